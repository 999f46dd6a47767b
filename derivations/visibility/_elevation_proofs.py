"""Proofs for edge angles in vertical slices, from the geometry.

A smooth blocker is the set F <= 0 of any function F: the edge is where the least F along the ray is
zero. An edge in space is a curve: the edge angle is that of the point where it meets the slice.
"""

from __future__ import annotations

import functools

import sympy as sp

a, phi, D, r = sp.symbols("alpha phi D r", real=True)
x, y, theta = sp.symbols("x y theta", real=True)

# Components along c, v, w, in which everything below is rational; u = cos(alpha) c + sin(alpha) w.
C, V, W = (sp.Matrix([int(i == j) for j in range(3)]) for i in range(3))
U = sp.cos(a) * C + sp.sin(a) * W
M = sp.Matrix(sp.symbols("m1:4", real=True))  # a step of the receiver, in any direction
K = sp.Matrix(sp.symbols("k1:4", real=True))  # tangent of an edge in space
n1, n2 = sp.symbols("n1 n2", real=True)
N = n1 * C + n2 * V  # all normals of rays that touch
H = sp.Matrix(3, 3, lambda i, j: sp.Symbol(f"h{min(i, j)}{max(i, j)}", real=True))


# --- the slice and the distribution --------------------------------------------------------------


def step_derivative():
    """(39) against any test function: d/dx int_0^alpha f dtheta = f(alpha) alpha_x."""
    f, edge = sp.Function("f"), sp.Function("alpha")(x)
    weighed = sp.Integral(f(theta), (theta, 0, edge)).diff(x)
    return sp.simplify(weighed - f(edge) * edge.diff(x))


def chain():
    """(40) and (41): any alpha of u = x cos + y sin and v = -x sin + y cos, by x and by y."""
    g = sp.Function("g")
    u, v = sp.symbols("u v", real=True)
    place = {u: x * sp.cos(phi) + y * sp.sin(phi), v: -x * sp.sin(phi) + y * sp.cos(phi)}
    alpha = g(u, v).subs(place)
    along, across = (g(u, v).diff(c).subs(place) for c in (u, v))
    wanted = {
        x: along * sp.cos(phi) - across * sp.sin(phi),
        y: along * sp.sin(phi) + across * sp.cos(phi),
    }
    return [sp.simplify((alpha.diff(c) - w).doit()) for c, w in wanted.items()]


def motion():
    """(42): p = q + D w(alpha) differentiated along any path of the receiver in its plane."""
    alpha, dist = sp.Function("alpha")(r), sp.Function("D")(r)
    w = sp.Matrix([sp.sin(alpha), 0, sp.cos(alpha)])  # in u, v, z
    c = sp.Matrix([sp.cos(alpha), 0, -sp.sin(alpha)])
    m = sp.Matrix([*sp.symbols("m1:3", real=True), 0])
    p = r * m + dist * w
    return [sp.simplify(e) for e in p.diff(r) - (dist * alpha.diff(r) * c + dist.diff(r) * w + m)]


@functools.cache
def least():
    """Both derivatives of alpha from "the least F along the ray is zero", F up to second order.

    Without the tangent plane of (43): F near p is n . d + d . H d / 2, any n with w . n = 0 and
    any symmetric H; the least value is found, and the angle solved from it, by series.
    """
    e, da1, da2, s1 = sp.symbols("e da1 da2 s1", real=True)
    turn = e * da1 + e**2 * da2 / 2
    # The least value lies at s = e s1 + O(e^2) beyond D; an error of s counts in e^4 alone.
    d = e * M + (D + e * s1) * (W * (1 - turn**2 / 2) + C * turn) - D * W
    F = sp.expand(N.dot(d) + (d.T * H * d)[0] / 2)
    one, two = F.coeff(e, 1), F.coeff(e, 2)
    first = sp.solve(one, da1)[0]
    s1_least = sp.solve(two.diff(s1), s1)[0]
    second = sp.solve(two.subs(s1, s1_least), da2)[0].subs(da1, first)
    return first, second


def tangent_plane():
    """(44), the rate in every direction, and (45), (46) for m = u and v."""
    first, _ = least()
    steep = N.dot(C)
    general = first + M.dot(N) / (D * steep)
    along, across = (first.subs(dict(zip(M, m, strict=True))) for m in (U, V))
    return [
        sp.cancel(sp.expand(e))
        for e in (general, along + sp.cos(a) / D, across + V.dot(N) / (D * steep))
    ]


