"""Probes of flatland."""

import equinox as eqx
import jax.numpy as jnp
import numpy as np

from firstorder import flatland
from firstorder.conventions import FLATLAND_SLOPE


def beam(s):
    """A segment overhead."""
    return flatland.Segments(jnp.stack([0.5 + s, 1.0]), jnp.stack([-0.5, 1.0]))


def shadowed(s):
    """A lamp, which is a mirror too, and a disc before it."""
    lamp = flatland.primitive(beam(s), emission=s, mirror=0.5)
    return flatland.Scene.of(lamp, flatland.primitive(flatland.Circles((0.1, 0.4), 0.1 * s)))


def above(s):
    """A receiver below the lamp."""
    return flatland.Receiver(jnp.stack([s, 0.0]), 0.1 * s)


def lit(s):
    """Irradiance as a function of the receiver."""
    return lambda at: flatland.irradiance(shadowed(s), at)


def up(s):
    """One ray that meets the lamp."""
    return jnp.stack([s, 0.0])[None], jnp.array([[0.0, 1.0]]) + 0.0 * s


def hit_of(shape):
    """A ray upward, and the tangents."""
    scene = flatland.Scene.of(flatland.primitive(shape))
    return flatland.nearest(scene, jnp.zeros((1, 2)), jnp.array([[0.0, 1.0]])), scene.silhouettes(
        jnp.zeros(2)
    )


def round_curve(s):
    """A smooth closed curve overhead."""
    a = 2.0 * np.pi * np.arange(16) / 16
    curve = flatland.closed_curve(np.stack([np.cos(a), 2.0 + np.sin(a)], -1), 2)
    return eqx.tree_at(lambda c: c.cosines, curve, curve.cosines.at[:, 1, 0].add(0.1 * s))


def glass(s, light):
    """What comes through a ball of glass down to a floor."""
    ball = flatland.primitive(flatland.Circles((0.0, 0.9), 0.4), ior=1.3 + 0.3 * s)
    floor = flatland.primitive(flatland.Segments((-1.0, 0.0), (1.0, 0.0)))
    through = flatland.through_body(1)
    return flatland.Caustic(flatland.Scene.of(ball, floor), light, through, 0, -0.3, 0.3, 8)


def above_it(s):
    """A beam straight down."""
    return flatland.Beam((0.0, 3.0), np.pi + 0.1 * s, s)


def lamp_beside(s):
    """A point light that the receiver sees past a small disc."""
    disc = flatland.primitive(flatland.Circles((0.5, 0.5), 0.1))
    return flatland.Scene.of(disc, points=flatland.PointLights((0.0, 1.0), s))


def faced(s):
    """Two patches that see each other."""
    return (
        jnp.stack([s, 0.0]),
        jnp.array([0.0, 1.0]),
        jnp.stack([0.2, 1.0 + s]),
        jnp.array([0, -1.0]),
    )


