"""Shading of pixels under lamps, term by term of their gradients.

Primary rays say which shape a pixel shows, shadow rays which nodes of the lamps it sees; both have
no derivative. All that follows is closed form: the point with its curvature and bumps
(`_bumps.solid_tilted`), light, lobes and their turning (`lobe_radiance`), the camera's footprint
(`camera`). What moving shadows add is read off the same shadow rays.

There are three steps: `surface_interaction` finds the point (`facet_interaction` on meshes),
`_shadow_rays` what is seen from there (`rendering.renderer` asks Embree), and `shade_point`
computes the pixel from both.

`imaging.images` is exact for what analytic shapes emit and hide; this is for what R07 §5.2 and §9
do with it: many pixels, bumps, separate terms, and shadow rays that may come from anywhere.
"""

from __future__ import annotations

from collections.abc import Sequence

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float, Int

from firstorder.imaging._interaction import surface_interaction
from firstorder.imaging._lamps import SampledLight
from firstorder.imaging._point_shading import (
    OF_SHADED,
    ShadedPixels,
    node_occlusion,
    oriented_light,
    shade_point,
    shade_rows,
)
from firstorder.imaging.camera import Pinhole
from firstorder.imaging.sky_lights import CosineSkyLight
from firstorder.imaging.surface_maps import SurfaceMaps
from firstorder.numerics._vectors import dot, unit
from firstorder.scene._bands import bands_of, by_band
from firstorder.scene._intersect import end_slack
from firstorder.space.intersect import nearest
from firstorder.space.scene import Scene

BLOCK = 1024  # pixels at a time: a lamp's nodes are kept for each


def _shadow_rays(
    scene: Scene, x: Float[Array, "3"], lamp: SampledLight, on: Int[Array, ""]
) -> tuple[Bool[Array, " k"], Float[Array, " k"]]:
    """Visibility of a lamp's nodes from a point, and where others are hidden.

    Args:
        scene: what may hide the lamp; it is no part of it.
        x: on a surface [m].
        lamp: its nodes.
        on: the shape on which x lies.

    Returns:
        Whether each is seen, and the depth of what hides it, as `shadow_edge_terms` has it.
    """
    way, _ = lamp.toward(x)
    far = jnp.sqrt(dot(way, way))
    hits = nearest(scene, jnp.broadcast_to(x, way.shape), unit(way), on)
    return node_occlusion(hits.t, far, lamp.near, end_slack(x, far))


def _shade_pixel(
    scene: Scene,
    camera: Pinhole,
    lamps: Sequence[SampledLight | CosineSkyLight],
    p: Float[Array, "2"],
    index: Int[Array, ""],
    finish: SurfaceMaps | None = None,
    shadows: bool = True,
) -> ShadedPixels:
    """Shading of one pixel that shows a shape.

    Args:
        scene: shapes, which may hide the lamps; what they emit does not count.
        camera: the eye.
        lamps: `even`, if shadows move.
        p: image coordinates.
        index: of the shape.
        finish: as in `surface_interaction`.
        shadows: whether rays are traced to the lamps.

    Reference: R07 §5.2-5.3, eqs. 25-27, in space.
    """
    at = surface_interaction(scene, camera, p, index, finish)
    if not shadows:
        return shade_point(at, lamps)
    held, x, on = jax.lax.stop_gradient((scene, at.point.position, index))
    n = jax.lax.stop_gradient(at.point.base_normal)
    rays = [_shadow_rays(held, x, oriented_light(lamp, n), on) for lamp in lamps]
    return shade_point(at, lamps, rays)


def shade_pixels(
    scene: Scene,
    camera: Pinhole,
    lamps: Sequence[SampledLight | CosineSkyLight],
    p: np.ndarray,
    index: np.ndarray,
    finish: SurfaceMaps | None = None,
    shadows: bool = True,
) -> ShadedPixels:
    """Shading of many pixels, in blocks of one compiled size; zeros where nothing is hit.

    Args:
        scene: as in `_shade_pixel`.
        camera: the eye.
        lamps: the light.
        p: image coordinates, shape (n, 2).
        index: of the shape at each, -1 for none.
        finish: bumps and textures.
        shadows: whether rays are traced to the lamps.

    Returns:
        Arrays of NumPy.

    Raises:
        ValueError: if there is no light.
    """
    if not lamps:
        raise ValueError("Argument `lamps` must hold a light, but is empty.")
    p, index = np.asarray(p, float), np.asarray(index)
    met = np.flatnonzero(index >= 0)
    return shade_rows(
        lambda p, index: _block(scene, camera, tuple(lamps), p, index, finish, shadows),
        (p, index),
        met,
        BLOCK,
        bands_of(scene, tuple(lamps), finish),
    )


@eqx.filter_jit
@by_band(OF_SHADED)
def _block(scene, camera, lamps, p, index, finish, shadows: bool) -> ShadedPixels:
    return jax.vmap(lambda p, i: _shade_pixel(scene, camera, lamps, p, i, finish, shadows))(
        p, index
    )
