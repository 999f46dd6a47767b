"""Lines of sight in which outlines touch each other: an edge and a round body, or two of them.

A plane through the eye touches both there. Planes through an edge that touch a body stand still;
those that touch two bodies make a family, by an angle. Lines of a cylinder's wall are edges in the
planes that touch it and another body. The rims of a cylinder touch each other for an eye that looks
along its wall.
"""

from __future__ import annotations

import itertools
from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Float, Int

from firstorder.space.discontinuities._edges import Edges, dot, unit
from firstorder.space.discontinuities._lines_of_sight import (
    apart_above,
    crossed,
    meeting,
    merged,
    quadratic_roots,
    taken,
)
from firstorder.space.discontinuities._round_lines import NODES
from firstorder.space.discontinuities._rounds import (
    OFF,
    WALL,
    Rounds,
    form,
    frame_across,
    outline_at,
    touching,
    touching_planes,
)
from firstorder.space.discontinuities._walls import (
    HALVINGS,
    changes_of_sign,
    line_of_wall,
    planes_of_wall,
)
from firstorder.space.receiver import Receiver

STEPS = 500  # towards a direction that parts two bodies


class Tangents(NamedTuple):
    """Lines of sight in which two outlines touch each other.

    Attributes:
        place: of the receivers [m].
        u: directions.
        m: unit normals of the planes that touch both.
        r: distances of the two along the lines [m].
        curvature: of the first against the second, as in `Outline`, with the normal m.
        bend: the mean of their curvatures.
        fill: the area that opens between them, over that of a lens.
    """

    place: Float[np.ndarray, "n 3"]
    u: Float[np.ndarray, "n 3"]
    m: Float[np.ndarray, "n 3"]
    r: Float[np.ndarray, "n 2"]
    curvature: Float[np.ndarray, " n"]
    bend: Float[np.ndarray, " n"]
    fill: Float[np.ndarray, " n"]


def no_tangents() -> tuple[np.ndarray, Tangents]:
    """No places along a line, and a table without rows."""
    none = np.zeros(0)
    return none, Tangents(*np.zeros((3, 0, 3)), np.zeros((0, 2)), none, none, none)


class EdgeTangents(NamedTuple):
    """Planes through edges, or lines of walls, that touch round bodies.

    Attributes:
        start, along: of the edge [m].
        body: number of the body.
        normal: of the plane, a unit vector.
    """

    start: Float[np.ndarray, "n 3"]
    along: Float[np.ndarray, "n 3"]
    body: Int[np.ndarray, " n"]
    normal: Float[np.ndarray, "n 3"]


def edge_tangents(edges: Edges, rounds: Rounds) -> EdgeTangents:
    """All planes through edges, or lines of walls, that touch round bodies."""
    bodies = np.flatnonzero(rounds.kind != WALL)
    edge, body = (a.ravel() for a in np.meshgrid(np.arange(len(edges.ends)), bodies, indexing="ij"))
    normal = touching_planes(rounds.take(body), edges.start[edge], edges.along[edge])
    row, side = np.nonzero(np.all(np.isfinite(normal), axis=-1))
    edge = edge[row]
    flat = EdgeTangents(edges.start[edge], edges.along[edge], body[row], normal[row, side])
    found = [flat]
    for wall in np.flatnonzero(rounds.kind == WALL):
        for other in bodies[rounds.shape[bodies] != rounds.shape[wall]]:
            one, body = rounds.take(wall), rounds.take(other)
            normal = planes_of_wall(one, body.center, body.spread)
            ends = line_of_wall(one, normal)
            found.append(EdgeTangents(*ends, np.full(len(normal), other), normal))
    return merged(found)


def edge_tangents_at(
    edges: Edges, rounds: Rounds, at: Receiver, place, planes: EdgeTangents
) -> tuple[Tangents, np.ndarray]:
    """Lines of sight from places in planes through edges that touch bodies, and which there are."""
    one = rounds.take(planes.body)
    way = touching(one, one.center - place, planes.normal)
    u = unit(way)
    seen = outline_at(one, place, u)
    r_edge, share = meeting(place, u, planes.start, planes.along)
    r = np.stack([r_edge, np.linalg.norm(way, axis=-1)], -1)
    there = (share > 0.0) & (share < 1.0) & apart_above(edges, at, u, r)
    k = seen.curvature
    rows = Tangents(place, u, seen.m, r, -k, 0.5 * k, np.ones(len(k)))
    return rows, there & seen.there & np.isfinite(k)


