"""Directions near an equator: D05 §5.2, from rotations of the sphere and straight rays.

Exact are the longitude's shift at incidence and the mirror. The rest is first order about the
central ray; D05's shear by curvature is not even that once the ray is aslant, for a normal that
leans across the plane of incidence turns the ray's latitude by its cosine alone.
"""

from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np
import sympy as sp

from derivations.transport.chain4d import _space_tracer as tracer
from derivations.transport.events._rotation_proofs import four_dimensional_shear
from firstorder.checks.tolerance import fitted_order
from firstorder.conventions import SPACE
from firstorder.laws import Move, Warp
from firstorder.ledger import Check, Counterexample, Row, na
from firstorder.transport.chain4d._equator import Bend, Oblique, Turn
from firstorder.transport.chain4d.chain import GlossyPatch
from firstorder.transport.events.cosine import ClampedCosine
from firstorder.transport.events.incidence import Incidence
from firstorder.transport.events.mirror import Mirror
from firstorder.transport.events.reflection import Reflection

SIZES = np.array([0.02, 0.04, 0.08])
RAY = np.array([0.5, -0.6, 0.4, 0.3])
theta, phi, tilt = sp.symbols("theta phi theta_0", real=True)


def unit(a, b):
    """Direction at longitude a and latitude b."""
    return sp.Matrix([-sp.sin(a) * sp.cos(b), -sp.sin(b), sp.cos(a) * sp.cos(b)])


# --- proofs --------------------------------------------------------------------------------------


def leaning_normal():
    """How the angles of a fixed ray on the equator change in a frame that leans by small angles.

    The frame of a normal at the angles (a, b) is the first one turned about n0 x n.
    """
    e = sp.Symbol("e")
    a, b = sp.symbols("a b", real=True)
    lean = sp.Matrix([-a, -b, 0])  # dn to first order
    axis = sp.Matrix([0, 0, 1]).cross(lean)
    w = unit(tilt, 0)
    local = w - e * axis.cross(w)  # the inverse turn, to first order
    longitude = sp.diff(sp.atan2(-local[0], local[2]), e).subs(e, 0)
    latitude = sp.diff(sp.asin(-local[1]), e).subs(e, 0)
    found = [sp.simplify(longitude + a), sp.simplify(latitude + b * sp.cos(tilt))]
    return [*found, four_dimensional_shear()]


def met_in_space():
    """Where the ray (X, Y, theta, phi) of a surface crosses the plane across the central ray."""
    X, Y = sp.symbols("X Y", real=True)
    c, s = sp.cos(tilt), sp.sin(tilt)
    frame = sp.Matrix([[c, 0, -s], [0, 1, 0], [s, 0, c]])
    p, w = frame.T * sp.Matrix([X, Y, 0]), frame.T * unit(theta, phi)
    at = p - w * (p[2] / w[2])
    there = theta - tilt
    exact = sp.Matrix(
        [
            X * sp.cos(theta) / sp.cos(there),
            Y - X * sp.sin(tilt) * sp.tan(phi) / sp.cos(there),
        ]
    )
    central = {X: 0, Y: 0, theta: tilt, phi: 0}
    J = exact.jacobian([X, Y, theta, phi]).subs(central)
    first = sp.Matrix([[c, 0, 0, 0], [0, 1, 0, 0]])
    shifted = w - unit(there, phi)  # the longitude shifts, the latitude stays
    return [
        *(at[:2, :] - exact).applyfunc(sp.simplify),
        *(J - first).applyfunc(sp.simplify),
        *shifted.applyfunc(sp.simplify),
    ]


