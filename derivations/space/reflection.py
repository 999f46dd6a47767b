"""Reflection from curved surfaces in space: R07 Appendix B and §5.1."""

from __future__ import annotations

import functools

import numpy as np

from derivations.ledger import Check, Counterexample, Row, na
from derivations.space import _reflection_printed as printed
from derivations.space import _reflection_proofs as proofs
from derivations.space import _surfaces as our
from firstorder.checks.tolerance import fitted_order, normwise

MODULE = "firstorder.space.reflection"

# --- numeric: the library against autodiff and against differences --------------------------------


def _arrays():
    import jax.numpy as jnp

    return [jnp.asarray(a) for a in (our.PLACE, our.AXES, our.S, our.LOCAL, our.TO_EYE)]


def _jax_light(x, w):
    import jax.numpy as jnp

    return our.light(x, w, jnp)


def _jax_moved(step):
    """Position and carried frame after a step (2,) on the ellipsoid, in JAX."""
    import jax.numpy as jnp

    x, axes, _, _, _ = _arrays()
    y = x + axes[:, :2] @ step
    y = y / jnp.sqrt(jnp.sum((y / our.RADII) ** 2))
    m = y / our.RADII**2
    m, n = m / jnp.sqrt(m @ m), axes[:, 2]
    v = jnp.cross(n, m)
    return y, axes + jnp.cross(v[:, None], axes, axis=0) + jnp.cross(
        v[:, None], jnp.cross(v[:, None], axes, axis=0), axis=0
    ) / (1.0 + n @ m)


@functools.cache
def _in_frame():
    """The library's gradient in the surface's frame, beside autodiff of the composition."""
    import jax
    import jax.numpy as jnp

    from firstorder.space.reflection import in_frame

    x, axes, S, w, _ = _arrays()
    L_x, L_w = jax.grad(_jax_light, (0, 1))(x, axes @ w)
    ours = in_frame(L_x, L_w, axes, S, w)

    def composed(step, turn):
        y, frame = _jax_moved(step)
        v = w + turn
        return _jax_light(y, frame @ (v / jnp.sqrt(v @ v)))

    spatial, angular = jax.jacfwd(composed, (0, 1))(jnp.zeros(2), jnp.zeros(3))
    return ours, spatial, angular


def frame_autodiff(part: str) -> float:
    """Gradient in the frame against autodiff through the ellipsoid."""
    ours, spatial, angular = _in_frame()
    return normwise(getattr(ours, part), {"spatial": spatial, "angular": angular}[part])


def _frame_at(i, s):
    x, n = our.moved(i, s)
    return x, our.smallest_rotation(our.AXES[:, 2], n) @ our.AXES


@functools.cache
def frame_differences(part: str) -> float:
    """The same against differences of light traced in the carried frame."""
    w = our.LOCAL

    def along(i):
        return our.slope(lambda s: our.light(_frame_at(i, s)[0], _frame_at(i, s)[1] @ w))

    ours = _in_frame()[0]
    if part == "spatial":
        return normwise(ours.spatial, np.array([along(0), along(1)]))
    e1 = our.unit(np.cross(w, [0.1, 0.2, 0.9]))
    turns = np.stack([e1, np.cross(w, e1)])
    true = [
        our.slope(lambda s, e=e: our.light(our.PLACE, our.AXES @ (w * np.cos(s) + e * np.sin(s))))
        for e in turns
    ]
    return normwise(turns @ np.asarray(ours.angular), np.array(true))


def _principal():
    import jax.numpy as jnp

    from firstorder.space.reflection import turning_of_directions

    axes, kappas = our.principal_frame(our.PLACE)
    ours = turning_of_directions(*map(jnp.asarray, (axes, np.diag(kappas), our.LOCAL)))
    return axes, kappas, np.asarray(ours)


def principal_differences() -> float:
    """(60): how the carried principal frame turns a fixed direction, by differences."""
    axes, _, ours = _principal()
    n = axes[:, 2]

    def turned(i, s):
        return our.smallest_rotation(n, our.moved(i, s, axes)[1]) @ axes @ our.LOCAL

    return normwise(ours, np.stack([our.slope(lambda s, i=i: turned(i, s)) for i in (0, 1)], 1))


