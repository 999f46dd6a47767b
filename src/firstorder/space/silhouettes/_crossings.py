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

from firstorder.numerics._order import order_of
from firstorder.numerics._roots import bracketed_root, brackets, even, newton
from firstorder.numerics._select import either
from firstorder.numerics._vectors import cross, dot, inverse_3x3, matvec, rows, unit
from firstorder.space.silhouettes._curves import TURN, SilhouetteArcs, SilhouetteSegments

Vector = Float[Array, "3"]
ROUNDINGS = 16.0  # in a height over a plane, whose normal is a product, and in its square
SAMPLES, MOST = 10, 4  # of a trigonometric polynomial of degree two, which has four roots


def on_plane(arc: SilhouetteArcs, normal: Vector) -> Float[Array, "2"]:
    """Parameters at which an arc crosses a plane through the eye; `arc.first` where it does not.

    `A + B cos t + C sin t = 0` gives `t = atan2(C, B) +- acos(-A / sqrt(B^2 + C^2))`.
    """
    products = dot(normal, arc.center), dot(normal, arc.a), dot(normal, arc.b)
    crosses, t = _on_plane(*products)
    return either(crosses, _wrapped(arc.first, arc.last, t), arc.first)


def arcs_on_planes(
    arcs: Float[Array, "c 3 3"],
    first: Float[Array, " c"],
    last: Float[Array, " c"],
    normals: Float[Array, "k 3"],
) -> Float[Array, "c k 2"]:
    """`on_plane` of every arc with every plane; an arc is its centre and its conjugate radii.

    Where it does not cross, it is cut where it is nearest to the plane: a ball on the floor touches
    the horizon of a receiver on the floor, and no part of either may have its middle there.
    """
    A, B, C = jnp.unstack(jnp.einsum("cei,ki->eck", arcs, normals))
    crosses, t = _on_plane(A, B, C)
    A, B, C = jax.lax.stop_gradient((A, B, C))
    t = either(crosses, t, jnp.arctan2(-A * C, -A * B)[..., None])
    return _wrapped(first[:, None, None], last[:, None, None], t)


def _on_plane(A, B, C):
    """Whether an arc crosses a plane, and where."""
    crosses, middle, half = _positive(A, B, C)
    return crosses[..., None], jnp.stack([middle - half, middle + half], -1)


def _positive(A, B, C):
    """Whether `A + B cos t + C sin t` has both signs, and where it is positive.

    It has not where it touches zero up to rounding: a compiler may round one sum in two ways in one
    program, and what stands on the floor would cross it for one use and not for another.

    Returns:
        Whether it has, the middle of that range of t, and half its length [rad].
    """
    scale = B * B + C * C
    square = scale - A * A
    crosses = square > ROUNDINGS * jnp.finfo(scale.dtype).eps * scale
    root = jnp.sqrt(either(crosses, square, 1.0))
    A, B, C = (either(crosses, *parts) for parts in ((-A, 0.0), (B, 1.0), (C, 0.0)))
    return crosses, jnp.arctan2(C, B), jnp.arctan2(root, A)


