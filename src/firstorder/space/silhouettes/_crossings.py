"""Crossings of silhouettes on the sphere of directions.

Every silhouette piece is a curve `p(t)` seen from an eye. A segment lies in a plane through the
eye, an arc on a quadratic cone, so crossings are roots of

    segment with segment    a linear equation in t
    arc with segment        n . p(t) = 0, with n the segment's normal:  A + B cos t + C sin t = 0
    arc with arc            p(t)^T M p(t) = 0, with M the other arc's cone: a trigonometric
                            polynomial of degree two

None of them asks whether the other piece is really there: a needless cut only splits a piece. Cuts
are differentiable to second order. Vectors are relative to the eye.
"""

from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from firstorder.numerics._roots import bracketed_root, brackets, newton
from firstorder.numerics._vectors import cross, dot, inverse_3x3, matvec, unit
from firstorder.space.silhouettes.analytic import SilhouetteArcs, SilhouetteSegments

Vector = Float[Array, "3"]
SAMPLES, MOST = 16, 4  # of a trigonometric polynomial of degree two, which has four roots


def on_plane(arc: SilhouetteArcs, normal: Vector) -> Float[Array, "2"]:
    """Parameters at which an arc crosses a plane through the eye; `arc.first` where it does not.

    `A + B cos t + C sin t = 0` gives `t = atan2(C, B) +- acos(-A / sqrt(B^2 + C^2))`.
    """
    A, B, C = dot(normal, arc.center), dot(normal, arc.a), dot(normal, arc.b)
    square = B * B + C * C - A * A
    scale = B * B + C * C
    crosses = (square > 0.0) & (scale > 0.0)
    root = jnp.sqrt(jnp.where(crosses, square, 1.0))
    middle = jnp.arctan2(jnp.where(crosses, C, 0.0), jnp.where(crosses, B, 1.0))
    half = jnp.arctan2(root, jnp.where(crosses, -A, 0.0))
    t = jnp.stack([middle - half, middle + half])
    return jnp.where(crosses, _wrapped(arc, t), arc.first)


def on_cone(arc: SilhouetteArcs, other: SilhouetteArcs) -> Float[Array, "4"]:
    """Parameters at which an arc crosses the cone of another; `arc.first` for missing roots."""
    f, fixed = _cone(arc, other), _cone(*jax.lax.stop_gradient((arc, other)))
    low, high, found = brackets(fixed, SAMPLES, arc.a.dtype)
    which = jnp.argsort(~found, stable=True)[:MOST]
    s = jax.vmap(lambda a, b: bracketed_root(fixed, a, b))(low[which], high[which])
    s = jax.vmap(lambda s: newton(f, newton(f, s)))(s)
    return jnp.where(found[which], _wrapped(arc, 2.0 * np.pi * s), arc.first)


def _cone(arc: SilhouetteArcs, other: SilhouetteArcs):
    """`y_1^2 + y_2^2 - y_3^2` along an arc, with y the coordinates in (a, b, center) of the other.

    In those coordinates the arc is a trigonometric polynomial too.
    """
    axes = jnp.stack([other.a, other.b, other.center], -1)
    flat = jnp.abs(dot(cross(other.a, other.b), other.center)) <= 0.0
    axes = jnp.where(flat, jnp.eye(3, dtype=axes.dtype), axes)  # seen edge-on: no cone
    turn = inverse_3x3(axes)
    c, a, b = (matvec(turn, v) for v in (arc.center, arc.a, arc.b))
    sign = jnp.array([1.0, 1.0, -1.0], c.dtype)

    def f(s):
        t = 2.0 * np.pi * s
        cos, sin = jnp.cos(t), jnp.sin(t)
        y = c + a * cos + b * sin
        v = (b * cos - a * sin) * (2.0 * np.pi)
        w = (c - y) * (2.0 * np.pi) ** 2
        return (
            jnp.sum(sign * y * y),
            2.0 * jnp.sum(sign * y * v),
            2.0 * jnp.sum(sign * (v * v + y * w)),
        )

    return f


def along_segment(line: SilhouetteSegments, normal: Vector) -> Float[Array, ""]:
    """Position in [0, 1] at which a segment crosses a plane through the eye; 0 if it does not."""
    a, b = dot(normal, line.start), dot(normal, line.end)
    crosses = (a > 0.0) != (b > 0.0)
    return jnp.where(crosses, a / jnp.where(crosses, a - b, 1.0), 0.0)


def segment_on_cone(line: SilhouetteSegments, other: SilhouetteArcs) -> Float[Array, "2"]:
    """Positions in [0, 1] at which a segment crosses the cone of an arc; 0 if it does not.

    The arc's points on the plane of the segment give the directions.
    """
    normal = unit(cross(line.start, line.end))
    t = on_plane(other, normal)
    w = jax.vmap(other.point)(t)
    side = cross(jnp.broadcast_to(normal, w.shape), w)
    a, b = side @ line.start, side @ line.end
    crosses = (a > 0.0) != (b > 0.0)  # or the opposite direction does, which cuts in vain
    return jnp.where(crosses, a / jnp.where(crosses, a - b, 1.0), 0.0)


def _wrapped(arc: SilhouetteArcs, t: Array) -> Array:
    """Angles by whole turns to where the arc is; at its start if it does not come there."""
    turn = 2.0 * np.pi
    t = t - turn * jax.lax.stop_gradient(jnp.floor((t - arc.first) / turn))
    return jnp.where(t < arc.last, t, arc.first)
