"""Light on a diffuse receiver in the scene of `shared.space`, its spectrum, and panels of them."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from matplotlib.colors import LogNorm

from figures.d05.shared import space
from figures.d05.shared.readings import ALIKE, alike
from figures.spread import spread
from figures.verdicts import Statement, at_least, at_most

# --- steps of a path -----------------------------------------------------------------------------

AGREE = "excellent qualitative agreement"
PATHS = "D05 §3"


class Place(NamedTuple):
    """One place of a path: its light by rays, and the pairs that predict it.

    Attributes:
        title: of its panels.
        window: under which both are seen.
        light: radiance of rays (x, y, v, w).
        pairs: of the prediction.
        behind: whether blockers have been passed.
    """

    title: str
    window: space.Window
    light: Any
    pairs: space.Pairs
    behind: bool


class Step(NamedTuple):
    """What is kept of the light at a place, measured and predicted.

    Attributes:
        place: where.
        rings: radial summaries of power, measured and predicted.
        axes: the rings' middles, in space and in angle.
        moments: second moments in the whole band, measured and predicted.
        likeness: correlation of the two magnitudes over the whole 4D grid.
    """

    place: Place
    rings: tuple[np.ndarray, np.ndarray]
    axes: tuple[np.ndarray, np.ndarray]
    moments: tuple[np.ndarray, np.ndarray]
    likeness: float

    @property
    def apart(self) -> float:
        """How far the moments differ, in units of deviations."""
        return space.moments_apart(*self.moments)

    @property
    def extent(self) -> np.ndarray:
        """Root mean square frequency in space and in angle, measured."""
        return np.sqrt(np.diag(self.moments[0].mean(axis=0)))


def step(place: Place, series) -> Step:
    """Trace and predict a place; `series` is that of the balls."""
    f = place.window.frequencies
    power = place.window.power(place.light)
    predicted = space.predicted(place.pairs, place.window, series if place.behind else None)
    a, b = np.sqrt(power).ravel(), np.sqrt(predicted).ravel()
    like = float(np.corrcoef(a, b)[0, 1])
    both = power, predicted
    rings = [space.radial(p, *f) for p in both]
    measured, guessed = (space.moments(p, *f) for p in both)
    return Step(place, (rings[0][0], rings[1][0]), rings[0][1:], (measured, guessed), like)


def layouts(make: Callable[[space.Balls], list[Place]], period: float, quick: bool):
    """The same path past soft balls, jittered anew: for each lay-out its steps.

    Places before the balls are traced once.
    """
    harmonics, found = 16 if quick else 44, []
    for seed in range(2 if quick else 20):
        balls = space.Balls.jittered(period, seed, soft=True)
        series = balls.series(harmonics)
        places = make(balls)
        old = found[0] if found else [None] * len(places)
        found.append([step(p, series) if p.behind or o is None else o
                      for p, o in zip(places, old, strict=True)])  # fmt: skip
    return found


def agreement(steps: list[Step], scanned: list[list[Step]]) -> list[Statement]:
    """Whether rays and prediction agree: opaque balls as a whole, soft ones by moments."""
    like = min(s.likeness for s in steps)
    claims = [
        Statement("Opaque balls: magnitudes at all 4D frequencies correlate with the predicted "
                  "ones, least of all steps", AGREE, like,
                  at_least(1.0 - ALIKE, f"'{AGREE}': to a tenth"), PATHS)
    ]  # fmt: skip
    for k, s in enumerate(steps):
        words = f"{s.place.title}: second moments of the spectrum, measured and predicted, differ"
        if s.place.behind:
            mean, error = spread([found[k].apart for found in scanned])
            claims.append(Statement(f"{words}, soft balls", AGREE, mean, alike(AGREE), PATHS,
                                    "of the deviations", error, said(scanned)))  # fmt: skip
        else:
            rule = at_most(1e-4, "single precision, and where the window ends")
            claims.append(Statement(words, AGREE, s.apart, rule, PATHS, "of the deviations"))
    return claims


def said(scanned) -> str:
    """What was varied, in words."""
    return f"{len(scanned)} lay-outs of balls"


def growth(scanned: list[list[Step]], axis: int, after: int, before: int) -> tuple[float, float]:
    """How much larger the root mean square frequency is at a step than before; mean and error."""
    return spread([found[after].extent[axis] / found[before].extent[axis] for found in scanned])


def draw_steps(axes, steps: list[Step]) -> None:
    """Two rows: measured above predicted, in powers of ten below the largest."""
    drawn = None
    for column, step in zip(axes.T, steps, strict=True):
        x, v = step.axes
        for ax, rings, name in zip(column, step.rings, ("measured", "predicted"), strict=True):
            top = rings.max()
            some = rings.any(1), rings.any(0)  # rings that no frequency of the grid falls into
            share = np.maximum(rings[np.ix_(*some)] / top, 1e-6)
            drawn = ax.pcolormesh(
                x[some[0]], v[some[1]], share.T, norm=LogNorm(1e-5, 1.0), cmap="magma",
                rasterized=True,
            )  # fmt: skip
            ax.set_title(f"{step.place.title}\n{name}", loc="left")
    for ax in axes[-1]:
        ax.set_xlabel("$|\\Omega_{xy}|$  [cycles/m]")
    for ax in axes[:, 0]:
        ax.set_ylabel("$|\\Omega_{vw}|$  [cycles]")
    axes[0, 0].figure.colorbar(drawn, ax=axes, label="energy, of the largest", shrink=0.7)


# --- the diffuse receiver ------------------------------------------------------------------------

REACH = 1.3  # slopes that reach the receiver lie below


def _slopes(nodes: int) -> tuple[np.ndarray, float]:
    h = 2.0 * REACH / nodes
    return (np.arange(nodes) + 0.5) * h - REACH, h


def projected_area(v, w) -> np.ndarray:
    """D05 §5.1: `G = 1 / (1 + v^2 + w^2)^2`."""
    return (1.0 + v * v + w * w) ** -2.0


def irradiance(balls, positions: np.ndarray, nodes: int) -> np.ndarray:
    """On a square grid of the receiver, by rays to all slopes."""
    return np.asarray(_irradiance(balls, jnp.asarray(positions), nodes))


@eqx.filter_jit
def _irradiance(balls, positions, nodes: int):
    t, h = _slopes(nodes)
    V, W = np.meshgrid(t, t, indexing="ij")
    G = projected_area(V, W) * h * h

    def row(x):
        return jax.lax.map(lambda y: jnp.sum(G * space.arrived(x, y, V, W, balls)), positions)

    return jax.lax.map(row, positions)


def spectrum_of(values: np.ndarray, positions: np.ndarray, width: float, f: np.ndarray):
    """Of samples under a Gaussian window."""
    g = np.exp(-0.5 * (positions / width) ** 2)
    kernel = np.exp(-2j * np.pi * np.outer(f, positions)) * g * (positions[1] - positions[0])
    return kernel @ values @ kernel.T


def predicted_irradiance(series, f: np.ndarray, width: float, nodes: int):
    """The same from the plane waves: `sum_s V_s int int G (x-spectrum at slope v) (y-spectrum)`.

    `series` is that of the balls. G is no product; it is one of few terms (its singular values fall
    fast).
    """
    t, h = _slopes(nodes)
    u, size, v = np.linalg.svd(projected_area(*np.meshgrid(t, t, indexing="ij")) * h * h)
    s, V = series
    tables = [_at_slopes(f, s, t, width, sign) for sign in (-1.0, 1.0)]
    total = np.zeros((f.size, f.size), complex)
    for k in range(np.count_nonzero(size > 1e-9 * size[0])):
        A = np.tensordot(tables[0], u[:, k], axes=(2, 0))
        B = np.tensordot(tables[1], v[k], axes=(2, 0))
        total += size[k] * (A @ V @ B.T)
    return total


def _at_slopes(f, s, t, width, sign):
    """Transform over one position of light times window times wave, at fixed slopes.

    The outgoing coordinates are (-x, v) on the first axis and (y, -w) on the second: `sign` is
    that of the position in them.
    """
    d = space.FIRST + space.SECOND
    slope = -sign * t  # -x with v, y with -w
    light, wide = space.SIGMA_X**-2.0, width**-2.0
    a = light + wide
    # emitted at sign x + d slope; the wave at sign x + SECOND slope
    linear = -light * d * (slope * sign)[None, None, :] + 2j * np.pi * (
        sign * s[None, :, None] - f[:, None, None]
    )
    constant = (
        -0.5 * (light * d * d + space.SIGMA_V**-2.0) * slope**2
        + 2j * np.pi * s[None, :, None] * space.SECOND * slope
    )
    return np.sqrt(2.0 * np.pi / a) * np.exp(linear**2 / (2.0 * a) + constant)


def ring_mean(F: np.ndarray, f: np.ndarray, bins: int) -> tuple[np.ndarray, np.ndarray]:
    """Root mean square over rings of frequency."""
    r = np.hypot(*np.meshgrid(f, f, indexing="ij")).ravel()
    i = np.minimum((r / f.max() * bins).astype(int), bins)
    power = np.bincount(i, np.abs(F).ravel() ** 2, bins + 1)
    counts = np.maximum(np.bincount(i, minlength=bins + 1), 1)
    return (np.arange(bins) + 0.5) * f.max() / bins, np.sqrt(power / counts)[:bins]
