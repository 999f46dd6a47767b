"""Lines of sight through a vertex and an edge, or through three edges.

A receiver lies on an event where one of its lines of sight does. `VertexEdges` and `ThreeEdges` are
rows of such lines that have been found geometrically, whether or not anything stands in the way.
Where an outline of a round body (`_rounds`) is in the place of an edge, the row holds the edge that
touches it there.
"""

from __future__ import annotations

import itertools
from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Bool, Float, Int

from firstorder.space.discontinuities._edges import Edges, dot, unit
from firstorder.space.receiver import Receiver

CHUNK = 1 << 16  # triples of edges at a time
GRAZING = 1e-6  # cosine to the receiver's normal below which a line is in the receiver's plane


class VertexEdges(NamedTuple):
    """Lines of sight through a vertex and an edge.

    Attributes:
        place: of the receivers [m].
        vertex, edge: numbers, where those of bodies' outlines come after those of edges.
        start, along: of the edge [m].
        r_vertex, r_edge: distances from the receiver [m].
    """

    place: Float[np.ndarray, "n 3"]
    vertex: Int[np.ndarray, " n"]
    edge: Int[np.ndarray, " n"]
    start: Float[np.ndarray, "n 3"]
    along: Float[np.ndarray, "n 3"]
    r_vertex: Float[np.ndarray, " n"]
    r_edge: Float[np.ndarray, " n"]


class ThreeEdges(NamedTuple):
    """Lines of sight through three edges.

    Attributes:
        place: of the receivers [m].
        start, along: of the edges [m].
        u: direction of the line, away from the receiver.
        r: distances from the receiver to the edges [m].
    """

    place: Float[np.ndarray, "n 3"]
    start: Float[np.ndarray, "n 3 3"]
    along: Float[np.ndarray, "n 3 3"]
    u: Float[np.ndarray, "n 3"]
    r: Float[np.ndarray, "n 3"]


def taken(rows, which):
    """Some rows of a table."""
    return type(rows)(*(a[which] for a in rows))


def merged(tables):
    """Several tables as one."""
    return type(tables[0])(*(np.concatenate(columns) for columns in zip(*tables, strict=True)))


def meeting(place, u, start, along) -> tuple[np.ndarray, np.ndarray]:
    """Where lines of sight pass lines: distance along them, and share of the way along the lines.

    Args:
        place: of the eye [m].
        u: direction.
        start: of the segment [m].
        along: from its start to its end [m].
    """
    n, w = np.cross(u, along), start - place
    square = dot(n, n)
    level = square <= 0.0
    square = np.where(level, 1.0, square)
    r, share = dot(np.cross(w, along), n) / square, dot(np.cross(w, u), n) / square
    return np.where(level, -1.0, r), np.where(level, -1.0, share)


# --- a vertex and an edge ------------------------------------------------------------------------


def vertex_edge_pairs(edges: Edges) -> tuple[np.ndarray, np.ndarray]:
    """Vertices and edges that span a plane."""
    away = np.cross(edges.start - edges.vertices[:, None], edges.along)
    far = np.linalg.norm(away, axis=-1) > edges.near * np.linalg.norm(edges.along, axis=-1)
    vertex, edge = np.nonzero(far & ~edges.touch)
    return vertex, edge


def in_planes_of_others(edges: Edges, rows: VertexEdges) -> Bool[np.ndarray, " n"]:
    """Whether the plane of a vertex and an edge holds another edge of that vertex."""
    flat = (edges.touch.astype(float) @ edges.coplanar) > 0.0
    straight = rows.edge < len(edges.ends)
    straight[straight] = flat[rows.vertex[straight], rows.edge[straight]]
    return straight


