"""D05's abstract and §3 to §6 in words: which axis, which lobe, series, scales, names, windows."""

from __future__ import annotations

import numpy as np
import sympy as sp

from derivations.transport.events.reflection import REFLECTION, semi_convolution, semi_spectra
from firstorder.checks.tolerance import normwise
from firstorder.conventions import Frame
from firstorder.fields import gaussian
from firstorder.ledger import Check, Counterexample, Row, na
from firstorder.transport import Curvature, Outgoing, clamped_cosine_transform

# --- abstract: the axis of the shear -------------------------------------------------------------

K = 0.8
SIZE = np.array([0.5, 0.4])
CENTRE = np.array([0.1, -0.2])


def _bell(x, t):
    return np.exp(-0.5 * (((x - CENTRE[0]) / SIZE[0]) ** 2 + ((t - CENTRE[1]) / SIZE[1]) ** 2))


def _transformed(Omega_x, Omega_theta):
    """The bell's own spectrum, by hand."""
    W = np.array([Omega_x, Omega_theta])
    size = 2.0 * np.pi * SIZE.prod() * np.exp(-2.0 * np.sum((np.pi * SIZE * W) ** 2))
    return size * np.exp(-2j * np.pi * W @ CENTRE)


def summed(light, Omega_x, Omega_theta, half=7.0, n=561):
    """Transform of samples of a light field, by a trapezoid sum."""
    axis = np.linspace(-half, half, n)
    x, t = np.meshgrid(axis, axis, indexing="ij")
    wave = np.exp(-2j * np.pi * (Omega_x * x + Omega_theta * t))
    return np.sum(light(x, t) * wave) * (axis[1] - axis[0]) ** 2


def bent(x, t):
    """What a curved surface meets in its local frame."""
    return _bell(x, t + K * x)


def sheared_along_space():
    """`l(x, theta + k x)`: with theta + k x for theta the exponent loses k Omega_theta at x."""
    x, t, k, Ox, Ot, u = sp.symbols("x theta k Omega_x Omega_theta theta_new", real=True)
    phase = (Ox * x + Ot * t).subs(t, u - k * x)
    return sp.expand(phase - ((Ox - k * Ot) * x + Ot * u))


def along_the_angle(Omega_x, Omega_theta):
    """The abstract's axis: the angular frequency is moved instead."""
    return float(np.real(_transformed(Omega_x, Omega_theta - K * Omega_x)))


def true_shear(Omega_x, Omega_theta):
    return float(np.real(summed(bent, Omega_x, Omega_theta)))


PLACES = ((0.2, 0.3), (-0.1, 0.4), (0.3, -0.2))


def curved_spectrum() -> float:
    """The library's spectrum after curvature against sums of samples."""
    F = Curvature(K)(gaussian(tuple(CENTRE), tuple(SIZE))).spectrum()
    found = np.array([complex(F(*W)) for W in PLACES])
    return normwise(found, np.array([summed(bent, *W) for W in PLACES]))


# --- §3.4: the middle lobe of a blocker ----------------------------------------------------------


def middle_lobe():
    """The transform of V at zero is its integral: of bars, the open share of each period."""
    x, p, q, n = sp.symbols("x p q n", positive=True)
    open_part = sp.integrate(1, (x, -q * p / 2, q * p / 2)) / p
    wave = sp.integrate(sp.cos(2 * sp.pi * n * x / p), (x, -q * p / 2, q * p / 2)) / p
    return [open_part - q, sp.limit(wave, n, 0) - q]


def mean_of_bars(open):
    """V of bars, sampled over a period, averaged."""
    x = (np.arange(20_000) + 0.5) / 20_000 - 0.5
    return float(np.mean(np.abs(x) < 0.5 * open))


def lobes_of_bars() -> float:
    """The library's heights of the middle and the side lobes against sums of samples."""
    from firstorder.shadowfield.plane.periodic import _bars_coefficient

    x = (np.arange(20_000) + 0.5) / 20_000 - 0.5
    worst = 0.0
    for n in range(3):
        height = np.mean((np.abs(x) < 0.15) * np.cos(2.0 * np.pi * n * x))
        worst = max(worst, abs(float(_bars_coefficient(n, 0.3)) - height))
    return float(worst)


