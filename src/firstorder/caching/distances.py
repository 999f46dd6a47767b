"""Radii of records from distances alone: split circle and split sphere, and lengths of rays.

The imagined world is a circle (along a line, J12) or a sphere (on a plane, Ward) of radius R around
the record, one half of it bright.

Circle: moving by dx brings the edge above to `tan(theta) = -dx / R`; turning by dn moves the normal
to or from it. The irradiance, 1 at the record, becomes `1 +- sin(atan(|dx| / R) + |dn|)` if both
work the same way. What is printed, `|dx| / R + sin |dn|`, bounds that for turns up to a right
angle.

Sphere: after a step dx away from the bright half its edge is seen at `a = atan(|dx| / R)` from the
normal's plane, and the irradiance, `pi / 2` at the record, has lost the share
`(2 / pi) (a + sin a cos a)`; a turn dn costs `sin |dn|`. What is used,
`(4 / pi) |dx| / R + 2 sin(|dn| / 2)`, bounds their sum. Its factor 4 / pi disappears in the
accuracy that a user chooses, and on a plane only the ratio |dx| / R is left.

Neither is a bound in other worlds:

* light painted on the circle, nowhere brighter than in the split one: `|E'(0)| <= L / R` and
  `|dE/dn| <= L` still hold, but after a finite step the split may be exceeded, in the third order;
* as a share of E the same light may change by `2 / R` per metre, and by any amount per radian:
  a small light near the horizon;
* other surfaces at R or farther: no bound exists, not even on E' itself.
"""

from __future__ import annotations

import math

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Float

from firstorder._argument_checks import (
    check_finite,
    check_not_negative,
    check_positive,
    check_shape,
    nan_unless,
    not_negative,
)
from firstorder.caching.regions import _checked_dims
from firstorder.typing import as_float

BLOCK = 1024  # places compared with all others at a time


def split_error(
    dx: ArrayLike, radius: ArrayLike, turn: ArrayLike = 0.0, dims: int = 1
) -> Float[Array, "..."]:
    """Expected change of irradiance since the record, as a share, in the split circle or sphere.

    `|dx| / R + sin |dn|` along a line, `(4 / pi) |dx| / R + sqrt(2 - 2 cos dn)` on a plane.

    Beyond a right angle the printed sine falls again, and at half a turn a record would be used for
    the other side of a sheet; here it stays at 1.

    An upper bound in the split circle and sphere only (see the module). Elsewhere a heuristic:
    neither the change nor its share of E is bounded by it. Numbers, or arrays that broadcast.

    Args:
        dx: distance from the record, of either sign [m].
        radius: of the circle or sphere, positive [m].
        turn: angle between the two normals, of either sign; on a plane up to half a turn [rad].
        dims: 1 for the circle, 2 for the sphere.

    Raises:
        ValueError: if the radius is not positive, or for another number of dimensions. A traced
            radius gives NaN.

    Reference: J12 eq. 34 (circle); Ward et al. 1988, to which J12 §8 compares (sphere).

    Example:
        >>> from firstorder.caching import split_error
        >>> split_error(-0.1, 0.5).item(), round(split_error(0.1, 0.5, dims=2).item(), 6)
        (0.2, 0.254648)
    """
    _checked_dims(dims)
    check_positive("radius", radius)
    radius, angle = as_float(radius), jnp.abs(as_float(turn))
    step = jnp.abs(as_float(dx)) / nan_unless(radius > 0, radius)
    if dims == 1:
        return step + jnp.sin(jnp.minimum(angle, 0.5 * np.pi))
    return (4.0 / math.pi) * step + 2.0 * jnp.sin(0.5 * jnp.minimum(angle, math.pi))