def vertex_edge_at(
    edges: Edges, at: Receiver, place, vertex, edge
) -> tuple[VertexEdges, np.ndarray]:
    """Lines of sight from places in the planes of vertices and edges, and which there are."""
    way = edges.vertices[vertex] - place
    r_vertex = np.linalg.norm(way, axis=-1)
    u = unit(way)
    start, along = edges.start[edge], edges.along[edge]
    r_edge, share = meeting(place, u, start, along)
    r = np.stack([r_vertex, r_edge], -1)
    there = (share > 0.0) & (share < 1.0) & apart_above(edges, at, u, r)
    return VertexEdges(place, vertex, edge, start, along, r_vertex, r_edge), there


def apart_above(edges: Edges, at: Receiver, u, r) -> Bool[np.ndarray, " n"]:
    """Whether what is in line is above the receivers' plane, and not in one place.

    Args:
        edges: say what one place is.
        at: gives the normal.
        u: directions of the lines of sight.
        r: distances along them, shape (n, k) [m].
    """
    far: Any = np.sort(r, axis=-1)
    gaps = np.concatenate([far[..., :1], far[..., 1:] - far[..., :-1]], axis=-1)
    return np.all(gaps > edges.near, axis=-1) & (dot(u, np.asarray(at.normal)) > GRAZING)


def vertex_edges_along(edges: Edges, at: Receiver, along, reach) -> tuple[np.ndarray, VertexEdges]:
    """Places on a line of receivers that see a vertex and an edge in line, and how far along."""
    vertex, edge = vertex_edge_pairs(edges)
    start = edges.start[edge]
    n = np.cross(start - edges.vertices[vertex], edges.along[edge])
    t = crossed(n, edges.vertices[vertex], at, along)
    on = (t > 0.0) & (t < reach)
    t, vertex, edge = t[on], vertex[on], edge[on]
    place = np.asarray(at.position) + t[:, None] * along
    rows, there = vertex_edge_at(edges, at, place, vertex, edge)
    return t[there], taken(rows, there)


def crossed(n, point, at: Receiver, along) -> np.ndarray:
    """How far along a line planes are met; -1 for planes along it."""
    rate = n @ along
    level = np.abs(rate) <= 1e-12 * np.linalg.norm(n, axis=-1)
    t = dot(point - np.asarray(at.position), n) / np.where(level, 1.0, rate)
    return np.where(level, -1.0, t)


# --- three edges ---------------------------------------------------------------------------------


def edge_triples(edges: Edges, most: int = CHUNK):
    """Triples of edges no two of which lie in a plane, in chunks of so many rows."""
    k = len(edges.ends)
    skew = ~edges.coplanar
    triples = (
        (i, j, m)
        for i in range(k)
        for j in np.flatnonzero(skew[i, i:]) + i
        for m in np.flatnonzero(skew[i, j:] & skew[j, j:]) + j
    )
    while chunk := list(itertools.islice(triples, most)):
        yield np.array(chunk)


def three_edges_at(edges: Edges, at: Receiver, place, triples) -> tuple[ThreeEdges, np.ndarray]:
    """Lines of sight from places on the quadrics of three edges, and which there are."""
    start, along = edges.start[triples], edges.along[triples]
    n = unit(np.cross(start - place[:, None], along))
    products = np.stack([np.cross(n[:, i - 1], n[:, i]) for i in range(3)])
    best = np.argmax(np.linalg.norm(products, axis=-1), axis=0)
    u = unit(products[best, np.arange(len(best))])
    u = u * np.where(dot(u, np.asarray(at.normal)) > 0.0, 1.0, -1.0)[:, None]
    r, share = meeting(place[:, None], u[:, None], start, along)
    there = np.all((share > 0.0) & (share < 1.0), axis=1) & apart_above(edges, at, u, r)
    return ThreeEdges(place, start, along, u, r), there


