"""The cosine term: D05 §4.1 step 3 and §6.1, from the shading integral and the Fourier integral."""

from __future__ import annotations

import functools

import jax
import jax.numpy as jnp
import numpy as np
import sympy as sp
from scipy.integrate import quad

from derivations.fields import spectrum
from derivations.ledger import Check, Counterexample, Row, na
from derivations.squares import square_error
from firstorder.checks.cases import bell, light
from firstorder.checks.tolerance import fitted_order, normwise
from firstorder.conventions import Frame
from firstorder.fields import GaussianProfile, gaussian
from firstorder.fields.field import Function
from firstorder.quadrature import gauss_legendre
from firstorder.transport import (
    Cosine,
    Curvature,
    Mirror,
    Reflection,
    cos_plus_transform,
)

x, t, o1, o2, s, w = sp.symbols("x theta Omega_x Omega_theta s w", real=True)
k = sp.symbols("k", positive=True)

COSINE = "firstorder.transport.cosine.Cosine"
_OUT = Frame(("x", "theta"), "outgoing")
TRANSFORM = "firstorder.transport.cosine.cos_plus_transform"


# ---- Proofs ------------------------------------------------------------------------------------


def transform_of_the_cosine():
    """The Fourier integral of one hump of the cosine, and its value at the removable pole."""
    W = sp.symbols("W", positive=True)
    integral = sp.integrate(sp.cos(t) * sp.cos(W * t), (t, -sp.pi / 2, sp.pi / 2))
    formula = 2 * sp.cos(sp.pi * W / 2) / (1 - W**2)
    generic = integral.args[0][0] if isinstance(integral, sp.Piecewise) else integral
    pole = sp.limit(formula, W, 1) - sp.integrate(sp.cos(t) ** 2, (t, -sp.pi / 2, sp.pi / 2))
    odd = sp.integrate(sp.cos(t) * sp.sin(3 * t), (t, -sp.pi / 2, sp.pi / 2))
    sinc = sp.pi / 2 * sum(sp.sin(sp.pi * a / 2) / (sp.pi * a / 2) for a in (1 - W, 1 + W))
    return [sp.simplify(generic - formula), pole, odd, sp.simplify(sp.expand_trig(sinc - formula))]


def convolution_over_angle():
    """`int F(Omega - w) C(w) dw` is the transform of f cos, since each w turns f by a phase.

    Insert `C(w) = int c(s) e^(-2 pi i w s) ds`: the integral over w of
    `F(Omega - w) e^(-2 pi i w s)` is `f(s) e^(-2 pi i Omega s)`, shown for a generic Gaussian,
    and the one over s is left.
    """
    a, m = sp.symbols("a m", positive=True)
    f = sp.exp(-sp.pi * a * (s - m) ** 2)
    F = sp.exp(-sp.pi * w**2 / a) * sp.exp(-2 * sp.pi * sp.I * w * m) / sp.sqrt(a)
    # int F(o2 - w) exp(-2 pi i w s) dw with p = o2 - w
    inner = sp.integrate(sp.expand(F * sp.exp(2 * sp.pi * sp.I * w * s)), (w, -sp.oo, sp.oo))
    phase = sp.exp(-2 * sp.pi * sp.I * o2 * s)
    return sp.simplify((inner - f) * phase)


def product_at_each_point():
    """The cosine is a product in ray space: Leibniz's rule on a generic cubic."""
    a = sp.symbols("a0:6")
    powers = [(i, j) for i in range(3) for j in range(2)]
    L = sum(c * x**i * t**j for c, (i, j) in zip(a, powers, strict=True))
    E = L * sp.cos(t)
    return [
        sp.expand(E.diff(t) - (L.diff(t) * sp.cos(t) - L * sp.sin(t))),
        sp.expand(E.diff(x) - L.diff(x) * sp.cos(t)),
    ]


