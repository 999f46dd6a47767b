"""Scenes of space from and to Mitsuba 3: the dict that it loads, and its XML.

| Mitsuba | here |
|---|---|
| rectangle, disk, sphere, cube | rectangle, disc, sphere or ellipsoid, box, each by `to_world` |
| cylinder and a disk at each of its ends | cylinder |
| obj, ply | mesh; its file lies in the folder that is given |
| diffuse: `reflectance`; the back is black | albedo (r, 0) |
| twosided around one diffuse, or two | albedo of front and back |
| no BSDF | diffuse of 0.5, as Mitsuba has it |
| area emitter: `radiance` [W/(m^2 sr)] | emission of the front, the same number |
| constant emitter: `radiance` | environment |
| integrators, sensors and what is in them | left out, with a warning that names them |

Three unlike numbers of an `rgb` are three bands. Those of a `spectrum` must be the same at all
wavelengths, of which there is none here. All else is refused in one sentence, since without it the
light would be another. Mitsuba computes in single precision; what is written here is whole, and is
read again to the bit.
"""

from __future__ import annotations

import os
import pathlib
import re
import warnings
from collections.abc import Mapping
from typing import Any

import numpy as np

from firstorder.io._regular import MOST_TEXT_BYTES, read_regular_file
from firstorder.io.meshes import read_mesh_uv
from firstorder.io.scenes._beside import Beside
from firstorder.io.scenes._elements import Place, nearest_known, refused_at
from firstorder.io.scenes._mitsuba_shapes import READERS, closed_tubes, placed
from firstorder.io.scenes._mitsuba_xml import dict_of_xml
from firstorder.io.scenes._toml_tables import TomlTable, number, yes
from firstorder.io.scenes.space_toml import MeshModel, SpaceFile
from firstorder.space.primitives import Primitive, primitive

MESHES = ("obj", "ply")
BSDFS = ("diffuse", "twosided")
# What holds no light and no shape.
BESIDE = (
    "path", "direct", "volpath", "volpathmis", "ptracer", "aov", "depth", "moment", "prb",
    "prb_basic", "direct_projective", "prb_projective", "perspective", "thinlens", "orthographic",
    "radiancemeter", "irradiancemeter", "distant", "hdrfilm", "independent", "stratified",
    "multijitter", "orthogonal", "ldsampler",
)  # fmt: skip
# Names that stand more than once, or none, are told apart in the dict by a number behind them.
NUMBERED = re.compile(r"__\d+$")
_UNSPECIFIED = {"type": "diffuse", "reflectance": 0.5}


# --- reading -------------------------------------------------------------------------------------


def read_mitsuba(path: str | os.PathLike[str], *, outside: bool = False) -> SpaceFile:
    """Reads a scene of Mitsuba 3 from an XML file.

    What is read stands at the head of `firstorder.io.scenes.mitsuba`.

    Args:
        path: the file; meshes lie beside it.
        outside: whether files that it names may lie outside of its folder.

    Raises:
        ValueError: one sentence that names the file, the line and the element.
        FileNotFoundError: one sentence that names the path, if there is no such file.
        ModuleNotFoundError: without the extra `mesh`, if it names a mesh.
    """
    path = pathlib.Path(path)
    source = read_regular_file(path, MOST_TEXT_BYTES)
    scene, lines = dict_of_xml(source, path.name)
    return _read(scene, Beside(path.parent, outside), path.name, lines)


def space_from_mitsuba(
    scene: Mapping[str, Any],
    folder: str | os.PathLike[str] = ".",
    file: str = "scene",
    *,
    outside: bool = False,
) -> SpaceFile:
    """Reads a scene from the dict that `mitsuba.load_dict` takes.

    Args:
        scene: with `"type": "scene"`. A transform is a 4 x 4 array, or has one as `.matrix`.
        folder: where the meshes lie that it names.
        file: how sentences about errors call it.
        outside: whether files that it names may lie outside of that folder.

    Raises:
        ValueError: one sentence that names the element.
        ModuleNotFoundError: without the extra `mesh`, if it names a mesh.

    Example:
        >>> from firstorder.io import space_from_mitsuba
        >>> light = {"type": "area", "radiance": {"type": "rgb", "value": [2.0, 2.0, 2.0]}}
        >>> lamp = {"type": "sphere", "center": [0, 0, 2], "radius": 0.5, "emitter": light}
        >>> space = space_from_mitsuba({"type": "scene", "lamp": lamp})
        >>> space.things[0].name, space.things[0].material.emission.tolist()
        ('lamp', [[2.0, 0.0]])
        >>> space_from_mitsuba({"type": "scene", "lamp": lamp | {"type": "bsphere"}})
        Traceback (most recent call last):
        ValueError: scene, "lamp": the type "bsphere" is not known here: did you mean `sphere`?
    """
    return _read(scene, Beside(folder, outside), file, {})


