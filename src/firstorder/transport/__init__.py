"""What happens to light: physical steps that pick a law, and paths that chain them."""

from firstorder.transport.event import Chain, Event, Linearised
from firstorder.transport.mirror import Mirror
from firstorder.transport.occlusion import Occlusion, half_plane_blocker
from firstorder.transport.path import Path
from firstorder.transport.reflection import Reflection
from firstorder.transport.rotation import Curvature
from firstorder.transport.travel import Travel

__all__ = [
    "Chain",
    "Curvature",
    "Event",
    "Linearised",
    "Mirror",
    "Occlusion",
    "Path",
    "Reflection",
    "Travel",
    "half_plane_blocker",
]
