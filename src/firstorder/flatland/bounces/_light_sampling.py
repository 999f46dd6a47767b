"""Sampling of lights: a random point on a light, as seen from a place.

Lights are picked by their flux. A shape is sampled evenly in its parameter, so the density per
radian at x is `P r / (speed cos_y)`; the sky by a table of its radiance.
"""

from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Bool, Float, Int

from firstorder._display import Module
from firstorder.conventions import direction
from firstorder.flatland.scene import Scene
from firstorder.numerics._planar import cross_2d, dot_2d
from firstorder.numerics._quadrature import gauss_legendre
from firstorder.sampling._distributions import Discrete, PiecewiseConstant
from firstorder.scene._intersect import rounding
from firstorder.scene._primitives import BACK, FRONT

SKY_PIECES = 256  # of the table by which the sky is sampled
EVEN = 0.1  # share of it that is uniform, lest a narrow bright place between its nodes be missed


class Lights(Module):
    """All lights of a scene, in the order: points, fronts and backs of shapes, sky.

    Attributes:
        pick: one of them, by flux.
        flux: of each [W]; the sky's is what crosses the circle around the scene, by its table, and
            no less than a tenth of all other.
        sky: density of directions over the whole turn, per radian.
        center, radius: of a circle around the scene [m].
    """

    pick: Discrete
    flux: Float[Array, " m"]
    sky: PiecewiseConstant
    center: Float[Array, "2"]
    radius: Float[Array, ""]

    @property
    def step(self) -> Float[Array, ""]:
        """By which rays start before their surface, so that others in its place lie behind [m]."""
        return before(self.center, self.radius)


class LightSample(Module):
    """A light sample as seen from a place.

    Attributes:
        along: unit vector to it.
        value: of `int L ... dtheta`, before the density: radiance, or `I / r` of a point.
        density: per radian, probability of the pick included; for a point, that probability.
        end: where the ray to it ends [m].
        on: the shape that it lies on, -1 for none.
        point: whether it is a point light, which no ray can meet by chance.
    """

    along: Float[Array, "n 2"]
    value: Float[Array, " n"]
    density: Float[Array, " n"]
    end: Float[Array, "n 2"]
    on: Int[Array, " n"]
    point: Bool[Array, " n"]


def bounds(scene: Scene) -> tuple[Float[Array, "2"], Float[Array, ""]]:
    """A circle around all shapes, by points along each, a little too large."""
    s = jnp.linspace(0.0, 1.0, 33, dtype=scene.material.emission.dtype)
    where = jax.vmap(lambda i: jax.vmap(lambda s: scene.motion(i, s)[0])(s))
    p = where(jnp.arange(scene.count)).reshape(-1, 2)
    p = jnp.concatenate([p, scene.points.position.astype(p.dtype)])
    center = 0.5 * (jnp.max(p, 0) + jnp.min(p, 0))
    return center, 1.01 * jnp.max(jnp.sqrt(jnp.sum((p - center) ** 2, -1)))


def before(center: Float[Array, "2"], radius: Float[Array, ""]) -> Float[Array, ""]:
    """Twice what rounding makes of places within a circle [m]."""
    return 2.0 * rounding((radius + jnp.max(jnp.abs(center)))[None])


def lengths(scene: Scene) -> Float[Array, " n"]:
    """Arc lengths of all shapes, in the scene's own precision [m]."""
    dtype = scene.material.emission.dtype
    t, w = (jnp.asarray(a, dtype) for a in gauss_legendre(64))

    def length(index):
        v = jax.vmap(lambda s: scene.motion(index, s)[1])(0.5 + 0.5 * t)
        return 0.5 * jnp.sum(w * jnp.sqrt(dot_2d(v, v)))

    return jax.vmap(length)(jnp.arange(scene.count))


def lights(
    scene: Scene, points: ArrayLike = 1.0, shapes: ArrayLike = 1.0, sky: ArrayLike = 1.0
) -> Lights:
    """The lights of a scene, weighted by the flux that each sends into it.

    A point sends `2 pi I`, a side of uniform radiance `2 L length`, the sky `2 R int L`; a sun that
    no node of its table meets must not be lost, so that a tenth of all picks are the sky's.

    Args:
        scene: what shines.
        points: 1 to count point lights, 0 to leave them out.
        shapes: likewise emitting shapes.
        sky: likewise the environment.
    """
    center, radius = bounds(scene)
    dtype = radius.dtype
    at = np.pi * ((np.arange(SKY_PIECES) + 0.5) * 2.0 / SKY_PIECES - 1.0)
    seen = jnp.ones(SKY_PIECES, dtype)
    sides = 2.0 * scene.material.emission * lengths(scene)[:, None]
    others = [2.0 * jnp.pi * scene.points.intensity * points, sides.T.ravel() * shapes]
    others = jnp.concatenate(others).astype(dtype)
    through = jnp.zeros((), dtype)
    if scene.environment is not None:
        L = jax.vmap(scene.environment)(jnp.asarray(at, dtype)).astype(dtype)
        mean = jnp.mean(L)
        through = jnp.maximum(4.0 * jnp.pi * radius * mean, EVEN * jnp.sum(others))
        through = through + jnp.finfo(dtype).tiny
        seen = jnp.where(mean > 0.0, (1.0 - EVEN) * L + EVEN * mean, 1.0)
    flux = jnp.append(others, through * sky).astype(dtype)
    turn = jnp.asarray(jnp.pi, dtype)
    return Lights(Discrete(flux), flux, PiecewiseConstant(seen, -turn, turn), center, radius)


