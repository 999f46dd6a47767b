"""Slopes and angles, and what renaming a direction does to spectra.

D05 §2.1, §4, Figs. 3 and 8. Starts from the inverse tangent as an integral.
"""

from __future__ import annotations

import jax.numpy as jnp
import numpy as np
import sympy as sp

from firstorder.checks.tolerance import fitted_order
from firstorder.conventions import FLATLAND, FLATLAND_SLOPE
from firstorder.ledger import Check, Counterexample, Row, na
from firstorder.transport.events.slopes import ToAngle, ToSlope, v_D_theta

v, s = sp.symbols("v s", positive=True)
theta = sp.Symbol("theta", real=True)


def expansion():
    """The angle is int_0^v ds / (1 + s^2), and its inverse to third order."""
    angle = sp.integrate(1 / (1 + s**2), (s, 0, v))
    series = sp.series(sp.tan(theta), theta, 0, 5).removeO() - (theta + theta**3 / 3)
    return sp.tan(angle) - v, series


def local_frequency():
    """Phase 2 pi W v as a function of theta: its local frequency is W dv / dtheta = W (1 + v^2)."""
    W = sp.Symbol("W")
    local = sp.diff(W * sp.tan(theta), theta)
    return sp.simplify(local - W * (1 + sp.tan(theta) ** 2))


def order_of_the_linearisation() -> float:
    """How far from 3 the fitted order of the displacement `tan(theta) - theta` is."""
    radii = np.array([0.05, 0.1, 0.2])
    errors = [float(ToAngle().linearised(jnp.zeros(2), r).error(FLATLAND_SLOPE)) for r in radii]
    return abs(fitted_order(radii, errors) - 3.0)


def order_backwards() -> float:
    """The same for `arctan(v) - v`."""
    radii = np.array([0.05, 0.1, 0.2])
    errors = [float(ToSlope().linearised(jnp.zeros(2), r).error(FLATLAND)) for r in radii]
    return abs(fitted_order(radii, errors) - 3.0)


def measured_frequency(v0, sigma, Omega_v):
    """Mean frequency in theta of a packet of frequency Omega_v in v, about the slope v0.

    By the discrete transform of its samples; no derivative of the tangent is taken.
    """
    n, width = 16384, 2.8
    angle = (np.arange(n) - n / 2) * (width / n)
    slope = np.tan(angle)
    packet = np.exp(-0.5 * ((slope - v0) / sigma) ** 2 + 2j * np.pi * Omega_v * slope)
    power = np.abs(np.fft.fft(packet)) ** 2
    return float(np.sum(np.fft.fftfreq(n, width / n) * power) / np.sum(power))


def stretched() -> float:
    """Relative difference between the measured frequency and (1 + v0^2) Omega_v, narrow packets."""
    worst = 0.0
    for v0 in (0.0, 0.2, 0.5, 1.0):
        # The mean of 1 + v^2 over the packet's energy in theta.
        slope = np.linspace(v0 - 0.4, v0 + 0.4, 4001)
        energy = np.exp(-(((slope - v0) / 0.05) ** 2)) / (1.0 + slope**2)
        mean = np.sum((1.0 + slope**2) * energy) / np.sum(energy)
        worst = max(worst, abs(measured_frequency(v0, 0.05, 40.0) / (40.0 * mean) - 1.0))
    return worst


def counted() -> float:
    """The same by the distance of neighbouring zeros of a wave in the slope, found by bisection."""
    from scipy.optimize import brentq

    Omega_v, worst = 4000.0, 0.0
    for v0 in (0.2, 0.5, 1.0):
        phase = round(2.0 * Omega_v * v0)
        zeros = [
            brentq(lambda a, k=k: 2.0 * Omega_v * np.tan(a) - k, 0.0, 1.2, xtol=1e-15)
            for k in (phase - 1, phase + 1)
        ]
        frequency = 1.0 / (zeros[1] - zeros[0])
        stretch = float(v_D_theta(jnp.arctan(v0)))
        worst = max(worst, abs(frequency / (Omega_v * stretch) - 1.0))
    return worst


ROWS = [
    Row(
        "D05.s2.1a",
        "approximation",
        implements="firstorder.transport.events.slopes.ToAngle",
        symbolic=expansion,
        autodiff=Check(order_of_the_linearisation, 0.05),
        fourier=na("no spectrum"),
        brute_force=Check(order_backwards, 0.05),
        note="Third order: a slope is misplaced by theta^3 / 3; 1 % of theta at 10 degrees, "
        "10 % at 30, 27 % at 45.",
    ),
    Row(
        "D05.s4a",
        "over-claim",
        implements="firstorder.transport.events.slopes.v_D_theta",
        symbolic=local_frequency,
        autodiff=na("spectral"),
        fourier=Check(stretched, 1e-9),
        brute_force=Check(counted, 1e-6),
        corrected="the local angular frequency is multiplied by dv / dtheta = 1 + v^2: "
        "by at most 1 / cos^2(a) on |theta| <= a",
        counterexample=Counterexample(
            {"v0": 1.0, "sigma": 0.05, "Omega_v": 40.0},
            printed=lambda v0, sigma, Omega_v: Omega_v,
            true=measured_frequency,
        ),
        note="True near the centre: 3 % at 10 degrees, 33 % at 30, twice the frequency at 45.",
    ),
]
