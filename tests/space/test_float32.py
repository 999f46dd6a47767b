"""Irradiance in single precision: it stays single, and mistakes few silhouettes."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from firstorder.numerics._compiled import own_programs
from firstorder.space import (
    Receiver,
    Scene,
    box,
    cylinder,
    disc,
    ellipsoid,
    irradiance,
    primitive,
    receiver,
    rectangle,
    sphere,
)
from firstorder.space.silhouettes import visible
from tests.first_calls import lamp_ball_box
from tests.precision import as_dtype

RECEIVERS = 8192


def lit(dtype):
    """Irradiance under a lamp, a ball and a box, in some precision."""
    scene, at = (as_dtype(a, dtype) for a in (lamp_ball_box(), Receiver.at((0.1, 0.2, 0.0))))
    steps = np.random.default_rng(0).uniform(-0.5, 0.5, (RECEIVERS, 2))
    found = jax.jit(jax.vmap(lambda step: irradiance(scene, at.moved(step))))
    return np.asarray(found(jnp.asarray(steps, dtype)), float)


def share_that_is_off():
    """Of receivers whose irradiance is off by a hundred-thousandth of the largest."""
    double, single = lit(jnp.float64), lit(jnp.float32)
    return np.mean(abs(single - double) > 1e-5 * double.max())


def test_few_receivers_mistake_what_lies_beside_a_silhouette():
    assert share_that_is_off() < 2e-4


def test_a_ray_farther_from_the_silhouette_mistakes_more(monkeypatch):
    def farther(distance, eps):
        return eps**0.5 * jnp.maximum(distance, 1.0)

    monkeypatch.setattr(visible, "_epsilon", farther)
    with own_programs():
        assert share_that_is_off() > 4e-4


def test_a_ball_a_millionth_as_large_as_far_has_a_gradient():
    def light(radius):
        lamp = rectangle((0.0, 0.0, 2.0), (0.0, 0.5, 0.0), (0.5, 0.0, 0.0))
        scene = Scene.of(primitive(lamp, emission=1.0), primitive(sphere((0.0, 0.0, 1.0), radius)))
        scene, at = (as_dtype(a, radius.dtype) for a in (scene, receiver((0.1, 0.0, 0.0))))
        return irradiance(scene, at)

    for radius in (1e-3, 1e-4, 1e-6, 1e-9, 1e-12):
        slope = jax.grad(light)(jnp.asarray(radius, jnp.float32))
        # It hides L pi r^2 cos(theta) / d^2 of the lamp; one that is smaller than a ray's distance
        # from the silhouette is not seen.
        wanted = -2.0 * np.pi * radius / 1.01**1.5
        np.testing.assert_allclose(slope, wanted if radius > 1e-5 else 0.0, rtol=1e-6)


SHAPES = {
    "rectangle": lambda: rectangle((0.1, 0.0, 1.0), (0.3, 0.0, 0.0), (0.0, 0.3, 0.1)),
    "sphere": lambda: sphere((0.1, 0.0, 1.0), 0.3),
    "box": lambda: box((0.1, 0.0, 0.5), (0.4, 0.3, 1.0)),
    "disc": lambda: disc((0.1, 0.0, 1.0), (0.1, 0.0, -1.0), 0.3),
    "ellipsoid": lambda: ellipsoid((0.1, 0.0, 1.0), np.diag([0.2, 0.1, 0.3])),
    "cylinder": lambda: cylinder((0.1, 0.0, 0.8), (0.2, 0.0, 1.0), 0.2),
}


@pytest.mark.parametrize("shape", SHAPES)
def test_what_is_made_of_single_precision_is_single(shape):
    scene = Scene.of(primitive(SHAPES[shape](), emission=1.0, two_sided=True), environment=0.5)
    scene, at = (as_dtype(a, jnp.float32) for a in (scene, receiver((0.0, 0.1, 0.0))))
    assert jnp.asarray(1.0).dtype == jnp.float64
    value, gradient = jax.value_and_grad(lambda x: irradiance(scene, at.moved(x)))(
        jnp.zeros(2, jnp.float32)
    )
    for found in (value, gradient):
        assert found.dtype == jnp.float32
        assert np.all(np.isfinite(found))
