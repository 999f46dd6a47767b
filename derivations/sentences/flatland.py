"""J12 §3 to §5 in words: radiosity, normalisations, falloff, corners, ends of sums."""

from __future__ import annotations

import itertools

import numpy as np
import sympy as sp

from derivations.flatland.bounces.radiosity import (
    corner_kernel,
    eigenvalue,
    exponent_error,
    room_derivatives,
)
from firstorder.ledger import ROUTES, Check, Counterexample, Row, na

# --- §3.2: diffuse BRDFs and falloff -------------------------------------------------------------


def cosines():
    """The cosine over the half circle and the hemisphere: what a diffuse BRDF is divided by."""
    theta, phi = sp.symbols("theta phi", real=True)
    flat = sp.integrate(sp.cos(theta), (theta, -sp.pi / 2, sp.pi / 2))
    space = sp.integrate(sp.cos(theta) * sp.sin(theta), (theta, 0, sp.pi / 2), (phi, 0, 2 * sp.pi))
    return [flat - 2, space - sp.pi]


def diffuse_albedo() -> float:
    """Share that the library's diffuse BRDF reflects, by the midpoint rule."""
    from firstorder.flatland._radiometry import diffuse_brdf

    n = 20_001
    theta = (np.arange(n) + 0.5) / n * np.pi - np.pi / 2
    shares = [float(np.mean(np.asarray(diffuse_brdf(0.7)(theta, o)) * np.cos(theta)) * np.pi)
              for o in (-1.2, 0.0, 0.4)]  # fmt: skip
    return max(abs(share / 0.7 - 1.0) for share in shares)


def flux_through_circles():
    """All that a small source sends crosses every circle about it: flux over 2 pi r, not r^2."""
    r, flux, d = sp.symbols("r Phi d", positive=True)
    E = sp.Function("E")(r)
    found = sp.solve(sp.Eq(2 * sp.pi * r * E, flux), E)[0]
    slope = sp.simplify(sp.diff(sp.log(found), r) * r)
    facing = (d / r) ** 2 / r  # both cosines over r, of two lines d apart
    return [slope + 1, sp.simplify(facing - d**2 / r**3)]


def falloff_by_autodiff() -> float:
    """Power of the distance in the library's geometry terms, at fixed cosines: -1 and -2."""
    return max(abs(_power(2) + 1.0), abs(_power(3) + 2.0))


def _power(dims):
    import jax
    import jax.numpy as jnp

    from firstorder.scene._geometry_term import geometry_term

    up = jnp.eye(dims)[-1]
    way = jnp.arange(1.0, dims + 1.0) / jnp.linalg.norm(jnp.arange(1.0, dims + 1.0))

    def logarithm(s):
        return jnp.log(geometry_term(0.0 * way, up, jnp.exp(s) * way, -up))

    return float(jax.grad(logarithm)(0.3))


def falloff_by_rays() -> float:
    """Angle that a small piece of curve fills, by its two ends, against the library's G."""
    from firstorder.scene._geometry_term import geometry_term

    half, worst = 1e-4, 0.0
    for r in (0.5, 1.0, 2.0, 4.0):
        at = r * np.array([0.6, 0.8])
        low, high = (np.arctan2(at[0] + s * half, at[1]) for s in (-1.0, 1.0))
        G = geometry_term(np.zeros(2), np.array([0.0, 1.0]), at, np.array([0.0, -1.0]))
        worst = max(worst, abs(0.8 * (high - low) / (2 * half) / float(G) - 1.0))
    return worst


# --- §4.1: scene C -------------------------------------------------------------------------------


def growth_of_the_slope(near, far):
    """|dE/dx| of scene C's wall at a distance from its corner over that at another."""
    slopes = np.abs(room_derivatives(np.array([near, far]))[1])
    return float(slopes[0] / slopes[1])


# --- §4.2: uniform densities ---------------------------------------------------------------------


def uniform_densities():
    """One over the measure of all directions: 2 pi sr and pi rad."""
    theta, phi = sp.symbols("theta phi", real=True)
    sky = sp.integrate(sp.sin(theta), (theta, 0, sp.pi / 2), (phi, 0, 2 * sp.pi))
    return [
        1 / sky - 1 / (2 * sp.pi),
        1 / sp.integrate(1, (theta, -sp.pi / 2, sp.pi / 2)) - 1 / sp.pi,
    ]


def drawn_evenly() -> float:
    """The library's density against the slope of its map from [0, 1], and against 1 / pi."""
    import jax

    from firstorder.sampling import UniformDirections

    u, sampler = np.linspace(0.05, 0.95, 7), UniformDirections()
    density = np.asarray(sampler.density(sampler.sample(u)))
    rate = np.asarray(jax.vmap(jax.grad(sampler.sample))(u))
    return float(max(np.max(np.abs(density * rate - 1.0)), np.max(np.abs(density * np.pi - 1.0))))


