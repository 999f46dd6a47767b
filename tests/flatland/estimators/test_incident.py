"""Light that arrives along rays, and what a receiver sees of shapes: by hand."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from firstorder.flatland import Circles, ConstantSky, Receiver, Scene, Segments, primitive
from firstorder.flatland.estimators._incident import incident_radiance, seen_from

# Shape 0 is a roof at y = 2, 1 a smaller one before it, 2 a ball around (5, 0).
ROOF, SCREEN = Segments((-2.0, 2.0), (2.0, 2.0)), Segments((-0.5, 1.0), (0.5, 1.0))
BALL = Circles((5.0, 0.0), 1.0)
SCENE = Scene.of(
    primitive(ROOF, emission=(1.0, 2.0)), primitive(SCREEN, emission=(3.0, 4.0)),
    primitive(BALL, emission=(5.0, 6.0)),
)  # fmt: skip
ask = jax.jit(seen_from)
framed = jax.jit(lambda scene, number, s: jax.vmap(scene.frame)(number, s))


def seen(scene, at, number, s):
    """Whether points of a shape are seen, by their parameters."""
    all_of_them = jnp.resize(jnp.asarray(s, float), 10)  # one size, so that programs are few
    number = jnp.full(10, number)
    return np.asarray(ask(scene, at, number, framed(scene, number, all_of_them)))[: len(s)].tolist()


def test_points_are_seen_unless_something_stands_before_them():
    """From the origin the screen hides |x| < 1 of the roof; parameters run from -2 to 2."""
    at = Receiver.at((0.0, 0.0))
    places = np.array([-2.0, -1.5, -1.01, -0.99, 0.0, 0.99, 1.01, 2.0])
    assert seen(SCENE, at, 0, (places + 2.0) / 4.0) == [True] * 3 + [False] * 3 + [True] * 2
    assert seen(SCENE, at, 1, [0.0, 0.3, 1.0]) == [True] * 3
    # From above the roof hides the screen.
    assert seen(SCENE, Receiver.at((0.0, 5.0)), 1, [0.0, 0.5, 1.0]) == [False] * 3


def test_of_a_ball_the_near_side_is_seen_from_outside_and_all_from_inside():
    """Parameters go clockwise from the top: a quarter is the right side."""
    outside = seen(SCENE, Receiver.at((0.0, 0.0)), 2, [0.25, 0.75, 0.6, 0.9, 0.1, 0.4])
    assert outside == [False, True, True, True, False, False]
    assert seen(SCENE, Receiver.at((5.3, 0.2)), 2, np.linspace(0.0, 0.9, 10)) == [True] * 10


def test_a_straight_shape_never_shows_itself_and_a_bent_one_does_from_within():
    on_roof = Receiver.on_shape(SCENE, 0, 0.25)
    assert seen(SCENE, on_roof, 0, [0.0, 0.25, 0.5, 1.0]) == [False] * 4
    assert seen(SCENE, Receiver.at((-1.0, 2.0)), 0, [0.25]) == [False]  # no way leads to itself
    scene = Scene.of(primitive(BALL))
    inside = Receiver.on_shape(scene, 0, 0.0)
    assert seen(scene, inside, 0, [0.5, 0.25, 1e-3]) == [True] * 3
    assert seen(scene, inside, 0, [0.0, 1e-9, 1.0 - 1e-9, 5e-8]) == [False] * 4


def test_distances_count_to_some_hundred_millionths():
    """What lies as close before a point is in its place, and of two in one place one counts."""
    for gap, free in ((1e-3, False), (1e-5, False), (0.0, None), (-1e-5, True)):
        near = Scene.of(primitive(ROOF), primitive(Segments((-2.0, 2.0 - gap), (2.0, 2.0 - gap))))
        first = seen(near, Receiver.at((0.1, 0.0)), 0, [0.6])[0]
        second = seen(near, Receiver.at((0.1, 0.0)), 1, [0.6])[0]
        if free is None:
            assert first != second
        else:
            assert (first, second) == (free, not free)


def test_what_lies_a_little_before_a_bent_point_hides_it_and_further_behind_does_not():
    """The whole of the tolerance is 5e-7 of the way."""
    at = Receiver.at((0.0, 0.0))
    for before, hidden in ((2e-6, True), (1e-7, True), (-2e-6, False)):
        y = 2.0 - before
        scene = Scene.of(primitive(ROOF), primitive(Segments((-0.1, y), (0.1, y))))
        assert seen(scene, at, 0, [0.5]) == [not hidden]


def test_the_very_end_of_a_shape_is_seen_whether_the_ray_meets_it_or_what_lies_behind():
    lone = Scene.of(primitive(Segments((0.3, 1.0), (0.7, 1.7))))
    backed = Scene.of(primitive(Segments((0.3, 1.0), (0.7, 1.7))), primitive(ROOF))
    for at in (Receiver.at((0.0, 0.0)), Receiver.at((0.11, 0.23)), Receiver.at((-0.7, 0.01))):
        assert seen(lone, at, 0, [0.0, 1.0]) == [True, True]
        assert seen(backed, at, 0, [0.0, 1.0]) == [True, True]


# --- radiance ------------------------------------------------------------------------------------


def incident(scene, radiance, index, front=True, along=(0.0, 1.0)):
    given = jnp.array(index), jnp.array(0.3), jnp.array(front), jnp.asarray(along)
    return float(incident_radiance(scene, radiance, *given))


@pytest.mark.parametrize("front", [True, False])
def test_shapes_send_what_their_side_emits(front):
    for number, emission in enumerate(((1.0, 2.0), (3.0, 4.0), (5.0, 6.0))):
        assert incident(SCENE, None, number, front) == emission[0 if front else 1]


def test_rays_that_meet_nothing_find_the_sky_or_the_dark():
    """The sky's angle is counter-clockwise from +y."""
    assert incident(SCENE, None, -1) == 0.0
    sky = Scene.of(primitive(ROOF, emission=7.0), environment=lambda theta: 2.0 + theta)
    for theta in (0.0, 0.4, -1.3, 2.8):
        along = (-np.sin(theta), np.cos(theta))
        assert incident(sky, None, -1, True, along) == pytest.approx(2.0 + theta)
        assert incident(sky, None, 0, True, along) == 7.0
    assert incident(Scene.of(primitive(ROOF), environment=ConstantSky(3.0)), None, -1) == 3.0


def test_a_radiance_that_is_given_is_asked_for_shape_place_side_and_direction():
    def radiance(number, s, front, along):
        return 100.0 * number + 10.0 * s + jnp.where(front, 1.0, 2.0) + 0.1 * along[0]

    assert incident(SCENE, radiance, 2, True, (0.6, 0.8)) == pytest.approx(204.06)
    assert incident(SCENE, radiance, 1, False, (-0.6, 0.8)) == pytest.approx(104.94)
    assert incident(SCENE, radiance, -1) == 0.0
