"""Candidate records on a surface of flatland: irradiance, three derivatives and ray lengths."""

from __future__ import annotations

from collections.abc import Callable

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Float

from firstorder._argument_checks import check_between, check_count, check_shape
from firstorder.caching.candidates import Candidates, _checked_derivatives
from firstorder.caching.distances import harmonic_mean_distance, minimum_distance
from firstorder.conventions import direction
from firstorder.flatland.direct_lighting import Radiance, irradiance
from firstorder.flatland.discontinuities import events
from firstorder.flatland.intersect import nearest
from firstorder.flatland.scene import Scene
from firstorder.flatland.visible import Receiver, receiver
from firstorder.numerics._quadrature import gauss_legendre
from firstorder.typing import as_float

BLOCK = 128  # candidates worked on at a time
PIECES = 64  # of a shape, for its arc length


def scene_candidates(
    scene: Scene,
    index: int,
    s: ArrayLike,
    E: Callable[[Receiver], Array] | None = None,
    *,
    derivatives: int = 3,
    rays: int = 256,
) -> Candidates:
    """Candidate records at the parameters s of one surface, with exact irradiance.

    E is exact, its derivatives are in arc length and in total, so that on a
    curved surface they include its bending. Of two edges in line they are one-sided.

    Args:
        scene: shapes and lights.
        index: number of the receiving shape.
        s: parameters of the candidates on it, shape (m,), in [0, 1].
        E: irradiance of a receiver, if it is not that of the emitters alone [W/m]: `irradiance`
            with a radiance, or that of a radiosity `RadiositySolution` (exact up to E'', so
            `derivatives=2`).
        derivatives: order of the highest derivative, 1 to 3.
        rays: of the split circle, one in the middle of each of that many strata of equal cosine
            weight; sky counts as infinitely far.

    Raises:
        ValueError: if a parameter lies outside [0, 1], or for another order.

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.flatland import Scene, Segments, primitive
        >>> from firstorder.caching import scene_candidates
        >>> floor = primitive(Segments((-1.0, 0.0), (1.0, 0.0)))
        >>> lamp = primitive(Segments((0.5, 1.0), (-0.5, 1.0)), emission=1.0)
        >>> found = scene_candidates(Scene.of(floor, lamp), 0, jnp.array([0.5]), derivatives=1)
        >>> found.position.item(), found.value.round(6).item(), found.gradient.round(6).item()
        (1.0, 0.894427, 0.0)
    """
    s = as_float(s)
    check_shape("s", s, (s.size,))
    check_between("s", s, 0.0, 1.0)
    check_count("rays", rays)
    count = 1 + _checked_derivatives(derivatives)
    columns = _columns(scene, index, s, E or (lambda at: irradiance(scene, at)), count)
    x, n, shortest, mean = _geometry(scene, index, s, rays)
    return Candidates.on_line(x, columns, tilt=n, minimum=shortest, harmonic=mean)


@eqx.filter_jit
def _geometry(scene: Scene, index: int, s: Array, rays: int) -> tuple[Array, ...]:
    n = jax.vmap(lambda s: scene.frame(index, s).n)(s)
    t = _ray_lengths(scene, index, s, rays)
    return _arc_length(scene, index, s), n, minimum_distance(t), harmonic_mean_distance(t)


def _columns(scene: Scene, index: int, s: Array, E: Callable[[Receiver], Array], count: int):
    """E and its derivatives in arc length, by nesting `d/dx = (ds/dx) d/ds`."""

    def deeper(f):
        """All that f gives, and the slope of the last of it."""

        def slopes(s):
            found, tangents = jax.jvp(f, (s,), (1.0 / scene.frame(index, s).speed,))
            return (*found, tangents[-1])

        return slopes

    def columns(s):
        return (E(receiver(scene, index, s)),)

    for _ in range(count - 1):
        columns = deeper(columns)
    # A few at a time, on the host: within one compiled loop the last bit would depend on how many
    # gaps there are, and a black wall on whether it is there.
    each = eqx.filter_jit(lambda s: jax.vmap(lambda s: jnp.stack(columns(s)))(s))
    step = max(min(BLOCK, s.shape[0]), 1)
    padded = jnp.concatenate([s, jnp.broadcast_to(s[-1:], (-s.shape[0] % step,))])
    parts = [each(padded[i : i + step]) for i in range(0, max(s.shape[0], 1), step)]
    return jnp.concatenate(parts)[: s.shape[0]]


