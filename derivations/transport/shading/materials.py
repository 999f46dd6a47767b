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


def textured():
    """(20) with `E = int L cos+(omega - n) d omega`: product rule; E_x by its own integral."""
    x = sp.symbols("x", real=True)
    E, rho = sp.Function("E")(x), sp.Function("rho")(x)
    product = (E * rho).diff(x) - (E.diff(x) * rho + E * rho.diff(x))
    second = (E * rho).diff(x, 2) - (
        E.diff(x, 2) * rho + 2 * E.diff(x) * rho.diff(x) + E * rho.diff(x, 2)
    )
    return product, second


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
    identity("R07.s4.3c", textured, "painted", "gradient"),
    identity(
        "R07.s4.3d",
        varying_on_a_curved_surface,
        "varying",
        "gradient",
        note="With the second order, which the paper does not give.",
    ),
]
