"""What a scene file of space says of itself in print."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import jax
import numpy as np

from firstorder._argument_checks import is_concrete
from firstorder.scene._words import (
    NAMELESS,
    _boxes,
    _counted,
    _extent,
    _few,
    _light,
    _numbers_of,
    _place,
    _rows,
    _sky,
    _tuple,
)
from firstorder.space.scene import Scene
from firstorder.space.shapes._bounds import bounds

Row = tuple[str, str, str, str]


def told_file(file: Any) -> str:
    """A line for the extent, one for each name as a scene has it, for each mesh, and the camera.

    Args:
        file: a `SpaceFile`.
    """
    shapes = sum(thing.shape.count for thing in file.things)
    counts = ((shapes, "shapes"), (len(file.models), "meshes"))
    head = f"SpaceFile: {', '.join(_counted(*count) for count in counts if count[0]) or 'empty'}"
    parts = [(thing.shape, thing.material) for thing in file.things]
    parts += [(model.mesh, model.material) for model in file.models]
    if not is_concrete((parts, file.camera)):
        return f"{head}, traced"
    with jax.ensure_compile_time_eval():  # numbers are printed among traced ones, too
        return "\n  ".join(_lines(file, head))


def _lines(file: Any, head: str) -> list[str]:
    """All that is said of a file of numbers."""
    rows, boxes = _meshes(file.models)
    if file.things:
        scene = Scene.of(*file.things)
        boxes.append(_boxes(scene, bounds))
        rows = _rows(scene, *boxes[-1]) + rows
    where = _extent(*map(np.concatenate, zip(*boxes, strict=True))) if boxes else ""
    return [f"{head}{where}", *_few(rows), *_maps(file), *_sky(file.sky), _camera(file)]


def _meshes(models: Sequence[Any]) -> tuple[list[Row], list[tuple[np.ndarray, np.ndarray]]]:
    """A row for each mesh, and its box."""
    rows, boxes = [], []
    for model in models:
        vertices = np.asarray(model.mesh.vertices)
        low, high = vertices.min(0, keepdims=True), vertices.max(0, keepdims=True)
        what = f"mesh of {_counted(model.mesh.count, 'triangles')}"
        light = _light(_numbers_of(model.face_material), [0])
        rows.append((model.name or NAMELESS, what, _place(low, high), light))
        boxes.append((low, high))
    return rows, boxes


def _maps(file: Any) -> list[str]:
    """A line that says which shapes and meshes wear which maps, if any do."""
    names = [part.name or NAMELESS for part in (*file.things, *file.models)]
    worn = zip(names, file.coats, strict=False)  # no coats at all are as good as bare ones
    worn = [f"{name} ({', '.join(coat.names)})" for name, coat in worn if coat.names]
    return [f"surface maps: {', '.join(worn)}".replace("_", " ")] if worn else []


def _camera(file: Any) -> str:
    if file.camera is None:
        return "no camera"
    eye, axes = np.asarray(file.camera.eye), np.asarray(file.camera.axes)
    return f"camera at {_tuple(eye)} m, looking along {_tuple(-axes[:, 2])}"
