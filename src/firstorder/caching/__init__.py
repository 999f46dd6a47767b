"""Irradiance caching, in flatland and on surfaces: records, radii, interpolation, errors.

Parts:

- `caching.candidates`, `caching.candidate_tables`, `caching.occlusion`: candidate records;
- `caching.split_circle`, `caching.split_sphere`: radii from distances alone;
- `caching.radii`, `caching.ellipses`: radii and ellipses from derivatives;
- `caching.discontinuities`: radii from several derivatives and visual events;
- `caching.filling`, `caching.surface_filling`: which candidates become records;
- `caching.cache`, `caching.surface_cache`: records, and irradiance interpolated between them;
- `caching.errors`, `caching.surface_errors`: true errors, and the best radii.
"""

from firstorder.caching.cache import Cache, Candidates, Lookup, taylor
from firstorder.caching.candidate_tables import (
    CandidateTable,
    GatherDirections,
    gather_directions,
    tabulate_candidates,
)
from firstorder.caching.candidates import gradient_discontinuities, scene_candidates
from firstorder.caching.discontinuities import expected_error_with_events, radius_with_events
from firstorder.caching.ellipses import (
    ValidityRegion,
    circular_regions,
    elliptic_regions,
    geometric_bound,
    hessian_norm,
    largest_radiance,
    semi_axes,
    surface_expected_error,
    third_derivative_norm,
)
from firstorder.caching.errors import ideal_radius, rms, true_error
from firstorder.caching.filling import Fit, fill, fit, interpolate, random_orders
from firstorder.caching.occlusion import OcclusionTable, occlusion_table
from firstorder.caching.radii import (
    CLAMPS,
    DEFINITIONS,
    Clamped,
    clamped,
    expected_error,
    radius_for,
)
from firstorder.caching.split_circle import (
    harmonic_mean_distance,
    minimum_distance,
    split_circle_change,
    split_circle_error,
)
from firstorder.caching.split_sphere import (
    neighbour_clamping,
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
from firstorder.caching.surface_filling import SurfaceFit, fill_surface, fit_surface

__all__ = [
    "scene_candidates",
    "gradient_discontinuities",
    "Candidates",
    "SurfaceCandidates",
    "CandidateTable",
    "GatherDirections",
    "gather_directions",
    "tabulate_candidates",
    "OcclusionTable",
    "occlusion_table",
    "DEFINITIONS",
    "expected_error",
    "radius_for",
    "expected_error_with_events",
    "radius_with_events",
    "hessian_norm",
    "third_derivative_norm",
    "geometric_bound",
    "largest_radiance",
    "CLAMPS",
    "Clamped",
    "clamped",
    "ValidityRegion",
    "circular_regions",
    "semi_axes",
    "elliptic_regions",
    "surface_expected_error",
    "minimum_distance",
    "harmonic_mean_distance",
    "weighted_harmonic_length",
    "neighbour_clamping",
    "split_circle_error",
    "split_circle_change",
    "split_sphere_error",
    "split_sphere_change",
    "random_orders",
    "fill",
    "Fit",
    "fit",
    "interpolate",
    "fill_surface",
    "SurfaceFit",
    "fit_surface",
    "taylor",
    "surface_taylor",
    "Cache",
    "SurfaceCache",
    "Lookup",
    "true_error",
    "surface_error",
    "ideal_radius",
    "ideal_ellipse",
    "largest_set",
    "rms",
    "ssim",
    "floats_per_record",
]
