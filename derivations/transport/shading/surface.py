"""Reflected light of a curved surface, from the integral over incident directions.

R07 (1), §4.1 (step 3), §4.3, §5.4 and App. C. Materials that vary in space are in
`shading_materials`, the terms of §5.1-5.2 in `shading_terms` and `shading_far_light`; `_shading`
holds what they share and says how the proofs work.
"""

from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np
import sympy as sp

from derivations.transport.shading._shading import (
    CLOSED,
    LIGHT,
    MODULE,
    NORMAL,
    RAYS,
    a,
    b,
    bell,
    brute,
    derivatives,
    flatless,
    fourier,
    gauss,
    identity,
    l0,
    light,
    lt,
    ltt,
    lx,
    lxt,
    lxx,
    n0,
    n1,
    n2,
    normal,
    r0,
    reflected,
    turn,
)
from firstorder.fields import GaussianProfile
from firstorder.ledger import Check, Row, na
from firstorder.transport.brdf.general import Ggx
from firstorder.transport.brdf.lobes import Lobe
from firstorder.transport.shading.surface import Surface


def definition_of_the_convolution():
    """(14), flat: at fixed offsets the ray enters the mirrored light alone. That is (15), (16)."""
    flat = derivatives(light(a, -b) * r0)
    # L_m(x, omega) = L(x, -omega), so L_m,x = L_x and L_m,theta = -L_theta
    return flat[1] - lx * r0, flat[2] + lt * r0


def substitution():
    """(22) -> (23): `omega' = n - omega`, whose Jacobian has size 1 and whose ends swap."""
    w, wp, theta = sp.symbols("omega omega_prime theta", real=True)
    L, rho = sp.Function("L"), sp.Function("rho")
    start = L(-w + n0) * rho(w - theta + n0)
    end = L(wp) * rho(2 * n0 - theta - wp)
    jacobian = sp.Abs(sp.diff(n0 - wp, wp)) - 1
    return (start.subs(w, n0 - wp) - end).simplify(), jacobian


def four_steps():
    """(22) from its definition: rotate, mirror, convolve, rotate back."""
    w, theta, x = sp.symbols("omega theta x", real=True)
    n, L, rho = sp.Function("n"), sp.Function("L"), sp.Function("rho")
    local = lambda x, t: L(x, t + n(x))  # noqa: E731
    mirrored = lambda x, t: local(x, -t)  # noqa: E731
    integrand = lambda x, t: mirrored(x, w) * rho(w - t)  # noqa: E731
    end = L(x, -w + n(x)) * rho(w - theta + n(x))
    return (integrand(x, theta - n(x)) - end).simplify(), mirrored(x, w) - L(x, -w + n(x))


def matrices():
    """(24): the three linear steps, and the derivative itself."""
    product = sp.Matrix([[1, -n1], [0, 1]]) * sp.diag(1, -1) * sp.Matrix([[1, n1], [0, 1]])
    combined = sp.Matrix([[1, 2 * n1], [0, -1]])
    true = sp.Matrix(derivatives(reflected())[1:3])
    return list(product - combined) + list(true - combined * sp.Matrix([lx, lt]) * r0)


def gradient():
    """(25)."""
    _, x, theta, *_ = derivatives(reflected())
    return x - (lx + 2 * n1 * lt) * r0, theta + lt * r0


def hessian():
    """(29)."""
    *_, xx, xt, tt = derivatives(reflected())
    return (
        xx - (lxx + 4 * n1 * lxt + 4 * n1**2 * ltt + 2 * n2 * lt) * r0,
        xt + (lxt + 2 * n1 * ltt) * r0,
        tt - ltt * r0,
    )


def even_lobes():
    """Footnote 2: the odd part of a lobe is what changes the sign; of an even one it is zero."""
    t, c = sp.symbols("t c", real=True)
    even = sp.exp(-(t**2)) * (1 + c * t**2)
    return sp.simplify(even - even.subs(t, -t))


def through_the_reflected_direction():
    """(68): the same with a function f instead of an integral."""
    _, x, theta, *_ = derivatives(light(a, 2 * turn - b))
    return x - lx - 2 * n1 * lt, theta + lt


