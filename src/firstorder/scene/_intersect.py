"""First hits of rays, in any dimension.

Rays times shapes are never kept in memory. A few shapes are compared in one reduction; from
`FEW` on, rays go in blocks that fit the cache and a scan over the shapes of each kind carries the
nearest distance and its shape's number. The search is not differentiated: the one hit that it finds
is computed again by the caller, so that value and gradient cost about as much as the value.

Surfaces in the same place, such as a lamp drawn on a wall, are told apart by their ranks and not
by rounding: of all that lie within a share `eps^(3/4)` of the distance behind the nearest hit, or
within rounding of the coordinates, the highest counts.

A group is a module that holds shapes of one kind along the leading axis of its leaves; it has
`count` and, for one row, `distance(origin, along, own)`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from functools import partial
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Bool, Float, Int

from firstorder._argument_checks import is_concrete
from firstorder.numerics._batching import in_blocks, one_list
from firstorder.numerics._host import hosted
from firstorder.numerics._select import either
from firstorder.scene._bands import in_any_band
from firstorder.typing import as_array

MISS = -1
# Measured (benchmarks/bench_flatland.py): below, one reduction over all shapes wins by up to 3.
FEW = 16
BLOCK = 2048  # rays whose state stays in the cache

# Origins, unit directions, and the number of the shape on which each ray starts.
Rays = tuple[Float[Array, "r d"], Float[Array, "r d"], Int[Array, " r"]]


def ranks(emission: Float[Array, "n 2 ..."]) -> Int[Array, " n"]:
    """Rank of each shape among those in one place: higher if it shines, and then if it is later.

    That of a shape that shines is its number and n.

    Args:
        emission: of both sides, in bands or not.
    """
    n = emission.shape[0]
    shines = jnp.any(jax.lax.stop_gradient(emission).reshape(n, -1) > 0.0, 1)
    return jnp.arange(n, dtype=jnp.int32) + n * in_any_band(shines).astype(jnp.int32)


def ranks_among(rank: Int[Array, " n"], some: np.ndarray) -> Int[Array, " m"]:
    """Ranks of some shapes among themselves.

    Args:
        rank: `ranks` of all.
        some: numbers of those, in order.
    """
    shines = rank[some] >= rank.shape[0]
    return jnp.arange(some.size, dtype=jnp.int32) + some.size * shines.astype(jnp.int32)


def tie(dtype: Any) -> float:
    """The share of a distance within which surfaces are in the same place."""
    return float(jnp.finfo(dtype).eps) ** 0.75


def rounding(origins: Float[Array, "*r d"]) -> Float[Array, "*r"]:
    """Of distances, from the coordinates of places."""
    return 8.0 * jnp.finfo(origins.dtype).eps * jnp.max(jnp.abs(origins), -1)


def highest(t: Float[Array, "m r"], rank: Int[Array, "m #r"], n: int) -> Int[Array, " r"]:
    """Number of the nearest shape, -1 for none; in the same place the one of the highest rank.

    Args:
        t: distances, infinite for a miss.
        rank: `ranks` of what is that far.
        n: number of all shapes.
    """
    share = tie(t.dtype)

    def nearer(one, other):
        (s, k), (t, m) = one, other
        least = jnp.minimum(s, t)
        within = least * (1.0 + share)
        both = (s <= within) & (t <= within)
        return least, either(both, jnp.maximum(k, m), either(s < t, k, m))

    met = either(t < jnp.inf, rank, MISS)
    nothing = jnp.asarray(jnp.inf, t.dtype), jnp.asarray(MISS, jnp.int32)
    most = jax.lax.reduce((t, met), nothing, nearer, (0,))[1]
    return either(most < n, most, most - n)


def numbered(groups: Sequence[Any]) -> Iterator[tuple[Any, Int[Array, " n"]]]:
    """Each group with the numbers of its shapes."""
    first = 0
    for group in groups:
        yield group, jnp.arange(first, first + group.count, dtype=jnp.int32)
        first += group.count


def picked(groups: Sequence[Any], index: ArrayLike, ask: Callable[[Any], Any]) -> Any:
    """The answer of the shape of that number.

    Of a traced number every group is evaluated, and one answer is kept.
    """
    if is_concrete(index):
        return ask(_shape(groups, int(index)))
    index, first, answer = jnp.asarray(index), 0, None
    for group in groups:
        at = jnp.clip(index - first, 0, group.count - 1)
        said = ask(jax.tree.map(lambda leaf, at=at: leaf[at], group))
        if answer is None:
            answer = said
        else:
            here = index >= first
            answer = jax.tree.map(lambda a, b, here=here: either(here, a, b), said, answer)
        first += group.count
    return answer


def _shape(groups: Sequence[Any], index: int) -> Any:
    """One shape by its number; the first or the last of all, if there is none of that number."""
    first, group = 0, groups[0]
    for following in groups[1:]:
        if index < first + group.count:
            break
        first, group = first + group.count, following
    at = min(max(index - first, 0), group.count - 1)
    return jax.tree.map(lambda leaf: as_array(hosted(leaf)[1][at]), group)


def _apart(rays):
    """Coordinates apart, so that rays lie side by side in memory. Once, outside of any loop."""
    origins, along, on = rays
    return origins.T, along.T, on


def _beside(f, rays):
    """Maps f over rays whose coordinates are apart."""
    return jax.vmap(f, in_axes=(1, 1, 0))(*rays)


def first_by_reduction(groups: Sequence[Any], rank: Array, rays: Rays) -> Int[Array, " r"]:
    """All distances at once, reduced by the compiler as they arise."""
    apart = _apart(rays)

    def meet(o, d, on):
        found = [
            jax.vmap(lambda shape, k: shape.distance(o, d, on == k))(group, numbers)
            for group, numbers in numbered(groups)
        ]
        return jnp.concatenate(found)

    t = jax.vmap(meet, in_axes=(1, 1, 0), out_axes=1)(*apart)
    # So much longer that a share of them is above rounding.
    t = t + rounding(rays[0]) / tie(t.dtype)
    return highest(t, rank[:, None], rank.shape[0])


def first_by_scan(groups: Sequence[Any], rank: Array, rays: Rays) -> Int[Array, " r"]:
    """Shape after shape against all rays."""
    apart = _apart(rays)
    share, slack, count = 1.0 + tie(apart[0].dtype), rounding(rays[0]), apart[2].shape

    def meet(carry, here):
        (reach, most), (shape, k, rank) = carry, here
        t = _beside(lambda o, d, on: shape.distance(o, d, on == k), apart)
        return (jnp.minimum(reach, share * t + slack), either(t <= reach, rank, most)), None

    found = []
    for group, numbers in numbered(groups):
        # The highest come last and take what is in the same place.
        order = jnp.argsort(rank[numbers])
        each = jax.tree.map(lambda a, order=order: a[order], (group, numbers, rank[numbers]))
        # No miss is as near as this.
        reach = jnp.full(count, jnp.finfo(apart[0].dtype).max, apart[0].dtype)
        found.append(jax.lax.scan(meet, (reach, jnp.full(count, MISS, jnp.int32)), each)[0])
    reach, most = (jnp.stack(a) for a in zip(*found, strict=True))
    return highest(either(most == MISS, jnp.inf, reach), most, rank.shape[0])


def first_shape(
    groups: Sequence[Any],
    rank: Int[Array, " n"],
    rays: Rays,
    block: int = BLOCK,
    few: int | None = None,
) -> Int[Array, " r"]:
    """Number of the shape that each ray meets first, -1 for none. It has no derivative.

    Args:
        groups: the shapes.
        rank: which of them counts, where several are in the same place: `ranks`.
        rays: with their leading axis.
        block: rays at a time, where shapes are many.
        few: so many shapes are compared in one reduction; `FEW`, if left out.
    """
    groups, rays = jax.lax.stop_gradient((tuple(groups), rays))
    if sum(group.count for group in groups) <= (FEW if few is None else few):
        return first_by_reduction(groups, rank, rays)

    def search(groups, rank, rays):
        return in_blocks(partial(first_by_scan, groups, rank), rays, block)

    return one_list(lambda fixed, rays: search(*fixed, rays))((groups, rank), rays)


def reached(groups: Sequence[Any], number: Int[Array, "*#r"], rays: Rays) -> Float[Array, " r"]:
    """Distances along rays to one shape, or to one of its own for each; infinite for none.

    Args:
        groups: the shapes.
        number: of the shape, or of that of each ray; -1 for none.
        rays: with their leading axis.
    """

    def reach(number, origin, along, on):
        known = jnp.maximum(number, 0)
        t = picked(groups, known, lambda shape: shape.distance(origin, along, on == number))
        return either(number == MISS, jnp.inf, t)

    return jax.vmap(reach, (0 if number.ndim else None, 0, 0, 0))(number, *rays)


def free_ways(
    groups: Sequence[Any],
    origins: Float[Array, "n d"],
    along: Sequence[Float[Array, "#n k"]],
    on: Int[Array, " n"],
) -> Float[Array, "n k"]:
    """Distance to what k rays from each of n places meet first, infinity for nothing.

    In units of each direction's length. It has no derivative. Which shape is met is not asked, and
    of surfaces in the same place any counts; so this costs a twentieth of the first hits.

    Args:
        groups: the shapes.
        origins: of the rays.
        along: their directions of any length, coordinates apart.
        on: number of the shape on which each place lies, or -1.
    """
    groups, origins, along = jax.lax.stop_gradient((tuple(groups), origins, tuple(along)))
    toward = jnp.stack(jnp.broadcast_arrays(*along))  # (d, n or 1, k)
    shape_ = jnp.broadcast_shapes((len(origins), 1), toward.shape[1:])

    def meet(free, here):
        shape, k = here
        each = jax.vmap(shape.distance, (None, 1, None))
        own = on == k
        t = jax.vmap(each, (0, 1, 0))(
            origins, jnp.broadcast_to(toward, (len(toward), *shape_)), own
        )
        return jnp.minimum(free, t), None

    free = jnp.full(shape_, jnp.inf, origins.dtype)
    for pair in numbered(groups):
        free, _ = jax.lax.scan(meet, free, pair)
    return free


def any_hit(
    groups: Sequence[Any],
    rank: Int[Array, " n"] | None,
    rays: Rays,
    on_end: Int[Array, " r"],
    length: Float[Array, " r"],
    near_end: tuple[float, float],
) -> Bool[Array, " r"]:
    """Whether any shape is hit before the end; the shape at the end is itself not hit there.

    A shape that shines hides an end on another in the same place, if its rank is higher.

    Args:
        groups: the shapes.
        rank: `ranks` of them; None if no ray ends on a shape.
        rays: where they start, where to, and on what.
        on_end: number of the shape on which each ends, or -1.
        length: of each ray [m].
        near_end: shares of the length, before the end, in which the shape that holds the end, and
            any other shape, do not count; nor does what is nearer to it by rounding.
    """
    apart = _apart(rays)
    its_own, others = near_end
    slack, least = rounding(rays[0]), None
    if rank is not None:
        n = rank.shape[0]
        least = either(on_end == MISS, 2 * n, jnp.maximum(rank[on_end], n - 1))

    def meet(blocked, here):
        shape, k = here
        t = _beside(lambda o, d, on: shape.distance(o, d, on == k), apart)
        before = length * either(on_end == k, jnp.full_like(length, its_own), others) + slack
        if rank is not None and least is not None:
            before = either(rank[k] > least, -before, before)
        return blocked | (t < length - before), None

    blocked = jnp.zeros(length.shape, bool)
    for pair in numbered(groups):
        blocked, _ = jax.lax.scan(meet, blocked, pair)
    return blocked


def occluded(
    groups: Sequence[Any],
    rank: Int[Array, " n"] | None,
    a: Float[Array, "r d"],
    b: Float[Array, "r d"],
    on_a: ArrayLike = MISS,
    on_b: ArrayLike = MISS,
    block: int = BLOCK,
) -> Bool[Array, " r"]:
    """Whether something stands between two points. It has no derivative.

    The shape on which a ray ends does not count within 32 sqrt(eps) of its length before the end;
    all others count up to `eps^(3/4)` of it, and both but for the rounding of the coordinates.
    Of shapes in one place with the end, those of a higher rank (`ranks`) that shine hide it.
    """
    groups, a, b = jax.lax.stop_gradient((groups, a, b))
    way = b - a
    length = jnp.sqrt(jnp.sum(way * way, -1))
    along = way / either(length == 0.0, 1.0, length)[:, None]
    on_a, on_b = (jnp.broadcast_to(jnp.asarray(on), length.shape) for on in (on_a, on_b))
    eps = float(jnp.finfo(length.dtype).eps)
    near_end = 32.0 * eps**0.5, tie(length.dtype)

    def find(fixed, rays):
        start, along, on_a, on_b, length = rays
        return any_hit(*fixed, (start, along, on_a), on_b, length, near_end)

    search = one_list(lambda fixed, rays: in_blocks(partial(find, fixed), rays, block))
    return search((tuple(groups), rank), (a, along, on_a, on_b, length))
