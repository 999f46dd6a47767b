"""Shading behind blockers: R07 (30)-(35), (37), footnote 3 and the metric of §6.2.

Visibility is a step; its derivatives are distributions. So nothing is differentiated here but
integrals: `int_a^alpha(p) f domega`, whose derivative is Leibniz's rule.
"""

from __future__ import annotations

import functools

import mpmath as mp
import numpy as np

from derivations.visibility import _gradients_bounds as bounds
from derivations.visibility import _gradients_proofs as proofs
from firstorder.ledger import Check, Counterexample, Row, na

# --- a scene for the numbers: two slabs whose shadows overlap, and one apart ----------------------

SLABS = (((0.45, 1.0), (-0.2, 1.2)), ((0.0, 0.8), (-0.5, 0.9)), ((-1.5, 1.1), (-1.9, 1.0)))
PLACE = (0.12, 0.3)


def transport(lib, x, theta, omega):
    """Smooth, of no special form: x, theta and omega are all mixed."""
    c, s, e = lib.cos(omega), lib.sin(omega + x), lib.exp(0.4 * theta * omega)
    return (1.0 + 0.3 * x + 0.2 * x * omega + 0.5 * s) * c * e


def light(lib, x, omega):
    """L of a transport that is L(x, omega) rho(theta - omega)."""
    return 1.0 + 0.3 * lib.sin(2.0 * omega + x) + 0.1 * x * omega


def lobe(lib, angle):
    """Its rho, not even, and not zero at the horizon."""
    return lib.exp(-0.8 * angle**2) * (1.0 + 0.2 * angle)


def _pieces(lib, x, slabs=SLABS):
    """The visible intervals, by hand: the first two slabs overlap, the third is apart."""
    angles = [[lib.atan((x - p[0]) / p[1]) for p in slab] for slab in slabs]
    (low, _), (_, high), (far_low, far_high) = angles
    half = lib.pi / 2
    return [(-half, low), (high, far_low), (far_high, half)]


def brute(x, theta, T=transport):
    """B on the visible pieces by 26 nodes each, in mpmath's current precision.

    The rule's own numbers are rounded, but the same for every x and theta, so that differences of
    this are good to 1e-15 of the derivative.
    """
    total = mp.mpf(0)
    t, weights = np.polynomial.legendre.leggauss(26)
    for low, high in _pieces(mp, x):
        half, middle = (high - low) / 2, (high + low) / 2
        pairs = zip(t.tolist(), weights.tolist(), strict=True)
        total += half * sum(w * T(mp, x, theta, middle + half * u) for u, w in pairs)
    return total


def against_adaptive() -> float:
    """Relative error of the value against adaptive quadrature."""
    pieces = _pieces(mp, PLACE[0])
    truth = sum(mp.quad(lambda w: transport(mp, *PLACE, w), ends) for ends in pieces)
    return abs(float(ours().value) - float(truth)) / abs(float(truth))


@functools.cache
def brute_jet():
    """B, its gradient and Hessian at PLACE by high-precision differences."""
    with mp.workdps(40):
        p, h = [mp.mpf(c) for c in PLACE], mp.mpf(10) ** -9
        B = {(i, j): brute(p[0] + i * h, p[1] + j * h) for i in range(-1, 2) for j in range(-1, 2)}
        second = [(B[1, 0] - 2 * B[0, 0] + B[-1, 0]) / h**2]
        second += [(B[1, 1] - B[1, -1] - B[-1, 1] + B[-1, -1]) / (4 * h**2)]
        second += [(B[0, 1] - 2 * B[0, 0] + B[0, -1]) / h**2]
        first = [(B[1, 0] - B[-1, 0]) / (2 * h), (B[0, 1] - B[0, -1]) / (2 * h)]
        return [float(v) for v in (B[0, 0], *first, *second)]


@functools.cache
def ours():
    """The library's jet and its parts."""
    import jax
    import jax.numpy as jnp

    import firstorder.visibility as vis

    @jax.jit
    def jet(x, theta):
        low, high = (
            vis.point_edge_angle(jnp.array([slab[k] for slab in SLABS]), jnp.stack([x, 0.0 * x]))
            for k in (0, 1)
        )
        edges = vis.visible_edges(low, high)
        T = functools.partial(transport, jnp)
        return vis.shading(T, x, theta, edges)

    return jet(*map(jnp.asarray, PLACE))


def _entries(shading):
    g, H = shading.gradient.total, shading.hessian.total
    return [float(v) for v in (shading.value, g[0], g[1], H[0, 0], H[0, 1], H[1, 1])]


def against_differences(which=range(6)) -> float:
    """Error of value, B_x, B_theta, B_xx, B_xtheta, B_thetatheta."""
    truth = brute_jet()
    return max(abs(_entries(ours())[i] - truth[i]) / abs(truth[i]) for i in which)


