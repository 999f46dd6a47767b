"""Slopes and angles: each renaming of directions is a warp."""

import jax.numpy as jnp
import numpy as np

from firstorder.checks.cases import FREQUENCIES, GRID, bell, light
from firstorder.checks.faults import Fault, twin, twin_law
from firstorder.checks.squares import Case
from firstorder.conventions import FLATLAND, FLATLAND_SLOPE
from firstorder.fields import Jet
from firstorder.laws import Move
from firstorder.laws.warp import Map, Warp
from firstorder.transport.events.slopes import ToAngle, ToSlope

RAYS = np.array([[0.3, 0.4], [-0.4, 0.75], [0.7, -0.6]])


def by_slope(u):
    """The angle of the vector (-v, 1) from the normal, read off with `arctan2`."""
    x, v = u
    return bell(x, float(np.arctan2(v, 1.0)))


def by_angle(u):
    """Radiance by the angle of a ray, from where it meets the line at distance one."""
    x, theta = u
    return bell(x, np.sin(theta) / np.cos(theta))


REFUSED = {"spectrum": "refused", "covariance": "refused", "wavelet": "refused"}
CASES = (
    Case(
        "angle to slope",
        ToSlope(),
        light(FLATLAND),
        GRID,
        FREQUENCIES,
        RAYS,
        by_slope,
        expected=REFUSED,
    ),
    Case(
        "slope to angle",
        ToAngle(),
        light(FLATLAND_SLOPE),
        GRID,
        FREQUENCIES,
        RAYS,
        by_angle,
        expected=REFUSED,
    ),
)


class _Sine(Map):
    """`(x, sin(theta))`: neither of the two."""

    def __call__(self, u):
        return jnp.stack([u[0], jnp.sin(u[1])])


def flat(law, jet, u):
    """The chain rule without the bend of the map."""
    J = law.map.derivatives(u)[1]
    return Jet(jet.value, J.T @ jet.gradient, J.T @ jet.hessian @ J, law.frame(jet.frame))


EVERY = ("value", "gradient", "hessian")
FAULTS = (
    Fault(
        "take the slope for the angle",
        lambda s: twin_law(s, lambda w: Move(np.eye(2), to=w.to)),
        EVERY,
    ),
    Fault("sine for tangent", lambda s: twin_law(s, lambda w: Warp(_Sine(), w.to)), EVERY),
    Fault(
        "flip the direction",
        lambda s: twin_law(s, lambda w: Move(np.diag([1.0, -1.0]), to=w.to)),
        EVERY,
    ),
    Fault(
        "forget the bend",
        lambda s: twin_law(s, lambda w: twin(w, push=flat)),
        ("hessian",),
    ),
)
