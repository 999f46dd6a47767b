"""Wrong uses that once gave a plausible number, or words from inside of JAX: now one sentence each.

An error where nothing sensible can be meant; a warning where something can. Below are the table,
what becomes of the same under `jit`, and what is simply taken now. `docs/what_can_go_wrong.md` is
this table for readers.
"""

import os
import pathlib
import re
import subprocess
import sys

import equinox as eqx
import jax
import jax.numpy as jnp
import jaxlib
import numpy as np
import pytest

from firstorder import flatland, session, space
from firstorder.errors import NoLight
from firstorder.fields import Constant, Function, gaussian
from firstorder.flatland import bounces as flatland_bounces
from firstorder.flatland.library import describe_scene, named_scene
from firstorder.io import read_scene
from firstorder.numerics import free_of, positive
from firstorder.space import bounces as space_bounces

DOCUMENT = pathlib.Path(__file__).parent.parent / "docs" / "what_can_go_wrong.md"

DOWN, UP = flatland.Segments((1.0, 1.0), (-1.0, 1.0)), flatland.Segments((-1.0, 1.0), (1.0, 1.0))
LAMP = flatland.primitive(DOWN, name="lamp", emission=1.0)
FLAT = flatland.Scene.of(LAMP)
PANEL = space.rectangle((0.0, 0.0, 1.0), (0.0, 0.5, 0.0), (0.5, 0.0, 0.0))
SPACE = space.Scene.of(space.primitive(PANEL, emission=1.0))
HERE, THERE = flatland.Receiver.at((0.0, 0.0)), space.Receiver.at((0.0, 0.0, 0.0))
BALL = flatland.Scene.of(LAMP, flatland.primitive(flatland.Circles((0.0, 0.0), 0.5), name="ball"))
FIELD = gaussian((0.0, 0.0), (1.0, 1.0))
HIGH = space.Receiver.at((0.0, 0.0, 0.5), (1.0, 0.0, 0.0))

DARK = (
    "Nothing in the scene shines, so no light arrives: give a primitive an `emission`, or the "
    "scene an `environment`."
)
AWAY = (
    "All that shines turns its dark side or its edge to the receiver, so no light arrives: give "
    "`primitive` a point to look at, `facing=`, or `two_sided=True`."
)
INSIDE = (
    "The receiver lies inside of shape 1 (`ball`) and all that shines outside of it, so no light "
    "arrives."
)
COLLISION = (
    "Shapes 1 and 0 run into each other and send unlike light: exact integrals do not know the "
    "line in which they meet. Move them apart, or let one end at the other."
)
MANY = "Argument `at` must be one receiver, but holds (4,) of them: ask for each by jax.vmap."
MANY_SCENES = (
    "Argument `scene` must be one scene, but holds (4,) of them: ask for each by jax.vmap."
)
RAY = (
    "must be one ray, the 2 coordinates x, theta, but has shape (): for many rays call the field "
    "itself, or `jets`."
)
NAMES = (
    "Argument `name` must be one of scene_a, scene_b, scene_c, scene_d, fig14_white, fig14_black, "
    "fig14_none, fig15, r07_fig09, r07_fig16, r07_fig17, e11_fig03, e11_fig07, e11_fig18a, "
    "e11_fig18b, but is 'scene_dd': did you mean 'scene_d'?"
)


def a_file(name, text):
    """A scene file in a folder of its own."""

    def make(folder):
        path = folder / name
        path.write_text(text)
        return read_scene(path)

    return make


def sunk(shape, lamp=PANEL):
    """A dark shape and a lamp that runs into it."""
    return space.Scene.of(space.primitive(shape), space.primitive(lamp, emission=1.0))


def dark(world, shape, at):
    return world.irradiance(world.Scene.of(world.primitive(shape)), at)


def away(make):
    return make(flatland.Scene.of(flatland.primitive(UP, emission=1.0)), HERE)


def away_in_space():
    panel = space.rectangle((0.0, 0.0, 1.0), (0.5, 0.0, 0.0), (0.0, 0.5, 0.0))
    return space.irradiance(space.Scene.of(space.primitive(panel, emission=1.0)), THERE)


KEY = jax.random.key(0)
DARK_FLAT = flatland.Scene.of(flatland.primitive(DOWN))
DARK_SPACE = space.Scene.of(space.primitive(PANEL, albedo=0.5))


def many(world, dims):
    return world.Receiver.at(np.zeros((4, dims)))


def many_scenes(world):
    """Four scenes in one, as `jax.vmap` makes them."""
    lamp = DOWN if world is flatland else PANEL
    return jax.vmap(lambda L: world.Scene.of(world.primitive(lamp, emission=L)))(jnp.arange(4.0))


