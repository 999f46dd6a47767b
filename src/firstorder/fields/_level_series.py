"""Fourier series of functions of a straight level."""

from __future__ import annotations

from collections.abc import Callable

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array

from firstorder.conventions import fourier_kernel
from firstorder.fields._series import Series
from firstorder.fields.field import Affine
from firstorder.fields.spectrum import Grid
from firstorder.typing import Scalar


def level_range(level: Affine, window: Grid) -> tuple[Scalar, Scalar]:
    """Smallest and largest value of a straight level on the window."""
    n = level.normal
    middle = level.at(jnp.stack([jnp.asarray(c, n.dtype) for c in window.center]))
    reach = 0.5 * sum(abs(a) * e for a, e in zip(n, window.extent, strict=True))
    return middle - reach, middle + reach


def level_series(
    coefficients: Callable, level: Affine, low: Scalar, high: Scalar, window: Grid
) -> Series:
    """Series of a function of `s = level(u)`, periodic beyond the interval `low < s < high`.

    Args:
        coefficients: maps integer harmonics k (array) and the period `high - low` to the
            coefficients of `exp(2 pi i k s / period)`.
        level: the straight level.
        low: start of the period, at or below the level's smallest value on the window.
        high: its end, at or above the largest.
        window: half of its largest size is the number of harmonics on each side of zero.
    """
    return _level_waves(coefficients, level, low, high, max(window.size) // 2)


def _level_waves(
    coefficients: Callable, level: Affine, low: Scalar, high: Scalar, harmonics: int
) -> Series:
    """`level_series` with the harmonics counted: those from `-harmonics` to `harmonics`."""
    k = np.arange(-harmonics, harmonics + 1)
    period = high - low
    s = jnp.asarray(k)[:, None] / period
    # level = normal . u + offset: the normal carries the frequencies, the offset is a phase.
    return Series(
        s * level.normal, coefficients(k, period) * fourier_kernel(s, -level.offset[None])
    )


def stair_series(level: Affine, places: Array, heights: Array, window: Grid) -> Series:
    """Series of a stair: `heights[j]` where `places[j - 1] < level < places[j]`.

    One period is exactly the level's range on the window (see `stair_waves`).
    """
    low, high = level_range(level, window)
    return stair_waves(level, places, heights, low, high, max(window.size) // 2)


def stair_waves(
    level: Affine, places: Array, heights: Array, low: Scalar, high: Scalar, harmonics: int
) -> Series:
    """Series of a stair with the period `low < level < high`.

    At the end of the period the stair falls back to its first height:
    `c_k = sum_j jump_j (exp(-2 pi i k p_j / P) - exp(-2 pi i k high / P)) / (2 pi i k)`.

    Args:
        level: the linear form along which it varies.
        places: values of the level where it jumps, in increasing order.
        heights: one more than places.
        low: start of the period.
        high: its end.
        harmonics: how many waves on each side of zero.
    """
    jumps = heights[1:] - heights[:-1]
    inside = jnp.clip(places, low, high)  # a place outside the period is as good as at its border

    def coefficients(k, period):
        s = jnp.asarray(k)[:, None, None] / period
        waves = fourier_kernel(s, inside[None, :, None]) - fourier_kernel(s, high[None, None, None])
        mean = heights[0] + jnp.sum(jumps * (high - inside)) / period
        return jnp.where(k == 0, mean, waves @ jumps / (2j * np.pi * np.where(k == 0, 1, k)))

    return _level_waves(coefficients, level, low, high, harmonics)
