import dataclasses
import functools

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from derivations.space import _lights as lights
from firstorder.checks.statistics import z_test
from firstorder.checks.tolerance import fitted_order, normwise
from firstorder.scene._derivatives import SPACE, Derivatives
from firstorder.scene._geometry_term import linear_jet
from firstorder.space import Scene, derivatives, irradiance, primitive, receiver, rectangle
from firstorder.space.estimators._irradiance_forms import (
    Samples,
    TracedRays,
    gather_samples,
    stratified_estimate,
    surface_area_estimate,
    trace_strata,
)
from firstorder.space.estimators.strata import Strata, hemisphere_strata
from firstorder.space.library import j12_box
from firstorder.space.receiver import Receiver
from tests.space import worlds

SIZES = (8, 16, 32, 64)  # rows; four times as many columns


@jax.jit
def forms(samples):
    return {"area": surface_area_estimate(samples), "strata": stratified_estimate(samples)}


def on_device(tree):
    return jax.tree.map(jnp.asarray, tree)


@functools.cache
def found(rows, hidden):
    return forms(on_device(lights.jittered(rows, hidden)))


# What is compared: (values, truth), by steps (0-2) and tilts (3-4).
PARTS = {
    "value": lambda v, g, H: v,
    "gradient": lambda v, g, H: g,
    "two steps": lambda v, g, H: H[..., :3, :3],
    "tangents": lambda v, g, H: H[..., :2, :2],
    "step and tilt": lambda v, g, H: H[..., :3, 3:],
    "two tilts": lambda v, g, H: H[..., 3:, 3:],
}


def error(ours, hidden, part):
    """Root mean square over sets of directions, relative to the truth."""
    true = np.asarray(PARTS[part](*lights.motion(hidden)))
    off = np.asarray(PARTS[part](ours.value, ours.gradient, ours.hessian)) - true
    return np.sqrt(np.mean(np.sum(off.reshape(off.shape[0], -1) ** 2, 1))) / np.linalg.norm(true)


def errors(form, hidden, part):
    return np.array([error(found(n, hidden)[form], hidden, part) for n in SIZES])


# --- the truth ----------------------------------------------------------------------------------


@pytest.mark.parametrize("part", PARTS)
def test_without_shadow_edges_the_surface_area_form_is_free_of_bias(part):
    e = errors("area", False, part)
    assert fitted_order(4 * np.square(SIZES), e) < -0.5
    assert e[-1] < 1e-2


@pytest.mark.parametrize("part", ["value", "gradient", "step and tilt", "two tilts"])
@pytest.mark.parametrize("hidden", [False, True])
def test_the_stratified_form_tends_to_the_truth_shadow_edges_included(part, hidden):
    e = errors("strata", hidden, part)
    assert fitted_order(4 * np.square(SIZES), e) < -0.35
    assert e[-1] < 3e-2


def test_in_a_penumbra_the_surface_area_form_keeps_the_edges_where_they_are():
    assert errors("area", True, "gradient")[-1] > 0.2
    assert errors("area", True, "tangents")[-1] > 0.5
    for part in ("value", "two tilts"):
        assert errors("area", True, part)[-1] < 1e-2


def test_any_strata():
    """Uneven rows and columns that start anywhere, of a quarter of the rays."""
    rng = np.random.default_rng(3)
    theta = np.sort(np.concatenate([[0.0, 0.5 * np.pi], rng.uniform(0.0, 0.5 * np.pi, 63)]))
    phi = 0.3 + np.sort(np.concatenate([[0.0, 2 * np.pi], rng.uniform(0.0, 2 * np.pi, 255)]))
    ours = forms(on_device(lights.jittered(64, True, borders=(theta, phi))))["strata"]
    for part in ("value", "gradient", "step and tilt", "two tilts"):
        assert error(ours, True, part) < 6e-2


# --- identities ---------------------------------------------------------------------------------