def cosine_on_the_equator():
    """`n . w / cos(theta)` of a direction turned off the equator: `1 - phi^2 / 2`, no first order.

    The direction is the pole's, turned by the latitude and then by the longitude. Of a normal off
    the equator, at the latitude b, the cosine has a first order: sin(b), so n must lie on it.
    """
    b = sp.Symbol("b", real=True)

    def turned(longitude, latitude):
        (c, s), (p, q) = ((sp.cos(u), sp.sin(u)) for u in (longitude, latitude))
        about_y = sp.Matrix([[c, 0, -s], [0, 1, 0], [s, 0, c]])
        about_x = sp.Matrix([[1, 0, 0], [0, p, -q], [0, q, p]])
        return about_y * about_x * sp.Matrix([0, 0, 1])

    w = turned(theta, phi)
    ratio = turned(0, 0).dot(w) / sp.cos(theta)
    off = turned(0, b).dot(w).diff(phi).subs(phi, 0)
    return [
        *(w - unit(theta, phi)),
        ratio.subs(phi, 0) - 1,
        ratio.diff(phi).subs(phi, 0),
        ratio.diff(phi, 2).subs(phi, 0) + 1,
        off - sp.sin(b),
    ]


def mirrored_angles():
    """The mirror about the normal negates both angles, exactly."""
    w = unit(theta, phi)
    return list(sp.Matrix([-w[0], -w[1], w[2]]) - unit(-theta, -phi))


def distance_near_the_equator():
    """`cos g = w . w'`: to second order in all four angles g^2 is the sum of two squares."""
    e, a, b, p, q = sp.symbols("e a b p q", real=True)
    cosine = unit(e * a, e * p).dot(unit(e * b, e * q))
    square = sp.series(2 * (1 - cosine), e, 0, 4).removeO()
    return sp.expand(square - e**2 * ((a - b) ** 2 + (p - q) ** 2))


def two_equators():
    """Axes turned about a ray on both equators: new angles are old ones, turned plane."""
    turn, e = sp.symbols("alpha e", real=True)
    c, s = sp.cos(turn), sp.sin(turn)
    R = sp.Matrix([[c, -s, 0], [s, c, 0], [0, 0, 1]])
    w = R * unit(e * theta, e * phi)
    found = sp.Matrix([sp.atan2(-w[0], w[2]), sp.asin(-w[1])])
    first = found.diff(e).subs(e, 0)
    second = found.diff(e, 2).subs(e, 0)
    plane = R[:2, :2] * sp.Matrix([theta, phi])
    return [*(first - plane).applyfunc(sp.simplify), *second.applyfunc(sp.simplify)]


# --- numbers -------------------------------------------------------------------------------------


def _touch(warp: Warp, ray) -> np.ndarray:
    return np.asarray(jax.jacfwd(warp.map)(jnp.asarray(ray)))


def bend_by_autodiff() -> float:
    """The shear against the Jacobian of the sphere's rotation."""
    S, at = jnp.array([[-0.5, 0.13], [0.13, 0.3]]), [0.0, 0.0, 0.7, 0.0]
    exact, first = (Bend(S, 0.7, exact=e).law(SPACE) for e in (True, False))
    assert isinstance(exact, Warp)
    assert isinstance(first, Move)
    return float(np.max(np.abs(_touch(exact, at) - np.asarray(first.M))))


def oblique_by_autodiff() -> float:
    """The footprint's scale against the Jacobian of the exact meeting."""
    exact, first = Oblique(0.7).law(SPACE), Incidence(0.7).law(SPACE)
    assert isinstance(exact, Warp)
    assert isinstance(first, Move)
    return float(np.max(np.abs(_touch(exact, [0.0, 0.0, 0.7, 0.0]) - np.asarray(first.M))))


def turn_by_autodiff() -> float:
    """A turn's move against its warp's Jacobian, at a ray away from longitude zero."""
    away = 0.4
    roll = tracer.tilted(away) @ tracer.spun(0.6) @ tracer.tilted(away).T
    R = jnp.asarray(tracer.tilted(-0.3) @ roll)
    exact, first = Turn(R).law(SPACE), Turn(R, at=away).law(SPACE)
    assert isinstance(exact, Warp)
    assert isinstance(first, Move)
    return float(np.max(np.abs(_touch(exact, [0.0, 0.0, away, 0.0]) - np.asarray(first.M))))


