"""Incidence and outgoing frames to first order: moves, found here by tracing nearby rays."""

import jax.numpy as jnp
import numpy as np

from firstorder.checks.cases import FREQUENCIES, GRID, RAYS, bell, light
from firstorder.checks.faults import Fault, twin, twin_law
from firstorder.checks.squares import Case
from firstorder.conventions import FLATLAND, Frame
from firstorder.laws import Move
from firstorder.transport.events.incidence import Incidence, Outgoing
from firstorder.transport.events.travel import Arrival

ANGLE = 0.6
LEAVING = Frame(("x", "theta"), "outgoing")


def trace(x, theta, tilt):
    """Point and local angle at which a ray meets a line through the origin, tilted by `tilt`.

    The ray starts at x on the untilted line, at the angle theta from its normal.
    """
    along = np.array([-np.sin(theta), np.cos(theta)])
    axis, normal = np.array([np.cos(tilt), np.sin(tilt)]), np.array([-np.sin(tilt), np.cos(tilt)])
    # (x, 0) + t along = s axis
    _, s = np.linalg.solve(np.stack([along, -axis], axis=1), np.array([-x, 0.0]))
    return s, float(np.arctan2(-along @ axis, along @ normal))


def nearby(x, theta, centre, tilt, e=1e-3):
    """The traced map to first order about the central ray, by differences of traced rays."""

    def difference(h):
        there = [np.array(trace(s * h * x, centre + s * h * theta, tilt)) for s in (1.0, -1.0)]
        return (there[0] - there[1]) / (2.0 * h)

    moved = (4.0 * difference(e) - difference(2.0 * e)) / 3.0
    return moved + np.array(trace(0.0, centre, tilt))


def onto(u):
    """Light at a ray of the surface, looked up on the plane across the ray, tilted by the angle."""
    x, theta = u
    return bell(*nearby(x, theta - ANGLE, ANGLE, ANGLE))


def arriving(u):
    """Light at a ray of the surface, looked up in the frame that it leaves, turned half round."""
    x, theta = u
    s, angle = nearby(x, theta - ANGLE, ANGLE, ANGLE)
    return bell(-s, angle)


def away(u):
    """Light at a ray of the plane across the ray, looked up on the surface, tilted back."""
    x, theta = u
    return bell(*nearby(x, theta, 0.0, -ANGLE))


CASES = tuple(
    Case(name, step, light(frame), GRID, FREQUENCIES, RAYS, brute, expected={"wavelet": "refused"})
    for name, step, frame, brute in (
        ("incidence", Incidence(ANGLE), FLATLAND, onto),
        ("arrival at incidence", Arrival() >> Incidence(ANGLE), LEAVING, arriving),
        ("outgoing", Outgoing(ANGLE), LEAVING, away),
    )
)


def wrong(change):
    """The step with the law of its last event changed."""

    def make(s):
        if hasattr(s, "events"):
            return s.events[0] >> twin_law(s.events[1], change)
        return twin_law(s, change)

    return make


EVERY = ("value", "gradient", "hessian", "spectrum", "covariance")
FAULTS = (
    Fault("scale the other way", wrong(lambda m: Move(jnp.linalg.inv(m.M), m.c)), EVERY),
    Fault("forget to scale", wrong(lambda m: Move(jnp.eye(2), m.c)), EVERY),
    Fault("scale the angle too", wrong(lambda m: Move(m.M[0, 0] * jnp.eye(2), m.c)), EVERY),
    Fault(
        "shift the other way",
        wrong(lambda m: Move(m.M, -m.c)),
        ("value", "gradient", "hessian", "spectrum"),
    ),
    Fault(
        "drop the 2 pi of the phase",
        wrong(lambda m: Move(m.M, m.c / (2.0 * np.pi))),
        ("spectrum",),
    ),
    Fault(
        "the printed argument",
        wrong(
            lambda m: twin(
                m,
                spectrum=lambda m, F, w: Move.spectrum(m, F, w * jnp.array([m.M[0, 0] ** 2, 1.0])),
            )
        ),
        ("spectrum",),
    ),
)
