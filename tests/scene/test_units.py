"""Light does not depend on the unit of length: scenes of picometres and of light years.

In another unit by a power of two every number keeps its digits, so that all answers must be the
same to the last bit, as long as lengths and derivatives themselves are in the range.
"""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from firstorder import flatland, space
from firstorder.checks.tolerance import normwise, rounding
from firstorder.flatland.shapes import _base
from firstorder.space.silhouettes import analytic

IN_FLATLAND = {
    "lamp": ((0.5, 1.0), (-0.5, 1.1)),
    "wall": ((-0.6, 0.4), (-0.4, 0.5)),
    "circle": ((0.1, 0.5), 0.1),
    "glow": ((-0.5, 0.8), 0.1),
    "arc": ((0.4, 0.7), 0.15),
    "ellipse": ((-0.2, 0.7), (0.1, 0.06)),
    "light": ((0.9, 0.6),),
    "at": ((0.05, 0.01),),
}


def light_in_flatland(p):
    """Irradiance among one shape of each kind, all of its lengths from outside."""
    of, shape = flatland.primitive, flatland
    scene = shape.Scene.of(
        of(shape.Segments(*p["lamp"]), emission=1.0),
        of(shape.Segments(*p["wall"])),
        of(shape.Circles(*p["circle"])),
        of(shape.Circles(*p["glow"]), emission=0.4),
        of(shape.Arcs(*p["arc"], 0.3, 2.5)),
        of(shape.Ellipses(*p["ellipse"], 0.3)),
    )
    return flatland.irradiance(scene, flatland.Receiver(*p["at"], 0.1))


def point_light(p):
    """Irradiance from a light without size, per unit of its intensity over the unit of length."""
    points = flatland.PointLights(*p["light"], 1.0)
    wall = flatland.primitive(flatland.Segments(*p["wall"]))
    scene = flatland.Scene.of(wall, points=points)
    return flatland.irradiance(scene, flatland.Receiver(*p["at"], 0.1))


IN_SPACE = {
    "lamp": ((0.0, 0.0, 2.0), (0.0, 0.5, 0.05), (0.5, 0.0, 0.1)),
    "ball": ((0.2, 0.1, 0.8), 0.3),
    "box": ((-0.5, -0.3, 0.5), (-0.2, 0.0, 0.9)),
    "triangle": ((-0.3, 0.4, 1.0), (0.1, 0.5, 1.2), (-0.1, 0.7, 0.9)),
    "cylinder": ((0.6, -0.4, 0.5), (0.7, -0.5, 1.1), 0.1),
    "disc": ((-0.2, -0.6, 0.9), (0.1, 0.2, 1.0), 0.2),
    "plane": ((3.0, 0.0, 0.0),),
    "at": ((0.05, 0.02, 0.0),),
}


def scene_in_space(p):
    """One shape of each kind, all of its lengths from outside, under a grey sky."""
    wall, up = (jnp.asarray(n, p["at"][0].dtype) for n in ((-1.0, 0.1, 0.0), (0.1, 0.2, 1.0)))
    return space.Scene.of(
        space.primitive(space.rectangle(*p["lamp"]), emission=1.0),
        space.primitive(space.sphere(*p["ball"])),
        space.primitive(space.box(*p["box"])),
        space.primitive(space.triangle(*p["triangle"])),
        space.primitive(space.cylinder(*p["cylinder"]), emission=0.3),
        space.primitive(space.disc(*p["disc"])),
        space.primitive(space.plane(*p["plane"], wall)),
        environment=0.1,
    ), space.receiver(*p["at"], up)


def light_in_space(p):
    """Irradiance there."""
    return space.irradiance(*scene_in_space(p))


# What is asked, the scene, the power of the unit that the answer has, and the powers of two that
# are tried as units: 1e-15 to 1e15, but for the point light, whose second derivative is 1/m^3.
ASKED = {
    "flatland": (light_in_flatland, IN_FLATLAND, 0, (-50, -20, 20, 50)),
    "point light": (point_light, IN_FLATLAND, -1, (-40, -20, 20, 40)),
    "space": (light_in_space, IN_SPACE, 0, (-50, -20, 20, 50)),
}
PRECISIONS = {"single": np.float32, "double": np.float64}


def answers(light):
    """Value, gradient by all lengths, and the change of that along all of them at once."""

    def along(p):
        way = jax.tree.map(lambda a: jnp.cos(3.0 * jnp.arange(a.size).reshape(a.shape)), p)
        way = jax.tree.map(lambda w, a: w.astype(a.dtype), way, p)
        (value, slope), (_, bend) = jax.jvp(jax.value_and_grad(light), (p,), (way,))
        return value, slope, bend

    return jax.jit(along)


def in_unit(asked, numbers, dtype, power, dimension):
    """What is asked in a scene that is 2^power times as large, in its own unit again."""
    one = np.asarray(2.0, dtype) ** power
    p = {name: [jnp.asarray(np.asarray(a, dtype) * one) for a in numbers[name]] for name in numbers}
    value, slope, bend = asked(p)
    own = [value / one**dimension]
    for k, tree in ((1, slope), (2, bend)):
        own += [np.asarray(a) * one ** (k - dimension) for a in jax.tree.leaves(tree)]
    return [np.asarray(a) for a in own]


