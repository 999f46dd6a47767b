"""Photons of space: flux sent from lamps and sky and followed until it is absorbed."""

from __future__ import annotations

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float, Int, PRNGKeyArray

from firstorder._argument_checks import check_count, is_concrete
from firstorder.conventions import cylindrical
from firstorder.numerics._vectors import matvec, norm, orthonormal_frame
from firstorder.sampling._distributions import Discrete
from firstorder.sampling._paths import SURVIVAL, Arrived, follow_photons, path_lengths
from firstorder.scene._bands import check_one_band
from firstorder.scene._questions import check_shines
from firstorder.space.bounces._surface_points import area_density, on_ball, point_on
from firstorder.space.bounces._vertices import Vertex, meet, scattered, step, unmet
from firstorder.space.intersect import occluded
from firstorder.space.scene import BACK, FRONT, Scene
from firstorder.space.shapes.kinds import Planes

LATTICE = 8  # points along each side of the square by which a lamp's area is found
SKY_CELLS = 32  # along each side of the sky, of which the brighter send more photons


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
    """Sends photons from all lamps and from the sky, each by its flux, and follows them.

    A side of radiance L sends `pi L` from each square metre, by the cosine. The sky sends `L pi
    R^2` from each solid angle, over the disc that a ball of radius R around all shapes shows to it;
    most of that may miss them. Photons are reflected by Russian roulette, so that each keeps its
    flux. Light that would go on after `bounces` reflections is lost: a share of `survival^bounces`
    at most.

    Valid for lamps of finite size: no plane that shines sends photons, and the sky sends none into
    a scene that holds a plane, which no ball surrounds.

    Args:
        scene: what shines and reflects.
        key: of JAX.
        count: photons sent.
        bounces: the most reflections.
        survival: the most that roulette lets go on.

    Raises:
        ValueError: if there is no photon, bounces are negative, `survival` is not in (0, 1), a
            plane shines, or the sky shines on a plane.

    Reference: Jensen 2001; J12 §4.4.

    Example:
        >>> import jax
        >>> from firstorder.space.bounces import trace_photons
        >>> from firstorder.space.library import j12_box
        >>> photons = trace_photons(j12_box(), jax.random.key(0), 1000, 2)
        >>> photons.position.shape  # the first landing, and those after two reflections
        (3, 1000, 3)
    """
    check_count("count", count)
    check_one_band("scene", scene)
    check_shines(scene)
    _check_lamps(scene)
    length = path_lengths(bounces, survival)
    return _thrown(scene, key, count, bounces, length.survival)


def _check_lamps(scene: Scene) -> None:
    """Refuses light that no photon can carry; a traced scene is not looked at.

    Raises:
        ValueError: if a plane shines, or a sky over a plane.
    """
    bright, endless = scene.material.emission, _endless(scene)
    if is_concrete(bright) and np.any(np.asarray(bright)[endless] > 0.0):
        raise ValueError("Argument `scene` must have lamps with an end, but a plane shines.")
    shines = callable(scene.environment) or (
        is_concrete(scene.environment) and np.any(np.asarray(scene.environment) > 0.0)
    )
    if shines and np.any(endless):
        raise ValueError(
            "Argument `scene` must hold no plane under a sky, for photons start around all shapes: "
            "a large rectangle does."
        )


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
        return (v.position, along, v.own), weight

    keys = jax.random.split(later, bounces + 1)
    (index, front, position, back), landed, flux = follow_photons(
        tuple(rays), flux, keys, 3, survival, arrive, go_on
    )
    return Photons(jnp.where(landed, index, -1), front, position, flux, back)


def _sent(scene: Scene, u: Float[Array, "n 5"]):
    """Places, directions, own shapes and fluxes of new photons."""
    emission = scene.material.emission.T.ravel()  # all fronts, then all backs
    ball = _ball(scene)
    lamps = jnp.pi * emission * jnp.tile(_areas(scene), 2)
    pick = Discrete(jnp.concatenate([lamps, _sky_fluxes(scene, ball[1], jnp.sum(lamps))]))
    number, _ = pick.sample(u[:, 0])
    chance, of_sky = pick.probability[number], number >= len(lamps)
    place, along, flux, own = _from_shapes(scene, jnp.minimum(number, len(lamps) - 1), u[:, 1:])
    beyond, down, light = _from_sky(scene, ball, jnp.maximum(number - len(lamps), 0), u[:, 1:])
    place = jnp.where(of_sky[:, None], beyond, place)
    along = jnp.where(of_sky[:, None], down, along)
    sent = jnp.where(of_sky, light, flux) / jnp.where(chance > 0.0, chance, 1.0) / u.shape[0]
    on = jnp.where(of_sky, -1, own).astype(jnp.int32)
    return place, along, on, jnp.where(chance > 0.0, sent, 0.0)


