"""First hits of rays, in any dimension.

Rays go in blocks, and shapes in chunks, so that all distances of a block to a chunk fit the
nearest memory: each step of the search is then one loop over them, several rays at once. (A number
that a loop over the shapes carries, such as the nearest distance so far, XLA writes where it reads
it, and goes ray by ray: three to twenty times as slow.) The search is not differentiated: the one
hit that it finds is computed again by the caller, so that value and gradient cost about as much as
the value.

Surfaces in the same place, such as a lamp drawn on a wall, are told apart by their ranks and not
by rounding: of all that lie within a share `eps^(3/4)` of the distance behind the nearest hit, or
within rounding of the coordinates, the highest counts.

A group is a module that holds shapes of one kind along the leading axis of its leaves; it has
`count` and, for one row, `prepared()`, which has `distance(origin, along, own)`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from functools import partial
from typing import Any, TypeVar

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Bool, Float, Int

from firstorder._argument_checks import is_concrete
from firstorder.numerics._batching import in_blocks, one_list
from firstorder.numerics._host import hosted
from firstorder.numerics._select import either
from firstorder.numerics._vectors import rows
from firstorder.scene._bands import in_any_band
from firstorder.typing import as_array

MISS = -1
# Measured (benchmarks/bench_flatland.py): from 8 to 32 shapes in a chunk do as well.
CHUNK = 16
DISTANCES = 4096  # in the nearest memory

# Origins, unit directions, and the number of the shape on which each ray starts.
Rays = tuple[Float[Array, "r d"], Float[Array, "r d"], Int[Array, " r"]]
# The same, coordinates apart.
Apart = tuple[Float[Array, "d r"], Float[Array, "d r"], Int[Array, " r"]]
Tree = TypeVar("Tree")


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


def end_slack(origins: Float[Array, "*r d"], far: Float[Array, "*k"]) -> Float[Array, "*k"]:
    """How close to the end of a way surfaces are in one place with it: a lamp and its wall."""
    return far * tie(far.dtype) + rounding(origins)


def highest(t: Float[Array, "m r"], rank: Int[Array, "m #r"], n: int) -> Int[Array, " r"]:
    """Number of the nearest shape, -1 for none; in the same place the one of the highest rank.

    Args:
        t: distances, infinite for a miss.
        rank: `ranks` of what is that far.
        n: number of all shapes.
    """
    most = _nearest(t, rank)[1]
    return either(most < n, most, most - n)


def _nearest(
    t: Float[Array, "m r"], rank: Int[Array, "m #r"]
) -> tuple[Float[Array, " r"], Int[Array, " r"]]:
    """The least distance, and the highest rank of what is in that place; -1 for a miss."""
    least = _shortest(t)
    there = t <= jnp.minimum(least * (1.0 + tie(t.dtype)), jnp.finfo(t.dtype).max)
    return least, jnp.max(either(there, rank, MISS), 0)


def _shortest(t: Float[Array, "m r"]) -> Float[Array, " r"]:
    """The least distance of each ray; that to a shape that is NaN does not count."""
    return jnp.min(either(t < jnp.inf, t, jnp.inf), 0)


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
        said = ask(jax.tree.map(lambda leaf, at=at: rows(leaf, at), group))
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
    # Not known before run time: a quotient that the compiler folds is not kept (`_distances`).
    x = origins[:, 0]
    return origins.T, along.T, either(x == x, on, MISS)


def _prepared(groups: Sequence[Any]) -> tuple[Any, ...]:
    """Groups with what depends on no ray computed, once for all of them."""
    return tuple(jax.vmap(lambda shape: shape.prepared())(group) for group in groups)


def _distances(group: Any, numbers: Array, apart: Apart, end: Array | float) -> Float[Array, "m r"]:
    """Distances of all rays to all shapes of a group, behind an end.

    Each is a quotient, of one at last: those of a ray to its own shape, which are infinite, are
    halved. XLA keeps a quotient that is read twice, and computes anything else anew for each
    reader, ray by ray: three to ten times as slow.
    """

    def one(shape, k):
        return jax.vmap(lambda o, d, on: shape.distance(o, d, on == k), (1, 1, 0))(*apart)

    t, own = jax.vmap(one)(group, numbers) - end, apart[2] == numbers[:, None]
    return t / either(own, jnp.asarray(2.0, t.dtype), 1.0)


def _least(t: Float[Array, "m r"]) -> Float[Array, " r"]:
    """The shortest of `_distances`, for a reader that is the only one.

    It is never above the largest, which is asked for so that they are read twice, and so kept.
    """
    least = _shortest(t)
    return either(least > jnp.max(t, 0), jnp.inf, least)


def _in_chunks(f: Callable[..., Tree], chunk: int, *of: Any) -> Tree:
    """Answers of f for each chunk of shapes, in rows.

    The chunks are of one size, and the last one may hold the last shape more than once.
    """
    count = jax.tree.leaves(of)[0].shape[0]
    chunks = -(-count // chunk)
    size = -(-count // chunks)
    which = np.minimum(np.arange(chunks * size), count - 1).reshape(chunks, size)
    return jax.lax.map(lambda each: f(*each), jax.tree.map(lambda a: a[which], of))


def _of_chunks(f: Callable[..., Array], groups: Sequence[Any]) -> Array:
    """Answers of f for groups of at most `CHUNK` shapes and for chunks of larger ones, in rows."""
    rows = [
        _in_chunks(f, CHUNK, *pair) if pair[0].count > CHUNK else f(*pair)[None]
        for pair in numbered(groups)
    ]
    return jnp.concatenate(rows)


def first_of_block(
    groups: Sequence[Any], rank: Array, rays: Rays, chunk: int = CHUNK
) -> Int[Array, " r"]:
    """The search for all rays at once, and for a chunk of shapes.

    Args:
        groups: the shapes.
        rank: `ranks` of them.
        rays: one block.
        chunk: shapes at a time.
    """
    apart, n = _apart(rays), rank.shape[0]
    # So much longer that a share of them is above rounding.
    more = rounding(rays[0]) / tie(rays[0].dtype)

    def candidates(group, numbers, rank):
        return _distances(group, numbers, apart, -more), rank[:, None]

    def nearest(*of):
        return _nearest(*candidates(*of))

    found, first = [], 0
    for group, numbers in numbered(groups):
        of = group, numbers, rank[first : first + group.count]
        many = group.count > chunk
        found.append(_in_chunks(nearest, chunk, *of) if many else candidates(*of))
        first += group.count
    width = max(most.shape[1] for _, most in found)  # 1, or that of the rays
    most = [jnp.broadcast_to(most, (len(most), width)) for _, most in found]
    return highest(jnp.concatenate([t for t, _ in found]), jnp.concatenate(most), n)


def first_shape(
    groups: Sequence[Any],
    rank: Int[Array, " n"],
    rays: Rays,
    block: int | None = None,
    chunk: int = CHUNK,
) -> Int[Array, " r"]:
    """Number of the shape that each ray meets first, -1 for none. It has no derivative.

    Args:
        groups: the shapes.
        rank: which of them counts, where several are in the same place: `ranks`.
        rays: with their leading axis.
        block: rays at a time; so many that the distances fit the nearest memory, if left out.
        chunk: shapes of one kind at a time.
    """
    groups, rays = jax.lax.stop_gradient((_prepared(groups), rays))
    size = block_of(groups, chunk) if block is None else block

    def search(groups, rank, rays):
        return in_blocks(lambda rays: first_of_block(groups, rank, rays, chunk), rays, size)

    return one_list(lambda fixed, rays: search(*fixed, rays))((groups, rank), rays)


def block_of(groups: Sequence[Any], chunk: int = CHUNK) -> int:
    """Number of rays whose distances to chunks of all groups fit the nearest memory."""
    return max(64, DISTANCES // sum(min(group.count, chunk) for group in groups))


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
    of surfaces in the same place any counts; so this costs half of the first hits.

    Args:
        groups: the shapes.
        origins: of the rays.
        along: their directions of any length, coordinates apart.
        on: number of the shape on which each place lies, or -1.
    """
    groups, origins, along = jax.lax.stop_gradient((_prepared(groups), origins, tuple(along)))
    d = origins.shape[1]
    toward = jnp.stack(jnp.broadcast_arrays(*along), -1)  # (n or 1, k, d)
    toward = jnp.broadcast_to(toward, (len(origins), *toward.shape[1:]))
    k = toward.shape[1]
    starts = jnp.broadcast_to(origins[:, None], toward.shape)
    rays = starts.reshape(-1, d), toward.reshape(-1, d), jnp.repeat(on, k)
    free = in_blocks(partial(_free_of_block, groups), rays, block_of(groups))
    return free.reshape(-1, k)


