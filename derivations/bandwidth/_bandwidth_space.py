"""Rays off a quadric in space, past blockers, and the spectra of slices of what an eye sees.

Shares no code with `firstorder`. The mirror is `z = r . S r / 2` with the normal +z at the origin;
the eye is at a distance d, theta from +z, in the xz plane. An eye's ray turns by psi: first in the
plane of view, then across it.
"""

from __future__ import annotations

import numpy as np

from derivations.reconstruction import tracer

UP = np.array([0.0, 0.0, 1.0])
WINDOW = 2e-3  # standard deviation of a slice's window [rad]
SAMPLES = 1024


def axes_across(w):
    """Two unit vectors across w: in the xz plane, and y."""
    return np.array([[w[2], 0.0, -w[0]], [0.0, 1.0, 0.0]])


def hits(d, S, theta, psi):
    """Points, unit normals and mirrored directions for turns psi of the eye, shape (..., 2)."""
    to_eye = np.array([np.sin(theta), 0.0, np.cos(theta)])
    w = -(to_eye + psi @ axes_across(to_eye))
    w = w / np.linalg.norm(w, axis=-1, keepdims=True)
    length = np.full(psi.shape[:-1], float(d))
    P = N = w
    for _ in range(8):
        P = d * to_eye + length[..., None] * w
        slope = P[..., :2] @ S
        N = np.concatenate([-slope, np.ones((*slope.shape[:-1], 1))], -1)
        F = P[..., 2] - 0.5 * np.sum(P[..., :2] * slope, -1)
        length = length - F / np.sum(w * N, -1)
    N = N / np.linalg.norm(N, axis=-1, keepdims=True)
    return P, N, w - 2.0 * np.sum(w * N, -1, keepdims=True) * N


def turns(d, S, theta, s, gloss: bool):
    """How lobe and blocker turn per turn of the eye: 2 x 2 each, across the lobe's middle.

    By differences of traced rays: of the lobe's direction, and of that to a point of a blocker at
    the distance 1 / s which the lobe looks at.
    """

    def seen(psi):
        P, N, r = hits(d, S, theta, psi)
        m = r if gloss else N
        return P, m

    middle = seen(np.zeros(2))[1]
    across = axes_across(middle)

    def lobe(psi):
        return seen(psi)[1] @ across.T

    def blocker(psi):
        way = middle / s - seen(psi)[0]
        return (way / np.linalg.norm(way, axis=-1, keepdims=True)) @ across.T

    h = 1e-3 * np.cos(theta) ** 2 / (1.0 + d + d * s)
    return [
        np.stack([tracer.rate(lambda a, e=e, f=f: f(a * e), 0.0, h) for e in np.eye(2)], -1)
        for f in (lobe, blocker)
    ]


def slice_peak(d, S, theta, s, gloss: bool, W_L, W_rho, along) -> float:
    """Frequency at which the spectrum of a slice of the image peaks [cycles per radian].

    Light and blocker are waves of W_L and of -W_L - W_rho cycles per radian about the lobe's
    middle, the lobe a Gaussian narrow enough to let W_rho pass: summed over a quadrature of it,
    pixel by pixel, windowed and transformed.
    """
    step = 10.0 * WINDOW / SAMPLES
    t = (np.arange(SAMPLES) - SAMPLES // 2) * step
    P, N, r = hits(d, S, theta, t[:, None] * along)
    middles = r if gloss else N
    across = axes_across(middles[SAMPLES // 2])
    u, weight = np.polynomial.hermite_e.hermegauss(5)
    sigma = 0.5 / (2.0 * np.pi * max(np.linalg.norm(W_rho), 1.0))
    W_V, signal = -W_L - W_rho, 0.0
    for a, wa in zip(sigma * u, weight, strict=True):
        for b, wb in zip(sigma * u, weight, strict=True):
            w = middles + np.array([a, b]) @ across
            w = w / np.linalg.norm(w, axis=-1, keepdims=True)
            light = np.exp(2j * np.pi * (w @ across.T) @ W_L)
            met = s * P + w if s > 0.0 else w  # where the ray meets the blocker, over its distance
            signal = signal + wa * wb * light * np.exp(2j * np.pi * (met @ across.T) @ W_V)
    windowed = signal * np.exp(-0.5 * (t / WINDOW) ** 2)
    size = np.abs(np.fft.fft(windowed, 16 * SAMPLES))
    return float(abs(np.fft.fftfreq(16 * SAMPLES, step)[np.argmax(size)]))


def reach(d, S, theta, s, gloss: bool, cutoff: float, light: float, tries: int = 2) -> float:
    """Largest peak of slices, over waves at the ends of their bands: the worst and some others."""
    lobe, blocker = turns(d, S, theta, s, gloss) if s > 0.0 else (
        turns(d, S, theta, 1.0, gloss)[0], np.zeros((2, 2))
    )  # fmt: skip
    left, _, right = np.linalg.svd(lobe - blocker)
    rng = np.random.default_rng(5)
    found = []
    for k in range(tries):
        a, b = (_unit(rng.normal(size=2)) for _ in range(2))
        along = _unit(rng.normal(size=2))
        if k == 0:  # the lobe's worst wave, the light's wave that goes its way, and a slice along
            a, along = left[:, 0], right[0]
            b = -_unit(blocker @ along) if s > 0.0 else a
        W_rho = cutoff * a
        W_L = light * b if s > 0.0 else -W_rho
        found.append(slice_peak(d, S, theta, s, gloss, W_L, W_rho, along))
    return max(found)


def _unit(a):
    return a / np.linalg.norm(a)


def configurations(count: int, seed: int, bump: bool = False):
    """Distances, shape operators, angles and slopes; bumps alone, if asked."""
    rng = np.random.default_rng(seed)
    for _ in range(count):
        d, theta, s = rng.uniform(0.3, 2.0), rng.uniform(-1.2, 1.2), rng.uniform(0.2, 2.0)
        a, b, e = rng.uniform(-1.0, 1.0, 3)
        S = -(abs(a) + 0.1) * np.eye(2) if bump else np.array([[a, b], [b, e]])
        yield d, S, theta, s
