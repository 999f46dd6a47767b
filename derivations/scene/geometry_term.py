"""The geometry term in flatland and in space: J12 (26), (38), (49), (58) and (66).

Everything starts from `G = -(n_x . p)(n_y . p) / |p|^(d+1)`, p = y - x, and `d/dx = -d/dp`. The
three scalar products are symbols that know their own gradients, so that every step is a polynomial
over a power of `p . p`, for any vectors, of unit length or not. Coefficients are those that the
paper prints for d = 2 and for d = 3. It measures angles towards +x and writes y for the vector from
x to y; neither shows here, where all is vectors. The steps of its appendices are `_geometry_steps`.
"""

from __future__ import annotations

import functools

import mpmath as mp
import numpy as np
import sympy as sp

from firstorder.ledger import Check, Row, na

A, B = sp.symbols("A B", real=True)  # n . p and m . p
s = sp.Symbol("s", positive=True)  # p . p
r = sp.sqrt(s)
a, b = A / r, -B / r  # the cosines
VECTORS = {
    d: tuple(sp.Matrix(sp.symbols(f"{name}1:{d + 1}", real=True)) for name in "pnm") for d in (2, 3)
}


def term(d):
    """The geometry term by its definition, cosines over a power of the distance."""
    return a * b / r ** (d - 1)


def by_x(scalar, d):
    """Gradient by x of a function of p = y - x, in p itself and in its three products."""
    p, n, m = VECTORS[d]
    inner = sp.Matrix([sp.diff(scalar, c) for c in p])
    return -(inner + sp.diff(scalar, A) * n + sp.diff(scalar, B) * m + 2 * sp.diff(scalar, s) * p)


def jacobian(vector, d):
    """Rows are components, columns are coordinates of x."""
    return sp.Matrix([by_x(c, d).T for c in vector])


def rest(true, printed):
    """Entries of a difference, which must all vanish."""
    return [sp.expand(e) for e in true - printed]


def products(d):
    """The gradients of the three products, from their components."""
    p, n, m = VECTORS[d]
    pairs = ((A, n.dot(p)), (B, m.dot(p)), (s, p.dot(p)))
    return [e for q, v in pairs for e in by_x(q, d) + sp.Matrix([sp.diff(v, c) for c in p])]


# --- from the angle to the geometry term --------------------------------------------------------


def subtended():
    """(26): the polar angle of a point that runs along a curve, as a function of arc length.

    Both a straight curve and one of curvature c are followed: only the tangent matters at l = 0.
    """
    length, c, slope = sp.symbols("l c phi", real=True)
    start = sp.Matrix(sp.symbols("y1 y2", real=True))
    tangent = sp.Matrix([sp.cos(slope), sp.sin(slope)])
    normal = sp.Matrix([-tangent[1], tangent[0]])  # left of the direction of travel
    out = []
    for bend in (0, c):
        at = start + length * tangent + bend * length**2 / 2 * normal
        rate = sp.diff(sp.atan2(at[1], at[0]), length).subs(length, 0)
        distance = sp.sqrt(start.dot(start))
        out.append(sp.simplify(rate - (-normal.dot(start) / distance) / distance))
    return out


def symmetric():
    """`cos_x dtheta/dl` is `-(n_x . p)(n_y . p) / r^3`, and it is symmetric.

    When the two points change places, (n_x, n_y, p) become (n_y, n_x, -p).
    """
    G = term(2)
    swapped = G.subs({A: -B, B: -A}, simultaneous=True)
    return [*subtended(), sp.simplify(G + A * B / r**3), sp.simplify(G - swapped)]


def curved_neighbours():
    """Two points of a circle of curvature k: `G = k^2 r / 4`, which vanishes with r."""
    t, k = sp.symbols("t k", positive=True)
    at = sp.Matrix([sp.sin(t), 1 - sp.cos(t)]) / k
    inward = sp.Matrix([-sp.sin(t), sp.cos(t)])
    r2 = sp.simplify(at.dot(at))
    cosines = -sp.Matrix([0, 1]).dot(at) * inward.dot(at)
    return sp.simplify(cosines / r2 - k**2 * r2 / 4)


# --- its derivatives ----------------------------------------------------------------------------


def gradient(d):
    """(38) and (58) from the definition."""
    p, n, m = VECTORS[d]
    c = {2: 3, 3: 4}[d]
    printed = c * a * b * p / r ** (d + 1) - b * n / r**d + a * m / r**d
    return products(d) + rest(by_x(term(d), d), printed)


def hessian(d):
    """(49) and (66) from the definition, differentiated twice."""
    p, n, m = VECTORS[d]
    c, both = {2: (3, 15), 3: (4, 24)}[d]
    H = both * a * b * p * p.T / r ** (d + 3) - c * a * b * sp.eye(d) / r ** (d + 1)
    H = H - (n * m.T + m * n.T) / r ** (d + 1)
    H = H - c * b * (n * p.T + p * n.T) / r ** (d + 2) + c * a * (m * p.T + p * m.T) / r ** (d + 2)
    return products(d) + rest(jacobian(by_x(term(d), d), d), H)


# --- numbers ------------------------------------------------------------------------------------


def up(angle):
    """A normal of flatland (conventions: Flatland)."""
    return np.array([-np.sin(angle), np.cos(angle)])


