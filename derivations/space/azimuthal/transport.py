"""Net visibility and light by azimuth, and their gradients: R07 (47)-(49).

V is a step, so nothing is differentiated but integrals over visible pieces, whose derivative is
Leibniz's rule. The numbers are those of a ball over a floor, against the area of its cap by Gauss
and Bonnet, and against light summed over the cap about the ball's own axis; and those of a box that
stands beside the receiver, whose upright edges the formulas leave out (`_upright_box`).
"""

from __future__ import annotations

import functools

import mpmath as mp
import numpy as np
import sympy as sp

from derivations.space.azimuthal import _upright_box as upright
from firstorder.ledger import Check, Counterexample, Row, na

x, theta = sp.symbols("x theta", real=True)
alpha = sp.Function("alpha")(x)


def gradient_of_net_visibility():
    """(48): d/dx of int_0^alpha sin(theta) dtheta, a visible piece below an edge (sign +1).

    A piece above an edge is minus this, sign -1, and any visibility is a sum of such pieces, slice
    by slice; an edge that lies in one slice, whole, is in none of them.
    """
    piece = sp.integrate(sp.sin(theta), (theta, 0, alpha)).diff(x)
    return sp.simplify(piece - sp.sin(alpha) * alpha.diff(x))


def gradient_under_light():
    """(49) for L(theta), and the interior term that L(x, theta) adds to it."""
    L, M = sp.Function("L")(theta), sp.Function("M")(x, theta)
    still = sp.Integral(L * sp.sin(theta), (theta, 0, alpha)).diff(x)
    edge = (L * sp.sin(theta)).subs(theta, alpha) * alpha.diff(x)
    moving = sp.Integral(M * sp.sin(theta), (theta, 0, alpha)).diff(x)
    inside = sp.Integral(M.diff(x) * sp.sin(theta), (theta, 0, alpha))
    both = inside + (M * sp.sin(theta)).subs(theta, alpha) * alpha.diff(x)
    return sp.simplify(still - edge), sp.simplify(moving - both)


# --- numbers -------------------------------------------------------------------------------------

# Beside the receiver, over its pole, and cut by its horizon: centres, radii.
BALLS = [((1.0, 0.5, 1.4), 0.6), ((0.3, 0.2, 2.0), 1.0), ((2.0, 0.5, 0.3), 0.6)]
WHOLE = (0, 1)  # those that the horizon does not cut


def cap(center, radius):
    """Solid angle of a ball above the horizon: two arcs and two corners."""
    d = mp.sqrt(sum(c**2 for c in center))
    beta, gamma = mp.asin(radius / d), mp.acos(center[2] / d)
    if gamma + beta <= mp.pi / 2:
        return 2 * mp.pi * (1 - mp.cos(beta))
    arc = mp.acos(-mp.cot(beta) * mp.cot(gamma))
    return 2 * mp.pi - 2 * arc * mp.cos(beta) - 2 * mp.acos(mp.cos(gamma) / mp.sin(beta))


def light(lib, w):
    """A smooth environment times the cosine; w are x, y, z."""
    return w[2] * (1.0 + 0.4 * w[0] + 0.3 * lib.sin(2.0 * w[1] + w[0] * w[2]))


def shadowed(move, center, radius):
    """What a whole ball takes of that light: nodes in polar coordinates about its own axis."""
    c = np.array(center) - np.array([*move, 0.0])
    d = np.linalg.norm(c)
    axis = c / d
    e = np.cross(axis, [0.3, -0.2, 0.9])
    e /= np.linalg.norm(e)
    f = np.cross(axis, e)
    t, weight = np.polynomial.legendre.leggauss(24)
    low = np.sqrt(1.0 - (radius / d) ** 2)
    u = 0.5 * (1.0 + low) + 0.5 * (1.0 - low) * t  # cosine from the axis
    turn = 2.0 * np.pi * np.arange(48) / 48
    s = np.sqrt(1.0 - u**2)[:, None]
    w = [u[:, None] * axis[i] + s * (np.cos(turn) * e[i] + np.sin(turn) * f[i]) for i in range(3)]
    return float(0.5 * (1.0 - low) * weight @ light(np, w).mean(1) * 2.0 * np.pi)


def differences(function, ball, h=2e-3):
    """Gradient of a number in NumPy, by sixth-order differences."""
    weights = {1: 0.75, 2: -0.15, 3: 1.0 / 60.0}

    def along(e):
        return sum(
            k * (function(n * h * e, *ball) - function(-n * h * e, *ball))
            for n, k in weights.items()
        )

    return np.array([along(e) / h for e in np.eye(2)])


@functools.cache
def ours():
    """Value, gradient by (48) and gradient by autodiff, of net visibility and of light."""
    import jax
    import jax.numpy as jnp

    from firstorder.space import Scene, primitive, receiver, sphere
    from firstorder.space.azimuthal.transport import transport_by_azimuth, visibility_by_azimuth

    def both(move, center, radius):
        scene = Scene.of(primitive(sphere(center, radius)))
        at = receiver(jnp.append(move, 0.0))
        lit = transport_by_azimuth(
            scene, at, transport=lambda at, w: light(jnp, w), nodes=24, inner=16
        )
        return visibility_by_azimuth(scene, at, nodes=24), lit

    def all_of(center, radius):
        def values(move):
            found = both(move, center, radius)
            return [B.value for B in found], found

        slopes, found = jax.jacfwd(values, has_aux=True)(jnp.zeros(2))
        return found, slopes

    centers, radii = (jnp.asarray(np.array(a)) for a in zip(*BALLS, strict=True))
    return jax.jit(jax.vmap(all_of))(centers, radii)


