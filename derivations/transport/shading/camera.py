"""The image gradient, from the projection and the shape of the base.

R07 §5.3. A point `p(x)` of the base obeys `p' = (cos n_0, sin n_0)`, `n_0' = kappa`; the eye sees
it at `px = gamma (p_x - e_x) / (e_y - p_y)`. Everything else is implicit differentiation of that.
"""

from __future__ import annotations

import functools

import jax
import jax.numpy as jnp
import numpy as np
import sympy as sp

from derivations.squares import square_error
from firstorder.checks.tolerance import fitted_order, normwise
from firstorder.fields import Jet
from firstorder.ledger import Check, Counterexample, Row, na
from firstorder.transport.shading.camera import (
    BaseSurface,
    Camera,
    distant_image_gradient,
    image_jet,
)

MODULE = "firstorder.transport.shading.camera"
STEP = 1e-30

x, q = sp.symbols("x x_perp", real=True)
gamma, z = sp.symbols("gamma z", positive=True)
n, kappa = sp.symbols("n_0 kappa", real=True)


def projection():
    """px, the direction to the eye, and both as functions of arc length, to second order.

    At arc length 0 the point lies z below the eye and q beside it.
    """
    # p(x) to second order: tangent (cos n, sin n), bending along the normal (-sin n, cos n)
    px = q + sp.cos(n) * x - kappa * sp.sin(n) * x**2 / 2
    py = sp.sin(n) * x + kappa * sp.cos(n) * x**2 / 2
    image = gamma * px / (z - py)
    return image, sp.atan2(px, z - py)


def first_derivatives():
    """(27): `dx/dpx = 1 / (dpx/dx)`, and theta is the angle of the direction to the eye."""
    image, theta = projection()
    step = 1 / image.diff(x).subs(x, 0)
    D = sp.sqrt(z**2 + q**2)
    # direction(theta) = (-sin, cos) points from the surface to the eye: (-q, z) / D
    n_v = (sp.cos(n) * z + sp.sin(n) * q) / D  # normal (-sin n, cos n) . (-q, z) / D
    u = gamma * q / z
    turn = (theta.diff(x) / image.diff(x)).subs(x, 0)
    local = sp.cos(sp.atan(q / z) - n)
    return (
        sp.simplify(step - z**2 / (gamma * D * n_v)),
        sp.simplify(turn - 1 / (gamma + u**2 / gamma)),
        sp.simplify(sp.expand_trig(local) - n_v),
    )


def second_derivatives():
    """`d2x/dpx2 = -px'' / px'^3`, against the closed form of `Camera.derivatives`."""
    image, _ = projection()
    i1, i2 = image.diff(x).subs(x, 0), image.diff(x, 2).subs(x, 0)
    D2 = z**2 + q**2
    cos_l = (sp.cos(n) * z + sp.sin(n) * q) / sp.sqrt(D2)
    sin_l = (q * sp.cos(n) - z * sp.sin(n)) / sp.sqrt(D2)
    step, turn = z**2 / (gamma * sp.sqrt(D2) * cos_l), z**2 / (gamma * D2)
    rate = -sp.sin(n) * step / z - q / z * turn + sin_l / cos_l * (turn - kappa * step)
    u = sp.symbols("u", real=True)
    bend = sp.diff(1 / (gamma + u**2 / gamma), u)
    s, c = q / sp.sqrt(D2), z / sp.sqrt(D2)
    return (
        sp.simplify(-i2 / i1**3 - step * rate),
        sp.simplify(bend.subs(u, gamma * q / z) + 2 * s * c * turn / gamma),
    )