def outer_product():
    """Distant light e(theta + k x) times c(theta): with s = theta + k x, dx = ds / k.

    The Fourier exponent splits into `(Omega_x / k) s + (Omega_theta - Omega_x / k) theta`, so the
    spectrum is the product of the two one-dimensional ones over |k|.
    """
    exponent = (o1 * x + o2 * t).subs(x, (s - t) / k)
    split = o1 / k * s + (o2 - o1 / k) * t
    return [sp.expand(exponent - split), sp.diff((s - t) / k, s) - 1 / k]


def line_of_distant_light():
    """Energy of distant light, at (0, W), moves by M^T to (k W, W): on k Omega_theta = Omega_x."""
    W = sp.symbols("W", real=True)
    energy = sp.Matrix([[1, 0], [k, 1]]).T * sp.Matrix([0, W])
    return sp.expand(k * energy[1] - energy[0])


def soft_shadow():
    """`E(x) = int s(x - v D) b(x - v d2) dv`, D = d1 + d2, is a convolution of magnified images.

    With p' = (D / d1) (x - v d2) the emitter is met at -(d2 ... ): linear in x - p' alone.
    """
    d1, d2, v, p = sp.symbols("d1 d2 v p", positive=True)
    D = d1 + d2
    slope = sp.solve(sp.Eq(p, D / d1 * (x - v * d2)), v)[0]
    emitter = sp.expand((x - slope * D) + (x - p) * d1 / d2)
    blocker = sp.expand((x - slope * d2) - p * d1 / D)
    jacobian = slope.diff(p) + d1 / (d2 * D)
    return [sp.simplify(e) for e in (emitter, blocker, jacobian)]


def with_the_cosine_inside():
    """The gradient of reflected light with its cosine, against R07 (25) that leaves it out.

    d/dx of `f rho(2 n - theta - w)` with `f = L(x, w) cos(w - n)` differs from the right integrand
    by a total derivative in w, which integrates to nothing.
    """
    n, L, rho = sp.Function("n")(x), sp.Function("L"), sp.Function("rho")
    f = L(x, w) * sp.cos(w - n)
    u = 2 * n - t - w
    n_x = n.diff(x)
    cosine, sine = sp.cos(w - n), sp.sin(w - n)
    right = (
        L(x, w).diff(x) * cosine + 2 * n_x * L(x, w).diff(w) * cosine - n_x * L(x, w) * sine
    ) * rho(u)
    total = sp.diff(-2 * n_x * f * rho(u), w)
    return sp.simplify((sp.diff(f * rho(u), x) - right - total).doit())


# ---- Numbers -----------------------------------------------------------------------------------


def transform_by_quadrature(Omega_theta) -> float:
    """The Fourier integral of the hump, adaptively."""
    value = quad(
        lambda a: np.cos(a) * np.cos(2.0 * np.pi * Omega_theta * a), -np.pi / 2, np.pi / 2,
        epsabs=1e-13, epsrel=1e-13,
    )[0]  # fmt: skip
    return float(value)


def printed_transform(Omega_theta) -> float:
    """D05 (13) as printed."""
    return float(2.0 * np.cos(0.5 * np.pi * Omega_theta) / (1.0 - (2.0 * np.pi * Omega_theta) ** 2))


def transform_error() -> float:
    """Closed form against quadrature, at the removable pole and beside it too."""
    pole = 0.5 / np.pi
    frequencies = [0.0, 0.11, pole, pole + 1e-9, 0.3, -0.8, 2.5]
    return max(abs(float(cos_plus_transform(W)) - transform_by_quadrature(W)) for W in frequencies)


def transform_by_samples() -> float:
    """Against midpoint samples, in units of what they miss at two kinks, `h^2 / 6`."""
    h = np.pi / 8192
    a = -np.pi / 2 + h * (np.arange(8192) + 0.5)
    W = np.linspace(-1.0, 1.0, 21)
    sums = (np.cos(a) * np.cos(2.0 * np.pi * W[:, None] * a)).sum(axis=1) * h
    return float(np.max(np.abs(sums - np.asarray(cos_plus_transform(W))))) / (h**2 / 6.0)


