"""The geometric coupling in space and its derivatives: J12 (58), (66) and (83)-(87).

Everything starts from `G = -(n_x . p)(n_y . p) / |p|^4`, p = y - x, and `d/dx = -d/dp`. The three
scalar products are symbols that know their own gradients, so that every step is a polynomial over a
power of `p . p`, for any vectors, of unit length or not.
"""

from __future__ import annotations

import functools

import mpmath as mp
import numpy as np
import sympy as sp

from derivations.ledger import Check, Row, na

p = sp.Matrix(sp.symbols("p1:4", real=True))
n = sp.Matrix(sp.symbols("n1:4", real=True))  # at x
m = sp.Matrix(sp.symbols("m1:4", real=True))  # at y
A, B = sp.symbols("A B", real=True)  # n . p and m . p
s = sp.Symbol("s", positive=True)  # p . p
r = sp.sqrt(s)
a, b = A / r, -B / r  # the cosines
G = -A * B / s**2


def by_x(scalar):
    """Gradient by x of a function of p = y - x, in p itself and in its three products."""
    inner = sp.Matrix([sp.diff(scalar, c) for c in p])
    return -(inner + sp.diff(scalar, A) * n + sp.diff(scalar, B) * m + 2 * sp.diff(scalar, s) * p)


def jacobian(vector):
    return sp.Matrix([by_x(c).T for c in vector])


def rest(true, printed):
    return [sp.expand(e) for e in true - printed]


def products():
    """The gradients of the three products, from their components."""
    pairs = ((A, n.dot(p)), (B, m.dot(p)), (s, p.dot(p)))
    return [e for q, v in pairs for e in by_x(q) + sp.Matrix([sp.diff(v, c) for c in p])]


def gradient():
    """(58)."""
    return products() + rest(by_x(G), 4 * a * b * p / r**4 - b * n / r**3 + a * m / r**3)


def hessian():
    """(66)."""
    H = 24 * a * b * p * p.T / r**6 - 4 * a * b * sp.eye(3) / r**4
    H = H - (n * m.T + m * n.T) / r**4 - 4 * b * (n * p.T + p * n.T) / r**5
    return rest(jacobian(by_x(G)), H + 4 * a * (m * p.T + p * m.T) / r**5)


def product_rule():
    """(83): each factor differentiated on its own."""
    parts = a * b * by_x(1 / s) + (a * by_x(b) + b * by_x(a)) / s
    return rest(by_x(G), parts)


FIRST = p * a * b / r**4


def by_parts():
    """(84); (76)-(78) for its gradients, and the Jacobian of y by x, minus the identity."""
    power, of_a, of_b = 4 * p / r**6, -n / r + a * p / r**2, m / r + b * p / r**2
    blocks = rest(by_x(s**-2), power) + rest(by_x(a), of_a) + rest(by_x(b), of_b)
    parts = a * b * p * power.T + (a * p / r**4) * of_b.T + (b * p / r**4) * of_a.T
    return blocks + rest(jacobian(FIRST), parts - a * b / r**4 * sp.eye(3))


def first_term():
    """(85)."""
    parts = 6 * a * b * p * p.T / r**6 - b * p * n.T / r**5 + a * p * m.T / r**5
    return rest(jacobian(FIRST), parts - a * b * sp.eye(3) / r**4)


def second_term():
    """(86)."""
    return rest(jacobian(b * n / r**3), 4 * b * n * p.T / r**5 + n * m.T / r**4)


def third_term():
    """(87)."""
    return rest(jacobian(a * m / r**3), 4 * a * m * p.T / r**5 - m * n.T / r**4)


# --- numbers --------------------------------------------------------------------------------------


@functools.cache
def scene():
    """Two points with unit normals that see each other, in no special position."""
    rng = np.random.default_rng(8)
    x, y = rng.normal(size=3), rng.normal(size=3)
    way = (y - x) / np.linalg.norm(y - x)
    tilts = rng.normal(size=(2, 3)) * 0.5
    up, down = way + tilts[0], -way + tilts[1]
    return x, up / np.linalg.norm(up), y, down / np.linalg.norm(down)


def _numbers(x):
    """By definition, with 40 digits: cosine times the solid angle of a square metre."""
    _, up, y, down = scene()
    way = [mp.mpf(q) - c for q, c in zip(y, x, strict=True)]
    r = mp.sqrt(sum(c * c for c in way))
    u = [c / r for c in way]
    cos_x = sum(mp.mpf(float(c)) * d for c, d in zip(up, u, strict=True))
    cos_y = -sum(mp.mpf(float(c)) * d for c, d in zip(down, u, strict=True))
    return cos_x, cos_y, r, way