def chain():
    """(26), and the second derivative: the chain rule on a generic 2-jet of B."""
    u, x1, x2, t1, t2 = sp.symbols("u x_u x_uu theta_u theta_uu", real=True)
    bx, bt, bxx, bxt, btt = sp.symbols("B_x B_theta B_xx B_xtheta B_thetatheta", real=True)
    dx, dt = x1 * u + x2 * u**2 / 2, t1 * u + t2 * u**2 / 2
    image = bx * dx + bt * dt + bxx * dx**2 / 2 + bxt * dx * dt + btt * dt**2 / 2
    C, H = sp.Matrix([x1, t1]), sp.Matrix([[bxx, bxt], [bxt, btt]])
    second = (C.T * H * C)[0] + bx * x2 + bt * t2
    return image.diff(u).subs(u, 0) - (bx * x1 + bt * t1), image.diff(u, 2).subs(u, 0) - second


def far_camera():
    """What (28) is off by, for a point at the place q beside the eye: gamma is not in it.

    I_u is what a step along the base changes, per step in the image. Over (28) it is
    `(z / D) (1 + (n . v) B_theta / (D B_x))`, D the distance: below the eye `z / D` is 1.
    """
    bx, bt = sp.symbols("B_x B_theta", real=True)
    image, theta = projection()
    I_u = ((bx + bt * theta.diff(x)) / image.diff(x)).subs(x, 0)
    D = sp.sqrt(z**2 + q**2)
    n_v = (sp.cos(n) * z + sp.sin(n) * q) / D
    ratio = I_u / (z / (gamma * n_v) * bx)
    return (
        sp.simplify(ratio - z / D * (1 + n_v * bt / (D * bx))),
        sp.simplify(ratio.subs(q, 0) - 1 - sp.cos(n) * bt / (z * bx)),
        sp.simplify(ratio.diff(gamma)),
    )


# --- brute force: rays and circles in NumPy, complex steps -------------------------------------

POSES = (
    (0.0, 0.0, (0.3, 2.0)),
    (0.0, 0.35, (0.1, 1.6)),
    (-0.5, -0.2, (0.4, 2.2)),
    (0.3, 0.1, (-0.2, 1.9)),
)
# No ray is near a tangent of the hill, where differences of derivatives are worth nothing.
PX, GAMMA = (-0.25, 0.0, 0.2), 1.3


def trace(px, kappa, n_0, eye, gamma=GAMMA):
    """Arc length and direction of the ray through px, by Newton on the curve's own integral."""
    s, w = np.polynomial.legendre.leggauss(20)
    arc = 0.0 * px

    def point(arc):
        angle = n_0 + kappa * 0.5 * arc * (s + 1.0)
        return 0.5 * arc * np.sum(w * np.cos(angle)), 0.5 * arc * np.sum(w * np.sin(angle))

    for _ in range(30):
        X, Y = point(arc)
        miss = gamma * (X - eye[0]) - px * (eye[1] - Y)
        a = n_0 + kappa * arc
        arc = arc - miss / (gamma * np.cos(a) + px * np.sin(a))
    if not np.iscomplexobj(px):
        return arc, np.arctan(px / gamma)
    slope = px.real / gamma  # NumPy's arctan loses digits of a tiny imaginary part
    return arc, np.arctan(slope) + 1j * px.imag / gamma / (1.0 + slope**2)


def _slope(px, kappa, n_0, eye, gamma=GAMMA):
    """dx/dpx and dtheta/dpx."""
    return [c.imag / STEP for c in trace(px + 1j * STEP, kappa, n_0, eye, gamma)]


def view_error(order):
    """Camera rays and their derivatives against the traced ones, all poses."""
    worst = 0.0
    for k, n_0, eye in POSES:
        camera = Camera(eye, GAMMA, BaseSurface(k, n_0))
        views = jax.jit(jax.vmap(camera.derivatives))(jnp.asarray(PX))
        truth = []
        for px in PX:
            if order == 0:
                truth.append(trace(px, k, n_0, eye))
            elif order == 1:
                truth.append(_slope(px, k, n_0, eye))
            else:
                h, c = 1e-3, np.array([3.0 / 4.0, -3.0 / 20.0, 1.0 / 60.0])
                ends = np.array([_slope(px + k_ * h, k, n_0, eye) for k_ in (1, 2, 3)])
                ends -= np.array([_slope(px - k_ * h, k, n_0, eye) for k_ in (1, 2, 3)])
                truth.append(c @ ends / h)
        ours = (views.x, views.theta), (views.dx, views.dtheta), (views.ddx, views.ddtheta)
        worst = max(worst, normwise(np.stack(ours[order], -1), np.array(truth)))
    return worst


