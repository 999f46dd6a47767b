"""The shadow light field of any scene of flatland, traced; its irradiance, exact.

The mapping: light and receiver lie along +x of the world, the light above. A position on either is
the world's x, and what stands at the distance d2 from the light has the light's height minus d2.
A ray (y, v) passes the world points (y + d v, height - d).
"""

from __future__ import annotations

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Float

from firstorder._argument_checks import (
    check_count,
    check_finite,
    check_kind,
    check_one,
    check_positive,
    is_concrete,
)
from firstorder.fields.spectrum import Grid
from firstorder.flatland.intersect import occluded
from firstorder.flatland.scene import Scene
from firstorder.flatland.visible import Receiver, view
from firstorder.typing import as_float


def ray_visibility(
    scene: Scene, x: ArrayLike, y: ArrayLike, light_height=1.0, d1=1.0
) -> Float[Array, "*r"]:
    """Visibility f of the rays between x on the receiver and y on the light, 0 or 1.

    Shapes named "light" and "floor" hide nothing at the rays' own ends. It has no derivative.

    Args:
        scene: the shapes, in metres.
        x: positions on the receiver, broadcast with y [m].
        y: positions on the light, broadcast with x [m].
        light_height: of the light's line in the world [m].
        d1: distance of the receiver's line below it [m].

    Raises:
        ValueError: if `d1` is not positive, or another number not finite.
        TypeError: if `scene` is no scene of flatland.

    Reference: E11 §3, Fig. 3 (c).

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.flatland import Scene, Segments, primitive
        >>> from firstorder.shadowfield import ray_visibility
        >>> scene = Scene.of(primitive(Segments((0.4, 0.5), (0.6, 0.5))))
        >>> ray_visibility(scene, jnp.array([0.5, 0.0]), 0.5).tolist()
        [0.0, 1.0]
    """
    check_kind("scene", scene, Scene, "a `Scene` of flatland")
    check_positive("d1", d1)
    for name, number in (("x", x), ("y", y), ("light_height", light_height)):
        check_finite(name, number)
    x, y, d1 = *jnp.broadcast_arrays(as_float(x), as_float(y)), as_float(d1)
    top = as_float(light_height)

    def at(along, height):
        return jnp.stack([along, jnp.broadcast_to(height, along.shape)], -1).reshape(-1, 2)

    ends = (_only(scene, name) for name in ("floor", "light"))
    hidden = occluded(scene, at(x, top - d1), at(y, top), *ends)
    return 1.0 - hidden.reshape(x.shape).astype(x.dtype)


def grid_visibility(scene: Scene, grid: Grid, light_height=1.0, d1=1.0) -> Float[Array, "nx ny"]:
    """Visibility of rays between receiver and light on a grid over (x, y), 0 or 1.

    Args:
        scene: the shapes, in metres.
        grid: over (x, y).
        light_height: of the light's line in the world [m].
        d1: distance of the receiver's line below it [m].

    Raises:
        ValueError: if `d1` is not positive.

    Example:
        >>> from firstorder.fields import Grid
        >>> from firstorder.flatland import Scene, Segments, primitive
        >>> from firstorder.shadowfield import grid_visibility
        >>> scene = Scene.of(primitive(Segments((0.0, 0.5), (1.0, 0.5))))
        >>> grid_visibility(scene, Grid((2, 2), (0.5, 0.5))).tolist()
        [[1.0, 0.0], [0.0, 0.0]]
    """
    x, y = (jnp.asarray(grid.axis(i)) for i in range(2))
    return ray_visibility(scene, x[:, None], y, light_height, d1)


def ray_visibility_by_slope(
    scene: Scene, y: ArrayLike, v: ArrayLike, light_height=1.0, d1=1.0
) -> Float[Array, "*r"]:
    """Visibility of rays by (y, v): position on the light, and offset for each metre down.

    Args:
        scene: the shapes, in metres.
        y: positions on the light, broadcast with v [m].
        v: offsets for each metre down, broadcast with y.
        light_height: of the light's line in the world [m].
        d1: distance of the receiver's line below it [m].

    Raises:
        ValueError: if `d1` is not positive.

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.flatland import Scene, Segments, primitive
        >>> from firstorder.shadowfield import ray_visibility_by_slope
        >>> scene = Scene.of(primitive(Segments((0.0, 0.5), (1.0, 0.5))))
        >>> ray_visibility_by_slope(scene, jnp.array([0.25, -0.25]), 0.0).tolist()
        [0.0, 1.0]
    """
    y, v = jnp.broadcast_arrays(as_float(y), as_float(v))
    return ray_visibility(scene, y + d1 * v, y, light_height, d1)


