"""The terms of the gradient of reflected light, and when they matter: R07 §5.1-5.2, Figure 4."""

from __future__ import annotations

import functools

import jax
import jax.numpy as jnp
import numpy as np

from derivations.transport.shading import _term_proofs as proofs
from derivations.transport.shading._shading import (
    BRUTE,
    LIGHT,
    MODULE,
    RAYS,
    SCENES,
    autodiff,
    bell,
    bent,
    brute,
    complex_step,
    dense,
    distant_entries,
    flatless,
    fourier,
    irradiance,
    measured,
    near,
    normal,
    slope_w,
    slope_x,
    two,
)
from derivations.transport.shading.surface import gradient
from firstorder.checks.tolerance import fitted_order, normwise
from firstorder.conventions import SPACE
from firstorder.fields import Affine, Function, Gaussian, GaussianProfile
from firstorder.laws import Move
from firstorder.ledger import Check, Counterexample, Row, na
from firstorder.transport import Curvature, Mirror, Reflection
from firstorder.transport.brdf.lobes import glossy, lambert
from firstorder.transport.shading._flat_jets import FlatlandLight
from firstorder.transport.shading.surface import Surface

TURNS = np.linspace(0.3, 6.0, 7)
CENTRE = np.array([0.2, -0.1, 0.3, 0.1])
PRECISION = np.array(
    [[2.0, 0.5, -0.4, 0.2], [0.5, 1.0, 0.1, 0.3], [-0.4, 0.1, 1.5, 0.0], [0.2, 0.3, 0.0, 1.2]]
)
SEEN = np.array([0.5, 0.4, -0.2, 0.3])  # a ray, in the axes that are not turned


def _in_turned_axes(t):
    """A light field of space with (x, y) and (v, w) in axes turned by t, and the ray in them."""
    R = np.array([[np.cos(t), -np.sin(t)], [np.sin(t), np.cos(t)]])
    M = np.kron(np.eye(2), R)
    return Move(M)(Gaussian(CENTRE, PRECISION, frame=SPACE)), jnp.asarray(M.T @ SEEN)


def gradient_in_turned_axes(of) -> float:
    """Length of the spatial gradient in turned axes, against steps along the axes as they were."""
    h = 1e-30j  # a complex step of the plain formula: no digit is lost
    steps = [SEEN - CENTRE + h * e for e in np.eye(4)[:2]]
    true = np.hypot(*[np.exp(-0.5 * d @ PRECISION @ d).imag / h.imag for d in steps])
    lengths = [np.hypot(*np.asarray(of(*_in_turned_axes(t)))[:2]) for t in TURNS]
    return normwise(np.array(lengths), np.full(TURNS.size, true))


# --- over-claims: printed, and true by brute force ---------------------------------------------


def printed_lambertian(x, theta):
    """B_x of a diffuse surface by (25): 2 n_x."""
    del theta
    k = bent(x)[1]
    SV = irradiance(x, L=lambda x_, w: slope_x(bell, x_, w))
    DV = irradiance(x, L=lambda x_, w: slope_w(bell, x_, w))
    return float(SV + 2.0 * k * DV)


def shape_operator_error() -> float:
    """The rotation by a matrix of curvatures, across and along a cylinder, against `cylinder`."""
    S = jnp.diag(jnp.array([0.5, 0.0]))
    lobe = GaussianProfile(0.2, frame=SPACE.turned())
    path = Curvature(S) >> Mirror() >> Reflection(lobe) >> Curvature(S, back=True)
    B = path(Function(lambda x, y, a, b: jnp.exp(-(a**2)) + 0.0 * (x + y + b), SPACE))
    found = jax.jit(lambda u: B.jet(u).gradient[:2])(jnp.array([0.0, 0.0, 0.2, 0.0]))
    return normwise(found, np.array([cylinder(0.5, 0.2), 0.0]))


def cylinder(kappa, theta):
    """B_x across a cylinder under distant light, traced in its cross-section."""
    f = functools.partial(dense, L=lambda x, w: np.exp(-(w**2)) + 0.0 * x, n=lambda x: kappa * x)
    return float(complex_step(f, 0.0, theta)[0])


# --- approximations: fitted orders -------------------------------------------------------------


def overcast_order():
    """B_x is of first order in the contrast of the sky, at fixed curvature."""

    def size(contrast):
        f = functools.partial(dense, L=lambda x, w: 1.0 + contrast * np.sin(w) + 0.0 * x)
        return abs(complex_step(f, 0.3, 0.1)[0])

    e = np.array([0.2, 0.1, 0.05])
    return abs(fitted_order(e, [size(c) for c in e]) - 1.0)


