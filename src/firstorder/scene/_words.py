"""What scenes, receivers and derivatives say of themselves in print."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence
from typing import Any

import jax
import numpy as np

from firstorder._argument_checks import is_concrete

ROWS = 8  # lines of shapes before the rest is counted
AXES = "xyz"
NAMELESS = "(no name)"
SINGULAR = {"boxes": "box", "meshes": "mesh"}
LIGHT = {
    "emits": "emission",
    "albedo": "albedo",
    "mirror": "mirror",
    "glossy": "specular",
    "refracts": "ior",
}
# Lowest and highest coordinates of each shape of a kind, (n, d) each; infinite for what has no end.
Bounds = Callable[[Any], tuple[np.ndarray, np.ndarray]]


def told(scene: Any, world: str, bounds: Bounds) -> str:
    """A few lines about a scene: its extent, and a line for the shapes of each name.

    Args:
        scene: of either world; of a batch, a traced one or one without numbers less is said.
        world: what it is called.
        bounds: of the shapes of a group.
    """
    head = f"Scene of {world}: {_counted(len(scene.names), 'shape')}"
    leaves = jax.tree.leaves((scene.groups, scene.material), is_leaf=lambda leaf: leaf is None)
    if not all(hasattr(leaf, "shape") and hasattr(leaf, "dtype") for leaf in leaves):
        return f"{head}, their numbers taken out"
    if not is_concrete(leaves):
        return f"{head}, traced"
    if batch := batch_of(scene):
        return f"{head}, in a batch of {batch}"
    if not all(isinstance(leaf, (np.ndarray, jax.Array)) for leaf in leaves):
        return f"{head}, without numbers"
    low, high = _boxes(scene, bounds)
    where = _extent(low, high)
    lines = [f"{head}{where}", *_few(_rows(scene, low, high)), *_lights(scene)]
    return "\n  ".join(lines)


def _boxes(scene: Any, bounds: Bounds) -> tuple[np.ndarray, np.ndarray]:
    """Lowest and highest coordinates of all shapes of a scene."""
    low, high = (np.concatenate(side) for side in zip(*map(bounds, scene.groups), strict=True))
    return low, high


def _extent(low: np.ndarray, high: np.ndarray) -> str:
    """Words after a comma for the box around all that has an end; none if nothing has."""
    ends = np.isfinite(low).all(-1) & np.isfinite(high).all(-1)
    return f", {_place(low[ends], high[ends], ' m')}" if ends.any() else ""


def told_receiver(at: Any, world: str) -> str:
    """A line about a receiver: its place and its normal; of many, how many and where they are.

    Args:
        at: of either world; of a traced one or one without numbers less is said.
        world: what it is called.
    """
    head = f"Receiver of {world}"
    leaves = jax.tree.leaves(at, is_leaf=lambda leaf: leaf is None)
    if not all(hasattr(leaf, "shape") and hasattr(leaf, "dtype") for leaf in leaves):
        return f"{head}, its numbers taken out"
    if not is_concrete(leaves):
        return f"{head}, traced"
    if not all(isinstance(leaf, (np.ndarray, jax.Array)) for leaf in leaves):
        return f"{head}, without numbers"
    places, on = np.asarray(at.position), np.asarray(at.on)
    if places.ndim > 1:
        rows = places.reshape(-1, places.shape[-1])
        where = f": {_place(rows, rows, ' m')}" if rows.size else ""
        return f"{head}, in a batch of {places.shape[:-1]}{where}"
    with jax.ensure_compile_time_eval():  # numbers are printed among traced ones, too
        normal = np.asarray(at.normal)
    line = f"{head} at {_tuple(places)} m, normal {_tuple(normal)}"
    return line if on < 0 else f"{line}, on shape {on}"


def told_derivatives(d: Any) -> str | None:
    """A table of one value's derivatives, None where there are others or no numbers."""
    leaves = jax.tree.leaves(d, is_leaf=lambda leaf: leaf is None)
    numbers = all(isinstance(leaf, (np.ndarray, jax.Array)) for leaf in leaves)
    if not numbers or not is_concrete(leaves) or np.ndim(d.value):
        return None
    hessian = np.asarray(d.hessian)
    second = [(f"second {name}", row) for name, row in zip(d.freedoms, hessian, strict=True)]
    rows = [("first", np.asarray(d.gradient)), *second]
    digits = [(name, *(f"{float(v) + 0.0:.4g}" for v in row)) for name, row in rows]
    head = f"Value {float(d.value):.6g} and derivatives by {', '.join(d.freedoms)}"
    return "\n  ".join([head, *_table([("", *d.freedoms), *digits], str.rjust)])


def batch_of(scene: Any) -> tuple[int, ...]:
    """How many scenes a scene holds that `jax.vmap` made; () for one."""
    *batch, _ = np.shape(scene.material.specular)  # emission may have bands
    if batch:
        return tuple(batch)
    counts = [np.shape(jax.tree.leaves(group)[0])[0] for group in scene.groups]
    return () if sum(counts) == len(scene.names) else (counts[0],)


