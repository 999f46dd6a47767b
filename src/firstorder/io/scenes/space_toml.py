"""Scenes of space as TOML files: written by hand, or by `write_space`; they come back to the bit.

    dimensions = 3

    [[shape]]
    kind = "sphere"
    center = [0.0, 0.0, 1.0]  # metres
    radius = 0.5
    name = "ball"             # optional, as everything below
    emission = 0.0            # W/(m^2 sr); or [front, back]; each may be [red, green, blue]
    two_sided = false         # whether a single emission holds for the back too
    albedo = 0.5              # of both sides, or [front, back]; bands likewise
    specular = 0.0            # share of a glossy lobe cos^exponent
    exponent = 0.0

    [[mesh]]
    file = "bunny.ply"        # beside this file; or `vertices` and `faces` (numbers from 0)
    scale = 1.0               # about the file's origin, and then
    move = [0.0, 0.0, 0.0]
    albedo = 0.5              # name and material as above

    [environment]             # distant light
    kind = "gaussian"         # constant (radiance), gaussian (center, sigma, radiance), ...
    sigma = 0.5

    [camera]
    eye = [0.0, -4.0, 2.0]
    look_at = [0.0, 0.0, 0.5]
    up = [0.0, 0.0, 1.0]
    gamma = 2.0               # focal length, in units of the image

| kind | geometry |
|---|---|
| sphere | `center`, `radius` |
| ellipsoid | `center`, `semi` |
| box | `low`, `high` |
| cylinder | `base`, `top`, `radius` |
| disc | `center`, `normal`, `radius` |
| rectangle | `center`, and half-edges `u`, `v`; the front is along u x v |
| triangle | `corners`, counter-clockwise from the front |
| polygon | `vertices`, likewise |
| plane | `point`, `normal` |
| all but sphere and polygon | or `center` and `axes`, three vectors: an affine image, below |
| panorama | `file`, with `colour`, or `values`: rows from the zenith; `degree` of harmonics |
| harmonic | `coefficients`, in the order of `space.HarmonicSky` |

An affine image has its points at `center` + q_1 a_1 + q_2 a_2 + q_3 a_3, with q in the unit ball
(ellipsoid), the cube [-1, 1]^3 (box), the unit disc times [-1, 1] (cylinder), or in the plane
q_3 = 0 in the unit disc, the square [-1, 1]^2 (rectangle), the triangle of (0, 0), (1, 0) and
(0, 1), or all of it (plane). A flat one has its front along a_1 x a_2.

What a shape or mesh has on it stands in tables within its own, `[shape.texture]`, `[shape.bump]`
and `[shape.normal_map]`, or `[mesh.texture]` and so on: `firstorder.io.scenes._surface_maps` says
what is in them.
"""

from __future__ import annotations

import dataclasses
import os
import pathlib
from collections.abc import Callable
from typing import Any

import jax.numpy as jnp
import numpy as np

from firstorder._display import as_picture, in_print
from firstorder.imaging.camera import Pinhole
from firstorder.io._faces import valid_faces
from firstorder.io._regular import MOST_TEXT_BYTES, read_regular_file
from firstorder.io.meshes import read_mesh_uv
from firstorder.io.scenes._beside import Beside
from firstorder.io.scenes._elements import Place, both_sides, nearest_known, refused_at
from firstorder.io.scenes._skies import sky_of
from firstorder.io.scenes._space_words import told_file
from firstorder.io.scenes._surface_maps import MapSet, corner_uv, map_set_of
from firstorder.io.scenes._toml_tables import (
    TomlTable,
    lines_of,
    number,
    parsed,
    sided,
    tables_of,
    three_vectors,
    triples,
    vector,
    vectors,
    word,
    yes,
)
from firstorder.numerics._vectors import cross, unit
from firstorder.space.meshes.triangle_mesh import Mesh, mesh
from firstorder.space.primitives import Material, Primitive, primitive
from firstorder.space.scene import Scene
from firstorder.space.shapes import build, kinds

MATERIAL = ("emission", "albedo", "specular", "exponent")
_TOP = ("dimensions", "shape", "mesh", "environment", "camera")
CLASSES = {
    "ellipsoid": kinds.Ellipsoids,
    "box": kinds.Boxes,
    "cylinder": kinds.Cylinders,
    "disc": kinds.Discs,
    "rectangle": kinds.Rectangles,
    "triangle": kinds.Triangles,
    "plane": kinds.Planes,
}


