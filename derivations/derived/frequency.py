"""D05 §3 and §4: what each step does to the light and to its spectrum.

D05's curvature is positive on a bump, the library's in a valley; formulas stand in the library's
sign. Of the printed spectra, (9), (10) and (11) are corrected as in the ledger.
"""

from __future__ import annotations

import functools

import sympy as sp

from derivations.derived.compare import (
    LEAVING,
    Equation,
    L,
    L_hat,
    Ot,
    Ov,
    Ox,
    S,
    S_hat,
    after,
    d,
    flat,
    hat,
    integral,
    k,
    n,
    oo,
    pi,
    rho,
    rho_hat,
    t,
    theta,
    unknown,
    v,
    x,
)
from derivations.derived.reflection import WIDE
from firstorder.conventions import FLATLAND_SLOPE, Frame
from firstorder.laws import Integrate, Move, Multiply
from firstorder.symbolic import UnknownField, UnknownLobe, UnknownVaryingLobe, derive
from firstorder.transport import (
    Arrival,
    Blend,
    Bump,
    Cosine,
    Curvature,
    DifferentialIrradiance,
    Incidence,
    Mirror,
    Occlusion,
    Outgoing,
    Reflection,
    Texture,
    Travel,
    diffuse,
    separable,
)

R = sp.Symbol("rho", positive=True)  # a diffuse BRDF is one number
theta_0, theta_1 = sp.symbols("theta_0 theta_1", real=True)
m = sp.Matrix(2, 2, sp.symbols("m_1:3_1:3", real=True))
y, phi, Oy, Op = sp.symbols("y phi Omega_y Omega_phi", real=True)
V, V_hat, T_hat, f_hat = unknown("V", "x"), hat("V", "x"), hat("T", "x"), hat("f", "theta")
T = unknown("T", "x")
L4, L4_hat = unknown("L", "x", "y", "theta", "phi"), hat("L", "x", "y", "theta", "phi")
spotted, spotted_hat = unknown("rho", "x", "theta"), hat("rho", "x", "theta")
PLANAR = UnknownField("V", ("x",))
TEXTURE = Texture(UnknownField("T", ("x",)))
LOBE, SPOTTED = Reflection(UnknownLobe("rho")), Reflection(UnknownVaryingLobe("rho"))
FACTOR = UnknownField("f", ("theta",))
NORMAL = UnknownField("n", ("x",))
ANGLES = Frame(("x", "y", "theta", "phi"))


@functools.cache
def travel():
    return derive(Travel(d), FLATLAND_SLOPE)


@functools.cache
def occlusion(depth=0):
    return derive(Occlusion(PLANAR, depth=depth), FLATLAND_SLOPE)


def incidence():
    """Light that left another surface arrives, and is seen from the tilted one."""
    return derive(Arrival() >> Incidence(theta_0), LEAVING)


def outgoing():
    return derive(Outgoing(theta_1), LEAVING)


def curvature():
    return derive(Curvature(k))


@functools.cache
def cosine():
    return derive(Cosine())


def cosine_transform(Omega):
    """`2 cos(pi^2 Omega) / (1 - (2 pi Omega)^2)`."""
    return 2 * sp.cos(pi**2 * Omega) / (1 - (2 * pi * Omega) ** 2)


def cosine_blur():
    """The convolution's kernel: what the integrand multiplies the light's spectrum by."""
    (integrals,) = cosine().spectrum.expression.atoms(sp.Integral)
    (s, *_), integrand = integrals.limits[0], generic(integrals.function)
    return sp.simplify(integrand / L_hat(Ox, Ot - s)).subs(s, Ot)


def generic(expression):
    """Without the values at removable singularities."""
    return expression.replace(sp.Piecewise, lambda *pairs: pairs[-1][0])


@functools.cache
def diffused():
    """Slopes are looked at to the horizon."""
    return derive(diffuse(R, reach=oo), FLATLAND_SLOPE)


def slope_transform(Omega):
    """`4 pi |Omega| K_1(2 pi |Omega|)`."""
    return 4 * pi * sp.Abs(Omega) * sp.besselk(1, 2 * pi * sp.Abs(Omega))