def on_cone(arc: SilhouetteArcs, other: SilhouetteArcs) -> Float[Array, "4"]:
    """Parameters at which an arc crosses the cone of another; `arc.first` for missing roots.

    The cone's axis points from the eye to the other arc's centre. Of an arc that comes in front of
    the eye and behind it, only the part in front is searched: behind it the cone is nobody's
    silhouette. The cone of a ball that all but touches the eye is almost a plane, with a root on
    either side of where the arc goes through it. Samples all around miss such a pair; the part in
    front starts and ends between the two.

    A circle about the eye, such as a plane's horizon, has no cone, but a plane that others cross.
    """
    mine = _in_coordinates_of(other, arc)
    fixed = jax.lax.stop_gradient(mine)
    pieces = _in_front(*fixed)
    f, fixed = _cone(*mine), _cone(*fixed)
    low, high, found = brackets(fixed, pieces)
    which = order_of(~found)[:MOST]
    s = jax.vmap(lambda a, b: bracketed_root(fixed, a, b))(low[which], high[which])
    s = jax.vmap(lambda s: newton(f, newton(f, s)))(s)
    t = either(found[which], _wrapped(arc.first, arc.last, TURN * s), arc.first)
    level = on_plane(arc, cross(unit(other.a), unit(other.b)))
    return either(jnp.all(other.center == 0.0), jnp.tile(level, MOST // 2), t)


def _in_coordinates_of(other: SilhouetteArcs, arc: SilhouetteArcs) -> tuple[Vector, Vector, Vector]:
    """Centre and conjugate radii of an arc, in the coordinates (a, b, center) of another one."""
    axes = jnp.stack([other.a, other.b, other.center], -1)
    flat = jnp.abs(dot(cross(other.a, other.b), other.center)) <= 0.0
    axes = either(flat, jnp.eye(3, dtype=axes.dtype), axes)  # seen edge-on: no cone
    turn = inverse_3x3(axes)
    return matvec(turn, arc.center), matvec(turn, arc.a), matvec(turn, arc.b)


def _in_front(c: Vector, a: Vector, b: Vector) -> Float[Array, " pieces_1"]:
    """Ends of pieces [turns] of the range where `c + a cos t + b sin t` lies before the eye.

    They are even, and cut where the arc crosses an axis of the other one's ellipse, which is at
    zero of y_1 or y_2: of a thin ellipse its longer axis lies between two roots, however close
    they are. If all of the arc lies before the eye, or none, the range is the whole turn.
    """
    crosses, middle, half = _positive(c, a, b)
    start = either(crosses[2], middle[2] - half[2], 0.0) / TURN
    length = either(crosses[2], 2.0 * half[2], TURN) / TURN
    on_axes = jnp.concatenate([middle[:2] - half[:2], middle[:2] + half[:2]]) / TURN
    inside = jnp.minimum(jnp.mod(on_axes - start, 1.0), length)
    cuts = jnp.concatenate([length * even(SAMPLES, c.dtype), inside])
    return start + rows(cuts, order_of(cuts))


def _cone(c: Vector, a: Vector, b: Vector):
    """`y_1^2 + y_2^2 - y_3^2` along an arc, with y its coordinates in those of another one.

    It is a trigonometric polynomial too.
    """
    sign = jnp.array([1.0, 1.0, -1.0], c.dtype)

    def f(s):
        t = TURN * s
        cos, sin = jnp.cos(t), jnp.sin(t)
        y = c + a * cos + b * sin
        v = (b * cos - a * sin) * TURN
        w = (c - y) * TURN**2
        return (
            jnp.sum(sign * y * y),
            2.0 * jnp.sum(sign * y * v),
            2.0 * jnp.sum(sign * (v * v + y * w)),
        )

    return f


def along_segment(line: SilhouetteSegments, normal: Vector) -> Float[Array, ""]:
    """Position in [0, 1] at which a segment crosses a plane through the eye; 0 if it does not."""
    return _between(dot(normal, line.start), dot(normal, line.end))


def lines_on_planes(
    lines: Float[Array, "m 2 3"], normals: Float[Array, "k 3"], size: Float[Array, " k"]
) -> Float[Array, "m k"]:
    """`along_segment` of every segment, given by its ends, with every plane.

    A segment that continues another one lies in its plane, where its heights are rounding alone.
    It is not cut: such a cut is anywhere and its derivatives are anything, and if it falls on the
    end of the segment nothing takes them off again.

    Args:
        lines: ends of the segments.
        normals: of the planes, of any length.
        size: of the numbers that each normal was made of, of which its rounding is a share.
    """
    heights = jnp.einsum("mei,ki->emk", lines, normals)
    most, highest = (jnp.abs(jax.lax.stop_gradient(a)) for a in (lines, heights))
    rounding = ROUNDINGS * jnp.finfo(lines.dtype).eps * jnp.max(most, (1, 2))[:, None] * size
    return _between(*jnp.unstack(heights), jnp.max(highest, 0) > rounding)


def _between(a, b, sure=True):
    """Where the line through two heights is level, if they have unlike signs and are sure."""
    crosses = ((a > 0.0) != (b > 0.0)) & sure
    return either(crosses, a / either(crosses, a - b, 1.0), 0.0)


def segment_on_cone(line: SilhouetteSegments, other: SilhouetteArcs) -> Float[Array, "2"]:
    """Positions in [0, 1] at which a segment crosses the cone of an arc; 0 if it does not.

    The arc's points on the plane of the segment give the directions.
    """
    normal = unit(cross(line.start, line.end))
    t = on_plane(other, normal)
    w = jax.vmap(other.point)(t)
    side = cross(jnp.broadcast_to(normal, w.shape), w)
    # ... or the opposite direction crosses, which cuts in vain
    return _between(side @ line.start, side @ line.end)


def lines_on_cones(
    lines: Float[Array, "m 2 3"],
    normals: Float[Array, "m 3"],
    arcs: Float[Array, "c 3 3"],
    t: Float[Array, "c m 2"],
) -> Float[Array, "m c 2"]:
    """`segment_on_cone` of every segment with every arc.

    Args:
        lines: ends of the segments.
        normals: of the planes through those and the eye, the products of the ends.
        arcs: centres and conjugate radii.
        t: where each arc crosses each of those planes.
    """
    beside = cross(lines, normals[:, None])
    center, a, b = jnp.unstack(jnp.einsum("cki,mei->kemc", arcs, beside)[..., None])
    t = jnp.swapaxes(t, 0, 1)
    return _between(*jnp.unstack(center + a * jnp.cos(t) + b * jnp.sin(t)))


def _wrapped(first: Array, last: Array, t: Array) -> Array:
    """Angles by whole turns to where the arc is; at its start if it does not come there."""
    t = t - TURN * jax.lax.stop_gradient(jnp.floor((t - first) / TURN))
    return either(t < last, t, first)


# --- parts between cuts --------------------------------------------------------------------------


def _others(mine: np.ndarray, theirs: np.ndarray) -> np.ndarray:
    """For each piece the numbers of those of other shapes; rows are filled up with -1."""
    found = [np.flatnonzero(theirs != owner) for owner in mine]
    most = max((len(r) for r in found), default=0)
    return np.array(
        [np.pad(r, (0, most - len(r)), constant_values=-1) for r in found], int
    ).reshape(len(mine), most)


def _chosen(a: Float[Array, "m w"], which: np.ndarray) -> Float[Array, "m k"]:
    """Of each row the entries of some numbers, the same count in all."""
    return rows(a.ravel(), which + a.shape[1] * np.arange(len(a))[:, None])


def line_ends(on_planes: Array, on_cones: Array, owners) -> Float[Array, "m k_1"]:
    """Ends of the parts of segments, in order: at the horizon, and where others are in line."""
    lines, rims = owners
    m, planes = on_planes.shape
    if m == 0:
        return jnp.zeros((0, 2), on_planes.dtype)
    cuts = jnp.concatenate([on_planes, on_cones.reshape(m, 2 * len(rims))], -1)
    # What is filled up is the horizon once more.
    arcs = _others(lines, rims)
    pair = np.stack([planes + 2 * arcs, planes + 2 * arcs + 1], -1)
    pair = np.where(arcs[..., None] < 0, 0, pair).reshape(m, -1)
    which = np.concatenate([np.zeros((m, 1), int), 1 + _others(lines, lines), pair], -1)
    return _ordered(_chosen(cuts, which), jnp.zeros(m, cuts.dtype), jnp.ones(m, cuts.dtype))


def arc_ends(arcs: Array, first: Array, last: Array, on_planes: Array, owners):
    """Ends of the parts of arcs, in order: at the horizon, and where others are in line."""
    lines, rims = owners
    m = len(rims)
    if m == 0:
        return jnp.zeros((0, 2), arcs.dtype)
    planes = np.concatenate([np.zeros((m, 1), int), 1 + _others(rims, lines)], -1)
    pair = np.stack([2 * planes, 2 * planes + 1], -1).reshape(m, -1)
    cuts = [_chosen(on_planes.reshape(m, -1), pair)]
    others = _others(rims, rims)
    if others.size:

        def crossed(arc, first, last, other):
            return on_cone(_arc(arc, first, last), _arc(other, first, last))

        t = jax.vmap(jax.vmap(crossed, (None, None, None, 0)))(
            arcs, first, last, rows(arcs, np.maximum(others, 0))
        )
        there = jnp.asarray(others >= 0)[..., None]
        cuts.append(either(there, t, first[:, None, None]).reshape(m, -1))
    return _ordered(jnp.concatenate(cuts, -1), first, last)


def _arc(points: Array, first: Array, last: Array) -> SilhouetteArcs:
    """One arc."""
    return SilhouetteArcs(*points, first, last, jnp.asarray(0), jnp.asarray(True))


def _ordered(inner: Float[Array, "m k"], first: Array, last: Array) -> Float[Array, "m k_2"]:
    """Ends of the parts between the cuts, in order."""
    inner = jax.vmap(lambda a: rows(a, order_of(a)))(jnp.maximum(inner, first[:, None]))
    return jnp.concatenate([first[:, None], inner, last[:, None]], -1)


def horizon_ends(lines: Array, s: Array, arcs: Array, t: Array) -> Float[Array, " h_1"]:
    """Azimuths at which a silhouette crosses the horizon, from -pi to pi.

    What does not cross gives one of its own points, which cuts in vain.
    """
    start, end = jnp.unstack(lines[..., :2], axis=1)
    points = [start + s[:, None] * (end - start)]
    around = jnp.stack([jnp.ones_like(t), jnp.cos(t), jnp.sin(t)], -1)
    points.append(jnp.einsum("cki,cit->ckt", around, arcs[..., :2]))
    p = jnp.concatenate([a.reshape(-1, 2) for a in points])
    there = jnp.any(p != 0.0, -1, keepdims=True)
    x, y = jnp.unstack(either(there, p, np.array([1.0, 0.0], p.dtype)), axis=-1)
    turn = jnp.full((1,), np.pi, p.dtype)
    return _ordered(jnp.arctan2(y, x)[None], -turn, turn)[0]
