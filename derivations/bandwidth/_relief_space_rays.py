"""Rays that meet a height field in space, one by one in NumPy: an eye before a mirror in relief.

Heights are sums of cosines, `sum a cos(2 pi k . x + phase)`. The eye is far, in the direction e,
and `V = (e_x, e_y) / e_z`. Its ray through u of the base runs along (u + t V, t), meets the relief
and goes on as a mirror sends it. Where it goes is told by where that line crosses the base, and its
direction. Arrays of places have two columns.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np


class Cosines(NamedTuple):
    """A relief of cosines: frequencies (n, 2), amplitudes (n,), phases (n,)."""

    k: np.ndarray
    a: np.ndarray
    phase: np.ndarray

    def height(self, x):
        return np.cos(2.0 * np.pi * x @ self.k.T + self.phase) @ self.a

    def slope(self, x):
        wave = -np.sin(2.0 * np.pi * x @ self.k.T + self.phase) * self.a
        return 2.0 * np.pi * wave @ self.k

    def curvature(self, x):
        """The larger eigenvalue of the Hessian, without its sign."""
        wave = -np.cos(2.0 * np.pi * x @ self.k.T + self.phase) * self.a
        kx, ky = self.k.T
        xx, xy, yy = np.moveaxis(wave @ np.stack([kx * kx, kx * ky, ky * ky], -1), -1, 0)
        return 2.0 * np.pi**2 * (np.abs(xx + yy) + np.hypot(xx - yy, 2.0 * xy))

    def numbers(self, x):
        """Largest height, slope and curvature at places, and root mean squares of the first two."""
        h, m = self.height(x), np.linalg.norm(self.slope(x), axis=-1)
        bent = self.curvature(x).max()
        return np.abs(h).max(), m.max(), bent, np.sqrt(np.mean(h**2)), np.sqrt(np.mean(m**2))


def to_eye(view, azimuth):
    """Direction to the eye."""
    across = np.sin(view) * np.array([np.cos(azimuth), np.sin(azimuth)])
    return np.append(across, np.cos(view))


def met(u, relief, e):
    """Where on the base the eye's ray through u ends, by bisection in the height."""
    V, half = e[:2] / e[2], np.sum(np.abs(relief.a))
    middle = np.zeros(u.shape[:-1])
    phase, turns = 2.0 * np.pi * u @ relief.k.T + relief.phase, 2.0 * np.pi * relief.k @ V
    for _ in range(60):
        half *= 0.5
        height = np.cos(phase + middle[..., None] * turns) @ relief.a
        middle += np.copysign(half, height - middle)
    return u + middle[..., None] * V


def mirrored(slope, e):
    """Where light comes from that a mirror of this slope sends to e, by the law of reflection."""
    N = np.concatenate([-slope, np.ones((*slope.shape[:-1], 1))], -1)
    N = N / np.linalg.norm(N, axis=-1, keepdims=True)
    return 2.0 * (N @ e)[..., None] * N - e


def traced(u, relief, e):
    """Where on the base, and from what direction, light comes that goes to the eye: (x, w)."""
    x = met(u, relief, e)
    w = mirrored(relief.slope(x), e)
    return x - relief.height(x)[..., None] * w[..., :2] / w[..., 2:], w


def bumped(u, relief, e):
    """The same of normals on a flat base."""
    return u, mirrored(relief.slope(u), e)


def flat(u, relief, e):
    """The same of a flat mirror."""
    return u, mirrored(0.0 * u, e)


def wave(place, Omega_x, Omega):
    """Light of one pair of frequencies, along the base and over directions."""
    x, w = place
    return np.exp(2j * np.pi * (x @ Omega_x + w @ Omega))


def cell(periods, count):
    """Places that lie evenly over the cell whose sides are the columns of a matrix."""
    s = np.arange(count) / count
    return np.stack(np.meshgrid(s, s, indexing="ij"), -1) @ periods.T


def pixels(light, periods, Omega_x, width, mean):
    """Largest error of one BRDF, of the mean given, over pixels anywhere in the cell.

    `light` is what the eye sees over the cell, less the wave along the base: it is periodic, and a
    Gaussian takes from each of its harmonics what that harmonic's frequency tells.
    """
    count = light.shape[0]
    m = np.fft.fftfreq(count, 1.0 / count)
    k = np.stack(np.meshgrid(m, m, indexing="ij"), -1) @ np.linalg.inv(periods)
    kept = np.exp(-2.0 * (np.pi * width) ** 2 * np.sum((k + Omega_x) ** 2, -1))
    seen = np.fft.ifft2(np.fft.fft2(light) * kept)
    return np.abs(seen - mean * kept[0, 0]).max()


def pixel_by_rays(relief, e, frequencies, width, middle, step):
    """What one pixel gets: rays over a square of twelve deviations, each weighed by a Gaussian."""
    t = np.arange(-6.0 * width, 6.0 * width, step)
    u = np.stack(np.meshgrid(t, t, indexing="ij"), -1) + middle
    weight = np.exp(-0.5 * np.sum((u - middle) ** 2, -1) / width**2)
    return np.sum(weight * wave(traced(u, relief, e), *frequencies)) / np.sum(weight)
