"""Edge angles in vertical slices: R07 (38)-(49), (72) and footnote 4, and second derivatives.

The start is geometry. A receiver at q sees along `w(alpha)` in the slice at azimuth phi. A smooth
blocker is the set F <= 0 of any function F: the edge is where the least F along the ray is zero. An
edge in space is a curve: the edge angle is that of the point where it meets the slice.
"""

from __future__ import annotations

from derivations.visibility import _elevation_checks as checks
from derivations.visibility import _elevation_proofs as proofs
from firstorder.ledger import Check, Row, na

ELEVATION = "firstorder.visibility.elevation"
NONE = {"fourier": na("no spectrum")}


def _pair(kind, *parts):
    """The two numeric routes for one rate or more, relative to their size."""
    return {
        "autodiff": Check(lambda: max(checks.against_autodiff(kind, p) for p in parts), 1e-11),
        "brute_force": Check(lambda: max(checks.against_bisection(kind, p) for p in parts), 1e-11),
    } | NONE


ROWS = [
    Row(
        "R07.38",
        "definition",
        implements=f"{ELEVATION}.contour_elevation",
        symbolic=na("definition"),
        autodiff=na("no derivative"),
        brute_force=Check(checks.traced_visibility, 0.0),
        **NONE,
        note="One angle for each azimuth. A silhouette that runs along a meridian has none: "
        "R07.48. theta is the polar angle: R07.s7.1a.",
    ),
    Row(
        "R07.39",
        "identity",
        implements=f"{ELEVATION}.Elevation",
        symbolic=proofs.step_derivative,
        autodiff=Check(lambda: checks.weighed("autodiff"), 1e-12),
        brute_force=Check(lambda: checks.weighed("brute"), 1e-12),
        **NONE,
        note="In the sense of distributions, and of the steps of (38): upright edges, which step "
        "in phi, have a delta there and not in theta (R07.48).",
    ),
    Row(
        "R07.40",
        "identity",
        implements=f"{ELEVATION}.Elevation.alpha_x",
        symbolic=proofs.chain,
        **_pair("both", "x"),
    ),
    Row(
        "R07.41",
        "identity",
        implements=f"{ELEVATION}.Elevation.alpha_y",
        symbolic=proofs.chain,
        **_pair("both", "y"),
        note="alpha_y = alpha_u sin(phi) + alpha_v cos(phi).",
    ),
    Row(
        "R07.42",
        "identity",
        implements=f"{ELEVATION}.contour_elevation",
        symbolic=proofs.motion,
        autodiff=Check(lambda: checks.motion_error("autodiff", False), 1e-12),
        brute_force=Check(lambda: checks.motion_error("brute", False), 1e-12),
        **NONE,
    ),
    Row(
        "R07.43",
        "identity",
        implements=f"{ELEVATION}.contour_elevation",
        symbolic=proofs.stays_in_the_plane,
        autodiff=Check(lambda: checks.motion_error("autodiff", True), 1e-12),
        brute_force=Check(lambda: checks.motion_error("brute", True), 1e-12),
        **NONE,
    ),
    Row(
        "R07.44",
        "identity",
        implements=f"{ELEVATION}.contour_elevation",
        symbolic=proofs.tangent_plane,
        autodiff=Check(lambda: checks.along_any("autodiff"), 1e-12),
        brute_force=Check(lambda: checks.along_any("brute"), 1e-12),
        **NONE,
        note="Derived without the tangent plane, from the least value along the ray of any "
        "function with the blocker's surface for a zero set; its curvature drops out. On a "
        "receiver that bends, m becomes m + omega x p.",
    ),
    Row(
        "R07.45",
        "identity",
        implements=f"{ELEVATION}.contour_elevation",
        symbolic=proofs.tangent_plane,
        **_pair("both", "u"),
        note="The sign is the opposite of (36)'s because the angle grows towards +u.",
    ),
    Row(
        "R07.46",
        "identity",
        implements=f"{ELEVATION}.contour_elevation",
        symbolic=lambda: [*proofs.tangent_plane(), proofs.second_of_a_limb()],
        **_pair("limb", "v", "bend"),
        note="Ours: the second derivatives, -(q_i . H q_j - s_i s_j / (w . H w)) / (D c . n) with "
        "H = dn, q_i = m_i + alpha_i D c, s_i = w . H q_i + (n . c) alpha_i.",
    ),
    Row(
        "R07.72",
        "identity",
        implements=f"{ELEVATION}.crease_elevation",
        symbolic=lambda: [*proofs.straight_edge(), proofs.second_of_a_rim()],
        **_pair("rim", "v", "bend"),
        note="k need not be across the ray. Ours: the second derivatives, for bent edges too.",
    ),
    Row(
        "R07.sDa",
        "identity",
        implements=f"{ELEVATION}.crease_elevation",
        symbolic=proofs.reduces,
        autodiff=na("one route"),
        brute_force=Check(checks.same_number, 1e-8),
        **NONE,
        note="For n = k x w of any length, so for every k in the tangent plane, not only for the "
        "one that is orthogonal to w. With n = -k x w both signs change and the ratio does not.",
    ),
    Row(
        "R07.fn4",
        "approximation",
        implements=f"{ELEVATION}.contour_elevation",
        symbolic=proofs.grazing,
        autodiff=na("one route"),
        brute_force=Check(lambda: max(checks.grazing_order(), checks.grazing_value()), 1e-3),
        **NONE,
        note="Exponent -1/2, fitted to 1e-3 over phi0 - phi from 1e-9 to 1e-6 on a ball; it asks "
        "for a limb that bends where the slice grazes it. A flat one gives an exponent nearer to "
        "-1, still integrable; a corner gives none.",
    ),
]
