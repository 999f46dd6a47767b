"""Textures, bumps and normal maps in scene files of space: tables within [[shape]] and [[mesh]].

    [shape.texture]           # factor of the albedo, from 0 to 1
    kind = "picture"          # over (u, v), bilinear
    file = "wood.exr"         # a picture beside this file, its luminance; or `values`:
    colour = false            # whether the bands of that file, red, green and blue, are kept
    values = [[0.2, 0.8]]     # rows from the top, of numbers or of bands
    repeat = [4.0, 4.0]       # optional: times in one unit of u, and of v
    hold = false              # whether the border goes on outside the picture, which lies once

    [shape.bump]
    kind = "waves"            # size prod_i sin(k_i . (x - origin))
    waves = [[25.0, 0.0, 0.0], [0.0, 25.0, 0.0]]    # k_i [rad/m]
    size = 0.01               # metres
    origin = [0.0, 0.0, 0.0]

    [shape.normal_map]
    kind = "picture"          # colours of normals in the tangent frame, 2 c - 1
    file = "stones.exr"

| table | kind | keys |
|---|---|---|
| texture | picture | `file`, with `colour`, or `values`; `repeat`, `hold` |
| texture | waves | `waves`, `origin`; `mean` (1/2) and `size` (1/2) |
| bump | picture | `file` or `values`, `repeat`; `size`: metres for a value of 1 |
| bump | waves | `waves`, `origin`, `size` |
| normal_map | picture | `file` or `values` (rows of triples), `repeat` |
| normal_map | waves | `lean`, slopes in space; their factor: `waves`, `origin`, `mean`, `size` |

Bumps and normal maps from pictures are cubic splines of at least 4 x 4 pixels, and repeat. On a
rectangle and a disc u and v go from 0 to 1 along `u` and `v`, or along the axes; on a triangle from
its first corner along its edges; on a plane they are metres. On a sphere, an ellipsoid and a
cylinder u is the azimuth, from 0 to 1, and v the latitude or the height; a box is a rectangle on
each face. A mesh has them from its file (`vt` of .obj), or as
`uv = [[[0, 0], [1, 0], [0, 1]], ...]`, three pairs for each of its `faces`.

Pictures are .exr, .hdr, .png and .jpg files. The levels of .png and .jpg are those of a screen
(sRGB) in a texture, and are made linear; in bumps and normal maps they are numbers from 0 to 1.

An .hdr file tells numbers by the middles of steps, 1 as 1 + 1/256: that is white here. Its steps
lean a flat normal map by 0.6 degrees; .exr files do not.
"""

from __future__ import annotations

import pathlib
from collections.abc import Callable, Sequence
from typing import Any

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from firstorder._argument_checks import check_between
from firstorder._display import Module
from firstorder.imaging._textures import (
    HeightMap,
    ImageTexture,
    SolidSlopes,
    SolidWaves,
    image_normal_map,
)
from firstorder.imaging.surface_maps import PerPrimitive, SurfaceMaps, UVMaps
from firstorder.io.images import LUMINANCE, RADIANCE_FILES, read_image
from firstorder.io.scenes._beside import Beside
from firstorder.io.scenes._elements import nearest_known, refused_at
from firstorder.io.scenes._toml_tables import (
    TomlTable,
    number,
    picture,
    point,
    rows,
    vector,
    vectors,
    word,
    yes,
)
from firstorder.io.scenes._toml_text import exact_text
from firstorder.typing import as_float

TABLES = ("texture", "bump", "normal_map")
KINDS = ("picture", "waves")
_WHITE = 1.0 + 2.0 / 256  # of .hdr files: they tell 1 as 1 + 1/256, the next number as 1 + 3/256


class Picture(Module):
    """Pixels of a bump or of a normal map, as a file has them.

    Attributes:
        values: rows from the top; heights in metres, or colours.
        repeat: times that they lie side by side in one unit of u, and of v.
    """

    values: Float[Array, "r c *3"] = eqx.field(converter=as_float)
    repeat: Float[Array, "2"] = eqx.field(converter=as_float, default=(1.0, 1.0))


