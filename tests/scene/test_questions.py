"""What is looked at before a scene is asked for light, and who is told of what."""

import gc
import inspect
import sys
import warnings
from types import SimpleNamespace

import jax
import numpy as np
import pytest

from firstorder import flatland, space
from firstorder.errors import NoLight
from firstorder.scene import _questions as questions
from firstorder.scene._questions import check_lit, check_question, check_shines, warns_if_dark

UP = flatland.Segments((-1.0, 1.0), (1.0, 1.0))  # its front looks up
ACROSS = flatland.Segments((0.5, 0.5), (5.0, 0.5))  # from within the ball to far outside
BALL = flatland.Circles((0.0, 0.0), 1.0)
FLAT = flatland.Receiver.at((0.0, 0.0))
FLOOR = space.rectangle((0, 0, 1), (1, 0, 0), (0, 1, 0))  # likewise
SKY = flatland.ConstantSky(1.0)
DEEP = space.Receiver.at((0.0, 0.0, 0.0))


def flat(*primitives, **more):
    return flatland.Scene.of(*primitives, **more)


def told(check, *args, **named):
    """The warning that a check gives, and the empty text for none."""
    with warnings.catch_warnings(record=True) as found:
        warnings.simplefilter("always")
        check(*args, **named)
    assert all(one.category is NoLight for one in found)
    assert len(found) <= 1
    return str(found[0].message) if found else ""


def points(position, intensity):
    return flatland.PointLights(position, intensity)


# --- whether anything shines ---------------------------------------------------------------------

DARK, LIT = flatland.primitive(UP), flatland.primitive(UP, emission=1.0)
BACKLIT = flatland.primitive(UP, emission=(0.0, 1.0))
SHINING = {
    "nothing": (flat(DARK), False),
    "a front": (flat(DARK, LIT), True),
    "a back": (flat(DARK, BACKLIT), True),
    "one band": (flat(flatland.primitive(UP, emission=(0.0, 0.0, 0.5))), True),
    "no band": (flat(flatland.primitive(UP, emission=(0.0, 0.0, 0.0))), False),
    "a number for a sky": (space.Scene.of(space.primitive(FLOOR), environment=0.5), True),
    "a black number for a sky": (space.Scene.of(space.primitive(FLOOR), environment=0.0), False),
    "a sky": (flat(DARK, environment=flatland.ConstantSky(0.5)), True),
    "a sky of one band": (flat(DARK, environment=flatland.ConstantSky((0.0, 0.0, 0.5))), True),
    "a black sky": (flat(DARK, environment=flatland.ConstantSky(0.0)), False),
    "a sky that is a function": (flat(DARK, environment=lambda theta: 0.0 * theta), True),
    "a point": (flat(DARK, points=points((0.0, 3.0), 1.0)), True),
    "one of two points": (flat(DARK, points=points([(0.0, 3.0), (1.0, 3.0)], [0.0, 1.0])), True),
    "a point without light": (flat(DARK, points=points((0.0, 3.0), 0.0)), False),
    "nothing in space": (space.Scene.of(space.primitive(FLOOR)), False),
    "a front in space": (space.Scene.of(space.primitive(FLOOR, emission=2.0)), True),
}


@pytest.mark.parametrize("name", SHINING)
def test_a_scene_in_which_nothing_shines_is_told(name):
    scene, shines = SHINING[name]
    assert ("Nothing in the scene shines" in told(check_shines, scene)) == (not shines)
    assert told(check_shines, scene) == told(check_shines, scene=scene)


def test_what_is_no_scene_or_traced_is_not_looked_at():
    assert told(check_shines, None) == ""
    assert told(check_shines, SimpleNamespace(material=None)) == ""
    assert told(jax.jit(lambda s: (check_shines(s), s.material.albedo)[1]), flat(DARK)) == ""


def test_a_function_of_a_scene_asks_first_and_gives_what_it_gives():
    def added(scene, other=1.0):
        """Of a scene."""
        return scene.count + other

    asking = warns_if_dark(added)
    assert asking.__doc__ == "Of a scene."
    assert told(lambda: asking(flat(LIT), other=2.0)) == ""
    assert "Nothing" in told(lambda: asking(flat(DARK), other=2.0))
    assert "Nothing" in told(lambda: asking(scene=flat(DARK)))
    assert asking(flat(LIT), other=2.0) == 3.0


