"""Photons of space: flux sent from lamps and sky and followed until it is absorbed."""

from __future__ import annotations

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float, Int, PRNGKeyArray

from firstorder._argument_checks import check_count, is_concrete, what
from firstorder._display import Module
from firstorder.conventions import cylindrical
from firstorder.numerics._vectors import dot, matvec, norm, orthonormal_frame
from firstorder.sampling._distributions import Discrete
from firstorder.sampling._paths import SURVIVAL, Arrived, follow_photons, path_lengths
from firstorder.scene._bands import check_one_band
from firstorder.scene._questions import check_shines
from firstorder.space.bounces._focus import Ball, aimed, spread
from firstorder.space.bounces._surface_points import area_density, on_ball, point_on
from firstorder.space.bounces._vertices import Rows, Vertex, meet, scattered, step, unmet
from firstorder.space.intersect import occluded
from firstorder.space.scene import BACK, FRONT, Scene
from firstorder.space.shapes.kinds import Ellipsoids, Planes

LATTICE = 8  # points along each side of the square by which a lamp's area is found
SKY_CELLS = 32  # along each side of the sky, of which the brighter send more photons


class Photons(Module):
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
    focus: Ellipsoids | None = None,
) -> Photons:
    """Sends photons from all lamps and from the sky, each by its flux, and follows them.

    A side of radiance L sends `pi L` from each square metre, by the cosine. The sky sends `L pi
    R^2` from each solid angle, over the disc that a ball of radius R around all shapes shows to it;
    most of that may miss them. Photons are reflected by Russian roulette, so that each keeps its
    flux. Light that would go on after `bounces` reflections is lost: a share of `survival^bounces`
    at most.

    A plane that shines, and a sky over a plane, have no end, and their power is infinite. Their
    photons are drawn with a density about a ball of radius R, the focus, and each weighs by it, at
    a distance d like `(d / R)^3`. None of their light is cut off: the flux that lands on a bounded
    piece of a surface is right on average, also after reflections, and its variance is finite. The
    derivation is in `space/bounces/_focus.py`.

    Valid when the places that matter lie in the focus: the relative variance grows like
    `(d / R)^3` too. Light that several planes send to each other comes with few heavy photons: ask
    with several keys, and do not trust an error bar of one of them. Both sides of a plane under a
    sky get photons.

    Args:
        scene: what shines and reflects.
        key: of JAX.
        count: photons sent.
        bounces: the most reflections.
        survival: the most that roulette lets go on.
        focus: a ball, by `sphere`, of the places that matter; None for one around all shapes but
            planes. It is asked for light without end alone.

    Raises:
        ValueError: if there is no photon, bounces are negative, `survival` is not in (0, 1), or
            light has no end, nor any shape, and there is no focus.
        TypeError: if the focus is no ball.

    Reference: Jensen 2001; J12 §4.4.

    Example:
        >>> import jax
        >>> from firstorder.space.bounces import trace_photons
        >>> from firstorder.space.library import j12_box
        >>> photons = trace_photons(j12_box(), jax.random.key(0), 1000, 2)
        >>> photons.position.shape  # the first landing, and those after two reflections
        (3, 1000, 3)

        A sky of radiance 1 gives the ground pi, and a square of 2 m four times that.

        >>> import jax.numpy as jnp
        >>> from firstorder.space import Scene, plane, primitive, sphere
        >>> ground = primitive(plane((0.0, 0.0, 0.0), (0.0, 0.0, 1.0)))
        >>> where, open_ = sphere((0.0, 0.0, 0.0), 2.0), Scene.of(ground, environment=1.0)
        >>> found = trace_photons(open_, jax.random.key(0), 100_000, 0, focus=where)
        >>> on = found.front & (jnp.abs(found.position[..., :2]) < 1.0).all(-1)
        >>> bool(abs(jnp.where(on, found.flux, 0.0).sum() / (4.0 * jnp.pi) - 1.0) < 0.05)
        True
    """
    check_count("count", count)
    check_one_band("scene", scene)
    check_shines(scene)
    ball = _focus(scene, focus)
    length = path_lengths(bounces, survival)
    return _thrown(scene, key, count, bounces, length.survival, ball)


def _focus(scene: Scene, focus: Ellipsoids | None) -> Ball | None:
    """Where photons of light without end are dense; None if there is no such light.

    Raises:
        ValueError: if it has to be told.
        TypeError: if it is no ball.
    """
    if focus is not None and not (isinstance(focus, Ellipsoids) and focus.count == 1):
        raise TypeError(f"Argument `focus` must be one ball, of `sphere`, but is {what(focus)}.")
    if not _shines_without_end(scene):
        return None
    if focus is not None:
        return Ball(focus.center[0], jnp.max(norm(focus.axes[0].T)))
    if np.all(_endless(scene)):
        raise ValueError(
            "Argument `focus` must say where photons are wanted, by `sphere`: light has no end "
            "here, and no shape has one either."
        )
    return _ball(scene)