# Wrong use: (what is done, what is raised or warned of, the sentence).
WRONG = {
    "a scene in which nothing shines": (lambda: dark(flatland, DOWN, HERE), NoLight, DARK),
    "a scene of space in which nothing shines": (
        lambda: dark(space, PANEL, THERE),
        NoLight,
        DARK,
    ),
    "a sky that is black": (
        lambda: flatland.irradiance(
            flatland.Scene.of(flatland.primitive(DOWN), environment=flatland.ConstantSky(0.0)), HERE
        ),
        NoLight,
        DARK,
    ),
    "paths in a dark scene": (
        lambda: flatland_bounces.path_irradiance(DARK_FLAT, HERE, key=KEY, paths=2),
        NoLight,
        DARK,
    ),
    "rays in a dark scene": (
        lambda: flatland_bounces.path_radiance(
            DARK_FLAT, np.zeros(2), np.array((0.0, 1.0)), key=KEY, paths=2
        ),
        NoLight,
        DARK,
    ),
    "trees in a dark scene": (
        lambda: flatland_bounces.tree_irradiance(DARK_FLAT, HERE, key=KEY, branches=(2,), runs=2),
        NoLight,
        DARK,
    ),
    "photons of a dark scene": (
        lambda: flatland_bounces.trace_photons(DARK_FLAT, KEY, 4, 1),
        NoLight,
        DARK,
    ),
    "radiosity of a dark scene": (
        lambda: flatland_bounces.solve_radiosity(DARK_FLAT),
        NoLight,
        DARK,
    ),
    "a light field of a dark scene": (lambda: flatland.light_field(DARK_FLAT, HERE), NoLight, DARK),
    "paths in a dark scene of space": (
        lambda: space_bounces.path_irradiance(DARK_SPACE, THERE, key=KEY, paths=2),
        NoLight,
        DARK,
    ),
    "rays in a dark scene of space": (
        lambda: space_bounces.path_radiance(
            DARK_SPACE, np.zeros(3), np.array((0.0, 0.0, 1.0)), key=KEY, paths=2
        ),
        NoLight,
        DARK,
    ),
    "radiosity of a dark scene of space": (
        lambda: space_bounces.solve_radiosity(DARK_SPACE, cells=2, shadow=0),
        NoLight,
        DARK,
    ),
    "a light field of a dark scene of space": (
        lambda: space.light_field(DARK_SPACE, THERE),
        NoLight,
        DARK,
    ),
    "derivatives of the light of a dark scene": (
        lambda: flatland.derivatives(
            flatland.irradiance, flatland.Scene.of(flatland.primitive(DOWN)), HERE
        ),
        NoLight,
        DARK,
    ),
    "a lamp that shows its back": (lambda: away(flatland.irradiance), NoLight, AWAY),
    "a lamp of space that shows its back": (away_in_space, NoLight, AWAY),
    "a receiver in the plane of the only lamp": (
        lambda: space.irradiance(SPACE, space.Receiver.at((0.0, 0.0, 1.0))),
        NoLight,
        AWAY,
    ),
    "a receiver inside of a body": (lambda: flatland.irradiance(BALL, HERE), NoLight, INSIDE),
    "a lamp that dips into a ball": (
        lambda: space.irradiance(sunk(space.sphere((0.5, 0.0, 1.0), 0.3)), THERE),
        ValueError,
        COLLISION,
    ),
    "two floors in one place, of which one shines": (
        lambda: space.irradiance(
            sunk(
                space.plane((0.0, 0.0, 0.0), (0.3, 0.1, 0.7)),
                space.plane((0.0, 0.0, 0.0), (0.9, 0.3, 2.1)),
            ),
            HIGH,
        ),
        ValueError,
        COLLISION,
    ),
    "the number of a shape that is not there": (
        lambda: flatland.Receiver.on_shape(FLAT, 7, 0.5),
        ValueError,
        "Argument `index` must be the number of a shape, 0 to 0, but is 7.",
    ),
    "the same in space": (
        lambda: SPACE.normal(5, jnp.zeros(3)),
        ValueError,
        "Argument `index` must be the number of a shape, 0 to 0, but is 5.",
    ),
    "a receiver on a shape that is not there": (
        lambda: space.irradiance(SPACE, space.Receiver.at((0.0, 0.0, 0.0), on=9)),
        ValueError,
        "Argument `on` must be the number of a shape, 0 to 0, but is 9.",
    ),
    "half a shape": (
        lambda: flatland.Receiver.at((0.0, 0.0), on=0.5),
        TypeError,
        "Argument `on` must be a shape's number, an integer, but is 0.5.",
    ),
    "a shape's name for its number": (
        lambda: flatland.Receiver.at((0.0, 0.0), on="lamp"),
        TypeError,
        "Argument `on` must be a shape's number, but is 'lamp': write scene.named('lamp')[0].",
    ),
    "the tuple that `named` gives for a number": (
        lambda: flatland.Receiver.on_shape(FLAT, FLAT.named("lamp"), 0.5),
        TypeError,
        "Argument `index` must be a shape's number, but is (0,): write scene.named('floor')[0] "
        "for the first of that name.",
    ),
    "a place beyond a shape's end": (
        lambda: flatland.Receiver.on_shape(FLAT, 0, 3.0),
        ValueError,
        "Argument `s` must lie in [0, 1], but is 3.0.",
    ),
    "many places on a shape at once": (
        lambda: flatland.Receiver.on_shape(FLAT, 0, jnp.linspace(0.0, 1.0, 4)),
        ValueError,
        "Argument `s` must be one number, but has shape (4,).",
    ),
    "a normal in degrees": (
        lambda: flatland.Receiver.at((0.0, 0.0), 45.0),
        UserWarning,
        "Argument `normal` is an angle of 45 rad, 7.2 turns: angles are in radians.",
    ),
    "a normal's angle in degrees": (
        lambda: flatland.Receiver((0.0, 0.0), 45),
        UserWarning,
        "Argument `n` is an angle of 45 rad, 7.2 turns: angles are in radians.",
    ),
    "an arc in degrees": (
        lambda: flatland.Arcs((0.0, 0.0), 1.0, 90.0, 1.0),
        UserWarning,
        "Argument `start` is an angle of 90 rad, 14.3 turns: angles are in radians.",
    ),
    "an ellipse tilted in degrees": (
        lambda: flatland.Ellipses((0.0, 0.0), (1.0, 0.5), 30.0),
        UserWarning,
        "Argument `tilt` is an angle of 30 rad, 4.8 turns: angles are in radians.",
    ),
    "an infinite coordinate": (
        lambda: flatland.Segments((np.inf, 0.0), (1.0, 1.0)),
        ValueError,
        "Argument `start` must be finite, but is inf.",
    ),
    "a complex coordinate": (
        lambda: flatland.Segments((1j, 0.0), (1.0, 1.0)),
        ValueError,
        "Argument `start` must be real, but is complex.",
    ),
    "a complex place": (
        lambda: space.Receiver.at((1j, 0.0, 0.0)),
        ValueError,
        "Argument `position` must be real, but is complex.",
    ),
    "complex light": (
        lambda: flatland.primitive(DOWN, emission=1j),
        ValueError,
        "Argument `emission` must be real, but is complex.",
    ),
    "a segment of no length": (
        lambda: flatland.Segments([(0.0, 0.0), (1.0, 1.0)], [(1.0, 0.0), (1.0, 1.0)]),
        ValueError,
        "Argument `end` must differ from `start`, but segment 1 has no length.",
    ),
    "one number for a ray": (
        lambda: FIELD.jet(0.3),
        ValueError,
        f"Argument `u` of Gaussian {RAY}",
    ),
    "one number for a ray of any function": (
        lambda: Function(lambda x, v: x * v).at(0.3),
        ValueError,
        f"Argument `u` of Function {RAY}",
    ),
    "a single ray for many": (
        lambda: flatland.nearest(FLAT, [0.0, 0.0], [0.0, 1.0]),
        ValueError,
        "Argument `origins` must have shape (rays, 2), but has (2,): a single ray is one row.",
    ),
    "a sky of other bands": (
        lambda: space.Scene.of(
            space.primitive(PANEL, emission=(1.0, 0.5, 0.2)), environment=np.ones(4)
        ),
        ValueError,
        "All that has bands must have equally many, but there are things of 3 and 4.",
    ),
    "bands for a field": (
        lambda: flatland.light_field(
            flatland.Scene.of(LAMP, environment=flatland.ConstantSky((1.0, 0.5, 0.2))), HERE
        ),
        ValueError,
        "Argument `scene` must have no bands here, but has 3: ask for each, scene.band(0) and so "
        "on.",
    ),
    "a colour for a field": (
        lambda: Constant((1.0, 0.5, 0.2)),
        ValueError,
        "Argument `height` must be one number, but has shape (3,).",
    ),
    "text for a field's number": (
        lambda: gaussian("a", (1.0, 1.0)),
        TypeError,
        "A number or an array is asked for, but 'a' is given.",
    ),
    "text for a count": (
        lambda: flatland.irradiance(FLAT, HERE, nodes="16"),
        ValueError,
        "Argument `nodes` must be a positive integer, but is '16'.",
    ),
    "no nodes": (
        lambda: space.irradiance(SPACE, THERE, nodes=0),
        ValueError,
        "Argument `nodes` must be a positive integer, but is 0.",
    ),
    "a receiver of the other world": (
        lambda: flatland.irradiance(FLAT, THERE),
        TypeError,
        "Argument `at` must be a Receiver of flatland, but is a Receiver of space.",
    ),
    "a scene of the other world": (
        lambda: space.irradiance(FLAT, THERE),
        TypeError,
        "Argument `scene` must be a Scene of space, but is a Scene of flatland.",
    ),
    "three coordinates in flatland": (
        lambda: flatland.Receiver((0.0, 0.0, 0.0), 0.0),
        ValueError,
        "Argument `position` must have two coordinates, but has shape (3,).",
    ),
    "two coordinates in space": (
        lambda: space.Receiver.at((0.0, 0.0)),
        ValueError,
        "Argument `position` must have three coordinates, but has shape (2,).",
    ),
    "a normal for its angle": (
        lambda: flatland.Receiver((0.0, 0.0), (0.0, 1.0)),
        ValueError,
        "Argument `n` must have shape (), but has (2,): write Receiver.at(position, normal).",
    ),
    "a normal for a frame": (
        lambda: space.Receiver((0.0, 0.0, 0.0), (0.0, 0.0, 1.0), np.zeros((2, 2))),
        ValueError,
        "Argument `axes` must have shape (3, 3), but has (3,): "
        "write Receiver.at(position, normal).",
    ),
    "many receivers in one call": (
        lambda: flatland.irradiance(FLAT, many(flatland, 2)),
        ValueError,
        MANY,
    ),
    "many receivers of space in one call": (
        lambda: space.irradiance(SPACE, many(space, 3)),
        ValueError,
        MANY,
    ),
    "many scenes in one call": (
        lambda: flatland.irradiance(many_scenes(flatland), HERE),
        ValueError,
        MANY_SCENES,
    ),
    "many scenes of space in one call": (
        lambda: space.irradiance(many_scenes(space), THERE),
        ValueError,
        MANY_SCENES,
    ),
    "a scene that nobody knows": (lambda: named_scene("scene_dd"), ValueError, NAMES),
    "a description of a scene that nobody knows": (
        lambda: describe_scene("scene_dd"),
        ValueError,
        NAMES,
    ),
    "a shape that nobody knows": (
        lambda: FLAT.named("lmp"),
        ValueError,
        "Argument `name` must be one of lamp, but is 'lmp': did you mean 'lamp'?",
    ),
    "a class of a drawing, misspelt": (
        a_file(
            "room.svg",
            '<svg viewBox="0 0 2 2"><line class="lihgt" x1="0" y1="0" x2="1" y2="0"/></svg>',
        ),
        ValueError,
        "room.svg, line 1, <line>: the class `lihgt` is not known here: did you mean `light`?",
    ),
    "a scene of space read as one of flatland": (
        a_file("room.toml", 'dimensions = 3\n[[shape]]\nkind = "sphere"\n'),
        ValueError,
        "room.toml: the scene is one of space (`dimensions = 3`): read it by read_space.",
    ),
}


