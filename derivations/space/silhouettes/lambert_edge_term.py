"""Lambert's term of an edge that stays in space, differentiated twice as the receiver moves.

From the definition: the ends of the edge, seen from x + d, are `w / s - d` and `v / r - d`; the
term depends on their directions alone, so that `w - s d` and `v - r d` do, also at s = 0.
"""

from __future__ import annotations

import mpmath as mp
import numpy as np
import sympy as sp

from firstorder.ledger import Check, Row, na

d = sp.symbols("d_x d_y", real=True)
wx, wy, vx, vy, wz, vz = sp.symbols("w_x w_y v_x v_y w_z v_z", real=True)
s, r, k0 = sp.symbols("s r k", real=True)
SLOPES = (0, 1)


def _at_rest(expression):
    return sp.expand(expression.subs(dict.fromkeys(d, 0)))


def _both():
    """Cosine and cross product of the moved ends, with |w| = |v| = 1 in the squared lengths."""
    P = 1 - 2 * s * (wx * d[0] + wy * d[1]) + s**2 * (d[0] ** 2 + d[1] ** 2)
    Q = 1 - 2 * r * (vx * d[0] + vy * d[1]) + r**2 * (d[0] ** 2 + d[1] ** 2)
    p, q = (wx - s * d[0], wy - s * d[1]), (vx - r * d[0], vy - r * d[1])
    dot = p[0] * q[0] + p[1] * q[1] + (k0 - wx * vx - wy * vy)
    return [f / sp.sqrt(P * Q) for f in (dot, p[0] * q[1] - p[1] * q[0])]


def moved_edge():
    """The derivatives of the cosine and of Z that `lambert_edge` uses, and A's equation."""
    w, v = (wx, wy), (vx, vy)
    Z = wx * vy - wy * vx
    dot = [-s * v[i] - r * w[i] for i in SLOPES]
    cross = [r * wy - s * vy, s * vx - r * wx]
    scale = [s * w[i] + r * v[i] for i in SLOPES]
    left = []
    for f, value, first, second in zip(_both(), (k0, Z), (dot, cross), (2 * s * r, 0), strict=True):
        left += [
            sp.expand(_at_rest(sp.diff(f, d[i])) - first[i] - value * scale[i]) for i in SLOPES
        ]
        for i, j in ((0, 0), (0, 1), (1, 1)):
            same = 1 if i == j else 0
            bend = s**2 * (2 * w[i] * w[j] - same) + r**2 * (2 * v[i] * v[j] - same)
            bend += scale[i] * scale[j]
            ours = second * same + first[i] * scale[j] + scale[i] * first[j] + value * bend
            left.append(sp.expand(_at_rest(sp.diff(f, d[i], d[j])) - sp.expand(ours)))
    t = sp.Symbol("t", positive=True)
    A = sp.acos(t) / sp.sqrt(1 - t**2)
    once = (1 - t**2) * sp.diff(A, t) - t * A + 1
    twice = (1 - t**2) * sp.diff(A, t, 2) - 3 * t * sp.diff(A, t) - A
    return [*left, once, twice]


# Long and short, near and far, one end at infinity, both, and one with no length.
EDGES = (
    ((0.3, -0.2, 0.9), (-0.4, 0.5, 0.3)),
    ((1.0, 0.2, 0.1), (-0.8, 0.3, 0.2)),
    ((0.3, -0.2, 0.9), (0.3001, -0.2002, 0.9)),
    ((0.1, 0.1, 5.0), (0.6, -0.3, 1.0)),
)


def _four(point):
    length = np.linalg.norm(point)
    return np.array([*(np.asarray(point) / length), 1.0 / length])


def by_autodiff() -> float:
    """Closed form against autodiff of the definition, on edges that are long enough for it."""
    import jax
    import jax.numpy as jnp

    from firstorder.space.silhouettes._lambert_edge_term import lambert_edge

    def term(x, p, q):
        a, b = p - jnp.append(x, 0.0), q - jnp.append(x, 0.0)
        c = jnp.cross(a, b)
        size = jnp.sqrt(jnp.sum(c**2))
        return 0.5 * jnp.arctan2(size, jnp.sum(a * b)) * c[2] / size

    jet = jax.jit(lambda p, q: [f(jnp.zeros(2), p, q) for f in (jax.grad(term), jax.hessian(term))])
    worst = 0.0
    for p, q in (EDGES[0], EDGES[1], EDGES[3]):
        _, gx, gy, xx, xy, yy = np.asarray(lambert_edge(jnp.array(_four(p)), jnp.array(_four(q))))
        gradient, hessian = jet(jnp.array(p), jnp.array(q))
        ours = np.array([gx, gy, xx, xy, xy, yy])
        theirs = np.concatenate([gradient, np.ravel(hessian)])
        worst = max(worst, float(np.abs(ours - theirs).max() / np.abs(theirs).max()))
    return worst


def lambert_exact(p, q, x):
    """The definition in 40 digits."""
    a = [mp.mpf(c) - o for c, o in zip(p, (*x, 0), strict=True)]
    b = [mp.mpf(c) - o for c, o in zip(q, (*x, 0), strict=True)]
    c = [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
    size = mp.sqrt(sum(t * t for t in c))
    return mp.atan2(size, sum(i * j for i, j in zip(a, b, strict=True))) * c[2] / size / 2


def differences(f, x, h="1e-12") -> np.ndarray:
    """Value, gradient and Hessian (xx, xy, yy) of a function of two numbers, by differences."""
    with mp.workdps(50):
        h = mp.mpf(h)
        at = {(i, j): f((mp.mpf(x[0]) + i * h, mp.mpf(x[1]) + j * h))
              for i in (-1, 0, 1) for j in (-1, 0, 1)}  # fmt: skip
        gradient = [(at[1, 0] - at[-1, 0]) / (2 * h), (at[0, 1] - at[0, -1]) / (2 * h)]
        xx = (at[1, 0] - 2 * at[0, 0] + at[-1, 0]) / h**2
        yy = (at[0, 1] - 2 * at[0, 0] + at[0, -1]) / h**2
        xy = (at[1, 1] - at[1, -1] - at[-1, 1] + at[-1, -1]) / (4 * h**2)
        return np.array([float(v) for v in (at[0, 0], *gradient, xx, xy, yy)])


def by_differences() -> float:
    """Closed form against differences in 50 digits, short edges among them."""
    import jax.numpy as jnp

    from firstorder.space.silhouettes._lambert_edge_term import lambert_edge

    worst = 0.0
    for p, q in EDGES:
        ours = np.asarray(lambert_edge(jnp.array(_four(p)), jnp.array(_four(q))))
        truth = differences(lambda x, p=p, q=q: lambert_exact(p, q, x), (0.0, 0.0))
        worst = max(worst, float(np.abs(ours - truth).max() / np.abs(truth).max()))
    return worst


ROWS = [
    Row(
        "C.space.edge",
        "identity",
        "firstorder.space.silhouettes._lambert_edge_term.lambert_edge",
        symbolic=moved_edge,
        autodiff=Check(by_autodiff, 1e-12),
        fourier=na("no spectrum"),
        brute_force=Check(by_differences, 1e-11),
        note="Smooth for edges of no length, and for ends at infinity.",
    ),
]
