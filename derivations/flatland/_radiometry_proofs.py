"""Proofs for `radiometry`: projected lengths and areas, light from known shapes, reflection."""

from __future__ import annotations

import sympy as sp

theta, phi, w, o = sp.symbols("theta phi w o", real=True)
rho, L = sp.symbols("rho L", positive=True)
HALF = sp.pi / 2


def projected_length():
    """(12): the width, across a beam, of a piece of curve: the cross product with the beam."""
    t, angle = sp.symbols("t n", real=True)
    piece = sp.Matrix([sp.cos(angle), sp.sin(angle)])
    beam = sp.Matrix([-sp.sin(angle + t), sp.cos(angle + t)])
    return sp.simplify(piece[0] * beam[1] - piece[1] * beam[0] - sp.cos(t))


def projected_area():
    """(11): the box of two edges and the beam has the volume of the projected area."""
    a, b = sp.Matrix(sp.symbols("a1:4", real=True)), sp.Matrix(sp.symbols("b1:4", real=True))
    beam = sp.Matrix(sp.symbols("w1:4", real=True))
    return sp.expand(sp.Matrix.hstack(a, b, beam).det() - a.cross(b).dot(beam))


def over_the_hemicircle(f, x=theta):
    return sp.integrate(f, (x, -HALF, HALF))


def over_the_hemisphere(f):
    return sp.integrate(sp.integrate(f * sp.sin(theta), (theta, 0, HALF)), (phi, 0, 2 * sp.pi))


def even_light():
    """Constant radiance: E = 2 L in flatland and pi L in space."""
    return (
        over_the_hemicircle(L * sp.cos(theta)) - 2 * L,
        over_the_hemisphere(L * sp.cos(theta)) - sp.pi * L,
    )


def disc_overhead():
    """(15) by angle against by area: a disc of radius R at height h above the point."""
    R, h, q = sp.symbols("R h q", positive=True)
    edge = sp.atan(R / h)
    by_angle = 2 * sp.pi * sp.integrate(sp.cos(theta) * sp.sin(theta), (theta, 0, edge))
    by_area = 2 * sp.pi * sp.integrate(h**2 * q / (h**2 + q**2) ** 2, (q, 0, R))
    return sp.simplify(by_angle - by_area)


def light_overhead():
    """(16) by angle against by length: a line light from a to b at height h."""
    a, b = sp.symbols("a b", real=True)
    h, q = sp.symbols("h q", positive=True)
    by_length = sp.integrate(h**2 / (h**2 + q**2) ** sp.Rational(3, 2), (q, a, b))
    by_angle = sp.sin(sp.atan(b / h)) - sp.sin(sp.atan(a / h))
    return sp.simplify(by_length - by_angle)


def strings_derived():
    """Hottel's rule, the integral of (16) along the receiver: `Phi = L (crossed - uncrossed)`."""
    a, b, c, d = sp.symbols("a b c d", real=True)  # receiver [a, b] below, light [c, d] above
    h, x = sp.symbols("h x", positive=True)

    def sine(p):
        return (p - x) / sp.sqrt((p - x) ** 2 + h**2)

    def string(p, q):
        return sp.sqrt((p - q) ** 2 + h**2)

    E = sine(d) - sine(c)
    antiderivative = string(c, x) - string(d, x)
    flux = antiderivative.subs(x, b) - antiderivative.subs(x, a)
    strings = string(a, d) + string(b, c) - string(a, c) - string(b, d)
    return sp.simplify(sp.diff(antiderivative, x) - E), sp.simplify(flux - strings)


def lobe():
    """(22) for a mirror lobe at normal incidence, by the gamma function, for m = 0 to 6."""
    out = []
    for power in range(7):
        p = sp.Integer(power + 1)
        norm = sp.sqrt(sp.pi) * sp.gamma((p + 1) / 2) / sp.gamma(p / 2 + 1)
        out.append(sp.simplify(over_the_hemicircle(sp.cos(theta) ** p) - norm))
    return out


def mirrored_in_space():
    """(19) for a lobe about the mirror direction: `r(w) . o = w . r(o)`."""
    n, a, b = (sp.Matrix(sp.symbols(f"{c}1:4", real=True)) for c in "nab")

    def mirror(u):
        return 2 * n.dot(u) * n - u

    return sp.expand(mirror(a).dot(b) - a.dot(mirror(b)))


def diffuse_energy():
    """(21) and (22): the diffuse BRDFs reflect the albedo."""
    return (
        over_the_hemisphere(rho / sp.pi * sp.cos(theta)) - rho,
        over_the_hemicircle(rho / 2 * sp.cos(theta)) - rho,
    )


def reflected_moments():
    """(24) and (23) from the definition: `dL' = f L cos dw` summed for `f = cos^2(w + o)`."""
    f = sp.cos(w + o) ** 2
    by_definition = over_the_hemicircle(sp.expand_trig(f) * sp.cos(w), w)
    # cos^2(w + o) = (1 + cos 2w cos 2o - sin 2w sin 2o) / 2, moments of cos: 2 and 2/3.
    closed = 1 + sp.cos(2 * o) * sp.Rational(1, 3)
    return sp.simplify(sp.expand_trig(by_definition - closed))


def diffuse_leaves():
    """(31), (32): a BRDF without angles leaves the integral, for every L given by its values."""
    f = sp.Symbol("f")
    radiances = [1, sp.sin(theta), sp.cos(theta) ** 3 + theta**2]
    return [
        sp.simplify(
            over_the_hemicircle(f * R * sp.cos(theta)) - f * over_the_hemicircle(R * sp.cos(theta))
        )
        for R in radiances
    ]


def furnace():
    """(25) corrected: a closed room that emits `1 - rho` and reflects `rho` is filled with 1."""
    return 1 - ((1 - rho) + rho / 2 * over_the_hemicircle(sp.cos(theta)))
