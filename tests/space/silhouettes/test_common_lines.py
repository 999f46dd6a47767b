import itertools

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from firstorder.space import (
    Receiver,
    Scene,
    boundary_gradient,
    irradiance,
    net_visibility,
    plane,
    primitive,
    rectangle,
    sphere,
    vector_irradiance,
    visible_silhouettes,
)
from firstorder.space.silhouettes import _common_lines

X, Y, Z = np.eye(3)
SKY = 0.3


def wall_over_a_floor(*emission, ups=(1.0, 1.0)):
    """A wall a metre away that stands on a floor; normals towards the room, or turned away."""
    planes = plane(X, -ups[0] * X), plane(0 * X, ups[1] * Z)
    things = zip(planes, emission, strict=True)
    return Scene.of(*(primitive(p, emission=L, two_sided=True) for p, L in things))


def lit_from_the_wall(height, distance):
    """Of unit radiance on a receiver that faces it: half of pi, and what the floor leaves below."""
    return 0.5 * np.pi * (1.0 + height / np.hypot(height, distance))


@pytest.mark.parametrize("ups", list(itertools.product((1.0, -1.0), repeat=2)))
@pytest.mark.parametrize("height", [1e-6, 0.5, 3.0, 1e6])
def test_light_of_a_wall_ends_at_the_floor(height, ups):
    at = Receiver.at(height * Z, X)
    true = lit_from_the_wall(height, 1.0)
    np.testing.assert_allclose(
        irradiance(wall_over_a_floor(1.0, 0.0, ups=ups), at), true, rtol=1e-14
    )
    rest = irradiance(wall_over_a_floor(0.0, 1.0, ups=ups), at)
    np.testing.assert_allclose(rest, np.pi - true, rtol=0.0, atol=1e-15)
    np.testing.assert_allclose(
        irradiance(wall_over_a_floor(1.0, 1.0, ups=ups), at), np.pi, rtol=1e-14
    )


def test_a_rectangle_in_the_place_of_the_floor_ends_at_the_wall():
    short = rectangle(-8.0 * X, 9.0 * X, 1e3 * Y)
    scene = Scene.of(primitive(plane(X, -X), emission=1.0), primitive(short))
    found = irradiance(scene, Receiver.at(0.5 * Z, X))
    np.testing.assert_allclose(found, lit_from_the_wall(0.5, 1.0), rtol=1e-5)


# --- planes at random ----------------------------------------------------------------------------


def drawn(seed, count=3):
    """Numbers of some planes and a receiver."""
    rng = np.random.default_rng(seed)
    places, normals = 1.5 * rng.normal(size=(count, 3)), rng.normal(size=(count, 3))
    return places, normals, rng.uniform(size=count), *rng.normal(size=(2, 3))


def planes(places, normals, light, *more):
    things = [
        primitive(plane(p, n), emission=L, two_sided=True)
        for p, n, L in zip(places, normals, light, strict=True)
    ]
    return Scene.of(*things, *more, environment=SKY)


def by_many_directions(places, normals, light, x, n, samples=700):
    """Irradiance by the midpoint rule over the disc below the hemisphere."""
    n = n / np.linalg.norm(n)
    along = np.cross(n, np.roll(n, 1) + X)
    along /= np.linalg.norm(along)
    u, phi = (np.arange(samples) + 0.5) / samples, np.linspace(0.0, 2.0 * np.pi, 2 * samples + 1)
    r, phi = np.sqrt(u)[:, None, None], 0.5 * (phi[1:] + phi[:-1])[None, :, None]
    beside = np.cos(phi) * along + np.sin(phi) * np.cross(n, along)
    w = r * beside + np.sqrt(1.0 - r * r) * n
    with np.errstate(divide="ignore"):
        t = np.stack([(p - x) @ m / (w @ m) for p, m in zip(places, normals, strict=True)])
    t = np.where(t > 0.0, t, np.inf)
    shown = np.where(np.min(t, 0) < np.inf, light[np.argmin(t, 0)], SKY)
    return np.pi * np.mean(shown)


@jax.jit
def lit(places, normals, light, x, n):
    return irradiance(planes(places, normals, light), Receiver.at(x, n))


@pytest.mark.parametrize("seed", range(6))
def test_light_of_three_planes_is_that_of_many_directions(seed):
    numbers = drawn(seed)
    np.testing.assert_allclose(lit(*numbers), by_many_directions(*numbers), rtol=0.0, atol=5e-5)


@jax.jit
def in_all_ways(places, normals, light, x, n):
    """Gradient and Hessian in the place by autodiff, and the gradient by edges that move."""

    def at(x):
        return Receiver.at(x, n)

    scene = planes(places, normals, light)

    def E(x):
        return irradiance(scene, at(x))

    moved = at(x).axes @ boundary_gradient(scene, at(x))
    return jax.grad(E)(x), jax.hessian(E)(x), moved, vector_irradiance(scene, at(x)), E(x)


@pytest.mark.parametrize("seed", range(6))
def test_derivatives_are_those_of_differences_and_of_moving_edges(seed):
    numbers = drawn(seed)
    gradient, hessian, moved, vector, E = in_all_ways(*numbers)
    np.testing.assert_allclose(moved, gradient, rtol=0.0, atol=1e-12)
    np.testing.assert_allclose(vector[2], E, rtol=1e-13)
    h = 1e-5
    places, normals, light, x, n = numbers
    sides = [
        [in_all_ways(places, normals, light, x + s * h * e, n) for s in (1, -1)] for e in (X, Y, Z)
    ]
    first = [(up[4] - down[4]) / (2.0 * h) for up, down in sides]
    second = [(up[0] - down[0]) / (2.0 * h) for up, down in sides]
    np.testing.assert_allclose(gradient, first, rtol=0.0, atol=1e-8)
    np.testing.assert_allclose(hessian, second, rtol=0.0, atol=1e-7)


