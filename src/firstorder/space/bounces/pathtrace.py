r"""Path tracing in space: light after any number of bounces, the brute-force reference.

    E ~ (1/N) sum over paths of prod_j f cos / pdf  L_e                           (J12 eqs. 28, 29)

At every vertex one light is sampled (next-event estimation), and the path's own direction meets
lights by chance; both are weighted by their densities (balance heuristic). Planes that shine, and
the sky, are met by chance only. A path of any number of bounces ends by
Russian roulette; where `bounces` is given there is none, so that every path is followed to the
same depth. Lanes, random numbers and how receivers spread over devices are flatland's
(`firstorder.flatland.bounces.pathtrace`).

No silhouette, contour or derivative is used here, which is what makes it a reference. It has no
gradients: paths jump.
"""

from __future__ import annotations

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Float, PRNGKeyArray

from firstorder._argument_checks import check_unit
from firstorder.numerics._vectors import dot, norm
from firstorder.sampling._paths import (
    SURVIVAL,
    Gathered,
    Lengths,
    check_many,
    lanes_for,
    path_lengths,
    roulette,
    survival_chance,
    walk,
)
from firstorder.sampling.estimates import Estimate
from firstorder.scene._arguments import check_asked, check_kind, numbers
from firstorder.scene._bands import OF_AN_ESTIMATE, band_after_band
from firstorder.scene._questions import warns_if_dark
from firstorder.space.bounces._surface_points import area_density, point_on
from firstorder.space.bounces._vertices import Rows, Vertex, brdf, meet, scattered, step, unmet
from firstorder.space.intersect import occluded
from firstorder.space.receiver import Receiver
from firstorder.space.scene import BACK, FRONT, Scene
from firstorder.space.shapes.kinds import Planes