@pytest.mark.smoke
@pytest.mark.parametrize("name", WRONG)
def test_a_wrong_use_is_one_sentence(name, tmp_path):
    use, kind, sentence = WRONG[name]
    give = (tmp_path,) if use.__code__.co_argcount else ()
    if issubclass(kind, Warning):
        with pytest.warns(kind) as found:
            use(*give)
        assert [str(w.message) for w in found] == [sentence]
    else:
        # With the import hook beartype is first where an annotation is wrong; without it
        # (`make smoke`) the sentences are ours.
        words = rf"^{re.escape(sentence)}(\n|$)|violates type hint"
        with pytest.raises((kind, TypeError), match=words):
            use(*give)


# --- under jit, where numbers are not known ------------------------------------------------------


@pytest.mark.parametrize("name", ["one number for a ray", "many receivers in one call"])
def test_shapes_are_known_under_jit_too(name):
    use = {
        "one number for a ray": lambda x: FIELD.jet(x).value,
        "many receivers in one call": lambda x: flatland.irradiance(
            FLAT, flatland.Receiver(jnp.zeros((4, 2)), jnp.full(4, x))
        ),
    }[name]
    words = re.escape(WRONG[name][2]) + "|violates type hint"
    with pytest.raises((ValueError, TypeError), match=words):
        jax.jit(use)(0.3)


