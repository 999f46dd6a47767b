"""Proofs of D05 §6.2 from a circle, an eye and the law of reflection; signs as in `bandwidth`."""

from __future__ import annotations

import sympy as sp

kappa, d, depth = sp.symbols("kappa d depth", positive=True)
t, s, theta, c = sp.symbols("t s theta c", real=True)
Omega, Omega_L, A = sp.symbols("Omega Omega_L A", positive=True)
SIGN = (1, -1)  # a valley, a bump


def circle(sign: int):
    """Point and normal's angle at arc length s on a circle through the origin, valley or bump."""
    k = sign * kappa
    return sp.Matrix([sp.sin(k * s) / k, (1 - sp.cos(k * s)) / k]), k * s


def from_normal(w):
    """Angle of a vector, counter-clockwise from +y."""
    return sp.atan2(-w[0], w[1])


def towards(a, length):
    """The point at a distance from the origin, in the direction a."""
    return length * sp.Matrix([-sp.sin(a), sp.cos(a)])


def slopes_at_origin(theta_edge=theta):
    """ds-derivatives at s = 0 of: the angle to the eye, the mirrored angle, the edge's angle."""
    for sign in SIGN:
        P, n = circle(sign)
        out = from_normal(towards(theta, d) - P)
        edge = from_normal(towards(theta_edge, depth) - P)
        slopes = (sp.diff(e, s).subs(s, 0) for e in (out, 2 * n - out, edge))
        yield sign * kappa, *map(sp.simplify, slopes)


def mirrored_per_eye():
    """d(mirrored) / d(eye) + (1 - 2 kappa d / cos theta), on circles of either sign."""
    return [m / e + 1 - 2 * k * d / sp.cos(theta) for k, e, m, _ in slopes_at_origin()]


def edge_per_eye():
    """Rates of (mirrored - edge) and of the edge, for an edge in any direction."""
    other = sp.symbols("theta_edge", real=True)
    found = []
    for k, e, m, b in slopes_at_origin(other):
        wander = sp.cos(other) / depth
        found.append((m - b) / e + 1 - (2 * k - wander) * d / sp.cos(theta))
        found.append(b / e - wander * d / sp.cos(theta))
    return found


def edge_slope():
    """The edge's angle wanders by cos(theta_edge) / depth per metre of a flat mirror."""
    return [b - sp.cos(theta) / depth for *_, b in slopes_at_origin()]


def phase_gradient(light, *coordinates):
    """Point of energy of `exp(2 pi i Omega light(u))`: the gradient of its phase, in cycles."""
    return sp.Matrix([sp.diff(Omega * light, u).subs(s, 0) for u in coordinates])


def after_curvature():
    """In the frame of each point's normal, an environment's angle is theta + n(s)."""
    found = []
    for sign in SIGN:
        _, n = circle(sign)
        found += list(phase_gradient(t + n, s, t) - sp.Matrix([sign * kappa * Omega, Omega]))
    return found


def after_mirror():
    """Leaving in the local direction t, light came from -t, which is -t + n(s) in the world."""
    found = []
    for sign in SIGN:
        _, n = circle(sign)
        found += list(phase_gradient(-t + n, s, t) - sp.Matrix([sign * kappa * Omega, -Omega]))
    return found


def leaving():
    """In the world t = local + n, and a line across the ray is cos(theta_1) of the mirror's."""
    found, y = [], sp.symbols("y", real=True)
    for sign in SIGN:
        _, n = circle(sign)
        light = (-(t - n) + n).subs(s, y / sp.cos(theta))
        point = sp.Matrix([sp.diff(Omega * light, u) for u in (y, t)])
        found += list(point - sp.Matrix([2 * sign * kappa / sp.cos(theta) * Omega, -Omega]))
    return found


def at_the_eye():
    """Travel by d to the eye, with the whole chain traced: both coordinates of the end point.

    Across the ray at the eye the point is the one that left, (2 kappa / cos, .); along the angle
    it is the rate at which the eye sees the mirrored angle turn.
    """
    found = []
    for sign in SIGN:
        P, n = circle(sign)
        across = sp.symbols("y", real=True)
        E = towards(theta, d) + across * sp.Matrix([sp.cos(theta), sp.sin(theta)])
        out = from_normal(E - P)
        # The ray through the eye's line at `across` in the direction t meets the mirror at s:
        # out(s, across) = t. Implicit differentiation of mirrored = 2 n(s) - t.
        at = {s: 0, across: 0}
        out_s, out_y, n_s = (
            sp.diff(out, s).subs(at), sp.diff(out, across).subs(at), sp.diff(n, s)
        )  # fmt: skip
        k = sign * kappa
        found.append(sp.simplify(2 * n_s * (-out_y / out_s) - 2 * k / sp.cos(theta)))
        found.append(sp.simplify(2 * n_s / out_s - 1 + 1 - 2 * k * d / sp.cos(theta)))
    return found


