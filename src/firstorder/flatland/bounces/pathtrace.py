"""Path tracing in flatland: light after any number of bounces, as an estimate with its error bar.

    E(x) ~ (1/N) sum_i prod_j f cos / (pdf q) L_e,      L(x <- psi) likewise       (J12 eqs. 28, 29)

Every receiver has a few *lanes*; a lane carries one path at a time and starts the next as soon as
that one ends, so memory does not grow with the number of paths, and long paths hold up nobody. A
path ends by Russian roulette, whose chance belongs to its density. At every vertex one light is
sampled too (next-event estimation) and both ways to meet an emitter are weighted by their densities
(balance heuristic); point lights can only be sampled.

The random numbers of receiver i depend on the key and on i alone: results do not change when
receivers are added behind it, or spread over devices. Pass receivers placed on a
`jax.sharding.Mesh` (`jax.device_put(at, NamedSharding(mesh, P("x")))`) and the same functions run
on all of its devices, and under `jax.distributed` on several hosts; so do `irradiance` and its
derivatives under `jax.vmap`. What is computed for one receiver is the same arithmetic wherever it
runs; only sums over lanes are ordered by the compiler.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, ArrayLike, Float, Int, PRNGKeyArray

from firstorder.errors import check_between
from firstorder.flatland.bounces import _scatter as scattering
from firstorder.flatland.bounces._light_sampling import Lights, lights
from firstorder.flatland.bounces._scatter import Surface
from firstorder.flatland.bounces._vertices import (
    Plan,
    Scatter,
    Vertex,
    has_gloss,
    meet,
    plane_direction,
    sampled_light,
)
from firstorder.flatland.scene import Scene
from firstorder.flatland.visible import Receiver
from firstorder.sampling.estimates import Estimate, Moments
from firstorder.scene._arguments import check_asked, check_kind

LANES = 8192  # paths under way at a time: their state stays in the cache
SURVIVAL = 0.95
NUMBERS = 5  # uniform numbers in a step: roulette and lobe, two for a direction, two for a light


# --- what the public asks for --------------------------------------------------------------------


def path_irradiance(
    scene: Scene,
    at: Receiver,
    key: PRNGKeyArray,
    paths: int,
    bounces: int | None = None,
    *,
    next_event: bool = True,
    survival: float = SURVIVAL,
    scatter: Scatter = scattering.scatter,
    lanes: int | None = None,
) -> Estimate:
    """Irradiance by path tracing: direct light and light after any number of bounces.

    Unbiased, with an error that falls as `paths^(-1/2)`. There is no derivative (paths are drawn,
    and jump): take gradients of `irradiance` or of the radiosity solution.

    Args:
        scene: what shines and reflects.
        at: receivers, one or a row of them.
        key: of JAX.
        paths: for each receiver, two or more.
        bounces: the most reflections of a path; None for any number.
        next_event: whether lights are sampled at every vertex; False leaves emitters to chance
            (point lights are sampled in any case).
        survival: the most that roulette lets go on. Below it a path goes on with the share that
            the surface reflects.
        scatter: what surfaces do (see `firstorder.flatland.bounces._scatter`).
        lanes: for each receiver; more is faster until the cache is full.

    Returns:
        Mean, standard error and number of paths, for each receiver [W/m].

    Raises:
        ValueError: if there are fewer than two paths or `survival` is not in (0, 1).

    Reference: J12 §4.3, eq. 29.

    Example:
        >>> import jax
        >>> from firstorder.flatland import irradiance, receiver
        >>> from firstorder.flatland.library._scenes import scene_b
        >>> from firstorder.flatland.bounces.pathtrace import path_irradiance
        >>> scene = scene_b()
        >>> floor = receiver(scene, 0, 0.8)
        >>> E = path_irradiance(scene, floor, jax.random.key(0), 4096)
        >>> bool(abs(E.z(irradiance(scene, floor))) < 4)
        True
    """
    check_asked(scene, Scene, at, Receiver)
    # The receiver reflects twice what arrives: its BRDF is 1, and its radiance the irradiance.
    surface = _sensor(at.n, albedo=2.0)
    start = Vertex(
        at.position, at.tangent, jnp.zeros_like(at.n), jnp.ones_like(at.n), surface, at.on
    )
    plan = _plan(scene, bounces, next_event, survival, scatter)
    return _paths(scene, start, key, paths, lanes, plan)


def path_radiance(
    scene: Scene,
    origin: Float[ArrayLike, "*r 2"],
    along: Float[ArrayLike, "*r 2"],
    key: PRNGKeyArray,
    paths: int,
    bounces: int | None = None,
    *,
    on: ArrayLike = -1,
    next_event: bool = True,
    survival: float = SURVIVAL,
    scatter: Scatter = scattering.scatter,
    lanes: int | None = None,
) -> Estimate:
    """Radiance that comes to a point against a direction, by path tracing.

    Args:
        scene: what shines and reflects.
        origin: where the rays start [m].
        along: unit vectors to where the light comes from.
        key: of JAX.
        paths: for each ray, two or more.
        bounces: the most reflections of a path; None for any number.
        on: shape on which each ray starts, -1 for none.
        next_event: as in `path_irradiance`.
        survival: as in `path_irradiance`.
        scatter: what surfaces do.
        lanes: for each ray.

    Returns:
        Mean, standard error and number of paths, for each ray [W/(m rad)].

    Reference: J12 §4.3, eq. 29.
    """
    check_kind("scene", scene, Scene)
    origin, along = jnp.asarray(origin), jnp.asarray(along)
    one = jnp.ones(along.shape[:-1], along.dtype)
    # A mirror across the ray sends it straight on.
    tangent = jnp.stack([along[..., 1], -along[..., 0]], -1)
    on = jnp.broadcast_to(jnp.asarray(on), one.shape)
    start = Vertex(origin, tangent, 0.0 * one, one, _sensor(one, mirror=1.0), on)
    plan = _plan(scene, bounces, next_event, survival, scatter)
    return _paths(scene, start, key, paths, lanes, plan)


def tree_irradiance(
    scene: Scene,
    at: Receiver,
    key: PRNGKeyArray,
    branches: tuple[int, ...],
    runs: int,
) -> Estimate:
    """Irradiance by stochastic ray tracing: a tree, `branches[d]` rays at each vertex of depth d.

    Cut off after `len(branches) - 1` reflections, and exact in the mean up to there.
    Emitters and the sky are met by chance, point lights are connected at every vertex. A tree
    has as many rays as the product of its branches, and all are held at once; runs follow each
    other.

    Args:
        scene: what shines and reflects.
        at: receivers, one or a row of them.
        key: of JAX.
        branches: rays at each vertex, from the receiver on.
        runs: independent trees for each receiver; they give the error bar.

    Raises:
        ValueError: if there is no branch or there are fewer than two runs.

    Reference: J12 §4.2, eq. 28.
    """
    check_asked(scene, Scene, at, Receiver)
    if not branches or min(branches) < 1:
        raise ValueError(f"Argument `branches` must hold positive numbers, but is {branches}.")
    _check_many("runs", runs)
    surface = _sensor(at.n, albedo=2.0)
    start = Vertex(
        at.position, at.tangent, jnp.zeros_like(at.n), jnp.ones_like(at.n), surface, at.on
    )
    shape = at.n.shape
    start = jax.tree.map(lambda a: a.reshape(-1, *a.shape[len(shape) :]), start)
    glossy = has_gloss(scene)
    mean, error = _trees(scene, start, key, branches, runs, glossy)
    return Estimate(mean.reshape(shape), error.reshape(shape), runs)


# --- paths ---------------------------------------------------------------------------------------


class _State(NamedTuple):
    """The loop's state. Leading axis: receivers times lanes.

    Attributes:
        vertex: where the path is.
        weight: what radiance that arrives here counts: `prod f cos / (pdf q)`.
        value: gathered on this path so far.
        depth: reflections so far; 0 at the receiver.
        left: paths still to finish, this one included.
        seen: moments of the paths that are finished.
        step: of the loop, which names the random numbers.
    """

    vertex: Vertex
    weight: Float[Array, " n"]
    value: Float[Array, " n"]
    depth: Int[Array, " n"]
    left: Int[Array, " n"]
    seen: Moments
    step: Int[Array, ""]


def _paths(scene, start: Vertex, key, paths: int, lanes: int | None, plan: Plan) -> Estimate:
    """Checks, and one row of receivers."""
    _check_many("paths", paths)
    shape = start.sine.shape
    start = jax.tree.map(lambda a: a.reshape(-1, *a.shape[len(shape) :]), start)
    rows = start.sine.shape[0]
    lanes = min(paths, lanes or max(LANES // rows, 1))
    # How many paths is no part of the program: it is compiled once for all numbers.
    mean, error = _traced(scene, start, key, jnp.asarray(paths), lanes, plan)
    return Estimate(mean.reshape(shape), error.reshape(shape), paths)


@eqx.filter_jit
def _traced(scene: Scene, start: Vertex, key, paths, lanes: int, plan: Plan):
    """All paths of all receivers."""
    scene, start = jax.lax.stop_gradient((scene, start))
    rows = start.sine.shape[0]
    dtype = start.position.dtype
    where = lights(scene, 1.0, plan.next_event, plan.next_event)
    keys = jax.vmap(lambda i: jax.random.fold_in(key, i))(jnp.arange(rows))
    # Receivers first: a row that is spread over devices stays where it is.
    first = jax.tree.map(lambda a: jnp.repeat(a, lanes, axis=0), start)
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
            lambda k: jax.random.uniform(jax.random.fold_in(k, state.step), (lanes, NUMBERS), dtype)
        )(keys).reshape(rows * lanes, NUMBERS)
        return _advance(scene, where, first, state, u, plan)

    done = jax.lax.while_loop(more, step, state)
    seen = jax.tree.map(lambda a: a.reshape(rows, lanes), done.seen).merged().estimate()
    return seen.mean, seen.error


def _advance(scene, where: Lights, first: Vertex, state: _State, u, plan: Plan) -> _State:
    """One vertex of every path: sample a light, go on, and add what the ray meets."""
    here, weight = state.vertex, state.weight
    at_start = state.depth == 0
    # The receiver always sends its path on; a surface by what it reflects.
    survive = jnp.where(at_start, 1.0, jnp.minimum(here.surface.total, plan.survival))
    on = u[:, 0] < survive
    chance = jnp.where(survive > 0.0, survive, 1.0)
    u = u.at[:, 0].divide(chance)

    value = state.value + weight * sampled_light(scene, where, here, u[:, 3:], survive, plan)
    turned = plan.scatter(here.surface, (here.sine, here.cosine), u[:, :3], plan.glossy)
    along = plane_direction(here, turned)
    weight = weight * turned.weight / chance
    on = on & (weight > 0.0)
    met = meet(scene, where, here.position, here.on, along, plan)
    drawn = turned.density * survive
    share = drawn / jnp.where(drawn > 0.0, drawn + met.density, 1.0)
    share = jnp.where(turned.delta, 1.0, share)
    value = value + jnp.where(on, weight * share * met.radiance, 0.0)

    on = on & met.there & (met.vertex.surface.total > 0.0) & (state.depth < plan.bounces)
    return _ended(first, state, _State(met.vertex, weight, value, state.depth + 1, *state[4:]), on)


def _ended(first: Vertex, before: _State, now: _State, on) -> _State:
    """Counts the paths that have ended and starts the next ones."""
    ended = ~on & (before.left > 0)
    seen = before.seen.add(now.value, ended)

    def kept(a, b):
        return jnp.where(on.reshape(-1, *[1] * (a.ndim - 1)), a, b)

    return _State(
        jax.tree.map(kept, now.vertex, first),
        jnp.where(on, now.weight, 1.0),
        jnp.where(on, now.value, 0.0),
        jnp.where(on, now.depth, 0),
        before.left - ended,
        seen,
        before.step + 1,
    )


# --- trees ---------------------------------------------------------------------------------------


@eqx.filter_jit
def _trees(scene: Scene, start: Vertex, key, branches: tuple[int, ...], runs: int, glossy: bool):
    """All runs, one after the other."""
    scene, start = jax.lax.stop_gradient((scene, start))
    where = lights(scene, 1.0, 0.0, 0.0)
    plan = Plan(jnp.array(0), jnp.array(0.0), jnp.array(1.0), glossy, scattering.scatter)

    def reflected(here: Vertex, key, depth: int):
        """(28) at every vertex: the mean over its rays, and the point lights."""
        n, width = here.sine.shape[0], branches[depth]
        now, later, more = jax.random.split(key, 3)
        u = jax.random.uniform(now, (n, 2), here.position.dtype)
        one = jnp.ones((n,), here.position.dtype)
        direct = sampled_light(scene, where, here, u, one, plan)
        many = jax.tree.map(lambda a: jnp.repeat(a, width, axis=0), here)
        u = jax.random.uniform(later, (n * width, 3), here.position.dtype)
        turned = plan.scatter(many.surface, (many.sine, many.cosine), u, glossy)
        along = plane_direction(many, turned)
        met = meet(scene, where, many.position, many.on, along, plan)
        L = met.radiance
        if depth + 1 < len(branches):
            L = L + jnp.where(met.there, reflected(met.vertex, more, depth + 1), 0.0)
        return direct + jnp.mean((turned.weight * L).reshape(n, width), -1)

    def run(seen: Moments, key):
        return seen.add(reflected(start, key, 0)), None

    none = Moments.none(start.sine.shape, start.position.dtype)
    seen, _ = jax.lax.scan(run, none, jax.random.split(key, runs))
    out = seen.estimate()
    return out.mean, out.error


# --- small change --------------------------------------------------------------------------------


def _plan(scene: Scene, bounces, next_event, survival, scatter) -> Plan:
    if bounces is not None and bounces < 0:
        raise ValueError(f"Argument `bounces` must not be negative, but is {bounces}.")
    check_between("survival", survival, 1e-6, 1.0 - 1e-6)
    most = jnp.asarray(jnp.iinfo(jnp.int32).max if bounces is None else bounces, jnp.int32)
    # Numbers, not choices: one compiled program serves all of them.
    number = jnp.asarray(float(next_event)), jnp.asarray(float(survival))
    return Plan(most, *number, has_gloss(scene), scatter)


def _sensor(like: Array, albedo: float = 0.0, mirror: float = 0.0) -> Surface:
    zero = jnp.zeros_like(like)
    return Surface(zero + albedo, zero + mirror, zero, zero, zero)


def _uniform(key, shape: tuple[int, ...], dtype) -> Array:
    """Numbers in (0, 1) from 32 random bits each (23 in single precision, so that none is 1)."""
    bits = jax.random.bits(key, shape, jnp.uint32)
    if dtype == jnp.float64:
        return (bits.astype(dtype) + 0.5) * 2.0**-32
    return ((bits >> 9).astype(dtype) + 0.5) * 2.0**-23


def _check_many(name: str, count: Any) -> None:
    if count < 2:
        raise ValueError(f"Argument `{name}` must be at least 2, but is {count}.")