def test_the_derivative_in_the_planes_is_that_of_differences():
    *scene, x, n = drawn(7)
    step = np.random.default_rng(8)
    ways = [step.normal(size=np.shape(a)) for a in scene]
    rate = jax.jvp(lambda *s: lit(*s, x, n), scene, ways)[1]
    h = 1e-5
    up, down = ([a + s * h * d for a, d in zip(scene, ways, strict=True)] for s in (1, -1))
    np.testing.assert_allclose(rate, (lit(*up, x, n) - lit(*down, x, n)) / (2.0 * h), rtol=1e-7)


# --- near and far --------------------------------------------------------------------------------


@pytest.mark.parametrize("precision", ["float64", "float32"])
@pytest.mark.parametrize("unit", [1.0, 1e-12, 1e12])
def test_planes_that_are_all_but_parallel_meet_far_away(precision, unit):
    """The upper one of two ceilings is seen below the line, near the horizon."""
    with jax.enable_x64(precision == "float64"):

        @jax.jit
        def beyond(angle):
            lower = plane(unit * jnp.stack([0.0 * angle, 0.0 * angle, 1.0 + 0.0 * angle]), -Z)
            tilt = jnp.stack([jnp.sin(angle), 0.0 * angle, -jnp.cos(angle)])
            upper = plane(1.5 * unit * jnp.asarray(Z, angle.dtype), tilt)
            scene = Scene.of(
                primitive(lower, emission=1.0, two_sided=True),
                primitive(upper, emission=0.0, two_sided=True),
            )
            E = irradiance(
                scene, Receiver.at(jnp.zeros(3, angle.dtype), jnp.asarray(Z, angle.dtype))
            )
            return np.pi - E

        eps = float(jnp.finfo(precision).eps)
        for angle in (0.1, 1e-2, 1e-4, 1e-8, 1e-12, 1e-16, 0.0):
            # It is half a metre lower where it meets the other one: a lune of slope 2 tan(angle).
            share = 0.5 * np.pi * (1.0 - 1.0 / np.hypot(1.0, 2.0 * np.tan(angle)))
            found = float(beyond(jnp.asarray(angle, precision)))
            assert found == pytest.approx(share, abs=8.0 * eps), angle


def test_a_receiver_on_one_of_two_planes_sees_the_other_alone():
    scene = wall_over_a_floor(1.0, 0.0)
    for at in (Receiver.at(0.0 * Z, Z), Receiver.at(0.0 * Z, Z, on=1)):
        np.testing.assert_allclose(irradiance(scene, at), 0.5 * np.pi, rtol=1e-14)
        assert np.all(np.isfinite(boundary_gradient(scene, at)))


# --- which lines there are -----------------------------------------------------------------------


def test_a_ball_hides_a_part_of_the_line():
    """It floats before the nearest point of the line."""
    ball = primitive(sphere(0.5 * X + 0.25 * Z, 0.2))
    numbers = [np.stack(a) for a in ((X, 0 * X), (-X, Z))]
    scene = planes(*numbers, (1.0, 0.2), ball)
    seen = visible_silhouettes(scene, Receiver.at(0.5 * Z, X))
    last = len(seen.rims.seen) - seen.common
    long = np.asarray(seen.arcs.last - seen.arcs.first)[last:]
    shown = np.asarray(seen.rims.seen)[last:]
    assert set(np.asarray(seen.rims.behind)[last:][shown]) == {2}
    p, _, w = seen.on_arcs(8)
    p, w = np.asarray(p)[last:][shown], np.asarray(w)[last:][shown]
    np.testing.assert_allclose(p[..., 2], 1.0, rtol=1e-12)  # in the receiver's frame
    assert np.sum(w) == pytest.approx(np.sum(long[shown]), rel=1e-12)
    hidden = 2.0 * np.arcsin(0.2 / np.hypot(0.5, 0.25))
    assert np.sum(w) == pytest.approx(np.pi - hidden, rel=1e-12)


def test_planes_that_are_dark_and_the_sky_need_no_line():
    scene = wall_over_a_floor(0.0, 0.0)
    np.testing.assert_allclose(net_visibility(scene, Receiver.at(0.5 * Z, Z)), np.pi, rtol=1e-14)


def test_every_pair_of_planes_has_a_line():
    things = [plane(0 * X, Z), sphere(X, 0.5), plane(2 * X, X), plane(2 * Y, Y)]
    scene = Scene.of(*map(primitive, things))
    assert len(_common_lines.pairs_of_planes(scene)) == 3
    assert visible_silhouettes(scene, Receiver.at(Z)).common > 0


@pytest.mark.parametrize("fault", ["none", "the other side", "behind"])
def test_with_a_wrong_line_the_edges_of_light_do_not_close(fault, monkeypatch):
    right = _common_lines._half_circles

    def wrong(*args):
        arcs, meet = right(*args)
        if fault == "none":
            return arcs, jnp.zeros_like(meet)
        turned = 2 if fault == "the other side" else 1  # the direction, or the nearest point
        return arcs.at[:, turned].multiply(-1.0), meet

    monkeypatch.setattr(_common_lines, "_half_circles", wrong)
    assert np.isnan(irradiance(wall_over_a_floor(1.0, 0.0), Receiver.at(0.5 * Z, X)))
