"""What the calculus buys: how densely light must be sampled, where, and what lies between."""

from firstorder.methods.adaptive import (
    Cell,
    LineSamples,
    by_curvature,
    by_differences,
    by_disagreement,
    by_gradient,
    by_length,
    sample_line,
)
from firstorder.methods.bandwidth import BandLimit, after, band_limit, band_limits
from firstorder.methods.glossy import (
    glossy_bandwidth,
    glossy_bandwidth_in_space,
    glossy_criterion,
    occluded_bandwidth,
    occluded_criterion,
)
from firstorder.methods.interpolation import Interpolant, hermite_basis, interpolation_error
from firstorder.methods.surfaces import GridInterpolant

__all__ = [
    "BandLimit",
    "Cell",
    "GridInterpolant",
    "Interpolant",
    "LineSamples",
    "after",
    "band_limit",
    "band_limits",
    "by_curvature",
    "by_differences",
    "by_disagreement",
    "by_gradient",
    "by_length",
    "glossy_bandwidth",
    "glossy_bandwidth_in_space",
    "glossy_criterion",
    "hermite_basis",
    "interpolation_error",
    "occluded_bandwidth",
    "occluded_criterion",
    "sample_line",
]
