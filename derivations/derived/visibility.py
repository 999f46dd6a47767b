"""R07 §5.3 and §6: the camera, and shadows whose edges move.

A blocker with one edge at the angle alpha(x) is a step that `Bump` carries along: it lets through
what lies below the edge.
"""

from __future__ import annotations

import functools

import jax.numpy as jnp
import sympy as sp

from derivations.derived.compare import (
    FLATLAND,
    LEAVING,
    Equation,
    L,
    S,
    after,
    at_symbols,
    d,
    flat,
    integral,
    oo,
    px,
    rho,
    t,
    theta,
    unknown,
    x,
)
from firstorder.conventions import FLATLAND_SLOPE
from firstorder.fields import Jet, half_plane
from firstorder.laws import Integrate
from firstorder.symbolic import UnknownField, UnknownLobe, derive, named_terms
from firstorder.symbolic._programs.functions import Unknown
from firstorder.symbolic._programs.reading import array, expression, read
from firstorder.transport import (
    BaseSurface,
    Bump,
    Camera,
    CameraRay,
    Mirror,
    Occlusion,
    Reflection,
    distant_image_gradient,
)
from firstorder.visibility import point_edge_angle

p, q = sp.Symbol("p", real=True), sp.Symbol("q", positive=True)
z, gamma = sp.symbols("z gamma", positive=True)
n_0 = sp.Symbol("n_0", real=True)
V, alpha = unknown("V", "x", "theta"), unknown("alpha", "x")
alpha_x = alpha(x, along="x")
EDGE = Bump(UnknownField("alpha", ("x",)), back=True)(half_plane(0.0, 1.0, 0.0, axis="theta"))
IN_SLOPES = UnknownField("L", frame=FLATLAND_SLOPE)
BLOCKED = Occlusion(UnknownField("V", frame=FLATLAND))
LOBE = Reflection(UnknownLobe("rho"))


# --- the camera ----------------------------------------------------------------------------------


@functools.cache
def image():
    """What an eye at the height z above the point x = 0 sees of a tilted base, from its front."""
    base = at_symbols(lambda n: BaseSurface(0.0, n), n_0)
    found = derive(Camera((0, z), gamma, base), LEAVING)
    return found.value.mapped(_facing), found.gradient.mapped(_facing)


def _facing(expression):
    """Cosines to the eye are positive."""
    return expression.replace(sp.Abs, lambda a: a).replace(sp.sign, lambda a: sp.Integer(1))


def motion():
    """`dx/dpx` and `dtheta/dpx`: what stands in front of `B_x` and `B_theta`."""
    value, gradient = image()
    (call,), (rate,) = value.expression.atoms(Unknown), flat(gradient)
    return [_simple(rate.coeff(L(*call.args, along=a))) for a in ("x", "theta")]


def _simple(expression):
    return sp.simplify(sp.expand_trig(expression))


def motion_printed():
    """R07 (27), with the height of the eye and its offset, of the point that is seen."""
    (call,) = image()[0].expression.atoms(Unknown)
    s = call.args[0]  # arc length from x = 0, up the tilted base
    height, beside = z - s * sp.sin(n_0), s * sp.cos(n_0)
    facing = sp.cos(sp.atan(px / gamma) - n_0)
    # D = height / cos(theta), positive
    D = height * sp.sqrt(1 + (beside / height) ** 2)
    return [_simple(height**2 / (gamma * D * facing)), 1 / (gamma + px**2 / gamma)]


def chain_rule():
    """R07 (26), `C . B` with C the derivatives of the ray that is seen."""
    (call,) = image()[0].expression.atoms(Unknown)
    pairs = zip(("x", "theta"), call.args, strict=True)
    return sum(sp.diff(ray, px) * L(*call.args, along=a) for a, ray in pairs)


def distant():
    """The middle of the image: its derivative by the height, for an eye that goes far away.

    And what the library has for R07 (28).
    """
    step, turn = (e.subs(px, 0) for e in motion())
    named = at_symbols(_distant, n_0, z, gamma)
    return [step, sp.limit(turn / step, z, oo), expression(named)]


