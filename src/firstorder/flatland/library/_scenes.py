"""The papers' scenes by name.

The papers print few numbers. What they leave open is chosen here, once, and said in each docstring;
every choice is an argument. `named_scene` finds a scene by its name, `scene_names` lists them.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping

from jaxtyping import ArrayLike

from firstorder._argument_checks import check_known
from firstorder.flatland.library._e11 import e11_fig03, e11_fig07, e11_fig18a, e11_fig18b
from firstorder.flatland.library.bumps import ChirpBumps, SineBumps, bumpy_ground
from firstorder.flatland.point_lights import PointLights
from firstorder.flatland.primitives import Primitive, primitive
from firstorder.flatland.scene import Scene
from firstorder.flatland.shapes.build import box
from firstorder.flatland.shapes.kinds import Circles, Segments
from firstorder.flatland.skies import GaussianSky
from firstorder.numerics._host import spread
from firstorder.typing import as_float

# --- J12, Fig. 2 ---------------------------------------------------------------------------------


def scene_a(radiance: ArrayLike = 1.0) -> Scene:
    """A line light over a line receiver, nothing between them.

    Open in the paper: every size. Here: the floor is y = 0 from x = -1 to 1; the lamp is y = 1 from
    -0.5 to 0.5, faces down, and is black.

    Shapes: `floor`, `lamp`.

    Args:
        radiance: of the lamp, a number [W/(m rad)].

    Raises:
        ValueError: if the radiance is negative.

    Reference: J12 §4.1, Fig. 2 (A).

    Example:
        >>> from firstorder.flatland import irradiance, receiver
        >>> from firstorder.flatland.library import scene_a
        >>> scene = scene_a()
        >>> print(f"{irradiance(scene, receiver(scene, *scene.named('floor'), 0.5)).item():.6f}")
        0.894427
    """
    return Scene.of(_floor(-1.0, 1.0), _lamp(-0.5, 0.5, 1.0, radiance))


def scene_b(radiance: ArrayLike = 1.0) -> Scene:
    """Scene A and a black occluder between: penumbra everywhere, umbra nowhere.

    Open in the paper: every size. Here: the occluder is y = 0.5 from x = -0.2 to 0.2.

    Shapes: `floor`, `lamp`, `blocker`.

    Args:
        radiance: of the lamp, a number [W/(m rad)].

    Raises:
        ValueError: if the radiance is negative.

    Reference: J12 §4.1, Fig. 2 (B).

    Example:
        >>> from firstorder.flatland.library import scene_b
        >>> scene_b().named("blocker")
        (2,)
    """
    blocker = primitive(Segments((-0.2, 0.5), (0.2, 0.5)), name="blocker")
    return Scene.of(_floor(-1.0, 1.0), _lamp(-0.5, 0.5, 1.0, radiance), blocker)


def scene_c(albedo: ArrayLike = 0.2, intensity: ArrayLike = 1.0) -> Scene:
    """A closed square room with a point light in its centre.

    The paper gives the albedo. Open: the sizes and the power. Here: the unit square and 1 W/rad.

    Shapes: `floor`, `right`, `ceiling`, `left`, normals inward.

    Args:
        albedo: of the walls, a number.
        intensity: of the light, a number [W/rad].

    Raises:
        ValueError: if a number is negative or the albedo above 1.

    Reference: J12 §4.1, Fig. 2 (C).

    Example:
        >>> from firstorder.flatland.library import scene_c
        >>> scene_c().points.position.tolist()
        [[0.5, 0.5]]
    """
    return Scene.of(*_room(albedo), points=PointLights((0.5, 0.5), intensity))


def scene_d(albedo: ArrayLike = 0.2, intensity: ArrayLike = 1.0, radius: ArrayLike = 0.08) -> Scene:
    """Scene C and four round occluders.

    Open in the paper: where they are and how large. Here: radius 0.08, centres at a quarter and
    three quarters of the room, the albedo of the walls.

    Shapes: `floor`, `right`, `ceiling`, `left`, and four named `occluder`.

    Args:
        albedo: of walls and occluders, a number.
        intensity: of the light, a number [W/rad].
        radius: of the occluders, a number [m].

    Raises:
        ValueError: if a number is negative, the radius zero or the albedo above 1.

    Reference: J12 §4.1, Fig. 2 (D).

    Example:
        >>> from firstorder.flatland.library import scene_d
        >>> scene_d().named("occluder")
        (4, 5, 6, 7)
    """
    centers = as_float([(x, y) for y in (0.25, 0.75) for x in (0.25, 0.75)])
    round_ones = Circles(centers, spread(radius, (4,)))
    occluders = primitive(round_ones, name="occluder", albedo=albedo)
    return Scene.of(*_room(albedo), occluders, points=PointLights((0.5, 0.5), intensity))


# --- J12, Figs. 14 and 15 ------------------------------------------------------------------------


def fig14(wall: str = "white") -> Scene:
    """A lamp over a floor with a white wall to its left, or a black one, or none.

    The paper gives the wall's albedos, 1 and 0. Open: every size. Here: the floor is y = 0 from
    x = 0 to 2; the wall stands at its left end, 1 high, facing right; the lamp is y = 1 from 0.8 to
    1.2, of radiance 1, facing down. The wall is never between lamp and floor. Floor and lamp are
    black.

    Shapes: `floor`, `lamp`, and `wall` if there is one.

    Args:
        wall: "white", "black" or "none".

    Raises:
        ValueError: if it is another word.

    Reference: J12 §6.3, Fig. 14.

    Example:
        >>> from firstorder.flatland.library import fig14
        >>> [fig14(wall).count for wall in ("white", "black", "none")]
        [3, 3, 2]
    """
    if wall not in ("white", "black", "none"):
        raise ValueError(f"Argument `wall` must be white, black or none, but is {wall!r}.")
    things = [_floor(0.0, 2.0), _lamp(0.8, 1.2, 1.0, 1.0)]
    if wall != "none":
        upright = Segments((0.0, 1.0), (0.0, 0.0))
        things.append(primitive(upright, name="wall", albedo=1.0 if wall == "white" else 0.0))
    return Scene.of(*things)


def fig15(
    albedo: ArrayLike = 0.5,
    *,
    lamp: tuple[float, float] = (0.4, 0.6),
    low: tuple[float, float] = (0.35, 0.4),
    high: tuple[float, float] = (0.65, 0.6),
) -> Scene:
    """A closed room with a lamp in its ceiling and a block in its centre.

    The paper gives the albedo of all surfaces, 0.5. Open: every size, and the light. Here: the unit
    square; the lamp is a part of the ceiling, of radiance 1.

    Shapes: `floor`, `right`, two named `ceiling`, `lamp`, `left`, and four named `block`.

    Args:
        albedo: of every surface, the lamp's too, a number.
        lamp: from where to where along the ceiling [m].
        low: lower left corner of the block [m].
        high: upper right corner of the block [m].

    Raises:
        ValueError: if the albedo is not in [0, 1], or something has no length.

    Reference: J12 §6.3, Fig. 15.

    Example:
        >>> from firstorder.flatland.library import fig15
        >>> fig15().named("block")
        (6, 7, 8, 9)
    """
    floor, right, _, left = _room(albedo)
    left_end, right_end = lamp
    ceiling = Segments([(1.0, 1.0), (left_end, 1.0)], [(right_end, 1.0), (0.0, 1.0)])
    shining = Segments((right_end, 1.0), (left_end, 1.0))
    return Scene.of(
        floor,
        right,
        primitive(ceiling, name="ceiling", albedo=albedo),
        primitive(shining, name="lamp", albedo=albedo, emission=1.0),
        left,
        primitive(box(low, high), name="block", albedo=albedo),
    )


# --- R07 -----------------------------------------------------------------------------------------


def r07_fig09(sigma: ArrayLike = 0.5) -> Scene:
    """A flat receiver shadowed by a box and a circle, under light that is brightest overhead.

    Open in the paper: every number. Here: the receiver is y = 0 from x = -3 to 3, white; the box
    spans -1.4 to -0.5 and 0.25 to 0.7; the circle has its centre at (0.6, 0.65) and radius 0.35;
    both are black. The sky has radiance 1 overhead and a standard deviation of 0.5 rad.

    Shapes: `floor`, four named `box`, `circle`.

    Args:
        sigma: of the sky, a number [rad].

    Raises:
        ValueError: if `sigma` is not positive.

    Reference: R07 §6.3, Fig. 9.

    Example:
        >>> from firstorder.flatland.library import r07_fig09
        >>> r07_fig09().named("circle")
        (5,)
    """
    return Scene.of(
        _floor(-3.0, 3.0, 1.0),
        primitive(box((-1.4, 0.25), (-0.5, 0.7)), name="box"),
        primitive(Circles((0.6, 0.65), 0.35), name="circle"),
        environment=GaussianSky(0.0, sigma),
    )


def r07_fig16(pieces: int = 96) -> Scene:
    """Ground in sine waves, lit from the upper right.

    Open in the paper: every number. Here: waves of amplitude 0.05 m and 2 cycles per metre from
    x = -1 to 1, white; a sky about -0.5 rad (to the right), 0.35 rad wide. `SineBumps()` is the
    profile in closed form; the scene has a polyline of it.

    Shapes: as many named `floor` as there are pieces.

    Args:
        pieces: of the polyline.

    Raises:
        ValueError: if `pieces` is not positive.

    Reference: R07 §9.2, Fig. 16.

    Example:
        >>> from firstorder.flatland.library import r07_fig16
        >>> r07_fig16(24).count
        24
    """
    return _bumpy(bumpy_ground(SineBumps(), -1.0, 1.0, pieces))


def r07_fig17(pieces: int = 160) -> Scene:
    """Ground in waves that get shorter to the right, lit from the upper right.

    Open in the paper: every number. Here: from x = 0 to 2, 1 cycle per metre at the left and 5 at
    the right, slopes up to 0.6; white, and the sky of `r07_fig16`. `ChirpBumps()` is the profile in
    closed form; the scene has a polyline of it.

    Shapes: as many named `floor` as there are pieces.

    Args:
        pieces: of the polyline.

    Raises:
        ValueError: if `pieces` is not positive.

    Reference: R07 §9.2, Fig. 17.

    Example:
        >>> from firstorder.flatland.library import r07_fig17
        >>> r07_fig17(24).count
        24
    """
    return _bumpy(bumpy_ground(ChirpBumps(), 0.0, 2.0, pieces))


# --- the list ------------------------------------------------------------------------------------


def scene_names() -> tuple[str, ...]:
    """The names of all scenes, in the order of the papers' figures.

    Example:
        >>> from firstorder.flatland.library import scene_names
        >>> scene_names()[:3]
        ('scene_a', 'scene_b', 'scene_c')
    """
    return tuple(_scenes())


def named_scene(name: str) -> Scene:
    """The scene of that name, with the numbers chosen in its docstring.

    Raises:
        ValueError: if there is none.

    Example:
        >>> from firstorder.flatland.library import named_scene
        >>> named_scene("scene_d").count
        8
    """
    scenes = _scenes()
    check_known("name", name, scenes)
    return scenes[name]()


def describe_scene(name: str) -> str:
    """A scene in one sentence: the first line of its docstring.

    Raises:
        ValueError: if there is none of that name.

    Example:
        >>> from firstorder.flatland.library import describe_scene
        >>> describe_scene("scene_a")
        'A line light over a line receiver, nothing between them.'
    """
    check_known("name", name, _scenes())
    made = fig14 if name.startswith("fig14_") else _scenes()[name]
    return (made.__doc__ or "").split("\n")[0]


def _scenes() -> Mapping[str, Callable[[], Scene]]:
    return {
        "scene_a": scene_a,
        "scene_b": scene_b,
        "scene_c": scene_c,
        "scene_d": scene_d,
        "fig14_white": lambda: fig14("white"),
        "fig14_black": lambda: fig14("black"),
        "fig14_none": lambda: fig14("none"),
        "fig15": fig15,
        "r07_fig09": r07_fig09,
        "r07_fig16": r07_fig16,
        "r07_fig17": r07_fig17,
        "e11_fig03": e11_fig03,
        "e11_fig07": e11_fig07,
        "e11_fig18a": e11_fig18a,
        "e11_fig18b": e11_fig18b,
    }


# --- what scenes share ---------------------------------------------------------------------------


def _floor(low: float, high: float, albedo: ArrayLike = 0.0) -> Primitive:
    """A horizontal receiver at y = 0, facing up."""
    return primitive(Segments((low, 0.0), (high, 0.0)), name="floor", albedo=albedo)


def _lamp(low: float, high: float, height: float, radiance: ArrayLike) -> Primitive:
    """A black line light that faces down."""
    return primitive(Segments((high, height), (low, height)), name="lamp", emission=radiance)


def _room(albedo: ArrayLike) -> list[Primitive]:
    """The unit square from inside, each wall by its name."""
    corners = [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)]
    names = ("floor", "right", "ceiling", "left")
    walls = zip(names, corners, [*corners[1:], corners[0]], strict=True)
    return [primitive(Segments(a, b), name=name, albedo=albedo) for name, a, b in walls]


def _bumpy(floor: Segments) -> Scene:
    sky = GaussianSky(-0.5, 0.35)
    return Scene.of(primitive(floor, name="floor", albedo=1.0), environment=sky)
