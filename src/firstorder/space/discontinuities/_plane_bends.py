"""Jumps of E'' where E' jumps: at planes in which edges, lines of walls, or halves of discs lie.

For an eye at the height h over such a plane, `h = x s` with `s = d . m`, light changes by what rays
see that go through it at points p, between the edges of the plane, which stay where they are:

    s x integral K(p) (n . (p - x d)) / |p - x d|^4 dA

with the alternating sum K of `_jumps`. Its first order is the jump of E', and the second has two
parts. The kernel gives

    4 s integral cos(theta) (u . d) K (1/r_near^2 - 1/r_far^2) d(omega)

to E''. And K ends where an edge e crosses the plane, at the distance q: on rays that pass e, and
move along the plane by `x (1 - r / q) (d . tau - s c)` at the distance r, with `tau = u x m` and
`c = (e . tau) / (e . m)`. Of all edges a of the plane that e is seen to cross, this gives

    s (s c - d . tau) cos(theta) (1/r_a - 1/q)^2 (K_after - K_before)

where K is that of the crossing, on those sides of the plane on which there is one.

A line of a wall does not stay where it is: an eye at the height h sees it as an edge that is higher
by `b h^2 / 2` (`InPlane.lifts`). That gives

    s^2 integral cos(theta) K (b_far / r_far - b_near / r_near) d(omega)

and what happens at its ends is in `_wall_ends`.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float, Int

from firstorder.space.discontinuities._edges import Edges, dot, fans, unit
from firstorder.space.discontinuities._lines_of_sight import merged
from firstorder.space.discontinuities._queries import crossing_sum, is_seen, steps, tangential
from firstorder.space.discontinuities._rounds import (
    FLAT,
    OFF,
    WALL,
    Rounds,
    null_directions,
    outline_at,
    plane_form,
)
from firstorder.space.discontinuities._strips import (
    InPlane,
    Strips,
    in_plane,
    strengths,
    strip_sums,
    sums,
    touching_walls,
)
from firstorder.space.discontinuities._wall_ends import end_bends, tip_bends, tips_of, wall_ends
from firstorder.space.receiver import Receiver
from firstorder.space.scene import Scene


class Crossings(NamedTuple):
    """Edges that cross a plane, and edges of the plane before or behind them.

    Attributes:
        row: number of the plane.
        point: where the first ones cross it [m].
        way: along them.
        side: of the plane on which they are, along its normal: 1, -1, or 0 for both.
        own: whether a vertex where they cross has an event of its own with the second one, which
            tells of how the first ones lean.
        start, along: of the second ones, in the plane [m].
        r: distances of both [m].
    """

    row: Int[np.ndarray, " k"]
    point: Float[np.ndarray, "k 3"]
    way: Float[np.ndarray, "k 3"]
    side: Int[np.ndarray, " k"]
    own: Bool[np.ndarray, " k"]
    start: Float[np.ndarray, "k 3"]
    along: Float[np.ndarray, "k 3"]
    r: Float[np.ndarray, "k 2"]


def plane_bends(
    scene: Scene, edges: Edges, rounds: Rounds, at: Receiver, places, normals, d, found: Strips
) -> Float[np.ndarray, "3 n"]:
    """Jumps of E'' along a line where E' jumps, and roots before and after, as rows.

    Args:
        scene: of one band.
        edges: of the scene.
        rounds: likewise.
        at: gives the normal and the shape on which receivers lie.
        places: of a receiver on each plane [m].
        normals: of the planes, on the side to which the line goes.
        d: unit direction of the line.
        found: strips of the planes.
    """
    speed = normals @ d
    shown = strip_sums(scene, at, edges, places, normals, found)
    seen = is_seen(scene, strengths(found, sums(found.row, found.weight * shown, len(places))))
    bends = np.zeros((3, len(places)))
    bends[0] = 4.0 * speed * sums(found.row, shown * (found.turn @ d), len(places))
    bends[0] += speed**2 * sums(found.row, shown * found.lift, len(places))
    tables, tips = [], []
    for k in np.flatnonzero(seen).tolist():
        here = in_plane(edges, rounds, at, places[k], normals[k])
        tables.append(_crossings(edges, rounds, at, here, k, places[k], normals[k]))
        ends, own = wall_ends(here, at, k, places[k], normals[k]), found.row == k
        tips.append(tips_of(here, edges, at, places[k], ends))
        strips = Strips(*(a[own] for a in found))
        bends[0, k] += speed[k] * end_bends(here, edges, at, d, ends, strips, shown[own])
    if tables:
        rows = merged(tables)
        parts = _parts(scene, edges, at, places, normals, d, rows)
        bends[0] += speed * sums(rows.row, parts, len(places))
        bends += tip_bends(scene, edges, at, places, d, merged(tips))
    return np.where(seen, bends, 0.0)


def _parts(scene: Scene, edges: Edges, at: Receiver, places, normals, d, rows: Crossings):
    """Parts of the jump of E'' by crossing, over the speed across the plane [W/m^3]."""
    place, m = places[rows.row], normals[rows.row]
    u = unit(rows.point - place)
    tau = np.cross(u, m)
    closer = np.diff(1.0 / rows.r, axis=1)[:, 0]  # positive if the edge of the plane is nearer
    step, share = steps(at, np.min(rows.r, axis=1))
    up = tangential(at, m)
    hair = share * step * np.linalg.norm(up, axis=-1) * np.abs(closer)
    K = np.zeros(len(u))
    for side in (1.0, -1.0):
        there = rows.side * side * closer <= 0.0
        eye = (place + side * step[:, None] * unit(up))[there]
        image = np.cross(rows.start[there] - eye, rows.along[there])
        other = np.cross(rows.point[there] - eye, rows.way[there])
        towards = m[there], tau[there], u[there]
        total, _ = crossing_sum(scene, at, eye, (image, other), towards, hair[there])
        K[there] += side * total
    slant = dot(rows.way, tau) / dot(rows.way, m) * (m @ d)
    moved = np.where(rows.own, 0.0, slant) - tau @ d
    return moved * dot(u, np.asarray(at.normal)) * closer**2 * K


# --- what crosses a plane ------------------------------------------------------------------------


def _crossings(
    edges: Edges, rounds: Rounds, at: Receiver, here: InPlane, row, place, m
) -> Crossings:
    """All crossings of one plane."""
    bodies = rounds.take(~touching_walls(rounds, place, m, edges.near))
    parts = _of_vertices(edges, here, m), _of_edges(edges, here), _of_bodies(bodies, here, place, m)
    point, way, side, vertex = (np.concatenate(a) for a in zip(*parts, strict=True))
    q = np.linalg.norm(point - place, axis=-1)
    u = (point - place) / q[:, None]
    r, there = here.distances(u @ here.frame.T, edges.near)
    there &= (np.abs(r - q[:, None]) > edges.near) & (u @ np.asarray(at.normal) > OFF)[:, None]
    k, a = np.nonzero(there)
    # A vertex with an edge in the plane has no event of its own there.
    flat = (edges.touch.astype(float) @ edges.coplanar) > 0.0
    walls = np.any(edges.touch[:, here.inside], axis=1, keepdims=True)
    flat = np.append(flat[:, here.inside], np.tile(walls, len(here.outwards)), axis=1)
    of = np.flatnonzero((vertex[k] >= 0) & (a < len(here.start)))
    own = np.zeros(len(k), bool)
    own[of] = ~flat[vertex[k[of]], a[of]]
    start = place + r[k, a][:, None] * u[k]
    along = here.tangents(start, place, a)
    rows = np.full(len(k), row)
    return Crossings(
        rows, point[k], way[k], side[k], own, start, along, np.stack([q[k], r[k, a]], 1)
    )


def _of_vertices(edges: Edges, here: InPlane, m):
    """Edges that leave the plane at vertices: where, along, to which side, and which vertices."""
    of, _, way = fans(edges)
    off = unit(way) @ m
    leaves = here.on[of] & (np.abs(off) > OFF)
    side = np.sign(off[leaves]).astype(int)
    return edges.vertices[of[leaves]], way[leaves], side, of[leaves]


def _of_edges(edges: Edges, here: InPlane):
    """Edges that cross the plane between their vertices."""
    a, b = edges.ends.T
    ends = here.height[a] * here.height[b] < 0.0
    which = np.flatnonzero(ends & ~(here.on[a] | here.on[b]))
    share = here.height[a] / np.where(ends, here.height[a] - here.height[b], 1.0)
    point = (edges.start + share[:, None] * edges.along)[which]
    return point, edges.along[which], np.zeros(len(which), int), np.full(len(which), -1)


def _of_bodies(rounds: Rounds, here: InPlane, place, m):
    """Outlines of bodies that cross the plane."""
    ways = null_directions(plane_form(rounds, place, here.frame)) @ here.frame
    body, branch = np.nonzero(np.all(np.isfinite(ways), axis=-1))
    u, one = ways[body, branch], rounds.take(body)
    u = u * np.where(dot(u, one.center - place) < 0.0, -1.0, 1.0)[:, None]
    eye = np.broadcast_to(place, u.shape)
    outline = outline_at(one, eye, u)
    # A wall may end at the plane, where its rim is.
    along = np.linalg.solve(one.axes, (outline.touch - one.center)[..., None])[..., 2, 0]
    ends = (one.kind == WALL) & (np.abs(np.abs(along) - 1.0) < OFF)
    normal = unit(np.cross(one.axes[..., 0], one.axes[..., 1]))
    level = (one.kind == FLAT) & (np.abs(np.abs(normal @ m) - 1.0) < OFF)
    there = (outline.there | ends) & ~level & np.all(np.isfinite(outline.touch), axis=-1)
    inwards = np.where(ends, -np.sign(along * (one.axes[..., 2] @ m)), 0.0).astype(int)
    way = np.cross(u, outline.m)
    there &= np.abs(way @ m) > OFF
    return outline.touch[there], way[there], inwards[there], np.full(np.sum(there), -1)
