"""What the stratified Hessian lacks at shadow edges: J12 (51), in the paper's angles."""

from __future__ import annotations

import sympy as sp

from derivations.flatland.estimators._measured import (
    corrected_error,
    limbs_moved,
    mended_sum,
    printed_limit,
    truth,
)
from derivations.flatland.estimators.irradiance_forms import uncovered
from firstorder.ledger import Check, Counterexample, Row, na

R = sp.symbols("R", positive=True)


def sliding():
    """Second motion of a limb: `-3 cos^2 sin / r^2 - R cos^3 / r^3` with the disc towards +x.

    The tangent of length t, the radius R and D, the way to the centre, make a right angle; all is
    rational in t, R and the sine and cosine of the limb's angle, whose rate is proved first.
    """
    t = sp.symbols("t", positive=True)
    s, c = sp.symbols("s c", real=True)
    D = sp.sqrt(t**2 + R**2)
    s_centre, c_centre = (t * s + R * c) / D, (t * c - R * s) / D
    # theta = theta_c - asin(R / D); d theta_c = -cos_c / D, d D = -sin_c per step of x.
    rate = -c_centre / D + R / (D * t) * -s_centre
    t_rate = D * -s_centre / t  # t^2 = D^2 - R^2
    theta_rate = -c / t
    second = 2 * c * s * theta_rate / t + c**2 * t_rate / t**2  # of -c^2 / t
    wanted = -3 * c**2 * s / t**2 - R * c**3 / t**3
    return sp.simplify(rate - theta_rate), sp.simplify(second - wanted)


ROWS = [
    Row(
        "J12.51",
        "over-claim",
        implements="firstorder.flatland.estimators.corrected.corrected_estimate",
        fourier=na("no spectrum"),
        symbolic=lambda: [*sliding(), uncovered()[1]],
        autodiff=Check(limbs_moved, 1e-12),
        brute_force=Check(lambda: max(mended_sum(), corrected_error()), 1e-5),
        corrected="plus, at each edge, (L_f - L_b) R cos^3 / r_f^3 before a curved blocker of "
        "radius R and -+ dL_b/dtheta cos^3 (1/r_f - 1/r_b)^2 before a background that varies "
        "(minus if it lies towards greater theta)",
        counterexample=Counterexample(
            {"x": 0.35}, printed=printed_limit, true=lambda x: float(truth("disc")[2][0, 0])
        ),
        note="Said to account for occlusions; its limit takes each shadow edge for a fixed point.",
    ),
]