NAN = {
    "a negative radius": lambda x: flatland.irradiance(
        flatland.Scene.of(LAMP, flatland.primitive(flatland.Circles((0.0, 0.5), x - 0.3))), HERE
    ),
    "a negative radius in space": lambda x: space.irradiance(
        space.Scene.of(
            space.primitive(PANEL, emission=1.0),
            space.primitive(space.sphere((0.0, 0.0, 0.5), x - 0.3)),
        ),
        THERE,
    ),
    "a receiver inside of a body of space": lambda x: space.irradiance(
        space.Scene.of(
            space.primitive(PANEL, emission=1.0), space.primitive(space.sphere((x, 0.0, 0.0), 0.5))
        ),
        THERE,
    ),
    "a lamp of space whose edge dips into a ball": lambda x: space.irradiance(
        space.Scene.of(
            space.primitive(PANEL, emission=1.0),
            space.primitive(space.sphere((0.5, 0.0, 0.8 + x), 0.1)),
        ),
        THERE,
    ),
}


@pytest.mark.smoke
@pytest.mark.parametrize("name", NAN)
def test_what_is_traced_and_wrong_is_nan(name):
    assert np.isnan(jax.jit(NAN[name])(0.2))
    assert np.isfinite(jax.jit(NAN[name])(0.7))


