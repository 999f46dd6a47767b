"""Random paths of both worlds: lanes that each carry one path at a time, and Russian roulette.

A lane starts its next path as soon as one ends, so memory does not grow with the number of paths,
and long paths hold up nobody. The random numbers of row i depend on the key and on i alone. What a
path does at a vertex is the world's; this module knows only that it goes on or ends.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, Int

from firstorder._argument_checks import check_between, check_count, check_integer
from firstorder.sampling.estimates import Moments

LANES = 8192  # paths under way at a time: their state stays in the cache
SURVIVAL = 0.95  # the most that roulette lets go on
ANY = jnp.iinfo(jnp.int32).max  # as many reflections as roulette allows


class Lengths(NamedTuple):
    """How long paths are; numbers, so that one compiled program serves all of them.

    Attributes:
        bounces: the most reflections of a path; `ANY` leaves its end to roulette.
        survival: the most that roulette lets go on.
    """

    bounces: Int[Array, ""]
    survival: Float[Array, ""]


class Gathered(NamedTuple):
    """Events of paths at one vertex each. Leading axis: lanes.

    Attributes:
        vertex: the next one.
        weight: what radiance that arrives there counts: `prod f cos / (pdf q)`.
        value: light found in this step, times its weight.
        on: whether the path goes on.
    """

    vertex: Any
    weight: Float[Array, " n"]
    value: Float[Array, " n"]
    on: Bool[Array, " n"]


class _State(NamedTuple):
    """The loop's state. Leading axis: rows times lanes.

    Attributes:
        vertex: where the path is.
        weight: what radiance that arrives here counts.
        value: gathered on this path so far.
        depth: reflections so far; 0 at the start.
        left: paths still to finish, this one included.
        seen: moments of the paths that are finished.
        step: of the loop, which names the random numbers.
    """

    vertex: Any
    weight: Float[Array, " n"]
    value: Float[Array, " n"]
    depth: Int[Array, " n"]
    left: Int[Array, " n"]
    seen: Moments
    step: Int[Array, ""]


def path_lengths(bounces: int | None, survival: float) -> Lengths:
    """How long paths are, from what a user asked for.

    Raises:
        ValueError: if bounces are negative or `survival` is not in (0, 1).
    """
    if bounces is not None:
        check_integer("bounces", bounces)
    if bounces is not None and bounces < 0:
        raise ValueError(f"Argument `bounces` must not be negative, but is {bounces}.")
    check_between("survival", survival, 1e-6, 1.0 - 1e-6)
    most = jnp.asarray(ANY if bounces is None else bounces, jnp.int32)
    return Lengths(most, jnp.asarray(float(survival)))


def check_many(name: str, count: Any) -> None:
    """Refuses fewer than two samples, from which no error follows.

    Raises:
        ValueError: if there are.
    """
    check_integer(name, count)
    if count < 2:
        raise ValueError(f"Argument `{name}` must be at least 2, but is {count}.")


def lanes_for(rows: int, paths: int, lanes: int | None) -> int:
    """Paths of one row under way at a time: what a user asked for, or what fills the cache.

    Raises:
        ValueError: if their number is no positive integer.
    """
    if lanes is not None:
        check_count("lanes", lanes)
    return min(paths, lanes or max(LANES // rows, 1))


def survival_chance(total: Array, depth: Array, length: Lengths) -> Array:
    """The probability with which roulette lets paths go on.

    A surface's share of reflected light, and at most `survival`. The first step is always taken,
    and paths of a given length are followed to their end.
    """
    sure = (depth == 0) | (length.bounces < ANY)
    return jnp.where(sure, 1.0, jnp.minimum(total, length.survival))


def roulette(u: Array, chance: Array) -> tuple[Array, Array, Array]:
    """Whether paths go on, what each weighs if it does, and its number u, uniform anew.

    Unbiased: `chance * (1 / chance) = 1`.
    """
    safe = jnp.where(chance > 0.0, chance, 1.0)
    return u < chance, 1.0 / safe, u / safe


class Arrived(NamedTuple):
    """Events of photons at one surface each. Leading axis: photons.

    Attributes:
        vertex: where they are; what the next direction is drawn from.
        landing: what is written down of it.
        there: whether anything was met.
        share: of their flux that the surface reflects.
    """

    vertex: Any
    landing: Any
    there: Bool[Array, " n"]
    share: Float[Array, " n"]


def follow_photons(
    rays: Any,
    flux: Float[Array, " n"],
    keys: Array,
    numbers: int,
    survival: Float[Array, ""],
    meet: Callable[[Any], Arrived],
    reflect: Callable[[Any, Array], tuple[Any, Array]],
) -> tuple[Any, Bool[Array, "b n"], Float[Array, "b n"]]:
    """Photons from surface to surface until roulette ends them: one in each lane.

    They are absorbed with the share that a surface does not reflect, so that each keeps its flux.

    Args:
        rays: of the new photons.
        flux: of each [W].
        keys: one for each surface on the way, the first included.
        numbers: uniform numbers at each, the first of them for roulette and uniform again after it.
        survival: the most that roulette lets go on.
        meet: where rays arrive.
        reflect: the next rays from (vertex, uniform numbers), and BRDF times cosine over density.

    Returns:
        Landings in the order of reflections, which of them are photons, and the flux of each.
    """

    def bounce(state, key):
        rays, flux = state
        met = meet(rays)
        landed = met.there & (flux > 0.0)
        flux = jnp.where(landed, flux, 0.0)
        u = jax.random.uniform(key, (flux.shape[0], numbers), flux.dtype)
        alive, heavier, again = roulette(u[:, 0], jnp.minimum(met.share, survival))
        rays, weight = reflect(met.vertex, u.at[:, 0].set(again))
        after = jnp.where(alive, flux * weight * heavier, 0.0)
        return (rays, after), (met.landing, landed, flux)

    return jax.lax.scan(bounce, (rays, flux), keys)[1]


def walk(
    first: Any,
    key: Array,
    paths: Array,
    lanes: int,
    numbers: int,
    advance: Callable[[Any, Array, Array, Array], Gathered],
) -> tuple[Float[Array, " r"], Float[Array, " r"]]:
    """Mean and standard error of what paths gather, for each row of first vertices.

    Args:
        first: vertices where the paths of each row start; leading axis r.
        key: of JAX.
        paths: for each row; how many is no part of the program.
        lanes: for each row.
        numbers: uniform numbers in a step.
        advance: a step of all lanes from (vertex, weight, depth, uniform numbers).
    """
    leaves = jax.tree.leaves(first)
    rows = leaves[0].shape[0]
    dtype = jnp.result_type(*(a for a in leaves if jnp.issubdtype(a.dtype, jnp.floating)))
    keys = jax.vmap(lambda i: jax.random.fold_in(key, i))(jnp.arange(rows))
    # Rows first: a row that is spread over devices stays where it is.
    first = jax.tree.map(lambda a: jnp.repeat(a, lanes, axis=0), first)
    quota = paths // lanes + (jnp.arange(lanes) < paths % lanes)
    none = jnp.zeros((rows * lanes,), dtype)
    state = _State(
        first,
        none + 1.0,
        none,
        jnp.zeros(none.shape, jnp.int32),
        jnp.tile(quota.astype(jnp.int32), rows),
        Moments.none(none.shape, dtype),
        jnp.zeros((), jnp.int32),
    )

    def more(state: _State):
        return jnp.any(state.left > 0)

    def step(state: _State) -> _State:
        u = jax.vmap(
            lambda k: jax.random.uniform(jax.random.fold_in(k, state.step), (lanes, numbers), dtype)
        )(keys).reshape(rows * lanes, numbers)
        found = advance(state.vertex, state.weight, state.depth, u)
        return _ended(first, state, found)

    done = jax.lax.while_loop(more, step, state)
    seen = jax.tree.map(lambda a: a.reshape(rows, lanes), done.seen).merged().estimate()
    return seen.mean, seen.error


def _ended(first: Any, before: _State, now: Gathered) -> _State:
    """Counts the paths that have ended and starts the next ones."""
    ended = ~now.on & (before.left > 0)
    value = before.value + now.value
    seen = before.seen.add(value, ended)

    def kept(a, b):
        return jnp.where(now.on.reshape(-1, *[1] * (a.ndim - 1)), a, b)

    return _State(
        jax.tree.map(kept, now.vertex, first),
        jnp.where(now.on, now.weight, 1.0),
        jnp.where(now.on, value, 0.0),
        jnp.where(now.on, before.depth + 1, 0),
        before.left - ended,
        seen,
        before.step + 1,
    )
