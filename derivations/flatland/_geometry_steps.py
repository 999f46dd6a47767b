"""The steps of J12's appendices A and B: (74)-(82), each from its own definition."""

from __future__ import annotations

import numpy as np
import sympy as sp

from derivations.flatland.geometry_term import (
    COS_X,
    COS_Y,
    GRADIENT,
    HESSIAN,
    I2,
    NX,
    NY,
    PAIRS,
    P,
    R,
    grad,
    jacobian,
    up,
)
from derivations.ledger import Check, Counterexample, Row, na


def product_rule():
    """(74): the three factors, each differentiated from its own definition."""
    whole = grad(COS_X * COS_Y / R)
    parts = COS_X * COS_Y * grad(1 / R) + COS_X / R * grad(COS_Y) + COS_Y / R * grad(COS_X)
    return sp.simplify(whole - parts)


def moved_vector():
    """(75): the Jacobian of `p = y - x` by x is `-I`."""
    return jacobian(P) + I2


def inverse_powers():
    """(76), for symbolic n."""
    n = sp.symbols("n", positive=True)
    return [
        sp.simplify(grad(R**-n) + n / R ** (n + 1) * grad(R)),
        sp.simplify(grad(R**-n) - n / R ** (n + 2) * P),
    ]


def cosines():
    """(77) and (78)."""
    return (
        sp.simplify(grad(COS_X) - (-NX / R + COS_X / R**2 * P)),
        sp.simplify(grad(COS_Y) - (NY / R + COS_Y / R**2 * P)),
    )


def first_term():
    """(79) and (80)."""
    whole = jacobian(COS_X * COS_Y / R**3 * P)
    rule = (
        COS_X * COS_Y * P * grad(R**-3).T
        + COS_X / R**3 * P * grad(COS_Y).T
        + COS_Y / R**3 * P * grad(COS_X).T
        + COS_X * COS_Y / R**3 * jacobian(P).T
    )
    evaluated = (
        5 * COS_X * COS_Y / R**5 * P * P.T
        - COS_Y / R**4 * P * NX.T
        + COS_X / R**4 * P * NY.T
        - COS_X * COS_Y / R**3 * I2
    )
    return sp.simplify(whole - rule), sp.simplify(whole - evaluated)


def other_terms():
    """(81) and (82)."""
    second = 3 * COS_Y / R**4 * NX * P.T + NX * NY.T / R**3
    third = 3 * COS_X / R**4 * NY * P.T - NY * NX.T / R**3
    return (
        sp.simplify(jacobian(COS_Y / R**2 * NX) - second),
        sp.simplify(jacobian(COS_X / R**2 * NY) - third),
    )


# --- numbers ---------------------------------------------------------------------------------


def step(primal, formula) -> dict:
    """One step of an appendix by autodiff and by central differences.

    Both differentiate `primal(xp, x, n_x, y, n_y)`, the definition in either of two array packages.
    """

    def errors(route):
        worst = 0.0
        for x, a, y, b in PAIRS:
            x, y = np.array(x), np.array(y)
            truth = route(primal, x, up(a), y, up(b))
            worst = max(worst, float(np.max(np.abs(truth - formula(y - x, up(a), up(b))))))
        return worst

    return {
        "autodiff": Check(lambda: errors(_by_jax), 1e-12),
        "fourier": na("no spectrum"),
        "brute_force": Check(lambda: errors(_by_differences), 1e-8),
    }


def _by_jax(primal, x, n, y, m):
    import jax
    import jax.numpy as jnp

    return np.asarray(jax.jacfwd(lambda x: primal(jnp, x, n, y, m))(jnp.asarray(x)))


def _by_differences(primal, x, n, y, m, h=1e-5):
    columns = [
        (primal(np, x + h * e, n, y, m) - primal(np, x - h * e, n, y, m)) / (2 * h)
        for e in np.eye(2)
    ]
    return np.stack(columns, -1)


def _r(p):
    return np.sqrt(p @ p)


def _cx(p, n):
    return n @ p / _r(p)


def _cy(p, m):
    return -(m @ p) / _r(p)


def length(xp, p):
    """The distance, in either package."""
    return xp.sqrt(xp.sum(p * p))


def value(xp, x, n, y, m):
    p = y - x
    return -(n @ p) * (m @ p) / length(xp, p) ** 3


def first(xp, x, n, y, m):
    p = y - x
    return -(n @ p) * (m @ p) / length(xp, p) ** 5 * p


