"""Incidence and outgoing frames, exact: warps, traced ray by ray."""

import equinox as eqx

from firstorder.checks.cases import FREQUENCIES, GRID, RAYS, bell, light
from firstorder.checks.cases.moves.incidence import ANGLE, LEAVING, trace
from firstorder.checks.faults import Fault, twin, twin_law
from firstorder.checks.squares import Case
from firstorder.conventions import FLATLAND
from firstorder.fields import Jet
from firstorder.transport.events.incidence import Incidence, Outgoing

REFUSED = {"spectrum": "refused", "covariance": "refused", "wavelet": "refused"}
CASES = tuple(
    Case(name, step, light(frame), GRID, FREQUENCIES, RAYS, brute, expected=REFUSED)
    for name, step, frame, brute in (
        (
            "incidence, exact",
            Incidence(ANGLE, exact=True),
            FLATLAND,
            lambda u: bell(*trace(*u, ANGLE)),
        ),
        (
            "outgoing, exact",
            Outgoing(ANGLE, exact=True),
            LEAVING,
            lambda u: bell(*trace(*u, -ANGLE)),
        ),
    )
)


def flat(law, jet, u):
    """The chain rule without the bend of the map."""
    J = law.map.derivatives(u)[1]
    return Jet(jet.value, J.T @ jet.gradient, J.T @ jet.hessian @ J, jet.frame)


EVERY = ("value", "gradient", "hessian")
FAULTS = (
    Fault(
        "tilt the other way",
        lambda s: twin_law(s, lambda w: eqx.tree_at(lambda w: w.map.angle, w, -w.map.angle)),
        EVERY,
    ),
    Fault("first order only", lambda s: type(s)(ANGLE), EVERY),
    Fault(
        "half the tilt",
        lambda s: twin_law(s, lambda w: eqx.tree_at(lambda w: w.map.angle, w, 0.5 * w.map.angle)),
        EVERY,
    ),
    Fault("forget the bend", lambda s: twin_law(s, lambda w: twin(w, push=flat)), ("hessian",)),
)