class MapSet(Module):
    """Texture, bump and normal map of one shape or mesh, as a scene file has them.

    Attributes:
        texture: factor of the albedo.
        bump: heights.
        normal_map: normals.

    Raises:
        ValueError: if the texture leaves [0, 1] by more than rounding.

    Example:
        >>> from firstorder.imaging import SolidWaves
        >>> from firstorder.io import MapSet
        >>> MapSet(texture=SolidWaves([[3.0, 0.0, 0.0]], size=0.25, mean=0.5)).names
        ('texture',)
    """

    texture: ImageTexture | SolidWaves | None = None
    bump: Picture | SolidWaves | None = None
    normal_map: Picture | SolidSlopes | None = None

    def __check_init__(self):
        """Refuse a texture that is no share."""
        match self.texture:
            case ImageTexture(values=values):
                check_between("texture", values, 0.0, 1.0)
            case SolidWaves(mean=mean, size=size):
                ends, rounding = jnp.stack([mean - size, mean + size]), jnp.finfo(mean.dtype).eps
                nearest = jnp.clip(ends, 0.0, 1.0)
                near = jnp.abs(ends - nearest) <= rounding
                check_between("texture", jnp.where(near, nearest, ends), 0.0, 1.0)

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the maps that are there."""
        return tuple(name for name in TABLES if getattr(self, name) is not None)

    @property
    def pictures(self) -> tuple[str, ...]:
        """Names of the maps that need (u, v)."""
        return tuple(n for n in self.names if isinstance(getattr(self, n), Picture | ImageTexture))


def map_set_of(table: TomlTable, beside: Beside, has_uv: bool = True) -> MapSet:
    """Surface maps described by a [[shape]] or [[mesh]].

    Args:
        table: of the shape or mesh.
        beside: which pictures it may name.
        has_uv: whether its places have (u, v).

    Raises:
        ValueError: one sentence that names the line and the table.
    """
    found = {}
    for name, reads in (("texture", _TEXTURE), ("bump", _BUMP), ("normal_map", _NORMALS)):
        inner = table.inner(name)
        if inner is None:
            continue
        kind = inner.take("kind", word)
        if kind not in KINDS:
            known = nearest_known(kind, KINDS)
            raise inner.at("kind").error(f'kind "{kind}" is not known: {known}')
        found[name] = reads[kind](inner, beside)
        inner.done()
    coat = MapSet(**found)
    if coat.pictures and not has_uv:
        name, what = coat.pictures[0], table.place.what.split()[0]
        raise table.at(name).error(f"`{name}` lies over (u, v), which this {what} has not.")
    return coat


# --- tables --------------------------------------------------------------------------------------


def _texture_picture(table: TomlTable, beside: Beside) -> ImageTexture:
    colour = "file" in table.values and table.take("colour", yes, False)
    pixels = _white(table, _pixels(table, beside, colour, picture))
    repeat, hold = table.take("repeat", point, [1.0, 1.0]), table.take("hold", yes, False)
    made = refused_at(table.at, lambda: ImageTexture(pixels, repeat, hold))
    key = "file" if "file" in table.values else "values"
    _check_share(table, key, float(pixels.min()), float(pixels.max()))
    return made


def _texture_waves(table: TomlTable, beside: Beside) -> SolidWaves:
    size, mean = table.take("size", number, 0.5), table.take("mean", number, 0.5)
    made = _waves(table, size, mean)
    _check_share(table, "size", mean - abs(size), mean + abs(size))
    return made


def _white(table: TomlTable, pixels: np.ndarray) -> np.ndarray:
    """Pixels in which the value that an .hdr file tells for white is 1."""
    if pathlib.Path(table.values.get("file", "")).suffix.lower() not in RADIANCE_FILES:
        return pixels
    return np.where(pixels < _WHITE, np.minimum(pixels, 1.0), pixels)


def _check_share(table: TomlTable, key: str, low: float, high: float) -> None:
    if low < 0.0 or high > 1.0:
        raise table.at(key).error(
            f"a texture must lie in [0, 1], but goes from {low:g} to {high:g}."
        )


def _bump_picture(table: TomlTable, beside: Beside) -> Picture:
    pixels, repeat = _pixels(table, beside), table.take("repeat", point, [1.0, 1.0])
    with np.errstate(over="ignore"):  # it is refused below
        made = Picture(table.take("size", number, 1.0) * pixels, repeat)
    refused_at(table.at, lambda: HeightMap.of(made.values, tuple(repeat)))
    return made


def _bump_waves(table: TomlTable, beside: Beside) -> SolidWaves:
    return _waves(table, table.take("size", number), 0.0)


def _normals_picture(table: TomlTable, beside: Beside) -> Picture:
    made = Picture(
        _white(table, _pixels(table, beside, True)), table.take("repeat", point, [1.0, 1.0])
    )
    refused_at(table.at, lambda: image_normal_map(made.values, tuple(made.repeat.tolist())))
    return made


def _normals_waves(table: TomlTable, beside: Beside) -> SolidSlopes:
    lean = table.take("lean", vector)
    if "waves" not in table.values:
        return SolidSlopes(lean)
    size, mean = table.take("size", number, 1.0), table.take("mean", number, 0.0)
    return SolidSlopes(lean, _waves(table, size, mean))


_TEXTURE = {"picture": _texture_picture, "waves": _texture_waves}
_BUMP = {"picture": _bump_picture, "waves": _bump_waves}
_NORMALS = {"picture": _normals_picture, "waves": _normals_waves}


def _waves(table: TomlTable, size: float, mean: float) -> SolidWaves:
    waves, origin = table.take("waves", vectors), table.take("origin", vector, [0.0, 0.0, 0.0])
    return SolidWaves(waves, size, mean, origin)


def _pixels(
    table: TomlTable,
    beside: Beside,
    colours: bool = False,
    read_rows: Callable[[Any], Any] | None = None,
) -> np.ndarray:
    """Pixels from a file or from the table: rows of numbers, or of triples.

    Args:
        table: of the map.
        beside: which files it may name.
        colours: whether there are three in each pixel; else it is their luminance.
        read_rows: reads the table's rows, of a texture; what else lies in pictures is no light.
    """
    if "file" not in table.values:
        return np.array(table.take("values", read_rows or (_triples if colours else rows)))
    path = table.file(beside)

    def read() -> np.ndarray:
        found = read_image(path, srgb=read_rows is not None).astype(float)
        if not np.all(np.isfinite(found)):
            raise ValueError(f"{path.name}: the picture holds numbers that are not finite.")
        return found if colours else found @ LUMINANCE

    return refused_at(lambda key: table.at("file"), read)


def _triples(value: Any) -> list[list[list[float]]]:
    """Rows of red, green and blue, all as long as the first."""
    try:
        found = [vectors(row) for row in value]
    except (TypeError, ValueError):
        found = []
    if not found or len({len(row) for row in found}) != 1:
        raise ValueError("rows of equally many triples of numbers")
    return found


def corner_uv(value: Any) -> list[list[list[float]]]:
    """Corner coordinates (u, v): three pairs for each face."""
    if not isinstance(value, list) or not all(isinstance(v, list) and len(v) == 3 for v in value):
        raise ValueError("three pairs of numbers for each face")
    try:
        return [[point(p) for p in v] for v in value]
    except ValueError:
        raise ValueError("three pairs of numbers for each face") from None


# --- text ----------------------------------------------------------------------------------------


def map_set_text(coat: MapSet, outer: str) -> str:
    """Tables of a map set as `map_set_of` reads them back to the bit, each after an empty line.

    Args:
        coat: any map set.
        outer: `shape` or `mesh`.

    Example:
        >>> from firstorder.io.scenes._surface_maps import MapSet, map_set_text
        >>> from firstorder.imaging import ImageTexture
        >>> print(map_set_text(MapSet(ImageTexture([[0.25, 1.0]])), "mesh").strip())
        [mesh.texture]
        kind = "picture"
        values = [[0.25, 1.0]]
        repeat = [1.0, 1.0]
        hold = false
    """
    return "".join(
        f'\n\n[{outer}.{name}]\nkind = "{_kind(getattr(coat, name))}"\n'
        + "\n".join(f"{k} = {v}" for k, v in _keys(name, getattr(coat, name)).items())
        for name in coat.names
    )


def _kind(worn: Any) -> str:
    return "picture" if isinstance(worn, Picture | ImageTexture) else "waves"


def _keys(name: str, worn: Any) -> dict[str, str]:
    match worn:
        case ImageTexture():
            more = {"hold": str(worn.hold).lower()}
            return {"values": exact_text(worn.values), "repeat": exact_text(worn.repeat)} | more
        case Picture():
            return {"values": exact_text(worn.values), "repeat": exact_text(worn.repeat)}
        case SolidSlopes():
            waves = {} if worn.waves is None else _keys("normal_map", worn.waves)
            return {"lean": exact_text(worn.lean)} | waves
        case _:
            wanted = ["waves", "origin", "size", "mean"]
            count = 3 if name == "bump" else 4  # a constant makes no bump
            return {key: exact_text(getattr(worn, key)) for key in wanted[:count]}


# --- what the renderer takes ---------------------------------------------------------------------


def surface_maps_of(worn: Sequence[tuple[tuple[int, ...], MapSet]]) -> SurfaceMaps | None:
    """Surface maps by the number of the primitive; None if there are none.

    Args:
        worn: numbers of primitives, and their maps.

    Raises:
        ValueError: if a picture of normals or of heights is none that can be used.

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.imaging import SolidWaves
        >>> from firstorder.io import MapSet, surface_maps_of
        >>> grey = MapSet(texture=SolidWaves([[3.0, 0.0, 0.0]], size=0.25, mean=0.5))
        >>> surface_maps_of([((0,), grey)]).albedo(jnp.array(0), jnp.zeros(3)).item()
        0.5
    """

    def by_number(name: str, kinds: Any, plain: tuple[float, ...], make: Callable) -> Any:
        found = [(k, getattr(coat, name)) for k, coat in worn]
        found = [(k, make(one)) for k, one in found if isinstance(one, kinds)]
        if not found:
            return None
        keys, functions = zip(*found, strict=True)
        return PerPrimitive(plain, keys, functions)

    def normals(picture: Picture):
        return image_normal_map(picture.values, tuple(picture.repeat.tolist()))

    def heights(picture: Picture):
        return HeightMap.of(picture.values, tuple(picture.repeat.tolist()))

    over = UVMaps(
        by_number("bump", Picture, (0.0,), heights),
        by_number("normal_map", Picture, (0.0, 0.0, 1.0), normals),
        by_number("texture", ImageTexture, (1.0,), _same),
    )
    there = any(a is not None for a in (over.height, over.normals, over.albedo))
    found = SurfaceMaps(
        by_number("bump", SolidWaves, (0.0,), _same),
        by_number("normal_map", SolidSlopes, (0.0, 0.0, 0.0), _same),
        by_number("texture", SolidWaves, (1.0,), _same),
        over if there else None,
    )
    return found if any(len(coat.names) for _, coat in worn) else None


def _same(one: Any) -> Any:
    return one
