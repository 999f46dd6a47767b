"""Spectral norm of small matrices."""

from __future__ import annotations

import jax.numpy as jnp
from jaxtyping import Array, Float


def spectral_norm(J: Float[Array, "*n m 2"]) -> Float[Array, "*n"]:
    """The larger singular value of matrices with two columns; its gradient is 0 at zero.

    From `J^T J`: half its trace, and half of what its eigenvalues are apart.
    """
    a, b = J[..., 0], J[..., 1]
    aa, ab, bb = jnp.sum(a * a, -1), jnp.sum(a * b, -1), jnp.sum(b * b, -1)
    apart = _length(jnp.stack([aa - bb, 2.0 * ab], -1))
    square = 0.5 * (aa + bb + apart)
    return jnp.where(square > 0, jnp.sqrt(jnp.where(square > 0, square, 1.0)), 0.0)


def _length(a: Array) -> Array:
    """Euclidean length along the last axis, with the gradient 0 at zero."""
    square = jnp.sum(a**2, -1)
    return jnp.where(square > 0, jnp.sqrt(jnp.where(square > 0, square, 1.0)), 0.0)
