"""The same calculus in space: shapes, what is seen of them, and the light that they leave."""

from firstorder.scene.derivatives import Derivatives, derivatives
from firstorder.space.direct_lighting import (
    boundary_gradient,
    irradiance,
    net_visibility,
    vector_irradiance,
)
from firstorder.space.intersect import Hits, first_shape, nearest, occluded
from firstorder.space.receiver import Receiver, receiver
from firstorder.space.scene import Material, Scene, Thing, thing
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
from firstorder.space.silhouettes.analytic import Curved, Outline, Straight, outline
from firstorder.space.silhouettes.visible import Pieces, Sides, exposed

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
    "Material",
    "Thing",
    "thing",
    "Scene",
    "Receiver",
    "receiver",
    "Hits",
    "first_shape",
    "nearest",
    "occluded",
    "Straight",
    "Curved",
    "Outline",
    "outline",
    "Sides",
    "Pieces",
    "exposed",
    "net_visibility",
    "irradiance",
    "vector_irradiance",
    "boundary_gradient",
    "Derivatives",
    "derivatives",
]
