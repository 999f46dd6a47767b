"""Rotation by curvature: R07 §4.1 and §10 and D05 §4.1-4.2, §5.2, from the geometry of a normal.

D05 (11), D05 Table 1 and R07 (50) clash in one sign. Both papers define the local angle as the
global one minus the normal's, and turning the sense of angles turns that of the curvature with it:
the shear `Omega_x - k Omega_theta` is the same in every convention, and the plus of D05 (11) is a
misprint.
"""

from __future__ import annotations

import functools

import jax
import jax.numpy as jnp
import numpy as np
import sympy as sp

from derivations.ledger import Check, Counterexample, Row, na
from derivations.squares import square_error
from firstorder.checks.cases import bell, light
from firstorder.checks.registry import cases
from firstorder.checks.tolerance import fitted_order, normwise
from firstorder.conventions import Frame
from firstorder.fields import autodiff_jet, gaussian
from firstorder.laws import Move
from firstorder.transport import Curvature, Mirror, Travel
from firstorder.transport.incidence import Outgoing
from firstorder.transport.slopes import ToSlope

x, t, k, o1, o2, s = sp.symbols("x theta k Omega_x Omega_theta s", real=True)
f = sp.Function("f")

CURVATURE = "firstorder.transport.rotation.Curvature"


# ---- From the definition L^s(x, theta) = L(x, theta + k x) ------------------------------------


def gradient_of_the_rotation(sign=1):
    """Chain rule on a light field that is a generic cubic, term by term."""
    a = sp.symbols("a0:10")
    powers = [(i, j) for i in range(4) for j in range(4 - i)]
    L = sum(c * x**i * t**j for c, (i, j) in zip(a, powers, strict=True))
    there = {t: t + sign * k * x}
    rotated = L.subs(there)
    gx, gt = L.diff(x).subs(there), L.diff(t).subs(there)
    return [
        sp.expand(rotated.diff(x) - (gx + sign * k * gt)),
        sp.expand(rotated.diff(t) - gt),
    ]


def exponent_of_the_rotation():
    """Fourier integral of L(x, theta + k x) by the substitution s = theta + k x, d theta = ds.

    It becomes `int L(x, s) exp(-2 pi i ((Omega_x - k Omega_theta) x + Omega_theta s))`.
    """
    exponent = (o1 * x + o2 * t).subs(t, s - k * x)
    jacobian = sp.diff(s - k * x, s) - 1
    return [sp.expand(exponent - ((o1 - k * o2) * x + o2 * s)), jacobian]


def either_sense_of_angles():
    """Turning theta, k and Omega_theta at once leaves D05's definition and the minus in place."""
    local = t - k * x
    turned = -local.subs({t: -t, k: -k}, simultaneous=True)
    sheared = o1 - k * o2
    return [
        sp.expand(turned - local),
        sp.expand(sheared.subs({k: -k, o2: -o2}, simultaneous=True) - sheared),
    ]


def inverse_transpose():
    """`M^-T` is `M^T` with k negated, and det M = 1."""
    M = sp.Matrix([[1, 0], [k, 1]])
    return [*(M.inv().T - M.T.subs(k, -k)), M.det() - 1]


def twice_the_curvature():
    """Back after mirror after to-local: one linear map, [[1, 0], [2 k, -1]]."""
    to_local = sp.Matrix([[1, 0], [k, 1]])
    mirror = sp.diag(1, -1)
    # The last event acts on the ray first: B(u) = L(to_local mirror back u).
    return to_local * mirror * to_local.inv() - sp.Matrix([[1, 0], [2 * k, -1]])


def spectrum_exponent_of_the_way_back():
    """D05 step 6: B(x, theta) = B_s(x, theta - k x) shears the spectrum by +k."""
    exponent = (o1 * x + o2 * t).subs(t, s + k * x)
    return [sp.expand(exponent - ((o1 + k * o2) * x + o2 * s)), *twice_the_curvature()]


def directional_bandwidth():
    """A point of energy keeps its angular frequency through both shears (M^T, second row)."""
    energy = sp.Matrix([[1, 0], [k, 1]]).T * sp.Matrix([o1, o2])
    return [energy[1] - o2, sp.Matrix([[1, 0], [-k, 1]]).T.row(1)[0]]


