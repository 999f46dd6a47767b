"""The split circle: radii of records in flatland from distances to surfaces.

The imagined world is a circle of radius R around the record, one half of it bright. Moving by dx
brings the edge above to `tan(theta) = -dx / R`; turning by dn moves the normal to or from it. The
irradiance, 1 at the record, becomes `1 +- sin(atan(|dx| / R) + |dn|)` if both work the same way.

What is printed, `|dx| / R + sin |dn|`, bounds that for turns up to a right angle. It is no bound in
other worlds:

* light painted on the circle, nowhere brighter than in the split one: `|E'(0)| <= L / R` and
  `|dE/dn| <= L` still hold, but after a finite step the split may be exceeded, in the third order;
* as a share of E the same light may change by `2 / R` per metre, and by any amount per radian:
  a small light near the horizon;
* other surfaces at R or farther: no bound exists, not even on E' itself.
"""

from __future__ import annotations

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Float

from firstorder.errors import check_not_negative, check_positive, nan_unless
from firstorder.typing import as_float


def split_circle_error(
    dx: ArrayLike, radius: ArrayLike, turn: ArrayLike = 0.0
) -> Float[Array, "..."]:
    """Expected change of irradiance since the record, in the split circle: `|dx| / R + sin |dn|`.

    Beyond a right angle the printed sine falls again, and at half a turn a record would be used for
    the other side of a sheet; here it stays at 1.

    An upper bound in the split circle only (see the module). Elsewhere a heuristic: neither the
    change nor its share of E is bounded by it.

    Args:
        dx: distance from the record along the surface, of either sign [m].
        radius: of the circle, positive [m].
        turn: angle between the two normals, of either sign [rad].

    Raises:
        ValueError: if the radius is not positive. A traced one gives NaN.

    Reference: J12 eq. 34.

    Example:
        >>> from firstorder.caching import split_circle_error
        >>> split_circle_error(-0.1, 0.5).item()
        0.2
    """
    check_positive("radius", radius)
    radius = as_float(radius)
    angle = jnp.minimum(jnp.abs(as_float(turn)), 0.5 * np.pi)
    return jnp.abs(as_float(dx)) / nan_unless(radius > 0, radius) + jnp.sin(angle)


def split_circle_change(
    dx: ArrayLike, radius: ArrayLike, turn: ArrayLike = 0.0
) -> Float[Array, "..."]:
    """The largest true change of irradiance in the split circle, where its value is 1.

    `sin(atan(|dx| / R) + |dn|)` for a step and a turn that work the same way, up to a right angle
    and 1 beyond it. The printed error is its bound.

    Args:
        dx: step along the surface, within the circle [m].
        radius: of the circle, positive [m].
        turn: of the normal [rad].

    Raises:
        ValueError: if the radius is not positive. A traced one gives NaN.

    Reference: derived here; J12 §4.5 prints its bound.

    Example:
        >>> from firstorder.caching import split_circle_change
        >>> split_circle_change(3.0, 4.0).item()
        0.6
    """
    check_positive("radius", radius)
    radius = as_float(radius)
    edge = jnp.arctan2(jnp.abs(as_float(dx)), nan_unless(radius > 0, radius))
    return jnp.sin(jnp.minimum(edge + jnp.abs(as_float(turn)), 0.5 * np.pi))


def minimum_distance(lengths: Float[Array, "... k"]) -> Float[Array, "..."]:
    """Length of the shortest ray; infinite where all miss.

    Args:
        lengths: of the rays, along the last axis; infinite for a miss [m].

    Raises:
        ValueError: if a length is negative. A traced one gives NaN.

    Reference: Tabellion and Lamorlette 2004, as J12 §4.5 uses it.
    """
    lengths = _lengths(lengths)
    return jnp.min(lengths, axis=-1)


def harmonic_mean_distance(lengths: Float[Array, "... k"]) -> Float[Array, "..."]:
    """Harmonic mean of the lengths of rays, `k / sum 1/D`; infinite where all miss.

    Args:
        lengths: of the rays, along the last axis; infinite for a miss [m].

    Raises:
        ValueError: if a length is negative. A traced one gives NaN.

    Reference: Ward et al. 1988, as J12 §4.5 uses it; R07 (37) sums the same 1/D.

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.caching import harmonic_mean_distance
        >>> harmonic_mean_distance(jnp.array([1.0, jnp.inf])).item()
        2.0
    """
    lengths = _lengths(lengths)
    touches = jnp.any(lengths == 0.0, axis=-1)
    free = ~jnp.isfinite(lengths)
    inverse = jnp.where(free, 0.0, 1.0 / jnp.where(free | (lengths == 0.0), 1.0, lengths))
    mean = jnp.mean(inverse, axis=-1)
    empty = mean == 0.0
    return jnp.where(touches, 0.0, jnp.where(empty, jnp.inf, 1.0 / jnp.where(empty, 1.0, mean)))


def _lengths(lengths: Array) -> Array:
    check_not_negative("lengths", jnp.where(jnp.isposinf(lengths), 0.0, lengths))
    return nan_unless(lengths >= 0, lengths)