def transform_derivative() -> float:
    """dC/dOmega is `-2 pi i` times the transform of theta cos: finite at the pole."""
    pole = 0.5 / np.pi
    slopes = jax.vmap(jax.grad(cos_plus_transform))(jnp.array([0.2, pole, 0.7]))

    def integral(W):
        return -2.0 * np.pi * quad(
            lambda a: a * np.cos(a) * np.sin(2.0 * np.pi * W * a), -np.pi / 2, np.pi / 2,
            epsabs=1e-13,
        )[0]  # fmt: skip

    return max(abs(float(g) - integral(W)) for g, W in zip(slopes, (0.2, pole, 0.7), strict=True))


def falloff(order: int) -> float:
    """Fitted power of the envelope of |F| for a jump in the derivative of order 0, 1 or 2."""
    W = np.array([10.0, 20.0, 40.0, 80.0])
    nodes, weights = gauss_legendre(900)

    def envelope(frequency):
        phases = frequency + np.linspace(0.0, 1.0, 9)[:-1]
        a, b = 0.5 * np.pi * nodes, 0.5 * np.pi * weights
        values = np.cos(a) ** order * b
        return np.max(np.abs(np.exp(-2j * np.pi * phases[:, None] * a) @ values))

    return fitted_order(W, [envelope(f) for f in W])


def falloff_error() -> float:
    """The footnote's powers for n = 0, 1, 2."""
    return max(abs(falloff(n) + n + 1) for n in (0, 1, 2))


@functools.cache
def shading_error() -> float:
    """All seven steps but the frames of the ray, against the shading integral (D05 eq. 8)."""
    kappa, sigma = 0.5, 0.3
    path = (
        light()
        >> Curvature(kappa)
        >> Cosine()
        >> Mirror()
        >> Reflection(GaussianProfile(sigma, frame=_OUT))
        >> Curvature(kappa, back=True)
    )
    error = 0.0
    for place, out in ((0.3, 0.2), (-0.6, -0.7)):
        n = kappa * place

        def integrand(angle, place=place, out=out, n=n):
            mirror = -(angle - n)
            lobe = np.exp(-0.5 * ((out - n - mirror) / sigma) ** 2) / (sigma * np.sqrt(2 * np.pi))
            return bell(place, angle) * lobe * max(np.cos(angle - n), 0.0)

        true = quad(integrand, n - np.pi / 2, n + np.pi / 2, epsabs=1e-13, epsrel=1e-12)[0]
        error = max(error, abs(float(path.light(place, out)) - true))
    return error


def cosine_gradient_error() -> float:
    """`with_the_cosine_inside` by numbers: autodiff of the path against the three terms."""
    kappa, sigma = 0.5, 0.3
    place, out = 0.3, 0.4
    L = light()
    path = (
        L
        >> Curvature(kappa)
        >> Cosine()
        >> Mirror()
        >> Reflection(GaussianProfile(sigma, frame=_OUT))
        >> Curvature(kappa, back=True)
    )
    ours = float(jax.grad(path.light.at)(jnp.array([place, out]))[0])
    n = kappa * place
    nodes, weights = gauss_legendre(200)
    a = n + 0.5 * np.pi * nodes
    jets = L.jets(place, jnp.asarray(a))
    lobe = np.exp(-0.5 * ((2 * n - out - a) / sigma) ** 2) / (sigma * np.sqrt(2 * np.pi))
    c, s_ = np.cos(a - n), np.sin(a - n)
    terms = (jets.gradient[:, 0] + 2.0 * kappa * jets.gradient[:, 1]) * c - kappa * jets.value * s_
    return abs(ours - float(np.sum(np.asarray(terms) * lobe * weights) * 0.5 * np.pi))