def _distant(n, height, gamma):
    zero = 0.0 * n
    ray = CameraRay(zero, zero, zero, zero, zero, zero)
    jet = Jet(zero, jnp.stack([1.0 + zero, zero]), jnp.zeros((2, 2)), LEAVING)
    return distant_image_gradient(ray, n, height, gamma, jet)


# --- edges ---------------------------------------------------------------------------------------


def shadowed(*steps):
    return derive(after(Occlusion(EDGE), *steps))


def lit(w):
    """1 below the edge, 0 above it."""
    return sp.Rational(1, 2) - sp.sign(w - alpha(x)) / 2


def reflected_shadow(i):
    return flat(shadowed(Mirror(), LOBE).gradient)[i]


def below_edge(along):
    """`int L_.. V rho` at the mirrored direction -theta, and T at the edge."""
    return integral(L(x, t - theta, along=along) * lit(t - theta) * rho(t))


def transport():
    """`T(x, theta, alpha) = L(x, alpha) rho(-theta - alpha)`, of an even lobe."""
    return L(x, alpha(x)) * rho(theta + alpha(x))


def edge_angle():
    """Rate of the angle of the point (p, q), from the code for the angle and from that for it."""
    point, receiver = array(p, q), array(x, 0)
    angle = read(lambda a, b: point_edge_angle(a, b).value, point, receiver)
    rate = read(lambda a, b: point_edge_angle(a, b).along().first, point, receiver)
    return [sp.diff(expression(angle), x), expression(rate)]


def edge_angle_printed():
    alpha_, D = sp.atan((x - p) / q), sp.sqrt((x - p) ** 2 + q**2)
    return [sp.cos(alpha_) / D, sp.cos(alpha_) ** 2 / q]


def half_plane_at_depth():
    """Light past the edge x = 0 of a blocker at the distance d: `alpha = x / d` in slopes."""
    blocker = Occlusion(half_plane(0.0, axis="x"), depth=d)
    (law,) = derive(blocker, FLATLAND_SLOPE).laws
    return derive(after(law, Integrate("v", -oo, oo), light=IN_SLOPES)).gradient


def half_plane_printed():
    seen = sp.Rational(1, 2) + sp.sign(x - d * t) / 2
    return integral(S(x, t, along="x") * seen) + S(x, x / d) / d


DERIVED = {
    "R07.26": Equation(lambda: image()[1], chain_rule),
    "R07.27": Equation(motion, motion_printed),
    "R07.28": Equation(
        distant, lambda: [z / gamma / sp.cos(n_0), 0, z / gamma / sp.cos(n_0)]
    ),
    "R07.30": Equation(lambda: derive(BLOCKED).value, lambda: L(x, theta) * V(x, theta)),
    "R07.31": Equation(
        lambda: derive(BLOCKED).gradient,
        lambda: [
            L(x, theta, along=a) * V(x, theta) + L(x, theta) * V(x, theta, along=a)
            for a in ("x", "theta")
        ],
    ),
    "R07.32": Equation(
        lambda: named_terms(BLOCKED >> Mirror() >> LOBE).MV,
        lambda: integral(L(x, t - theta) * V(x, t - theta, along="x") * rho(t)),
    ),
    "R07.33": Equation(lambda: derive(EDGE).value, lambda: lit(theta)),
    "R07.34": Equation(
        lambda: [sp.diff(derive(EDGE).value.expression, w) for w in (x, theta)],
        lambda: [
            sp.DiracDelta(theta - alpha(x)) * alpha_x, -sp.DiracDelta(theta - alpha(x))
        ],
    ),
    "R07.35": Equation(
        lambda: reflected_shadow(1), lambda: transport() - below_edge("theta")
    ),
    "R07.36": Equation(edge_angle, edge_angle_printed),
    "R07.37": Equation(
        lambda: [reflected_shadow(0), half_plane_at_depth()],
        lambda: [below_edge("x") + transport() * alpha_x, half_plane_printed()],
    ),
}  # fmt: skip
