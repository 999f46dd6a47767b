"""Scenes as TOML files: written by hand, or by `write_flatland`; a scene comes back to the bit.

    [[shape]]
    kind = "segment"          # segment, arc, circle, ellipse, curve, polyline or box
    start = [0.5, 1.0]        # metres; travel leaves the normal to the left
    end = [-0.5, 1.0]
    name = "lamp"             # optional, as everything below
    emission = 1.0            # W/(m rad); or [front, back]; each may be [red, green, blue]
    two_sided = false         # whether a single emission holds for the back too
    albedo = [0.5, 0.0]       # of both sides, or [front, back]
    mirror = 0.0
    specular = 0.0            # share of a glossy lobe cos^exponent
    exponent = 0.0
    ior = 0.0                 # 0: opaque

    [[light]]                 # a point light
    position = [0.0, 2.0]
    intensity = 1.0           # W/rad; or one for each band

    [environment]             # distant light
    kind = "gaussian"         # constant (radiance), gaussian (center, sigma, radiance), row
    sigma = 0.5

| kind | geometry |
|---|---|
| segment | `start`, `end` |
| arc | `center`, `radius`, `start`, `sweep`: angles counter-clockwise from +y [rad] |
| circle | `center`, `radius` |
| ellipse | `center`, `semi`, and `tilt` [rad] |
| curve | `cosines`, `sines`: K + 1 pairs each, from the mean up; and `samples` |
| polyline | `points`, and `closed` |
| box | `low`, `high`: the corners; normals outward |
| row | `values` from +pi to -pi, or `file` with `row`, `columns`, `colour`; `smooth` |

Of a `file` the middle row and all columns are read, unless `row` (0 is the top) and `columns` say
otherwise. Values are joined by lines, or by cubics where `smooth = true`.
"""

from __future__ import annotations

import os
import pathlib
from collections.abc import Callable
from typing import Any

import numpy as np

from firstorder.flatland.scene import Scene
from firstorder.flatland.shapes.build import box, polyline
from firstorder.flatland.shapes.kinds import Arcs, Circles, Curves, Ellipses, Segments
from firstorder.flatland.skies import ConstantSky, GaussianSky, PanoramaSky
from firstorder.io._regular import MOST_TEXT_BYTES, read_regular_file
from firstorder.io.files import write_text
from firstorder.io.images import read_panorama_row
from firstorder.io.scenes._beside import Beside
from firstorder.io.scenes._elements import (
    MATERIAL,
    Element,
    LightElement,
    Place,
    assemble,
    both_sides,
    nearest_known,
    refused_at,
)
from firstorder.io.scenes._toml_tables import (
    TomlTable,
    banded,
    lines_of,
    number,
    parsed,
    point,
    points,
    row,
    sided,
    tables_of,
    whole,
    word,
    yes,
)
from firstorder.io.scenes._toml_text import exact_text, material_lines, quoted
from firstorder.scene._arguments import check_kind

MOST_SAMPLES = 4096  # of a curve: a short file must not ask for much

# --- reading -------------------------------------------------------------------------------------


def read_flatland(path: str | os.PathLike[str], *, outside: bool = False) -> Scene:
    r"""Reads a scene from a TOML file.

    Its keys stand at the head of `firstorder.io.scenes.flatland_toml`.

    Args:
        path: the file.
        outside: whether files that it names may lie outside of its folder.

    Raises:
        ValueError: one sentence that names the file, the line and the element, if it is no scene.
        FileNotFoundError: one sentence that names the path, if there is no such file.

    Example:
        >>> import pathlib, tempfile
        >>> from firstorder.io import read_flatland
        >>> file = pathlib.Path(tempfile.mkdtemp(), "dish.toml")
        >>> _ = file.write_text('[[shape]]\nkind = "circle"\ncenter = [0, 0]\nradius = -1')
        >>> read_flatland(file)
        Traceback (most recent call last):
        ValueError: dish.toml, line 4, shape 1: `radius` must be positive, but is -1.0.
    """
    path = pathlib.Path(path)
    source = read_regular_file(path, MOST_TEXT_BYTES)
    return flatland_from_toml(source, path.name, path.parent, outside=outside)


