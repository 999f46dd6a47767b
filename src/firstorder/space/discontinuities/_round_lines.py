"""Lines of sight that pass outlines of round bodies, from receivers on a line.

Outlines are numbered: edges first, round bodies after them. All conditions are polynomials of the
place along the line, and of that along an edge: roots are all found.
"""

from __future__ import annotations

import itertools

import numpy as np
from jaxtyping import Float

from firstorder.space.discontinuities._edges import Edges, dot, unit
from firstorder.space.discontinuities._lines_of_sight import (
    ThreeEdges,
    VertexEdges,
    apart_above,
    meeting,
    no_triples,
    quadratic_roots,
    taken,
)
from firstorder.space.discontinuities._rounds import (
    ANGLES,
    BALL,
    FLAT,
    OFF,
    Rounds,
    along_outline,
    between,
    frame_across,
    is_on,
    outline_at,
    outside,
)
from firstorder.space.receiver import Receiver

PLACES = 128  # along a line, at which three round outlines are looked for
NODES = np.array([0.0, 0.5, 1.0])
PARABOLA = np.array([[1.0, 0.0, 0.0], [-3.0, 4.0, -1.0], [2.0, -4.0, 2.0]])  # from values there


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


def vertices_off_discs(edges: Edges, rounds: Rounds) -> tuple[np.ndarray, np.ndarray]:
    """Numbers of vertices and of bodies: a vertex sees a disc of its own plane as a line."""
    off = (edges.vertices[:, None] - rounds.center)[..., None]
    height = np.linalg.solve(rounds.axes, off)[..., 2, 0] * np.linalg.norm(
        rounds.axes[..., 2], axis=-1
    )
    vertex, body = np.nonzero((rounds.kind != FLAT) | (np.abs(height) > edges.near))
    return vertex, body


def vertex_rounds_along(edges: Edges, rounds: Rounds, at: Receiver, along, reach):
    """Places on a line of receivers that see a vertex on an outline, and how far along."""
    vertex, body = vertices_off_discs(edges, rounds)
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
    on[curved] = is_on(one, eye, way) & outline.there
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
    k = len(edges.ends)
    first, second = np.nonzero(np.triu(rounds.shape[:, None] != rounds.shape, 1))
    edge, pair = (a.ravel() for a in np.indices((k, len(first))))
    return np.stack([edge, k + first[pair], k + second[pair]], -1)


def round_triples_along(edges: Edges, rounds: Rounds, at: Receiver, along, reach):
    """Places on a line of receivers that see an edge and two outlines in line, and how far along.

    A line from the place t through the point s of the edge meets another edge, or touches a body,
    where a polynomial of second degree in t and in s is zero.
    """
    triples = edge_triples_with_bodies(edges, rounds), edges_with_two_bodies(edges, rounds)
    found = []
    for triple in np.concatenate(triples):
        edge, *others = triple
        conditions = [_condition(edges, rounds, at, along * reach, edge, i) for i in others]
        t, s = _common_roots(*conditions)
        place = np.asarray(at.position) + t[:, None] * reach * along
        point = edges.start[edge] + s[:, None] * edges.along[edge]
        found.append((t, place, unit(point - place), np.broadcast_to(triple, (len(t), 3))))
    return _that_are_there(edges, rounds, at, reach, found)


def _that_are_there(edges: Edges, rounds: Rounds, at: Receiver, reach, found):
    """How far along those lines of sight are that pass all of their outlines, and a table of them.

    Of each triple `found` has shares of the receivers' line, places, directions and numbers.
    """
    if not found:
        return np.zeros(0), no_triples()
    t, place, u, numbers = (np.concatenate(a) for a in zip(*found, strict=True))
    rows, there = triples_at(edges, rounds, at, place, u, numbers)
    return reach * t[there], taken(rows, there)