@dataclasses.dataclass(frozen=True)
class MeshModel:
    """A mesh with a name and a material.

    Attributes:
        mesh: for silhouettes and Embree.
        name: for `Scene.named`.
        material: arguments of `primitive`, by name.
        uv: at the corners of each face, for pictures, shape (f, 3, 2); or None.

    Example:
        >>> from firstorder.io import MeshModel
        >>> from firstorder.space.meshes import mesh
        >>> one = mesh([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])
        >>> MeshModel(one, "leaf", {"albedo": 0.5}).name
        'leaf'
    """

    mesh: Mesh
    name: str
    material: dict[str, Any]
    uv: Any = None

    __repr__ = in_print

    @property
    def face_material(self) -> Material:
        """The material as of one shape, each number for front and back."""
        return primitive(build.sphere((0.0, 0.0, 0.0), 1.0), **self.material).material

    @property
    def thing(self) -> Primitive:
        """The mesh as triangles of a scene: right for rays, slow for many."""
        a, b, c = (self.mesh.corners[:, k] for k in range(3))
        u, v = b - a, c - a
        return primitive(
            kinds.Triangles(a, jnp.stack([u, v, unit(cross(u, v))], -1)),
            name=self.name,
            **self.material,
        )


@dataclasses.dataclass(frozen=True)
class SpaceFile:
    """Contents of a scene file of space.

    Attributes:
        things: primitives, shapes with materials.
        models: meshes with materials.
        sky: radiance from beyond everything: a number, or a function of the direction.
        camera: or None.
        coats: maps of the primitives and then of the models, one for each; or empty.

    Example:
        >>> from firstorder.io import SpaceFile
        >>> from firstorder.space import primitive, sphere
        >>> SpaceFile((primitive(sphere((0.0, 0.0, 1.0), 0.5), name="ball", albedo=0.5),))
        SpaceFile: 1 shape, x -0.5 to 0.5 m, y -0.5 to 0.5 m, z 0.5 to 1.5 m
          ball  1 ellipsoid  x -0.5 to 0.5, y -0.5 to 0.5, z 0.5 to 1.5  albedo 0.5
          no camera
    """

    things: tuple[Primitive, ...]
    models: tuple[MeshModel, ...] = ()
    sky: Any = 0.0
    camera: Pinhole | None = None
    coats: tuple[MapSet, ...] = ()

    _repr_html_ = as_picture

    def __repr__(self) -> str:
        return told_file(self)

    @property
    def scene(self) -> Scene:
        """Everything as one scene, meshes as triangles, without coats."""
        return Scene.of(*self.things, *(model.thing for model in self.models), environment=self.sky)


# --- reading -------------------------------------------------------------------------------------


def read_space(path: str | os.PathLike[str], *, outside: bool = False) -> SpaceFile:
    r"""Reads a scene of space from a TOML file.

    Its keys stand at the head of `firstorder.io.scenes.space_toml`.

    Args:
        path: the file.
        outside: whether files that it names may lie outside of its folder.

    Raises:
        ValueError: one sentence that names the file, the line and the element, if it is no scene.
        ModuleNotFoundError: without the extra that reads a mesh or a panorama that it names.

    Example:
        >>> import pathlib, tempfile
        >>> from firstorder.io import read_space
        >>> file = pathlib.Path(tempfile.mkdtemp(), "ball.toml")
        >>> start = 'dimensions = 3\n[[shape]]\nkind = "sphere"\ncenter = [0, 0, 1]\nradius = '
        >>> _ = file.write_text(start + "0.5")
        >>> read_space(file).scene.count
        1
        >>> _ = file.write_text(start + "-1")
        >>> read_space(file)
        Traceback (most recent call last):
        ValueError: ball.toml, line 5, shape 1: `radius` must be positive, but is -1.0.
    """
    path = pathlib.Path(path)
    source = read_regular_file(path, MOST_TEXT_BYTES)
    return space_from_toml(source, path.name, path.parent, outside=outside)


