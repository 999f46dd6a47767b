"""Photons of space: flux sent from the lamps and followed until it is absorbed."""

from __future__ import annotations

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float, Int, PRNGKeyArray

from firstorder._argument_checks import check_positive, is_concrete
from firstorder.conventions import cylindrical
from firstorder.numerics._vectors import matvec, orthonormal_frame
from firstorder.sampling._distributions import Discrete
from firstorder.sampling._paths import SURVIVAL, Arrived, follow_photons, path_lengths
from firstorder.scene._bands import check_one_band
from firstorder.scene._questions import check_shines
from firstorder.space.bounces._surface_points import area_density, point_on
from firstorder.space.bounces._vertices import Vertex, meet, scattered
from firstorder.space.scene import BACK, FRONT, Scene
from firstorder.space.shapes.kinds import Planes

LATTICE = 8  # points along each side of the square by which a lamp's area is found


class Photons(eqx.Module):
    """Photons where they landed, in the order of their reflections.

    Attributes:
        index: number of the shape, -1 where a photon ended before.
        front: whether they landed on its front.
        position: [m].
        flux: what each carries; 0 where there is none [W].
        back: unit vector to where they came from.
    """

    index: Int[Array, "*b n"]
    front: Bool[Array, "*b n"]
    position: Float[Array, "*b n 3"]
    flux: Float[Array, "*b n"]
    back: Float[Array, "*b n 3"]


def trace_photons(
    scene: Scene,
    key: PRNGKeyArray,
    count: int,
    bounces: int = 16,
    *,
    survival: float = SURVIVAL,
) -> Photons:
    """Sends photons from all lamps, each lamp by its flux, and follows them.

    A side of radiance L sends `pi L` from each square metre, by the cosine. Photons are reflected
    by Russian roulette, so that each keeps its flux. Light that would go on after `bounces`
    reflections is lost: a share of `survival^bounces` at most.

    Valid for lamps of finite size: neither the sky nor a plane that shines sends photons.

    Args:
        scene: what shines and reflects.
        key: of JAX.
        count: photons sent.
        bounces: the most reflections.
        survival: the most that roulette lets go on.

    Raises:
        ValueError: if there is no photon, bounces are negative, `survival` is not in (0, 1), or
            light comes from a sky or a plane.

    Reference: Jensen 2001; J12 §4.4.

    Example:
        >>> import jax
        >>> from firstorder.space.bounces.photons import trace_photons
        >>> from firstorder.space.library import j12_box
        >>> photons = trace_photons(j12_box(), jax.random.key(0), 1000, 2)
        >>> photons.position.shape  # the first landing, and those after two reflections
        (3, 1000, 3)
    """
    check_positive("count", count)
    check_one_band("scene", scene)
    check_shines(scene)
    _check_lamps(scene)
    length = path_lengths(bounces, survival)
    return _thrown(scene, key, count, bounces, length.survival)


def _check_lamps(scene: Scene) -> None:
    """Refuses light that no photon can carry; a traced scene is not looked at.

    Raises:
        ValueError: if a sky or a plane shines.
    """
    shines = callable(scene.environment) or (
        is_concrete(scene.environment) and np.any(np.asarray(scene.environment) > 0.0)
    )
    if shines:
        raise ValueError("Argument `scene` must be lit by its shapes: a sky sends no photons.")
    bright, endless = scene.material.emission, _endless(scene)
    if is_concrete(bright) and np.any(np.asarray(bright)[endless] > 0.0):
        raise ValueError("Argument `scene` must have lamps with an end, but a plane shines.")


def _endless(scene: Scene) -> np.ndarray:
    """Which shapes are planes."""
    kinds = [isinstance(group, Planes) for group in scene.groups for _ in range(group.count)]
    return np.array(kinds)


@eqx.filter_jit
def _thrown(scene: Scene, key, count: int, bounces: int, survival) -> Photons:
    """One photon in each lane."""
    scene = jax.lax.stop_gradient(scene)
    first, later = jax.random.split(key)
    *rays, flux = _sent(scene, jax.random.uniform(first, (count, 5), scene.material.emission.dtype))

    def arrive(ray) -> Arrived:
        origin, along, on = ray
        v, there, _ = meet(scene, origin, along, on)
        front = jnp.sum(jax.vmap(scene.normal)(v.on, v.position) * v.normal, -1) > 0.0
        return Arrived(v, (v.on, front, v.position, v.back), there, v.albedo + v.specular)

    def go_on(v: Vertex, u):
        along, weight, _ = scattered(v, u)
        return (v.position, along, v.on), weight

    keys = jax.random.split(later, bounces + 1)
    (index, front, position, back), landed, flux = follow_photons(
        tuple(rays), flux, keys, 3, survival, arrive, go_on
    )
    return Photons(jnp.where(landed, index, -1), front, position, flux, back)


def _sent(scene: Scene, u: Float[Array, "n 5"]):
    """Places, directions, own shapes and fluxes of new photons."""
    emission = scene.material.emission.T.ravel()  # all fronts, then all backs
    power = emission * jnp.tile(_areas(scene), 2)
    pick = Discrete(power)
    number, _ = pick.sample(u[:, 0])
    on, side = number % scene.count, jnp.where(number < scene.count, FRONT, BACK)
    place, normal = jax.vmap(lambda i, u: scene.ask(i, lambda s: point_on(s, u)))(on, u[:, 1:3])
    density = area_density(scene, on, normal) * pick.probability[number]
    outward = jnp.where(side == FRONT, 1.0, -1.0)[:, None] * normal
    rho = jnp.sqrt(u[:, 3])
    local = cylindrical(rho, 2.0 * jnp.pi * u[:, 4], jnp.sqrt(1.0 - u[:, 3]))
    along = matvec(orthonormal_frame(outward), local)
    sent = jnp.pi * emission[number] / jnp.where(density > 0.0, density, 1.0) / u.shape[0]
    return place, along, on.astype(jnp.int32), jnp.where(density > 0.0, sent, 0.0)


def _areas(scene: Scene) -> Float[Array, " n"]:
    """Surface of each shape, by which lamps are picked [m^2]; of an ellipsoid nearly, else exact.

    What the pick is off by is made up for by the flux of each photon.
    """
    middles = (np.arange(LATTICE) + 0.5) / LATTICE
    u = jnp.asarray(np.stack(np.meshgrid(middles, middles), -1).reshape(-1, 2))
    u = u.astype(scene.material.emission.dtype)

    def area(index):
        _, normal = jax.vmap(lambda u: scene.ask(index, lambda s: point_on(s, u)))(u)
        density = area_density(scene, jnp.full(u.shape[0], index), normal)
        return jnp.mean(1.0 / density)

    areas = jax.vmap(area)(jnp.arange(scene.count))
    return jnp.where(jnp.asarray(_endless(scene)), 0.0, areas)
