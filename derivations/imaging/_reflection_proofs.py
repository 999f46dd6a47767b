"""Proofs for reflection in space, from the geometry.

The frame at x + alpha t is the frame at x turned by the smallest rotation that carries n(x) to
n(x + alpha t); the normal is that of the surface z = (x, y) S (x, y) / 2 in its own tangent plane.
"""

from __future__ import annotations

import functools

import sympy as sp

alpha, k1, k2, s11, s12, s22 = sp.symbols("alpha kappa_1 kappa_2 S_11 S_12 S_22", real=True)
W = sp.Matrix(sp.symbols("w_1:4", real=True))  # a direction in the local frame
E1, E2, E3 = (sp.Matrix(c) for c in ((1, 0, 0), (0, 1, 0), (0, 0, 1)))


def carried_frame(S, axis):
    """R(alpha) along one axis of the tangent plane: Rodrigues' rotation to the graph's normal."""
    x, y = sp.symbols("x y", real=True)
    z = (sp.Matrix([[x, y]]) * S * sp.Matrix([x, y]))[0] / 2
    n = sp.Matrix([-sp.diff(z, x), -sp.diff(z, y), 1]).subs(
        {x: alpha * axis[0], y: alpha * axis[1]}
    )
    n = n / sp.sqrt(n.dot(n))
    v = E3.cross(n)
    K = sp.Matrix([[0, -v[2], v[1]], [v[2], 0, -v[0]], [-v[1], v[0], 0]])
    return sp.eye(3) + K + K * K / (1 + n[2])


def turn(S, axis):
    """dR/d alpha at 0."""
    return carried_frame(S, axis).diff(alpha).subs(alpha, 0)


PRINCIPAL = sp.diag(k1, k2)
GENERAL = sp.Matrix([[s11, s12], [s12, s22]])
P1 = sp.Matrix.hstack(E3, sp.zeros(3, 1), -E1)  # columns n, 0, -t
P2 = sp.Matrix.hstack(sp.zeros(3, 1), E3, -E2)


def rotation_rate():
    """(60): in principal directions dR = kappa P with *columns* n, 0, -t; R w, P w orthogonal."""
    first, second = turn(PRINCIPAL, (1, 0)), turn(PRINCIPAL, (0, 1))
    rows = sp.Matrix.vstack(E3.T, sp.zeros(1, 3), -E1.T)
    orthogonal = [W.dot(P * W) for P in (P1, P2, rows)]
    return [first - k1 * P1, second - k2 * P2, *orthogonal]


def general_rate():
    """In any tangents dR w = (n x dn) x w, dn = -S tau."""
    found = []
    for tau in ((1, 0), (0, 1)):
        dn = sp.Matrix([*(-GENERAL * sp.Matrix(tau)), 0])
        found.append(turn(GENERAL, tau) * W - E3.cross(dn).cross(W))
    return [f.applyfunc(sp.simplify) for f in found]


def rotated_tangents():
    """(57): d/da F(R (w + a u)) = grad F . R u, any matrix R and any quadratic F."""
    R = sp.Matrix(3, 3, sp.symbols("r_1:10"))
    u, z = sp.Matrix(sp.symbols("u_1:4")), sp.symbols("z_1:4")
    L = quadratic(z)
    turned = L.subs(dict(zip(z, R * (W + alpha * u), strict=True)), simultaneous=True)
    here = dict(zip(z, R * W, strict=True))
    slopes = [sp.diff(L, c).subs(here, simultaneous=True) for c in z]
    return sp.expand(
        sp.diff(turned, alpha).subs(alpha, 0)
        - sum(d * c for d, c in zip(slopes, R * u, strict=True))
    )


def quadratic(arguments):
    """A light field as general as a first derivative can notice, and one order more."""
    q = list(arguments)
    terms = [1, *q, *(a * b for i, a in enumerate(q) for b in q[i:])]
    return sum(c * t for c, t in zip(sp.symbols(f"c_0:{len(terms)}"), terms, strict=True))


def _along(with_place: bool):
    """Light in the carried frame along t as a function of alpha, to differentiate as it stands."""
    q = sp.symbols("x w_x w_y w_z")
    L = quadratic(q)
    Rw = carried_frame(PRINCIPAL, (1, 0)) * W
    place = alpha if with_place else 0
    return L, q, L.subs(dict(zip(q, (place, *Rw), strict=True)), simultaneous=True)


