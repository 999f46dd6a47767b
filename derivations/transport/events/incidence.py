"""Incidence and outgoing frames, from straight rays that meet two lines through one point.

D05 §4.1 and Table 1. The plane across the central ray and the surface cross at the origin at the
angle of incidence; a ray is followed from the one to the other; the first-order map is the
Jacobian of that at the central ray.
"""

from __future__ import annotations

import jax.numpy as jnp
import numpy as np
import sympy as sp

from derivations.squares import square_error
from firstorder.checks.tolerance import fitted_order
from firstorder.conventions import FLATLAND
from firstorder.ledger import Check, Counterexample, Row, na
from firstorder.transport.events.incidence import Incidence

x, theta = sp.symbols("x theta", real=True)
tilt = sp.Symbol("theta_0", real=True)
Ox, Ot = sp.symbols("Omega_x Omega_theta", real=True)


def met():
    """Position and local angle at which the ray (x, theta) meets the line tilted by theta_0."""
    t, s = sp.symbols("t s")
    along = sp.Matrix([-sp.sin(theta), sp.cos(theta)])
    axis = sp.Matrix([sp.cos(tilt), sp.sin(tilt)])
    where = sp.solve(sp.Matrix([x, 0]) + t * along - s * axis, [t, s])[s]
    return sp.Matrix([where, theta - tilt])


def projected():
    """The exact map, and its Jacobian at the central ray: diag(cos(theta_0), 1)."""
    exact = met()[0] - x * sp.cos(theta) / sp.cos(theta - tilt)
    central = {x: 0, theta: tilt}
    J = met().jacobian([x, theta]).subs(central) - sp.diag(sp.cos(tilt), 1)
    return [sp.simplify(exact), *met().subs(central), *J.applyfunc(sp.simplify)]


def back_again():
    """The outgoing map undoes it, exactly and to first order."""
    X, T = sp.symbols("X T", real=True)
    there = met()
    back = sp.Matrix([X * sp.cos(T) / sp.cos(T + tilt), T + tilt])
    round_trip = back.subs({X: there[0], T: there[1]}, simultaneous=True)
    return (round_trip - sp.Matrix([x, theta])).applyfunc(sp.simplify)


def phases():
    """The Fourier integral of l(s c x, theta - theta_0), s = +-1, by u = s c x: phase, argument.

    And of l_o(x / c, theta + theta_1). With c = cos of the angle > 0.
    """
    c, s = sp.Symbol("c", positive=True), sp.Symbol("s", real=True)
    X, T = sp.symbols("X T", real=True)
    found = []
    # exponent / (-2 pi i), at x = X / scale, theta = T + shift; the Jacobian is 1 / |scale|
    for scale, shift, argument, phase in (
        (s * c, tilt, (Ox / (s * c), Ot), Ot * tilt),
        (1 / c, -tilt, (Ox * c, Ot), -Ot * tilt),
    ):
        exponent = Ox * X / scale + Ot * (T + shift)
        found.append(sp.simplify(exponent - (argument[0] * X + argument[1] * T) - phase))
        old = sp.Matrix([X / scale, T + shift]).jacobian([X, T]).det()
        found.append(sp.simplify(old - 1 / scale))
    return found


def order_of_the_footprint() -> float:
    """How far from 2 the fitted order of the traced map's departure from its move is."""
    from firstorder.checks.cases.moves.incidence import trace

    sizes, errors, angle = np.array([0.02, 0.05, 0.1]), [], 0.6
    for h in sizes:
        s, local = trace(h, angle + h, angle)
        errors.append(abs(s - h * np.cos(angle)) + abs(local - h))
    return abs(fitted_order(sizes, errors) - 2.0)


def order_of_the_event() -> float:
    """The same as the exact event reports it."""
    angle, radii = 0.6, np.array([0.02, 0.05, 0.1])
    exact = Incidence(angle, exact=True)
    errors = [float(exact.linearised(jnp.array([0.0, angle]), r).error(FLATLAND)) for r in radii]
    return abs(fitted_order(radii, errors) - 2.0)


# What follows shares no formula with the above: the map is found by following two nearby rays.


def _traced_map(angle, e=1e-4):
    """First-order map of (x, theta - centre), by differences of traced rays."""
    from firstorder.checks.cases.moves.incidence import trace

    columns = []
    for dx, dt in ((e, 0.0), (0.0, e)):
        two = [np.array(trace(k * dx, angle + k * dt, angle)) for k in (1.0, -1.0)]
        columns.append((two[0] - two[1]) / (2.0 * e))
    return np.stack(columns, axis=1)


def _light(s, angle):
    """Light across the central ray; off-centre and correlated."""
    a, b = s - 0.3, angle + 0.1
    return np.exp(-(a * a + 0.6 * a * b + 1.5 * b * b))


def _light_hat(Omega_x, Omega_theta):
    """Its transform, by samples."""
    return _sampled(lambda X, T: _light(X, T), 0.0, Omega_x, Omega_theta)


