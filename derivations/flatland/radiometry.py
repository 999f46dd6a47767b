"""Radiometry of flatland beside space: J12 Table I, (1)-(25), (27), (31) and (32).

Units are symbols that are multiplied as the definitions say; integrals are done from the geometry
(projected lengths and areas, crossed strings, discs). (26) is in the module `geometry`.
"""

from __future__ import annotations

import functools

import numpy as np
import sympy as sp

from derivations.flatland.geometry import subtended
from derivations.ledger import Check, Counterexample, Row, na

J, s, m, rad, sr = sp.symbols("J s m rad sr", positive=True)
W = J / s
theta, phi, w, o = sp.symbols("theta phi w o", real=True)
rho, L = sp.symbols("rho L", positive=True)
HALF = sp.pi / 2

# --- units ---------------------------------------------------------------------------------------

PLANCK, LIGHT, WAVELENGTH = J * s, m / s, m
PHOTON = PLANCK * LIGHT / WAVELENGTH
DENSITY = PHOTON / WAVELENGTH  # of the energy, in wavelength
RADIANCE = {"3D": W / (m**2 * sr), "2D": W / (m * rad)}


def table_disagrees() -> float:
    """How many rows of the library's table differ from the printed units, but for Q_lambda."""
    from firstorder.flatland.radiometry import TABLE_I

    return float(sum(not q.agrees for q in TABLE_I if q.symbol != "Q_lambda"))


def wavelength_rescaled() -> float:
    """(3) measured in nanometres: as a density Q stays, as an energy it would be 10^9 times as big.

    A spectrum of densities 2, 5, 3 on unit steps; the units of the sum are those of the parts.
    """
    metres = np.array([1.0, 2.0, 3.0])
    density = np.array([2.0, 5.0, 3.0])
    nano = 1e9 * metres
    return abs(np.trapezoid(density / 1e9, nano) / np.trapezoid(density, metres) - 1.0)


UNITS = {
    "implements": "firstorder.flatland.radiometry.TABLE_I",
    "autodiff": na("definition"),
    "fourier": na("definition"),
    "brute_force": Check(table_disagrees, 0.0),
}

# --- projected lengths and areas ------------------------------------------------------------------


def projected_length():
    """(12): the width, across a beam, of a piece of curve: the cross product with the beam."""
    t, angle = sp.symbols("t n", real=True)
    piece = sp.Matrix([sp.cos(angle), sp.sin(angle)])
    beam = sp.Matrix([-sp.sin(angle + t), sp.cos(angle + t)])
    return sp.simplify(piece[0] * beam[1] - piece[1] * beam[0] - sp.cos(t))


def projected_area():
    """(11): the box of two edges and the beam has the volume of the projected area."""
    a, b = sp.Matrix(sp.symbols("a1:4", real=True)), sp.Matrix(sp.symbols("b1:4", real=True))
    beam = sp.Matrix(sp.symbols("w1:4", real=True))
    return sp.expand(sp.Matrix.hstack(a, b, beam).det() - a.cross(b).dot(beam))


def counted(angle) -> float:
    """Parallel photons that meet a tilted piece of curve, counted, against the library."""
    from firstorder.flatland.radiometry import foreshortening

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


def over_the_hemicircle(f, x=theta):
    return sp.integrate(f, (x, -HALF, HALF))


def over_the_hemisphere(f):
    return sp.integrate(sp.integrate(f * sp.sin(theta), (theta, 0, HALF)), (phi, 0, 2 * sp.pi))


def even_light():
    """Constant radiance: E = 2 L in flatland and pi L in space."""
    return (
        over_the_hemicircle(L * sp.cos(theta)) - 2 * L,
        over_the_hemisphere(L * sp.cos(theta)) - sp.pi * L,
    )


