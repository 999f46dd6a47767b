"""Photons of flatland: flux sent from the lights and followed until it is absorbed."""

from __future__ import annotations

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float, Int, PRNGKeyArray

from firstorder._argument_checks import check_count, check_integer
from firstorder._display import Module
from firstorder.conventions import direction
from firstorder.flatland.bounces import _scatter as scattering
from firstorder.flatland.bounces._light_sampling import Lights, lengths, lights
from firstorder.flatland.bounces._vertices import (
    Plan,
    Scatter,
    Vertex,
    has_gloss,
    meet,
    plane_direction,
)
from firstorder.flatland.intersect import occluded
from firstorder.flatland.scene import Scene
from firstorder.numerics._planar import dot_2d, left
from firstorder.sampling._distributions import CosineDirections
from firstorder.sampling._paths import SURVIVAL, Arrived, follow_photons, path_lengths
from firstorder.scene._bands import check_one_band
from firstorder.scene._primitives import BACK, FRONT
from firstorder.scene._questions import check_shines


class Photons(Module):
    """Photons where they landed, in the order of their reflections.

    Attributes:
        index: number of the shape, -1 where a photon ended before.
        front: whether they landed on its front.
        s: the parameter on it.
        flux: what each carries; 0 where there is none [W].
        sine, cosine: of the local angle from which they came, on the side on which they landed.
    """

    index: Int[Array, "*b n"]
    front: Bool[Array, "*b n"]
    s: Float[Array, "*b n"]
    flux: Float[Array, "*b n"]
    sine: Float[Array, "*b n"]
    cosine: Float[Array, "*b n"]


def trace_photons(
    scene: Scene,
    key: PRNGKeyArray,
    count: int,
    bounces: int = 16,
    *,
    survival: float = SURVIVAL,
    scatter: Scatter = scattering.scatter,
) -> Photons:
    """Sends photons from all lights, each light by its flux, and follows them.

    They are reflected by Russian roulette, so that each keeps its flux. Light that would go on
    after `bounces` reflections is lost: a share of `survival^bounces` at most.

    Args:
        scene: what shines and reflects.
        key: of JAX.
        count: photons sent.
        bounces: the most reflections.
        survival: the most that roulette lets go on.
        scatter: what surfaces do.

    Raises:
        ValueError: if there is no photon, bounces are negative or `survival` is not in (0, 1).

    Reference: J12 §4.4.

    Example:
        >>> import jax
        >>> from firstorder.flatland.library import scene_c
        >>> from firstorder.flatland.bounces import trace_photons
        >>> photons = trace_photons(scene_c(), jax.random.key(0), 1000, 2)
        >>> round(photons.flux[0].sum().item(), 6)  # all that the light sends arrives
        6.283185
    """
    check_count("count", count)
    check_one_band("scene", scene)
    check_shines(scene)
    plan = Plan(path_lengths(bounces, survival), jnp.array(0.0), has_gloss(scene), scatter)
    return _thrown(scene, key, count, bounces, plan)


def split_photons(photons: Photons, runs: int) -> list[Photons]:
    """Photons split into several independent sets of equal size, each as bright as the whole.

    Raises:
        ValueError: if the photons cannot be shared out evenly.

    Example:
        >>> import jax
        >>> from firstorder.flatland.library import scene_c
        >>> from firstorder.flatland.bounces import split_photons, trace_photons
        >>> two = split_photons(trace_photons(scene_c(), jax.random.key(0), 1000, 2), 2)
        >>> two[1].flux.shape, round(two[1].flux[0].sum().item(), 6)
        ((3, 500), 6.283185)
    """
    count = photons.index.shape[-1]
    check_integer("runs", runs)
    if runs < 1 or count % runs:
        raise ValueError(f"Argument `runs` must divide {count} photons, but is {runs}.")
    # On the host: a slice of its own for each run would be compiled for each.
    parts = [np.split(np.asarray(leaf), runs, axis=-1) for leaf in jax.tree.leaves(photons)]
    whole = jax.tree.structure(photons)
    each = [
        jax.tree.unflatten(whole, [jnp.asarray(leaf) for leaf in run])
        for run in zip(*parts, strict=True)
    ]
    return [eqx.tree_at(lambda p: p.flux, run, runs * run.flux) for run in each]


