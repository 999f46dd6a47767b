"""Visual events on a line of receivers: where irradiance, or a derivative of it, jumps.

Seen from a receiver, edges at different distances move at different speeds. Where they line up the
order in which they cover each other changes, and

    two edges in a plane with the receiver      E' jumps
    a vertex and an edge                        E'' jumps
    three edges                                 E'' jumps
    a shape that the line runs into             E jumps

Closed forms are in `_jumps`. Parallel edges lie in a plane, and so do the edges of a face. All of
it is found on the host, from concrete scenes of flat faces.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from jaxtyping import ArrayLike, Float

from firstorder._argument_checks import check_finite, check_positive
from firstorder.scene._arguments import check_asked_one, numbers
from firstorder.space.discontinuities._edges import Edges, edges_of, unit
from firstorder.space.discontinuities._event_table import ORDERS, EventsAlong, joined
from firstorder.space.discontinuities._jumps import (
    Bends,
    plane_slopes,
    strips,
    three_edges_bends,
    vertex_edge_bends,
)
from firstorder.space.discontinuities._lines_of_sight import (
    contacts,
    planes_along,
    three_edges_along,
    vertex_edges_along,
)
from firstorder.space.discontinuities._queries import check_concrete, is_seen
from firstorder.space.receiver import Receiver
from firstorder.space.scene import Scene


def visual_events_along(
    scene: Scene, at: Receiver, *, along: Any, reach: ArrayLike, hidden: bool = False
) -> EventsAlong:
    """All visual events on a line of receivers in a plane.

    Light is what shapes of constant radiance and a constant sky emit, as for `irradiance`.

    Valid for: boxes, rectangles and triangles that do not run into each other, and lines along
    which no two edges of different bodies stay in line. Where E' jumps at a plane of two edges, the
    jump of E'' is left out. Events at one place are rows of their own, and their jumps add. Work
    grows with the third power of the number of edges.

    Args:
        scene: concrete shapes of flat faces, and a sky of one radiance.
        at: the first receiver; say on which shape it lies (`on`) if it lies on one.
        along: direction of the line, of any length, shape (3,); perpendicular to the normal.
        reach: length of the line [m].
        hidden: also give events that something hides.

    Returns:
        Places, kinds and jumps, in order of distance.

    Raises:
        ValueError: if the scene is traced, has a round shape, a plane in which the receivers do not
            lie, bands or a sky of many radiances; if the line has no length or leaves the plane.

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
    length, edges = float(np.asarray(reach)), edges_of(scene, at)
    parts = [
        _contacts(edges, at, way, length),
        _planes(scene, edges, at, way, length),
        _vertices(scene, edges, at, way, length),
        _triples(scene, edges, at, way, length),
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


def _table(at: Receiver, way, kind: str, x, direction, near, far, jumps, visible) -> EventsAlong:
    n = len(x)
    position = np.asarray(at.position) + x[:, None] * way
    order = np.full(n, ORDERS[kind])
    # A jump of irradiance from radiance that cancels to rounding is none.
    jumps = [np.where(visible, j, 0.0) for j in jumps]
    return EventsAlong(x, position, np.full(n, kind), order, direction, near, far, visible, *jumps)


def _contacts(edges: Edges, at: Receiver, way, reach: float) -> EventsAlong:
    x = contacts(edges, at, way, reach)
    none = np.zeros(len(x))
    direction = np.broadcast_to(way, (len(x), 3))
    seen = np.ones(len(x), bool)
    return _table(at, way, "contact", x, direction, none, none, (none, none), seen)


def _planes(scene: Scene, edges: Edges, at: Receiver, way, reach: float) -> EventsAlong:
    x, normals = planes_along(edges, at, way, reach)
    places = np.asarray(at.position) + x[:, None] * way
    found = strips(edges, at, places, normals)
    slopes = plane_slopes(scene, at, edges, places, normals, found)
    rows, first = np.unique(found.row, return_index=True)
    r, u = found.r[first], found.u[first]
    jump = slopes[rows] * np.abs(normals[rows] @ way)
    seen = is_seen(scene, slopes[rows])
    return _table(at, way, "two edges in a plane", x[rows], u, r, r, (jump, 0.0 * jump), seen)


def _vertices(scene: Scene, edges: Edges, at: Receiver, way, reach: float) -> EventsAlong:
    x, rows = vertex_edges_along(edges, at, way, reach)
    u = unit(edges.vertices[rows.vertex] - rows.place)
    ends = np.stack([rows.r_vertex, rows.r_edge])
    bends = vertex_edge_bends(scene, at, edges, rows)
    return _bent(scene, at, way, "vertex and edge", x, u, ends, bends)


def _triples(scene: Scene, edges: Edges, at: Receiver, way, reach: float) -> EventsAlong:
    x, rows = three_edges_along(edges, at, way, reach)
    bends = three_edges_bends(scene, at, edges, rows)
    return _bent(scene, at, way, "three edges", x, rows.u, rows.r.T, bends)


def _bent(scene: Scene, at: Receiver, way, kind, x, u, r, bends: Bends) -> EventsAlong:
    jump = bends.along(way)
    ends = np.min(r, axis=0), np.max(r, axis=0)
    seen = is_seen(scene, bends.strength)
    return _table(at, way, kind, x, u, *ends, (0.0 * jump, jump), seen)