def scale_of_an_environment():
    """Table 1's scale by c = cos(theta_0), `lhat(O_x / c, O_theta) / c`, on `delta(O_x) lambdahat`.

    First the scale itself: the phase of a wave at (a, b), met at x cos(theta_0), has the gradient
    (a c, b). Then what it does to the line O_x = 0, against any test function: nothing.
    """
    place, a = sp.symbols("x a", real=True)
    phase = (a * place + Omega * t).subs(place, place * sp.cos(theta))
    moved = phase.diff(place) - a * sp.cos(theta), phase.diff(t) - Omega
    scale, O_x = sp.Symbol("cos_theta_0", positive=True), sp.Symbol("Omega_x", real=True)
    test, line = sp.Function("f")(O_x), (O_x, -sp.oo, sp.oo)
    scaled = sp.integrate(sp.DiracDelta(O_x / scale) / scale * test, line)
    return *moved, scaled - sp.integrate(sp.DiracDelta(O_x) * test, line)


def cosine_moves_the_end():
    """A cosine splits each wave in two, 1 / (2 pi) apart; the lower one passes a cut above it.

    cos(t) cos(2 pi Omega (t + kappa s)) is the mean of two waves with the phase gradients
    (kappa Omega, Omega +- 1 / (2 pi)).
    """
    b = 2 * sp.pi * Omega
    product = sp.cos(t) * sp.cos(b * (t + kappa * s))
    phases = [b * (t + kappa * s) + sign * t for sign in SIGN]
    split = sum(sp.cos(p) for p in phases) / 2
    points = [(sp.diff(p, s) / (2 * sp.pi), sp.diff(p, t) / (2 * sp.pi)) for p in phases]
    ends = [
        (x - kappa * Omega, y - Omega - sign / (2 * sp.pi))
        for (x, y), sign in zip(points, SIGN, strict=True)
    ]
    return [sp.expand_trig(sp.expand(product - split)), *map(sp.simplify, sum(ends, ()))]


def mean_is_below_the_largest():
    """max(a, b) exceeds the mean of a and b by |a - b| / 2."""
    a, b = sp.symbols("a b", positive=True)
    return sp.simplify((sp.Max(a, b) - (a + b) / 2 - sp.Abs(a - b) / 2).rewrite(sp.Piecewise))


def mirror_in_space():
    """Turn of the mirrored ray per turn of the eye's, off any quadric, starting from vectors.

    z = (S_11 x^2 + 2 S_12 x y + S_22 y^2) / 2, eye at distance d in the xz plane. Both turns are
    read in orthonormal pairs across the two rays: in the plane of incidence, and y.
    """
    x, y = sp.symbols("x y", real=True)
    S11, S12, S22 = sp.symbols("S_11 S_12 S_22", real=True)
    a = sp.symbols("alpha", positive=True)
    P = sp.Matrix([x, y, (S11 * x**2 + 2 * S12 * x * y + S22 * y**2) / 2])
    N = sp.Matrix([-P[2].diff(x), -P[2].diff(y), 1])
    E = d * sp.Matrix([sp.sin(a), 0, sp.cos(a)])
    to_eye = E - P
    N, to_eye = N / sp.sqrt(N.dot(N)), to_eye / sp.sqrt(to_eye.dot(to_eye))
    mirrored = 2 * N.dot(to_eye) * N - to_eye
    here = {x: 0, y: 0}
    # Axes that turn together when a flat mirror is looked at: the image of e across the mirror.
    e_in, e_out = sp.Matrix([sp.cos(a), 0, -sp.sin(a)]), sp.Matrix([0, 1, 0])
    m_in, m_out = sp.Matrix([-sp.cos(a), 0, -sp.sin(a)]), sp.Matrix([0, -1, 0])

    def turn(w, one, two):
        J = w.jacobian([x, y]).subs(here)
        return sp.Matrix([(one.T * J)[:], (two.T * J)[:]])

    J = turn(mirrored, m_in, m_out) * turn(to_eye, e_in, e_out).inv()
    bend = sp.Matrix([[S11 / sp.cos(a), S12], [S12, S22 * sp.cos(a)]])
    return list((J - (sp.eye(2) - 2 * d * bend)).applyfunc(sp.simplify))
