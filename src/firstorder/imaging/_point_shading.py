"""Shading of one pixel from its surface point and the nodes of the lamps that it sees."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Float

from firstorder._display import Module
from firstorder.imaging._area_lights import LobeRadiance, lobe_radiance, shadow_edge_terms
from firstorder.imaging._interaction import SurfaceInteraction
from firstorder.imaging._lamps import SampledLight
from firstorder.imaging.sky_lights import CosineSkyLight, Direction
from firstorder.numerics._batching import host_blocks
from firstorder.numerics._vectors import dot


class ShadedPixels(Module):
    """Radiance of pixels, its gradient, and the sizes of R07's terms; lobes apart: diffuse, glossy.

    Bands have an axis behind that of pixels, in all but CV, distance, cosine and curvature.

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

    value: Float[Array, "*n_bands"]
    gradient: Float[Array, "*n_bands 2"]
    edges: Float[Array, "*n_bands 2"]
    SV: Float[Array, "*n_bands 2"]
    DV: Float[Array, "*n_bands 2"]
    CV: Float[Array, "*n 2"]
    CDV: Float[Array, "*n_bands 2"]
    distance: Float[Array, "*n"]
    cosine: Float[Array, "*n"]
    curvature: Float[Array, "*n"]


# Where the leaves of `ShadedPixels` have bands, for `scene._bands.by_band`.
OF_SHADED = (-1, -2, -2, -2, -2, None, -2, None, None, None)


def node_occlusion(t: Array, far: Array, near: bool, slack: ArrayLike = 0.0) -> tuple[Array, Array]:
    """Whether nodes are seen, and where they are not: depths as `shadow_edge_terms` has them.

    Args:
        t: what stands before the nodes, infinity where nothing does [m].
        far: of the nodes; of distant light it does not count [m].
        near: whether the light is.
        slack: how close to a near light nothing hides it [m].
    """
    hidden = t < (far - slack if near else jnp.inf)
    return ~hidden, jnp.where(hidden, t / far if near else t, 0.0)


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
            `_shadow_rays` gives it; None if nothing is hidden, not even by the surface itself. Else
            what is below the surface on which the point lies is hidden by it, whatever is given
            here and wherever the shading normal leans; that this horizon turns where the surface
            curves is not in the gradient.

    Reference: R07 §5.2-5.3, eqs. 25-27, in space.
    """
    dtype, to_eye, found = at.point.position.dtype, at.view.to_eye, []
    for k, lamp in enumerate(lamps):
        lamp = oriented_light(lamp, at.point.base_normal)
        count = lamp.shape[0] * lamp.shape[1]
        seen, depth = jnp.ones(count, dtype), jnp.zeros(count, dtype)
        if shadows is not None:
            above = lamp.toward(at.point.position)[0] @ at.point.base_normal > 0.0
            seen, depth = (jnp.where(above, a.astype(dtype), 0.0) for a in shadows[k])
        terms = lobe_radiance(lamp, seen, at.point, to_eye, at.lobe)
        moved = jnp.zeros((2, 2), dtype)
        if shadows is not None and lamp.even:
            moved = jnp.stack(shadow_edge_terms(lamp, seen, depth, at.point, to_eye, at.lobe))
        found.append((terms, moved))
    return shaded_pixel(at, found)


def shaded_pixel(
    at: SurfaceInteraction,
    found: Sequence[tuple[tuple[LobeRadiance, LobeRadiance], Float[Array, "2 2"]]],
) -> ShadedPixels:
    """Pixel under all lights, from the terms of each, and from what moving shadows add to them.

    Args:
        at: as in `shade_point`.
        found: for each light the terms of both lobes, and along t and b what shadows add to each.
    """
    value = sum(t.value for terms, _ in found for t in terms)
    gradient = sum(t.image_gradient(at.view, at.point) for terms, _ in found for t in terms)
    edges = sum(jnp.sum(moved, 0) for _, moved in found) @ at.view.surface_D_p(at.point)
    SV, DV, CDV = (sum(part) for part in zip(*(_parts(terms) for terms, _ in found), strict=True))
    CV = jnp.stack([_size(at.point.spin), 2.0 * _size(at.point.spin)])
    return ShadedPixels(
        value, gradient, edges, _sizes(SV), _sizes(DV), CV, _sizes(CDV),
        at.view.distance, dot(at.point.base_normal, at.view.to_eye), _size(at.S),
    )  # fmt: skip


def _parts(terms: tuple[LobeRadiance, LobeRadiance]) -> tuple[Array, Array, Array]:
    """SV, DV and CDV of both lobes, to be summed over lamps before their sizes are taken."""
    return tuple(jnp.stack([getattr(t, name) for t in terms]) for name in ("SV", "DV", "CDV"))  # pyright: ignore


def _size(a: Array) -> Array:
    return jnp.sqrt(jnp.sum(a * a))


def _sizes(rows: Array) -> Array:
    return jnp.sqrt(jnp.sum(rows * rows, -1))


def shade_rows(
    shade: Callable[..., ShadedPixels],
    given: tuple[np.ndarray, ...],
    rows: np.ndarray,
    block: int,
    bands: int | None = None,
    abreast: int = 1,
) -> ShadedPixels:
    """Some of many pixels, shaded in blocks of one size; the others are zeros.

    Args:
        shade: from blocks of the given arrays to pixels.
        given: arrays of all pixels.
        rows: which of them to shade.
        block: pixels at a time.
        bands: of what is seen, if it has any.
        abreast: blocks that are shaded at a time, by threads.
    """
    count = len(given[0])
    if not len(rows):
        more = () if bands is None else (bands,)
        L, D = jnp.zeros((count, *more)), jnp.zeros((count, *more, 2))
        one, two = jnp.zeros(count), jnp.zeros((count, 2))
        dark = ShadedPixels(L, D, D, D, D, two, D, one, one, one)
        return jax.tree.map(np.array, dark)

    def back(some):
        out = np.zeros((count, *some.shape[1:]))
        out[rows] = some
        return out

    found = host_blocks(lambda block: shade(*block), tuple(a[rows] for a in given), block, abreast)
    return jax.tree.map(back, found)


def oriented_light(light: SampledLight | CosineSkyLight, n: Direction) -> SampledLight:
    """Light as a surface of unit normal n sees it: nodes of a `CosineSkyLight` stand about it."""
    return light.about(n) if isinstance(light, CosineSkyLight) else light