def near_order():
    """SV grows as 1 / d for light of a given angular pattern."""

    def size(d):
        f = functools.partial(
            dense, L=lambda x, w: np.exp(-((x / d - np.tan(w) + 0.4) ** 2)), n=lambda x: 0.0 * x
        )
        return abs(complex_step(f, 0.0, 0.1)[0])

    d = np.array([1.0, 2.0, 4.0])
    return abs(fitted_order(d, [size(c) for c in d]) + 1.0)


def bump_order():
    """The error of `B_x = CDV` falls as the inverse of the curvature."""

    def miss(kappa):
        f = functools.partial(dense, L=near(3.0), n=lambda x: kappa * x)
        B_x, B_theta = complex_step(f, 0.0, 0.3)
        return abs(B_x + 2.0 * kappa * B_theta) / abs(B_x)

    k = np.array([20.0, 40.0, 80.0])
    return abs(fitted_order(k, [miss(c) for c in k]) + 1.0)


def young():
    """|L_theta (*) rho| <= sup |L| int |rho'|, even for light with edges: how far off it is.

    A search over square waves, the worst lights for the bound, with the slope of the library's
    diffuse lobe: `int |rho'|` is its albedo, and is unbounded for a narrow lobe. Reached by a step.
    """
    t = np.linspace(-0.5 * np.pi, 0.5 * np.pi, 20001)
    slope = np.asarray(jax.vmap(lambert(0.8).kernel.derivatives)(jnp.asarray(t))[1])
    bound, worst = 0.8, 0.0
    for frequency in np.linspace(0.05, 8.0, 40):
        for phase in np.linspace(0.0, 1.0, 20):
            L = np.sign(np.sin(2.0 * np.pi * (frequency * t + phase)))
            worst = max(worst, abs(np.trapezoid(L * slope, t)))
    return abs(worst - bound)


def terms_by_autodiff(light, surface):
    """SV + CDV against autodiff of the value."""
    B = surface.reflect(light)

    def error():
        terms = B.terms(*RAYS.T)[0]
        B_x = jax.jit(jax.vmap(jax.grad(B.at)))(jnp.asarray(RAYS))[:, 0]
        return normwise(terms.SV + terms.CDV, B_x)

    return Check(error, 1e-10)


def _overcast(x, w):
    return 1.0 + 0.1 * jnp.sin(w) + 0.0 * x


def _lamp(x, w):
    """`near(3.0)`, jittable."""
    return jnp.exp(-0.5 * (x - 3.0 * jnp.tan(w)) ** 2)


# --- identities of the terms -------------------------------------------------------------------


def term_error(row):
    """The row's identity, on the library's terms against complex steps of the dense sum."""
    flat, distant = row in ("flat", "flat-envmap"), row in ("distant", "flat-envmap")
    L = (lambda x, w: np.exp(-((w - 0.1) ** 2)) + 0.0 * x) if distant else bell
    n = (lambda x: 0.0 * x) if flat else normal
    f = functools.partial(dense, L=L, n=n)
    ours = FlatlandLight(lambda x, w: jnp.exp(-((w - 0.1) ** 2)) + 0.0 * x, distant_entries)
    surface = SCENES["flat" if flat else "glossy"]
    terms = surface.reflect(ours if distant else LIGHT).terms(*RAYS.T)[0]
    B_x = np.array([complex_step(f, x, t)[0] for x, t in RAYS])
    zero = {"distant": [terms.SV], "flat": [terms.CV, terms.CDV], "all": []}
    zero["flat-envmap"] = [*zero["distant"], *zero["flat"], B_x]
    left = {"distant": terms.CDV, "flat": terms.SV, "flat-envmap": 0.0 * B_x}
    total = left.get(row, terms.SV + terms.CDV)
    gone = [float(np.max(np.abs(z))) for z in zero[row]]
    return max([normwise(total, B_x) if np.any(B_x) else 0.0, *gone])


def direction_sign():
    """B_theta + DV, from complex steps."""
    terms = SCENES["glossy"].reflect(LIGHT).terms(*RAYS.T)[0]
    truth = np.array([complex_step(dense, x, t)[1] for x, t in RAYS])
    return normwise(-terms.DV, truth)


TERMS = f"{MODULE}.ReflectedField.terms"

# --- rows --------------------------------------------------------------------------------------