# --- §4: series, not transforms ------------------------------------------------------------------


def cosine_series():
    """Coefficients `1 / (2 pi) int cos+ exp(-i n t)` on the circle: the transform at n / (2 pi)."""
    t = sp.Symbol("t", real=True)
    found = []
    for n in range(6):
        series = sp.integrate(sp.cos(t) * sp.cos(n * t), (t, -sp.pi / 2, sp.pi / 2)) / (2 * sp.pi)
        sample = sp.Rational(1, 4) if n == 1 else sp.cos(sp.pi * n / 2) / (sp.pi * (1 - n**2))
        found.append(sp.simplify(series - sample))
    return found


def series_by_samples() -> float:
    """The library's transform at n / (2 pi) against sums around the circle."""
    N = 200_000
    t = (np.arange(N) + 0.5) / N * 2.0 * np.pi
    plus = np.maximum(np.cos(t), 0.0)
    n = np.arange(8)
    true = np.array([np.mean(plus * np.cos(k * t)) for k in n])
    return normwise(np.asarray(clamped_cosine_transform(n / (2.0 * np.pi))) / (2.0 * np.pi), true)


# --- §4.2: the scale of step 7 -------------------------------------------------------------------


def scaled_bell():
    """Second moments of the power spectrum of `l(x / c, theta + theta_1)`, l a bell: x alone."""
    W, c, s, a = sp.symbols("Omega c sigma alpha", positive=True)
    power = sp.exp(-4 * sp.pi**2 * s**2 * W**2)

    def moment(factor):
        p = power.subs(W, factor * W)
        whole = sp.integrate(p, (W, -sp.oo, sp.oo))
        return sp.integrate(W**2 * p, (W, -sp.oo, sp.oo)) / whole

    phase = sp.exp(2 * sp.pi * sp.I * W * a)
    return [sp.simplify(moment(c) * c**2 - moment(1)), sp.simplify(phase * sp.conjugate(phase) - 1)]


def angular_bandwidth(theta_1):
    """Deviation of the angular frequencies after step 7 over that before, by slopes of samples."""
    axis = np.linspace(-6.0, 6.0, 601)
    x, t = np.meshgrid(axis, axis, indexing="ij")

    def deviation(values):
        slope = np.gradient(values, axis, axis=1, edge_order=2)
        return np.sqrt(np.sum(slope**2) / np.sum(values**2))

    after = _bell(x / np.cos(theta_1), t + theta_1)
    return float(deviation(after) / deviation(_bell(x, t)))


def bandwidths_after() -> float:
    """The library's covariance after step 7 over that before: 1 / cos^2 in space, 1 in angle."""
    L = gaussian(tuple(CENTRE), tuple(SIZE), frame=Frame(sense="outgoing"))
    before, after = (np.asarray(f.covariance().matrix) for f in (L, Outgoing(0.6)(L)))
    ratio = np.diag(after) / np.diag(before)
    return normwise(ratio, np.array([1.0 / np.cos(0.6) ** 2, 1.0]))


# --- §4.5: names ---------------------------------------------------------------------------------

WIDTH = 0.3  # of a lobe


def before_the_lobe(Omega):
    """Transform over the angle of the light that arrives in the local frame."""
    return float(np.exp(-2.0 * (np.pi * SIZE[1] * Omega) ** 2))


def after_the_lobe(Omega):
    """The same of what is reflected, by a sum of the convolution; both are one at zero."""
    t = np.linspace(-6.0, 6.0, 2401)
    lit = np.exp(-0.5 * (t / SIZE[1]) ** 2)
    lobe = np.exp(-0.5 * (t / WIDTH) ** 2)
    sent = np.convolve(lit, lobe / lobe.sum(), mode="same")
    return float(np.sum(sent * np.cos(2.0 * np.pi * Omega * t)) / sent.sum())