def triples_at(
    edges: Edges, rounds: Rounds, at: Receiver, place, u, numbers
) -> tuple[ThreeEdges, np.ndarray]:
    """Lines of sight from places along directions, and which pass all of three outlines."""
    parts = [seen(edges, rounds, place, u, numbers[:, i]) for i in range(3)]
    start, along, r, on = (np.stack(a, axis=1) for a in zip(*parts, strict=True))
    # Where two of them touch, or are parallel, there is another event.
    m = unit(np.cross(start - place[:, None], along))
    cross = np.all(np.linalg.norm(np.cross(m, np.roll(m, 1, axis=1)), axis=-1) > OFF, axis=1)
    there = np.all(on, axis=1) & cross & apart_above(edges, at, u, r)
    return ThreeEdges(place, start, along, u, r), there


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
    if np.max(np.abs(f[1:])) <= 1e-12:
        f, g = g, f
    if np.max(np.abs(g[1:])) <= 1e-12:  # it tells s alone, as of an edge along the line
        s = _between_0_and_1(np.polynomial.Polynomial(g[0]).trim(1e-14).roots())
        t, row = quadratic_roots(NODES[:, None] ** [0, 1, 2] @ (f @ s ** [[0], [1], [2]]))
        on = (t > 0.0) & (t < 1.0)
        return t[on], s[row[on]]
    f, g = ([np.polynomial.Polynomial(row) for row in a] for a in (f, g))

    def minor(i, j):
        return f[i] * g[j] - f[j] * g[i]

    resultant = minor(0, 2) ** 2 - minor(0, 1) * minor(1, 2)
    s = resultant.trim(1e-14 * np.max(np.abs(resultant.coef))).roots()
    s = _between_0_and_1(s)
    with np.errstate(divide="ignore", invalid="ignore"):
        t = -minor(0, 2)(s) / minor(1, 2)(s)
    on = (t > 0.0) & (t < 1.0)
    return t[on], s[on]


def _between_0_and_1(s) -> np.ndarray:
    """Real roots between 0 and 1, of a double one both."""
    return s.real[(np.abs(s.imag) < 1e-6) & (s.real > 0.0) & (s.real < 1.0)]


# --- three round outlines ------------------------------------------------------------------------


def three_rounds_along(edges: Edges, rounds: Rounds, at: Receiver, along, reach):
    """Places on a line of receivers that see three round outlines cross, and how far along.

    Those of two bodies are zero on the outline of the third, by the place and by an angle about it.
    They are looked for on a grid.
    """
    found, count = [], len(edges.ends)
    for triple in three_bodies(edges, rounds):
        first, *others = (rounds.take(i) for i in triple - count)
        axis = _axis(first, np.asarray(at.position) + np.array([[0.0], [1.0]]) * along * reach)

        def places_ways(t, angle, first=first, axis=axis):
            place = np.asarray(at.position) + t[..., None] * reach * along
            return place, along_outline(first, axis, place, angle)

        def both(t, angle, others=others, places_ways=places_ways):
            place, way = places_ways(t, angle)
            return np.stack([outside(other, place, way) for other in others])

        t, angle = _common_zeros(both)
        place, u = places_ways(t, angle)
        found.append((t, place, u, np.broadcast_to(triple, (len(t), 3))))
    return _that_are_there(edges, rounds, at, reach, found)


def three_bodies(edges: Edges, rounds: Rounds) -> np.ndarray:
    """Numbers of the outlines of three bodies, ellipsoids last: others' are points of theirs."""
    order = np.argsort(rounds.kind == BALL, kind="stable")
    found = np.array(list(itertools.combinations(order, 3)), int).reshape(-1, 3)
    a, b, c = rounds.shape[found].T
    return len(edges.ends) + found[(a != b) & (b != c) & (c != a)]


def _axis(body: Rounds, ends: Float[np.ndarray, "2 3"]) -> Float[np.ndarray, "3"]:
    """From which angles about an outline are counted all the way between two places."""
    normals = between(body, ends)
    axis = np.cross(*unit(normals))  # at right angles to what is between them as well
    return frame_across(normals[0])[0] if np.linalg.norm(axis) < OFF else axis


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
    steps = h * np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])[..., None]  # none, and one of each
    with np.errstate(invalid="ignore", divide="ignore", over="ignore"):
        for _ in range(20):
            value, *beside = np.moveaxis(both(t + steps[0], angle + steps[1]), 1, 0)
            J = np.stack([each - value for each in beside], -1) / h
            det = J[0, :, 0] * J[1, :, 1] - J[0, :, 1] * J[1, :, 0]
            t = t - (value[0] * J[1, :, 1] - value[1] * J[0, :, 1]) / det
            angle = angle - (value[1] * J[0, :, 0] - value[0] * J[1, :, 0]) / det
    good = (t > 0.0) & (t < 1.0) & np.isfinite(angle)
    found = np.stack([t[good], angle[good] % (2.0 * np.pi)], -1)
    apart = np.abs(found[:, None] - found)
    apart[..., 1] = np.minimum(apart[..., 1], 2.0 * np.pi - apart[..., 1])
    first = ~np.any(np.tril(np.all(apart < 1e-7, axis=-1), -1), axis=1)
    return found[first, 0], found[first, 1]