def split_radius(length: ArrayLike, accuracy: ArrayLike, dims: int = 1) -> Float[Array, "..."]:
    """How far a record reaches until `split_error` without a turn is the accuracy (Ward's metric).

    `a R` along a line, `(pi / 4) a R` on a plane, for the accuracy a. Programs that drop the factor
    4 / pi of the error, as Radiance does, have the radius a R on a plane: that is
    `split_radius(R, 4 / pi * a, dims=2)`. `circular_regions` holds the radii within limits, without
    which they vanish in a corner. Numbers, or arrays that broadcast.

    Args:
        length: R of each record, `harmonic_mean_distance` or `minimum_distance` of its rays, not
            negative, may be infinite [m].
        accuracy: the share of the irradiance that may be wrong, positive.
        dims: 1 along a line, 2 on a plane.

    Returns:
        A radius for each length [m].

    Raises:
        ValueError: if a length is negative, the accuracy is not positive, or for another number of
            dimensions. A traced one gives NaN.

    Reference: J12 eq. 34 (circle); Ward et al. 1988 (sphere).

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.caching import circular_regions, harmonic_mean_distance, split_radius
        >>> R = harmonic_mean_distance(jnp.array([[1.0, 3.0], [2.0, jnp.inf]]))
        >>> print(split_radius(R, 0.2))
        [0.3 0.8]
        >>> print(circular_regions(split_radius(R, 0.2, dims=2), 0.1, 0.5, dims=2).radius.round(3))
        [0.236 0.5  ]
    """
    _checked_dims(dims)
    length, accuracy = as_float(length), as_float(accuracy)
    check_not_negative("length", _finite(length))
    check_positive("accuracy", accuracy)
    sound = (length >= 0) & (accuracy > 0)
    return nan_unless(sound, accuracy * length * (1.0 if dims == 1 else 0.25 * math.pi))


def split_change(
    dx: ArrayLike, radius: ArrayLike, turn: ArrayLike = 0.0, dims: int = 1
) -> Float[Array, "..."]:
    """The largest true change of irradiance in the split circle or sphere, as a share.

    With `a = atan(|dx| / R)`: in the circle `sin(a + |dn|)` for a step and a turn that work the
    same way, up to a right angle and 1 beyond it; in the sphere `(2 / pi) (a + sin a cos a)` for a
    step alone: seen from there and projected onto the floor, the edge of the bright half is the
    chord `x = sin a` of the unit disc. `split_error` is their bound. Numbers, or
    arrays that broadcast.

    Args:
        dx: step, within the circle or sphere [m].
        radius: of it, positive [m].
        turn: of the normal, in the circle [rad].
        dims: 1 for the circle, 2 for the sphere.

    Raises:
        ValueError: if the radius is not positive, for a turn in the sphere, or for another number
            of dimensions. A traced radius gives NaN.

    Reference: derived here; J12 §4.5 prints the bound of the circle's.

    Example:
        >>> from firstorder.caching import split_change
        >>> split_change(3.0, 4.0).item(), round(split_change(1.0, 1.0, dims=2).item(), 6)
        (0.6, 0.81831)
    """
    _checked_dims(dims)
    check_positive("radius", radius)
    radius = as_float(radius)
    a = jnp.arctan2(jnp.abs(as_float(dx)), nan_unless(radius > 0, radius))
    if dims == 1:
        return jnp.sin(jnp.minimum(a + jnp.abs(as_float(turn)), 0.5 * np.pi))
    if not (isinstance(turn, (int, float)) and turn == 0.0):
        raise ValueError("Argument `turn` must be left out in the split sphere.")
    return (2.0 / math.pi) * (a + jnp.sin(a) * jnp.cos(a))


def minimum_distance(lengths: ArrayLike) -> Float[Array, "..."]:
    """Length of the shortest ray; infinite where all miss.

    Args:
        lengths: of the rays, shape (..., k); infinite for a miss [m].

    Returns:
        One length for each row of rays [m].

    Raises:
        ValueError: if a length is negative. A traced one gives NaN.

    Reference: Tabellion and Lamorlette 2004, as J12 §4.5 uses it.

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.caching import minimum_distance
        >>> minimum_distance(jnp.array([[1.0, 0.5, jnp.inf], [jnp.inf, jnp.inf, jnp.inf]])).tolist()
        [0.5, inf]
    """
    lengths = _lengths(lengths)
    return jnp.min(lengths, axis=-1)


