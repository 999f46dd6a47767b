"""Light transport: events, each a physical step that picks a law, and paths that chain them."""

from firstorder.transport.brdf.general import Brdf, Ggx, LobeBrdf, TabulatedBrdf
from firstorder.transport.brdf.lobes import (
    CosinePowerProfile,
    Lobe,
    LobeArgument,
    TabulatedProfile,
    glossy,
    lambert,
    phong,
    retro,
)
from firstorder.transport.chain4d.chain import GlossyPatch
from firstorder.transport.event import Chain, Event, Linearised, Path, require_frame
from firstorder.transport.events.bump import Bump
from firstorder.transport.events.cosine import ClampedCosine, Cosine, clamped_cosine_transform
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
    Occlusion,
    PlanarBlockers,
    comb_blocker,
    grating_blocker,
    half_plane_blocker,
    pit_blockers,
    slit_blocker,
)
from firstorder.transport.events.reflection import Blend, Reflection, VaryingGaussian
from firstorder.transport.events.rotation import Curvature
from firstorder.transport.events.separable import Angular, AngularFactor, separable
from firstorder.transport.events.slopes import ToAngle, ToSlope, theta_D_v, v_D_theta
from firstorder.transport.events.tabulate import Tabulate
from firstorder.transport.events.texture import Texture, Wave, wave
from firstorder.transport.events.travel import Arrival, Travel, line_light
from firstorder.transport.shading._flat_jets import FlatlandLight
from firstorder.transport.shading.camera import (
    BaseSurface,
    Camera,
    CameraRay,
    distant_image_gradient,
    image_jet,
)
from firstorder.transport.shading.surface import (
    DerivativeTerms,
    ReflectedField,
    Surface,
    far_light_ratio,
)

__all__ = [
    "Event",
    "Chain",
    "Path",
    "Linearised",
    "require_frame",
    "Travel",
    "Arrival",
    "line_light",
    "Curvature",
    "Bump",
    "ToSlope",
    "ToAngle",
    "v_D_theta",
    "theta_D_v",
    "Incidence",
    "Outgoing",
    "Mirror",
    "Cosine",
    "ClampedCosine",
    "clamped_cosine_transform",
    "Occlusion",
    "PlanarBlockers",
    "half_plane_blocker",
    "slit_blocker",
    "comb_blocker",
    "grating_blocker",
    "pit_blockers",
    "Texture",
    "Wave",
    "wave",
    "Reflection",
    "VaryingGaussian",
    "Blend",
    "Angular",
    "AngularFactor",
    "separable",
    "Fresnel",
    "Schlick",
    "Transmission",
    "Snell",
    "refraction",
    "fresnel_reflection",
    "diffuse",
    "DifferentialIrradiance",
    "Gather",
    "SlopeWeight",
    "bessel_zk1",
    "Tabulate",
    "Lobe",
    "LobeArgument",
    "CosinePowerProfile",
    "TabulatedProfile",
    "glossy",
    "phong",
    "lambert",
    "retro",
    "Brdf",
    "LobeBrdf",
    "Ggx",
    "TabulatedBrdf",
    "Surface",
    "ReflectedField",
    "DerivativeTerms",
    "FlatlandLight",
    "far_light_ratio",
    "GlossyPatch",
    "BaseSurface",
    "Camera",
    "CameraRay",
    "image_jet",
    "distant_image_gradient",
]
