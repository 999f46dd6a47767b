"""Mitsuba's shapes as affine images of canonical ones, which ours are too.

    point = (axes | center) @ q,      axes | center = the upper rows of `to_world`

A map that mirrors is refused: it turns some of Mitsuba's shapes inside out, and of a rectangle the
side that shines but not the side that is lit.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Float

from firstorder.io.scenes._toml_tables import TomlTable, number, vector, yes
from firstorder.space.primitives import Primitive
from firstorder.space.shapes import build
from firstorder.space.shapes.kinds import (
    Boxes,
    Cylinders,
    Discs,
    Ellipsoids,
    Rectangles,
    Shape,
)

Matrix = Float[np.ndarray, "4 4"]
Axes = Float[np.ndarray, "3 3"]
# Mitsuba computes in single precision: what differs by less is meant to be the same.
SINGLE = 1e-6


def matrix(value: Any) -> Matrix:
    """An affine map, as an array or as something that has one in `.matrix`.

    Raises:
        ValueError: what it must be.
    """
    words = "a 4 x 4 matrix of numbers, the last row 0 0 0 1"
    try:
        found = np.asarray(getattr(value, "matrix", value), float)
    except (TypeError, ValueError):
        raise ValueError(words) from None
    if found.size == 16 and found.ndim == 3:  # one matrix of a variant that computes with many
        found = found.reshape(4, 4)
    if found.shape != (4, 4) or not np.all(np.isfinite(found)) or any(found[3] != (0, 0, 0, 1)):
        raise ValueError(words)
    if not np.linalg.det(found[:3, :3]) > 0.0:
        raise ValueError("a map that has an inverse and does not mirror")
    return found


def placed(table: TomlTable) -> tuple[Axes, Float[np.ndarray, "3"]]:
    """The linear part and the shift of `to_world`."""
    found = table.take("to_world", matrix, np.eye(4))
    return found[:3, :3], found[:3, 3]


# --- reading -------------------------------------------------------------------------------------


def sphere(table: TomlTable) -> Shape:
    """A sphere; an ellipsoid if it is scaled by more than one number."""
    center = np.array(table.take("center", vector, [0.0] * 3))
    radius = table.take("radius", number, 1.0)
    _outward(table)
    if "to_world" not in table.values:
        return build.sphere(center, radius)
    axes, shift = placed(table)
    if not radius > 0.0:
        raise ValueError(f"Argument `radius` must be positive, but is {radius}.")
    return Ellipsoids(axes @ center + shift, radius * axes)


def cube(table: TomlTable) -> Shape:
    """A box; a parallelepiped if it is sheared."""
    axes, shift = placed(table)
    _outward(table)
    return Boxes(shift, axes)


def rectangle(table: TomlTable) -> Shape:
    """A rectangle."""
    return _flat(Rectangles, table)


def disk(table: TomlTable) -> Shape:
    """A disc."""
    return _flat(Discs, table)


def cylinder(table: TomlTable) -> Shape:
    """A cylinder; its caps are ours, and `closed_tubes` looks for Mitsuba's."""
    p0 = np.array(table.take("p0", vector, [0.0, 0.0, 0.0]))
    p1 = np.array(table.take("p1", vector, [0.0, 0.0, 1.0]))
    radius = table.take("radius", number, 1.0)
    _outward(table)
    axes, shift = placed(table)
    half = 0.5 * (p1 - p0)
    if not np.any(half):
        raise ValueError("Argument `p1` must not be `p0`, but is.")
    if not radius > 0.0:
        raise ValueError(f"Argument `radius` must be positive, but is {radius}.")
    upright = half[2] > 0.0 and not np.any(half[:2])
    u, v = (np.eye(3)[0], np.eye(3)[1]) if upright else _across(half)
    own = np.stack([radius * u, radius * v, half], -1)
    return Cylinders(axes @ (p0 + half) + shift, axes @ own)


