"""The light, the surfaces and the routes that the derivations of shading share.

The proofs differentiate `B = int L(x, omega) rho(2 n(x) - theta - omega) d omega` at fixed offsets
`t = theta_r - omega`: there x and theta enter through L alone. A derivative up to order two knows
L and n by their 2-jets only, so polynomials with free coefficients prove it for all smooth L and n,
at every offset.

Numeric routes: autodiff of the value; the discrete transform of the sampled light, multiplied by
the lobe's transform and by powers of 2 pi i Omega; and, as brute force, a dense sum over directions
in NumPy, differentiated by complex steps.
"""

from __future__ import annotations

import functools

import jax
import jax.numpy as jnp
import numpy as np
import sympy as sp

from firstorder.checks.tolerance import normwise
from firstorder.fields import Affine, Constant, autodiff_jet, gaussian
from firstorder.ledger import Check, Row, na
from firstorder.transport.brdf.lobes import Lobe, glossy, lambert
from firstorder.transport.events.reflection import VaryingGaussian
from firstorder.transport.events.texture import wave
from firstorder.transport.shading.surface import Surface

MODULE = "firstorder.transport.shading.surface"
RAYS = np.array([[0.3, 0.1], [-0.4, 0.25], [0.7, -0.35]])


# --- symbols -----------------------------------------------------------------------------------

a, b = sp.symbols("dx dtheta", real=True)
n0, n1, n2 = sp.symbols("n n_x n_xx", real=True)
l0, lx, lt, lxx, lxt, ltt = sp.symbols(
    "L L_x L_theta L_xx L_xtheta L_thetatheta", real=True
)  # the jet of L at (x, theta_r - t)
r0, rx, rxx = sp.symbols("rho rho_x rho_xx", real=True)  # that of the lobe at a fixed offset


def light(da, db):
    """The 2-jet of L."""
    return l0 + lx * da + lt * db + lxx * da**2 / 2 + lxt * da * db + ltt * db**2 / 2


def lobe(da):
    """The 2-jet of a lobe that varies in x, at a fixed offset."""
    return r0 + rx * da + rxx * da**2 / 2


turn = n1 * a + n2 * a**2 / 2  # n(x + dx) - n(x)


def derivatives(f):
    """Value, gradient and Hessian at the ray."""
    at = {a: 0, b: 0}
    orders = ((0, 0), (1, 0), (0, 1), (2, 0), (1, 1), (0, 2))
    return [sp.diff(f, a, i, b, j).subs(at) if i + j else f.subs(at) for i, j in orders]


def reflected():
    """The integrand of (23) at a fixed offset, as a function of the ray."""
    return light(a, 2 * turn - b) * r0


# --- brute force: NumPy, complex steps ---------------------------------------------------------

STEP = 1e-30


def bell(x, w):
    """The light: off-centre and correlated, entire in both arguments."""
    p, q = (x - 0.21) / 0.55, (w + 0.13) / 0.4
    return 1.3 * np.exp(-0.5 * (p * p - 0.7 * p * q + q * q) / (1.0 - 0.35**2))


def normal(x):
    """The normal's angle."""
    return 0.05 + 0.3 * x + 0.08 * np.cos(2.0 * np.pi * 0.4 * x)


def bent(x):
    """n, n_x and n_xx of `normal`, by hand."""
    w = 0.8 * np.pi
    return normal(x), 0.3 - 0.08 * w * np.sin(w * x), -0.08 * w**2 * np.cos(w * x)


def gauss(t, sigma):
    """The Gaussian lobe."""
    return np.exp(-0.5 * (t / sigma) ** 2) / (sigma * np.sqrt(2.0 * np.pi))


def dense(x, theta, L=bell, n=normal, sigma=0.2, turn=2.0, look=-1.0, weight=None):
    """B by 4000 equidistant offsets, from the unsimplified steps; spectrally accurate."""
    h = 9.0 * np.max(np.real(sigma if not callable(sigma) else 0.35)) / 2000.0
    t = h * np.arange(-2000, 2001)
    s = sigma(x) if callable(sigma) else sigma
    w = turn * n(x) + look * theta - t
    values = L(x, w) * gauss(t, s)
    return h * np.sum(values if weight is None else values * weight(w - n(x)))


