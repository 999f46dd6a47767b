"""The wavelet portrait: Haar coefficients in the standard (tensor) decomposition."""

from __future__ import annotations

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from firstorder._argument_checks import check_shape
from firstorder._display import Module
from firstorder.conventions import Frame
from firstorder.fields._haar import haar_matrix
from firstorder.fields.field import Field
from firstorder.fields.spectrum import Grid


class Wavelet(Module):
    """Haar coefficients of cell averages, normalised in L2 of the grid's box.

    `f = sum_ij F_ij psi_i(x) psi_j(theta)` with `int psi_i psi_k = delta_ik`.
    """

    coefficients: Float[Array, "..."]
    grid: Grid
    frame: Frame = eqx.field(static=True, default=Frame())

    @classmethod
    def of(cls, field: Field, grid: Grid) -> Wavelet:
        """Coefficients of the piecewise constant field that takes the samples' values.

        Example:
            >>> from firstorder.fields import Affine, Grid, Wavelet
            >>> ramp = Wavelet.of(Affine([1.0, 0.0], 0.0), Grid((4, 4), (0.5, 0.5)))
            >>> ramp.samples()[:, 0].round(12).tolist()
            [-0.75, -0.25, 0.25, 0.75]
        """
        return cls.of_samples(grid.sample(field), grid, field.frame)

    @classmethod
    def of_samples(cls, samples: Array, grid: Grid, frame: Frame) -> Wavelet:
        """Forward transform, one matrix product per axis.

        Args:
            samples: cell averages on the grid, shape `grid.size`; each size a power of two.
            grid: where they lie.
            frame: names of the coordinates.

        Raises:
            ValueError: if the samples have another shape than the grid.

        Example:
            >>> import jax.numpy as jnp
            >>> from firstorder.conventions import Frame
            >>> from firstorder.fields import Grid, Wavelet
            >>> light = Wavelet.of_samples(jnp.ones(4), Grid((4,), (1.0,)), Frame(("x",)))
            >>> light.coefficients.tolist()  # all in the constant
            [1.9999999999999998, 0.0, 0.0, 0.0]
        """
        samples = jnp.asarray(samples)
        check_shape("samples", samples, grid.size)
        return cls(_along_axes(samples, haar_matrix) * np.sqrt(grid.cell), grid, frame)

    def samples(self) -> Float[Array, "..."]:
        """Inverse transform: the cell averages."""
        return _along_axes(self.coefficients, lambda n: haar_matrix(n).T) / np.sqrt(self.grid.cell)


def _along_axes(a: Array, matrix) -> Array:
    """Apply `matrix(n)` along every axis of `a`."""
    for i, n in enumerate(a.shape):
        a = jnp.moveaxis(jnp.tensordot(jnp.asarray(matrix(n), a.dtype), a, axes=(1, i)), 0, i)
    return a
