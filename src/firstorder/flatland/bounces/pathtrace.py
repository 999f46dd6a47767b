"""Path tracing in flatland: light after any number of bounces, as an estimate with its error bar.

    E(x) ~ (1/N) sum_i prod_j f cos / (pdf q) L_e,      L(x <- psi) likewise       (J12 eqs. 28, 29)

Every receiver has a few *lanes*; a lane carries one path at a time and starts the next as soon as
that one ends, so memory does not grow with the number of paths, and long paths hold up nobody. A
path of any number of bounces ends by Russian roulette, whose chance belongs to its density. At
every vertex one light is sampled too (next-event estimation) and both ways to meet an emitter are
weighted by their densities (balance heuristic); point lights can only be sampled.

The random numbers of receiver i depend on the key and on i alone: results do not change when
receivers are added behind it, or spread over devices. Pass receivers placed on a
`jax.sharding.Mesh` (`jax.device_put(at, NamedSharding(mesh, P("x")))`) and the same functions run
on all of its devices, and under `jax.distributed` on several hosts; so do `irradiance` and its
derivatives under `jax.vmap`. What is computed for one receiver is the same arithmetic wherever it
runs; only sums over lanes are ordered by the compiler, so the same key gives the same bytes with
the same versions and flags of it (`session.settings`).
"""

from __future__ import annotations

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, ArrayLike, PRNGKeyArray

from firstorder._argument_checks import check_integer
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
from firstorder.numerics._planar import left
from firstorder.sampling._paths import (
    SURVIVAL,
    Gathered,
    check_many,
    lanes_for,
    path_lengths,
    roulette,
    survival_chance,
    walk,
)
from firstorder.sampling.estimates import Estimate, Moments
from firstorder.scene._arguments import check_asked, check_kind, numbers
from firstorder.scene._bands import OF_AN_ESTIMATE, band_after_band
from firstorder.scene._questions import warns_if_dark

NUMBERS = 5  # uniform numbers in a step: roulette and lobe, two for a direction, two for a light


# --- what the public asks for --------------------------------------------------------------------


