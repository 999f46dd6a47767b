"""The steps of J12's appendices A to D: (74)-(82) in flatland, (83)-(87) in space."""

from __future__ import annotations

import functools

import numpy as np
import sympy as sp

from derivations.scene.geometry_term import (
    GRADIENT,
    HESSIAN,
    VECTORS,
    a,
    b,
    by_x,
    definition,
    differences,
    jacobian,
    length,
    pairs,
    products,
    r,
    rest,
    s,
    term,
)
from firstorder.ledger import Check, Counterexample, Row, na


def product_rule(d):
    """(74), (83): the three factors, each differentiated on its own."""
    over = r ** (1 - d)
    parts = a * b * by_x(over, d) + over * (a * by_x(b, d) + b * by_x(a, d))
    return products(d) + rest(by_x(term(d), d), parts)


def moved_vector():
    """(75): the Jacobian of `p = y - x` by x is `-I`."""
    return jacobian(VECTORS[2][0], 2) + sp.eye(2)


def inverse_powers(d):
    """(76), for symbolic n."""
    n, p = sp.symbols("n", positive=True), VECTORS[d][0]
    true = by_x(r**-n, d)
    return [
        *(sp.simplify(e) for e in true + n / r ** (n + 1) * by_x(r, d)),
        *(sp.simplify(e) for e in true - n / r ** (n + 2) * p),
    ]


def cosines(d):
    """(77) and (78)."""
    p, n, m = VECTORS[d]
    return (
        products(d) + rest(by_x(a, d), -n / r + a * p / s),
        products(d) + rest(by_x(b, d), m / r + b * p / s),
    )


def first(d):
    """The first term of the gradient, without its coefficient."""
    return a * b * VECTORS[d][0] / r ** (d + 1)


def by_parts(d):
    """(79), (84); (76)-(78) for its gradients, and the Jacobian of y by x, minus the identity."""
    p, n, m = VECTORS[d]
    power, of_a, of_b = (d + 1) * p / r ** (d + 3), -n / r + a * p / s, m / r + b * p / s
    blocks = rest(by_x(r ** -(d + 1), d), power) + rest(by_x(a, d), of_a) + rest(by_x(b, d), of_b)
    parts = a * b * p * power.T + (a * p * of_b.T + b * p * of_a.T) / r ** (d + 1)
    return blocks + rest(jacobian(first(d), d), parts - a * b / r ** (d + 1) * sp.eye(d))


def first_term(d):
    """(80), (85)."""
    p, n, m = VECTORS[d]
    c = {2: 5, 3: 6}[d]
    parts = c * a * b * p * p.T / r ** (d + 3) - (b * p * n.T - a * p * m.T) / r ** (d + 2)
    return products(d) + rest(jacobian(first(d), d), parts - a * b * sp.eye(d) / r ** (d + 1))


def second_term(d):
    """(81), (86)."""
    p, n, m = VECTORS[d]
    parts = {2: 3, 3: 4}[d] * b * n * p.T / r ** (d + 2) + n * m.T / r ** (d + 1)
    return products(d) + rest(jacobian(b * n / r**d, d), parts)


def third_term(d):
    """(82), (87)."""
    p, n, m = VECTORS[d]
    parts = {2: 3, 3: 4}[d] * a * m * p.T / r ** (d + 2) - m * n.T / r ** (d + 1)
    return products(d) + rest(jacobian(a * m / r**d, d), parts)


# --- numbers ---------------------------------------------------------------------------------


def _cos_x(p, n, m):
    return n @ p / length(p)


def _cos_y(p, n, m):
    return -(m @ p) / length(p)


def _scale(p, n, m):
    """Distance, cosines and dimension, of floating-point numbers."""
    return np.sqrt(p @ p), n @ p / np.sqrt(p @ p), -(m @ p) / np.sqrt(p @ p), len(p)


def _product_rule(p, n, m):
    """The three summands of (74) and (83), each from (76)-(78)."""
    r, a, b, d = _scale(p, n, m)
    power = (d - 1) * p / r ** (d + 1)
    return a * b * power + (a * (m / r + b / r**2 * p) + b * (-n / r + a / r**2 * p)) / r ** (d - 1)


