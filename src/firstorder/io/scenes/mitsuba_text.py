"""Scenes of space as Mitsuba 3 loads them: its dict, and its XML, which `mitsuba` reads back."""

from __future__ import annotations

import os
import pathlib
import warnings
from collections.abc import Callable, Iterator
from typing import Any, NamedTuple

import numpy as np

from firstorder.io.files import write_text
from firstorder.io.scenes._elements import Place
from firstorder.io.scenes._mitsuba_shapes import written
from firstorder.io.scenes._mitsuba_xml import xml_of_dict
from firstorder.io.scenes.mitsuba import NUMBERED
from firstorder.io.scenes.space_toml import MeshModel, SpaceFile
from firstorder.scene._arguments import check_kind
from firstorder.space.scene import Scene
from firstorder.space.skies import ConstantSky

# What an object is called in XML, by its type.
TAGS = {
    **dict.fromkeys(("sphere", "cube", "rectangle", "disk", "cylinder", "ply"), "shape"),
    **dict.fromkeys(("diffuse", "twosided"), "bsdf"),
    **dict.fromkeys(("area", "constant"), "emitter"),
}


def write_mitsuba(path: str | os.PathLike[str], space: SpaceFile | Scene) -> None:
    """Writes a scene of space as an XML file for Mitsuba 3, whole or not at all.

    Args:
        path: the file; meshes are written beside it, as .ply files.
        space: as `read_space` or `read_mitsuba` gives it, or a scene.

    Raises:
        ValueError: one sentence, if something in it has no counterpart.
    """
    path = pathlib.Path(path)
    found = space_to_mitsuba(space, folder=path.parent, stem=path.stem)
    write_text(path, xml_of_dict(found, TAGS))


def space_to_mitsuba(
    space: SpaceFile | Scene,
    *,
    transform: Callable[[np.ndarray], Any] = np.asarray,
    folder: str | os.PathLike[str] | None = None,
    stem: str = "mesh",
) -> dict[str, Any]:
    """The dict that `mitsuba.load_dict` takes; `space_from_mitsuba` reads it to the bit.

    Args:
        space: as `read_space` or `read_mitsuba` gives it, or a scene.
        transform: what makes Mitsuba's transform of a 4 x 4 array: `mitsuba.ScalarTransform4f`.
            Left out, the arrays themselves stand in the dict.
        folder: where meshes are written, as .ply files.
        stem: how their names begin.

    Raises:
        ValueError: one sentence, if something in it has no counterpart: planes, triangles,
            ellipsoids, glossy lobes, surface maps, light from the back, a sky that is no number, or
            meshes without a folder.

    Example:
        >>> from firstorder.io import space_to_mitsuba
        >>> from firstorder.space import Scene, sphere, primitive
        >>> lamp = primitive(sphere((0.0, 0.0, 1.0), 0.5), name="lamp", emission=2.0)
        >>> written = space_to_mitsuba(Scene.of(lamp))
        >>> written["lamp"]["center"], written["lamp"]["emitter"]["radiance"]["value"]
        ([0.0, 0.0, 1.0], [2.0, 2.0, 2.0])
    """
    if not isinstance(space, SpaceFile):
        check_kind("space", space, Scene)
    found: dict[str, Any] = {"type": "scene"}
    keys = _Keys()
    for row in _rows(space):
        for ending, made in _elements(row, transform):
            found[keys.new(f"{row.name}{ending}" if row.name else "")] = made
    if isinstance(space, SpaceFile):
        found |= _models_dict(space, keys, folder, stem)
        left = ["the camera"] * (space.camera is not None)
        left += ["(u, v) of meshes"] * any(model.uv is not None for model in space.models)
        if left:
            words = "only shapes, materials and lights are written."
            warnings.warn(f"Left out: {', '.join(left)}; {words}", stacklevel=2)
    sky = space.environment if isinstance(space, Scene) else space.sky
    sky = sky.radiance if isinstance(sky, ConstantSky) else sky
    if callable(sky):
        raise ValueError("Argument `space` must have a sky that is a number, but has "
                         f"{type(sky).__name__}.")  # fmt: skip
    if sky is not None and np.any(np.asarray(sky)):
        found[keys.new("sky")] = {"type": "constant", "radiance": _rgb(sky)}
    return found


class _Keys:
    """Names of elements, each once."""

    def __init__(self):
        self.used = {"type"}

    def new(self, name: str) -> str:
        """A key that is the name, or the name and a number that reading takes away."""
        if "." in name:
            raise ValueError(f'Mitsuba takes no name with a dot in it, such as "{name}".')
        key, count = name, 0
        while not key or key in self.used or (key == name and NUMBERED.search(name)):
            key, count = f"{name}__{count}", count + 1
        self.used.add(key)
        return key


