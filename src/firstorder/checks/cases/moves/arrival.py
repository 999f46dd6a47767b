"""Arrival: the half-turn between a surface that light leaves and the one it comes to."""

import numpy as np

from firstorder.checks.cases import FREQUENCIES, GRID, RAYS, bell, light
from firstorder.checks.faults import Fault, twin_law
from firstorder.checks.squares import Case
from firstorder.conventions import Frame
from firstorder.laws import Move
from firstorder.transport.events.travel import Arrival


def facing(u):
    """Turn the receiver's ray into the plane, and read it off in the frame of the source."""
    x, v = u
    half_turn = np.array([[np.cos(np.pi), -np.sin(np.pi)], [np.sin(np.pi), np.cos(np.pi)]])
    point = half_turn @ np.array([x, 0.0])
    comes_from = half_turn @ np.array([-v, 1.0])
    goes_to = -comes_from
    return bell(point[0], -goes_to[0] / goes_to[1])


CASES = (
    Case(
        "arrival",
        Arrival(),
        light(Frame(("x", "v"), "outgoing")),
        GRID,
        FREQUENCIES,
        RAYS,
        facing,
        expected={"wavelet": "refused"},
    ),
)

EVERY = ("value", "gradient", "hessian", "spectrum", "covariance")
FAULTS = (
    Fault("keep x", lambda s: twin_law(s, lambda m: Move(np.eye(2), to=m.to)), EVERY),
    Fault(
        "flip the slope too",
        lambda s: twin_law(s, lambda m: Move(-np.eye(2), to=m.to)),
        EVERY,
    ),
    Fault(
        "shift instead of flip",
        lambda s: twin_law(s, lambda m: Move(np.eye(2), np.array([-0.4, 0.0]), m.to)),
        EVERY,
    ),
    Fault(
        "flip the slope instead",
        lambda s: twin_law(s, lambda m: Move(-m.M, to=m.to)),
        ("value", "gradient", "hessian", "spectrum"),
    ),
)
