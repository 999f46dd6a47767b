"""Scenes as light fields: radiance along a line, with the silhouettes for its edges."""

from firstorder.flatland.light_fields.field import LightField, facing, light_field
from firstorder.flatland.light_fields.spectrum import StraightEdges, series_in, spectrum_in

__all__ = [
    "LightField",
    "light_field",
    "facing",
    "StraightEdges",
    "series_in",
    "spectrum_in",
]