def test_moments_are_the_sum_of_the_couplings_jets():
    seen = on_device(lights.jittered(8, True))
    seen = jax.tree.map(lambda a: a[0] if a.ndim > 2 else a, seen)
    b, u = seen.cosine, seen.strata.directions
    met = np.isfinite(seen.distance)
    r = jnp.where(met, seen.distance, 1.0)
    share = np.where(met, seen.strata.weights * seen.radiance * r**2 / b, 0.0)
    ours = jax.tree.map(lambda a: a[0], found(8, True)["area"])
    for k, axis in enumerate(np.eye(3)):
        jet = linear_jet(r, u, jnp.asarray(axis), seen.normal, u[..., k], b)
        gradient = np.einsum("mn,mni->i", share, jet.gradient)
        if k < 2:
            assert normwise(ours.hessian[:3, 3 + k], gradient) < 1e-11
        else:
            assert normwise(ours.gradient[:3], gradient) < 1e-11
            assert normwise(ours.hessian[:3, :3], np.einsum("mn,mnij->ij", share, jet.hessian)) < (
                1e-11
            )


def turned(seen, angle, scale):
    """The same cells and scene turned about the normal and enlarged."""
    R = np.array([[np.cos(angle), -np.sin(angle), 0], [np.sin(angle), np.cos(angle), 0], [0, 0, 1]])
    seen = eqx.tree_at(lambda s: s.strata.phi, seen, seen.strata.phi + angle)
    where = (lambda s: s.strata.directions, lambda s: s.normal)
    for get in where:
        seen = eqx.tree_at(get, seen, get(seen) @ R.T)
    return eqx.tree_at(lambda s: s.distance, seen, scale * seen.distance), R


@pytest.mark.parametrize(("angle", "scale"), [(0.5 * np.pi, 1.0), (-2.3, 1.0), (0.7, 40.0)])
def test_turned_and_enlarged(angle, scale):
    seen, R = turned(lights.jittered(16, True), angle, scale)
    T = np.block([[R / scale, np.zeros((3, 2))], [np.zeros((2, 3)), R[:2, :2]]])
    for form, there in forms(on_device(seen)).items():
        here = found(16, True)[form]
        assert normwise(there.gradient, here.gradient @ T.T) < 1e-11
        assert normwise(there.hessian, T @ here.hessian @ T.T) < 1e-10


def test_an_even_sky_changes_by_no_motion():
    """E = pi, and no derivative; the surface-area form misses the light at the horizon."""
    seen = lights.jittered(16, False)
    seen = eqx.tree_at(lambda s: s.radiance, seen, np.ones_like(seen.radiance))
    seen = eqx.tree_at(lambda s: s.distance, seen, np.full_like(seen.distance, np.inf))
    both = forms(on_device(seen))
    np.testing.assert_allclose(both["strata"].value, np.pi, rtol=1e-13)
    np.testing.assert_allclose(both["strata"].gradient, 0.0, rtol=0.0, atol=1e-13)
    np.testing.assert_allclose(both["strata"].hessian, 0.0, rtol=0.0, atol=1e-13)
    np.testing.assert_allclose(
        both["area"].hessian[:, 3:, 3:],
        np.broadcast_to(-np.pi * np.eye(2), (8, 2, 2)),
        rtol=0.0,
        atol=1e-12,
    )


def test_travel_over_a_curved_surface_by_the_chain_rule():
    """A quadratic function of the five freedoms, followed along a surface."""
    rng = np.random.default_rng(2)
    g, H = rng.normal(size=5), rng.normal(size=(5, 5))
    H, S = H + H.T, rng.normal(size=(2, 2))
    S, C = S + S.T, rng.normal(size=(2, 2, 2))
    C = sum(np.transpose(C, p) for p in ((0, 1, 2), (1, 2, 0), (2, 0, 1), (0, 2, 1), (2, 1, 0),
                                         (1, 0, 2)))  # fmt: skip

    def f(d):
        tilt = -S @ d - 0.5 * jnp.einsum("ijk,j,k->i", C, d, d)
        q = jnp.concatenate([d, 0.5 * (d @ S @ d)[None], tilt])
        return g @ q + 0.5 * q @ H @ q

    read = Derivatives(*map(jnp.asarray, (1.0, g, H)), SPACE).along(S, C)
    first, second = jax.jit(lambda d: (jax.grad(f)(d), jax.hessian(f)(d)))(jnp.zeros(2))
    assert normwise(read.gradient, first) < 1e-13
    assert normwise(read.hessian, second) < 1e-13


