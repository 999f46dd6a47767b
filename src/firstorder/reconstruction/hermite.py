"""Interpolation between samples that know their derivatives: linear, cubic and quintic Hermite.

Where a sample brings its gradient for little more than the price of its value, a curve of higher
degree goes through the same samples. Nodes may lie anywhere; a break is a node given twice, once
for each side, and nothing is interpolated across it.
"""

from __future__ import annotations

import math

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from firstorder._argument_checks import check_finite, check_not_negative, is_concrete, nan_unless
from firstorder._display import Module
from firstorder.reconstruction._cells import cell_of
from firstorder.typing import Scalar, as_float


def hermite_basis(t, data: int) -> Float[Array, "... 2 data"]:
    """Weights of the values and derivatives at both ends of a cell of unit length.

    `p(t) = sum_ik w[i, k](t) h^k f^(k)(node i)` is the polynomial of degree `2 data - 1` with these
    values and derivatives. A tensor product of cells takes one such array along each axis, so that
    the data at a corner are `d^k/dx^k d^l/dy^l f`.

    Args:
        t: place in the cell, 0 at its first node and 1 at its second.
        data: numbers known at each node: 1 the value, 2 also the slope, 3 also the second
            derivative.

    Raises:
        ValueError: if `data` is not 1, 2 or 3.

    Reference: derivations/reconstruction/hermite.py solves for them; R07 §6.3 uses them.

    Example:
        >>> from firstorder.reconstruction import hermite_basis
        >>> hermite_basis(0.5, 2).tolist()
        [[0.5, 0.125], [0.5, -0.125]]
    """
    _check_data(data)
    t = as_float(t)
    here, there = _one_end(t, data), _one_end(1.0 - t, data)
    # Seen from the other end the axis runs backwards: odd derivatives change sign.
    there = [w if k % 2 == 0 else -w for k, w in enumerate(there)]
    return jnp.stack([jnp.stack(here, -1), jnp.stack(there, -1)], -2)


def _one_end(t: Array, data: int) -> list[Array]:
    """Weights at t = 0, as products of their roots: exact zeros without cancellation."""
    s = 1.0 - t
    match data:
        case 1:
            return [s]
        case 2:
            return [(1.0 + 2.0 * t) * s * s, t * s * s]
    s3 = s * s * s
    return [(1.0 + 3.0 * t + 6.0 * t * t) * s3, t * (1.0 + 3.0 * t) * s3, 0.5 * t * t * s3]


