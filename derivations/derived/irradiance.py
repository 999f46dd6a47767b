"""J12 §3, §5, §7 and its appendices: irradiance as integrals of a field, and the geometry term.

Angles of the paper grow towards +x, those of the library away from it. The vector y of the paper
is p here, from the receiver to the point that sends.
"""

from __future__ import annotations

import jax.numpy as jnp
import sympy as sp

from derivations.derived.compare import (
    LIGHT,
    Equation,
    L,
    after,
    at_symbols,
    flat,
    integral,
    pi,
    t,
    theta,
    unknown,
    x,
)
from derivations.derived.reflection import WIDE
from firstorder.fields import Constant
from firstorder.laws import Integrate, Move, Multiply
from firstorder.scene._geometry_term import (
    facing,
    geometry_gradient,
    geometry_hessian,
    geometry_term,
)
from firstorder.symbolic import UnknownField, derive
from firstorder.symbolic._programs.reading import array, expression, read
from firstorder.transport import Cosine
from firstorder.visibility import point_edge_angle

HORIZONS = -pi / 2, pi / 2
L_0, rho, low, high = sp.symbols("L_0 rho theta_low theta_high", real=True)
r = sp.Symbol("r", positive=True)
f = unknown("f", "x", "theta", "omega")


# --- integrals of light --------------------------------------------------------------------------


def irradiance():
    return derive(after(Cosine(), Integrate("theta", *HORIZONS)))


def irradiance_printed():
    return integral(L(x, t) * sp.cos(t), t, *HORIZONS)


def reflected(brdf):
    """Incoming light, weighed by a BRDF of both angles and by the cosine, and added up."""
    wide = Move([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0]], to=WIDE)
    return derive(after(Cosine(), wide, brdf, Integrate("omega", *HORIZONS)))


def general():
    return reflected(Multiply(UnknownField("f", frame=WIDE)))


def diffuse():
    return reflected(at_symbols(lambda a: Multiply(Constant(a, WIDE)), rho))


def sector():
    """Uniform light between two angles."""
    light = at_symbols(lambda a: Constant(a, LIGHT.frame), L_0)
    part = at_symbols(lambda a, b: Integrate("theta", a, b), low, high)
    cosine = Multiply(lambda x, theta: jnp.cos(theta))
    return derive(part(cosine(light))).value.evaluated()


# --- borders of sectors --------------------------------------------------------------------------

across, up = sp.Symbol("p", real=True), sp.Symbol("q", positive=True)


def border(order: int):
    """A derivative of the sine of the angle at which (p, q) is seen from (x, 0)."""
    angle = read(lambda a, b: point_edge_angle(a, b).value, array(across, up), array(x, 0))
    return sp.diff(sp.sin(expression(angle)), x, order)


def border_printed(order: int):
    """By the paper's angle, whose sine has the other sign than the library's."""
    angle, D = sp.atan((across - x) / up), sp.sqrt((across - x) ** 2 + up**2)
    if order == 1:
        return sp.cos(angle) ** 2 / D
    return 3 * sp.cos(angle) ** 2 * sp.sin(angle) / D**2


# --- the geometry term ---------------------------------------------------------------------------


class Patches:
    """Two patches of d dimensions that face each other, and what is said of them by p and r."""

    def __init__(self, d: int):
        """Name the coordinates."""
        self.d = d
        self.x, self.y, self.n, self.m = (
            sp.symbols(f"{name}_1:{d + 1}", real=True) for name in ("x", "y", "n", "m")
        )
        self.p = sp.Matrix(sp.symbols(f"p_1:{d + 1}", real=True))
        self.n_x, self.n_y = sp.Matrix(self.n), sp.Matrix(self.m)
        self.cos_x = self.n_x.dot(self.p) / r
        self.cos_y = -self.n_y.dot(self.p) / r

    def read(self, function):
        """What a function of the library makes of them, where they face each other."""
        given = (array(*each) for each in (self.x, self.n, self.y, self.m))
        entries = read(function, *given).entries
        return [_seen(sp.sympify(e)) for e in entries.ravel()]

    def by_p(self, expressions):
        """Expressions in the vector p and its length r."""
        ends = {y: x + p for y, x, p in zip(self.y, self.x, self.p, strict=True)}
        square = self.p.dot(self.p)

        def shorter(power):
            return r ** (2 * power.exp) if power.base == square else power

        moved = (sp.sympify(e).xreplace(ends) for e in flat(expressions))
        return [e.replace(lambda a: a.is_Pow, shorter) for e in moved]

    def derivative(self, function, order: int = 1):
        """Derivatives of a number by the place of the receiver."""
        found = self.read(function)
        for _ in range(order):
            found = [sp.diff(e, a) for e in found for a in self.x]
        return self.by_p(found)

    def gradient_printed(self):
        """J12 (38) and (58)."""
        d, p, a, b = self.d, self.p, self.cos_x, self.cos_y
        return (d + 1) * a * b * p / r ** (d + 1) - b * self.n_x / r**d + a * self.n_y / r**d

    def hessian_printed(self):
        """J12 (49) and (66)."""
        d, p, a, b = self.d, self.p, self.cos_x, self.cos_y
        n, m, one = self.n_x, self.n_y, sp.eye(self.d)
        return (
            (d + 1) * (d + 3) * a * b * p * p.T / r ** (d + 3)
            - (d + 1) * a * b * one / r ** (d + 1)
            - (n * m.T + m * n.T) / r ** (d + 1)
            - (d + 1) * b * (n * p.T + p * n.T) / r ** (d + 2)
            + (d + 1) * a * (m * p.T + p * m.T) / r ** (d + 2)
        )

    def product_rule(self):
        """J12 (74) and (83): each gradient is derived, and put together by hand."""
        d, inverse = self.d, r ** (1 - self.d)
        power, towards, from_ = (
            sp.Matrix(self.derivative(part)) for part in (_power(d), _cos_x, _cos_y)
        )
        a, b = self.cos_x, self.cos_y
        return a * b * power + a * inverse * from_ + b * inverse * towards


