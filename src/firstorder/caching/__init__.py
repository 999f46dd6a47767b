"""Irradiance caching, in flatland and on surfaces: radii, records, what either choice costs."""

from firstorder.caching.cache import Answer, Cache, Candidates, derivatives_of, taylor
from firstorder.caching.candidates import kinks, survey
from firstorder.caching.discontinuities import expected_error_with_events, radius_with_events
from firstorder.caching.ellipses import (
    Reach,
    circles,
    curvature,
    ellipses,
    geometric_bound,
    largest_radiance,
    positive_part,
    principal,
    semi_axes,
    surface_expected_error,
    third_curvature,
)
from firstorder.caching.errors import ideal_radius, rms, true_error
from firstorder.caching.filling import Fit, fill, fit, interpolated, shuffled
from firstorder.caching.radii import (
    CLAMPS,
    DEFINITIONS,
    Clamped,
    clamped,
    expected_error,
    radius_for,
)
from firstorder.caching.split_circle import (
    harmonic_length,
    minimum_length,
    split_circle_change,
    split_circle_error,
)
from firstorder.caching.split_sphere import (
    neighbour_clamped,
    split_sphere_change,
    split_sphere_error,
    weighted_harmonic_length,
)
from firstorder.caching.surface_cache import SurfaceCache, SurfaceCandidates, surface_taylor
from firstorder.caching.surface_errors import (
    floats_per_record,
    ideal_ellipse,
    largest_set,
    ssim,
    surface_error,
)
from firstorder.caching.surface_filling import (
    SurfaceFit,
    fill_surface,
    fill_with_neighbours,
    fit_surface,
    fit_with,
)

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
    "Reach",
    "circles",
    "curvature",
    "ellipses",
    "geometric_bound",
    "largest_radiance",
    "positive_part",
    "principal",
    "semi_axes",
    "surface_expected_error",
    "third_curvature",
    "neighbour_clamped",
    "split_sphere_change",
    "split_sphere_error",
    "weighted_harmonic_length",
    "SurfaceCache",
    "SurfaceCandidates",
    "surface_taylor",
    "SurfaceFit",
    "fill_surface",
    "fill_with_neighbours",
    "fit_surface",
    "fit_with",
    "floats_per_record",
    "ideal_ellipse",
    "largest_set",
    "ssim",
    "surface_error",
]