def flatland_from_toml(
    source: str | bytes,
    file: str = "scene",
    folder: str | os.PathLike[str] = ".",
    *,
    outside: bool = False,
) -> Scene:
    r"""Reads a scene from the text of a TOML file.

    Args:
        source: the text, or its bytes in UTF-8.
        file: how sentences about errors call it.
        folder: where the panoramas that it names lie.
        outside: whether files that it names may lie outside of that folder.

    Raises:
        ValueError: one sentence that names the line and the element.

    Example:
        >>> from firstorder.io import flatland_from_toml
        >>> floor = '[[shape]]\nkind = "segment"\nstart = [-1, 0]\nend = [1, 0]\nname = "floor"'
        >>> flatland_from_toml(floor).named("floor")
        (0,)
    """
    text, tables = parsed(source, file)
    lines = lines_of(text)

    def each(key: str) -> list[TomlTable]:
        return tables_of(tables, key, file, lines)

    for key, value in tables.items():
        _check_key(key, value, Place(file, lines.get((key, 0, ""))))
    elements = [_element(table) for table in each("shape")]
    lights = [_light(table) for table in each("light")]
    sky = None
    if "environment" in tables:
        place = Place(file, lines.get(("environment", 0, "")), "environment")
        table = TomlTable(tables["environment"], place, lines, "environment", 0)
        sky = _sky(table, Beside(folder, outside))
    return assemble(elements, lights, sky, file)


def _check_key(key: str, value: Any, place: Place) -> None:
    """Refuses what does not stand at the top of a scene file."""
    if key in ("shape", "light"):
        if not (isinstance(value, list) and all(isinstance(v, dict) for v in value)):
            raise place.error(f"`{key}` must be written [[{key}]], each with its own keys.")
    elif key == "environment":
        if not isinstance(value, dict):
            raise place.error("`environment` must be written [environment], with its own keys.")
    else:
        known = nearest_known(key, ("shape", "light", "environment"))
        raise place.error(f"`{key}` is not known here: {known}")


def _light(table: TomlTable) -> LightElement:
    light = LightElement(table.take("position", point), table.take("intensity", banded), table.at)
    table.done()
    return light


def _element(table: TomlTable) -> Element:
    """One element; its numbers are judged when it is built."""
    kind = table.take("kind", word)
    name = table.take("name", word, "")
    two_sided = table.take("two_sided", yes, False)
    material = {
        k: table.take(k, sided if k in ("emission", "albedo") else number, 0.0) for k in MATERIAL
    }
    material["emission"] = both_sides(material["emission"], two_sided)
    if kind in KINDS_OF_SPACE:
        raise table.at("kind").error(
            f'kind "{kind}" is one of space: a scene of space begins with `dimensions = 3`.'
        )
    if kind not in _GEOMETRY:
        raise table.at("kind").error(
            f'kind "{kind}" is not known: {nearest_known(kind, _GEOMETRY)}'
        )
    kind, geometry = _GEOMETRY[kind](table)
    table.done()
    return Element(kind, geometry, material, name, table.at)


def _rows(table: TomlTable, **reads: Callable[[Any], Any]) -> dict[str, Any]:
    return {key: [table.take(key, read)] for key, read in reads.items()}


def _segment(table):
    return "segment", _rows(table, start=point, end=point)


def _arc(table):
    return "arc", _rows(table, center=point, radius=number, start=number, sweep=number)


def _circle(table):
    return "circle", _rows(table, center=point, radius=number)


def _ellipse(table):
    rows = _rows(table, center=point, semi=point)
    return "ellipse", {**rows, "tilt": [table.take("tilt", number, 0.0)]}


def _curve(table):
    rows = _rows(table, cosines=points, sines=points)
    samples = table.take("samples", whole, 64)
    if not 1 <= samples <= MOST_SAMPLES:
        words = f"`samples` must lie in [1, {MOST_SAMPLES}], but is {samples}."
        raise table.at("samples").error(words)
    return "curve", {**rows, "samples": samples}


def _polyline(table):
    corners, closed = table.take("points", points), table.take("closed", yes, False)
    made = refused_at(table.at, lambda: polyline(np.array(corners), closed))
    return "segment", {"start": np.asarray(made.start), "end": np.asarray(made.end)}


def _box(table):
    low, high = table.take("low", point), table.take("high", point)
    made = refused_at(table.at, lambda: box(np.array(low), np.array(high)))
    return "segment", {"start": np.asarray(made.start), "end": np.asarray(made.end)}


KINDS_OF_SPACE = (
    "sphere", "ellipsoid", "cylinder", "disc", "rectangle", "triangle", "polygon", "plane",
)  # fmt: skip
_GEOMETRY: dict[str, Callable[[TomlTable], tuple[str, dict[str, Any]]]] = {
    "segment": _segment,
    "arc": _arc,
    "circle": _circle,
    "ellipse": _ellipse,
    "curve": _curve,
    "polyline": _polyline,
    "box": _box,
}