def absorbed(kappa, place, out) -> float:
    """R07's (25) without a cosine, times the cosine at the mirror direction."""
    L, sigma = light(), 0.3
    r = 2.0 * kappa * place - out
    nodes, weights = gauss_legendre(200)
    a = r + 3.0 * nodes
    jets = L.jets(place, jnp.asarray(a))
    lobe = np.exp(-0.5 * ((r - a) / sigma) ** 2) / (sigma * np.sqrt(2 * np.pi))
    terms = np.asarray(jets.gradient[:, 0] + 2.0 * kappa * jets.gradient[:, 1])
    return float(np.sum(terms * lobe * weights) * 3.0 * np.cos(r - kappa * place))


def differenced(kappa, place, out) -> float:
    """B_x with its cosine, by differences of the shading integral."""
    sigma, h = 0.3, 1e-3

    def B(at):
        n = kappa * at

        def integrand(a):
            lobe = np.exp(-0.5 * ((2 * n - out - a) / sigma) ** 2) / (sigma * np.sqrt(2 * np.pi))
            return bell(at, a) * lobe * np.cos(a - n)

        return quad(integrand, n - np.pi / 2, n + np.pi / 2, epsabs=1e-13, epsrel=1e-12)[0]

    return (B(place + h) - B(place - h)) / (2.0 * h)


def distant_spectrum(k, Omega_x, Omega_theta) -> float:
    """Real spectrum of `exp(-(theta + k x)^2) cos+(theta)`, by a plain double sum over x, theta."""
    nodes, weights = gauss_legendre(80)
    angle, h = 0.5 * np.pi * nodes, 0.02
    place = np.arange(-14.0, 14.0, h)
    values = np.exp(-((angle[:, None] + k * place) ** 2)) * np.cos(angle)[:, None]
    phase = 2.0 * np.pi * (Omega_x * place + Omega_theta * angle[:, None])
    return float(np.sum(values * np.cos(phase) * weights[:, None]) * 0.5 * np.pi * h)


def _light_transform(Omega) -> float:
    """Transform of exp(-theta^2)."""
    return float(np.sqrt(np.pi) * np.exp(-((np.pi * Omega) ** 2)))


def printed_outer_product(k, Omega_x, Omega_theta) -> float:
    """D05 §6.1: without 1 / |k|."""
    return _light_transform(Omega_x / k) * float(cos_plus_transform(Omega_x / k - Omega_theta))


def outer_product_error(Omega_theta) -> float:
    """The corrected product against the plain double sum."""
    k = 0.6
    return max(
        abs(printed_outer_product(k, W, Omega_theta) / k - distant_spectrum(k, W, Omega_theta))
        for W in (0.0, 0.1, 0.25)
    )


def irradiance_is_a_convolution() -> float:
    """Irradiance of a curved surface in distant light is (lambda (*) cos+)(k x)."""
    from firstorder.laws import Integrate

    kappa, place = 0.6, 0.7
    distant = Function(lambda x, angle: jnp.exp(-(angle**2)) + 0.0 * x)
    E = Integrate("theta", -0.5 * jnp.pi, 0.5 * jnp.pi, 60)((Curvature(kappa) >> Cosine())(distant))
    n = kappa * place
    true = quad(lambda a: np.exp(-(a**2)) * np.cos(a - n), n - np.pi / 2, n + np.pi / 2)[0]
    return abs(float(E(place)) - true)


def line_error() -> float:
    """Of light 40 m wide, the covariance after a shear of 0.6 is along (0.6, 1)."""
    S = Curvature(0.6)(gaussian((0.2, 0.1), (40.0, 0.2)).covariance()).matrix
    values, vectors = np.linalg.eigh(np.asarray(S))
    along = vectors[:, 1] / vectors[1, 1]
    return abs(float(along[0] - 0.6)) + float(values[0] / values[1])


