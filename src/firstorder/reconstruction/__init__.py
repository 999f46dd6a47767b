"""Where to put samples, and what lies between them: lines, quadtrees, triangles, filters."""

from firstorder.reconstruction.grid import GridInterpolant
from firstorder.reconstruction.hermite import Interpolant, hermite_basis, interpolation_error
from firstorder.reconstruction.line import (
    Cell,
    LineSamples,
    by_curvature,
    by_differences,
    by_disagreement,
    by_gradient,
    by_length,
    sample_line,
)

__all__ = [
    "LineSamples",
    "Cell",
    "sample_line",
    "by_length",
    "by_differences",
    "by_gradient",
    "by_curvature",
    "by_disagreement",
    "Interpolant",
    "GridInterpolant",
    "hermite_basis",
    "interpolation_error",
]
