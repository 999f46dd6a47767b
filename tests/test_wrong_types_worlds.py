"""What a newcomer gives to the two worlds by mistake: one sentence that says what to write instead.

It comes where the thing is given, and types need no numbers, so it is the same under `jit`.

With the import hook beartype is first where an annotation is wrong; without it (`make smoke`) the
sentences are ours.
"""

import re

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from firstorder import flatland, space
from firstorder.flatland.bounces import pathtrace as flat_paths
from firstorder.flatland.estimators.strata import hemicircle_strata, trace_strata
from firstorder.space.azimuthal.transport import visibility_by_azimuth
from firstorder.space.bounces import pathtrace
from firstorder.space.silhouettes.visible import visible_silhouettes

SEGMENTS = flatland.Segments((1.0, 1.0), (-1.0, 1.0))
LAMP = flatland.primitive(SEGMENTS, emission=1.0)
FLAT = flatland.Scene.of(LAMP)
PANEL = space.rectangle((0.0, 0.0, 1.0), (0.0, 0.5, 0.0), (0.5, 0.0, 0.0))
SPACE = space.Scene.of(space.primitive(PANEL, emission=1.0))
HERE = {
    "flatland": flatland.Receiver.at((0.0, 0.0)),
    "space": space.Receiver.at((0.0, 0.0, 0.0)),
}
SCENES = {"flatland": FLAT, "space": SPACE}
KEY = jax.random.key(0)

REFUSED = {
    "a shape in a scene": (
        lambda: flatland.Scene.of(LAMP, SEGMENTS),
        "Argument 2 must be a primitive, but is a Segments: "
        "write primitive(Segments(...), emission=...).",
    ),
    "a shape in a scene of space": (
        lambda: space.Scene.of(PANEL),
        "Argument 1 must be a primitive, but is a Rectangles: "
        "write primitive(Rectangles(...), emission=...).",
    ),
    "a list in a scene": (
        lambda: flatland.Scene.of([LAMP]),
        "Argument 1 must be a primitive, but is a list: write Scene.of(*things).",
    ),
    "a list in a scene of space": (
        lambda: space.Scene.of([]),
        "Argument 1 must be a primitive, but is a list: write Scene.of(*things).",
    ),
    "a primitive of space in flatland": (
        lambda: flatland.Scene.of(space.primitive(PANEL)),
        "Argument 1 must be a primitive of flatland, but is a primitive of space.",
    ),
    "a primitive of flatland in space": (
        lambda: space.Scene.of(LAMP),
        "Argument 1 must be a primitive of space, but is a primitive of flatland.",
    ),
    "a number in a scene": (
        lambda: space.Scene.of(1.0),
        "Argument 1 must be a primitive, but is a float.",
    ),
    "a shape of space in flatland": (
        lambda: flatland.primitive(PANEL),
        "Argument `shape` must be a shape of flatland, but is a Rectangles of space.",
    ),
    "a shape of flatland in space": (
        lambda: space.primitive(SEGMENTS),
        "Argument `shape` must be a shape of space, but is a Segments of flatland.",
    ),
    "a tuple for a shape": (
        lambda: space.primitive((0.0, 0.0)),
        "Argument `shape` must be a shape, but is a tuple.",
    ),
    "a number for a sky of flatland": (
        lambda: flatland.Scene.of(LAMP, environment=1.0),
        "Argument `environment` must be a function of the angle, such as ConstantSky(1.0), "
        "but is 1.0.",
    ),
    "text for a sky": (
        lambda: space.Scene.of(space.primitive(PANEL), environment="white"),
        "Argument `environment` must be a number or an array, but is 'white'.",
    ),
    "text for light": (
        lambda: flatland.primitive(SEGMENTS, emission="bright"),
        "Argument `emission` must be a number or an array, but is 'bright'.",
    ),
    "text for light in space": (
        lambda: space.primitive(PANEL, emission="bright"),
        "Argument `emission` must be a number or an array, but is 'bright'.",
    ),
    "text for a mirror": (
        lambda: flatland.primitive(SEGMENTS, mirror="yes"),
        "Argument `mirror` must be a number or an array, but is 'yes'.",
    ),
    "text for a place": (
        lambda: flatland.Receiver.at("here"),
        "Argument `position` must be a number or an array, but is 'here'.",
    ),
    "text for a place in space": (
        lambda: space.Receiver.at("here"),
        "Argument `position` must be a number or an array, but is 'here'.",
    ),
    "text for an end": (
        lambda: flatland.Segments("left", (1.0, 1.0)),
        "A number or an array is asked for, but 'left' is given.",
    ),
    "derivatives at a tuple": (
        lambda: flatland.derivatives(flatland.irradiance, FLAT, (0.0, 0.0)),
        "The last argument must be a Receiver, but is of type tuple: "
        "write Receiver.at(position, normal).",
    ),
    "a scene's class given its things": (
        lambda: flatland.Scene([LAMP]),
        "A Scene of flatland holds groups, material, points, environment, crossings and names: "
        "write Scene.of(primitive(...), ...).",
    ),
    "the same in space": (
        lambda: space.Scene(space.primitive(PANEL), environment=1.0),
        "A Scene of space holds groups, material, environment and names: "
        "write Scene.of(primitive(...), ...).",
    ),
    "a receiver's class given a place": (
        lambda: flatland.Receiver((0.0, 0.0)),
        "A Receiver of flatland holds position, n and on: write Receiver.at(position, normal).",
    ),
    "a receiver's class of space given a place and a normal": (
        lambda: space.Receiver((0.0, 0.0, 0.0), (0.0, 0.0, 1.0)),
        "A Receiver of space holds position, axes, S and on: write Receiver.at(position, normal).",
    ),
    "a receiver's class given a normal by name": (
        lambda: space.Receiver((0.0, 0.0, 0.0), normal=(0.0, 0.0, 1.0)),
        "A Receiver of space holds position, axes, S and on: write Receiver.at(position, normal).",
    ),
    "a receiver on no scene": (
        lambda: flatland.Receiver.on_shape(SEGMENTS, 0, 0.5),
        "Argument `scene` must be a Scene, but is a Segments: write Scene.of(primitive(...), ...).",
    ),
}