def _ray_lengths(scene: Scene, index: int, s: ArrayLike, rays: int = 256) -> Float[Array, "m r"]:
    """Lengths of stratified rays from places on a surface; infinite where one meets nothing [m].

    Args:
        scene: the shapes.
        index: number of the shape from which they start.
        s: parameters on it.
        rays: how many at each place, uniform in the sine of their angle.
    """
    sines = -1.0 + (2.0 * jnp.arange(rays) + 1.0) / rays
    at = jax.vmap(lambda s: receiver(scene, index, s))(as_float(s))
    along = direction(at.n[:, None] + jnp.arcsin(sines).astype(at.n.dtype))
    origins = jnp.broadcast_to(at.position[:, None], along.shape)
    t = nearest(scene, origins.reshape(-1, 2), along.reshape(-1, 2), index).t
    return t.reshape(along.shape[:-1])


def _arc_length(scene: Scene, index: int, s: ArrayLike) -> Float[Array, " m"]:
    """Arc length from the start of a shape to the parameters s [m].

    Whole pieces, and a part of one: at the ends of a thin ellipse the speed falls within a
    hundredth of the parameter.
    """
    s = as_float(s)
    t, w = (jnp.asarray(a, s.dtype) for a in gauss_legendre(16))
    speed = jax.vmap(jax.vmap(lambda s: scene.frame(index, s).speed))

    def between(low: Array, high: Array) -> Array:
        half = 0.5 * (high - low)[:, None]
        return jnp.sum(half * w * speed(low[:, None] + half * (1.0 + t)), -1)

    ends = jnp.linspace(0.0, 1.0, PIECES + 1, dtype=s.dtype)
    each = between(ends[:-1], ends[1:])
    whole = jnp.concatenate([jnp.zeros(1, s.dtype), jnp.cumsum(each)])
    k = jnp.clip(jnp.floor(jax.lax.stop_gradient(s) * PIECES).astype(int), 0, PIECES - 1)
    return whole[k] + between(ends[k], s)


def gradient_discontinuities(
    scene: Scene, index: int, radiance: Radiance | None = None, breaks=()
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Arc lengths of the visual events along a surface, with the jumps of E' and of E there.

    Args:
        scene: concrete shapes and lights.
        index: number of the receiving shape.
        radiance: what surfaces send out; their emission if left out.
        breaks: places (shape, parameter) at which that radiance jumps.

    Returns:
        Arrays of positions [m], jumps of E' and jumps of E, as `radius_with_events` takes them once
        the candidate's own position is subtracted.

    Raises:
        ValueError: if the scene is traced, or has no shape of this number.

    Example:
        >>> from firstorder.caching import gradient_discontinuities
        >>> from firstorder.flatland import PointLights, Scene, Segments, primitive
        >>> floor = primitive(Segments((-1.0, 0.0), (1.0, 0.0)))
        >>> blocker = primitive(Segments((0.0, 0.5), (-2.0, 0.5)))
        >>> scene = Scene.of(floor, blocker, points=PointLights((0.0, 1.0), 1.0))
        >>> x, _, steps = gradient_discontinuities(scene, 0)
        >>> x.round(9).tolist(), steps.tolist()  # the shadow ends in the middle of the floor
        ([1.0], [1.0])
    """
    jumps = events.jumps_on(scene, index, radiance, breaks)
    x = np.asarray(_arc_length(scene, index, jumps.s)) if len(jumps.s) else np.zeros(0)
    return x, jumps.jump_E1, jumps.jump_E
