"""Parseval: one covariance from the spectrum and from the gradients (D05 §6.2)."""

from __future__ import annotations

import numpy as np
import sympy as sp

from firstorder.ledger import Check, Row, na


def two_ways():
    """The transform of a derivative, by parts; then both second moments of a tilted Gaussian.

    `d(f e) = f' e + f e'` with `e = exp(-2 pi i O u)`: the left side integrates to nothing, so the
    transform of f' is 2 pi i O F, and Plancherel's theorem gives the statement for every f. The
    Gaussian, done by moments, checks the scale and that power, not amplitude, is meant.
    """
    y, Om = sp.symbols("u Omega", real=True)
    f = sp.Function("f")(y)
    e = sp.exp(-2 * sp.pi * sp.I * Om * y)
    by_parts = sp.diff(f * e, y) - (sp.diff(f, y) * e - 2 * sp.pi * sp.I * Om * f * e)
    a, b, c = sp.symbols("P_xx P_xt P_tt", positive=True)
    P = sp.Matrix([[a, b], [b, c]])
    # f = exp(-h.P h / 2): f^2 has covariance P^-1 / 2, and grad f = -f P h.
    from_gradients = P * (P.inv() / 2) * P / (4 * sp.pi**2)
    # |F|^2 = const exp(-4 pi^2 O . P^-1 O) has covariance (8 pi^2 P^-1)^-1.
    from_spectrum = (8 * sp.pi**2 * P.inv()).inv()
    return sp.simplify(by_parts), [sp.simplify(v) for v in from_gradients - from_spectrum]


def _gradients_against_spectrum() -> float:
    """`covariance_of` against `covariance_of_samples` on light that is no Gaussian."""
    import equinox as eqx

    from firstorder.checks.cases import light
    from firstorder.checks.tolerance import normwise
    from firstorder.fields import Function, Grid, covariance_of, covariance_of_samples
    from firstorder.laws import Multiply

    grid = Grid.spanning((90, 91), (5.0, 5.0))
    wave = Function(lambda x, t: 1.0 + 0.5 * x * t + 0.3 * x**2 - 0.2 * t)
    f = Multiply(wave)(light())
    gradients = eqx.filter_jit(lambda f: covariance_of(f, grid).matrix)(f)
    samples = eqx.filter_jit(grid.sample)(f)
    return normwise(gradients, covariance_of_samples(samples, grid, f.frame).matrix)


def _gradients_against_sums() -> float:
    """The Gaussian's closed form against differences and sums in NumPy."""
    from firstorder.checks.cases import bell, light
    from firstorder.checks.tolerance import normwise

    axis, h = np.linspace(-4.5, 4.5, 61), 1e-4
    rays = [(x, t) for x in axis for t in axis]
    f = np.array([bell(*u) for u in rays])
    g = np.array(
        [
            [
                (bell(x + h, t) - bell(x - h, t)) / (2 * h),
                (bell(x, t + h) - bell(x, t - h)) / (2 * h),
            ]
            for x, t in rays
        ]
    )
    return normwise(light().covariance().matrix, g.T @ g / (4 * np.pi**2 * np.sum(f * f)))


ROWS = [
    Row(
        "C.parseval",
        "identity",
        implements="firstorder.fields.covariance.covariance_of",
        symbolic=two_ways,
        autodiff=na("spectral"),
        fourier=Check(_gradients_against_spectrum, 1e-9),
        brute_force=Check(_gradients_against_sums, 1e-6),
        note="Mean squared gradient and bandwidth are one thing; an edge makes both infinite. The "
        "brute-force route takes second-order differences of step 1e-4.",
    ),
]
