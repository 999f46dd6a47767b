"""Radii from tolerated errors: integrals of the first missing Taylor term (J12 §6.4).

The proofs integrate the modulus, or the square, of that term over both sides of a record, for every
definition of error that J12 names and every order of extrapolation, and solve for the radius. The
numeric routes integrate it adaptively, and take the light below a lamp as the truth.
"""

from __future__ import annotations

import functools

import numpy as np
import sympy as sp
from scipy.integrate import quad
from scipy.optimize import brentq

from derivations.caching._light import scene_a_columns, scene_a_numbers
from firstorder.checks.tolerance import fitted_order
from firstorder.ledger import Check, Row, na

R, D, value, tolerance, x = sp.symbols("R D E epsilon x", positive=True)

# What each definition asks of the missing term `m(x)`, as an integral over both sides.
INTEGRALS = {
    "total": lambda m: 2 * sp.integrate(m, (x, 0, R)),
    "average": lambda m: sp.integrate(m, (x, 0, R)) / R,
    "average squared": lambda m: sp.integrate(m**2, (x, 0, R)) / R,
    "integrated squared": lambda m: 2 * sp.integrate(m**2, (x, 0, R)),
    "relative": lambda m: 2 * sp.integrate(m, (x, 0, R)) / value,
    "largest": lambda m: m.subs(x, R),
}


def integral(definition: str, order: int):
    """The error of a definition, integrated from the missing term; the modulus is even in x."""
    return INTEGRALS[definition](D * x ** (order + 1) / sp.factorial(order + 1))


def printed_total():
    """(54): the missing term of a linear expansion, derived by subtracting it from the parabola."""
    E0, E1 = sp.symbols("E_0 E_1", real=True)
    y = sp.Symbol("y", real=True)
    line, found = E0 + E1 * y, []
    for h in (D, -D):
        miss = sp.expand(line + h * y**2 / 2 - line)
        total = sp.integrate(sp.Abs(miss), (y, -R, R))
        found.append(sp.simplify(total - sp.Abs(h) * R**3 / 3))
    return found


def leading_order():
    """The total error of the true E against its estimate: odd terms cancel, the rest is O(R^2).

    For h > 0 the miss is positive near the record, and the modulus may be dropped there.
    """
    h, third, fourth = sp.symbols("h t q", positive=True)
    miss = h * x**2 / 2 + third * x**3 / 6 + fourth * x**4 / 24
    y = sp.Symbol("y", real=True)
    total = sp.integrate(miss.subs(x, y), (y, -R, R))
    return sp.expand(total / (h * R**3 / 3) - 1 - sp.Rational(1, 20) * fourth / h * R**2)


def solved(definition: str = "total", order: int = 1):
    """The radius that solves `integral = tolerance`; there is one positive root."""
    c = sp.simplify(integral(definition, order))
    power = sp.degree(sp.Poly(c, R))
    root = (tolerance / c.coeff(R, power)) ** sp.Rational(1, power)
    return sp.simplify(root), sp.simplify(c.subs(R, root) - tolerance)


def printed_radius():
    """(55) from the integral, by solving for R."""
    root, residual = solved()
    return [sp.simplify(root - (3 * tolerance / D) ** sp.Rational(1, 3)), residual]


# --- numbers -----------------------------------------------------------------------------------


def expected(derivative: float, radius, order: int = 1, **options):
    """The library's expected error along a line, from numbers."""
    import jax.numpy as jnp

    from firstorder.caching import ValidityRegion, expected_error

    T = jnp.full((1,) * (order + 1), derivative)
    region = ValidityRegion(jnp.full((1, 1), 1.0) / radius)
    return expected_error(T, region, order=order, **options)


PLACES = (0.1, 0.35, 0.8)


