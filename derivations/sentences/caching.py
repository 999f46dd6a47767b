"""J12 §5.2 to §9 in words: powers, penumbras, walls of cells, eigenvalues, ranks of tensors."""

from __future__ import annotations

import mpmath as mp
import numpy as np
import sympy as sp

from derivations.flatland._scenes import BLOCKER, LIGHT, Place, motion
from firstorder.ledger import Check, Counterexample, Row, na

# --- (51): a power of the cosine -----------------------------------------------------------------


def border_bends():
    """d^2 sin(theta) / dx^2 of a fixed point at (0, h), theta = atan(-x / h) towards +x."""
    x = sp.Symbol("x", real=True)
    h = sp.Symbol("h", positive=True)
    r = sp.sqrt(x**2 + h**2)
    sine, cosine = -x / r, h / r
    return [sp.simplify(sine.diff(x, 2) + 3 * cosine**2 * sine / r**2)]


def printed_bend(theta, r):
    """cos(theta^2), as the exponent stands."""
    return float(3.0 * np.cos(theta**2) * np.sin(theta) / r**2)


def true_bend(theta, r):
    """By differences of the sine itself, with the sign of (51)'s L_i - L_(i-1)."""
    with mp.workdps(30):
        h = mp.mpf(10) ** -8
        px, py = r * mp.sin(theta), r * mp.cos(theta)

        def sine(x):
            return (px - x) / mp.hypot(px - x, py)

        return float(-(sine(h) - 2 * sine(0) + sine(-h)) / h**2)


def bends_of_borders(route) -> float:
    """The library's Hessian of one border against differences, or autodiff of its sine."""
    import jax
    import jax.numpy as jnp

    from firstorder.flatland.estimators._irradiance_forms import border_derivatives
    from firstorder.visibility import edge_at

    worst = 0.0
    for theta, r in ((0.7, 0.8), (-0.4, 1.5)):
        point = jnp.array([[r * np.sin(theta), r * np.cos(theta)]])
        border = edge_at(*(jnp.array([c]) for c in (-theta, 1.0 / r, 1.0)))
        found = float(border_derivatives(border).hessian[0, 0])
        if route == "autodiff":
            sine = lambda x, p=point: -(p[0, 0] - x) / jnp.hypot(p[0, 0] - x, p[0, 1])  # noqa: E731
            true = float(jax.grad(jax.grad(sine))(0.0))
        else:
            true = true_bend(theta, r)
        worst = max(worst, abs(found - true))
    return worst


# --- §6.1: the gradient in a penumbra ------------------------------------------------------------


def frozen(x):
    """Scene B's gradient with the shadow's ends held on the light: (37)."""
    with mp.workdps(30):
        h = mp.mpf(10) ** -8
        here = Place((mp.mpf(x), mp.mpf(0)), mp.mpf(0), [0, 0, 0])
        low, high = (here.through(b, 0.5) for b in BLOCKER)
        left = (LIGHT[0], max(LIGHT[0], min(low, LIGHT[1])))
        right = (min(LIGHT[1], max(high, LIGHT[0])), LIGHT[1])

        def E(step):
            place = Place((mp.mpf(x), mp.mpf(0)), mp.mpf(0), [step, 0, 0])
            return sum(place.sine(a, 1) - place.sine(b, 1) for a, b in (left, right))

        return float((E(h) - E(-h)) / (2 * h))


def share_at_most_one(x):
    """|(37)| over |grad E|, no more than one, as the sentence has it."""
    return min(1.0, share(x))


def share(x):
    """The same, by differences."""
    return abs(frozen(x)) / abs(float(motion("B", (x, 0.0), 0.0)[1][0]))


def both_signs():
    """E = S(visible) with one moving end: dE/dx = smooth + edge; neither sign bounds the sum."""
    s, e = sp.symbols("smooth edge", positive=True)
    opposed, along = (s - e) ** 2, (s + e) ** 2
    # More than the smooth part where they agree, less where e < 2 s and they do not.
    return [sp.expand(along - s**2 - e * (e + 2 * s)), sp.expand(opposed - s**2 - e * (e - 2 * s))]


