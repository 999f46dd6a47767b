"""The split circle (J12 §4.5): what its error bounds, and what it does not.

The proofs start from light on a circle. Coordinates: the record at the origin, normal +y, J12's
angles towards +x; the circle's point at the angle beta is `R (sin beta, cos beta)`.
"""

from __future__ import annotations

import numpy as np
import sympy as sp

from firstorder.ledger import Check, Counterexample, Row, na

R, dx, a, b = sp.symbols("R dx a b", positive=True)
beta, theta, delta, u = sp.symbols("beta theta delta u", real=True)


def moved_and_turned():
    """E where the half circle beta > beta_s = 0 is bright, after a step and a turn to the light."""
    start = sp.Integer(0)  # the split, seen from the origin
    edge = sp.atan((R * sp.sin(start) - dx) / (R * sp.cos(start)))
    # Turning by b towards the light lowers every angle by b; light goes on below the old horizon.
    E = sp.integrate(sp.cos(theta), (theta, edge - b, sp.pi / 2))
    change = sp.simplify(E - 1)
    exact = sp.sin(sp.atan(dx / R) + b)
    return [
        sp.simplify(sp.expand_trig(change - exact)),
        sp.simplify(change.subs(b, 0) - dx / sp.sqrt(R**2 + dx**2)),
        # To first order it is the printed error.
        sp.diff(exact, dx).subs({dx: 0, b: 0}) - 1 / R,
        sp.diff(exact, b).subs({dx: 0, b: 0}) - 1,
    ]


def bounded_by_the_print():
    """The gap tan a + sin b - sin(a + b) is a sum of terms not negative for acute a and b."""
    gap = sp.tan(a) + sp.sin(b) - sp.sin(a + b)
    parts = sp.sin(a) * (1 - sp.cos(a) * sp.cos(b)) / sp.cos(a) + sp.sin(b) * (1 - sp.cos(a))
    return sp.simplify(sp.expand_trig(gap - parts))


def seen_sine():
    """Sine of the angle at which the circle's point is seen after a step, u = sin(beta)."""
    x, y = R * u - dx, R * sp.sqrt(1 - u**2)
    return x / sp.sqrt(sp.expand(x**2 + y**2))


def painted_circle():
    """First derivatives of E = int L d(sine), for light L painted on the circle.

    The kernels are `sin 2 beta / R` for the step and `sin beta` for the turn; where L lies between
    0 and 1 their largest integrals are those of the split circle.
    """
    motion = sp.diff(seen_sine(), dx).subs(dx, 0).subs(u, sp.sin(beta))
    # E = int L d(sine): its derivative pairs L with the derivative of the motion.
    kernel = sp.simplify(sp.diff(motion.subs(sp.sqrt(1 - sp.sin(beta) ** 2), sp.cos(beta)), beta))
    turning = sp.diff(sp.cos(beta - b), b).subs(b, 0)
    quarter = (beta, 0, sp.pi / 2)
    return [
        sp.simplify(kernel - sp.sin(2 * beta) / R),
        sp.integrate(kernel, quarter) - 1 / R,
        sp.simplify(turning - sp.sin(beta)),
        sp.integrate(turning, quarter) - 1,
        # As a share of E = int L cos(beta): no more than the largest ratio of the kernels.
        sp.simplify(sp.expand_trig(kernel) / sp.cos(beta) - 2 * sp.sin(beta) / R),
        sp.simplify(turning / sp.cos(beta) - sp.tan(beta)),
    ]


def exceeded_in_third_order():
    """The whole light right of u = 3 delta / 4 gains `delta + delta^3 / 16`: more than delta."""
    # R = 1; what lies right of u has the irradiance 1 - u before the step.
    after = 1 - seen_sine().subs({R: 1, dx: delta})
    gain = (after - (1 - u)).subs(u, sp.Rational(3, 4) * delta)
    return sp.series(gain, delta, 0, 4).removeO() - delta - delta**3 / 16