def check_one_scene(scene: Any) -> None:
    """Refuses several scenes in one, whose axis would be taken for that of bands.

    Raises:
        ValueError: if `jax.vmap` made the scene of several.
    """
    if batch := batch_of(scene):
        raise ValueError(
            f"Argument `scene` must be one scene, but holds {batch} of them: "
            "ask for each by jax.vmap."
        )


def kinds_of(scene: Any) -> list[str]:
    """The kind of every shape, in the order of their numbers: "segments", "boxes", ..."""
    return [type(group).__name__.lower() for group in scene.groups for _ in range(group.count)]


def _counted(count: int, kind: str) -> str:
    """`1 box`, `3 boxes`; from the plural or the singular of regular words."""
    one = SINGULAR.get(kind, kind.removesuffix("s"))
    many = kind if kind.endswith("s") else f"{kind}s"
    return f"{count} {one if count == 1 else many}"


def _rows(scene: Any, low: np.ndarray, high: np.ndarray) -> list[tuple[str, str, str, str]]:
    """Name, count and kind, place and light of neighbours that share a name and a kind."""
    material = _numbers_of(scene.material)
    labels = list(zip(scene.names, kinds_of(scene), strict=True))
    found = []
    for (name, kind), run in itertools.groupby(range(len(labels)), key=labels.__getitem__):
        k = list(run)
        what, light = _counted(len(k), kind), _light(material, k)
        found.append((name or NAMELESS, what, _place(low[k], high[k]), light))
    return found


def _numbers_of(material: Any) -> dict[str, np.ndarray]:
    """Numbers of materials by the word for each: emits, albedo and so on."""
    fields = {word: field for word, field in LIGHT.items() if hasattr(material, field)}
    return {word: np.asarray(getattr(material, field)) for word, field in fields.items()}


def _light(material: dict[str, np.ndarray], k: list[int]) -> str:
    """Words for emission and reflection of shapes k, where they are not zero."""
    some = {word: values[k] for word, values in material.items() if values[k].any()}
    return ", ".join(f"{word} {_brightness(values)}" for word, values in some.items())


def _brightness(values: np.ndarray) -> str:
    """Of the brighter sides of shapes: one number, least and largest, or these for each band."""
    most = values if values.ndim == 1 else values.max(1)
    if most.ndim == 2:
        return f"({', '.join(_between(band) for band in most.T)})"
    return _between(most)


def _few(rows: list[tuple[str, str, str, str]]) -> list[str]:
    """Rows under each other; more than a few are counted."""
    shown = rows if len(rows) <= ROWS else rows[: ROWS - 1]
    lines = _table(shown, str.ljust)
    left = len(rows) - len(shown)
    return lines + ([f"... and {left} more names or kinds"] if left else [])


def _table(rows: Sequence[tuple[str, ...]], side: Callable[[str, int], str]) -> list[str]:
    """Rows of cells in columns, all but the first with their text to that side."""
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    return [
        "  ".join([row[0].ljust(widths[0]), *map(side, row[1:], widths[1:])]).rstrip()
        for row in rows
    ]


def _lights(scene: Any) -> list[str]:
    """Lines about lights that have no shape."""
    found, points = [], getattr(scene, "points", None)
    if points is not None and is_concrete(points) and (count := np.shape(points.position)[0]):
        at = np.asarray(points.position)
        found.append(f"{_counted(count, 'point light')}: {_place(at, at)}")
    return found + _sky(scene.environment)


def _sky(sky: Any) -> list[str]:
    """A line about distant light, if there is any."""
    if callable(sky):
        return [f"sky: {_name(sky)}"]
    if sky is not None and is_concrete(sky) and np.any(np.asarray(sky)):
        return [f"sky: {_brightness(np.asarray(sky)[None, None])} from everywhere"]
    return []


def _name(sky: Any) -> str:
    """Name of a sky; a plain function by its own."""
    inner = getattr(sky, "radiance", sky)
    function = getattr(inner, "func", None)
    return getattr(function, "__name__", "") or type(sky).__name__.lstrip("_")


def _place(low: np.ndarray, high: np.ndarray, unit: str = "") -> str:
    """`x -1 to 1, y 0`: the box that holds boxes, along the axes on which it ends."""
    sides = zip(AXES, low.min(0), high.max(0), strict=False)
    ended = [(axis, np.array(ends)) for axis, *ends in sides if np.isfinite(ends).all()]
    return ", ".join(f"{axis} {_between(ends)}{unit}" for axis, ends in ended) or "without end"


def _between(values: np.ndarray) -> str:
    """The one value, or the smallest and the largest, to three digits."""
    low, high = (f"{float(v) + 0.0:.3g}" for v in (values.min(), values.max()))
    return low if low == high else f"{low} to {high}"


def _tuple(values: np.ndarray) -> str:
    """`(0.5, 0, 1)`, to three digits; what is rounding beside the longest is zero."""
    small = np.abs(values) < 1e-6 * np.max(np.abs(values))
    return f"({', '.join(_between(np.atleast_1d(v)) for v in np.where(small, 0.0, values))})"
