"""Distances to round shapes, as searches ask for them: against quadratic equations in NumPy."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from firstorder.conventions import direction
from firstorder.flatland import Arcs, Ellipses, Scene, Segments, first_shape, nearest, primitive
from firstorder.numerics._planar import left

RNG = np.random.default_rng(11)
COUNT, RAYS = 40, 50
CENTERS = RNG.uniform(-1.0, 1.0, (COUNT, 2))
SEMI = RNG.uniform(0.2, 1.5, (COUNT, 2))
TILT = RNG.uniform(-3.0, 3.0, COUNT)
START = RNG.uniform(-9.0, 9.0, COUNT)
SWEEP = RNG.uniform(0.1, 2.0 * np.pi, COUNT) * np.where(np.arange(COUNT) % 2, 1.0, -1.0)
SWEEP[:3] = 2.0 * np.pi, -np.pi, 2.0 * np.pi + 5e-7
ORIGINS = RNG.uniform(-2.5, 2.5, (RAYS, 2))
ANGLES = RNG.uniform(0.0, 2.0 * np.pi, RAYS)
ALONG = np.stack([np.cos(ANGLES), np.sin(ANGLES)], -1)


def distances(shapes, origins=ORIGINS, along=ALONG, on=False):
    """Of all rays to all shapes, prepared."""
    prepared = jax.vmap(lambda shape: shape.prepared())(shapes)
    one = jax.vmap(lambda shape, o, d: shape.distance(o, d, jnp.asarray(on)), (None, 0, 0))
    each = jax.vmap(one, (0, None, None))
    return np.asarray(jax.jit(each)(prepared, jnp.asarray(origins), jnp.asarray(along)))


def roots(frame, center, o, d):
    """Both roots of |frame (o + t d - center)| = 1, in order; none where they are not real."""
    w, u = frame @ (o - center), frame @ d
    t = np.roots([u @ u, 2.0 * (w @ u), w @ w - 1.0])
    return np.sort(t.real) if np.all(t.imag == 0.0) else np.array([])


def ellipse_by_hand(k, o, d):
    c, s = np.cos(TILT[k]), np.sin(TILT[k])
    frame = np.diag(1.0 / SEMI[k]) @ np.array([[c, s], [-s, c]])
    ahead = [t for t in roots(frame, CENTERS[k], o, d) if t > 0.0]
    return min(ahead, default=np.inf)


def arc_by_hand(k, o, d):
    """By the angle of each root, counted from the start in the arc's own sense."""
    radius = SEMI[k, 0]
    for t in roots(np.eye(2) / radius, CENTERS[k], o, d):
        x, y = o + t * d - CENTERS[k]
        turned = (np.arctan2(-x, y) - START[k]) * np.sign(SWEEP[k])
        if t > 0.0 and np.mod(turned, 2.0 * np.pi) <= abs(SWEEP[k]):
            return t
    return np.inf


@pytest.mark.parametrize(
    ("shapes", "by_hand"),
    [
        (Ellipses(CENTERS, SEMI, TILT), ellipse_by_hand),
        (Arcs(CENTERS, SEMI[:, 0], START, SWEEP), arc_by_hand),
    ],
    ids=["ellipses", "arcs"],
)
def test_distances_are_the_first_roots_ahead(shapes, by_hand):
    pairs = zip(ORIGINS, ALONG, strict=True)
    true = np.array([[by_hand(k, o, d) for k in range(COUNT)] for o, d in pairs]).T
    assert 0.1 < np.mean(np.isfinite(true)) < 0.9
    found = distances(shapes)
    np.testing.assert_allclose(found, true, rtol=1e-9)
    by_hit = jax.vmap(
        lambda s: jax.vmap(lambda o, d: s.hit(o, d, jnp.asarray(False)))(ORIGINS, ALONG)
    )
    t, s = jax.jit(by_hit)(shapes)
    np.testing.assert_allclose(found, t, rtol=1e-12)
    assert jnp.all((s >= 0.0) & (s <= 1.0))


@pytest.mark.parametrize("inward", [True, False])
def test_a_ray_does_not_meet_the_place_where_it_starts(inward):
    """From a circle it meets the other side, a chord away; from outside of it nothing."""
    radius, angle = 0.7, np.linspace(0.1, 6.0, 9)
    away = np.stack([np.cos(angle), np.sin(angle)], -1)
    turned = angle + (np.pi + 0.4 if inward else 0.4)
    along = np.stack([np.cos(turned), np.sin(turned)], -1)
    true = 2.0 * radius * np.cos(0.4) if inward else np.inf
    for shape in (
        Ellipses((0.3, -40.0), (radius, radius), 0.3),
        Arcs((0.3, -40.0), radius, 0.2, 6.28),
    ):
        start = np.array([0.3, -40.0]) + radius * away
        np.testing.assert_allclose(distances(shape, start, along, on=True)[0], true, rtol=1e-9)


