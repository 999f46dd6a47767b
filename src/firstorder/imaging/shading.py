"""Shading of pixels under lamps, term by term of their gradients.

Primary rays say which shape a pixel shows, shadow rays which nodes of the lamps it sees; both have
no derivative. All that follows is closed form: the point with its curvature and bumps
(`_bumps.solid_tilted`), light, lobes and their turning (`lobe_radiance`), the camera's footprint
(`camera`). What moving shadows add is read off the same shadow rays.

There are three steps: `surface_interaction` finds the point (`imaging.facets` does for meshes),
`_shadow_rays` what is seen from there (`rendering.renderer` asks Embree), and `shade_point`
computes the pixel from both.

`imaging.images` is exact for what analytic shapes emit and hide; this is for what R07 §5.2 and §9
do with it: many pixels, bumps, separate terms, and shadow rays that may come from anywhere.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float, Int

from firstorder.conventions import shape_operator
from firstorder.imaging._area_lights import (
    LobeRadiance,
    SampledLight,
    SurfaceReflectance,
    lobe_radiance,
    shadow_edge_terms,
)
from firstorder.imaging._bumps import solid_tilted
from firstorder.imaging._reflection import SurfacePoint, surface_point
from firstorder.imaging._textures import shape_uv
from firstorder.imaging.camera import Pinhole, PixelFootprint
from firstorder.imaging.sky_lights import CosineSkyLight, oriented_light
from firstorder.imaging.surface_maps import SurfaceMaps
from firstorder.numerics._vectors import dot, orthonormal_frame, unit
from firstorder.numerics.batching import host_blocks
from firstorder.scene._primitives import BACK, FRONT
from firstorder.space.intersect import nearest
from firstorder.space.scene import Scene

BLOCK = 1024  # pixels at a time: a lamp's nodes are kept for each


class SurfaceInteraction(eqx.Module):
    """A surface point seen by a pixel, with its footprint, reflectance and curvature.

    Attributes:
        point: of the surface, bumps included.
        view: the camera's ray.
        lobe: how the surface reflects.
        S: shape operator of the surface without bumps [1/m].
    """

    point: SurfacePoint
    view: PixelFootprint
    lobe: SurfaceReflectance
    S: Float[Array, "2 2"]


class ShadedPixels(eqx.Module):
    """Radiance of pixels, its gradient, and the sizes of R07's terms; lobes apart: diffuse, glossy.

    Attributes:
        value: radiance, without what the surface itself emits [W/(m^2 sr)].
        gradient: along px and py; shadows scale it and do not move.
        edges: what moving shadows add to it.
        SV: |spatial variation|, by lobe [per m].
        DV: |directional variation| [per rad].
        CV: how fast the lobe turns (Frobenius norm) [1/m].
        CDV: |curvature-weighted directional variation| [per m].
        distance: from the eye [m].
        cosine: between the base surface's normal and the way to the eye.
        curvature: of the base surface (Frobenius norm), without bumps [1/m].
    """

    value: Float[Array, "*n"]
    gradient: Float[Array, "*n 2"]
    edges: Float[Array, "*n 2"]
    SV: Float[Array, "*n 2"]
    DV: Float[Array, "*n 2"]
    CV: Float[Array, "*n 2"]
    CDV: Float[Array, "*n 2"]
    distance: Float[Array, "*n"]
    cosine: Float[Array, "*n"]
    curvature: Float[Array, "*n"]


def surface_interaction(
    scene: Scene,
    camera: Pinhole,
    p: Float[Array, "2"],
    index: Int[Array, ""],
    finish: SurfaceMaps | None = None,
) -> SurfaceInteraction:
    """Surface point of a pixel, with curvature, bumps and the camera's footprint.

    Args:
        scene: shapes and materials.
        camera: the eye.
        p: image coordinates.
        index: of the shape that is seen there; it must be met.
        finish: bumps and textures, by the shape's number.
    """
    d = camera.direction(p)
    x, n, distance = scene.surface(index, camera.eye, d)
    back = dot(n, d) > 0.0
    front = jnp.where(back, -1.0, 1.0)
    axes = orthonormal_frame(front * n)
    T = axes[:, :2]
    S = shape_operator(T, front * jax.jacfwd(lambda x: scene.normal(index, x))(x) @ T)
    view = camera.view(p, distance, axes[:, 2])
    m = scene.material
    side = jnp.where(back, BACK, FRONT)
    lobe = SurfaceReflectance(
        m.albedo[index, side], m.specular[index], jnp.maximum(m.exponent[index], 1e-6)
    )
    plain = SurfaceInteraction(surface_point(x, axes, S), view, lobe, S)

    def uv(x):
        return scene.ask(index, lambda a: shape_uv(a, x))

    return apply_surface_maps(plain, index, front, finish, uv, lambda x: scene.normal(index, x))


def apply_surface_maps(
    at: SurfaceInteraction,
    index: Int[Array, ""],
    front: Array,
    finish: SurfaceMaps | None,
    uv: Callable[[Array], Array],
    up: Callable[[Array], Array],
) -> SurfaceInteraction:
    """Surface point with its bumps and its texture, from one without.

    Args:
        at: what is seen there of the surface by itself.
        index: the primitive's number.
        front: 1 or -1, for its front or back: a bump is a dip from behind, also in a normal map.
        finish: what it has on it.
        uv: of a position on it, where `finish` has pictures.
        up: the unit normal of its front there, of the surface by itself.
    """
    if finish is None:
        return at
    point, lobe, x = at.point, at.lobe, at.point.position
    for tilt in finish.leanings(index, uv, up):
        point = solid_tilted(point, lambda x, tilt=tilt: front * tilt(x))
    for factor in finish.factors(index, uv):
        share, slope = factor(x), jax.jacfwd(factor)(x)
        lobe = eqx.tree_at(
            lambda a: (a.albedo, a.slope),
            lobe,
            (lobe.albedo * share, lobe.slope * share + lobe.albedo * slope),
        )
    return SurfaceInteraction(point, at.view, lobe, at.S)


def _shadow_rays(
    scene: Scene, x: Float[Array, "3"], lamp: SampledLight, on: Int[Array, ""]
) -> tuple[Bool[Array, " k"], Float[Array, " k"]]:
    """Visibility of a lamp's nodes from a point, and how far along the way others are hidden.

    Args:
        scene: what may hide the lamp; it is no part of it.
        x: on a surface [m].
        lamp: its nodes.
        on: the shape on which x lies.

    Returns:
        Whether each is seen, and the share; of distant light the one that `shadow_edge_terms`
        wants.
    """
    way, _ = lamp.toward(x)
    far = jnp.sqrt(dot(way, way))
    hits = nearest(scene, jnp.broadcast_to(x, way.shape), unit(way), on)
    return node_occlusion(hits.t, far, lamp.near)


def node_occlusion(t: Array, far: Array, near: bool) -> tuple[Array, Array]:
    """Whether nodes are seen, and the share of the way at which they are not.

    Args:
        t: what stands before the nodes, infinity where nothing does [m].
        far: of the nodes; of distant light it does not count [m].
        near: whether the light is.
    """
    hidden = t < (far if near else jnp.inf)
    t = jnp.where(hidden, t, 1.0)
    return ~hidden, jnp.where(hidden, t / (far if near else 1.0 + t), 1.0)


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


def shade_point(
    at: SurfaceInteraction,
    lamps: Sequence[SampledLight | CosineSkyLight],
    shadows: Sequence[tuple[Array, Array]] | None = None,
) -> ShadedPixels:
    """Shading of one pixel, from its surface point and the visibility of nodes from there.

    Args:
        at: the point, its lobes, the camera's ray.
        lamps: the light.
        shadows: for each lamp which nodes are seen, and where the others are hidden, as
            `_shadow_rays` gives it; None if nothing is. What is below the surface on which the
            point lies is hidden by it, whatever is given here and wherever the shading normal
            leans; that this horizon turns where the surface curves is not in the gradient.

    Reference: R07 §5.2-5.3, eqs. 25-27, in space.
    """
    dtype = at.point.position.dtype
    value, gradient, edges = jnp.zeros((), dtype), jnp.zeros(2, dtype), jnp.zeros(2, dtype)
    sizes = []
    to_eye, footprint = at.view.to_eye, at.view.surface_D_p(at.point)
    for k, lamp in enumerate(lamps):
        lamp = oriented_light(lamp, at.point.base_normal)
        count = lamp.shape[0] * lamp.shape[1]
        seen, depth = jnp.ones(count, dtype), jnp.ones(count, dtype)
        if shadows is not None:
            above = lamp.toward(at.point.position)[0] @ at.point.base_normal > 0.0
            seen, depth = (
                jnp.where(above, a.astype(dtype), b)
                for a, b in zip(shadows[k], (0, 1), strict=True)
            )
        terms = lobe_radiance(lamp, seen, at.point, to_eye, at.lobe)
        value = value + sum(t.value for t in terms)
        gradient = gradient + sum(t.image_gradient(at.view, at.point) for t in terms)
        if shadows is not None and lamp.even:
            moved = shadow_edge_terms(lamp, seen, depth, at.point, to_eye, at.lobe)
            edges = edges + sum(moved) @ footprint
        sizes.append(_parts(terms))
    SV, DV, CDV = (sum(part) for part in zip(*sizes, strict=True))
    CV = jnp.stack([_size(at.point.spin), 2.0 * _size(at.point.spin)])
    return ShadedPixels(
        value, gradient, edges, _sizes(SV), _sizes(DV), CV, _sizes(CDV),
        at.view.distance, dot(at.point.base_normal, to_eye), _size(at.S),
    )  # fmt: skip


def _parts(terms: tuple[LobeRadiance, LobeRadiance]) -> tuple[Array, Array, Array]:
    """SV, DV and CDV of both lobes, to be summed over lamps before their sizes are taken."""
    return tuple(jnp.stack([getattr(t, name) for t in terms]) for name in ("SV", "DV", "CDV"))  # pyright: ignore


def _size(a: Array) -> Array:
    return jnp.sqrt(jnp.sum(a * a))


def _sizes(rows: Array) -> Array:
    return jnp.sqrt(jnp.sum(rows * rows, -1))


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
    """
    p, index = np.asarray(p, float), np.asarray(index)
    met = np.flatnonzero(index >= 0)
    return shade_rows(
        lambda p, index: _block(scene, camera, tuple(lamps), p, index, finish, shadows),
        (p, index),
        met,
        BLOCK,
    )


def shade_rows(
    shade: Callable[..., ShadedPixels],
    given: tuple[np.ndarray, ...],
    rows: np.ndarray,
    block: int,
) -> ShadedPixels:
    """Some of many pixels, shaded in blocks of one size; the others are zeros.

    Args:
        shade: from blocks of the given arrays to pixels.
        given: arrays of all pixels.
        rows: which of them to shade.
        block: pixels at a time.
    """
    count = len(given[0])
    if not len(rows):
        one, two = np.zeros(count), np.zeros((count, 2))
        return ShadedPixels(one, two, two, two, two, two, two, one, one, one)  # pyright: ignore

    def back(some):
        out = np.zeros((count, *some.shape[1:]))
        out[rows] = some
        return out

    found = host_blocks(lambda block: shade(*block), tuple(a[rows] for a in given), block)
    return jax.tree.map(back, found)


@eqx.filter_jit
def _block(scene, camera, lamps, p, index, finish, shadows: bool) -> ShadedPixels:
    return jax.vmap(lambda p, i: _shade_pixel(scene, camera, lamps, p, i, finish, shadows))(
        p, index
    )