def harmonic_mean_distance(
    lengths: ArrayLike, weights: ArrayLike | None = None
) -> Float[Array, "..."]:
    """Harmonic mean of the lengths of rays, `sum w / sum (w / D)`; infinite where none hits.

    Args:
        lengths: of the rays, an array with these along the last axis; infinite for a miss [m].
        weights: an array of that shape: solid angle times cosine, or whatever each ray stands for,
            not negative; rays that are sampled by the cosine count alike, as they do if these are
            left out. Where all are zero the mean is infinite, too.

    Returns:
        One length for each row of rays [m].

    Raises:
        ValueError: if a length or a weight is negative. A traced one gives NaN.

    Reference: Ward et al. 1988, as J12 §4.5 uses it; R07 (37) sums the same 1/D.

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.caching import harmonic_mean_distance
        >>> harmonic_mean_distance(jnp.array([1.0, jnp.inf])).item()
        2.0
        >>> harmonic_mean_distance(jnp.array([1.0, jnp.inf]), jnp.array([1.0, 3.0])).item()
        4.0
    """
    lengths = _lengths(lengths)
    touches = jnp.any(lengths == 0.0, axis=-1)
    free = jnp.isposinf(lengths)
    inverse = jnp.where(free, 0.0, 1.0 / jnp.where(free | (lengths == 0.0), 1.0, lengths))
    if weights is None:
        mean = jnp.mean(inverse, axis=-1)
    else:
        check_not_negative("weights", weights)
        w = not_negative(as_float(weights))
        touches = jnp.any((lengths == 0.0) & (w > 0.0), axis=-1)
        total = jnp.sum(w, axis=-1)
        mean = jnp.sum(w * inverse, axis=-1) / jnp.where(total == 0.0, 1.0, total)
    empty = mean == 0.0
    touches &= ~jnp.isnan(mean)
    return jnp.where(touches, 0.0, jnp.where(empty, jnp.inf, 1.0 / jnp.where(empty, 1.0, mean)))


def _lengths(lengths: ArrayLike) -> Array:
    lengths = as_float(lengths)
    if lengths.shape[-1:] in ((), (0,)):
        raise ValueError(
            "Argument `lengths` must hold at least one ray in a row, but has shape "
            f"{lengths.shape}."
        )
    check_not_negative("lengths", _finite(lengths))
    return nan_unless(lengths >= 0, lengths)


def _finite(lengths: Array) -> Array:
    """Lengths as they are judged: those of rays that miss are as good as any."""
    return jnp.where(jnp.isposinf(lengths), 0.0, lengths)


def neighbour_clamping(position: ArrayLike, length: ArrayLike) -> np.ndarray:
    """Lengths cut so that none exceeds a neighbour's by more than their distance.

    `min_j (R_j + |x_i - x_j|)`: what the distance to the nearest surface fulfils by the triangle
    inequality, and what missed geometry and means of distances break. It acts both ways: a small
    length cuts its neighbours', and the largest field that obeys is reached in one pass.

    Args:
        position: places (m, 1), (m, 2) or (m, 3) [m].
        length: of each, (m,), may be infinite [m].

    Returns:
        The lengths, as a NumPy array. Time and memory are those of m x 1024 distances at a time.

    Raises:
        ValueError: if a length is negative, or there is not one for each place.

    Reference: Krivanek et al. 2006 (neighbour clamping), which J12 §8.2 names.

    Example:
        >>> import numpy as np
        >>> from firstorder.caching import neighbour_clamping
        >>> neighbour_clamping(np.array([[0.0, 0.0], [1.0, 0.0]]), np.array([0.5, 9.0])).tolist()
        [0.5, 1.5]
    """
    x, R = np.asarray(position, dtype=float), np.asarray(length, dtype=float)
    if x.ndim != 2:
        raise ValueError(f"Argument `position` must have shape (m, d), but has {x.shape}.")
    check_finite("position", x)
    check_shape("length", R, x.shape[:1])
    check_not_negative("length", np.where(np.isposinf(R), 0.0, R))
    held = np.empty_like(R)
    for start in range(0, len(R), BLOCK):
        rows = slice(start, start + BLOCK)
        distance = np.sqrt(sum((x[rows, None, k] - x[None, :, k]) ** 2 for k in range(x.shape[1])))
        held[rows] = np.min(R + distance, axis=1)
    return held
