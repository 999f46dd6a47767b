"""Scenes of space as text: TOML that `space_toml` reads back to the bit, and lists."""

from __future__ import annotations

import os
from collections.abc import Iterator
from typing import Any

import numpy as np

from firstorder.io.files import write_text
from firstorder.io.scenes._surface_maps import MapSet, map_set_text
from firstorder.io.scenes._toml_text import exact_text, material_lines, quoted
from firstorder.io.scenes.space_toml import CLASSES, MATERIAL, MeshModel, SpaceFile
from firstorder.scene._arguments import check_kind
from firstorder.space.primitives import Material
from firstorder.space.scene import Scene
from firstorder.space.skies import ConstantSky, GaussianSky, HarmonicSky, PanoramaSky


def write_space(path: str | os.PathLike[str], space: SpaceFile | Scene) -> None:
    """Writes a scene of space as a TOML file, whole or not at all; it comes back to the bit.

    Args:
        path: the file.
        space: as `read_space` gives it, or a scene. Meshes are written out, not as files; a
            scene's triangles are triangles. A sky of every direction alike becomes a number.

    Raises:
        ValueError: if the sky is a function that a file cannot name.

    Example:
        >>> import pathlib, tempfile
        >>> from firstorder.io import read_space, write_space
        >>> from firstorder.space.library import j12_occluder
        >>> file = pathlib.Path(tempfile.mkdtemp(), "b.toml")
        >>> write_space(file, j12_occluder())
        >>> read_space(file).scene.named("block")
        (0,)
    """
    write_text(path, space_to_toml(space))


def space_to_toml(space: SpaceFile | Scene) -> str:
    """The text that `write_space` writes.

    Raises:
        ValueError: if the sky is a function that a file cannot name.

    Example:
        >>> from firstorder.io import space_to_toml
        >>> from firstorder.space import Scene, sphere, primitive
        >>> ball = primitive(sphere((0.0, 0.0, 1.0), 0.5), name="ball", albedo=0.2)
        >>> print(space_to_toml(Scene.of(ball, environment=1.0)))
        dimensions = 3
        <BLANKLINE>
        [[shape]]
        kind = "sphere"
        name = "ball"
        center = [0.0, 0.0, 1.0]
        radius = 0.5
        albedo = 0.2
        <BLANKLINE>
        [environment]
        kind = "constant"
        radiance = 1.0
        <BLANKLINE>
    """
    tables = ["dimensions = 3"]
    if not isinstance(space, SpaceFile):
        check_kind("space", space, Scene)
        sky, first = space.environment, 0
        for group in space.groups:
            for i in range(group.count):
                tables.append(_shape_text(group, i, space.names[first], space.material, first))
                first += 1
    else:
        sky = space.sky
        coats = space.coats or (MapSet(),) * (len(space.things) + len(space.models))
        first = len(space.things)
        tables += [
            _shape_text(t.shape, i, t.name, t.material, i) + map_set_text(coat, "shape")
            for t, coat in zip(space.things, coats[:first], strict=True)
            for i in range(t.shape.count)
        ]
        tables += [
            _model_text(model) + map_set_text(coat, "mesh")
            for model, coat in zip(space.models, coats[first:], strict=True)
        ]
        if space.camera is not None:
            camera = space.camera
            tables.append(
                f"[camera]\neye = {exact_text(camera.eye)}\naxes = {exact_text(camera.axes.T)}\n"
                f"gamma = {exact_text(camera.gamma)}"
            )
    if words := _sky_text(sky):
        tables.append(f"[environment]\n{words}")
    return "\n\n".join(tables) + "\n"


def _shape_text(group: Any, i: int, name: str, material: Any, row: int) -> str:
    kind = _kind(group, i)
    round_ = kind == "sphere"
    center, axes = np.asarray(group.center)[i], np.asarray(group.axes)[i]
    lines = [f'kind = "{kind}"']
    lines += [f"name = {quoted(name)}"] * bool(name)
    lines.append(f"center = {exact_text(center)}")
    lines.append(f"radius = {exact_text(axes[0, 0])}" if round_ else f"axes = {exact_text(axes.T)}")
    return "\n".join(["[[shape]]", *lines, *_material_lines(material, row)])


def _model_text(model: MeshModel) -> str:
    lines = [f"name = {quoted(model.name)}"] * bool(model.name)
    faces = ", ".join(f"[{a}, {b}, {c}]" for a, b, c in np.asarray(model.mesh.faces).tolist())
    lines += [f"vertices = {exact_text(model.mesh.vertices)}", f"faces = [{faces}]"]
    if model.uv is not None:
        lines.append(f"uv = {exact_text(model.uv)}")
    return "\n".join(["[[mesh]]", *lines, *_material_lines(model.face_material, 0)])


