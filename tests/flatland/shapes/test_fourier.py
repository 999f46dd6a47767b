import jax
import jax.numpy as jnp
import numpy as np
import pytest

from firstorder.flatland import Curves, Receiver, Scene, closed_curve, irradiance, primitive
from firstorder.flatland.shapes._fourier import CurveRoots
from firstorder.numerics._piecewise_roots import taylor
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


@pytest.mark.parametrize("samples", [4, 64])
@pytest.mark.parametrize("thin", [0.1, 0.01, 0.001])
def test_the_tip_of_a_thin_curve_in_the_middle_of_a_piece_is_met_from_inside(thin, samples):
    """It bows out by far more than its chord."""
    half = np.pi / samples
    cos = [[0.0, 0.0], [np.cos(half), thin * np.sin(half)]]
    sin = [[0.0, 0.0], [np.sin(half), -thin * np.cos(half)]]
    ellipse = jax.tree.map(lambda a: a[0], Curves(cos, sin, samples))
    start = 1.0 - np.geomspace(1e-6, 1.0, 200)
    t, _ = jax.jit(jax.vmap(lambda x: ellipse.hit(jnp.stack([x, 0.0 * x]), jnp.eye(2)[0], OFF)))(
        start
    )
    np.testing.assert_allclose(t, 1.0 - start, rtol=0.0, atol=1e-14)


def test_a_distance_is_in_lengths_of_the_direction_and_a_curve_of_nan_is_missed():
    circle = as_circle(0.0, 0.0, 1.0)
    o, d = jnp.array([-3.0, 0.0]), jnp.array([4.0, 0.0])
    assert abs(circle.hit(o, d, OFF)[0] - 0.5) < 1e-15
    assert abs(circle.distance(o, d, OFF) - 0.5) < 1e-15
    scene = jax.tree.map(lambda a: a * jnp.nan, Scene.of(primitive(bean())))
    assert jnp.isinf(scene.hit(jnp.array(0), o, d)[0])
    assert jnp.all(jnp.isinf(jax.vmap(scene.hit, (0, None, None))(jnp.array([0, 0]), o, d)[0]))


def test_motion_is_the_series_with_its_derivatives():
    shape = jax.tree.map(lambda a: a[0], bean())
    curve = CurveRoots(shape.cosines, shape.sines, shape.samples)
    s, orders = jnp.array(0.37), [lambda s: curve.motion(s)[0]]
    for _ in range(2):
        orders.append(jax.jacfwd(orders[-1]))
    a = -2.0 * np.pi * (s + 1.0 / 128.0)  # clockwise, from the last of 128 points
    here = [np.cos(a), 0.7 * np.sin(a) + 0.35 * np.cos(2.0 * a)]
    np.testing.assert_allclose(curve.motion(s)[0], here, rtol=1e-12)
    for found, order in zip(curve.motion(s), orders, strict=True):
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


def test_lines_touch_a_star_in_up_to_eight_places():
    """As many as the angle at which a fine polygon is seen turns back."""
    a = 2.0 * np.pi * np.arange(100_000) / 100_000
    r = 1.0 + 0.25 * np.cos(5.0 * a)
    places = np.stack([r * np.cos(a), r * np.sin(a)], -1)
    star = jax.tree.map(lambda a: a[0], closed_curve(places[::500], 12))
    eyes = np.random.default_rng(2).uniform(-2.5, 2.5, (60, 2))
    points, valid = jax.jit(jax.vmap(lambda p: star.silhouettes(p, OFF)))(eyes)
    counts = []
    for eye, at, there in zip(eyes, np.asarray(points), np.asarray(valid), strict=True):
        x, y = (places - eye).T
        angle = np.unwrap(np.arctan2(y, x))
        round_trip = 2.0 * np.pi * np.round((angle[-1] - angle[0]) / (2.0 * np.pi))
        angle = np.concatenate([angle, angle[:2] + round_trip])
        turns = (np.flatnonzero(np.diff(np.sign(np.diff(angle)))) + 1) % len(a)
        if len(turns) <= 8:
            found = at[there]
            assert len(found) == len(turns)
            apart = np.linalg.norm(found[:, None] - places[turns], axis=-1)
            assert np.all(apart.min(0, initial=9.0) < 1e-3)
        else:
            assert np.all(np.isnan(at))
        counts.append(len(turns))
    assert {2, 4, 6, 8} <= {*counts}


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


