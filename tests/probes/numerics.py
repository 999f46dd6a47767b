"""Probes of quadrature, short vectors and batches."""

import jax.numpy as jnp

from firstorder import numerics, scene
from firstorder.flatland import Receiver
from firstorder.numerics import _batching, _quadrature, _refinement, _small_matrices


def vectors(s):
    """One that varies and the zero vector, at which lengths have a corner."""
    return jnp.stack([jnp.stack([s, 1.0, -s]), jnp.zeros(3)])


def bent(s):
    """A matrix that is not symmetric."""
    return jnp.diag(jnp.stack([s, 0.5 + s, 1.0])) + 0.1 * jnp.arange(9.0).reshape(3, 3)


def cut(s):
    """An interval that a break cuts, and that another misses."""
    return -s, 2.0 * s, [0.5 * s, 3.0 + s]


PROBES = {
    "numerics._quadrature.composite_gauss_legendre": lambda s: _quadrature.composite_gauss_legendre(
        *cut(s), 3
    ),
    "numerics.Approximation": lambda s: _refinement.approximated(lambda step: (1.0 + step) * s),
    "numerics.cross": lambda s: numerics.cross(vectors(s), bent(s)[:2]),
    "numerics.dot": lambda s: numerics.dot(vectors(s), bent(s)[:2]),
    "numerics.in_batches": lambda s: numerics.in_batches(jnp.sin, s * jnp.arange(3.0), 2),
    "numerics._batching.in_blocks": lambda s: _batching.in_blocks(jnp.sin, s * jnp.arange(3.0), 2),
    "numerics.inverse_3x3": lambda s: numerics.inverse_3x3(bent(s)),
    "numerics._quadrature.inverse_sqrt_panels": lambda s: _quadrature.inverse_sqrt_panels(
        jnp.stack([-s, s, s, 2.0 * s]), 3
    ),
    "numerics.matvec": lambda s: numerics.matvec(bent(s), vectors(s)),
    "numerics.norm": lambda s: numerics.norm(vectors(s)),
    "numerics.orthonormal_frame": lambda s: numerics.orthonormal_frame(
        jnp.stack([jnp.stack([0.6 * jnp.cos(s), 0.6 * jnp.sin(s), -0.8]), jnp.eye(3)[2]])
    ),
    "numerics._quadrature.sorted_breaks": lambda s: _quadrature.sorted_breaks(*cut(s)),
    "numerics.positive": lambda s: numerics.positive(jnp.stack([s, -s, 100.0 * s]), 0.2),
    "numerics.free_of": lambda s: numerics.free_of(jnp.stack([s, 100.0 * s]), 0.2),
    "numerics.unit": lambda s: numerics.unit(vectors(s)),
    "numerics.batched": lambda s: numerics.batched(lambda u: s * u)(jnp.ones((2, 3), s.dtype)),
    "numerics._small_matrices.inner": lambda s: _small_matrices.inner(
        jnp.stack([s, 2.0 * s]), jnp.stack([s, -s])
    ),
    "numerics._small_matrices.product": lambda s: _small_matrices.product(
        jnp.stack([jnp.stack([s, s]), jnp.stack([-s, s])]), jnp.stack([s, s])
    ),
    "numerics._small_matrices.quadratic": lambda s: _small_matrices.quadratic(
        jnp.stack([jnp.stack([s, s]), jnp.stack([-s, s])]), jnp.stack([s, s])
    ),
    "numerics._small_matrices.congruence": lambda s: _small_matrices.congruence(
        jnp.stack([jnp.stack([s, s]), jnp.stack([-s, s])]), s * jnp.eye(2, dtype=s.dtype)
    ),
    "scene.Derivatives": lambda s: scene.Derivatives(s, s[None], s[None, None], ("x",)).second,
    "scene.derivatives": lambda s: scene.derivatives(
        lambda at: s * at.n**2, Receiver(jnp.stack([s, s]), s)
    ).along(s),
    "scene.line_derivatives": lambda s: scene.line_derivatives(lambda x: s * x**2, s),
}
