"""The scene in space of D05 Figs. 1, 6 and 9: its light by rays, and the 4D prediction beside it.

A round area light, a layer of balls, one jittered in each cell of a square grid, a receiver that
faces the light: coordinates of every step are positions and slopes across the central ray. Rays are
traced against the balls. The prediction takes the balls for discs in their middle plane: a Gaussian
light times a sum of plane waves stays one under every linear law, and factors into (x, v) and
(y, w), so its 4D spectrum is a product of three matrices. Both are seen through the same Gaussian
window.

Balls are opaque, as in the paper, or soft: `1 - exp(-(b / r)^2)` gets by at the distance b from the
middle, a share of the light for each ball that a ray passes. Moments are asked of soft ones alone:
behind a sharp rim the power falls as the third power of frequency, so its second moment grows with
the band that is looked at and is no property of the light.
"""

from __future__ import annotations

import dataclasses
import functools
import operator

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float
from scipy.special import j1

from firstorder.conventions import SPACE_SLOPE
from firstorder.laws import Move
from firstorder.transport import GlossyPatch, Travel
from firstorder.transport.chain4d._equator import ComposedMove

SIGMA_X, SIGMA_V = 0.15, 0.3  # of the light: metres and slopes
FIRST, SECOND = 1.0, 1.0  # metres to the balls, and on to the receiver
BOX = 4.8  # period of the prediction's plane waves: the light at the balls fits in [m]
LEAVING = SPACE_SLOPE.turned()


class Balls(eqx.Module):
    """One ball in each square cell of side `period`, jittered so that it stays in there."""

    centers: Float[Array, "cells cells 2"]
    period: float = eqx.field(static=True)
    radius: float = eqx.field(static=True)
    soft: bool = eqx.field(static=True)

    @classmethod
    def jittered(cls, period: float, seed: int = 7, fill: float = 0.3, soft: bool = False) -> Balls:
        """Radius `fill` of the period: opaque ones block a share pi fill^2 of the layer."""
        cells = round(BOX / period)
        rng = np.random.default_rng(seed)
        middles = (np.arange(cells) + 0.5) * period - 0.5 * BOX
        grid = np.stack(np.meshgrid(middles, middles, indexing="ij"), -1)
        room = 0.8 * (0.5 - fill) * period
        centers = jnp.asarray(grid + rng.uniform(-room, room, grid.shape))
        return cls(centers, period, fill * period, soft)

    def through(self, x, y, v, w):
        """Share of the light that gets by, of the ray through (x, y) of their middle plane."""
        i, j = (jnp.floor((a + 0.5 * BOX) / self.period).astype(int) for a in (x, y))
        near = (-1, 0, 1) if self.soft else (0,)
        parts = [1.0 - self._hidden(i + a, j + b, x, y, v, w) for a in near for b in near]
        return functools.reduce(operator.mul, parts)

    def _hidden(self, i, j, x, y, v, w):
        """What the ball of a cell hides."""
        cells = len(self.centers)
        inside = (i >= 0) & (i < cells) & (j >= 0) & (j < cells)
        c = self.centers[jnp.clip(i, 0, cells - 1), jnp.clip(j, 0, cells - 1)]
        px, py = x - c[..., 0], y - c[..., 1]
        along = (px * v + py * w) ** 2 / (1.0 + v * v + w * w)
        distance = (px * px + py * py - along) / self.radius**2
        return inside * (jnp.exp(-distance) if self.soft else distance < 1.0)

    def series(self, harmonics: int) -> tuple[np.ndarray, np.ndarray]:
        """Frequencies along an axis, and Fourier coefficients of the discs' transparency."""
        k = np.arange(-harmonics, harmonics + 1)
        s = k / BOX
        if self.soft:
            return s, _sampled_series(self, k)
        q = np.hypot(s[:, None], s[None, :])
        safe = np.where(q > 0, q, 1.0)
        disc = np.where(
            q > 0, self.radius * j1(2 * np.pi * self.radius * safe) / safe, np.pi * self.radius**2
        )
        c = np.asarray(self.centers).reshape(-1, 2)
        waves = np.exp(-2j * np.pi * np.outer(s, c[:, 0])) @ np.exp(
            -2j * np.pi * np.outer(c[:, 1], s)
        )
        coefficients = -disc * waves / BOX**2
        coefficients[harmonics, harmonics] += 1.0
        return s, coefficients


