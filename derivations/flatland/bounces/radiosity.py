"""Radiosity at a corner and in a closed room; an independent solution of J12's scene C.

The kernel of two walls at right angles is homogeneous of degree -1, so powers of the distance to
the corner are its eigenfunctions: irradiance has powers there that are not whole, and J12 §4.1's
"completely smooth" scene C is smooth between its corners only.
"""

from __future__ import annotations

import functools
import math

import numpy as np
import sympy as sp
from scipy import integrate

from firstorder.ledger import Check, Row, na

x, y, t, u = sp.symbols("x y t u", positive=True)
alpha = sp.Symbol("alpha", real=True)


# --- proofs --------------------------------------------------------------------------------------


def corner_kernel():
    """From the geometry: x on the wall y = 0, y on the wall x = 0; half the geometry term."""
    way = sp.Matrix([-x, y])
    r = sp.sqrt(way.dot(way))
    cos_x, cos_y = way[1] / r, -way[0] / r
    K = cos_x * cos_y / r / 2
    c = sp.Symbol("c", positive=True)
    printed = x * y / (2 * (x**2 + y**2) ** sp.Rational(3, 2))
    return sp.simplify(K - printed), sp.simplify(c * K.subs({x: c * x, y: c * y}) - K)


def eigenvalue():
    """`int K(1, t) t^alpha dt = B(1 + alpha/2, (1 - alpha)/2) / 4`, by `u = t^2 / (1 + t^2)`."""
    f = t ** (1 + alpha) / (2 * (1 + t**2) ** sp.Rational(3, 2))
    back = sp.sqrt(u / (1 - u))
    beta = u ** (alpha / 2) * (1 - u) ** ((1 - alpha) / 2 - 1) / 4
    ratio = f.subs(t, back) * sp.diff(back, u) / beta
    # It is 1: constant (its logarithm has no slope), and 1 at one place.
    slope = sp.diff(sp.expand_log(sp.log(ratio), force=True), u)
    return sp.simplify(slope), sp.simplify(ratio.subs(u, sp.Rational(1, 2)) - 1)


def closed_room():
    """What one point sends is received once: the half cosine over the horizon adds up to one."""
    a = sp.Symbol("theta", real=True)
    return sp.integrate(sp.cos(a) / 2, (a, -sp.pi / 2, sp.pi / 2)) - 1


# --- brute force: scene C by its symmetry --------------------------------------------------------


@functools.cache
def room(albedo: float, half: int = 120):
    """Nodes, weights and irradiance on one wall of the unit room, by the double exponential rule.

    All four walls are alike, so one integral equation on [0, 1] is left. Distances a and 1 - a to
    both corners are kept apart, without cancellation.
    """
    step = 3.6 / half
    s = step * np.arange(-half, half + 1)
    a, b = (1.0 / (1.0 + np.exp(sign * np.pi * np.sinh(s))) for sign in (-1.0, 1.0))
    w = step * np.pi * np.cosh(s) * a * b
    K = _adjacent(a[:, None], a) + _adjacent(b[:, None], a) + _opposite(a[:, None], a)
    E = np.linalg.solve(np.eye(len(s)) - albedo * K * w, _direct(a))
    return a, w, E


def _adjacent(p, q):
    return 0.5 * p * q / (p * p + q * q) ** 1.5


def _opposite(p, q):
    return 0.5 / ((p - q) ** 2 + 1.0) ** 1.5


def _direct(p):
    return 0.5 / (0.25 + (p - 0.5) ** 2)


def room_irradiance(place, albedo: float = 0.2) -> np.ndarray:
    """Irradiance of scene C at distances from a corner, up to 1/2, by the equation itself."""
    a, w, E = room(albedo)
    p = np.asarray(place, dtype=float)[:, None]
    K = _adjacent(p, a) + _adjacent(1.0 - p, a) + _opposite(p, a)
    return _direct(p[:, 0]) + albedo * K @ (w * E)