def traced_latitude(theta0, k2, y) -> float:
    """Latitude that a ray of the equator has in the frame of the normal at (0, y), by vectors."""
    n = np.array([0.0, -k2 * y, 1.0])
    n /= np.linalg.norm(n)
    side = np.array([1.0, 0.0, 0.0])  # the first axis does not turn: the normal leans across it
    w = np.array([-np.sin(theta0), 0.0, np.cos(theta0)])
    return float(np.arcsin(-(w @ np.cross(n, side))))


def shear_order() -> float:
    """Order of what the corrected shear misses: traced rays against it."""
    errors = [abs(traced_latitude(0.9, 0.8, h) + 0.8 * h * np.cos(0.9)) for h in SIZES]
    return abs(fitted_order(SIZES, errors) - 3.0)


def footprint_order() -> float:
    """Order of what the scale of x alone misses, by traced rays."""
    errors = []
    for h in SIZES:
        u = h * RAY
        frame = tracer.tilted(0.7)
        w = np.array(
            [
                -np.sin(0.7 + u[2]) * np.cos(u[3]),
                -np.sin(u[3]),
                np.cos(0.7 + u[2]) * np.cos(u[3]),
            ]
        )
        met = tracer.coordinates(frame, np.array([u[0], u[1], 0.0]), w)
        errors.append(np.linalg.norm(met[:2] - [u[0] * np.cos(0.7), u[1]]))
    return abs(fitted_order(SIZES, errors) - 2.0)


def cosine_order() -> float:
    """Order in the latitude of what the library's `cos+(theta)` leaves of n . w."""
    rays = [jnp.array([0.0, 0.0, 0.7, h]) for h in SIZES]
    errors = [abs(float(ClampedCosine(frame=SPACE).at(u)) - _vector(*u[2:])[2]) for u in rays]
    return abs(fitted_order(SIZES, errors) - 2.0)


def _vector(a, b):
    return np.array([-np.sin(a) * np.cos(b), -np.sin(b), np.cos(a) * np.cos(b)])


def distance_order() -> float:
    """Order of the error of the plane distance of two directions near the equator.

    It is read from the library's lobe of a patch, a Gaussian of the distance: two factors.
    """
    sigma, errors = 0.3, []
    events = GlossyPatch(jnp.zeros((2, 2)), sigma=sigma).chain().events
    lobes = [e.lobe for e in events if isinstance(e, Reflection)]
    for h in SIZES:
        a, b = _vector(0.8 * h, 0.9 * h), _vector(-0.5 * h, 0.4 * h)
        exact = np.arctan2(np.linalg.norm(np.cross(a, b)), a @ b)
        apart = jnp.array([0.0, 0.0, 1.3 * h, 0.5 * h])
        fall = float(sum(jnp.log(rho.at(0.0 * apart) / rho.at(apart)) for rho in lobes))
        errors.append(abs(exact - sigma * np.sqrt(2.0 * fall)))
    return abs(fitted_order(SIZES, errors) - 3.0)


def mirror_by_vectors() -> float:
    """Both angles negated against the mirror image of a vector."""
    w, n = _vector(0.6, 0.3), np.array([0.0, 0.0, 1.0])
    return float(np.linalg.norm(2.0 * (n @ w) * n - w - _vector(-0.6, -0.3)))


