"""Rotation by curvature: R07 §4.1 and §10 and D05 §4.1-4.2, §5.2, from the geometry of a normal.

D05 (11), D05 Table 1 and R07 (50) clash in one sign. Both papers define the local angle as the
global one minus the normal's, and turning the sense of angles turns that of the curvature with it:
the shear `Omega_x - k Omega_theta` is the same in every convention, and the plus of D05 (11) is a
misprint.
"""

from __future__ import annotations

import numpy as np
import sympy as sp

from derivations.squares import square_error
from derivations.transport.events import _rotation_numbers as numbers
from derivations.transport.events import _rotation_proofs as proofs
from derivations.transport.events._rotation_proofs import k, t, x
from firstorder.checks.tolerance import normwise
from firstorder.ledger import Check, Counterexample, Row, na

CURVATURE = "firstorder.transport.events.rotation.Curvature"
EQUATOR = "firstorder.transport.chain4d._equator"


def _squares(**routes) -> dict:
    """The usual three numeric routes of a step: squares of one case."""
    case, spectral = routes.pop("case"), routes.pop("spectral", True)
    return {
        "autodiff": Check(
            lambda: max(square_error(case, p) for p in ("gradient", "hessian")), 1e-10
        ),
        "fourier": Check(lambda: square_error(case, "spectrum"), 1e-9)
        if spectral
        else na("no spectrum"),
        "brute_force": Check(lambda: square_error(case, "value"), 1e-10),
        **routes,
    }


def _measured(check: Check) -> dict:
    """An approximation: measured by brute force alone."""
    return {
        "symbolic": na("measured"),
        "autodiff": na("no derivative"),
        "fourier": na("no spectrum"),
        "brute_force": check,
    }


def _order(measure, order: float) -> Check:
    """The fitted order of an error, within a tenth."""
    return Check(lambda: abs(measure() - order), 0.1)


