"""Shadows as a light field: spectra, sheared filters, sampling rates, shared shadow rays.

Parts:

- `shadowfield.plane`: the theory in flatland, spectra, filters, sampling rates;
- `shadowfield.rendering`: soft shadows in space from rays that pixels share.
"""

from firstorder.shadowfield.plane.filters import (
    RayFilter,
    axis_aligned_filter,
    reconstruct_irradiance,
    sheared_filter,
)
from firstorder.shadowfield.plane.light_field import (
    ON_LIGHT,
    ON_RECEIVER,
    PLANE,
    TWO_PLANES,
    FormFactor,
    factoring_bound,
    mean_form_factor,
    planar_blocker,
    planar_blockers,
    shadow_irradiance,
    to_two_planes,
)
from firstorder.shadowfield.plane.periodic import (
    average_occlusion_bound,
    coarsest_average_period,
    moire,
    moire_frequency,
    shadow_harmonic,
)
from firstorder.shadowfield.plane.rates import (
    SamplingRates,
    light_rate,
    light_rate_of_endless_wedge,
    receiver_rate,
    replicas_overlap,
    samples_per_receiver,
    sampling_rates,
    wedge_corners,
)
from firstorder.shadowfield.plane.scene_rays import (
    depth_range,
    grid_visibility,
    ray_visibility,
    ray_visibility_by_slope,
    visible_lengths,
)
from firstorder.shadowfield.plane.spectra import (
    PlanarShadowSpectrum,
    ShadowSpectrum,
    Wedge,
    blocker_spectrum,
    energy_outside,
    power_spectrum,
    two_plane_spectrum,
    zero_outside,
)
from firstorder.shadowfield.rendering._glossy_receivers import (
    GlossySurface,
    ShearedReflection,
    glossy_surface,
    sheared_reflection,
)
from firstorder.shadowfield.rendering.band_limit_choice import (
    BandLimitSweep,
    SelectedBandLimits,
    band_limit_sweep,
    select_band_limits,
)
from firstorder.shadowfield.rendering.depth_bounds import blocker_depths, smooth_depths
from firstorder.shadowfield.rendering.lamp import LampFrame, lamp_frame
from firstorder.shadowfield.rendering.layers import layered_shadow
from firstorder.shadowfield.rendering.ray_table import RayTable, trace_shadow_rays
from firstorder.shadowfield.rendering.sample_counts import distribute_rays, rays_per_pixel
from firstorder.shadowfield.rendering.scene_rays import own_visibility, scene_blockers
from firstorder.shadowfield.rendering.sheared_filter import (
    ShearedShadow,
    depths_under_filter,
    sheared_shadow,
)

__all__ = [
    "ON_LIGHT",
    "TWO_PLANES",
    "PLANE",
    "ON_RECEIVER",
    "planar_blocker",
    "planar_blockers",
    "to_two_planes",
    "FormFactor",
    "mean_form_factor",
    "factoring_bound",
    "shadow_irradiance",
    "blocker_spectrum",
    "two_plane_spectrum",
    "ShadowSpectrum",
    "PlanarShadowSpectrum",
    "Wedge",
    "power_spectrum",
    "energy_outside",
    "zero_outside",
    "RayFilter",
    "sheared_filter",
    "axis_aligned_filter",
    "reconstruct_irradiance",
    "SamplingRates",
    "wedge_corners",
    "receiver_rate",
    "light_rate",
    "light_rate_of_endless_wedge",
    "sampling_rates",
    "samples_per_receiver",
    "replicas_overlap",
    "shadow_harmonic",
    "average_occlusion_bound",
    "coarsest_average_period",
    "moire",
    "moire_frequency",
    "ray_visibility",
    "grid_visibility",
    "ray_visibility_by_slope",
    "visible_lengths",
    "depth_range",
    "LampFrame",
    "lamp_frame",
    "RayTable",
    "trace_shadow_rays",
    "scene_blockers",
    "own_visibility",
    "blocker_depths",
    "smooth_depths",
    "depths_under_filter",
    "sheared_shadow",
    "ShearedShadow",
    "layered_shadow",
    "GlossySurface",
    "glossy_surface",
    "sheared_reflection",
    "ShearedReflection",
    "band_limit_sweep",
    "BandLimitSweep",
    "select_band_limits",
    "SelectedBandLimits",
    "rays_per_pixel",
    "distribute_rays",
]
