"""First hits of rays, and visibility between two points, as `scene._intersect` finds them."""

from __future__ import annotations

import jax
import jax.numpy as jnp
from jaxtyping import Array, ArrayLike, Bool, Float, Int

from firstorder._display import Module
from firstorder.flatland.scene import Scene
from firstorder.flatland.shapes._base import Shape
from firstorder.flatland.shapes.kinds import Curves
from firstorder.numerics._batching import in_batches
from firstorder.numerics._compiled import compiled
from firstorder.scene import _intersect as intersect
from firstorder.scene._arguments import rays_of
from firstorder.scene._intersect import MISS


class Hits(Module):
    """First hits of rays.

    Attributes:
        t: distance along the unit direction, infinity for a miss [m].
        index: number of the shape, -1 for a miss.
        s: parameter on the shape.
    """

    t: Float[Array, "*r"]
    index: Int[Array, "*r"]
    s: Float[Array, "*r"]


@compiled
def first_shape(
    scene: Scene, origins: ArrayLike, along: ArrayLike, on: ArrayLike = MISS
) -> Int[Array, " r"]:
    """Number of the shape that each ray meets first, -1 for none. It has no derivative.

    Args:
        scene: the shapes.
        origins: where the rays start, one row for each, shape (r, 2) [m].
        along: unit directions, likewise.
        on: the shape on which each ray starts, or -1.

    Raises:
        ValueError: if rays are not rows of two coordinates.

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.flatland import first_shape
        >>> from firstorder.flatland.library import scene_a
        >>> up = jnp.array([[0.0, 1.0], [1.0, 0.0]])
        >>> first_shape(scene_a(), jnp.full((2, 2), 0.25), up).tolist()  # the lamp, and nothing
        [1, -1]
    """
    origins, along = rays_of(origins, along, 2)
    on = jnp.broadcast_to(jnp.asarray(on), origins.shape[:1])
    rank = intersect.ranks(scene.material.emission)
    return _first_of_ranked(scene.groups, rank, (origins, along, on))


def _first_of_ranked(
    groups: tuple[Shape, ...], rank: Int[Array, " n"], rays: intersect.Rays
) -> Int[Array, " r"]:
    """`first_shape` of shapes whose ranks are known (`scene._intersect.ranks`)."""
    return intersect.first_shape(groups, rank, rays, _block(groups), _chunk(groups))


def _has_curves(groups: tuple[Shape, ...]) -> bool:
    """Whether a ray costs many brackets, which are kept for a whole block of rays."""
    return any(isinstance(group, Curves) for group in groups)


def _block(groups: tuple[Shape, ...]) -> int:
    """Rays at a time."""
    return 64 if _has_curves(groups) else intersect.block_of(groups)


def _chunk(groups: tuple[Shape, ...]) -> int:
    """Shapes at a time."""
    return 1 if _has_curves(groups) else intersect.CHUNK


@compiled
def nearest(scene: Scene, origins: ArrayLike, along: ArrayLike, on: ArrayLike = MISS) -> Hits:
    """The first hit of every ray, differentiable in rays and shapes.

    Args:
        scene: the shapes.
        origins: where the rays start, one row for each, shape (r, 2) [m].
        along: unit directions, likewise.
        on: the shape on which each ray starts, or -1; a ray does not meet its own start.

    Returns:
        Distance, shape and parameter for each ray.

    Raises:
        ValueError: if rays are not rows of two coordinates.

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.flatland import Circles, Scene, primitive, nearest
        >>> scene = Scene.of(primitive(Circles((0.0, 3.0), 1.0)))
        >>> nearest(scene, jnp.array([[0.0, 0.0]]), jnp.array([[0.0, 1.0]])).t.item()
        2.0
    """
    origins, along = rays_of(origins, along, 2)
    index = first_shape(scene, origins, along, on)
    on = jnp.broadcast_to(jnp.asarray(on), index.shape)
    asked = jnp.maximum(index, 0), origins, along, on
    if _has_curves(scene.groups) and on.size > _block(scene.groups):
        t, s = in_batches(lambda ray: scene.hit(*ray), asked, _block(scene.groups))
    else:
        t, s = jax.vmap(scene.hit)(*asked)
    met = (index >= 0) & jnp.isfinite(t)  # search and hit may round a grazing ray differently
    return Hits(jnp.where(met, t, jnp.inf), jnp.where(met, index, MISS), jnp.where(met, s, 0.0))


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
        a: where the rays start, one row for each, shape (r, 2) [m].
        b: where they end, shape (r, 2) [m].
        on_a: the shape on which each ray starts, or -1.
        on_b: the shape on which each ray ends, or -1. It does not count near the end of the ray,
            within 32 sqrt(eps) of its length; all others count up to `eps^(3/4)` of it.
            Of surfaces in the same place, the one that `Scene.of` says hides the end on another.

    Raises:
        ValueError: if rays are not rows of two coordinates.

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.flatland import occluded
        >>> from firstorder.flatland.library import scene_b
        >>> low, high = jnp.array([[0.0, 0.25], [0.5, 0.25]]), jnp.array([[0.0, 0.75], [0.5, 0.75]])
        >>> occluded(scene_b(), low, high).tolist()
        [True, False]
    """
    a, b = rays_of(a, b, 2, ("a", "b"))
    free = isinstance(on_b, int) and on_b == MISS
    rank = None if free else intersect.ranks(scene.material.emission)
    return intersect.occluded(scene.groups, rank, a, b, on_a, on_b, _block(scene.groups))