def second(xp, x, n, y, m):
    p = y - x
    return -(m @ p) / length(xp, p) ** 3 * n


def third(xp, x, n, y, m):
    p = y - x
    return (n @ p) / length(xp, p) ** 3 * m


def _by_parts(p, n, m):
    """The three summands of (74), each from (76)-(78)."""
    r, a, b = _r(p), _cx(p, n), _cy(p, m)
    return a * b * p / r**3 + a / r * (m / r + b / r**2 * p) + b / r * (-n / r + a / r**2 * p)


def _first_evaluated(p, n, m):
    r, a, b = _r(p), _cx(p, n), _cy(p, m)
    return (
        5 * a * b / r**5 * np.outer(p, p)
        - b / r**4 * np.outer(p, n)
        + a / r**4 * np.outer(p, m)
        - a * b / r**3 * np.eye(2)
    )


def _first_by_rule(p, n, m):
    r, a, b = _r(p), _cx(p, n), _cy(p, m)
    return (
        a * b * np.outer(p, 3 * p / r**5)
        + a / r**3 * np.outer(p, m / r + b * p / r**2)
        + b / r**3 * np.outer(p, -n / r + a * p / r**2)
        + a * b / r**3 * (-np.eye(2)).T
    )


def rate_of_vector(u1, u2):
    """Sum of the components of the change of y - x per step of x along (u1, u2)."""
    x, y, h = np.array([0.2, -0.1]), np.array([0.7, 1.3]), 1e-6
    u = np.array([u1, u2])
    return float(np.sum((y - (x + h * u)) - (y - (x - h * u))) / (2 * h))


ROWS = [
    Row("J12.74", "identity", **GRADIENT, symbolic=product_rule, **step(value, _by_parts)),
    Row(
        "J12.75",
        "misprint",
        **GRADIENT,
        symbolic=moved_vector,
        **step(lambda xp, x, n, y, m: y - x, lambda p, n, m: -np.eye(2)),
        corrected="J_x(y) = -I_2, a matrix; (80) uses it so",
        counterexample=Counterexample(
            {"u1": 0.6, "u2": -0.8},
            # The printed (-1, -1) as a gradient: each step of x would change y by its negative
            # sum in every component.
            printed=lambda u1, u2: 2.0 * (-u1 - u2),
            true=rate_of_vector,
        ),
    ),
    Row(
        "J12.76",
        "identity",
        **GRADIENT,
        symbolic=inverse_powers,
        **step(
            lambda xp, x, n, y, m: length(xp, y - x) ** -3.0, lambda p, n, m: 3.0 * p / _r(p) ** 5
        ),
    ),
    Row(
        "J12.77",
        "identity",
        **GRADIENT,
        symbolic=lambda: cosines()[0],
        **step(
            lambda xp, x, n, y, m: n @ (y - x) / length(xp, y - x),
            lambda p, n, m: -n / _r(p) + _cx(p, n) / _r(p) ** 2 * p,
        ),
    ),
    Row(
        "J12.78",
        "identity",
        **GRADIENT,
        symbolic=lambda: cosines()[1],
        **step(
            lambda xp, x, n, y, m: -(m @ (y - x)) / length(xp, y - x),
            lambda p, n, m: m / _r(p) + _cy(p, m) / _r(p) ** 2 * p,
        ),
    ),
    Row(
        "J12.79",
        "identity",
        **HESSIAN,
        symbolic=lambda: first_term()[0],
        **step(first, _first_by_rule),
        note="The transpose of J(y) does no harm: J(y) = -I.",
    ),
    Row(
        "J12.80",
        "identity",
        **HESSIAN,
        symbolic=lambda: first_term()[1],
        **step(first, _first_evaluated),
    ),
    Row(
        "J12.81",
        "identity",
        **HESSIAN,
        symbolic=lambda: other_terms()[0],
        **step(
            second,
            lambda p, n, m: (
                3 * _cy(p, m) / _r(p) ** 4 * np.outer(n, p) + np.outer(n, m) / _r(p) ** 3
            ),
        ),
    ),
    Row(
        "J12.82",
        "identity",
        **HESSIAN,
        symbolic=lambda: other_terms()[1],
        **step(
            third,
            lambda p, n, m: (
                3 * _cx(p, n) / _r(p) ** 4 * np.outer(m, p) - np.outer(m, n) / _r(p) ** 3
            ),
        ),
    ),
]