def edge_tangents_along(edges: Edges, rounds: Rounds, at: Receiver, along, reach):
    """Places on a line of receivers that see an edge touch a body, and how far along."""
    planes = edge_tangents(edges, rounds)
    t = crossed(planes.normal, planes.start, at, along)
    on = (t > 0.0) & (t < reach)
    place = np.asarray(at.position) + t[on, None] * along
    rows, there = edge_tangents_at(edges, rounds, at, place, taken(planes, on))
    return t[on][there], taken(rows, there)


def body_tangents_at(
    edges: Edges, rounds: Rounds, at: Receiver, place, bodies, normal
) -> tuple[Tangents, np.ndarray]:
    """Lines of sight from places in planes that touch two bodies, and which there are."""
    pair = [rounds.take(bodies[:, i]) for i in (0, 1)]
    ways = [touching(one, one.center - place, normal) for one in pair]
    u = unit(ways[0])
    first, second = (outline_at(one, place, u) for one in pair)
    r = np.stack([np.linalg.norm(way, axis=-1) for way in ways], -1)
    there = (np.linalg.norm(unit(ways[1]) - u, axis=-1) < OFF) & first.there & second.there
    there &= apart_above(edges, at, u, r)
    k, other = first.curvature, np.sign(dot(first.m, second.m)) * second.curvature
    there &= np.abs(k - other) > 0.0
    fill = np.ones(len(k))
    return Tangents(place, u, first.m, r, k - other, 0.5 * (k + other), fill), there


def body_tangents_along(edges: Edges, rounds: Rounds, at: Receiver, along, reach):
    """Places on a line of receivers that see two bodies touch, and how far along.

    They are where it crosses the curves of `common_planes`.
    """
    found, origin = [no_tangents()], np.asarray(at.position)
    beside = np.cross(np.asarray(at.normal), along)
    for numbers, planes in common_planes(rounds):

        def off(angle, side, planes=planes):
            return dot(planes.places(at, angle, side)[0] - origin, beside)

        angle, side = changes_of_sign(off)
        place, normal = planes.places(at, angle, side)
        t = dot(place - origin, along)
        on = (np.abs(dot(place - origin, beside)) < 1e-6 * reach) & (t > 0.0) & (t < reach)
        bodies = np.broadcast_to(numbers, (np.sum(on), 2))
        rows, there = body_tangents_at(edges, rounds, at, place[on], bodies, normal[on])
        found.append((t[on][there], taken(rows, there)))
    return np.concatenate([t for t, _ in found]), merged([rows for _, rows in found])


class CommonPlanes(NamedTuple):
    """Planes that touch two bodies, by an angle about an axis that parts them.

    Attributes:
        first, second: the bodies.
        axis: a direction from the first to the second, in which the first ends before the second
            begins.
    """

    first: Rounds
    second: Rounds
    axis: Float[np.ndarray, "3"]

    def normals(self, angle, side) -> Float[np.ndarray, "*n 3"]:
        """Unit normals: of planes with both bodies on one side (1), or one on either (-1)."""
        b, c = frame_across(self.axis)
        out = np.cos(angle)[..., None] * b + np.sin(angle)[..., None] * c
        between = self.second.center - self.first.center
        ahead, aside = self.axis @ between, out @ between
        one, other = (_half_towards(body, self.axis, out) for body in (self.first, self.second))
        low, high = np.zeros(np.shape(angle)), np.full(np.shape(angle), np.pi)
        for _ in range(HALVINGS):
            middle = 0.5 * (low + high)
            cos, sin = np.cos(middle), np.sin(middle)
            apart = cos * ahead + sin * aside - one(cos, sin) + side * other(cos, sin)
            low, high = np.where(apart > 0.0, middle, low), np.where(apart > 0.0, high, middle)
        return np.cos(low)[..., None] * self.axis + np.sin(low)[..., None] * out

    def places(self, at: Receiver, angle, side) -> tuple[np.ndarray, np.ndarray]:
        """Where lines through both touching points meet the receivers' plane, and normals there."""
        n, up = self.normals(angle, side), np.asarray(at.normal)
        ends = [_support(self.first, n), _support(self.second, side[..., None] * n)]
        way = ends[1] - ends[0]
        rate = np.where(way @ up == 0.0, np.nan, way @ up)
        share = ((np.asarray(at.position) - ends[0]) @ up) / rate
        return ends[0] + share[..., None] * way, n