def _sampled(function, centre, Omega_x, Omega_theta):
    axis = np.linspace(-9.0, 9.0, 361)
    X, T = np.meshgrid(axis, axis + centre, indexing="ij")
    wave = np.exp(-2j * np.pi * (Omega_x * X + Omega_theta * T))
    return complex(np.sum(function(X, T) * wave) * (axis[1] - axis[0]) ** 2)


def incident_traced(theta0, Omega_x, Omega_theta):
    """Transform of the light on the surface; it arrives from a frame turned half round."""
    m = _traced_map(theta0)

    def onto(X, T):
        across = m @ np.stack([X.ravel(), T.ravel() - theta0])
        return _light(-across[0], across[1]).reshape(X.shape)

    return _sampled(onto, theta0, Omega_x, Omega_theta).real


def outgoing_traced(theta1, Omega_x, Omega_theta):
    """Transform of the light across a ray that leaves at theta1, known on the surface."""
    m = np.linalg.inv(_traced_map(theta1))

    def away(X, T):
        on = m @ np.stack([X.ravel(), T.ravel()])
        return _light(on[0], on[1] + theta1).reshape(X.shape)

    return _sampled(away, 0.0, Omega_x, Omega_theta).real


def printed_9(theta0, Omega_x, Omega_theta):
    """D05 (9) as it stands."""
    c = np.cos(theta0)
    return (
        np.exp(-1j * Omega_theta * theta0) / abs(c) * _light_hat(-Omega_x * c, Omega_theta)
    ).real


def printed_10(theta1, Omega_x, Omega_theta):
    """D05 (10) as it stands."""
    c = np.cos(theta1)
    return (np.exp(1j * Omega_theta * theta1) * abs(c) * _light_hat(Omega_x / c, Omega_theta)).real


def corrected_against_traced() -> float:
    """Both corrected formulas against the traced transforms, a few frequencies."""
    worst = 0.0
    for angle in (0.6, -0.9):
        c = np.cos(angle)
        for W in ((0.2, 0.1), (-0.15, 0.25), (0.0, 0.0)):
            phase = np.exp(-2j * np.pi * W[1] * angle)
            onto = phase / c * _light_hat(-W[0] / c, W[1])
            away = c / phase * _light_hat(W[0] * c, W[1])
            worst = max(
                worst,
                abs(onto.real - incident_traced(angle, *W)),
                abs(away.real - outgoing_traced(angle, *W)),
            )
    return worst


def against_traced(case) -> float:
    """The formulas, and the library's event, against traced rays."""
    return max(corrected_against_traced(), square_error(case, "value"))


INCIDENT = {
    "implements": "firstorder.transport.events.incidence.Incidence",
    "symbolic": lambda: [*projected(), *phases()],
    "autodiff": na("spectral"),
    "fourier": Check(lambda: square_error("arrival at incidence", "spectrum"), 1e-9),
    "brute_force": Check(lambda: against_traced("arrival at incidence"), 1e-9),
    "corrected": "lhat_i(O_x, O_theta) = exp(-2 pi i O_theta theta_0) / |cos(theta_0)| "
    "lhat(-O_x / cos(theta_0), O_theta)",
    "counterexample": Counterexample(
        {"theta0": 0.9, "Omega_x": 0.2, "Omega_theta": 0.1}, printed_9, incident_traced
    ),
    "note": "Two misprints: the argument is divided by the cosine, and the phase lacks 2 pi. "
    "First order about the central ray (s4.1a).",
}
AWAY = {
    "implements": "firstorder.transport.events.incidence.Outgoing",
    "symbolic": lambda: [*back_again(), *phases()],
    "autodiff": na("spectral"),
    "fourier": Check(lambda: square_error("outgoing", "spectrum"), 1e-9),
    "brute_force": Check(lambda: against_traced("outgoing"), 1e-9),
    "corrected": "lhat''(O_x, O_theta) = exp(2 pi i O_theta theta_1) |cos(theta_1)| "
    "lhat_o(O_x cos(theta_1), O_theta)",
    "counterexample": Counterexample(
        {"theta1": 0.9, "Omega_x": 0.2, "Omega_theta": 0.1}, printed_10, outgoing_traced
    ),
    "note": "Two misprints: the argument is multiplied by the cosine, and the phase lacks 2 pi. "
    "Energy moves out to O_x / cos(theta_1), which is how D05 section 6.2 uses it.",
}

ROWS = [
    Row(
        "D05.s4.1a",
        "approximation",
        implements="firstorder.transport.events.incidence.Incidence",
        symbolic=lambda: [*projected(), *back_again()],
        autodiff=Check(order_of_the_event, 0.1),
        fourier=na("no spectrum"),
        brute_force=Check(order_of_the_footprint, 0.1),
        note="Second order: exactly x cos(theta) / cos(theta - theta_0), off by "
        "x sin(theta_0) (theta - theta_0); good while |theta - theta_0| tan(theta_0) << 1.",
    ),
    Row("D05.9", "misprint", **INCIDENT),
    Row("D05.10", "misprint", **AWAY),
    Row("D05.T1.3", "misprint", **INCIDENT),
    Row("D05.T1.4", "misprint", **AWAY),
]