@pytest.mark.parametrize("dtype", [np.float64, np.float32])
@pytest.mark.parametrize("harmonics", [0, 1, 5, 16, 80])
def test_on_its_pieces_a_curve_is_the_series_with_its_derivatives(harmonics, dtype):
    """Of harmonics that fall off as those of a smooth curve; so many that pieces are divided."""
    rng = np.random.default_rng(harmonics)
    fall = np.exp(-0.3 * np.arange(harmonics + 1))[:, None]
    a, b = (fall * rng.normal(size=(harmonics + 1, 2)) for _ in range(2))
    pieces = CurveRoots(jnp.asarray(a, dtype), jnp.asarray(b, dtype), 64).prepared()
    count, u = pieces.starts.shape[-1], np.array([-1.0, -0.3, 0.4, 1.0])
    assert count == (256 if harmonics == 80 else 64)
    s = (np.arange(count)[:, None] + 0.5 + 0.5 * u) / count
    turn = 2.0 * np.pi * np.arange(harmonics + 1)
    cos, sin = (g(turn * s[..., None]) for g in (np.cos, np.sin))
    step = turn[:, None] / (2.0 * count)  # a derivative in u for one in s
    series = (
        cos @ a + sin @ b,
        cos @ (step * b) - sin @ (step * a),
        -(cos @ (step**2 * a) + sin @ (step**2 * b)),
    )
    eps = np.finfo(dtype).eps
    for k, true in enumerate(series):
        at_start = pieces.starts[k] + (pieces.center[:, None] if k == 0 else 0.0)
        np.testing.assert_allclose(at_start.T, true[:, 0], rtol=0.0, atol=60.0 * eps)
        for i in (0, 1):
            rows = jnp.broadcast_to(pieces.about[i][:, :, None], (*pieces.about[i].shape, len(u)))
            found = taylor(rows, jnp.asarray(np.broadcast_to(u, s.shape), dtype), 3)[k]
            found = found + (pieces.center[i] if k == 0 else 0.0)
            np.testing.assert_allclose(found, true[..., i], rtol=0.0, atol=60.0 * eps)


def flower():
    """A curve with twelve petals, which a line meets in up to ten places."""
    a = 2.0 * np.pi * np.arange(256) / 256
    r = 1.0 + 0.3 * np.cos(12.0 * a)
    return closed_curve(np.stack([r * np.cos(a), r * np.sin(a)], -1), 14, samples=128)


@pytest.mark.parametrize("make", [bean, flower])
def test_rays_meet_a_curve_where_they_first_meet_a_fine_polygon(make):
    """From outside, from inside and from the curve itself; to the arrow height of its sides."""
    group, rng, n, sides = make(), np.random.default_rng(9), 600, 20_000
    shape = jax.tree.map(lambda a: a[0], group)
    s = np.arange(sides) / sides
    corners = np.asarray(jax.jit(jax.vmap(lambda s: shape.motion(s)[0]))(s))
    on = np.arange(n) % 3 == 0
    start = np.where(on[:, None], corners[rng.integers(0, sides, n)], rng.uniform(-2, 2, (n, 2)))
    a = rng.uniform(0.0, 2.0 * np.pi, n)
    along = np.stack([np.cos(a), np.sin(a)], -1)
    ready = jax.tree.map(lambda a: a[0], group.ready())
    asked = start, along, on
    hits = jax.jit(jax.vmap(ready.hit))(*asked)[0]
    searched = jax.jit(jax.vmap(ready.prepared().distance))(*asked)
    np.testing.assert_allclose(searched, hits, rtol=0.0, atol=1e-12)

    true, clear = [], []
    for o, d, own in zip(start, along, on, strict=True):
        w = corners - o
        beside, ahead = d[0] * w[:, 1] - d[1] * w[:, 0], w @ d
        after, later = np.roll(beside, -1), np.roll(ahead, -1)
        met = (beside > 0.0) != (after > 0.0)
        t = (ahead * after - later * beside)[met] / (after - beside)[met]
        t = t[t > (1e-3 if own else 0.0)]
        true.append(t.min(initial=np.inf))
        # Where the ray grazes the curve, or starts beside it, the polygon is no oracle.
        near = np.abs(beside) < 1e-4
        slow = np.abs(after - beside) < 0.03 * np.hypot(*(np.roll(corners, -1, 0) - corners).T)
        clear.append(not np.any(near & slow & (ahead > -1e-3)))
    true, clear = np.array(true), np.array(clear)
    assert clear.sum() > 0.9 * n
    assert 0.1 < np.isinf(true[clear]).mean() < 0.9
    np.testing.assert_allclose(np.asarray(hits)[clear], true[clear], rtol=0.0, atol=1e-5)