def test_nothing_is_looked_at_under_jit():
    dim = flatland.Scene.of(flatland.primitive(DOWN))
    assert jax.jit(lambda at: flatland.irradiance(dim, at))(HERE) == 0.0
    assert jax.vmap(lambda at: flatland.irradiance(BALL, at))(many(flatland, 2)).tolist() == [0] * 4


@pytest.mark.parametrize("scene", [BALL, flatland.Scene.of(flatland.primitive(DOWN))])
def test_what_is_concrete_inside_of_jit_is_looked_at(scene):
    with pytest.warns(NoLight):
        jax.jit(lambda x: x + flatland.irradiance(scene, HERE))(1.0)


# --- zeros that are answers ----------------------------------------------------------------------


def test_a_true_zero_has_no_warning():
    turned_away = flatland.Receiver.at((0.0, 0.0), (0.0, -1.0))
    assert abs(flatland.irradiance(FLAT, turned_away)) == 0.0
    wall = flatland.primitive(flatland.Segments((-9.0, 0.5), (9.0, 0.5)))
    assert flatland.irradiance(flatland.Scene.of(LAMP, wall), HERE) == 0.0
    on_the_lamp = flatland.Receiver.on_shape(FLAT, 0, 0.5)
    assert flatland.irradiance(FLAT, on_the_lamp) == 0.0


def test_a_circle_around_its_light_is_a_room():
    room = flatland.primitive(flatland.Circles((0.0, 0.5), 3.0))
    inside = flatland.irradiance(flatland.Scene.of(LAMP, room), HERE)
    assert inside == flatland.irradiance(FLAT, HERE) > 1.0
    glowing = flatland.primitive(flatland.Circles((0.0, 0.0), 0.5), emission=1.0, two_sided=True)
    np.testing.assert_allclose(flatland.irradiance(flatland.Scene.of(glowing), HERE), 2.0)
    point = flatland.PointLights((0.0, 0.2), 1.0)
    assert flatland.irradiance(flatland.Scene.of(room, points=point), HERE) > 1.0


def test_light_by_a_function_needs_no_emission():
    dim = flatland.Scene.of(flatland.primitive(DOWN))
    E = flatland.irradiance(dim, HERE, radiance=lambda index, s, front, along: jnp.ones(()))
    np.testing.assert_allclose(E, flatland.irradiance(FLAT, HERE))


# --- what is taken now ---------------------------------------------------------------------------


LISTS = {
    "rays": (lambda: flatland.nearest(FLAT, [[0.0, 0.0]], [[0.0, 1.0]]).t, [1.0]),
    "a step": (lambda: THERE.moved([0.1, 0.0]).position, [0.1, 0.0, 0.0]),
    "a tilt": (lambda: THERE.tilted([0.0, 0.0]).normal, [0.0, 0.0, 1.0]),
    "a displacement": (lambda: HERE.displaced([0.1, 0.2, 0.0]).position, [0.1, 0.2]),
    "cuts": (lambda: flatland.view(FLAT, HERE, cuts=[(0.0, 0.5)]).angles[2], 0.0),
}