def autodiff_error():
    """Closed forms against autodiff of the ray through px."""
    worst = 0.0
    for k, n_0, eye in POSES[1:3]:
        camera = Camera(eye, GAMMA, BaseSurface(k, n_0))

        def both(px, camera=camera):
            def ray(p):
                v = camera.derivatives(p)
                return jnp.stack([v.x, v.theta])

            v = camera.derivatives(px)
            closed = jnp.stack([v.dx, v.dtheta]), jnp.stack([v.ddx, v.ddtheta])
            return closed, (jax.jacfwd(ray)(px), jax.jacfwd(jax.jacfwd(ray))(px))

        closed, truth = jax.jit(jax.vmap(both))(jnp.asarray(PX))
        worst = max([worst, *map(normwise, closed, truth)])
    return worst


def _seen(kappa, z, px, gamma):
    """Camera ray and jet of the light there: a glossy surface of curvature kappa, distant light."""
    view = Camera((0.0, z), gamma, BaseSurface(kappa, 0.0)).derivatives(jnp.asarray(px))
    w, turn = 2.0 * kappa * view.x - view.theta, jnp.array([2.0 * kappa, -1.0])
    bell = jnp.exp(-0.5 * ((w - 0.2) / 0.5) ** 2)  # light already convolved
    slope = -(w - 0.2) / 0.25
    jet = Jet(bell, slope * bell * turn, (slope**2 - 4.0) * bell * jnp.outer(turn, turn))
    return view, jet


def image_gradient(kappa, z, distant, px=0.05, gamma=1.0):
    """I_u of a curved glossy surface under distant light, traced; and the library's (28)."""
    if distant:
        view, B = _seen(kappa, z, px, gamma)
        down = 0.0 if kappa == 0.0 else (1.0 - np.cos(kappa * view.x)) / kappa
        return float(distant_image_gradient(view, kappa * view.x, z - down, gamma, B))

    def image(p):
        arc, theta = trace(p, kappa, 0.0, (0.0, z), gamma)
        return np.exp(-0.5 * ((2.0 * kappa * arc - theta - 0.2) / 0.5) ** 2)

    return float(image(px + 1j * STEP).imag / STEP)


def jet_error():
    """(26): the library's image jet against the traced image's slope."""
    worst = 0.0
    for kappa, z, px in ((0.4, 2.0, 0.05), (-0.3, 3.0, -0.2)):
        ours = float(image_jet(*_seen(kappa, z, px, 1.0))[1])
        worst = max(worst, abs(ours / image_gradient(kappa, z, False, px) - 1.0))
    return worst


def distant_order():
    """The error of (28) relative to I_u, for cameras further and further up: order -1."""
    heights = np.array([200.0, 400.0, 800.0])

    def miss(z):
        # the same point of a hill, seen near the centre of the image: x_perp fixed, px = x_perp / z
        px, k = 0.05 / z, -0.5
        return abs(1.0 - image_gradient(k, z, True, px) / image_gradient(k, z, False, px))

    return abs(fitted_order(heights, [miss(h) for h in heights]) + 1.0)


def overhead_order():
    """§5.3's first example: I_u ~ B_theta / gamma near the centre, relative: order 2 in u/gamma.

    By the library's rays and by traced ones.
    """
    eye, u = (0.0, 2.0), np.array([0.1, 0.05, 0.025])
    ours = [float(Camera(eye, 1.0).derivatives(jnp.asarray(c)).dtheta) for c in u]
    traced = [_slope(c, 0.0, 0.0, eye, 1.0)[1] for c in u]  # B_x = 0: the step along x is no matter
    misses = (np.abs(1.0 - np.array(turns)) for turns in (ours, traced))
    return max(abs(fitted_order(u, miss) - 2.0) for miss in misses)