def scale_of_step_seven():
    """l(X, theta) = l_o(X / c, theta): energy at Omega_x moves to Omega_x / c, shear and all."""
    c = sp.symbols("c", positive=True)
    M = sp.diag(1 / c, 1)
    return list(M.T * sp.Matrix([2 * k * o2, o2]) - sp.Matrix([2 * k * o2 / c, o2]))


def focus_of_a_parallel_beam():
    """Rays of one direction leave at theta = 2 k x, so they land at x - 2 k x d.

    They meet in x = 0 at d = 1 / (2 k), where all energy is spatial.
    """
    d = sp.symbols("d")
    landing = x - (2 * k * x) * d  # a ray at x of slope v = 2 k x, counter-clockwise, goes to -x
    meeting = sp.solve(landing.diff(x), d)[0]
    # the same in frequencies: a line (0, W) -> (2 k W, -W)^T -> travel keeps v-energy zero
    W = sp.symbols("W")
    energy = sp.Matrix([[1, 0], [2 * k, -1]]).T * sp.Matrix([0, W])
    travelled = sp.Matrix([[1, d], [0, 1]]).T * energy
    return [meeting - 1 / (2 * k), travelled[1].subs(d, meeting)]


def four_dimensional_shear():
    """The Fourier exponent of l(x, y, theta + k1 x, phi + k2 y)."""
    y, p, k1, k2, oy, op, q = sp.symbols("y phi k1 k2 Omega_y Omega_phi q", real=True)
    exponent = (o1 * x + oy * y + o2 * t + op * p).subs({t: s - k1 * x, p: q - k2 * y})
    return sp.expand(exponent - ((o1 - k1 * o2) * x + (oy - k2 * op) * y + o2 * s + op * q))


# ---- Numbers ----------------------------------------------------------------------------------


def sheared_spectrum(k, Omega_x, Omega_theta) -> float:
    """Real part of the spectrum of the local light `bell(x, theta' + k x)`, by a plain sum."""
    h = 0.05
    axis = np.arange(-6.0, 6.0, h)
    values = np.array([[bell(a, b + k * a) for b in axis] for a in axis])
    phase = 2.0 * np.pi * (Omega_x * axis[:, None] + Omega_theta * axis)
    return float(np.sum(values * np.cos(phase)) * h * h)


def printed_shear(k, Omega_x, Omega_theta) -> float:
    """D05 (11) as printed: `Omega_x + k Omega_theta`."""
    F = light().spectrum()
    return float(F(Omega_x + k * Omega_theta, Omega_theta).real)


SIGN = Counterexample(
    {"k": 0.7, "Omega_x": 0.3, "Omega_theta": 0.25}, printed_shear, sheared_spectrum
)


def shear_error() -> float:
    """R07 (50) against the plain sum."""
    F = Curvature(0.7)(light().spectrum())
    return abs(float(F(0.3, 0.25).real) - sheared_spectrum(0.7, 0.3, 0.25))


RAYS = jnp.array([[0.3, 0.1], [-0.4, 0.25], [0.7, -0.35]])


@functools.cache
def doubling_errors() -> tuple[float, float]:
    """Chain to-local, mirror, back against the one move: jets, spectra."""
    kappa = 0.45
    chain = Curvature(kappa) >> Mirror() >> Curvature(kappa, back=True)
    one = Move([[1.0, 0.0], [2.0 * kappa, -1.0]], to=Frame(sense="outgoing"))
    L = light()
    jets = [jax.vmap(step(L).jet)(RAYS) for step in (chain, one)]
    Omega = np.meshgrid(np.linspace(-0.5, 0.5, 5), np.linspace(-0.4, 0.6, 4))
    spectra = [step(L.spectrum())(*Omega) for step in (chain, one)]
    jet_error = max(
        normwise(a, b)
        for a, b in zip(jax.tree.leaves(jets[0]), jax.tree.leaves(jets[1]), strict=True)
    )
    return jet_error, normwise(*spectra)


def doubling_by_tracing() -> float:
    """A parallel beam off a mirror of normals n = k x: the leaving angle is 2 k x - theta."""
    error = 0.0
    for place, angle in ((0.3, 0.2), (-0.5, 0.4)):
        n = 0.45 * place
        normal = np.array([-np.sin(n), np.cos(n)])
        to_light = np.array([-np.sin(angle), np.cos(angle)])
        leaving = 2.0 * (normal @ to_light) * normal - to_light
        error = max(error, abs(np.arctan2(-leaving[0], leaving[1]) - (2 * 0.45 * place - angle)))
    return float(error)