def mirror_by_autodiff() -> float:
    """The move against the Jacobian of mirrored vectors' angles, away from the equator."""

    def image(u):
        a, b = u
        w = jnp.stack([-jnp.sin(a) * jnp.cos(b), -jnp.sin(b), jnp.cos(a) * jnp.cos(b)])
        n = jnp.array([0.0, 0.0, 1.0])
        m = 2.0 * (n @ w) * n - w
        return jnp.stack([jnp.arctan2(-m[0], m[2]), jnp.arcsin(-m[1])])

    law = Mirror().law(SPACE)
    assert isinstance(law, Move)
    J = np.eye(4)
    J[2:, 2:] = np.asarray(jax.jacfwd(image)(jnp.asarray(RAY[2:])))
    return float(np.max(np.abs(J - np.asarray(law.M))))


def turn_order() -> float:
    """Order of what the plane rotation misses."""
    errors = []
    for h in SIZES:
        w = tracer.spun(0.6) @ _vector(0.8 * h, 0.6 * h)
        exact = np.array([np.arctan2(-w[0], w[2]), np.arcsin(-w[1])])
        errors.append(np.linalg.norm(exact - tracer.spun(0.6)[:2, :2] @ [0.8 * h, 0.6 * h]))
    return abs(fitted_order(SIZES, errors) - 3.0)


HERE = "firstorder.transport.chain4d._equator"

ROWS = [
    Row(
        "D05.s5.2c",
        "over-claim",
        f"{HERE}.Bend",
        leaning_normal,
        autodiff=Check(bend_by_autodiff, 1e-14),
        fourier=na("two routes"),
        brute_force=Check(shear_order, 0.1),
        corrected="lhat(O_x - k_1 O_theta, O_y - k_2 cos(theta_0) O_phi, O_theta, O_phi), theta_0 "
        "the ray's own longitude; with any M, its second row takes the cosine",
        counterexample=Counterexample(
            {"theta0": 1.0, "k2": 0.5, "y": 0.02}, lambda theta0, k2, y: -k2 * y, traced_latitude
        ),
        note="Printed right at normal incidence alone: at theta_0 the latitude turns by "
        "cos(theta_0) k_2 y. First order, so no small neighbourhood helps; with the footprint's "
        "1 / cos on the other axis these are Coddington's two powers (C.space.chain).",
    ),
    Row(
        "D05.s5.2d",
        "approximation",
        f"{HERE}.Oblique",
        met_in_space,
        autodiff=Check(oblique_by_autodiff, 1e-14),
        fourier=na("two routes"),
        brute_force=Check(footprint_order, 0.1),
        note="Second order in position: y is off by x sin(theta_0) phi, x by x sin(theta_0) (theta "
        "- theta_0). Longitude and latitude are exact.",
    ),
    Row(
        "D05.s5.2e",
        "approximation",
        "firstorder.transport.events.cosine.ClampedCosine",
        cosine_on_the_equator,
        autodiff=na("no derivative"),
        fourier=na("no spectrum"),
        brute_force=Check(cosine_order, 0.1),
        note="Relative error phi^2 / 2; exactly the product of both cosines, two convolutions.",
    ),
    Row(
        "D05.s5.2f",
        "identity",
        "firstorder.transport.events.mirror.Mirror",
        mirrored_angles,
        autodiff=Check(mirror_by_autodiff, 1e-14),
        fourier=na("two routes"),
        brute_force=Check(mirror_by_vectors, 1e-15),
        note="Exact at any latitude; the directions stay near the equator.",
    ),
    Row(
        "D05.s5.2g",
        "approximation",
        "firstorder.transport.chain4d.chain.GlossyPatch",
        distance_near_the_equator,
        autodiff=na("no derivative"),
        fourier=na("no spectrum"),
        brute_force=Check(distance_order, 0.1),
        note="Third order in the angles, relative error of second order in the latitude.",
    ),
    Row(
        "D05.s5.2h",
        "approximation",
        f"{HERE}.Turn",
        two_equators,
        autodiff=Check(turn_by_autodiff, 1e-14),
        fourier=na("two routes"),
        brute_force=Check(turn_order, 0.1),
        note="Third order about a ray on both equators; the turn across the ray, in slopes, is "
        "exact, and the last one turns positions too.",
    ),
]
