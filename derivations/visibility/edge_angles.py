"""The edge angle of corners and round blockers: R07 (36), (70) and (71), and its second derivative.

The start is geometry: a ray from the receiver at angle omega touches a circle of radius r about C
where C lies r to its left (or right). A corner is the circle of radius zero. The receiver follows
any curve with q' = (cos n, sin n), n' = kappa.
"""

from __future__ import annotations

import mpmath as mp
import numpy as np
import sympy as sp

from firstorder.ledger import Check, Counterexample, Row, na

x, d, r, D, side = sp.symbols("x d r D side", real=True)
s, omega = sp.symbols("s omega", real=True)


def _directions(angle):
    """The ray (conventions: counter-clockwise from +y) and its left."""
    return sp.Matrix([-sp.sin(angle), sp.cos(angle)]), sp.Matrix([-sp.cos(angle), -sp.sin(angle)])


def _along(order: int):
    """d^order alpha / ds^order from the tangency condition by implicit differentiation."""
    n = sp.Function("n")(s)
    q = sp.Matrix([sp.Function("q1")(s), sp.Function("q2")(s)])
    C = sp.Matrix(sp.symbols("C1 C2", real=True))
    w = sp.Function("w")(s)
    _, left = _directions(w)
    touch = (C - q).dot(left) - side * r
    frame = {q[0].diff(s): sp.cos(n), q[1].diff(s): sp.sin(n)}
    first = sp.solve(touch.diff(s).subs(frame), w.diff(s))[0]
    found = first
    if order == 2:
        found = first.diff(s).subs(frame).subs(w.diff(s), first)
    return found - n.diff(s, order), C, q, w, n


def _local(order: int):
    """The same in D, the local angle, r and kappa: C = q + D u + side r left.

    Differentiated first, and then read in axes in which the normal stands at n = 0.
    """
    found, C, q, w, n = _along(order)
    u, left = _directions(w)
    a, k, k1 = sp.symbols("alpha kappa kappa_x", real=True)
    place = {C[i]: q[i] + D * u[i] + side * r * left[i] for i in (0, 1)}
    found = found.subs(place).subs({n.diff(s, 2): k1, n.diff(s): k}).subs({w: a, n: 0})
    return found, a, k, k1


def first_derivative():
    """A turning, bending receiver: cos(alpha) / D - kappa, whatever the radius."""
    found, a, k, _ = _local(1)
    flat = sp.atan(x / d).diff(x) - sp.cos(sp.atan(x / d)) ** 2 / d  # the triangle of Fig. 7a
    return sp.simplify(found - (sp.cos(a) / D - k)), sp.simplify(flat)


def second_derivative():
    """-2 sin cos / D^2 + kappa sin / D - side r cos^2 / D^3 - kappa_x."""
    found, a, k, k1 = _local(2)
    S, c = sp.sin(a), sp.cos(a)
    ours = -2 * S * c / D**2 + k * S / D - side * r * c**2 / D**3 - k1
    return sp.simplify(sp.expand_trig(found - ours))


def sliding_point():
    """The point of tangency C - r left moves by r u dalpha, not r u dx: App. D with dalpha."""
    a = sp.Symbol("alpha", real=True)
    u, left = _directions(a)
    return (-r * left).diff(a) - r * u


def first_order_form():
    """(71) corrected: both sides of (70) corrected, times its denominator, to first order."""
    a, e = sp.symbols("alpha epsilon", real=True)
    da, dx = sp.symbols("dalpha dx", real=True)
    top = d * sp.tan(a) + e * dx + r * sp.sin(a) * e * da
    bottom = d + r * sp.cos(a) * e * da
    both = sp.tan(a + e * da) * bottom - top
    linear = both.diff(e).subs(e, 0)
    turn = sp.solve(linear, da)[0]
    return sp.simplify(turn - sp.cos(a) ** 2 / d * dx), *sliding_point()


# --- numbers -------------------------------------------------------------------------------------

CASES = [  # center, radius, side, position, n, kappa
    ((0.3, 1.4), 0.5, 1.0, (-0.2, 0.1), 0.0, 0.0),
    ((0.3, 1.4), 0.5, -1.0, (0.7, -0.1), 0.3, 0.0),
    ((-1.1, 0.9), 0.2, 1.0, (0.4, 0.0), -0.2, 0.6),
    ((-1.1, 0.9), 0.2, -1.0, (0.4, 0.0), 0.1, -0.8),
]


def touching_angle(center, radius, side, place, n):
    """Local angle of the tangent ray by bisection of "does this ray meet the disc", 40 digits.

    No formula for tangents: only the distance of the centre from a ray.
    """
    w = [center[0] - place[0], center[1] - place[1]]
    middle = mp.atan2(-w[0], w[1])
    inside, outside = middle, middle - side * mp.pi / 2
    for _ in range(160):
        half = (inside + outside) / 2
        if abs(w[0] * mp.cos(half) + w[1] * mp.sin(half)) < radius:
            inside = half
        else:
            outside = half
    return inside - n


def bisected(order: int, center, radius, side, position, n, kappa):
    """Derivative of the bisected angle along an arc of curvature kappa, by differences."""
    with mp.workdps(45):
        center, position = [mp.mpf(c) for c in center], [mp.mpf(c) for c in position]

        def angle(t):
            turn = n + kappa * t
            if kappa:
                step = [(mp.sin(turn) - mp.sin(n)) / kappa, -(mp.cos(turn) - mp.cos(n)) / kappa]
            else:
                step = [t * mp.cos(n), t * mp.sin(n)]
            place = [p + q for p, q in zip(position, step, strict=True)]
            return touching_angle(center, mp.mpf(radius), side, place, turn)

        h = mp.mpf(10) ** -12
        if order == 1:
            return float((angle(h) - angle(-h)) / (2 * h))
        return float((angle(h) - 2 * angle(0) + angle(-h)) / h**2)


