"""Discontinuities of the derivatives of irradiance in space: visual events."""

from firstorder.space.discontinuities._event_table import EventsAlong
from firstorder.space.discontinuities.events import visual_events_along
from firstorder.space.discontinuities.mesh import DiscontinuityMesh, discontinuity_mesh

__all__ = [
    "EventsAlong",
    "visual_events_along",
    "DiscontinuityMesh",
    "discontinuity_mesh",
]