def principal_columns() -> float:
    """(60), (62): `kappa P w` with columns, written out."""
    axes, kappas, ours = _principal()
    t, b, n = axes.T
    w = our.LOCAL
    columns = np.stack([kappas[0] * (n * w[0] - t * w[2]), kappas[1] * (n * w[1] - b * w[2])], 1)
    return normwise(ours, columns)


def rotation_order() -> float:
    """(61): how far the order of the neglected part is from 2."""
    axes, kappas = our.principal_frame(our.PLACE)
    t, _, n = axes.T
    w = our.LOCAL
    Pw = n * w[0] - t * w[2]
    sizes = np.array([0.04, 0.02, 0.01])

    def miss(s):
        turned = our.smallest_rotation(n, our.moved(0, s, axes)[1]) @ axes @ w
        rough = axes @ w + s * kappas[0] * Pw
        return abs(our.light(our.PLACE, turned) - our.light(our.PLACE, rough))

    return abs(fitted_order(sizes, [miss(s) for s in sizes]) - 2.0)


@functools.cache
def _reflected(through: str = "kernel"):
    """The library's reflection at the place, and autodiff of the value through the ellipsoid."""
    import jax
    import jax.numpy as jnp

    from firstorder.laws import VonMisesFisher, Zonal
    from firstorder.space.reflection import mirrored, reflected, surface_point

    x, axes, S, _, v = _arrays()
    lobe = Zonal(VonMisesFisher(our.SHARPNESS), 16, 32)

    def both(x, axes, S, v):
        B = reflected(_jax_light, surface_point(x, axes, S), v, lobe, through=through)

        def value(step, turn):
            y, frame = _jax_moved(step)
            eye = v + turn
            eye = eye / jnp.sqrt(eye @ eye)
            r = mirrored(eye, frame[:, 2])
            return lobe.value(lambda w: _jax_light(y, w), r)

        return B, B.spatial, B.angular, jax.jacfwd(value, (0, 1))(jnp.zeros(2), jnp.zeros(3))

    return jax.jit(both)(x, axes, S, v)


def reflected_autodiff(part: str, through: str = "kernel") -> float:
    """Gradient of reflected light against autodiff of the value."""
    _, spatial, angular, (along, over) = _reflected(through)
    return normwise(spatial, along) if part == "spatial" else normwise(angular, over)


def reflected_differences(part: str, through: str = "kernel") -> float:
    """The same against differences of sums over the sphere on the traced ellipsoid."""
    along, turns, over = our.truth()
    _, spatial, angular, _ = _reflected(through)
    return normwise(spatial, along) if part == "spatial" else normwise(turns @ angular, over)


@functools.cache
def _fixed_normal_differences() -> float:
    """(65): SV against differences of the sum with position alone moved."""
    n = our.AXES[:, 2]
    true = [
        our.slope(lambda s, i=i: our.glossy(our.PLACE + s * our.AXES[:, i], n, our.TO_EYE))
        for i in (0, 1)
    ]
    return normwise(_reflected()[0].SV, np.array(true))


@functools.cache
def _fixed_centre_autodiff() -> float:
    """(65), (67): SV and DV against autodiff of the convolution in position and centre."""
    import jax
    import jax.numpy as jnp

    from firstorder.laws import VonMisesFisher, Zonal
    from firstorder.space.reflection import mirrored

    x, axes, _, _, v = _arrays()
    lobe = Zonal(VonMisesFisher(our.SHARPNESS), 16, 32)

    def value(y, r):
        return lobe.value(lambda w: _jax_light(y, w), r / jnp.sqrt(r @ r))

    L_x, L_r = jax.jit(jax.grad(value, (0, 1)))(x, mirrored(v, axes[:, 2]))
    B = _reflected()[0]
    return max(normwise(B.SV, L_x @ axes[:, :2]), normwise(B.DV, L_r))


