"""Curves on a plane of receivers on which three outlines cross, at least two of them round."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float, Int

from firstorder.space.discontinuities._curves import Curves, crossing
from firstorder.space.discontinuities._edges import Edges, dot, unit
from firstorder.space.discontinuities._followed import Sights, Square, arrived, followed
from firstorder.space.discontinuities._lines_of_sight import ThreeEdges, merged, taken
from firstorder.space.discontinuities._round_lines import (
    edges_with_two_bodies,
    three_bodies,
    triples_at,
)
from firstorder.space.discontinuities._rounds import (
    WALL,
    Rounds,
    along_outline,
    between,
    form,
    frame_across,
    outside,
)
from firstorder.space.receiver import Receiver
from firstorder.space.scene import Scene

PLACES = 32  # along either side of the square, at which curves are looked for
PARTS = 64  # of an outline, between which another one may cross it
NEAR = 3.0 / PLACES  # from where a curve is looked for to where it is, over half of the square


def triple_curves(
    scene: Scene, edges: Edges, rounds: Rounds, at: Receiver, reach: float, points: int
) -> Curves:
    """Curves on which an edge and two round outlines cross, or three round outlines."""
    square = Square(edges, rounds, at, reach)
    triples = np.concatenate([edges_with_two_bodies(edges, rounds), three_bodies(edges, rounds)])
    triples = triples[np.all(_above(square)[triples], axis=1)]
    lines = _lines(square, [_seeds(square, triple) for triple in triples])
    pieces = [piece for line in lines for piece in _pieces(square, line, points)]
    if not pieces:
        return Curves("three edges", np.zeros((0, points, 3)), np.zeros((0, points)))
    sights, _, on = arrived(square, merged(pieces))
    rows, there = _passing(square, sights)
    there &= on
    places, there_ = square.places(sights.flat), there.reshape(-1, points)
    return crossing(scene, edges, at, places.reshape(-1, points, 3), there_, taken(rows, there))


def _passing(square: Square, sights: Sights) -> tuple[ThreeEdges, np.ndarray]:
    """Lines of sight as rows, and which of them pass all of three outlines in the square."""
    given = square.edges, square.rounds, square.at, square.places(sights.flat)
    rows, on = triples_at(*given, sights.u, sights.numbers)
    return rows, on & square.within(sights)


# --- where curves are looked for -----------------------------------------------------------------


def _above(square: Square) -> np.ndarray:
    """Which outlines, by their numbers, have a part above the plane of the receivers."""
    edges, rounds, up = square.edges, square.rounds, np.asarray(square.at.normal)
    foot = np.asarray(square.at.position) @ up
    tops = np.max((edges.vertices @ up)[edges.ends], axis=1, initial=-np.inf)
    bodies = rounds.center @ up + np.sqrt(np.maximum(form(rounds.spread, up), 0.0))
    return np.concatenate([tops, np.where(rounds.kind == WALL, np.inf, bodies)]) > foot + edges.near


def _seeds(square: Square, triple: Int[np.ndarray, "3"]) -> Sights:
    """Lines of sight that pass all of three outlines.

    From a grid of places: where, along one of the outlines, it crosses the next.
    """
    share = (np.arange(PLACES) + 0.5) / PLACES * 2.0 - 1.0
    flat = np.stack(np.meshgrid(share, share), -1).reshape(-1, 2)
    found = [(np.zeros((0, 2)), np.zeros((0, 3)))]
    for one, other in zip(triple, np.roll(triple, -1), strict=True):
        place = square.places(flat)[:, None]
        ways = _along(square, one, place)
        value = _beside(square, other, place, ways)
        row, part = np.nonzero(value[:, 1:] * value[:, :-1] < 0.0)
        low, high = (np.abs(value[row, part + k])[:, None] for k in (0, 1))
        u = unit(high * ways[row, part] + low * ways[row, part + 1])
        found.append((flat[row], u))
    flat, u = (np.concatenate(a) for a in zip(*found, strict=True))
    start = Sights(flat, u, np.broadcast_to(triple, (len(u), 3)))
    there, _, on = arrived(square, start)
    on &= np.linalg.norm(there.flat - flat, axis=-1) < NEAR
    there = there.take(on)
    return there.take(_passing(square, there)[1])


def _along(square: Square, number, place) -> Float[np.ndarray, "n k 3"]:
    """Directions along an outline, from places."""
    edges, body = square.edges, number - len(square.edges.ends)
    share = np.linspace(0.0, 1.0, PARTS + 1)
    if body < 0:
        return unit(edges.start[number] + share[:, None] * edges.along[number] - place)
    one = square.rounds.take(body)
    axis = frame_across(between(one, place))[..., 0, :]
    return along_outline(one, axis, place, 2.0 * np.pi * share)


def _beside(square: Square, number, place, way) -> Float[np.ndarray, "n k"]:
    """Zero where directions are on an outline, and of one sign on either side of it."""
    edges, body = square.edges, number - len(square.edges.ends)
    if body >= 0:
        return outside(square.rounds.take(body), place, way)
    return dot(np.cross(edges.start[number] - place, edges.along[number]), way)


# --- from there ----------------------------------------------------------------------------------


def _lines(square: Square, seeds: list[Sights]) -> list[Sights]:
    """All curves through lines of sight, of several triples."""
    found: list[Sights] = []
    while seeds := [each for each in seeds if len(each.u)]:
        lines = followed(square, merged([each.take([0]) for each in seeds]))
        found += [line for line in lines if len(line.u) > 1]
        seeds = [each.take(_off(line, each)) for line, each in zip(lines, seeds, strict=True)]
    return found


def _off(line: Sights, seeds: Sights) -> np.ndarray:
    """Which lines of sight are not on a curve, of which the first one is."""
    a, way = line.both[:-1], np.diff(line.both, axis=0)
    length = np.linalg.norm(way, axis=-1)
    w = seeds.both[:, None] - a
    share = np.clip(dot(w, way) / np.where(length > 0.0, length, 1.0) ** 2, 0.0, 1.0)
    near = np.linalg.norm(w - share[..., None] * way, axis=-1) < 0.1 * length
    off = ~np.any(near, axis=1)
    off[0] = False
    return off


def _pieces(square: Square, line: Sights, points: int) -> list[Sights]:
    """Parts of a curve along which lines of sight pass all three outlines, with so many points."""
    _, there = _passing(square, line)
    ends = np.flatnonzero(np.diff(np.concatenate([[False], there, [False]])))
    length = np.append(0.0, np.cumsum(np.linalg.norm(np.diff(line.both, axis=0), axis=-1)))
    found = []
    for first, last in zip(ends[::2], ends[1::2], strict=True):
        low, high = length[max(first - 1, 0)], length[min(last, len(length) - 1)]
        s = np.linspace(low, high, points)
        z = np.stack([np.interp(s, length, column) for column in line.both.T], -1)
        numbers = np.broadcast_to(line.numbers[0], (points, 3))
        found.append(Sights(z[:, :2], unit(z[:, 2:]), numbers))
    return found
