"""Integrals over regions of the sphere as integrals along their edges.

An edge is a curve `p(t)` relative to the eye, in the frame of the receiver (normal +z); D = |p|,
w = p / D. The region lies to the left, where `p x p'` points. With Stokes' theorem on the sphere,

    solid angle             integral dw            = contour  (p x p').c / (D^2 (1 + w.c)) dt
    cosine-weighted         integral w_z dw        = contour  (p x p')_z / (2 D^2) dt
    vector irradiance       integral w dw          = contour  (p x p') / (2 D^2) dt
    rate under translation  d/dx integral f dw     = contour  f(w) (p x p') / D^3 dt

with any axis c, the same for all edges of a region. The last is the law of Biot and Savart: an
edge whose points stand still in space moves on the sphere by -m_perp / D when the eye moves by m,
and what slides along the ray does not count. It holds for the contour of a curved blocker too, and
it is R07 (48), (49) without a parametrisation: there the edge is followed by azimuth. All four are
per length of t, so that a sum with the weights of any quadrature is the integral; for segments the
first two and the last with f = 1 are closed.

All functions broadcast over leading axes.
"""

from __future__ import annotations

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from firstorder.numerics._scale import power_of_two
from firstorder.numerics._select import either
from firstorder.numerics._vectors import (
    Coordinates,
    apart,
    cross,
    cross_apart,
    dot,
    dot_apart,
    near_one,
    norm,
)

Points = Float[Array, "*#n 3"]
Numbers = Float[Array, "*#n"]


def solid_angle_rate(p: Points, v: Points, axis: Points) -> Numbers:
    """Solid angle between an edge and an axis, per length of the edge's parameter [sr].

    The region that an open edge bounds is closed by great circles through the axis; of a circle
    about the axis the rate is constant. With the normal for an axis the sum over all edges of a
    region is its solid angle. About another axis an edge's solid angle differs by those of two
    triangles between the normal, the axis and an end (`segment_solid_angle`), up to whole spheres.

    Valid when: the edge does not pass through the direction opposite to the axis.

    Args:
        p: point relative to the eye, in the receiver's frame [m].
        v: its derivative.
        axis: unit vector.
    """
    here = apart(p)
    return angle_rate(here, cross_apart(here, apart(v)), apart(axis))


def angle_rate(p: Coordinates, level: Coordinates, axis: Coordinates) -> Array:
    """`solid_angle_rate`, of coordinates, with `level = p x p'`."""
    square = dot_apart(p, p)
    return dot_apart(level, axis) / (square + jnp.sqrt(square) * dot_apart(p, axis))


def vector_irradiance_rate(p: Points, v: Points) -> Points:
    """Half of `w x dw`: its z is the cosine-weighted solid angle, per length of the parameter.

    Reference: Lambert; J12's E of a region of unit radiance is the z of the sum.
    """
    return 0.5 * cross(p, v) / dot(p, p)[..., None]


def translation_rate(p: Points, v: Points) -> Points:
    """Rate of a region's solid angle under translation of the eye, per length of the parameter.

    Weighted with f(w) it is the rate of the integral of f over the region.

    Reference: R07 §7, eq. 48, 49; design §6.
    """
    square = dot(p, p)[..., None]
    return cross(p, v) / square / jnp.sqrt(square)  # one by one: cubes leave the range first


def segment_solid_angle(a: Points, b: Points) -> Numbers:
    """Solid angle of the triangle between the normal and a segment [sr].

    Example:
        >>> import jax.numpy as jnp
        >>> a, b = jnp.array([1.0, 0.0, 0.0]), jnp.array([0.0, 1.0, 0.0])
        >>> print(round(float(segment_solid_angle(a, b) / jnp.pi), 6))  # an octant
        0.5
    """
    return angle_between(apart(near_one(a)), apart(near_one(b)))


def angle_between(a: Coordinates, b: Coordinates) -> Array:
    """`segment_solid_angle`, of coordinates."""
    A, B = (_length(e) for e in (a, b))
    area = cross_apart(a, b)[2]
    return 2.0 * jnp.arctan2(area, A * B + B * a[2] + A * b[2] + dot_apart(a, b))


