"""Circles by depth: which of many is nearest in each gap, in n log n.

On a ray through a circle the distances to the two points that it meets have a product that does not
depend on the ray, the power of its origin:

    t_1 t_2 = |w|^2 - r^2,    w = origin - center.

Discs that do not overlap meet a ray in intervals that do not overlap either, so of two of them the
nearer has the smaller power, on every ray that meets both. One sort by power is their order from
front to back for a receiver, and no ray is needed. (From inside a circle the power is negative: it
comes first, as it hides all others.)

Whether discs overlap is asked of all pairs, once for a scene and not for each receiver.
"""

from __future__ import annotations

import jax
import jax.custom_batching
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float, Int

from firstorder.flatland.shapes._base import Shape
from firstorder.flatland.shapes.kinds import Circles
from firstorder.numerics._order import order_of
from firstorder.numerics._planar import dot_2d
from firstorder.scene import _intersect as intersect
from firstorder.scene._intersect import MISS

MANY = 32  # circles from which on their order pays


def ordered_by_depth(groups: tuple[Shape, ...]) -> Bool[Array, ""] | None:
    """Whether the circles among shapes are ordered by depth; None if too few for it to pay.

    Of a row of scenes under `vmap`: whether those of all are. So it is one answer, and what is
    chosen by it is alone computed. It has no derivative.
    """
    circles = [group for group in groups if isinstance(group, Circles)]
    if not circles or circles[0].count < MANY:
        return None
    return do_not_overlap(circles[0])


def do_not_overlap(circles: Circles) -> Bool[Array, ""]:
    """Whether no disc reaches into another, up to the share in which surfaces are in one place."""
    return _apart(*jax.lax.stop_gradient((circles.center, circles.radius)))


@jax.custom_batching.custom_vmap
def _apart(center: Float[Array, "*rows n 2"], radius: Float[Array, "*rows n"]) -> Bool[Array, ""]:
    way = center[..., :, None, :] - center[..., None, :, :]
    reach = (radius[..., :, None] + radius[..., None, :]) * (1.0 - intersect.tie(way.dtype))
    itself = np.eye(radius.shape[-1], dtype=bool)
    return jnp.all((dot_2d(way, way) >= reach * reach) | itself)


@_apart.def_vmap
def _(size, batched, *circles):
    whole = [
        a if b else jnp.broadcast_to(a, (size, *a.shape))
        for a, b in zip(circles, batched, strict=True)
    ]
    return _apart(*whole), False


def first_shape(
    groups: tuple[Shape, ...], rank: Int[Array, " n"], view: tuple[Array, ...]
) -> Int[Array, " m"]:
    """Number of the nearest shape in each gap of a view, -1 for none, if no discs overlap.

    A ray meets the other shapes, the receiver's own, and one disc.

    Args:
        groups: the shapes.
        rank: of each where several are in one place: `scene._intersect.ranks`.
        view: where the receiver is, and the number of the shape on which it lies; of each cut, the
            tangent of half its angle, those of `scene.silhouettes` first; unit vectors into the
            gaps, in their order; and the order of the cuts.
    """
    origin, on, half, along, order = view
    which = [isinstance(group, Circles) for group in groups].index(True)
    circles, others = groups[which], (*groups[:which], *groups[which + 1 :])
    first = sum(group.count for group in groups[:which])
    stop, count = first + circles.count, len(rank)
    # Numbers among the circles alone, and below among the others.
    own = jnp.where((on >= first) & (on < stop), on - first, MISS)
    cuts = sum(group.count * group.silhouette_count for group in groups[:which])

    def of_circles(a):
        return a[cuts : cuts + 2 * circles.count].reshape(-1, 2)

    place = jnp.zeros_like(order).at[order].set(np.arange(len(order), dtype=np.int32))
    above = of_circles(jnp.abs(half) < 1.0)
    front, rim = front_circle(circles, origin, own, of_circles(place), above, len(along))
    rays = _rays(origin, along, own)
    met = [
        (intersect.reached((circles,), k, rays), rank[first:stop][jnp.maximum(k, 0)])
        for k in (front, rim, own)
    ]
    if others:
        rest = np.delete(np.arange(count), np.arange(first, stop))
        on = jnp.where(on < first, on, jnp.where(on < stop, MISS, on - circles.count))
        rays = _rays(origin, along, on)
        number = intersect.first_shape(others, intersect.ranks_among(rank, rest), rays)
        t = intersect.reached(others, number, rays)
        met.append((t, rank[rest][jnp.maximum(number, 0)]))
    t, rank = (jnp.stack(jnp.broadcast_arrays(*a)) for a in zip(*met, strict=True))
    slack = intersect.rounding(origin) / intersect.tie(t.dtype)
    return intersect.highest(t + slack, rank, count)


