"""Shading behind blockers: R07 (30)-(35), (37), footnote 3 and the metric of §6.2.

Visibility is a step; its derivatives are distributions. So nothing is differentiated here but
integrals: `int_a^alpha(p) f domega`, whose derivative is Leibniz's rule.
"""

from __future__ import annotations

import functools

import mpmath as mp
import numpy as np
import sympy as sp

from derivations.ledger import Check, Counterexample, Row, na

x, theta, omega, a, b = sp.symbols("x theta omega a b", real=True)
alpha = sp.Function("alpha")(x)


def _at_edge(expression):
    """A derivative of T or L, taken first and then read at the edge."""
    return expression.subs(omega, alpha).doit()


def leibniz(order: str):
    """Derivatives of B = int_a^alpha T domega, a visible piece whose end moves: sign +1.

    A piece that begins at an edge is minus this with the same ends, sign -1, and any visibility
    is a sum of such pieces. T is a product of three functions, of which every T is a limit of
    sums; sympy then writes each derivative in one way only.
    """
    T = sp.Mul(*(sp.Function(f"T{c}")(c) for c in (x, theta, omega)))
    B = sp.Integral(T, (omega, a, alpha))
    ax, axx = alpha.diff(x), alpha.diff(x, 2)

    def inside(*by):
        return sp.Integral(T.diff(*by), (omega, a, alpha))

    wanted = {
        "x": inside(x) + _at_edge(T) * ax,
        "theta": inside(theta),
        "xx": inside(x, 2)
        + 2 * _at_edge(T.diff(x)) * ax
        + _at_edge(T.diff(omega)) * ax**2
        + _at_edge(T) * axx,
        "xtheta": inside(x, theta) + _at_edge(T.diff(theta)) * ax,
        "thetatheta": inside(theta, 2),
    }
    by = {"x": (x,), "theta": (theta,), "xx": (x, x), "xtheta": (x, theta)}
    found = B.diff(*by.get(order, (theta, theta)))
    return sp.simplify((found - wanted[order]).doit())


def product_rule():
    """(31) as a distribution in x: with any test function f, int f L V = int_a^alpha f L."""
    L, f = sp.Function("L")(x, omega), sp.Function("f")(omega)
    weighed = sp.Integral(f * L, (omega, a, alpha)).diff(x)
    smooth = sp.Integral(f * L.diff(x), (omega, a, alpha))
    step = _at_edge(f) * _at_edge(L) * alpha.diff(x)  # int f L delta(alpha - omega) alpha_x
    # In omega: - int f_omega L V = int f L_omega V - f L at the edge, and f vanishes at the end a.
    g = sp.Function("g")(omega)
    parts = (g * f).diff(omega) - g.diff(omega) * f - g * f.diff(omega)
    return sp.simplify((weighed - smooth - step).doit()), sp.simplify(parts)


def step_derivatives():
    """(34): against any test function, d/dx int f H(alpha - omega) = f(alpha) alpha_x.

    And - int f_omega H(alpha - omega) = -f(alpha) + f(a), f zero at the far end a.
    """
    f = sp.Function("f")
    weighed = sp.Integral(f(omega), (omega, a, alpha))
    dx = weighed.diff(x) - f(alpha) * alpha.diff(x)
    slope = -sp.integrate(f(omega).diff(omega), (omega, a, alpha)) + f(alpha) - f(a)
    return sp.simplify(dx), sp.simplify(slope.doit())


def by_parts():
    """B_theta = int L rho' for T = L(omega) rho(theta - omega): what (35) needs beside it."""
    L, rho, t = sp.Function("L"), sp.Function("rho"), sp.Symbol("t")
    T = L(omega) * rho(theta - omega)
    # d/domega of T = L_omega rho - L rho', so that rho' L = L_omega rho - dT/domega.
    slope = rho(t).diff(t).subs(t, theta - omega)
    moved = L(omega) * slope - (L(omega).diff(omega) * rho(theta - omega) - T.diff(omega))
    return sp.simplify(moved.doit()), sp.simplify((T.diff(theta) - L(omega) * slope).doit())


