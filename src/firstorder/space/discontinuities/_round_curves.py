"""Curves on a plane of receivers on which outlines of round bodies line up, and the jumps there."""

from __future__ import annotations

import numpy as np

from firstorder.space.discontinuities._curves import (
    COARSE,
    Curves,
    crossing,
    filled,
    within,
)
from firstorder.space.discontinuities._edges import Edges, dot, fans, unit
from firstorder.space.discontinuities._event_table import TOUCH
from firstorder.space.discontinuities._jumps import (
    tangent_roots,
    vertex_edge_bends,
)
from firstorder.space.discontinuities._lines_of_sight import taken
from firstorder.space.discontinuities._round_lines import (
    edge_triples_with_bodies,
    triples_at,
    vertex_rounds_at,
    vertices_off_discs,
)
from firstorder.space.discontinuities._rounds import (
    WALL,
    Rounds,
    around,
    between,
    frame_across,
    null_directions,
    on_rim,
)
from firstorder.space.discontinuities._tangents import (
    body_tangents_at,
    common_planes,
    edge_tangents,
    edge_tangents_at,
    endwise_at,
)
from firstorder.space.discontinuities._walls import planes_of_wall
from firstorder.space.receiver import Receiver
from firstorder.space.scene import Scene


def _inside(at: Receiver, reach: float, places) -> np.ndarray:
    """Which places are in the square; those that are not finite are not."""
    flat = (places - np.asarray(at.position)) @ np.asarray(at.axes)[:, :2]
    return np.all(np.abs(flat) <= reach, axis=-1)


def _met(at: Receiver, point, way) -> np.ndarray:
    """Where lines meet the receivers' plane [m]."""
    up = np.asarray(at.normal)
    rate = np.where(way @ up == 0.0, np.nan, way @ up)
    return point + (((np.asarray(at.position) - point) @ up) / rate)[..., None] * way


def _touching(scene: Scene, edges: Edges, at: Receiver, places, there, seen) -> Curves:
    """Curves on which outlines touch, from the lines of sight that some of the places have."""
    rows, on = seen
    roots = tangent_roots(scene, at, edges, taken(rows, on))
    there[there] = on
    sizes = roots.strength * np.linalg.norm(roots.rate, axis=-1) ** 1.5
    return Curves(TOUCH, places, filled(scene, there, roots.strength, sizes))


def edge_tangent_lines(
    scene: Scene, edges: Edges, rounds: Rounds, at: Receiver, reach: float, points: int
) -> Curves:
    """Lines on which an edge, or a line of a wall, touches a body."""
    planes = edge_tangents(edges, rounds)
    places, which = within(at, planes.start, planes.normal, reach, points)
    there = np.ones(places.shape[:2], bool)
    rows = taken(planes, np.repeat(which, points))
    seen = edge_tangents_at(edges, rounds, at, places[there], rows)
    return _touching(scene, edges, at, places, there, seen)


def body_curves(
    scene: Scene, edges: Edges, rounds: Rounds, at: Receiver, reach: float, points: int
) -> list[Curves]:
    """Curves on which two bodies touch."""
    angle, side = np.meshgrid(np.linspace(0.0, 2.0 * np.pi, points), [1.0, -1.0])
    found = []
    for numbers, planes in common_planes(rounds):
        places, normal = planes.places(at, angle, side)
        there = _inside(at, reach, places)
        bodies = np.broadcast_to(numbers, (np.sum(there), 2))
        seen = body_tangents_at(edges, rounds, at, places[there], bodies, normal[there])
        found.append(_touching(scene, edges, at, places, there, seen))
    return found


def endwise_curves(
    scene: Scene, edges: Edges, rounds: Rounds, at: Receiver, reach: float, points: int
) -> Curves:
    """Conics on which the wall of a cylinder is seen endwise."""
    walls = np.flatnonzero(rounds.kind == WALL)
    one = Rounds(*(a[:, None] for a in rounds.take(walls)))
    angle = np.broadcast_to(np.linspace(0.0, 2.0 * np.pi, points), (len(walls), points))
    places = _met(at, on_rim(one, angle), one.axes[..., 2])
    there = _inside(at, reach, places)
    row, _ = np.nonzero(there)
    seen = endwise_at(edges, rounds, at, places[there], walls[row])
    return _touching(scene, edges, at, places, there, seen)