def against_autodiff(which=range(6)) -> float:
    """The same against autodiff of a plain Gauss-Legendre sum over the visible pieces."""
    truth = _autodiff_jet()
    return max(abs(_entries(ours())[i] - truth[i]) / abs(truth[i]) for i in which)


@functools.cache
def _autodiff_jet():
    import jax
    import jax.numpy as jnp

    t, w = np.polynomial.legendre.leggauss(40)

    class Lib:
        pi, cos, sin, exp = np.pi, jnp.cos, jnp.sin, jnp.exp
        atan = staticmethod(jnp.arctan)

    def B(p):
        total = 0.0
        for low, high in _pieces(Lib, p[0]):
            node = 0.5 * (high + low) + 0.5 * (high - low) * t
            total += jnp.sum(0.5 * (high - low) * w * transport(Lib, p[0], p[1], node))
        return total

    p = jnp.array(PLACE)
    g, H = jax.jit(jax.grad(B))(p), jax.jit(jax.hessian(B))(p)
    return [float(v) for v in (B(p), g[0], g[1], H[0, 0], H[0, 1], H[1, 1])]


def parts_agree() -> float:
    """B_theta by parts against differences of the integral, for T = L(x, omega) rho."""
    import jax.numpy as jnp

    import firstorder.visibility as vis

    X, angle = PLACE
    low, high = (
        vis.point_edge_angle(jnp.array([slab[k] for slab in SLABS]), jnp.array([X, 0.0]))
        for k in (0, 1)
    )
    split = vis.angular_derivative_by_parts(
        functools.partial(light, jnp),
        functools.partial(lobe, jnp),
        X,
        angle,
        vis.visible_edges(low, high),
    )
    truth = convolved_slope(X, angle)
    return abs(float(split.total) - truth) / abs(truth)


def _convolved(lib, x, theta, omega):
    return light(lib, x, omega) * lobe(lib, theta - omega)


def convolved_slope(x, theta):
    """B_theta of that T, by differences of adaptive quadrature."""
    with mp.workdps(40):
        h = mp.mpf(10) ** -9
        up, down = (brute(mp.mpf(x), mp.mpf(theta) + e, _convolved) for e in (h, -h))
        return float((up - down) / (2 * h))


def printed_angular(x, theta):
    """(35) for that T: the signed sum alone."""
    return _signed_sum(x, theta, _convolved)


def _signed_sum(x, theta, T):
    with mp.workdps(40):
        ends = [e for piece in _pieces(mp, mp.mpf(x)) for e in piece][1:-1]
        return float(sum(-s * T(mp, x, theta, w) for s, w in zip((1, -1) * 2, ends, strict=True)))


def printed_general(x, theta):
    """The angular part of (32): int T V_omega, for the general T."""
    return _signed_sum(x, theta, transport)


def general_boundary(x, theta):
    """What visibility adds to B_theta for the general T: all of it less int T_theta V.

    Both by quadrature.
    """
    with mp.workdps(40):
        h = mp.mpf(10) ** -9
        X, angle = mp.mpf(x), mp.mpf(theta)
        whole = (brute(X, angle + h) - brute(X, angle - h)) / (2 * h)

        def slope(lib, x, t, w):
            return (transport(lib, x, t + h, w) - transport(lib, x, t - h, w)) / (2 * h)

        return float(mp.nstr(whole - brute(X, angle, slope), 12))


def steps_of_visibility() -> float:
    """V as a sum of signed steps against the intervals themselves, at 2001 angles."""
    import jax.numpy as jnp

    import firstorder.visibility as vis

    low, high = (
        vis.point_edge_angle(jnp.array([slab[k] for slab in SLABS]), jnp.array([PLACE[0], 0.0]))
        for k in (0, 1)
    )
    angles = np.linspace(-1.57, 1.57, 2001)
    V = np.asarray(vis.visible_edges(low, high).visibility(jnp.asarray(angles)))
    blocked = np.zeros(angles.size, bool)
    u = np.stack([-np.sin(angles), np.cos(angles)], -1)
    for p, q in SLABS:  # the ray meets the slab if its ends are on both of its sides
        one, two = (u[:, 0] * e[1] - u[:, 1] * (e[0] - PLACE[0]) for e in (p, q))
        blocked |= one * two < 0
    return float(np.max(np.abs(V - ~blocked)))


