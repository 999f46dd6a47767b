"""Light along pieces of edges, with derivatives that do not ask where the pieces are cut.

An edge whose points move by `dp` in the eye's frame sweeps, per length of its parameter,

    p . (dp x p') / |p|^3        [sr]

of what lies to its left, and an integral over the region changes by that times its integrand. What
moves along the edge or along the ray sweeps nothing. So the derivative of a sum over edges is one
integral along them at fixed parameters: ends and cuts do not move, for what one piece loses by them
its neighbours win. It is taken here as *the* derivative of every piece, by a rule of its own:

    exact for sums over closed edges, each with its jump; not for a piece by itself.

Autodiff of such a sum asks for the derivative of no cut, which costs more than all else, and its
Hessian only for the first one. `translation_rate` is the same for an eye that moves: dp = -m.

Reference: R07 §7, eq. 48, 49; design §6.
"""

from __future__ import annotations

from functools import partial

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from firstorder.quadrature import gauss_legendre
from firstorder.vectors import cross, dot, settled, unit
from firstorder.visibility.contour import (
    axis_solid_angle,
    segment_solid_angle,
    segment_vector_irradiance,
    solid_angle_rate,
    vector_irradiance_rate,
)

Points = Float[Array, "*#n 3"]
Numbers = Float[Array, "*#n"]


def swept_rate(p: Points, v: Points, dp: Points) -> Numbers:
    """Solid angle that an edge sweeps as its points move, per length of its parameter [sr].

    Args:
        p: point relative to the eye [m].
        v: its derivative along the edge.
        dp: its motion [m].

    Returns:
        Positive if the region to the left grows.
    """
    square = dot(p, p)
    return dot(cross(dp, v), p) / (square * jnp.sqrt(square))


# --- straight pieces -----------------------------------------------------------------------------


def _between(start: Points, end: Points, low: Numbers, high: Numbers) -> tuple[Points, Points]:
    """The part of a segment from `low` to `high` in [0, 1]."""
    along = end - start
    return start + low[..., None] * along, start + high[..., None] * along


def _straight(value, form):
    """A closed integral along a segment, and its derivative at fixed ends.

    The derivative of the closed integral holds the ends' motion too, which is the integrated
    one-form there: that is taken off again.
    """

    @jax.custom_jvp
    def integral(start, end, low, high):
        return value(*_between(start, end, low, high))

    @integral.defjvp
    def rule(primals, tangents):
        start, end, low, high = primals
        ends, moves = (_between(*both, low, high) for both in ((start, end), tangents[:2]))
        found, rate = jax.jvp(value, ends, moves)
        return found, rate - (form(ends[1], moves[1]) - form(ends[0], moves[0]))

    return integral


def _light_form(p, dp):
    return 0.5 * cross(p, dp) / dot(p, p)[..., None]


def _angle_form(p, dp):
    square = dot(p, p)
    return cross(p, dp)[..., 2] / (square + jnp.sqrt(square) * p[..., 2])


_segment_light = _straight(segment_vector_irradiance, _light_form)
_segment_angle = _straight(segment_solid_angle, _angle_form)


def segment_light(start: Points, end: Points, low: Numbers, high: Numbers) -> Points:
    """Vector irradiance of unit radiance along a part of a segment: `segment_vector_irradiance`.

    Args:
        start, end: of the segment, relative to the eye and in its frame [m].
        low, high: ends of the part, in [0, 1].
    """
    return _segment_light(start, end, low, high)


def segment_angle(start: Points, end: Points, low: Numbers, high: Numbers) -> Numbers:
    """Solid angle between the normal and a part of a segment: `segment_solid_angle` [sr].

    Args:
        start, end: of the segment, relative to the eye and in its frame [m].
        low, high: ends of the part, in [0, 1].
    """
    return _segment_angle(start, end, low, high)


# --- elliptic arcs -------------------------------------------------------------------------------


