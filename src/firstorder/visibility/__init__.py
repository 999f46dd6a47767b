"""Where light breaks: edges of blockers, the angles that they cover, and shading behind them."""

from firstorder.visibility.alpha import Alpha, circle_alpha, point_alpha, rotated, sight
from firstorder.visibility.elevation import (
    Elevation,
    limb_bend,
    limb_elevation,
    rim_bend,
    rim_elevation,
)
from firstorder.visibility.from_rays import Brackets, Limbs, bracketed, limbs
from firstorder.visibility.gradients import (
    Edges,
    Shading,
    Split,
    angular_by_parts,
    differentiated_edges,
    exposed_edges,
    shaded,
    shading,
)
from firstorder.visibility.intervals import (
    blocked_measure,
    clipped,
    exposed,
    merged,
    signed_edges,
    spanned,
    visible_gaps,
    visible_measure,
)

__all__ = [
    "Alpha",
    "point_alpha",
    "circle_alpha",
    "rotated",
    "sight",
    "Elevation",
    "limb_elevation",
    "rim_elevation",
    "limb_bend",
    "rim_bend",
    "clipped",
    "spanned",
    "exposed",
    "signed_edges",
    "merged",
    "visible_gaps",
    "visible_measure",
    "blocked_measure",
    "Edges",
    "Split",
    "Shading",
    "exposed_edges",
    "differentiated_edges",
    "shaded",
    "shading",
    "angular_by_parts",
    "Brackets",
    "Limbs",
    "bracketed",
    "limbs",
]