def refuses(make, words):
    """Ours, or beartype's where the import hook has seen the annotation first."""
    with pytest.raises(TypeError, match=rf"^{re.escape(words)}(\n|$)|violates type hint"):
        make()


@pytest.mark.smoke
@pytest.mark.parametrize("compiled", [False, True], ids=["eager", "jitted"])
@pytest.mark.parametrize("name", REFUSED)
def test_what_cannot_be_meant_is_one_sentence(name, compiled):
    make, words = REFUSED[name]
    refuses(jax.jit(lambda: jnp.sum(make() is None)) if compiled else make, words)


ASKED = {
    "flatland": {
        "view": flatland.view,
        "irradiance": flatland.irradiance,
        "weighted_irradiance": lambda s, at: flatland.weighted_irradiance(s, at, weight=jnp.cos),
        "point_light_irradiance": flatland.point_light_irradiance,
        "mirror_irradiance": lambda s, at: flatland.mirror_irradiance(s, at, mirrors=(0,)),
        "path_irradiance": lambda s, at: flat_paths.path_irradiance(s, at, key=KEY, paths=2),
        "tree_irradiance": lambda s, at: flat_paths.tree_irradiance(
            s, at, key=KEY, branches=(2,), runs=2
        ),
        "trace_strata": lambda s, at: trace_strata(s, at, where=hemicircle_strata(4)),
    },
    "space": {
        "irradiance": space.irradiance,
        "net_visibility": space.net_visibility,
        "vector_irradiance": space.vector_irradiance,
        "boundary_gradient": space.boundary_gradient,
        "visible_silhouettes": visible_silhouettes,
        "visibility_by_azimuth": visibility_by_azimuth,
        "path_irradiance": lambda s, at: pathtrace.path_irradiance(s, at, key=KEY, paths=2),
    },
}
ASKED_OTHERWISE = {
    ("flatland", "line"): flatland.light_field,
    ("space", "plane"): space.light_field,
}
QUESTIONS = [(w, n, f, "at") for w, each in ASKED.items() for n, f in each.items()]
QUESTIONS += [(w, f.__name__, f, n) for (w, n), f in ASKED_OTHERWISE.items()]


@pytest.mark.smoke
@pytest.mark.parametrize(("world", "name", "ask", "argument"), QUESTIONS)
def test_every_question_wants_a_scene_and_a_receiver_of_its_world(world, name, ask, argument):
    other = "space" if world == "flatland" else "flatland"
    scene, at, made = SCENES[world], HERE[world], "write Receiver.at(position, normal)"
    for given, words in (
        (
            (scene, (0.0, 0.0)),
            f"Argument `{argument}` must be a Receiver, but is a tuple: {made}.",
        ),
        (
            (scene, HERE[other]),
            f"Argument `{argument}` must be a Receiver of {world}, but is a Receiver of {other}.",
        ),
        (
            (SCENES[other], at),
            f"Argument `scene` must be a Scene of {world}, but is a Scene of {other}.",
        ),
        (
            ([LAMP], at),
            "Argument `scene` must be a Scene, but is a list: write Scene.of(primitive(...), ...).",
        ),
    ):
        refuses(lambda given=given: ask(*given), words)
        refuses(lambda given=given: jax.jit(lambda x: ask(*given))(1.0), words)


@pytest.mark.smoke
@pytest.mark.parametrize("world", ["flatland", "space"])
def test_what_is_neither_sides_nor_bands_is_refused(world):
    make = {
        "flatland": lambda **how: flatland.primitive(SEGMENTS, **how),
        "space": lambda **how: space.primitive(PANEL, **how),
    }[world]
    for key in ("emission", "albedo"):
        with pytest.raises(ValueError, match="Argument") as found:
            make(**{key: np.ones((3, 3))})
        assert str(found.value) == (
            f"Argument `{key}` must be one number, two (front and back), those of each shape "
            "(here 1), or three or more bands in place of each number, but has shape (3, 3)."
        )
        with pytest.raises(ValueError, match=r"but has shape \(3, 3\)\."):
            jax.jit(lambda a, key=key: make(**{key: a}).material.emission)(jnp.ones((3, 3)))
    with pytest.raises(ValueError, match=r"`specular` must be one number, .* shape \(4,\)\.$"):
        make(specular=np.zeros(4))


def test_one_number_for_each_of_three_shapes_is_no_colour():
    three = flatland.Segments(np.zeros((3, 2)), np.ones((3, 2)))
    made = flatland.primitive(three, emission=(1.0, 0.5, 0.2))
    assert made.material.emission.tolist() == [[1.0, 0.0], [0.5, 0.0], [0.2, 0.0]]