def sample_light(
    scene: Scene, where: Lights, place: Float[Array, "n 2"], u: Float[Array, "n 2"]
) -> LightSample:
    """One light sample for each place."""
    number, rest = where.pick.sample(u[:, 0])
    chance = where.pick.probability[number]
    n, p = scene.count, scene.points.intensity.shape[0]
    end = jnp.zeros_like(place)
    value, density = jnp.zeros_like(chance), jnp.ones_like(chance)
    on = jnp.full(number.shape, -1)
    which = jnp.clip(number, 0, max(p - 1, 0))
    if p:
        end = scene.points.position[which].astype(place.dtype)
    is_point = number < p

    # --- a point on a shape
    side = jnp.where(number - p >= n, BACK, FRONT)
    shape = jnp.clip(number - p - n * side, 0, n - 1)
    on_shape = (number >= p) & (number < p + 2 * n)
    position, v, _ = jax.vmap(scene.motion)(shape, u[:, 1])
    end = jnp.where(on_shape[:, None], position, end)
    away = end - place
    r = jnp.sqrt(dot_2d(away, away))
    along = away / jnp.where(r > 0.0, r, 1.0)[:, None]
    # speed cos_y / r, positive if the sampled side is seen
    seen = cross_2d(along, v) * jnp.where(side == FRONT, 1.0, -1.0)
    facing = on_shape & (seen > 0.0) & (r > 0.0)
    L = scene.material.emission[shape, side]
    value = jnp.where(facing, L, value)
    density = jnp.where(facing, chance * r / jnp.where(facing, seen, 1.0), density)
    on = jnp.where(on_shape, shape, on)
    if p:
        nearby = scene.points.intensity[which] / jnp.where(r > 0.0, r, 1.0)
        value = jnp.where(is_point & (r > 0.0), nearby, value)
        density = jnp.where(is_point, chance, density)

    # --- a direction of the sky
    if scene.environment is not None:
        angle = where.sky.sample(rest)
        far = number >= p + 2 * n
        d = direction(angle)
        along = jnp.where(far[:, None], d, along)
        reach = where.radius * 4.0 + jnp.sqrt(jnp.sum((place - where.center) ** 2, -1))
        end = jnp.where(far[:, None], place + reach[:, None] * d, end)
        value = jnp.where(far, jax.vmap(scene.environment)(angle), value)
        density = jnp.where(far, chance * where.sky.density(angle), density)
    # Where nothing shines nothing is picked; what is returned then counts for nothing.
    value = jnp.where((chance > 0.0) & (density > 0.0), value, 0.0)
    density = jnp.where(density > 0.0, density, 1.0)
    return LightSample(along, value, density, end, on, is_point)


def density_of_shape(
    scene: Scene,
    where: Lights,
    index: Int[Array, " n"],
    front: Bool[Array, " n"],
    seen: Float[Array, " n"],
    r: Float[Array, " n"],
) -> Float[Array, " n"]:
    """Density with which `sample_light` draws the direction in which a shape is met.

    Args:
        scene: the scene.
        where: its lights.
        index: number of the shape, any if there is none.
        front: whether its front is met.
        seen: `speed cos_y` there, positive.
        r: distance to it [m].
    """
    p = scene.points.intensity.shape[0]
    entry = p + jnp.maximum(index, 0) + jnp.where(front, 0, scene.count)
    lit = seen > 0.0
    return where.pick.probability[entry] * jnp.where(lit, r, 0.0) / jnp.where(lit, seen, 1.0)


def density_of_sky(where: Lights, along: Float[Array, "n 2"]) -> Float[Array, " n"]:
    """Density with which `sample_light` draws a direction of the sky."""
    return where.pick.probability[-1] * where.sky.density(jnp.arctan2(-along[:, 0], along[:, 1]))
