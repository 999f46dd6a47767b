"""Reflection from curved surfaces in space: R07 Appendix B and §5.1."""

from __future__ import annotations

import functools

import numpy as np

from derivations.imaging import _reflection_frames as frames
from derivations.imaging import _reflection_printed as printed
from derivations.imaging import _reflection_proofs as proofs
from derivations.imaging import _surfaces as our
from firstorder.checks.tolerance import normwise
from firstorder.ledger import Check, Counterexample, Row, na

MODULE = "firstorder.imaging._reflection"

# --- numeric: reflected light against autodiff and against differences ----------------------------


@functools.cache
def _reflected(through: str = "kernel"):
    """The library's reflection at the place, and autodiff of the value through the ellipsoid."""
    import jax
    import jax.numpy as jnp

    from firstorder.imaging._reflection import mirrored, reflected_radiance, surface_point
    from firstorder.laws import VonMisesFisher, Zonal

    x, axes, S, _, v = frames.arrays()
    lobe = Zonal(VonMisesFisher(our.SHARPNESS), 16, 32)

    def both(x, axes, S, v):
        B = reflected_radiance(
            frames.jax_light, surface_point(x, axes, S), v, lobe, through=through
        )

        def value(step, turn):
            y, frame = frames.jax_moved(step)
            eye = v + turn
            eye = eye / jnp.sqrt(eye @ eye)
            r = mirrored(eye, frame[:, 2])
            return lobe.value(lambda w: frames.jax_light(y, w), r)

        return B, B.spatial, B.angular, jax.jacfwd(value, (0, 1))(jnp.zeros(2), jnp.zeros(3))

    return jax.jit(both)(x, axes, S, v)


def reflected_autodiff(part: str, through: str = "kernel") -> float:
    """Gradient of reflected light against autodiff of the value."""
    _, spatial, angular, (along, over) = _reflected(through)
    return normwise(spatial, along) if part == "spatial" else normwise(angular, over)


def reflected_differences(part: str, through: str = "kernel") -> float:
    """The same against differences of sums over the sphere on the traced ellipsoid."""
    along, turns, over = our.truth()
    _, spatial, angular, _ = _reflected(through)
    return normwise(spatial, along) if part == "spatial" else normwise(turns @ angular, over)


@functools.cache
def _fixed_normal_differences() -> float:
    """(65): SV against differences of the sum with position alone moved."""
    n = our.AXES[:, 2]
    true = [
        our.slope(lambda s, i=i: our.glossy(our.PLACE + s * our.AXES[:, i], n, our.TO_EYE))
        for i in (0, 1)
    ]
    return normwise(_reflected()[0].SV, np.array(true))


@functools.cache
def _fixed_centre_autodiff() -> float:
    """(65), (67): SV and DV against autodiff of the convolution in position and centre."""
    import jax
    import jax.numpy as jnp

    from firstorder.imaging._reflection import mirrored
    from firstorder.laws import VonMisesFisher, Zonal

    x, axes, _, _, v = frames.arrays()
    lobe = Zonal(VonMisesFisher(our.SHARPNESS), 16, 32)

    def value(y, r):
        return lobe.value(lambda w: frames.jax_light(y, w), r / jnp.sqrt(r @ r))

    L_x, L_r = jax.jit(jax.grad(value, (0, 1)))(x, mirrored(v, axes[:, 2]))
    B = _reflected()[0]
    return max(normwise(B.SV, L_x @ axes[:, :2]), normwise(B.DV, L_r))


def _great_circle_differences() -> float:
    """(67): DV against differences of the sum along great circles of the lobe's centre."""
    n = our.AXES[:, 2]
    r = 2.0 * (n @ our.TO_EYE) * n - our.TO_EYE
    e1 = our.unit(np.cross(r, [0.5, 0.1, -0.4]))
    turns = np.stack([e1, np.cross(r, e1)])
    w, weights = our.sphere()
    L = our.light(our.PLACE, w)

    def at(e, s):
        return np.sum(weights * L * our.bell(w @ (r * np.cos(s) + e * np.sin(s))))

    true = [our.slope(lambda s, e=e: at(e, s)) for e in turns]
    return normwise(turns @ _reflected()[0].DV, np.array(true))