def test_lights_are_looked_at_once_and_forgotten_with_their_scene():
    scene = flat(LIT)
    assert questions._lights(scene) is questions._lights(scene)
    key = id(scene)
    assert key in questions._kept
    del scene
    gc.collect()
    assert key not in questions._kept


# --- from where ----------------------------------------------------------------------------------

GLOW = flatland.primitive(BALL, emission=(0.0, 1.0))
BLUE = flatland.primitive(UP, emission=(0.0, 0.0, 0.5))
GLASS = flatland.primitive(BALL, name="glass", albedo=0.5)
# Scene, receiver, and what is told of it.
SIDES = {
    "a front from behind": (flat(LIT), FLAT, "dark side"),
    "a front from before": (flat(LIT), flatland.Receiver.at((0.0, 2.0)), ""),
    "a back from behind": (flat(BACKLIT), FLAT, ""),
    "a back from before": (flat(BACKLIT), flatland.Receiver.at((0.0, 2.0)), "dark side"),
    "a front from its own plane": (flat(LIT), flatland.Receiver.at((5.0, 1.0)), "dark side"),
    "a back from its own plane": (flat(BACKLIT), flatland.Receiver.at((5.0, 1.0)), "dark side"),
    "the receiver's own shape": (flat(LIT), flatland.Receiver.at((0.0, 1.0), on=0), ""),
    "behind a front, under a sky": (flat(LIT, environment=SKY), FLAT, ""),
    "behind a front, and a point": (flat(LIT, points=points((0.0, 3.0), 1.0)), FLAT, ""),
    "behind a front, and a dark point": (flat(LIT, points=points((0.0, 3.0), 0.0)), FLAT, "dark"),
    "the inside of a ball": (flat(GLOW), FLAT, ""),
    "the outside of a ball lit inside": (flat(GLOW), flatland.Receiver.at((0.0, 3.0)), "dark side"),
    "a ball around, a lamp outside": (
        flat(GLASS, flatland.primitive(ACROSS, emission=(1.0, 1.0))), FLAT, "",
    ),  # it crosses the circle
    "a ball around, a lamp beyond": (
        flat(flatland.primitive(flatland.Segments((-1.0, 3.0), (1.0, 3.0)), emission=(1.0, 1.0)),
             GLASS), FLAT, "inside of shape 1 (`glass`)",
    ),
    "a ball around, a lamp inside": (
        flat(flatland.primitive(flatland.Segments((-0.1, 0.5), (0.1, 0.5)), emission=(1.0, 1.0)),
             GLASS), FLAT, "",
    ),
    "a ball far away around, a lamp inside": (
        flat(flatland.primitive(flatland.Segments((8.9, 0.5), (9.1, 0.5)), emission=(1.0, 1.0)),
             flatland.primitive(flatland.Circles((9.0, 0.0), 1.0))),
        flatland.Receiver.at((9.0, 0.0)), "",
    ),
    "one band of a front from before": (flat(BLUE), flatland.Receiver.at((0.0, 2.0)), ""),
    "one band of a front from behind": (flat(BLUE), FLAT, "dark side"),
    "a ball around, a sky": (flat(GLASS, environment=SKY), FLAT, "inside of shape 0 (`glass`)"),
    "a ball around and a segment, a sky": (flat(DARK, GLASS, environment=SKY), FLAT, "`glass`"),
    "a ball beside, a sky": (
        flat(flatland.primitive(flatland.Circles((3.0, 0.0), 1.0)), environment=SKY), FLAT, "",
    ),
    "on a ball, a sky": (
        flat(GLASS, environment=SKY), flatland.Receiver.at((0.0, 0.999), on=0), "",
    ),
    "a ball around, a point outside": (
        flat(GLASS, points=points((0.0, 2.0), 1.0)), FLAT, "inside of shape 0",
    ),
    "a ball around, a point inside": (flat(GLASS, points=points((0.0, 0.5), 1.0)), FLAT, ""),
    "a ball around, a dark point inside": (
        flat(GLASS, points=points([(0.0, 0.5), (0.0, 2.0)], [0.0, 1.0])), FLAT, "inside of shape",
    ),
    "a second ball around, a sky": (
        flat(flatland.primitive(flatland.Circles([(9.0, 0.0), (0.0, 0.0)], 1.0)), environment=SKY),
        FLAT, "inside of shape 1 and",
    ),
    "a second ball around, a point inside of the first": (
        flat(flatland.primitive(flatland.Circles([(9.0, 0.0), (0.0, 0.0)], 1.0)),
             points=points((9.0, 0.0), 1.0)), FLAT, "inside of shape 1 and",
    ),
    "a second ball around, a point inside of it": (
        flat(flatland.primitive(flatland.Segments((20.0, 0.0), (20.0, 1.0))),
             flatland.primitive(flatland.Circles([(9.0, 0.0), (0.0, 0.0)], 1.0)),
             points=points((0.0, 0.5), 1.0)), FLAT, "",
    ),
    "a front in space from behind": (
        space.Scene.of(space.primitive(FLOOR, emission=1.0)), DEEP, "dark side",
    ),
    "a front in space": (
        space.Scene.of(space.primitive(FLOOR, emission=1.0)), space.Receiver.at((0, 0, 2)), "",
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", SIDES)
def test_a_receiver_that_no_light_can_reach_is_told(name):
    scene, at, words = SIDES[name]
    found = told(check_lit, scene, at)
    assert words in found
    assert bool(words) == bool(found)
    assert told(check_lit, scene, at, radiance=lambda *_: 1.0) == ""
    assert told(check_question, scene, at) == ""


def test_nothing_that_shines_is_told_before_sides():
    assert "Nothing in the scene shines" in told(check_lit, flat(DARK, GLASS), FLAT)


def test_what_is_concrete_is_looked_at_inside_of_jit():
    seen = []

    @jax.jit
    def ask(x):
        seen.append(told(check_lit, *SIDES["a ball around, a point outside"][:2]))
        seen.append(told(check_lit, *SIDES["a ball around, a lamp inside"][:2]))
        return x

    ask(1.0)
    assert "inside of shape 0" in seen[0]
    assert not seen[1]


def test_single_precision_is_told_to_the_caller_of_the_public_function(monkeypatch):
    callers = []

    def told_of(level):
        callers.append(sys._getframe(level).f_code.co_name)

    def public(check, *given):
        return inspect.unwrap(check)(*given)

    def caller(*given):
        return public(*given)

    monkeypatch.setattr(questions, "warn_of_single_precision", told_of)
    caller(check_question, flat(LIT, environment=SKY), FLAT)
    caller(check_lit, flat(LIT, environment=SKY), FLAT)
    caller(check_shines, flat(LIT))
    assert callers == ["caller"] * 3


# --- numbers -------------------------------------------------------------------------------------


@pytest.mark.parametrize("check", [check_question, check_lit])
def test_numbers_of_shapes_and_nodes_are_checked(check):
    scene = flat(LIT, environment=SKY)
    for nodes in (0, -1):
        with pytest.raises(ValueError, match="`nodes`"):
            check(scene, FLAT, nodes=nodes)
    check(scene, FLAT, nodes=1)
    with pytest.raises(ValueError, match="`on` must be the number of a shape, 0 to 0, but is 1"):
        check(scene, flatland.Receiver.at((0.0, 0.0), on=1))
    with pytest.raises(ValueError, match="but is 3"):
        check(scene, flatland.Receiver.at((0.0, 0.0), on=3))


@pytest.mark.parametrize("check", [check_question, check_lit])
def test_what_is_no_scene_and_receiver_of_one_world_is_left_to_the_function(check):
    many = jax.vmap(lambda p: flatland.Receiver.at(p))(np.zeros((2, 2)))
    for scene, at in ((flat(DARK), DEEP), (flat(DARK), many), (flat(DARK), None), (None, FLAT)):
        assert told(check, scene, at) == ""
