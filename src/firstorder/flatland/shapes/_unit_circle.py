"""A line and the unit circle: the crossings and the tangents that all round shapes share."""

from __future__ import annotations

import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float

from firstorder.flatland.shapes._base import Point
from firstorder.numerics._planar import cross_2d, dot_2d, left
from firstorder.numerics._quadratic import root_sum
from firstorder.numerics._select import either, grazing

SLACK = 16.0  # roundings by which the square under a grazing ray's root may be off


def unit_circle_roots(w: Point, d: Point, on: Bool[Array, ""]):
    """Both roots t of `|w + t d| = 1` without cancellation, each with whether it is one and ahead.

    With `on`, w lies on the circle to rounding: the root at t = 0 is not one, the other may be.

    Returns:
        For each root its t, which is finite for a miss too; whether it is a hit; and whether it is
        a hit or a miss within rounding. The place of a hit depends on the last condition, since
        rounding may decide the other one in two ways (see `grazing`).
    """
    a, b, c = dot_2d(d, d), dot_2d(w, d), dot_2d(w, w) - 1.0
    root_of = under_the_root(a - cross_2d(w, d) ** 2, b, on)
    real, nearly = root_of > 0.0, root_of > -SLACK * grazing(a)
    total, taken_off = root_sum(b, root_of, a)
    near, far = c / total, either(taken_off, total, -c) / either(taken_off, a, total)
    ahead, outside = b < 0.0, (c > 0.0) & ~on
    first, last = ahead & outside, ahead | ((c < 0.0) & ~on)
    return (near, real & first, nearly & first), (far, real & last, nearly & last)


def under_the_root(difference: Array, b: Array, on: Bool[Array, ""]) -> Array:
    """The square under the root of a line and a circle; `b^2` for a line that starts on the circle.

    There the difference is the same number but for the rounding of the start, which is large for a
    small circle far from the origin: a ray along it would miss it. Its derivatives are right.
    """
    return difference + either(on, jax.lax.stop_gradient(b * b - difference), 0.0)


def unit_circle_tangents(w: Point, on: Bool[Array, ""]):
    """The two points of the unit circle at which lines from w touch it, and whether there are any.

    A point that lies on the circle to rounding has them to both sides of it, for an eye there may
    see past the circle. With `on` they are two points of the tangent at w, and turn as it does.
    """
    square, tiny = dot_2d(w, w), SLACK * grazing(jnp.ones_like(w[0]))
    beside = ~on & (square > 1.0 - tiny)
    foot = w / jnp.where(beside, square, 1.0)
    root = jnp.where(on, 1.0, jnp.sqrt(jnp.where(square > 1.0, square - 1.0, tiny)))
    side = left(foot) * root
    points = jnp.stack([foot - side, foot + side])
    return points, jnp.broadcast_to(beside | on, (2,))


def on_circle(h: Point, there: Bool[Array, ""]) -> Point:
    """A point of the unit circle; the top in place of a miss."""
    return jnp.where(there, h, jnp.array([0.0, 1.0], h.dtype))


def turns(h: Point, there: Bool[Array, ""]) -> Float[Array, ""]:
    """Clockwise turns from the top to a point of the unit circle, in [0, 1); 0 for a miss."""
    h = on_circle(h, there)
    return jnp.mod(jnp.arctan2(h[0], h[1]) / (2.0 * jnp.pi), 1.0)
