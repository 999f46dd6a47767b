"""What an edge sweeps as it moves, from the flux of p / |p|^3.

A patch p(s, r) that moves has the solid angle `int F . (p_s x p_r)`, F = p / |p|^3. F has no
divergence away from the eye, so the rate of the flux is a boundary term: `oint F . (dp x p')`, up
to the sense of the edge, whatever the patch does inside.
"""

from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np
import sympy as sp

from firstorder.checks.tolerance import normwise
from firstorder.ledger import Check, Row, na
from firstorder.space.silhouettes._edge_integrals import swept_rate


def boundary_term():
    """`d/dt [F . (p_s x p_r)] = d/ds [F . (p_t x p_r)] + d/dr [F . (p_s x p_t)]` if div F = 0.

    p is any map: here by its first and second derivatives at one point, as free symbols.
    """
    x = sp.symbols("x:3", real=True)
    X = sp.Matrix(x)
    F = X / sp.sqrt(X.dot(X)) ** 3
    divergence = sum(F[i].diff(x[i]) for i in range(3))
    gradient = sp.Matrix(3, 3, lambda i, j: sp.Symbol(f"F{i}{j}"))  # any field's, divergence below
    value = sp.Matrix(sp.symbols("F:3"))
    p = {a: sp.Matrix(sp.symbols(f"p{a}_:3")) for a in "srt"}
    q = {ab: sp.Matrix(sp.symbols(f"p{ab}_:3")) for ab in ("sr", "st", "rt")}

    def rate(along, first, second, d_first, d_second):
        """Derivative of F . (a x b) along one of the three parameters."""
        a, b = p[first], p[second]
        return (gradient * p[along]).dot(a.cross(b)) + value.dot(
            d_first.cross(b) + a.cross(d_second)
        )

    left = rate("t", "s", "r", q["st"], q["rt"])
    right = rate("s", "t", "r", q["st"], q["sr"]) + rate("r", "s", "t", q["sr"], q["rt"])
    # the identity for any F: left - right = div F times the volume of (p_t, p_s, p_r)
    volume = gradient.trace() * p["t"].dot(p["s"].cross(p["r"]))
    return [sp.simplify(divergence), sp.expand(left - right - volume)]


CORNERS = np.array([[0.6, -0.2, 1.1], [0.9, 0.7, 1.4], [-0.3, 0.5, 0.9]])
MOTION = np.array([[0.2, -0.1, 0.3], [-0.4, 0.2, 0.1], [0.1, 0.3, -0.2]])


def solid_angle(corners):
    """Of a triangle, by van Oosterom and Strackee."""
    a, b, c = corners
    xp = jnp if isinstance(corners, jax.Array) else np
    la, lb, lc = (xp.sqrt(xp.sum(e * e)) for e in (a, b, c))
    volume = xp.sum(a * xp.cross(b, c))
    rest = la * lb * lc + xp.sum(a * b) * lc + xp.sum(b * c) * la + xp.sum(c * a) * lb
    return 2.0 * xp.arctan2(volume, rest)


def _swept() -> float:
    """The one-form along all three sides, 24 nodes on each."""
    t, w = np.polynomial.legendre.leggauss(24)
    t, w, total = 0.5 * (t + 1.0)[:, None], 0.5 * w, 0.0
    for i in range(3):
        a, b, da, db = CORNERS[i], CORNERS[i - 2], MOTION[i], MOTION[i - 2]
        p, dp = a + t * (b - a), da + t * (db - da)
        along = np.broadcast_to(b - a, p.shape)
        rate = swept_rate(jnp.asarray(p), jnp.asarray(along), jnp.asarray(dp))
        total += float(np.sum(w * np.asarray(rate)))
    return total


def against_autodiff() -> float:
    """The sum of the sides against autodiff of the closed solid angle."""
    corners, motion = jnp.asarray(CORNERS), jnp.asarray(MOTION)
    rate = jax.jvp(solid_angle, (corners,), (motion,))[1]
    return normwise(_swept(), float(rate))


def against_differences() -> float:
    """And against differences of it, sign and all: the region to the left of the edge grows."""
    h = 1e-3
    steps = [solid_angle(CORNERS + k * h * MOTION) for k in (-2, -1, 1, 2)]
    rate = (steps[0] - 8.0 * steps[1] + 8.0 * steps[2] - steps[3]) / (12.0 * h)
    return abs(_swept() - float(rate))


ROWS = [
    Row(
        "C.space.swept",
        "identity",
        "firstorder.space.silhouettes._edge_integrals.swept_rate",
        boundary_term,
        autodiff=Check(against_autodiff, 1e-12),
        fourier=na("no spectrum"),
        brute_force=Check(against_differences, 1e-9),
        note="Exact for a sum over closed edges, at fixed parameters: where a piece is cut does "
        "not matter, for what it loses its neighbour wins. Not for one piece by itself.",
    ),
]
