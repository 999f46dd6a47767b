"""Which shape a ray meets first.

Rays and shapes are never multiplied in memory: a scan over the shapes of each kind carries the
nearest distance and its shape's number for all rays. The search is not differentiated; the one hit
that it finds is computed again, so that value and gradient cost about as much as the value.
"""

from __future__ import annotations

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, ArrayLike, Bool, Float, Int

from firstorder.flatland.scene import Scene

MISS = -1


class Hits(eqx.Module):
    """Where rays end.

    Attributes:
        t: distance along the unit direction, infinity for a miss [m].
        index: number of the shape, -1 for a miss.
        s: parameter on the shape.
    """

    t: Float[Array, "*r"]
    index: Int[Array, "*r"]
    s: Float[Array, "*r"]


def first_shape(
    scene: Scene, origins: Float[Array, "r 2"], along: Float[Array, "r 2"], on: ArrayLike = MISS
) -> Int[Array, " r"]:
    """Number of the shape that each ray meets first, -1 for none. It has no derivative.

    Args:
        scene: the shapes.
        origins: where the rays start [m].
        along: unit directions.
        on: the shape on which each ray starts, or -1.
    """
    scene, origins, along = jax.lax.stop_gradient((scene, origins, along))
    count = origins.shape[0]
    on = jnp.broadcast_to(jnp.asarray(on), (count,))
    nearest = jnp.full((count,), jnp.inf, origins.dtype)
    index = jnp.full((count,), MISS, jnp.int32)
    first = 0
    for group in scene.groups:

        def meet(carry, here):
            nearest, index = carry
            shape, number = here
            t, _ = jax.vmap(lambda o, d, own: shape.hit(o, d, own))(origins, along, on == number)
            closer = t < nearest
            return (jnp.where(closer, t, nearest), jnp.where(closer, number, index)), None

        numbers = jnp.arange(first, first + group.count, dtype=jnp.int32)
        (nearest, index), _ = jax.lax.scan(meet, (nearest, index), (group, numbers))
        first += group.count
    return index


def nearest(
    scene: Scene, origins: Float[Array, "r 2"], along: Float[Array, "r 2"], on: ArrayLike = MISS
) -> Hits:
    """The first hit of every ray, differentiable in rays and shapes.

    Args:
        scene: the shapes.
        origins: where the rays start [m].
        along: unit directions.
        on: the shape on which each ray starts, or -1; a ray does not meet its own start.

    Returns:
        Distance, shape and parameter for each ray.

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.flatland import Circles, Scene, thing, nearest
        >>> scene = Scene.of(thing(Circles((0.0, 3.0), 1.0)))
        >>> nearest(scene, jnp.array([[0.0, 0.0]]), jnp.array([[0.0, 1.0]])).t.item()
        2.0
    """
    index = first_shape(scene, origins, along, on)
    on = jnp.broadcast_to(jnp.asarray(on), index.shape)
    t, s = jax.vmap(scene.hit)(jnp.maximum(index, 0), origins, along, on)
    met = index >= 0
    return Hits(jnp.where(met, t, jnp.inf), index, jnp.where(met, s, 0.0))


def occluded(
    scene: Scene,
    a: Float[Array, "r 2"],
    b: Float[Array, "r 2"],
    on_a: ArrayLike = MISS,
    on_b: ArrayLike = MISS,
) -> Bool[Array, " r"]:
    """Whether something stands between two points. It has no derivative.

    Args:
        scene: the shapes.
        a: where the rays start [m].
        b: where they end [m].
        on_a: the shape on which each ray starts, or -1.
        on_b: the shape on which each ray ends, or -1: what is met there does not count.
    """
    scene, a, b = jax.lax.stop_gradient((scene, a, b))
    way = b - a
    length = jnp.sqrt(way[:, 0] ** 2 + way[:, 1] ** 2)
    along = way / jnp.where(length == 0.0, 1.0, length)[:, None]
    on_a, on_b = (jnp.broadcast_to(jnp.asarray(on), length.shape) for on in (on_a, on_b))
    # A ray that ends on a surface meets it there, to rounding.
    eps = float(jnp.finfo(length.dtype).eps)
    limit = length * (1.0 - jnp.where(on_b >= 0, 32.0 * eps**0.5, 0.0))
    blocked = jnp.zeros(length.shape, bool)
    first = 0
    for group in scene.groups:

        def meet(blocked, here):
            shape, number = here
            t, _ = jax.vmap(lambda o, d, own: shape.hit(o, d, own))(a, along, on_a == number)
            return blocked | (t < limit), None

        numbers = jnp.arange(first, first + group.count, dtype=jnp.int32)
        blocked, _ = jax.lax.scan(meet, blocked, (group, numbers))
        first += group.count
    return blocked
