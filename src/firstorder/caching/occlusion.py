"""Occlusion-aware Hessians of irradiance at many places of a floor: a metric for records.

`space.estimators.occlusion_aware` for places on a level shape, all with the same gather rays.
"""

from __future__ import annotations

from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Float, Int

from firstorder._argument_checks import check_count, check_finite, check_index, check_shape
from firstorder._display import in_print
from firstorder.caching._records import checked_places
from firstorder.caching.candidates import Candidates
from firstorder.numerics._batching import in_batches
from firstorder.space.bounces._radiance_maps import RadianceMaps, trace_maps
from firstorder.space.estimators._triangulation import (
    HemisphereTriangulation,
    hemisphere_triangulation,
)
from firstorder.space.estimators.occlusion_aware import occlusion_aware_estimate

BATCH = 8  # places at a time: what a thousand rays of each need stays in the cache
BLOCK = 256  # places compiled for: the last block is padded


class OcclusionTable(NamedTuple):
    """Irradiance at places of a plane, with derivatives that include the motion of shadow edges.

    Attributes:
        position: [m].
        E: irradiance [W/m^2].
        gradient: [W/m^3].
        hessian: symmetric [W/m^4].
        minimum: shortest ray; infinite if none meets anything [m].
    """

    position: Float[np.ndarray, "m 2"]
    E: Float[np.ndarray, " m"]
    gradient: Float[np.ndarray, "m 2"]
    hessian: Float[np.ndarray, "m 2 2"]
    minimum: Float[np.ndarray, " m"]

    __repr__ = in_print

    def candidates(self) -> Candidates:
        """The rows as candidates for records."""
        return Candidates.of(
            self.position, self.E, self.gradient, self.hessian, minimum=self.minimum
        )


def occlusion_table(
    maps: RadianceMaps, position: ArrayLike, on: int, height: float = 0.0, rays: int = 1024
) -> OcclusionTable:
    """Occlusion-aware irradiance, gradient and Hessian at every place, from one gather each.

    What `occlusion_aware_estimate` finds, with the directions of `hemisphere_triangulation` for all
    places alike, in single precision. Some 2 ms for a place with 1024 rays, on one core.

    Valid and wrong as `occlusion_aware_estimate`: the share of edges that rays resolve, sharp ones,
    and those of curved surfaces only up to their radius over their distance.

    Args:
        maps: the light and its scene.
        position: x and y of places on a level shape that faces up (m, 2) [m].
        on: number of the shape they lie on.
        height: z of the places [m].
        rays: from each place; the largest square number within it is used.

    Raises:
        ValueError: if there are fewer than 4 rays, maps have several bands, the shape is not there,
            positions are not (m, 2), not finite or none, or the height is not finite.

    Reference: after Schwarzhaupt, Jensen and Jarosz 2012, as J12 §9 asks.

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.caching import occlusion_table
        >>> from firstorder.space import library
        >>> from firstorder.space.bounces import RadianceMaps
        >>> maps = RadianceMaps(library.j12_box(), jnp.zeros((4, 2, 2)))
        >>> occlusion_table(maps, jnp.array([[0.4, 0.3]]), on=0, rays=64).hessian.tolist()
        [[[0.0, 0.0], [0.0, 0.0]]]
    """
    check_count("rays", rays)
    check_index("on", on, maps.scene.count)
    check_shape("maps.L", maps.L, maps.L.shape[:3])
    check_finite("height", height)
    places = checked_places(position)
    if not len(places):
        raise ValueError("Argument `position` must hold at least one place, but is empty.")
    middle = np.array([*(0.5 * (places.min(0) + places.max(0))), height])
    x, single = jnp.asarray(places - middle[:2], jnp.float32), _about(middle, maps)
    net = _single(hemisphere_triangulation(rays))
    parts = []
    for start in range(0, x.shape[0], BLOCK):
        some = x[start : start + BLOCK]
        padded = jnp.concatenate([some, jnp.broadcast_to(some[-1:], (BLOCK - len(some), 2))])
        seen = _cast(single, net.directions, padded, jnp.asarray(on))
        found = (*_derived(net, *seen), jnp.min(seen[1], axis=-1))
        parts.append([np.asarray(a, float)[: len(some)] for a in found])
    columns = (np.concatenate(p) for p in zip(*parts, strict=True))
    return OcclusionTable(places, *columns)


def _about(middle: np.ndarray, maps: RadianceMaps) -> RadianceMaps:
    """Maps in single precision, of a scene moved so that a place lies at the origin.

    Far from there a number in single precision says little about where a surface lies.
    """
    groups = [eqx.tree_at(lambda g: g.center, g, g.center - middle) for g in maps.scene.groups]
    moved = eqx.tree_at(lambda m: m.scene.groups, maps, tuple(groups))
    return jax.tree.map(lambda a: a.astype(jnp.float32) if eqx.is_inexact_array(a) else a, moved)


def _single(net: HemisphereTriangulation) -> HemisphereTriangulation:
    """Directions in single precision; triangles and neighbours as arguments, not constants."""
    directions = net.directions.astype(jnp.float32)
    return HemisphereTriangulation(
        directions, jnp.asarray(net.triangles), jnp.asarray(net.neighbours)
    )


@eqx.filter_jit
def _cast(
    maps: RadianceMaps,
    directions: Float[Array, "r 3"],
    x: Float[Array, "m 2"],
    on: Int[Array, ""],
) -> tuple[Float[Array, "m r"], Float[Array, "m r"]]:
    """Radiance and distance of every ray, from places on the level z = 0."""
    along = (directions[:, 0], directions[:, 1], directions[:, 2])

    def one(place):
        x, y = (jnp.broadcast_to(a, along[0].shape) for a in place)
        seen = trace_maps(maps, (x, y, jnp.zeros_like(x)), along, on)
        return seen.radiance, seen.distance

    return in_batches(one, x, BATCH)


@eqx.filter_jit
def _derived(
    net: HemisphereTriangulation, radiance: Float[Array, "m r"], distance: Float[Array, "m r"]
) -> tuple[Array, Array, Array]:
    """Apart from the cast, so that it is compiled once for all scenes."""

    def one(seen):
        return occlusion_aware_estimate(
            seen[0], net.directions, seen[1], net.triangles, net.neighbours
        )

    return in_batches(one, (radiance, distance), BATCH)
