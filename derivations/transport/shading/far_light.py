"""When light counts as far: spatial against directional variation of a source, R07 §5.2."""

from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np
import sympy as sp

from derivations.transport.shading._shading import (
    MODULE,
    STEP,
    bent,
    complex_step,
    dense,
    flatless,
    measured,
    near,
    slope_w,
    slope_x,
)
from firstorder.checks.tolerance import fitted_order, normwise
from firstorder.ledger import Check, Counterexample, Row, na
from firstorder.transport.shading.surface import far_light_ratio


def isotropic_source():
    """§5.2: L_x and L_theta of a source that shines equally in all directions.

    First a line at height d, seen from a point that moves along a base with normal n_0; then any
    emitter: two rays hit it in the same place if their distance there, across the ray, is the same.
    """
    x, d, w, m = sp.symbols("x d omega n_0", real=True)
    s = sp.Function("s")
    px, py = sp.cos(m) * x, sp.sin(m) * x  # along the tangent (cos n_0, sin n_0)
    L = s(px - (d - py) * sp.tan(w))
    ratio = (L.diff(x) / L.diff(w)).subs(x, 0).doit()
    D = d / sp.cos(w)
    across_x = sp.Matrix([sp.cos(m), sp.sin(m)]).dot(sp.Matrix([sp.cos(w), sp.sin(w)]))
    across_w = -D  # direction(w) turns counter-clockwise: to the left
    flat = ratio.subs(m, 0) + sp.cos(w) ** 2 / d
    return (
        sp.simplify(ratio + sp.cos(w - m) / D),
        sp.simplify(across_x / across_w + sp.cos(w - m) / D),
        sp.simplify(flat),
    )


def mirrored_source():
    """SV and CDV of a mirror below a line of light at height d: they are to each other as L's are.

    A mirror's lobe is a Dirac, so B = L(x, 2 n(x) - theta), and SV is what moving does to it at a
    fixed reflected direction r. The rest of B_x is CDV, and is nothing where n_x is. Of how the
    line shines along itself first derivatives know the slope alone.
    """
    x, d, w, r, theta, slope = sp.symbols("x d omega r theta slope", real=True)
    n, L = sp.Function("n")(x), slope * (x - d * sp.tan(w))
    SV = L.diff(x).subs(w, r)
    CDV = L.subs(w, 2 * n - theta).diff(x).subs(theta, 2 * n - r) - SV
    return [
        sp.simplify(sp.cos(r) ** 2 * CDV + 2 * d * n.diff(x) * SV),
        sp.simplify(CDV.subs(n.diff(x), 0)),
    ]


def flat_mirror(d, theta):
    """B_x of a flat mirror under a line of light: `L(x, -theta)`, by complex steps."""
    return float(complex_step(lambda x, t: near(d)(x, -t), 0.3, theta)[0])


def comparable_order():
    """|SV / CDV| against the unfiltered light's at the lobe's centre: second order in the width.

    Of a line of light, whose own ratio is the library's: it shines alike in all directions.
    """
    d, (n, kappa, _) = 2.0, bent(0.3)
    r = 2.0 * n - 0.1
    unfiltered = float(far_light_ratio(d / np.cos(r), r, kappa))

    def miss(sigma):
        SV = dense(0.3, 0.1, L=lambda x, w: slope_x(near(d), x, w), sigma=sigma)
        DV = dense(0.3, 0.1, L=lambda x, w: slope_w(near(d), x, w), sigma=sigma)
        return abs(abs(SV / (2.0 * kappa * DV)) - unfiltered)

    s = np.array([0.04, 0.02, 0.01])
    return abs(fitted_order(s, [miss(c) for c in s]) - 2.0)


def isotropic_error():
    """`L_x = -cos(omega - n_0) / D L_theta` against a traced circle of light, tilted base."""
    n_0, center, radius = 0.3, np.array([0.4, 3.0]), 0.7

    def L(x, w):
        """Radiance of a point on the circle depends on where it is, not on the direction."""
        px, py = np.cos(n_0) * x, np.sin(n_0) * x
        ux, uy = -np.sin(w), np.cos(w)
        qx, qy = px - center[0], py - center[1]
        b = qx * ux + qy * uy
        D = -b - np.sqrt(b * b - (qx * qx + qy * qy - radius**2))
        return np.sin(3.0 * np.arctan((qx + D * ux) / (qy + D * uy))), D

    worst = 0.0
    for w in (-0.25, -0.1, 0.0):
        D = L(0.0, w)[1]
        L_x = L(0.0 + 1j * STEP, w)[0].imag / STEP
        L_w = L(0.0, w + 1j * STEP)[0].imag / STEP
        worst = max(worst, abs(L_x + np.cos(w - n_0) / D * L_w) / abs(L_x))
        ours = far_light_ratio(D, w - n_0, 0.8)
        worst = max(worst, abs(ours - abs(L_x / (1.6 * L_w))))
    return float(worst)


