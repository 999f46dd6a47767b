"""Sampling rates of image pixels from differences between neighbours: D05 §6.2.

The rates that `pixel_rates` has in closed form, without curvatures: slants, distances and
anisotropy come for nothing, and silhouettes are no smooth surface.
"""

from __future__ import annotations

from typing import NamedTuple

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int

from firstorder._argument_checks import (
    check_coordinates,
    check_kind,
    check_shape,
    nan_unless,
)
from firstorder._display import in_print
from firstorder.bandwidth._spectral_norm import reach, spectral_norm
from firstorder.bandwidth.pixel_rates import _bands
from firstorder.typing import RealLike, as_float


class PixelDifferences(NamedTuple):
    """Differences between a pixel and the next; the last axis holds those along px and py.

    Attributes:
        mirrored: direction [per pixel].
        normal: direction [per pixel].
        moved: position across the mirrored direction [m per pixel].
        position: [m per pixel].

    Example:
        >>> import numpy as np
        >>> from firstorder.bandwidth import PixelDifferences
        >>> none = np.zeros((1, 1, 3, 2))
        >>> PixelDifferences(none, none, none, none).moved.shape
        (1, 1, 3, 2)
    """

    mirrored: Float[np.ndarray | Array, "w h 3 2"]
    normal: Float[np.ndarray | Array, "w h 3 2"]
    moved: Float[np.ndarray | Array, "w h 3 2"]
    position: Float[np.ndarray | Array, "w h 3 2"]

    __repr__ = in_print


def pixel_differences(
    position: Float[np.ndarray, "w h 3"],
    normal: Float[np.ndarray, "w h 3"],
    eye: Float[np.ndarray | Array, "3"],
    label: Int[np.ndarray | Array, "w h"],
) -> PixelDifferences:
    """Differences between neighbours of the same label; 0 where a pixel has no such neighbour.

    Args:
        position: at each pixel, first axis across [m].
        normal: unit.
        eye: [m].
        label: what each pixel shows.

    Raises:
        ValueError: if an array has another shape.

    Reference: D05 §6.2: "directly in screen-space with finite-difference approximation".

    Example:
        >>> import numpy as np
        >>> from firstorder.bandwidth import pixel_differences
        >>> x = np.stack(np.meshgrid(np.arange(3.0), np.arange(2.0), [0.0], indexing="ij"), -1)
        >>> up, label = np.broadcast_to((0.0, 0.0, 1.0), (3, 2, 3)), np.zeros((3, 2), int)
        >>> turns = pixel_differences(x[:, :, 0], up, np.array([1.0, 0.0, 9.0]), label)
        >>> turns.position[1, 0].tolist()  # a metre per pixel, of a floor
        [[1.0, 0.0], [0.0, 1.0], [0.0, 0.0]]
    """
    position, normal, label = np.asarray(position), np.asarray(normal), np.asarray(label)
    if position.ndim != 3:
        raise ValueError(
            f"Argument `position` must have shape (w, h, 3), but has {position.shape}."
        )
    check_coordinates("position", position)
    check_shape("normal", normal, position.shape)
    check_shape("label", label, position.shape[:2])
    check_shape("eye", np.asarray(eye), (3,))
    to_eye = np.asarray(eye) - position
    to_eye = to_eye / np.linalg.norm(to_eye, axis=-1, keepdims=True)
    mirrored = 2.0 * np.sum(normal * to_eye, -1, keepdims=True) * normal - to_eye
    r, n, x = (_differences(a, label) for a in (mirrored, normal, position))
    along = np.sum(mirrored[..., None] * x, -2, keepdims=True)
    return PixelDifferences(r, n, x - mirrored[..., None] * along, x)


