"""The discontinuity mesh of a plane of receivers: its visual events as lines.

A vertex and an edge span a plane, which meets the receivers in a line, and so do two edges of one
plane. Lines of sight through three edges sweep a quadric, which meets them in a conic.
"""

from __future__ import annotations

import dataclasses
from typing import NamedTuple

import numpy as np
from jaxtyping import ArrayLike, Float, Int

from firstorder._argument_checks import check_positive
from firstorder.scene._arguments import check_asked_one
from firstorder.space.discontinuities._edges import Edges, dot, edges_of, fans
from firstorder.space.discontinuities._event_table import ORDERS
from firstorder.space.discontinuities._jumps import (
    plane_slopes,
    strips,
    three_edges_bends,
    vertex_edge_bends,
)
from firstorder.space.discontinuities._lines_of_sight import (
    edge_triples,
    planes_of,
    taken,
    three_edges_at,
    transversals,
    vertex_edge_at,
    vertex_edge_pairs,
)
from firstorder.space.discontinuities._queries import check_concrete, is_seen, tangential
from firstorder.space.receiver import Receiver
from firstorder.space.scene import Scene

CHUNK = 1 << 12  # triples of edges at a time
COARSE = 32  # points at which a conic is looked for before it is drawn


@dataclasses.dataclass(frozen=True, eq=False)
class DiscontinuityMesh:
    """Visible visual events on a plane of receivers, as pieces of lines.

    Attributes:
        lines: points of each piece, arrays of shape (k, 3) [m].
        jumps: at those points, how much the lowest derivative across the line that jumps does so:
            sizes, arrays of shape (k,) [W/m^3 for the first derivative, W/m^4 for the second].
        kind: of each piece, as for `EventsAlong`, shape (n,).
        order: of that derivative.
    """

    lines: tuple[np.ndarray, ...]
    jumps: tuple[np.ndarray, ...]
    kind: np.ndarray
    order: Int[np.ndarray, " n"]

    def __len__(self) -> int:
        return len(self.lines)


class _Curves(NamedTuple):
    """Points along lines of one kind, and the jumps there; zero where nothing is seen."""

    kind: str
    places: Float[np.ndarray, "n k 3"]
    jumps: Float[np.ndarray, "n k"]


def discontinuity_mesh(
    scene: Scene, at: Receiver, *, points: int = 65, reach: ArrayLike
) -> DiscontinuityMesh:
    """The lines on a plane of receivers across which derivatives of irradiance jump.

    Valid for: what `visual_events_along` is valid for. Lines are sampled: they end within a spacing
    of the points, and pieces shorter than that are left out. The outlines of shapes that stand on
    the plane are not among them.

    Args:
        scene: concrete shapes of flat faces, and a sky of one radiance.
        at: the receiver in the middle of a square of the plane.
        points: along each line.
        reach: from there to the sides of the square, along the receiver's tangents [m].

    Raises:
        ValueError: if the scene is traced, has a round shape, a plane in which the receivers do not
            lie, bands or a sky of many radiances; if a number is not positive.

    Reference: J12 §5; R07 §7.

    Example:
        >>> from firstorder.space import Receiver, Scene, primitive, rectangle
        >>> from firstorder.space.discontinuities import discontinuity_mesh
        >>> lamp = rectangle((0.0, 0.0, 2.0), (0.0, 0.5, 0.0), (0.5, 0.0, 0.0))
        >>> plate = rectangle((0.0, 0.0, 1.0), (0.2, 0.0, 0.0), (0.0, 0.2, 0.0))
        >>> scene = Scene.of(primitive(lamp, emission=1.0), primitive(plate))
        >>> mesh = discontinuity_mesh(scene, Receiver.at((0.0, 0.0, 0.0)), reach=2.0)
        >>> len(mesh), set(mesh.kind.tolist())  # each edge of one with two edges of the other
        (8, {'two edges in a plane'})
    """
    check_asked_one(scene, Scene, at, Receiver)
    check_concrete(scene, at)
    check_positive("reach", reach)
    check_positive("points", points)
    edges, width = edges_of(scene, at), float(np.asarray(reach))
    curves = [
        _plane_lines(scene, edges, at, width, points),
        _vertex_lines(scene, edges, at, width, points),
        *_conics(scene, edges, at, width, points),
    ]
    return _mesh(curves)


def _mesh(curves: list[_Curves]) -> DiscontinuityMesh:
    """The pieces along which something is seen."""
    lines, jumps, kinds = [], [], []
    for kind, all_places, all_sizes in curves:
        for places, sizes in zip(all_places, all_sizes, strict=True):
            shown = np.concatenate([[False], sizes > 0.0, [False]])
            ends = np.flatnonzero(shown[1:] != shown[:-1])
            for first, last in zip(ends[::2], ends[1::2], strict=True):
                if last - first > 1:
                    lines.append(places[first:last])
                    jumps.append(sizes[first:last])
                    kinds.append(kind)
    order = np.array([ORDERS[kind] for kind in kinds], int)
    return DiscontinuityMesh(tuple(lines), tuple(jumps), np.array(kinds), order)


