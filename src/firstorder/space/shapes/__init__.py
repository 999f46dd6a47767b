"""Shapes of space, each an affine image of a canonical one."""

from firstorder.space.shapes.build import (
    box,
    cylinder,
    disc,
    ellipsoid,
    plane,
    polygon,
    rectangle,
    sphere,
    triangle,
)
from firstorder.space.shapes.kinds import (
    Boxes,
    Cylinders,
    Discs,
    Ellipsoids,
    Planes,
    Rectangles,
    Shape,
    Triangles,
)

__all__ = [
    "Shape",
    "Ellipsoids",
    "Boxes",
    "Cylinders",
    "Discs",
    "Rectangles",
    "Triangles",
    "Planes",
    "sphere",
    "ellipsoid",
    "box",
    "cylinder",
    "disc",
    "rectangle",
    "triangle",
    "polygon",
    "plane",
]