def is_space(path: str | os.PathLike[str]) -> bool:
    """Whether a file is a TOML scene that says `dimensions = 3`.

    Args:
        path: of the file.

    Raises:
        ValueError: one sentence, if a .toml file is no TOML.
        FileNotFoundError: one sentence that names the path, if there is no such .toml file.

    Example:
        >>> import pathlib, tempfile
        >>> from firstorder.io import is_space, write_text
        >>> file = pathlib.Path(tempfile.mkdtemp(), "a.toml")
        >>> write_text(file, "dimensions = 3")
        >>> is_space(file)
        True
    """
    path = pathlib.Path(path)
    if path.suffix.lower() != ".toml":
        return False
    source = read_regular_file(path, MOST_TEXT_BYTES)
    return parsed(source, path.name)[1].get("dimensions") == 3


def space_from_toml(
    source: str | bytes,
    file: str = "scene",
    folder: str | os.PathLike[str] = ".",
    *,
    outside: bool = False,
) -> SpaceFile:
    r"""Reads a scene of space from the text of a TOML file.

    Args:
        source: the text, or its bytes in UTF-8.
        file: how sentences about errors call it.
        folder: where the meshes and panoramas that it names lie.
        outside: whether files that it names may lie outside of that folder.

    Raises:
        ValueError: one sentence that names the line and the element.

    Example:
        >>> from firstorder.io import space_from_toml
        >>> text = "dimensions = 3\n[[shape]]\nkind = 'sphere'\ncenter = [0, 0, 1]\nradius = 0.5"
        >>> space_from_toml(text).scene.count
        1
    """
    text, tables = parsed(source, file)
    lines, beside = lines_of(text), Beside(folder, outside)
    for key, value in tables.items():
        _check_key(key, value, Place(file, lines.get((key, 0, ""))))
    if tables.get("dimensions") != 3:
        raise Place(file).error("a scene of space must say `dimensions = 3` at its top.")

    def each(key: str) -> list[TomlTable]:
        return tables_of(tables, key, file, lines)

    def one(key: str, read: Callable[[TomlTable], Any], default: Any) -> Any:
        if key not in tables:
            return default
        table = TomlTable(tables[key], Place(file, lines.get((key, 0, "")), key), lines, key, 0)
        found = read(table)
        table.done()
        return found

    things = [_thing(table, beside) for table in each("shape")]
    models = [_model(table, beside) for table in each("mesh")]
    if not things and not models:
        raise Place(file).error("a scene must have at least one shape or mesh, but there is none.")
    sky = one("environment", lambda table: sky_of(table, beside), 0.0)
    coats = tuple(coat for _, coat in (*things, *models))
    shapes_, meshes_ = (tuple(made for made, _ in a) for a in (things, models))
    return SpaceFile(shapes_, meshes_, sky, one("camera", _camera, None), coats)


def _check_key(key: str, value: Any, place: Place) -> None:
    """Refuses what does not stand at the top of a scene file."""
    if key in ("shape", "mesh"):
        if not (isinstance(value, list) and all(isinstance(v, dict) for v in value)):
            raise place.error(f"`{key}` must be written [[{key}]], each with its own keys.")
    elif key in ("environment", "camera"):
        if not isinstance(value, dict):
            raise place.error(f"`{key}` must be written [{key}], with its own keys.")
    elif key not in _TOP:
        raise place.error(f"`{key}` is not known here: {nearest_known(key, _TOP)}")


def _material(table: TomlTable) -> dict[str, Any]:
    """The arguments of `primitive`; a single emission is the front's."""
    two_sided = table.take("two_sided", yes, False)
    found = {
        k: table.take(k, sided if k in ("emission", "albedo") else number, 0.0) for k in MATERIAL
    }
    found["emission"] = both_sides(found["emission"], two_sided)
    found["albedo"] = both_sides(found["albedo"], True)
    return found