def against_bisection(order: int) -> float:
    """Largest relative error of the closed form."""
    from firstorder.visibility import circle_edge_angle

    worst = 0.0
    for center, radius, side, position, n, kappa in CASES:
        ours = circle_edge_angle(center, radius, side, position, n).along(kappa)
        found = float(ours.first if order == 1 else ours.second)
        truth = bisected(order, center, radius, side, position, n, kappa)
        worst = max(worst, abs(found - truth) / abs(truth))
    return worst


def against_autodiff(order: int) -> float:
    """The same against autodiff of the angle along the arc."""
    import jax
    import jax.numpy as jnp

    from firstorder.visibility import circle_edge_angle

    @jax.jit
    def errors(center, radius, side, position, n, kappa):
        def value(t):
            turn = n + kappa * t
            # sin(t kappa / 2) / (kappa / 2), at kappa = 0 too
            length = t * jnp.sinc(0.5 * kappa * t / jnp.pi)
            middle = 0.5 * (turn + n)
            step = length * jnp.stack([jnp.cos(middle), jnp.sin(middle)])
            return circle_edge_angle(center, radius, side, position + step, turn).value

        closed = circle_edge_angle(center, radius, side, position, n).along(kappa)
        first = closed.first - jax.grad(value)(0.0)
        return jnp.stack([first, closed.second - jax.grad(jax.grad(value))(0.0)])

    rows = [errors(*map(jnp.asarray, case)) for case in CASES]
    return float(np.max(np.abs(np.stack(rows)[:, order - 1])))


def printed_tangent(x, d, r, dx):
    """The tangent of alpha + dalpha by the first fraction of (70)."""
    alpha = np.arctan(x / d)
    return (x + dx + r * np.sin(alpha) * dx) / (d + r * np.cos(alpha))


def _traced(x, d, r, dx):
    """Angle before and after a step, by bisection; the disc lies to the left of its tangent."""
    alpha = np.arctan(x / d)
    center = (-r * np.cos(alpha), d - r * np.sin(alpha))
    with mp.workdps(30):
        one, two = (
            touching_angle([mp.mpf(c) for c in center], mp.mpf(r), 1, [mp.mpf(p), mp.mpf(0)], 0)
            for p in (x, x + dx)
        )
        return float(one), float(two - one)


def true_tangent(x, d, r, dx):
    """The same by bisection."""
    alpha, turn = _traced(x, d, r, dx)
    return np.tan(alpha + turn)


def printed_side(x, d, r, dx):
    """Left side of (71) without d tan(alpha), per dx."""
    alpha = np.arctan(x / d)
    return d / np.cos(alpha) ** 2 + r * np.sin(alpha)


def true_side(x, d, r, dx):
    """What it stands for: tan(alpha + dalpha) times the height of the moved point, by bisection."""
    alpha, turn = _traced(x, d, r, dx)
    return (np.tan(alpha + turn) * (d + r * np.cos(alpha) * turn) - d * np.tan(alpha)) / dx


ALPHA = "firstorder.visibility.edge_angles.circle_edge_angle"
MEASURED = {
    "implements": ALPHA,
    "autodiff": Check(lambda: against_autodiff(1), 1e-13),
    "fourier": na("no spectrum"),
    "brute_force": Check(lambda: against_bisection(1), 1e-12),
}
ROWS = [
    Row(
        "R07.36",
        "identity",
        implements="firstorder.visibility.edge_angles.point_edge_angle",
        symbolic=lambda: [*first_derivative(), second_derivative()],
        autodiff=Check(lambda: max(against_autodiff(1), against_autodiff(2)), 1e-12),
        fourier=na("no spectrum"),
        brute_force=Check(lambda: max(against_bisection(1), against_bisection(2)), 1e-12),
        note="Right as printed with angles counter-clockwise from the normal; with R07's own 3D "
        "angle, towards +u, it changes its sign, (45). On a curved receiver - kappa. Ours: "
        "alpha_xx = -2 sin cos / D^2 + kappa sin / D - sgn r cos^2 / D^3 - kappa_x.",
    ),
    Row(
        "R07.70",
        "misprint",
        **MEASURED,
        symbolic=first_order_form,
        corrected="tan(alpha + dalpha) = (x + dx + r sin(alpha) dalpha) / "
        "(d + r cos(alpha) dalpha): the point of tangency slides by r dalpha",
        counterexample=Counterexample(
            {"x": 0.7, "d": 2.0, "r": 0.5, "dx": 1e-6}, printed=printed_tangent, true=true_tangent
        ),
        note="Units show it: r dx is an area. The first fraction, without a differential below, is "
        "wrong by a finite amount; the second errs in the point but, as that slides along the ray, "
        "not in the angle to first order. The conclusion, (36), is right.",
    ),
    Row(
        "R07.71",
        "misprint",
        **MEASURED,
        symbolic=first_order_form,
        corrected="d tan(alpha) + d sec^2(alpha) dalpha + r sin(alpha) dalpha = d tan(alpha) + dx "
        "+ r sin(alpha) dalpha",
        counterexample=Counterexample(
            {"x": 0.7, "d": 2.0, "r": 0.5, "dx": 1e-6}, printed=printed_side, true=true_side
        ),
        note="As printed it says d sec^2(alpha) = 1 for every blocker.",
    ),
]