# --- rays ---------------------------------------------------------------------------------------


def test_gather_sees_what_is_there():
    """Two receivers with frames of their own over a slope z = 1 + x / 2, under a sky."""
    slope = np.array([-0.5, 0.0, 1.0]) / np.sqrt(1.25)

    def trace(origins, along, on):
        t = (1.0 + 0.5 * origins[:, 0] - origins[:, 2]) / (along[:, 2] - 0.5 * along[:, 0])
        met = (t > 0.0) & (on == 5)
        normal = jnp.broadcast_to(jnp.asarray(slope), along.shape)  # the far side's
        return TracedRays(jnp.where(met, t, jnp.nan), jnp.where(met, 3, -1), normal)

    turn = np.array([[0.6, -0.8, 0.0], [0.8, 0.6, 0.0], [0.0, 0.0, 1.0]])
    at = Receiver(
        jnp.array([[0.0, 0.0, 0.0], [1.0, 2.0, 0.0]]),
        jnp.asarray([np.eye(3), turn]),
        jnp.zeros((2, 2, 2)),
        jnp.array([5, 5]),
    )
    where = hemisphere_strata(4, 8, jax.random.key(1), shape=(2,))
    seen = gather_samples(trace, lambda i, p, n, d: i + p[:, 0], at, where, lambda d: 7.0 + d[:, 1])
    for k in range(2):
        world = np.asarray(where.directions[k]) @ np.asarray(at.axes[k]).T
        x, met = np.asarray(at.position[k]), np.asarray(seen.index[k]) == 3
        hit = x + np.where(met, seen.distance[k], 0.0)[..., None] * world
        np.testing.assert_allclose(
            (hit[..., 2] - 1.0 - 0.5 * hit[..., 0])[met], 0.0, rtol=0.0, atol=1e-12
        )
        np.testing.assert_allclose(
            seen.radiance[k], np.where(met, 3 + hit[..., 0], 7.0 + world[..., 1]), rtol=1e-12
        )
        normal = np.asarray(seen.normal[k]) @ np.asarray(at.axes[k]).T
        np.testing.assert_allclose((normal + slope)[met], 0.0, rtol=0.0, atol=1e-14)
        np.testing.assert_allclose(seen.cosine[k], -np.sum(normal * world, -1))
        assert np.all(np.isinf(seen.distance[k][~met]))
        assert np.all(seen.cosine[k] > 0.0)
    assert 0 < np.sum(seen.index < 0) < seen.index.size


@pytest.mark.smoke
@pytest.mark.parametrize("size", [(1, 1), (4, 8)])
def test_single_precision_and_a_single_cell(size):
    """Finite, in the precision of the samples, for a grazing hit and for misses too."""
    where = hemisphere_strata(*size)
    single = functools.partial(jnp.asarray, dtype=jnp.float32)
    where = Strata(*map(single, (where.theta, where.phi, where.directions, where.weights)))
    w = where.directions
    L = single(np.random.default_rng(0).uniform(size=size))
    distance = jnp.where(L > 0.5, single(jnp.inf), 1.0 + L)
    seen = Samples(where, L, distance, -w, jnp.zeros_like(L), jnp.zeros(size, int))
    for leaf in jax.tree.leaves(forms(seen)):
        assert leaf.dtype == jnp.float32
        assert np.all(np.isfinite(leaf))


# --- deliberate faults --------------------------------------------------------------------------

FAULTS = {
    "the farther sample moves the wall": lambda s: eqx.tree_at(
        lambda s: s.distance, s, np.maximum(s.distance, np.roll(s.distance, 4, -1))
    ),
    "the wrong side of the wall": lambda s: eqx.tree_at(lambda s: s.radiance, s, -s.radiance),
    "azimuths the other way": lambda s: eqx.tree_at(lambda s: s.strata.phi, s, -s.strata.phi),
    "the fall-off of area": lambda s: eqx.tree_at(lambda s: s.distance, s, s.distance**2),
    "rows for columns": lambda s: eqx.tree_at(lambda s: s.radiance, s, np.roll(s.radiance, 8, -2)),
}