ROWS = [
    # §5.1
    Row(
        "R07.s5.1a",
        "over-claim",
        implements="firstorder.transport.events.rotation.Curvature",
        symbolic=proofs.turning_normal,
        autodiff=na("scale"),
        fourier=flatless,
        brute_force=Check(
            lambda: max(abs(cylinder(0.5, 0.2) - 0.5 * cylinder(1.0, 0.2)), shape_operator_error()),
            1e-12,
        ),
        corrected="n_x -> dn along the direction of differentiation (the shape operator)",
        counterexample=Counterexample(
            {"kappa": 0.5, "theta": 0.2},
            printed=lambda kappa, theta: 0.0 * kappa * theta,  # a cylinder's K is zero
            true=cylinder,
        ),
        note="Gaussian curvature has the unit 1/m^2 and vanishes on a cylinder.",
    ),
    Row(
        "R07.s5.1b",
        "identity",
        implements="firstorder.laws.move.Move.jet",
        symbolic=proofs.rotated_axes,
        autodiff=Check(lambda: gradient_in_turned_axes(lambda f, u: jax.grad(f.at)(u)), 1e-10),
        fourier=flatless,
        brute_force=Check(lambda: gradient_in_turned_axes(lambda f, u: f.jet(u).gradient), 1e-10),
        note="A field of space whose axes are turned by a Move.",
    ),
    # §5.2
    Row(
        "R07.s5.2a",
        "definition",
        implements=f"{MODULE}.DerivativeTerms",
        symbolic=na("definition"),
        autodiff=na("definition"),
        fourier=na("definition"),
        brute_force=Check(lambda: term_error("all"), 1e-10),
    ),
    Row(
        "R07.s5.2b",
        "identity",
        implements=TERMS,
        symbolic=proofs.sum_of_terms,
        autodiff=autodiff("glossy", "gradient"),
        fourier=fourier("gradient"),
        brute_force=Check(lambda: term_error("all"), 1e-10),
        note="Homogeneous lobes; varying ones, textures and cosines add a material term MV.",
    ),
    Row(
        "R07.s5.2c",
        "identity",
        implements=TERMS,
        symbolic=gradient,
        autodiff=autodiff("glossy", "gradient"),
        fourier=fourier("gradient"),
        brute_force=Check(direction_sign, 1e-10),
        note="The same in size, read at theta_r, and of the opposite sign: B_theta = -DV by (25), "
        "for which `essentially` leaves room.",
    ),
    *[
        Row(
            f"R07.fig4.{row}",
            "identity",
            implements=TERMS,
            symbolic=proof,
            autodiff=autodiff("flat" if "flat" in row else "glossy", "gradient"),
            fourier=two,
            brute_force=Check(functools.partial(term_error, row), 1e-10),
            note="At fixed direction, and without an exact cosine.",
        )
        for row, proof in (
            ("distant", proofs.distant_light),
            ("flat", proofs.flat_surface),
            ("flat-envmap", proofs.flat_in_distant_light),
        )
    ],
    measured(
        "R07.fig4.overcast",
        overcast_order,
        0.05,
        "Order 1 in the sky's contrast, at bounded curvature: CDV = CV DV.",
        TERMS,
        terms_by_autodiff(_overcast, SCENES["glossy"]),
    ),
    measured(
        "R07.fig4.near",
        near_order,
        0.1,
        "SV is of order -1 in the distance of the light.",
        TERMS,
        terms_by_autodiff(_lamp, SCENES["flat"]),
    ),
    measured(
        "R07.fig4.bump",
        bump_order,
        0.05,
        "B_x = CDV (1 + O(1 / n_x)) where DV is not zero; it fails where n_x vanishes.",
        TERMS,
        terms_by_autodiff(_lamp, Surface(Affine([20.0, 0.0], 0.0), (glossy(0.2),))),
    ),
    Row(
        "R07.fig4.lambertian",
        "over-claim",
        implements=f"{MODULE}.ReflectedField.entries",
        symbolic=proofs.diffuse_argument,
        autodiff=autodiff("diffuse", "hessian"),
        fourier=two,
        brute_force=brute("diffuse", "gradient"),
        corrected="B_x = SV + n_x DV with the lobe in n - omega (CV = n_x, not 2 n_x); B_theta = 0",
        counterexample=Counterexample(
            {"x": 0.3, "theta": 0.1},
            printed=printed_lambertian,
            true=lambda x, theta: float(complex_step(BRUTE["diffuse"], x, theta)[0]),
        ),
        note="A diffuse lobe turns once with the normal. SV is low-pass filtered like DV.",
    ),
    measured(
        "R07.s5.2h",
        young,
        1e-6,
        "|L_theta (*) rho| <= sup |L| int |rho'| for any light (Young's inequality), searched.",
        "firstorder.transport.brdf.lobes.lambert",
    ),
]