def bounded_turn():
    """The bound of footnote 3's correction: |B_x^V| <= sum |T| cos / D, finite while D > 0.

    cos(alpha) / D = y / (y^2 + (x - p)^2) is at most 1 / y over all receivers, y the height.
    """
    y, t = sp.symbols("y t", positive=True)
    rate = y / (y**2 + t**2)
    return [sp.simplify(1 / y - rate - t**2 / (y * (y**2 + t**2)))]


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
            vis.point_alpha(jnp.array([slab[k] for slab in SLABS]), jnp.stack([x, 0.0 * x]))
            for k in (0, 1)
        )
        edges = vis.exposed_edges(low, high)
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
        vis.point_alpha(jnp.array([slab[k] for slab in SLABS]), jnp.array([X, 0.0])) for k in (0, 1)
    )
    split = vis.angular_by_parts(
        functools.partial(light, jnp),
        functools.partial(lobe, jnp),
        X,
        angle,
        vis.exposed_edges(low, high),
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
        vis.point_alpha(jnp.array([slab[k] for slab in SLABS]), jnp.array([PLACE[0], 0.0]))
        for k in (0, 1)
    )
    angles = np.linspace(-1.57, 1.57, 2001)
    V = np.asarray(vis.exposed_edges(low, high).visibility(jnp.asarray(angles)))
    blocked = np.zeros(angles.size, bool)
    u = np.stack([-np.sin(angles), np.cos(angles)], -1)
    for p, q in SLABS:  # the ray meets the slab if its ends are on both of its sides
        one, two = (u[:, 0] * e[1] - u[:, 1] * (e[0] - PLACE[0]) for e in (p, q))
        blocked |= one * two < 0
    return float(np.max(np.abs(V - ~blocked)))


# --- footnote 3 ----------------------------------------------------------------------------------


def aligned(x, gap=0.0):
    """Light under cos; the ends (0, 1) of one slab and (gap, 2) of another are in line at x = 0."""
    near, far = np.arctan(x / 1.0), np.arctan((x - gap) / 2.0)
    return 1.0 + np.sin(min(near, far))


def true_reciprocal(h):
    """1 / |B_x| where two edges are in line, by the steeper one-sided difference quotient."""
    return 1.0 / max(abs(aligned(h) - aligned(0.0)), abs(aligned(0.0) - aligned(-h))) * h


def largest_excess(trials: int = 2000) -> float:
    """Search: |difference quotient| of B minus the bound sum of 1 / y over the ends, its largest.

    Random slabs, a third of them with an end placed in line with another; uniform light.
    """
    rng = np.random.default_rng(7)
    worst = -np.inf
    for _ in range(trials):
        ends = np.stack([rng.uniform(-2, 2, (4, 2)), rng.uniform(0.2, 2.0, (4, 2))], -1)
        if rng.random() < 0.33:
            ends[1, 0] = 2.0 * ends[0, 0]  # seen from x = 0, in line with the first
        quotient = (_sky(1e-7, ends) - _sky(-1e-7, ends)) / 2e-7
        worst = max(worst, abs(quotient) - np.sum(1.0 / ends[..., 1]))
    return max(0.0, worst)


def _sky(x, ends):
    """Integral of cos over what the slabs leave visible: sorted intervals, in NumPy."""
    angles = np.sort(np.arctan((x - ends[..., 0]) / ends[..., 1]), -1)
    total, reach = 0.0, -0.5 * np.pi
    for low, high in angles[np.argsort(angles[:, 0])]:
        total += np.sin(max(low, reach)) - np.sin(reach)
        reach = max(reach, high)
    return total + 1.0 - np.sin(reach)


# --- the metric of §6.2 --------------------------------------------------------------------------


def tilted_gradient(one, two):
    """B_x before a slab from (0, 1) that leans by `one`, over that before one that leans by `two`.

    By differences of B; both reach far to the left.
    """

    def slope(tilt):
        far = (-60.0 * np.cos(tilt), 1.0 + 60.0 * np.sin(tilt))
        ends = np.array([[[0.0, 1.0], far]])
        edge = lambda x: np.sin(np.arctan(x / 1.0)) + 1.0  # noqa: E731
        # The far end is an edge too; it is taken away, as if the slab went on to the horizon.
        whole = [_sky(x, ends) for x in (1e-5, -1e-5)]
        rest = [1.0 - np.sin(np.arctan((x - far[0]) / far[1])) for x in (1e-5, -1e-5)]
        assert abs(whole[0] - rest[0] - edge(1e-5)) < 1e-12
        return (whole[0] - rest[0] - whole[1] + rest[1]) / 2e-5

    return slope(one) / slope(two)