FLAT = na("no spectrum")
FRAME = {"implements": f"{MODULE}.in_frame", "fourier": FLAT}
NOTHING = dict.fromkeys(("symbolic", "autodiff", "fourier", "brute_force"), na("definition"))

ROWS = [
    Row("R07.56", "definition", implements=f"{MODULE}.in_frame", **NOTHING),
    Row(
        "R07.57",
        "identity",
        **FRAME,
        symbolic=proofs.rotated_tangents,
        autodiff=Check(lambda: frames.frame_autodiff("angular"), 1e-12),
        brute_force=Check(lambda: frames.frame_differences("angular"), 1e-10),
    ),
    Row("R07.58", "definition", implements=f"{MODULE}.in_frame", **NOTHING),
    Row(
        "R07.59",
        "identity",
        **FRAME,
        symbolic=proofs.splitting,
        autodiff=Check(lambda: frames.frame_autodiff("spatial"), 1e-12),
        brute_force=Check(lambda: frames.frame_differences("spatial"), 1e-10),
    ),
    Row(
        "R07.60",
        "misprint",
        implements=f"{MODULE}.turning_of_directions",
        symbolic=lambda: [*proofs.rotation_rate(), *proofs.general_rate()],
        autodiff=Check(lambda: frames.frame_autodiff("spatial"), 1e-12),
        fourier=FLAT,
        brute_force=Check(frames.principal_differences, 1e-10),
        corrected="R = (columns t, b, n), P = (columns n, 0, -t): local to global, as "
        "L_s(x, w) = L(x, R w) needs. With rows the curvature's term changes sign, against (10)",
        counterexample=Counterexample(
            {"radius": 2.0, "angle": 0.3}, printed=printed.printed_turn, true=printed.traced_turn
        ),
        note="kappa of S = -dn is right. R w and P w are orthogonal either way, so that check "
        "cannot tell. The frame is carried without twist: principal directions themselves turn "
        "about n along their lines (tests), and b is not constant there.",
    ),
    Row(
        "R07.61",
        "approximation",
        implements=f"{MODULE}.turning_of_directions",
        symbolic=na("measured"),
        autodiff=na("measured"),
        fourier=FLAT,
        brute_force=Check(frames.rotation_order, 0.05),
        note="The neglected part is of order alpha^2; exact as a derivative.",
    ),
    Row(
        "R07.62",
        "identity",
        implements=f"{MODULE}.turning_of_directions",
        symbolic=proofs.splitting,
        autodiff=Check(frames.principal_columns, 1e-13),
        fourier=FLAT,
        brute_force=Check(frames.principal_differences, 1e-10),
        note="With P's columns as in R07.60; where mu = 0 l has no direction, and mu L_l is 0.",
    ),
    Row(
        "R07.63",
        "identity",
        **FRAME,
        symbolic=lambda: [*proofs.splitting(), *proofs.tangents_are_not_orthogonal()],
        autodiff=Check(lambda: frames.frame_autodiff("spatial"), 1e-12),
        brute_force=Check(lambda: frames.frame_differences("spatial"), 1e-10),
        note="True with the l and m of (62), which are no orthonormal frame: R07.fn6. The library "
        "takes any t, b with the 2 x 2 shape operator.",
    ),
    Row(
        "R07.fn6",
        "identity",
        implements=f"{MODULE}.ReflectedRadiance",
        symbolic=proofs.tangents_are_not_orthogonal,
        autodiff=Check(lambda: reflected_autodiff("angular"), 1e-10),
        fourier=FLAT,
        brute_force=Check(lambda: reflected_differences("angular"), 1e-9),
        note="Of orthonormal tangents; the l and m of (63) are no such pair: R07.sBb. The "
        "library's angular gradient is a vector, and asks for no frame.",
    ),
    Row(
        "R07.sBb",
        "over-claim",
        implements=f"{MODULE}.ReflectedRadiance",
        symbolic=proofs.tangents_are_not_orthogonal,
        autodiff=Check(lambda: reflected_autodiff("angular"), 1e-10),
        fourier=FLAT,
        brute_force=Check(lambda: reflected_differences("angular"), 1e-9),
        corrected="l.m = w_1 w_2 / (mu_1 mu_2): the two are orthonormal only where one of the "
        "principal directions is across the ray; elsewhere the gradient needs their Gram matrix",
        counterexample=Counterexample(
            {"w_1": 0.5, "w_2": 0.6}, printed=printed.length_from_l_and_m, true=printed.steepest
        ),
        note="Printed and true are lengths of one angular gradient. (63) is right as it stands.",
    ),
    Row(
        "R07.sBa",
        "over-claim",
        implements=f"{MODULE}.half_turn",
        symbolic=proofs.half_turn_of_tangents,
        autodiff=Check(lambda: reflected_autodiff("angular"), 1e-10),
        fourier=FLAT,
        brute_force=Check(lambda: reflected_differences("angular"), 1e-9),
        corrected="L^m_u(w) = L^s_{Mu}(M w), M = 2 n n^T - I: a half turn. M u = -u only for "
        "u orthogonal to n; else -u is not even tangent at M w",
        counterexample=Counterexample(
            {"w_1": 0.5, "w_2": 0.3}, printed=printed.printed_mirror, true=printed.traced_mirror
        ),
        note="True by name if the tangents at M w are called -M u. In (theta, phi) nothing is "
        "negated: the half turn adds pi to phi.",
    ),
    Row("R07.64", "definition", implements=f"{MODULE}.reflected_radiance", **NOTHING),
    Row(
        "R07.65",
        "identity",
        implements=f"{MODULE}.reflected_radiance",
        symbolic=lambda: proofs.convolution_by_hand()[0],
        autodiff=Check(_fixed_centre_autodiff, 1e-10),
        fourier=FLAT,
        brute_force=Check(_fixed_normal_differences, 1e-10),
    ),
    Row("R07.66", "definition", implements=f"{MODULE}.reflected_radiance", **NOTHING),
    Row(
        "R07.67",
        "identity",
        implements=f"{MODULE}.reflected_radiance",
        symbolic=lambda: proofs.convolution_by_hand()[1],
        autodiff=Check(_fixed_centre_autodiff, 1e-10),
        fourier=FLAT,
        brute_force=Check(_great_circle_differences, 1e-9),
        note="rho' may be avoided by rotating the light: C.space.reflection, C.zonal.rotation.",
    ),
    Row(
        "C.space.reflection",
        "identity",
        implements=f"{MODULE}.reflected_radiance",
        symbolic=lambda: [
            *proofs.mirrored_direction_turns_twice(),
            proofs.convolution_by_hand()[2],
        ],
        autodiff=Check(
            lambda: max(reflected_autodiff("spatial", t) for t in ("kernel", "light")), 1e-10
        ),
        fourier=FLAT,
        brute_force=Check(
            lambda: max(reflected_differences("spatial", t) for t in ("kernel", "light")), 1e-9
        ),
        note="General tangents on an ellipsoid with a near light, a lobe of sharpness 7.",
    ),
    Row(
        "C.space.direct.gaussian",
        "over-claim",
        implements=f"{MODULE}.direct_extension",
        symbolic=proofs.mirrored_direction_turns_twice,
        autodiff=na("scale"),
        fourier=FLAT,
        brute_force=Check(
            lambda: max(printed.gaussian_under_rescaling(), printed.gaussian_extension_error()),
            1e-9,
        ),
        corrected="2 (n x dn) . ((w x grad_w L) (*) rho) for 2 n_x (L_theta (*) rho)",
        counterexample=Counterexample(
            {"radius": 2.0}, printed=printed.gaussian_on_a_ball, true=printed.traced_on_a_ball
        ),
        note="Relative to the truth it scales as 1/length, and on a ball its sign is wrong.",
    ),
    Row(
        "C.space.direct.mean",
        "approximation",
        implements=f"{MODULE}.direct_extension",
        symbolic=na("measured"),
        autodiff=na("measured"),
        fourier=FLAT,
        brute_force=Check(printed.roundness_order, 0.1),
        note="Along the normal its error is of first order in the difference of the curvatures.",
    ),
    Row(
        "C.space.direct.normal",
        "approximation",
        implements=f"{MODULE}.direct_extension",
        symbolic=na("measured"),
        autodiff=na("measured"),
        fourier=FLAT,
        brute_force=Check(printed.tilt_order, 0.1),
        note="Principal tangents: the error is of second order in the angle of the eye (mu = 1). "
        "In other tangents it loses the shape operator's off-diagonal.",
    ),
]
