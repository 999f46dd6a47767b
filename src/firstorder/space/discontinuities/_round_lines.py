"""Lines of sight that pass outlines of round bodies, from receivers on a line.

Outlines are numbered: edges first, round bodies after them. All conditions are polynomials of the
place along the line, and of that along an edge: roots are all found.
"""

from __future__ import annotations

import itertools
from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Float

from firstorder.space.discontinuities._edges import Edges, dot, unit
from firstorder.space.discontinuities._lines_of_sight import (
    ThreeEdges,
    VertexEdges,
    apart_above,
    crossed,
    meeting,
    merged,
    no_triples,
    quadratic_roots,
    taken,
)
from firstorder.space.discontinuities._rounds import (
    Rounds,
    around,
    between,
    form,
    frame_across,
    outline_at,
    outside,
    touching,
    touching_planes,
)
from firstorder.space.receiver import Receiver

OFF = 1e-6  # angle to an outline above which a line of sight does not touch it [rad]
ANGLES = 256  # about an axis, at which places are looked for that see two bodies touch
PLACES = 128  # along a line, at which three round outlines are looked for
HALVINGS = 60
STEPS = 500  # towards a direction that parts two bodies
NODES = np.array([0.0, 0.5, 1.0])
PARABOLA = np.array([[1.0, 0.0, 0.0], [-3.0, 4.0, -1.0], [2.0, -4.0, 2.0]])  # from values there


class Tangents(NamedTuple):
    """Lines of sight in which two outlines touch each other.

    Attributes:
        place: of the receivers [m].
        u: directions.
        m: unit normals of the planes that touch both.
        r: distances of the two along the lines [m].
        curvature: of the first against the second, as in `Outline`, with the normal m.
        bend: the mean of their curvatures.
    """

    place: Float[np.ndarray, "n 3"]
    u: Float[np.ndarray, "n 3"]
    m: Float[np.ndarray, "n 3"]
    r: Float[np.ndarray, "n 2"]
    curvature: Float[np.ndarray, " n"]
    bend: Float[np.ndarray, " n"]


# --- an edge and a round body, or two of them, that touch ----------------------------------------


def edge_tangents(edges: Edges, rounds: Rounds) -> tuple[np.ndarray, ...]:
    """Planes through edges that touch round bodies: numbers of both, and unit normals."""
    edge, body = (a.ravel() for a in np.indices((len(edges.ends), len(rounds.center))))
    normal = touching_planes(rounds.take(body), edges.start[edge], edges.along[edge])
    row, side = np.nonzero(np.all(np.isfinite(normal), axis=-1))
    return edge[row], body[row], normal[row, side]


def edge_tangents_at(
    edges: Edges, rounds: Rounds, at: Receiver, place, edge, body, normal
) -> tuple[Tangents, np.ndarray]:
    """Lines of sight from places in planes through edges that touch bodies, and which there are."""
    one = rounds.take(body)
    way = touching(one, one.center - place, normal)
    u = unit(way)
    seen = outline_at(one, place, u)
    r_edge, share = meeting(place, u, edges.start[edge], edges.along[edge])
    r = np.stack([r_edge, np.linalg.norm(way, axis=-1)], -1)
    there = (share > 0.0) & (share < 1.0) & apart_above(edges, at, u, r)
    k = seen.curvature
    return Tangents(place, u, seen.m, r, -k, 0.5 * k), there & np.isfinite(k)


def edge_tangents_along(edges: Edges, rounds: Rounds, at: Receiver, along, reach):
    """Places on a line of receivers that see an edge touch a body, and how far along."""
    edge, body, normal = edge_tangents(edges, rounds)
    t = crossed(normal, edges.start[edge], at, along)
    on = (t > 0.0) & (t < reach)
    place = np.asarray(at.position) + t[on, None] * along
    rows, there = edge_tangents_at(edges, rounds, at, place, edge[on], body[on], normal[on])
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
    there = np.linalg.norm(unit(ways[1]) - u, axis=-1) < OFF
    there &= apart_above(edges, at, u, r)
    k, other = first.curvature, np.sign(dot(first.m, second.m)) * second.curvature
    there &= np.abs(k - other) > 0.0
    return Tangents(place, u, first.m, r, k - other, 0.5 * (k + other)), there


