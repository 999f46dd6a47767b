"""Sheared filtering of shadows in space, from shared rays."""

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
from firstorder.shadowfield.rendering.lamp import LampFrame, below, lamp_frame
from firstorder.shadowfield.rendering.layers import layered_shadow
from firstorder.shadowfield.rendering.ray_table import RayTable, trace_shadow_rays
from firstorder.shadowfield.rendering.sample_counts import distribute_rays, rays_per_pixel
from firstorder.shadowfield.rendering.sheared_filter import (
    ShearedShadow,
    depths_under_filter,
    sheared_shadow,
)

__all__ = [
    "below",
    "LampFrame",
    "lamp_frame",
    "RayTable",
    "trace_shadow_rays",
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