@eqx.filter_jit
def _thrown(scene: Scene, key, count: int, bounces: int, plan: Plan) -> Photons:
    """One photon in each lane; a scan over reflections."""
    scene = jax.lax.stop_gradient(scene)
    where = lights(scene)
    first, later = jax.random.split(key)
    dtype = where.radius.dtype
    place, along, flux, on = _sent(scene, where, jax.random.uniform(first, (count, 4), dtype))

    def arrive(ray) -> Arrived:
        met = meet(scene, where, *ray, plan)
        v = met.vertex
        return Arrived(v, (v.on, met.front, met.s, v.sine, v.cosine), met.there, v.surface.total)

    def go_on(v: Vertex, u):
        turned = plan.scatter(v.surface, (v.sine, v.cosine), u, plan.glossy)
        return (v.position, v.on, plane_direction(v, turned)), turned.weight

    keys = jax.random.split(later, bounces + 1)
    (index, *rest), landed, flux = follow_photons(
        (place, on, along), flux, keys, 3, plan.length.survival, arrive, go_on
    )
    front, s, sine, cosine = rest
    return Photons(jnp.where(landed, index, -1), front, s, flux, sine, cosine)


def _sent(scene: Scene, where: Lights, u: Array):
    """Places, directions, fluxes and own shapes of new photons."""
    count, n, p = u.shape[0], scene.count, scene.points.intensity.shape[0]
    number, rest = where.pick.sample(u[:, 0])
    each = jnp.sum(where.flux) / count
    flux = jnp.broadcast_to(each, (count,))

    # --- shapes: evenly in the parameter, by the cosine about the side's normal
    side = jnp.where(number - p >= n, BACK, FRONT)
    shape = jnp.clip(number - p - n * side, 0, n - 1)
    place, v, _ = jax.vmap(scene.motion)(shape, u[:, 1])
    speed = jnp.sqrt(dot_2d(v, v))
    tangent = v / speed[:, None] * jnp.where(side == FRONT, 1.0, -1.0)[:, None]
    turned = CosineDirections().sample(u[:, 2])
    sine, cosine = jnp.sin(turned), jnp.cos(turned)
    along = cosine[:, None] * left(tangent) - sine[:, None] * tangent
    length = lengths(scene)[shape]
    from_shape = (number >= p) & (number < p + 2 * n)
    before = place + where.step * left(tangent)
    # Of several lamps in one place the one that is seen sends.
    hidden = occluded(scene, before, place, -1, shape)
    flux = jnp.where(from_shape, jnp.where(hidden, 0.0, flux * speed / length), flux)
    place = before
    on = jnp.where(from_shape, shape, -1).astype(jnp.int32)

    # --- points: all directions alike
    if p:
        point = number < p
        here = scene.points.position[jnp.minimum(number, p - 1)].astype(place.dtype)
        place = jnp.where(point[:, None], here, place)
        along = jnp.where(point[:, None], direction(2.0 * jnp.pi * u[:, 2]), along)

    # --- sky: through a chord across the circle around the scene
    if scene.environment is not None:
        far = number >= p + 2 * n
        angle = where.sky.sample(rest)
        d, offset = direction(angle), 2.0 * u[:, 1] - 1.0
        start = where.center + where.radius * (1.5 * d + offset[:, None] * left(d))
        chance = where.pick.probability[-1] * where.sky.density(angle) * count
        sky = jax.vmap(scene.environment)(angle) * 2.0 * where.radius
        place = jnp.where(far[:, None], start, place)
        along = jnp.where(far[:, None], -d, along)
        flux = jnp.where(far, sky / jnp.where(far, chance, 1.0), flux)
    return place, along, flux, on
