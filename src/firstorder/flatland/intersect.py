"""Which shape a ray meets first.

Rays times shapes are never kept in memory. A few shapes are compared in one reduction; from
`FEW` on, rays go in blocks that fit the cache and a scan over the shapes of each kind carries the
nearest distance and its shape's number. The search is not differentiated: the one hit that it finds
is computed again, so that value and gradient cost about as much as the value.
"""

from __future__ import annotations

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, ArrayLike, Bool, Float, Int

from firstorder.flatland.scene import Scene
from firstorder.flatland.shapes import Curves

MISS = -1
# Measured (benchmarks/bench_flatland.py): below, one reduction over all shapes wins by up to 3.
FEW = 16
BLOCK = 2048  # rays whose state stays in the cache


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
    on = jnp.broadcast_to(jnp.asarray(on), origins.shape[:1])
    few = scene.count <= FEW and not _has_curves(scene)
    rays = origins, along, on
    return _in_one(scene, rays) if few else _blocked(_one_by_one, scene, rays)


def _has_curves(scene: Scene) -> bool:
    """Whether a ray costs many brackets, which are kept for a whole block of rays."""
    return any(isinstance(group, Curves) for group in scene.groups)


def _block(scene: Scene) -> int:
    return BLOCK // 32 if _has_curves(scene) else BLOCK


def _apart(rays):
    """Coordinates apart, so that rays lie side by side in memory. Once, outside of any loop."""
    origins, along, on = rays
    return origins.T, along.T, on


def _beside(f, rays):
    """Maps f over rays whose coordinates are apart."""
    return jax.vmap(f, in_axes=(1, 1, 0))(*rays)


def _numbered(scene: Scene):
    """Each group with the numbers of its shapes."""
    first = 0
    for group in scene.groups:
        yield group, jnp.arange(first, first + group.count, dtype=jnp.int32)
        first += group.count


def _in_one(scene: Scene, rays) -> Int[Array, " r"]:
    """All distances to a group at once, reduced by the compiler as they arise."""
    rays = _apart(rays)
    nearest = jnp.full(rays[2].shape, jnp.inf, rays[0].dtype)
    index = jnp.full(rays[2].shape, MISS, jnp.int32)
    for group, numbers in _numbered(scene):

        def meet(o, d, on, group=group, numbers=numbers):
            return jax.vmap(lambda shape, k: shape.distance(o, d, on == k))(group, numbers)

        t = _beside(meet, rays)
        least, which = jnp.min(t, 1), numbers[0] + jnp.argmin(t, 1).astype(jnp.int32)
        closer = least < nearest
        nearest, index = jnp.where(closer, least, nearest), jnp.where(closer, which, index)
    return index


def _one_by_one(scene: Scene, rays) -> Int[Array, " r"]:
    """Shape after shape against all rays."""

    def meet(carry, here):
        (nearest, index), (shape, k) = carry, here
        t = _beside(lambda o, d, on: shape.distance(o, d, on == k), rays)
        closer = t < nearest
        return (jnp.where(closer, t, nearest), jnp.where(closer, k, index)), None

    rays, count = _apart(rays), rays[2].shape
    carry = jnp.full(count, jnp.inf, rays[0].dtype), jnp.full(count, MISS, jnp.int32)
    for numbered in _numbered(scene):
        carry, _ = jax.lax.scan(meet, carry, numbered)
    return carry[1]


def _blocked(find, scene: Scene, rays):
    """Many rays in blocks; the last one is filled up with copies of a ray."""
    count, block = rays[2].shape[0], _block(scene)
    if count <= block:
        return find(scene, rays)
    blocks = -(-count // block)

    def cut(a):
        more = jnp.broadcast_to(a[:1], (blocks * block - count, *a.shape[1:]))
        return jnp.concatenate([a, more]).reshape(blocks, block, *a.shape[1:])

    found = jax.lax.map(lambda rays: find(scene, rays), jax.tree.map(cut, rays))
    return found.reshape(-1)[:count]


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
    asked = jnp.maximum(index, 0), origins, along, on
    if _has_curves(scene) and on.size > _block(scene):
        t, s = jax.lax.map(lambda ray: scene.hit(*ray), asked, batch_size=_block(scene))
    else:
        t, s = jax.vmap(scene.hit)(*asked)
    met = (index >= 0) & jnp.isfinite(t)  # search and hit may round a grazing ray differently
    return Hits(jnp.where(met, t, jnp.inf), jnp.where(met, index, MISS), jnp.where(met, s, 0.0))


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
        on_b: the shape on which each ray ends, or -1. It does not count near the end of the ray,
            within 32 sqrt(eps) of its length; all others count up to 8 eps of it.
    """
    scene, a, b = jax.lax.stop_gradient((scene, a, b))
    way = b - a
    length = jnp.sqrt(way[:, 0] ** 2 + way[:, 1] ** 2)
    along = way / jnp.where(length == 0.0, 1.0, length)[:, None]
    on_a, on_b = (jnp.broadcast_to(jnp.asarray(on), length.shape) for on in (on_a, on_b))
    eps = float(jnp.finfo(length.dtype).eps)
    return _blocked(
        lambda scene, rays: _meets(scene, rays, eps), scene, (a, along, on_a, on_b, length)
    )


def _meets(scene: Scene, rays, eps: float) -> Bool[Array, " r"]:
    """Whether anything is met before the end; the shape at the end is itself not met there."""
    start, along, on_a, on_b, length = rays
    apart = _apart((start, along, on_a))

    def meet(blocked, here):
        shape, k = here
        t = _beside(lambda o, d, on: shape.distance(o, d, on == k), apart)
        at_end = jnp.where(on_b == k, 32.0 * eps**0.5, 8.0 * eps)
        return blocked | (t < length * (1.0 - at_end)), None

    blocked = jnp.zeros(length.shape, bool)
    for numbered in _numbered(scene):
        blocked, _ = jax.lax.scan(meet, blocked, numbered)
    return blocked