def splitting():
    """(59), (63): the light's own variation plus the rotation's, mu kappa L_l."""
    L, q, along = _along(with_place=True)
    here = dict(zip(q, (0, *W), strict=True))
    own = sp.diff(L, q[0]).subs(here)
    _, _, turned = _along(with_place=False)
    left = sp.diff(along, alpha).subs(alpha, 0)
    mu_l = P1 * W  # mu l
    curved = k1 * sum(sp.diff(L, c).subs(here) * m for c, m in zip(q[1:], mu_l, strict=True))
    return [
        sp.expand(left - own - sp.diff(turned, alpha).subs(alpha, 0)),
        sp.expand(left - own - curved),
    ]


def tangents_are_not_orthogonal():
    """The product l . m is w_1 w_2 / (mu_1 mu_2); mu_i is w's distance from the other tangent."""
    mu_l, mu_m = P1 * W, P2 * W
    one = W.dot(W) - 1
    return [
        sp.expand(mu_l.dot(mu_m) - W[0] * W[1]),
        sp.expand(mu_l.dot(mu_l) - (1 - W[1] ** 2) - one),
        sp.expand(mu_m.dot(mu_m) - (1 - W[0] ** 2) - one),
    ]


def half_turn_of_tangents():
    """M = 2 n n^T - I is a proper rotation, M u = -u + 2 (n.u) n, and u is not tangent at M w."""
    u = sp.Matrix(sp.symbols("u_1:4", real=True))
    M = 2 * E3 * E3.T - sp.eye(3)
    return [
        M * M.T - sp.eye(3),
        M.det() - 1,
        M * u + u - 2 * u[2] * E3,
        sp.expand(u.dot(M * W) - 2 * u[2] * W[2] + u.dot(W)),
    ]


def _moment(a, b, c):
    """The integral of x^a y^b z^c over the sphere: zero if a power is odd, else a Beta function."""
    if a % 2 or b % 2 or c % 2:
        return 0
    over = sp.gamma(sp.Rational(a + b + c + 3, 2))
    parts = [sp.gamma(sp.Rational(k + 1, 2)) for k in (a, b, c)]
    return 2 * parts[0] * parts[1] * parts[2] / over


def _sum_over_the_sphere(f, w):
    """The integral of a polynomial in w over the sphere of directions."""
    return sum(k * _moment(*powers) for powers, k in sp.Poly(sp.expand(f), *w).terms())


@functools.cache
def convolution_by_hand():
    """(65), (67) and the route through the light, integrated exactly.

    Light and lobe are quadratic polynomials with free coefficients; theta is on a great circle.
    """
    w, x, s, t = sp.symbols("w_x w_y w_z"), *sp.symbols("x s t", real=True)
    a = sp.symbols("a_0:5")
    b = sp.symbols("b_0:3")
    L = a[0] + a[1] * w[0] * (1 + x) + a[2] * w[1] + a[3] * w[0] * w[2] + a[4] * x * w[2] ** 2
    rho = b[0] + b[1] * t + b[2] * t**2
    centre, u = sp.Matrix([sp.sin(s), 0, sp.cos(s)]), sp.Matrix([sp.cos(s), 0, -sp.sin(s)])
    vector = sp.Matrix(w)
    kernel, slope = (f.subs(t, centre.dot(vector)) for f in (rho, sp.diff(rho, t)))
    B = _sum_over_the_sphere(L * kernel, w)
    spatial = sp.diff(B, x) - _sum_over_the_sphere(sp.diff(L, x) * kernel, w)
    angular = sp.diff(B, s) - _sum_over_the_sphere(L * slope * u.dot(vector), w)
    gradient = sp.Matrix([sp.diff(L, c) for c in w])
    # u . grad B = (centre x u) . int (w x grad L) rho
    turned = centre.cross(u).dot(vector.cross(gradient)) * kernel
    rotated = sp.diff(B, s) - _sum_over_the_sphere(turned, w)
    return tuple(sp.simplify(sp.expand(e)) for e in (spatial, angular, rotated))


def mirrored_direction_turns_twice():
    """d(2 n (n.v) - v) = 2 (n x dn) x r for dn orthogonal to n, and its derivative in v."""
    v, d = sp.Matrix(sp.symbols("v_1:4")), sp.Matrix([*sp.symbols("d_1:3"), 0])
    n = E3 + alpha * d
    r = 2 * n * n.dot(v) - v
    turned = r.diff(alpha).subs(alpha, 0) - 2 * E3.cross(d).cross(r.subs(alpha, 0))
    in_v = r.subs(alpha, 0).jacobian(v) - (2 * E3 * E3.T - sp.eye(3))
    return [turned.applyfunc(sp.expand), in_v]
