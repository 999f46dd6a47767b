"""How densely light must be sampled: band limits, and the rates of pixels that follow."""

from firstorder.bandwidth.band_limits import BandLimit, after, band_limit, band_limits
from firstorder.bandwidth.curved_mirror import (
    glossy_bandwidth,
    glossy_bandwidth_in_space,
    glossy_criterion,
    occluded_bandwidth,
    occluded_criterion,
)

__all__ = [
    "BandLimit",
    "after",
    "band_limit",
    "band_limits",
    "glossy_bandwidth",
    "glossy_bandwidth_in_space",
    "glossy_criterion",
    "occluded_bandwidth",
    "occluded_criterion",
]