def shadow_error(route) -> float:
    """Soft shadow of Gaussian emitter and blocker: the product of magnified spectra, or images."""
    d1, d2 = 1.5, 0.8
    D = d1 + d2

    def E(place):
        v = np.linspace(-6.0, 6.0, 1201)
        emitter = np.exp(-((place - v * D - 0.2) ** 2))
        blocker = np.exp(-2.0 * (place - v * d2 + 0.1) ** 2)
        return np.sum(emitter * blocker) * (v[1] - v[0])

    if route == "image":
        p = np.linspace(-9.0, 9.0, 1801)
        emitter = np.exp(-((-(0.4 - p) * d1 / d2 - 0.2) ** 2))
        blocker = np.exp(-2.0 * (p * d1 / D + 0.1) ** 2)
        image = np.sum(emitter * blocker) * (p[1] - p[0]) * d1 / (d2 * D)
        return abs(image - E(0.4))
    places = np.linspace(-9.0, 9.0, 361)
    h = places[1] - places[0]
    values = np.array([E(a) for a in places])
    W = np.array([0.0, 0.1, 0.2])
    ours = np.exp(-2j * np.pi * W[:, None] * places) @ values * h
    a, b = -W * d2 / d1, W * D / d1
    s_hat = np.sqrt(np.pi) * np.exp(-((np.pi * a) ** 2)) * np.exp(-2j * np.pi * a * 0.2)
    b_hat = np.sqrt(np.pi / 2) * np.exp(-((np.pi * b) ** 2) / 2) * np.exp(2j * np.pi * b * 0.1)
    return normwise(ours, s_hat * b_hat / d1)


_SQUARES = {
    "autodiff": Check(
        lambda: max(square_error("cosine", p) for p in ("gradient", "hessian")), 1e-10
    ),
    # The light straddles the horizon: samples miss the kink by h^2 / 12, h = 10 / 2048.
    "fourier": Check(lambda: square_error("cosine", "spectrum"), 2e-6),
    "brute_force": Check(lambda: square_error("cosine", "value"), 1e-10),
}