def _across(along: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Two unit vectors that make a right-handed frame with a third of any length."""
    along = along / np.linalg.norm(along)
    u = np.cross(along, np.eye(3)[np.argmin(np.abs(along))])
    u = u / np.linalg.norm(u)
    return u, np.cross(along, u)


def _flat(kind: type[Rectangles] | type[Discs], table: TomlTable) -> Shape:
    """A flat shape, whose third axis is the unit normal whatever `to_world` does along it."""
    axes, shift = placed(table)
    normal = np.cross(axes[:, 0], axes[:, 1])
    normal = normal / np.linalg.norm(normal)
    if np.max(np.abs(axes[:, 2] - normal)) > 16.0 * np.finfo(float).eps:
        axes = np.stack([axes[:, 0], axes[:, 1], normal], -1)
    made = kind(shift, axes)
    return made.turned(np.array([True])) if table.take("flip_normals", yes, False) else made


def _outward(table: TomlTable) -> None:
    """Refuses a closed shape whose front is its inside."""
    if table.take("flip_normals", yes, False):
        raise ValueError("Argument `flip_normals` must be false: the front of a closed shape is "
                         "its outside.")  # fmt: skip


READERS = {
    "sphere": sphere,
    "cube": cube,
    "rectangle": rectangle,
    "disk": disk,
    "cylinder": cylinder,
}


def closed_tubes(things: Sequence[Primitive]) -> tuple[list[Primitive], list[int]]:
    """Cylinders with the discs that close them taken away.

    Mitsuba's cylinders are tubes, ours have caps: a tube is ours if a disc of the same material
    lies at each of its ends and looks outwards.

    Args:
        things: of one shape each.

    Returns:
        The rest in its order, and the numbers of the tubes that are open.
    """
    caps, bare = set(), []
    discs = _Discs([k for k, thing in enumerate(things) if isinstance(thing.shape, Discs)], things)
    for number_, tube in enumerate(things):
        if isinstance(tube.shape, Cylinders):
            found = [discs.cap(tube, side) for side in (-1.0, 1.0)]
            if None in found:
                bare.append(number_)
            caps.update(found)
    return [thing for k, thing in enumerate(things) if k not in caps], bare


class _Discs:
    """All discs side by side, so that each tube is compared with them at once."""

    def __init__(self, numbers: Sequence[int], things: Sequence[Primitive]):
        self.numbers, own = numbers, [things[k] for k in numbers]
        self.center = np.array([np.asarray(t.shape.center, float)[0] for t in own]).reshape(-1, 3)
        axes = np.array([np.asarray(t.shape.axes, float)[0] for t in own]).reshape(-1, 3, 3)
        self.rim, self.normal = _rim(axes), axes[..., 2]
        self.known: dict[Any, int] = {}
        self.front = np.array([self.known.setdefault(_front(t), len(self.known)) for t in own])

    def cap(self, tube: Primitive, side: float) -> int | None:
        """The number of the disc that closes one end of a tube."""
        center, axes = (np.asarray(a, float)[0] for a in (tube.shape.center, tube.shape.axes))
        end, size = center + side * axes[:, 2], np.max(np.abs(axes))
        near = np.max(np.abs(self.center - end), -1) <= SINGLE * (size + np.max(np.abs(end)))
        alike = np.max(np.abs(self.rim - _rim(axes)), (-2, -1)) <= SINGLE * size**2
        outward = side * (self.normal @ axes[:, 2]) > 0.0
        same = near & alike & outward & (self.front == self.known.get(_front(tube), -1))
        return self.numbers[np.argmax(same)] if same.any() else None


def _rim(axes: np.ndarray) -> np.ndarray:
    """A circle or an ellipse, however its two half-axes are chosen: their outer products' sum."""
    return axes[..., :2] @ np.swapaxes(axes[..., :2], -1, -2)


def _front(thing: Primitive) -> tuple[tuple[float, ...], ...]:
    """Emission and albedo of the front, in bands if there are any."""
    both = thing.material.emission, thing.material.albedo
    return tuple(tuple(np.ravel(np.asarray(a)[0, 0]).tolist()) for a in both)


# --- writing -------------------------------------------------------------------------------------


class Written(NamedTuple):
    """A shape of Mitsuba: the end of its name, its type, and what says where it is."""

    ending: str
    kind: str
    keys: dict[str, Any]


def written(shape: Shape, i: int) -> Iterator[Written]:
    """The shapes of Mitsuba that make one of ours.

    Raises:
        ValueError: if there are none.
    """
    center, axes = (np.asarray(a, float)[i] for a in (shape.center, shape.axes))
    if not np.linalg.det(axes) > 0.0:
        raise ValueError("`axes` must be right-handed for Mitsuba, but are not.")
    match shape:
        case Ellipsoids():
            yield Written("", "sphere", _round(center, axes))
        case Boxes():
            yield Written("", "cube", {"to_world": _world(center, axes)})
        case Rectangles():
            yield Written("", "rectangle", {"to_world": _world(center, axes)})
        case Discs():
            yield Written("", "disk", {"to_world": _world(center, axes)})
        case Cylinders():
            yield from _tube(center, axes)
        case _:
            kind = type(shape).__name__.lower()
            raise ValueError(f"Mitsuba has no shape for {kind}, which this is one of.")


def _world(center: np.ndarray, axes: Axes) -> Matrix:
    found = np.eye(4)
    found[:3, :3], found[:3, 3] = axes, center
    return found


def _round(center: np.ndarray, axes: Axes) -> dict[str, Any]:
    """A sphere by centre and radius, or turned; Mitsuba's cannot be ellipsoids."""
    radius = axes[0, 0]
    if np.array_equal(axes, radius * np.eye(3)):
        return {"center": center.tolist(), "radius": float(radius)}
    if not _orthogonal(axes, 3):
        raise ValueError("Mitsuba has spheres and no ellipsoids, which this is one of.")
    return {"to_world": _world(center, axes)}


def _tube(center: np.ndarray, axes: Axes) -> Iterator[Written]:
    """A tube and its two caps."""
    u, v, half = axes.T
    normal = np.cross(u, v)
    normal = normal / np.linalg.norm(normal)
    slant = np.linalg.norm(np.cross(normal, half)) > SINGLE * np.linalg.norm(half)
    if slant or not _orthogonal(axes, 2):
        raise ValueError("Mitsuba has round upright cylinders alone, which this is none of.")
    ends = {"p0": [0.0, 0.0, -1.0], "p1": [0.0, 0.0, 1.0], "radius": 1.0}
    yield Written("", "cylinder", ends | {"to_world": _world(center, axes)})
    base = _world(center - half, np.stack([v, u, -normal], -1))
    yield Written("_base", "disk", {"to_world": base})
    yield Written("_top", "disk", {"to_world": _world(center + half, np.stack([u, v, normal], -1))})


def _orthogonal(axes: Axes, count: int) -> bool:
    """Whether the first columns are at right angles and of one length."""
    own = axes[:, :count].T @ axes[:, :count]
    return bool(np.max(np.abs(own - own[0, 0] * np.eye(count))) <= SINGLE * own[0, 0])