def tilted_mean(one, two):
    """The same ratio by the harmonic mean of all blocker distances over the directions."""

    def inverse(tilt):
        # Distance along omega to the line through (0, 1) with that tilt, from the origin.
        w = np.linspace(0.0, np.arctan2(60.0 * np.cos(tilt), 1.0 + 60.0 * np.sin(tilt)), 4001)
        along = np.stack([-np.sin(w), np.cos(w)], -1)
        normal = np.array([np.sin(tilt), np.cos(tilt)])
        return np.trapezoid(along @ normal / normal[1], w)

    return inverse(one) / inverse(two)


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
        implements=f"{GRADIENTS}.Split",
        symbolic=product_rule,
        note="In the sense of distributions; the two terms are Split's interior and boundary.",
    ),
    Row(
        "R07.32",
        "over-claim",
        **ANGULAR | TWO,
        implements=f"{GRADIENTS}.shaded",
        symbolic=lambda: [leibniz(o) for o in ("x", "theta", "xx", "xtheta", "thetatheta")],
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
        implements=f"{GRADIENTS}.Edges",
        symbolic=na("definition"),
        autodiff=na("no derivative"),
        fourier=na("definition"),
        brute_force=Check(steps_of_visibility, 0.0),
    ),
    Row(
        "R07.34",
        "identity",
        **SPATIAL | TWO,
        implements=f"{GRADIENTS}.Edges",
        symbolic=step_derivatives,
    ),
    Row(
        "R07.35",
        "over-claim",
        **ANGULAR | TWO,
        implements=f"{GRADIENTS}.angular_by_parts",
        symbolic=by_parts,
        corrected="for T = L(x, omega) rho(theta - omega): B_theta = int L_omega rho V domega + "
        "sum_j -sgn_j T(alpha_j) - [T V] between the horizon's ends; otherwise no such term",
        counterexample=Counterexample(
            {"x": 0.12, "theta": 0.3}, printed=printed_angular, true=convolved_slope
        ),
    ),
    Row(
        "R07.37",
        "identity",
        **SPATIAL | TWO,
        implements=f"{GRADIENTS}.exposed_edges",
        symbolic=lambda: [leibniz("x"), leibniz("xx"), leibniz("xtheta")],
        note="The visibility part of B_x; ours: B_xx^V = sum sgn (2 T_x alpha_x + T_omega "
        "alpha_x^2 + T alpha_xx), B_xtheta^V = sum sgn T_theta alpha_x.",
    ),
    Row(
        "R07.fn3",
        "over-claim",
        implements=f"{GRADIENTS}.shaded",
        symbolic=bounded_turn,
        autodiff=na("one route"),
        fourier=na("no spectrum"),
        brute_force=Check(largest_excess, 1e-6),
        corrected="in flatland, under bounded transport, |B_x^V| <= sum_j |T| cos(alpha_j) / D_j, "
        "also where edges are in line: the gradient jumps there and stays finite while every "
        "D_j > 0",
        counterexample=Counterexample({"h": 1e-6}, printed=lambda h: 0.0, true=true_reciprocal),
        note="Printed and true are 1 / |B_x|. Under a point light B itself jumps.",
    ),
    Row(
        "R07.s6.2",
        "over-claim",
        implements=f"{GRADIENTS}.exposed_edges",
        symbolic=lambda: leibniz("x"),
        autodiff=na("one route"),
        fourier=na("no spectrum"),
        brute_force=Check(lambda: abs(tilted_gradient(0.0, 0.6) - 1.0), 1e-8),
        corrected="the sum runs over edges alone: it bounds the gradient by the harmonic mean of "
        "the distances of the *edges*; the mean over all directions counts the whole of every "
        "blocker, of which the gradient knows nothing",
        counterexample=Counterexample(
            {"one": 0.0, "two": 0.6}, printed=tilted_mean, true=tilted_gradient
        ),
        note="Printed and true are ratios between two slabs with one edge and two tilts.",
    ),
]
