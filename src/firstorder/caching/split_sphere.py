"""The split sphere: radii of records on surfaces from distances alone.

The imagined world is a sphere of radius R around the record, one half of it bright. After a step
dx away from that half its edge is seen at `a = atan(|dx| / R)` from the normal's plane, and the
irradiance, `pi / 2` at the record, has lost the share `(2 / pi) (a + sin a cos a)`; a turn dn
costs `sin |dn|`. What is used, `(4 / pi) |dx| / R + 2 sin(|dn| / 2)`, bounds their sum.

As in flatland it is no bound in other worlds. Its factor 4 / pi disappears in the accuracy that a
user chooses, and on a plane only the ratio |dx| / R is left.
"""

from __future__ import annotations

import math

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Float

from firstorder.caching.split_circle import harmonic_mean_distance
from firstorder.errors import check_not_negative, check_positive, nan_unless
from firstorder.typing import as_float

BLOCK = 1024  # places compared with all others at a time


def split_sphere_error(
    dx: ArrayLike, radius: ArrayLike, turn: ArrayLike = 0.0
) -> Float[Array, "..."]:
    """Expected share of irradiance that changes: `(4 / pi) |dx| / R + sqrt(2 - 2 cos dn)`.

    An upper bound in the split sphere only (see the module).

    Args:
        dx: length of the step from the record [m].
        radius: of the sphere, positive [m].
        turn: angle between the two normals, up to half a turn [rad].

    Raises:
        ValueError: if the radius is not positive. A traced one gives NaN.

    Reference: Ward et al. 1988, to which J12 §8 compares.

    Example:
        >>> from firstorder.caching import split_sphere_error
        >>> round(split_sphere_error(0.1, 0.5).item(), 6)
        0.254648
    """
    check_positive("radius", radius)
    radius = as_float(radius)
    step = jnp.abs(as_float(dx)) / nan_unless(radius > 0, radius)
    angle = jnp.minimum(jnp.abs(as_float(turn)), math.pi)
    return (4.0 / math.pi) * step + 2.0 * jnp.sin(0.5 * angle)


def split_sphere_change(dx: ArrayLike, radius: ArrayLike) -> Float[Array, "..."]:
    """The largest true share of irradiance lost by a step in the split sphere.

    `(2 / pi) (a + sin a cos a)` with `a = atan(|dx| / R)`: seen from there and projected onto the
    floor, the edge of the bright half is the chord `x = sin a` of the unit disc.

    Args:
        dx: length of the step, within the sphere [m].
        radius: of the sphere, positive [m].

    Raises:
        ValueError: if the radius is not positive. A traced one gives NaN.

    Reference: derived here.

    Example:
        >>> from firstorder.caching import split_sphere_change
        >>> round(split_sphere_change(1.0, 1.0).item(), 6)
        0.81831
    """
    check_positive("radius", radius)
    radius = as_float(radius)
    a = jnp.arctan2(jnp.abs(as_float(dx)), nan_unless(radius > 0, radius))
    return (2.0 / math.pi) * (a + jnp.sin(a) * jnp.cos(a))


def weighted_harmonic_length(lengths: ArrayLike, weights: ArrayLike) -> Float[Array, "..."]:
    """Weighted harmonic mean of the lengths of rays; infinite where all miss.

    `sum w / sum (w / D)`. Rays that are sampled by the cosine count alike:
    `harmonic_mean_distance`.

    Args:
        lengths: of the rays, along the last axis; infinite for a miss [m].
        weights: solid angle times cosine, or whatever each ray stands for; not negative.

    Raises:
        ValueError: if a length or a weight is negative.

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.caching import weighted_harmonic_length
        >>> weighted_harmonic_length(jnp.array([1.0, jnp.inf]), jnp.array([1.0, 3.0])).item()
        4.0
    """
    check_not_negative("weights", weights)
    w = as_float(weights)
    share = w * w.shape[-1] / jnp.sum(w, axis=-1, keepdims=True)
    none = share == 0.0
    # A ray of weight w is one of length D / w among equals.
    return harmonic_mean_distance(
        jnp.where(none, jnp.inf, as_float(lengths) / jnp.where(none, 1.0, share))
    )


def neighbour_clamping(position: ArrayLike, length: ArrayLike) -> np.ndarray:
    """Lengths cut so that none exceeds a neighbour's by more than their distance.

    `min_j (R_j + |x_i - x_j|)`: what the distance to the nearest surface fulfils by the triangle
    inequality, and what missed geometry and means of distances break. It acts both ways: a small
    length cuts its neighbours', and the largest field that obeys is reached in one pass.

    Args:
        position: places (m, 2) or (m, 3) [m].
        length: of each, may be infinite [m].

    Returns:
        The lengths, as a NumPy array. Time and memory are those of m x 1024 distances at a time.

    Raises:
        ValueError: if a length is negative.

    Reference: Krivanek et al. 2006 (neighbour clamping), which J12 §8.2 names.

    Example:
        >>> import numpy as np
        >>> from firstorder.caching import neighbour_clamping
        >>> neighbour_clamping(np.array([[0.0, 0.0], [1.0, 0.0]]), np.array([0.5, 9.0])).tolist()
        [0.5, 1.5]
    """
    x, R = np.asarray(position, dtype=float), np.asarray(length, dtype=float)
    check_not_negative("length", np.where(np.isposinf(R), 0.0, R))
    held = np.empty_like(R)
    for start in range(0, len(R), BLOCK):
        rows = slice(start, start + BLOCK)
        distance = np.sqrt(sum((x[rows, None, k] - x[None, :, k]) ** 2 for k in range(x.shape[1])))
        held[rows] = np.min(R + distance, axis=1)
    return held
