"""Irradiance caching along lines, on planes and on surfaces: records, regions, errors.

A place has d coordinates: d = 1 along a line of flatland, d = 2 on a plane in space. Everything is
written once for both, and reads d off the arrays.

Parts:

- `caching.candidates`: places, and all that a record there would hold;
- `caching.flatland_candidates`, `caching.candidate_tables`, `caching.occlusion`: from scenes;
- `caching.distances`: split circle and split sphere, radii from distances alone;
- `caching.radii`, `caching.regions`, `caching.ellipses`: regions from derivatives;
- `caching.discontinuities`: radii from several derivatives and visual events, along a line;
- `caching.event_lines`: the same on a plane, from the lines of visual events there;
- `caching.filling`: which candidates become records;
- `caching.cache`: records, and irradiance interpolated between them;
- `caching.surface_cache`: records with normals, on curved and tilted surfaces;
- `caching.errors`: true errors, the best regions, and errors of images.
"""

from firstorder.caching.cache import Cache, Lookup, taylor
from firstorder.caching.candidate_tables import (
    CandidateTable,
    GatherDirections,
    gather_directions,
    tabulate_candidates,
)
from firstorder.caching.candidates import Candidates
from firstorder.caching.discontinuities import expected_error_with_events, radius_with_events
from firstorder.caching.distances import (
    harmonic_mean_distance,
    minimum_distance,
    neighbour_clamping,
    split_change,
    split_error,
    split_radius,
)
from firstorder.caching.ellipses import elliptic_regions, gradient_regions, semi_axes
from firstorder.caching.errors import (
    floats_per_record,
    ideal_region,
    largest_set,
    rms,
    ssim,
    true_error,
)
from firstorder.caching.event_lines import (
    EventLines,
    expected_error_with_lines,
    radius_with_lines,
)
from firstorder.caching.filling import Fit, fill, fit, random_orders
from firstorder.caching.flatland_candidates import gradient_discontinuities, scene_candidates
from firstorder.caching.occlusion import OcclusionTable, occlusion_table
from firstorder.caching.radii import (
    DEFINITIONS,
    derivative_norm,
    expected_error,
    geometric_bound,
    largest_radiance,
    radius_for,
)
from firstorder.caching.regions import CLAMPS, ValidityRegion, circular_regions, screen_limits
from firstorder.caching.surface_cache import (
    SurfaceCache,
    displacement,
    fill_surface,
    hessian_along,
)

__all__ = [
    "Candidates",
    "scene_candidates",
    "gradient_discontinuities",
    "CandidateTable",
    "GatherDirections",
    "gather_directions",
    "tabulate_candidates",
    "OcclusionTable",
    "occlusion_table",
    "DEFINITIONS",
    "derivative_norm",
    "expected_error",
    "radius_for",
    "geometric_bound",
    "largest_radiance",
    "expected_error_with_events",
    "radius_with_events",
    "EventLines",
    "expected_error_with_lines",
    "radius_with_lines",
    "CLAMPS",
    "ValidityRegion",
    "circular_regions",
    "screen_limits",
    "semi_axes",
    "elliptic_regions",
    "gradient_regions",
    "split_error",
    "split_radius",
    "split_change",
    "minimum_distance",
    "harmonic_mean_distance",
    "neighbour_clamping",
    "random_orders",
    "fill",
    "Fit",
    "fit",
    "taylor",
    "Cache",
    "Lookup",
    "SurfaceCache",
    "displacement",
    "fill_surface",
    "hessian_along",
    "true_error",
    "ideal_region",
    "largest_set",
    "rms",
    "ssim",
    "floats_per_record",
]
