"""Estimators of irradiance and its derivatives from rays: arc-length and stratified forms."""

from firstorder.flatland.estimators._irradiance_forms import (
    arc_length_estimate,
    arc_length_integral,
    arc_length_sum,
    stratified_estimate,
)
from firstorder.flatland.estimators.corrected import corrected_estimate
from firstorder.flatland.estimators.strata import (
    Samples,
    Strata,
    gap_quadrature,
    hemicircle_strata,
    trace_strata,
)

__all__ = [
    "Strata",
    "hemicircle_strata",
    "gap_quadrature",
    "Samples",
    "trace_strata",
    "arc_length_estimate",
    "arc_length_integral",
    "arc_length_sum",
    "stratified_estimate",
    "corrected_estimate",
]