def common_planes(rounds: Rounds):
    """Numbers of two bodies, but walls, that do not meet, and the planes that touch both."""
    for i, j in itertools.combinations(np.flatnonzero(rounds.kind != WALL), 2):
        if rounds.shape[i] == rounds.shape[j]:
            continue
        axis = _parting(rounds.take(i), rounds.take(j))
        if axis is not None:
            yield (i, j), CommonPlanes(rounds.take(i), rounds.take(j), axis)


def _half(body: Rounds, n) -> Any:
    """How far a body reaches from its middle along unit vectors [m]."""
    return np.sqrt(np.maximum(form(body.spread, n), 0.0))


def _half_towards(body: Rounds, axis, out):
    """Half of how wide a body is along `cos * axis + sin * out`, a function of cosine and sine."""
    S = body.spread
    along, mixed, across = form(S, axis), 2.0 * form(S, axis, out), form(S, out)
    return lambda cos, sin: np.sqrt(
        np.maximum(cos * cos * along + cos * sin * mixed + sin * sin * across, 0.0)
    )


def _support(body: Rounds, n) -> np.ndarray:
    """The point of a body that is farthest along directions [m]."""
    half = np.asarray(_half(body, n))[..., None]
    return body.center + (n @ body.spread) / np.where(half > 0.0, half, 1.0)


def _parting(first: Rounds, second: Rounds) -> Float[np.ndarray, "3"] | None:
    """A direction along which one body ends before another begins, if there is one.

    The vector between them shortens towards that between their nearest points (Gilbert's method).
    """
    v = second.center - first.center
    for _ in range(STEPS):
        n = unit(v)
        gap = _support(second, -n) - _support(first, n)
        if n @ gap > 0.0:
            return n
        back = v - gap
        v = v - np.clip((v @ back) / (back @ back), 0.0, 1.0) * back
    return None


# --- walls that are seen endwise -----------------------------------------------------------------


def endwise_at(edges: Edges, rounds: Rounds, at: Receiver, place, wall):
    """Lines of sight from places on walls made longer, along them, and which there are.

    The two rims touch each other, and behind these places the farther one shows from behind the
    nearer. What opens is their hull less the nearer one, which is more than a lens.
    """
    one = rounds.take(wall)
    q = np.linalg.solve(one.axes, (place - one.center)[..., None])
    above, z, a = q[:, 2, 0] > 0.0, np.abs(q[:, 2]), one.axes[..., 2]
    u = unit(np.where(above[:, None], -a, a))
    flat = q * np.array([[1.0], [1.0], [0.0]])
    m = unit(np.linalg.solve(np.swapaxes(one.axes, -1, -2), flat)[..., 0])
    r = np.linalg.norm(a, axis=-1)[:, None] * (z + np.array([-1.0, 1.0]))
    # Of a cylinder the rim where its axis ends, that where it starts, and the wall follow.
    rims = np.where(above, wall - 2, wall - 1), np.where(above, wall - 1, wall - 2)
    near, far = (outline_at(rounds.take(rim), place, u).curvature for rim in rims)
    with np.errstate(invalid="ignore", divide="ignore"):  # from a rim that is in the floor
        fill = 0.5 * (near + far) / -np.sqrt(near * far)
    there = (z[:, 0] > 1.0) & apart_above(edges, at, u, r)
    return Tangents(place, u, m, r, near - far, 0.5 * (near + far), fill), there


def endwise_along(edges: Edges, rounds: Rounds, at: Receiver, along, reach):
    """Places on a line of receivers that see a wall endwise, and how far along."""
    walls = np.flatnonzero(rounds.kind == WALL)
    axes, off = rounds.axes[walls], np.asarray(at.position) - rounds.center[walls]
    o, d = (np.linalg.solve(axes, a)[:, :2, 0] for a in (off[..., None], along[:, None]))
    places = o + NODES[:, None, None] * reach * d
    t, row = quadratic_roots(dot(places, places) - 1.0)
    on = (t > 0.0) & (t < 1.0)
    t, row = reach * t[on], row[on]
    place = np.asarray(at.position) + t[:, None] * along
    rows, there = endwise_at(edges, rounds, at, place, walls[row])
    return t[there], taken(rows, there)