TERMS = {
    "G": lambda a, b, r, y: [a * b / r**2],
    "first": lambda a, b, r, y: [a * b * c / r**4 for c in y],
    "second": lambda a, b, r, y: [b * mp.mpf(float(c)) / r**3 for c in scene()[1]],
    "third": lambda a, b, r, y: [a * mp.mpf(float(c)) / r**3 for c in scene()[3]],
}


@functools.cache
def differences(term, order=1):
    """Jacobian of a term by x, or G's Hessian, from central differences with 40 digits."""
    with mp.workdps(40):
        h = mp.mpf(10) ** -9
        x = [mp.mpf(float(c)) for c in scene()[0]]

        def at(*moves):
            q = list(x)
            for i, s in moves:
                q[i] = q[i] + s * h
            return TERMS[term](*_numbers(q))

        if order == 1:
            columns = [[(s - t) / (2 * h) for s, t in zip(at((i, 1)), at((i, -1)), strict=True)]
                       for i in range(3)]  # fmt: skip
            return np.array(columns, float).T
        H = np.zeros((3, 3))
        for i in range(3):
            for j in range(3):
                corner = [at((i, s), (j, t))[0] * s * t for s in (1, -1) for t in (1, -1)]
                H[i, j] = mp.fsum(corner) / (4 * h * h)
        return H


def closed(term, order=1):
    """The right-hand sides as printed, in numbers."""
    x, up, y, down = scene()
    way = y - x
    r = float(np.linalg.norm(way))
    a, b = up @ way / r, -down @ way / r
    if term == "G":
        from firstorder.space._geometry_term import coupling_jet

        jet = coupling_jet(x, up, y, down)
        return np.asarray((jet.gradient[None], jet.hessian)[order - 1])
    if term == "first":
        terms = 6 * a * b * np.outer(way, way) / r**6 - b * np.outer(way, up) / r**5
        return terms + a * np.outer(way, down) / r**5 - a * b * np.eye(3) / r**4
    if term == "second":
        return 4 * b * np.outer(up, way) / r**5 + np.outer(up, down) / r**4
    return 4 * a * np.outer(down, way) / r**5 - np.outer(down, up) / r**4


@functools.cache
def _autodiff():
    """Jacobians of the three terms of the gradient and of G, and G's Hessian, by JAX."""
    import jax
    import jax.numpy as jnp

    from firstorder.space._geometry_term import coupling

    x, up, y, down = map(jnp.asarray, scene())

    def terms(x):
        way = y - x
        r = jnp.sqrt(way @ way)
        a, b = up @ way / r, -down @ way / r
        return a * b * way / r**4, b * up / r**3, a * down / r**3

    def value(x):
        return coupling(x, up, y, down)

    def all_of_it(x):
        jacobians = jax.jacfwd(terms)(x)
        return dict(zip(("first", "second", "third"), jacobians, strict=True)), (
            jax.grad(value)(x),
            jax.hessian(value)(x),
        )

    return jax.jit(all_of_it)(x)


def against_autodiff(term, order=1):
    from firstorder.checks.tolerance import normwise

    jacobians, (gradient, H) = _autodiff()
    if term == "G":
        return normwise(closed("G", order), (gradient[None], H)[order - 1])
    return normwise(closed(term), jacobians[term])


def against_differences(term, order=1):
    from firstorder.checks.tolerance import normwise

    return normwise(closed(term, order), differences(term, order))


SHARED = {"fourier": na("no spectrum")}


def _row(number, proof, term, function, order=1, note=""):
    return Row(
        f"J12.{number}",
        "identity",
        implements=f"firstorder.space._geometry_term.{function}",
        symbolic=proof,
        autodiff=Check(lambda: against_autodiff(term, order), 1e-12),
        brute_force=Check(lambda: against_differences(term, order), 1e-12),
        note=note,
        **SHARED,
    )


ROWS = [
    _row(58, gradient, "G", "coupling_gradient", note="Right as printed, with y measured from x."),
    _row(66, hessian, "G", "coupling_hessian", 2, "Right as printed; symmetric."),
    _row(83, product_rule, "G", "coupling_gradient"),
    _row(84, by_parts, "first", "coupling_hessian", note="J(y) = -I: (75) prints it as a vector."),
    _row(85, first_term, "first", "coupling_hessian"),
    _row(86, second_term, "second", "coupling_hessian"),
    _row(87, third_term, "third", "coupling_hessian"),
]
