"""The cosine term: D05 §4.1 step 3 and §6.1, from the shading integral and the Fourier integral."""

from __future__ import annotations

import sympy as sp

from derivations.fields import spectrum
from derivations.squares import square_error
from derivations.transport.events import _cosine_numbers as numbers
from derivations.transport.events import _cosine_proofs as proofs
from derivations.transport.events._cosine_proofs import o2, w
from firstorder.ledger import Check, Counterexample, Row, na

COSINE = "firstorder.transport.events.cosine.ClampedCosine"
TRANSFORM = "firstorder.transport.events.cosine.clamped_cosine_transform"


_SQUARES = {
    "autodiff": Check(
        lambda: max(square_error("cosine", p) for p in ("gradient", "hessian")), 1e-10
    ),
    # The light straddles the horizon: samples miss the kink by h^2 / 12, h = 10 / 2048.
    "fourier": Check(lambda: square_error("cosine", "spectrum"), 2e-6),
    "brute_force": Check(lambda: square_error("cosine", "value"), 1e-10),
}

ROWS = [
    Row(
        "D05.8",
        "definition",
        "firstorder.transport.events.reflection.Reflection",
        symbolic=na("definition"),
        autodiff=Check(numbers.cosine_gradient_error, 1e-10),
        fourier=na("no spectrum"),
        brute_force=Check(numbers.shading_error, 1e-10),
        note="The path of events against adaptive quadrature of the shading integral.",
    ),
    Row("D05.s4.1c", "identity", COSINE, proofs.product_at_each_point, **_SQUARES),
    Row(
        "D05.12",
        "identity",
        COSINE,
        lambda: [proofs.convolution_over_angle(), *proofs.transform_of_the_cosine()],
        **_SQUARES,
    ),
    Row(
        "D05.T1.6",
        "identity",
        COSINE,
        proofs.convolution_over_angle,
        **_SQUARES,
        note="With the Dirac in Omega_x of (12), which the table leaves out.",
    ),
    Row(
        "D05.13",
        "misprint",
        TRANSFORM,
        proofs.transform_of_the_cosine,
        autodiff=Check(numbers.transform_derivative, 1e-10),
        fourier=Check(numbers.transform_by_samples, 1.0),
        brute_force=Check(numbers.transform_error, 1e-12),
        corrected="2 cos(pi^2 W) / (1 - (2 pi W)^2), and pi/2 at W = 1 / (2 pi)",
        counterexample=Counterexample(
            {"Omega_theta": 0.3}, numbers.printed_transform, numbers.transform_by_quadrature
        ),
        note="Read as printed in the extraction, cos(pi/2 W): it has a pole at W = 1 / (2 pi). The "
        "denominator is in cycles, the cosine in radians. Fourier: error in units of the grid's.",
    ),
    Row(
        "D05.fn1",
        "approximation",
        TRANSFORM,
        symbolic=spectrum.fall_of_a_broken_power,
        autodiff=na("no derivative"),
        fourier=Check(lambda: max(numbers.falloff_error(), numbers.kinks_alone_error()), 0.05),
        brute_force=Check(spectrum.fitted_fall, 0.02),
        note="Powers fitted on cos^n cut at the horizon, n = 0, 1, 2, for W in [10, 80]: an "
        "asymptotic statement, about the envelope.",
    ),
    Row(
        "D05.s4.1d",
        "approximation",
        TRANSFORM,
        symbolic=lambda: sp.limit(
            (w**2 * 2 / (1 - w**2)) + 2, w, sp.oo
        ),  # the envelope tends to -2 cos(pi w / 2) / w^2
        autodiff=na("no derivative"),
        fourier=Check(lambda: abs(numbers.falloff(1) + 2.0), 0.05),
        brute_force=Check(lambda: 1.0 - numbers.low_energy(0.32), 0.04),
        note="97% of its energy lies below 1 / pi cycles per radian.",
    ),
    Row(
        "D05.s6.1a",
        "misprint",
        TRANSFORM,
        proofs.outer_product,
        autodiff=na("spectral"),
        fourier=Check(lambda: numbers.outer_product_error(0.0), 1e-9),
        brute_force=Check(lambda: numbers.outer_product_error(0.3), 1e-9),
        corrected="dEhat'(W_x, W_theta) = lhat_i(0, W_x/k) coshat+(W_x/k - W_theta) / |k|, k != 0",
        counterexample=Counterexample(
            {"k": 0.6, "Omega_x": 0.1, "Omega_theta": 0.3},
            numbers.printed_outer_product,
            numbers.distant_spectrum,
        ),
        note="dx = ds / |k| along the line of slope k.",
    ),
    Row(
        "D05.s6.1b",
        "misprint",
        TRANSFORM,
        lambda: [e.subs(o2, 0) for e in proofs.outer_product()],
        autodiff=na("spectral"),
        fourier=Check(lambda: numbers.outer_product_error(0.0), 1e-9),
        brute_force=Check(numbers.irradiance_is_a_convolution, 1e-9),
        corrected="Ehat(W_x) = lhat_i(0, W_x/k) coshat+(W_x/k) / |k|: E(x) = (l (*) cos+)(k x)",
        counterexample=Counterexample(
            {"k": 0.6, "Omega_x": 0.1, "Omega_theta": 0.0},
            numbers.printed_outer_product,
            numbers.distant_spectrum,
        ),
    ),
    Row(
        "D05.s6.1c",
        "identity",
        "firstorder.transport.events.rotation.Curvature",
        proofs.line_of_distant_light,
        autodiff=na("spectral"),
        fourier=Check(numbers.line_error, 1e-3),
        brute_force=Check(lambda: square_error("curvature", "value"), 1e-10),
        note="Stated error: the light is 40 m wide instead of infinitely distant. Needs the minus "
        "of Table 1; with the plus of (11) the line would be -k Omega_theta = Omega_x.",
    ),
    Row(
        "D05.s6.1d",
        "identity",
        "firstorder.transport.events.occlusion.Occlusion",
        proofs.soft_shadow,
        autodiff=na("no derivative"),
        fourier=Check(lambda: numbers.shadow_error("spectrum"), 1e-9),
        brute_force=Check(
            lambda: max(numbers.shadow_error("image"), numbers.shadow_by_events()), 1e-9
        ),
        note="Emitter magnified by -d2/d1, blocker by (d1 + d2)/d1.",
    ),
    Row(
        "R07.s4.1f",
        "over-claim",
        COSINE,
        proofs.with_the_cosine_inside,
        autodiff=Check(numbers.cosine_gradient_error, 1e-10),
        fourier=na("no spectrum"),
        brute_force=Check(
            lambda: abs(numbers.differenced(0.5, 0.3, 0.4) - numbers.gradient(0.5, 0.3, 0.4)), 1e-5
        ),
        corrected="B_x = (L_x c) (x) rho + 2 n_x (L_theta c) (x) rho - n_x (L s) (x) rho with "
        "c, s = cos, sin(w - n)",
        counterexample=Counterexample(
            {"kappa": 0.5, "place": 0.3, "out": 0.9}, numbers.absorbed, numbers.differenced
        ),
        note="The cosine depends on the incoming angle, not on a difference. What (25) lacks "
        "is small for narrow lobes near normal incidence. Brute force: differences of h = 1e-3.",
    ),
]
