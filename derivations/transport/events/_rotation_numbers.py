"""Rotation by curvature in numbers: traced, differenced and fitted."""

from __future__ import annotations

import functools

import jax
import jax.numpy as jnp
import numpy as np
import sympy as sp

from firstorder.checks.cases import bell, light
from firstorder.checks.registry import all_cases
from firstorder.checks.tolerance import fitted_order, normwise
from firstorder.conventions import SPACE, Frame
from firstorder.fields import autodiff_jet, gaussian
from firstorder.laws import Move
from firstorder.ledger import Counterexample
from firstorder.transport import Curvature, Mirror, Travel
from firstorder.transport.chain4d._equator import Turn, equator_direction
from firstorder.transport.events.incidence import Outgoing
from firstorder.transport.events.slopes import ToSlope


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
    case = all_cases()["curvature"]
    if route == "rule":
        after = case.step(case.field.covariance()).matrix
    else:
        from firstorder.checks.squares import by_conversion

        after = by_conversion(case, "covariance")
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
    """Where the beam is narrowest, against its waist before 1 / (2 kappa); in a hill it widens.

    The variance 0.2^2 (1 - 2 kappa d)^2 + 0.01^2 d^2 is least a thousandth before the focus.
    """
    kappa = 0.8
    focus = 1.0 / (2.0 * kappa) / (1.0 + (0.01 / (2.0 * kappa * 0.2)) ** 2)
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
    """Normal of a curve y = k x^2 / 2 + c x^3 / 6 against k s, by arc length: second order.

    The latter is by how much the library's rotation turns the ray that has the local angle 0.
    """
    sizes, errors = np.array([0.001, 0.002, 0.004, 0.008]), []
    turn = np.asarray(Curvature(0.6).law(light().frame).M)
    for length in sizes:
        p = np.linspace(0.0, length, 2001)
        slope = 0.6 * p + 0.45 * p**2
        arc = np.trapezoid(np.sqrt(1.0 + slope**2), p)
        errors.append(abs(np.arctan(slope[-1]) - (turn @ [arc, 0.0])[1]))
    return fitted_order(sizes, errors)


def surface_normal_order() -> float:
    """Angles of the normal of a bumpy surface against M (x, y), M = -(shape operator).

    The latter is by how much the library's rotation turns the ray that has the local angles 0.
    """
    sizes, errors = np.array([0.0005, 0.001, 0.002, 0.004]), []
    hessian = np.array([[0.7, 0.2], [0.2, -0.4]])
    turn = np.asarray(Curvature(-hessian).law(SPACE).M)
    for r in sizes:
        p = r * np.array([0.6, 0.8])
        gradient = hessian @ p + np.array([0.5 * p[0] ** 2 + 0.3 * p[0] * p[1], 0.15 * p[0] ** 2])
        normal = np.array([-gradient[0], -gradient[1], 1.0])
        angles = np.arctan2(normal[0], normal[2]), np.arcsin(normal[1] / np.linalg.norm(normal))
        errors.append(np.linalg.norm(np.array(angles) - (turn @ [*p, 0.0, 0.0])[2:]))
    return fitted_order(sizes, errors)


def unit(azimuth, latitude) -> np.ndarray:
    """A direction near the equator."""
    c = np.cos(latitude)
    return np.array([c * np.cos(azimuth), c * np.sin(azimuth), np.sin(latitude)])


def rotation_order() -> float:
    """Turning about the axis (azimuth 0, latitude 0) against a plane rotation of both angles.

    The latter is the library's move for a turn about its own axis, the third.
    """
    c, s = np.cos(0.8), np.sin(0.8)
    R = np.array([[1, 0, 0], [0, c, -s], [0, s, c]])
    move = Turn([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]], at=0.0).law(SPACE)
    plane = np.asarray(move.M)[2:, 2:]
    sizes, errors = np.array([0.005, 0.01, 0.02, 0.04]), []
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


def distortion_by_autodiff() -> float:
    """How fast the library's directions move with the longitude, against cos(latitude)."""
    latitudes = jnp.array([-1.2, 0.0, 0.3, 1.5])
    rates = jax.vmap(jax.jacfwd(equator_direction), (None, 0))(jnp.array(0.4), latitudes)
    return normwise(jnp.linalg.norm(rates, axis=-1), np.cos(np.asarray(latitudes)))


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
    L = gaussian((0.2, 0.2 * kappa), (1.0, kappa))  # L_x = k L_theta on x = theta / k
    x, theta = 0.5, 0.5 * kappa
    L_x = L.jet(jnp.array([x, theta])).gradient[0]
    local = jnp.array([x, theta - kappa * x])
    rotated = jax.grad(Curvature(kappa)(L).at)(local)[0]  # L_x + k L_theta, by (11)
    return abs(float(rotated / (2.0 * L_x)) - 1.0)


def flat(route) -> float:
    """No curvature: nothing happens."""
    L = light()
    if route == "spectrum":
        return normwise(Curvature(0.0)(L.spectrum())(0.3, 0.2), L.spectrum()(0.3, 0.2))
    a, b = (jax.vmap(field.jet)(RAYS) for field in (Curvature(0.0)(L), L))
    return max(normwise(p, q) for p, q in zip(jax.tree.leaves(a), jax.tree.leaves(b), strict=True))
