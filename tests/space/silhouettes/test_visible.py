"""What is seen beside an edge: hidden, shared, touching and cut-off pieces."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from firstorder import space
from firstorder.space import (
    Scene,
    box,
    cylinder,
    plane,
    primitive,
    receiver,
    rectangle,
    sphere,
    visible_silhouettes,
)
from firstorder.space.silhouettes import visible


@jax.jit
def _pieces(scene, at):
    return visible_silhouettes(scene, at)


def arcs(found, owner):
    """Angular length of the seen arcs of a shape."""
    seen = np.asarray(found.rims.seen) & (np.asarray(found.rims.owner) == owner)
    length = np.asarray(found.arcs.last - found.arcs.first)
    return length[seen].sum()


def balls(*centers):
    return Scene.of(*(primitive(sphere(c, 0.5)) for c in centers))


def test_a_ball_alone_is_seen_all_round():
    found = _pieces(balls((0.0, 0.0, 2.0), (0.0, 0.0, -9.0)), receiver((0.0, 0.0, 0.0)))
    np.testing.assert_allclose(arcs(found, 0), 2.0 * np.pi)
    assert arcs(found, 1) == 0.0  # below the horizon
    assert np.all(np.asarray(found.above) == -1)


def test_contours_are_in_metres():
    """That of a ball of 4 m, 16 m up, is a circle at 15 m with a radius of 4 cos(beta)."""
    scene = Scene.of(primitive(sphere((0.0, 0.0, 16.0), 4.0)))
    found = _pieces(scene, receiver((0.0, 0.0, 0.0)))
    p, v, w = (np.asarray(a)[found.rims.seen] for a in found.on_arcs(8))
    radius = 4.0 * np.sqrt(1.0 - 1.0 / 16.0)
    np.testing.assert_allclose(p[..., 2], 15.0)
    np.testing.assert_allclose(np.hypot(p[..., 0], p[..., 1]), radius)
    length = np.sum(w * np.linalg.norm(v, axis=-1))
    np.testing.assert_allclose(length, 2.0 * np.pi * radius)


def test_a_ball_behind_another_is_not_seen():
    found = _pieces(balls((0.0, 0.0, 2.0), (0.0, 0.0, 6.0)), receiver((0.0, 0.0, 0.0)))
    np.testing.assert_allclose(arcs(found, 0), 2.0 * np.pi)
    assert arcs(found, 1) == 0.0


def test_overlapping_balls_hide_an_arc_of_the_farther_one():
    found = _pieces(balls((0.3, 0.0, 2.0), (-0.4, 0.0, 4.0)), receiver((0.0, 0.0, 0.0)))
    np.testing.assert_allclose(arcs(found, 0), 2.0 * np.pi)
    assert 0.0 < arcs(found, 1) < 2.0 * np.pi
    behind = np.asarray(found.rims.behind)[np.asarray(found.rims.owner) == 0]
    assert {-1, 1} <= set(behind.tolist())


def test_a_ball_on_the_horizon_is_cut_there():
    found = _pieces(balls((2.0, 0.0, 0.0), (0.0, 0.0, -9.0)), receiver((0.0, 0.0, 0.0)))
    np.testing.assert_allclose(arcs(found, 0), np.pi)
    parts = np.asarray(found.azimuths[1:] - found.azimuths[:-1])
    width = parts[np.asarray(found.above) == 0].sum()
    np.testing.assert_allclose(width, 2.0 * np.arcsin(0.25))


def test_balls_over_a_box_below_the_horizon_are_seen_all_round():
    middles = [(-3.0, y, z) for y in (-1.5, 0.0, 1.5) for z in (1.0, 2.5)]
    shapes = [box((1.0, -0.5, -0.9), (1.4, 0.5, -0.5)), *(sphere(c, 0.5) for c in middles)]
    found = _pieces(Scene.of(*map(primitive, shapes)), receiver((0.0, 0.0, 0.0)))
    round_ones = np.unique(found.rims.owner)
    assert len(round_ones) == len(middles)
    for owner in round_ones:
        np.testing.assert_allclose(arcs(found, owner), 2.0 * np.pi)


@pytest.mark.parametrize("seed", range(6))
def test_a_rim_that_stands_on_the_horizon_is_the_horizons(seed):
    """However all is turned; of the upper rim the part is seen that looks at the receiver."""
    turn, _ = np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))
    foot, up = 2.0 * turn[0], turn[2]
    scene = Scene.of(primitive(cylinder(foot, foot + 1.5 * up, 0.5)))
    found = _pieces(scene, receiver((0.0, 0.0, 0.0), up))
    np.testing.assert_allclose(arcs(found, 0), 2.0 * np.arccos(0.25), rtol=1e-9)


def test_two_walls_share_an_edge_and_each_answers_for_itself():
    """A corner of a room: neither wall is cut off by the other."""
    scene = Scene.of(
        primitive(rectangle((2.0, 0.0, 1.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))),
        primitive(rectangle((1.0, 1.0, 1.0), (1.0, 0.0, 0.0), (0.0, 0.0, 1.0))),
    )
    found = _pieces(scene, receiver((1.0, -0.5, 0.5)))
    lines = found.lines
    touching = np.asarray(lines.seen) & (np.asarray(lines.behind) >= 0)
    assert touching.any()
    assert not np.asarray(lines.cut)[touching].any()


def test_a_box_on_the_floor_cuts_the_floor_off():
    scene = Scene.of(
        primitive(plane((0.0, 0.0, 0.0), (0.0, 0.0, 1.0))),
        primitive(box((1.0, -1.0, 0.0), (2.0, 1.0, 1.0))),
    )
    found = _pieces(scene, receiver((0.0, 0.0, 0.5), (0.0, 1.0, 0.0)))
    lines = found.lines
    floor = scene.count - 1
    against = np.asarray(lines.seen) & (np.asarray(lines.behind) == floor)
    assert against.any()
    assert np.asarray(lines.cut)[against].all()


WALLS = [  # centre and half edges; both stand through the horizon, the first before the second
    ((2.0, 0.1, 0.2), (0.2, 0.8, 0.3), (0.1, -0.2, 0.7)),
    ((4.0, 0.9, 0.5), (0.3, 1.5, -0.2), (-0.2, 0.1, 1.1)),
]


def walls(scale):
    return Scene.of(*(primitive(rectangle(*scale * np.array(wall))) for wall in WALLS))


def seen_by_rays(wall, other):
    """Of each edge of a wall the share that is above the horizon and not behind the other wall."""
    (middle, u, v), (center, *sides) = np.array(WALLS[wall]), np.array(WALLS[other])
    corners = np.array([middle + a * u + b * v for a, b in ((-1, -1), (1, -1), (1, 1), (-1, 1))])
    s = (np.arange(10_000) + 0.5)[:, None] / 10_000
    p = corners[:, None] + s * (np.roll(corners, -1, 0) - corners)[:, None]
    # t p = center + x side + y side', for each point.
    planes = np.stack([p, *(np.broadcast_to(-side, p.shape) for side in sides)], -1)
    t, x, y = np.moveaxis(
        np.linalg.solve(planes, np.broadcast_to(center, p.shape)[..., None])[..., 0], -1, 0
    )
    hidden = (t > 0.0) & (t < 1.0) & (np.abs(x) < 1.0) & (np.abs(y) < 1.0)
    return np.mean((p[..., 2] > 0.0) & ~hidden, -1)


@pytest.mark.parametrize("scale", [1.0, 8.0])
def test_edges_are_seen_as_far_as_rays_see_them(scale):
    found = _pieces(walls(scale), receiver((0.0, 0.0, 0.0)))
    for wall, other in ((0, 1), (1, 0)):
        mine = np.asarray(found.lines.seen & (found.lines.owner == wall))
        middle, u, v = scale * np.array(WALLS[wall])
        start, end = np.asarray(found.start)[mine] - middle, np.asarray(found.end)[mine] - middle
        length = np.linalg.norm(end - start, axis=-1)
        # Ends lie on the edges, where one coordinate along a side is one.
        sides = np.linalg.lstsq(np.stack([u, v], 1), np.concatenate([start, end]).T)[0]
        np.testing.assert_allclose(np.max(np.abs(sides), 0), 1.0)
        whole = 2.0 * np.array([np.linalg.norm(side) for side in (u, v, u, v)])
        np.testing.assert_allclose(length.sum(), seen_by_rays(wall, other) @ whole, rtol=1e-3)
    farther = seen_by_rays(1, 0)
    assert np.count_nonzero((farther > 0.0) & (farther < 1.0)) == 3


def test_walls_that_shine_are_seen_like_others():
    here, dark = receiver((0.0, 0.0, 0.0)), walls(1.0)
    lit = Scene.of(
        *(primitive(rectangle(*np.array(wall)), emission=k) for k, wall in enumerate(WALLS, 1))
    )
    one, other = _pieces(lit, here), _pieces(dark, here)
    for name in ("seen", "owner", "behind", "cut"):
        np.testing.assert_array_equal(getattr(one.lines, name), getattr(other.lines, name))
    np.testing.assert_array_equal(one.above, other.above)


def on_horizon(wall):
    """The azimuths between which a wall stands on the horizon."""
    middle, u, v = np.array(WALLS[wall])
    x = np.linspace(-1.0, 1.0, 100_001)[:, None]
    y = -(middle[2] + x * u[2]) / v[2]
    p = (middle + x * u + y * v)[np.abs(y[:, 0]) <= 1.0]
    azimuth = np.arctan2(p[:, 1], p[:, 0])
    return azimuth.min(), azimuth.max()


def test_walls_stand_on_the_horizon_as_wide_as_they_are():
    found = _pieces(walls(1.0), receiver((0.0, 0.0, 0.0)))
    parts, above = np.diff(found.azimuths), np.asarray(found.above)
    (low, high), (start, end) = on_horizon(0), on_horizon(1)
    assert low < start < high < end
    np.testing.assert_allclose(parts[above == 0].sum(), high - low, rtol=0.0, atol=1e-4)
    np.testing.assert_allclose(parts[above == 1].sum(), end - high, rtol=0.0, atol=1e-4)


@pytest.mark.parametrize("nodes", [1, 4])
def test_nodes_on_straight_pieces_are_even_in_the_angle_of_sight(nodes):
    found = _pieces(walls(1.0), receiver((0.0, 0.0, 0.0)))
    p, v, w = (np.asarray(a) for a in found.on_lines(nodes))
    start, end = np.asarray(found.start), np.asarray(found.end)
    aside = np.cross(p - start[:, None], (end - start)[:, None])
    np.testing.assert_allclose(aside, 0.0, rtol=0.0, atol=1e-14)
    turned = np.linalg.norm(np.cross(p, v), axis=-1) / np.sum(p * p, -1)
    angle = np.arctan2(np.linalg.norm(np.cross(start, end), axis=-1), np.sum(start * end, -1))
    np.testing.assert_allclose(turned, np.repeat(angle[:, None], nodes, 1), rtol=1e-12)
    np.testing.assert_allclose(np.sum(w, 1), 1.0, rtol=1e-14)


def test_inside_a_closed_shape_nothing_is_sound():
    found = _pieces(balls((0.0, 0.0, 0.1), (0.0, 0.0, -9.0)), receiver((0.0, 0.0, 0.0)))
    assert not bool(found.sound)


@pytest.mark.parametrize("x", [0.0, 0.35])
def test_derivatives_are_finite_in_degenerate_places(x):
    """A ball over the pole, two that touch in direction, one that touches the horizon."""
    scene = Scene.of(
        *(primitive(sphere(c, 0.5)) for c in ((0.0, 0.0, 2.0), (1.0, 0.0, 2.0), (3.0, 0.0, 0.5)))
    )

    def total(x):
        found = visible_silhouettes(scene, receiver(jnp.array([0.0, 0.0, 0.0])).moved(x))
        return jnp.sum(found.arcs.first * found.rims.seen) + jnp.sum(found.azimuths)

    assert np.all(np.isfinite(jax.jit(jax.grad(total))(jnp.array([x, 0.0]))))


def test_many_parts_are_asked_for_in_blocks_and_get_the_same_answers(monkeypatch):
    """All at once they would take gigabytes."""
    scene = Scene.of(
        *(primitive(box((x, 0.1, 1.0), (x + 0.2, 0.5, 1.3))) for x in (-0.6, -0.2, 0.2)),
        primitive(sphere((0.0, 0.0, 2.0), 0.4)),
    )
    at = receiver((0.1, 0.0, 0.0))
    found = visible._outlines_from(scene, at)
    whole = visible._cut_outlines(found, at.axes)
    monkeypatch.setattr(visible, "ASKED", 100)
    parts = visible._cut_outlines(found, at.axes)
    assert np.any(whole.sides.seen)
    for one, other in zip(jax.tree.leaves(whole), jax.tree.leaves(parts), strict=True):
        np.testing.assert_array_equal(one, other)


LAMP = space.primitive(
    space.rectangle((0.0, 0.0, 2.0), (0.0, 0.5, 0.0), (0.5, 0.0, 0.0)), emission=1.0
)


@pytest.mark.parametrize("normal", [(0.0, 0.0, 0.0), (jnp.nan, 0.0, 1.0)])
def test_a_traced_receiver_without_a_normal_sees_nothing_that_is_known(normal):
    plate = space.rectangle((0.0, 0.1, 1.0), (0.2, 0.0, 0.0), (0.0, 0.2, 0.0))
    scene = space.Scene.of(LAMP, space.primitive(plate))

    @jax.jit
    def edges(normal):
        at = space.Receiver.at((0.0, 0.0, 0.0), normal)
        return space.boundary_gradient(scene, at), space.visible_silhouettes(scene, at).sound

    found, sound = edges(jnp.array(normal))
    assert jnp.isnan(found).all()
    assert not sound
    found, sound = edges(jnp.array([0.0, 0.0, 1.0]))
    assert jnp.isfinite(found).all()
    assert sound