def irradiance(x, L=bell, n=normal, albedo=0.8):
    """`albedo / 2 int L cos+` over the local hemisphere, by Gauss-Legendre."""
    w, weights = np.polynomial.legendre.leggauss(160)
    w, weights = 0.5 * np.pi * w, 0.5 * np.pi * weights
    return 0.5 * albedo * np.sum(weights * np.cos(w) * L(x, n(x) + w))


def complex_step(f, x, theta):
    """Gradient of an entire function, without cancellation."""
    return np.array([f(x + 1j * STEP, theta).imag, f(x, theta + 1j * STEP).imag]) / STEP


def differences(f, x, theta, h=2e-3):
    """Hessian: sixth-order differences of the gradient."""
    c = np.array([3.0 / 4.0, -3.0 / 20.0, 1.0 / 60.0]) / h
    rows = []
    for e in ((1.0, 0.0), (0.0, 1.0)):
        g = [
            ck * (complex_step(f, x + k * h * e[0], theta + k * h * e[1])
                  - complex_step(f, x - k * h * e[0], theta - k * h * e[1]))
            for k, ck in zip((1, 2, 3), c, strict=True)
        ]  # fmt: skip
        rows.append(sum(g))
    return np.array(rows)


def near(d, width=1.0):
    """A line of light at height d: the same from all sides."""
    return lambda x, w: np.exp(-0.5 * ((x - d * np.tan(w)) / width) ** 2)


def slope_x(L, x, w):
    return np.imag(L(x + 1j * STEP, w)) / STEP


def slope_w(L, x, w):
    return np.imag(L(x, w + 1j * STEP)) / STEP


def distant_entries(x, w):
    """Entries of a distant bell."""
    f, zero = jnp.exp(-((w - 0.1) ** 2)), 0.0 * x
    h = w - 0.1
    return f + zero, zero, -2.0 * h * f, zero, zero, (4.0 * h * h - 2.0) * f


# --- the same by the library -------------------------------------------------------------------

LIGHT = gaussian((0.21, -0.13), (0.55, 0.4), 0.35, 1.3)
NORMAL = Affine([0.3, 0.0], 0.05) + wave(0.4, 0.08)
SIGMA = wave(0.5, 0.05, mean=0.25)
VARYING = Lobe(VaryingGaussian(SIGMA, widest=0.32))
SCENES = {
    "glossy": Surface(NORMAL, (glossy(0.2),)),
    "flat": Surface(Constant(0.0), (glossy(0.2),)),
    "varying": Surface(NORMAL, (VARYING,)),
    "varying, flat": Surface(Constant(0.0), (VARYING,)),
    "painted": Surface(NORMAL, (glossy(0.2),), wave(0.3, 0.4, mean=0.6)),
    "painted, diffuse": Surface(NORMAL, (lambert(0.8),), wave(0.3, 0.4, mean=0.6)),
    "diffuse": Surface(NORMAL, (lambert(0.8),)),
    "cosine": Surface(NORMAL, (glossy(0.2, cosine=True),)),
}
BRUTE = {
    "glossy": dense,
    "flat": functools.partial(dense, n=lambda x: 0.0 * x),
    "varying": functools.partial(dense, sigma=lambda x: 0.25 + 0.05 * np.cos(np.pi * x)),
    "varying, flat": functools.partial(
        dense, n=lambda x: 0.0 * x, sigma=lambda x: 0.25 + 0.05 * np.cos(np.pi * x)
    ),
    "painted": lambda x, t: (0.6 + 0.4 * np.cos(0.6 * np.pi * x)) * dense(x, t),
    "diffuse": lambda x, t: irradiance(x),
    "painted, diffuse": lambda x, t: (0.6 + 0.4 * np.cos(0.6 * np.pi * x)) * irradiance(x),
    "cosine": functools.partial(dense, weight=np.cos),
}