def body_tangents_along(edges: Edges, rounds: Rounds, at: Receiver, along, reach):
    """Places on a line of receivers that see two bodies touch, and how far along.

    They are where it crosses the curves of `common_planes`.
    """
    none = np.zeros(0), Tangents(*np.zeros((3, 0, 3)), np.zeros((0, 2)), *np.zeros((2, 0)))
    found, origin = [none], np.asarray(at.position)
    beside = np.cross(np.asarray(at.normal), along)
    for numbers, planes in common_planes(rounds):

        def off(angle, side, planes=planes):
            return dot(planes.places(at, angle, side)[0] - origin, beside)

        angle, side = _crossings(off)
        place, normal = planes.places(at, angle, side)
        t = dot(place - origin, along)
        on = (np.abs(dot(place - origin, beside)) < 1e-6 * reach) & (t > 0.0) & (t < reach)
        bodies = np.broadcast_to(numbers, (np.sum(on), 2))
        rows, there = body_tangents_at(edges, rounds, at, place[on], bodies, normal[on])
        found.append((t[on][there], taken(rows, there)))
    return np.concatenate([t for t, _ in found]), merged([rows for _, rows in found])


def _crossings(off) -> tuple[np.ndarray, np.ndarray]:
    """Angles, and sides, at which a function changes its sign; or becomes infinite."""
    angle, side = np.meshgrid(np.linspace(0.0, 2.0 * np.pi, ANGLES + 1), [1.0, -1.0])
    negative = off(angle, side) < 0.0
    k, i = np.nonzero(negative[:, 1:] != negative[:, :-1])
    low, high, side = angle[k, i], angle[k, i + 1], side[k, i]
    below = negative[k, i]
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        same = (off(middle, side) < 0.0) == below
        low, high = np.where(same, middle, low), np.where(same, high, middle)
    return low, side


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
        low, high = np.zeros(np.shape(angle)), np.full(np.shape(angle), np.pi)
        for _ in range(HALVINGS):
            middle = 0.5 * (low + high)
            n = np.cos(middle)[..., None] * self.axis + np.sin(middle)[..., None] * out
            apart = n @ between - _half(self.first, n) + side * _half(self.second, n)
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
    """Numbers of two bodies that do not meet, and the planes that touch both."""
    for i, j in itertools.combinations(range(len(rounds.center)), 2):
        axis = _parting(rounds.take(i), rounds.take(j))
        if axis is not None:
            yield (i, j), CommonPlanes(rounds.take(i), rounds.take(j), axis)


def _half(body: Rounds, n) -> Any:
    """How far a body reaches from its middle along unit vectors [m]."""
    return np.sqrt(np.maximum(form(body.spread, n), 0.0))


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


# --- a vertex and a round body -------------------------------------------------------------------


def vertex_rounds_at(
    edges: Edges, rounds: Rounds, at: Receiver, place, vertex, body
) -> tuple[VertexEdges, np.ndarray]:
    """Lines of sight from places through vertices that touch bodies, and which there are."""
    way = edges.vertices[vertex] - place
    u, r = unit(way), np.linalg.norm(way, axis=-1)
    number = len(edges.ends) + body
    start, along, far, there = seen(edges, rounds, place, u, number)
    there &= apart_above(edges, at, u, np.stack([r, far], -1))
    return VertexEdges(place, vertex, number, start, along, r, far), there


def vertex_rounds_along(edges: Edges, rounds: Rounds, at: Receiver, along, reach):
    """Places on a line of receivers that see a vertex on an outline, and how far along."""
    vertex, body = (a.ravel() for a in np.indices((len(edges.vertices), len(rounds.center))))
    places = np.asarray(at.position) + NODES[:, None, None] * reach * along
    t, row = quadratic_roots(outside(rounds.take(body), places, edges.vertices[vertex] - places))
    on = (t > 0.0) & (t < 1.0)
    t, row = reach * t[on], row[on]
    place = np.asarray(at.position) + t[:, None] * along
    rows, there = vertex_rounds_at(edges, rounds, at, place, vertex[row], body[row])
    return t[there], taken(rows, there)