def _sampled_series(balls: Balls, k: np.ndarray, n: int = 240) -> np.ndarray:
    """Coefficients of waves k of the transparency in the middle plane, from n^2 samples."""
    x = (np.arange(n) + 0.5) * BOX / n - 0.5 * BOX
    X, Y = np.meshgrid(x, x, indexing="ij")
    waves = np.exp(-2j * np.pi * np.outer(k, x) / BOX) / n
    return waves @ np.asarray(balls.through(X, Y, 0.0, 0.0)) @ waves.T


# --- by rays -------------------------------------------------------------------------------------


def emitted(x, y, v, w):
    """The light at its source."""
    return jnp.exp(-0.5 * ((x * x + y * y) / SIGMA_X**2 + (v * v + w * w) / SIGMA_V**2))


def outgoing(x, y, v, w, balls: Balls | None, at: float):
    """Light `at` metres from the source, going away from it; balls stand at FIRST."""
    light = emitted(x + at * v, y + at * w, v, w)
    if balls is None:
        return light
    back = at - FIRST
    return light * balls.through(x + back * v, y + back * w, v, w)


def arrived(x, y, v, w, balls: Balls | None):
    """Light on the receiver's side: the frame makes half a turn about the second axis."""
    return outgoing(-x, y, v, -w, balls, FIRST + SECOND)


class Light(eqx.Module):
    """Light on its way: `at` metres from the source, or arrived at the receiver."""

    balls: Balls | None
    at: float = eqx.field(static=True)
    arriving: bool = eqx.field(static=True, default=False)

    def __call__(self, x, y, v, w):
        if self.arriving:
            return arrived(x, y, v, w, self.balls)
        return outgoing(x, y, v, w, self.balls, self.at)


def _tilted(angle) -> np.ndarray:
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, 0.0, -s], [0.0, 1.0, 0.0], [s, 0.0, c]])


class Glossed(eqx.Module):
    """Light off a glossy paraboloid `z = -|x|^2 / (2 R)`, across the mirrored ray: rays, exactly.

    The lobe is a Gaussian in the plane across the outgoing ray, by Gauss-Hermite quadrature.
    """

    balls: Balls
    radius: float = eqx.field(static=True)
    theta0: float = eqx.field(static=True)
    sigma: float = eqx.field(static=True)
    nodes: int = eqx.field(static=True)
    on: float = eqx.field(static=True, default=0.0)

    def __call__(self, x, y, v, w):
        d, q, n = self._met(x + self.on * v, y + self.on * w, v, w)
        first = jnp.cross(d, np.array([0.0, 1.0, 0.0]))
        first /= jnp.linalg.norm(first, axis=-1, keepdims=True)
        second = jnp.cross(d, first)
        t, weight = np.polynomial.hermite_e.hermegauss(self.nodes)
        weight = weight / np.sqrt(2.0 * np.pi)
        into = _tilted(self.theta0)
        ql = q @ into

        def node(total, tw):
            ta, tb, w = tw
            m = d + self.sigma * (ta * first + tb * second)
            m /= jnp.linalg.norm(m, axis=-1, keepdims=True)
            r = (2.0 * jnp.sum(n * m, -1)[..., None] * n - m) @ into
            step = ql[..., 2] / r[..., 2]
            place = ql[..., 0] - r[..., 0] * step, ql[..., 1] - r[..., 1] * step
            slopes = -r[..., 0] / r[..., 2], -r[..., 1] / r[..., 2]
            return total + w * arrived(*place, *slopes, self.balls), None

        grid = [a.ravel() for a in np.meshgrid(t, t)]
        nodes = jnp.stack([*grid, np.outer(weight, weight).ravel()], -1)
        return jax.lax.scan(node, jnp.zeros(x.shape), nodes)[0]

    def _met(self, x, y, v, w):
        """Directions of rays across the mirrored one, where they meet the surface, and normals."""
        frame, S = _tilted(-self.theta0), -np.eye(2) / self.radius
        p = x[..., None] * frame[:, 0] + y[..., None] * frame[:, 1]
        d = -v[..., None] * frame[:, 0] - w[..., None] * frame[:, 1] + frame[:, 2]
        d /= jnp.linalg.norm(d, axis=-1, keepdims=True)
        Sd, Sp = d[..., :2] @ S, p[..., :2] @ S
        a = 0.5 * jnp.sum(d[..., :2] * Sd, -1)
        b = jnp.sum(p[..., :2] * Sd, -1) - d[..., 2]
        c = 0.5 * jnp.sum(p[..., :2] * Sp, -1) - p[..., 2]
        root = jnp.sqrt(jnp.maximum(b * b - 4.0 * a * c, 0.0))
        q = p - (2.0 * c / (b - root))[..., None] * d
        n = jnp.concatenate([-q[..., :2] @ S, jnp.ones_like(q[..., :1])], -1)
        return d, q, n / jnp.linalg.norm(n, axis=-1, keepdims=True)