def _thing(table: TomlTable, beside: Beside) -> tuple[Primitive, MapSet]:
    kind, name, material = table.take("kind", word), table.take("name", word, ""), _material(table)
    if kind not in _GEOMETRY:
        known = nearest_known(kind, _GEOMETRY)
        raise table.at("kind").error(f'kind "{kind}" is not known: {known}')
    if "axes" in table.values and kind in CLASSES:
        center, axes = table.take("center", vector), table.take("axes", three_vectors)
        made = refused_at(
            table.at, lambda: CLASSES[kind](np.array(center), np.array(axes).T)
        )  # fmt: skip
    else:
        make, reads = _GEOMETRY[kind]
        given = {key: table.take(key, read) for key, read in reads.items()}
        arrays = {k: np.array(v, float) for k, v in given.items()}
        made = refused_at(table.at, lambda: make(**arrays))
    coat = map_set_of(table, beside, kind != "polygon")
    table.done()
    return refused_at(table.at, lambda: primitive(made, name=name, **material)), coat


def _ellipsoid(center, semi):
    if not np.all(semi > 0.0):
        raise ValueError(f"Argument `semi` must be positive, but is {semi[~(semi > 0.0)][0]}.")
    return build.ellipsoid(center, np.diag(semi))


def _triangle(corners):
    if len(corners) != 3:
        raise ValueError(f"Argument `corners` must be three points, but is {len(corners)}.")
    try:
        return build.triangle(*corners)
    except ValueError:
        raise ValueError("Argument `corners` must not lie in line, but does.") from None


_GEOMETRY: dict[str, tuple[Callable[..., Any], dict[str, Callable[[Any], Any]]]] = {
    "sphere": (build.sphere, {"center": vector, "radius": number}),
    "ellipsoid": (_ellipsoid, {"center": vector, "semi": vector}),
    "box": (build.box, {"low": vector, "high": vector}),
    "cylinder": (build.cylinder, {"base": vector, "top": vector, "radius": number}),
    "disc": (build.disc, {"center": vector, "normal": vector, "radius": number}),
    "rectangle": (build.rectangle, {"center": vector, "u": vector, "v": vector}),
    "triangle": (_triangle, {"corners": vectors}),
    "polygon": (build.polygon, {"vertices": vectors}),
    "plane": (build.plane, {"point": vector, "normal": vector}),
}


def _model(table: TomlTable, beside: Beside) -> tuple[MeshModel, MapSet]:
    name, material = table.take("name", word, ""), _material(table)
    if "file" in table.values:
        path = table.file(beside)
        scale, move = table.take("scale", number, 1.0), table.take("move", vector, [0.0] * 3)
        if not scale > 0.0:
            raise table.at("scale").error(f"`scale` must be positive, but is {scale}.")
        found, uv = refused_at(lambda key: table.at("file"), lambda: read_mesh_uv(path))
        found = found.at(scale * found.vertices + np.array(move))
    else:
        vertices, faces = table.take("vertices", vectors), table.take("faces", triples)
        found = refused_at(table.at, lambda: mesh(np.array(vertices), np.array(faces)))
        uv = table.take("uv", corner_uv, None)
        if uv is not None:
            if len(uv) != len(faces):
                raise table.at("uv").error(
                    f"`uv` must be three pairs for each of {len(faces)} faces, but is of {len(uv)}."
                )
            uv = np.array(uv)[valid_faces(np.array(faces))]
    coat = map_set_of(table, beside, uv is not None)
    table.done()
    model = MeshModel(found, name, material, None if uv is None else np.array(uv, float))
    refused_at(table.at, lambda: model.face_material)
    return model, coat


def _camera(table: TomlTable) -> Pinhole:
    eye, gamma = np.array(table.take("eye", vector)), table.take("gamma", number)
    if "axes" in table.values:
        axes = np.array(table.take("axes", three_vectors)).T
        if np.max(np.abs(axes.T @ axes - np.eye(3))) > 1e-6:
            raise table.at("axes").error("`axes` must be orthonormal, but is not.")
    else:
        target = np.array(table.take("look_at", vector))
        up = np.array(table.take("up", vector, [0.0, 0.0, 1.0]))
        right = np.cross(target - eye, up)
        if not np.linalg.norm(right) > 1e-12 * np.linalg.norm(target - eye) * np.linalg.norm(up):
            raise table.at("up").error("`up` must not be along the view, but is.")
        back = (eye - target) / np.linalg.norm(eye - target)
        right = right / np.linalg.norm(right)
        axes = np.stack([right, np.cross(back, right), back], -1)
    return refused_at(table.at, lambda: Pinhole(eye, axes, gamma))