def directional_spread(route) -> float:
    """Change of the angular second moment of the spectrum, by our rule or from samples."""
    before = light().covariance().matrix[1, 1]
    case = cases()["curvature"]
    if route == "rule":
        after = case.step(case.field.covariance()).matrix
    else:
        from firstorder.checks.squares import converted

        after = converted(case, "covariance")
    return abs(float(after[1, 1] / before) - 1.0)


@functools.cache
def grazing(route) -> float:
    """Spatial second moment after step 7 at 60 degrees: four times what curvature gave."""
    chain = Curvature(0.5) >> Mirror() >> Curvature(0.5, back=True)
    L = light()
    if route == "covariance":
        flat, seen = chain(L.covariance()), Outgoing(np.pi / 3)(chain(L.covariance()))
        return abs(float(seen.matrix[0, 0] / flat.matrix[0, 0]) - 4.0)
    ray = jnp.array([0.1, -0.9])
    shaded = chain(L)
    seen = autodiff_jet(Outgoing(np.pi / 3)(shaded).at, ray, shaded.frame).gradient[0]
    there = shaded.jet(jnp.array([0.2, -0.9 + np.pi / 3])).gradient[0]
    return abs(float(seen / there) - 2.0)


def caustic_width(kappa: float, distances) -> np.ndarray:
    """Spatial standard deviation of the light at each distance, from the path's own samples.

    A Gaussian beam 0.2 wide, parallel within 0.01 rad, reflected by n = kappa x.
    """
    beam = gaussian((0.0, 0.0), (0.2, 0.01))
    as_slopes = ToSlope().linearised(jnp.zeros(2))  # v = theta, as D05 has it
    mirror = Curvature(kappa) >> Mirror() >> Curvature(kappa, back=True)
    at_surface = (mirror >> as_slopes)(beam)
    grid = np.linspace(-1.2, 1.2, 241), np.linspace(-2.2, 2.2, 1101)
    widths = []
    for d in distances:
        light_there = Travel(d)(at_surface)
        rows = np.asarray(light_there(grid[0][:, None], grid[1][None, :])).sum(axis=1)
        widths.append(np.sqrt(np.sum(rows * grid[0] ** 2) / np.sum(rows)))
    return np.array(widths)


def focus_error() -> float:
    """Where the beam is narrowest, relative to 1 / (2 kappa); in a hill it only widens."""
    kappa = 0.8
    focus = 1.0 / (2.0 * kappa)
    d = focus * np.array([0.8, 1.0, 1.2])
    valley, hill = caustic_width(kappa, d) ** 2, caustic_width(-kappa, d)
    a, b, _ = np.polyfit(d, valley, 2)  # squared width is quadratic in distance
    return abs(-b / (2.0 * a) / focus - 1.0) + float(np.any(np.diff(hill) <= 0))


def aberration_order() -> float:
    """A circular mirror crosses its axis at `R - R / (2 cos b)`: off the focus by b^2 R / 4."""
    apertures, misses = np.array([0.02, 0.04, 0.08, 0.16]), []
    for b in apertures:  # angle of the normal where the ray hits the unit circle, centre above
        hit = np.array([np.sin(b), 1.0 - np.cos(b)])
        normal = np.array([-np.sin(b), np.cos(b)])
        leaving = 2.0 * normal[1] * normal - np.array([0.0, 1.0])
        height = hit[1] - hit[0] * leaving[1] / leaving[0]
        misses.append(abs(height - 0.5))
    return fitted_order(apertures, misses)


def normal_order() -> float:
    """Normal of a curve y = k x^2 / 2 + c x^3 / 6 against k s, by arc length: second order."""
    sizes, errors = np.array([0.01, 0.02, 0.04, 0.08]), []
    for length in sizes:
        p = np.linspace(0.0, length, 2001)
        slope = 0.6 * p + 0.45 * p**2
        arc = np.trapezoid(np.sqrt(1.0 + slope**2), p)
        errors.append(abs(np.arctan(slope[-1]) - 0.6 * arc))
    return fitted_order(sizes, errors)