@eqx.filter_jit
def _row(light, x, y, v):
    """A light over (y, v, w) at one x."""
    X, Y, V, W = jnp.meshgrid(x[None], y, v, v, indexing="ij")
    return light(X, Y, V, W)[0]


# --- windows and transforms ----------------------------------------------------------------------


@dataclasses.dataclass(frozen=True)
class Window:
    """A 4D grid of n^4 rays under a Gaussian window that ends at 3.2 deviations."""

    x: float  # deviation of the window, in metres
    v: float  # in slopes
    n: int
    pad: float = 1.5

    @property
    def axes(self) -> tuple[np.ndarray, np.ndarray]:
        """Positions and slopes."""
        t = (np.arange(self.n) - 0.5 * self.n) / (0.5 * self.n)
        return 3.2 * self.x * t, 3.2 * self.v * t

    @property
    def frequencies(self) -> tuple[np.ndarray, np.ndarray]:
        """Of the padded transform, in ascending order."""
        size = round(self.pad * self.n)
        steps = [a[1] - a[0] for a in self.axes]
        fx, fv = (np.fft.fftshift(np.fft.fftfreq(size, h)) for h in steps)
        return fx, fv

    def power(self, light) -> np.ndarray:
        """Power of the windowed, padded transform: axes (x, y, v, w)."""
        x, v = (jnp.asarray(a) for a in self.axes)
        values = np.empty((self.n,) * 4)
        for i in range(self.n):  # a slab at a time: memory
            values[i] = _row(light, x[i], x, v)
        x, v = self.axes
        gx, gv = (np.exp(-0.5 * (a / s) ** 2) for a, s in ((x, self.x), (v, self.v)))
        for axis, g in enumerate((gx, gx, gv, gv)):
            values *= g.reshape([-1 if k == axis else 1 for k in range(4)])
        size = (round(self.pad * self.n),) * 4
        F = np.fft.fftshift(np.abs(np.fft.fftn(values.astype(np.complex64), size, range(4))) ** 2)
        return F / F.sum()


@dataclasses.dataclass(frozen=True)
class Pair:
    """`exp(-k s^2 / 2 - (W - b s) Q (W - b s) / 2)`: one pair of coordinates, for each wave s."""

    Q: np.ndarray
    b: np.ndarray
    k: float = 0.0

    def moved(self, M) -> Pair:
        """Energy moves by `M^T`."""
        inverse = np.linalg.inv(M)
        return Pair(inverse @ self.Q @ inverse.T, M.T @ self.b, self.k)

    def blocked(self) -> Pair:
        """Times plane waves over positions."""
        return Pair(self.Q, self.b + np.eye(2)[0], self.k)

    def blurred(self, sigma) -> Pair:
        """Convolved with a Gaussian lobe over the direction."""
        Q = self.Q + np.diag([0.0, (2.0 * np.pi * sigma) ** 2])
        b = np.linalg.solve(Q, self.Q @ self.b)
        return Pair(Q, b, self.k + self.b @ self.Q @ self.b - b @ Q @ b)

    def windowed(self, window: Window) -> Pair:
        """Times the window."""
        spread = np.diag([window.x**-2.0, window.v**-2.0]) / (2.0 * np.pi) ** 2
        return Pair(np.linalg.inv(np.linalg.inv(self.Q) + spread), self.b, self.k)

    def table(self, f, g, s) -> np.ndarray:
        """At all frequencies (f, g), for all waves: shape (f, g, s)."""
        a = f[:, None, None] - self.b[0] * s
        c = g[None, :, None] - self.b[1] * s
        Q = self.Q
        return np.exp(
            -0.5 * (Q[0, 0] * a * a + 2 * Q[0, 1] * a * c + Q[1, 1] * c * c + self.k * s * s)
        )


Pairs = tuple[Pair, Pair]


def source() -> Pairs:
    """Both pairs of the light at its source."""
    Q = (2.0 * np.pi) ** 2 * np.diag([SIGMA_X**2, SIGMA_V**2])
    return Pair(Q, np.zeros(2)), Pair(Q, np.zeros(2))