class _Row(NamedTuple):
    """A shape: its group and its number there, its material and its number there, its name."""

    group: Any
    i: int
    material: Any
    row: int
    name: str


def _rows(space: SpaceFile | Scene) -> Iterator[_Row]:
    """The shapes of a scene, in the order of their numbers."""
    if isinstance(space, Scene):
        first = 0
        for group in space.groups:
            for i in range(group.count):
                yield _Row(group, i, space.material, first + i, space.names[first + i])
            first += group.count
        return
    if any(coat.names for coat in space.coats):
        raise ValueError("Surface maps (texture, bump, normal map) are not written for Mitsuba.")
    for thing in space.things:
        for i in range(thing.shape.count):
            yield _Row(thing.shape, i, thing.material, i, thing.name)


def _elements(row: _Row, transform: Callable[[np.ndarray], Any]) -> list[tuple[str, dict]]:
    """The shapes of Mitsuba that make one of ours, each with how its name ends."""
    try:
        light = _material_dict(row.material, row.row)
        made = list(written(row.group, row.i))
    except ValueError as error:
        raise Place("", None, _called("shape", row.name)).error(error) from None
    found = []
    for ending, kind, where in made:
        placed = {k: transform(v) if k == "to_world" else v for k, v in where.items()}
        found.append((ending, {"type": kind, **placed, **light}))
    return found


def _called(kind: str, name: str) -> str:
    return f'{kind} "{name}"' if name else f"a {kind} without a name"


def _material_dict(material: Any, row: int) -> dict[str, Any]:
    """BSDF and emitter of a shape."""
    emission, albedo, specular = (
        np.asarray(getattr(material, key))[row] for key in ("emission", "albedo", "specular")
    )
    if specular != 0.0:
        raise ValueError("glossy lobes are not written for Mitsuba.")
    if np.any(emission[1]):
        raise ValueError("Mitsuba's area emitters shine from the front alone, and this one also or "
                         "only from the back.")  # fmt: skip
    found: dict[str, Any] = {"bsdf": _bsdf(*albedo)}
    if np.any(emission[0]):
        found["emitter"] = {"type": "area", "radiance": _rgb(emission[0])}
    return found


def _bsdf(front: Any, back: Any) -> dict[str, Any]:
    one = {"type": "diffuse", "reflectance": _rgb(front)}
    if not np.any(back):
        return one
    if np.array_equal(back, front):
        return {"type": "twosided", "front": one}
    return {"type": "twosided", "front": one,
            "back": {"type": "diffuse", "reflectance": _rgb(back)}}  # fmt: skip


def _rgb(value: Any) -> dict[str, Any]:
    """One band, which is all three of Mitsuba's, or three."""
    if np.size(value) not in (1, 3):
        raise ValueError(f"Mitsuba has three bands, but here are {np.size(value)}.")
    return {"type": "rgb", "value": np.broadcast_to(np.asarray(value, float), 3).tolist()}


def _models_dict(
    space: SpaceFile, keys: _Keys, folder: str | os.PathLike[str] | None, stem: str
) -> dict[str, Any]:
    """Meshes, each in a file of its own."""
    found = {}
    for k, model in enumerate(space.models):
        if folder is None:
            raise ValueError("Argument `folder` must be given, as Mitsuba reads meshes from files.")
        name = f"{stem}_{k}.ply"
        try:
            light = _material_dict(model.face_material, 0)
        except ValueError as error:
            raise Place("", None, _called("mesh", model.name)).error(error) from None
        write_text(pathlib.Path(folder, name), _ply(model))
        where = {"type": "ply", "filename": name, "face_normals": True}
        found[keys.new(model.name)] = where | light
    return found


def _ply(model: MeshModel) -> str:
    """A mesh as the text of a PLY file in double precision."""
    vertices, faces = np.asarray(model.mesh.vertices, float), np.asarray(model.mesh.faces)
    head = ["ply", "format ascii 1.0", f"element vertex {len(vertices)}",
            *(f"property double {axis}" for axis in "xyz"), f"element face {len(faces)}",
            "property list uchar int vertex_indices", "end_header"]  # fmt: skip
    points = (" ".join(map(repr, row)) for row in vertices.tolist())
    corners = (f"3 {a} {b} {c}" for a, b, c in faces.tolist())
    return "\n".join([*head, *points, *corners]) + "\n"