def of_the_convolved_gradients():
    """(69): L_x and L_theta in the place of L."""
    p, q = a, 2 * turn - b
    first = {"x": lx + lxx * p + lxt * q, "theta": lt + lxt * p + ltt * q}
    at = {a: 0, b: 0}
    dx = {k: sp.diff(e, a).subs(at) for k, e in first.items()}
    dt = {k: sp.diff(e, b).subs(at) for k, e in first.items()}
    return (
        dx["x"] - lxx - 2 * n1 * lxt,
        dt["x"] + lxt,
        dx["theta"] - lxt - 2 * n1 * ltt,
        dt["theta"] + ltt,
    )


def exact_cosine():
    """B with `cos(omega - n)`, both ways: the missing term, and the horizon's end term.

    `w = m - t` is the local angle, m = n - theta. Over the interior Leibniz' rule holds. At a
    horizon the cosine vanishes and its slope does not: differentiate a whole integral up to
    `t = m + pi/2` in closed form, with a quadratic lobe and a linear light.
    """
    t, m, s = sp.symbols("t m s", real=True)
    weight = sp.cos(n1 * a + n2 * a**2 / 2 - b + s)  # s = w at the ray
    first = derivatives(light(a, 2 * turn - b) * r0 * weight)
    gained = -lt * sp.cos(s) + l0 * sp.sin(s)  # theta: m falls, so the cosine gains a sine
    c1, r1, r2 = sp.symbols("c1 r1 r2", real=True)
    L, rho = lambda t: 1 + c1 * t, lambda t: 1 + r1 * t + r2 * t**2
    start = sp.Rational(-1, 5)
    whole = sp.integrate(sp.expand(L(m - t) * rho(t)) * sp.cos(m - t), (t, start, m + sp.pi / 2))
    inner = sp.integrate(
        sp.diff(sp.expand(L(m - t) * rho(t)) * sp.cos(m - t), m, 2), (t, start, m + sp.pi / 2)
    )
    end = L(-sp.pi / 2) * rho(m + sp.pi / 2)
    return (
        first[1] - ((lx + 2 * n1 * lt) * sp.cos(s) - n1 * l0 * sp.sin(s)) * r0,
        first[2] - gained * r0,
        sp.simplify(sp.diff(whole, m, 2) - inner - end),
    )


def general_brdf():
    """`int L(x, n + w) rho(w, theta - n) cos w dw`: ends at -+ pi/2 stand still, so no end term."""
    p0, p1, p2 = sp.symbols("rho rho_o rho_oo", real=True)
    o = b - turn
    brdf = p0 + p1 * o + p2 * o**2 / 2
    _, x, theta, xx, xt, tt = derivatives(light(a, turn) * brdf)
    gx = lx + n1 * lt
    return (
        x - gx * p0 + n1 * l0 * p1,
        theta - l0 * p1,
        xx
        - (lxx + 2 * n1 * lxt + n1**2 * ltt + n2 * lt) * p0
        + 2 * n1 * gx * p1
        - l0 * (n1**2 * p2 - n2 * p1),
        xt - gx * p1 + n1 * l0 * p2,
        tt - l0 * p2,
    )


# --- brute force -------------------------------------------------------------------------------


def off_specular(theta, sign, shift=0.3):
    """A shifted lobe on a flat surface: (14) as printed (sign 1) and turned about."""
    t = np.linspace(-2.5, 2.5, 8001)
    rho = gauss(t - shift, 0.2)
    return float(np.sum(bell(0.3, -(theta + sign * t)) * rho) * (t[1] - t[0]))


class _Shifted(GaussianProfile):
    """An off-specular lobe: a Gaussian about 0.3."""

    def half_width(self):
        """As far as the shifted bell reaches."""
        return super().half_width() + 0.3

    def derivatives(self, t):
        """Those of the bell, at the shifted angle."""
        return super().derivatives(t - 0.3)


def off_specular_error():
    """The library's (23) with that lobe, which no exchange of angles leaves as it was."""
    lobe = Lobe(_Shifted(0.2, frame=LIGHT.frame.turned()))
    B = Surface(0.0, (lobe,)).reflect(LIGHT, nodes=96)
    return max(abs(float(B.at(jnp.array([0.3, t]))) - off_specular(t, 1.0)) for t in (0.1, -0.4))