def frozen_by_library() -> float:
    """The library's arc-length form in scene B at that place, many strata."""
    from derivations.flatland._scenes import built
    from firstorder.flatland import Receiver
    from firstorder.flatland.estimators import arc_length_estimate, hemicircle_strata, trace_strata

    scene, _ = built("B")
    rays = trace_strata(scene, Receiver((0.6, 0.0), 0.0), where=hemicircle_strata(200_000))
    return abs(float(arc_length_estimate(rays).gradient[0]) / frozen(0.6) - 1.0)


# --- §7.1: walls that move along their normals ---------------------------------------------------


def swept_by_a_wall():
    """The area beside a curve c(s) + t v(s) grows by `int v . n |c'| ds`: v along c sweeps none.

    By Green's theorem the area is `1/2 int c x c' ds` and ends; v = a c' + b (its normal).
    """
    s, t = sp.symbols("s t", real=True)
    p, q, a, b = (sp.Function(k)(s) for k in "pqab")
    c = sp.Matrix([p, q])
    slope = c.diff(s)
    normal = sp.Matrix([slope[1], -slope[0]])
    moved = c + t * (a * slope + b * normal)

    def twice_area(curve):
        d = curve.diff(s)
        return curve[0] * d[1] - curve[1] * d[0]

    rate = twice_area(moved).diff(t).subs(t, 0) / 2
    size = slope.dot(slope)
    v = a * slope + b * normal
    ends = (v[1] * c[0] - v[0] * c[1]) / 2  # a total derivative: what the curve's own ends add
    return sp.simplify(sp.expand(rate - b * size - ends.diff(s)))


# --- §8: powers, eigenvalues, names --------------------------------------------------------------


def powers():
    """R^3 on a line and R^4 on a disc, of the integrals of |x H x| / 2."""
    r, R, h, lam = sp.symbols("r R h lambda", positive=True)
    eps = sp.Symbol("epsilon", positive=True)
    line = 2 * sp.integrate(h * r**2 / 2, (r, 0, R))
    disc = sp.integrate(lam * r**2 / 2 * 2 * sp.pi * r, (r, 0, R))
    found = [sp.solve(line - eps, R)[0], next(k for k in sp.solve(disc - eps, R) if k.is_positive)]
    slopes = [sp.diff(sp.log(f), v) * v for f, v in zip(found, (h, lam), strict=True)]
    return [sp.simplify(slopes[0] + sp.Rational(1, 3)), sp.simplify(slopes[1] + sp.Rational(1, 4))]


def power_of_the_radius(dims, factor=16.0):
    """The power with which the library's radius falls as the derivative grows."""
    from firstorder.caching import radius_for

    R = [float(radius_for(np.array(h), 0.01, dims=dims)) for h in (2.0, 2.0 * factor)]
    return np.log(R[1] / R[0]) / np.log(factor)


def radii_by_search() -> float:
    """Radii of both laws against bisection of sums of |x H x| / 2."""
    from scipy.optimize import brentq

    from firstorder.caching import radius_for

    n, worst = 4000, 0.0
    t = (np.arange(n) + 0.5) / n
    for h in (0.5, 8.0):
        for dims in (1, 2):
            weight = 2.0 if dims == 1 else 2.0 * np.pi

            def error(R, h=h, dims=dims, weight=weight):
                return np.mean(0.5 * h * (R * t) ** 2 * weight * (R * t) ** (dims - 1)) * R - 0.01

            found = brentq(error, 1e-3, 9.0, xtol=1e-14)
            worst = max(worst, abs(float(radius_for(np.array(h), 0.01, dims=dims)) / found - 1.0))
    return worst


H = np.array([[1.3, 0.4], [0.4, -0.6]])


def scaled_eigen(factor, which):
    """Largest eigenvalue of H over that of twice the light, or length of the eigenvector."""
    values, vectors = np.linalg.eigh(factor * H)
    return values[-1] if which == "value" else np.linalg.norm(vectors[:, -1])


def eigen_of_a_multiple():
    """(c H) v = (c lambda) v: the same v, and c times lambda."""
    c, p, q, s = sp.symbols("c p q s", real=True)
    M = sp.Matrix([[p, q], [q, s]])
    lam = (p + s) / 2 + sp.sqrt(((p - s) / 2) ** 2 + q**2)
    v = sp.Matrix([q, lam - p])
    return [
        *((c * M) * v - c * lam * v).applyfunc(sp.simplify),
        *((M * v) - lam * v).applyfunc(sp.simplify),
    ]


