"""Mirror: directions change sign, positions do not."""

import jax.numpy as jnp

from firstorder.checks.cases import FREQUENCIES, GRID, RAYS, bell, light
from firstorder.checks.faults import Fault, twin_law
from firstorder.checks.squares import Case
from firstorder.laws import Move
from firstorder.transport import Mirror

CASES = (
    Case(
        "mirror",
        Mirror(),
        light(),
        GRID,
        FREQUENCIES,
        RAYS,
        lambda u: bell(u[0], -u[1]),
        expected={"wavelet": "refused"},
    ),
)

EVERY = ("value", "gradient", "hessian", "spectrum", "covariance")


def _flip(signs):
    return lambda s: twin_law(s, lambda m: Move(jnp.diag(jnp.array(signs)), to=m.to))


FAULTS = (
    Fault(
        "do not mirror",
        _flip([1.0, 1.0]),
        ("value", "gradient", "hessian", "spectrum", "covariance"),
    ),
    Fault(
        "mirror space, not angle", _flip([-1.0, 1.0]), ("value", "gradient", "hessian", "spectrum")
    ),
    Fault("a turn by 180 degrees", _flip([-1.0, -1.0]), EVERY),
    Fault("angles count double", _flip([1.0, -2.0]), EVERY),
    Fault(
        "exchange space and angle",
        lambda s: twin_law(s, lambda m: Move(jnp.array([[0.0, 1.0], [1.0, 0.0]]), to=m.to)),
        EVERY,
    ),
)