ROWS = [
    Row(
        "R07.s4.1a",
        "approximation",
        implements=CURVATURE,
        **_measured(_order(numbers.normal_order, 2)),
        note="Second order in arc length, |x| << |k / k_x|. Counter-clockwise: k > 0 is a valley.",
    ),
    Row(
        "R07.s4.1b",
        "identity",
        CURVATURE,
        proofs.gradient_of_the_rotation,
        **_squares(case="curvature"),
    ),
    Row("R07.9", "definition", CURVATURE, proofs.inverse_transpose, **_squares(case="curvature")),
    Row(
        "R07.10",
        "identity",
        CURVATURE,
        proofs.gradient_of_the_rotation,
        **_squares(case="curvature"),
    ),
    Row(
        "R07.11",
        "identity",
        CURVATURE,
        proofs.gradient_of_the_rotation,
        **_squares(case="curvature"),
    ),
    Row(
        "R07.s4.1c",
        "identity",
        CURVATURE,
        lambda: (lambda L: L.subs(t, t + k * x).diff(x) - k * L.diff(t).subs(t, t + k * x))(
            sp.exp(sp.sin(t)) + t**3
        ),
        autodiff=Check(lambda: numbers.rotated_ridge("autodiff"), 1e-10),
        fourier=na("no spectrum"),
        brute_force=Check(lambda: numbers.rotated_ridge("differences"), 1e-10),
    ),
    Row(
        "R07.s4.1d",
        "identity",
        CURVATURE,
        lambda: [e.subs(k, 0) for e in proofs.gradient_of_the_rotation()],
        autodiff=Check(lambda: numbers.flat("jets"), 1e-14),
        fourier=Check(lambda: numbers.flat("spectrum"), 1e-14),
        brute_force=na("two routes"),
    ),
    Row(
        "R07.s4.1e",
        "approximation",
        CURVATURE,
        symbolic=na("scale"),
        autodiff=Check(numbers.balance, 1e-12),
        fourier=na("no spectrum"),
        brute_force=na("scale"),
        note="Where |L_x| = |k L_theta| the parts are equal, by (11); nothing is said about signs.",
    ),
    Row(
        "R07.17",
        "identity",
        CURVATURE,
        lambda: proofs.gradient_of_the_rotation(-1),
        **_squares(case="curvature back"),
    ),
    Row(
        "R07.50",
        "identity",
        CURVATURE,
        lambda: [*proofs.exponent_of_the_rotation(), *proofs.either_sense_of_angles()],
        autodiff=na("spectral"),
        fourier=Check(lambda: square_error("curvature", "spectrum"), 1e-9),
        brute_force=Check(numbers.shear_error, 1e-10),
        note="The minus holds in every convention: see D05.11.",
    ),
    Row(
        "R07.s10a",
        "identity",
        "firstorder.laws.move.Move.spectrum",
        proofs.inverse_transpose,
        autodiff=na("no derivative"),
        fourier=Check(lambda: square_error("curvature", "spectrum"), 1e-9),
        brute_force=Check(
            lambda: normwise(np.linalg.inv([[1, 0], [0.7, 1]]).T, np.array([[1, -0.7], [0, 1]])),
            1e-15,
        ),
    ),
    Row(
        "R07.s10b",
        "over-claim",
        CURVATURE,
        proofs.either_sense_of_angles,
        autodiff=na("spectral"),
        fourier=Check(lambda: square_error("curvature", "spectrum"), 1e-9),
        brute_force=Check(numbers.shear_error, 1e-10),
        corrected="Omega_x - k Omega_theta in both conventions; the plus of D05 (11) is wrong.",
        counterexample=numbers.SIGN,
        note="Both have theta' = theta - k x; (theta, k) -> (-theta, -k) turns Omega_theta too.",
    ),
    Row(
        "R07.s10c",
        "identity",
        CURVATURE,
        lambda: [*proofs.gradient_of_the_rotation(), *proofs.exponent_of_the_rotation()],
        **_squares(case="curvature"),
    ),
    Row(
        "D05.s4.1b",
        "approximation",
        implements=CURVATURE,
        **_measured(_order(numbers.normal_order, 2)),
        note="Second order in arc length. D05's angles grow towards +x, so its k > 0 is a bump.",
    ),
    Row(
        "D05.11",
        "misprint",
        CURVATURE,
        lambda: [*proofs.exponent_of_the_rotation(), *proofs.either_sense_of_angles()],
        autodiff=na("spectral"),
        fourier=Check(lambda: square_error("curvature", "spectrum"), 1e-9),
        brute_force=Check(numbers.shear_error, 1e-10),
        corrected="lhat_i'(Omega_x, Omega_theta) = lhat_i(Omega_x - k Omega_theta, Omega_theta)",
        counterexample=numbers.SIGN,
        note="From the text's own theta' = theta - k x. Table 1, §6.1 and §6.2 have the minus.",
    ),
    Row(
        "D05.T1.5",
        "identity",
        CURVATURE,
        proofs.exponent_of_the_rotation,
        autodiff=na("spectral"),
        fourier=Check(lambda: square_error("curvature", "spectrum"), 1e-9),
        brute_force=Check(numbers.shear_error, 1e-10),
    ),
    Row(
        "D05.s4.1g",
        "identity",
        CURVATURE,
        proofs.spectrum_exponent_of_the_way_back,
        autodiff=Check(lambda: numbers.doubling_errors()[0], 1e-12),
        fourier=Check(lambda: numbers.doubling_errors()[1], 1e-12),
        brute_force=Check(numbers.doubling_by_tracing, 1e-14),
        note="To-local, mirror and back are one move [[1, 0], [2 k, -1]]: R07 (24)'s transpose.",
    ),
    Row(
        "D05.s4.2a",
        "identity",
        CURVATURE,
        proofs.directional_bandwidth,
        autodiff=na("spectral"),
        fourier=Check(lambda: numbers.directional_spread("samples"), 1e-9),
        brute_force=Check(lambda: numbers.directional_spread("rule"), 1e-12),
        note="At the surface; travel afterwards turns spatial into angular frequency.",
    ),
    Row(
        "D05.s4.2b",
        "identity",
        "firstorder.transport.events.incidence.Outgoing",
        proofs.scale_of_step_seven,
        autodiff=Check(lambda: numbers.grazing("jets"), 1e-10),
        fourier=Check(lambda: numbers.grazing("covariance"), 1e-12),
        brute_force=na("two routes"),
        note="With the corrected (10): the printed one would reduce the shear.",
    ),
    Row(
        "D05.s4.2c",
        "approximation",
        CURVATURE,
        proofs.focus_of_a_parallel_beam,
        autodiff=na("no derivative"),
        fourier=Check(numbers.focus_error, 1e-9),
        brute_force=_order(numbers.aberration_order, 2),
        note="Exact for n = k x (a beam of 0.2 by 0.01 rad is narrowest 1e-3 before 1 / (2 |k|)); "
        "a circular mirror of radius R misses it by b^2 R / 4 at the aperture b: second order, "
        "1% of the focal length for b < 0.14. Negative k is D05's valley.",
    ),
    Row(
        "D05.19",
        "approximation",
        implements=CURVATURE,
        **_measured(_order(numbers.surface_normal_order, 2)),
        note="A linear map, M = -(shape operator) with angles towards +x and +y, second order in "
        "the distance; its form is bilinear.",
    ),
    Row(
        "D05.s5.2a",
        "misprint",
        f"{EQUATOR}.equator_direction",
        numbers.latitude_distortion,
        autodiff=Check(numbers.distortion_by_autodiff, 1e-14),
        fourier=na("no spectrum"),
        brute_force=Check(
            lambda: abs(numbers.azimuth_speed(0.5 * np.pi - 0.3) - np.cos(0.3)), 1e-9
        ),
        corrected="phi in [-pi/2, pi/2] is the latitude; a colatitude has the distortion sin(phi).",
        counterexample=Counterexample(
            {"phi": 0.3}, lambda phi: float(np.cos(phi)), numbers.azimuth_speed
        ),
        note="The counterexample reads phi as the colatitude that the text calls it.",
    ),
    Row(
        "D05.s5.2b",
        "approximation",
        implements=f"{EQUATOR}.Turn",
        **_measured(_order(numbers.rotation_order, 3)),
        note="Third order in the angular distance from the axis: 0.2 degrees at 10.",
    ),
]
