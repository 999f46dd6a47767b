"""The covariance portrait: second moments of the power spectrum.

`Sigma = int Omega Omega^T |F|^2 / int |F|^2 = int grad f grad f^T / (4 pi^2 int f^2)`,
in cycles squared; the second form is Parseval's. About zero frequency, not about a mean. An
edge has an infinite one.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import equinox as eqx
import jax.numpy as jnp
import numpy as np

from firstorder._argument_checks import check_shape
from firstorder._display import Module, in_notebook
from firstorder.conventions import Frame
from firstorder.fields.spectrum import Grid
from firstorder.typing import Matrix

if TYPE_CHECKING:
    from firstorder.fields.field import Field


class Covariance(Module):
    """Second-moment matrix of a power spectrum, in (cycles per unit)^2.

    Example:
        >>> from firstorder.fields import gaussian
        >>> from firstorder.fields import Covariance
        >>> S = gaussian(center=(0.3, 0.0), sigma=(1.0, 0.5)).covariance()
        >>> round(float(S.matrix[0, 0] * 8 * 3.141592653589793**2), 6)  # 1 / sigma_x^2
        1.0
    """

    matrix: Matrix
    frame: Frame = eqx.field(static=True, default=Frame())

    _repr_markdown_ = in_notebook


def covariance_of(field: Field, grid: Grid) -> Covariance:
    """Covariance of a field from its gradients on a grid, `int grad grad^T / (4 pi^2 int f^2)`.

    Spectrally accurate for a smooth field that fits in the grid.

    Args:
        field: smooth, with a jet.
        grid: holds the field.

    Example:
        >>> from firstorder.fields import Grid, covariance_of, gaussian
        >>> bell = gaussian((0.0, 0.0), (1.0, 0.5))
        >>> S = covariance_of(bell, Grid.spanning((32, 32), (6.0, 3.0)))
        >>> round(float(S.matrix[0, 0] / bell.covariance().matrix[0, 0]), 9)
        1.0
    """
    jets = field.jets(*np.moveaxis(np.asarray(grid.points()), -1, 0))
    g = jets.gradient.reshape(-1, len(grid.size))
    power = jnp.sum(jets.value**2)
    return Covariance(g.T @ g / (4.0 * np.pi**2 * power), field.frame)


def covariance_of_samples(samples, grid: Grid, frame: Frame) -> Covariance:
    """Covariance from samples alone, by the FFT: shares nothing with `covariance_of`.

    Args:
        samples: values on the grid, shape `grid.size`.
        grid: where they lie.
        frame: names of the coordinates.

    Raises:
        ValueError: if the samples have another shape than the grid.

    Example:
        >>> from firstorder.fields import Grid, covariance_of_samples, gaussian
        >>> bell, grid = gaussian((0.0, 0.0), (1.0, 0.5)), Grid.spanning((32, 32), (6.0, 3.0))
        >>> S = covariance_of_samples(grid.sample(bell), grid, bell.frame)
        >>> round(float(S.matrix[0, 0] / bell.covariance().matrix[0, 0]), 6)
        1.0
    """
    samples = jnp.asarray(samples)
    check_shape("samples", samples, grid.size)
    power = jnp.abs(jnp.fft.fftshift(jnp.fft.fftn(samples))) ** 2
    Omega = jnp.meshgrid(
        *(jnp.asarray(grid.frequencies(i)) for i in range(samples.ndim)), indexing="ij"
    )
    W = jnp.stack([o.ravel() for o in Omega])
    p = power.ravel() / jnp.sum(power)
    return Covariance((W * p) @ W.T, frame)