def seen(edges: Edges, rounds: Rounds, place, u, number) -> tuple[np.ndarray, ...]:
    """Outlines by their numbers in directions: as edges, how far away, and whether there are any.

    Args:
        edges: of the scene.
        rounds: likewise.
        place: of eyes, shape (n, 3) [m].
        u: directions.
        number: of the outline that passes there.

    Returns:
        Starts and ways of edges, which touch outlines of bodies [m]; distances [m]; and whether the
        direction is on the outline.
    """
    count = len(edges.ends)
    start, along = np.zeros((2, len(number), 3))
    r, on = np.zeros(len(number)), np.zeros(len(number), bool)
    flat, curved = np.flatnonzero(number < count), np.flatnonzero(number >= count)
    start[flat], along[flat] = edges.start[number[flat]], edges.along[number[flat]]
    r[flat], share = meeting(place[flat], u[flat], start[flat], along[flat])
    on[flat] = (share > 0.0) & (share < 1.0)
    eye, way, one = place[curved], u[curved], rounds.take(number[curved] - count)
    outline = outline_at(one, eye, way)
    start[curved], along[curved] = outline.touch, np.cross(way, outline.m)
    r[curved] = dot(outline.touch - eye, way)
    off = np.linalg.norm(np.cross(way, outline.touch - eye), axis=-1)
    on[curved] = off < OFF * r[curved]
    return start, along, r, on


# --- an edge and two outlines, one of which is round ---------------------------------------------


def edge_triples_with_bodies(edges: Edges, rounds: Rounds) -> np.ndarray:
    """Numbers of two edges in no plane and of the outline of a body."""
    first, second = np.nonzero(np.triu(~edges.coplanar, 1))
    body = len(edges.ends) + np.arange(len(rounds.center))
    pair, body = (a.ravel() for a in np.meshgrid(np.arange(len(first)), body, indexing="ij"))
    return np.stack([first[pair], second[pair], body], -1)


def edges_with_two_bodies(edges: Edges, rounds: Rounds) -> np.ndarray:
    """Numbers of an edge and of the outlines of two bodies."""
    k, b = len(edges.ends), len(rounds.center)
    first, second = np.triu_indices(b, 1)
    edge, pair = (a.ravel() for a in np.indices((k, len(first))))
    return np.stack([edge, k + first[pair], k + second[pair]], -1)


def round_triples_along(edges: Edges, rounds: Rounds, at: Receiver, along, reach):
    """Places on a line of receivers that see an edge and two outlines in line, and how far along.

    A line from the place t through the point s of the edge meets another edge, or touches a body,
    where a polynomial of second degree in t and in s is zero.
    """
    found = [(np.zeros(0), no_triples())]
    triples = edge_triples_with_bodies(edges, rounds), edges_with_two_bodies(edges, rounds)
    for triple in np.concatenate(triples):
        t, s = _common_roots(
            *(
                _condition(edges, rounds, at, along * reach, triple[0], number)
                for number in triple[1:]
            )
        )
        place = np.asarray(at.position) + t[:, None] * reach * along
        point = edges.start[triple[0]] + s[:, None] * edges.along[triple[0]]
        numbers = np.broadcast_to(triple, (len(t), 3))
        rows, there = triples_at(edges, rounds, at, place, unit(point - place), numbers)
        found.append((reach * t[there], taken(rows, there)))
    return np.concatenate([t for t, _ in found]), merged([rows for _, rows in found])


def triples_at(
    edges: Edges, rounds: Rounds, at: Receiver, place, u, numbers
) -> tuple[ThreeEdges, np.ndarray]:
    """Lines of sight from places along directions, and which pass all of three outlines."""
    parts = [seen(edges, rounds, place, u, numbers[:, i]) for i in range(3)]
    start, along, r, on = (np.stack(a, axis=1) for a in zip(*parts, strict=True))
    return ThreeEdges(place, start, along, u, r), np.all(on, axis=1) & apart_above(edges, at, u, r)


def _condition(edges: Edges, rounds: Rounds, at: Receiver, along, edge, number) -> np.ndarray:
    """Coefficients of the polynomial of an outline, for powers of t and of s, shape (3, 3)."""
    place = np.asarray(at.position) + NODES[:, None, None] * along
    way = edges.start[edge] + NODES[:, None] * edges.along[edge] - place
    other = number - len(edges.ends)
    if other >= 0:
        values = outside(rounds.take(other), place, way)
    else:
        values = dot(np.cross(way, edges.start[number] - place), edges.along[number])
    most = np.max(np.abs(values))
    found = PARABOLA @ (values / np.where(most > 0.0, most, 1.0)) @ PARABOLA.T
    if other < 0:
        found[2], found[:, 2] = 0.0, 0.0
    return found


