"""Convolve in space along one of its two directions."""

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from scipy.integrate import quad

from firstorder.checks.cases.laws.convolve import OFFSET, WIDTH, Leaning, lobe
from firstorder.checks.cases.space._light import (
    CENTER,
    FREQUENCIES,
    RAYS,
    SPREAD,
    bell,
    box,
    light,
)
from firstorder.checks.faults import Fault, twin
from firstorder.checks.squares import Case
from firstorder.conventions import SPACE_SLOPE
from firstorder.fields import Covariance
from firstorder.laws import Convolve

ALONG = np.eye(4)[3]


def brute(u):
    """Adaptive quadrature along the last coordinate."""
    low, high = u[3] - OFFSET - 3.0, u[3] - OFFSET + 3.0

    def product(s):
        return bell([*u[:3], s]) * lobe(u[3] - s)

    return quad(product, low, high, epsabs=1e-13, epsrel=1e-13)[0]


CASES = tuple(
    Case(
        f"convolve in space, {size}^4",
        Convolve(Leaning(WIDTH, OFFSET, "w", SPACE_SLOPE), nodes=56),
        light(),
        box(size, CENTER + OFFSET * ALONG, SPREAD + WIDTH**2 * np.outer(ALONG, ALONG)),
        FREQUENCIES,
        RAYS,
        brute,
        expected={"wavelet": "refused"},
    )
    for size in (24, 25)
)


def with_kernel(change):
    """Fault that changes the kernel of the law."""
    return lambda s: eqx.tree_at(lambda m: m.kernel, s, change(s.kernel))


def added(m, S):
    """Covariances added, as for a product."""
    return Covariance(S.matrix + m.kernel.spread() * jnp.outer(ALONG, ALONG), S.frame)


EVERY = ("value", "gradient", "hessian", "spectrum")
FAULTS = (
    Fault("correlate", with_kernel(lambda g: Leaning(g.sigma, -g.offset, "w", SPACE_SLOPE)), EVERY),
    Fault(
        "convolve along the other direction",
        with_kernel(lambda g: Leaning(g.sigma, g.offset, "v", SPACE_SLOPE)),
        (*EVERY, "covariance"),
    ),
    Fault(
        "a lobe wider by a tenth",
        with_kernel(lambda g: Leaning(1.1 * g.sigma, g.offset, "w", SPACE_SLOPE)),
        (*EVERY, "covariance"),
    ),
    Fault("add covariances", lambda s: twin(s, covariance=added), ("covariance",)),
)
