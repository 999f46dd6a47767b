"""The world of three dimensions: shapes, scenes, silhouettes, irradiance.

Parts:

- `space.shapes`: affine images of a few canonical shapes;
- `space.meshes`: triangle meshes and their curvature;
- `space.library`: scenes by name;
- `space.silhouettes`: silhouettes, their visible parts, integrals along them;
- `space.discontinuities`: visual events, where derivatives of irradiance jump;
- `space.azimuthal`: integrals over azimuth, slice by slice;
- `space.light_fields`: a scene as a field over a plane;
- `space.estimators`: irradiance and its derivatives from rays;
- `space.bounces`: radiosity, radiance maps, path tracing, photon maps.
"""

from firstorder._on_demand import on_demand
from firstorder.scene._derivatives import Derivatives, derivatives
from firstorder.scene._geometry_term import geometry_jet, geometry_term
from firstorder.space.direct_lighting import (
    boundary_gradient,
    irradiance,
    net_visibility,
    vector_irradiance,
)
from firstorder.space.intersect import Hits, first_shape, nearest, occluded
from firstorder.space.light_fields.field import light_field
from firstorder.space.primitives import Material, Primitive, primitive
from firstorder.space.receiver import Receiver, in_receiver_frame, receiver
from firstorder.space.scene import Scene
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
    triangles,
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
from firstorder.space.silhouettes.analytic import Silhouette, silhouette
from firstorder.space.silhouettes.visible import VisibleSilhouettes, visible_silhouettes
from firstorder.space.skies import ConstantSky, GaussianSky, HarmonicSky, PanoramaSky

__all__ = [
    "light_field",
    "derivatives",
    "Derivatives",
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
    "triangles",
    "polygon",
    "plane",
    "Material",
    "Primitive",
    "primitive",
    "Scene",
    "ConstantSky",
    "GaussianSky",
    "PanoramaSky",
    "HarmonicSky",
    "Receiver",
    "receiver",
    "in_receiver_frame",
    "Hits",
    "first_shape",
    "nearest",
    "occluded",
    "Silhouette",
    "silhouette",
    "VisibleSilhouettes",
    "visible_silhouettes",
    "geometry_term",
    "geometry_jet",
    "net_visibility",
    "irradiance",
    "vector_irradiance",
    "boundary_gradient",
]

# Parts that are costly to import, or that few ask for.
_PARTS = ("azimuthal", "bounces", "discontinuities", "estimators", "library")
__getattr__, __dir__ = on_demand(__name__, _PARTS)