def _rays(origin: Float[Array, "2"], along: Float[Array, "m 2"], on: Int[Array, ""]):
    """Rays from one place, on the shape of that number."""
    return jnp.broadcast_to(origin, along.shape), along, jnp.broadcast_to(on, len(along))


def front_circle(
    circles: Circles,
    origin: Float[Array, "2"],
    own: Int[Array, ""],
    places: Int[Array, "n 2"],
    above: Bool[Array, "n 2"],
    gaps: int,
) -> tuple[Int[Array, " gaps"], Int[Array, ""]]:
    """Number of the nearest of discs that do not overlap in each gap of a view, -1 for none.

    Args:
        circles: the discs.
        origin: the receiver.
        own: number of the one on which it is known to lie, or -1: that one is left out.
        places: of both silhouettes of each among all cuts of the view: of the one further
            counter-clockwise, and of the other.
        above: whether they lie above the receiver's horizon.
        gaps: how many the view has, one more than cuts.

    Returns:
        The numbers, and that of a circle on whose rim the receiver lies, if that is not its own. It
        has no silhouettes and is left out too: what is seen of it only a ray can tell.
    """
    own = jnp.arange(circles.count, dtype=np.int32) == own
    w = origin - circles.center
    power = dot_2d(w, w) - circles.radius * circles.radius
    unit = w / circles.radius[:, None]
    outside, inside = dot_2d(unit, unit) > 1.0, power < 0.0  # the first as silhouettes have it
    rim = ~(outside | inside | own)
    # A disc that is cut by the horizon fills the view from its one silhouette to the edge.
    first = jnp.where(above[:, 1] & outside, places[:, 1] + 1, 0)
    stop = jnp.where(above[:, 0] & outside, places[:, 0] + 1, gaps)
    there = jnp.where(outside, above[:, 0] | above[:, 1], inside) & ~own
    order = order_of(power)
    front = first_cover(first[order], jnp.where(there, stop, 0)[order], gaps)
    front = jnp.where(front < circles.count, order[jnp.minimum(front, circles.count - 1)], MISS)
    return front, jnp.where(jnp.any(rim), jnp.argmax(rim), MISS)


def first_cover(
    first: Int[Array, " n"], stop: Int[Array, " n"], places: int
) -> Int[Array, " places"]:
    """The first of n intervals that covers each place, n where none does; in n log n.

    An interval is two runs of `2^k` places, which may overlap; a run is handed down to its halves
    until it is one place.

    Args:
        first: first place of each interval.
        stop: the place behind its last; one that is not behind `first` covers nothing.
        places: how many there are.

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.flatland._depth_order import first_cover
        >>> first_cover(jnp.array([2, 0]), jnp.array([4, 3]), 5).tolist()
        [1, 1, 0, 0, 2]
    """
    n, levels = first.shape[0], max(1, places.bit_length())
    number = np.arange(n, dtype=np.int32)
    size = stop - first
    level = jnp.where(size > 0, 31 - jax.lax.clz(jnp.maximum(size, 1).astype(jnp.int32)), levels)
    runs = jnp.full((levels, places), n, jnp.int32)
    for begin in (first, stop - (1 << jnp.minimum(level, levels - 1))):
        runs = runs.at[level, begin].min(number, mode="drop")
    whole = runs[-1]
    for k in range(levels - 2, -1, -1):
        half = 1 << k
        later = jnp.concatenate([jnp.full(min(half, places), n, jnp.int32), whole[:-half]])
        whole = jnp.minimum(runs[k], jnp.minimum(whole, later))
    return whole
