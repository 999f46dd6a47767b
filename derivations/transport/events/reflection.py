"""BRDF convolution: D05 (15)-(16), §4.5, R07 §10, from the shading integral.

R07 (51) and the step from it to D05 (20) are looked at critically: a derivative is not a bandwidth.
"""

from __future__ import annotations

import functools

import jax
import jax.numpy as jnp
import numpy as np
import sympy as sp

from derivations.squares import square_error
from derivations.transport.events import _reflection_bounds as bounds
from firstorder.checks.cases import bell, light
from firstorder.checks.tolerance import fitted_order
from firstorder.conventions import Frame
from firstorder.fields import Function, GaussianProfile, gaussian
from firstorder.ledger import Check, Counterexample, Row, na
from firstorder.transport import Curvature, Mirror, Reflection, TabulatedProfile

x, t, k, o1, o2, w, s = sp.symbols("x theta k Omega_x Omega_theta w s", real=True)
_OUT = Frame(("x", "theta"), "outgoing")
REFLECTION = "firstorder.transport.events.reflection.Reflection"
BLEND = "firstorder.transport.events.reflection.Blend"
SIGMA = 0.3


# ---- Proofs ------------------------------------------------------------------------------------


def convolution_theorem():
    """Transform over theta of `int E(w) rho(theta - w) dw`: with s = theta - w the phases split."""
    exponent = (o1 * x + o2 * t).subs(t, s + w)
    return [sp.expand(exponent - (o1 * x + o2 * w) - o2 * s), sp.diff(s + w, s) - 1]


def semi_convolution():
    """A product over x at each Omega_theta is a convolution over Omega_x alone, on harmonics.

    `E(x) = e^(2 pi i a x)`, `rho(x) = e^(2 pi i b x)`, for all a and b: energy at a + b, as of
    the convolution of two Diracs; and Omega_theta is untouched, because both carry the same.
    """
    a, b = sp.symbols("a b", real=True)
    i2pi = 2 * sp.pi * sp.I
    product = sp.exp(i2pi * a * x) * sp.exp(i2pi * b * x)
    return [sp.simplify(product - sp.exp(i2pi * (a + b) * x)), *convolution_theorem()]


def reciprocal_in_the_mirror_parameterisation():
    """`rho'(theta_o - theta_r)` with `theta_r = -theta_i` is symmetric in its two angles."""
    i, o, a, b = sp.symbols("i o a b", real=True)

    def brdf(incoming, outgoing):
        r = outgoing - (-incoming)
        return sp.exp(-a * r**2) + b * r**3

    return sp.expand(brdf(i, o) - brdf(o, i))


def local_angle_in_the_lobe():
    """The lobe needs the local outgoing angle: theta_o' - theta_r' = theta_o + theta_i - 2 k x."""
    i, o = sp.symbols("theta_i theta_o", real=True)
    local_out, mirror = o - k * x, -(i - k * x)
    return sp.expand((local_out - mirror) - (o + i - 2 * k * x))


def distant_light():
    """`B = int L(w) rho(2 k x - theta - w) dw`: B_x by parts is `2 k int L_w rho`."""
    L, rho = sp.Function("L"), sp.Function("rho")
    integrand = L(w) * rho(2 * k * x - t - w)
    by_parts = sp.diff(-2 * k * L(w) * rho(2 * k * x - t - w), w)
    wanted = 2 * k * L(w).diff(w) * rho(2 * k * x - t - w)
    return sp.simplify((sp.diff(integrand, x) - wanted - by_parts).doit())


def bernstein_is_sharp():
    """For one harmonic at the limit, |f'| reaches `2 pi Omega max |f|` and not `Omega`."""
    W, A = sp.symbols("W A", positive=True)
    f = A * sp.cos(2 * sp.pi * W * s)
    return sp.simplify(f.diff(s).subs(s, 1 / (4 * W)) + 2 * sp.pi * W * A)


# ---- Numbers -----------------------------------------------------------------------------------


def _lobe(angle):
    return np.exp(-0.5 * (angle / SIGMA) ** 2) / (SIGMA * np.sqrt(2.0 * np.pi))


