"""Band limits of light and sampling rates of image pixels: how densely light must be sampled."""

from firstorder.bandwidth.band_limits import (
    BandLimit,
    band_limit,
    band_limit_after,
    path_band_limits,
)
from firstorder.bandwidth.curved_mirror import (
    glossy_bandwidth,
    glossy_bandwidth_in_space,
    glossy_criterion,
    occluded_bandwidth,
    occluded_criterion,
)
from firstorder.bandwidth.pits import (
    PitCutoffs,
    pit_brdf_error,
    pit_cutoffs,
    pit_texture_error,
)
from firstorder.bandwidth.pixel_rates import (
    blocker_distance,
    diffuse_bandwidth_map,
    glossy_bandwidth_map,
    mean_inverse_distance,
    radians_per_pixel,
    rms_cutoff,
    sampling_density,
)
from firstorder.bandwidth.relief import (
    brdf_relief_error,
    bump_relief_error,
    flat_relief_error,
    relief_cutoffs,
)
from firstorder.bandwidth.relief_brdf import (
    relief_transfer,
    shape_transfer,
    shape_transfer_in_space,
)
from firstorder.bandwidth.relief_numbers import Relief
from firstorder.bandwidth.relief_shapes import (
    ReliefCutoffs,
    brdf_shape_error,
    bump_shape_error,
    flat_shape_error,
    shape_cutoffs,
)
from firstorder.bandwidth.screen_space import (
    PixelDifferences,
    pixel_differences,
    screen_diffuse_bandwidth,
    screen_glossy_bandwidth,
)

__all__ = [
    "BandLimit",
    "band_limit",
    "band_limit_after",
    "path_band_limits",
    "glossy_bandwidth",
    "glossy_bandwidth_in_space",
    "occluded_bandwidth",
    "glossy_criterion",
    "occluded_criterion",
    "glossy_bandwidth_map",
    "diffuse_bandwidth_map",
    "rms_cutoff",
    "mean_inverse_distance",
    "blocker_distance",
    "radians_per_pixel",
    "sampling_density",
    "PixelDifferences",
    "pixel_differences",
    "screen_glossy_bandwidth",
    "screen_diffuse_bandwidth",
    "ReliefCutoffs",
    "relief_cutoffs",
    "flat_relief_error",
    "bump_relief_error",
    "brdf_relief_error",
    "relief_transfer",
    "Relief",
    "shape_cutoffs",
    "flat_shape_error",
    "bump_shape_error",
    "brdf_shape_error",
    "shape_transfer",
    "shape_transfer_in_space",
    "PitCutoffs",
    "pit_cutoffs",
    "pit_texture_error",
    "pit_brdf_error",
]
