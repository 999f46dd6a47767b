"""Radiometry of flatland beside space: J12 Table I, (1)-(25), (27), (31) and (32).

Units are symbols that are multiplied as the definitions say; integrals are done from the geometry
(projected lengths and areas, crossed strings, discs). (26) is in the module `geometry`.
"""

from __future__ import annotations

import functools

import numpy as np
import sympy as sp

from derivations.flatland._radiometry_discs import coaxial_discs, under_disc
from derivations.flatland._radiometry_proofs import (
    diffuse_energy,
    diffuse_leaves,
    disc_overhead,
    even_light,
    furnace,
    lobe,
    mirrored_in_space,
    projected_area,
    projected_length,
    reflected_moments,
    strings_derived,
)
from derivations.scene.geometry_term import subtended
from firstorder.ledger import ROUTES, Check, Counterexample, Row, na

J, s, m = sp.symbols("J s m", positive=True)

# --- units ---------------------------------------------------------------------------------------

PLANCK, LIGHT, WAVELENGTH = J * s, m / s, m
PHOTON = PLANCK * LIGHT / WAVELENGTH
DENSITY = PHOTON / WAVELENGTH  # of the energy, in wavelength


def wavelength_rescaled() -> float:
    """(3) measured in nanometres: as a density Q stays, as an energy it would be 10^9 times as big.

    A spectrum of densities 2, 5, 3 on unit steps; the units of the sum are those of the parts.
    """
    metres = np.array([1.0, 2.0, 3.0])
    density = np.array([2.0, 5.0, 3.0])
    nano = 1e9 * metres
    return abs(float(np.trapezoid(density / 1e9, nano) / np.trapezoid(density, metres)) - 1.0)


# --- projected lengths and areas ------------------------------------------------------------------


def counted(angle) -> float:
    """Parallel photons that meet a tilted piece of curve, counted, against the library."""
    from firstorder.flatland._radiometry import foreshortening

    n = 200_000
    across = (np.arange(n) + 0.5) / n * 2.0 - 1.0  # photons one 2/n apart across the beam
    # The piece from -1/2 to 1/2 along (cos, sin) of its tilt is met where its shadow is.
    hit = np.abs(across) < 0.5 * abs(np.cos(angle))
    return abs(2.0 * np.mean(hit) - float(foreshortening(angle)))


def shadow_of_square() -> float:
    """The same in space: photons through the shadow of a tilted square, by point-in-square."""
    n = 700
    grid = (np.arange(n) + 0.5) / n * 2.0 - 1.0
    beam = np.array([0.3, -0.4, 0.9]) / np.linalg.norm([0.3, -0.4, 0.9])
    u = np.cross(beam, [1.0, 0.0, 0.0])
    u /= np.linalg.norm(u)
    v = np.cross(beam, u)
    P = grid[:, None, None] * u + grid[None, :, None] * v
    foot = P - P[..., 2:] / beam[2] * beam  # where the photon meets the plane z = 0
    inside = np.all(np.abs(foot[..., :2]) < 0.5, -1)
    return abs(4.0 * np.mean(inside) - beam[2])


# --- integrals -----------------------------------------------------------------------------------


@functools.cache
def _scene(name):
    from derivations.flatland._scenes import built

    return built(name)[0]


def crossed_strings() -> float:
    """(14): flux from the light of scene A to its floor, against Hottel's strings."""
    import equinox as eqx

    from firstorder.flatland._radiometry import incident_flux

    def string(a, b):
        return np.hypot(a - b, 1.0)

    strings = string(-1, 0.5) + string(1, -0.5) - string(-1, -0.5) - string(1, 0.5)
    ours = eqx.filter_jit(lambda scene: incident_flux(scene, 0))(_scene("A"))
    return abs(float(ours) / strings - 1.0)


# --- reflection ----------------------------------------------------------------------------------


def exchanged() -> float:
    """Reciprocity of the library's BRDFs at random angles."""
    from firstorder.flatland._radiometry import diffuse_brdf, phong_brdf

    a, b = np.random.default_rng(1).uniform(-1.5, 1.5, (2, 200))
    fs = [diffuse_brdf(0.7), phong_brdf(0.6, 0.0), phong_brdf(0.6, 3.5), phong_brdf(0.6, 80.0)]
    return max(float(np.max(np.abs(np.asarray(f(a, b)) - np.asarray(f(b, a))))) for f in fs)