def _from_shapes(scene: Scene, number: Int[Array, " n"], u: Float[Array, "n 4"]):
    """Places on the sides of these numbers, directions by the cosine, flux over density, `own`."""
    emission = scene.material.emission.T.ravel()
    on, side = number % scene.count, jnp.where(number < scene.count, FRONT, BACK)
    place, normal = jax.vmap(lambda i, u: scene.ask(i, lambda s: point_on(s, u)))(on, u[:, :2])
    density = area_density(scene, on, normal)
    outward = jnp.where(side == FRONT, 1.0, -1.0)[:, None] * normal
    before = place + step(scene) * outward
    # Of several lamps in one place the one that is seen sends.
    sends = (density > 0.0) & ~occluded(scene, before, place, -1, on)
    own = unmet(scene, on, side == BACK)
    rho = jnp.sqrt(u[:, 2])
    local = cylindrical(rho, 2.0 * jnp.pi * u[:, 3], jnp.sqrt(1.0 - u[:, 2]))
    along = matvec(orthonormal_frame(outward), local)
    sent = jnp.pi * emission[number] / jnp.where(density > 0.0, density, 1.0)
    return before, along, jnp.where(sends, sent, 0.0), own


def _from_sky(scene: Scene, ball: tuple[Array, Array], cell: Int[Array, " n"], u):
    """Places on the discs that a ball shows to directions of these cells of the sky; the same."""
    (middle, radius), side = ball, _cells(scene)
    row = jnp.stack([cell // side, cell % side], -1)
    sky = on_ball(((row + u[:, 2:]) / side).T)
    across = cylindrical(jnp.sqrt(u[:, 0]), 2.0 * jnp.pi * u[:, 1], jnp.ones_like(u[:, 0]))
    place = middle + radius * matvec(orthonormal_frame(sky), across)
    return place, -sky, 4.0 * jnp.pi**2 * radius**2 / side**2 * jax.vmap(scene.sky)(sky)


def _cells(scene: Scene) -> int:
    """Cells along each side of the sky: a number is as bright everywhere."""
    return SKY_CELLS if callable(scene.environment) else 1


def _sky_fluxes(scene: Scene, radius: Float[Array, ""], others: Float[Array, ""]) -> Array:
    """Flux from each cell of the sky, by the radiance in its middle and in those around.

    A sun that no middle meets must not be lost: a tenth of a function's photons go to all cells,
    and of all photons a tenth to the sky.
    """
    side = _cells(scene)
    L = jax.vmap(scene.sky)(on_ball(_lattice(scene, side).T))
    whole = 4.0 * jnp.pi**2 * radius**2
    if not callable(scene.environment):
        return whole * L
    # A cell that the rim of a sun passes has more light than its middle.
    rows = jnp.pad(L.reshape(side, side), ((1, 1), (0, 0)), mode="edge")
    around = [jnp.roll(rows[i : i + side], k, 1) for i in (0, 1, 2) for k in (-1, 0, 1)]
    flux = whole / side**2 * (0.5 * L + 0.5 * jnp.mean(jnp.stack(around), 0).ravel())
    least = jnp.maximum(0.1 * jnp.sum(flux), 0.1 * others) + jnp.finfo(flux.dtype).tiny
    return flux + least / side**2


def _ball(scene: Scene) -> tuple[Float[Array, "3"], Float[Array, ""]]:
    """Middle and radius of a ball around all shapes but planes, not the smallest."""
    center, reach = [], []
    for group in scene.groups:
        if not isinstance(group, Planes):
            axes = group.axes[..., : 3 if group.closed else 2]
            center.append(group.center)
            reach.append(jnp.sum(norm(jnp.swapaxes(axes, -1, -2)), -1))  # canonically in a cube
    if not center:
        return jnp.zeros(3), jnp.zeros(())
    center, reach = jnp.concatenate(center), jnp.concatenate(reach)
    low, high = center - reach[:, None], center + reach[:, None]
    middle = 0.5 * (jnp.min(low, 0) + jnp.max(high, 0))
    return middle, jnp.max(norm(center - middle) + reach)


def _areas(scene: Scene) -> Float[Array, " n"]:
    """Surface of each shape, by which lamps are picked [m^2]; of an ellipsoid nearly, else exact.

    What the pick is off by is made up for by the flux of each photon.
    """
    u = _lattice(scene, LATTICE)

    def area(index):
        _, normal = jax.vmap(lambda u: scene.ask(index, lambda s: point_on(s, u)))(u)
        density = area_density(scene, jnp.full(u.shape[0], index), normal)
        return jnp.mean(1.0 / density)

    areas = jax.vmap(area)(jnp.arange(scene.count))
    return jnp.where(jnp.asarray(_endless(scene)), 0.0, areas)


def _lattice(scene: Scene, side: int) -> Float[Array, "n 2"]:
    """Middles of the cells of the unit square in rows, in the scene's precision."""
    middles = (np.arange(side) + 0.5) / side
    u = np.stack(np.meshgrid(middles, middles, indexing="ij"), -1).reshape(-1, 2)
    return jnp.asarray(u, scene.material.emission.dtype)
