"""Shadow rays through scenes of analytic shapes: what `trace_shadow_rays` asks, and own rays.

For meshes that is `rendering.mesh_blockers`.
"""

from __future__ import annotations

from typing import Any

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int

from firstorder._argument_checks import check_count, check_index, check_kind, check_shape
from firstorder.numerics._batching import host_blocks
from firstorder.scene._intersect import end_slack
from firstorder.shadowfield.rendering._below import where_below
from firstorder.shadowfield.rendering.lamp import LampFrame, _receiver_rows
from firstorder.shadowfield.rendering.ray_table import Blockers
from firstorder.space.intersect import nearest, occluded
from firstorder.space.scene import Scene

BLOCK = 1024  # rays at once


def scene_blockers(scene: Scene, on: int = -1) -> Blockers:
    """First and last distance at which rays are hidden, as `trace_shadow_rays` asks for it.

    Args:
        scene: what hides; the lamp must not be in it.
        on: number of the shape on which all receivers lie, -1 for none.

    Returns:
        From receivers and places on the lamp, shape (n, 3) each, to shares of the way from the lamp
        of the first and the last thing in between; infinity and minus infinity for a free ray.

    Raises:
        TypeError: if `scene` is no scene of space, or `on` no integer.
        ValueError: if there is no shape `on`.

    Example:
        >>> import numpy as np
        >>> from firstorder.shadowfield import scene_blockers
        >>> from firstorder.space import Scene, primitive, sphere
        >>> ball = Scene.of(primitive(sphere((0.0, 0.0, 1.0), 0.5)))
        >>> found = scene_blockers(ball)(np.zeros((1, 3)), np.array([[0.0, 0.0, 4.0]]))
        >>> [a.tolist() for a in found]
        [[0.625], [0.875]]
    """
    _check_on(scene, on)

    def between(receivers: np.ndarray, lamp: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        near, far = host_blocks(lambda rays: _between(scene, *rays, on), (receivers, lamp), BLOCK)
        return np.asarray(near), np.asarray(far)

    return between


def _check_on(scene: Any, on: Any) -> None:
    """Refuse what is no scene, and numbers of shapes that are not in it; -1 stands for none."""
    check_kind("scene", scene, Scene, "a `Scene` of space")
    on = np.asarray(on)
    check_index("on", np.where(on == -1, 0, on), scene.count)


@eqx.filter_jit
def _between(scene: Scene, a: Array, b: Array, on: int) -> tuple[Array, Array]:
    way = b - a
    far = jnp.sqrt(jnp.sum(way**2, 1))
    along = way / far[:, None]
    step = end_slack(jnp.maximum(jnp.abs(a), jnp.abs(b)), far)
    last = nearest(scene, a, along, on).t
    first = step + nearest(scene, b - step[:, None] * along, -along).t
    hidden = (last < far - step) & (first < far)
    return jnp.where(hidden, first / far, jnp.inf), jnp.where(hidden, 1.0 - last / far, -jnp.inf)


def own_visibility(
    scene: Scene,
    lamp: LampFrame,
    points: Float[np.ndarray, "m 3"],
    on: Int[np.ndarray, " m"],
    strata: int,
    seed: int = 0,
) -> Float[np.ndarray, " m"]:
    """The share of the lamp that each point sees, by stratified rays of its own: unbiased.

    It errs by some `strata^(-3/2)` where an edge crosses the lamp.

    Args:
        scene: what hides; the lamp must not be in it.
        lamp: the lamp.
        points: in the world [m].
        on: number of the shape on which each lies, -1 for none.
        strata: along each edge of the lamp, one ray in each.
        seed: of the random numbers.

    Returns:
        NaN for points that are nowhere or not below the lamp.

    Raises:
        TypeError: if `scene` is no scene of space, or `on` holds no integers.
        ValueError: if `strata` is not positive, there is no shape `on`, or not one number of a
            shape for each point.

    Example:
        >>> import numpy as np
        >>> from firstorder.shadowfield import lamp_frame, own_visibility
        >>> from firstorder.space import Scene, box, primitive
        >>> card = Scene.of(primitive(box((-9.0, -9.0, 1.0), (0.0, 9.0, 1.1))))  # hides x < 0
        >>> lamp = lamp_frame((0, 0, 2), (0, 1, 0), (1, 0, 0))
        >>> own_visibility(card, lamp, np.zeros((1, 3)), np.array([-1]), 4).tolist()
        [0.5]
    """
    _check_on(scene, on)
    check_count("strata", strata)
    points = _receiver_rows(points)
    check_shape("on", np.asarray(on), (len(points),))
    rng, count = np.random.default_rng(seed), strata**2
    cell = np.stack(np.meshgrid(np.arange(strata), np.arange(strata), indexing="ij"), -1)
    u = (cell.reshape(-1, 2) + rng.random((len(points), count, 2))) * 2.0 / strata - 1.0

    def answer(points, on, u) -> Float[np.ndarray, " m"]:
        y = (u * lamp.half).reshape(-1, 2)
        ends = lamp.world(np.append(y, np.zeros((len(y), 1)), 1))
        rays = np.repeat(points, count, 0), ends, np.repeat(on, count)
        hidden = host_blocks(lambda rays: _occluded(scene, *rays), rays, BLOCK)
        return 1.0 - np.mean(hidden.reshape(-1, count), 1)

    return where_below(lamp, points, answer, np.asarray(on), u)


@eqx.filter_jit
def _occluded(scene: Scene, a: Array, b: Array, on: Array) -> Array:
    return occluded(scene, a, b, on)