def stays_in_the_plane():
    """(43): for a point p(r) on any surface F = 0, and any path, grad F . p' = 0.

    With (42) and w . n = 0 the motion along the ray drops out.
    """
    X = sp.symbols("X1:4", real=True)
    p = [sp.Function(f"p{i}")(r) for i in range(3)]
    F = sp.Function("F")
    total = F(*p).diff(r)
    grad = [F(*X).diff(c).subs(dict(zip(X, p, strict=True))) for c in X]
    both = total - sum(g * q.diff(r) for g, q in zip(grad, p, strict=True))
    da, dD = sp.symbols("da dD")
    left = N.dot(D * da * C + dD * W + M) - (D * da * C.dot(N) + M.dot(N))
    return sp.simplify(both.doit()), sp.simplify(left)


def second_of_a_limb():
    """`limb_bend`: the second derivative in every direction."""
    first, second = least()
    q = M + D * first * C
    s = (W.T * H * q)[0] + N.dot(C) * first
    ours = -((q.T * H * q)[0] - s**2 / (W.T * H * W)[0]) / (D * N.dot(C))
    return sp.cancel(second - ours)


def crossing(order: int):
    """A derivative of the angle at which a curve p + k t + K t^2 / 2 meets the slice."""
    e, t1, t2 = sp.symbols("e t1 t2", real=True)
    bent = sp.Matrix(sp.symbols("K1:4", real=True))
    t = e * t1 + e**2 * t2 / 2
    point = D * W + K * t + bent * t**2 / 2 - e * M
    cut = sp.expand(V.dot(point))
    t1s = sp.solve(cut.coeff(e, 1), t1)[0]
    t2s = sp.solve(cut.coeff(e, 2).subs(t1, t1s), t2)[0]
    point = point.subs(t2, t2s).subs(t1, t1s)
    part = sp.atan(C.dot(point) / W.dot(point))  # the angle of `point` from w
    return part.diff(e, order).subs(e, 0), bent


def straight_edge():
    """(72) and alpha_u: the angle of the point where a line meets the slice."""
    first = crossing(1)[0].subs({f"K{i}": 0 for i in (1, 2, 3)})
    along, across = (first.subs(dict(zip(M, m, strict=True))) for m in (U, V))
    return [sp.simplify(e) for e in (along + sp.cos(a) / D, across - K.dot(C) / (D * K.dot(V)))]


def reduces():
    """Proof that k . c = -n . v and k . v = n . c for n = k x w, whatever k: (72) is then (46)."""
    n = K.cross(W)
    return sp.simplify(K.dot(C) + n.dot(V)), sp.simplify(K.dot(V) - n.dot(C))


def second_of_a_rim():
    """`rim_bend` in every direction."""
    found, bent = crossing(2)
    t = V.dot(M) / K.dot(V)
    way = K * t - M
    ours = C.dot(bent - K * V.dot(bent) / K.dot(V)) * t**2 / D
    ours -= 2 * W.dot(way) * C.dot(way) / D**2
    return sp.cancel(found - ours)


def grazing():
    """Footnote 4: where a slice only grazes a ball, alpha_v goes as (phi0 - phi)^(-1/2).

    A ball of half-angle b at polar angle g has its edges at theta0 +- asin(sqrt(h)), with
    `h = 1 - cos(b)^2 / (1 - sin(g)^2 S^2)`, S the sine of the azimuth from its middle, and theta0
    smooth. h has a simple zero where the slice grazes, and edge' sqrt(h) goes to h' / 2 there: not
    zero. (alpha_phi is alpha_v times the way per turn, which is smooth.)
    """
    g, b, S = sp.symbols("g b S", positive=True)
    h = 1 - sp.cos(b) ** 2 / (1 - sp.sin(g) ** 2 * S**2)
    end = sp.sin(b) / sp.sin(g)
    rate = sp.asin(sp.sqrt(h)).diff(S)
    slope = -2 * sp.sin(g) * sp.sin(b) / sp.cos(b) ** 2
    return [
        sp.simplify(h.subs(S, end)),
        sp.simplify(h.diff(S).subs(S, end) - slope),
        sp.simplify(rate**2 * h * (1 - h) - (h.diff(S) / 2) ** 2),
    ]
