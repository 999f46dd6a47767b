"""The jet portrait: value, gradient and Hessian of a field at a ray."""

from __future__ import annotations

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, ArrayLike, Float

from firstorder._display import Module, in_notebook
from firstorder._labelled import DataFrame, Dataset, derivatives_frame, derivatives_set
from firstorder.conventions import Frame
from firstorder.typing import as_float


class Jet(Module):
    """Value, gradient and Hessian of a light field at one ray (or at a batch of rays).

    `f(u + h) = value + gradient . h + h . hessian . h / 2 + O(h^3)`.

    A jet is numbers at one ray, so laws that look at other rays (integrate, convolve) refuse
    it; they act on a `Field`, whose `jet` method gives a jet anywhere.

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.fields import Jet
        >>> Jet(jnp.array(1.0), jnp.array([2.0, 0.0]), jnp.zeros((2, 2))).gradient[0].item()
        2.0
    """

    value: Float[Array, "*b"]
    gradient: Float[Array, "*b n"]
    hessian: Float[Array, "*b n n"]
    frame: Frame = eqx.field(static=True, default=Frame())

    _repr_markdown_ = in_notebook

    def __add__(self, other: Jet) -> Jet:
        """Sum of two jets at the same ray."""
        if not isinstance(other, Jet):
            return NotImplemented
        if self.frame != other.frame:
            raise ValueError(
                f"Argument `other` must be a jet over {self.frame.coordinates}, {self.frame.sense} "
                f"like this one, but is over {other.frame.coordinates}, {other.frame.sense}."
            )
        return jax.tree.map(jnp.add, self, other)

    def scaled(self, a) -> Jet:
        """Jet of `a f` for a constant `a`."""
        return jax.tree.map(lambda leaf: a * leaf, self)

    def to_pandas(self, unit: str = "L") -> DataFrame:
        """A table with a row for each ray: `value`, `d_x`, ..., `d_x_theta`, ...

        Args:
            unit: of the value; those of all columns stand in `attrs["units"]`.

        Raises:
            ModuleNotFoundError: without the extra `tables`.

        Example:
            >>> from firstorder.fields import gaussian
            >>> jet = gaussian((0.0, 0.0), (1.0, 1.0)).jets(0.0, 0.0)
            >>> list(jet.to_pandas())
            ['value', 'd_x', 'd_theta', 'd_x_x', 'd_x_theta', 'd_theta_x', 'd_theta_theta']
        """
        names = self.frame.coordinates
        return derivatives_frame(self.value, self.gradient, self.hessian, names, unit)

    def to_xarray(self, unit: str = "L") -> Dataset:
        """A data set of `value`, `gradient` and `hessian` over named coordinates.

        Args:
            unit: of the value.

        Raises:
            ModuleNotFoundError: without the extra `tables`.

        Example:
            >>> from firstorder.fields import gaussian
            >>> jet = gaussian((0.0, 0.0), (1.0, 1.0)).jets(0.0, 0.0)
            >>> jet.to_xarray().hessian.sel(coordinate="x", coordinate_2="x").item()
            -1.0
        """
        names = self.frame.coordinates
        parts = self.value, self.gradient, self.hessian
        return derivatives_set(*parts, names, unit, "coordinate", "ray")


def autodiff_jet(function, u: ArrayLike, frame: Frame) -> Jet:
    """Jet of any callable of a ray by `jax.grad` and `jax.hessian`: the oracle, or a fallback.

    Args:
        function: maps a ray `u` to a scalar.
        u: the ray, shape (n,).
        frame: names of the coordinates of `u`.

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.conventions import FLATLAND
        >>> from firstorder.fields import autodiff_jet
        >>> jet = autodiff_jet(lambda u: u[0] ** 2 * u[1], jnp.array([1.0, 3.0]), FLATLAND)
        >>> jet.gradient.tolist()
        [6.0, 1.0]
    """

    def first(u):
        value, gradient = jax.value_and_grad(function)(u)
        return gradient, (value, gradient)

    hessian, (value, gradient) = jax.jacfwd(first, has_aux=True)(as_float(u))
    return Jet(value, gradient, hessian, frame)