def _shines_without_end(scene: Scene) -> bool:
    """Whether a plane shines, or a sky over a plane; a traced scene may."""
    endless, bright = _endless(scene), scene.material.emission
    if not np.any(endless) or not is_concrete(bright):
        return bool(np.any(endless))
    sky = scene.environment
    shines = callable(sky) or not is_concrete(sky) or bool(np.any(np.asarray(sky) > 0.0))
    return shines or bool(np.any(np.asarray(bright)[endless] > 0.0))


def _endless(scene: Scene) -> np.ndarray:
    """Which shapes are planes."""
    kinds = [isinstance(group, Planes) for group in scene.groups for _ in range(group.count)]
    return np.array(kinds)


@eqx.filter_jit
def _thrown(scene: Scene, key, count: int, bounces: int, survival, focus: Ball | None) -> Photons:
    """One photon in each lane."""
    scene, focus = jax.lax.stop_gradient((scene, focus))
    first, later = jax.random.split(key)
    u = jax.random.uniform(first, (count, 5), scene.material.emission.dtype)
    *rays, flux, endless = _sent(scene, focus, u)

    def arrive(ray) -> Arrived:
        origin, along, on = ray
        v, there, _ = meet(scene, origin, along, on)
        front = jnp.sum(jax.vmap(scene.normal)(v.on, v.position) * v.normal, -1) > 0.0
        return Arrived(v, (v.on, front, v.position, v.back), there, v.albedo + v.specular)

    def go_on(v: Vertex, u):
        along, weight = scattered(v, u)[:2] if focus is None else aimed(focus, v, endless, u)
        return (v.position, along, v.own), weight

    keys = jax.random.split(later, bounces + 1)
    (index, front, position, back), landed, flux = follow_photons(
        tuple(rays), flux, keys, 3, survival, arrive, go_on
    )
    return Photons(jnp.where(landed, index, -1), front, position, flux, back)


def _sent(scene: Scene, focus: Ball | None, u: Float[Array, "n 5"]):
    """Places, directions, own shapes and fluxes of new photons; which are of light without end."""
    emission = scene.material.emission.T.ravel()  # all fronts, then all backs
    lamps = jnp.pi * emission * jnp.tile(_areas(scene, focus), 2)
    wide = _ball(scene).radius if focus is None else 2.0**0.5 * focus.radius
    pick = Discrete(jnp.concatenate([lamps, _sky_fluxes(scene, wide, jnp.sum(lamps))]))
    number, rest = pick.sample(u[:, 0])
    chance, of_sky = pick.probability[number], number >= len(lamps)
    u = u.at[:, 0].set(rest)
    place, along, flux, own = _from_shapes(scene, focus, jnp.minimum(number, len(lamps) - 1), u)
    cell = jnp.maximum(number - len(lamps), 0)
    beyond, down, light = _from_sky(scene, focus, cell, u[:, 1:])
    place = jnp.where(of_sky[:, None], beyond, place)
    along = jnp.where(of_sky[:, None], down, along)
    sent = jnp.where(of_sky, light, flux) / jnp.where(chance > 0.0, chance, 1.0) / u.shape[0]
    on = jnp.where(of_sky, -1, own).astype(jnp.int32)
    endless = of_sky | jnp.asarray(_endless(scene))[number % scene.count]
    return place, along, on, jnp.where(chance > 0.0, sent, 0.0), endless


def _from_shapes(scene: Scene, focus: Ball | None, number: Int[Array, " n"], u):
    """Places on the sides of these numbers, directions by the cosine, flux over density, `own`."""
    emission = scene.material.emission.T.ravel()
    on, side = number % scene.count, jnp.where(number < scene.count, FRONT, BACK)
    place, normal = jax.vmap(lambda i, u: scene.ask(i, lambda s: point_on(s, u)))(on, u[:, 1:3])
    density = area_density(scene, on, normal)
    endless = jnp.asarray(_endless(scene))[on]
    if focus is not None:
        far, thin = spread(focus, place, normal, u[:, 1:3])
        place, density = jnp.where(endless[:, None], far, place), jnp.where(endless, thin, density)
    outward = jnp.where(side == FRONT, 1.0, -1.0)[:, None] * normal
    before = place + step(scene, place) * outward
    # Of several lamps in one place the one that is seen sends.
    sends = (density > 0.0) & ~occluded(scene, before, place, -1, on)
    own = unmet(scene, on, side == BACK)
    rho = jnp.sqrt(u[:, 3])
    local = cylindrical(rho, 2.0 * jnp.pi * u[:, 4], jnp.sqrt(1.0 - u[:, 3]))
    along = matvec(orthonormal_frame(outward), local)
    sent = jnp.pi * emission[number] / jnp.where(density > 0.0, density, 1.0)
    if focus is not None:
        one = jnp.ones_like(density)
        white = Vertex(before, outward, on, outward, one, 0.0 * one, 0.0 * one, own)
        about, weight = aimed(focus, white, endless, u[:, jnp.array([0, 3, 4])])
        along = jnp.where(endless[:, None], about, along)
        sent = jnp.where(endless, weight * sent, sent)
    return before, along, jnp.where(sends, sent, 0.0), own