def larger_light() -> float:
    """The library's bound against eigenvalues; under twice the radiance R falls by 2^-1/4."""
    import jax.numpy as jnp

    from firstorder.caching import geometric_bound, radius_for

    rng = np.random.default_rng(83)
    A = rng.normal(size=(40, 2, 2))
    B = np.asarray(geometric_bound(jnp.asarray(A + np.swapaxes(A, 1, 2)), jnp.full(40, 0.1)))
    true = _bound_by_hand(A + np.swapaxes(A, 1, 2)) * 0.1
    off = np.max(np.abs(B - true)) / np.max(np.abs(true))
    R = [float(radius_for(np.array(L * 3.0), 0.01, dims=2)) for L in (1.0, 2.0)]
    return float(max(off, abs(R[0] / R[1] - 2.0**0.25)))


def _bound_by_hand(hessians):
    """(P + N + |P - N|) / 2 by eigenvalues, P and N the sums of positive and negative parts."""

    def part(M):
        w, V = np.linalg.eigh(M)
        return (V * np.maximum(w, 0.0)) @ V.T

    P, N = sum(map(part, hessians)), sum(part(-M) for M in hessians)
    return 0.5 * (P + N + part(P - N) + part(N - P))


def curvature_along(angle):
    """Second derivative of x^T H x / 2 along a direction, by differences."""
    u = np.array([np.cos(angle), np.sin(angle)])
    f = [0.5 * (k * u) @ H @ (k * u) for k in (-1e-2, 0.0, 1e-2)]
    return float((f[0] - 2.0 * f[1] + f[2]) / 1e-4)


def principal_axes() -> float:
    """The library's directions of an ellipse: H is diagonal in them, largest size first."""
    import jax.numpy as jnp

    from firstorder.caching import semi_axes

    lengths, axes = (np.asarray(a) for a in semi_axes(jnp.asarray(H), 0.01, most=1e6))
    D = axes.T @ H @ axes
    ratio = lengths[0] / lengths[1] - np.sqrt(abs(D[1, 1] / D[0, 0]))
    # The area: (4 eps / pi)^(1/2) over |lambda_1 lambda_2|^(1/4), times (pi/2)^(1/2) for a saddle.
    area = np.sqrt(4 * 0.01 / np.pi * np.pi / 2) / abs(np.linalg.det(H)) ** 0.25
    return float(max(abs(D[0, 1]), abs(ratio), abs(lengths.prod() / area - 1.0)))


def third_derivative():
    """E''' has an index for each derivative: eight numbers of a surface, four that differ."""
    x, y, s, t = sp.symbols("x y s t", real=True)
    E = sp.Function("E")(x, y)
    u = (x, y)
    T = [[[E.diff(a, b, c) for c in u] for b in u] for a in u]
    term = sum(T[i][j][k] * (s, t)[i] * (s, t)[j] * (s, t)[k]
               for i in (0, 1) for j in (0, 1) for k in (0, 1))  # fmt: skip
    h = sp.Symbol("h")
    g = sp.exp(x + 2 * y) + x**3 * y  # a test function of its own
    along = g.subs({x: x + h * s, y: y + h * t}, simultaneous=True).diff(h, 3).subs(h, 0)
    different = {term_ for row in T for col in row for term_ in col}
    return [sp.simplify(term.subs(E, g).doit() - along), sp.Integer(len(different) - 4)]


def third_along(angle, share):
    """The form `E'''[u, u, u]` of a cubic along a direction, by differences."""

    def E(p):
        return share * p[0] ** 3 - 0.7 * p[0] * p[1] ** 2

    u = np.array([np.cos(angle), np.sin(angle)])
    h = 1e-2
    f = [E(k * h * u) for k in (-2, -1, 1, 2)]
    return float((f[3] - 2 * f[2] + 2 * f[1] - f[0]) / (2 * h**3))


def third_norms() -> float:
    """The library's size of a third derivative: of c x^3 along x, and of c y^3."""
    import jax.numpy as jnp

    from firstorder.caching import derivative_norm

    worst = 0.0
    for axis in (0, 1):
        T = jnp.zeros((2, 2, 2)).at[axis, axis, axis].set(2.5)
        worst = max(worst, abs(float(derivative_norm(T, 3, directions=3001)) / 2.5 - 1.0))
    return worst


