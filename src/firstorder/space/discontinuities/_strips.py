"""Strips that open between what lies in a plane with a receiver, and the jumps of E' they make."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float, Int

from firstorder.space.discontinuities._edges import Edges, dot, unit
from firstorder.space.discontinuities._lines_of_sight import meeting
from firstorder.space.discontinuities._queries import light, steps, tangential
from firstorder.space.discontinuities._rounds import (
    FLAT,
    WALL,
    Rounds,
    form,
    null_directions,
    plane_form,
)
from firstorder.space.discontinuities._walls import across, line_of_wall, radius_of_wall
from firstorder.space.receiver import Receiver
from firstorder.space.scene import Scene

NODES = np.polynomial.legendre.leggauss(32)


class Strips(NamedTuple):
    """Angles in a plane at which a receiver sees one edge of the plane behind another.

    Attributes:
        row: number of the plane.
        u: a direction in the middle of the angle.
        r: a distance between the two edges along it [m].
        weight: the integral of `cos(theta) (1/r_near - 1/r_far)` over the angle [1/m].
        turn: that of `cos(theta) (1/r_near^2 - 1/r_far^2) u` [1/m^2].
        lift: that of `cos(theta) (b_far / r_far - b_near / r_near)` with `b` of `lifts` [1/m^2].
        angles: where it begins and ends, in the frame of the plane [rad].
        lines: numbers of the two edges, as in `InPlane.distances`.
    """

    row: Int[np.ndarray, " k"]
    u: Float[np.ndarray, "k 3"]
    r: Float[np.ndarray, " k"]
    weight: Float[np.ndarray, " k"]
    turn: Float[np.ndarray, "k 3"]
    lift: Float[np.ndarray, " k"]
    angles: Float[np.ndarray, "k 2"]
    lines: Int[np.ndarray, "k 2"]


def strips(edges: Edges, rounds: Rounds, at: Receiver, places, normals) -> Strips:
    """All strips of the planes through receivers, whether or not anything stands in the way.

    Args:
        edges: of the scene.
        rounds: likewise.
        at: gives the normal of the receivers.
        places: of a receiver on each plane, shape (n, 3) [m].
        normals: of the planes, unit vectors, likewise.
    """
    none, pairs, ways = np.zeros(0), np.zeros((0, 2)), np.zeros((0, 3))
    found = [Strips(none.astype(int), ways, none, none, ways, none, pairs, pairs.astype(int))]
    for row, (place, m) in enumerate(zip(places, normals, strict=True)):
        found += _strips_of(edges, rounds, at, row, place, m)
    return Strips(*(np.concatenate(a) for a in zip(*found, strict=True)))


def _strips_of(edges: Edges, rounds: Rounds, at: Receiver, row: int, place, m) -> list[Strips]:
    """The strips of one plane."""
    here = in_plane(edges, rounds, at, place, m)
    start, end, arcs = here.start, here.end, here.arcs
    if len(start) + 2 * len(arcs.center) < 2:
        return []
    piercing = _piercing(edges, here.flat, here.height, here.on)
    straight = slice(len(here.inside), None)
    points = np.concatenate([here.flat[here.on], start[straight], end[straight], piercing])
    crossing = rounds.take(~touching_walls(rounds, place, m, edges.near))
    angles = _break_angles(points, _null_angles(crossing, place, here.frame), arcs.tangents())
    ways = _ways(0.5 * (angles[1:] + angles[:-1]))
    r, there = here.distances(ways, edges.near)
    rises = np.append(here.lifts(m), np.zeros(2 * len(arcs.center)))
    found = []
    for cell in np.flatnonzero(np.sum(there, axis=1) > 1):
        seen = np.flatnonzero(there[cell])
        seen = seen[np.argsort(r[cell, seen])]
        far = r[cell, seen]
        apart = np.append(True, np.diff(far) > edges.near)  # edges that share their line are one
        seen, far = seen[apart], far[apart]
        once, twice = _integrals(start, end, arcs, *angles[cell : cell + 2])
        parts = once, twice, -rises * once
        weight, turn, lift = (here.slope * -np.diff(a[seen], axis=0) for a in parts)
        n = len(weight)
        u = np.tile(ways[cell] @ here.frame, (n, 1))
        middle = 2.0 / (1.0 / far[:-1] + 1.0 / far[1:])  # by the nearer edge, however far the other
        ends, lines = np.tile(angles[cell : cell + 2], (n, 1)), np.stack([seen[:-1], seen[1:]], -1)
        strip = Strips(np.full(n, row), u, middle, weight, turn @ here.frame, lift, ends, lines)
        found.append(strip)
    return found


def _ways(angle) -> Float[np.ndarray, "*k 2"]:
    return np.stack([np.cos(angle), np.sin(angle)], -1)


def _distances(q) -> np.ndarray:
    """Distances by their inverses; -1 for what is not met."""
    met = q > 0.0
    return np.where(met, 1.0 / np.where(met, q, 1.0), -1.0)


def _integrals(start, end, arcs: Arcs, low, high) -> tuple[np.ndarray, np.ndarray]:
    """Integrals of `sin(omega) / r` [1/m], and of `sin(omega) u / r^2` [1/m^2].

    Between two angles, over all lines and arcs.
    """
    areas = np.diff(_sine_integral(np.array([low, high])), axis=0)[0]
    x, weights = NODES
    turn = 0.5 * np.pi * x  # 1 / r of an arc ends like a root
    omega = 0.5 * (low + high) + 0.5 * (high - low) * np.sin(turn)
    weights = 0.25 * np.pi * (high - low) * np.cos(turn) * np.sin(omega) * weights
    straight, ways = _inverse_distances(start, end), _ways(omega)
    curved = np.nan_to_num(arcs.inverse_distances(ways))
    squares = np.concatenate([ways @ straight.T, curved], axis=1) ** 2
    return np.concatenate([straight @ areas, weights @ curved]), squares.T @ (
        weights[:, None] * ways
    )


# --- what is in the plane ------------------------------------------------------------------------


class InPlane(NamedTuple):
    """Lines and arcs in a plane through a receiver.

    Attributes:
        frame: unit vectors of the plane, level and upwards.
        slope: cosine of the latter to the receiver's normal.
        height: of vertices above the plane [m].
        flat: their coordinates from the receiver [m].
        on: which vertices lie in the plane.
        inside: numbers of edges that do.
        walls: that touch it.
        outwards: unit normals of the plane, out of those walls.
        arcs: discs and rims.
        start, end: of the edges, and of the lines of walls after them [m].
    """

    frame: Float[np.ndarray, "2 3"]
    slope: float
    height: Float[np.ndarray, " v"]
    flat: Float[np.ndarray, "v 2"]
    on: Bool[np.ndarray, " v"]
    inside: Int[np.ndarray, " e"]
    walls: Rounds
    outwards: Float[np.ndarray, "k 3"]
    arcs: Arcs
    start: Float[np.ndarray, "m 2"]
    end: Float[np.ndarray, "m 2"]

    def distances(self, ways, near: float) -> tuple[np.ndarray, np.ndarray]:
        """How far along directions lines and arcs are met [m], and which are."""
        r, share = _meeting_flat(ways[:, None], self.start, self.end)
        r = np.concatenate([r, _distances(self.arcs.inverse_distances(ways))], axis=1)
        there = r > near
        there[:, : len(self.start)] &= (share > 0.0) & (share < 1.0)
        return r, there

    def lifts(self, m) -> Float[np.ndarray, " l"]:
        """By how much lines seem higher, `b s^2 x^2 / 2` on `m`, to an eye at `x s` above [1/m].

        Edges by nothing. A wall is touched farther on, by an eye above the plane and by one below:
        `b = rho / D^2` out of it, with the radius of curvature rho, at the distance D of the line.
        """
        straight = len(self.inside)
        inverse = _inverse_distances(self.start[straight:], self.end[straight:])
        bends = (
            (self.outwards @ m) * radius_of_wall(self.walls, self.outwards) * dot(inverse, inverse)
        )
        return np.append(np.zeros(straight), bends)

    def tangents(self, point, place, number) -> Float[np.ndarray, "n 3"]:
        """Vectors along lines or arcs at points of theirs, by numbers as in `distances`."""
        way, arc = np.zeros((len(number), 2)), number >= len(self.start)
        way[~arc] = (self.end - self.start)[number[~arc]]
        k = (number[arc] - len(self.start)) % len(self.arcs.center)
        off = (point[arc] - place) @ self.frame.T - self.arcs.center[k]
        slope = np.einsum("nij,nj->ni", self.arcs.inverse[k], off)
        way[arc] = np.stack([-slope[:, 1], slope[:, 0]], -1)
        return way @ self.frame


def in_plane(edges: Edges, rounds: Rounds, at: Receiver, place, m) -> InPlane:
    """Outlines that lie in the plane through a place with a unit normal."""
    up = np.asarray(at.normal) - (np.asarray(at.normal) @ m) * m
    slope = float(np.linalg.norm(up))
    frame = np.stack([np.cross(m, up / slope), up / slope])
    height = (edges.vertices - place) @ m
    flat = (edges.vertices - place) @ frame.T
    on = np.abs(height) <= edges.near
    inside = np.flatnonzero(np.all(on[edges.ends], axis=1))
    walls = rounds.take(touching_walls(rounds, place, m, edges.near))
    outwards = -np.sign((walls.center - place) @ m)[:, None] * m
    first, way = line_of_wall(walls, outwards)
    lines = (np.stack([first, first + way]) - place) @ frame.T
    start, end = np.concatenate([flat[edges.ends[inside].T], lines], axis=1)
    arcs = _arcs_in(rounds, place, m, frame, edges.near)
    return InPlane(frame, slope, height, flat, on, inside, walls, outwards, arcs, start, end)


class Arcs(NamedTuple):
    """Discs and rims of a plane, `(x - c) M (x - c) = 1` for an eye at the origin.

    Attributes:
        center: c [m].
        inverse: M [1/m^2].
    """

    center: Float[np.ndarray, "k 2"]
    inverse: Float[np.ndarray, "k 2 2"]

    def inverse_distances(self, u) -> Float[np.ndarray, "n m"]:
        """1 / r along directions, shape (n, 2), to the nearer halves and to the farther ones.

        Not finite where there are none.
        """
        toward = np.einsum("kij,kj->ki", self.inverse, self.center)
        a, b = np.einsum("ni,kij,nj->nk", u, self.inverse, u), u @ toward.T
        e = dot(self.center, toward) - 1.0
        with np.errstate(invalid="ignore", divide="ignore"):
            root = np.sqrt(b * b - a * e)
            return np.concatenate([(b + root) / e, (b - root) / e], axis=1)

    def tangents(self) -> np.ndarray:
        """Angles at which they begin and end; not finite for an eye within."""
        toward = np.einsum("kij,kj->ki", self.inverse, self.center)
        e = dot(self.center, toward) - 1.0
        G = toward[:, :, None] * toward[:, None] - e[:, None, None] * self.inverse
        return _angles(null_directions(G))


def _arcs_in(rounds: Rounds, place, m, frame, near) -> Arcs:
    """Discs and rims that lie in a plane."""
    heights = np.abs((rounds.center - place) @ m) + np.sum(np.abs(m @ rounds.axes[..., :2]), -1)
    one = rounds.take((rounds.kind == FLAT) & (heights <= near))
    axes = frame @ one.axes[..., :2]
    spread = axes @ np.swapaxes(axes, -1, -2)
    return Arcs((one.center - place) @ frame.T, np.linalg.inv(spread))


def touching_walls(rounds: Rounds, place, m, near) -> Bool[np.ndarray, " b"]:
    """Which bodies are walls that touch a plane along a line."""
    height, level = (rounds.center - place) @ m, np.abs(rounds.axes[..., 2] @ m) <= near
    reach = np.sqrt(np.maximum(form(across(rounds), m), 0.0))
    return (rounds.kind == WALL) & level & (np.abs(np.abs(height) - reach) <= near)


def _piercing(edges: Edges, flat, height, on) -> Float[np.ndarray, "k 2"]:
    """Where edges cross the plane."""
    a, b = edges.ends.T
    pierce = (height[a] * height[b] < 0.0) & ~(on[a] | on[b])
    a, b = a[pierce], b[pierce]
    share = (height[a] / (height[a] - height[b]))[:, None]
    return flat[a] + share * (flat[b] - flat[a])


def _null_angles(rounds: Rounds, place, frame) -> np.ndarray:
    """Angles at which a plane crosses outlines of round bodies."""
    return _angles(null_directions(plane_form(rounds, place, frame)))


def _angles(ways) -> np.ndarray:
    """Angles of lines, above the horizon."""
    return (np.arctan2(ways[..., 1], ways[..., 0]) % np.pi).ravel()


def _inverse_distances(start, end) -> Float[np.ndarray, "n 2"]:
    """Vectors q with `1 / r = q . u` along the lines through pairs of points of the plane."""
    way = end - start
    normal = np.stack([way[:, 1], -way[:, 0]], -1)
    offset = dot(normal, start)
    safe = np.where(offset == 0.0, 1.0, offset)  # a line through the eye: no direction meets it
    return np.where(offset == 0.0, 0.0, 1.0 / safe)[:, None] * normal


def _meeting_flat(u, start, end) -> tuple[np.ndarray, np.ndarray]:
    """`meeting`, in the plane."""

    def lifted(a):
        return np.concatenate([a, np.zeros((*a.shape[:-1], 1))], -1)

    u, start, end = lifted(u), lifted(start), lifted(end)
    return meeting(np.zeros(3), u, start, end - start)


def _break_angles(points, *others) -> Float[np.ndarray, " k"]:
    """Angles above the horizon at which something begins or ends in the plane, in order."""
    points = points[points[:, 1] > 0.0]
    angles = np.concatenate([np.arctan2(points[:, 1], points[:, 0]), *others])
    return np.unique(np.concatenate([[0.0, np.pi], angles[np.isfinite(angles)]]))


def _sine_integral(omega) -> Float[np.ndarray, "k 2"]:
    """Antiderivative of `sin(omega) (cos(omega), sin(omega))`."""
    sine, cosine = np.sin(omega), np.cos(omega)
    return 0.5 * np.stack([sine * sine, omega - sine * cosine], -1)


def plane_slopes(
    scene: Scene, at: Receiver, edges: Edges, places, normals, found: Strips
) -> Float[np.ndarray, " n"]:
    """Jumps of E' for steps along the normals of planes, each of one metre a unit [W/m^3].

    Args:
        scene: of one band.
        at: gives the normal and the shape on which receivers lie.
        edges: of the scene.
        places: of a receiver on each plane [m].
        normals: of the planes.
        found: their strips.
    """
    shown = found.weight * strip_sums(scene, at, edges, places, normals, found)
    return sums(found.row, shown, len(places))


def strengths(found: Strips, slopes) -> Float[np.ndarray, " n"]:
    """Jumps by plane over the weight of their strips, in any unit of length [W/(m^2 sr)]."""
    weight = sums(found.row, found.weight, len(slopes))
    return slopes / np.where(weight > 0.0, weight, 1.0)


def strip_sums(
    scene: Scene, at: Receiver, edges: Edges, places, normals, found: Strips
) -> Float[np.ndarray, " k"]:
    """Alternating sums of radiance in strips, by rays down and up through them, over and under."""
    step = steps(at, found.r)[0][:, None]
    place = places[found.row]
    aside = step * unit(tangential(at, normals))[found.row]
    far = found.r[:, None] * found.u
    over, under = place + aside, place - aside
    origins = np.stack([over, under, over, under])
    # None runs along the plane: computed twice by a compiler, it may rise once and fall once.
    L = light(scene, at, origins, far + np.stack([-aside, aside, aside, -aside]))
    return L[0] + L[1] - L[2] - L[3]


def sums(row, parts, count: int) -> Float[np.ndarray, " n"]:
    """Sums of parts by the row that they belong to."""
    total = np.zeros(count)
    np.add.at(total, row, parts)
    return total