def _read(
    scene: Mapping[str, Any], beside: Beside, file: str, lines: Mapping[str, int]
) -> SpaceFile:
    found = {k: _plain(v) for k, v in scene.items()}
    if found.pop("type", None) != "scene":
        raise Place(file).error('a scene of Mitsuba must say `"type": "scene"`.')
    elements = {k: _Element(k, v, Place(file, lines.get(k), f'"{k}"')) for k, v in found.items()}
    materials = {e.id: e.values for e in elements.values() if e.type in BSDFS}
    things, models, skies, left_out = [], [], [], []
    for element in elements.values():
        if element.type in READERS:
            things.append(_thing(element, materials))
        elif element.type in MESHES:
            models.append(_model(element, materials, beside))
        elif element.type == "constant":
            skies.append(element)
        elif element.type in BESIDE:
            left_out.append(f"{element.id} ({element.type})")
        elif element.type not in BSDFS and element.type not in _OTHER_BSDFS:
            known = nearest_known(element.type, (*READERS, *MESHES, *BSDFS, "constant"))
            raise element.place.error(f'the type "{element.type}" is not known here: {known}')
    closed, bare = closed_tubes(things)
    if bare:
        place = [e for e in elements.values() if e.type in READERS][bare[0]].place
        raise place.error("a cylinder is a tube in Mitsuba and has caps here: add a disk of the "
                          "same material at each of its ends.")  # fmt: skip
    if not closed and not models:
        raise Place(file).error("a scene must have at least one shape, but there is none.")
    if len(skies) > 1:
        raise skies[1].place.error("a scene has one constant emitter at most, and this is another.")
    sky = _sky(skies[0]) if skies else 0.0
    if left_out:
        warnings.warn(f"{file}: {', '.join(left_out)} left out: only shapes, materials and lights "
                      "are read.", stacklevel=3)  # fmt: skip
    return SpaceFile(tuple(closed), tuple(models), sky)


# Only refused where a shape has one of them on.
_OTHER_BSDFS = (
    "blendbsdf", "bumpmap", "conductor", "dielectric", "hair", "mask", "measured", "normalmap",
    "null", "phong", "plastic", "pplastic", "principled", "principledthin", "roughconductor",
    "roughdielectric", "roughplastic", "thindielectric",
)  # fmt: skip


class _Element:
    """An object of the scene: its own values, and the objects in it."""

    def __init__(self, key: str, values: Any, place: Place):
        if not isinstance(values, dict) or not isinstance(values.get("type"), str):
            raise place.error("an element of a scene must be a dict with a `type`.")
        self.values, self.place, self.type = values, place, values["type"]
        self.id = str(values.get("id", key))
        self.name = NUMBERED.sub("", self.id)
        self.inner = {
            k: v for k, v in values.items() if isinstance(v, dict) and v.get("type") not in BANDS
        }

    def table(self) -> TomlTable:
        """Table of the values that say where the element is and how large."""
        left = {k: v for k, v in self.values.items() if k not in (*self.inner, "type", "id")}
        return TomlTable(left, self.place, {}, self.id, 0)


def _plain(value: Any) -> Any:
    """Values as Python's own lists and numbers, by which they are checked."""
    if isinstance(value, Mapping):
        return {k: _plain(v) for k, v in value.items()}
    if isinstance(value, np.ndarray | np.generic):
        return value.tolist()
    if isinstance(value, list | tuple):
        return [_plain(v) for v in value]
    return value


def _thing(element: _Element, materials: Mapping[str, Any]) -> Primitive:
    table = element.table()
    material = _material(element, materials)
    shape = refused_at(table.at, lambda: READERS[element.type](table))
    table.done()
    return refused_at(table.at, lambda: primitive(shape, name=element.name, **material))


def _model(element: _Element, materials: Mapping[str, Any], beside: Beside) -> MeshModel:
    table, material = element.table(), _material(element, materials)
    path = table.file(beside, "filename")
    axes, shift = placed(table)
    turned = table.take("flip_normals", yes, False)
    flat = table.take("face_normals", yes, False)
    table.done()
    found, uv = refused_at(table.at, lambda: read_mesh_uv(path))
    if not flat and _has_normals(path):
        raise element.place.error(
            f"`face_normals` must be true, as {path.name} has normals of its own at its vertices "
            "and every face is flat here."
        )
    found = found.at(np.asarray(found.vertices) @ axes.T + shift)
    if turned:
        raise element.place.error("`flip_normals` must be false for a mesh: turn its faces round.")
    model = MeshModel(found, element.name, material, uv)
    refused_at(table.at, lambda: model.face_material)
    return model