def value_error() -> float:
    """(47) against the caps."""
    found = ours()[0][0].value
    truth = [float(2 * mp.pi - cap(*ball)) for ball in BALLS]
    return float(np.max(np.abs(np.asarray(found) - truth)))


def visibility_gradient(route: str) -> float:
    """(48) against differences of the caps, or against autodiff of (47)."""
    (found, _), slopes = ours()
    if route == "autodiff":
        return float(np.max(np.abs(found.gradient.total - slopes[0])))
    worst = 0.0
    with mp.workdps(40):
        h = mp.mpf(10) ** -12
        for (center, radius), ours_ in zip(BALLS, np.asarray(found.gradient.total), strict=True):
            c = [mp.mpf(v) for v in center]
            dx = (cap([c[0] - h, *c[1:]], radius) - cap([c[0] + h, *c[1:]], radius)) / (2 * h)
            dy = (cap([c[0], c[1] - h, c[2]], radius) - cap([c[0], c[1] + h, c[2]], radius)) / (
                2 * h
            )
            worst = max(worst, abs(float(ours_[0] + dx)), abs(float(ours_[1] + dy)))
    return worst


def light_gradient(route: str) -> float:
    """(49) against differences of light summed over caps, or against autodiff of B."""
    (_, found), slopes = ours()
    if route == "autodiff":
        return float(np.max(np.abs(found.gradient.total - slopes[1])))
    total = np.asarray(found.gradient.total)
    errors = [total[i] + differences(shadowed, BALLS[i]) for i in WHOLE]
    return float(np.max(np.abs(errors)))


def formula_of_47(height, radius):
    """(47) for a ball straight overhead, by quadrature: V = 1 beyond its edge."""
    edge = mp.asin(radius / height)
    return float(2 * mp.pi * mp.quad(mp.sin, [edge, mp.pi / 2]))


def blocked_share(height, radius, rays=4001):
    """The share of the hemisphere that the ball blocks: rays, even in solid angle."""
    z = (np.arange(rays) + 0.5) / rays
    return float(np.mean(height**2 * (1.0 - z**2) < radius**2))


SLICES = "firstorder.space.azimuthal.transport"
NONE = {"fourier": na("no spectrum")}
ROWS = [
    Row(
        "R07.47",
        "definition",
        implements=f"{SLICES}.visibility_by_azimuth",
        symbolic=na("definition"),
        autodiff=na("no derivative"),
        brute_force=Check(value_error, 1e-12),
        **NONE,
        note="In sr, of what is visible. Taken over half great circles, phi in [0, pi).",
    ),
    Row(
        "R07.s7.2a",
        "misprint",
        implements=f"{SLICES}.visibility_by_azimuth",
        symbolic=lambda: sp.integrate(sp.sin(theta), (theta, 0, sp.pi / 2)) - 1,
        autodiff=na("no derivative"),
        brute_force=Check(value_error, 1e-12),
        **NONE,
        corrected="(47) is the visible solid angle; the share that is blocked is 1 - B / (2 pi)",
        counterexample=Counterexample(
            {"height": 2.0, "radius": 1.0}, printed=formula_of_47, true=blocked_share
        ),
        note="The formula is right and its description is not.",
    ),
    Row(
        "R07.48",
        "over-claim",
        implements=f"{SLICES}.visibility_by_azimuth",
        symbolic=lambda: [gradient_of_net_visibility(), upright.moving_ends()],
        autodiff=Check(lambda: visibility_gradient("autodiff"), 1e-11),
        brute_force=Check(
            lambda: max(visibility_gradient("brute"), upright.error("visibility")), 1e-11
        ),
        **NONE,
        corrected="as printed if no silhouette runs along a meridian; else, for each that does, at "
        "the azimuth phi_e, + dphi_e/dx times the jump of int V sin(theta) dtheta there",
        counterexample=Counterexample(
            {"light": "visibility", "x": 0.1, "y": 0.2, "axis": 0},
            printed=upright.printed_slope,
            true=upright.true_slope,
        ),
        note="The edges of boxes, walls and pillars that stand upright; the library adds them on a "
        "flat receiver. What meets the horizon has no edge there. On a curved receiver alpha_x "
        "holds the turn of its frame.",
    ),
    Row(
        "R07.49",
        "over-claim",
        implements=f"{SLICES}.transport_by_azimuth",
        symbolic=lambda: [*gradient_under_light(), upright.moving_ends()],
        autodiff=Check(lambda: light_gradient("autodiff"), 1e-10),
        brute_force=Check(lambda: max(light_gradient("brute"), upright.error("cosine")), 1e-9),
        **NONE,
        corrected="as printed if no silhouette runs along a meridian; else, for each that does, at "
        "the azimuth phi_e, + dphi_e/dx times the jump of int L V sin(theta) dtheta there",
        counterexample=Counterexample(
            {"light": "cosine", "x": 0.1, "y": 0.2, "axis": 0},
            printed=upright.printed_slope,
            true=upright.true_slope,
        ),
        note="Upright edges: R07.48. Light that varies in space adds the integral of its own "
        "derivative where it is seen: the interior part.",
    ),
]