# --- §5.1: the ends of the sum -------------------------------------------------------------------


def rising_sectors():
    """(43), borders rise from -pi/2 to pi/2, even light: E = 2 L; cosines vanish at the ends."""
    b = sp.symbols("b", real=True)
    L = sp.Symbol("L")
    borders = [-sp.pi / 2, b, sp.pi / 2]
    E = sum(L * (sp.sin(q) - sp.sin(p)) for p, q in itertools.pairwise(borders))
    return [sp.simplify(E - 2 * L), sp.cos(borders[0]), sp.cos(borders[-1])]


def even_light_by(first, last):
    """(44) for L = 1 between borders at these two ends: `sin(last) - sin(first)`."""
    jumps = [(0.0 - 1.0) * np.sin(first), (1.0 - 0.0) * np.sin(last)]
    return float(sum(jumps))


def even_light(first, last):
    """The cosine over the half circle, by the midpoint rule; borders are no matter."""
    del first, last
    n = 4000
    return float(np.mean(np.cos((np.arange(n) + 0.5) / n * np.pi - np.pi / 2)) * np.pi)


def ends_of_strata() -> float:
    """The library's E of a sky of one from few strata: 2, which both ends bring."""
    from firstorder.flatland import ConstantSky, Receiver, Scene, Segments, primitive
    from firstorder.flatland.estimators import hemicircle_strata, stratified_estimate, trace_strata

    below = primitive(Segments((-1.0, -1.0), (1.0, -1.0)))  # a scene has a shape
    sky = Scene.of(below, environment=ConstantSky(1.0))
    rays = trace_strata(sky, Receiver((0.0, 0.0), 0.0), where=hemicircle_strata(3))
    return abs(float(stratified_estimate(rays).value) / 2.0 - 1.0)


NONE = {"fourier": na("no spectrum")}
ROWS = [
    Row(
        "J12.s3.1a",
        "definition",
        **dict.fromkeys(ROUTES, na("definition")),
        note="By analogy with irradiance; 2 L of a diffuse curve. The text calls dl(x) a "
        "differential area: it is a length, and so [W/m] says.",
    ),
    Row(
        "J12.s3.2a",
        "identity",
        implements="firstorder.flatland._radiometry.diffuse_brdf",
        symbolic=cosines,
        autodiff=na("no derivative"),
        brute_force=Check(diffuse_albedo, 1e-8),
        **NONE,
    ),
    Row(
        "J12.s3.2c",
        "identity",
        implements="firstorder.scene._geometry_term.geometry_term",
        symbolic=flux_through_circles,
        autodiff=Check(falloff_by_autodiff, 1e-12),
        brute_force=Check(falloff_by_rays, 1e-6),
        **NONE,
        note="At fixed cosines; between two parallel lines, or planes, cosines add two powers.",
    ),
    Row(
        "J12.s4.1a",
        "over-claim",
        implements="firstorder.flatland.bounces.radiosity.corner_exponent",
        symbolic=lambda: [*corner_kernel(), *eigenvalue()],
        autodiff=na("measured"),
        brute_force=Check(exponent_error, 1.0),
        **NONE,
        corrected="smooth along each wall between its corners; at a corner E has a power of the "
        "distance that is not whole, and with rho = 0.2 even dE/dx is not bounded",
        counterexample=Counterexample(
            {"near": 1e-6, "far": 1e-3},
            printed=lambda near, far: 1.0 + 0.0 * (near + far),
            true=growth_of_the_slope,
        ),
        note="Printed and true are the slope at one distance from a corner over that at another.",
    ),
    Row(
        "J12.s4.2a",
        "identity",
        symbolic=uniform_densities,
        autodiff=Check(drawn_evenly, 1e-12),
        brute_force=na("one route"),
        **NONE,
    ),
    Row(
        "J12.s5.1a",
        "misprint",
        implements="firstorder.flatland.estimators._irradiance_forms.stratified_estimate",
        symbolic=rising_sectors,
        autodiff=na("no derivative"),
        brute_force=Check(ends_of_strata, 1e-12),
        **NONE,
        corrected="theta_1- = -pi/2 is the first border and theta_(N+1)- = pi/2 the last",
        counterexample=Counterexample(
            {"first": np.pi / 2, "last": -np.pi / 2}, printed=even_light_by, true=even_light
        ),
        note="Their cosines vanish in either order, which is all that (47) needs.",
    ),
]