def scale_order():
    """dx/du against z / (gamma n_0 . v): relative error of order 2 in x_perp / z."""
    n_0, eye = 0.3, (0.0, 2.0)

    def miss(px):
        arc, _ = trace(px, 0.0, n_0, eye, 1.0)
        step = trace(px + 1j * STEP, 0.0, n_0, eye, 1.0)[0].imag / STEP
        view = Camera(eye, 1.0, BaseSurface(0.0, n_0)).derivatives(jnp.asarray(px))
        B = Jet(jnp.zeros(()), jnp.array([1.0, 0.0]), jnp.zeros((2, 2)))
        ours = distant_image_gradient(view, n_0, eye[1] - np.sin(n_0) * arc, 1.0, B)
        return abs(1.0 - float(ours) / step)

    u = np.array([0.1, 0.05, 0.025])
    return abs(fitted_order(u, [miss(c) for c in u]) - 2.0)


CAMERA = f"{MODULE}.Camera"
ROWS = [
    Row(
        "R07.s5.3a",
        "definition",
        implements=CAMERA,
        symbolic=na("definition"),
        autodiff=na("definition"),
        fourier=na("definition"),
        brute_force=Check(functools.partial(view_error, 0), 1e-12),
    ),
    Row(
        "R07.26",
        "identity",
        implements=f"{MODULE}.image_jet",
        symbolic=chain,
        autodiff=Check(lambda: square_error("camera", "gradient"), 1e-10),
        fourier=na("no spectrum"),
        brute_force=Check(lambda: max(square_error("camera", "value"), jet_error()), 1e-10),
        note="With the second derivative, which the paper does not give.",
    ),
    Row(
        "R07.27",
        "identity",
        implements=f"{MODULE}.Camera.derivatives",
        symbolic=lambda: [*first_derivatives(), *second_derivatives()],
        autodiff=Check(autodiff_error, 1e-10),
        fourier=na("no spectrum"),
        brute_force=Check(lambda: max(view_error(1), view_error(2)), 1e-10),
        note="Both signs are + in our convention: px grows with x, and the way back to the eye "
        "turns counter-clockwise. The base's curvature enters the second derivative only.",
    ),
    Row(
        "R07.s5.3b",
        "approximation",
        implements=f"{MODULE}.Camera.derivatives",
        symbolic=na("measured"),
        autodiff=na("scale"),
        fourier=na("no spectrum"),
        brute_force=Check(overhead_order, 0.05),
        note="Order 2 in u / gamma; at fixed B_theta.",
    ),
    Row(
        "R07.s5.3c",
        "approximation",
        implements=f"{MODULE}.distant_image_gradient",
        symbolic=na("measured"),
        autodiff=na("scale"),
        fourier=na("no spectrum"),
        brute_force=Check(scale_order, 0.1),
        note="Order 2 in x_perp / z.",
    ),
    Row(
        "R07.28",
        "over-claim",
        implements=f"{MODULE}.distant_image_gradient",
        symbolic=far_camera,
        autodiff=na("measured"),
        fourier=na("no spectrum"),
        brute_force=Check(distant_order, 0.1),
        corrected="holds where z |B_x| >> (n_0 . v) |B_theta|, whatever gamma is; order 1 in 1/z",
        counterexample=Counterexample(
            {"kappa": 0.0, "z": 1000.0},
            printed=lambda kappa, z: image_gradient(kappa, z, True),
            true=lambda kappa, z: image_gradient(kappa, z, False),
        ),
        note="A flat surface in distant light has B_x = 0, but its highlights are seen from afar. "
        "Both parts scale with 1 / gamma, so a large gamma does not help.",
    ),
]
