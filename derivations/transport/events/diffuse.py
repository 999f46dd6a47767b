"""Diffuse shading in slopes: the projected area of a direction, its transform, the sum.

D05 §3.3 and §5.1. Starts from the cosine, the direction as a unit vector and the Fourier integral.
"""

from __future__ import annotations

import functools

import equinox as eqx
import jax
import jax.numpy as jnp
import mpmath as mp
import numpy as np

from derivations.squares import square_error
from derivations.transport.events import _diffuse_proofs as proofs
from firstorder.checks.tolerance import fitted_order, normwise
from firstorder.conventions import SPACE_SLOPE
from firstorder.ledger import Check, Counterexample, Row, na
from firstorder.transport.events.diffuse import SlopeWeight, bessel_zk1


def weight_by_autodiff() -> float:
    """`cos(arctan v) d arctan / dv` with the derivative by autodiff, against the closed form."""
    slopes = jnp.linspace(-3.0, 3.0, 41)
    turn = jax.vmap(jax.grad(jnp.arctan))(slopes)
    return normwise(SlopeWeight()(0.0, slopes), jnp.cos(jnp.arctan(slopes)) * turn)


def weight_in_space_by_autodiff() -> float:
    """The same with the unit vector's Jacobian by autodiff."""

    def ray(s):
        return jnp.append(-s, 1.0) / jnp.sqrt(1.0 + s @ s)

    def area(s):
        J = jax.jacfwd(ray)(s)
        return ray(s)[2] * jnp.sqrt(jnp.linalg.det(J.T @ J))

    slopes = jnp.stack(jnp.meshgrid(jnp.linspace(-2, 2, 9), jnp.linspace(-1, 3, 8)), -1)
    slopes = slopes.reshape(-1, 2)
    G = SlopeWeight(SPACE_SLOPE)(0.0, 0.0, slopes[:, 0], slopes[:, 1])
    return normwise(G, jax.vmap(area)(slopes))


def areas_by_quadrature() -> float:
    """The integral of g over an interval against the shadow of an arc of the unit circle."""
    from scipy.integrate import quad

    weight, worst = eqx.filter_jit(SlopeWeight().at), 0.0
    for a, b in ((-0.3, 1.2), (0.0, 4.0)):
        ours = quad(lambda s: float(weight(jnp.array([0.0, s]))), a, b, epsabs=1e-13)[0]
        worst = max(worst, abs(ours - (np.sin(np.arctan(b)) - np.sin(np.arctan(a)))))
    return worst


def discs_by_quadrature() -> float:
    """The integral of G over a disc of slopes against the area of the projected spherical cap."""
    from scipy.integrate import quad

    weight, worst = eqx.filter_jit(SlopeWeight(SPACE_SLOPE).at), 0.0
    for r in (0.4, 2.5):
        ring = lambda t: 2.0 * np.pi * t * float(weight(jnp.array([0.0, 0.0, 0.6 * t, 0.8 * t])))  # noqa: E731
        worst = max(worst, abs(quad(ring, 0.0, r)[0] - np.pi * np.sin(np.arctan(r)) ** 2))
    return worst


FREQUENCIES = np.array([0.0, 1e-5, 0.02, 0.2, 0.7, 1.5, 4.0])


def transform_against_scipy() -> float:
    """Relative error of the transform against SciPy's Bessel function, which JAX has not."""
    from scipy.special import k1

    z = 2.0 * np.pi * FREQUENCIES[1:]
    ours = np.array([SlopeWeight().transform(jnp.array([f])) for f in FREQUENCIES[1:]])
    return float(np.max(np.abs(ours / (2.0 * z * k1(z)) - 1.0)))