def surface_normal_order() -> float:
    """Angles of the normal of a bumpy surface against M (x, y), M = -(shape operator)."""
    sizes, errors = np.array([0.005, 0.01, 0.02, 0.04]), []
    hessian = np.array([[0.7, 0.2], [0.2, -0.4]])
    for r in sizes:
        p = r * np.array([0.6, 0.8])
        gradient = hessian @ p + np.array([0.5 * p[0] ** 2 + 0.3 * p[0] * p[1], 0.15 * p[0] ** 2])
        normal = np.array([-gradient[0], -gradient[1], 1.0])
        angles = np.arctan2(normal[0], normal[2]), np.arcsin(normal[1] / np.linalg.norm(normal))
        errors.append(np.linalg.norm(np.array(angles) + hessian @ p))
    return fitted_order(sizes, errors)


def unit(azimuth, latitude) -> np.ndarray:
    """A direction near the equator."""
    c = np.cos(latitude)
    return np.array([c * np.cos(azimuth), c * np.sin(azimuth), np.sin(latitude)])


def rotation_order() -> float:
    """Turning about the axis (azimuth 0, latitude 0) against a plane rotation of both angles."""
    turn = 0.8
    R = np.array([[1, 0, 0], [0, np.cos(turn), -np.sin(turn)], [0, np.sin(turn), np.cos(turn)]])
    plane = R[1:, 1:]
    sizes, errors = np.array([0.02, 0.04, 0.08, 0.16]), []
    for r in sizes:
        angles = r * np.array([0.8, 0.6])
        w = R @ unit(*angles)
        exact = np.array([np.arctan2(w[1], w[0]), np.arcsin(w[2])])
        errors.append(np.linalg.norm(exact - plane @ angles))
    return fitted_order(sizes, errors)


def azimuth_speed(phi) -> float:
    """|d w / d azimuth| if `phi` is a colatitude, by differences of directions."""
    h = 1e-5
    ahead, behind = unit(h, 0.5 * np.pi - phi), unit(-h, 0.5 * np.pi - phi)
    return float(np.linalg.norm(ahead - behind) / (2.0 * h))


def latitude_distortion():
    """Metric of azimuth and latitude: |w_azimuth| = cos(latitude)."""
    a, b = sp.symbols("a b", real=True)
    w = sp.Matrix([sp.cos(b) * sp.cos(a), sp.cos(b) * sp.sin(a), sp.sin(b)])
    return sp.simplify(w.diff(a).dot(w.diff(a)) - sp.cos(b) ** 2)


def rotated_ridge(route) -> float:
    """Distant light: L_x = 0, so the local spatial derivative is kappa L_theta."""
    from firstorder.fields import Function

    kappa = 0.6
    L = Function(lambda place, angle: jnp.exp(-((angle - 0.2) ** 2)) + 0.0 * place)
    u = jnp.array([0.3, 0.1])
    there = 0.1 + kappa * 0.3
    slope = -2.0 * (there - 0.2) * np.exp(-((there - 0.2) ** 2))
    local = Curvature(kappa)(L)
    if route == "differences":
        h = 1e-4
        values = [float(local(0.3 + h * i, 0.1)) for i in (-2, -1, 1, 2)]
        measured = (values[0] - 8 * values[1] + 8 * values[2] - values[3]) / (12 * h)
    else:
        measured = float(jax.grad(local.at)(u)[0])
    return abs(measured - kappa * slope)


def balance() -> float:
    """Light that varies as much over x as over k theta: both parts of L^s_x are one size."""
    kappa = 0.6
    L = gaussian((0.0, 0.0), (1.0, kappa))  # L_x = k L_theta on the diagonal x = theta / k ...
    jet = L.jet(jnp.array([0.5, 0.5 * kappa]))
    return abs(float(jet.gradient[0] / (kappa * jet.gradient[1])) - 1.0)


def flat(route) -> float:
    """No curvature: nothing happens."""
    L = light()
    if route == "spectrum":
        return normwise(Curvature(0.0)(L.spectrum())(0.3, 0.2), L.spectrum()(0.3, 0.2))
    a, b = (jax.vmap(field.jet)(RAYS) for field in (Curvature(0.0)(L), L))
    return max(normwise(p, q) for p, q in zip(jax.tree.leaves(a), jax.tree.leaves(b), strict=True))


def _squares(**routes) -> dict:
    """The usual three numeric routes of a step: squares of one case."""
    case, spectral = routes.pop("case"), routes.pop("spectral", True)
    return {
        "autodiff": Check(
            lambda: max(square_error(case, p) for p in ("gradient", "hessian")), 1e-10
        ),
        "fourier": Check(lambda: square_error(case, "spectrum"), 1e-9)
        if spectral
        else na("no spectrum"),
        "brute_force": Check(lambda: square_error(case, "value"), 1e-10),
        **routes,
    }