def _filled(scene: Scene, there, strength, sizes) -> Float[np.ndarray, "n k"]:
    """Sizes of jumps at those points that have lines of sight, zero elsewhere."""
    found = np.zeros(there.shape)
    found[there] = np.where(is_seen(scene, strength), np.abs(sizes), 0.0)
    return found


# --- straight lines ------------------------------------------------------------------------------


def _within(at: Receiver, point, normal, reach: float, points: int):
    """Points along the lines in which planes meet a square, and which planes do.

    Args:
        at: the receiver in its middle.
        point: of each plane, shape (n, 3) [m].
        normal: of each plane.
        reach: from the middle to the sides [m].
        points: on each line.

    Returns:
        Points of those that meet it, shape (m, points, 3), and their numbers.
    """
    frame = np.asarray(at.axes)[:, :2]
    flat, offset = normal @ frame, dot(point - np.asarray(at.position), normal)
    square = dot(flat, flat)
    level = square <= 1e-12 * dot(normal, normal)
    square = np.where(level, 1.0, square)
    foot = flat * (offset / square)[:, None]
    way = np.stack([-flat[:, 1], flat[:, 0]], -1) / np.sqrt(square)[:, None]
    with np.errstate(divide="ignore", invalid="ignore"):
        sides = (np.array([-reach, reach])[:, None, None] - foot) / way
        sides = np.where(way == 0.0, np.copysign(np.inf, sides), sides)
    low, high = np.max(np.min(sides, axis=0), axis=1), np.min(np.max(sides, axis=0), axis=1)
    which = np.flatnonzero(~level & (low < high))
    share = (np.arange(points) + 0.5) / points
    s = low[which, None] + share * (high - low)[which, None]
    inside = foot[which, None] + s[..., None] * way[which, None]
    return np.asarray(at.position) + inside @ frame.T, which


def _vertex_lines(scene: Scene, edges: Edges, at: Receiver, reach: float, points: int) -> _Curves:
    vertex, edge = vertex_edge_pairs(edges)
    corner = edges.vertices[vertex]
    normal = np.cross(edges.start[edge] - corner, edges.along[edge])
    places, which = _within(at, corner, normal, reach, points)
    numbers = (np.repeat(a[which], points) for a in (vertex, edge))
    rows, there = vertex_edge_at(edges, at, places.reshape(-1, 3), *numbers)
    bends = vertex_edge_bends(scene, at, edges, taken(rows, there), fans(edges))
    sizes = dot(bends.rate, bends.rate) * bends.strength
    there = there.reshape(places.shape[:2])
    return _Curves("vertex and edge", places, _filled(scene, there, bends.strength, sizes))


def _plane_lines(scene: Scene, edges: Edges, at: Receiver, reach: float, points: int) -> _Curves:
    point, normal = planes_of(edges)
    places, which = _within(at, point, normal, reach, points)
    flat, normals = places.reshape(-1, 3), np.repeat(normal[which], points, axis=0)
    slopes = plane_slopes(scene, at, edges, flat, normals, strips(edges, at, flat, normals))
    sizes = slopes * np.linalg.norm(tangential(at, normals), axis=-1)
    there = np.ones(places.shape[:2], bool)
    return _Curves("two edges in a plane", places, _filled(scene, there, slopes, sizes))


# --- conics --------------------------------------------------------------------------------------


def _conics(scene: Scene, edges: Edges, at: Receiver, reach: float, points: int) -> list[_Curves]:
    found = []
    for triples in edge_triples(edges, CHUNK):
        share = np.broadcast_to((np.arange(COARSE) + 0.5) / COARSE, (len(triples), COARSE))
        _, _, there = _seen_from(edges, at, reach, triples, share)
        which = np.flatnonzero(np.any(there, axis=1))
        first = np.argmax(there[which], axis=1)
        last = COARSE - np.argmax(there[which, ::-1], axis=1)
        low, high = np.maximum(first - 0.5, 0.0) / COARSE, np.minimum(last + 0.5, COARSE) / COARSE
        share = (np.arange(points) + 0.5) / points
        share = low[:, None] + share * (high - low)[:, None]
        places, rows, there = _seen_from(edges, at, reach, triples[which], share)
        bends = three_edges_bends(scene, at, edges, rows)
        sizes = dot(bends.rate, bends.rate) * bends.strength
        found.append(_Curves("three edges", places, _filled(scene, there, bends.strength, sizes)))
    return found


def _seen_from(edges: Edges, at: Receiver, reach: float, triples, share):
    """Places on conics, and the lines of sight through all three edges where there are some."""
    places = transversals(edges, at, triples, share)
    inside = (places - np.asarray(at.position)) @ np.asarray(at.axes)[:, :2]
    there = np.all(np.abs(inside) <= reach, axis=-1)  # not so for what is not finite
    numbers = np.repeat(triples, share.shape[1], axis=0).reshape(*share.shape, 3)
    rows, on = three_edges_at(edges, at, places[there], numbers[there])
    there[there] = on
    return places, taken(rows, on), there
