"""Light on a diffuse receiver in the scene of `shared.space`, its spectrum, and panels of them."""

from __future__ import annotations

import dataclasses

import numpy as np
from matplotlib.colors import LogNorm

from figures.d05.shared import space
from figures.style import Claim

# --- steps of a path -----------------------------------------------------------------------------


@dataclasses.dataclass(frozen=True)
class Step:
    """Light at one place of the path: measured and predicted power over one window."""

    title: str
    window: space.Window
    measured: np.ndarray
    predicted: np.ndarray

    def rings(self):
        """Radial summaries, and the rings' middles."""
        a, x, v = space.radial(self.measured, *self.window.frequencies)
        return a, space.radial(self.predicted, *self.window.frequencies)[0], x, v

    def moments(self, share: float = 1.0) -> tuple[np.ndarray, np.ndarray]:
        """Second moments, measured and predicted."""
        f = self.window.frequencies
        return space.moments(self.measured, *f, share), space.moments(self.predicted, *f, share)

    def likeness(self) -> float:
        """Correlation of the two magnitudes over the whole 4D grid."""
        a, b = np.sqrt(self.measured).ravel(), np.sqrt(self.predicted).ravel()
        return float(a @ b / np.sqrt((a @ a) * (b @ b)))

    def claims(self, smooth: bool) -> list[Claim]:
        """How far moments are apart, in the whole band and in its inner half."""
        a, b = self.moments()
        c, d = self.moments(0.5)
        whole, inner, like = space.moments_apart(a, b), space.moments_apart(c, d), self.likeness()
        words = "of the deviations" if smooth else "of the deviations (edges alias)"
        bound = 0.02 if smooth else 0.15
        start = f"{self.title}: measured and predicted"
        return [
            Claim(
                f"{start} second moments differ by",
                0.0,
                whole,
                words,
                whole < bound if smooth else None,
            ),
            Claim(
                f"{start} moments in the inner half of the band differ by",
                0.0,
                inner,
                "of the deviations",
                inner < bound,
            ),
            Claim(
                f"{start} 4D magnitudes correlate by",
                1.0,
                like,
                "",
                like > (0.999 if smooth else 0.95),
            ),
        ]

    def extent(self, measured: bool = True) -> np.ndarray:
        """Root mean square frequency in space and in angle, in the inner half of the band."""
        m = self.moments(0.5)[0 if measured else 1].mean(axis=0)
        return np.sqrt(np.diag(m))


def draw_steps(axes, steps: list[Step]) -> None:
    """Two rows: measured above predicted, in powers of ten below the largest."""
    for column, step in zip(axes.T, steps, strict=True):
        measured, predicted, x, v = step.rings()
        names = "measured", "predicted"
        for ax, rings, name in zip(column, (measured, predicted), names, strict=True):
            top = rings.max()
            ax.pcolormesh(
                x, v, np.maximum(rings, 1e-6 * top).T, norm=LogNorm(1e-5 * top, top),
                cmap="magma", rasterized=True,
            )  # fmt: skip
            ax.set_title(f"{step.title}\n{name}", loc="left")
    for ax in axes[-1]:
        ax.set_xlabel("$|\\Omega_{xy}|$  [cycles/m]")
    for ax in axes[:, 0]:
        ax.set_ylabel("$|\\Omega_{vw}|$  [cycles]")


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
    t, h = _slopes(nodes)
    V, W = np.meshgrid(t, t, indexing="ij")
    G = projected_area(V, W) * h * h
    found = np.empty((positions.size,) * 2)
    for i, x in enumerate(positions):
        for j, y in enumerate(positions):
            found[i, j] = np.sum(G * space.arrived(x, y, V, W, balls))
    return found


def spectrum_of(values: np.ndarray, positions: np.ndarray, width: float, f: np.ndarray):
    """Of samples under a Gaussian window."""
    g = np.exp(-0.5 * (positions / width) ** 2)
    kernel = np.exp(-2j * np.pi * np.outer(f, positions)) * g * (positions[1] - positions[0])
    return kernel @ values @ kernel.T


def predicted_irradiance(balls, f: np.ndarray, width: float, nodes: int, harmonics: int):
    """The same from the plane waves: `sum_s V_s int int G (x-spectrum at slope v) (y-spectrum)`.

    G is no product; it is one of few terms (its singular values fall fast).
    """
    t, h = _slopes(nodes)
    u, size, v = np.linalg.svd(projected_area(*np.meshgrid(t, t, indexing="ij")) * h * h)
    s, V = balls.series(harmonics)
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