def _visible_length(scene: Scene, x, light_height=1.0, d1=1.0) -> Float[Array, ""]:
    """Irradiance without form factor, exact: the length of the light that one receiver sees [m].

    `h(x) = int f dy` for a uniform light, from the visible intervals; differentiable. The shape
    named "light" is the light, and x is one position. With its form factor: `flatland.irradiance`.

    Args:
        scene: with one shape named "light", along +x.
        x: position on the receiver [m].
        light_height: of the light in the world [m].
        d1: distance of the receiver below it [m].

    Reference: E11 eq. 2.

    Example:
        >>> from firstorder.flatland.library._e11 import e11_fig18b
        >>> from firstorder.shadowfield.plane.scene_rays import _visible_length
        >>> round(_visible_length(e11_fig18b(), 0.0).item(), 12)
        0.0
    """
    position = jnp.stack([as_float(x), as_float(light_height) - d1])
    seen = view(scene, Receiver(position, 0.0, _only(scene, "floor")))
    lit = seen.seen == _only(scene, "light")
    # Gaps without light may end on the horizon, whose tangent is no number.
    a, b = (jnp.where(lit, ends, 0.0) for ends in (seen.angles[:-1], seen.angles[1:]))
    return d1 * jnp.sum(jnp.where(lit, jnp.tan(b) - jnp.tan(a), 0.0))


def visible_lengths(
    scene: Scene, x: Float[ArrayLike, " n"], light_height=1.0, d1=1.0
) -> Float[Array, " n"]:
    """Length of the light that each of many receivers sees [m].

    Args:
        scene: the shapes, of which one is named "light", along +x.
        x: positions on the receiver [m].
        light_height: of the light's line in the world [m].
        d1: distance of the receiver's line below it [m].

    Raises:
        ValueError: if no shape is named "light", or it does not lie at `light_height`.
    """
    if "light" not in scene.names:
        raise ValueError('Argument `scene` must have a shape named "light", but has none.')
    if is_concrete((scene, light_height)):
        with jax.ensure_compile_time_eval():
            found = np.asarray(_heights(scene.groups, 2))[_only(scene, "light")]
        few = 8.0 * float(np.finfo(found.dtype).eps)
        if not np.allclose(found, light_height, rtol=few, atol=1e-5 * d1):
            raise ValueError(
                f"Argument `light_height` must be that of the light, {found[0]:g} to {found[1]:g}, "
                f"but is {light_height}."
            )
    return jax.vmap(lambda x: _visible_length(scene, x, light_height, d1))(as_float(x))


def depth_range(scene: Scene, light_height=1.0, samples: int = 65) -> tuple[float, float]:
    """Least and largest distance from the light of everything but light and floor, by samples.

    Args:
        scene: concrete shapes.
        light_height: of the light in the world [m].
        samples: points on each shape; ends are among them.

    Returns:
        The least and the largest one [m].

    Raises:
        ValueError: if there is nothing else, or something above the light.

    Example:
        >>> from firstorder.flatland import Scene, Segments, primitive
        >>> from firstorder.shadowfield import depth_range
        >>> depth_range(Scene.of(primitive(Segments((0.0, 0.25), (1.0, 0.75)))))
        (0.25, 0.75)
    """
    check_count("samples", samples)
    own = [_only(scene, name) for name in ("floor", "light")]
    others = [i for i in range(scene.count) if i not in own]
    if not others:
        raise ValueError("Argument `scene` must have shapes besides light and floor, but has none.")
    heights = np.asarray(_heights(scene.groups, samples))[others]
    check_finite("light_height", light_height)
    check_one("light_height", light_height)
    if light_height <= np.max(heights):
        raise ValueError(
            f"Argument `light_height` must be above all blockers, of which one is at "
            f"{np.max(heights):g} m, but is {light_height:g} m."
        )
    depths = light_height - heights
    return float(np.min(depths)), float(np.max(depths))


@eqx.filter_jit
def _heights(groups, samples: int) -> Float[Array, "n s"]:
    """Heights along each shape."""
    s = jnp.linspace(0.0, 1.0, samples)
    height = jax.vmap(lambda shape, s: shape.motion(s)[0][1], (None, 0))
    return jnp.concatenate([jax.vmap(height, (0, None))(group, s) for group in groups])


def _only(scene: Scene, name: str) -> int:
    """The number of the shape of that name, -1 if there is none."""
    return scene.names.index(name) if name in scene.names else -1
