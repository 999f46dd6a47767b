"""Discontinuities of the derivatives of irradiance: visual events and critical lines."""

from firstorder.flatland.discontinuities._event_table import IrradianceJumps, VisualEvents
from firstorder.flatland.discontinuities.events import extrapolation_error, jumps_on, visual_events

__all__ = [
    "VisualEvents",
    "visual_events",
    "IrradianceJumps",
    "jumps_on",
    "extrapolation_error",
]