def transform_against_integral() -> float:
    """The transform against its Fourier integral, by QUADPACK's rule for such integrals."""
    from scipy.integrate import quad

    def g(s):
        return (1.0 + s * s) ** -1.5

    worst = abs(2.0 - float(SlopeWeight().transform(jnp.array([0.0]))))
    for f in FREQUENCIES[2:]:
        half = quad(g, 0.0, np.inf, weight="cos", wvar=2.0 * np.pi * f, epsabs=1e-12)[0]
        worst = max(worst, abs(2.0 * half - float(SlopeWeight().transform(jnp.array([f])))))
    return worst


def space_against_hankel() -> float:
    """G's transform against its Hankel integral, by mpmath's rule between the zeros."""
    worst = abs(np.pi - float(SlopeWeight(SPACE_SLOPE).transform(jnp.zeros(2))))
    for f in (0.05, 0.3, 0.8):
        k = 2.0 * mp.pi * f
        truth = mp.quadosc(
            lambda r, k=k: 2.0 * mp.pi * r * mp.besselj(0, k * r) / (1 + r * r) ** 2,
            [0, mp.inf],
            omega=k,
        )
        ours = SlopeWeight(SPACE_SLOPE).transform(jnp.array([0.6 * f, -0.8 * f]))
        worst = max(worst, abs(float(truth) - float(ours)))
    return worst


def space_sampled() -> float:
    """The same by the discrete transform of samples, after a Gaussian window that both share.

    A window of standard deviation 2 multiplies G; its own transform blurs the closed form.
    """
    h, n, sigma = 0.125, 256, 2.0
    axis = (np.arange(n) - (n - 1) / 2) * h
    U, V = np.meshgrid(axis, axis, indexing="ij")
    samples = np.exp(-(U**2 + V**2) / (2 * sigma**2)) / (1.0 + U**2 + V**2) ** 2
    F, worst = SlopeWeight(SPACE_SLOPE), 0.0
    # Gauss-Hermite-like trapezoid of the blur, spectral for a Gaussian
    q = np.linspace(-0.56, 0.56, 161)
    S, T = np.meshgrid(q, q, indexing="ij")
    bell = np.exp(-2.0 * (np.pi * sigma) ** 2 * (S**2 + T**2))
    bell /= np.sum(bell)
    for W in ((0.1, 0.2), (0.45, -0.3)):
        sampled = np.sum(samples * np.cos(2 * np.pi * (W[0] * U + W[1] * V))) * h * h
        near = jnp.stack([jnp.asarray(W[0] - S), jnp.asarray(W[1] - T)], -1).reshape(-1, 2)
        blurred = float(jnp.sum(jax.vmap(F.transform)(near) * bell.ravel()))
        worst = max(worst, abs(sampled - blurred))
    return worst


@functools.cache
def _shading():
    """Case, incoming spectrum and reflected spectrum of the square "diffuse shading".

    The step is made here: the square's own was made when the squares were imported.
    """
    from firstorder.checks.cases.products.diffuse import REACH, RHO, WINDOW
    from firstorder.checks.registry import all_cases
    from firstorder.transport.events.diffuse import diffuse

    case = all_cases()["diffuse shading"]
    F = case.field.spectrum()
    return case, F, diffuse(RHO, REACH, WINDOW)(F)


def _blurred(Omega_x: float, Omega_v: float) -> complex:
    """`(l_i (*) ghat)(Omega_x, Omega_v)` by adaptive quadrature, ghat by SciPy."""
    from scipy.integrate import quad
    from scipy.special import k1

    _, F, _ = _shading()
    incoming = eqx.filter_jit(F.at)

    def ghat(s):
        z = 2.0 * np.pi * abs(s)
        return 2.0 * z * k1(z) if z > 0 else 2.0

    def part(take):
        f = lambda s: ghat(s) * take(complex(incoming(jnp.array([Omega_x, Omega_v - s]))))  # noqa: E731
        halves = ((-4.0, 0.0), (0.0, 4.0))
        return sum(quad(f, *ends, epsabs=1e-11, epsrel=1e-10, limit=200)[0] for ends in halves)

    return complex(part(np.real), part(np.imag))