def _library(p, n, m):
    from firstorder.scene._geometry_term import geometry_gradient

    return geometry_gradient(0.0 * p, n, p, m)


def _library_vector(p, n, m):
    """What (79) leaves for the Jacobian of the vector itself, of the library's Hessian."""
    r, a, b, d = _scale(p, n, m)
    by_x, by_y = STEPS["cos_x"][1](p, n, m), STEPS["cos_y"][1](p, n, m)
    factor = a * b * (d + 1) * p / r ** (d + 3) + (a * by_y + b * by_x) / r ** (d + 1)
    first = _library_term("first")(p, n, m)
    return (first - np.outer(p, factor)) * r ** (d + 1) / (a * b)


def _library_power(p, n, m):
    """The library's gradient between normals that face each other: both cosines are stationary."""
    way = p / np.sqrt(p @ p)
    return _library(p, way, -way)


def _library_cos(of):
    """What (74) and (83) leave for the gradient of one cosine, of the library's gradient."""

    def rest(p, n, m):
        r, a, b, d = _scale(p, n, m)
        by_x, by_y = STEPS["cos_x"][1](p, n, m), STEPS["cos_y"][1](p, n, m)
        both = r ** (d - 1) * np.asarray(_library(p, n, m)) - (d - 1) * a * b * p / r**2
        return (both - a * by_y) / b if of == "x" else (both - b * by_x) / a

    return rest


def _library_term(of):
    """What the library's Hessian leaves for the Jacobian of one of the gradient's three terms."""

    def rest(p, n, m):
        from firstorder.scene._geometry_term import geometry_hessian

        c = {2: 3, 3: 4}[len(p)]
        H = np.asarray(geometry_hessian(0.0 * p, n, p, m))
        first, second, third = (term(p, n, m) for term in (_first_term, _second_term, _third_term))
        return {
            "first": (H + second - third) / c,
            "second": c * first + third - H,
            "third": H - c * first + second,
        }[of]

    return rest


def _by_parts(p, n, m):
    r, a, b, d = _scale(p, n, m)
    return (
        a * b * np.outer(p, (d + 1) * p / r ** (d + 3))
        + a / r ** (d + 1) * np.outer(p, m / r + b * p / r**2)
        + b / r ** (d + 1) * np.outer(p, -n / r + a * p / r**2)
        - a * b / r ** (d + 1) * np.eye(d)
    )


def _first_term(p, n, m):
    r, a, b, d = _scale(p, n, m)
    return (
        {2: 5, 3: 6}[d] * a * b * np.outer(p, p) / r ** (d + 3)
        - b * np.outer(p, n) / r ** (d + 2)
        + a * np.outer(p, m) / r ** (d + 2)
        - a * b * np.eye(d) / r ** (d + 1)
    )


def _second_term(p, n, m):
    r, _, b, d = _scale(p, n, m)
    return {2: 3, 3: 4}[d] * b * np.outer(n, p) / r ** (d + 2) + np.outer(n, m) / r ** (d + 1)


def _third_term(p, n, m):
    r, a, _, d = _scale(p, n, m)
    return {2: 3, 3: 4}[d] * a * np.outer(m, p) / r ** (d + 2) - np.outer(m, n) / r ** (d + 1)


# Definitions, of numbers of any package, and what the paper makes of their derivatives by x.
STEPS = {
    "vector": (lambda p, n, m: p, lambda p, n, m: -np.eye(len(p)), _library_vector),
    "power": (  # n = d - 1, the one of the geometry term
        lambda p, n, m: length(p) ** (1 - len(p)),
        lambda p, n, m: (len(p) - 1.0) * p / np.sqrt(p @ p) ** (len(p) + 1),
        _library_power,
    ),
    "cos_x": (
        _cos_x,
        lambda p, n, m: (-n + (n @ p) / (p @ p) * p) / np.sqrt(p @ p),
        _library_cos("x"),
    ),
    "cos_y": (
        _cos_y,
        lambda p, n, m: (m - (m @ p) / (p @ p) * p) / np.sqrt(p @ p),
        _library_cos("y"),
    ),
    "value": (definition, _product_rule, _library),
    "by parts": (
        lambda p, n, m: definition(p, n, m) / (p @ p) * p,
        _by_parts,
        _library_term("first"),
    ),
    "first": (
        lambda p, n, m: definition(p, n, m) / (p @ p) * p,
        _first_term,
        _library_term("first"),
    ),
    "second": (
        lambda p, n, m: _cos_y(p, n, m) / length(p) ** len(p) * n,
        _second_term,
        _library_term("second"),
    ),
    "third": (
        lambda p, n, m: _cos_x(p, n, m) / length(p) ** len(p) * m,
        _third_term,
        _library_term("third"),
    ),
}