def occluded_ggx():
    """(1) with all its factors: rough facets, a blocker's edge, the cosine; adaptive quadrature."""
    from scipy.integrate import quad

    from firstorder.fields import half_plane
    from firstorder.laws import Multiply

    blocker = half_plane(-0.2, 0.0, 1.0, "theta")  # V = 1 for omega > -0.2
    rho = Ggx(0.4)
    B = Surface(NORMAL, (rho,)).reflect(Multiply(blocker)(LIGHT))
    value = jax.jit(lambda x, theta: B(x, theta))
    worst = 0.0
    for x, theta in RAYS[:2]:
        n = normal(x)

        def integrand(w, x=x, theta=theta, n=n):
            h, d, o = 0.5 * (w + theta - n), 0.5 * (w - theta + n), theta - n
            D = 0.5 * 0.16 / (0.16 * np.cos(h) ** 2 + np.sin(h) ** 2) ** 1.5
            a = [np.sqrt(np.cos(t) ** 2 + 0.16 * np.sin(t) ** 2) for t in (w, o)]
            facets = D * np.cos(d) / (a[0] * np.cos(o) + a[1] * np.cos(w))
            return bell(x, n + w) * facets * np.cos(w)

        truth = quad(integrand, -0.2 - n, 0.5 * np.pi, epsabs=1e-13, epsrel=1e-12)[0]
        worst = max(worst, abs(float(value(x, theta)) - truth) / truth)
    return worst


# --- rows --------------------------------------------------------------------------------------

ROWS = [
    Row(
        "R07.1",
        "definition",
        implements=f"{MODULE}.ReflectedField",
        symbolic=na("definition"),
        autodiff=na("definition"),
        fourier=na("definition"),
        brute_force=Check(occluded_ggx, 1e-10),
        note="Checked with microfacets, a blocker's edge and the cosine together.",
    ),
    Row(
        "R07.14",
        "definition",
        implements=CLOSED,
        symbolic=na("definition"),
        autodiff=na("definition"),
        fourier=fourier("value", flat=True),
        brute_force=brute("flat", "value"),
        note="The integral is a correlation; it is Fig. 2's convolution for an even lobe only.",
    ),
    Row(
        "R07.fn2",
        "identity",
        implements=f"{MODULE}.ReflectedField",
        symbolic=even_lobes,
        autodiff=na("no derivative"),
        fourier=flatless,
        brute_force=Check(
            lambda: max(
                abs(off_specular(0.1, 1.0, 0.0) - off_specular(0.1, -1.0, 0.0)),
                off_specular_error(),
            ),
            1e-12,
        ),
        note="Of the symmetric BRDF that the footnote speaks of. An off-specular lobe is not even; "
        "for it the sign matters, and (23), a true convolution, is used as it stands.",
    ),
    identity(
        "R07.15",
        definition_of_the_convolution,
        "flat",
        "gradient",
        wave_route=fourier("gradient", flat=True),
    ),
    identity(
        "R07.16",
        definition_of_the_convolution,
        "flat",
        "gradient",
        wave_route=fourier("gradient", flat=True),
    ),
    identity("R07.22", four_steps, "glossy", "value", wave_route=fourier("value")),
    identity("R07.s4.3a", four_steps, "glossy", "value", wave_route=fourier("value")),
    identity("R07.23", substitution, "glossy", "value", wave_route=fourier("value")),
    Row(
        "R07.s4.3b",
        "definition",
        implements="firstorder.conventions.mirror_direction",
        symbolic=substitution,
        autodiff=na("definition"),
        fourier=na("definition"),
        brute_force=na("definition"),
    ),
    identity("R07.24", matrices, "glossy", "gradient", wave_route=fourier("gradient")),
    identity(
        "R07.25",
        gradient,
        "glossy",
        "gradient",
        wave_route=fourier("gradient"),
        note="For a lobe in theta_r without a separate cosine; see R07.s4.1f, R07.fig4.*. L_x is "
        "at a direction that stands still: R07.s4.3e.",
    ),
    identity("R07.29", hessian, "glossy", "hessian", wave_route=fourier("hessian")),
    identity(
        "R07.68",
        through_the_reflected_direction,
        "glossy",
        "gradient",
        wave_route=fourier("gradient"),
    ),
    identity(
        "R07.69", of_the_convolved_gradients, "glossy", "hessian", wave_route=fourier("hessian")
    ),
]

# The paper prints no formula for these; tests/transport/shading/test_surface.py runs the proofs.
UNNUMBERED = (exact_cosine, general_brdf)
