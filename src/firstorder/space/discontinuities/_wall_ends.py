"""Jumps and roots of E'' from the ends of a line of a wall that lies in a plane.

A line ends at a rim, along which the outline goes on; its image leaves the plane like a parabola.
Let u be the direction to the end at the distance r, v at right angles to u in the plane and away
from the line, and `(cos(b) - 1) p + sin(b) q` the rim from there, with `q . v > 0`. For an eye at
the height h, what lies in the plane at another distance `r_j` crosses the rim at `C b^2 = |h A|` if
h is on the one side of the plane, and a tip opens between the two. With K, the alternating sum of
radiance about it, its light is to the second order in h

    K cos(theta) (2/3) d_1 |h A|^(3/2) / sqrt(C) + K h^2 S

    A = 1/r - 1/r_j,    C = |p . m| / (2 r)
    S = cos(theta) d_1 (D A^2 / (4 C^2) - B |A| / (2 C)) + (c d_1^2 + 2 cos(theta) d_2) A^2 / (4 C)
    B = sgn(A) (q_u / r^2 + d_1 (1/r_j)'),    D = |p . m| q_u / (2 r^2)

by the angle `d_1 b + d_2 b^2` of the rim along the plane, the derivative c of `cos(theta)` by that
angle, and `q_u = q . u`. So E'' grows like one over a root, as beside half a lens (`_jumps`), and
jumps by `2 s^2 K S`, with `s = d . m`. And the strips of the line end there. Rays past the end move
by `x (1 - R / r) (d . v)` at the distance R, so that E'' jumps by

    2 s (d . v) cos(theta) integral (K_line - K_beyond) (1 - R / r) / R^3 dR

with the sums K of the strips on either side of the end.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from jaxtyping import Float, Int

from firstorder.space.discontinuities._edges import Edges, dot
from firstorder.space.discontinuities._jumps import tangent_roots
from firstorder.space.discontinuities._rounds import OFF, form
from firstorder.space.discontinuities._strips import InPlane, Strips, sums
from firstorder.space.discontinuities._tangents import Tangents
from firstorder.space.discontinuities._walls import across, line_of_wall
from firstorder.space.receiver import Receiver
from firstorder.space.scene import Scene

BESIDE = 1e-5  # of an end of a line, rays that tell which strips are on either side of it [rad]


class WallEnds(NamedTuple):
    """Ends of lines of walls in planes.

    Attributes:
        row: number of the plane.
        u, v: directions to them, and at right angles to these in the plane, away from the line.
        r: distances [m].
        m: unit normals of the planes, `u x m = v`.
        p, q: of the rims, the first out of the wall [m].
        height: of the ends over the middles of the rims, along m [m].
    """

    row: Int[np.ndarray, " n"]
    u: Float[np.ndarray, "n 3"]
    v: Float[np.ndarray, "n 3"]
    r: Float[np.ndarray, " n"]
    m: Float[np.ndarray, "n 3"]
    p: Float[np.ndarray, "n 3"]
    q: Float[np.ndarray, "n 3"]
    height: Float[np.ndarray, " n"]


def wall_ends(here: InPlane, at: Receiver, row: int, place, m) -> WallEnds:
    """The ends above the horizon of one plane."""
    walls, out = here.walls, here.outwards
    start, way = line_of_wall(walls, out)
    point = np.concatenate([start, start + way])
    r = np.linalg.norm(point - place, axis=-1)
    u, away = (point - place) / r[:, None], np.concatenate([-way, way])
    v = np.cross(u, m)
    side = np.where(dot(v, away) < 0.0, -1.0, 1.0)[:, None]
    b = walls.axes[..., :2]
    turn = np.einsum("kij,ki->kj", b, out) / np.sqrt(form(across(walls), out))[:, None]
    p, q = (np.einsum("kij,kj->ki", b, a) for a in (turn, turn[:, ::-1] * [-1.0, 1.0]))
    p, q = np.tile(p, (2, 1)), np.tile(q, (2, 1))
    v, mm = side * v, side * m
    q = q * np.where(dot(q, v) < 0.0, -1.0, 1.0)[:, None]
    ends = WallEnds(np.full(len(r), row), u, v, r, mm, p, q, dot(p, mm))
    there = (u @ np.asarray(at.normal) > OFF) & (dot(q, v) > OFF * np.linalg.norm(q, axis=-1))
    return WallEnds(*(a[there] for a in ends))


class Tips(NamedTuple):
    """Tips that open between rims, where lines of walls end, and what else lies in a plane.

    Attributes:
        row, u, m: as of the end.
        r: distances of the end and of the other [m].
        curvature: of the rim against the other, as in `Outline`.
        second: S, of second order in the height [1/m^2].
    """

    row: Int[np.ndarray, " n"]
    u: Float[np.ndarray, "n 3"]
    m: Float[np.ndarray, "n 3"]
    r: Float[np.ndarray, "n 2"]
    curvature: Float[np.ndarray, " n"]
    second: Float[np.ndarray, " n"]


def tips_of(here: InPlane, edges: Edges, at: Receiver, place, ends: WallEnds) -> Tips:
    """The tips of one plane."""
    r, there = here.distances(ends.u @ here.frame.T, edges.near)
    there &= np.abs(r - ends.r[:, None]) > edges.near
    k, line = np.nonzero(there)
    ends, r = WallEnds(*(a[k] for a in ends)), r[k, line]
    along = here.tangents(place + r[:, None] * ends.u, place, line)
    slope = -dot(along, ends.u) / (r * dot(along, ends.v))  # of 1 / r towards v
    curvature = -ends.height * ends.r / dot(ends.q, ends.v) ** 2
    second = _second_order(ends, r, slope, np.asarray(at.normal))
    return Tips(ends.row, ends.u, ends.m, np.stack([ends.r, r], -1), curvature, second)


def _second_order(ends: WallEnds, other, slope, normal) -> Float[np.ndarray, " n"]:
    """S of tips, in square radians by the square of the height [1/m^2]."""
    u, v, p, q, r, height = ends.u, ends.v, ends.p, ends.q, ends.r, np.abs(ends.height)
    A, C, D = 1.0 / r - 1.0 / other, height / (2.0 * r), height * dot(q, u) / (2.0 * r**2)
    turn, cosine = dot(q, v) / r, dot(u, normal)
    turns = -dot(p, v) / (2.0 * r) - turn * dot(q, u) / r
    B = np.sign(A) * (dot(q, u) / r**2 + turn * slope)
    bent = cosine * turn * (D * A**2 / (4.0 * C**2) - B * np.abs(A) / (2.0 * C))
    widened = dot(v, normal) * turn**2 + 2.0 * cosine * turns
    return bent + widened * A**2 / (4.0 * C)


def tip_bends(
    scene: Scene, edges: Edges, at: Receiver, places, d, tips: Tips
) -> Float[np.ndarray, "3 n"]:
    """Jumps of E'' along a line from tips, and roots before and after, by plane.

    Args:
        scene: of one band.
        edges: of the scene.
        at: gives the normal and the shape on which receivers lie.
        places: of a receiver on each plane [m].
        d: unit direction of the line.
        tips: of the planes.
    """
    row, u, m, r, k, second = tips
    half = np.full(len(k), 0.5)  # of a lens
    roots = tangent_roots(scene, at, edges, Tangents(places[row], u, m, r, k, 0.5 * k, half))
    before, after = roots.along(d)
    K = roots.strength / (dot(u, np.asarray(at.normal)) * np.sqrt(2.0 / np.abs(k)) * half)
    jump = np.where(after != 0.0, 2.0, -2.0) * (m @ d) ** 2 * K * second
    return np.stack([sums(row, part, len(places)) for part in (jump, before, after)])


def end_bends(
    here: InPlane, edges: Edges, at: Receiver, d, ends: WallEnds, found: Strips, shown
) -> float:
    """The jump of E'' from ends of lines in one plane, over the speed across the plane [W/m^3].

    Args:
        here: the plane.
        edges: of the scene.
        at: gives the normal.
        d: unit direction of the line of receivers.
        ends: of the plane.
        found: its strips.
        shown: their alternating sums of radiance.
    """
    total, normal = 0.0, np.asarray(at.normal)
    r, _ = here.distances(ends.u @ here.frame.T, edges.near)
    for u, v, end, nearness in zip(ends.u, ends.v, ends.r, 1.0 / r, strict=True):
        near, far = (0.5 * z * z - z / end for z in nearness[found.lines].T)
        for side in (1.0, -1.0):
            way = here.frame @ (u + side * BESIDE * v)
            low, high = found.angles.T - np.arctan2(way[1], way[0])
            K = np.where((low < 0.0) & (high > 0.0), shown, 0.0)
            total -= side * 2.0 * (d @ v) * (u @ normal) * np.sum(K * (near - far))
    return total
