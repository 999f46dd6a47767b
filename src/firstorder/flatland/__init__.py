"""A world of two dimensions, small enough to be exact: shapes, scenes, irradiance.

Parts:

- `flatland.shapes`: segments, arcs, circles, ellipses, smooth closed curves;
- `flatland.library`: scenes by name, and bumpy ground;
- `flatland.light_fields`: a scene as a field, with all portraits;
- `flatland.discontinuities`: visual events, where derivatives of irradiance jump;
- `flatland.estimators`: irradiance and its derivatives from rays;
- `flatland.bounces`: radiosity, path tracing, photon maps.
"""

from firstorder._on_demand import on_demand
from firstorder.flatland._radiometry import (
    diffuse_brdf,
    incident_flux,
    phong_brdf,
    reflected_radiance,
)
from firstorder.flatland.direct_lighting import (
    derivatives_on_shape,
    irradiance,
    point_light_irradiance,
    weighted_irradiance,
)
from firstorder.flatland.intersect import Hits, first_shape, nearest, occluded
from firstorder.flatland.light_fields.field import LightField, light_field
from firstorder.flatland.light_fields.spectrum import StraightEdges
from firstorder.flatland.mirrors import mirror_irradiance
from firstorder.flatland.point_lights import PointLights
from firstorder.flatland.primitives import Material, Primitive, primitive
from firstorder.flatland.refraction import (
    Beam,
    Caustic,
    PointSource,
    RayEnd,
    fresnel_reflectance,
    rainbow_incidence,
    through_body,
    trace_path,
)
from firstorder.flatland.scene import Frenet, Scene
from firstorder.flatland.shapes.build import box, closed_curve, polyline
from firstorder.flatland.shapes.kinds import Arcs, Circles, Curves, Ellipses, Segments
from firstorder.flatland.skies import ConstantSky, GaussianSky, PanoramaSky
from firstorder.flatland.visible import Receiver, View, local_angle, receiver, view
from firstorder.scene._derivatives import Derivatives, derivatives
from firstorder.scene._geometry_term import geometry_jet, geometry_term

__all__ = [
    "derivatives",
    "derivatives_on_shape",
    "Segments",
    "Arcs",
    "Circles",
    "Ellipses",
    "Curves",
    "polyline",
    "box",
    "closed_curve",
    "primitive",
    "Primitive",
    "Material",
    "PointLights",
    "ConstantSky",
    "GaussianSky",
    "PanoramaSky",
    "Scene",
    "Frenet",
    "Hits",
    "nearest",
    "first_shape",
    "occluded",
    "Receiver",
    "receiver",
    "View",
    "view",
    "local_angle",
    "irradiance",
    "weighted_irradiance",
    "point_light_irradiance",
    "mirror_irradiance",
    "LightField",
    "light_field",
    "StraightEdges",
    "Derivatives",
    "geometry_term",
    "geometry_jet",
    "diffuse_brdf",
    "phong_brdf",
    "incident_flux",
    "reflected_radiance",
    "PointSource",
    "Beam",
    "RayEnd",
    "trace_path",
    "through_body",
    "Caustic",
    "fresnel_reflectance",
    "rainbow_incidence",
]

# Parts that are costly to import, or that few ask for.
_PARTS = ("bounces", "discontinuities", "library")
__getattr__, __dir__ = on_demand(__name__, _PARTS)