@pytest.mark.smoke
@pytest.mark.parametrize("name", LISTS)
def test_a_list_is_an_array(name):
    """Without the import hook, by which an annotation says that it is none."""
    ask, value = LISTS[name]
    try:
        np.testing.assert_allclose(ask(), value, rtol=0.0, atol=1e-12)
    except TypeError as error:
        assert re.search("violates type hint", str(error))  # noqa: PT017


@pytest.mark.parametrize(("world", "dims"), [(flatland, 2), (space, 3)])
def test_many_receivers_are_mapped_over(world, dims):
    scene = {2: FLAT, 3: SPACE}[dims]
    positions = 0.1 * np.arange(4.0 * dims).reshape(4, dims) - 0.5
    one = world.Receiver.at(positions[2])
    batch = world.Receiver.at(positions, on=-1)
    E = jax.vmap(lambda at: world.irradiance(scene, at))(batch)
    np.testing.assert_allclose(E[2], world.irradiance(scene, one), rtol=1e-12)
    assert batch.on.shape == (4,)


def test_one_angle_and_one_shape_stand_for_many_positions():
    batch = flatland.Receiver(np.zeros((4, 2)), 0.1, 0)
    assert batch.n.shape == batch.on.shape == (4,)
    E = jax.vmap(lambda at: flatland.irradiance(BALL, at))(batch)
    assert E.shape == (4,)


@pytest.mark.smoke
def test_fields_and_their_methods_can_be_jitted():
    light = flatland.light_field(FLAT, HERE)
    for field in (FIELD, light):
        u = jnp.array([0.1, 0.2])
        np.testing.assert_allclose(jax.jit(field)(0.1, 0.2), field(0.1, 0.2))
        np.testing.assert_allclose(jax.jit(field.at)(u), field.at(u))
        jax.tree.map(np.testing.assert_allclose, jax.jit(field.jet)(u), field.jet(u))
    spectrum = FIELD.spectrum()
    np.testing.assert_allclose(jax.jit(spectrum.at)(u), spectrum.at(u))


def test_a_method_is_equal_to_itself_and_a_tree_of_its_field():
    twin = gaussian((0.0, 0.0), (1.0, 1.0))
    assert FIELD.jet == FIELD.jet
    assert FIELD.jet != twin.jet
    assert FIELD.jet != FIELD.at
    assert twin != FIELD
    assert len(jax.tree.leaves(FIELD.jet)) == len(jax.tree.leaves(FIELD)) > 0
    assert jax.jit(lambda f: f(jnp.zeros(2)))(FIELD.at) == 1.0


def test_a_scene_can_be_differentiated_as_it_is():
    beams = flatland.primitive(
        flatland.Segments([(-1.0, 0.4), (-0.9, 0.6)], [(0.2, 0.6), (0.1, 0.4)]), emission=0.5
    )
    scene = flatland.Scene.of(LAMP, beams)
    assert scene.crossings.pairs.tolist() == [[1, 2]]
    slope = jax.grad(flatland.irradiance)(scene, HERE)
    brighter = eqx.tree_at(lambda s: s.material.emission, scene, 2.0 * scene.material.emission)
    rate = jnp.sum(slope.material.emission * scene.material.emission)
    twice, once = (flatland.irradiance(s, HERE) for s in (brighter, scene))
    np.testing.assert_allclose(twice - once, rate, rtol=1e-12)


@pytest.mark.parametrize("x", [1e-6, 0.05, 1.0, 80.0])
def test_positive_and_its_inverse(x):
    np.testing.assert_allclose(positive(free_of(x, 0.1), 0.1), x, rtol=1e-9)
    assert positive(-5.0) > 0.0
    assert abs(positive(50.0, 0.1) - 50.0) < 1e-12
    assert np.isnan(jax.jit(free_of)(-x))
    with pytest.raises(ValueError, match=r"^Argument `x` must be positive, but is"):
        free_of(-x)


FLOOR = space.rectangle((0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0))


@pytest.mark.parametrize(
    "none", [flatland.Segments(np.zeros((0, 2)), np.zeros((0, 2))),
             space.Rectangles(np.zeros((0, 3)), np.zeros((0, 3, 3)))],
)  # fmt: skip
def test_primitives_of_no_shape_are_refused(none):
    world = flatland if isinstance(none, flatland.Segments) else space
    with pytest.raises(ValueError, match=r"^Argument `shape` must hold at least one shape"):
        world.primitive(none)