def reflected_light(cosine_and_mirror, Omega=0.5):
    """Imaginary part of the transform of what a lobe sends: of the light, or of `dE_r'`."""
    t = np.linspace(-np.pi / 2, np.pi / 2, 4001)
    lit = np.exp(-0.5 * ((t - 0.4) / SIZE[1]) ** 2)
    sign = 1.0
    if cosine_and_mirror:
        lit, sign = lit * np.cos(t), -1.0
    wave = np.exp(-2j * np.pi * Omega * sign * t)
    lobe = np.exp(-2.0 * (np.pi * WIDTH * Omega) ** 2)
    return float(np.imag(np.sum(lit * wave)) * (t[1] - t[0]) * lobe)


# --- §5.2: a linear map --------------------------------------------------------------------------


def linear_normals():
    """Angles of the normal of z = -(k_1 x^2 + k_2 y^2) / 2 to first order: linear in (x, y)."""
    x, y, k1, k2, c = sp.symbols("x y k_1 k_2 c", real=True)
    z = -(k1 * x**2 + k2 * y**2) / 2
    angles = sp.Matrix([sp.atan(-z.diff(x)), sp.atan(-z.diff(y))])
    M = angles.jacobian([x, y]).subs({x: 0, y: 0})
    u = sp.Matrix([x, y])
    return [*(M * (c * u) - c * M * u), *(M - sp.diag(k1, k2))]


def normal_of_a_ball(x, radius=2.0):
    """Angle of the normal of a ball at a place beside its top."""
    return float(np.arcsin(x / radius))


# --- §6: windows ---------------------------------------------------------------------------------


def uncertainty():
    """`<x^2> <Omega^2> = 1 / (16 pi^2)` of a bell, nine times that of its first harmonic.

    And no less of any f: `int |x f / s + s f'|^2 >= 0` for all s, by parts.
    """
    s = sp.Symbol("s", positive=True)
    t = sp.Symbol("t", real=True)
    found = []
    for f, times in ((sp.exp(-(t**2) / (2 * s**2)), 1), (t * sp.exp(-(t**2) / (2 * s**2)), 9)):
        whole = sp.integrate(f**2, (t, -sp.oo, sp.oo))
        spread = sp.integrate(t**2 * f**2, (t, -sp.oo, sp.oo)) / whole
        band = sp.integrate(f.diff(t) ** 2, (t, -sp.oo, sp.oo)) / (4 * sp.pi**2 * whole)
        found.append(sp.simplify(spread * band - sp.Rational(times, 16) / sp.pi**2))
    g = sp.Function("g")(t)
    square = (t * g / s + s * g.diff(t)) ** 2
    parts = t**2 * g**2 / s**2 + s**2 * g.diff(t) ** 2 + (t * g**2).diff(t) - g**2
    return [*found, sp.simplify(sp.expand(square - parts))]


def windows() -> float:
    """The library's band of a bell, times how wide its power is: the least that there is."""
    band = np.diag(np.asarray(gaussian((0.0, 0.0), tuple(SIZE)).covariance().matrix))
    return normwise(band * SIZE**2 / 2.0, np.full(2, 1.0 / (16.0 * np.pi**2)))


def never_narrower(trials=200) -> float:
    """By how much sums of three random bells fall below the least product; 0 if none does."""
    rng = np.random.default_rng(60)
    t = np.linspace(-12.0, 12.0, 2401)
    worst = 0.0
    for _ in range(trials):
        f = sum(a * np.exp(-0.5 * ((t - c) / s) ** 2)
                for a, c, s in zip(*rng.uniform([[-1], [-3], [0.4]], [[1], [3], [1.5]], (3, 3)),
                                   strict=True))  # fmt: skip
        slope, whole = np.gradient(f, t), np.sum(f**2)
        product = np.sum(t**2 * f**2) * np.sum(slope**2) / (4.0 * np.pi**2 * whole**2)
        worst = max(worst, 1.0 - 16.0 * np.pi**2 * product)
    return float(worst)


