"""Numerical tools: quadrature, roots, batches, vectors."""

from firstorder.numerics._vectors import (
    cross,
    dot,
    inverse_3x3,
    matvec,
    norm,
    orthonormal_frame,
    unit,
)
from firstorder.numerics.batching import batched, host_blocks, host_rows, in_batches, in_blocks
from firstorder.numerics.quadrature import (
    composite_gauss_legendre,
    gauss_legendre,
    inverse_sqrt_panels,
    periodic_trapezoid,
    sorted_breaks,
)
from firstorder.numerics.small_matrices import congruence, inner, product, quadratic

__all__ = [
    "host_blocks",
    "host_rows",
    "batched",
    "inner",
    "product",
    "quadratic",
    "congruence",
    "gauss_legendre",
    "composite_gauss_legendre",
    "sorted_breaks",
    "periodic_trapezoid",
    "inverse_sqrt_panels",
    "dot",
    "cross",
    "norm",
    "unit",
    "orthonormal_frame",
    "matvec",
    "inverse_3x3",
    "in_batches",
    "in_blocks",
]
