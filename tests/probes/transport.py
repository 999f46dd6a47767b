"""Probes of laws and events."""

import jax
import jax.numpy as jnp
import numpy as np

from firstorder import fields, laws, transport
from firstorder.conventions import FLATLAND
from tests.probes.light import GRID, OUT, SLOPE, jet, light, lobe, mask, on, ray, value_on, wave

DIRECTION = np.array([0.6, 0.0, 0.8])


def shaded(s, *reflectance):
    """Light reflected by a valley."""
    surface = transport.Surface(fields.Affine(jnp.stack([s, 0.0]), 0.1), reflectance)
    return surface.reflect(light(s), 8)


def profile(field):
    """What an angular profile is at one angle."""
    return field.derivatives(jnp.asarray(0.2))


def view(s):
    """A camera ray."""
    return transport.Camera(jnp.stack([s, 2.0]), 1.0, transport.BaseSurface(0.1 * s)).derivatives(
        0.2 * s
    )


def sphere_light(w):
    return 1.0 + 0.3 * w[2] + 0.2 * w[0] * w[1]


class Bend(laws.Map):
    """A warp with a parameter."""

    s: jax.Array

    def __call__(self, u):
        return u + self.s * jnp.sin(u[::-1])


PROBES = {
    "laws.Circle": lambda s: value_on(laws.Convolve(lobe(s), laws.Circle(), 8), s),
    "laws.Convolve": lambda s: on(laws.Convolve(lobe(s), nodes=8), s),
    "laws.Hemisphere": lambda s: value_on(
        laws.Convolve(lobe(s), laws.Hemisphere(fields.Constant(s)), 8), s
    ),
    "laws.FieldImage": lambda s: jet(laws.FieldImage(laws.Multiply(light(s)), light(s))),
    "laws.Integrate": lambda s: on(laws.Integrate("theta", -2.0, s, 8), s),
    "laws.Line": lambda s: value_on(laws.Convolve(lobe(s), laws.Line(), 8), s),
    "laws.Linearisation": lambda s: laws.Warp(Bend(s)).linearise(ray(FLATLAND)).displacement,
    "laws.Move": lambda s: on(laws.Move(jnp.eye(2) + 0.1 * s, jnp.stack([s, 0.0])), s),
    "laws.Multiply": lambda s: on(laws.Multiply(light(s)), s),
    "laws.SpectrumImage": lambda s: laws.Move(jnp.eye(2) + 0.1 * s)(light(s).spectrum()).at(
        ray(FLATLAND)
    ),
    "laws.VonMisesFisher": lambda s: laws.VonMisesFisher(1.0 + s).derivatives(jnp.asarray(0.7)),
    "laws.Warp": lambda s: on(laws.Warp(Bend(s)), s),
    "laws.Zonal": lambda s: laws.Zonal(laws.VonMisesFisher(1.0 + s), 4, 6).jet(
        sphere_light, jnp.asarray(DIRECTION, s.dtype)
    ),
    "laws.ZonalCosine": lambda s: laws.Zonal(laws.ZonalCosine(), 4, 6)(
        lambda w: s * sphere_light(w)
    )(jnp.asarray(DIRECTION, s.dtype)),
    "transport.AngularFactor": lambda s: on(transport.AngularFactor(transport.Fresnel(1.0 + s)), s),
    "transport.Arrival": lambda s: on(transport.Arrival(), s, OUT),
    "transport.Blend": lambda s: value_on(
        transport.Reflection(
            transport.Blend(
                (lobe(s), lobe(2.0 * s)), (transport.wave(0.3, mean=s), fields.Constant(s))
            ),
            nodes=8,
        ),
        s,
        OUT,
    ),
    "transport.Bump": lambda s: on(transport.Bump(wave(s)), s),
    "transport.Chain": lambda s: on(
        transport.Chain((transport.Curvature(s), transport.Mirror())), s
    ),
    "transport.ClampedCosine": lambda s: jet(laws.Multiply(light(s))(transport.ClampedCosine())),
    "transport.Cosine": lambda s: on(transport.Cosine(), s),
    "transport.Curvature": lambda s: on(transport.Curvature(s), s),
    "transport.DifferentialIrradiance": lambda s: on(transport.DifferentialIrradiance(s), s, SLOPE),
    "transport.Fresnel": lambda s: jet(transport.Fresnel(1.0 + s)),
    "transport.Gather": lambda s: on(transport.Gather(reach=2.0 + s, nodes=8), s, SLOPE),
    "transport.GlossyPatch": lambda s: transport.GlossyPatch(
        s * jnp.eye(2), 0.5, 0.1, azimuth=0.1 * s
    ).mirror_matrix(),
    "transport.Incidence": lambda s: on(transport.Incidence(s), s),
    "transport.PlanarBlockers": lambda s: on(
        transport.PlanarBlockers((mask(s), mask(-1.0)), jnp.stack([s, 1.0])), s, SLOPE
    ),
    "transport.Linearised": lambda s: on(transport.Bump(wave(s)).linearised(ray(FLATLAND)), s),
    "transport.Mirror": lambda s: on(transport.Mirror(), s),
    "transport.Occlusion": lambda s: on(transport.Occlusion(mask(s), s), s, SLOPE),
    "transport.Outgoing": lambda s: on(transport.Outgoing(s), s, OUT),
    "transport.Path": lambda s: (light(s) >> transport.Curvature(s)).jets(ray(FLATLAND)),
    "transport.Reflection": lambda s: on(transport.Reflection(lobe(s), nodes=8), s, OUT),
    "transport.Schlick": lambda s: jet(transport.Schlick(0.1 + 0.5 * s)),
    "transport.SlopeWeight": lambda s: jet(transport.SlopeWeight(scale=s)),
    "transport.Snell": lambda s: on(transport.Snell(1.0 + s), s),
    "transport.Texture": lambda s: on(transport.Texture(wave(s)), s),
    "transport.ToAngle": lambda s: on(transport.ToAngle(), s, SLOPE),
    "transport.ToSlope": lambda s: on(transport.ToSlope(), s),
    "transport.Transmission": lambda s: jet(transport.Transmission(1.0 + s)),
    "transport.Travel": lambda s: on(transport.Travel(s), s, SLOPE),
    "transport.VaryingGaussian": lambda s: jet(
        transport.VaryingGaussian(transport.wave(0.3, 0.1, mean=0.2 + s), 1.0)
    ),
    "transport.Wave": lambda s: jet(transport.Wave(jnp.stack([s, 0.3]), s, s)),
    "transport.bessel_zk1": lambda s: transport.bessel_zk1(s),
    "transport.comb_blocker": lambda s: on(transport.comb_blocker(s, 3, SLOPE), s, SLOPE),
    "transport.clamped_cosine_transform": lambda s: transport.clamped_cosine_transform(s),
    "transport.diffuse": lambda s: on(transport.diffuse(s, 2.0, nodes=8), s, SLOPE),
    "transport.fresnel_reflection": lambda s: on(transport.fresnel_reflection(1.0 + s), s),
    "transport.grating_blocker": lambda s: on(transport.grating_blocker(s, SLOPE), s, SLOPE),
    "transport.half_plane_blocker": lambda s: on(transport.half_plane_blocker(s, SLOPE), s, SLOPE),
    "transport.line_light": lambda s: jet(transport.line_light(light(s, SLOPE), s)),
    "transport.pit_blockers": lambda s: on(transport.pit_blockers(s, s, 2, SLOPE), s, SLOPE),
    "transport.refraction": lambda s: value_on(transport.refraction(1.0 + s), s),
    "transport.separable": lambda s: value_on(transport.separable(lobe(s), nodes=8), s),
    "transport.slit_blocker": lambda s: on(transport.slit_blocker(-1.0, s, SLOPE), s, SLOPE),
    "transport.theta_D_v": lambda s: transport.theta_D_v(s),
    "transport.v_D_theta": lambda s: transport.v_D_theta(s),
    "transport.wave": lambda s: jet(wave(s)),
    "transport.BaseSurface": lambda s: transport.BaseSurface(s).position(s),
    "transport.Camera": lambda s: value_on(transport.Camera(jnp.stack([s, 2.0]), 1.0), s, OUT),
    "transport.CosinePowerProfile": lambda s: profile(transport.CosinePowerProfile(1.0 + s)),
    "transport.Ggx": lambda s: transport.Ggx(s).derivatives(0.2 * s, 0.3 + s),
    "transport.FlatlandLight": lambda s: jet(
        transport.FlatlandLight(
            lambda x, t: x * t, lambda x, t: (x * t, t, x, 0 * x, 1 + 0 * x, 0 * x)
        )
    ),
    "transport.LobeArgument": lambda s: shaded(
        s, transport.Lobe(lobe(s), transport.LobeArgument(1.5, "1.5 n - 0.5 theta - omega"))
    ).at(ray(OUT)),
    "transport.Lobe": lambda s: shaded(s, transport.Lobe(lobe(s))).at(ray(OUT)),
    "transport.LobeBrdf": lambda s: transport.LobeBrdf(transport.glossy(s)).derivatives(
        0.1 * s, 0.2 + s
    ),
    "transport.ReflectedField": lambda s: jet(shaded(s, transport.glossy(0.1 + s))),
    "transport.Surface": lambda s: transport.Surface(wave(s), (transport.glossy(s),)).normal_at(s),
    "transport.Tabulate": lambda s: on(transport.Tabulate(GRID), s),
    "transport.TabulatedProfile": lambda s: profile(
        transport.TabulatedProfile(jnp.stack([0.0 * s, s, 2.0 * s, s]), 0.2)
    ),
    "transport.TabulatedBrdf": lambda s: transport.TabulatedBrdf(s * jnp.ones((5, 6))).derivatives(
        0.1 * s, 0.2 * s
    ),
    "transport.DerivativeTerms": lambda s: shaded(s, transport.glossy(0.1 + s)).terms(0.2, 0.1),
    "transport.CameraRay": lambda s: view(s),
    "transport.distant_image_gradient": lambda s: transport.distant_image_gradient(
        view(s), 0.1 * s, 2.0 + s, 1.0 + s, light(s).jet(ray(FLATLAND))
    ),
    "transport.far_light_ratio": lambda s: transport.far_light_ratio(1.0 + s, 0.1, s),
    "transport.glossy": lambda s: profile(transport.glossy(s).kernel),
    "transport.image_jet": lambda s: transport.image_jet(view(s), light(s).jet(ray(FLATLAND))),
    "transport.lambert": lambda s: profile(transport.lambert(s).kernel),
    "transport.phong": lambda s: profile(transport.phong(1.0 + s).kernel),
    "transport.retro": lambda s: profile(transport.retro(s).kernel),
}
