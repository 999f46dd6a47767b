"""R07 §4, §5.2, §5.4, §10 and Appendix C: light that a curved surface reflects.

A lobe is even (footnote 2), and convolutions are written at a fixed offset t from the direction
that is looked at: `(L (x) rho)(x, w) = int L(x, w + t) rho(t) dt`.
"""

from __future__ import annotations

import functools

import sympy as sp

from derivations.derived.compare import (
    LEAVING,
    LIGHT,
    Equation,
    L,
    L_hat,
    Ot,
    Ox,
    after,
    flat,
    integral,
    k,
    n,
    pi,
    rho,
    t,
    theta,
    unknown,
    x,
)
from firstorder.conventions import FLATLAND, Frame
from firstorder.laws import Integrate, Move, Multiply
from firstorder.symbolic import (
    UnknownField,
    UnknownLobe,
    UnknownVaryingLobe,
    derive,
    named_terms,
)
from firstorder.symbolic._programs.functions import Unknown, unknown_function
from firstorder.symbolic._programs.reading import matrix
from firstorder.transport import (
    Bump,
    Cosine,
    Curvature,
    Mirror,
    Occlusion,
    Reflection,
    Texture,
)

NORMAL, LOBE = UnknownField("n", ("x",)), Reflection(UnknownLobe("rho"))
SPOTTED = Reflection(UnknownVaryingLobe("rho"))
DISTANT = UnknownField("L", ("theta",), FLATLAND)
LINE = Frame(("x",))
WIDE = Frame(("x", "theta", "omega"))
n_x, n_xx = n(x, along="x"), n(x, along=("x", "x"))
spotted = unknown("rho", "x", "theta")
V, T, E, sky = (
    unknown("V", "x", "theta"),
    unknown("T", "x"),
    unknown("E", "x"),
    unknown("L", "theta"),
)


def surface(lobe=LOBE, normal=NORMAL):
    """R07's four steps."""
    return Bump(normal) >> Mirror() >> lobe >> Bump(normal, back=True)


@functools.cache
def reflected():
    return derive(LIGHT >> surface())


@functools.cache
def terms(flat_surface: bool = False, distant: bool = False):
    path = surface(normal=0.0) if flat_surface else surface()
    return named_terms((DISTANT if distant else LIGHT) >> path)


def convolved(*along):
    """`(L_.. (x) rho)(x, theta_r)`, with `theta_r = 2 n - theta`."""
    return integral(L(x, 2 * n(x) - theta + t, along=along) * rho(t))


def in_place(**along):
    """`L^m (x) rho` at theta."""
    return integral(L(x, theta - t, **along) * rho(t))


def curvature(back: bool = False):
    return derive(Curvature(k, back=back), LEAVING if back else FLATLAND)


def sheared(sign):
    """`grad L` at `(x, theta + sign k x)`, with the matrix in front of it."""
    u = x, theta + sign * k * x
    return sp.Matrix([[1, sign * k], [0, 1]]) * sp.Matrix([L(*u, along=a) for a in ("x", "theta")])


def general():
    """A BRDF of both angles, and a blocker, in the local frame."""
    wide = Move([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0]], to=WIDE)
    brdf = Multiply(UnknownField("f", frame=WIDE))
    blocked = Occlusion(UnknownField("V", frame=FLATLAND))
    return derive(after(blocked, Cosine(), wide, brdf, Integrate("omega", -pi / 2, pi / 2)))


def general_printed():
    f = unknown("f", "x", "theta", "omega")
    return integral(L(x, t) * f(x, theta, t) * V(x, t) * sp.cos(t), t, -pi / 2, pi / 2)


def as_light(expression, *along):
    """What is said of an unknown P, said of a derivative of the light."""

    def named(part):
        names = ("x", "theta")
        orders = tuple(o + along.count(a) for o, a in zip(part.orders, names, strict=True))
        return unknown_function("L", names, orders)(*part.args)

    return [
        e.replace(lambda p: isinstance(p, Unknown) and p.base == "P", named)
        for e in flat(expression)
    ]


def first_derivatives_again():
    """R07 (69): the gradients of `L_x (x) rho` and of `L_theta (x) rho` at theta_r."""
    again = derive(UnknownField("P", frame=FLATLAND) >> surface()).gradient
    return as_light(again, "x") + as_light(again, "theta")


