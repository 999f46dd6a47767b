"""The geometry of drawings: lines, Béziers and conics, mapped, turned round, and made into shapes.

Lines and circular arcs stay what they are. Béziers and arcs of ellipses become chords, so many that
none is further from the curve than the tolerance: a curve run in n equal steps of its parameter is
left by at most `max |c''| / (8 n^2)`.
"""

from __future__ import annotations

import abc
import dataclasses
import math
from typing import Any, TypeAlias

import numpy as np

Point: TypeAlias = np.ndarray
# How a rounded number may differ from one that is meant to be the same.
_ALIKE = 1e-9
_MOST_CHORDS = 10_000


class Piece(abc.ABC):
    """A piece of a path."""

    @abc.abstractmethod
    def mapped(self, A: np.ndarray, b: Point) -> Piece:
        """The piece after `p -> A p + b`."""

    @abc.abstractmethod
    def turned(self) -> Piece:
        """Piece with its direction reversed."""

    @abc.abstractmethod
    def points(self, chords: int) -> np.ndarray:
        """Points (chords + 1, 2) at equal steps of the parameter, both ends included."""

    @property
    @abc.abstractmethod
    def bend(self) -> float:
        """Bound of `|c''|` for a parameter in [0, 1]."""

    def within(self, tolerance: float) -> np.ndarray:
        """Points whose chords are nowhere further away than the tolerance.

        Raises:
            ValueError: if that takes too many.
        """
        needed = math.sqrt(self.bend / (8.0 * tolerance))
        if not needed <= _MOST_CHORDS:
            raise ValueError(
                f"the tolerance {tolerance:g} asks for more than {_MOST_CHORDS} chords."
            )
        return self.points(max(1, math.ceil(needed)))


@dataclasses.dataclass(frozen=True)
class Bezier(Piece):
    """A Bézier curve through its first and last of k control points; two of them make a line."""

    control: np.ndarray

    def mapped(self, A, b):
        """Curve with its control points mapped."""
        return Bezier(self.control @ A.T + b)

    def turned(self):
        """Curve with its control points in the other order."""
        return Bezier(self.control[::-1])

    def points(self, chords):
        """Points by the Bernstein polynomials; the ends to the bit."""
        n = len(self.control) - 1
        t = np.linspace(0.0, 1.0, chords + 1)[:, None]
        found = sum(
            math.comb(n, k) * t**k * (1.0 - t) ** (n - k) * c for k, c in enumerate(self.control)
        )
        return np.concatenate([self.control[:1], np.asarray(found)[1:-1], self.control[-1:]])

    @property
    def bend(self):
        """Bound of the second derivative: a Bézier curve within the hull of its control points."""
        n = len(self.control) - 1
        if n < 2:
            return 0.0
        second = n * (n - 1) * np.diff(self.control, 2, axis=0)
        return float(np.max(np.hypot(*second.T)))


@dataclasses.dataclass(frozen=True)
class Conic(Piece):
    """A piece of an ellipse, `center + u cos t + v sin t` for t from `start` by `sweep`."""

    center: Point
    u: Point
    v: Point
    start: float
    sweep: float

    def mapped(self, A, b):
        """Conic with its conjugate half-diameters mapped."""
        return Conic(A @ self.center + b, A @ self.u, A @ self.v, self.start, self.sweep)

    def turned(self):
        """Conic from its end to its start."""
        return Conic(self.center, self.u, self.v, self.start + self.sweep, -self.sweep)

    def points(self, chords):
        """Points at equal steps of t."""
        t = self.start + np.linspace(0.0, 1.0, chords + 1)[:, None] * self.sweep
        return self.center + self.u * np.cos(t) + self.v * np.sin(t)

    @property
    def bend(self):
        """`sweep^2` times a bound of the largest half-axis."""
        return float(self.sweep**2 * np.hypot(np.hypot(*self.u), np.hypot(*self.v)))

    @property
    def axes(self) -> tuple[Point, float]:
        """Half-axes, the longer first, and the angle of the longer from +x."""
        U, semi, _ = np.linalg.svd(np.stack([self.u, self.v], -1))
        return semi, math.atan2(U[1, 0], U[0, 0])

    @property
    def is_round(self) -> bool:
        """Whether the conic is a piece of a circle."""
        semi, _ = self.axes
        return bool(semi[0] - semi[1] <= _ALIKE * semi[0])

    @property
    def is_whole(self) -> bool:
        """Whether the conic goes once around."""
        return abs(abs(self.sweep) - 2.0 * math.pi) <= _ALIKE

    @property
    def turn(self) -> float:
        """Sweep as seen: positive if counter-clockwise."""
        return math.copysign(1.0, self.u[0] * self.v[1] - self.u[1] * self.v[0]) * self.sweep