def reflected_by_convolution() -> float:
    """D05 (7) with the Bessel function: what the event computes through a series."""
    from firstorder.checks.cases.products.diffuse import RHO

    _, _, reflected = _shading()
    return max(abs(complex(reflected(f)) - RHO * _blurred(f, 0.0)) for f in (-0.3, 0.0, 0.25))


def differential_by_convolution() -> float:
    """The spectrum of dE off the axis, by the same quadrature."""
    from firstorder.checks.cases.products.diffuse import WINDOW
    from firstorder.transport.events.diffuse import DifferentialIrradiance

    case, _, _ = _shading()
    dE = DifferentialIrradiance(1.0, WINDOW)(case.field.spectrum())
    return max(abs(complex(dE(*W)) - _blurred(*W)) for W in ((0.2, 0.4), (-0.1, -0.3)))


def differential_sampled() -> float:
    """The same from samples of dE."""
    from firstorder.checks.cases.products.diffuse import WINDOW
    from firstorder.fields import Grid, SampledSpectrum
    from firstorder.transport.events.diffuse import DifferentialIrradiance

    case, _, _ = _shading()
    step = DifferentialIrradiance(1.0, WINDOW)
    sampled = SampledSpectrum.of(step(case.field), Grid.spanning((96, 193), (5.0, 4.0)))
    mesh = np.meshgrid([-0.3, 0.1], [-0.5, 0.0, 0.4], indexing="ij")
    return normwise(step(case.field.spectrum())(*mesh), sampled(*mesh))


def decay() -> float:
    """How far from -1 the order of `ghat / (asymptote) - 1` in z is; it tends to 3 / (8 z)."""
    z = np.array([20.0, 40.0, 80.0])
    ratio = (
        2.0 * np.asarray(bessel_zk1(jnp.asarray(z**2))) / (np.sqrt(2.0 * np.pi * z) * np.exp(-z))
    )
    return abs(fitted_order(z, ratio - 1.0) + 1.0)


def half_height() -> float:
    """Distance of ghat's half height from 0.2005 cycles per unit slope."""
    from scipy.optimize import brentq
    from scipy.special import k1

    f = brentq(lambda f: 2.0 * np.pi * f * k1(2.0 * np.pi * f) - 0.5, 0.05, 0.5)
    ours = brentq(lambda f: float(SlopeWeight().transform(jnp.array([f]))) - 1.0, 0.05, 0.5)
    return abs(ours - f) + max(0.0, abs(f - 0.2) - 1e-3)


def furnace(albedo, radiance):
    """Reflected radiance from the balance of flux: out = albedo in, both by quadrature."""
    from scipy.integrate import quad

    flux_in = quad(lambda a: radiance * np.cos(a), -np.pi / 2, np.pi / 2)[0]
    per_radiance = quad(np.cos, -np.pi / 2, np.pi / 2)[0]
    return albedo * flux_in / per_radiance