def disc_overhead():
    """(15) by angle against by area: a disc of radius R at height h above the point."""
    R, h, q = sp.symbols("R h q", positive=True)
    edge = sp.atan(R / h)
    by_angle = 2 * sp.pi * sp.integrate(sp.cos(theta) * sp.sin(theta), (theta, 0, edge))
    by_area = 2 * sp.pi * sp.integrate(h**2 * q / (h**2 + q**2) ** 2, (q, 0, R))
    return sp.simplify(by_angle - by_area)


def light_overhead():
    """(16) by angle against by length: a line light from a to b at height h."""
    a, b = sp.symbols("a b", real=True)
    h, q = sp.symbols("h q", positive=True)
    by_length = sp.integrate(h**2 / (h**2 + q**2) ** sp.Rational(3, 2), (q, a, b))
    by_angle = sp.sin(sp.atan(b / h)) - sp.sin(sp.atan(a / h))
    return sp.simplify(by_length - by_angle)


def coaxial_discs() -> float:
    """(13): flux from one disc to another, four-fold quadrature against the known form factor."""
    R1, R2, h, n = 0.7, 1.1, 0.9, 40
    t, weight = np.polynomial.legendre.leggauss(n)
    q1, q2 = (0.5 * R * (1 + t) for R in (R1, R2))
    a = 2 * np.pi * np.arange(64) / 64
    r2 = (
        q1[:, None, None] ** 2
        + q2[None, :, None] ** 2
        - 2 * q1[:, None, None] * q2[None, :, None] * np.cos(a)
        + h**2
    )
    inner = np.sum(h**2 / r2**2, -1) * 2 * np.pi / 64
    flux = 2 * np.pi * np.einsum("i,j,ij->", 0.5 * R1 * weight * q1, 0.5 * R2 * weight * q2, inner)
    X = 1 + (1 + (R2 / h) ** 2) / (R1 / h) ** 2
    factor = 0.5 * (X - np.sqrt(X**2 - 4 * (R2 / R1) ** 2))
    return abs(flux / (np.pi * np.pi * R1**2 * factor) - 1.0)


@functools.cache
def _scene(name):
    from derivations.flatland._scenes import built

    return built(name)[0]


def crossed_strings() -> float:
    """(14): flux from the light of scene A to its floor, against Hottel's strings."""
    import equinox as eqx

    from firstorder.flatland.radiometry import flux

    def string(a, b):
        return np.hypot(a - b, 1.0)

    strings = string(-1, 0.5) + string(1, -0.5) - string(-1, -0.5) - string(1, 0.5)
    ours = eqx.filter_jit(lambda scene: flux(scene, 0))(_scene("A"))
    return abs(float(ours) / strings - 1.0)


def strings_derived():
    """Hottel's rule, the integral of (16) along the receiver: `Phi = L (crossed - uncrossed)`."""
    a, b, c, d = sp.symbols("a b c d", real=True)  # receiver [a, b] below, light [c, d] above
    h, x = sp.symbols("h x", positive=True)

    def sine(p):
        return (p - x) / sp.sqrt((p - x) ** 2 + h**2)

    def string(p, q):
        return sp.sqrt((p - q) ** 2 + h**2)

    E = sine(d) - sine(c)
    antiderivative = string(c, x) - string(d, x)
    flux = antiderivative.subs(x, b) - antiderivative.subs(x, a)
    strings = string(a, d) + string(b, c) - string(a, c) - string(b, d)
    return sp.simplify(sp.diff(antiderivative, x) - E), sp.simplify(flux - strings)


# --- reflection ----------------------------------------------------------------------------------


def lobe():
    """(22) for a mirror lobe at normal incidence, by the gamma function, for m = 0 to 6."""
    out = []
    for power in range(7):
        p = sp.Integer(power + 1)
        norm = sp.sqrt(sp.pi) * sp.gamma((p + 1) / 2) / sp.gamma(p / 2 + 1)
        out.append(sp.simplify(over_the_hemicircle(sp.cos(theta) ** p) - norm))
    return out