def test_radiosity_in_space_refuses_glossy_surfaces_that_it_would_leave_out():
    shiny = space.primitive(FLOOR, albedo=0.3, specular=0.5, exponent=9.0)
    scene = space.Scene.of(space.primitive(PANEL, emission=1.0), shiny)
    with pytest.raises(ValueError, match="must be diffuse, but holds a surface with `specular`"):
        space_bounces.solve_radiosity(scene, cells=2)


# --- float32 kept by accident --------------------------------------------------------------------

LATE = """
import warnings
import jax.numpy as jnp
from firstorder import session
{first}
with warnings.catch_warnings(record=True) as found:
    warnings.simplefilter("always")
    session.start(cache="off")
    session.start(cache="off")
print([str(w.message) for w in found])
"""
LATE_WORDS = (
    "Arrays made before session.start() keep float32 (1 of them): call it in the first lines of "
    "the program."
)


TOO_LATE = (
    "JAX already ran before session.start(), too late for the flag "
    "--xla_cpu_experimental_ynn_fusion_type= that keeps this jaxlib from wrong sums: call it "
    "first, or set XLA_FLAGS."
)
NO_START = """
import warnings
from firstorder import session
from firstorder.flatland import Receiver, Scene, Segments, irradiance, primitive
with warnings.catch_warnings(record=True) as found:
    warnings.simplefilter("always")
    {first}
    lamp = primitive(Segments((1.0, 1.0), (-1.0, 1.0)), emission=1.0)
    irradiance(Scene.of(lamp), Receiver.at((0.0, 0.0)))
print([str(w.message) for w in found])
"""
SINGLE = (
    "Numbers are float32, of which derivatives lose digits: call firstorder.session.start() first, "
    "or start(x64=False) if they are meant to be."
)


def said(program, **flags):
    """Output of a fresh process, without the flags of this one."""
    environment = {k: v for k, v in os.environ.items() if k != "XLA_FLAGS"} | flags
    command = [sys.executable, "-c", program]
    done = subprocess.run(command, capture_output=True, text=True, env=environment)
    assert done.returncode == 0, done.stderr
    return done.stdout.strip()


# In a fresh process, as users call: here wrong types are refused before the library sees them.
COUNTS = """
import jax
import numpy as np
from firstorder import flatland, io, models, sampling, shadowfield, space
from firstorder.caching import derivative_norm
from firstorder.flatland import bounces as b2
from firstorder.imaging import pixel_grid
from firstorder.numerics import gauss_legendre
from firstorder.space import bounces as b3
from firstorder.space.azimuthal import visibility_by_azimuth
flat = flatland.Scene.of(
    flatland.primitive(flatland.Segments((1.0, 1.0), (-1.0, 1.0)), emission=1.0))
panel = space.rectangle((0.0, 0.0, 1.0), (0.0, 0.5, 0.0), (0.5, 0.0, 0.0))
deep = space.Scene.of(space.primitive(panel, emission=1.0))
here, there = flatland.Receiver.at((0.0, 0.0)), space.Receiver.at((0.0, 0.0, 0.0))
key = jax.random.key(0)
for name, ask in (
    ("paths", lambda n: b3.path_irradiance(deep, there, key=key, paths=n)),
    ("lanes", lambda n: b3.path_irradiance(deep, there, key=key, paths=4, lanes=n)),
    ("bounces", lambda n: b2.path_irradiance(flat, here, key=key, paths=4, bounces=n)),
    ("branches", lambda n: b2.tree_irradiance(flat, here, key=key, branches=(n,), runs=2)),
    ("count", lambda n: b3.trace_photons(deep, key, n, 2)),
    ("count", lambda n: b2.trace_photons(flat, key, n, 2)),
    ("bounces", lambda n: b3.trace_photons(deep, key, 4, n)),
    ("cells", lambda n: b3.solve_radiosity(deep, cells=n)),
    ("bounces", lambda n: b3.solve_radiosity(deep, cells=2, bounces=n)),
    ("rays", lambda n: b3.solve_radiosity(deep, cells=2, bounces=2, rays=n)),
    ("shadow", lambda n: b3.solve_radiosity(deep, cells=2, shadow=n)),
    ("nodes", lambda n: b2.Discretization(nodes=n)),
    ("k", lambda n: b2.DensityEstimator(k=n)),
    ("mirrors", lambda n: flatland.mirror_irradiance(flat, here, mirrors=(n,))),
    ("nodes", lambda n: visibility_by_azimuth(deep, there, nodes=n)),
    ("most", lambda n: visibility_by_azimuth(deep, there, most=n)),
    ("nodes", gauss_legendre),
    ("count", sampling.midpoints),
    ("columns", lambda n: pixel_grid(n, 2)),
    ("p", lambda n: models.torus_knot(n, 3)),
    ("sides", lambda n: models.tree(8, forks=(2,), sides=3 + n)),
    ("count", lambda n: sampling.expected_fixed_radius(np.sign, [0.0], 1.0, n)),
    ("rays", lambda n: shadowfield.trace_shadow_rays(
        shadowfield.lamp_frame((0, 0, 1), (0, 1, 0), (1, 0, 0)), np.zeros((1, 3)), [n], None)),
    ("directions", lambda n: derivative_norm(np.ones((2, 2, 2)), 3, "mean", n)),
    ("harmonics", lambda n: flatland.closed_curve(np.eye(9, 2), n)),
    ("samples", lambda n: flatland.closed_curve(np.eye(9, 2), 2, n)),
):
    try:
        print(name, "gives", ask(2.5))
    except ValueError as error:
        print(str(error).startswith(f"Argument `{name}` must be "), "integer, but is" in str(error))
for write, scene in (
    (io.space_to_toml, flat), (io.space_to_mitsuba, flat), (io.flatland_to_toml, deep),
    (io.describe_space, flat),
):
    try:
        print(write(scene))
    except TypeError as error:
        print(str(error).startswith("Argument `s"), ", but is a Scene" in str(error))
"""


