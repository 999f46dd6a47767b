"""Bump and normal maps in space: R07 §4.2, Blinn's normal, from a chart with free coefficients."""

from __future__ import annotations

import functools

import numpy as np
import sympy as sp

from derivations.imaging import _bumpy as bumpy
from derivations.imaging import _surfaces as our
from firstorder.checks.tolerance import normwise
from firstorder.ledger import Check, Row, na

MODULE = "firstorder.imaging._bumps"
u, v = sp.symbols("u v", real=True)
ORIGIN = {u: 0, v: 0}


@functools.cache
def surface():
    """A chart through the origin: oblique there, with every second derivative free."""
    a, b, c = sp.symbols("a b c", positive=True)
    second = sp.symbols("q_0:9", real=True)
    quadratic = sp.Matrix(3, 3, second) * sp.Matrix([u**2 / 2, u * v, v**2 / 2])
    return sp.Matrix([a * u + b * v, c * v, 0]) + quadratic, (a, b, c), second


@functools.cache
def frame_and_rate(k):
    """Columns t, b, n at the origin and their derivatives in u or v.

    From the definition t = X_u / |X_u|, n ~ X_u x X_v, b = n x t; the derivative of a unit vector
    is that of `unit_length`, and lengths at the origin are free of roots.
    """
    X, (a, _, c), _ = surface()
    X_u, X_v = X.diff(u), X.diff(v)
    N = X_u.cross(X_v)

    def unit(V, length):
        here, slope = V.subs(ORIGIN) / length, V.diff(k).subs(ORIGIN)
        return here, (slope - here * here.dot(slope)) / length

    (t, dt), (n, dn) = unit(X_u, a), unit(N, a * c)
    b, db = n.cross(t), dn.cross(t) + n.cross(dt)
    return sp.Matrix.hstack(t, b, n), sp.Matrix.hstack(dt, db, dn)


@functools.cache
def rates():
    """S, twist and d(arc)/d(u, v) by the rules that the library uses, at the origin."""
    X, (a, b, c), _ = surface()
    A = sp.Matrix([[a, b], [0, c]])
    inverse = A.inv()
    second = [[X.diff(i).diff(j) for j in (u, v)] for i in (u, v)]
    form = sp.Matrix(2, 2, lambda i, j: second[i][j][2])
    twist = (sp.Matrix([[second[0][j][1] / a for j in (0, 1)]]) * inverse).applyfunc(sp.simplify)
    return inverse, inverse.T * form * inverse, twist, second


def normal_map_turns():
    """The derivative of m_1 t + m_2 b + m_3 n, against slope, curvature and twist."""
    inverse, S, twist, _ = rates()
    m0, m1 = sp.Matrix(sp.symbols("m_1:4")), sp.Matrix(3, 2, sp.symbols("s_0:6"))
    m = m0 + m1 * sp.Matrix([u, v])
    columns = []
    for k in (u, v):
        axes, slope = frame_and_rate(k)
        columns.append(slope * m0 + axes * m.diff(k))
    true = sp.Matrix.hstack(*columns) * inverse
    flat = sp.Matrix.vstack(-m0[1] * twist, m0[0] * twist) - m0[2] * S
    rule = m1 * inverse + sp.Matrix.vstack(flat, sp.Matrix([[m0[0], m0[1]]]) * S)
    return (true - rule).applyfunc(sp.cancel)


def bump_turns():
    """The derivative of n - grad h, the surface gradient from its definition at every (u, v).

    grad h = (X_u, X_v) G^-1 (h_u, h_v), G the metric. The height has free derivatives.
    """
    X, _, _ = surface()
    inverse, S, _, second = rates()
    h = sp.symbols("h_0:5", real=True)
    height = h[0] * u + h[1] * v + h[2] * u**2 / 2 + h[3] * u * v + h[4] * v**2 / 2
    J = sp.Matrix.hstack(X.diff(u), X.diff(v))
    G = J.T * J
    slope = sp.Matrix([height.diff(u), height.diff(v)])
    # G^-1 to first order about the origin is all that one derivative needs.
    G_0 = G.subs(ORIGIN).inv()
    columns = []
    for k in (u, v):
        G_k = -G_0 * G.diff(k).subs(ORIGIN) * G_0
        J_0, s_0 = J.subs(ORIGIN), slope.subs(ORIGIN)
        gradient = J.diff(k).subs(ORIGIN) * G_0 * s_0 + J_0 * G_k * s_0
        gradient += J_0 * G_0 * slope.diff(k).subs(ORIGIN)
        columns.append(frame_and_rate(k)[1][:, 2] - gradient)
    true = sp.Matrix.hstack(*columns) * inverse
    g = inverse.T * slope.subs(ORIGIN)
    plain = sp.Matrix(2, 2, lambda i, j: height.diff((u, v)[i]).diff((u, v)[j]))
    bent = sp.Matrix(2, 2, lambda i, j: second[i][j][0] * g[0] + second[i][j][1] * g[1])
    hessian = inverse.T * (plain - bent) * inverse
    rule = sp.Matrix.vstack(-(S + hessian), -(S * g).T)
    return (true - rule).applyfunc(sp.cancel)


