"""Shape of a sheared filter, and the shares of cells under it."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from firstorder._argument_checks import check_count, check_positive
from firstorder.shadowfield.rendering._weighted_sums import Sums
from firstorder.shadowfield.rendering.ray_table import Plane

Numbers = Float[np.ndarray, " n"]


class FilterShape(NamedTuple):
    """The sheared filter at receivers.

    Attributes:
        sigma: of the Gaussian across, in the receiver's plane; infinite if nothing can hide [m].
        shear: metres on the lamp for each metre across.
        touched: 1 where the receiver lies among the blockers and there is no sheared filter, 0
            where they keep away from it, and smooth in between.
    """

    sigma: Numbers
    shear: Numbers
    touched: Numbers


def filter_shape(
    d1: Numbers,
    near: Numbers,
    far: Numbers,
    Omega_y: float,
    pixel: float | Numbers,
    extent: float = np.inf,
    margin: float = 0.02,
) -> FilterShape:
    """Width and shear of the filter: `sigma = 1 / (pi W)`, never below half a pixel.

    Blockers at a single depth allow any width. But rays that are slid off the lamp are lost: of
    those slid by s extents a share 1 - |s|/2. Weighed by exp(-s^2/2), as with the largest width
    allowed, `sigma = extent / shear`, they are (int w)^2 / int w^2 = 1.833 effective ones, and 2
    with any greater width: on both axes of a square lamp that keeps 84 % of all there can be.

    Args:
        d1: depth of the receivers below the lamp [m].
        near: depth of the first blockers that can matter [m].
        far: depth of the last ones [m].
        Omega_y: band limit on the lamp [cycles/m].
        pixel: side of a pixel on the receiver [m].
        extent: half of the lamp's longer edge [m].
        margin: blockers nearer to the receiver than this share of d1 touch it; they begin to at
            three times as far.

    Reference: E11 §4, eqs. 9-10, with a Gaussian in place of the pixel's filter.

    Example:
        >>> import numpy as np
        >>> from firstorder.shadowfield.rendering._filter_shape import filter_shape
        >>> one = np.ones(1)
        >>> shape = filter_shape(one, 0.25 * one, 0.5 * one, 2.0, 0.01)
        >>> round(shape.sigma[0].item(), 6), round(shape.shear[0].item(), 6)
        (0.238732, 0.666667)
    """
    check_positive("Omega_y", Omega_y)
    check_positive("pixel", pixel)
    gap = np.where(np.isfinite(near), 1.0 - far / d1, 1.0)
    t = np.clip((3.0 * margin - gap) / (2.0 * margin), 0.0, 1.0)
    touched = t * t * (3.0 - 2.0 * t)
    some = np.isfinite(near) & (touched < 1.0)
    low, high = np.where(some, near, 0.25 * d1), np.where(some, far, 0.5 * d1)
    steep, flat = high / (d1 - high), low / (d1 - low)  # 1/a, 1/b
    width = Omega_y * (steep - flat)
    shear = 0.5 * (steep + flat)
    with np.errstate(divide="ignore"):
        sigma = np.minimum(1.0 / (np.pi * width), extent / shear)
    sigma = np.maximum(sigma, 0.5 * np.asarray(pixel))
    return FilterShape(np.where(some, sigma, np.inf), shear, touched)


def or_lit(seen: np.ndarray, sums: Sums) -> np.ndarray:
    """Filtered visibility at receivers, along the first axis; 1 where no ray has weight."""
    some = sums.square > 0.0
    return np.where(some.reshape(-1, *(1,) * (seen.ndim - 1)), seen, 1.0)


def own_share(sums: Sums, near: Numbers, shape: FilterShape) -> Numbers:
    """Share of a receiver's own rays in its answer: 1 where a blocker is known and no ray weighs.

    Args:
        sums: under the filter.
        near: depth of the first blockers, infinity for none [m].
        shape: of the filter.
    """
    return np.where(np.isfinite(near) & (sums.square == 0.0), 1.0, shape.touched)


def cell_shares(cells: int, falloff: Callable[[Plane], Numbers] | None = None) -> Numbers:
    """Fractions of the light that the lamp's cells emit; they add to 1.

    Args:
        cells: along each edge of the lamp.
        falloff: of the light, from places in [-1, 1]^2; None for a constant.

    Raises:
        ValueError: if `cells` is not positive, or the light is negative or dark everywhere.
    """
    check_count("cells", cells)
    if falloff is None:
        return np.full(cells**2, 1.0 / cells**2)
    x = (2.0 * np.arange(8 * cells) + 1.0) / (8 * cells) - 1.0
    places = np.stack(np.meshgrid(x, x, indexing="ij"), -1)
    light = np.asarray(falloff(places.reshape(-1, 2)), float)
    if np.any(light < 0.0) or not np.sum(light) > 0.0:
        raise ValueError("Argument `falloff` must be positive somewhere and negative nowhere.")
    light = light.reshape(cells, 8, cells, 8).sum((1, 3)).ravel()
    return light / np.sum(light)
