"""Integrals of light along pieces of edges, with derivatives at fixed ends.

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
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from firstorder.numerics._arc_factor import arc_factor
from firstorder.numerics._quadrature import gauss_legendre
from firstorder.numerics._scale import power_of_two
from firstorder.numerics._select import either
from firstorder.numerics._vectors import (
    Coordinates,
    apart,
    cross,
    cross_apart,
    dot,
    dot_apart,
    settled,
    unit,
)
from firstorder.visibility._contour import angle_between, angle_rate

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
    return _swept(apart(p), cross_apart(apart(p), apart(v)), apart(dp))


def _swept(p: Coordinates, level: Coordinates, dp: Coordinates) -> Array:
    """Sweep of an edge with `level = p x p'`."""
    square = dot_apart(p, p)
    return -dot_apart(dp, level) / (square * jnp.sqrt(square))


# --- straight pieces -----------------------------------------------------------------------------


def segment_light(start: Points, end: Points, low: Numbers, high: Numbers) -> tuple[Numbers, ...]:
    """Vector irradiance of unit radiance along a part of a segment: `segment_vector_irradiance`.

    Args:
        start: of the segment, relative to the eye and in its frame [m].
        end: of the segment [m].
        low: where the part begins, in [0, 1].
        high: where it stops.

    Returns:
        Coordinates apart.
    """
    return _segment_light(start, end, low, high)


def segment_upward(start: Points, end: Points, low: Numbers, high: Numbers) -> tuple[Numbers, ...]:
    """The last coordinate of `segment_light`, which irradiance is made of."""
    return _segment_upward(start, end, low, high)


def segment_angle(start: Points, end: Points, low: Numbers, high: Numbers) -> Numbers:
    """Solid angle between the normal and a part of a segment: `segment_solid_angle` [sr].

    Args:
        start: of the segment, relative to the eye and in its frame [m].
        end: of the segment [m].
        low: where the part begins, in [0, 1].
        high: where it stops.
    """
    return _segment_angle(start, end, low, high)


class _Span(NamedTuple):
    """How parts of segments are seen.

    Attributes:
        units: directions to both ends, shape (2, n, 3).
        inverse: of the distances of both, shape (2, n).
        normal: vector product of the directions.
        cosine: scalar product of them.
    """

    units: Array
    inverse: Array
    normal: Array
    cosine: Array


def _straight(closed):
    """Closed integral along a segment, and its derivative at fixed ends, which is closed too.

    What moves along the edge or along the ray sweeps nothing, so of the motion of an end only the
    part along the plane's normal counts.

    Args:
        closed: of a span the integral and, if asked for, what a motion of each end along the normal
            is worth.
    """

    @jax.custom_jvp
    def integral(start, end, low, high):
        return closed(_span(start, end, low, high), False)[0]

    @integral.defjvp
    def rule(primals, tangents):
        start, end, low, high = primals
        span = _span(start, end, low, high)
        value, worth = closed(span, True)
        swept = -span.inverse * dot(span.normal, _ends(*tangents[:2], low, high))
        return value, jax.tree.map(lambda a: jnp.sum(swept * a, 0), worth)

    return integral


def _ends(start: Points, end: Points, low: Numbers, high: Numbers) -> Float[Array, "2 *n 3"]:
    """Both ends of the part of a segment from `low` to `high` in [0, 1]."""
    return start + jnp.stack([low, high])[..., None] * (end - start)


def _span(start: Points, end: Points, low: Numbers, high: Numbers) -> _Span:
    """How the part of a segment from `low` to `high` in [0, 1] is seen."""
    ends = _ends(start, end, low, high)
    inverse = 1.0 / jnp.sqrt(dot(ends, ends))
    units = inverse[..., None] * ends
    first, last = jnp.unstack(units)
    return _Span(units, inverse, cross(first, last), dot(first, last))


def _light_of(span: _Span, moves: bool, which: slice = slice(None)):
    """Half the angle along the plane's normal, in the coordinates that are asked for.

    An end's motion is worth `integral of (1 - s) p / |p|^4 ds` along the chord of the directions,
    where s is the way from that end. `A(k) = integral of 1 / |p|^2 ds` gives that with its slope.
    """
    factor, *slope = arc_factor(dot(span.normal, span.normal), span.cosine, int(moves))
    value = (0.5 * factor)[..., None] * span.normal[..., which]
    worth = ()
    if moves:
        end, k = span.units[..., which], span.cosine[..., None]
        across = jnp.flip(end, 0) - k * end
        worth = 0.5 * (factor[..., None] * end - slope[0][..., None] * across)
        worth = tuple(jnp.unstack(worth, axis=-1))
    return tuple(jnp.unstack(value, axis=-1)), worth


def _angle_of(span: _Span, moves: bool):
    """Solid angle between the normal and the segment.

    Either end's motion is worth `1 / (1 + k)`, of which a sum of vectors keeps the digits.
    """
    first, last = jnp.unstack(span.units[..., 2])
    value = 2.0 * jnp.arctan2(span.normal[..., 2], 1.0 + first + last + span.cosine)
    both = jnp.sum(span.units, 0)
    return value, 2.0 / dot(both, both) if moves else None


_segment_light = _straight(_light_of)
_segment_upward = _straight(partial(_light_of, which=slice(2, 3)))
_segment_angle = _straight(_angle_of)


# --- elliptic arcs -------------------------------------------------------------------------------


@partial(jax.custom_jvp, nondiff_argnums=(2,))
def arc_nodes(
    first: Numbers, last: Numbers, nodes: int, crowd: tuple[Numbers, Numbers]
) -> tuple[Array, Array, Array]:
    """Cosines, sines and weights of nodes between two angles t: shape (..., nodes).

    Gauss-Legendre in the angle s that a Möbius map of the circle makes of t:

        exp(is) = (exp(it) - k) / (1 - k* exp(it)),    dt/ds = |1 - k* exp(it)|^2 / (1 - |k|^2)

    Args:
        first: angle at which it begins [rad].
        last: angle at which it stops [rad].
        nodes: how many.
        crowd: parts of the complex k, in whose direction nodes crowd; |k| < 1. They count as fixed.
    """
    return _nodes_and_stretch(first, last, nodes, crowd)[:3]


@arc_nodes.defjvp
def _moving_nodes(nodes, primals, tangents):
    """Each node moves by dt = dt/ds ds, where ds is linear in the motion of both ends."""
    first, last, crowd = primals
    cos, sin, w, stretch = _nodes_and_stretch(first, last, nodes, crowd)
    t = jnp.stack([first, last])
    re, im = _from_pole(jnp.cos(t), jnp.sin(t), crowd)
    slack = 1.0 - (crowd[0] * crowd[0] + crowd[1] * crowd[1])
    ends = slack / (re * re + im * im) * jnp.stack(tangents[:2])
    x, share = (0.5 * a for a in gauss_legendre(nodes))
    ds, dw = (
        jnp.einsum("e...,en->...n", ends, jnp.asarray(np.stack(parts), cos.dtype))
        for parts in ((0.5 - x, 0.5 + x), (-share, share))
    )
    _, im = _from_pole(cos, sin, [k[..., None] for k in crowd])
    steep = 2.0 / slack[..., None] * im  # the logarithmic derivative of dt/ds in s
    dt = stretch * ds
    return (cos, sin, w), (-sin * dt, cos * dt, stretch * dw + steep * w * ds)


def _from_pole(cos: Array, sin: Array, crowd) -> tuple[Array, Array]:
    """The real part of `1 - k* exp(it)`, and the imaginary part of its conjugate."""
    x, y = crowd
    return 1.0 - (x * cos + y * sin), x * sin - y * cos


def _nodes_and_stretch(first: Numbers, last: Numbers, nodes: int, crowd):
    """`arc_nodes`, and dt/ds there."""
    t = jnp.stack([first, last])
    re, im = _from_pole(jnp.cos(t), jnp.sin(t), crowd)
    s = t + 2.0 * jnp.arctan2(im, re)
    cos, sin, w = _even_nodes(s[0], s[1], nodes)
    x, y = (k[..., None] for k in crowd)
    # exp(it) = exp(is) (v*)^2 / |v|^2 with v = 1 + k* exp(is)
    re, im = _from_pole(cos, sin, (-x, -y))
    rr, ii = re * re, im * im
    share = 1.0 / settled(rr + ii)
    turn, across = share * (rr - ii), share * (2.0 * re * im)
    stretch = (1.0 - (x * x + y * y)) * share
    return *settled((turn * cos - across * sin, turn * sin + across * cos)), stretch * w, stretch


def _even_nodes(first: Numbers, last: Numbers, nodes: int) -> tuple[Array, Array, Array]:
    """Gauss-Legendre nodes, which lie evenly about the middle: half of them need angles."""
    x, w = (jnp.asarray(a, first.dtype) for a in gauss_legendre(nodes))
    middle, half = 0.5 * (first + last)[..., None], 0.5 * (last - first)[..., None]
    up = half * x[nodes // 2 :]
    c, s, cos, sin = settled((jnp.cos(middle), jnp.sin(middle), jnp.cos(up), jnp.sin(up)))
    odd = nodes % 2
    cos = jnp.concatenate([cos[..., odd:][..., ::-1], cos], -1)
    sin = jnp.concatenate([-sin[..., odd:][..., ::-1], sin], -1)
    return *settled((c * cos - s * sin, s * cos + c * sin)), half * w


def _crowd(center: Points, a: Points, b: Points) -> tuple[Numbers, Numbers]:
    """The complex k of `arc_nodes` for arcs, in the direction in which each is nearest to the eye.

    Integrands are rational in exp(it). They have poles where |p|^2 = 0, which lie the closer to the
    arc the nearer that is, and at 0 and infinity. The map with

        (1 - |k|) / (1 + |k|) = sqrt(nearest / farthest distance)

    puts both kinds equally far away from it. For circles; an ellipse is taken for a circle.
    """
    center, a, b = jax.lax.stop_gradient((center, a, b))
    x, y = jnp.sum(center * a, -1), jnp.sum(center * b, -1)
    mean = jnp.sum(center * center + 0.5 * (a * a + b * b), -1)
    half = jnp.sqrt(x * x + y * y)
    swing = 2.0 * half
    # An arc through the eye has no such map.
    m = jnp.sqrt(jnp.sqrt(jnp.maximum((mean - swing) / (mean + swing), 1e-6)))
    k = (m - 1.0) / ((m + 1.0) * jnp.maximum(half, jnp.finfo(half.dtype).tiny))
    return k * x, k * y


def line_points(start: Points, end: Points, nodes: int) -> tuple[Array, Array, Array]:
    """Points, their derivatives and quadrature weights on segments, even in the angle of sight.

    Seen from h beside its line, a point lies at `foot + h tan(t) e`, and a rate at which the edge
    sweeps light is smooth in t, however long or near the edge is. An edge that is seen end-on
    sweeps nothing; its nodes are even in length.
    """
    one = power_of_two(jnp.concatenate([start, end], -1))[..., None]  # these are metres
    p, along = start / one, (end - start) / one
    square = dot(along, along)[..., None]
    size = jnp.sqrt(either(square > 0.0, square, 1.0))
    e = along / size
    low = dot(p, e)[..., None]
    foot = p - low * e
    beside = dot(foot, foot)[..., None]
    wide = beside > jnp.finfo(beside.dtype).eps ** 2
    h = jnp.sqrt(either(wide, beside, 1.0))
    first, last = jnp.arctan2(low, h), jnp.arctan2(low + size, h)
    x, w = (jnp.asarray(a, p.dtype) for a in gauss_legendre(nodes))
    t = 0.5 * ((first + last) + (last - first) * x)
    place = either(wide, h * jnp.tan(t), low + size * (0.5 + 0.5 * x))
    speed = either(wide, h * (last - first) / jnp.cos(t) ** 2, jnp.broadcast_to(size, t.shape))
    found = foot[..., None, :] + place[..., None] * e[..., None, :]
    moved = speed[..., None] * e[..., None, :]
    return one[..., None] * found, one[..., None] * moved, jnp.broadcast_to(0.5 * w, t.shape)


def arc_points(
    center: Points, a: Points, b: Points, first: Numbers, last: Numbers, nodes: int
) -> tuple[Array, Array, Array]:
    """Points, their derivatives in the angle and quadrature weights on arcs."""
    one = power_of_two(jnp.concatenate([center, a, b], -1))[..., None]  # these are metres
    crowd = _crowd(*(e / one for e in (center, a, b)))
    cos, sin, w = arc_nodes(first, last, nodes, crowd)
    p, v = _points((center, a, b), cos, sin)
    return jnp.stack(p, -1), jnp.stack(v, -1), w


def arc_light(
    center: Points, a: Points, b: Points, first: Numbers, last: Numbers, nodes: int
) -> tuple[Numbers, ...]:
    """Vector irradiance of unit radiance along elliptic arcs `center + a cos t + b sin t`.

    Args:
        center: relative to the eye and in its frame [m].
        a: one conjugate radius [m].
        b: the other [m].
        first: angle at which it begins [rad].
        last: angle at which it stops [rad].
        nodes: of Gauss-Legendre on each arc.

    Returns:
        Coordinates apart.
    """
    return _arc_light(center, a, b, first, last, nodes)


def arc_upward(
    center: Points, a: Points, b: Points, first: Numbers, last: Numbers, nodes: int
) -> tuple[Numbers, ...]:
    """The last coordinate of `arc_light`, which irradiance is made of."""
    return _arc_upward(center, a, b, first, last, nodes)


def arc_angle(
    center: Points, a: Points, b: Points, first: Numbers, last: Numbers, nodes: int
) -> Numbers:
    """Solid angle between the normal and elliptic arcs [sr], up to whole spheres.

    Args:
        center: relative to the eye and in its frame [m].
        a: one conjugate radius [m].
        b: the other [m].
        first: angle at which it begins [rad].
        last: angle at which it stops [rad].
        nodes: of Gauss-Legendre on each arc.
    """
    return _arc_angle(center, a, b, first, last, nodes)


def _points(arc, cos, sin) -> tuple[Coordinates, Coordinates]:
    """Points of arcs, and their derivatives in the angle: shape (..., nodes) each."""
    center, a, b = (jnp.moveaxis(e, -1, 0)[..., None] for e in arc)
    x, y, z = jnp.unstack(center + a * cos + b * sin)
    u, v, w = jnp.unstack(b * cos - a * sin)
    return (x, y, z), (u, v, w)


def _curved(value, swept):
    """Integral along an arc, and its derivative at fixed ends."""

    @partial(jax.custom_jvp, nondiff_argnums=(5,))
    def integral(center, a, b, first, last, nodes):
        cos, sin, w = arc_nodes(first, last, nodes, _crowd(center, a, b))
        p, v = _points((center, a, b), cos, sin)
        return value(p, cross_apart(p, v), w, (center, a, b, first, last))

    @integral.defjvp
    def rule(nodes, primals, tangents):
        *arc, first, last = primals
        cos, sin, w = arc_nodes(first, last, nodes, _crowd(*arc))
        p, v = _points(arc, cos, sin)
        level = cross_apart(p, v)
        dp, _ = _points(tangents[:3], cos, sin)
        return value(p, level, w, primals), swept(p, level, w, dp)

    return integral


def _light(p, level, w, ends, which=(0, 1, 2)):
    share = 0.5 * w / dot_apart(p, p)
    return tuple(jnp.sum(share * level[i], -1) for i in which)


def _light_swept(p, level, w, dp, which=(0, 1, 2)):
    square = dot_apart(p, p)
    share = w * -dot_apart(dp, level) / (square * square)
    return tuple(jnp.sum(share * p[i], -1) for i in which)


def _angle(p, level, w, ends):
    """Angle integral of an arc about its own axis: a ball's contour has a constant integrand."""
    center, a, b, first, last = ends
    normal = cross(unit(a), unit(b))  # of a horizon, which is about the eye
    axis = settled(unit(either(jnp.any(center != 0.0, -1, keepdims=True), center, normal)))
    about = jnp.sum(w * angle_rate(p, level, apart(axis[..., None, :])), -1)
    axis = apart(axis)
    turn = jnp.stack([first, last], -1)
    p, _ = _points((center, a, b), jnp.cos(turn), jnp.sin(turn))
    here, there = (jax.tree.map(lambda a, i=i: a[..., i], p) for i in (0, 1))
    return about + angle_between(axis, there) - angle_between(axis, here)


def _angle_swept(p, level, w, dp):
    return jnp.sum(w * _swept(p, level, dp), -1)


_arc_light = _curved(_light, _light_swept)
_arc_upward = _curved(partial(_light, which=(2,)), partial(_light_swept, which=(2,)))
_arc_angle = _curved(_angle, _angle_swept)
