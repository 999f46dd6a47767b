"""Numerical tools: quadrature and its errors, roots, batches, vectors, positive numbers."""

from firstorder.numerics._batching import batched, host_blocks, in_batches
from firstorder.numerics._positive import free_of, positive
from firstorder.numerics._quadrature import gauss_legendre
from firstorder.numerics._refinement import Approximation
from firstorder.numerics._vectors import (
    cross,
    dot,
    inverse_3x3,
    matvec,
    norm,
    orthonormal_frame,
    unit,
)

__all__ = [
    "host_blocks",
    "batched",
    "gauss_legendre",
    "Approximation",
    "dot",
    "cross",
    "norm",
    "unit",
    "orthonormal_frame",
    "matvec",
    "inverse_3x3",
    "in_batches",
    "positive",
    "free_of",
]
