"""Band limits measured: spectra of what an eye sees through a window, by exact rays."""

from __future__ import annotations

import numpy as np
from scipy.special import sici

from derivations.reconstruction import tracer

WINDOW = 0.001  # radians: short beside the curvature of the view, long beside a wave


def through_window(d, k, theta, light):
    """Spectrum of what the eye sees through a Gaussian window about the angle theta.

    Args:
        d: distance of the eye.
        k: curvature of the mirror.
        theta: angle of the view.
        light: signal as a function of where the eye looks, and of the mirrored angle.

    Returns:
        Frequencies in increasing order, and the size of the spectrum there.
    """
    offset = (np.arange(2**14) - 2**13) * (12.0 * WINDOW / 2**14)
    signal = light(*tracer.seen(d, theta, k, theta + offset))
    padded = np.fft.fft(signal * np.exp(-0.5 * (offset / WINDOW) ** 2), 2**17)
    frequencies = np.fft.fftfreq(2**17, offset[1] - offset[0])
    return np.fft.fftshift(frequencies), np.abs(np.fft.fftshift(padded))


def measured_peak(d, k, theta, cycles=16000.0) -> float:
    """Frequency at which the spectrum of a wave peaks at the eye, per cycle of the wave."""
    wave = lambda P, mirrored: np.exp(2j * np.pi * cycles * mirrored)  # noqa: E731
    frequencies, size = through_window(d, k, theta, wave)
    return float(abs(frequencies[np.argmax(size)]) / cycles)


def peak_error() -> float:
    """Peaks of measured spectra against `glossy_bandwidth`; the window's own error is stated."""
    from firstorder.bandwidth import glossy_bandwidth

    found = [
        (measured_peak(d, k, th), float(glossy_bandwidth(1.0, d, k, np.cos(th))))
        for d, k, th in ((1.0, -0.5, 0.6), (0.3, 0.9, -0.4), (2.0, 0.8, 0.3), (1.0, 0.0, 0.7))
    ]
    return max(abs(a - b) / b for a, b in found)


def edge_profile(alpha, cutoff: float, light: float):
    """`int_0^inf exp(2 pi i light u) K(alpha - u) du` with the ideal lobe K, cut at `cutoff`.

    K = sin(2 pi cutoff u) / (pi u). Sine and cosine integrals; light above the cutoff.
    """
    a, b = 2.0 * np.pi * (light + cutoff), 2.0 * np.pi * (light - cutoff)
    size = np.maximum(np.abs(alpha), 1e-12)
    (si_a, ci_a), (si_b, ci_b) = sici(a * size), sici(b * size)
    even = np.sign(alpha) * (si_a - si_b)  # the constant halves cancel for light > cutoff
    return np.exp(2j * np.pi * light * alpha) * (even - 1j * (ci_b - ci_a)) / (2.0 * np.pi)


def measured_extent(d, k, theta, depth, cutoff=24000.0, light=36000.0) -> float:
    """Highest frequency at the eye of a wave that an edge cuts and an ideal lobe then blurs.

    The edge stands in the mirror direction, where a narrow lobe sees it. Going up from its
    largest value, the spectrum ends where it falls to half of what it was just before.
    """

    def shaded(P, mirrored):
        edge = tracer.angle(tracer.eye(depth, -theta) - P)
        profile = edge_profile(mirrored - edge, cutoff, light)
        return np.exp(2j * np.pi * light * edge) * profile

    frequencies, size = through_window(d, k, theta, shaded)
    just = int(8.0 / (2.0 * np.pi * WINDOW) / (frequencies[1] - frequencies[0]))
    start = int(np.argmax(size)) + just
    ended = size[start:] < 0.5 * size[start - just : -just]
    return float(frequencies[start + np.argmax(ended)])


def extent_error() -> float:
    """Ends of measured spectra against `occluded_bandwidth`."""
    from firstorder.bandwidth import occluded_bandwidth

    found = []
    for d, k, th, depth in (
        (1.0, 0.0, 0.0, 0.8), (1.0, -0.5, 0.6, 1.5), (0.8, 0.4, -0.4, 1.0)
    ):  # fmt: skip
        ours = float(occluded_bandwidth(24000.0, d, k, np.cos(th), depth, light=36000.0))
        found.append(abs(measured_extent(d, k, th, depth) - ours) / ours)
    return max(found)