@functools.cache
def jets(scene):
    """Closed-form jets, and those by autodiff of the value."""
    B = SCENES[scene].reflect(LIGHT)

    def both(u):
        return B.jet(u), autodiff_jet(B.at, u, B.frame)

    return jax.jit(jax.vmap(both))(jnp.asarray(RAYS))


def autodiff(scene, part):
    def error():
        closed, truth = jets(scene)
        return normwise(getattr(closed, part), getattr(truth, part))

    return Check(error, 1e-10)


def brute(scene, part, bound=1e-10):
    def error():
        f = BRUTE[scene]
        make = {
            "value": lambda x, t: f(x, t),
            "gradient": lambda x, t: complex_step(f, x, t),
            "hessian": lambda x, t: differences(f, x, t),
        }[part]
        truth = np.array([make(x, t) for x, t in RAYS])
        return normwise(getattr(jets(scene)[0], part), truth)

    return Check(error, bound)


# --- Fourier -----------------------------------------------------------------------------------


@functools.cache
def spectrum():
    """Discrete transform of the sampled light: frequencies along x and theta, and F."""
    nx, nt, X, T = 96, 97, 5.0, 4.0
    x = (np.arange(nx) - 0.5 * (nx - 1)) * 2.0 * X / nx
    t = (np.arange(nt) - 0.5 * (nt - 1)) * 2.0 * T / nt
    kx, kt = np.fft.fftfreq(nx, 2.0 * X / nx), np.fft.fftfreq(nt, 2.0 * T / nt)
    f = bell(x[:, None], t)
    left = np.exp(-2j * np.pi * kx[:, None] * x) / nx
    right = np.exp(-2j * np.pi * kt[:, None] * t) / nt
    return kx, kt, left @ f @ right.T


def convolved(x, angle, i, j, sigma=0.2):
    """The derivative `d^(i + j) L / dx^i dtheta^j`, convolved with the lobe: all by frequencies."""
    kx, kt, F = spectrum()
    lobe = np.exp(-2.0 * (np.pi * sigma * kt) ** 2)
    left = (2j * np.pi * kx) ** i * np.exp(2j * np.pi * kx * x)
    right = (2j * np.pi * kt) ** j * np.exp(2j * np.pi * kt * angle) * lobe
    return (left @ F @ right).real


def fourier(part, flat=False):
    """(23), (25), (29) as printed, convolved by frequencies, against the closed form."""

    def error():
        found = []
        for x, theta in RAYS:
            n, k, kk = (0.0, 0.0, 0.0) if flat else bent(x)
            r = 2.0 * n - theta
            C = {(i, j): convolved(x, r, i, j) for i in range(3) for j in range(3 - i)}
            if part == "value":
                found.append(C[0, 0])
            elif part == "gradient":
                found.append([C[1, 0] + 2.0 * k * C[0, 1], -C[0, 1]])
            else:
                xx = C[2, 0] + 4.0 * k * C[1, 1] + 4.0 * k**2 * C[0, 2] + 2.0 * kk * C[0, 1]
                xt = -C[1, 1] - 2.0 * k * C[0, 2]
                found.append([[xx, xt], [xt, C[0, 2]]])
        return normwise(np.array(found), getattr(jets("flat" if flat else "glossy")[0], part))

    return Check(error, 1e-9)


# --- rows --------------------------------------------------------------------------------------

two, flatless = na("two routes"), na("no spectrum")
CLOSED = f"{MODULE}.ReflectedField.entries"


def measured(equation, check, bound, note, implements, autodiff=None):
    return Row(
        equation,
        "approximation",
        implements=implements,
        symbolic=na("measured"),
        autodiff=autodiff or na("scale"),
        fourier=na("scale"),
        brute_force=Check(check, bound),
        note=note,
    )


def identity(equation, symbolic, scene, part, *, wave_route=None, note=""):
    return Row(
        equation,
        "identity",
        implements=CLOSED,
        symbolic=symbolic,
        autodiff=na("no derivative") if part == "value" else autodiff(scene, part),
        fourier=wave_route or two,
        brute_force=brute(scene, part, 1e-8 if part == "hessian" else 1e-10),
        note=note,
    )