def _material_lines(material: Material, row: int) -> Iterator[str]:
    return material_lines({key: np.asarray(getattr(material, key))[row] for key in MATERIAL})


def _sky_text(sky: Any) -> str:
    match sky:
        case GaussianSky():
            keys = {k: getattr(sky, k) for k in ("center", "sigma", "radiance")}
            kind = "gaussian"
        case PanoramaSky():
            kind, keys = "panorama", {"values": sky.values}
        case HarmonicSky():
            kind, keys = "harmonic", {"coefficients": sky.coefficients}
        case ConstantSky():
            kind, keys = "constant", {"radiance": sky.radiance}
        case _ if callable(sky):
            raise ValueError(
                "Argument `space` must have a sky that a file can name (a number, GaussianSky, "
                f"PanoramaSky or HarmonicSky), but has {type(sky).__name__}."
            )
        case _:
            if sky is None or not np.any(np.asarray(sky)):
                return ""
            kind, keys = "constant", {"radiance": sky}
    return "\n".join([f'kind = "{kind}"', *(f"{k} = {exact_text(v)}" for k, v in keys.items())])


# --- describing ----------------------------------------------------------------------------------


def describe_space(space: SpaceFile) -> str:
    r"""Contents of a scene of space: one line for each shape and mesh, the sky and the camera.

    Args:
        space: as `read_space` gives it.

    Raises:
        TypeError: if it is something else.
        ValueError: if the sky is a function that a file cannot name.

    Example:
        >>> from firstorder.io import describe_space, space_from_toml
        >>> text = 'dimensions = 3\n[[shape]]\nkind = "sphere"\ncenter = [0, 0, 1]\nradius = 0.5'
        >>> print(describe_space(space_from_toml(text)))
        sphere     unnamed       at (0, 0, 1)
        sky        black
        camera     none
    """
    check_kind("space", space, SpaceFile)
    lines = []
    wear = [", ".join(c.names).replace("_", " ") for c in space.coats]
    wear = [words and f", with {words}" for words in wear]
    wear = wear or [""] * (len(space.things) + len(space.models))
    for t, worn in zip(space.things, wear, strict=False):
        centers = np.asarray(t.shape.center)
        for i in range(t.shape.count):
            kind, where = _kind(t.shape, i), f"at {_numbers(centers[i])}{worn}"
            lines.append((kind, t.name or "unnamed", where, t.material, i))
    for model, worn in zip(space.models, wear[len(space.things) :], strict=True):
        size = f"{model.mesh.count} faces, {len(model.mesh.vertices)} vertices"
        shut = "closed" if model.mesh.closed else "with a boundary"
        lines.append(
            ("mesh", model.name or "unnamed", f"{size}, {shut}{worn}", model.face_material, 0)
        )
    words = [f"{k:10} {n:13} {what}{_light(m, i)}" for k, n, what, m, i in lines]
    sky = _sky_text(space.sky).splitlines()
    named = {"kind": "black"} | dict(line.split(" = ", 1) for line in sky)
    rest = ", ".join(f"{k} {v}" for k, v in named.items() if k != "kind" and len(v) < 60)
    words.append(f"{'sky':10} {named['kind'].strip(chr(34))}{rest and ', '}{rest}")
    if space.camera is None:
        words.append(f"{'camera':10} none")
    else:
        ahead = _numbers(-np.asarray(space.camera.axes)[:, 2])
        words.append(f"{'camera':10} at {_numbers(space.camera.eye)}, looking along {ahead}")
    return "\n".join(words)


def _kind(shape: Any, i: int) -> str:
    axes = np.asarray(shape.axes)[i]
    kind = next(k for k, kind in CLASSES.items() if type(shape) is kind)
    return "sphere" if kind == "ellipsoid" and _is_round(axes) else kind


def _is_round(axes: np.ndarray) -> bool:
    return bool(axes[0, 0] > 0 and np.all(axes == axes[0, 0] * np.eye(3)))


def _numbers(x: Any) -> str:
    rounded = np.round(np.asarray(x), 9) + 0.0
    words = (_numbers(v) if np.ndim(v) else f"{v:.4g}" for v in rounded)
    return f"({', '.join(words)})"


def _light(material: Any, i: int) -> str:
    """Emission and albedo of a shape in words; empty if it has none."""
    emission, albedo = np.asarray(material.emission)[i], np.asarray(material.albedo)[i]
    found = [f", emits {_numbers(emission)}"] * bool(np.any(emission))
    found += [f", albedo {_numbers(albedo)}"] * bool(np.any(albedo))
    return "".join(found)
