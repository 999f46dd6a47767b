"""Rays and shapes: the first hit of each ray, and whether two points see each other."""

from __future__ import annotations

import jax
import jax.numpy as jnp
from jaxtyping import Array, ArrayLike, Bool, Float, Int

from firstorder._display import Module
from firstorder.numerics._compiled import compiled
from firstorder.scene import _intersect as intersect
from firstorder.scene._arguments import rays_of
from firstorder.scene._intersect import MISS
from firstorder.space.scene import Scene


class Hits(Module):
    """First hits of rays.

    Attributes:
        t: distance along the unit direction, infinity for a miss [m].
        index: number of the shape, -1 for a miss.
    """

    t: Float[Array, "*r"]
    index: Int[Array, "*r"]


@compiled
def first_shape(
    scene: Scene, origins: ArrayLike, along: ArrayLike, on: ArrayLike = MISS
) -> Int[Array, " r"]:
    """Number of the shape that each ray meets first, -1 for none. It has no derivative.

    Args:
        scene: the shapes.
        origins: where the rays start, one row for each, shape (r, 3) [m].
        along: unit directions, likewise.
        on: the shape on which each ray starts, or -1; shapes are convex, so it is not met again.

    Raises:
        ValueError: if rays are not rows of three coordinates.

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.space import first_shape
        >>> from firstorder.space.library import j12_box
        >>> up = jnp.array([[0.0, 0.0, 1.0], [0.0, 1.0, 0.0]])
        >>> first_shape(j12_box(), jnp.full((2, 3), 0.5), up).tolist()  # the light, and nothing
        [2, -1]
    """
    origins, along = rays_of(origins, along, 3)
    on = jnp.broadcast_to(jnp.asarray(on), origins.shape[:1])
    rank = intersect.ranks(scene.material.emission)
    return intersect.first_shape(scene.groups, rank, (origins, along, on))


@compiled
def nearest(scene: Scene, origins: ArrayLike, along: ArrayLike, on: ArrayLike = MISS) -> Hits:
    """The first hit of every ray, differentiable in rays and shapes.

    Args:
        scene: the shapes.
        origins: where the rays start, one row for each, shape (r, 3) [m].
        along: unit directions, likewise.
        on: the shape on which each ray starts, or -1.

    Returns:
        Distance and shape for each ray.

    Raises:
        ValueError: if rays are not rows of three coordinates.

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.space import Scene, nearest, sphere, primitive
        >>> scene = Scene.of(primitive(sphere((0.0, 0.0, 3.0), 1.0)))
        >>> nearest(scene, jnp.zeros((1, 3)), jnp.array([[0.0, 0.0, 1.0]])).t.item()
        2.0
    """
    origins, along = rays_of(origins, along, 3)
    index = first_shape(scene, origins, along, on)
    on = jnp.broadcast_to(jnp.asarray(on), index.shape)
    t = jax.vmap(scene.distance)(jnp.maximum(index, 0), origins, along, on)
    met = (index >= 0) & jnp.isfinite(t)  # search and hit may round a grazing ray differently
    return Hits(jnp.where(met, t, jnp.inf), jnp.where(met, index, MISS))


@compiled
def occluded(
    scene: Scene,
    a: ArrayLike,
    b: ArrayLike,
    on_a: ArrayLike = MISS,
    on_b: ArrayLike = MISS,
) -> Bool[Array, " r"]:
    """Whether something stands between two points. It has no derivative.

    Args:
        scene: the shapes.
        a: where the rays start, one row for each, shape (r, 3) [m].
        b: where they end, shape (r, 3) [m].
        on_a: the shape on which each ray starts, or -1.
        on_b: the shape on which each ray ends, or -1. It does not count near the end of the ray,
            within 32 sqrt(eps) of its length; all others count up to `eps^(3/4)` of it.
            Of surfaces in the same place, the one that `Scene.of` says hides the end on another.

    Raises:
        ValueError: if rays are not rows of three coordinates.

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.space import Scene, occluded, sphere, primitive
        >>> scene = Scene.of(primitive(sphere((0.0, 0.0, 3.0), 1.0)))
        >>> occluded(scene, jnp.zeros((1, 3)), jnp.array([[0.0, 0.0, 9.0]])).item()
        True
    """
    a, b = rays_of(a, b, 3, ("a", "b"))
    free = isinstance(on_b, int) and on_b == MISS
    rank = None if free else intersect.ranks(scene.material.emission)
    return intersect.occluded(scene.groups, rank, a, b, on_a, on_b)
