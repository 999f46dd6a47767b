"""Closed curves by Fourier series: where lines cross them and where they touch.

Both questions are roots of a smooth periodic function of the parameter. A curve is cut into pieces,
once for all rays, on each of which it is a polynomial: see `firstorder.numerics._piecewise_roots`.
"""

from __future__ import annotations

import math

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float
from scipy import special

from firstorder._argument_checks import nan_unless
from firstorder._display import Module
from firstorder.flatland.shapes._base import Point
from firstorder.numerics._order import order_of
from firstorder.numerics._piecewise_roots import brackets, degree, taylor
from firstorder.numerics._planar import cross_2d, dot_2d
from firstorder.numerics._roots import bracketed_root, newton

MOST_TANGENTS = 8
# Crossings that are found to rounding, of which the nearest counts: beside a tangent there are two,
# pieces may lie side by side, and some crossings behind the start of a ray.
NEAREST = 6
PAIRS = 4  # pieces on which a line that turns there may cross twice: the nearest to it are asked


class CurveRoots(Module):
    """One curve `c(s) = sum_k cosines[k] cos(2 pi k s) + sines[k] sin(2 pi k s)`."""

    cosines: Float[Array, "*n k 2"]
    sines: Float[Array, "*n k 2"]
    samples: int = eqx.field(static=True)

    def motion(self, s: Float[Array, ""]):
        """Position, first and second derivative in s."""
        w = 2.0 * jnp.pi * jnp.arange(self.cosines.shape[-2], dtype=self.cosines.dtype)
        c, q = jnp.cos(w * s)[:, None], jnp.sin(w * s)[:, None]
        w = w[:, None]
        a, b = self.cosines, self.sines
        return (
            jnp.sum(a * c + b * q, -2),
            jnp.sum(w * (b * c - a * q), -2),
            -jnp.sum(w**2 * (a * c + b * q), -2),
        )

    def _size(self) -> Float[Array, ""]:
        """A length of the order of the curve's."""
        return jnp.sqrt(jnp.sum(self.cosines[..., 1:, :] ** 2 + self.sines[..., 1:, :] ** 2))

    def prepared(self) -> PreparedCurves:
        """The curve in pieces, on each of which it is a polynomial to rounding.

        A piece is so short that the highest harmonic turns by at most two radians on it. Pieces
        have no derivatives.
        """
        curve = jax.lax.stop_gradient(self)
        k = np.arange(1, self.cosines.shape[-2])
        pieces = self.samples * max(1, math.ceil(math.pi * k.size / self.samples))
        reach = math.pi * k / pieces  # by which harmonics turn on half a piece
        eps = float(jnp.finfo(self.cosines.dtype).eps)
        m = np.arange(degree(math.pi * k.size / pieces, eps) + 1)[:, None, None]
        turn = 2.0 * np.pi * k * (np.arange(pieces)[:, None] + 0.5) / pieces
        # a cos + b sin is the real part of (a - i b) exp(i turn), and a derivative a factor i.
        wave = np.array([1, 1j, -1, -1j])[m % 4] * reach**m / special.factorial(m)
        wave = wave * np.exp(1j * turn)
        cos, sin = (jnp.asarray(part, self.cosines.dtype) for part in (wave.real, wave.imag))
        about = cos @ curve.cosines[1:] + sin @ curve.sines[1:]
        about = jnp.moveaxis(about, -1, 0)
        by_order = jnp.moveaxis(about, 1, 0)
        starts = jnp.stack(taylor(by_order, -jnp.ones_like(by_order[0]), 3))
        extents = 2.0 * jnp.sum(jnp.sqrt(jnp.sum(by_order[1:] ** 2, 1)), 0)
        return PreparedCurves(curve.cosines[0], about, starts, extents, curve._nearest_self())

    def hit(self, pieces: PreparedCurves, origin: Point, along: Point, on: Bool[Array, ""]):
        """The nearest crossing with a ray: distance and parameter, infinity if there is none.

        Args:
            pieces: the curve, prepared.
            origin: of the ray [m].
            along: its direction.
            on: whether the origin lies on the curve.
        """
        t, s = pieces.crossing(*jax.lax.stop_gradient((origin, along)), on)
        there = jnp.isfinite(t)
        s = jnp.where(there, s, 0.0)
        across = jnp.stack([-along[1], along[0]])
        for _ in range(2):  # now with derivatives
            c, v, _ = self.motion(s)
            value, slope = jnp.dot(across, c - origin), jnp.dot(across, v)
            s = s - jnp.where(there, value, 0.0) / jnp.where(there & (slope != 0.0), slope, 1.0)
        distance = jnp.dot(along, self.motion(s)[0] - origin) / jnp.dot(along, along)
        return jnp.where(there, distance, jnp.inf), jnp.mod(s, 1.0)

    def tangents(self, pieces: PreparedCurves, p: Point):
        """The points at which lines from p touch the curve, and which of the eight exist."""

        def f(s):
            c, v, a = self.motion(s)
            u = c - p
            return v[0] * u[1] - v[1] * u[0], a[0] * u[1] - a[1] * u[0]

        s, valid, too_many = pieces.touching(jax.lax.stop_gradient(p))
        for _ in range(2):  # now with derivatives
            value, slope = jax.vmap(f)(s)
            s = s - jnp.where(valid, value, 0.0) / jnp.where(valid & (slope != 0), slope, 1.0)
        points = jax.vmap(lambda s: self.motion(s)[0])(s)
        # Better no answer than a wrong one.
        return nan_unless(~too_many, points), valid | too_many

    def _nearest_self(self) -> Float[Array, ""]:
        """The distance below which a point of the curve is the eye's own."""
        eps = jnp.finfo(self.cosines.dtype).eps
        return self._size() * eps**0.5


