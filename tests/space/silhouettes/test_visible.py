"""What is seen beside an edge: hidden, shared, touching and cut-off pieces."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from firstorder.space import (
    Scene,
    box,
    plane,
    primitive,
    receiver,
    rectangle,
    sphere,
    visible_silhouettes,
)


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
