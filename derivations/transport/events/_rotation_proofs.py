"""Proofs for rotation by curvature, from the definition `L^s(x, theta) = L(x, theta + k x)`."""

from __future__ import annotations

import sympy as sp

x, t, k, o1, o2, s = sp.symbols("x theta k Omega_x Omega_theta s", real=True)
f = sp.Function("f")


def gradient_of_the_rotation(sign=1):
    """Chain rule on a light field that is a generic cubic, term by term."""
    a = sp.symbols("a0:10")
    powers = [(i, j) for i in range(4) for j in range(4 - i)]
    L = sum(c * x**i * t**j for c, (i, j) in zip(a, powers, strict=True))
    there = {t: t + sign * k * x}
    rotated = L.subs(there)
    gx, gt = L.diff(x).subs(there), L.diff(t).subs(there)
    return [
        sp.expand(rotated.diff(x) - (gx + sign * k * gt)),
        sp.expand(rotated.diff(t) - gt),
    ]


def exponent_of_the_rotation():
    """Fourier integral of L(x, theta + k x) by the substitution s = theta + k x, d theta = ds.

    It becomes `int L(x, s) exp(-2 pi i ((Omega_x - k Omega_theta) x + Omega_theta s))`.
    """
    exponent = (o1 * x + o2 * t).subs(t, s - k * x)
    jacobian = sp.diff(s - k * x, s) - 1
    return [sp.expand(exponent - ((o1 - k * o2) * x + o2 * s)), jacobian]


def either_sense_of_angles():
    """Turning theta, k and Omega_theta at once leaves D05's definition and the minus in place."""
    local = t - k * x
    turned = -local.subs({t: -t, k: -k}, simultaneous=True)
    sheared = o1 - k * o2
    return [
        sp.expand(turned - local),
        sp.expand(sheared.subs({k: -k, o2: -o2}, simultaneous=True) - sheared),
    ]


def inverse_transpose():
    """`M^-T` is `M^T` with k negated, and det M = 1."""
    M = sp.Matrix([[1, 0], [k, 1]])
    return [*(M.inv().T - M.T.subs(k, -k)), M.det() - 1]


def twice_the_curvature():
    """Back after mirror after to-local: one linear map, [[1, 0], [2 k, -1]]."""
    to_local = sp.Matrix([[1, 0], [k, 1]])
    mirror = sp.diag(1, -1)
    # The last event acts on the ray first: B(u) = L(to_local mirror back u).
    return to_local * mirror * to_local.inv() - sp.Matrix([[1, 0], [2 * k, -1]])


def spectrum_exponent_of_the_way_back():
    """D05 step 6: B(x, theta) = B_s(x, theta - k x) shears the spectrum by +k."""
    exponent = (o1 * x + o2 * t).subs(t, s + k * x)
    return [sp.expand(exponent - ((o1 + k * o2) * x + o2 * s)), *twice_the_curvature()]


def directional_bandwidth():
    """A point of energy keeps its angular frequency through both shears (M^T, second row)."""
    energy = sp.Matrix([[1, 0], [k, 1]]).T * sp.Matrix([o1, o2])
    return [energy[1] - o2, sp.Matrix([[1, 0], [-k, 1]]).T.row(1)[0]]


def scale_of_step_seven():
    """l(X, theta) = l_o(X / c, theta): energy at Omega_x moves to Omega_x / c, shear and all."""
    c = sp.symbols("c", positive=True)
    M = sp.diag(1 / c, 1)
    return list(M.T * sp.Matrix([2 * k * o2, o2]) - sp.Matrix([2 * k * o2 / c, o2]))


def focus_of_a_parallel_beam():
    """Rays of one direction leave at theta = 2 k x, so they land at x - 2 k x d.

    They meet in x = 0 at d = 1 / (2 k), where all energy is spatial.
    """
    d = sp.symbols("d")
    landing = x - (2 * k * x) * d  # a ray at x of slope v = 2 k x, counter-clockwise, goes to -x
    meeting = sp.solve(landing.diff(x), d)[0]
    # the same in frequencies: a line (0, W) -> (2 k W, -W)^T -> travel keeps v-energy zero
    W = sp.symbols("W")
    energy = sp.Matrix([[1, 0], [2 * k, -1]]).T * sp.Matrix([0, W])
    travelled = sp.Matrix([[1, d], [0, 1]]).T * energy
    return [meeting - 1 / (2 * k), travelled[1].subs(d, meeting)]


def four_dimensional_shear():
    """The Fourier exponent of l(x, y, theta + k1 x, phi + k2 y)."""
    y, p, k1, k2, oy, op, q = sp.symbols("y phi k1 k2 Omega_y Omega_phi q", real=True)
    exponent = (o1 * x + oy * y + o2 * t + op * p).subs({t: s - k1 * x, p: q - k2 * y})
    return sp.expand(exponent - ((o1 - k1 * o2) * x + (oy - k2 * op) * y + o2 * s + op * q))
