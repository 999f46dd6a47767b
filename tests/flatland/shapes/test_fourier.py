import jax
import jax.numpy as jnp
import numpy as np
import pytest

from firstorder.flatland import Receiver, Scene, closed_curve, irradiance, primitive
from firstorder.flatland.shapes._fourier import CurveRoots
from tests.flatland.worlds import bean


def as_circle(x, y, r):
    a = 2.0 * np.pi * np.arange(32) / 32
    return jax.tree.map(
        lambda c: c[0], closed_curve(np.stack([x + r * np.cos(a), y + r * np.sin(a)], -1), 2)
    )


OFF = jnp.array(False)


def test_a_circle_as_a_series_is_met_like_a_circle():
    d = jnp.array([0.6, 0.8])

    def t(x):
        return as_circle(1.0, 2.0, 0.7).hit(jnp.array([x, 0.1]), d, OFF)[0]

    def circle(x):
        w = jnp.array([x - 1.0, 0.1 - 2.0])
        b = w @ d
        return -b - jnp.sqrt(b**2 - w @ w + 0.49)

    for f, g in (
        (t, circle),
        (jax.grad(t), jax.grad(circle)),
        (jax.grad(jax.grad(t)), jax.grad(jax.grad(circle))),
    ):
        assert abs(jax.jit(f)(-0.5) - g(-0.5)) < 1e-10


def test_a_curve_does_not_meet_its_own_point_but_the_far_side():
    curve, n = as_circle(0.5, 2.0, 0.7), 64
    at = 2.0 * np.pi * (np.arange(n) + 0.3) / n
    inward = at + np.pi + np.linspace(-1.2, 1.2, n)
    place, along = (np.stack([np.cos(a), np.sin(a)], -1) for a in (at, inward))
    t, _ = jax.jit(jax.vmap(lambda o, d: curve.hit(o, d, jnp.array(True))))(
        np.array([0.5, 2.0]) + 0.7 * place, along
    )
    np.testing.assert_allclose(t, 1.4 * np.cos(np.linspace(-1.2, 1.2, n)), rtol=1e-12)


def test_a_curve_is_met_however_near_to_it_a_ray_starts_beside_it():
    """Towards its middle; from inside as from outside."""
    curve, d = as_circle(0.5, 2.0, 0.7), jnp.array([0.6, 0.8])
    gaps = np.array([1e-9, 1e-4, 0.3, 0.65, 2.0])
    hit = jax.jit(jax.vmap(lambda o: curve.hit(o, d, OFF)[0]))
    outside = hit(np.array([0.5, 2.0]) - (0.7 + gaps[:, None]) * d)
    np.testing.assert_allclose(outside, gaps, rtol=1e-12, atol=1e-15)
    inside = hit(np.array([0.5, 2.0]) + (0.7 - gaps[:4, None]) * d)
    np.testing.assert_allclose(inside, gaps[:4], rtol=1e-12, atol=1e-15)


def test_motion_is_the_series_with_its_derivatives():
    shape = jax.tree.map(lambda a: a[0], bean())
    curve = CurveRoots(shape.cosines, shape.sines, shape.samples)
    s, orders = jnp.array(0.37), [lambda s: curve.motion(s)[0]]
    for _ in range(3):
        orders.append(jax.jacfwd(orders[-1]))
    a = -2.0 * np.pi * (s + 1.0 / 128.0)  # clockwise, from the last of 128 points
    here = [np.cos(a), 0.7 * np.sin(a) + 0.35 * np.cos(2.0 * a)]
    np.testing.assert_allclose(curve.motion(s)[0], here, rtol=1e-12)
    for found, order in zip((*curve.motion(s), curve._third(s)), orders, strict=True):
        np.testing.assert_allclose(found, order(s), rtol=1e-12)


def test_lines_touch_a_curve_where_the_angle_turns_back_at_which_its_places_are_seen():
    shape = jax.tree.map(lambda a: a[0], bean())
    a = np.linspace(0.0, 2.0 * np.pi, 200_001)
    places = np.stack([np.cos(a), 0.7 * np.sin(a) + 0.35 * np.cos(2.0 * a)], 1)
    # Beside the line that touches it where it bends neither way, two tangents are as good as one.
    way = np.gradient(places, axis=0)
    bend = way[:, 0] * np.gradient(way[:, 1]) - way[:, 1] * np.gradient(way[:, 0])
    k = np.flatnonzero(np.diff(np.sign(bend[2:-2])))[0] + 2
    t = way[k] / np.linalg.norm(way[k])
    near = [places[k] - 2.0 * t + e * np.array([-t[1], t[0]]) for e in (1e-6, -1e-6)]
    eyes = np.array([[0.35, -3.0], [0.0, 0.9], [3.0, 0.9], [0.1, 0.3], [-0.4, 0.6], *near])
    points, valid = jax.jit(jax.vmap(lambda p: shape.silhouettes(p, OFF)))(eyes)
    counts = []
    for eye, at, there in zip(eyes, np.asarray(points), np.asarray(valid), strict=True):
        x, y = (places - eye).T
        turns = np.flatnonzero(np.diff(np.sign(np.diff(np.unwrap(np.arctan2(y, x)))))) + 1
        true, found = places[turns], at[there]
        np.testing.assert_allclose(
            found[np.argsort(found[:, 0])], true[np.argsort(true[:, 0])], rtol=0.0, atol=1e-4
        )
        counts.append(len(found))
    assert {*counts[:5]} == {*counts[5:]} == {2, 4}  # four where the dent is seen from outside


def test_tangents_of_a_circle_as_a_series_carry_two_derivatives():
    def side(p):
        points, valid = as_circle(0.0, 0.0, 0.5).silhouettes(jnp.array([p, 2.0]), OFF)
        return jnp.sum(jnp.where(valid, points[:, 0] ** 2 + points[:, 1], 0.0))

    def circle(p):
        q = jnp.array([p, 2.0])
        D = q @ q
        foot, off = q * 0.25 / D, jnp.array([-2.0, p]) * 0.5 * jnp.sqrt(D - 0.25) / D
        return sum((foot + k * off)[0] ** 2 + (foot + k * off)[1] for k in (-1.0, 1.0))

    for f, g in (
        (side, circle),
        (jax.grad(side), jax.grad(circle)),
        (jax.grad(jax.grad(side)), jax.grad(jax.grad(circle))),
    ):
        assert abs(jax.jit(f)(0.3) - g(0.3)) < 1e-9


@pytest.mark.parametrize("width", [1e-2, 1e-4, 1e-6])
def test_a_short_chord_beside_a_tangent_is_found(width):
    # The chord is far shorter than a piece; its two ends are on one piece of the curve.
    curve = as_circle(0.0, 0.0, 1.0)
    y = np.cos(0.5 * width)
    t, _ = curve.hit(jnp.array([-3.0, y]), jnp.array([1.0, 0.0]), OFF)
    assert abs(t - (3.0 - np.sin(0.5 * width))) < 1e-9 / width


def test_more_tangents_than_are_kept_are_no_answer():
    a = 2.0 * np.pi * np.arange(256) / 256
    r = 1.0 + 0.3 * np.cos(12.0 * a)
    flower = closed_curve(np.stack([r * np.cos(a), 3.0 + r * np.sin(a)], -1), 16, samples=256)
    assert jnp.isnan(
        irradiance(Scene.of(primitive(flower, emission=1.0)), Receiver((0.0, 0.0), 0.0))
    )