def _from_sky(scene: Scene, focus: Ball | None, cell: Int[Array, " n"], u: Float[Array, "n 4"]):
    """Places on the discs that a ball shows to directions of these cells of the sky; the same.

    With a focus, on the planes through its middle, and before all that is on the way there.
    """
    ball, side = _ball(scene), _cells(scene)
    row = jnp.stack([cell // side, cell % side], -1)
    sky = on_ball(((row + u[:, 2:]) / side).T)
    if focus is None:
        across = cylindrical(jnp.sqrt(u[:, 0]), 2.0 * jnp.pi * u[:, 1], jnp.ones_like(u[:, 0]))
        place = ball.middle + ball.radius * matvec(orthonormal_frame(sky), across)
        area = jnp.pi * ball.radius**2
    else:
        place, density = spread(focus, focus.middle, sky, u[:, :2])
        way = jnp.maximum(_way_out(scene, ball, place, sky), focus.radius)
        place, area = place + 2.0 * way[:, None] * sky, 1.0 / density
    return place, -sky, 4.0 * jnp.pi / side**2 * area * jax.vmap(scene.sky)(sky)


def _way_out(scene: Scene, ball: Ball, place: Rows, along: Rows) -> Float[Array, " n"]:
    """Distances along rays to where they have passed all shapes, which a ball holds, and planes."""
    passed = [dot(ball.middle - place, along) + ball.radius]
    for group in scene.groups:
        if isinstance(group, Planes):
            normal = jax.vmap(lambda plane: plane.normal(plane.center))(group)
            height = jnp.sum((group.center - place[:, None]) * normal, -1)
            rise = along @ normal.T
            passed.append(jnp.max(height / jnp.where(rise == 0.0, jnp.inf, rise), -1))
    return jnp.max(jnp.stack(passed), 0)


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


def _ball(scene: Scene) -> Ball:
    """Middle and radius of a ball around all shapes but planes, not the smallest."""
    center, reach = [], []
    for group in scene.groups:
        if not isinstance(group, Planes):
            axes = group.axes[..., : 3 if group.closed else 2]
            center.append(group.center)
            reach.append(jnp.sum(norm(jnp.swapaxes(axes, -1, -2)), -1))  # canonically in a cube
    if not center:
        return Ball(jnp.zeros(3), jnp.zeros(()))
    center, reach = jnp.concatenate(center), jnp.concatenate(reach)
    low, high = center - reach[:, None], center + reach[:, None]
    middle = 0.5 * (jnp.min(low, 0) + jnp.max(high, 0))
    return Ball(middle, jnp.max(norm(center - middle) + reach))


def _areas(scene: Scene, focus: Ball | None) -> Float[Array, " n"]:
    """Surface of each shape, by which lamps are picked [m^2]; of flat ones exact, else nearly.

    What the pick is off by is made up for by the flux of each photon. A plane counts by what it
    sends through the focus, as the sky does: photons of all lights carry alike there.
    """
    u = _lattice(scene, LATTICE)

    def area(index):
        _, normal = jax.vmap(lambda u: scene.ask(index, lambda s: point_on(s, u)))(u)
        density = area_density(scene, jnp.full(u.shape[0], index), normal)
        return jnp.mean(1.0 / density)

    areas = jax.vmap(area)(jnp.arange(scene.count))
    plane = 0.0 if focus is None else 2.0 * jnp.pi * focus.radius**2
    return jnp.where(jnp.asarray(_endless(scene)), plane, areas)


def _lattice(scene: Scene, side: int) -> Float[Array, "n 2"]:
    """Middles of the cells of the unit square in rows, in the scene's precision."""
    middles = (np.arange(side) + 0.5) / side
    u = np.stack(np.meshgrid(middles, middles, indexing="ij"), -1).reshape(-1, 2)
    return jnp.asarray(u, scene.material.emission.dtype)
