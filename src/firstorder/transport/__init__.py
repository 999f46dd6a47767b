"""What happens to light: physical steps that pick a law, and paths that chain them."""

from firstorder.transport.brdf.general import Brdf, Ggx, LobeBrdf, TabulatedBrdf
from firstorder.transport.brdf.lobes import (
    CosinePower,
    Lobe,
    Tabulated,
    glossy,
    lambert,
    phong,
    retro,
)
from firstorder.transport.chain4d.chain import GlossyPatch
from firstorder.transport.event import Chain, Event, Linearised
from firstorder.transport.events.bump import Bump
from firstorder.transport.events.cosine import ClampedCosine, Cosine, cos_plus_transform
from firstorder.transport.events.diffuse import (
    DifferentialIrradiance,
    Gather,
    SlopeWeight,
    bessel_zk1,
    diffuse,
)
from firstorder.transport.events.incidence import Incidence, Outgoing
from firstorder.transport.events.interface import (
    Fresnel,
    Schlick,
    Snell,
    Transmission,
    fresnel_reflection,
    refraction,
)
from firstorder.transport.events.mirror import Mirror
from firstorder.transport.events.occlusion import (
    Layers,
    Occlusion,
    comb_blocker,
    grating_blocker,
    half_plane_blocker,
    slit_blocker,
)
from firstorder.transport.events.reflection import Blend, Reflection, VaryingGaussian
from firstorder.transport.events.rotation import Curvature
from firstorder.transport.events.separable import Angular, AngularFactor, separable
from firstorder.transport.events.slopes import ToAngle, ToSlope, theta_D_v, v_D_theta
from firstorder.transport.events.tabulate import Tabulate
from firstorder.transport.events.texture import Texture, Wave, wave
from firstorder.transport.events.travel import Arrival, Travel
from firstorder.transport.path import Path
from firstorder.transport.shading.camera import Base, Camera, View, image_jet
from firstorder.transport.shading.flat_jets import Light
from firstorder.transport.shading.surface import Reflected, Surface, Terms, far_light_ratio

__all__ = [
    "Angular",
    "AngularFactor",
    "Arrival",
    "Base",
    "Blend",
    "Brdf",
    "Bump",
    "Camera",
    "Chain",
    "ClampedCosine",
    "Cosine",
    "CosinePower",
    "Curvature",
    "DifferentialIrradiance",
    "Event",
    "Fresnel",
    "Gather",
    "Ggx",
    "GlossyPatch",
    "Incidence",
    "Layers",
    "Light",
    "Linearised",
    "Lobe",
    "LobeBrdf",
    "Mirror",
    "Occlusion",
    "Outgoing",
    "Path",
    "Reflected",
    "Reflection",
    "Schlick",
    "SlopeWeight",
    "Snell",
    "Surface",
    "Tabulate",
    "Tabulated",
    "TabulatedBrdf",
    "Terms",
    "Texture",
    "ToAngle",
    "ToSlope",
    "Transmission",
    "Travel",
    "VaryingGaussian",
    "View",
    "Wave",
    "bessel_zk1",
    "comb_blocker",
    "cos_plus_transform",
    "diffuse",
    "far_light_ratio",
    "fresnel_reflection",
    "glossy",
    "grating_blocker",
    "half_plane_blocker",
    "image_jet",
    "lambert",
    "phong",
    "refraction",
    "retro",
    "separable",
    "slit_blocker",
    "theta_D_v",
    "v_D_theta",
    "wave",
]
