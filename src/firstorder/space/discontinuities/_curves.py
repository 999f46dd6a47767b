"""Curves on a plane of receivers on which edges line up, and the jumps along them."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from firstorder.space.discontinuities._edges import Edges, dot, fans
from firstorder.space.discontinuities._jumps import (
    three_edges_bends,
    vertex_edge_bends,
)
from firstorder.space.discontinuities._lines_of_sight import (
    ThreeEdges,
    edge_triples,
    taken,
    three_edges_at,
    transversals,
    vertex_edge_at,
    vertex_edge_pairs,
)
from firstorder.space.discontinuities._planes import planes_of
from firstorder.space.discontinuities._queries import is_seen, tangential
from firstorder.space.discontinuities._rounds import Rounds
from firstorder.space.discontinuities._strips import plane_slopes, strengths, strips
from firstorder.space.receiver import Receiver
from firstorder.space.scene import Scene

CHUNK = 1 << 12  # triples of edges at a time
COARSE = 32  # points at which a conic is looked for before it is drawn


class Curves(NamedTuple):
    """Points along lines of one kind, and the jumps there; zero where nothing is seen."""

    kind: str
    places: Float[np.ndarray, "n k 3"]
    jumps: Float[np.ndarray, "n k"]


def filled(scene: Scene, there, strength, sizes) -> Float[np.ndarray, "n k"]:
    """Sizes of jumps at those points that have lines of sight, zero elsewhere.

    Args:
        scene: says what rounding is.
        there: which of the points have them.
        strength: of the jumps there [W/m^2].
        sizes: of the jumps there.
    """
    found = np.zeros(there.shape)
    found[there] = np.where(is_seen(scene, strength), np.abs(sizes), 0.0)
    return found


def crossing(scene: Scene, edges: Edges, at: Receiver, places, there, rows: ThreeEdges) -> Curves:
    """Curves on which three edges cross, by the lines of sight that some of the places have."""
    bends = three_edges_bends(scene, at, edges, rows)
    sizes = dot(bends.rate, bends.rate) * bends.strength
    return Curves("three edges", places, filled(scene, there, bends.strength, sizes))


# --- straight lines ------------------------------------------------------------------------------


def within(at: Receiver, point, normal, reach: float, points: int):
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


def vertex_lines(scene: Scene, edges: Edges, at: Receiver, reach: float, points: int) -> Curves:
    vertex, edge = vertex_edge_pairs(edges)
    corner = edges.vertices[vertex]
    normal = np.cross(edges.start[edge] - corner, edges.along[edge])
    places, which = within(at, corner, normal, reach, points)
    numbers = (np.repeat(a[which], points) for a in (vertex, edge))
    rows, there = vertex_edge_at(edges, at, places.reshape(-1, 3), *numbers)
    bends = vertex_edge_bends(scene, at, edges, taken(rows, there), fans(edges))
    sizes = dot(bends.rate, bends.rate) * bends.strength
    there = there.reshape(places.shape[:2])
    return Curves("vertex and edge", places, filled(scene, there, bends.strength, sizes))


def plane_lines(
    scene: Scene, edges: Edges, rounds: Rounds, at: Receiver, reach: float, points: int
) -> Curves:
    point, normal = planes_of(edges, rounds)
    places, which = within(at, point, normal, reach, points)
    flat, normals = places.reshape(-1, 3), np.repeat(normal[which], points, axis=0)
    found = strips(edges, rounds, at, flat, normals)
    slopes = plane_slopes(scene, at, edges, flat, normals, found)
    sizes = slopes * np.linalg.norm(tangential(at, normals), axis=-1)
    there = np.ones(places.shape[:2], bool)
    return Curves(
        "two edges in a plane", places, filled(scene, there, strengths(found, slopes), sizes)
    )


# --- conics --------------------------------------------------------------------------------------


def conics(scene: Scene, edges: Edges, at: Receiver, reach: float, points: int) -> list[Curves]:
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
        found.append(crossing(scene, edges, at, places, there, rows))
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
