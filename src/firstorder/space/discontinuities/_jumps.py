"""Jumps of derivatives of irradiance where edges line up.

Let `m` be the unit normal of the plane through a receiver and an edge, `r` the distance to it along
the line of sight `u`. For a receiver that moves with `d` the image of the edge moves with
`-(d . m) / r`. What the images do to each other makes the jump:

Two edges in a plane with normal m. Where they overlap, a strip opens between them. With `q / r` the
light along the plane that goes over one part of it and under the other, E' jumps by

    |d . m| integral cos(theta) (L_down + L_up - L_over - L_under) d(1/r) d(omega)

over the angle in the plane: `L_down(r)` is seen by a ray that goes over the plane to the distance r
and under it from there, `L_up(r)` by its reverse, `L_over` and `L_under` by rays on one side. E''
jumps there as well (`_plane_bends`).

A vertex and an edge. The image of the edge moves against that of the vertex with `s' = g . d`,
`g = -m (1/r_edge - 1/r_vertex)`. Edges leave the vertex along `e_i`, as seen by the receiver, and
E'' jumps by

    sgn(s') s'^2 cos(theta) sum over i of K_i (e_i . tau) / |e_i . m|,      tau = u x m

Three edges, with `lambda_i` the sines between the other two, enclose a triangle of the area
`D^2 / (2 |lambda_1 lambda_2 lambda_3|)`, where `D' = g . d` with `g = -sum lambda_i m_i / r_i`, and
E'' jumps by

    sgn(D') D'^2 cos(theta) sgn(lambda_3) (K_after - K_before) / (lambda_1 lambda_2 lambda_3)

Two outlines that touch, with the normal m of the plane that touches both, and k the curvature of
the one against the other. Their images move by `g . d`, `g = -m (1/r_1 - 1/r_2)`, and overlap, or
part, in a lens of the area `(4 sqrt(2) / 3) |g . d|^(3/2) / sqrt(|k|)` where `k (g . d) < 0`; E''
grows there without bound,

    E'' ~ K cos(theta) sqrt(2 / |k|) |g . d|^(3/2) / sqrt(x)

at the distance x, and is smooth on the other side. The two rims of a cylinder touch for an eye that
looks along its wall. What opens then is their hull: of outlines that are curved by k_1 and k_2 it
is `(k_1 + k_2) / (2 sqrt(k_1 k_2))` times the lens.

`K` is the alternating sum of radiance about a crossing (`_queries.crossing_sum`), of the edge with
that of the vertex, and of the first two of the three; of outlines that touch it is that of the
lens, over and under them, and beside the lens.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from firstorder.space.discontinuities._edges import Edges, dot, fans, unit
from firstorder.space.discontinuities._lines_of_sight import (
    ThreeEdges,
    VertexEdges,
    in_planes_of_others,
)
from firstorder.space.discontinuities._queries import (
    crossing_sum,
    is_seen,
    light,
    steps,
    tangential,
)
from firstorder.space.discontinuities._rounds import OFF, rounds_of, tangent_planes
from firstorder.space.discontinuities._strips import plane_slopes, strengths, strips, sums
from firstorder.space.discontinuities._tangents import Tangents
from firstorder.space.receiver import Receiver
from firstorder.space.scene import Scene


class Bends(NamedTuple):
    """Jumps of E'' by the direction in which a receiver moves: `sgn(g . d) (g . d)^2 C`.

    Attributes:
        rate: g, of the images against each other, in the plane of the receivers [1/m].
        strength: C [W/m^2].
    """

    rate: Float[np.ndarray, "n 3"]
    strength: Float[np.ndarray, " n"]

    def along(self, d) -> Float[np.ndarray, " n"]:
        """Jumps for unit directions, one or as many as rows [W/m^4]."""
        moves = dot(self.rate, d)
        return np.sign(moves) * moves**2 * self.strength


class Roots(NamedTuple):
    """Where E'' grows like one over a root: by the direction in which a receiver moves.

    Attributes:
        rate: g, of the images against each other, in the plane of the receivers [1/m].
        curvature: of one against the other.
        strength: K cos(theta) sqrt(2 / |k|) [W/m^2].
    """

    rate: Float[np.ndarray, "n 3"]
    curvature: Float[np.ndarray, " n"]
    strength: Float[np.ndarray, " n"]

    def along(self, d) -> tuple[Float[np.ndarray, " n"], Float[np.ndarray, " n"]]:
        """Coefficients of `1 / sqrt(x)` in E'' before and after, for a unit direction [W/m^3.5]."""
        moves = dot(self.rate, d)
        size = self.strength * np.abs(moves) ** 1.5
        after = self.curvature * moves < 0.0
        return np.where(after, 0.0, size), np.where(after, size, 0.0)


def tangent_roots(scene: Scene, at: Receiver, edges: Edges, rows: Tangents) -> Roots:
    """Where E'' grows without bound since two outlines touch.

    Args:
        scene: of one band.
        at: gives the normal and the shape on which receivers lie.
        edges: of the scene.
        rows: lines of sight.
    """
    u, m, k = rows.u, rows.m, rows.curvature[:, None]
    rate = tangential(at, -m * (1.0 / rows.r[:, :1] - 1.0 / rows.r[:, 1:]))
    step, _ = steps(at, np.min(rows.r, axis=1))
    d = -np.sign(k) * step[:, None] * unit(rate)  # to where the lens is
    heights = -dot(d, m)[:, None] / rows.r
    middle, width = np.mean(heights, axis=1, keepdims=True), np.abs(np.diff(heights, axis=1))
    beside = np.sqrt(6.0 * width / np.abs(k))  # where the outlines are twice as far apart
    bent = middle + rows.bend[:, None] * beside**2 / 2.0
    tau = np.cross(u, m)
    ways = [u + middle * m, u + beside * tau + bent * m]
    ways += [u + (middle + 1.5 * side * width) * m for side in (1.0, -1.0)]
    L = light(scene, at, rows.place + d, np.stack(ways))
    K = L[0] + L[1] - L[2] - L[3]
    cosine = dot(u, np.asarray(at.normal))
    strength = K * cosine * np.sqrt(2.0 / np.abs(rows.curvature)) * rows.fill
    return Roots(rate, rows.curvature, strength)


def vertex_edge_bends(
    scene: Scene, at: Receiver, edges: Edges, rows: VertexEdges, leaving=None
) -> Bends:
    """Jumps of E'' where a vertex and an edge line up.

    Args:
        scene: of one band.
        at: gives the normal and the shape on which receivers lie.
        edges: of the scene.
        rows: lines of sight.
        leaving: `fans(edges)`, which are found if it is left out.
    """
    vertex, start, along = edges.vertices[rows.vertex], rows.start, rows.along
    u = unit(vertex - rows.place)
    m = unit(np.cross(start - vertex, along))
    rate = tangential(at, -m * (1.0 / rows.r_edge - 1.0 / rows.r_vertex)[:, None])
    of, part, way = fans(edges) if leaving is None else leaving
    # What leaves along the edge's image makes a strip with it, or nothing that is seen.
    straight = rows.edge < len(edges.ends)
    leaves = rows.vertex[:, None] == of
    leaves[straight] &= ~edges.coplanar[rows.edge[straight]][:, part]
    ways = way / np.linalg.norm(way, axis=-1, keepdims=True)
    beside_walls = leaves & ~straight[:, None] & (np.abs(m @ ways.T) <= OFF)
    row, fan = np.nonzero(leaves & ~beside_walls)
    way, u_, m_ = way[fan], u[row], m[row]
    tau = np.cross(u_, m_)
    across, beside = dot(way, m_), dot(way, tau)
    step, share = steps(at, np.minimum(rows.r_vertex, rows.r_edge)[row])
    moved = np.linalg.norm(rate, axis=-1)
    eye = rows.place[row] + (np.sign(across) * step)[:, None] * unit(rate)[row]
    image, other = np.cross(start[row] - eye, along[row]), np.cross(vertex[row] - eye, way)
    bent = np.flatnonzero(~straight[row])  # an outline may turn away before the edge crosses it
    bodies = rounds_of(scene).take(rows.edge[row[bent]] - len(edges.ends))
    image[bent] = tangent_planes(bodies, eye[bent], u_[bent], other[bent])
    K, _ = crossing_sum(scene, at, eye, (image, other), (m_, tau, u_), share * step * moved[row])
    parts = K * beside / np.abs(across)
    flat = in_planes_of_others(edges, rows) | np.any(beside_walls, axis=1)
    total = sums(row, parts, len(u)) * ~_on_strips(scene, at, edges, rows.place, m, flat)
    return Bends(rate, dot(u, np.asarray(at.normal)) * total)


def _on_strips(scene: Scene, at: Receiver, edges: Edges, place, m, asked) -> np.ndarray:
    """Which planes of those asked about make E' jump: the jump of E'' there is `_plane_bends`'."""
    flat = np.flatnonzero(asked)
    planes = place[flat], m[flat]
    found = strips(edges, rounds_of(scene), at, *planes)
    slopes = plane_slopes(scene, at, edges, *planes, found)
    jumps = np.zeros(len(m), bool)
    jumps[flat] = is_seen(scene, strengths(found, slopes))
    return jumps


def three_edges_bends(scene: Scene, at: Receiver, edges: Edges, rows: ThreeEdges) -> Bends:
    """Jumps of E'' where three edges line up.

    Args:
        scene: of one band.
        at: gives the normal and the shape on which receivers lie.
        edges: of the scene.
        rows: lines of sight.
    """
    start, along = rows.start, rows.along
    m, r = unit(np.cross(start - rows.place[:, None], along)), rows.r
    sines = _sines(m, rows.u)
    # The two edges whose crossing is looked at are those that cross at the largest angle.
    last = np.argmax(np.abs(sines), axis=1)
    order = (last[:, None] + np.array([1, 2, 3])) % 3
    m, start, along = (np.take_along_axis(a, order[..., None], 1) for a in (m, start, along))
    r, sines = (np.take_along_axis(a, order, 1) for a in (r, sines))
    rate = tangential(at, -np.sum((sines / r)[..., None] * m, axis=1))
    step, share = steps(at, np.min(r, axis=1))
    hair = share * step * np.linalg.norm(rate, axis=-1)
    K = []
    for side in (1.0, -1.0):
        eye = rows.place + side * step[:, None] * unit(rate)
        planes = tuple(np.cross(start[:, i] - eye, along[:, i]) for i in (0, 1))
        K.append(crossing_sum(scene, at, eye, planes, (m[:, 0], m[:, 1], rows.u), hair)[0])
    change = np.sign(sines[:, 2]) * (K[0] - K[1]) / np.prod(sines, axis=1)
    return Bends(rate, dot(rows.u, np.asarray(at.normal)) * change)


def _sines(m, u) -> Float[np.ndarray, "n 3"]:
    """Of each edge the sine, about the line of sight, between the other two."""
    pairs = [np.cross(m[:, i - 2], m[:, i - 1]) for i in range(3)]
    return np.stack([dot(u, p) for p in pairs], -1)