def matrices():
    """R07 (24): the three steps' matrices and their product."""
    step = sp.Matrix([[1, n_x], [0, 1]])
    back = sp.Matrix([[1, -n_x], [0, 1]])
    return back * sp.diag(1, -1) * step * sp.Matrix([convolved("x"), convolved("theta")])


def lambertian():
    """Weighed by the cosine and added up, in the frame of the normal."""
    integrate = Integrate("theta", -pi / 2, pi / 2)
    return named_terms(after(Bump(NORMAL), Cosine(), integrate))


def under_cosine(*along):
    return integral(L(x, t + n(x), along=along) * sp.cos(t), t, -pi / 2, pi / 2)


LOCAL = Equation(lambda: curvature().value, lambda: L(x, theta + k * x))
MIRRORED = Equation(lambda: derive(Mirror()).gradient, lambda: [
    L(x, -theta, along="x"), -L(x, -theta, along="theta")
])  # fmt: skip
SHADED = Equation(
    lambda: derive(LOBE, LEAVING).gradient,
    lambda: [in_place(along="x"), in_place(along="theta")],
)
GRADIENT = Equation(
    lambda: reflected().gradient,
    lambda: [convolved("x") + 2 * n_x * convolved("theta"), -convolved("theta")],
)

DERIVED = {
    "R07.1": Equation(lambda: general().value, general_printed),
    "R07.s4.1b": Equation(lambda: derive(Bump(NORMAL)).value, lambda: L(x, theta + n(x))),
    "R07.9": Equation(
        lambda: matrix(curvature().laws[0].M), lambda: sp.Matrix([[1, 0], [k, 1]])
    ),
    "R07.10": Equation(
        lambda: [curvature().value, curvature().gradient],
        lambda: [L(x, theta + k * x), sheared(1)],
    ),
    "R07.11": Equation(lambda: curvature().gradient, lambda: sheared(1)),
    "R07.s4.1c": Equation(
        lambda: derive(DISTANT >> Curvature(k)).gradient.expression[0],
        lambda: k * sky(theta + k * x, along="theta"),
    ),
    "R07.s4.1d": Equation(
        lambda: curvature().value.expression.subs(k, 0), lambda: L(x, theta)
    ),
    "R07.12": Equation(
        lambda: derive(Mirror()).gradient.expression[1], lambda: -L(x, -theta, along="theta")
    ),
    "R07.13": Equation(
        lambda: [derive(Mirror()).value, derive(Mirror()).gradient],
        lambda: [L(x, -theta), MIRRORED.printed()],
    ),
    "R07.14": Equation(lambda: derive(LOBE, LEAVING).value, in_place),
    "R07.15": SHADED,
    "R07.16": SHADED,
    "R07.17": Equation(
        lambda: [curvature(True).value, curvature(True).gradient],
        lambda: [L(x, theta - k * x), sheared(-1)],
    ),
    "R07.18": Equation(
        lambda: derive(SPOTTED, LEAVING).value, lambda: integral(L(x, theta - t) * spotted(x, t))
    ),
    "R07.19": Equation(
        lambda: derive(SPOTTED, LEAVING).gradient,
        lambda: [
            integral(
                L(x, theta - t, along="x") * spotted(x, t)
                + L(x, theta - t) * spotted(x, t, along="x")
            ),
            integral(L(x, theta - t, along="theta") * spotted(x, t)),
        ],
    ),
    "R07.20": Equation(
        lambda: derive(
            UnknownField("E", frame=LINE) >> Texture(UnknownField("T", frame=LINE))
        ).gradient,
        lambda: [E(x, along="x") * T(x) + E(x) * T(x, along="x")],
    ),
    "R07.21": Equation(
        lambda: [derive(Bump(NORMAL)).value, derive(Bump(NORMAL)).gradient],
        lambda: [
            L(x, theta + n(x)),
            L(x, theta + n(x), along="x") + n_x * L(x, theta + n(x), along="theta"),
            L(x, theta + n(x), along="theta"),
        ],
    ),
    "R07.22": Equation(
        lambda: reflected().value,
        # L^m(x, w) at w = theta - n - t, which mirrors the local angle n - w
        lambda: integral(L(x, -(theta - n(x) - t) + n(x)) * rho(t)),
    ),
    "R07.s4.3a": Equation(
        lambda: derive(Bump(NORMAL) >> Mirror()).value, lambda: L(x, -theta + n(x))
    ),
    "R07.23": Equation(lambda: reflected().value, convolved),
    "R07.s4.3b": Equation(
        lambda: derive(Bump(NORMAL) >> Mirror() >> Bump(NORMAL, back=True)).value,
        lambda: L(x, 2 * n(x) - theta),
    ),
    "R07.24": Equation(lambda: reflected().gradient, matrices),
    "R07.25": GRADIENT,
    "R07.s4.3c": Equation(
        lambda: derive(LIGHT >> surface() >> Texture(UnknownField("T", ("x",))))
        .gradient.expression[0],
        lambda: T(x) * GRADIENT.printed()[0] + T(x, along="x") * convolved(),
    ),
    "R07.s4.3d": Equation(
        lambda: named_terms(LIGHT >> surface(SPOTTED)).MV,
        lambda: integral(L(x, 2 * n(x) - theta + t) * spotted(x, t, along="x")),
    ),
    "R07.s5.2a": Equation(
        lambda: [terms().SV, terms().DV, terms().CV, terms().CDV],
        lambda: [
            convolved("x"), convolved("theta"), 2 * n_x, 2 * n_x * convolved("theta")
        ],
    ),
    "R07.s5.2b": Equation(
        lambda: [terms().total, terms().MV],
        lambda: [flat(reflected().gradient)[0], 0],
    ),
    "R07.s5.2c": Equation(
        lambda: reflected().gradient.expression[1], lambda: -terms().DV.expression
    ),
    "R07.fig4.distant": Equation(
        lambda: [terms(distant=True).SV, terms(distant=True).total],
        lambda: [0, 2 * n_x * integral(sky(2 * n(x) - theta + t, along="theta") * rho(t))],
    ),
    "R07.fig4.flat": Equation(
        lambda: [terms(True).CV, terms(True).CDV, terms(True).total],
        lambda: [0, 0, integral(L(x, -theta + t, along="x") * rho(t))],
    ),
    "R07.fig4.flat-envmap": Equation(
        lambda: [terms(True, True).total, terms(True, True).DV],
        lambda: [0, integral(sky(-theta + t, along="theta") * rho(t))],
    ),
    "R07.fig4.lambertian": Equation(
        lambda: [lambertian().total, lambertian().CV],
        lambda: [under_cosine("x") + n_x * under_cosine("theta"), n_x],
    ),
    "R07.29": Equation(
        lambda: reflected().hessian,
        lambda: [
            convolved("x", "x")
            + 4 * n_x * convolved("x", "theta")
            + 4 * n_x**2 * convolved("theta", "theta")
            + 2 * n_xx * convolved("theta"),
            *2 * [-convolved("x", "theta") - 2 * n_x * convolved("theta", "theta")],
            convolved("theta", "theta"),
        ],
    ),
    "R07.50": Equation(lambda: curvature().spectrum, lambda: L_hat(Ox - k * Ot, Ot)),
    "R07.s10a": Equation(
        lambda: [
            matrix(curvature().laws[0].M).inv().T, matrix(curvature().laws[0].M).det()
        ],
        lambda: [sp.Matrix([[1, -k], [0, 1]]), 1],
    ),
    "R07.s10c": Equation(
        lambda: [curvature().value, curvature().spectrum],
        lambda: [L(x, theta + k * x), L_hat(Ox - k * Ot, Ot)],
    ),
    "R07.s10d": Equation(
        lambda: derive(
            DISTANT >> Curvature(k) >> Mirror() >> LOBE >> Curvature(k, back=True)
        ).gradient.expression[0],
        lambda: 2 * k * integral(sky(2 * k * x - theta + t, along="theta") * rho(t)),
    ),
    "R07.68": Equation(
        lambda: derive(Bump(NORMAL) >> Mirror() >> Bump(NORMAL, back=True)).gradient,
        lambda: [
            L(x, 2 * n(x) - theta, along="x")
            + 2 * n_x * L(x, 2 * n(x) - theta, along="theta"),
            -L(x, 2 * n(x) - theta, along="theta"),
        ],
    ),
    "R07.69": Equation(
        first_derivatives_again,
        lambda: [
            convolved("x", "x") + 2 * n_x * convolved("x", "theta"),
            -convolved("x", "theta"),
            convolved("x", "theta") + 2 * n_x * convolved("theta", "theta"),
            -convolved("theta", "theta"),
        ],
    ),
}  # fmt: skip
