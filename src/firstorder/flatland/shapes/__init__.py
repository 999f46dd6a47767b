"""Shapes of flatland: segments, arcs, circles, ellipses, smooth closed curves."""

from firstorder.flatland.shapes._base import Shape
from firstorder.flatland.shapes.build import box, closed_curve, polyline
from firstorder.flatland.shapes.kinds import Arcs, Circles, Curves, Ellipses, Segments

__all__ = [
    "Shape",
    "Segments",
    "Arcs",
    "Circles",
    "Ellipses",
    "Curves",
    "polyline",
    "box",
    "closed_curve",
]