DIFFUSE = "firstorder.transport.events.diffuse.diffuse"
ROWS = [
    Row(
        "D05.6",
        "misprint",
        implements="firstorder.transport.events.diffuse.DifferentialIrradiance",
        symbolic=proofs.projected_area,
        autodiff=Check(lambda: square_error("diffuse shading", "gradient"), 1e-10),
        fourier=Check(lambda: square_error("diffuse shading", "spectrum"), 1e-9),
        brute_force=Check(lambda: square_error("diffuse shading", "value"), 1e-10),
        corrected="l_o(x) = rho int l_i dA_perp with rho the BRDF: albedo / 2 in flatland, since "
        "int dA_perp = 2 (albedo / pi in space)",
        counterexample=Counterexample(
            {"albedo": 1.0, "radiance": 1.0},
            printed=lambda albedo, radiance: albedo * radiance * 2.0,
            true=furnace,
        ),
        note="Right if rho is read as the BRDF; called the albedo, it makes white glow.",
    ),
    Row(
        "D05.s3.3a",
        "identity",
        implements="firstorder.transport.events.diffuse.SlopeWeight",
        symbolic=proofs.projected_area,
        autodiff=Check(weight_by_autodiff, 1e-10),
        fourier=na("two routes"),
        brute_force=Check(areas_by_quadrature, 1e-10),
    ),
    Row(
        "D05.s3.3b",
        "definition",
        implements="firstorder.transport.events.diffuse.DifferentialIrradiance",
        symbolic=na("definition"),
        autodiff=na("definition"),
        fourier=na("definition"),
        brute_force=Check(lambda: square_error("diffuse shading", "value"), 1e-10),
    ),
    Row(
        "D05.s3.3c",
        "identity",
        implements="firstorder.transport.events.diffuse.DifferentialIrradiance",
        symbolic=proofs.convolved_along_the_slope,
        autodiff=na("spectral"),
        fourier=Check(differential_sampled, 1e-9),
        brute_force=Check(differential_by_convolution, 1e-9),
        note="Along Omega_v alone: as a function of x too, g has the spectrum ghat delta(O_x).",
    ),
    Row(
        "D05.s3.3d",
        "identity",
        implements="firstorder.laws.integrate.Integrate.spectrum",
        symbolic=proofs.slice_at_zero,
        autodiff=na("spectral"),
        fourier=Check(lambda: square_error("diffuse shading", "spectrum"), 1e-9),
        brute_force=Check(reflected_by_convolution, 1e-9),
        note="O_t in the text is O_x.",
    ),
    Row(
        "D05.7",
        "identity",
        implements=DIFFUSE,
        symbolic=lambda: [*proofs.convolved_along_the_slope(), *proofs.slice_at_zero()],
        autodiff=na("spectral"),
        fourier=Check(lambda: square_error("shadow of a comb", "spectrum"), 1e-9),
        brute_force=Check(reflected_by_convolution, 1e-9),
        note="rho is the BRDF, see (6).",
    ),
    Row(
        "D05.s3.3e",
        "identity",
        implements="firstorder.transport.events.diffuse.SlopeWeight.transform",
        symbolic=proofs.bessel,
        autodiff=na("spectral"),
        fourier=Check(transform_against_integral, 1e-9),
        brute_force=Check(transform_against_scipy, 1e-12),
        note="0 times infinity at zero as printed; the limit is 2.",
    ),
    Row(
        "D05.s3.3f",
        "approximation",
        implements="firstorder.transport.events.diffuse.bessel_zk1",
        symbolic=na("measured"),
        autodiff=na("spectral"),
        fourier=Check(decay, 0.05),
        brute_force=Check(half_height, 1e-9),
        note="Half height at 0.20 cycles per unit slope, then sqrt(2 pi z) exp(-z), z = 2 pi O_v, "
        "to first order in 1 / z. A small blur for spectra that reach well beyond 0.2 cycles.",
    ),
    Row(
        "D05.s5.1a",
        "identity",
        implements="firstorder.transport.events.diffuse.SlopeWeight",
        symbolic=proofs.projected_area_in_space,
        autodiff=Check(weight_in_space_by_autodiff, 1e-10),
        fourier=na("two routes"),
        brute_force=Check(discs_by_quadrature, 1e-8),
    ),
    Row(
        "D05.s5.1b",
        "identity",
        implements="firstorder.transport.events.diffuse.SlopeWeight.transform",
        symbolic=proofs.bessel_in_space,
        autodiff=na("spectral"),
        fourier=Check(space_sampled, 1e-8),
        brute_force=Check(space_against_hankel, 1e-9),
        note="Not printed. Ghat = 2 pi^2 q K_1(2 pi q) = (pi / 2) ghat(q): Fig. 5(c) is Fig. 5(b), "
        "turned about its axis.",
    ),
]