@functools.cache
def pairs(d):
    """Points with unit normals that see each other, in no special position: x, n, y, m."""
    if d == 2:
        angles = (
            ((0.3, -0.2), 0.4, (-0.5, 1.1), 3.3),
            ((0.0, 0.0), 0.0, (0.9, 0.7), 2.2),
            ((-1.2, 0.4), -1.0, (0.6, 1.5), 2.0),
        )
        return tuple((np.array(x), up(i), np.array(y), up(j)) for x, i, y, j in angles)
    rng = np.random.default_rng(8)
    x, y = rng.normal(size=3), rng.normal(size=3)
    way = (y - x) / np.linalg.norm(y - x)
    tilts = rng.normal(size=(2, 3)) * 0.5
    n, m = way + tilts[0], -way + tilts[1]
    return ((x, n / np.linalg.norm(n), y, m / np.linalg.norm(m)),)


def length(p):
    """The distance, of numbers of any package."""
    return (p @ p) ** 0.5


def definition(p, n, m):
    """G as cosines over a power of the distance, of numbers of any package."""
    return -(n @ p) * (m @ p) / length(p) ** (len(p) + 1)


def subtended_numerically(p, n, m):
    """G of flatland as a difference quotient of polar angles: only `atan2` and dot products."""
    along = (m[1], -m[0])  # the tangent whose left is the normal

    def polar(step):
        return mp.atan2(p[1] + step * along[1], p[0] + step * along[0])

    h = mp.mpf(10) ** -14
    return n @ p / length(p) * (polar(h) - polar(-h)) / (2 * h)


def differences(f, pair, order):
    """f(p, n, m) or its derivatives by x: central differences with 60 digits."""
    with mp.workdps(60):
        x, n, y, m = (np.array([mp.mpf(float(c)) for c in v], object) for v in pair)
        h = np.eye(len(x), dtype=object) * mp.mpf(10) ** -9

        def by_step(g, e):
            return lambda x: (g(x + e) - g(x - e)) / (2 * np.sum(e))

        at = [lambda x: np.asarray(f(y - x, n, m))]
        for _ in range(order):
            at = [by_step(g, e) for g in at for e in h]
        found = np.array([g(x) for g in at]).astype(float)
    steps = found.reshape((len(x),) * order + found.shape[1:])
    return np.moveaxis(steps, range(order), range(-order, 0))


def library(order):
    """The library's value, gradient or Hessian."""
    from firstorder.scene import _geometry_term as ours

    return (ours.geometry_term, ours.geometry_gradient, ours.geometry_hessian)[order]


def brute_force(order, d) -> float:
    """The library against differences of the definition, all pairs."""
    from firstorder.checks.tolerance import normwise

    f = subtended_numerically if d == 2 else definition
    return max(
        normwise(np.asarray(library(order)(*pair)), differences(f, pair, order))
        for pair in pairs(d)
    )


def autodiff(order, d) -> float:
    """The library's closed forms against derivatives of its value."""
    import jax

    from firstorder.checks.tolerance import normwise
    from firstorder.scene._geometry_term import geometry_term

    args = tuple(np.array(c) for c in zip(*pairs(d), strict=True))
    derivative = jax.grad(geometry_term) if order == 1 else jax.hessian(geometry_term)
    return normwise(library(order)(*args), jax.jit(jax.vmap(derivative))(*args))


def angle_by_length() -> float:
    """(26) by autodiff: `dtheta/dl` as the derivative of the polar angle."""
    import jax
    import jax.numpy as jnp

    from firstorder.scene._geometry_term import geometry_term

    worst = 0.0
    for x, n, y, m in pairs(2):
        p, along = y - x, np.array([m[1], -m[0]])
        rate = jax.grad(
            lambda s, p=p, along=along: jnp.arctan2(p[1] + s * along[1], p[0] + s * along[0])
        )(0.0)
        truth = n @ p / np.hypot(*p) * rate
        worst = max(worst, float(abs(geometry_term(x, n, y, m) - truth) / truth))
    return worst


GRADIENT = {"implements": "firstorder.scene._geometry_term.geometry_gradient"}
HESSIAN = {"implements": "firstorder.scene._geometry_term.geometry_hessian"}


def _row(number, order, d, note=""):
    return Row(
        f"J12.{number}",
        "identity",
        **(GRADIENT, HESSIAN)[order - 1],
        symbolic=lambda: (gradient, hessian)[order - 1](d),
        autodiff=Check(lambda: autodiff(order, d), 1e-12),
        fourier=na("no spectrum"),
        brute_force=Check(lambda: brute_force(order, d), 1e-12),
        note=note,
    )


ROWS = [
    Row(
        "J12.26",
        "identity",
        implements="firstorder.scene._geometry_term.geometry_term",
        symbolic=lambda: [*symmetric(), curved_neighbours()],
        autodiff=Check(angle_by_length, 1e-13),
        fourier=na("no spectrum"),
        brute_force=Check(lambda: brute_force(0, 2), 1e-13),
        note="The two cosines are of one sign only between facing sides; zero otherwise, and at 0.",
    ),
    _row(38, 1, 2, "A translation: both normals are held fixed."),
    _row(49, 2, 2),
    _row(58, 1, 3, "Right as printed, with y measured from x."),
    _row(66, 2, 3, "Right as printed; symmetric."),
]
