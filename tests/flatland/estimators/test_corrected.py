import jax
import jax.numpy as jnp
import numpy as np
import pytest

from firstorder.checks.tolerance import normwise
from firstorder.flatland import (
    Arcs,
    Circles,
    Receiver,
    Scene,
    Segments,
    derivatives,
    irradiance,
    primitive,
)
from firstorder.flatland.estimators import (
    corrected_estimate,
    hemicircle_strata,
    stratified_estimate,
    trace_strata,
)
from tests.flatland.estimators.test_irradiance_forms import MOST, errors, orders, sampled, truth
from tests.precision import as_dtype


def test_its_hessian_has_another_limit_than_the_truth():
    """The limit is the mended form without the two terms; what is missing is not small."""
    _, _, hessian = truth("disc")
    limit = sampled("disc", MOST, 1, sliding=False)["mended"].hessian
    assert normwise(limit, hessian) > 0.1
    assert np.max(np.abs((limit - hessian)[2])) < 1e-4  # turns are right
    gaps = [
        np.mean([normwise(sampled("disc", n, k)["stratified"].hessian, limit) for k in range(12)])
        for n in (128, 8192)
    ]
    assert gaps[1] < 0.35 * gaps[0]


def test_with_no_edge_looked_for_it_is_the_plain_form():
    """Before uniform lights, as then nothing jumps but at edges."""
    scene = Scene.of(
        primitive(Segments((0.5, 1.0), (-0.5, 1.0)), emission=1.0),
        primitive(Circles((-0.2, 0.5), 0.15), emission=0.3),
    )
    at = Receiver((0.25, 0.0), 0.2)
    samples = trace_strata(scene, at, where=hemicircle_strata(64))
    ours, plain = (
        corrected_estimate(scene, at, samples=samples, breaks=0),
        stratified_estimate(samples),
    )
    np.testing.assert_allclose(ours.gradient, plain.gradient, rtol=1e-12)
    np.testing.assert_allclose(ours.hessian, plain.hessian, rtol=1e-12)


def test_mended_it_tends_to_the_truth():
    found, last = orders("disc", "mended", (128, 1024, 8192))
    assert all(order < -1.2 for order in found)
    assert max(last) < 5e-5


def test_the_inside_of_an_open_ring_is_told_from_its_outside():
    """Beside an end of the ring a receiver sees both; before even lights all edges are exact."""
    ring = Arcs((0.0, 1.5), 0.5, 1.5 * np.pi, 1.5 * np.pi)
    scene = Scene.of(primitive(ring, emission=(1.0, 0.4)))
    at = Receiver((0.05, 0.0), 0.1)
    samples = trace_strata(scene, at, where=hemicircle_strata(64))
    ours = corrected_estimate(scene, at, samples=samples, breaks=4)
    true = derivatives(irradiance, scene, at)
    np.testing.assert_allclose(ours.gradient, true.gradient, rtol=0.0, atol=1e-6)
    np.testing.assert_allclose(ours.hessian, true.hessian, rtol=0.0, atol=1e-5)


def test_in_single_precision_the_contour_of_a_small_disc_is_one():
    """Ten radii away bisection stops where a ray meets the disc at a cosine of 0.02."""
    lamp = primitive(Segments((2.0, 3.0), (-2.0, 3.0)), emission=1.0)
    scene, at = Scene.of(lamp, primitive(Circles((0.1, 1.0), 0.1))), Receiver((0.0, 0.0), 0.1)

    def light(u):
        """Sines of the ends of the lamp less those of the disc."""
        here = at.displaced(u)
        way = jnp.array([[-2.0, 3.0], [2.0, 3.0], [0.1, 1.0]]) - here.position
        left, right, disc = jnp.arctan2(-way[:, 0], way[:, 1]) - here.n
        half = jnp.arcsin(0.1 / jnp.linalg.norm(way[2]))
        dark = jnp.sin(disc + half) - jnp.sin(disc - half)
        return jnp.sin(left) - jnp.sin(right) - dark

    gradient, hessian = jax.jit(lambda u: (jax.grad(light)(u), jax.hessian(light)(u)))(np.zeros(3))
    scene, single, strata = as_dtype((scene, at, hemicircle_strata(64)), np.float32)
    samples = trace_strata(scene, single, where=strata)
    ours = corrected_estimate(scene, single, samples=samples, breaks=4)
    np.testing.assert_allclose(ours.gradient, gradient, rtol=0.0, atol=1e-4)
    np.testing.assert_allclose(ours.hessian, hessian, rtol=0.0, atol=1e-3)


@pytest.mark.parametrize(
    "fault",
    [{"bend": 0.0}, {"bend": -1.0}, {"inverse": 1.05}, {"sliding": False}],
    ids=["no bend", "bend of the other sign", "another distance", "fixed edges"],
)
def test_faults_of_the_mended_form_are_noticed(fault):
    assert errors(sampled("disc", 2048, 5)["mended"], "disc")[2] < 2e-3
    error = errors(sampled("disc", 2048, 5, **fault)["mended"], "disc")[2]
    assert np.isfinite(error)
    assert error > 1e-2