PROBES = {
    "flatland.Arcs": lambda s: hit_of(flatland.Arcs((0.0, 2.0), 0.5 + s, 0.5, -5.0)),
    "flatland.Circles": lambda s: hit_of(flatland.Circles((0.0, 2.0), s)),
    "flatland.Curves": lambda s: hit_of(round_curve(s)),
    "flatland.Derivatives": lambda s: flatland.derivatives(lit(s), above(s)).along(s).second,
    "flatland.Ellipses": lambda s: hit_of(
        flatland.Ellipses((0.0, 2.0), jnp.stack([s, 0.5 * s]), s)
    ),
    "flatland.Frenet": lambda s: shadowed(s).frame(1, 0.1).normal,
    "flatland.Hits": lambda s: flatland.nearest(shadowed(s), *up(s)).s,
    "flatland.LightField": lambda s: [
        e.crossing(jnp.stack([s, 0.0 * s]), 1, 0.0 * s - 1.5, 0.0 * s + 1.5)
        for e in flatland.light_field(shadowed(s), above(s)).edges()
    ],
    "flatland.Material": lambda s: flatland.primitive(beam(s), emission=s).material,
    "flatland.PointLights": lambda s: flatland.PointLights((0.0, 1.0), s),
    "flatland.Receiver": lambda s: above(s).normal,
    "flatland.Scene": lambda s: shadowed(s).length(0),
    "flatland.Segments": lambda s: hit_of(beam(s)),
    "flatland.StraightEdges": lambda s: flatland.StraightEdges(
        s * jnp.eye(2), jnp.eye(2), jnp.ones_like(s) * jnp.arange(2), FLATLAND_SLOPE
    )(0.1 * s, 0.2),
    "flatland.Primitive": lambda s: flatland.primitive(beam(s), albedo=s).material,
    "flatland.View": lambda s: flatland.view(shadowed(s), above(s)).angles,
    "flatland.derivatives_on_shape": lambda s: flatland.derivatives_on_shape(
        lit(s), shadowed(s), 1, 0.1 * s
    ),
    "flatland.box": lambda s: flatland.box((0.0, 0.0), jnp.stack([s, 1.0])),
    "flatland.closed_curve": lambda s: hit_of(round_curve(s)),
    "flatland.weighted_irradiance": lambda s: flatland.weighted_irradiance(
        shadowed(s), above(s), weight=jnp.cos, nodes=4
    ),
    "flatland.mirror_irradiance": lambda s: flatland.mirror_irradiance(
        shadowed(s), above(s), mirrors=(0,)
    ),
    "flatland.irradiance": lambda s: flatland.irradiance(shadowed(s), above(s)),
    "flatland.light_field": lambda s: flatland.light_field(shadowed(s), above(s)).jets(s, 0.1 * s),
    "flatland.Beam": lambda s: above_it(s).ray(0.1 * s),
    "flatland.Caustic": lambda s: glass(s, above_it(s)).envelope(0.1 * s),
    "flatland.PointSource": lambda s: flatland.PointSource(jnp.stack([s, 3.0]), s).ray(s),
    "flatland.RayEnd": lambda s: glass(s, flatland.PointSource((0.0, 3.0), s)).arrive(
        np.pi + 0.1 * s
    ),
    "flatland.diffuse_brdf": lambda s: flatland.diffuse_brdf(s)(0.1 * s, -s),
    "flatland.first_shape": lambda s: (1.0 + s) * (2 + flatland.first_shape(shadowed(s), *up(s))),
    "flatland.fresnel_reflectance": lambda s: flatland.fresnel_reflectance(
        jnp.stack([1.0 + s, 0.1 * s]), s
    ),
    "flatland.geometry_jet": lambda s: flatland.geometry_jet(*faced(s)),
    "flatland.geometry_term": lambda s: flatland.geometry_term(*faced(s)),
    "flatland.incident_flux": lambda s: flatland.incident_flux(shadowed(s), 1, nodes=4),
    "flatland.local_angle": lambda s: flatland.local_angle(above(s), jnp.stack([s, 1.0 + s])),
    "flatland.phong_brdf": lambda s: flatland.phong_brdf(s, 2.0 * s)(
        jnp.stack([0.1 * s, 1.5 + 0.0 * s]), s
    ),
    "flatland.point_light_irradiance": lambda s: flatland.point_light_irradiance(
        lamp_beside(s), above(s)
    ),
    "flatland.reflected_radiance": lambda s: flatland.reflected_radiance(
        shadowed(s), above(s), out=0.1 * s, brdf=flatland.phong_brdf(s, 1.0 + s), nodes=4
    ),
    "flatland.trace_path": lambda s: flatland.trace_path(
        glass(s, above_it(s)).scene, flatland.through_body(1), *above_it(s).ray(0.1 * s)
    ),
    "flatland.nearest": lambda s: flatland.nearest(shadowed(s), *up(s)),
    "flatland.occluded": lambda s: s * flatland.occluded(shadowed(s), *up(s)),
    "flatland.polyline": lambda s: flatland.polyline(
        jnp.stack([jnp.stack([s, s]), s * jnp.eye(2)[0]])
    ),
    "flatland.receiver": lambda s: flatland.receiver(shadowed(s), 1, s),
    "flatland.primitive": lambda s: flatland.primitive(beam(s), mirror=s).material,
    "flatland.derivatives": lambda s: flatland.derivatives(lit(s), above(s)),
    "flatland.view": lambda s: flatland.view(shadowed(s), above(s)).angles,
    "flatland.ConstantSky": lambda s: flatland.ConstantSky(s)(s),
    "flatland.GaussianSky": lambda s: flatland.GaussianSky(0.1, 0.5 + s, s)(s),
    "flatland.PanoramaSky": lambda s: flatland.PanoramaSky(
        jnp.stack([s, 2.0 * s, 1.0 + s, s]), True
    )(s),
}
