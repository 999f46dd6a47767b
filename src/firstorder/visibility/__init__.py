"""Visibility: edges of blockers, the angles that they cover, and shading behind them."""

from firstorder.visibility._contour import segment_solid_angle, segment_vector_irradiance
from firstorder.visibility._intervals import (
    blocked_measure,
    clip_intervals,
    exposed_ends,
    interval_between,
    merge_intervals,
    signed_edges,
    visible_gaps,
    visible_measure,
)
from firstorder.visibility.edge_angles import (
    EdgeAngle,
    circle_edge_angle,
    edge_at,
    point_edge_angle,
)
from firstorder.visibility.elevation import (
    Elevation,
    contour_elevation,
    contour_elevation_hessian,
    crease_elevation,
    crease_elevation_hessian,
)
from firstorder.visibility.from_rays import (
    BracketedEdges,
    TangentPoints,
    bracket_edges,
    tangent_points,
)
from firstorder.visibility.gradients import (
    Shading,
    SplitDerivative,
    VisibilityEdges,
    angular_derivative_by_parts,
    autodiff_edges,
    shading,
    shading_derivatives,
    visible_edges,
)

__all__ = [
    "EdgeAngle",
    "point_edge_angle",
    "circle_edge_angle",
    "edge_at",
    "clip_intervals",
    "interval_between",
    "exposed_ends",
    "signed_edges",
    "merge_intervals",
    "visible_gaps",
    "visible_measure",
    "blocked_measure",
    "VisibilityEdges",
    "visible_edges",
    "autodiff_edges",
    "SplitDerivative",
    "Shading",
    "shading",
    "shading_derivatives",
    "angular_derivative_by_parts",
    "Elevation",
    "contour_elevation",
    "crease_elevation",
    "contour_elevation_hessian",
    "crease_elevation_hessian",
    "segment_solid_angle",
    "segment_vector_irradiance",
    "BracketedEdges",
    "bracket_edges",
    "TangentPoints",
    "tangent_points",
]