def _free_of_block(groups: Sequence[Any], rays: Rays) -> Float[Array, " r"]:
    """Distances to what rays meet first."""
    apart = _apart(rays)

    def least(group, numbers):
        return _least(_distances(group, numbers, apart, 0.0))

    return jnp.min(_of_chunks(least, groups), 0)


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

    def blocked(group, numbers):
        k = numbers[:, None]
        before = length * either(on_end == k, jnp.full_like(length, its_own), others) + slack
        if rank is not None and least is not None:
            before = either(rank[k] > least, -before, before)
        return _least(_distances(group, numbers, apart, length - before)) < 0.0

    return jnp.any(_of_chunks(blocked, groups), 0)


def occluded(
    groups: Sequence[Any],
    rank: Int[Array, " n"] | None,
    a: Float[Array, "r d"],
    b: Float[Array, "r d"],
    on_a: ArrayLike = MISS,
    on_b: ArrayLike = MISS,
    block: int | None = None,
) -> Bool[Array, " r"]:
    """Whether something stands between two points. It has no derivative.

    The shape on which a ray ends does not count within 32 sqrt(eps) of its length before the end;
    all others count up to `eps^(3/4)` of it, and both but for the rounding of the coordinates.
    Of shapes in one place with the end, those of a higher rank (`ranks`) that shine hide it.
    """
    groups, a, b = jax.lax.stop_gradient((_prepared(groups), a, b))
    way = b - a
    length = jnp.sqrt(jnp.sum(way * way, -1))
    along = way / either(length == 0.0, 1.0, length)[:, None]
    on_a, on_b = (jnp.broadcast_to(jnp.asarray(on), length.shape) for on in (on_a, on_b))
    eps = float(jnp.finfo(length.dtype).eps)
    near_end = 32.0 * eps**0.5, tie(length.dtype)

    def find(fixed, rays):
        start, along, on_a, on_b, length = rays
        return any_hit(*fixed, (start, along, on_a), on_b, length, near_end)

    size = block_of(groups) if block is None else block
    search = one_list(lambda fixed, rays: in_blocks(partial(find, fixed), rays, size))
    return search((groups, rank), (a, along, on_a, on_b, length))