def split(M) -> tuple[np.ndarray, np.ndarray]:
    """The (x, v) and (y, w) parts of a 4D matrix that does not mix them."""
    M = np.asarray(M)
    parts = M[np.ix_([0, 2], [0, 2])], M[np.ix_([1, 3], [1, 3])]
    mixed = M.copy()
    for rows in ([0, 2], [1, 3]):
        mixed[np.ix_(rows, rows)] = 0.0
    assert np.max(np.abs(mixed)) < 1e-12, "the pairs mix"
    return parts


def travelled(pairs: Pairs, d: float) -> Pairs:
    """Travel, by the library's law."""
    law = Travel(d).law(LEAVING)
    assert isinstance(law, Move)
    one, two = (p.moved(M) for p, M in zip(pairs, split(law.M), strict=True))
    return one, two


def turned(pairs: Pairs) -> Pairs:
    """Arrival: half a turn about the second axis."""
    return pairs[0].moved(np.diag([-1.0, 1.0])), pairs[1].moved(np.diag([1.0, -1.0]))


def glossy(pairs: Pairs, S, theta0, sigma) -> Pairs:
    """The library's shading chain in 4D."""
    first, *_, last = GlossyPatch(S, theta0, sigma).chain().events
    assert isinstance(first, ComposedMove)
    assert isinstance(last, ComposedMove)
    law = first.law(SPACE_SLOPE)
    before, after = split(law.M), split(last.law(law.frame(SPACE_SLOPE)).M)
    one, two = (
        p.moved(a).blurred(sigma).moved(b) for p, a, b in zip(pairs, before, after, strict=True)
    )
    return one, two


def predicted(pairs: Pairs, window: Window, series=None) -> np.ndarray:
    """Power of the predicted spectrum on the transform's frequencies: axes (x, y, v, w)."""
    s, V = (np.zeros(1), np.ones((1, 1))) if series is None else series
    fx, fv = window.frequencies
    A, B = (p.windowed(window).table(fx, fv, s).astype(np.complex64) for p in pairs)
    shape = len(fx), len(fv)
    F = (A.reshape(-1, s.size) @ V.astype(np.complex64)) @ B.reshape(-1, s.size).T
    power = np.abs(F.reshape(shape + shape)) ** 2
    power = np.moveaxis(power, 1, 2)  # (x, v, y, w) to (x, y, v, w)
    return power / power.sum()


# --- what is compared ----------------------------------------------------------------------------


def radial(power, fx, fv, bins: int = 24) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Mean power over rings of spatial and of angular frequency, and the rings' middles."""
    tops = fx.max(), fv.max()
    rings = [np.hypot(*np.meshgrid(f, f, indexing="ij")).ravel() for f in (fx, fv)]
    index = [
        np.minimum((r / top * bins).astype(int), bins) for r, top in zip(rings, tops, strict=True)
    ]
    flat = power.reshape(rings[0].size, rings[1].size)
    sums = np.zeros((bins + 1, flat.shape[1]))
    np.add.at(sums, index[0], flat)
    both = np.zeros((bins + 1, bins + 1))
    np.add.at(both.T, index[1], sums.T)
    counts = np.outer(*(np.bincount(i, minlength=bins + 1) for i in index))
    middles = [(np.arange(bins) + 0.5) * top / bins for top in tops]
    return (both / np.maximum(counts, 1))[:bins, :bins], middles[0], middles[1]


def moments(power, fx, fv, share: float = 1.0) -> np.ndarray:
    """Second moments of the (x, v) pair and of the (y, w) pair: shape (2, 2, 2).

    With `share`, of what lies within that share of the largest frequency on every axis.
    """
    found = []
    kept = [np.abs(f) <= share * np.abs(f).max() for f in (fx, fv)]
    power = power[np.ix_(kept[0], kept[0], kept[1], kept[1])]
    power, fx, fv = power / power.sum(), fx[kept[0]], fv[kept[1]]
    for axes in ((1, 3), (0, 2)):
        p = power.sum(axis=axes)
        cross = fx @ p @ fv
        found.append([[fx**2 @ p.sum(1), cross], [cross, fv**2 @ p.sum(0)]])
    return np.array(found)


def moments_apart(a, b) -> float:
    """Largest difference of two sets of moments, each pair in units of its own deviations."""
    scale = np.sqrt(np.einsum("pi,pj->pij", *[np.einsum("pii->pi", b)] * 2))
    return float(np.max(np.abs(a - b) / scale))