# --- numbers, by summing small pieces of light ---------------------------------------------------


def painted_irradiance(position, turn, R, bright, pieces=40000):
    """E from light of radiance 1 on the arcs of a circle where `bright(beta)`; midpoint rule."""
    angle = np.pi * (2.0 * (np.arange(pieces) + 0.5) / pieces - 1.0)
    point = R * np.stack([np.sin(angle), np.cos(angle)])
    way = point - np.array([[position], [0.0]])
    r = np.hypot(*way)
    normal = np.array([np.sin(turn), np.cos(turn)])
    facing = np.maximum(normal @ way / r, 0.0)
    inward = np.abs(np.sum(way * point, axis=0)) / (r * R)
    return float(np.sum(bright(angle) * facing * inward / r) * R * 2.0 * np.pi / pieces)


def _split(angle):
    return angle > 0.0


def change_error() -> float:
    """Largest error of `split_change` against summed light."""
    from firstorder.caching import split_change

    worst = 0.0
    for step, turn in ((0.3, 0.0), (0.0, 0.7), (0.4, 0.5), (0.8, 0.2), (0.05, 1.4)):
        true = painted_irradiance(1.7 * step, turn, 1.7, _split) - 1.0
        worst = max(worst, abs(float(split_change(1.7 * step, 1.7, turn)) - true))
    return worst


def first_order_error() -> float:
    """The printed error and the true change have the same slopes at the record."""
    import jax

    from firstorder.caching import split_change, split_error

    worst = 0.0
    for which in (0, 2):
        at = [1e-9, 1.7, 1e-9]
        slopes = [jax.grad(f, which)(*at) for f in (split_error, split_change)]
        worst = max(worst, abs(float(slopes[0] - slopes[1])))
    return worst


def largest_excess() -> float:
    """How far the change in the split circle comes above the printed error, at most; 0 if never."""
    from firstorder.caching import split_change, split_error

    rng = np.random.default_rng(5)
    step, turn = rng.uniform(-1.0, 1.0, 20000), rng.uniform(-np.pi, np.pi, 20000)
    excess = np.asarray(split_change(step, 1.0, turn)) - np.asarray(split_error(step, 1.0, turn))
    return max(0.0, float(np.max(excess)))


def share_near_the_horizon(dx, beta, width):
    """Relative change of E, by summed light, for a small light on the circle of radius 1."""

    def bright(angle):
        return np.abs(angle - beta) < 0.5 * width

    before, after = (painted_irradiance(at, 0.0, 1.0, bright) for at in (0.0, dx))
    return after / before - 1.0


ROWS = [
    Row(
        "J12.34",
        "over-claim",
        implements="firstorder.caching.split_error",
        symbolic=lambda: [
            *moved_and_turned(),
            bounded_by_the_print(),
            *painted_circle(),
            exceeded_in_third_order(),
        ],
        autodiff=Check(first_order_error, 1e-8),
        fourier=na("no spectrum"),
        brute_force=Check(lambda: max(change_error(), largest_excess()), 1e-6),
        corrected=(
            "eps = |dx|/R + sin(min(|dn|, pi/2)) bounds the change in the split circle itself, "
            "sin(atan(|dx|/R) + |dn|), where E = 1. Of light 0 <= L <= 1 on that circle it is the "
            "first order, |E'| <= 1/R and |dE/dn| <= 1; as a share of E that may be 2/R per metre "
            "and tan(beta) per radian. Among things at R or farther there is no bound."
        ),
        counterexample=Counterexample(
            {"dx": 0.05, "beta": 1.4, "width": 0.02},
            # Printed, the expected change of E, which is 1 at the record: a share.
            printed=lambda dx, beta, width: dx,
            true=share_near_the_horizon,
        ),
        note="Said to be a conservative upper bound on the error. A small light near the horizon.",
    ),
]