def shaded(k, x, theta_o) -> float:
    """Reflected light of a curved surface by the plain shading integral in global angles."""
    incoming = np.linspace(-6.0, 6.0, 4001)
    values = np.array([bell(x, a) for a in incoming])
    # The mirror direction of `a` about the normal k x is 2 k x - a.
    lobe = _lobe(theta_o - (2.0 * k * x - incoming))
    return float(np.sum(values * lobe) * (incoming[1] - incoming[0]))


def unprimed(k, x, theta_o) -> float:
    """D05 (15) as printed: the global outgoing angle against the local mirror direction."""
    incoming = np.linspace(-6.0, 6.0, 4001)
    values = np.array([bell(x, a) for a in incoming])
    lobe = _lobe(theta_o - (k * x - incoming))  # theta_r' = -(theta_i - k x)
    return float(np.sum(values * lobe) * (incoming[1] - incoming[0]))


LOCAL = Counterexample({"k": 0.8, "x": 0.5, "theta_o": 0.4}, unprimed, shaded)


@functools.cache
def shaded_path(kappa: float):
    """The events of the same."""
    return (
        light()
        >> Curvature(kappa)
        >> Mirror()
        >> Reflection(GaussianProfile(SIGMA, frame=_OUT))
        >> Curvature(kappa, back=True)
    ).light


def path_error() -> float:
    """Events against the plain integral."""
    rays = [(0.5, 0.4), (-0.3, 0.2)]
    return max(abs(float(shaded_path(0.8)(*ray)) - shaded(0.8, *ray)) for ray in rays)


def _skewed(angle):
    """A lobe that is not even: of an even one, no exchange of angles shows anything."""
    return _lobe(angle) * (1.0 + 0.5 * np.tanh(angle / SIGMA))


def exchanged(i, o) -> float:
    """|rho'(o' - r') - rho'(r' - o')|: the printed formula with its own two angles exchanged."""
    mirror = -i
    return float(abs(_skewed(o - mirror) - _skewed(mirror - o)))


def asymmetry(i, o) -> float:
    """|rho(i -> o) - rho(o -> i)| of the lobe, tracing both ways about the normal."""

    def brdf(incoming, outgoing):
        d = np.array([-np.sin(incoming), np.cos(incoming)])
        mirror = np.array([-d[0], d[1]])
        angle = np.arctan2(-mirror[0], mirror[1])
        return _skewed(outgoing - angle)

    return float(abs(brdf(i, o) - brdf(o, i)))


def response_asymmetry(i, o) -> float:
    """The same of the events: a narrow beam from i seen at o, and from o seen at i."""
    lobe = TabulatedProfile([0.0, 1.0, 3.0, 0.5, 0.0], 0.3, frame=_OUT)

    def seen(incoming, outgoing):
        beam = gaussian((0.0, incoming), (1.0, 0.1))
        return float((beam >> Mirror() >> Reflection(lobe)).light(0.0, outgoing))

    return abs(seen(i, o) - seen(o, i))


def _sheared(omega_x, omega_theta, mirrored) -> float:
    """Magnitude of the spectrum after a blend that varies as cos(2 pi x), by plain sums."""
    h = 0.05
    axis = np.arange(-5.0, 5.0, h)
    sign = -1.0 if mirrored else 1.0
    values = np.array([[bell(a, sign * b) for b in axis] for a in axis])
    over_angle = values @ np.exp(-2j * np.pi * omega_theta * axis) * h
    over_angle *= np.cos(2.0 * np.pi * 0.3 * axis) * np.exp(-2 * (np.pi * SIGMA * omega_theta) ** 2)
    return float(abs(np.sum(over_angle * np.exp(-2j * np.pi * omega_x * axis)) * h))