@warns_if_dark
@band_after_band(OF_AN_ESTIMATE)
def path_irradiance(
    scene: Scene,
    at: Receiver,
    *,
    key: PRNGKeyArray,
    paths: int,
    bounces: int | None = None,
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
        survival: the most that roulette lets go on; below it a path goes on with the share that
            the surface reflects. Roulette ends paths only where `bounces` is None.
        scatter: what surfaces do (see `firstorder.flatland.bounces._scatter`).
        lanes: for each receiver; more is faster until the cache is full.

    Returns:
        Mean, standard error and number of paths, for each receiver, bands last [W/m].

    Raises:
        ValueError: if there are fewer than two paths or `survival` is not in (0, 1).

    Reference: J12 §4.3, eq. 29.

    Example:
        >>> import jax
        >>> from firstorder.flatland import irradiance, receiver
        >>> from firstorder.flatland.library import scene_b
        >>> from firstorder.flatland.bounces import path_irradiance
        >>> scene = scene_b()
        >>> floor = receiver(scene, 0, 0.8)
        >>> E = path_irradiance(scene, floor, key=jax.random.key(0), paths=4096)
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


@warns_if_dark
@band_after_band(OF_AN_ESTIMATE)
def path_radiance(
    scene: Scene,
    origin: ArrayLike,
    along: ArrayLike,
    *,
    key: PRNGKeyArray,
    paths: int,
    bounces: int | None = None,
    on: ArrayLike = -1,
    next_event: bool = True,
    survival: float = SURVIVAL,
    scatter: Scatter = scattering.scatter,
    lanes: int | None = None,
) -> Estimate:
    """Radiance that comes to a point against a direction, by path tracing.

    Args:
        scene: what shines and reflects.
        origin: where the rays start, shape (..., 2) [m].
        along: unit vectors to where the light comes from, of the same shape.
        key: of JAX.
        paths: for each ray, two or more.
        bounces: the most reflections of a path; None for any number.
        on: shape on which each ray starts, -1 for none.
        next_event: as in `path_irradiance`.
        survival: as in `path_irradiance`.
        scatter: what surfaces do.
        lanes: for each ray.

    Returns:
        Mean, standard error and number of paths, for each ray, bands last [W/(m rad)].

    Raises:
        ValueError: if there are fewer than two paths, or a number is out of its range.

    Reference: J12 §4.3, eq. 29.

    Example:
        >>> import jax
        >>> import jax.numpy as jnp
        >>> from firstorder.flatland.bounces import path_radiance
        >>> from firstorder.flatland.library import scene_a
        >>> ray = jnp.array([0.0, 0.5]), jnp.array([0.0, 1.0])
        >>> path_radiance(scene_a(), *ray, key=jax.random.key(0), paths=2).mean.item()  # the lamp's
        1.0
    """
    check_kind("scene", scene, Scene)
    origin, along = numbers("origin", origin), numbers("along", along)
    one = jnp.ones(along.shape[:-1], along.dtype)
    # A mirror across the ray sends it straight on.
    tangent = jnp.stack([along[..., 1], -along[..., 0]], -1)
    on = jnp.broadcast_to(jnp.asarray(on), one.shape)
    start = Vertex(origin, tangent, 0.0 * one, one, _sensor(one, mirror=1.0), on)
    plan = _plan(scene, bounces, next_event, survival, scatter)
    return _paths(scene, start, key, paths, lanes, plan)


@warns_if_dark
@band_after_band(OF_AN_ESTIMATE)
def tree_irradiance(
    scene: Scene,
    at: Receiver,
    *,
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

    Returns:
        Mean, standard error and number of runs, for each receiver [W/m].

    Raises:
        ValueError: if there is no branch or there are fewer than two runs.

    Reference: J12 §4.2, eq. 28.

    Example:
        >>> import jax
        >>> from firstorder.flatland import irradiance, receiver
        >>> from firstorder.flatland.bounces import tree_irradiance
        >>> from firstorder.flatland.library import scene_a
        >>> floor = receiver(scene_a(), 0, 0.5)
        >>> E = tree_irradiance(scene_a(), floor, key=jax.random.key(0), branches=(64,), runs=16)
        >>> bool(abs(E.z(irradiance(scene_a(), floor))) < 4.0)
        True
    """
    check_asked(scene, Scene, at, Receiver)
    for count in branches:
        check_integer("branches", count)
    if not branches or min(branches) < 1:
        raise ValueError(f"Argument `branches` must hold positive numbers, but is {branches}.")
    check_many("runs", runs)
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


def _paths(scene, start: Vertex, key, paths: int, lanes: int | None, plan: Plan) -> Estimate:
    """Checks, and one row of receivers."""
    check_many("paths", paths)
    shape = start.sine.shape
    start = jax.tree.map(lambda a: a.reshape(-1, *a.shape[len(shape) :]), start)
    rows = start.sine.shape[0]
    lanes = lanes_for(rows, paths, lanes)
    # How many paths is no part of the program: it is compiled once for all numbers.
    mean, error = _traced(scene, start, key, jnp.asarray(paths), lanes, plan)
    return Estimate(mean.reshape(shape), error.reshape(shape), paths)


@eqx.filter_jit
def _traced(scene: Scene, start: Vertex, key, paths, lanes: int, plan: Plan):
    """All paths of all receivers."""
    scene, start = jax.lax.stop_gradient((scene, start))
    where = lights(scene, 1.0, plan.next_event, plan.next_event)
    start = _before(start, where)

    def advance(here: Vertex, weight, depth, u) -> Gathered:
        return _advance(scene, where, plan, here, weight, depth, u)

    return walk(start, key, paths, lanes, NUMBERS, advance)


def _advance(scene, where: Lights, plan: Plan, here: Vertex, weight, depth, u) -> Gathered:
    """One vertex of every path: sample a light, go on, and add what the ray meets."""
    chance = survival_chance(here.surface.total, depth, plan.length)
    # The chance belongs to the density with which the path's own direction is drawn.
    value = weight * sampled_light(scene, where, here, u[:, 3:], chance, plan)
    on, heavier, again = roulette(u[:, 0], chance)
    u = u.at[:, 0].set(again)
    turned = plan.scatter(here.surface, (here.sine, here.cosine), u[:, :3], plan.glossy)
    along = plane_direction(here, turned)
    weight = weight * turned.weight * heavier
    on = on & (weight > 0.0)
    met = meet(scene, where, here.position, here.on, along, plan)
    drawn = turned.density * chance
    share = drawn / jnp.where(drawn > 0.0, drawn + met.density, 1.0)
    share = jnp.where(turned.delta, 1.0, share)
    value = value + jnp.where(on, weight * share * met.radiance, 0.0)
    on = on & met.there & (met.vertex.surface.total > 0.0) & (depth < plan.length.bounces)
    return Gathered(met.vertex, weight, value, on)


# --- trees ---------------------------------------------------------------------------------------


@eqx.filter_jit
def _trees(scene: Scene, start: Vertex, key, branches: tuple[int, ...], runs: int, glossy: bool):
    """All runs, one after the other."""
    scene, start = jax.lax.stop_gradient((scene, start))
    where = lights(scene, 1.0, 0.0, 0.0)
    start = _before(start, where)
    plan = Plan(path_lengths(0, SURVIVAL), jnp.array(0.0), glossy, scattering.scatter)

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
    length = path_lengths(bounces, survival)
    # A number, not a choice: one compiled program serves both.
    return Plan(length, jnp.asarray(float(next_event)), has_gloss(scene), scatter)


def _before(start: Vertex, where: Lights) -> Vertex:
    """Vertices on shapes, a step before them as all that are met."""
    step = jnp.where(start.on >= 0, where.step, 0.0)
    return start._replace(position=start.position + step[:, None] * left(start.tangent))


def _sensor(like: Array, albedo: float = 0.0, mirror: float = 0.0) -> Surface:
    zero = jnp.zeros_like(like)
    return Surface(zero + albedo, zero + mirror, zero, zero, zero)