def three_edges_along(edges: Edges, at: Receiver, along, reach) -> tuple[np.ndarray, ThreeEdges]:
    """Places on a line of receivers that see three edges in line, and how far along.

    The determinant of the normals of the planes through the receiver and each edge vanishes there:
    a polynomial of degree two, for the cubic terms cancel.
    """
    found = [(np.zeros(0), no_triples())]
    for triples in edge_triples(edges):
        t, row = quadratic_roots(_determinants(edges, at, along, reach, triples))
        t = t * reach
        on = (t > 0.0) & (t < reach)
        t, row = t[on], row[on]
        place = np.asarray(at.position) + t[:, None] * along
        rows, there = three_edges_at(edges, at, place, triples[row])
        found.append((t[there], taken(rows, there)))
    return np.concatenate([t for t, _ in found]), merged([rows for _, rows in found])


def no_triples() -> ThreeEdges:
    """A table without rows."""
    none, edges = np.zeros((0, 3)), np.zeros((0, 3, 3))
    return ThreeEdges(none, edges, edges, none, none)


def _determinants(edges: Edges, at: Receiver, along, reach, triples) -> np.ndarray:
    """Determinants at the start, in the middle and at the end of the line, shape (3, n)."""
    start, way = edges.start[triples], unit(edges.along[triples])
    places = np.asarray(at.position) + np.array([0.0, 0.5, 1.0])[:, None] * reach * along
    n = np.cross(start - places[:, None, None], way)
    return dot(n[:, :, 0], np.cross(n[:, :, 1], n[:, :, 2]))


def quadratic_roots(values: Float[np.ndarray, "3 n"]) -> tuple[np.ndarray, np.ndarray]:
    """Real roots of parabolas by their values at 0, 1/2 and 1, and the rows they belong to."""
    c = values[0]
    b = 4.0 * values[1] - 3.0 * values[0] - values[2]
    a = 2.0 * (values[0] + values[2]) - 4.0 * values[1]
    square = b * b - 4.0 * a * c
    q = -0.5 * (b + np.where(b >= 0.0, 1.0, -1.0) * np.sqrt(np.maximum(square, 0.0)))
    with np.errstate(divide="ignore", invalid="ignore"):
        roots = np.stack([q / a, c / q])
    real = (square > 0.0) & np.isfinite(roots)
    _, row = np.nonzero(real)
    return roots[real], row


def contacts(edges: Edges, at: Receiver, along, reach) -> Float[np.ndarray, " c"]:
    """How far along a line of receivers it runs into faces, or out of them."""
    corner, spans, triangular = edges.faces
    normal = np.cross(spans[:, 0], spans[:, 1])
    t = crossed(normal, corner, at, along)
    w = np.asarray(at.position) + t[:, None] * along - corner
    square = dot(normal, normal)
    x = dot(np.cross(w, spans[:, 1]), normal) / square
    y = dot(np.cross(spans[:, 0], w), normal) / square
    slack = edges.near / np.min(np.linalg.norm(spans, axis=-1), axis=1, initial=np.inf)
    most = np.where(triangular, x + y, np.maximum(x, y))
    on: Bool[np.ndarray, " f"] = (np.minimum(x, y) >= -slack) & (most <= 1.0 + slack)
    return np.unique(t[on & (t > 0.0) & (t < reach)])


def transversals(edges: Edges, at: Receiver, triples, share) -> np.ndarray:
    """Where the lines through three edges meet the plane of the receivers.

    Args:
        edges: of the scene.
        at: a receiver of the plane.
        triples: numbers of edges, shape (n, 3).
        share: of the way along the first edge at which the lines pass it, shape (n, k).

    Returns:
        Places, shape (n, k, 3); not finite for lines along the plane [m].
    """
    start, along = edges.start[triples][:, None], edges.along[triples][:, None]
    point = start[..., 0, :] + share[..., None] * along[..., 0, :]
    n = np.cross(start[..., 1:, :] - point[..., None, :], along[..., 1:, :])
    u, normal = np.cross(n[..., 0, :], n[..., 1, :]), np.asarray(at.normal)
    with np.errstate(divide="ignore", invalid="ignore"):
        far = (np.asarray(at.position) - point) @ normal / (u @ normal)
        return point + far[..., None] * u
