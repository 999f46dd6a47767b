"""The clamped cosine in numbers: by quadrature, samples and differences."""

from __future__ import annotations

import functools

import jax
import jax.numpy as jnp
import numpy as np
from scipy.integrate import quad

from firstorder.checks.cases import bell, light
from firstorder.checks.tolerance import fitted_order, normwise
from firstorder.conventions import FLATLAND_SLOPE, Frame
from firstorder.fields import GaussianProfile, gaussian
from firstorder.fields.field import Function
from firstorder.laws import Integrate
from firstorder.numerics._quadrature import gauss_legendre
from firstorder.transport import (
    Cosine,
    Curvature,
    Mirror,
    Occlusion,
    Reflection,
    Travel,
    clamped_cosine_transform,
)

_OUT = Frame(("x", "theta"), "outgoing")


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
    return max(
        abs(float(clamped_cosine_transform(W)) - transform_by_quadrature(W)) for W in frequencies
    )


def transform_by_samples() -> float:
    """Against midpoint samples, in units of what they miss at two kinks, `h^2 / 6`."""
    h = np.pi / 8192
    a = -np.pi / 2 + h * (np.arange(8192) + 0.5)
    W = np.linspace(-1.0, 1.0, 21)
    sums = (np.cos(a) * np.cos(2.0 * np.pi * W[:, None] * a)).sum(axis=1) * h
    return float(np.max(np.abs(sums - np.asarray(clamped_cosine_transform(W))))) / (h**2 / 6.0)


def transform_derivative() -> float:
    """dC/dOmega is `-2 pi i` times the transform of theta cos: finite at the pole."""
    pole = 0.5 / np.pi
    slopes = jax.vmap(jax.grad(clamped_cosine_transform))(jnp.array([0.2, pole, 0.7]))

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


def kinks_alone_error() -> float:
    """What the two kinks alone, `-2 cos(pi^2 W) / (2 pi W)^2`, leave of the library's transform.

    It falls as the power -4, for the third derivative jumps next; at W = m / pi no wave is zero.
    """
    W = np.array([32.0, 64.0, 128.0, 256.0]) / np.pi
    kinks = -2.0 * np.cos(np.pi**2 * W) / (2.0 * np.pi * W) ** 2
    return abs(fitted_order(W, np.abs(np.asarray(clamped_cosine_transform(W)) - kinks)) + 4.0)


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
    return _light_transform(Omega_x / k) * float(
        clamped_cosine_transform(Omega_x / k - Omega_theta)
    )


def outer_product_error(Omega_theta) -> float:
    """The corrected product against the plain double sum."""
    k = 0.6
    return max(
        abs(printed_outer_product(k, W, Omega_theta) / k - distant_spectrum(k, W, Omega_theta))
        for W in (0.0, 0.1, 0.25)
    )


def irradiance_is_a_convolution() -> float:
    """Irradiance of a curved surface in distant light is (lambda (*) cos+)(k x)."""
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


def shadow_by_events() -> float:
    """The same shadow by occlusion of the emitter's light, against the product of both images."""
    d1, d2 = 1.5, 0.8
    D = d1 + d2
    emitter = Function(lambda x, v: jnp.exp(-((x - 0.2) ** 2)) + 0.0 * v, FLATLAND_SLOPE)
    blocker = Occlusion(lambda x: jnp.exp(-2.0 * (x + 0.1) ** 2), d2)
    E = Integrate("v", -6.0, 6.0, 200)(blocker(Travel(D)(emitter)))
    u = np.linspace(-3.0, 3.0, 601)[:, None]  # place on the blocker
    places = np.array([-0.5, 0.4])
    product = np.exp(-((places - (places - u) * D / d2 - 0.2) ** 2) - 2.0 * (u + 0.1) ** 2)
    return normwise(jax.vmap(E.at)(jnp.asarray(places)[:, None]), product.sum(0) * 0.01 / d2)


def gradient(kappa, place, out) -> float:
    path = (
        light()
        >> Curvature(kappa)
        >> Cosine()
        >> Mirror()
        >> Reflection(GaussianProfile(0.3, frame=_OUT))
        >> Curvature(kappa, back=True)
    )
    return float(path.light.jet(jnp.array([place, out])).gradient[0])


def low_energy(cutoff) -> float:
    """Fraction of the energy of the clamped cosine, pi / 2, below a frequency."""
    energy = quad(lambda W: float(clamped_cosine_transform(W)) ** 2, 0.0, cutoff, epsabs=1e-9)[0]
    return 2.0 * energy / (0.5 * np.pi)
