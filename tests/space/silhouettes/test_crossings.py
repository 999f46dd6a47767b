"""Crossings of silhouettes against points that were put there."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from firstorder.numerics._roots import even
from firstorder.space.silhouettes import _crossings as crossings
from firstorder.space.silhouettes._curves import SilhouetteArcs, SilhouetteSegments

on_plane, on_cone = jax.jit(crossings.on_plane), jax.jit(crossings.on_cone)
along_segment = jax.jit(crossings.along_segment)
segment_on_cone = jax.jit(crossings.segment_on_cone)
YES = jnp.asarray(True)
OWNER = jnp.asarray(0)


def arc(center, a, b, first=0.0, last=2.0 * np.pi):
    return SilhouetteArcs(*(jnp.asarray(v, float) for v in (center, a, b, first, last)), OWNER, YES)


def line(start, end):
    return SilhouetteSegments(jnp.asarray(start, float), jnp.asarray(end, float), OWNER, YES)


ROUND = arc((0.0, 0.0, 2.0), (1.0, 0.0, 0.1), (0.0, 0.7, 0.2))


def test_an_arc_crosses_a_plane_through_the_eye():
    p, q = ROUND.point(jnp.asarray(0.4)), ROUND.point(jnp.asarray(2.9))
    found = np.sort(on_plane(ROUND, jnp.cross(p, q)))
    np.testing.assert_allclose(found, [0.4, 2.9], rtol=0.0, atol=1e-12)


def test_an_arc_that_does_not_cross_gives_its_start():
    found = on_plane(ROUND, jnp.array([1.0, 0.0, 0.0]) + 5.0 * jnp.array([0.0, 0.0, 1.0]))
    assert found.tolist() == [0.0, 0.0]


def planes_on(arc, normals):
    """`arcs_on_planes` of one arc."""
    points = jnp.stack([arc.center, arc.a, arc.b])[None]
    return crossings.arcs_on_planes(points, arc.first[None], arc.last[None], normals)[0]


def test_among_planes_an_arc_that_does_not_cross_is_cut_where_it_is_nearest():
    normals = np.array([(1.0, 0.0, 5.0), (-1.0, 0.0, -5.0), (0.0, 0.3, 2.0)])
    t = np.linspace(0.0, 2.0 * np.pi, 10_001)
    heights = np.abs(np.asarray(ROUND.point(jnp.asarray(t))) @ normals.T)
    wanted = np.repeat(t[np.argmin(heights, 0)][:, None], 2, 1)
    np.testing.assert_allclose(planes_on(ROUND, jnp.asarray(normals)), wanted, rtol=0.0, atol=t[1])


def test_an_arc_that_touches_a_plane_is_cut_there_once_however_it_rounds():
    """A circle of radius one about a point one above the plane, turned in it."""
    turn = np.random.default_rng(0).uniform(0.0, 2.0 * np.pi, 1000)
    zero = np.zeros_like(turn)
    c, a, b = (
        np.stack(x, -1)
        for x in (
            (zero, zero, zero + 1.0),
            (np.cos(turn), zero, np.sin(turn)),
            (-np.sin(turn), zero, np.cos(turn)),
        )
    )
    arcs = jnp.asarray(np.stack([c, a, b], 1))
    ends = jnp.asarray(np.stack([zero, zero + 2.0 * np.pi]))
    found = crossings.arcs_on_planes(arcs, *ends, jnp.array([(0.0, 0.0, 1.0)]))[:, 0]
    lowest = np.mod(1.5 * np.pi - turn, 2.0 * np.pi)
    np.testing.assert_allclose(found, np.stack([lowest, lowest], -1), rtol=0.0, atol=1e-14)


def test_a_circle_whose_plane_is_level_is_cut_anywhere_and_breaks_nothing():
    flat = arc((0.3, 0.2, 1.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0))

    def cut(z):
        return planes_on(flat, jnp.stack([0.0 * z, 0.0 * z, z])[None])

    for f in (cut, jax.jacfwd(cut), jax.jacfwd(jax.jacfwd(cut))):
        assert np.all(np.isfinite(f(jnp.asarray(1.0))))


def test_roots_outside_of_an_arc_are_its_start():
    p, q = ROUND.point(jnp.asarray(0.4)), ROUND.point(jnp.asarray(2.9))
    part = arc(ROUND.center, ROUND.a, ROUND.b, 2.0 * np.pi + 2.0, 2.0 * np.pi + 4.0)
    found = np.sort(on_plane(part, jnp.cross(p, q))) - 2.0 * np.pi
    np.testing.assert_allclose(found, [2.0, 2.9], rtol=0.0, atol=1e-12)


def test_two_arcs_cross_in_up_to_four_directions():
    other = arc((0.0, 0.1, 4.0), (0.9, 0.3, 0.0), (-0.5, 2.2, 0.3))
    t = np.asarray(on_cone(ROUND, other))
    t = t[t > 0.0]
    assert len(t) == 4
    dense = jnp.linspace(0.0, 2.0 * np.pi, 200001)
    theirs = jax.vmap(other.point)(dense)
    theirs = np.asarray(theirs / jnp.linalg.norm(theirs, axis=1, keepdims=True))
    for s in t:
        p = np.asarray(ROUND.point(jnp.asarray(s)))
        assert np.max(theirs @ p / np.linalg.norm(p)) > 1.0 - 1e-9


@pytest.mark.parametrize("far", [1.0, 1e15])
def test_an_arc_crosses_a_circle_about_the_eye(far):
    """The horizon of a plane is such a circle, far away."""
    a, b = (ROUND.point(jnp.asarray(t)) for t in (0.4, 2.9))
    other = arc((0.0, 0.0, 0.0), far * a, far * b)
    found = np.unique(on_cone(ROUND, other))
    np.testing.assert_allclose(found, [0.4, 2.9], rtol=0.0, atol=1e-12)
    aside = arc(other.center, (1.0, 0.0, 0.0), (0.0, 1.0, 0.0))
    assert np.unique(on_cone(ROUND, aside)).tolist() == [0.0]


def test_crossings_of_arcs_have_two_derivatives():
    def cut(x):
        other = arc((0.0, 0.1, 4.0), (0.9, 0.3, 0.0), (-0.5, 2.2, 0.3))
        moved = SilhouetteArcs(
            other.center + x * jnp.array([0.3, 0.2, 0.1]), *jax.tree.leaves(other)[1:]
        )
        return jnp.sort(on_cone(ROUND, moved))

    h = 1e-4
    slope, bend = jax.jit(lambda x: (jax.jacfwd(cut)(x), jax.jacfwd(jax.jacfwd(cut))(x)))(0.0)
    low, mid, high = cut(-h), cut(0.0), cut(h)
    np.testing.assert_allclose(slope, (high - low) / (2 * h), rtol=1e-6)
    np.testing.assert_allclose(bend, (high - 2 * mid + low) / h**2, rtol=1e-5)


def contours(center, turn, sine):
    """Contours of balls, given the sines of their angular radii, with axes and cosines."""
    far = np.linalg.norm(center, axis=-1, keepdims=True)
    n = center / far
    u = np.cross(n, np.eye(3)[np.argmin(abs(n), -1)])
    u /= np.linalg.norm(u, axis=-1, keepdims=True)
    v, cosine = np.cross(n, u), np.sqrt(1.0 - sine[:, None] ** 2)
    cos, sin = np.cos(turn)[:, None], np.sin(turn)[:, None]
    radius = far * sine[:, None] * cosine
    radii = radius * (cos * u + sin * v), radius * (cos * v - sin * u)
    return np.stack([center * cosine**2, *radii], 1), n, cosine[:, 0]


def missed_pairs(count=20_000):
    """Of crossings of a contour with that of a ball that all but touches the eye, those missed.

    On the sphere of directions they are where two circles meet: w . n = cos, for both.
    """
    rng = np.random.default_rng(0)
    places, turns = rng.normal(size=(2, count, 3)), rng.uniform(0.0, 6.28, (2, count))
    near = 1.0 - 10.0 ** rng.uniform(-14.0, -3.0, count)
    one, n, c = contours(places[0], turns[0], np.sin(rng.uniform(0.02, 1.5, count)))
    other, m, d = contours(places[1], turns[1], near)
    k = np.sum(n * m, -1)
    share = 1.0 - k * k
    foot = ((c - k * d) / share)[:, None] * n + ((d - k * c) / share)[:, None] * m
    square = (1.0 - np.sum(foot**2, -1)) / share
    meet = square > 1e-12
    aside = np.sqrt(np.where(meet, square, 0.0))[:, None] * np.cross(n, m)

    def crossed(one, other):
        return crossings.on_cone(arc(*one), arc(*other))

    found = np.asarray(jax.jit(jax.vmap(crossed))(jnp.asarray(one), jnp.asarray(other)))
    missed = 0
    for w in (foot - aside, foot + aside):
        t = np.arctan2(np.sum(w * one[:, 2], -1), np.sum(w * one[:, 1], -1))
        off = np.abs((found - t[:, None] + np.pi) % (2.0 * np.pi) - np.pi).min(-1)
        missed += np.sum(meet & (off > 1e-5))
    assert np.sum(meet) > 0.1 * count
    return missed


def test_a_contour_crosses_that_of_a_ball_that_all_but_touches_the_eye():
    assert missed_pairs() == 0


def test_fault_samples_all_around_lose_such_crossings(monkeypatch):
    monkeypatch.setattr(crossings, "_in_front", lambda c, a, b: even(crossings.SAMPLES, c.dtype))
    assert missed_pairs() > 0


# Arcs (centre and radii) in the coordinates of thin ellipses, along whose longer axis they run.
CONE = arc((0.0, 0.0, 1.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0))
ALONG = [
    ((-47.53954832, 25.10187251, 8.97327558), (-3.10713978, 0.27194989, 0.33802504),
     (48.76863305, -26.23343239, -8.76039369)),
    ((-0.26746468, 1045.56161926, 29.04820705), (-1.3239688, -588.75690026, -16.15349841),
     (0.79801053, -878.18011608, -24.06019259)),
    ((-0.05638113, 70.3095388126, 4.520515572), (-2.99602156, -58.7964826836, -3.1545813414),
     (4.32817665, -40.1838264961, -2.1504748527)),
    ((-1.47907605, -709.180204243, 87.6933537265), (1.6381050916, 133.379176939, -16.0570465529),
     (-0.5179225546, 706.494792064, -85.982626489)),
    ((-0.0316437228, 92.355526286793, 14.182354181), (-0.1648688558, -92.323363343, -13.720587309),
     (0.8792268827, -15.631149437, -2.31469622)),
]  # fmt: skip


@pytest.mark.parametrize("points", ALONG)
def test_arcs_along_thin_ellipses_cross_them(points):
    """Two crossings close together fell into one piece of the search."""
    one = arc(*points)
    t = np.linspace(0.0, 2.0 * np.pi, 1_000_001)
    x, y, z = np.asarray(one.point(jnp.asarray(t))).T
    inside = x * x + y * y < z * z
    counted = np.sum((inside[1:] != inside[:-1]) & (z[1:] > 0.0))
    assert counted > 0
    assert np.sum(np.asarray(on_cone(one, CONE)) > 0.0) == counted


def test_segments_are_cut_by_planes_and_by_cones():
    one = line((-1.0, 0.3, 1.0), (1.0, 0.4, 2.0))
    p = one.point(jnp.asarray(0.3))
    normal = jnp.cross(p, jnp.array([0.1, 1.0, 0.5]))
    np.testing.assert_allclose(along_segment(one, normal), 0.3)
    through = arc(2.0 * p + jnp.array([-0.5, 0.0, 0.0]), (0.5, 0.0, 0.0), (0.0, 0.4, 0.1))
    assert np.min(np.abs(segment_on_cone(one, through) - 0.3)) < 1e-12
    away = line((5.0, 5.0, 1.0), (6.0, 5.0, 1.0))
    assert segment_on_cone(away, through).tolist() == [0.0, 0.0]


def test_many_segments_are_cut_as_each_is_alone():
    ends = [((-1.0, 0.3, 1.0), (1.0, 0.4, 2.0)), ((0.2, -1.5, 1.0), (0.1, 1.0, 1.3))]
    arcs = [((0.0, 0.0, 2.0), (1.0, 0.0, 0.1), (0.0, 0.7, 0.2)), ((0.3, 0.1, 1.5), (0.2, 0.4, 0.0),
            (-0.3, 0.3, 0.4)), ((5.0, 5.0, 1.0), (0.1, 0.0, 0.0), (0.0, 0.1, 0.0))]  # fmt: skip
    lines = [line(*pair) for pair in ends]
    normals = jnp.stack([jnp.cross(one.start, one.end) for one in lines])
    t = jnp.stack([jnp.stack([on_plane(arc(*e), n) for n in normals]) for e in arcs])
    found = crossings.lines_on_cones(jnp.array(ends), normals, jnp.array(arcs), t)
    alone = [[segment_on_cone(one, arc(*e)) for e in arcs] for one in lines]
    np.testing.assert_allclose(found, alone, rtol=0.0, atol=1e-12)
    assert np.count_nonzero(np.asarray(found)) >= 4
    planes = jnp.array([[0.3, 1.0, -0.1], [1.0, 0.1, 0.2], [0.0, 0.0, 1.0]])
    found = crossings.lines_on_planes(jnp.array(ends), planes, jnp.ones(3))
    alone = [[along_segment(one, n) for n in planes] for one in lines]
    np.testing.assert_allclose(found, alone, rtol=0.0, atol=1e-15)


def test_the_parts_of_segments_end_where_shapes_other_than_their_own_are_in_line():
    rng = np.random.default_rng(1)
    lines, rims = np.array([0, 0, 1]), np.array([0, 2, 3, 1])
    on_planes, on_cones = rng.uniform(0.01, 0.99, (3, 4)), rng.uniform(0.01, 0.99, (3, 4, 2))
    ends = crossings.line_ends(jnp.array(on_planes), jnp.array(on_cones), (lines, rims))
    for row, owner in enumerate(lines):
        others = on_planes[row, 1:][lines != owner], on_cones[row][rims != owner].ravel()
        wanted = {0.0, 1.0, on_planes[row, 0], *np.concatenate(others)}
        np.testing.assert_allclose(np.unique(ends[row]), sorted(wanted))


def test_the_parts_of_arcs_end_where_shapes_other_than_their_own_are_in_line():
    rng = np.random.default_rng(2)
    arcs = jnp.array(
        [[(x, 0.1 * x, 2.0), (0.8, 0.0, 0.1), (0.0, 0.7, 0.2)] for x in (0.0, 0.3, 0.5)]
    )
    first, last = jnp.array([0.0, 0.5, 0.0]), jnp.array([6.0, 4.5, 2.0 * np.pi])
    lines, rims = np.array([0, 1, 3]), np.array([0, 1, 2])
    on_planes = rng.uniform(0.6, 4.0, (3, 4, 2))
    ends = crossings.arc_ends(arcs, first, last, jnp.array(on_planes), (lines, rims))
    assert np.all(np.diff(ends) >= 0.0)
    for row, owner in enumerate(rims):
        mine = arc(*arcs[row], first[row], last[row])
        others = [on_cone(mine, arc(*arcs[k])) for k in range(3) if k != row]
        assert np.count_nonzero(np.stack(others) > first[row]) > 1
        others += [first[row][None], last[row][None], on_planes[row, 0]]
        others += [on_planes[row, 1:][lines != owner].ravel()]
        wanted = np.unique(np.concatenate(others).round(9))
        np.testing.assert_allclose(np.unique(ends[row].round(9)), wanted, rtol=0.0, atol=1e-8)


def test_one_arc_is_cut_by_the_horizon_alone():
    arcs, ends = jnp.array([ROUND.center, ROUND.a, ROUND.b])[None], jnp.array([0.0])
    found = crossings.arc_ends(
        arcs, ends, ends + 6.0, jnp.array([[[2.0, 1.0]]]), (np.array([]), np.array([0]))
    )
    assert found.tolist() == [[0.0, 1.0, 2.0, 6.0]]


def test_the_horizon_ends_where_silhouettes_cross_it():
    lines = jnp.array([[(1.0, 1.0, -1.0), (1.0, 1.0, 1.0)], [(0.0, -1.0, -1.0), (2.0, -1.0, 3.0)]])
    arcs = jnp.array([[(-2.0, 0.0, 0.0), (0.0, 2.0, 0.0), (0.0, 0.0, 1.0)]])
    s, t = jnp.array([0.5, 0.25]), jnp.array([[0.0, np.pi]])
    found = crossings.horizon_ends(lines, s, arcs, t)
    right, left = np.arctan2(-1.0, 0.5), 0.75 * np.pi
    np.testing.assert_allclose(
        found, [-np.pi, -left, right, 0.25 * np.pi, left, np.pi], rtol=0.0, atol=1e-12
    )


def test_a_point_straight_above_has_no_azimuth_and_no_slope():
    """A lamp's corner over the receiver: the azimuths of the others keep their derivatives."""
    lines = jnp.array([[(0.0, 0.0, 1.0), (1.0, 0.0, 1.0)], [(1.0, 1.0, 1.0), (1.0, -1.0, -1.0)]])
    s, arcs, t = jnp.array([0.0, 0.5]), jnp.zeros((0, 3, 3)), jnp.zeros((0, 2))

    def ends(shift):
        return crossings.horizon_ends(lines.at[1].add(shift), s + 0.0 * shift[0], arcs, t)

    at = jnp.zeros(3)
    np.testing.assert_allclose(ends(at), [-np.pi, 0.0, 0.0, np.pi], rtol=0.0, atol=1e-15)
    slopes = jax.jacfwd(ends)(at)
    np.testing.assert_allclose(slopes.sum(0), [0.0, 1.0, 0.0], rtol=0.0, atol=1e-15)


def test_the_height_over_a_cone_has_two_derivatives():
    f = crossings._cone(*jnp.array([(0.3, -0.2, 1.0), (0.5, 0.1, 0.4), (-0.2, 0.6, 0.3)]))
    value = jax.grad(lambda s: f(s)[0])
    for s in (0.1, 0.45, 0.8):
        np.testing.assert_allclose(f(s)[1:], [value(s), jax.grad(value)(s)], rtol=1e-12)


def test_one_segment_is_cut_by_the_horizon_alone():
    owners = np.array([0]), np.array([], int)
    found = crossings.line_ends(jnp.array([[0.25]]), jnp.zeros((1, 0, 2)), owners)
    assert np.unique(found).tolist() == [0.0, 0.25, 1.0]


@pytest.mark.parametrize("flat", [True, False])
def test_an_arc_seen_edge_on_cuts_nothing_and_breaks_nothing(flat):
    edge = arc((0.0, 0.0, 2.0), (1.0, 0.0, 0.0), (0.0, 0.0, 0.5) if flat else (0.0, 0.5, 0.0))
    slope = jax.jacfwd(lambda c: on_cone(ROUND, arc(c, edge.a, edge.b)))(edge.center)
    assert np.all(np.isfinite(slope))
