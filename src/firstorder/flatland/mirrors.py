"""Irradiance by way of flat mirrors, exact like irradiance that arrives straight.

In a mirror the scene is seen from the eye's mirror image: its silhouettes, reflected, are edges of
the view like all others. They cut the hemicircle together with the real ones, and behind each gap
that shows the mirror there is again one shape throughout.
"""

from __future__ import annotations

from collections.abc import Sequence

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from firstorder._argument_checks import check_integer
from firstorder.conventions import direction
from firstorder.flatland.intersect import first_shape
from firstorder.flatland.scene import Scene
from firstorder.flatland.shapes._base import own_unit
from firstorder.flatland.visible import Receiver, view
from firstorder.numerics._compiled import compiled
from firstorder.numerics._quadrature import gauss_legendre
from firstorder.numerics._refinement import with_errors
from firstorder.numerics._scale import power_of_two
from firstorder.scene._arguments import check_asked_one
from firstorder.scene._bands import by_band
from firstorder.scene._primitives import BACK, FRONT


@compiled
@with_errors("nodes")
@by_band()
def mirror_irradiance(
    scene: Scene, at: Receiver, *, mirrors: Sequence[int], nodes: int = 16, with_error: bool = False
) -> Float[Array, ""]:
    """Irradiance by way of one reflection in flat mirrors [W/m]; add it to `irradiance`.

    Valid for: mirrors that are segments, light of emitters and of the environment, one reflection.
    Point lights are left out: their reflection is another point light beyond the mirror.

    Args:
        scene: shapes and lights; `Material.mirror` says how much each mirror reflects.
        at: one receiver.
        mirrors: numbers of the shapes that are mirrors; both sides reflect.
        nodes: nodes in each gap in which the environment is reflected.
        with_error: whether to give an `Approximation`: the answer, and a bound of its error.

    Raises:
        ValueError: if a mirror is no segment of the scene, or none is named.

    Example:
        >>> from firstorder.flatland import Receiver, Scene, Segments, mirror_irradiance, primitive
        >>> lamp = primitive(Segments((-0.5, 1.0), (-1.5, 1.0)), emission=1.0)
        >>> glass = primitive(Segments((1.0, 0.0), (1.0, 3.0)), mirror=0.8)
        >>> scene = Scene.of(lamp, glass)
        >>> round(float(mirror_irradiance(scene, Receiver((0.0, 0.0), 0.0), mirrors=(1,))), 6)
        0.026438
    """
    check_asked_one(scene, Scene, at, Receiver)
    if not mirrors:
        raise ValueError("Argument `mirrors` must name at least one shape, but is empty.")
    straight = scene.groups[0].count if hasattr(scene.groups[0], "end") else 0
    for k in mirrors:
        check_integer("mirrors", k)
        if not 0 <= k < straight:
            raise ValueError(f"Argument `mirrors` must hold numbers of segments, but holds {k}.")
    cuts = jnp.concatenate([_edges(scene, at, k) for k in mirrors])
    seen = view(scene, at, cuts=cuts)
    t, w = (jnp.asarray(a, at.position.dtype) for a in gauss_legendre(nodes))
    half = 0.5 * (seen.angles[1:] - seen.angles[:-1])
    middle = 0.5 * (seen.angles[1:] + seen.angles[:-1])
    shown = jnp.any(seen.seen[:, None] == jnp.asarray(mirrors), 1)
    mirror = jnp.where(shown, seen.seen, mirrors[0])
    behind, L = _behind(scene, at, mirror, middle)
    sines = jnp.sin(seen.angles)
    E = jnp.where(behind >= 0, L, 0.0) * (sines[1:] - sines[:-1])
    if scene.environment is not None:

        def sky(k, angle):
            bounced = _bounced(scene, k, direction(at.n + angle))
            return scene.sky(jnp.arctan2(-bounced[0], bounced[1]))

        theta = middle[:, None] + half[:, None] * t
        light = jax.vmap(lambda k, row: jax.vmap(lambda a: sky(k, a))(row))(mirror, theta)
        each = half * jnp.sum(w * jnp.cos(theta) * light, 1)
        E = E + jnp.where(behind < 0, each, 0.0)
    return jnp.sum(jnp.where(shown, scene.material.mirror[mirror] * E, 0.0))


def _reflected(scene: Scene, k: int, points: Float[Array, "m 2"]) -> Float[Array, "m 2"]:
    """Points on the other side of a mirror."""
    frame = scene.frame(k, 0.5)
    height = (points - frame.position) @ frame.normal
    return points - 2.0 * height[:, None] * frame.normal


def _edges(scene: Scene, at: Receiver, k: int) -> Float[Array, "m 2"]:
    """Images of the scene's edges in a mirror."""
    eye = _reflected(scene, k, at.position[None])[0]
    points, valid = scene.silhouettes(eye)
    points = jnp.where(valid[:, None], points, eye + at.normal)
    breaks = getattr(scene.environment, "breaks", None)
    edges = _reflected(scene, k, points)
    if breaks is None:
        return edges
    bounced = jax.vmap(lambda a: _bounced(scene, k, direction(a)))(breaks)
    # So far away that the place of the receiver rounds off no digit of the direction.
    far = own_unit(scene.groups) + power_of_two(at.position)
    return jnp.concatenate([edges, at.position + far * bounced])


def _bounced(scene: Scene, k, along: Float[Array, "2"]) -> Float[Array, "2"]:
    """A direction after its reflection."""
    normal = scene.frame(k, 0.5).normal
    return along - 2.0 * jnp.sum(along * normal) * normal


def _behind(scene: Scene, at: Receiver, mirror, angles):
    """Shape that each gap shows in its mirror, and the radiance of that side."""
    fixed, here = jax.lax.stop_gradient((scene, at))
    along = jax.vmap(direction)(here.n + jax.lax.stop_gradient(angles))
    t, _ = jax.vmap(lambda k, d: fixed.hit(k, here.position, d))(mirror, along)
    there = here.position + jnp.where(jnp.isfinite(t), t, 0.0)[:, None] * along
    bounced = jax.vmap(lambda k, d: _bounced(fixed, k, d))(mirror, along)
    shape = first_shape(fixed, there, bounced, mirror)

    def side(k, o, d):
        _, v, _ = fixed.motion(k, fixed.hit(k, o, d)[1])
        return jnp.where(v[0] * d[1] - v[1] * d[0] < 0.0, FRONT, BACK)

    number = jnp.maximum(shape, 0)
    sides = jax.vmap(side)(number, there, bounced)
    return shape, scene.material.emission[number, sides]