def _length(a: Coordinates) -> Array:
    square = dot_apart(a, a)
    return either(square > 0.0, jnp.sqrt(either(square > 0.0, square, 1.0)), 0.0)


def segment_vector_irradiance(a: Points, b: Points) -> Points:
    """Half the angle that a segment subtends, along its plane's normal.

    Valid when: the segment does not pass through the eye. Seen end-on it gives zero.

    Example:
        >>> import jax.numpy as jnp
        >>> a, b = jnp.array([1.0, 0.0, 0.0]), jnp.array([0.0, 1.0, 0.0])
        >>> print(segment_vector_irradiance(a, b) / jnp.pi)
        [0.   0.   0.25]
    """
    return jnp.stack(light_between(apart(near_one(a)), apart(near_one(b))), -1)


def light_between(a: Coordinates, b: Coordinates, which=(0, 1, 2)) -> tuple[Array, ...]:
    """`segment_vector_irradiance`, of coordinates: those that are asked for."""
    c = cross_apart(a, b)
    half = _half_angle_by_sine(dot_apart(c, c), dot_apart(a, b))
    return tuple(c[i] * half for i in which)


@jax.custom_jvp
def _half_angle_by_sine(square: Array, cosine: Array) -> Array:
    """`h = atan2(s, k) / (2 s)` of s^2 and k, also where s vanishes: there the ratio is smooth."""
    wide = _is_wide(square, cosine)
    sine = jnp.sqrt(either(wide, square, 1.0))
    far = either(cosine == 0.0, 1.0, cosine)
    ratio = square / (far * far)
    small = (1.0 - ratio / 3.0 + ratio * ratio / 5.0) / far
    return 0.5 * either(wide, jnp.arctan2(sine, cosine) / sine, small)


@_half_angle_by_sine.defjvp
def _half_angle_rule(primals, tangents):
    """`dh/dk = -1 / (2 (s^2 + k^2))` and `dh/ds^2 = (k / (2 (s^2 + k^2)) - h) / (2 s^2)`."""
    square, cosine = primals
    half, wide = _half_angle_by_sine(square, cosine), _is_wide(square, cosine)
    both = square + cosine * cosine
    by_cosine = -0.5 / either(both > 0.0, both, 1.0)
    far = either(cosine == 0.0, 1.0, cosine)
    cube = far * far * far
    small = (0.2 * square / (far * far) - 1.0 / 6.0) / cube
    large = (cosine * by_cosine + half) / either(wide, -2.0 * square, 1.0)
    return half, either(wide, large, small) * tangents[0] + by_cosine * tangents[1]


def _is_wide(square: Array, cosine: Array) -> Array:
    """Whether an angle is so wide that its sine may divide: near two right angles it must."""
    return either(cosine < 0.0, square > 0.0, square > 1e-8 * cosine * cosine)


def segment_translation_rate(a: Points, b: Points) -> Points:
    """The integral of `translation_rate` along a segment.

        (a x b) (A + B) / (A B (A B + a . b)),    A = |a|, B = |b|

    Example:
        >>> import jax.numpy as jnp
        >>> a, b = jnp.array([1.0, 0.0, 0.0]), jnp.array([0.0, 1.0, 0.0])
        >>> segment_translation_rate(a, b).tolist()
        [0.0, 0.0, 2.0]
    """
    scale, other = power_of_two(a), power_of_two(b)
    a, b = a / scale[..., None], b / other[..., None]
    A, B, level, cosine = norm(a), norm(b), cross(a, b), dot(a, b)
    square = dot(level, level)
    # Seen under nearly two right angles the sum A B + a . b is a difference: (A B)^2 - (a . b)^2
    # is |a x b|^2.
    behind = (cosine < 0.0) & (square > 0.0)
    inverse = jnp.where(
        behind,
        (A * B - cosine) / jnp.where(behind, square, 1.0),
        1.0 / jnp.where(behind, 1.0, A * B + cosine),
    )
    return level * ((1.0 / (A * scale) + 1.0 / (B * other)) * inverse)[..., None]
