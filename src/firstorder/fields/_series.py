"""Fourier series of a factor on a window: the measure that a multiplication convolves with."""

from __future__ import annotations

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Complex, Float

from firstorder._display import Module
from firstorder.conventions import fourier_kernel
from firstorder.fields.spectrum import Grid


class Series(Module):
    """`g(u) = sum_k coefficients_k exp(2 pi i frequencies_k . u)` on a box.

    On that box the factor equals its periodic continuation, so for a field that vanishes outside
    it the product has the spectrum `sum_k c_k F(Omega - s_k)`, exactly if the sum is over all k.
    A half-plane, whose own spectrum is half a Dirac and a principal value, becomes a square wave.
    What a sum that ends leaves out is said in `Multiply`.
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