@functools.cache
def semi_spectra() -> float:
    """D05 §4.5's intermediate space: transforms over the angle alone multiply, at each x."""
    from firstorder.checks.registry import all_cases

    case = all_cases()["spatially varying BRDF"]
    h = 0.06
    axis = np.arange(-6.0, 6.0, h)
    error = 0.0
    for place, W in ((0.3, 0.2), (-0.5, 0.45)):
        phase = np.exp(-2j * np.pi * W * axis)
        shade = np.asarray(jax.vmap(case.step(case.field).at)(jnp.stack(
            [jnp.full(axis.size, place), jnp.asarray(axis)], axis=-1))) @ phase * h  # fmt: skip
        before = np.array([bell(place, a) for a in axis]) @ phase * h
        width = 0.35 + 0.1 * np.cos(2.0 * np.pi * place / 2.4 + 0.4)
        error = max(error, abs(shade - before * np.exp(-2.0 * (np.pi * width * W) ** 2)))
    return float(error)


def distant(route) -> float:
    """R07 §10's `B_x = 2 k (L_theta (*) rho)` for light of direction alone."""
    kappa = 0.8
    sky = Function(lambda x, a: jnp.exp(-((a - 0.2) ** 2)) + 0.0 * x)
    B = (
        sky
        >> Curvature(kappa)
        >> Mirror()
        >> Reflection(GaussianProfile(SIGMA, frame=_OUT), nodes=80)
        >> Curvature(kappa, back=True)
    ).light
    u = jnp.array([0.3, 0.1])
    a = np.linspace(-6.0, 6.0, 4001)
    slope = -2.0 * (a - 0.2) * np.exp(-((a - 0.2) ** 2))
    r = 2 * kappa * 0.3 - 0.1
    formula = 2.0 * kappa * np.sum(slope * _lobe(r - a)) * (a[1] - a[0])
    if route == "jet":
        return abs(float(B.jet(u).gradient[0]) - formula)
    return abs(float(jax.grad(B.at)(u)[0]) - formula)


def image_order() -> float:
    """R07 (51) against the traced image of a shading-curved plane, as the eye goes up.

    Eye at height z above a plane whose shading normal is k x; the pixel u sees x = z u / gamma at
    the outgoing angle arctan(u / gamma). The neglected part falls as 1 / z at fixed x.
    """
    kappa, gamma, place = 0.8, 1.0, 0.05

    def B(at, out):
        variance = SIGMA**2 + 0.16
        r = 2.0 * kappa * at - out
        return np.sqrt(0.16 / variance) * np.exp(-0.5 * (r - 0.3) ** 2 / variance)

    heights, errors = np.array([20.0, 40.0, 80.0, 160.0]), []
    for z in heights:
        u, h = gamma * place / z, 1e-4 * gamma / z

        def image(pixel, z=z):
            return B(z * pixel / gamma, np.arctan(pixel / gamma))

        exact = (image(u + h) - image(u - h)) / (2.0 * h)
        r = 2.0 * kappa * place - np.arctan(u / gamma)
        variance = SIGMA**2 + 0.16
        L_theta = -(r - 0.3) / variance * B(place, 2.0 * kappa * place - r)
        cosine = np.cos(np.arctan(u / gamma))
        errors.append(abs(2.0 * kappa * z / (gamma * cosine) * L_theta / exact - 1.0))
    return fitted_order(heights, errors)


# ---- Rows --------------------------------------------------------------------------------------


def _squares(case: str) -> dict:
    return {
        "autodiff": Check(
            lambda: max(square_error(case, p) for p in ("gradient", "hessian")), 1e-10
        ),
        "fourier": Check(lambda: square_error(case, "spectrum"), 1e-9),
        "brute_force": Check(lambda: square_error(case, "value"), 1e-10),
    }


_LOCAL = {**_squares("reflection"), "brute_force": Check(path_error, 1e-10)}