@pytest.mark.parametrize("fault", FAULTS)
def test_faults_of_the_stratified_form_are_noticed(fault):
    assert error(found(64, True)["strata"], True, "gradient") < 3e-2
    wrong = forms(on_device(FAULTS[fault](lights.jittered(64, True))))["strata"]
    off = error(wrong, True, "gradient")
    assert np.isfinite(off)
    assert off > 0.1


AREA_FAULTS = {
    "the other side's normal": lambda s: eqx.tree_at(lambda s: s.normal, s, -s.normal),
    "cosine left out": lambda s: eqx.tree_at(lambda s: s.cosine, s, np.ones_like(s.cosine)),
    "weights of another density": lambda s: eqx.tree_at(
        lambda s: s.strata.weights, s, s.strata.weights * s.strata.directions[..., 2]
    ),
}


@pytest.mark.parametrize("fault", AREA_FAULTS)
def test_faults_of_the_surface_area_form_are_noticed(fault):
    """By three steps: over a level light the tangents' block knows nothing of the light's tilt."""
    wrong = forms(on_device(AREA_FAULTS[fault](lights.jittered(64, False))))["area"]
    assert error(found(64, False)["area"], False, "gradient") < 1e-2
    assert error(wrong, False, "gradient") > 3e-2


# --- properties: the same directions in the receiver's frame ----------------------------------


@jax.jit
def _both_forms(change, x, y):
    """Both forms over one ray in each of 6 x 24 cells, in a scene that may change."""
    where = hemisphere_strata(6, 24, jax.random.key(5))
    samples = trace_strata(worlds.lit(change), worlds.below(change, x, y), where=where)
    found = surface_area_estimate(samples), stratified_estimate(samples)
    return tuple(jnp.stack(parts) for parts in zip(*map(jets_of, found), strict=True))


def jets_of(d):
    return d.value, d.gradient, d.hessian


def forms_at(place, **change):
    found = _both_forms(worlds.Change(**change).arrays, *map(float, place))
    return [np.asarray(a) for a in found]


def assert_alike(ours, expected):
    """To rounding, by the largest entry of each: value, gradient and Hessian of both forms."""
    for a, b in zip(ours, expected, strict=True):
        assert np.all(np.isfinite(b))
        np.testing.assert_allclose(a, b, rtol=0.0, atol=1e-10 * (1.0 + np.abs(b).max()))


GROUND = st.tuples(worlds.PLACE, worlds.PLACE)


@given(GROUND, worlds.TURN, worlds.SHIFT)
def test_rigid_motion_of_scene_and_receiver_changes_no_form(place, turn, shift):
    assert_alike(forms_at(place, turn=turn, shift=shift), forms_at(place))


@given(GROUND, worlds.SIZE)
def test_forms_scale_with_the_unit_of_length(place, scale):
    value, gradient, hessian = forms_at(place, scale=scale)
    first, second = (np.asarray(worlds.as_measured(scale, order)) for order in (1, 2))
    assert_alike((value, gradient / first, hessian / second), forms_at(place))


@given(GROUND, st.tuples(*[worlds.BRIGHT] * worlds.LIGHTS))
def test_forms_add_lights(place, light):
    alone = [forms_at(place, light=one) for one in np.eye(worlds.LIGHTS)]
    parts = zip(*alone, strict=True)
    expected = [sum(L * a for L, a in zip(light, each, strict=True)) for each in parts]
    assert_alike(forms_at(place, light=light), expected)


@given(GROUND, worlds.SHARE, worlds.SHARE)
def test_forms_do_not_see_in_how_many_pieces_a_shape_is(place, lamp, screen):
    assert_alike(forms_at(place, lamp=lamp, screen=screen), forms_at(place))


# --- z on every derivative ----------------------------------------------------------------------

SETS, ROWS, COLUMNS = 2048, 3, 12
LAMP = rectangle((0.2, -0.1, 1.2), (0.05, 0.45, 0.1), (0.5, -0.05, 0.15))
AT = (0.1, 0.15, 0.0)
RISE = {"even": 0.0, "varied": 1.0}  # of the logarithm of the lamp's radiance [1/m]


def brightness(rise, y):
    return jnp.exp(rise * (y[..., 0] - y[..., 1]))