def _common_roots(f, g) -> tuple[np.ndarray, np.ndarray]:
    """Common roots of two polynomials of second degree in t and in s, both between 0 and 1."""
    f, g = ([np.polynomial.Polynomial(row) for row in a] for a in (f, g))

    def minor(i, j):
        return f[i] * g[j] - f[j] * g[i]

    resultant = minor(0, 2) ** 2 - minor(0, 1) * minor(1, 2)
    s = resultant.trim(1e-14 * np.max(np.abs(resultant.coef))).roots()
    s = s.real[(np.abs(s.imag) < 1e-6) & (s.real > 0.0) & (s.real < 1.0)]
    with np.errstate(divide="ignore", invalid="ignore"):
        t = -minor(0, 2)(s) / minor(1, 2)(s)
    return t, s


# --- three round outlines ------------------------------------------------------------------------


def three_rounds_along(edges: Edges, rounds: Rounds, at: Receiver, along, reach):
    """Places on a line of receivers that see three round outlines cross, and how far along.

    Those of two bodies are zero on the outline of the third, by the place and by an angle about it.
    They are looked for on a grid.
    """
    found = [(np.zeros(0), no_triples())]
    for numbers in itertools.combinations(range(len(rounds.center)), 3):
        first, others = rounds.take(numbers[0]), [rounds.take(i) for i in numbers[1:]]
        ends = between(first, np.asarray(at.position) + np.array([[0.0], [reach]]) * along)
        axis = np.cross(*unit(ends))  # at right angles to what is between them as well
        axis = frame_across(ends[0])[0] if np.linalg.norm(axis) < OFF else axis

        def places_ways(t, angle, first=first, axis=axis):
            place = np.asarray(at.position) + t[..., None] * reach * along
            return place, around(first, axis, place, angle)

        def both(t, angle, others=others, places_ways=places_ways):
            place, way = places_ways(t, angle)
            return np.stack([outside(other, place, way) for other in others])

        t, angle = _common_zeros(both)
        place, u = places_ways(t, angle)
        outlines = np.broadcast_to(np.array(numbers) + len(edges.ends), (len(t), 3))
        rows, there = triples_at(edges, rounds, at, place, u, outlines)
        found.append((reach * t[there], taken(rows, there)))
    return np.concatenate([t for t, _ in found]), merged([rows for _, rows in found])


def _common_zeros(both) -> tuple[np.ndarray, np.ndarray]:
    """Where two functions of a place between 0 and 1 and of an angle are zero.

    By Newton's method from those cells of a grid in which both change their sign.
    """
    t, angle = np.meshgrid(np.linspace(0.0, 1.0, PLACES + 1), np.linspace(0, 2 * np.pi, ANGLES + 1))
    negative = both(t, angle) < 0.0
    corners = [negative[:, i : i + ANGLES, j : j + PLACES] for i in (0, 1) for j in (0, 1)]
    count = np.sum(corners, axis=0)
    cell = np.all((count > 0) & (count < 4), axis=0)
    t = t[:-1, :-1][cell] + 0.5 / PLACES
    angle = angle[:-1, :-1][cell] + np.pi / ANGLES
    h = 1e-6
    for _ in range(20):
        value = both(t, angle)
        J = np.stack([both(t + h, angle) - value, both(t, angle + h) - value], -1) / h
        det = J[0, :, 0] * J[1, :, 1] - J[0, :, 1] * J[1, :, 0]
        with np.errstate(invalid="ignore", divide="ignore"):
            t = t - (value[0] * J[1, :, 1] - value[1] * J[0, :, 1]) / det
            angle = angle - (value[1] * J[0, :, 0] - value[0] * J[1, :, 0]) / det
    good = (t > 0.0) & (t < 1.0) & np.isfinite(angle)
    found = np.stack([t[good], angle[good] % (2.0 * np.pi)], -1)
    _, first = np.unique(np.round(found, 8), axis=0, return_index=True)
    return found[first, 0], found[first, 1]


# --- what the line runs into ---------------------------------------------------------------------


def round_contacts(rounds: Rounds, at: Receiver, along, reach) -> Float[np.ndarray, " c"]:
    """How far along a line of receivers it runs into ellipsoids, or out of them."""
    solid = rounds.take(np.linalg.det(rounds.spread) > 0.0)
    if not len(solid.center):
        return np.zeros(0)
    w = np.asarray(at.position) + NODES[:, None, None] * reach * along - solid.center
    t, _ = quadratic_roots(form(np.linalg.inv(solid.spread), w) - 1.0)
    return np.unique(reach * t[(t > 0.0) & (t < 1.0)])