def isotropic_by_autodiff():
    """The same under a line of light, its slopes by autodiff, against `far_light_ratio`."""
    d, kappa = 2.0, 0.5
    w = jnp.array([-0.7, 0.1, 0.6])
    L_x, L_w = jax.vmap(jax.grad(lambda x, w: jnp.sin(x - d * jnp.tan(w)), (0, 1)), (None, 0))(
        0.3, w
    )
    signed = L_x / (2.0 * kappa * L_w)
    return normwise(-far_light_ratio(d / jnp.cos(w), w, kappa), signed)


# --- rows --------------------------------------------------------------------------------------

ROWS = [
    Row(
        "R07.fig4.mirror",
        "over-claim",
        implements=f"{MODULE}.far_light_ratio",
        symbolic=mirrored_source,
        autodiff=Check(isotropic_by_autodiff, 1e-10),
        fourier=flatless,
        brute_force=Check(isotropic_error, 1e-10),
        corrected="|SV| / |CDV| of a mirror is |L_x| / (2 |n_x| |L_theta|), of the light itself: "
        "cos(theta_r)^2 / (2 d |n_x|) under a line at height d, and a flat mirror has B_x = SV",
        counterexample=Counterexample(
            {"d": 2.0, "theta": 0.3},
            printed=lambda d, theta: 0.0 * d * theta,  # CDV of a flat surface
            true=flat_mirror,
        ),
    ),
    measured(
        "R07.s5.2d",
        comparable_order,
        0.1,
        "Of the unfiltered light; that of SV and CDV differs by order 2 in the lobe's width.",
        f"{MODULE}.far_light_ratio",
    ),
    Row(
        "R07.s5.2e",
        "definition",
        implements=f"{MODULE}.far_light_ratio",
        symbolic=na("definition"),
        autodiff=na("definition"),
        fourier=na("definition"),
        brute_force=na("definition"),
    ),
    Row(
        "R07.s5.2f",
        "misprint",
        implements=f"{MODULE}.far_light_ratio",
        symbolic=isotropic_source,
        autodiff=Check(isotropic_by_autodiff, 1e-10),
        fourier=flatless,
        brute_force=Check(isotropic_error, 1e-10),
        corrected="L_x = -cos(w - n_0) / D L_theta, D along the ray; -cos(w)^2 / d L_theta if flat",
        counterexample=Counterexample(
            {"d": 2.0, "w": 0.6},
            printed=lambda d, w: float(slope_w(near(d), 0.3, w) / d),
            true=lambda d, w: float(slope_x(near(d), 0.3, w)),
        ),
        note=(
            "Exact for every emitter that shines equally in all directions. The sign makes SV and "
            "CDV cancel in a valley with n_x = cos(w)^2 / (2 d), which is focused on the source."
        ),
    ),
    Row(
        "R07.s5.2g",
        "over-claim",
        implements=f"{MODULE}.far_light_ratio",
        symbolic=isotropic_source,
        autodiff=Check(isotropic_by_autodiff, 1e-10),
        fourier=flatless,
        brute_force=Check(isotropic_error, 1e-10),
        corrected="cos(w)^2 / d << 2 |n_x|: as printed it is sufficient and, aslant, not necessary",
        counterexample=Counterexample(
            {"d": 2.0, "w": 1.2, "kappa": 0.5},
            printed=lambda d, w, kappa: 1.0 / (2.0 * d * kappa) + 0.0 * w,
            true=lambda d, w, kappa: abs(
                float(slope_x(near(d), 4.8, w) / (2.0 * kappa * slope_w(near(d), 4.8, w)))
            ),
        ),
        note="Both sides as the ratio |SV| / |CDV| of a mirror.",
    ),
]
