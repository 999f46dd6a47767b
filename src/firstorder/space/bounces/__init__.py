"""Indirect light in space: radiosity, radiance maps, path tracing."""

from firstorder.space.bounces._radiance_maps import (
    RadianceMaps,
    face_layout,
    refine_maps,
    trace_maps,
)
from firstorder.space.bounces.pathtrace import path_irradiance, path_radiance
from firstorder.space.bounces.radiosity import rectangle_irradiance, solve_radiosity

__all__ = [
    "path_irradiance",
    "path_radiance",
    "rectangle_irradiance",
    "solve_radiosity",
    "RadianceMaps",
    "face_layout",
    "trace_maps",
    "refine_maps",
]