def truth(name):
    """E and its derivatives: of an even lamp in closed form, of any by a product rule over it."""
    at = receiver(AT)
    if name == "even":
        scene = Scene.of(primitive(LAMP, emission=1.0, two_sided=True))
        return derivatives(irradiance, scene, at)
    t, w = np.polynomial.legendre.leggauss(24)
    s = np.stack(np.meshgrid(t, t, [0.0], indexing="ij"), -1).reshape(-1, 3)
    axes = np.asarray(LAMP.axes[0])
    y, normal = s @ axes.T + np.asarray(LAMP.center[0]), np.cross(axes[:, 0], axes[:, 1])
    weights = np.outer(w, w).ravel() * brightness(RISE[name], y)

    def E(at):
        way = y - at.position
        up, facing = way @ at.normal, jnp.abs(way @ normal)
        return jnp.sum(weights * up * facing / jnp.sum(way**2, -1) ** 2)

    return derivatives(E, at)


@jax.jit
def _gathered(key, rise):
    where = hemisphere_strata(ROWS, COLUMNS, key, shape=(SETS,))
    at = receiver(jnp.broadcast_to(jnp.array(AT), (SETS, 3)))
    scene = Scene.of(primitive(LAMP, emission=1.0, two_sided=True))
    return trace_strata(scene, at, where=where, radiance=lambda i, p, n, d: brightness(rise, p))


@functools.cache
def gathered(name):
    """Many independent sets of a few rays each."""
    return _gathered(jax.random.key(9), RISE[name])


def every_derivative(d):
    """Value, five first and fifteen second derivatives, last axis."""
    i, j = np.triu_indices(5)
    parts = d.value[..., None], d.gradient, d.hessian[..., i, j]
    return np.concatenate([np.asarray(a) for a in parts], -1)


def against_the_truth(name, samples):
    """One test of 21 means, corrected for their number."""
    seen = every_derivative(surface_area_estimate(samples))
    error = seen.std(0, ddof=1) / np.sqrt(SETS)
    return z_test(seen.mean(0), error, every_derivative(truth(name)), truth_error=1e-12)


@pytest.mark.parametrize("name", RISE)
def test_gathered_gradients_and_hessians_are_free_of_bias(name):
    assert against_the_truth(name, gathered(name)).passed


BIASES = {
    "light a little too bright": lambda s: dataclasses.replace(s, radiance=1.05 * s.radiance),
    "distances a little too long": lambda s: dataclasses.replace(s, distance=1.05 * s.distance),
    "cosines that are forgotten": lambda s: dataclasses.replace(s, cosine=1.0 + 0.0 * s.cosine),
    "normals that look the other way": lambda s: dataclasses.replace(s, normal=-s.normal),
}


@pytest.mark.parametrize("name", BIASES)
def test_a_bias_of_gathered_derivatives_is_noticed(name):
    assert not against_the_truth("even", BIASES[name](gathered("even"))).passed


def test_cells_go_with_the_receivers():
    cells = hemisphere_strata(2, 4, jax.random.key(0), shape=(2,))
    with pytest.raises(ValueError, match=r"`where` must have no leading axes or those of the rec"):
        trace_strata(j12_box(), receiver(np.full((3, 3), 0.5)), where=cells)


@pytest.mark.smoke
def test_what_is_no_light_no_cells_and_no_samples_is_one_sentence():
    scene = Scene.of(primitive(rectangle((0, 0, 1), (0, 0.5, 0), (0.5, 0, 0)), emission=1.0))
    at, cells = receiver((0.0, 0.0, 0.0)), hemisphere_strata(2, 4)
    for ask, words in (
        (lambda: trace_strata(scene, at, where=(2, 4)), "`where` must be cells of `hemisphere_st"),
        (lambda: trace_strata(scene, at, where=cells, radiance=1.0), "`radiance` must be a functi"),
        (lambda: stratified_estimate(cells), "`samples` must be samples of `trace_strata`, but"),
        (lambda: surface_area_estimate(cells), "`samples` must be samples of `trace_strata`, but"),
    ):
        with pytest.raises(TypeError, match=f"^Argument {words}|violates type hint"):
            ask()