GRADIENTS = "firstorder.visibility.gradients"
TWO = {"fourier": na("no spectrum")}
SPATIAL = {
    "autodiff": Check(lambda: against_autodiff((1, 3)), 1e-12),
    "brute_force": Check(lambda: against_differences((1, 3)), 1e-12),
}
ANGULAR = {
    "autodiff": Check(lambda: against_autodiff((2, 4, 5)), 1e-12),
    "brute_force": Check(lambda: max(against_differences((2, 4, 5)), parts_agree()), 1e-12),
}
ROWS = [
    Row(
        "R07.30",
        "definition",
        implements=f"{GRADIENTS}.shading",
        symbolic=na("definition"),
        autodiff=na("no derivative"),
        fourier=na("definition"),
        brute_force=Check(against_adaptive, 1e-12),
    ),
    Row(
        "R07.31",
        "identity",
        **SPATIAL | TWO,
        implements=f"{GRADIENTS}.SplitDerivative",
        symbolic=proofs.product_rule,
        note="In the sense of distributions; the two terms are Split's interior and boundary.",
    ),
    Row(
        "R07.32",
        "over-claim",
        **ANGULAR | TWO,
        implements=f"{GRADIENTS}.shading_derivatives",
        symbolic=lambda: [proofs.leibniz(o) for o in ("x", "theta", "xx", "xtheta", "thetatheta")],
        corrected="B_x^V = int T V_x domega; B_theta = int T_theta V domega has no visibility part "
        "for a general T, as V does not depend on theta",
        counterexample=Counterexample(
            {"x": 0.12, "theta": 0.3}, printed=printed_general, true=general_boundary
        ),
        note="grad V read as (V_x, V_omega), as (34) and (35) do, needs T = L rho(theta - omega).",
    ),
    Row(
        "R07.33",
        "definition",
        implements=f"{GRADIENTS}.VisibilityEdges",
        symbolic=na("definition"),
        autodiff=na("no derivative"),
        fourier=na("definition"),
        brute_force=Check(steps_of_visibility, 0.0),
    ),
    Row(
        "R07.34",
        "identity",
        **SPATIAL | TWO,
        implements=f"{GRADIENTS}.VisibilityEdges",
        symbolic=proofs.step_derivatives,
    ),
    Row(
        "R07.35",
        "over-claim",
        **ANGULAR | TWO,
        implements=f"{GRADIENTS}.angular_derivative_by_parts",
        symbolic=proofs.by_parts,
        corrected="for T = L(x, omega) rho(theta - omega): B_theta = int L_omega rho V domega + "
        "sum_j -sgn_j T(alpha_j) - [T V] between the horizon's ends; for the reflected lobe of "
        "(23) all three change sign (R07.s6.1b); for a T of no such difference no such term",
        counterexample=Counterexample(
            {"x": 0.12, "theta": 0.3}, printed=printed_angular, true=convolved_slope
        ),
    ),
    Row(
        "R07.37",
        "identity",
        **SPATIAL | TWO,
        implements=f"{GRADIENTS}.visible_edges",
        symbolic=lambda: [proofs.leibniz("x"), proofs.leibniz("xx"), proofs.leibniz("xtheta")],
        note="The visibility part of B_x; ours: B_xx^V = sum sgn (2 T_x alpha_x + T_omega "
        "alpha_x^2 + T alpha_xx), B_xtheta^V = sum sgn T_theta alpha_x.",
    ),
    Row(
        "R07.fn3",
        "over-claim",
        implements=f"{GRADIENTS}.shading_derivatives",
        symbolic=proofs.bounded_turn,
        autodiff=na("one route"),
        fourier=na("no spectrum"),
        brute_force=Check(lambda: max(bounds.largest_excess(), bounds.gradient_error()), 1e-6),
        corrected="in flatland, under bounded transport, |B_x^V| <= sum_j |T| cos(alpha_j) / D_j, "
        "also where edges are in line: the gradient jumps there and stays finite while every "
        "D_j > 0",
        counterexample=Counterexample(
            {"h": 1e-6}, printed=lambda h: 0.0, true=bounds.true_reciprocal
        ),
        note="Printed and true are 1 / |B_x|. Under a point light B itself jumps.",
    ),
    Row(
        "R07.s6.2",
        "over-claim",
        implements=f"{GRADIENTS}.visible_edges",
        symbolic=proofs.edges_alone,
        autodiff=na("one route"),
        fourier=na("no spectrum"),
        brute_force=Check(
            lambda: max(abs(bounds.tilted_gradient(0.0, 0.6) - 1.0), bounds.edge_sum_error()), 1e-8
        ),
        corrected="the sum runs over edges alone: it bounds the gradient by the harmonic mean of "
        "the distances of the *edges*; the mean over all directions counts the whole of every "
        "blocker, of which the gradient knows nothing",
        counterexample=Counterexample(
            {"one": 0.0, "two": 0.6}, printed=bounds.tilted_mean, true=bounds.tilted_gradient
        ),
        note="Printed and true are ratios between two slabs with one edge and two tilts.",
    ),
]