def _sky(table: TomlTable, beside: Beside):
    kind = table.take("kind", word)
    match kind:
        case "constant":
            radiance = table.take("radiance", banded)
            sky = refused_at(table.at, lambda: ConstantSky(radiance))
        case "gaussian":
            given = {
                k: table.take(k, banded if k == "radiance" else number, d)
                for k, d in (("center", 0.0), ("sigma", 0.5), ("radiance", 1.0))
            }
            sky = refused_at(table.at, lambda: GaussianSky(**given))
        case "row":
            smooth = table.take("smooth", yes, False)
            if "file" in table.values:
                file = table.file(beside)
                number_ = table.take("row", whole, None)
                columns = table.take("columns", whole, None)
                colour = table.take("colour", yes, False)
                sky = refused_at(
                    lambda key: table.at(key or "file"),
                    lambda: read_panorama_row(file, number_, columns, colour),
                )
                sky = PanoramaSky(sky.values, smooth)
            else:
                values = table.take("values", row)
                sky = refused_at(table.at, lambda: PanoramaSky(np.array(values), smooth))
        case _:
            known = nearest_known(kind, ("constant", "gaussian", "row"))
            raise table.at("kind").error(f'kind "{kind}" is not known: {known}')
    table.done()
    return sky


# --- writing -------------------------------------------------------------------------------------


def write_flatland(path: str | os.PathLike[str], scene: Scene) -> None:
    """Writes a scene as a TOML file, whole or not at all; `read_flatland` gives it back to the bit.

    Args:
        path: the file.
        scene: its environment is one that a file can name (`ConstantSky`, `GaussianSky`,
            `PanoramaSky`), or none.

    Raises:
        ValueError: if the environment is another function, or a curve has more than 4096 samples.

    Example:
        >>> import pathlib, tempfile
        >>> from firstorder.flatland.library import scene_b
        >>> from firstorder.io import read_flatland, write_flatland
        >>> file = pathlib.Path(tempfile.mkdtemp(), "b.toml")
        >>> write_flatland(file, scene_b())
        >>> read_flatland(file).named("blocker")
        (2,)
    """
    write_text(path, flatland_to_toml(scene))


def flatland_to_toml(scene: Scene) -> str:
    """The text that `write_flatland` writes.

    Raises:
        ValueError: if the environment is one that a file cannot name, or a curve has more than
            4096 samples.

    Example:
        >>> from firstorder.flatland import Circles, Scene, primitive
        >>> from firstorder.io import flatland_to_toml
        >>> print(flatland_to_toml(Scene.of(primitive(Circles((0.0, 1.0), 0.5), name="ball",
        ...     albedo=0.2))))
        [[shape]]
        kind = "circle"
        name = "ball"
        center = [0.0, 1.0]
        radius = 0.5
        albedo = 0.2
        <BLANKLINE>
    """
    check_kind("scene", scene, Scene)
    tables, index = [], 0
    for group in scene.groups:
        for i in range(group.count):
            lines = ["[[shape]]", *_geometry(group, i, scene.names[index])]
            given = {key: np.asarray(getattr(scene.material, key))[index] for key in MATERIAL}
            tables.append("\n".join([*lines, *material_lines(given)]))
            index += 1
    for p, w in zip(
        np.asarray(scene.points.position), np.asarray(scene.points.intensity), strict=True
    ):
        tables.append(f"[[light]]\nposition = {exact_text(p)}\nintensity = {exact_text(w)}")
    if scene.environment is not None:
        tables.append("\n".join(["[environment]", *_environment(scene.environment)]))
    return "\n\n".join(tables) + "\n"


_NAMES = {
    Segments: ("segment", ("start", "end")),
    Arcs: ("arc", ("center", "radius", "start", "sweep")),
    Circles: ("circle", ("center", "radius")),
    Ellipses: ("ellipse", ("center", "semi", "tilt")),
    Curves: ("curve", ("cosines", "sines")),
}


def _geometry(group, i: int, name: str):
    kind, keys = _NAMES[type(group)]
    yield f'kind = "{kind}"'
    if name:
        yield f"name = {quoted(name)}"
    for key in keys:
        yield f"{key} = {exact_text(np.asarray(getattr(group, key))[i])}"
    if isinstance(group, Curves):
        if group.samples > MOST_SAMPLES:
            raise ValueError(
                f"Argument `scene` must have curves of at most {MOST_SAMPLES} samples to be "
                f"written, but one has {group.samples}."
            )
        yield f"samples = {group.samples}"


def _environment(sky):
    match sky:
        case ConstantSky():
            yield from ('kind = "constant"', f"radiance = {exact_text(sky.radiance)}")
        case GaussianSky():
            yield 'kind = "gaussian"'
            for key in ("center", "sigma", "radiance"):
                yield f"{key} = {exact_text(getattr(sky, key))}"
        case PanoramaSky():
            yield from ('kind = "row"', f"smooth = {str(sky.smooth).lower()}")
            yield f"values = {exact_text(sky.values)}"
        case _:
            raise ValueError(
                "Argument `scene` must have an environment that a file can name (ConstantSky, "
                f"GaussianSky or PanoramaSky), but has {type(sky).__name__}."
            )