def mirrored_in_space():
    """(19) for a lobe about the mirror direction: `r(w) . o = w . r(o)`."""
    n, a, b = (sp.Matrix(sp.symbols(f"{c}1:4", real=True)) for c in "nab")

    def mirror(u):
        return 2 * n.dot(u) * n - u

    return sp.expand(mirror(a).dot(b) - a.dot(mirror(b)))


def diffuse_energy():
    """(21) and (22): the diffuse BRDFs reflect the albedo."""
    return (
        over_the_hemisphere(rho / sp.pi * sp.cos(theta)) - rho,
        over_the_hemicircle(rho / 2 * sp.cos(theta)) - rho,
    )


def reflected_moments():
    """(24) and (23) from the definition: `dL' = f L cos dw` summed for `f = cos^2(w + o)`."""
    f = sp.cos(w + o) ** 2
    by_definition = over_the_hemicircle(sp.expand_trig(f) * sp.cos(w), w)
    # cos^2(w + o) = (1 + cos 2w cos 2o - sin 2w sin 2o) / 2, moments of cos: 2 and 2/3.
    closed = 1 + sp.cos(2 * o) * sp.Rational(1, 3)
    return sp.simplify(sp.expand_trig(by_definition - closed))


def diffuse_leaves():
    """(31), (32): a BRDF without angles leaves the integral, for every L given by its values."""
    f = sp.Symbol("f")
    radiances = [1, sp.sin(theta), sp.cos(theta) ** 3 + theta**2]
    return [
        sp.simplify(
            over_the_hemicircle(f * R * sp.cos(theta)) - f * over_the_hemicircle(R * sp.cos(theta))
        )
        for R in radiances
    ]


def furnace():
    """(25) corrected: a closed room that emits `1 - rho` and reflects `rho` is filled with 1."""
    return 1 - ((1 - rho) + rho / 2 * over_the_hemicircle(sp.cos(theta)))


def exchanged() -> float:
    """Reciprocity of the library's BRDFs at random angles."""
    from firstorder.flatland.radiometry import diffuse, glossy

    a, b = np.random.default_rng(1).uniform(-1.5, 1.5, (2, 200))
    fs = [diffuse(0.7), glossy(0.6, 0.0), glossy(0.6, 3.5), glossy(0.6, 80.0)]
    return max(float(np.max(np.abs(np.asarray(f(a, b)) - np.asarray(f(b, a))))) for f in fs)


def albedos(exponents=(0.0, 1.0, 3.5, 40.0), n=20001):
    """Share reflected of light from each of 41 angles, by the midpoint rule."""
    from firstorder.flatland.radiometry import glossy

    o = (np.arange(n) + 0.5) / n * np.pi - np.pi / 2
    ws = np.linspace(-1.57, 1.57, 41)
    out = [np.asarray(glossy(1.0, k)(ws[:, None], o)) @ np.cos(o) * np.pi / n for k in exponents]
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
    from firstorder.flatland.radiometry import diffuse, glossy, reflected, reflected_over_curves

    scene, at = _scene("B"), Receiver((0.35, 0.0), 0.2)
    brdf = glossy(0.6, 5.0) if lobe else diffuse(0.7)

    @jax.jit
    def both(out):
        by_angle = reflected(scene, at, out, brdf)
        return by_angle, reflected_over_curves(scene, at, out, brdf, 20_000), irradiance(scene, at)

    return [float(v) for v in both(-0.4)], ray_sum(brdf, -0.4)


def by_rays() -> float:
    (ours, _, _), truth = _reflections(True)
    return abs(ours - truth) / truth


def by_curves() -> float:
    (ours, curves, _), _ = _reflections(True)
    return abs(ours - curves) / ours


def by_irradiance() -> float:
    (ours, _, E), truth = _reflections(False)
    return max(abs(ours - 0.35 * E), abs(ours - truth) * 1e-4) / ours


def furnace_filled(share) -> float:
    """What is sent out in a furnace, by bounces: emission, and each bounce's share of the last."""
    sent = last = 1.0 - share
    for _ in range(2000):
        last = share / 2.0 * 2.0 * last
        sent += last
    return sent


