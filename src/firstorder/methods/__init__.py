"""What the calculus buys: how densely light must be sampled."""

from firstorder.methods.bandwidth import (
    BandLimit,
    after,
    band_limit,
    band_limits,
    glossy_bandwidth,
    glossy_bandwidth_in_space,
    glossy_criterion,
    occluded_bandwidth,
    occluded_criterion,
)
from firstorder.methods.interpolation import Interpolant, hermite_basis, interpolation_error

__all__ = [
    "BandLimit",
    "Interpolant",
    "after",
    "band_limit",
    "band_limits",
    "glossy_bandwidth",
    "glossy_bandwidth_in_space",
    "glossy_criterion",
    "hermite_basis",
    "interpolation_error",
    "occluded_bandwidth",
    "occluded_criterion",
]