class HermiteInterpolant(Module):
    """A piecewise polynomial through samples: degree 1, 3 or 5 by what is known at each.

    `p(x) = sum_ik w[i, k]((x - a) / h) h^k f^(k)(node i)` on the cell from a to a + h. It is
    continuous with as many derivatives as are given. It is exact for polynomials of its degree, and
    else wrong by `interpolation_error`, as long as no kink or jump lies inside a cell: put a break
    there, a node listed twice with the data of its left and of its right side.

    NaN outside of the nodes: nothing is known there.

    Args:
        nodes: positions, in rising order; equal neighbours are a break.
        data: what is known at each node, in columns: value, slope, second derivative.

    Raises:
        ValueError: if the nodes are fewer than two, do not rise or are not as many as the data.

    Reference: R07 §6.3 (Fig. 10); §8.1 draws a quadratic Bezier curve instead.

    Example:
        >>> from firstorder.reconstruction import HermiteInterpolant
        >>> cube = HermiteInterpolant([0.0, 1.0, 3.0], [[0.0, 0.0], [1.0, 3.0], [27.0, 27.0]])
        >>> cube(2.0).item()
        8.0
    """

    nodes: Float[Array, " n"] = eqx.field(converter=as_float)
    data: Float[Array, "n k"] = eqx.field(converter=as_float)

    def __check_init__(self):
        """Refuse nodes that do not rise, and data that do not fit."""
        if self.data.ndim != 2 or self.data.shape[0] != self.nodes.size or self.nodes.ndim != 1:
            raise ValueError(
                "Argument `data` must have one row per node, but has shape "
                f"{self.data.shape} for nodes of shape {self.nodes.shape}."
            )
        _check_data(self.data.shape[1])
        if self.nodes.size < 2:
            raise ValueError(f"Argument `nodes` must hold two or more, but has {self.nodes.size}.")
        check_finite("nodes", self.nodes)
        if is_concrete(self.nodes) and not bool(jnp.all(jnp.diff(self.nodes) >= 0)):
            raise ValueError("Argument `nodes` must be in rising order, but is not.")

    @property
    def degree(self) -> int:
        """Degree of the pieces: 1, 3 or 5."""
        return 2 * self.data.shape[1] - 1

    def __call__(self, x, side: str = "right") -> Float[Array, "..."]:
        """The interpolated value.

        Args:
            x: where, an array of any shape, in the unit of the nodes.
            side: which of its two values a break shows, "left" or "right".
        """
        x = as_float(x)
        i = cell_of(self.nodes, x, side)
        a, b = self.nodes[i], self.nodes[i + 1]
        h = jnp.where(b > a, b - a, 1.0)
        count = self.data.shape[1]
        # A break at the last node is a cell of no length, whose other end is its right side.
        t = (x - a) / h + jnp.where((b > a) | (side == "left"), 0.0, 1.0)
        w = hermite_basis(t, count)
        scaled = w * jnp.stack([jnp.ones_like(h), h, h * h][:count], -1)[..., None, :]
        both = jnp.stack([self.data[i], self.data[i + 1]], -2)
        rising = jnp.all(jnp.diff(self.nodes) >= 0)
        return nan_unless(rising & self._inside(x), jnp.sum(scaled * both, (-2, -1)))

    def _inside(self, x: Array) -> Array:
        """Mask of places between the ends, rounding included."""
        low, high = self.nodes[0], self.nodes[-1]
        slack = 8.0 * jnp.finfo(self.nodes.dtype).eps * jnp.maximum(jnp.abs(low), jnp.abs(high))
        return (x >= low - slack) & (x <= high + slack)

    def derivatives(self, x: Scalar) -> tuple[Scalar, Scalar, Scalar]:
        """Value, slope and second derivative of the interpolant at one place."""

        def slope(s):
            return jax.jvp(self, (s,), (jnp.ones_like(s),))

        x = as_float(x)
        (value, first), (_, second) = jax.jvp(slope, (x,), (jnp.ones_like(x),))
        return value, first, second


def interpolation_error(h, derivative, data: int, norm: str = "largest") -> Array:
    """The error of Hermite interpolation over a cell: `c h^(2 data) |f^(2 data)|`.

    With m = data, `c = 1 / (4^m (2 m)!)` is its largest magnitude: 1/8, 1/384, 1/46080. Its rms
    over the cell has `c = 1 / sqrt((4 m + 1)!)`: 1/10.95, 1/602.4, 1/78911. Equalities where the
    derivative is even over the cell, and bounds where it is the derivative's largest magnitude.

    Args:
        h: length of the cell.
        derivative: the function's derivative of order 2 data, in its unit per h^(2 data).
        data: numbers known at each node: 1, 2 or 3.
        norm: "largest" or "rms".

    Returns:
        In the function's unit; an array of the shape to which `h` and `derivative` broadcast.

    Raises:
        ValueError: if `h` is negative, `data` not 1, 2 or 3, or `norm` another word.

    Reference: derived in derivations/reconstruction/hermite.py.

    Example:
        >>> from firstorder.reconstruction import interpolation_error
        >>> interpolation_error(2.0, 1.0, 1).item()  # h^2 / 8
        0.5
    """
    _check_data(data)
    check_not_negative("h", h)
    if norm not in ("largest", "rms"):
        raise ValueError(f"Argument `norm` must be 'largest' or 'rms', but is {norm!r}.")
    h, derivative = as_float(h), as_float(derivative)
    if norm == "largest":
        c = 1.0 / (4**data * math.factorial(2 * data))
    else:
        c = 1.0 / math.sqrt(math.factorial(4 * data + 1))
    return nan_unless(h >= 0, c * h ** (2 * data) * jnp.abs(derivative))


def _check_data(data: int) -> None:
    if data not in (1, 2, 3):
        raise ValueError(f"Argument `data` must be 1, 2 or 3 numbers per node, but is {data}.")