def albedos(exponents=(0.0, 1.0, 3.5, 40.0), n=20001):
    """Share reflected of light from each of 41 angles, by the midpoint rule."""
    from firstorder.flatland._radiometry import phong_brdf

    o = (np.arange(n) + 0.5) / n * np.pi - np.pi / 2
    ws = np.linspace(-1.57, 1.57, 41)
    out = [
        np.asarray(phong_brdf(1.0, k)(ws[:, None], o)) @ np.cos(o) * np.pi / n for k in exponents
    ]
    return ws, np.array(out)


def energy() -> float:
    """By how much more than all is reflected, and less than all at normal incidence."""
    ws, share = albedos()
    return max(float(np.max(share) - 1.0), float(np.max(np.abs(share[:, len(ws) // 2] - 1.0))))


def ray_sum(brdf, out, rays=200_000):
    """(24) in scene B by plain rays: only lines and comparisons, in numpy."""
    angle = (np.arange(rays) + 0.5) / rays * np.pi - np.pi / 2
    x, n = np.array([0.35, 0.0]), 0.2
    across, up = -np.sin(angle + n), np.cos(angle + n)
    safe = np.where(up > 1e-9, up, 1.0)
    light, blocker = (x[0] + (y - x[1]) * across / safe for y in (1.0, 0.5))
    lit = (up > 1e-9) & (np.abs(light) < 0.5) & ~(np.abs(blocker) < 0.2)
    f = np.asarray(brdf(angle, out))
    return float(np.sum(f * lit * np.cos(angle)) * np.pi / rays)


@functools.cache
def _reflections(lobe: bool):
    """Both forms in scene B, compiled; and the sum over rays."""
    import jax

    from firstorder.flatland import Receiver, irradiance
    from firstorder.flatland._radiometry import (
        diffuse_brdf,
        phong_brdf,
        reflected_radiance,
        reflected_radiance_over_curves,
    )

    scene, at = _scene("B"), Receiver((0.35, 0.0), 0.2)
    brdf = phong_brdf(0.6, 5.0) if lobe else diffuse_brdf(0.7)

    @jax.jit
    def both(out):
        by_angle = reflected_radiance(scene, at, out=out, brdf=brdf)
        return (
            by_angle,
            reflected_radiance_over_curves(scene, at, out=out, brdf=brdf, count=20_000),
            irradiance(scene, at),
        )

    return [float(v) for v in both(-0.4)], ray_sum(brdf, -0.4)


def by_rays() -> float:
    (ours, _, _), truth = _reflections(True)
    return abs(ours - truth) / truth


def by_curves() -> float:
    (_, curves, _), truth = _reflections(True)
    return abs(curves - truth) / truth


def diffuse_by_rays() -> float:
    """(31): the library's reflected light, with a BRDF without angles, against the rays."""
    (ours, _, _), truth = _reflections(False)
    return abs(ours - truth) / truth


def by_irradiance() -> float:
    """(32): half the albedo times the library's irradiance against rays, with its BRDF."""
    (_, _, E), truth = _reflections(False)
    return abs(0.35 * E - truth) / E


def furnace_filled(share) -> float:
    """What is sent out in a furnace, by bounces: emission, and each bounce's share of the last."""
    sent = last = 1.0 - share
    for _ in range(2000):
        last = share / 2.0 * 2.0 * last
        sent += last
    return sent


def furnace_balanced() -> float:
    """(25) in a furnace: emission and the reflected share of what is sent are what is sent."""
    from firstorder.flatland._radiometry import outgoing_radiance

    sent = furnace_filled(0.3)
    by_angle = (np.arange(20_000) + 0.5) / 20_000 * np.pi - np.pi / 2
    reflected = 0.3 / 2.0 * sent * np.mean(np.cos(by_angle)) * np.pi  # (24), a diffuse BRDF
    return abs(float(outgoing_radiance(1.0 - 0.3, reflected)) / sent - 1.0)


DEFINED = {"autodiff": na("definition"), "fourier": na("definition")}
PLAIN = {"autodiff": na("no derivative"), "fourier": na("no spectrum")}
BOOK = "firstorder.flatland._radiometry."
LEFT_OUT = {**DEFINED, "brute_force": na("definition")}


STATED = dict.fromkeys(ROUTES, na("definition"))


ROWS = [
    Row("J12.1", "definition", symbolic=lambda: PHOTON - J, **LEFT_OUT),
    Row(
        "J12.2",
        "definition",
        symbolic=lambda: DENSITY - J / m,
        **LEFT_OUT,
        note="Table I says J: right for n_lambda photons, wrong for the integrand of (3).",
    ),
    Row(
        "J12.3",
        "definition",
        symbolic=lambda: DENSITY * WAVELENGTH - J,
        **DEFINED,
        brute_force=Check(wavelength_rescaled, 1e-12),
        note="An energy only if Q_lambda is one per wavelength; the paper says it ignores this.",
    ),
    *(Row(f"J12.{k}", "definition", implements=BOOK + "TABLE_I", **STATED) for k in range(4, 11)),
    Row(
        "J12.11",
        "identity",
        symbolic=projected_area,
        **PLAIN,
        brute_force=Check(shadow_of_square, 5e-3),
    ),
    Row(
        "J12.12",
        "identity",
        implements=BOOK + "foreshortening",
        symbolic=projected_length,
        **PLAIN,
        brute_force=Check(lambda: max(map(counted, (0.0, 0.4, -1.2, 1.5))), 2e-5),
    ),
    Row(
        "J12.13",
        "identity",
        symbolic=lambda: even_light()[1],
        **PLAIN,
        brute_force=Check(coaxial_discs, 1e-10),
    ),
    Row(
        "J12.14",
        "identity",
        implements=BOOK + "incident_flux",
        symbolic=lambda: [even_light()[0], *strings_derived()],
        **PLAIN,
        brute_force=Check(crossed_strings, 1e-12),
    ),
    Row(
        "J12.15",
        "identity",
        symbolic=disc_overhead,
        **PLAIN,
        brute_force=Check(lambda: under_disc(0), 1e-10),
    ),
    *(Row(f"J12.{k}", "definition", **STATED) for k in (17, 18)),
    Row("J12.19", "definition", symbolic=mirrored_in_space, **LEFT_OUT),
    Row(
        "J12.20",
        "definition",
        implements=BOOK + "phong_brdf",
        symbolic=na("definition"),
        **DEFINED,
        brute_force=Check(exchanged, 0.0),
    ),
    Row("J12.21", "definition", symbolic=lambda: diffuse_energy()[0], **LEFT_OUT),
    Row(
        "J12.22",
        "definition",
        implements=BOOK + "phong_brdf",
        symbolic=lambda: [diffuse_energy()[1], *lobe()],
        **DEFINED,
        brute_force=Check(energy, 1e-4),
        note="The cosine integrates to 2: the diffuse BRDF is rho / 2, and a lobe's norm another.",
    ),
    Row(
        "J12.23",
        "identity",
        symbolic=reflected_moments,
        **PLAIN,
        brute_force=Check(lambda: under_disc(2), 1e-10),
    ),
    Row(
        "J12.24",
        "identity",
        implements=BOOK + "reflected_radiance",
        symbolic=reflected_moments,
        **PLAIN,
        brute_force=Check(by_rays, 1e-4),
    ),
    Row(
        "J12.25",
        "misprint",
        implements=BOOK + "outgoing_radiance",
        symbolic=furnace,
        **PLAIN,
        brute_force=Check(furnace_balanced, 1e-8),
        corrected="L(x -> theta') = L^e(x -> theta') + L'(x -> theta'): the prime is the reflected",
        counterexample=Counterexample(
            {"share": 0.3},
            # Printed, with L' of (24): reflected light plus the outgoing light itself.
            printed=lambda share: share * 1.0 + 1.0,
            true=furnace_filled,
        ),
        note="In (24) and (27) L' is the reflected radiance, and (28) writes L^e for the emitted.",
    ),
    Row(
        "J12.27",
        "identity",
        implements=BOOK + "reflected_radiance_over_curves",
        symbolic=subtended,
        **PLAIN,
        brute_force=Check(by_curves, 2e-4),
        note="The error is that of sampled visibility, of first order in the spacing.",
    ),
    Row(
        "J12.31",
        "identity",
        implements=BOOK + "reflected_radiance",
        symbolic=diffuse_leaves,
        **PLAIN,
        brute_force=Check(diffuse_by_rays, 1e-4),
    ),
    Row(
        "J12.32",
        "identity",
        implements=BOOK + "diffuse_brdf",
        symbolic=diffuse_leaves,
        **PLAIN,
        brute_force=Check(by_irradiance, 1e-4),
    ),
]