ROWS = [
    Row(
        "D05.15",
        "misprint",
        REFLECTION,
        local_angle_in_the_lobe,
        **_LOCAL,
        corrected="l_o'(x, theta_o') = int dE_r'(x, theta_r') rho'(theta_o' - theta_r') dtheta_r'",
        counterexample=LOCAL,
        note="theta_o lacks its prime (in the text extraction; look at the page).",
    ),
    Row("D05.16", "identity", REFLECTION, convolution_theorem, **_squares("reflection")),
    Row(
        "D05.T1.7",
        "identity",
        REFLECTION,
        convolution_theorem,
        **_squares("reflection"),
        note="rho' stands for its transform, as in (16).",
    ),
    Row(
        "D05.s4.1f",
        "over-claim",
        REFLECTION,
        reciprocal_in_the_mirror_parameterisation,
        autodiff=na("no derivative"),
        fourier=na("no spectrum"),
        brute_force=Check(
            lambda: max(asymmetry(0.5, 0.2), asymmetry(-0.7, 0.9), response_asymmetry(-0.4, 0.6)),
            1e-12,
        ),
        corrected="rho'(theta_o' - theta_r') = rho'(theta_o' + theta_i') is reciprocal.",
        counterexample=Counterexample({"i": -0.4, "o": 0.6}, exchanged, asymmetry),
        note="Reciprocity exchanges the incoming and the outgoing direction (true: traced, for a "
        "skewed lobe). The formula changes only if the outgoing and the mirror direction are "
        "exchanged (printed), which is not what reciprocity asks, and only if the lobe is not "
        "even. What is not reciprocal is f(theta_i') rho' of §4.3.",
    ),
    Row(
        "D05.s4.5a",
        "identity",
        REFLECTION,
        semi_convolution,
        autodiff=Check(lambda: square_error("spatially varying BRDF", "hessian"), 1e-10),
        fourier=Check(semi_spectra, 1e-9),
        brute_force=Check(lambda: square_error("spatially varying BRDF", "value"), 1e-10),
    ),
    Row("D05.s4.5", "identity", REFLECTION, semi_convolution, **_squares("spatially varying BRDF")),
    Row("D05.s4.5b", "identity", REFLECTION, convolution_theorem, **_squares("reflection")),
    Row(
        "D05.s4.5c",
        "identity",
        BLEND,
        semi_convolution,
        **_squares("blend of BRDFs"),
        note="Each term of the blend is a texture times a lobe.",
    ),
    Row("D05.s4.5d", "identity", BLEND, semi_convolution, **_squares("blend of BRDFs")),
    Row(
        "D05.T1.10",
        "misprint",
        REFLECTION,
        semi_convolution,
        **_squares("spatially varying BRDF"),
        corrected="dEhat_r' (x)_x rhohat, of the mirrored irradiance as in §4.5",
        counterexample=Counterexample(
            {"omega_x": 0.5, "omega_theta": 0.4},
            lambda omega_x, omega_theta: _sheared(omega_x, omega_theta, False),
            lambda omega_x, omega_theta: _sheared(omega_x, omega_theta, True),
        ),
        note="The index r is missing: without the mirror Omega_theta has the other sign.",
    ),
    Row(
        "R07.s10d",
        "identity",
        REFLECTION,
        distant_light,
        autodiff=Check(lambda: distant("autodiff"), 1e-10),
        fourier=na("no spectrum"),
        brute_force=Check(lambda: distant("jet"), 1e-10),
    ),
    Row(
        "R07.51",
        "approximation",
        REFLECTION,
        distant_light,
        autodiff=Check(lambda: distant("autodiff"), 1e-10),
        fourier=na("no spectrum"),
        brute_force=Check(lambda: abs(image_order() + 1.0), 0.1),
        note="First order in (n_0 . v) / (2 |k| z), which must be small; a large gamma is no help.",
    ),
    Row(
        "R07.s10e",
        "over-claim",
        REFLECTION,
        bernstein_is_sharp,
        autodiff=na("no derivative"),
        fourier=Check(bounds.bernstein_violation, 1e-12),
        brute_force=Check(bounds.bernstein_reached, 1e-4),
        corrected="|L_theta (x) rho| <= 2 pi Omega_rho max |L (x) rho| (Bernstein), a bound",
        counterexample=Counterexample(
            {"Omega": 0.4, "A": 2.0}, lambda Omega, A: Omega, bounds.blurred_slope
        ),
        note="(51) is a derivative, radiance per pixel; (20) a bandwidth, cycles per pixel. They "
        "share the factor 2 k z / (n_0 . v); the rest differs by 2 pi and the light's amplitude.",
    ),
]