def _differences(a: np.ndarray, label: np.ndarray) -> np.ndarray:
    """Mean difference to the neighbours of the same label, along both axes."""
    out = np.zeros((*a.shape, 2))
    for axis in (0, 1):
        step = np.diff(a, axis=axis)
        same = np.diff(label, axis=axis) == 0
        step = np.where(same[..., None], step, 0.0)
        total, count = np.zeros(a.shape), np.zeros(label.shape)
        for part in (slice(1, None), slice(None, -1)):
            at = (part, slice(None)) if axis == 0 else (slice(None), part)
            total[at] += step
            count[at] += same
        out[..., axis] = total / np.maximum(count, 1.0)[..., None]
    return out


def screen_glossy_bandwidth(
    cutoff: RealLike, turns: PixelDifferences, slope: RealLike = 0.0, light: RealLike = 0.0
) -> Float[Array, "w h"]:
    """Glossy bandwidth from differences: `|r_p + s x_p| cutoff + s |x_p| light` [cycles/pixel].

    x_p is what moves across the mirrored direction r. Arguments are those of
    `glossy_bandwidth_map`, numbers, or arrays with one for each pixel.

    Valid where a pixel's neighbours show the same smooth surface; errs as the square of a pixel
    inside of it, as a pixel at its border.

    Raises:
        ValueError: for an argument outside its range; traced ones, and turns that are not finite,
            give NaN.

    Reference: D05 §6.2, eqs. 20-21.

    Example:
        >>> import numpy as np
        >>> from firstorder.bandwidth import PixelDifferences, screen_glossy_bandwidth
        >>> one = np.zeros((1, 1, 3, 2))
        >>> one[0, 0, 0, 0] = 0.5  # along px alone
        >>> screen_glossy_bandwidth(1.0, PixelDifferences(one, 0 * one, one, one), slope=2.0,
        ...     light=0.25).tolist()
        [[1.75]]
    """
    check_kind("turns", turns, PixelDifferences, "what `pixel_differences` gives")
    valid = _bands(cutoff, slope, light) & _finite(turns.mirrored) & _finite(turns.moved)
    s = as_float(slope)[..., None, None]
    moved = as_float(turns.moved)
    turn = spectral_norm(as_float(turns.mirrored) + s * moved)
    sharp = as_float(slope) * spectral_norm(moved) * as_float(light)
    return nan_unless(valid, reach(turn, cutoff) + sharp)


def screen_diffuse_bandwidth(
    cutoff: RealLike, turns: PixelDifferences, slope: RealLike = 0.0, light: RealLike = 0.0
) -> Float[Array, "w h"]:
    """Diffuse bandwidth from differences: `|n_p| cutoff + s |x_p| (cutoff + light)` [cycles/pixel].

    x_p is the whole of the motion here. Arguments are those of `diffuse_bandwidth_map`, errors
    and validity those of `screen_glossy_bandwidth`; numbers, or one for each pixel.

    Raises:
        ValueError: for an argument outside its range; traced ones, and turns that are not finite,
            give NaN.

    Example:
        >>> import numpy as np
        >>> from firstorder.bandwidth import PixelDifferences, screen_diffuse_bandwidth
        >>> one = np.zeros((1, 1, 3, 2))
        >>> one[0, 0, 0, 0] = 0.5
        >>> screen_diffuse_bandwidth(1.0, PixelDifferences(0 * one, one, one, one), slope=2.0,
        ...     light=0.25).tolist()
        [[1.75]]
    """
    check_kind("turns", turns, PixelDifferences, "what `pixel_differences` gives")
    valid = _bands(cutoff, slope, light) & _finite(turns.normal) & _finite(turns.position)
    both = as_float(cutoff) + as_float(light)
    moved = as_float(slope) * spectral_norm(as_float(turns.position))
    turn = spectral_norm(as_float(turns.normal))
    return nan_unless(valid, reach(turn, cutoff) + reach(moved, both))


def _finite(turn: np.ndarray | Array) -> Array:
    return jnp.all(jnp.isfinite(as_float(turn)), (-2, -1))