DEFINED = {"autodiff": na("definition"), "fourier": na("definition")}
PLAIN = {"autodiff": na("no derivative"), "fourier": na("no spectrum")}
BOOK = "firstorder.flatland.radiometry."
LEFT_OUT = {**DEFINED, "brute_force": na("definition")}


def _unit(equation, derived, printed, note="", **more):
    """A definition whose unit is that of the table."""
    return Row(
        equation, "definition", symbolic=lambda: derived - printed, note=note, **{**UNITS, **more}
    )


ROWS = [
    _unit("J12.1", PHOTON, J),
    _unit(
        "J12.2",
        DENSITY,
        J / m,
        "Table I says J: right for n_lambda photons, wrong for the integrand of (3).",
    ),
    _unit(
        "J12.3",
        DENSITY * WAVELENGTH,
        J,
        "An energy only if Q_lambda is one per wavelength; the paper says that it ignores this.",
        brute_force=Check(wavelength_rescaled, 1e-12),
    ),
    *(_unit(f"J12.{k}", J / s, W) for k in (4, 5, 6)),
    _unit("J12.7", W / m**2, RADIANCE["3D"] * sr),
    _unit("J12.8", W / m, RADIANCE["2D"] * rad),
    _unit("J12.9", W / (sr * m**2), RADIANCE["3D"]),
    _unit("J12.10", W / (rad * m), RADIANCE["2D"]),
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
        implements=BOOK + "flux",
        symbolic=lambda: [even_light()[0], *strings_derived()],
        **PLAIN,
        brute_force=Check(crossed_strings, 1e-12),
    ),
    Row(
        "J12.15",
        "identity",
        symbolic=disc_overhead,
        **PLAIN,
        brute_force=Check(coaxial_discs, 1e-10),
    ),
    Row(
        "J12.16",
        "identity",
        implements="firstorder.flatland.irradiance.irradiance",
        symbolic=light_overhead,
        **PLAIN,
        brute_force=Check(crossed_strings, 1e-12),
    ),
    Row("J12.17", "definition", symbolic=lambda: RADIANCE["3D"] / (W / m**2) - 1 / sr, **LEFT_OUT),
    Row("J12.18", "definition", symbolic=lambda: RADIANCE["2D"] / (W / m) - 1 / rad, **LEFT_OUT),
    Row("J12.19", "definition", symbolic=mirrored_in_space, **LEFT_OUT),
    Row(
        "J12.20",
        "definition",
        implements=BOOK + "glossy",
        symbolic=na("definition"),
        **DEFINED,
        brute_force=Check(exchanged, 0.0),
    ),
    Row("J12.21", "definition", symbolic=lambda: diffuse_energy()[0], **LEFT_OUT),
    Row(
        "J12.22",
        "definition",
        implements=BOOK + "glossy",
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
        brute_force=Check(coaxial_discs, 1e-10),
    ),
    Row(
        "J12.24",
        "identity",
        implements=BOOK + "reflected",
        symbolic=reflected_moments,
        **PLAIN,
        brute_force=Check(by_rays, 1e-4),
    ),
    Row(
        "J12.25",
        "misprint",
        implements=BOOK + "outgoing",
        symbolic=furnace,
        **PLAIN,
        brute_force=Check(lambda: abs(furnace_filled(0.3) - 1.0), 1e-12),
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
        implements=BOOK + "reflected_over_curves",
        symbolic=subtended,
        **PLAIN,
        brute_force=Check(by_curves, 2e-4),
        note="The error is that of sampled visibility, of first order in the spacing.",
    ),
    Row(
        "J12.31",
        "identity",
        implements=BOOK + "reflected",
        symbolic=diffuse_leaves,
        **PLAIN,
        brute_force=Check(by_irradiance, 1e-8),
    ),
    Row(
        "J12.32",
        "identity",
        implements=BOOK + "diffuse",
        symbolic=diffuse_leaves,
        **PLAIN,
        brute_force=Check(by_irradiance, 1e-8),
    ),
]
