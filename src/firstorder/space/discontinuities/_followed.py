"""Curves on a plane of receivers on which three outlines cross, followed from place to place.

A line of sight u from the place x passes all three outlines where `F_i(x, u) = 0`: three conditions
on two coordinates of the place and two of the direction, which leave a curve. It is smooth even
where two of the outlines touch on the third. Newton's method leads to it by the shortest way, and
back to it after each step along its tangent.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from jaxtyping import Float, Int

from firstorder.space.discontinuities._edges import Edges, dot, unit
from firstorder.space.discontinuities._rounds import (
    Rounds,
    half_slope,
    outside,
    slope_by_place,
)
from firstorder.space.receiver import Receiver

LONGEST, SHORTEST = 1 / 32, 1e-6  # steps, in halves of the square and in radians
TURN = 0.15  # of the tangent above which a step is taken again at half its length [rad]
MOST = 4096  # steps along one curve
ITERATIONS = 8  # of Newton's method
EXACT = 1e-10  # angle to outlines at which it has arrived [rad]


class Sights(NamedTuple):
    """Lines of sight near to three outlines each.

    Attributes:
        flat: coordinates of their places along the receiver's tangents, over half of the square.
        u: unit directions.
        numbers: of the outlines, edges before bodies.
    """

    flat: Float[np.ndarray, "n 2"]
    u: Float[np.ndarray, "n 3"]
    numbers: Int[np.ndarray, "n 3"]

    def take(self, which) -> Sights:
        """Some of them."""
        return Sights(*(a[which] for a in self))

    @property
    def both(self) -> Float[np.ndarray, "n 5"]:
        """Coordinates of places and directions."""
        return np.concatenate([self.flat, self.u], axis=-1)


class Square(NamedTuple):
    """Outlines of a scene, and a square of receivers.

    Attributes:
        edges, rounds: of the scene.
        at: the receiver in the middle.
        reach: from there to the sides [m].
    """

    edges: Edges
    rounds: Rounds
    at: Receiver
    reach: float

    @property
    def frame(self) -> Float[np.ndarray, "3 2"]:
        """From coordinates of places to places [m]."""
        return self.reach * np.asarray(self.at.axes)[:, :2]

    def places(self, flat) -> Float[np.ndarray, "*n 3"]:
        """Places by their coordinates [m]."""
        return np.asarray(self.at.position) + flat @ self.frame.T

    def within(self, sights: Sights) -> np.ndarray:
        """Which lines of sight start in the square, and go upwards."""
        up = sights.u @ np.asarray(self.at.normal) > 0.0
        return up & np.all(np.abs(sights.flat) <= 1.0, axis=-1)


def conditions(square: Square, sights: Sights) -> tuple[np.ndarray, np.ndarray]:
    """Angles from lines of sight to three outlines, and their derivatives.

    Returns:
        Values, shape (n, 3), and gradients, shape (n, 3, 5), by coordinates of places and of
        directions, across these.
    """
    values, slopes = zip(*(_condition(square, sights, i) for i in range(3)), strict=True)
    return np.stack(values, axis=1), np.stack(slopes, axis=1)


def _condition(square: Square, sights: Sights, i: int) -> tuple[np.ndarray, np.ndarray]:
    edges, rounds = square.edges, square.rounds
    number, u, count = sights.numbers[:, i], sights.u, len(square.edges.ends)
    place, value = square.places(sights.flat), np.zeros(len(number))
    by_place, by_way = np.zeros((2, len(number), 3))
    flat, curved = np.flatnonzero(number < count), np.flatnonzero(number >= count)
    start, along = edges.start[number[flat]], edges.along[number[flat]]
    by_way[flat] = np.cross(start - place[flat], along)
    by_place[flat] = np.cross(u[flat], along)
    value[flat] = dot(by_way[flat], u[flat])
    one = rounds.take(number[curved] - count), place[curved], u[curved]
    value[curved], by_way[curved] = outside(*one), 2.0 * half_slope(*one)
    by_place[curved] = slope_by_place(*one)
    by_way = by_way - dot(by_way, u)[:, None] * u
    with np.errstate(invalid="ignore", divide="ignore"):
        size = 1.0 / np.linalg.norm(by_way, axis=-1)
        slope = np.concatenate([by_place @ square.frame, by_way], axis=-1) * size[:, None]
        return value * size, slope


def arrived(square: Square, sights: Sights) -> tuple[Sights, np.ndarray, np.ndarray]:
    """Nearest lines of sight that pass all three outlines.

    Returns:
        The lines, the derivatives of the conditions there, and which of them have arrived.
    """
    with np.errstate(invalid="ignore", over="ignore", divide="ignore"):
        value, slope = conditions(square, sights)
        for _ in range(ITERATIONS):
            # The least step that would do for straight conditions; rows are at right angles to u.
            across = slope @ np.swapaxes(slope, -1, -2) + 1e-14 * np.eye(3)
            step = np.swapaxes(slope, -1, -2) @ np.linalg.solve(across, value[..., None])
            z = sights.both - step[..., 0]
            sights = Sights(z[:, :2], unit(z[:, 2:]), sights.numbers)
            value, slope = conditions(square, sights)
            if not np.any(np.abs(value) >= EXACT):  # what is not finite stays so
                break
    return sights, slope, np.all(np.abs(value) < EXACT, axis=1)


def _tangent(sights: Sights, slope, before=None) -> Float[np.ndarray, "n 5"]:
    """Unit tangents of curves, turned as those before, by the derivatives of the conditions."""
    length = np.concatenate([np.zeros_like(sights.flat), sights.u], axis=-1)  # that of u stays
    rows = np.concatenate([slope, length[:, None]], axis=1)
    _, _, V = np.linalg.svd(np.where(np.isfinite(rows), rows, 0.0))
    t = V[:, -1]
    return t if before is None else t * np.where(dot(t, before) < 0.0, -1.0, 1.0)[:, None]


def followed(square: Square, start: Sights) -> list[Sights]:
    """The curves through lines of sight on them, to where they leave the square, or close."""
    there, closed = _followed(square, start, 1.0)
    back, _ = _followed(square, start.take(~closed), -1.0)
    for k, rows in zip(np.flatnonzero(~closed), back, strict=True):
        there[k] = rows[:0:-1] + there[k]
    return [_sights(rows, number) for rows, number in zip(there, start.numbers, strict=True)]


def _sights(rows, numbers) -> Sights:
    z = np.array(rows)
    return Sights(z[:, :2], z[:, 2:], np.broadcast_to(numbers, (len(z), 3)))


def _followed(square: Square, start: Sights, sense: float) -> tuple[list[list], np.ndarray]:
    """Coordinates along curves in one sense, the first ones first, and which of them close."""
    found, closed = [[z] for z in start.both], np.zeros(len(start.u), bool)
    here, step = start, np.full(len(start.u), LONGEST)
    t = sense * _tangent(start, conditions(square, start)[1])
    row = np.arange(len(start.u))  # of those curves that go on
    for count in range(MOST):
        if not len(row):
            break
        z = here.both + step[:, None] * t
        there, slope, on = arrived(square, Sights(z[:, :2], unit(z[:, 2:]), here.numbers))
        ahead, way = _tangent(there, slope, t), there.both - here.both
        straight = np.minimum(dot(ahead, t), dot(unit(way), t)) > np.cos(TURN)
        on &= straight & (np.linalg.norm(way, axis=-1) < 1.5 * step)
        here = Sights(*(np.where(on[:, None], *ab) for ab in zip(there, here, strict=True)))
        t, z = np.where(on[:, None], ahead, t), here.both
        for k in np.flatnonzero(on):
            found[row[k]].append(z[k])
        home = on & (np.linalg.norm(z - start.both[row], axis=-1) < 0.9 * step) & (count > 2)
        closed[row] = home
        step = np.where(on, np.minimum(1.5 * step, LONGEST), 0.5 * step)
        go = ~home & (square.within(here) | ~on) & (step > SHORTEST)
        here, t, step, row = here.take(go), t[go], step[go], row[go]
    for k in np.flatnonzero(closed):
        found[k].append(start.both[k])
    return found, closed