NUMBERS = 6  # uniform numbers in a step: roulette and lobe, two for a direction, three for a light

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
        bounces: the most reflections of a path, 0 for direct light; None for any number.
        next_event: whether lights are sampled at every vertex; False leaves emitters to chance.
        survival: the most that roulette lets go on; below it a path goes on with the share that
            the surface reflects. Roulette ends paths only where `bounces` is None.
        lanes: for each receiver; more is faster until the cache is full.

    Returns:
        Mean, standard error and number of paths, for each receiver, bands last [W/m^2].

    Raises:
        ValueError: if there are fewer than two paths, bounces are negative or `survival` is not in
            (0, 1).

    Reference: J12 §4.3, eq. 29, in space.

    Example:
        >>> import jax
        >>> from firstorder.space import receiver
        >>> from firstorder.space import irradiance
        >>> from firstorder.space.library import j12_box
        >>> from firstorder.space.bounces import path_irradiance
        >>> scene, at = j12_box(), receiver((0.5, 0.5, 0.0), on=0)
        >>> E = path_irradiance(scene, at, key=jax.random.key(0), paths=4096, bounces=0)
        >>> bool(abs(E.z(irradiance(scene, at))) < 4)
        True
    """
    check_asked(scene, Scene, at, Receiver)
    shape = at.on.shape
    position, normal = at.position.reshape(-1, 3), at.normal.reshape(-1, 3)
    one = jnp.ones(position.shape[0], position.dtype)
    on = jnp.asarray(at.on).reshape(-1)
    start = Vertex(position, normal, on, 0.0 * position, jnp.pi * one, 0.0 * one, 0.0 * one, on)
    mean, error = _paths(
        scene, start, key, paths, lanes, path_lengths(bounces, survival), next_event
    )
    return Estimate(mean.reshape(shape), error.reshape(shape), paths)


@warns_if_dark
@band_after_band(OF_AN_ESTIMATE)
def path_radiance(
    scene: Scene,
    origin: Float[ArrayLike, "*r 3"],
    along: Float[ArrayLike, "*r 3"],
    *,
    key: PRNGKeyArray,
    paths: int,
    bounces: int | None = None,
    next_event: bool = True,
    survival: float = SURVIVAL,
    lanes: int | None = None,
) -> Estimate:
    """Radiance that comes to a point against a direction, by path tracing.

    Args:
        scene: what shines and reflects.
        origin: where the rays start [m].
        along: unit vectors to where the light comes from.
        key: of JAX.
        paths: for each ray, two or more.
        bounces: the most reflections of a path, 0 for what is emitted alone; None for any number.
        next_event: as in `path_irradiance`.
        survival: as in `path_irradiance`.
        lanes: for each ray.

    Returns:
        Mean, standard error and number of paths, for each ray, bands last [W/(m^2 sr)].

    Raises:
        ValueError: as in `path_irradiance`, and if a direction is no unit vector.

    Reference: J12 §4.3, eq. 29, in space.

    Example:
        >>> import jax
        >>> import jax.numpy as jnp
        >>> from firstorder.space.bounces import path_radiance
        >>> from firstorder.space.library import j12_box
        >>> up, key = (jnp.full(3, 0.5), jnp.array([0.0, 0.0, 1.0])), jax.random.key(0)
        >>> path_radiance(j12_box(), *up, key=key, paths=2, bounces=0).mean.item()  # the light
        1.0
    """
    check_kind("scene", scene, Scene)
    check_many("paths", paths)
    path_lengths(bounces, survival)  # refuses numbers that would be told less one below
    origin, along = numbers("origin", origin), numbers("along", along)
    check_unit("along", along)
    shape = along.shape[:-1]
    origin = jnp.broadcast_to(origin, along.shape).reshape(-1, 3)
    along = along.reshape(-1, 3)
    start, emitted = _first(scene, origin, along)
    if bounces == 0:
        emitted = emitted.reshape(shape)
        return Estimate(emitted, jnp.zeros_like(emitted), paths)
    length = path_lengths(None if bounces is None else bounces - 1, survival)
    mean, error = _paths(scene, start, key, paths, lanes, length, next_event)
    return Estimate((mean + emitted).reshape(shape), error.reshape(shape), paths)


# --- paths ---------------------------------------------------------------------------------------


@eqx.filter_jit
def _first(scene: Scene, origin: Rows, along: Rows) -> tuple[Vertex, Array]:
    """Where rays arrive, and what is emitted there; a ray that meets nothing reflects nothing."""
    vertex, there, L = meet(scene, origin, along, jnp.full(along.shape[0], -1))
    albedo, specular = (jnp.where(there, a, 0.0) for a in (vertex.albedo, vertex.specular))
    return vertex._replace(albedo=albedo, specular=specular), L


def _paths(scene, start: Vertex, key, paths: int, lanes: int | None, length: Lengths, next_event):
    """Checks, and one row of first vertices."""
    check_many("paths", paths)
    lanes = lanes_for(start.on.shape[0], paths, lanes)
    lights = _lights(scene) if next_event else ()
    # How many paths is no part of the program: it is compiled once for all numbers.
    return _traced(scene, start, key, jnp.asarray(paths), lanes, length, lights)


@eqx.filter_jit
def _traced(scene: Scene, start: Vertex, key, paths, lanes: int, length: Lengths, lights):
    """All paths of all rows."""
    scene, start = jax.lax.stop_gradient((scene, start))
    back = dot(jax.vmap(scene.normal)(jnp.maximum(start.on, 0), start.position), start.normal) < 0.0
    before = start.position + step(scene, start.position) * start.normal
    start = start._replace(position=before, own=unmet(scene, start.on, back))

    def advance(here: Vertex, weight, depth, u) -> Gathered:
        return _advance(scene, lights, length, here, weight, depth, u)

    return walk(start, key, paths, lanes, NUMBERS, advance)


def _advance(scene, lights, length: Lengths, here: Vertex, weight, depth, u) -> Gathered:
    """One vertex of every path: sample a light, go on, and add what the ray meets."""
    chance = survival_chance(here.albedo + here.specular, depth, length)
    # The chance belongs to the density with which the path's own direction is drawn.
    value = weight * _sampled(scene, here, u[:, 3:], chance, lights)
    on, heavier, again = roulette(u[:, 0], chance)
    along, factor, density = scattered(here, u.at[:, 0].set(again)[:, :3])
    met, there, L = meet(scene, here.position, along, here.own)
    other = _light_density(scene, here.position, met, there, lights)
    drawn = density * chance
    share = drawn / jnp.where(drawn > 0.0, drawn + other, 1.0)
    weight = weight * factor * heavier
    on = on & (weight > 0.0)
    value = value + jnp.where(on, weight * share * L, 0.0)
    on = on & there & (met.albedo + met.specular > 0.0) & (depth < length.bounces)
    return Gathered(met, weight, value, on)


# --- lights --------------------------------------------------------------------------------------


def _lights(scene: Scene) -> tuple[int, ...]:
    """Shapes that shine and whose surface can be sampled: all but planes."""
    bright = np.any(np.asarray(scene.material.emission) > 0.0, -1)
    endless = [isinstance(group, Planes) for group in scene.groups for _ in range(group.count)]
    return tuple(i for i, without_end in enumerate(endless) if bright[i] and not without_end)


def _light_density(scene, origin: Rows, met: Vertex, there, lights) -> Array:
    """Density by solid angle with which light sampling draws the direction of a hit."""
    if not lights:
        return jnp.zeros_like(met.albedo)
    sampled = jnp.any(met.on[:, None] == jnp.asarray(lights), -1) & there
    way = met.position - origin
    square = jnp.maximum(dot(way, way), jnp.finfo(way.dtype).tiny)
    cosine = jnp.abs(dot(met.normal, met.back))
    area = area_density(scene, jnp.maximum(met.on, 0), met.normal) / len(lights)
    return jnp.where(sampled, area * square / jnp.where(cosine > 0.0, cosine, 1.0), 0.0)


def _sampled(scene: Scene, here: Vertex, u: Float[Array, "n 3"], survival, lights) -> Array:
    """Light from one sampled point of one light, weighted against meeting it by chance."""
    if not lights:
        return jnp.zeros_like(here.albedo)
    pick = jnp.minimum((u[:, 0] * len(lights)).astype(jnp.int32), len(lights) - 1)
    index = jnp.asarray(lights, jnp.int32)[pick]
    point, normal = jax.vmap(lambda i, u: scene.ask(i, lambda s: point_on(s, u)))(index, u[:, 1:])
    way = point - here.position
    length = norm(way)
    along = way / jnp.where(length > 0.0, length, 1.0)[:, None]
    value, chance = brdf(here, along)
    cosine = -dot(normal, along)
    side = jnp.where(cosine > 0.0, FRONT, BACK)
    L = scene.material.emission[index, side]
    area = area_density(scene, index, normal) / len(lights)
    cosine = jnp.abs(cosine)
    density = area * length**2 / jnp.where(cosine > 0.0, cosine, 1.0)
    hidden = occluded(scene, here.position, point, here.own, index)
    # A closed light hides its far side from outside.
    total = density + survival * chance
    good = ~hidden & (cosine > 0.0) & (total > 0.0) & (index != here.own)
    return jnp.where(good, value * L / jnp.where(total > 0.0, total, 1.0), 0.0)