SPECTRAL = {"autodiff": na("spectral")}
ROWS = [
    Row(
        "D05.s0a",
        "misprint",
        implements="firstorder.transport.events.rotation.Curvature",
        symbolic=sheared_along_space,
        fourier=Check(curved_spectrum, 1e-12),
        brute_force=na("one route"),
        **SPECTRAL,
        corrected="along the spatial frequency axis, as §4.1 has it: Omega_theta stays",
        counterexample=Counterexample(
            {"Omega_x": 0.2, "Omega_theta": 0.3}, printed=along_the_angle, true=true_shear
        ),
        note="Along the angle the light field is sheared, and along the angular frequency the "
        "spectrum by travel.",
    ),
    Row(
        "D05.s3.4e",
        "misprint",
        implements="firstorder.shadowfield.plane.periodic._bars_coefficient",
        symbolic=middle_lobe,
        fourier=Check(lobes_of_bars, 1e-8),
        brute_force=na("one route"),
        **SPECTRAL,
        corrected="the average visibility; V is 1 where light passes",
        counterexample=Counterexample(
            {"open": 0.3}, printed=lambda open: 1.0 - open, true=mean_of_bars
        ),
    ),
    Row(
        "D05.s4b",
        "identity",
        implements="firstorder.transport.events.cosine.clamped_cosine_transform",
        symbolic=cosine_series,
        fourier=Check(series_by_samples, 1e-9),
        brute_force=na("one route"),
        **SPECTRAL,
        note="Where (13) has a transform, its values at whole multiples of 1 / (2 pi) cycles per "
        "radian, over 2 pi, are meant; the rest is of light on a line of angles.",
    ),
    Row(
        "D05.s4.2d",
        "misprint",
        implements="firstorder.transport.events.incidence.Outgoing",
        symbolic=scaled_bell,
        fourier=Check(bandwidths_after, 1e-12),
        brute_force=na("one route"),
        **SPECTRAL,
        corrected="the spatial scale, as the sentence before it says",
        counterexample=Counterexample(
            {"theta_1": 0.6},
            printed=lambda theta_1: float(1.0 / np.cos(theta_1)),
            true=angular_bandwidth,
        ),
        note="Printed and true are the factors of the angular bandwidth.",
    ),
    Row(
        "D05.s4.5e",
        "misprint",
        implements=REFLECTION,
        symbolic=semi_convolution,
        fourier=Check(semi_spectra, 1e-9),
        brute_force=na("one route"),
        **SPECTRAL,
        corrected="lhat_o' = dEhat_r' (x)_x rhohat, as the line before it",
        counterexample=Counterexample({"Omega": 0.5}, printed=before_the_lobe, true=after_the_lobe),
        note="The left side lacks its o; without it l' is the light of (11), which arrives.",
    ),
    Row(
        "D05.s4.5f",
        "misprint",
        implements=REFLECTION,
        symbolic=semi_convolution,
        fourier=Check(semi_spectra, 1e-9),
        brute_force=na("one route"),
        **SPECTRAL,
        corrected="the spectrum of the mirrored differential irradiance, dEhat_r'",
        counterexample=Counterexample(
            {"Omega": 0.5},
            printed=lambda Omega: reflected_light(False, Omega),
            true=lambda Omega: reflected_light(True, Omega),
        ),
        note="The formula has it right; the sentence after it speaks of the incoming light.",
    ),
    Row(
        "D05.s5.2i",
        "misprint",
        symbolic=linear_normals,
        autodiff=na("one route"),
        fourier=na("no spectrum"),
        brute_force=na("one route"),
        corrected="a linear map; its matrix is that of the second fundamental form, which is the "
        "bilinear one",
        counterexample=Counterexample(
            {"x": 0.01},
            printed=lambda x: 4.0 * normal_of_a_ball(x),
            true=lambda x: normal_of_a_ball(2.0 * x),
        ),
        note="A form of two equal arguments quadruples over twice the way; the normal's angle "
        "doubles.",
    ),
    Row(
        "D05.s6a",
        "identity",
        symbolic=uncertainty,
        fourier=Check(windows, 1e-12),
        brute_force=Check(never_narrower, 1e-6),
        **SPECTRAL,
        note="With equality for bells: a band of sigma cycles needs a window of 1 / (4 pi sigma).",
    ),
]