def _measured(check: Check) -> dict:
    """An approximation: measured by brute force alone."""
    return {
        "symbolic": na("measured"),
        "autodiff": na("no derivative"),
        "fourier": na("no spectrum"),
        "brute_force": check,
    }


def _order(measure, order: float) -> Check:
    """The fitted order of an error, within a tenth."""
    return Check(lambda: abs(measure() - order), 0.1)


ROWS = [
    Row(
        "R07.s4.1a",
        "approximation",
        implements=CURVATURE,
        **_measured(_order(normal_order, 2)),
        note="Second order in arc length, |x| << |k / k_x|. Counter-clockwise: k > 0 is a valley.",
    ),
    Row("R07.s4.1b", "identity", CURVATURE, gradient_of_the_rotation, **_squares(case="curvature")),
    Row("R07.9", "definition", CURVATURE, inverse_transpose, **_squares(case="curvature")),
    Row("R07.10", "identity", CURVATURE, gradient_of_the_rotation, **_squares(case="curvature")),
    Row("R07.11", "identity", CURVATURE, gradient_of_the_rotation, **_squares(case="curvature")),
    Row(
        "R07.s4.1c",
        "identity",
        CURVATURE,
        lambda: (lambda L: L.subs(t, t + k * x).diff(x) - k * L.diff(t).subs(t, t + k * x))(
            sp.exp(sp.sin(t)) + t**3
        ),
        autodiff=Check(lambda: rotated_ridge("autodiff"), 1e-10),
        fourier=na("no spectrum"),
        brute_force=Check(lambda: rotated_ridge("differences"), 1e-10),
    ),
    Row(
        "R07.s4.1d",
        "identity",
        CURVATURE,
        lambda: [e.subs(k, 0) for e in gradient_of_the_rotation()],
        autodiff=Check(lambda: flat("jets"), 1e-14),
        fourier=Check(lambda: flat("spectrum"), 1e-14),
        brute_force=na("two routes"),
    ),
    Row(
        "R07.s4.1e",
        "approximation",
        CURVATURE,
        symbolic=na("scale"),
        autodiff=Check(balance, 1e-12),
        fourier=na("no spectrum"),
        brute_force=na("scale"),
        note="Where |L_x| = |k L_theta| the parts are equal, by (11); nothing is said about signs.",
    ),
    Row(
        "R07.17",
        "identity",
        CURVATURE,
        lambda: gradient_of_the_rotation(-1),
        **_squares(case="curvature back"),
    ),
    Row(
        "R07.50",
        "identity",
        CURVATURE,
        lambda: [*exponent_of_the_rotation(), *either_sense_of_angles()],
        autodiff=na("spectral"),
        fourier=Check(lambda: square_error("curvature", "spectrum"), 1e-9),
        brute_force=Check(shear_error, 1e-10),
        note="The minus holds in every convention: see D05.11.",
    ),
    Row(
        "R07.s10a",
        "identity",
        "firstorder.laws.move.Move.spectrum",
        inverse_transpose,
        autodiff=na("no derivative"),
        fourier=Check(lambda: square_error("curvature", "spectrum"), 1e-9),
        brute_force=Check(
            lambda: normwise(np.linalg.inv([[1, 0], [0.7, 1]]).T, np.array([[1, -0.7], [0, 1]])),
            1e-15,
        ),
    ),
    Row(
        "R07.s10b",
        "over-claim",
        CURVATURE,
        either_sense_of_angles,
        autodiff=na("spectral"),
        fourier=Check(lambda: square_error("curvature", "spectrum"), 1e-9),
        brute_force=Check(shear_error, 1e-10),
        corrected="Omega_x - k Omega_theta in both conventions; the plus of D05 (11) is wrong.",
        counterexample=SIGN,
        note="Both have theta' = theta - k x; (theta, k) -> (-theta, -k) turns Omega_theta too.",
    ),
    Row(
        "R07.s10c",
        "identity",
        CURVATURE,
        lambda: [*gradient_of_the_rotation(), *exponent_of_the_rotation()],
        **_squares(case="curvature"),
    ),
    Row(
        "D05.s4.1b",
        "approximation",
        implements=CURVATURE,
        **_measured(_order(normal_order, 2)),
        note="Second order in arc length. D05's angles grow towards +x, so its k > 0 is a bump.",
    ),
    Row(
        "D05.11",
        "misprint",
        CURVATURE,
        lambda: [*exponent_of_the_rotation(), *either_sense_of_angles()],
        autodiff=na("spectral"),
        fourier=Check(lambda: square_error("curvature", "spectrum"), 1e-9),
        brute_force=Check(shear_error, 1e-10),
        corrected="lhat_i'(Omega_x, Omega_theta) = lhat_i(Omega_x - k Omega_theta, Omega_theta)",
        counterexample=SIGN,
        note="From the text's own theta' = theta - k x. Table 1, §6.1 and §6.2 have the minus.",
    ),
    Row(
        "D05.T1.5",
        "identity",
        CURVATURE,
        exponent_of_the_rotation,
        autodiff=na("spectral"),
        fourier=Check(lambda: square_error("curvature", "spectrum"), 1e-9),
        brute_force=Check(shear_error, 1e-10),
    ),
    Row(
        "D05.s4.1g",
        "identity",
        CURVATURE,
        spectrum_exponent_of_the_way_back,
        autodiff=Check(lambda: doubling_errors()[0], 1e-12),
        fourier=Check(lambda: doubling_errors()[1], 1e-12),
        brute_force=Check(doubling_by_tracing, 1e-14),
        note="To-local, mirror and back are one move [[1, 0], [2 k, -1]]: R07 (24)'s transpose.",
    ),
    Row(
        "D05.s4.2a",
        "identity",
        CURVATURE,
        directional_bandwidth,
        autodiff=na("spectral"),
        fourier=Check(lambda: directional_spread("samples"), 1e-9),
        brute_force=Check(lambda: directional_spread("rule"), 1e-12),
        note="At the surface; travel afterwards turns spatial into angular frequency.",
    ),
    Row(
        "D05.s4.2b",
        "identity",
        "firstorder.transport.incidence.Outgoing",
        scale_of_step_seven,
        autodiff=Check(lambda: grazing("jets"), 1e-10),
        fourier=Check(lambda: grazing("covariance"), 1e-12),
        brute_force=na("two routes"),
        note="With the corrected (10): the printed one would reduce the shear.",
    ),
    Row(
        "D05.s4.2c",
        "approximation",
        CURVATURE,
        focus_of_a_parallel_beam,
        autodiff=na("no derivative"),
        fourier=Check(focus_error, 2e-3),
        brute_force=_order(aberration_order, 2),
        note="Exact for n = k x (a beam of 0.2 by 0.01 rad is narrowest 1e-3 before 1 / (2 |k|)); "
        "a circular mirror of radius R misses it by b^2 R / 4 at the aperture b: second order, "
        "1% of the focal length for b < 0.14. Negative k is D05's valley.",
    ),
    Row(
        "D05.19",
        "approximation",
        implements=CURVATURE,
        **_measured(_order(surface_normal_order, 2)),
        note="A linear map, M = -(shape operator) with angles towards +x and +y, second order in "
        "the distance; its form is bilinear.",
    ),
    Row(
        "D05.s5.2a",
        "misprint",
        CURVATURE,
        latitude_distortion,
        autodiff=na("no derivative"),
        fourier=na("no spectrum"),
        brute_force=Check(lambda: abs(azimuth_speed(0.5 * np.pi - 0.3) - np.cos(0.3)), 1e-9),
        corrected="phi in [-pi/2, pi/2] is the latitude; a colatitude has the distortion sin(phi).",
        counterexample=Counterexample({"phi": 0.3}, lambda phi: float(np.cos(phi)), azimuth_speed),
        note="The counterexample reads phi as the colatitude that the text calls it.",
    ),
    Row(
        "D05.s5.2b",
        "approximation",
        CURVATURE,
        **_measured(_order(rotation_order, 3)),
        note="Third order in the angular distance from the axis: 0.2 degrees at 10.",
    ),
    Row(
        "D05.s5.2c",
        "approximation",
        CURVATURE,
        four_dimensional_shear,
        autodiff=Check(lambda: square_error("curvature in space", "hessian"), 1e-10),
        fourier=Check(lambda: square_error("curvature in space", "spectrum"), 1e-9),
        brute_force=_order(surface_normal_order, 2),
        note="The shear is exact for the linearised normal, itself of second order (D05.19).",
    ),
]