def _by_jax(f, pair):
    import jax
    import jax.numpy as jnp

    x, n, y, m = map(jnp.asarray, pair)
    return np.asarray(jax.jit(jax.jacfwd(lambda x: f(y - x, n, m)))(x))


@functools.cache
def _errors(step, d, route):
    """Largest relative error of a step by autodiff, or by central differences with 60 digits."""
    from firstorder.checks.tolerance import normwise

    primal, *formulas = STEPS[step]
    worst = 0.0
    for pair in pairs(d):
        truth = _by_jax(primal, pair) if route == "jax" else differences(primal, pair, 1)
        x, n, y, m = pair
        ours = (np.asarray(formula(y - x, n, m)) for formula in formulas)
        worst = max(worst, *(normwise(matrix, truth) for matrix in ours))
    return worst


def rate_of_vector(u1, u2):
    """Sum of the components of the change of y - x per step of x along (u1, u2)."""
    x, y, h = np.array([0.2, -0.1]), np.array([0.7, 1.3]), 1e-6
    u = np.array([u1, u2])
    return float(np.sum((y - (x + h * u)) - (y - (x - h * u))) / (2 * h))


def _row(number, step, d, function, proof, kind="identity", **more):
    return Row(
        f"J12.{number}",
        kind,
        **function,
        symbolic=proof,
        autodiff=Check(lambda: _errors(step, d, "jax"), 1e-12),
        fourier=na("no spectrum"),
        brute_force=Check(lambda: _errors(step, d, "differences"), 1e-12),
        **more,
    )


ROWS = [
    _row(74, "value", 2, GRADIENT, lambda: product_rule(2)),
    _row(
        75,
        "vector",
        2,
        HESSIAN,
        moved_vector,
        "misprint",
        corrected="J_x(y) = -I_2, a matrix; (80) uses it so",
        counterexample=Counterexample(
            {"u1": 0.6, "u2": -0.8},
            # The printed (-1, -1) as a gradient: each step of x would change y by its negative
            # sum in every component.
            printed=lambda u1, u2: 2.0 * (-u1 - u2),
            true=rate_of_vector,
        ),
    ),
    _row(76, "power", 2, GRADIENT, lambda: inverse_powers(2), note="Numbers: n = 1, of G itself."),
    _row(77, "cos_x", 2, GRADIENT, lambda: cosines(2)[0]),
    _row(78, "cos_y", 2, GRADIENT, lambda: cosines(2)[1]),
    _row(
        79,
        "by parts",
        2,
        HESSIAN,
        lambda: by_parts(2),
        note="The transpose of J(y) does no harm: J(y) = -I.",
    ),
    _row(80, "first", 2, HESSIAN, lambda: first_term(2)),
    _row(81, "second", 2, HESSIAN, lambda: second_term(2)),
    _row(82, "third", 2, HESSIAN, lambda: third_term(2)),
    _row(83, "value", 3, GRADIENT, lambda: product_rule(3)),
    _row(
        84,
        "by parts",
        3,
        HESSIAN,
        lambda: by_parts(3),
        note="J(y) = -I: (75) prints it as a vector.",
    ),
    _row(85, "first", 3, HESSIAN, lambda: first_term(3)),
    _row(86, "second", 3, HESSIAN, lambda: second_term(3)),
    _row(87, "third", 3, HESSIAN, lambda: third_term(3)),
]