@dataclasses.dataclass(frozen=True)
class Subpath:
    """Pieces from end to start, closed or not."""

    pieces: tuple[Piece, ...]
    closed: bool

    def mapped(self, A: np.ndarray, b: Point) -> Subpath:
        """The subpath after `p -> A p + b`."""
        return Subpath(tuple(piece.mapped(A, b) for piece in self.pieces), self.closed)

    def turned(self) -> Subpath:
        """Subpath with its direction reversed."""
        return Subpath(tuple(piece.turned() for piece in reversed(self.pieces)), self.closed)

    def shut(self) -> Subpath:
        """Subpath closed by a line back to where it began."""
        first, last = self.pieces[0].points(1)[0], self.pieces[-1].points(1)[-1]
        return Subpath((*self.pieces, Bezier(np.stack([last, first]))), True)

    @property
    def area(self) -> float:
        """Signed area: positive if it is travelled counter-clockwise."""
        p = np.concatenate([piece.points(16)[:-1] for piece in self.pieces])
        q = np.roll(p, -1, axis=0)
        middle = p.mean(0)
        (x, y), (a, b) = (p - middle).T, (q - middle).T
        return float(0.5 * np.sum(x * b - y * a))


def shapes(path: Subpath, tolerance: float) -> list[tuple[str, dict[str, Any]]]:
    """A subpath as shapes of flatland: kinds and geometry, in the order of travel.

    Chords of no length are left out.

    Raises:
        ValueError: if a curve takes too many chords.
    """
    found: list[tuple[str, dict[str, Any]]] = []
    chords: list[np.ndarray] = []

    def finish() -> None:
        if chords:
            ends = np.concatenate(chords)
            found.append(("segment", {"start": ends[:, 0], "end": ends[:, 1]}))
            chords.clear()

    for piece in path.pieces:
        if isinstance(piece, Conic) and (round_one := _round(piece)) is not None:
            finish()
            found.append(round_one)
            continue
        p = piece.within(tolerance)
        long = np.any(p[:-1] != p[1:], axis=1)
        if long.any():
            chords.append(np.stack([p[:-1], p[1:]], 1)[long])
    finish()
    return found


def _round(piece: Conic) -> tuple[str, dict[str, Any]] | None:
    """A circle, an arc or an ellipse without loss; None for what has to be chords."""
    semi, angle = piece.axes
    if semi[1] <= 0.0:
        return None
    outward = piece.turn < 0.0
    if piece.is_whole and outward:
        if piece.is_round:
            return "circle", {"center": [piece.center], "radius": [semi[0]]}
        return "ellipse", {"center": [piece.center], "semi": [semi], "tilt": [angle]}
    if piece.is_round:
        first = piece.points(1)[0] - piece.center
        return "arc", {
            "center": [piece.center],
            "radius": [semi[0]],
            "start": [math.atan2(-first[0], first[1])],
            "sweep": [piece.turn],
        }
    if piece.is_whole:  # an ellipse with its normals inward is a curve of one harmonic
        sign = math.copysign(1.0, piece.sweep)
        cosines = np.stack([piece.center, piece.points(1)[0] - piece.center])
        quarter = piece.start + 0.5 * math.pi * sign
        up = piece.u * math.cos(quarter) + piece.v * math.sin(quarter)
        return "curve", {"cosines": [cosines], "sines": [np.stack([0.0 * up, up])]}
    return None