class PreparedCurves(Module):
    """Curves in pieces, on each of which they are polynomials of u between -1 and 1.

    Attributes:
        center: of each [m].
        about: by coordinate, power of u and piece, without the centre [m].
        starts: where the pieces start, and two derivatives in u there, by coordinate and piece [m].
        extents: how far their points are apart at most [m].
        own: the distance below which a point of the curve is the eye's own [m].
    """

    center: Float[Array, "*n 2"]
    about: Float[Array, "*n 2 m p"]
    starts: Float[Array, "*n 3 2 p"]
    extents: Float[Array, "*n p"]
    own: Float[Array, "*n"]

    @property
    def count(self) -> int:
        """Number of curves."""
        return self.center.shape[0]

    def distance(self, origin: Point, along: Point, on: Bool[Array, ""]) -> Float[Array, ""]:
        """Distance to the nearest point ahead, infinity for none."""
        return self.crossing(origin, along, on)[0]

    def crossing(
        self, origin: Point, along: Point, on: Bool[Array, ""]
    ) -> tuple[Float[Array, ""], Float[Array, ""]]:
        """The nearest crossing ahead: distance in lengths of a vector, and parameter."""
        (x, y), w = along, origin - self.center
        beside, before = cross_2d(along, w), dot_2d(along, w)

        def rows(piece):
            across = x * self.about[1][:, piece] - y * self.about[0][:, piece]
            return across.at[0].add(-beside)

        place, way, _ = self.starts
        ends = x * place[1] - y * place[0] - beside, x * way[1] - y * way[0]
        found = brackets(_line, ends, rows, PAIRS)
        # A point of the curve itself is met again at a distance of rounding.
        least = jnp.where(on, self.own, 0.0)
        start = x * place[0] + y * place[1] - before
        end = jnp.roll(start, -1)
        ahead = jnp.maximum(start, end) + self.extents > least
        met = found.found & ahead[found.piece]
        which = order_of(jnp.where(met, (start + end)[found.piece], jnp.inf))[:NEAREST]
        piece = found.piece[which]
        u = _root(_line, rows(piece), found.low[which], found.high[which])
        t = [taylor(self.about[k][:, piece], u, 1)[0] for k in (0, 1)]
        t = x * t[0] + y * t[1] - before
        t = jnp.where(met[which] & (t > least), t, jnp.inf)
        best = jnp.argmin(t)
        return t[best] / dot_2d(along, along), self._parameter(piece, u)[best]

    def touching(self, p: Point) -> tuple[Array, Bool[Array, " k"], Bool[Array, ""]]:
        """Parameters of tangents from an eye, which of them exist, and whether there are more."""
        w = p - self.center

        def rows(piece):
            return self.about[..., piece].at[:, 0].add(-w[:, None])

        place, way, turn = self.starts
        u = place - w[:, None]
        ends = way[0] * u[1] - way[1] * u[0], turn[0] * u[1] - turn[1] * u[0]
        found = brackets(_tangent, ends, rows, MOST_TANGENTS)
        which = order_of(~found.found)[:MOST_TANGENTS]
        piece = found.piece[which]
        some = rows(piece)
        u = _root(_tangent, some, found.low[which], found.high[which])
        apart = jnp.sqrt(sum(taylor(row, u, 1)[0] ** 2 for row in some))
        valid = found.found[which] & (apart > self.own)
        return self._parameter(piece, u), valid, jnp.sum(found.found) > MOST_TANGENTS

    def _parameter(self, piece: Array, u: Array) -> Array:
        """The parameter of the curve."""
        return (piece + 0.5 + 0.5 * u) / self.starts.shape[-1]


def _line(rows: Array, u: Array):
    """How far a curve is beside a line, and two derivatives."""
    return taylor(rows, u, 3)


def _tangent(rows: Array, u: Array):
    """How far the eye is beside a tangent, times its length, and two derivatives."""
    (x, vx, ax, jx), (y, vy, ay, jy) = (taylor(row, u, 4) for row in rows)
    return vx * y - vy * x, ax * y - ay * x, jx * y - jy * x + ax * vy - ay * vx


def _root(f, rows: Array, low: Array, high: Array) -> Array:
    """The roots between ends of opposite sign, to rounding."""

    def of(u):
        return f(rows, u)

    u = bracketed_root(of, low, high)
    for _ in range(2):
        u = jnp.clip(newton(of, u), low, high)
    return u
