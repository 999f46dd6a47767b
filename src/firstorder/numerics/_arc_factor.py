"""The ratio of an angle to its sine, with its derivatives: what integrals along segments hold."""

from __future__ import annotations

import math
from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from firstorder.numerics._select import either

Numbers = Float[Array, "*n"]

# Below this 1 - cos(angle) an integral by so many nodes, symmetric ones taken together. On both
# sides A and A' err by a few roundings there and A'' by 1e-13, which counts by the angle's square.
SHORT, NODES = 0.04, 8


def _rule() -> tuple[np.ndarray, np.ndarray]:
    """Places `2 s (1 - s)` of nodes in the upper half of [0, 1], and the weights of both halves."""
    x, w = np.polynomial.legendre.leggauss(NODES)
    return 0.5 * (1.0 - x[NODES // 2 :] ** 2), w[NODES // 2 :]


PLACES, WEIGHTS = _rule()


@partial(jax.custom_jvp, nondiff_argnums=(2,))
def arc_factor(square: Numbers, cosine: Numbers, derivatives: int) -> tuple[Numbers, ...]:
    """`A(k) = arccos(k) / sqrt(1 - k^2)` of a cosine k, and so many derivatives of it.

    Smooth wherever k > -1: an angle of zero is no exception. There A is taken as an integral along
    the chord of the angle, `A(k) = integral from 0 to 1 of ds / (1 - 2 s (1 - s) (1 - k))`;
    elsewhere `(1 - k^2) A' = k A - 1` and its derivatives give one after the other.

    Args:
        square: 1 - k^2, with the digits that a difference of close numbers loses.
        cosine: k.
        derivatives: how many.

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.numerics._arc_factor import arc_factor
        >>> A, slope = arc_factor(jnp.array(0.0), jnp.array(1.0), 1)  # of no angle
        >>> round(A.item(), 6), round(slope.item(), 6)
        (1.0, -0.333333)
    """
    both = 1.0 + cosine
    short = square < SHORT * both
    places = jnp.asarray(PLACES, cosine.dtype)
    near = either(short, square / both, 0.0)[..., None]
    inverse = 1.0 / (1.0 - near * places)
    square = either(short, 1.0, square)
    sine = jnp.sqrt(square)
    far = [jnp.arctan2(sine, cosine) / sine]
    for n in range(1, derivatives + 1):
        rest = (n - 1) ** 2 * far[n - 2] if n > 1 else -1.0
        far.append(((2 * n - 1) * cosine * far[n - 1] + rest) / square)
    close = []
    for n in range(derivatives + 1):
        weights = jnp.asarray(math.factorial(n) * (-PLACES) ** n * WEIGHTS, cosine.dtype)
        close.append(jnp.sum(weights * inverse ** (n + 1), -1))
    return tuple(either(short, *pair) for pair in zip(close, far, strict=True))


@arc_factor.defjvp
def _arc_factor_rule(derivatives, primals, tangents):
    """Of one function of k, whichever of its two arguments moves."""
    found = arc_factor(*primals, derivatives + 1)
    return found[:-1], tuple(slope * tangents[1] for slope in found[1:])