def irradiance_in_slopes():
    return derive(DifferentialIrradiance(1.0), FLATLAND_SLOPE)


def local_shading():
    """D05 (8): BRDF and cosine of local angles, light and result of global ones."""
    wide = Move([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0]], to=WIDE)
    brdf = Multiply(UnknownField("f", frame=WIDE))
    there, back = Bump(NORMAL), Bump(NORMAL, back=True)
    integrate = Integrate("omega", -pi / 2, pi / 2)
    return derive(after(there, Cosine(), wide, brdf, integrate, back))


def local_shading_printed():
    f, local = unknown("f", "x", "theta", "omega"), theta - n(x)
    return integral(L(x, t + n(x)) * f(x, local, t) * sp.cos(t), t, -pi / 2, pi / 2)


def in_space():
    return derive(Curvature(m), ANGLES)


def blended():
    """Two lobes, each with a texture."""
    lobes = tuple(UnknownLobe(f"rho_{i}") for i in (1, 2))
    weights = tuple(UnknownField(f"T_{i}", ("x",)) for i in (1, 2))
    return derive(Reflection(Blend(lobes, weights)), LEAVING)


def blended_printed():
    terms = (unknown(f"T_{i}", "x")(x) * unknown(f"rho_{i}", "theta")(t) for i in (1, 2))
    return integral(L(x, theta - t) * sum(terms))


def reflected_twice_turned():
    return derive(Curvature(k) >> Mirror() >> LOBE >> Curvature(k, back=True))


MIRRORED = Equation(lambda: derive(Mirror()).spectrum, lambda: L_hat(Ox, -Ot))
BLURRED = Equation(lambda: derive(LOBE, LEAVING).spectrum, lambda: L_hat(Ox, Ot) * rho_hat(Ot))
TRAVELLED = Equation(lambda: travel().spectrum, lambda: S_hat(Ox, Ov + d * Ox))
OCCLUDED = Equation(lambda: occlusion().spectrum, lambda: integral(S_hat(Ox - t, Ov) * V_hat(t)))
ARRIVED = Equation(
    lambda: incidence().spectrum,
    lambda: (
        sp.exp(-2 * pi * sp.I * Ot * theta_0)
        / sp.Abs(sp.cos(theta_0))
        * L_hat(-Ox / sp.cos(theta_0), Ot)
    ),
)
LEFT = Equation(
    lambda: outgoing().spectrum,
    lambda: (
        sp.exp(2 * pi * sp.I * Ot * theta_1)
        * sp.Abs(sp.cos(theta_1))
        * L_hat(Ox * sp.cos(theta_1), Ot)
    ),
)
SHEARED = Equation(lambda: curvature().spectrum, lambda: L_hat(Ox - k * Ot, Ot))
COSINE = Equation(
    lambda: generic_integral(cosine().spectrum),
    lambda: integral(L_hat(Ox, Ot - t) * cosine_transform(t)),
)
PAINTED = Equation(lambda: derive(TEXTURE).spectrum, lambda: integral(T_hat(t) * L_hat(Ox - t, Ot)))
SEPARABLE = Equation(
    lambda: derive(separable(UnknownLobe("rho"), incoming=FACTOR)).spectrum,
    lambda: rho_hat(Ot) * integral(L_hat(Ox, -Ot - t) * f_hat(t)),
)
SEMI = Equation(
    lambda: derive(SPOTTED, LEAVING).spectrum,
    lambda: integral(L_hat(Ox - t, Ot) * spotted_hat(t, Ot)),
)


def generic_integral(formula):
    """An integral whose integrand is known but at single frequencies, with its kernel in short."""
    (found,) = formula.expression.atoms(sp.Integral)
    ((s, *_),) = found.limits
    light = L_hat(Ox, Ot - s)
    return integral(light * sp.simplify(generic(found.function) / light), s)