def _seen(expression):
    """The choice for patches that face each other."""
    return expression.replace(sp.Piecewise, lambda *pairs: pairs[0][0])


def _cos_x(*args):
    return facing(*args).cos_x


def _cos_y(*args):
    return facing(*args).cos_y


def _power(d):
    return lambda *args: facing(*args).r ** (1 - d)


FLAT, SPACE = Patches(2), Patches(3)


def gradients(patches):
    """By differentiating the code of the geometry term, and from the code of its gradient."""
    named = patches.by_p(patches.read(geometry_gradient))
    return [patches.derivative(geometry_term), named]


def hessians(patches):
    named = patches.by_p(patches.read(geometry_hessian))
    return [patches.derivative(geometry_term, 2), named]


def gradient_of_power():
    """J12 (76) for n = 1 and 2."""
    return [p.derivative(_power(p.d)) for p in (FLAT, SPACE)]


DERIVED = {
    "J12.16": Equation(lambda: irradiance().value, irradiance_printed),
    "J12.24": Equation(
        lambda: general().value,
        lambda: integral(L(x, t) * f(x, theta, t) * sp.cos(t), t, *HORIZONS),
    ),
    "J12.26": Equation(
        lambda: FLAT.by_p(FLAT.read(geometry_term)), lambda: FLAT.cos_x * FLAT.cos_y / r
    ),
    "J12.31": Equation(lambda: diffuse().value, lambda: rho * irradiance_printed()),
    "J12.32": Equation(
        lambda: diffuse().value, lambda: rho * flat(irradiance().value)[0]
    ),
    "J12.38": Equation(lambda: gradients(FLAT), lambda: 2 * [FLAT.gradient_printed()]),
    "J12.40": Equation(lambda: irradiance().value, irradiance_printed),
    "J12.43": Equation(
        lambda: sector(), lambda: L_0 * (sp.sin(high) - sp.sin(low))
    ),
    "J12.46": Equation(lambda: border(1), lambda: border_printed(1)),
    "J12.49": Equation(lambda: hessians(FLAT), lambda: 2 * [FLAT.hessian_printed()]),
    "J12.51": Equation(lambda: border(2), lambda: border_printed(2)),
    "J12.58": Equation(lambda: gradients(SPACE), lambda: 2 * [SPACE.gradient_printed()]),
    "J12.66": Equation(lambda: hessians(SPACE), lambda: 2 * [SPACE.hessian_printed()]),
    "J12.74": Equation(lambda: FLAT.derivative(geometry_term), FLAT.product_rule),
    "J12.76": Equation(
        gradient_of_power, lambda: [FLAT.p / r**3, 2 * SPACE.p / r**4]
    ),
    "J12.77": Equation(
        lambda: FLAT.derivative(_cos_x), lambda: -FLAT.n_x / r + FLAT.cos_x * FLAT.p / r**2
    ),
    "J12.78": Equation(
        lambda: FLAT.derivative(_cos_y), lambda: FLAT.n_y / r + FLAT.cos_y * FLAT.p / r**2
    ),
    "J12.83": Equation(lambda: SPACE.derivative(geometry_term), SPACE.product_rule),
}  # fmt: skip
