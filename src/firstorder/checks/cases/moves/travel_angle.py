"""Travel in angles: a warp, exact at any angle, whose spectrum is refused."""

import equinox as eqx
import jax.numpy as jnp
import numpy as np

from firstorder.checks.cases import FREQUENCIES, GRID, RAYS, bell, light
from firstorder.checks.faults import Fault, twin, twin_law
from firstorder.checks.squares import Case
from firstorder.conventions import FLATLAND
from firstorder.fields import Jet
from firstorder.transport import Travel

D = 0.8


def coming(u):
    """Look along the ray, from the line y = 0 up to y = D, where the light was known."""
    x, theta = u
    along = np.array([-np.sin(theta), np.cos(theta)])
    x0, _ = np.linalg.solve(np.array([[1.0, -along[0]], [0.0, -along[1]]]), np.array([x, -D]))
    return bell(x0, theta)


def flat(law, jet, u):
    """The chain rule without the bend of the map."""
    J = law.map.derivatives(u)[1]
    return Jet(jet.value, J.T @ jet.gradient, J.T @ jet.hessian @ J, jet.frame)


CASES = (
    Case(
        "travel, in angles",
        Travel(D),
        light(FLATLAND),
        GRID,
        FREQUENCIES,
        RAYS,
        coming,
        expected={"spectrum": "refused", "covariance": "refused", "wavelet": "refused"},
    ),
)

EVERY = ("value", "gradient", "hessian")
FAULTS = (
    Fault("half as far", lambda s: Travel(0.5 * s.d), EVERY),
    Fault(
        "flip the shear",
        lambda s: twin_law(s, lambda w: eqx.tree_at(lambda w: w.map.shear, w, s.d)),
        EVERY,
    ),
    Fault(
        "take the angle for its tangent",
        lambda s: twin_law(s, lambda w: w.linearise(jnp.zeros(2)).move),
        EVERY,
    ),
    Fault(
        "forget the bend of the rays",
        lambda s: twin_law(s, lambda w: twin(w, push=flat)),
        ("hessian",),
    ),
    Fault(
        "do not pull the gradient back",
        lambda s: twin_law(s, lambda w: twin(w, push=lambda w, jet, u: jet)),
        ("gradient", "hessian"),
    ),
)
