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

from functools import partial
from typing import TYPE_CHECKING

import jax
import jax.custom_batching
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float, Int

from firstorder.flatland.scene import Scene
from firstorder.flatland.shapes._base import Shape
from firstorder.flatland.shapes.kinds import Circles
from firstorder.numerics._batching import in_blocks, one_list
from firstorder.numerics._order import order_of
from firstorder.numerics._planar import dot_2d
from firstorder.scene import _intersect as intersect
from firstorder.scene._intersect import MISS

if TYPE_CHECKING:
    from firstorder.flatland.visible import Receiver

MANY = 32  # circles from which on their order pays
IN_CACHE = 2**15  # gaps whose tables stay in the cache


def many_circles(scene: Scene) -> Circles | None:
    """The circles of a scene, if they are so many that their order pays."""
    for group in scene.groups:
        if isinstance(group, Circles) and group.count >= MANY:
            return group
    return None


def do_not_overlap(circles: Circles) -> Bool[Array, ""]:
    """Whether no disc reaches into another, up to the share in which surfaces are in one place.

    Of a row of scenes under `vmap`: whether that holds in all of them. So it is one answer, and
    what is chosen by it is alone computed. It has no derivative.
    """
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
    scene: Scene,
    at: Receiver,
    angles: Float[Array, " m_1"],
    along: Float[Array, "m 2"],
    order: Int[Array, " k"],
) -> Int[Array, " m"]:
    """Number of the nearest shape in each gap of a view, -1 for none, if no discs overlap.

    A ray meets the other shapes, the receiver's own, and one disc.

    Args:
        scene: the shapes.
        at: the receiver.
        angles: the ends of the gaps, from edge to edge of the view.
        along: directions of their middles.
        order: of the cuts between the ends: their numbers, those of `scene.silhouettes` first.
    """
    rows = jax.tree.map(lambda a: a[None], (at.position, at.on, angles, along, order))
    block = max(1, IN_CACHE // along.shape[0])

    def find(shared, rows):
        return in_blocks(jax.vmap(partial(_first_shape, *shared)), rows, block)

    return one_list(find)((scene.groups, scene.material.emission), rows)[0]


def _first_shape(groups: tuple[Shape, ...], emission: Array, view: tuple) -> Int[Array, " m"]:
    """`first_shape` of one view."""
    origin, on, angles, along, order = view
    which = [isinstance(group, Circles) for group in groups].index(True)
    circles, others = groups[which], (*groups[:which], *groups[which + 1 :])
    number = sum(group.count for group in groups[:which]) + np.arange(circles.count)
    cuts = sum(group.count * group.silhouette_count for group in groups[:which])

    place = jnp.zeros_like(order).at[order].set(np.arange(len(order), dtype=np.int32))
    place = place[cuts : cuts + 2 * circles.count].reshape(-1, 2)
    above = jnp.abs(angles[place + 1]) < angles[-1]
    front, rim = front_circle(circles, origin, number == on, place, above, len(along))
    met = [jnp.where(k == MISS, MISS, k + number[0]) for k in (front, rim)]
    met = [*jnp.broadcast_arrays(*met, on)]
    rays = jnp.broadcast_to(origin, along.shape), along, met[-1]
    if others:
        rest = np.delete(np.arange(len(emission)), number)
        found = intersect.first_shape(others, intersect.ranks(emission[rest]), rays)
        met.append(found + jnp.where(found < number[0], 0, circles.count))
    return intersect.first_of(groups, intersect.ranks(emission), jnp.stack(met), rays)


def front_circle(
    circles: Circles,
    origin: Float[Array, "2"],
    own: Bool[Array, " n"],
    places: Int[Array, "n 2"],
    above: Bool[Array, "n 2"],
    gaps: int,
) -> tuple[Int[Array, " gaps"], Int[Array, ""]]:
    """Number of the nearest of discs that do not overlap in each gap of a view, -1 for none.

    Args:
        circles: the discs.
        origin: the receiver.
        own: whether it is known to lie on them: those are left out.
        places: of both silhouettes of each among all cuts of the view: of the one further
            counter-clockwise, and of the other.
        above: whether they lie above the receiver's horizon.
        gaps: how many the view has, one more than cuts.

    Returns:
        The numbers, and that of a circle on whose rim the receiver lies, if that is not its own. It
        has no silhouettes and is left out too: what is seen of it only a ray can tell.
    """
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
