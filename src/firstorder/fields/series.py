"""Fourier series of a factor on a window: the measure that a multiplication convolves with."""

from __future__ import annotations

from collections.abc import Callable

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Complex, Float

from firstorder.conventions import fourier_kernel
from firstorder.fields.field import Affine
from firstorder.fields.spectrum import Grid
from firstorder.typing import Scalar


class Series(eqx.Module):
    """`g(u) = sum_k coefficients_k exp(2 pi i frequencies_k . u)` on a box.

    On that box the factor equals its periodic continuation, so for a field that vanishes outside
    it the product has the spectrum `sum_k c_k F(Omega - s_k)` exactly. A half-plane, whose own
    spectrum is half a Dirac and a principal value, becomes a square wave.
    """

    frequencies: Float[Array, "k n"]
    coefficients: Complex[Array, " k"]


def sampled_series(field, window: Grid) -> Series:
    """Series of a smooth field that vanishes at, or is periodic on, the window's border.

    Coefficients by the discrete transform of the samples. Spectrally accurate for a smooth factor.
    """
    axes = [jnp.asarray(window.frequencies(i)) for i in range(len(window.size))]
    nodes = jnp.stack(jnp.meshgrid(*axes, indexing="ij"), -1).reshape(-1, len(axes))
    c = window.sample(field)
    for i, Omega in enumerate(axes):
        kernel = fourier_kernel(Omega[:, None, None], jnp.asarray(window.axis(i))[None, :, None])
        c = jnp.moveaxis(jnp.tensordot(kernel / window.size[i], c, axes=(1, i)), 0, i)
    return Series(nodes, c.ravel())


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
        window: half of its largest size is the number of harmonics.
    """
    k = np.arange(-(max(window.size) // 2), max(window.size) // 2 + 1)
    period = high - low
    s = jnp.asarray(k)[:, None] / period
    # level = normal . u + offset: the normal carries the frequencies, the offset is a phase.
    return Series(
        s * level.normal, coefficients(k, period) * fourier_kernel(s, -level.offset[None])
    )


def stair_series(level: Affine, places: Array, heights: Array, window: Grid) -> Series:
    """Series of a stair: `heights[j]` where `places[j - 1] < level < places[j]`.

    One period is exactly the level's range on the window, where the stair falls back to its first
    height: `c_k = sum_j jump_j (exp(-2 pi i k p_j / P) - exp(-2 pi i k high / P)) / (2 pi i k)`.
    """
    low, high = level_range(level, window)
    jumps = heights[1:] - heights[:-1]
    inside = jnp.clip(places, low, high)  # a place outside the window is as good as at its border

    def coefficients(k, period):
        s = jnp.asarray(k)[:, None, None] / period
        waves = fourier_kernel(s, inside[None, :, None]) - fourier_kernel(s, high[None, None, None])
        mean = heights[0] + jnp.sum(jumps * (high - inside)) / period
        return jnp.where(k == 0, mean, waves @ jumps / (2j * np.pi * np.where(k == 0, 1, k)))

    return level_series(coefficients, level, low, high, window)


def axis_series(coefficients, normal, window: Grid, axis: int) -> Series:
    """Series of a function of one coordinate, or of the linear form `normal . u`.

    Args:
        coefficients: maps integer harmonics k (array) and the period to coefficients c_k.
        normal: direction in frequency space along which the harmonics lie.
        window: gives the period (its extent along `axis`) and the number of harmonics.
        axis: the axis of the window that is used.
    """
    period = window.extent[axis]
    half = window.size[axis] // 2
    k = np.arange(-half, half + 1)
    nodes = (k / period)[:, None] * jnp.asarray(normal)
    return Series(nodes, jnp.asarray(coefficients(k, period)) + 0j)  # real ones too