@pytest.mark.parametrize("precision", PRECISIONS)
@pytest.mark.parametrize("name", ASKED)
def test_light_and_two_derivatives_are_the_same_in_every_unit(name, precision):
    light, numbers, dimension, units = ASKED[name]
    dtype = PRECISIONS[precision]
    asked = answers(light)
    ordinary = in_unit(asked, numbers, dtype, 0, dimension)
    assert ordinary[0] > 0.01
    assert {a.dtype for a in ordinary[1:]} == {np.dtype(dtype)}
    for power in units:
        found = in_unit(asked, numbers, dtype, power, dimension)
        for a, b in zip(found, ordinary, strict=True):
            np.testing.assert_array_equal(a, b)


@pytest.mark.parametrize("name", ["flatland", "space"])
def test_single_precision_agrees_with_double(name):
    light, numbers, *_ = ASKED[name]
    asked = answers(light)
    single = in_unit(asked, numbers, np.float32, 50, 0)
    double = in_unit(asked, numbers, np.float64, 0, 0)
    assert normwise(single[0], double[0]) < rounding(operations=10, dtype="float32")
    rest = [np.concatenate([a.ravel() for a in found[1:]]) for found in (single, double)]
    assert normwise(*rest) < rounding(operations=1000, dtype="float32")


def without_units(a):
    """A twin of `power_of_two` that leaves all numbers in metres."""
    return jnp.ones(a.shape[:-1], a.dtype)


TAKEN = {"flatland": _base, "space": analytic}


@pytest.mark.parametrize("name", TAKEN)
def test_fault_a_scene_that_is_left_in_metres(name, monkeypatch):
    monkeypatch.setattr(TAKEN[name], "power_of_two", without_units)
    with pytest.raises(AssertionError):
        test_light_and_two_derivatives_are_the_same_in_every_unit(name, "single")


# --- what else is asked of a scene ---------------------------------------------------------------


@pytest.mark.parametrize("power", ASKED["space"][-1])
def test_solid_angle_and_the_contour_gradient_are_the_same_in_every_unit(power):
    def asked(p):
        scene, at = scene_in_space(p)
        seen = space.visible_silhouettes(scene, at)
        lengths = seen.start, seen.end, seen.on_arcs(4)[0]
        return space.net_visibility(scene, at), space.boundary_gradient(scene, at), lengths, seen

    def of(power):
        one = np.float32(2.0) ** power
        p = {k: [jnp.asarray(np.float32(a) * one) for a in v] for k, v in IN_SPACE.items()}
        angle, gradient, (start, end, on_arcs), seen = found(p)
        straight, curved = (np.asarray(s.seen) for s in (seen.lines, seen.rims))
        lengths = start[straight], end[straight], on_arcs[curved]
        assert seen.sound
        assert np.any(np.abs(gradient) * one > 0.1)
        return [angle, gradient * one, *(a / one for a in lengths)]

    found = jax.jit(asked)
    for a, b in zip(of(power), of(0), strict=True):
        np.testing.assert_array_equal(a, b)


@pytest.mark.parametrize("power", ASKED["flatland"][-1])
def test_traced_shapes_that_cross_are_seen_in_every_unit(power):
    """A circle and a segment through a lamp; and neither of them."""

    def light(p, one):
        lamp = flatland.Segments(p[0], p[1])
        others = flatland.Circles(p[2], 0.2 * one), flatland.Segments(p[3], p[4])
        of = flatland.primitive
        scenes = [flatland.Scene.of(of(lamp, emission=1.0), of(other)) for other in others]
        at = flatland.Receiver(jnp.zeros(2, p.dtype), 0.0)
        return jnp.stack([flatland.irradiance(scene, at) for scene in scenes])

    one = np.float32(2.0) ** power
    p = np.float32([(0.5, 1.0), (-0.5, 1.0), (0.1, 1.05), (0.3, 0.8), (0.2, 1.2)])
    away = np.float32([(0.0, 0.0)] * 2 + [(0.0, -0.5)] * 3)
    assert np.all(np.isnan(jax.jit(light)(one * p, one)))
    assert np.all(np.isfinite(jax.jit(light)(one * (p + away), one)))


@pytest.mark.parametrize("power", ASKED["space"][-1])
def test_concrete_shapes_are_taken_in_every_unit(power):
    one = np.float32(2.0) ** power
    p = {k: [np.float32(a) * one for a in v] for k, v in IN_SPACE.items()}
    plain = {k: [np.float32(a) for a in v] for k, v in IN_SPACE.items()}
    assert space.irradiance(*scene_in_space(p)) == space.irradiance(*scene_in_space(plain))
    square = np.float32([(0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (1.0, 1.0, 0.0), (0.0, 1.0, 0.0)])
    np.testing.assert_array_equal(space.polygon(one * square).axes[:, :, 2], [(0, 0, 1)] * 2)
