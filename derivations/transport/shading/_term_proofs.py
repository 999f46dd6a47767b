"""Proofs about the terms of the gradient of reflected light: R07 §5.1-5.2, Figure 4."""

from __future__ import annotations

import sympy as sp

from derivations.transport.shading._shading import (
    a,
    b,
    derivatives,
    light,
    lt,
    ltt,
    lx,
    lxt,
    lxx,
    n1,
    n2,
    r0,
    turn,
)

DISTANT, FLAT = dict.fromkeys((lx, lxx, lxt), 0), dict.fromkeys((n1, n2), 0)


def diffuse_argument():
    """A diffuse lobe depends on `n - omega`: its derivatives have n_x once, and none in theta."""
    _, x, theta, xx, xt, tt = derivatives(light(a, turn) * r0)
    return (
        x - (lx + n1 * lt) * r0,
        theta,
        xx - (lxx + 2 * n1 * lxt + n1**2 * ltt + n2 * lt) * r0,
        xt,
        tt,
    )


def terms(of):
    """B_x, and SV, DV and CV by what they are called after, all at a fixed offset of the lobe.

    SV is what moving does at a fixed reflected direction `theta_r = 2 n - theta`, DV what turning
    that direction does in one place, CV the rate at which moving turns it. `of` says what is known
    of the light and the surface, and is put into the integrand before anything is differentiated.
    """
    integrand, turned = ((f * r0).subs(of) for f in (light(a, 2 * turn - b), light(a, b)))
    B_x, SV, DV = derivatives(integrand)[1], *derivatives(turned)[1:3]
    return B_x, SV, DV, (2 * turn).subs(of).diff(a).subs(a, 0)


def sum_of_terms():
    """§5.2: SV and CV DV are all that there is in B_x."""
    B_x, SV, DV, CV = terms({})
    return B_x - SV - CV * DV


def distant_light():
    """Figure 4: no SV, and all of B_x is CDV."""
    B_x, SV, DV, CV = terms(DISTANT)
    return SV, B_x - CV * DV


def flat_surface():
    """Figure 4: no CV and no CDV, and all of B_x is SV."""
    B_x, SV, DV, CV = terms(FLAT)
    return CV, CV * DV, B_x - SV


def flat_in_distant_light():
    """Figure 4: no SV, CV or CDV, and no B_x; DV stays."""
    B_x, SV, DV, CV = terms(DISTANT | FLAT)
    return SV, CV, CV * DV, B_x, DV - lt * r0


def rotated_axes():
    """§5.1: the size of (B_x, B_y) in turned axes."""
    Bx, By, t = sp.symbols("B_x B_y t", real=True)
    R = sp.Matrix([[sp.cos(t), sp.sin(t)], [-sp.sin(t), sp.cos(t)]])
    return sp.simplify((R * sp.Matrix([Bx, By])).norm() ** 2 - Bx**2 - By**2)


def turning_normal():
    """§5.1 in space: of the surface's bending, B knows `dn` along the step alone, and not `K`.

    A mirror of any shape matrix S about the origin, seen from a fixed direction v; the lobe adds up
    such mirrors. The light is known to first order: the slopes g over places and l over directions.
    On the cylinder K vanishes, and B changes across it by (25)'s `2 n_x` times the light's slope.
    """
    x, y, h = sp.symbols("x y h", real=True)
    along = sp.Matrix(sp.symbols("a_x a_y", real=True))
    S11, S12, S22 = sp.symbols("S_11 S_12 S_22", real=True)
    S, g, v = sp.Matrix([[S11, S12], [S12, S22]]), sp.symbols("g_x:z"), sp.symbols("v_x:z")
    g, v, slope = sp.Matrix(g), sp.Matrix(v), sp.Matrix(sp.symbols("l_x:z"))
    place = sp.Matrix([x, y])
    P = sp.Matrix([x, y, -(place.T * S * place)[0] / 2])
    N = P.diff(x).cross(P.diff(y))
    N = N / sp.sqrt(N.dot(N))
    here = {x: 0, y: 0}
    B = g.dot(P) + slope.dot(2 * N.dot(v) * N - v)
    B_a = B.subs({x: h * along[0], y: h * along[1]}).diff(h).subs(h, 0)
    up, dn = sp.Matrix([0, 0, 1]), sp.Matrix([*(S * along), 0])
    spatial = g.dot(sp.Matrix([*along, 0]))
    turned = B_a - spatial - 2 * slope.dot(dn.dot(v) * up + v[2] * dn)
    K = N.diff(x).cross(N.diff(y)).dot(N).subs(here)
    cylinder = {S12: 0, S22: 0, **dict(zip(along, (1, 0), strict=True))}
    straight = dict(zip(v, (0, 0, 1), strict=True))
    across = B_a.subs(cylinder).subs(straight) - g[0] - 2 * S11 * slope[0]
    return sp.expand(turned), K - S.det(), K.subs(cylinder), across