DERIVED = {
    "D05.2": Equation(lambda: travel().value, lambda: S(x - v * d, v)),
    "D05.s3.1a": TRAVELLED,
    "D05.3": TRAVELLED,
    "D05.4": Equation(lambda: occlusion().value, lambda: S(x, v) * V(x)),
    "D05.5": OCCLUDED,
    "D05.s3.2a": OCCLUDED,
    "D05.6": Equation(
        lambda: diffused().value,
        lambda: R * integral(S(x, t) / (1 + t**2) ** sp.Rational(3, 2)),
    ),
    "D05.s3.3b": Equation(
        lambda: irradiance_in_slopes().value,
        lambda: S(x, v) / (1 + v**2) ** sp.Rational(3, 2),
    ),
    "D05.s3.3c": Equation(
        lambda: irradiance_in_slopes().spectrum,
        lambda: integral(S_hat(Ox, Ov - t) * slope_transform(t)),
    ),
    "D05.s3.3d": Equation(
        lambda: derive(Integrate("v", -oo, oo), FLATLAND_SLOPE).spectrum, lambda: S_hat(Ox, 0)
    ),
    "D05.7": Equation(
        lambda: diffused().spectrum, lambda: R * integral(S_hat(Ox, -t) * slope_transform(t))
    ),
    "D05.8": Equation(lambda: local_shading().value, local_shading_printed),
    "D05.s4.1a": Equation(
        lambda: incidence().value, lambda: L(-x * sp.cos(theta_0), theta - theta_0)
    ),
    "D05.9": ARRIVED,
    "D05.10": LEFT,
    "D05.11": SHEARED,
    "D05.s4.1c": Equation(
        lambda: generic_cosine(), lambda: L(x, theta) * sp.cos(theta)
    ),
    "D05.12": COSINE,
    "D05.13": Equation(cosine_blur, lambda: cosine_transform(Ot)),
    "D05.s4.1e": Equation(lambda: derive(Mirror()).value, lambda: L(x, -theta)),
    "D05.14": MIRRORED,
    "D05.15": Equation(
        lambda: derive(LOBE, LEAVING).value, lambda: integral(L(x, theta - t) * rho(t))
    ),
    "D05.16": BLURRED,
    "D05.s4.1g": Equation(
        lambda: [reflected_twice_turned().value, reflected_twice_turned().spectrum],
        lambda: [
            integral(L(x, 2 * k * x - theta + t) * rho(t)),
            L_hat(Ox + 2 * k * Ot, -Ot) * rho_hat(Ot),
        ],
    ),
    "D05.17": SEPARABLE,
    "D05.s4.3b": Equation(
        lambda: derive(separable(UnknownLobe("rho"), outgoing=FACTOR)).spectrum,
        lambda: integral(L_hat(Ox, -(Ot - t)) * rho_hat(Ot - t) * f_hat(t)),
    ),
    "D05.18": PAINTED,
    "D05.s4.5": SEMI,
    "D05.s4.5b": BLURRED,
    "D05.s4.5c": Equation(
        lambda: derive(LOBE >> TEXTURE, LEAVING).spectrum,
        lambda: integral(L_hat(Ox - t, Ot) * rho_hat(Ot) * T_hat(t)),
    ),
    "D05.s4.5d": Equation(lambda: blended().value, blended_printed),
    "D05.19": Equation(
        lambda: in_space().value,
        lambda: L4(
            x, y, theta + m[0, 0] * x + m[0, 1] * y, phi + m[1, 0] * x + m[1, 1] * y
        ),
    ),
    "D05.T1.1": TRAVELLED,
    "D05.T1.2": OCCLUDED,
    "D05.T1.3": ARRIVED,
    "D05.T1.4": LEFT,
    "D05.T1.5": SHEARED,
    "D05.T1.6": COSINE,
    "D05.T1.7": BLURRED,
    "D05.T1.8": PAINTED,
    "D05.T1.9": SEPARABLE,
    "D05.T1.10": SEMI,
}  # fmt: skip


def generic_cosine():
    """Above the horizon."""
    return flat(cosine().value)[0].replace(sp.Piecewise, lambda *pairs: pairs[0][0])
