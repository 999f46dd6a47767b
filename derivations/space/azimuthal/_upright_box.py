"""A box that stands on the floor beside a receiver: solid angle and light in closed form.

Its upright edges are silhouettes along meridians of the azimuth integral, of which R07 (48) and
(49) know nothing. One face is seen, at the distance a, from azimuth psi_0 to psi_1 about its
normal; its top edge is at the height h, at cos(theta) = h cos(psi) / sqrt(a^2 + h^2 cos^2(psi)).
"""

from __future__ import annotations

import functools

import mpmath as mp
import numpy as np
import sympy as sp

LOW, HIGH = (0.7, -0.4, 0.0), (1.5, 0.6, 1.1)


def _ends(x, y):
    """Distance of the face that looks at (x, y), and the azimuths of its upright edges."""
    a = LOW[0] - x
    return a, [mp.atan((end - y) / a) for end in (LOW[1], HIGH[1])]


def _net(a, psi, h):
    """Primitive over psi of int_theta^(pi/2) sin = cos(theta) at the top edge."""
    return mp.asin(h * mp.sin(psi) / mp.sqrt(a**2 + h**2))


def _cosine(a, psi, h):
    """The same of int sin cos = cos(theta)^2 / 2: light that is the cosine."""
    c = mp.sqrt(a**2 + h**2)
    return (psi - a / c * mp.atan(a * mp.tan(psi) / c)) / 2


PRIMITIVES = {"visibility": _net, "cosine": _cosine}
OPEN = {"visibility": 2 * mp.pi, "cosine": mp.pi}


def left(light, x, y):
    """What the box leaves: (47), or (49) with L = cos(theta)."""
    a, ends = _ends(x, y)
    low, high = (PRIMITIVES[light](a, psi, mp.mpf(HIGH[2])) for psi in ends)
    return OPEN[light] - (high - low)


def true_slope(light, x, y, axis):
    """Its derivative by differences in forty digits."""
    with mp.workdps(40):
        h, at = mp.mpf(10) ** -12, [mp.mpf(x), mp.mpf(y)]
        step = [h * (axis == i) for i in range(2)]
        up, down = (
            left(light, *(p + s * e for p, e in zip(at, step, strict=True))) for s in (1, -1)
        )
        return float((up - down) / (2 * h))


def printed_slope(light, x, y, axis):
    """(48), or (49): the top edge alone, each azimuth for itself, by adaptive quadrature.

    At a fixed azimuth the horizontal distance s = a / cos(psi) of the top edge changes with x
    alone, by -1 / cos(psi).
    """
    a, ends = _ends(x, y)
    h = HIGH[2]

    def slice_(psi):
        s = a / mp.cos(psi)
        sine, turn = s / mp.hypot(s, h), h / (s**2 + h**2)  # of theta = atan(s / h), dtheta/ds
        weight = sine * (h / mp.hypot(s, h) if light == "cosine" else 1)
        return -turn / mp.cos(psi) * weight

    return float(mp.quad(slice_, ends)) if axis == 0 else 0.0


@functools.cache
def ours(light):
    """Value and gradient that the library finds."""
    import jax.numpy as jnp

    from firstorder.space import Scene, box, primitive, receiver
    from firstorder.space.azimuthal.transport import transport_by_azimuth, visibility_by_azimuth

    scene, at = Scene.of(primitive(box(LOW, HIGH))), receiver(jnp.array([0.1, 0.2, 0.0]))
    if light == "visibility":
        found = visibility_by_azimuth(scene, at)
    else:
        found = transport_by_azimuth(scene, at, transport=lambda at, w: w[2])
    return np.append(np.asarray(found.gradient.total), float(found.value))


def error(light) -> float:
    """The library beside the box, upright edges and all."""
    true = [true_slope(light, 0.1, 0.2, axis) for axis in (0, 1)]
    true.append(float(left(light, mp.mpf("0.1"), mp.mpf("0.2"))))
    return float(np.max(np.abs(ours(light) - np.array(true))))


def moving_ends():
    """What a blocker takes between two azimuths that move: (48)'s integral, and its ends.

    At an end stands an upright edge, and the azimuth's whole share of light jumps there.
    """
    x, phi, theta = sp.symbols("x phi theta", real=True)
    one, two = (sp.Function(f"phi_{i}")(x) for i in (1, 2))
    alpha, L = sp.Function("alpha")(x, phi), sp.Function("L")(theta, phi)
    share = sp.Integral(L * sp.sin(theta), (theta, alpha, sp.pi / 2))
    whole = sp.Integral(share, (phi, one, two)).diff(x)
    top = sp.Integral(-(L * sp.sin(theta)).subs(theta, alpha) * alpha.diff(x), (phi, one, two))
    ends = share.subs(phi, two) * two.diff(x) - share.subs(phi, one) * one.diff(x)
    return sp.simplify((whole - top - ends).doit())