def test_an_arc_ends_where_its_sweep_does():
    """Rays from the middle, a millionth of a turn to both sides of both ends."""
    for sweep in (0.3, 2.0, np.pi, 4.0, 6.0, -0.3, -2.0, -np.pi, -4.0, -6.0):
        for s, out in ((0.0, -1.0), (1.0, 1.0)):
            angle = 0.5 + s * sweep + 1e-6 * np.sign(sweep) * out * np.array([1.0, -1.0])
            along = np.stack([-np.sin(angle), np.cos(angle)], -1)
            found = distances(Arcs((0.0, 0.0), 2.0, 0.5, sweep), np.zeros((2, 2)), along)[0]
            np.testing.assert_allclose(found, [np.inf, 2.0])


def test_a_sweep_of_a_whole_turn_leaves_no_gap():
    """Nor does one that is longer than that by rounding."""
    for more in (0.0, 9e-7):
        angle = 0.5 + more / 2.0 + np.array([0.0, np.pi, -1e-7])
        along = np.stack([-np.sin(angle), np.cos(angle)], -1)
        arc = Arcs((0.0, 0.0), 2.0, 0.5, 2.0 * np.pi + more)
        np.testing.assert_allclose(distances(arc, np.zeros((3, 2)), along)[0], 2.0)


def test_a_hit_beside_an_end_is_at_that_end():
    """By rounding a place beside an end has no parameter, or that of the other one."""
    arc, eye = Arcs((0.1, 0.7), 0.9, 0.5, 1.3), np.array([0.35, -1.2])
    one = jax.tree.map(lambda a: a[0], arc)
    hits = jax.vmap(lambda d: one.hit(jnp.asarray(eye), d, jnp.asarray(False)))
    for s in (0.0, 1.0):
        end = np.asarray(arc.motion(jnp.asarray([s]))[0])[0]
        way = end - eye
        angle = np.arctan2(*way) + np.linspace(-3e-15, 3e-15, 41)
        along = np.stack([np.sin(angle), np.cos(angle)], -1)
        t, at = hits(along)
        hit = np.isfinite(t)
        assert 5 < np.sum(hit) < 36
        np.testing.assert_allclose(np.asarray(at)[hit], s, rtol=0.0, atol=1e-13)


@pytest.mark.parametrize("dtype", [jnp.float32, jnp.float64])
@pytest.mark.parametrize("partner", ["arc", "segment"])
def test_no_ray_passes_between_an_arc_and_what_is_joined_to_it(dtype, partner):
    """Rays from inside, at the very joint: as the search and as the hit see it."""
    rng = np.random.default_rng(5)

    @jax.jit
    def missed(center, radius, start, sweep, origins, along):
        end = center + radius * direction(start + sweep)
        scene = Scene.of(
            primitive(Arcs(center, radius, start, sweep)),
            primitive(
                Arcs(center, radius, start + sweep, 2.0 * jnp.pi - sweep)
                if partner == "arc"
                else Segments(end, end + left(direction(start + sweep)))
            ),
        )
        found = first_shape(scene, origins, along), nearest(scene, origins, along).index
        return jnp.sum(jnp.stack(found) < 0)

    for _ in range(20):
        center, radius = rng.uniform(-3.0, 3.0, 2), rng.uniform(0.1, 2.0)
        start, sweep = rng.uniform(-3.0, 3.0), rng.uniform(0.1, 3.1)
        joint = np.array([-np.sin(start + sweep), np.cos(start + sweep)])
        origins = rng.uniform(-0.45, 0.45, (200, 2))
        along = joint - origins
        along = along / np.linalg.norm(along, axis=1, keepdims=True)
        given = center, radius, start, sweep, center + radius * origins, along
        assert missed(*(jnp.asarray(a, dtype) for a in given)) == 0


def test_an_arc_as_short_as_rounding_is_met_on_its_own_side():
    angle = np.linspace(0.1, 6.0, 200)
    away = np.stack([-np.sin(angle), np.cos(angle)], -1)
    for sweep in (1e-16, 1e-15, 1e-12):
        arc = Arcs(np.zeros((200, 2)), np.ones(200), angle, np.full(200, sweep))
        found = distances(arc, np.zeros((200, 2)), -away)
        assert np.all(np.isinf(np.diagonal(found)))