def room_derivatives(place, albedo: float = 0.2) -> np.ndarray:
    """E, E', E'' of scene C: the kernels are differentiated under the integral (sympy)."""
    a, w, E = room(albedo)
    p, q = sp.symbols("p q", positive=True)
    half = sp.Rational(1, 2)
    K = half * p * q / (p**2 + q**2) ** (3 * half)
    K += half * (1 - p) * q / ((1 - p) ** 2 + q**2) ** (3 * half)
    K += half / ((p - q) ** 2 + 1) ** (3 * half)
    D = half / (half**2 + (p - half) ** 2)
    rows = []
    for order in range(3):
        k, d = (sp.lambdify((p, q), sp.diff(f, p, order) + 0 * q, "numpy") for f in (K, D))
        at = np.asarray(place, dtype=float)
        rows.append(d(at, 0.0) + albedo * k(at[:, None], a) @ (w * E))
    return np.array(rows)


def fitted_exponent(albedo: float, near: float = 1e-5) -> float:
    """The power at the corner, from values at doubling distances; the linear term is taken out."""
    E = room_irradiance(near * 2.0 ** np.arange(4), albedo)
    d = np.diff(E)
    e = d[1:] - 2.0 * d[:-1]
    return math.log2(e[1] / e[0])


def reflected_power(albedo: float, alpha: float) -> float:
    """What the adjacent wall reflects of `x^alpha` to x = 1, by quadrature up to 1 and beyond."""
    near, _ = integrate.quad(_cubed, 0.0, 1.0, weight="alg", wvar=(1.0 + alpha, 0.0))
    far, _ = integrate.quad(_cubed, 0.0, 1.0, weight="alg", wvar=(-alpha, 0.0))  # t to 1 / t
    return albedo * (near + far)


def _cubed(t):
    return 0.5 / (1.0 + t * t) ** 1.5


def exponent_error() -> float:
    """Worst over its bound: the power that the walls keep, to 1e-9; that of a room, to 1e-3."""
    from firstorder.flatland.bounces.radiosity import corner_exponent

    worst = 0.0
    for rho in (0.2, 0.5, 0.8):
        alpha = float(corner_exponent(rho))
        kept, fitted = abs(reflected_power(rho, alpha) - 1.0), abs(fitted_exponent(rho) - alpha)
        worst = max(worst, kept / 1e-9, fitted / 1e-3)
    return worst


def energy_error() -> float:
    """Absorbed over emitted flux of scene C, less one, for three albedos."""
    worst = 0.0
    for rho in (0.0, 0.2, 0.9):
        _, w, E = room(rho)
        worst = max(worst, abs(4.0 * (1.0 - rho) * np.sum(w * E) / (2.0 * np.pi) - 1.0))
    return worst


def flux_error() -> float:
    """The library's fluxes in a room of one radiance, against its length by hand.

    Walls of albedo 0.6 that emit 0.5 have the irradiance E = 2 L_e / (1 - rho) = 2.5.
    """
    from firstorder.flatland import Scene, box, primitive
    from firstorder.flatland.bounces.radiosity import Discretization, solve_radiosity

    walls = primitive(box((0.0, 0.0), (1.5, 1.0), inward=True), emission=0.5, albedo=0.6)
    solution = solve_radiosity(Scene.of(walls), fineness=Discretization(4, 0.5))
    length = 5.0
    emitted, absorbed = map(float, solution.flux())
    return max(
        abs(emitted / (2.0 * 0.5 * length) - 1.0), abs(absorbed / (0.4 * 2.5 * length) - 1.0)
    )


ROWS = [
    Row(
        "C.radiosity.corner",
        "identity",
        "firstorder.flatland.bounces.radiosity.corner_exponent",
        symbolic=lambda: [*corner_kernel(), *eigenvalue()],
        autodiff=na("no derivative"),
        fourier=na("no spectrum"),
        brute_force=Check(exponent_error, 1.0),
        note="The next power is near 2, so the fit at 1e-5 m is off by some 1e-4; E' diverges at "
        "the corners of J12's scene C, as x^-0.10.",
    ),
    Row(
        "C.radiosity.energy",
        "identity",
        "firstorder.flatland.bounces.radiosity.RadiositySolution.flux",
        symbolic=closed_room,
        autodiff=na("no derivative"),
        fourier=na("no spectrum"),
        brute_force=Check(lambda: max(energy_error(), flux_error()), 1e-11),
    ),
]