def arc_nodes(first: Numbers, last: Numbers, nodes: int) -> tuple[Array, Array, Array]:
    """Cosines, sines and weights of Gauss-Legendre nodes between two angles: shape (..., nodes).

    Nodes lie evenly about the middle, so that half of them need angles of their own.
    """
    x, w = (jnp.asarray(a, first.dtype) for a in gauss_legendre(nodes))
    middle, half = 0.5 * (first + last)[..., None], 0.5 * (last - first)[..., None]
    up = half * x[nodes // 2 :]
    c, s, cos, sin = settled((jnp.cos(middle), jnp.sin(middle), jnp.cos(up), jnp.sin(up)))
    odd = nodes % 2
    cos = jnp.concatenate([cos[..., odd:][..., ::-1], cos], -1)
    sin = jnp.concatenate([-sin[..., odd:][..., ::-1], sin], -1)
    return *settled((c * cos - s * sin, s * cos + c * sin)), half * w


def _points(center, a, b, cos, sin):
    """Points of arcs, and their derivatives in the angle: shape (..., nodes, 3)."""
    cos, sin = cos[..., None], sin[..., None]
    a, b = a[..., None, :], b[..., None, :]
    return center[..., None, :] + a * cos + b * sin, b * cos - a * sin


def arc_points(
    center: Points, a: Points, b: Points, first: Numbers, last: Numbers, nodes: int
) -> tuple[Array, Array, Array]:
    """Points, their derivatives in the angle and quadrature weights on arcs."""
    cos, sin, w = arc_nodes(first, last, nodes)
    return *_points(center, a, b, cos, sin), w


def _light(p, v, w, ends):
    return jnp.sum(w[..., None] * vector_irradiance_rate(p, v), -2)


def _light_swept(p, v, w, dp):
    return jnp.sum((w * swept_rate(p, v, dp))[..., None] * unit(p), -2)


def _angle(p, v, w, ends):
    """About the arc's own axis the integrand is tame: of a ball's limb it is constant."""
    center, a, b, first, last = ends
    level = cross(unit(a), unit(b))  # of a horizon, which is about the eye
    axis = unit(jnp.where(jnp.any(center != 0.0, -1, keepdims=True), center, level))
    about = jnp.sum(w * solid_angle_rate(p, v, axis[..., None, :]), -1)
    turn = jnp.stack([first, last], -1)
    p, _ = _points(center, a, b, jnp.cos(turn), jnp.sin(turn))
    return about + axis_solid_angle(axis, p[..., 0, :], p[..., 1, :])


def _angle_swept(p, v, w, dp):
    return jnp.sum(w * swept_rate(p, v, dp), -1)


def _curved(value, swept):
    """An integral along an arc, and its derivative at fixed ends."""

    @partial(jax.custom_jvp, nondiff_argnums=(5,))
    def integral(center, a, b, first, last, nodes):
        p, v, w = arc_points(center, a, b, first, last, nodes)
        return value(p, v, w, (center, a, b, first, last))

    @integral.defjvp
    def rule(nodes, primals, tangents):
        center, a, b, first, last = primals
        cos, sin, w = arc_nodes(first, last, nodes)
        p, v = _points(center, a, b, cos, sin)
        dp, _ = _points(*tangents[:3], cos, sin)
        return value(p, v, w, primals), swept(p, v, w, dp)

    return integral


_arc_light = _curved(_light, _light_swept)
_arc_angle = _curved(_angle, _angle_swept)


def arc_light(
    center: Points, a: Points, b: Points, first: Numbers, last: Numbers, nodes: int
) -> Points:
    """Vector irradiance of unit radiance along elliptic arcs `center + a cos t + b sin t`.

    Args:
        center, a, b: relative to the eye and in its frame [m].
        first, last: angles between which it runs [rad].
        nodes: of Gauss-Legendre on each arc.
    """
    return _arc_light(center, a, b, first, last, nodes)


def arc_angle(
    center: Points, a: Points, b: Points, first: Numbers, last: Numbers, nodes: int
) -> Numbers:
    """Solid angle between the normal and elliptic arcs [sr], up to whole spheres.

    Args:
        center, a, b: relative to the eye and in its frame [m].
        first, last: angles between which it runs [rad].
        nodes: of Gauss-Legendre on each arc.
    """
    return _arc_angle(center, a, b, first, last, nodes)
