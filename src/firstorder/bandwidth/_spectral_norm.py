"""Spectral norm of small matrices, and what it makes of a cutoff."""

from __future__ import annotations

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from firstorder.numerics._select import safe_sqrt
from firstorder.typing import RealLike, as_float


def spectral_norm(J: Float[Array, "*n m 2"]) -> Float[Array, "*n"]:
    """The larger singular value of matrices with two columns; its gradient is 0 at zero.

    From `J^T J`: half its trace, and half of what its eigenvalues are apart.
    """
    # In units of the largest entry: fourth powers leave the range of single precision early.
    size = jax.lax.stop_gradient(jnp.max(jnp.abs(J), (-2, -1)))
    size = jnp.where((size > 0) & jnp.isfinite(size), size, 1.0)
    J = J / size[..., None, None]
    a, b = J[..., 0], J[..., 1]
    aa, ab, bb = jnp.sum(a * a, -1), jnp.sum(a * b, -1), jnp.sum(b * b, -1)
    apart = _length(jnp.stack([aa - bb, 2.0 * ab], -1))
    return size * safe_sqrt(0.5 * (aa + bb + apart))


def _length(a: Array) -> Array:
    """Euclidean length along the last axis, with the gradient 0 at zero."""
    return safe_sqrt(jnp.sum(a**2, -1))


def reach(turn: Array, cutoff: RealLike) -> Array:
    """`turn cutoff`: nothing where nothing turns, for endless spectra too."""
    cutoff = as_float(cutoff)
    endless = jnp.isinf(cutoff)
    # A finite product is taken as it stands: it has a slope where nothing turns yet.
    product = turn * jnp.where(endless, 1.0, cutoff)
    return jnp.where(endless, jnp.where(turn > 0.0, jnp.inf, turn), product)