def _has_normals(path: pathlib.Path) -> bool:
    """Whether a mesh has normals at its vertices, between which Mitsuba shades smoothly."""
    text = path.read_bytes()
    if path.suffix.lower() == ".ply":
        return (
            re.search(rb"^property\s+\w+\s+nx\s*$", text.partition(b"end_header")[0], re.M)
            is not None
        )
    return re.search(rb"^vn\s", text, re.M) is not None


# --- materials and light -------------------------------------------------------------------------

Light = float | tuple[float, ...]
BANDS = ("rgb", "spectrum", "uniform", "d65", "bitmap", "checkerboard", "mesh_attribute", "srgb")


def _material(element: _Element, materials: Mapping[str, Any]) -> dict[str, Any]:
    """The arguments of `primitive`, as numbers of front and back."""
    emission, albedo = 0.0, None
    for key, inner in element.inner.items():
        place = element.place
        if inner["type"] == "ref":
            name = inner.get("id")
            if name not in materials:
                known = nearest_known(str(name), materials)
                raise place.error(f"`{key}` must name a diffuse or twosided BSDF of the scene, but "
                                  f'is "{name}": {known}')  # fmt: skip
            inner = materials[name]
        if inner["type"] == "area":
            emission = _light(inner, "radiance", 1.0, place)
        elif inner["type"] in BSDFS and albedo is None:
            albedo = _albedo(inner, place)
        elif inner["type"] in BSDFS:
            raise place.error("a shape has one BSDF, but there are two.")
        else:
            known = nearest_known(inner["type"], (*BSDFS, "area"))
            raise place.error(f'`{key}` of type "{inner["type"]}" is not known here: {known}')
    if albedo is None:
        albedo = _albedo(_UNSPECIFIED, element.place)
    light = {"emission": _sides(emission, 0.0), "albedo": albedo}
    return {**light, "specular": 0.0, "exponent": 0.0}


def _sides(front: Light, back: Light) -> list[Any]:
    """Front and back, in bands if either has them."""
    bands = max(np.size(front), np.size(back))
    if bands == 1:
        return [front, back]
    return [np.broadcast_to(side, bands).tolist() for side in (front, back)]


def _albedo(bsdf: Mapping[str, Any], place: Place) -> list[Any]:
    """Albedo of front and back."""
    if bsdf["type"] == "diffuse":
        return _sides(_light(bsdf, "reflectance", 0.5, place), 0.0)
    within = [v for v in bsdf.values() if isinstance(v, dict)]
    if not 1 <= len(within) <= 2 or any(v.get("type") != "diffuse" for v in within):
        raise place.error("`twosided` must hold one diffuse BSDF, or two, but does not.")
    sides = [_light(v, "reflectance", 0.5, place) for v in within]
    return _sides(sides[0], sides[-1])


def _sky(element: _Element) -> Light:
    if element.inner:
        raise element.place.error(f"`{next(iter(element.inner))}` is not known here.")
    return _light(element.values, "radiance", 1.0, element.place)


def _light(values: Mapping[str, Any], key: str, default: float, place: Place) -> Light:
    """A number, or three bands of unlike ones; nothing else may stand beside it."""
    for other in values:
        if other not in (key, "type", "id"):
            raise place.error(f"`{other}` is not known here: known is {key}.")
    given, kind = values.get(key, default), "number"
    if isinstance(given, dict):
        kind = given.get("type")
        if kind not in ("rgb", "spectrum", "uniform") or set(given) - {"type", "id", "value"}:
            raise place.error(
                f'`{key}` must be a number, rgb, spectrum or uniform, but is "{kind}".'
            )
        given = given.get("value")
    bands: list[Any] = given if isinstance(given, list) else [given]
    if bands and all(isinstance(b, list) and len(b) == 2 for b in bands):  # (wavelength, value)
        bands = [b[1] for b in bands]
    try:
        found = tuple(number(b) for b in bands)
    except ValueError as error:
        raise place.error(f"`{key}` must be {error} in each band, but is {given!r:.40}.") from None
    if len(set(found)) == 1:
        return found[0]
    if kind == "rgb" and len(found) == 3:
        return found
    raise place.error(f"`{key}` must be the same at all wavelengths, or rgb, but is {given}.")
