"""The hemicircle: its cuts and what is between them, against angles, rays and higher precision."""

import itertools

import jax
import jax.numpy as jnp
import mpmath
import numpy as np
import pytest

from firstorder.flatland import (
    Circles,
    Receiver,
    Scene,
    Segments,
    _hemicircle,
    irradiance,
    local_angle,
    primitive,
)
from firstorder.flatland._hemicircle import cuts_of, seen_between
from firstorder.flatland.shapes._crossings import find_crossings
from tests.flatland.worlds import everything


@pytest.fixture
def scene():
    """A lamp above two discs, of which one is below the horizon of a receiver at the origin."""
    return Scene.of(
        primitive(Segments((1.0, 2.0), (-1.0, 2.0)), emission=(2.0, 3.0)),
        primitive(Circles(np.array([[0.2, 1.0], [0.5, -1.0]]), np.array([0.3, 0.2]))),
    )


def test_cuts_are_the_angles_of_silhouettes_and_those_below_the_horizon_are_its_ends():
    scene, at = everything(), Receiver((0.1, -0.2), 0.3)
    cuts = cuts_of(scene, at)
    points, valid = scene.silhouettes(at.position, at.on)
    truth = jax.vmap(lambda p: local_angle(at, p))(points[valid])
    assert np.allclose(np.arctan2(cuts.sine, cuts.cosine)[valid], truth, rtol=0.0, atol=1e-14)
    assert np.all(np.asarray(cuts.cosine)[valid][np.abs(truth) == 0.5 * np.pi] == 0.0)
    assert np.allclose(cuts.far[valid], np.sum((points[valid] - at.position) ** 2, -1))
    assert np.all(np.isinf(cuts.far[~valid]))


def test_the_sides_that_are_seen_are_told(scene):
    for x, y, side in ((0.0, 0.0, True), (0.0, 3.0, False)):
        at = Receiver((x, y), 0.0 if side else np.pi)
        seen = seen_between(scene, at, cuts_of(scene, at), sides=True)
        assert seen.front is not None
        assert set(seen.front[seen.shape == 0].tolist()) == {side}
    assert seen_between(scene, at, cuts_of(scene, at)).front is None


def test_what_is_seen_does_not_depend_on_blocks(scene, monkeypatch):
    x = jnp.linspace(-1.0, 1.0, 37)

    def seen():
        def one(x):
            at = Receiver(jnp.stack([x, 0.0 * x]), 0.1)
            return seen_between(scene, at, cuts_of(scene, at), sides=True)

        return jax.jit(jax.vmap(one))(x)

    whole = seen()
    monkeypatch.setattr(_hemicircle, "MANY", 1)
    monkeypatch.setattr(_hemicircle, "IN_CACHE", 64)
    for one, other in zip(jax.tree.leaves(whole), jax.tree.leaves(seen()), strict=True):
        assert np.array_equal(one, other)


def test_a_lamp_near_the_horizon_keeps_the_digits_of_its_derivatives():
    # Seen at 1e-4 above the horizon: what the sines of its ends lose must not be lost again in E''.
    lamp = Segments((2.0, 2e-4), (1.0, 1e-4 * 1.5))
    scene = Scene.of(primitive(lamp, emission=1.0, two_sided=True))

    def E(x):
        return irradiance(scene, Receiver(jnp.stack([x, 0.0 * x]), 0.0))

    def exact(x):
        a, b = (mpmath.mpf(float(p[0, 0])) - x for p in (lamp.start, lamp.end))
        h, k = (mpmath.mpf(float(p[0, 1])) for p in (lamp.start, lamp.end))
        return abs(a / mpmath.sqrt(a * a + h * h) - b / mpmath.sqrt(b * b + k * k))

    with mpmath.workdps(40):
        slope, bend = (float(mpmath.diff(exact, 0.25, n)) for n in (1, 2))
    assert abs(jax.grad(E)(0.25) / slope - 1.0) < 1e-11
    assert abs(jax.grad(jax.grad(E))(0.25) / bend - 1.0) < 1e-11