def true_total(at: float, radius: float) -> float:
    """(53) below the lamp, adaptively and to some 1e-13."""
    E, E1 = scene_a_numbers()[:2]

    def miss(t):
        return abs(float(E(at + t) - E(at) - E1(at) * t))

    sides = [
        quad(miss, *ends, epsabs=1e-14, epsrel=1e-12)[0] for ends in ((-radius, 0), (0, radius))
    ]
    return sum(sides)


def order_of_the_estimate() -> float:
    """How far the fitted order of the estimate's relative error is from 2, at its worst."""
    radii = np.array([0.02, 0.04, 0.08])
    worst = 0.0
    for at in PLACES:
        h = float(scene_a_columns(at)[2])
        errors = [abs(float(expected(h, r)) / true_total(at, r) - 1.0) for r in radii]
        worst = max(worst, abs(fitted_order(radii, errors) - 2.0))
    return worst


def slope_of_the_estimate() -> float:
    """d/dR of the estimate is the missing term at both ends; every order and linear definition."""
    import jax

    worst = 0.0
    for order in (0, 1, 2):
        for radius in (0.3, 1.7):
            ours = jax.grad(lambda r, o=order: expected(-2.3, r, order=o))(radius)
            ends = 2.0 * 2.3 * radius ** (order + 1) / float(sp.factorial(order + 1))
            worst = max(worst, abs(float(ours) / ends - 1.0))
    return worst


@functools.cache
def integrated(definition: str, order: int, radius: float) -> float:
    """The error of the missing term alone, adaptively; derivative 2.3, value 0.7."""
    size = 2.3 / float(sp.factorial(order + 1))

    def miss(t):
        return size * abs(t) ** (order + 1)

    if definition == "largest":
        return max(miss(-radius), miss(radius))
    squared = "squared" in definition
    total = 2.0 * quad(lambda t: miss(t) ** 2 if squared else miss(t), 0.0, radius)[0]
    mean = total / (2.0 * radius) if "average" in definition else total
    return mean / 0.7 if definition == "relative" else mean


def radius_by_search() -> float:
    """Largest relative error of every radius against a bracketed root of the integral."""
    from firstorder.caching import DEFINITIONS, radius_for

    worst = 0.0
    for definition in DEFINITIONS:
        for order in (0, 1, 2):
            options = {"order": order, "definition": definition, "value": 0.7}
            found = brentq(
                lambda r, d=definition, o=order: integrated(d, o, r) - 0.04, 1e-3, 50.0, xtol=1e-14
            )
            ours = float(radius_for(-2.3, 0.04, **options))
            error = float(expected(-2.3, 0.6, **options)) / integrated(definition, order, 0.6)
            worst = max(worst, abs(ours / found - 1.0), abs(error - 1.0))
    return worst


def slope_of_the_radius() -> float:
    """The slopes dR / d(tolerance) and d(error) / dR multiply to one, by autodiff."""
    import jax

    from firstorder.caching import radius_for

    radius = float(radius_for(4.1, 0.02))
    product = jax.grad(lambda e: radius_for(4.1, e))(0.02) * jax.grad(lambda r: expected(4.1, r))(
        radius
    )
    return abs(float(product) - 1.0)


ROWS = [
    Row(
        "J12.54",
        "approximation",
        implements="firstorder.caching.expected_error",
        symbolic=lambda: [*printed_total(), leading_order()],
        autodiff=Check(slope_of_the_estimate, 1e-12),
        fourier=na("no spectrum"),
        brute_force=Check(order_of_the_estimate, 0.02),
        note=(
            "Relative error E''''/(20 E'') R^2 (order 2, below the lamp of scene A); E''' cancels "
            "between the sides. Not valid at inflections or across kinks of E."
        ),
    ),
    Row(
        "J12.55",
        "identity",
        implements="firstorder.caching.radius_for",
        symbolic=printed_radius,
        autodiff=Check(slope_of_the_radius, 1e-12),
        fourier=na("no spectrum"),
        brute_force=Check(radius_by_search, 1e-10),
        note="Six definitions of error and orders 0, 1, 2 of extrapolation by the same integrals.",
    ),
]
