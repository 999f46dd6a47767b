"""Point and spot lights, and their spectra (D05 §2.1, Fig. 4), from the Fourier integral."""

from __future__ import annotations

import jax.numpy as jnp
import numpy as np
import sympy as sp

from firstorder.checks.tolerance import fitted_order, normwise
from firstorder.conventions import FLATLAND_SLOPE
from firstorder.fields import GaussianProfile, Grid, discrete_transform, point_light, spot_light
from firstorder.ledger import Check, Row, na

FREQUENCIES = (np.array([-7.3, -0.9, 0.0, 1.7, 40.0]), np.array([-0.8, 0.05, 0.4]))
X, W = 0.23, 0.45  # where the light stands, half of the bulb


def falloff() -> GaussianProfile:
    """The bell over slopes, in the precision that is set when it is asked for."""
    return GaussianProfile(0.3, "v", FLATLAND_SLOPE, 0.8)


# A point ---------------------------------------------------------------------------------------


def point():
    """The Dirac's integral is a phase; a constant in angle is the limit of ever wider bells.

    Their transforms keep the integral b(0) = 1 while their second moment vanishes: a Dirac.
    """
    x, v, w = sp.symbols("x v Omega", real=True)
    x0, s = sp.symbols("x_0 sigma", positive=True)
    wave = sp.exp(-2 * sp.pi * sp.I * w * x)
    dirac = sp.integrate(sp.DiracDelta(x - x0) * wave, (x, -sp.oo, sp.oo))
    bell = sp.exp(-(v**2) / (2 * s**2))
    transform = _transform(bell, v, w)
    mass = sp.integrate(transform, (w, -sp.oo, sp.oo))
    second = sp.integrate(w**2 * transform, (w, -sp.oo, sp.oo))
    return dirac - sp.exp(-2 * sp.pi * sp.I * w * x0), mass - 1, sp.limit(second, s, sp.oo)


def _transform(f, t, w):
    """The Fourier integral of an even function: its cosine transform."""
    return sp.simplify(2 * sp.integrate(f * sp.cos(2 * sp.pi * w * t), (t, 0, sp.oo)))


def point_by_samples() -> float:
    """One column of samples of height 1 / step is a Dirac; its transform is flat at once."""
    h = 0.05
    grid = Grid((9, 61), (h, 0.1), (X, 0.0))
    samples = np.zeros(grid.size)
    samples[4] = np.asarray(falloff()(0.0, grid.axis(1))) / h
    truth = discrete_transform(jnp.asarray(samples), grid, *FREQUENCIES)
    ours = point_light(X, falloff()).spectrum()(*np.meshgrid(*FREQUENCIES, indexing="ij"))
    return normwise(ours, truth)


def point_by_shrinking() -> float:
    """|fitted order - 2|: bulbs of unit strength that shrink, by quadrature."""
    Omega = np.array([1.7, 0.4])
    point = complex(point_light(X, falloff()).spectrum()(*Omega))
    sizes = 0.04 * 0.5 ** np.arange(4)
    errors = [abs(_spot_by_quadrature(Omega, size) / (2 * size) - point) for size in sizes]
    return abs(fitted_order(sizes, errors) - 2.0)


# A spot ----------------------------------------------------------------------------------------


def spot():
    """The Fourier integral of a box about x_0 and of a bell, minus sinc, phase and bell."""
    x, v = sp.symbols("x v", real=True)
    w, o, x0, a, s = sp.symbols("Omega_x Omega_v x_0 a sigma", positive=True)
    wave = sp.exp(-2 * sp.pi * sp.I * w * x)
    box = sp.integrate(wave, (x, x0 - a / 2, x0 + a / 2))
    sinc = sp.sin(sp.pi * a * w) / (sp.pi * w)
    bell = _transform(sp.exp(-(v**2) / (2 * s**2)), v, o)
    return (
        sp.simplify((box - sinc * sp.exp(-2 * sp.pi * sp.I * w * x0)).rewrite(sp.cos)),
        bell - sp.sqrt(2 * sp.pi) * s * sp.exp(-2 * sp.pi**2 * s**2 * o**2),
    )


def _spot_by_quadrature(Omega, half_width: float) -> complex:
    """Gauss-Legendre across the bulb, trapezoid over the slopes, in plain NumPy."""
    t, weight = np.polynomial.legendre.leggauss(160)
    x = X + half_width * t
    v = np.linspace(-3.0, 3.0, 121)
    bell = 0.8 / (0.3 * np.sqrt(2 * np.pi)) * np.exp(-(v**2) / 0.18)
    across = np.sum(half_width * weight * np.exp(-2j * np.pi * Omega[0] * x))
    return complex(across * np.sum(bell * np.exp(-2j * np.pi * Omega[1] * v)) * 0.05)


def spot_by_quadrature() -> float:
    """Largest difference at the frequencies, relative to the largest value."""
    mesh = np.stack(np.meshgrid(*FREQUENCIES, indexing="ij"), -1)
    truth = np.array([_spot_by_quadrature(w, W) for w in mesh.reshape(-1, 2)]).reshape(5, 3)
    ours = spot_light(X, W, falloff()).spectrum()(*np.moveaxis(mesh, -1, 0))
    return normwise(ours, truth)


def spot_by_samples() -> float:
    """Samples whose cells end where the bulb does: each stands for its cell, hence `sinc`."""
    n = 90
    grid = Grid((n + 10, 61), (2 * W / n, 0.1), (X, 0.0))
    light = spot_light(X, W, falloff())
    truth = discrete_transform(grid.sample(light), grid, *FREQUENCIES)
    cells = np.sinc(grid.step[0] * FREQUENCIES[0])[:, None]
    ours = light.spectrum()(*np.meshgrid(*FREQUENCIES, indexing="ij"))
    return normwise(ours, truth * cells)


ROWS = [
    Row(
        "D05.s2.1c",
        "identity",
        implements="firstorder.fields.sources.point_light",
        symbolic=point,
        autodiff=na("spectral"),
        fourier=Check(point_by_samples, 1e-9),
        brute_force=Check(point_by_shrinking, 0.01),
        note="constant in Omega_x times the transform of the falloff, which tends to a Dirac as "
        "the falloff widens; brute force: a shrinking bulb meets it with order 2",
    ),
    Row(
        "D05.s2.1d",
        "identity",
        implements="firstorder.fields.sources.spot_light",
        symbolic=spot,
        autodiff=na("spectral"),
        fourier=Check(spot_by_samples, 1e-9),
        brute_force=Check(spot_by_quadrature, 1e-9),
    ),
]