ROWS = [
    Row(
        "D05.8",
        "definition",
        "firstorder.transport.separable.separable",
        symbolic=na("definition"),
        autodiff=Check(cosine_gradient_error, 1e-10),
        fourier=na("no spectrum"),
        brute_force=Check(shading_error, 1e-10),
        note="The path of events against adaptive quadrature of the shading integral.",
    ),
    Row("D05.s4.1c", "identity", COSINE, product_at_each_point, **_SQUARES),
    Row(
        "D05.12",
        "identity",
        COSINE,
        lambda: [convolution_over_angle(), *transform_of_the_cosine()],
        **_SQUARES,
    ),
    Row(
        "D05.T1.6",
        "identity",
        COSINE,
        convolution_over_angle,
        **_SQUARES,
        note="With the Dirac in Omega_x of (12), which the table leaves out.",
    ),
    Row(
        "D05.13",
        "misprint",
        TRANSFORM,
        transform_of_the_cosine,
        autodiff=Check(transform_derivative, 1e-10),
        fourier=Check(transform_by_samples, 1.0),
        brute_force=Check(transform_error, 1e-12),
        corrected="2 cos(pi^2 W) / (1 - (2 pi W)^2), and pi/2 at W = 1 / (2 pi)",
        counterexample=Counterexample(
            {"Omega_theta": 0.3}, printed_transform, transform_by_quadrature
        ),
        note="Read as printed in the extraction, cos(pi/2 W): it has a pole at W = 1 / (2 pi). The "
        "denominator is in cycles, the cosine in radians. Fourier: error in units of the grid's.",
    ),
    Row(
        "D05.fn1",
        "approximation",
        TRANSFORM,
        symbolic=spectrum.fall_of_a_broken_power,
        autodiff=na("no derivative"),
        fourier=Check(falloff_error, 0.05),
        brute_force=Check(spectrum.fitted_fall, 0.02),
        note="Powers fitted on cos^n cut at the horizon, n = 0, 1, 2, for W in [10, 80]: an "
        "asymptotic statement, about the envelope.",
    ),
    Row(
        "D05.s4.1d",
        "approximation",
        TRANSFORM,
        symbolic=lambda: sp.limit(
            (w**2 * 2 / (1 - w**2)) + 2, w, sp.oo
        ),  # the envelope tends to -2 cos(pi w / 2) / w^2
        autodiff=na("no derivative"),
        fourier=Check(lambda: abs(falloff(1) + 2.0), 0.05),
        brute_force=Check(lambda: 1.0 - _low_energy(0.32), 0.04),
        note="97% of its energy lies below 1 / pi cycles per radian.",
    ),
    Row(
        "D05.s6.1a",
        "misprint",
        TRANSFORM,
        outer_product,
        autodiff=na("spectral"),
        fourier=Check(lambda: outer_product_error(0.0), 1e-9),
        brute_force=Check(lambda: outer_product_error(0.3), 1e-9),
        corrected="dEhat'(W_x, W_theta) = lhat_i(0, W_x/k) coshat+(W_x/k - W_theta) / |k|, k != 0",
        counterexample=Counterexample(
            {"k": 0.6, "Omega_x": 0.1, "Omega_theta": 0.3}, printed_outer_product, distant_spectrum
        ),
        note="dx = ds / |k| along the line of slope k.",
    ),
    Row(
        "D05.s6.1b",
        "misprint",
        TRANSFORM,
        lambda: [e.subs(o2, 0) for e in outer_product()],
        autodiff=na("spectral"),
        fourier=Check(lambda: outer_product_error(0.0), 1e-9),
        brute_force=Check(irradiance_is_a_convolution, 1e-9),
        corrected="Ehat(W_x) = lhat_i(0, W_x/k) coshat+(W_x/k) / |k|: E(x) = (l (*) cos+)(k x)",
        counterexample=Counterexample(
            {"k": 0.6, "Omega_x": 0.1, "Omega_theta": 0.0}, printed_outer_product, distant_spectrum
        ),
    ),
    Row(
        "D05.s6.1c",
        "identity",
        "firstorder.transport.rotation.Curvature",
        line_of_distant_light,
        autodiff=na("spectral"),
        fourier=Check(line_error, 1e-3),
        brute_force=Check(lambda: square_error("curvature", "value"), 1e-10),
        note="Stated error: the light is 40 m wide instead of infinitely distant. Needs the minus "
        "of Table 1; with the plus of (11) the line would be -k Omega_theta = Omega_x.",
    ),
    Row(
        "D05.s6.1d",
        "identity",
        "firstorder.transport.occlusion.Occlusion",
        soft_shadow,
        autodiff=na("no derivative"),
        fourier=Check(lambda: shadow_error("spectrum"), 1e-9),
        brute_force=Check(lambda: shadow_error("image"), 1e-9),
        note="Emitter magnified by -d2/d1, blocker by (d1 + d2)/d1.",
    ),
    Row(
        "R07.s4.1f",
        "over-claim",
        COSINE,
        with_the_cosine_inside,
        autodiff=Check(cosine_gradient_error, 1e-10),
        fourier=na("no spectrum"),
        brute_force=Check(lambda: abs(differenced(0.5, 0.3, 0.4) - _gradient(0.5, 0.3, 0.4)), 1e-5),
        corrected="B_x = (L_x c) (x) rho + 2 n_x (L_theta c) (x) rho - n_x (L s) (x) rho with "
        "c, s = cos, sin(w - n)",
        counterexample=Counterexample(
            {"kappa": 0.5, "place": 0.3, "out": 0.9}, absorbed, differenced
        ),
        note="The cosine depends on the incoming angle, not on a difference. What (25) lacks "
        "is small for narrow lobes near normal incidence. Brute force: differences of h = 1e-3.",
    ),
]


def _gradient(kappa, place, out) -> float:
    path = (
        light()
        >> Curvature(kappa)
        >> Cosine()
        >> Mirror()
        >> Reflection(GaussianProfile(0.3, frame=_OUT))
        >> Curvature(kappa, back=True)
    )
    return float(path.light.jet(jnp.array([place, out])).gradient[0])


def _low_energy(cutoff) -> float:
    """Fraction of the energy of the clamped cosine, pi / 2, below a frequency."""
    energy = quad(lambda W: float(cos_plus_transform(W)) ** 2, 0.0, cutoff, epsabs=1e-9)[0]
    return 2.0 * energy / (0.5 * np.pi)