def vertex_walls(
    scene: Scene, edges: Edges, rounds: Rounds, at: Receiver, reach: float, points: int
) -> Curves:
    """Lines on which a vertex is on the outline of the wall of a cylinder."""
    found = []
    for wall in np.flatnonzero(rounds.kind == WALL):
        for vertex, corner in enumerate(edges.vertices):
            normals = planes_of_wall(rounds.take(wall), corner, np.zeros((3, 3)))
            found += [(vertex, wall, *n) for n in normals]
    table = np.array(found).reshape(-1, 5)
    vertex, wall, normal = table[:, 0].astype(int), table[:, 1].astype(int), table[:, 2:]
    places, which = within(at, edges.vertices[vertex], normal, reach, points)
    there = np.ones(places.shape[:2], bool)
    numbers = (np.repeat(a[which], points) for a in (vertex, wall))
    return _on_outlines(scene, edges, rounds, at, places, there, *numbers)


def _on_outlines(
    scene: Scene, edges: Edges, rounds: Rounds, at: Receiver, places, there, vertex, body
) -> Curves:
    """Curves on which vertices are on outlines, by places that may be on them."""
    rows, on = vertex_rounds_at(edges, rounds, at, places[there], vertex, body)
    bends = vertex_edge_bends(scene, at, edges, taken(rows, on), fans(edges))
    there[there] = on
    sizes = dot(bends.rate, bends.rate) * bends.strength
    return Curves("vertex and edge", places, filled(scene, there, bends.strength, sizes))


def vertex_cones(
    scene: Scene, edges: Edges, rounds: Rounds, at: Receiver, reach: float, points: int
) -> Curves:
    """Conics on which a vertex is on the outline of a body."""
    vertex, body = vertices_off_discs(edges, rounds)
    vertex, body = (a[rounds.kind[body] != WALL] for a in (vertex, body))
    one, corner = rounds.take(body), edges.vertices[vertex]
    axis = frame_across(between(one, corner))[:, :1]
    angle = np.broadcast_to(np.linspace(0.0, 2.0 * np.pi, points), (len(vertex), points))
    spread = Rounds(*(a[:, None] for a in one))
    eye = np.broadcast_to(corner[:, None], (*angle.shape, 3))
    way = around(spread, axis, eye, angle)
    places = _met(at, eye, way)
    there = _inside(at, reach, places)
    row, _ = np.nonzero(there)
    return _on_outlines(scene, edges, rounds, at, places, there, vertex[row], body[row])


def round_conics(
    scene: Scene, edges: Edges, rounds: Rounds, at: Receiver, reach: float, points: int
) -> Curves:
    """Curves on which two edges cross the outline of a body.

    Two for each three, by places along the first of the edges.
    """
    triples = np.repeat(edge_triples_with_bodies(edges, rounds), 2, axis=0)
    branch = np.arange(len(triples)) % 2
    share = np.broadcast_to((np.arange(COARSE) + 0.5) / COARSE, (len(triples), COARSE))
    _, _, there = _passing(edges, rounds, at, reach, triples, branch, share)
    which = np.flatnonzero(np.any(there, axis=1))
    share = np.broadcast_to((np.arange(points) + 0.5) / points, (len(which), points))
    found = _passing(edges, rounds, at, reach, triples[which], branch[which], share)
    places, rows, there = found
    return crossing(scene, edges, at, places, there, rows)


def _passing(edges: Edges, rounds: Rounds, at: Receiver, reach: float, triples, branch, share):
    """Places, and lines of sight through two edges that touch a body where there are some."""
    start, along = edges.start[triples[:, :2]], edges.along[triples[:, :2]]
    point = start[:, :1] + share[..., None] * along[:, :1]
    other = np.broadcast_to(along[:, 1:], point.shape)
    normal = np.cross(start[:, 1:] - point, other)
    frame = np.stack([unit(other), unit(np.cross(normal, other))], -2)
    one = Rounds(*(a[:, None] for a in rounds.take(triples[:, 2] - len(edges.ends))))
    w = one.center - point
    side = np.cross(w[..., None, :], frame)
    G = np.einsum("nkai,nxij,nkbj->nkab", side, one.spread, side)
    G = G - np.einsum("nkai,nxij,nkbj->nkab", frame, one.adjugate, frame)
    ways = np.einsum("nkca,nkai->nkci", null_directions(G), frame)
    u = np.take_along_axis(ways, branch[:, None, None, None], 2)[:, :, 0]
    u = u * np.where(u @ np.asarray(at.normal) > 0.0, 1.0, -1.0)[..., None]
    places = _met(at, point, u)
    there = _inside(at, reach, places)
    numbers = np.broadcast_to(triples[:, None], (*share.shape, 3))
    rows, on = triples_at(edges, rounds, at, places[there], u[there], numbers[there])
    there[there] = on
    return places, taken(rows, on), there
