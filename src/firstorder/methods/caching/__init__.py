"""Irradiance caching in flatland: radii, records, and what the choice of either costs."""

from firstorder.methods.caching.cache import Answer, Cache, Candidates, derivatives_of, taylor
from firstorder.methods.caching.errors import ideal_radius, rms, true_error
from firstorder.methods.caching.events import expected_error_with_events, radius_with_events
from firstorder.methods.caching.filling import Fit, fill, fit, interpolated, shuffled
from firstorder.methods.caching.radii import (
    CLAMPS,
    DEFINITIONS,
    Clamped,
    clamped,
    expected_error,
    radius_for,
)
from firstorder.methods.caching.split_circle import (
    harmonic_length,
    minimum_length,
    split_circle_change,
    split_circle_error,
)
from firstorder.methods.caching.surveys import kinks, survey

__all__ = [
    "survey",
    "kinks",
    "Candidates",
    "Cache",
    "Answer",
    "taylor",
    "derivatives_of",
    "DEFINITIONS",
    "CLAMPS",
    "Clamped",
    "clamped",
    "expected_error",
    "radius_for",
    "expected_error_with_events",
    "radius_with_events",
    "split_circle_error",
    "split_circle_change",
    "minimum_length",
    "harmonic_length",
    "fill",
    "Fit",
    "fit",
    "interpolated",
    "shuffled",
    "true_error",
    "ideal_radius",
    "rms",
]