def test_counts_that_are_no_integers_and_scenes_of_the_other_world_are_named():
    assert set(said(COUNTS).splitlines()) == {"True True"}


SHAPES = """
import numpy as np
from firstorder import shadowfield
lamp, three = shadowfield.lamp_frame((0, 0, 1), (0, 1, 0), (1, 0, 0)), np.zeros((3, 3))
free = lambda a, b: (np.full(len(a), np.inf), np.full(len(a), -np.inf))
table, _ = shadowfield.trace_shadow_rays(lamp, three, [1, 2, 1], free)
for name, ask in (
    ("rays", lambda n: shadowfield.trace_shadow_rays(lamp, three, n, free)),
    ("albedo", lambda n: shadowfield.glossy_surface(three + 1.0, three + 1.0, albedo=n)),
    ("bounds", lambda n: shadowfield.sheared_shadow(
        lamp, table, three, 1.0, 0.1, np.zeros(3), bounds=(n, n))),
):
    try:
        print(name, "gives", ask(np.ones(2, int)))
    except ValueError as error:
        print(str(error) == f"Argument `{name}` must have shape (3,), but has (2,).")
"""


def test_what_is_not_one_for_each_receiver_is_named():
    assert set(said(SHAPES).splitlines()) == {"True"}


@pytest.mark.parametrize(("first", "words"), [("early = jnp.ones(3)", [LATE_WORDS]), ("", [])])
def test_arrays_made_before_the_session_are_told(first, words):
    assert said(LATE.format(first=first), XLA_FLAGS=flags_here()) == str(words)


def flags_here():
    """All that this version of jaxlib is started with."""
    return " ".join(session.flags_of(jaxlib.__version__))


def test_a_session_too_late_for_the_flag_of_sums_is_told():
    needed = any(flag.startswith(session.SOUND) for flag in flags_here().split())
    words = [TOO_LATE] if needed else []
    assert said(LATE.format(first="jnp.ones(3, int)")) == str(words)


@pytest.mark.parametrize(
    ("first", "words"),
    [("", [SINGLE]), ("session.start(x64=False)", []), ("session.start()", [])],
)
def test_float32_that_nobody_asked_for_is_told(first, words):
    assert said(NO_START.format(first=first)) == str(words)


# --- the document --------------------------------------------------------------------------------


def written(title):
    """Rows of the table below a heading of the document."""
    section = (
        DOCUMENT.read_text(encoding="utf-8").partition(f"## {title}\n")[2].partition("\n## ")[0]
    )
    header, _, *rows = re.findall(r"^\| (.+?) \| (.+?) \|$", section, re.M)
    assert header[0] == "wrong use"
    return dict(rows)


def test_the_document_says_these_sentences():
    errors = {n: words for n, (_, kind, words) in WRONG.items() if not issubclass(kind, Warning)}
    warned = {n: words for n, (_, kind, words) in WRONG.items() if issubclass(kind, Warning)}
    assert written("Errors") == errors
    assert written("Warnings") == warned | {
        "arrays made before `session.start()`": LATE_WORDS,
        "the session started after JAX ran": TOO_LATE,
        "light without `session.start()`": SINGLE,
    }
    assert written("Under `jit`") == dict.fromkeys(NAN, "NaN")
