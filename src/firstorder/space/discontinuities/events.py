"""Visual events on a line of receivers: where irradiance, or a derivative of it, jumps.

Seen from a receiver, edges at different distances move at different speeds. Where they line up the
order in which they cover each other changes, and

    two edges in a plane with the receiver      E' jumps, and E''
    a vertex and an edge                        E'' jumps
    three edges                                 E'' jumps
    outlines that touch, one of them round      E'' grows like 1 / sqrt(x) on one side
    a shape that the line runs into             E jumps

For a vertex and an edge, or three edges, an outline of a round body is an edge as well. Closed
forms are in `_jumps`, `_plane_bends` and `_wall_ends`. Parallel edges lie in a plane, and so do the
edges of a face, both halves of a disc or of a cylinder's rim, and an edge and a line of a wall that
is parallel to it. The rims of a cylinder touch for a receiver that looks along its wall. Where
lines of a wall meet a rim an outline has no corner: what crosses it there makes no jump before that
of E''', and no event. All of it is found on the host, from concrete scenes.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from jaxtyping import ArrayLike, Float

from firstorder._argument_checks import check_finite, check_positive
from firstorder.scene._arguments import check_asked_one, numbers
from firstorder.space.discontinuities._contacts import round_contacts
from firstorder.space.discontinuities._edges import Edges, edges_of, unit
from firstorder.space.discontinuities._event_table import ORDERS, TOUCH, EventsAlong, joined
from firstorder.space.discontinuities._jumps import (
    tangent_roots,
    three_edges_bends,
    vertex_edge_bends,
)
from firstorder.space.discontinuities._lines_of_sight import (
    contacts,
    three_edges_along,
    vertex_edges_along,
)
from firstorder.space.discontinuities._plane_bends import plane_bends
from firstorder.space.discontinuities._planes import planes_along
from firstorder.space.discontinuities._queries import check_concrete, is_seen
from firstorder.space.discontinuities._round_lines import (
    round_triples_along,
    three_rounds_along,
    vertex_rounds_along,
)
from firstorder.space.discontinuities._rounds import Rounds, rounds_of
from firstorder.space.discontinuities._strips import plane_slopes, strengths, strips
from firstorder.space.discontinuities._tangents import (
    body_tangents_along,
    edge_tangents_along,
    endwise_along,
)
from firstorder.space.receiver import Receiver
from firstorder.space.scene import Scene


def visual_events_along(
    scene: Scene, at: Receiver, *, along: Any, reach: ArrayLike, hidden: bool = False
) -> EventsAlong:
    """All visual events on a line of receivers in a plane.

    Light is what shapes of constant radiance and a constant sky emit, as for `irradiance`.

    Valid for: shapes that do not run into each other, and lines along which no two outlines of
    different bodies stay in line. Where E' jumps E'' does as well, and it grows like `1 / sqrt(x)`
    on one side if a line of a wall in that plane ends before or behind another edge.
    Where two round outlines touch, or three cross, is looked for on a grid, and two such places
    very close to each other may be missed. Where a vertex lies on a round outline that one of its
    edges all but touches, the jump is large, holds for a hair's breadth only, and may be wrong.
    Where a line of a wall meets the rim of a cap that is seen nearly edge-on, the outline turns
    sharply, without a corner: what crosses it there changes E'' fast, but makes no jump and has no
    row, and a root of outlines that touch beside it holds for a hair's breadth only. Events at one
    place are rows of their own, and their jumps add. Work grows with the third power of the number
    of edges.

    Args:
        scene: concrete shapes, and a sky of one radiance.
        at: the first receiver; say on which shape it lies (`on`) if it lies on one.
        along: direction of the line, of any length, shape (3,); perpendicular to the normal.
        reach: length of the line [m].
        hidden: also give events that something hides.

    Returns:
        Places, kinds and jumps, in order of distance.

    Raises:
        ValueError: if the scene is traced, has a plane in which the receivers do not lie, bands or
            a sky of many radiances; if the line has no length or leaves the plane.

    Reference: J12 §5; R07 §7.

    Example:
        >>> from firstorder.space import Receiver, Scene, box, primitive, rectangle
        >>> from firstorder.space.discontinuities import visual_events_along
        >>> lamp = rectangle((0.0, 0.0, 2.0), (0.0, 0.5, 0.0), (0.5, 0.0, 0.0))
        >>> plate = rectangle((0.0, 0.0, 1.0), (0.2, 0.0, 0.0), (0.0, 0.2, 0.0))
        >>> scene = Scene.of(primitive(lamp, emission=1.0), primitive(plate))
        >>> at = Receiver.at((-2.0, 0.0, 0.0))
        >>> found = visual_events_along(scene, at, along=(1.0, 0.0, 0.0), reach=4.0)
        >>> (found.x - 2.0).round(6).tolist()  # the lamp's edges, in line with the plate's
        [-0.9, -0.1, 0.1, 0.9]
        >>> found.order.tolist()
        [1, 1, 1, 1]
    """
    check_asked_one(scene, Scene, at, Receiver)
    check_concrete(scene, at)
    way = _direction(at, along)
    check_positive("reach", reach)
    length, edges, rounds = float(np.asarray(reach)), edges_of(scene, at), rounds_of(scene)
    line = way, length
    parts = [
        _contacts(at, way, contacts(edges, at, *line)),
        _contacts(at, way, round_contacts(scene, edges, at, *line)),
        _planes(scene, edges, rounds, at, way, length),
        _touches(scene, edges, at, way, edge_tangents_along(edges, rounds, at, *line)),
        _touches(scene, edges, at, way, body_tangents_along(edges, rounds, at, *line)),
        _touches(scene, edges, at, way, endwise_along(edges, rounds, at, *line)),
        _vertices(scene, edges, at, way, vertex_edges_along(edges, at, *line)),
        _vertices(scene, edges, at, way, vertex_rounds_along(edges, rounds, at, *line)),
        _triples(scene, edges, at, way, three_edges_along(edges, at, *line)),
        _triples(scene, edges, at, way, round_triples_along(edges, rounds, at, *line)),
        _triples(scene, edges, at, way, three_rounds_along(edges, rounds, at, *line)),
    ]
    table = joined(parts)
    return table if hidden else table.take(table.visible)


def _direction(at: Receiver, along: Any) -> Float[np.ndarray, "3"]:
    """The unit direction of a line in the plane of its receivers."""
    given = np.asarray(numbers("along", along), float)
    check_finite("along", given)
    if given.shape != (3,):
        raise ValueError(f"Argument `along` must have shape (3,), but has {given.shape}.")
    if not np.any(given):
        raise ValueError("Argument `along` must have a length, but is the zero vector.")
    way = unit(given)
    if abs(way @ np.asarray(at.normal)) > 1e-6:
        raise ValueError("Argument `along` must be perpendicular to the normal, but is not.")
    return way


# --- one kind after the other --------------------------------------------------------------------


def _table(
    at: Receiver, way, kind: str, x, direction, r, seen, slope=0.0, bend=0.0, roots=(0.0, 0.0)
) -> EventsAlong:
    """One row for each x, from distances r, shape (n, k), and jumps where something is seen."""
    n = len(x)
    position = np.asarray(at.position) + x[:, None] * way
    order, near, far = np.full(n, ORDERS[kind]), np.min(r, axis=1), np.max(r, axis=1)
    # A jump of irradiance from radiance that cancels to rounding is none.
    jumps = [np.where(seen, jump, 0.0) for jump in (slope, bend, *roots)]
    return EventsAlong(x, position, np.full(n, kind), order, direction, near, far, seen, *jumps)


def _contacts(at: Receiver, way, x) -> EventsAlong:
    direction, none = np.broadcast_to(way, (len(x), 3)), np.zeros((len(x), 1))
    return _table(at, way, "contact", x, direction, none, np.ones(len(x), bool))


def _planes(
    scene: Scene, edges: Edges, rounds: Rounds, at: Receiver, way, reach: float
) -> EventsAlong:
    x, normals = planes_along(edges, rounds, at, way, reach)
    normals = normals * np.where(normals @ way < 0.0, -1.0, 1.0)[:, None]
    places = np.asarray(at.position) + x[:, None] * way
    found = strips(edges, rounds, at, places, normals)
    slopes = plane_slopes(scene, at, edges, places, normals, found)
    rows, first = np.unique(found.row, return_index=True)
    r, u = found.r[first, None], found.u[first]
    slope = slopes[rows] * np.abs(normals[rows] @ way)
    seen = is_seen(scene, strengths(found, slopes)[rows])
    bend, *roots = plane_bends(scene, edges, rounds, at, places, normals, way, found)[:, rows]
    return _table(at, way, "two edges in a plane", x[rows], u, r, seen, slope, bend, roots)


def _touches(scene: Scene, edges: Edges, at: Receiver, way, found) -> EventsAlong:
    x, rows = found
    roots = tangent_roots(scene, at, edges, rows)
    seen = is_seen(scene, roots.strength)
    return _table(at, way, TOUCH, x, rows.u, rows.r, seen, roots=roots.along(way))


def _vertices(scene: Scene, edges: Edges, at: Receiver, way, found) -> EventsAlong:
    x, rows = found
    bends = vertex_edge_bends(scene, at, edges, rows)
    u, r = unit(edges.vertices[rows.vertex] - rows.place), np.stack([rows.r_vertex, rows.r_edge], 1)
    seen = is_seen(scene, bends.strength)
    return _table(at, way, "vertex and edge", x, u, r, seen, bend=bends.along(way))


def _triples(scene: Scene, edges: Edges, at: Receiver, way, found) -> EventsAlong:
    x, rows = found
    bends = three_edges_bends(scene, at, edges, rows)
    seen = is_seen(scene, bends.strength)
    return _table(at, way, "three edges", x, rows.u, rows.r, seen, bend=bends.along(way))
