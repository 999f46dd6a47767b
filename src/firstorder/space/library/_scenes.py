"""Scenes of the papers in space, and two with more shapes in them.

The papers print few numbers. What they leave open is chosen here, once, and said in each docstring.
`named_scene` finds a scene by its name, `scene_names` lists them. In each, `floor` is the receiver:
the plane z = 0, facing up.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import jax.numpy as jnp
import numpy as np
from jaxtyping import ArrayLike

from firstorder._argument_checks import check_known
from firstorder.space.primitives import Primitive, primitive
from firstorder.space.scene import Scene
from firstorder.space.shapes.build import box, plane, rectangle, sphere
from firstorder.space.shapes.kinds import Boxes
from firstorder.typing import as_float

WALLS = ("black", "none")

# --- J12, Figs. 17-22 ----------------------------------------------------------------------------


def j12_box(wall: str = "black", radiance: ArrayLike = 1.0) -> Scene:
    """A floor between a grey and a black wall, under a light; front and back are missing.

    The paper gives the albedos: 0.5 on the left, 0 on the right. Open: every size. Here: the floor
    is the unit square, the walls stand at x = 0 and x = 1 and are 1 m high, the light is the square
    from 0.3 to 0.7 m in x and in y, 1 m up, facing down. The floor is black, so that indirect light
    on it is one reflection from the left wall.

    Shapes: `floor`, `left`, `light`, and `right` unless it is left out.

    Args:
        wall: "black", or "none" for no right wall.
        radiance: of the light, a number [W/(m^2 sr)].

    Raises:
        ValueError: for another wall.

    Reference: J12 §8, Fig. 17 (left); Fig. 19 leaves the wall out.

    Example:
        >>> from firstorder.space.library import j12_box
        >>> j12_box("none").count
        3
    """
    return Scene.of(*_box(wall, radiance))


def j12_occluder(wall: str = "black", albedo: ArrayLike = 0.5, radiance: ArrayLike = 1.0) -> Scene:
    """The box of J12 with a diffuse block that stands on its floor.

    Open in the paper: every size, and the block's albedo in Fig. 19 (Fig. 20: 0.01). Here: the
    block is 0.2 by 0.3 m, 0.25 m high, its left side at x = 0.35, and of albedo 0.5.

    Shapes: those of `j12_box`, and `block`.

    Args:
        wall: "black", or "none" for no right wall.
        albedo: of the block, a number.
        radiance: of the light, a number [W/(m^2 sr)].

    Raises:
        ValueError: for another wall, or if a number is out of its range.

    Reference: J12 §8, Figs. 17 (right), 19 and 20.

    Example:
        >>> from firstorder.space.library import j12_occluder
        >>> j12_occluder().named("block")
        (0,)
    """
    block = box((0.35, 0.35, 0.0), (0.55, 0.65, 0.25))
    return Scene.of(*_box(wall, radiance), primitive(block, name="block", albedo=albedo))


def _box(wall: str, radiance: ArrayLike) -> list[Primitive]:
    if wall not in WALLS:
        raise ValueError(f"Argument `wall` must be one of {list(WALLS)}, but is {wall!r}.")
    things = [
        _floor(0.0),
        primitive(
            rectangle((0.0, 0.5, 0.5), (0.0, 0.5, 0.0), (0.0, 0.0, 0.5)), name="left", albedo=0.5
        ),
        _lamp((0.5, 0.5, 1.0), 0.2, radiance),
    ]
    right = primitive(rectangle((1.0, 0.5, 0.5), (0.0, 0.0, 0.5), (0.0, 0.5, 0.0)), name="right")
    return things + [right] * (wall == "black")


def _floor(albedo: ArrayLike) -> Primitive:
    """The unit square, facing up."""
    square = rectangle((0.5, 0.5, 0.0), (0.5, 0.0, 0.0), (0.0, 0.5, 0.0))
    return primitive(square, name="floor", albedo=albedo)


def _lamp(center: Any, half: float, radiance: ArrayLike) -> Primitive:
    """A black square that shines down."""
    return primitive(
        rectangle(center, (0.0, half, 0.0), (half, 0.0, 0.0)), name="light", emission=radiance
    )


# --- scenes of some complexity -------------------------------------------------------------------


def clutter(albedo: ArrayLike = 0.5, radiance: ArrayLike = 1.0, seed: int = 4) -> Scene:
    """A closed room full of boxes and balls, for many bounces.

    The unit cube, all walls and things of one albedo, a light of 0.4 m just under the ceiling; nine
    boxes on the floor, turned and of all heights, in a grid of cells that they do not leave, so
    that they do not touch; three balls above them.

    Shapes: `floor`, `wall` (4), `ceiling`, `light`, `thing` (9 boxes and 3 balls).

    Args:
        albedo: of everything but the light, a number.
        radiance: of the light, a number [W/(m^2 sr)].
        seed: of sizes and turns.

    Raises:
        ValueError: if the radiance is negative, or the albedo not in [0, 1].

    Reference: none; J12 §8 names scenes of moderate complexity as future work.

    Example:
        >>> from firstorder.space.library import clutter
        >>> clutter().count
        19
    """
    rng = np.random.default_rng(seed)
    things = [_floor(albedo), *_walls(albedo), _lamp((0.5, 0.5, 0.99), 0.2, radiance)]
    for cell in np.stack(np.meshgrid(*2 * [np.arange(3)]), -1).reshape(-1, 2):
        turn, height = rng.uniform(0.0, np.pi), rng.uniform(0.05, 0.35)
        half = rng.uniform(0.03, 0.08, 2)
        center = np.append((cell + 0.5) / 3 + rng.uniform(-0.04, 0.04, 2), 0.5 * height)
        c, s = np.cos(turn), np.sin(turn)
        frame = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
        axes = frame * np.append(half, 0.5 * height)
        things.append(primitive(Boxes(center, axes), name="thing", albedo=albedo))
    for center, r in (((0.3, 0.3, 0.6), 0.08), ((0.7, 0.4, 0.5), 0.06), ((0.45, 0.75, 0.55), 0.07)):
        things.append(primitive(sphere(center, r), name="thing", albedo=albedo))
    return Scene.of(*things)


def tables(albedo: ArrayLike = 0.6, radiance: ArrayLike = 1.0) -> Scene:
    """A room lit from its ceiling alone: a lamp shines up, and three tables stand in its light.

    The unit cube; the lamp is a square of 0.2 m at half height, facing up, so that all light on the
    floor has been reflected at least once. Each table is a top on four legs of 2 cm.

    Shapes: `floor`, `wall` (4), `ceiling`, `light`, `table` (15 boxes).

    Args:
        albedo: of everything but the lamp, a number.
        radiance: of the lamp, a number [W/(m^2 sr)].

    Raises:
        ValueError: if the radiance is negative, or the albedo not in [0, 1].

    Reference: none; J12 §8 names scenes of moderate complexity as future work.

    Example:
        >>> from firstorder.space.library import tables
        >>> len(tables().named("table"))
        15
    """
    up = rectangle((0.5, 0.5, 0.5), (0.1, 0.0, 0.0), (0.0, 0.1, 0.0))
    things = [_floor(albedo), *_walls(albedo), primitive(up, name="light", emission=radiance)]
    for x, y, wide, deep, high in (
        (0.28, 0.3, 0.15, 0.1, 0.2),
        (0.7, 0.25, 0.12, 0.12, 0.28),
        (0.55, 0.75, 0.2, 0.09, 0.15),
    ):
        top = box((x - wide, y - deep, high), (x + wide, y + deep, high + 0.02))
        things.append(primitive(top, name="table", albedo=albedo))
        for a in (x - wide + 0.01, x + wide - 0.03):
            for b in (y - deep + 0.01, y + deep - 0.03):
                leg = box((a, b, 0.0), (a + 0.02, b + 0.02, high))
                things.append(primitive(leg, name="table", albedo=albedo))
    return Scene.of(*things)


def _walls(albedo: ArrayLike) -> list[Primitive]:
    """Four walls and a ceiling of the unit cube, facing inwards."""
    x, y, z = 0.5 * np.eye(3)
    sides = (
        ("wall", (0.0, 0.5, 0.5), y, z),
        ("wall", (1.0, 0.5, 0.5), z, y),
        ("wall", (0.5, 0.0, 0.5), z, x),
        ("wall", (0.5, 1.0, 0.5), x, z),
        ("ceiling", (0.5, 0.5, 1.0), y, x),
    )
    return [primitive(rectangle(c, u, v), name=name, albedo=albedo) for name, c, u, v in sides]


# --- shadows -------------------------------------------------------------------------------------


def sphere_over_plane(height: ArrayLike = 1.0, radius: ArrayLike = 0.5, sky: Any = 1.0) -> Scene:
    """A sphere over a plane, under the sky: the scene whose net visibility has a closed form.

    Shapes: `floor` (the plane z = 0), `sphere` (its centre above the origin).

    Args:
        height: of the centre, a number [m].
        radius: a number [m].
        sky: radiance of the environment [W/(m^2 sr)], a number or a function of direction.

    Raises:
        ValueError: if the radius is not positive, or the sky's radiance negative.

    Reference: R07 §7, Fig. 12.

    Example:
        >>> from firstorder.space.library import sphere_over_plane
        >>> sphere_over_plane().count
        2
    """
    up = as_float(height)
    ball = sphere(jnp.stack([0.0 * up, 0.0 * up, up]), radius)
    return Scene.of(_ground(), primitive(ball, name="sphere"), environment=sky)


def three_spheres(sky: Any = 1.0) -> Scene:
    """Three spheres on and over a plane, whose soft shadows overlap.

    Open in the paper: every size and place. Here: radii 0.5, 0.35 and 0.25 m; the first rests on
    the plane.

    Shapes: `floor` (the plane z = 0), three named `sphere`.

    Args:
        sky: radiance of the environment [W/(m^2 sr)], a number or a function of direction.

    Raises:
        ValueError: if the sky's radiance is negative.

    Reference: R07 §8, Fig. 13.

    Example:
        >>> from firstorder.space.library import three_spheres
        >>> len(three_spheres().named("sphere"))
        3
    """
    places = (((-0.45, 0.1, 0.5), 0.5), ((0.45, -0.35, 0.6), 0.35), ((0.35, 0.55, 0.35), 0.25))
    balls = [primitive(sphere(center, r), name="sphere") for center, r in places]
    return Scene.of(_ground(), *balls, environment=sky)


def _ground() -> Primitive:
    return primitive(plane((0.0, 0.0, 0.0), (0.0, 0.0, 1.0)), name="floor")


# --- by name -------------------------------------------------------------------------------------


def scene_names() -> tuple[str, ...]:
    """Names of all scenes.

    Example:
        >>> from firstorder.space.library import scene_names
        >>> scene_names()[:2]
        ('j12_box', 'j12_occluder')
    """
    return tuple(_makers())


def describe_scene(name: str) -> str:
    """A scene in one sentence.

    Raises:
        ValueError: if there is no such scene.

    Example:
        >>> from firstorder.space.library import describe_scene
        >>> describe_scene("sphere_over_plane")
        'A sphere over a plane, under the sky: the scene whose net visibility has a closed form.'
    """
    return (_maker(name).__doc__ or "").partition("\n")[0]


def named_scene(name: str) -> Scene:
    """The scene of that name, with its default sizes.

    Raises:
        ValueError: if there is no such scene.

    Example:
        >>> from firstorder.space import library
        >>> library.named_scene("j12_box").named("floor")
        (0,)
    """
    return _maker(name)()


def _maker(name: str) -> Callable[[], Scene]:
    check_known("name", name, scene_names())
    return _makers()[name]


def _makers() -> Mapping[str, Callable[[], Scene]]:
    makers = (j12_box, j12_occluder, clutter, tables, sphere_over_plane, three_spheres)
    return {maker.__name__: maker for maker in makers}