NONE = {"fourier": na("no spectrum")}
ROWS = [
    Row(
        "J12.s5.2a",
        "misprint",
        implements="firstorder.flatland.estimators._irradiance_forms.border_derivatives",
        symbolic=border_bends,
        autodiff=Check(lambda: bends_of_borders("autodiff"), 1e-10),
        brute_force=Check(lambda: bends_of_borders("brute"), 1e-8),
        **NONE,
        corrected="cos^2(theta_i-)",
        counterexample=Counterexample(
            {"theta": 0.7, "r": 0.8}, printed=printed_bend, true=true_bend
        ),
        note="In (51) the exponent stands at theta; (46) and (47) have it at the cosine.",
    ),
    Row(
        "J12.s6.1a",
        "over-claim",
        implements="firstorder.flatland.estimators._irradiance_forms.arc_length_estimate",
        symbolic=both_signs,
        autodiff=na("measured"),
        brute_force=Check(frozen_by_library, 1e-4),
        **NONE,
        corrected="the form errs by its edges, in either direction: it is too large where the edge "
        "and the smooth part are of opposite signs and the edge less than twice the other",
        counterexample=Counterexample({"x": 0.6}, printed=share_at_most_one, true=share),
        note="Printed and true are (37) over the gradient, in scene B where the penumbra ends.",
    ),
    Row(
        "J12.s7.1a",
        "identity",
        symbolic=swept_by_a_wall,
        autodiff=na("one route"),
        brute_force=na("one route"),
        **NONE,
        note="Called an approximation. To first order it is none, and the gradient tends to the "
        "truth (J12.63); of second derivatives it is one.",
    ),
    Row(
        "J12.s8.2a",
        "identity",
        implements="firstorder.caching.radius_for",
        symbolic=powers,
        autodiff=Check(
            lambda: max(abs(power_of_the_radius(1) + 1 / 3), abs(power_of_the_radius(2) + 1 / 4)),
            1e-12,
        ),
        brute_force=Check(radii_by_search, 1e-6),
        **NONE,
    ),
    Row(
        "J12.s8.3a",
        "misprint",
        implements="firstorder.caching.geometric_bound",
        symbolic=eigen_of_a_multiple,
        autodiff=na("no derivative"),
        brute_force=Check(larger_light, 1e-12),
        **NONE,
        corrected="eigenvalues double; eigenvectors, which are directions, stay",
        counterexample=Counterexample(
            {"factor": 2.0},
            printed=lambda factor: factor * scaled_eigen(1.0, "vector"),
            true=lambda factor: scaled_eigen(factor, "vector"),
        ),
        note="Printed and true are lengths of the eigenvector. A scale of L_max scales all radii, "
        "by its power -1/4.",
    ),
    Row(
        "J12.s8.4a",
        "misprint",
        implements="firstorder.caching.semi_axes",
        symbolic=eigen_of_a_multiple,
        autodiff=na("no derivative"),
        brute_force=Check(principal_axes, 1e-10),
        **NONE,
        corrected="the principal directions are the eigenvectors; the principal curvatures are "
        "the eigenvalues",
        counterexample=Counterexample(
            {"angle": 0.0},
            printed=lambda angle: float(np.linalg.eigh(H)[0][-1]) + 0.0 * angle,
            true=curvature_along,
        ),
        note="Printed is lambda_1, true the curvature along an axis that is no eigenvector.",
    ),
    Row(
        "J12.s9a",
        "misprint",
        implements="firstorder.caching.derivative_norm",
        symbolic=third_derivative,
        autodiff=na("no derivative"),
        brute_force=Check(third_norms, 1e-6),
        **NONE,
        corrected="a tensor of rank 3, with eight entries of which four differ",
        counterexample=Counterexample(
            {"angle": np.pi + 0.3, "share": 0.4},
            printed=lambda angle, share: third_along(angle - np.pi, share),
            true=third_along,
        ),
        note="A form of rank 2 is the same in opposite directions: printed. That of rank 3 "
        "changes its sign: true.",
    ),
]
