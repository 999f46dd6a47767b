"""Reflected light where the material varies: lobes (18)-(19), textures (20), on curved surfaces.

R07 §4.2 and the end of §4.3.
"""

from __future__ import annotations

import sympy as sp

from derivations.transport.shading._shading import (
    a,
    b,
    brute,
    derivatives,
    identity,
    l0,
    light,
    lobe,
    lt,
    ltt,
    lx,
    lxt,
    lxx,
    n1,
    n2,
    r0,
    rx,
    rxx,
    turn,
)
from firstorder.ledger import Row, na


def varying():
    """(19), and the second derivatives that the paper does not give."""
    value, x, theta, xx, xt, tt = derivatives(light(a, -b) * lobe(a))
    return (
        value - l0 * r0,
        x - lx * r0 - l0 * rx,
        theta + lt * r0,
        xx - lxx * r0 - 2 * lx * rx - l0 * rxx,
        xt + lxt * r0 + lt * rx,
        tt - ltt * r0,
    )


def varying_on_a_curved_surface():
    """§4.3, last paragraph: L (*) rho_x in B_x and nothing in B_theta; and the Hessian."""
    _, x, theta, xx, xt, tt = derivatives(light(a, 2 * turn - b) * lobe(a))
    smooth = lxx + 4 * n1 * lxt + 4 * n1**2 * ltt + 2 * n2 * lt
    return (
        x - (lx + 2 * n1 * lt) * r0 - l0 * rx,
        theta + lt * r0,
        xx - smooth * r0 - 2 * (lx + 2 * n1 * lt) * rx - l0 * rxx,
        xt + (lxt + 2 * n1 * ltt) * r0 + lt * rx,
        tt - ltt * r0,
    )


def coefficients(f):
    """Of dx and of dx^2 / 2 in B(x + dx), multiplied out: the derivatives, by their definition."""
    f = sp.expand(f)
    return f.coeff(a, 1), 2 * f.coeff(a, 2)


def textured():
    """(20), from the integral: light of a local direction, times its cosine c, times the texture.

    A step carries the frame of the normal with it, so E_x is what (10) makes of the light.
    """
    c = sp.Symbol("cos_omega")
    x, xx = coefficients(light(a, turn) * c * lobe(a))
    E, E_x = l0 * c, (lx + n1 * lt) * c
    E_xx = (lxx + 2 * n1 * lxt + n1**2 * ltt + n2 * lt) * c
    return x - (E_x * r0 + E * rx), xx - (E_xx * r0 + 2 * E_x * rx + E * rxx)


def textured_and_glossy():
    """§4.3: (25) times the texture, and the texture's slope times (23)."""
    paint, p_x = sp.symbols("p p_x", real=True)
    x, _ = coefficients((light(a, 2 * turn) * r0) * (paint + p_x * a))
    return x - paint * (lx + 2 * n1 * lt) * r0 - p_x * l0 * r0


ROWS = [
    Row(
        "R07.18",
        "definition",
        implements="firstorder.transport.events.reflection.VaryingGaussian",
        symbolic=na("definition"),
        autodiff=na("definition"),
        fourier=na("definition"),
        brute_force=brute("varying, flat", "value"),
    ),
    identity(
        "R07.19",
        varying,
        "varying, flat",
        "gradient",
        note="Second order, not printed: B_xx gains 2 L_x (*) rho_x + L (*) rho_xx.",
    ),
    identity(
        "R07.20",
        textured,
        "painted, diffuse",
        "gradient",
        note="E is printed without the cosine; the product rule does not care.",
    ),
    identity("R07.s4.3c", textured_and_glossy, "painted", "gradient"),
    identity(
        "R07.s4.3d",
        varying_on_a_curved_surface,
        "varying",
        "gradient",
        note="With the second order, which the paper does not give.",
    ),
]