def unit_length():
    """d(N / |N|) = (I - n n^T) dN / |N|."""
    k = sp.symbols("k")
    N, dN = sp.Matrix(sp.symbols("N_1:4")), sp.Matrix(sp.symbols("d_1:4"))
    moved = N + k * dN
    size = sp.sqrt(N.dot(N))
    left = (moved / sp.sqrt(moved.dot(moved))).diff(k).subs(k, 0)
    return (left - (dN - N * N.dot(dN) / size**2) / size).applyfunc(sp.simplify)


# --- numeric: the tilted normal along curves on an ellipsoid --------------------------------------

PLACE = np.array([0.7, 0.4])


def _chart(uv):
    from firstorder.imaging._bumps import chart

    return chart(bumpy.ellipsoid, uv)


def _height(uv):
    import jax.numpy as jnp

    return bumpy.height(bumpy.ellipsoid(uv), jnp)


def map_of(uv):
    """A normal map with slopes of its own."""
    import jax.numpy as jnp

    return jnp.stack([0.2 * jnp.sin(3 * uv[0]), 0.3 * jnp.cos(2 * uv[1] + uv[0]), jnp.ones(())])


@functools.cache
def points():
    """The library's two shading points, and autodiff of their normals, per arc length."""
    import jax
    import jax.numpy as jnp

    from firstorder.imaging._bumps import bumped, normal_mapped

    def bump(uv):
        return bumped(_chart(uv), _height, uv)

    def mapped(uv):
        return normal_mapped(_chart(uv), map_of, uv)

    def both(uv):
        inverse = _chart(uv).uv_D_arc
        slopes = [jax.jacfwd(lambda q, f=f: f(q).normal)(uv) @ inverse for f in (bump, mapped)]
        return bump(uv), mapped(uv), *slopes

    return jax.jit(both)(jnp.asarray(PLACE))


def autodiff_error(which: int) -> float:
    """How the normal turns against autodiff of the normal along the chart."""
    found = points()
    return normwise(found[which].turning, found[2 + which])


def bump_differences() -> float:
    """The bump's normal against the implicit surface's, by differences along tangents."""
    point = points()[0]
    x, T = np.asarray(point.position), np.asarray(point.tangents)

    def tilted(s, tau):
        y = our.on_ellipsoid(x + s * tau)
        n, slope = our.normal_at(y), bumpy.height_slope(y)
        return our.unit(n - (slope - n * (n @ slope)))

    columns = [our.slope(lambda s, c=c: tilted(s, T[:, c])) for c in (0, 1)]
    turning = normwise(point.turning, np.stack(columns, 1))
    return max(turning, normwise(point.normal, tilted(0.0, T[:, 0])))


def map_differences() -> float:
    """The mapped normal against a frame from the implicit surface, t along its parallels."""
    point = points()[1]
    x, T = np.asarray(point.position), np.asarray(point.tangents)

    def mapped(s, tau):
        y = our.on_ellipsoid(x + s * tau)
        n, (a, b, c) = our.normal_at(y), our.RADII
        t = our.unit([-a * y[1] / b, b * y[0] / a, 0.0])
        q = np.array([np.arctan2(y[1] / b, y[0] / a), np.arcsin(y[2] / c)])
        m = [0.2 * np.sin(3 * q[0]), 0.3 * np.cos(2 * q[1] + q[0]), 1.0]
        return our.unit(np.stack([t, np.cross(n, t), n], 1) @ m)

    columns = [our.slope(lambda s, c=c: mapped(s, T[:, c])) for c in (0, 1)]
    return normwise(point.turning, np.stack(columns, 1))


ROWS = [
    Row(
        "C.space.bump",
        "identity",
        implements=f"{MODULE}.bumped",
        symbolic=lambda: [bump_turns(), unit_length()],
        autodiff=Check(lambda: autodiff_error(0), 1e-12),
        fourier=na("no spectrum"),
        brute_force=Check(bump_differences, 1e-9),
        note="Blinn's normal: against the displaced surface wrong by h S grad h (tests).",
    ),
    Row(
        "C.space.normalmap",
        "identity",
        implements=f"{MODULE}.normal_mapped",
        symbolic=lambda: [normal_map_turns(), unit_length()],
        autodiff=Check(lambda: autodiff_error(1), 1e-12),
        fourier=na("no spectrum"),
        brute_force=Check(map_differences, 1e-9),
        note="Without the frame's twist it is wrong wherever coordinate lines bend.",
    ),
]
