"""A world small enough to be exact: shapes, scenes, what is seen, and the light that arrives."""

from firstorder.flatland.direct_lighting import (
    derivatives_on_shape,
    gathered,
    irradiance,
)
from firstorder.flatland.intersect import Hits, nearest, occluded
from firstorder.flatland.mirrors import in_mirrors
from firstorder.flatland.scene import Frenet, Material, PointLights, Scene, Thing, thing
from firstorder.flatland.shapes.build import box, closed_curve, polyline
from firstorder.flatland.shapes.kinds import Arcs, Circles, Curves, Ellipses, Segments
from firstorder.flatland.skies import ConstantSky, GaussianSky, RowSky
from firstorder.flatland.visible import Receiver, View, receiver, view
from firstorder.scene.derivatives import Derivatives, derivatives

__all__ = [
    "Segments",
    "Arcs",
    "Circles",
    "Ellipses",
    "Curves",
    "polyline",
    "box",
    "closed_curve",
    "Thing",
    "thing",
    "Material",
    "PointLights",
    "ConstantSky",
    "GaussianSky",
    "RowSky",
    "Scene",
    "Frenet",
    "Hits",
    "nearest",
    "occluded",
    "Receiver",
    "View",
    "receiver",
    "view",
    "irradiance",
    "gathered",
    "in_mirrors",
    "Derivatives",
    "derivatives",
    "derivatives_on_shape",
]