def _great_circle_differences() -> float:
    """(67): DV against differences of the sum along great circles of the lobe's centre."""
    n = our.AXES[:, 2]
    r = 2.0 * (n @ our.TO_EYE) * n - our.TO_EYE
    e1 = our.unit(np.cross(r, [0.5, 0.1, -0.4]))
    turns = np.stack([e1, np.cross(r, e1)])
    w, weights = our.sphere()
    L = our.light(our.PLACE, w)

    def at(e, s):
        return np.sum(weights * L * our.bell(w @ (r * np.cos(s) + e * np.sin(s))))

    true = [our.slope(lambda s, e=e: at(e, s)) for e in turns]
    return normwise(turns @ _reflected()[0].DV, np.array(true))


FLAT = na("no spectrum")
FRAME = {"implements": f"{MODULE}.in_frame", "fourier": FLAT}
NOTHING = dict.fromkeys(("symbolic", "autodiff", "fourier", "brute_force"), na("definition"))

ROWS = [
    Row("R07.56", "definition", implements=f"{MODULE}.in_frame", **NOTHING),
    Row(
        "R07.57",
        "identity",
        **FRAME,
        symbolic=proofs.rotated_tangents,
        autodiff=Check(lambda: frame_autodiff("angular"), 1e-12),
        brute_force=Check(lambda: frame_differences("angular"), 1e-10),
    ),
    Row("R07.58", "definition", implements=f"{MODULE}.in_frame", **NOTHING),
    Row(
        "R07.59",
        "identity",
        **FRAME,
        symbolic=proofs.splitting,
        autodiff=Check(lambda: frame_autodiff("spatial"), 1e-12),
        brute_force=Check(lambda: frame_differences("spatial"), 1e-10),
    ),
    Row(
        "R07.60",
        "misprint",
        implements=f"{MODULE}.turning_of_directions",
        symbolic=lambda: [*proofs.rotation_rate(), *proofs.general_rate()],
        autodiff=Check(lambda: frame_autodiff("spatial"), 1e-12),
        fourier=FLAT,
        brute_force=Check(principal_differences, 1e-10),
        corrected="R = (columns t, b, n), P = (columns n, 0, -t): local to global, as "
        "L_s(x, w) = L(x, R w) needs. With rows the curvature's term changes sign, against (10)",
        counterexample=Counterexample(
            {"radius": 2.0, "angle": 0.3}, printed=printed.printed_turn, true=printed.traced_turn
        ),
        note="kappa of S = -dn is right. R w and P w are orthogonal either way, so that check "
        "cannot tell. The frame is carried without twist: principal directions themselves turn "
        "about n along their lines (tests), and b is not constant there.",
    ),
    Row(
        "R07.61",
        "approximation",
        implements=f"{MODULE}.turning_of_directions",
        symbolic=na("measured"),
        autodiff=na("measured"),
        fourier=FLAT,
        brute_force=Check(rotation_order, 0.05),
        note="The neglected part is of order alpha^2; exact as a derivative.",
    ),
    Row(
        "R07.62",
        "identity",
        implements=f"{MODULE}.turning_of_directions",
        symbolic=proofs.splitting,
        autodiff=Check(principal_columns, 1e-13),
        fourier=FLAT,
        brute_force=Check(principal_differences, 1e-10),
        note="With P's columns as in R07.60; where mu = 0 l has no direction, and mu L_l is 0.",
    ),
    Row(
        "R07.63",
        "identity",
        **FRAME,
        symbolic=lambda: [*proofs.splitting(), *proofs.tangents_are_not_orthogonal()],
        autodiff=Check(lambda: frame_autodiff("spatial"), 1e-12),
        brute_force=Check(lambda: frame_differences("spatial"), 1e-10),
        note="True with the l and m of (62), which are no orthonormal frame: R07.fn6. The library "
        "takes any t, b with the 2 x 2 shape operator.",
    ),
    Row(
        "R07.fn6",
        "over-claim",
        implements=f"{MODULE}.Reflected",
        symbolic=proofs.tangents_are_not_orthogonal,
        autodiff=Check(lambda: reflected_autodiff("angular"), 1e-10),
        fourier=FLAT,
        brute_force=Check(lambda: reflected_differences("angular"), 1e-9),
        corrected="so it is for orthonormal tangents; App. B's own l and m have "
        "l.m = w_1 w_2 / (mu_1 mu_2), and need their Gram matrix",
        counterexample=Counterexample(
            {"w_1": 0.5, "w_2": 0.6}, printed=printed.length_from_l_and_m, true=printed.steepest
        ),
        note="The library's angular gradient is a vector, and asks for no frame.",
    ),
    Row(
        "R07.sBa",
        "over-claim",
        implements=f"{MODULE}.half_turn",
        symbolic=proofs.half_turn_of_tangents,
        autodiff=Check(lambda: reflected_autodiff("angular"), 1e-10),
        fourier=FLAT,
        brute_force=Check(lambda: reflected_differences("angular"), 1e-9),
        corrected="L^m_u(w) = L^s_{Mu}(M w), M = 2 n n^T - I: a half turn. M u = -u only for "
        "u orthogonal to n; else -u is not even tangent at M w",
        counterexample=Counterexample(
            {"w_1": 0.5, "w_2": 0.3}, printed=printed.printed_mirror, true=printed.traced_mirror
        ),
        note="True by name if the tangents at M w are called -M u. In (theta, phi) nothing is "
        "negated: the half turn adds pi to phi.",
    ),
    Row("R07.64", "definition", implements=f"{MODULE}.reflected", **NOTHING),
    Row(
        "R07.65",
        "identity",
        implements=f"{MODULE}.reflected",
        symbolic=lambda: proofs.convolution_by_hand()[0],
        autodiff=Check(_fixed_centre_autodiff, 1e-10),
        fourier=FLAT,
        brute_force=Check(_fixed_normal_differences, 1e-10),
    ),
    Row("R07.66", "definition", implements=f"{MODULE}.reflected", **NOTHING),
    Row(
        "R07.67",
        "identity",
        implements=f"{MODULE}.reflected",
        symbolic=lambda: proofs.convolution_by_hand()[1],
        autodiff=Check(_fixed_centre_autodiff, 1e-10),
        fourier=FLAT,
        brute_force=Check(_great_circle_differences, 1e-9),
        note="rho' may be avoided by rotating the light: C.space.reflection, C.zonal.rotation.",
    ),
    Row(
        "C.space.reflection",
        "identity",
        implements=f"{MODULE}.reflected",
        symbolic=lambda: [
            *proofs.mirrored_direction_turns_twice(),
            proofs.convolution_by_hand()[2],
        ],
        autodiff=Check(
            lambda: max(reflected_autodiff("spatial", t) for t in ("kernel", "light")), 1e-10
        ),
        fourier=FLAT,
        brute_force=Check(
            lambda: max(reflected_differences("spatial", t) for t in ("kernel", "light")), 1e-9
        ),
        note="General tangents on an ellipsoid with a near light, a lobe of sharpness 7.",
    ),
    Row(
        "C.space.direct.gaussian",
        "over-claim",
        implements=f"{MODULE}.direct_extension",
        symbolic=proofs.mirrored_direction_turns_twice,
        autodiff=na("scale"),
        fourier=FLAT,
        brute_force=Check(printed.gaussian_under_rescaling, 1e-9),
        corrected="2 (n x dn) . ((w x grad_w L) (*) rho) for 2 n_x (L_theta (*) rho)",
        counterexample=Counterexample(
            {"radius": 2.0}, printed=printed.gaussian_on_a_ball, true=printed.traced_on_a_ball
        ),
        note="Relative to the truth it scales as 1/length, and on a ball its sign is wrong.",
    ),
    Row(
        "C.space.direct.mean",
        "approximation",
        implements=f"{MODULE}.direct_extension",
        symbolic=na("measured"),
        autodiff=na("measured"),
        fourier=FLAT,
        brute_force=Check(printed.roundness_order, 0.1),
        note="Along the normal its error is of first order in the difference of the curvatures.",
    ),
    Row(
        "C.space.direct.normal",
        "approximation",
        implements=f"{MODULE}.direct_extension",
        symbolic=na("measured"),
        autodiff=na("measured"),
        fourier=FLAT,
        brute_force=Check(printed.tilt_order, 0.1),
        note="Principal tangents: the error is of second order in the angle of the eye (mu = 1). "
        "In other tangents it loses the shape operator's off-diagonal.",
    ),
]