@pytest.mark.parametrize("numbers", list(itertools.permutations(range(3))))
def test_of_three_edges_in_line_the_nearest_hides_the_others(numbers):
    # Whatever their numbers, which decide the order of cuts in one place.
    heights, lengths, lights = (1.0, 2.0, 3.0), (0.5, 1.3, 2.7), (3.0, 5.0, 7.0)
    none = find_crossings([Segments((0.0, 0.0), (1.0, 0.0))])

    @jax.jit
    def light(signs, x):
        shapes = [
            primitive(
                Segments((0.0, heights[k]), jnp.stack([signs[k] * lengths[k], heights[k]])),
                emission=lights[k],
                two_sided=True,
            )
            for k in numbers
        ]
        return irradiance(Scene.of(*shapes, crossings=none), Receiver(jnp.stack([x, 0.0 * x]), 0.0))

    d = 1e-6
    for signs in itertools.product((-1.0, 1.0), repeat=3):
        signs = jnp.array(signs)
        E, slope = jax.value_and_grad(light, 1)(signs, 0.0)
        sides = (E - light(signs, -d)) / d, (light(signs, d) - E) / d
        assert min(abs(slope - side) for side in sides) < 1e-4


def test_where_the_receiver_is_nowhere_derivatives_are_nan_too(scene):
    def E(x):
        return irradiance(scene, Receiver(jnp.stack([x, 0.0]), 0.0))

    for x in (jnp.nan, jnp.inf):
        value, slope = jax.jvp(E, (x,), (1.0,))
        assert jnp.isnan(value)
        assert jnp.isnan(slope)
        assert jnp.isnan(jax.grad(E)(x))


def test_no_receivers_among_many_cuts_are_none(scene):
    points = jnp.stack([jnp.linspace(-1.0, 1.0, 60), jnp.ones(60)], -1)

    def E(p):
        return irradiance(scene, Receiver(p, 0.0), cuts=points)

    assert jax.vmap(E)(jnp.zeros((0, 2))).shape == (0,)


@pytest.mark.parametrize("count", [24, 40])
def test_each_band_of_many_shapes_is_as_alone(count):
    # By rays, and by depth; both in blocks.
    x, lights = np.linspace(-1.0, 1.0, count), np.array([1.0, 3.0, 2.0])
    row = Circles(np.stack([x, 0.0 * x + 1.0], -1), np.full(count, 0.01))
    lamp = Segments((0.6, 2.0), (-0.6, 2.0))
    scene = Scene.of(primitive(lamp, emission=lights), primitive(row, emission=lights[::-1] / 2.0))
    at = jnp.stack([jnp.linspace(-0.5, 0.5, 7), jnp.zeros(7)], -1)

    def both(scene):
        def E(p):
            return irradiance(scene, Receiver(p, 0.0))

        return jax.vmap(E)(at), jax.vmap(jax.jacfwd(E))(at)

    together = both(scene)
    for band in range(3):
        for one, alone in zip(together, both(scene.band(band)), strict=True):
            assert np.allclose(one[:, band], alone, rtol=1e-13, atol=1e-13)


def test_an_edge_in_the_horizon_is_the_horizons_however_the_scene_is_turned():
    """A lamp on the floor: where its foot is raised, light is lost, and none is won below it.

    Both are second derivatives of one side; one of them is given, and not by rounding.
    """
    angles = np.random.default_rng(5).uniform(-np.pi, np.pi, 200)

    def light(angle, raised, apart):
        """From a lamp at a distance from the receiver, 0.7 times as high."""
        turn = jnp.array([[jnp.cos(angle), -jnp.sin(angle)], [jnp.sin(angle), jnp.cos(angle)]])
        corners = (0.3, 0.2), (0.3 + apart, 0.2), (0.3 + apart, 0.2 + 0.7 * apart)
        at, foot, top = (turn @ jnp.array(p) for p in corners)
        lamp = primitive(Segments(foot + raised * turn[:, 1], top), emission=1.0)
        return irradiance(Scene.of(lamp), Receiver(at, angle))

    E = jax.jit(jax.vmap(light, (0, None, None)))
    bend = jax.jit(jax.vmap(jax.hessian(light, 1), (0, None, None)))
    for apart in (1.0, 0.01):
        np.testing.assert_allclose(
            E(angles, 0.0, apart), 1.0 - 1.0 / np.hypot(1.0, 0.7), rtol=1e-12
        )
        np.testing.assert_allclose(bend(angles, 0.0, apart), 0.0, rtol=0.0, atol=1e-9)
    # (Clearly above the horizon it is lost.)
    np.testing.assert_allclose(bend(angles, 1e-9, 1.0), -1.0, rtol=1e-6)
