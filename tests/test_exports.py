"""Every exported name under jit, vmap and grad, in float32 and in float64.

A new export is one line of `PROBES`: a function of one number s that builds the thing from s and
returns what it computes. The walk differentiates it through that number. Abstract classes are
walked through what extends them.
"""

import importlib
import importlib.util
import inspect

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from firstorder import fields, flatland, laws, methods, sampling, space, transport, visibility
from firstorder.conventions import FLATLAND, FLATLAND_SLOPE, SPACE, Frame
from firstorder.fields import Grid, gaussian

# Wherever numbers are computed; `checks`, `plotting` and `io` work on the host.
PACKAGES = [
    name
    for name in (
        "fields", "laws", "transport", "visibility", "sampling", "flatland", "space", "methods"
    )
    if importlib.util.find_spec(f"firstorder.{name}")
]  # fmt: skip

ANGLE, OFFSET, OUT = Frame(("theta",)), Frame(("x",)), Frame(sense="outgoing")
SLOPE = FLATLAND_SLOPE
GRID = Grid.spanning((8, 9), (2.0, 1.8))
DIRECTION = np.array([0.6, 0.0, 0.8])
LIMB, FLAT = (-1.0, 0.0, 0.0), np.diag([0.0, 1.0, 1.0])  # a normal, and a bend across it


def light(s, frame=FLATLAND):
    """Off-centre, correlated, of width s."""
    return gaussian(jnp.stack([0.2 * s, -0.1]), jnp.stack([0.5 + s, 0.4]), 0.3, 1.3, frame)


def ray(frame):
    return jnp.array([0.31, 0.12, -0.2, 0.15])[: frame.dims]


def jet(field):
    """Value, to be differentiated, and the jet at a ray, which is a derivative already."""
    arrays, rest = eqx.partition(field, eqx.is_inexact_array)
    frozen = eqx.combine(jax.lax.stop_gradient(arrays), rest)
    return field.at(ray(field.frame)), jax.lax.stop_gradient(frozen.jet(ray(field.frame)))


def value_on(event, s, frame=FLATLAND):
    """The value alone: for what shares its jet with something else on the walk."""
    field = event(light(s, frame))
    return field.at(ray(field.frame))


def on(event, s, frame=FLATLAND):
    """The jet of light after an event or law."""
    return jet(event(light(s, frame)))


def lobe(s):
    return fields.GaussianProfile(0.3 + 0.1 * s)


def cut_light(s):
    """Light over four coordinates, without correlation."""
    return fields.Gaussian(jnp.zeros(4) + 0.1 * s, jnp.eye(4) * (1.0 + s), 1.0, SPACE)


def mask(s, frame=SLOPE):
    return fields.half_plane(s, 0.0, 1.0, "x", frame)


def wave(s, frame=FLATLAND):
    return transport.wave(0.25, 0.2 * s, frame=frame)


def shaded(s, *reflectance):
    """Light reflected by a valley."""
    surface = transport.Surface(fields.Affine(jnp.stack([s, 0.0]), 0.1), reflectance)
    return surface.reflect(light(s), 8)


def profile(field):
    """What an angular profile is at one angle."""
    return field.derivatives(jnp.asarray(0.2))


def view(s):
    """A camera ray."""
    return transport.Camera(jnp.stack([s, 2.0]), 1.0, transport.Base(0.1 * s)).derivatives(0.2 * s)


def sphere_light(w):
    return 1.0 + 0.3 * w[2] + 0.2 * w[0] * w[1]


def band(s):
    return methods.BandLimit.box(jnp.stack([s, 2.0 + s])).cut("theta", 1.0)


def cell(s):
    return methods.Cell(s, jnp.stack([s, 1.0, -s]), jnp.stack([s**2, -s, 1.0]))


def sampled(s):
    """Adaptive samples of a function with a parameter, on a line that grows with it."""
    return methods.sample_line(lambda x: (s * x**2, 2.0 * s * x), 0.0, s, 6, initial=3)


class Bend(laws.Map):
    """A warp with a parameter."""

    s: jax.Array

    def __call__(self, u):
        return u + self.s * jnp.sin(u[::-1])


def slab(s):
    """Edges of a blocker whose height is a parameter."""
    low, high = (visibility.point_alpha(jnp.stack([c, 1.0 + s])[None], side=c) for c in (1.0, -0.5))
    return visibility.exposed_edges(low, high)


def shadow(s):
    """Shading behind it."""
    return visibility.shading(lambda x, t, w: s * jnp.cos(w + 0.1 * t * x), 0.1, s, slab(s))


def slots(s):
    """Two intervals that overlap."""
    return jnp.stack([-s, 0.0 * s]), jnp.stack([0.1 * s, s])


def disc(s):
    """Distance to a disc of radius s about (0, 2), and the edges that rays find."""

    def hit(a):
        inside = s**2 - 4.0 * jnp.sin(a) ** 2
        there = (inside > 0) & (jnp.cos(a) > 0)
        root = jnp.sqrt(jnp.where(there, inside, 1.0))
        return jnp.where(there, 2.0 * jnp.cos(a) - root, jnp.inf)

    angles = jnp.linspace(-1.5, 1.5, 32, dtype=s.dtype)
    return hit, visibility.bracketed(lambda a: jnp.isfinite(hit(a)), angles, 2)


def beam(s):
    """A segment overhead."""
    return flatland.Segments(jnp.stack([0.5 + s, 1.0]), jnp.stack([-0.5, 1.0]))


def shadowed(s):
    """A lamp, which is a mirror too, and a disc before it."""
    lamp = flatland.thing(beam(s), emission=s, mirror=0.5)
    return flatland.Scene.of(lamp, flatland.thing(flatland.Circles((0.1, 0.4), 0.1 * s)))


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
    scene = flatland.Scene.of(flatland.thing(shape))
    return flatland.nearest(scene, jnp.zeros((1, 2)), jnp.array([[0.0, 1.0]])), scene.silhouettes(
        jnp.zeros(2)
    )


def ball(s):
    """A ball above the floor, of radius s / 4."""
    return space.Scene.of(space.thing(space.sphere((0.1, 0.2, 1.0), 0.25 * s), emission=s))


def under(s):
    """A receiver below it."""
    return space.receiver(jnp.stack([0.1 * s, 0.0, 0.0]))


def towards(s):
    """A ray to the ball."""
    return jnp.zeros((1, 3)) + 0.01 * s, jnp.array([[0.1, 0.2, 1.0]]) / np.sqrt(1.05)


def reached(shape):
    """Where a ray that nearly hits its middle meets a shape, and what is seen of its edge."""
    ray = jnp.array([0.02, 0.03, -3.0]), jnp.array([0.0, 0.0, 1.0])
    row = jax.tree.map(lambda a: a[0], shape)
    scene = space.Scene.of(space.thing(shape))
    return row.distance(*ray, False), space.outline(scene, jnp.array([0.3, 0.4, -5.0]))


def slanted(s):
    """Axes of a shape."""
    return jnp.diag(jnp.stack([s, 0.5 + s, 1.0])) + 0.1 * jnp.ones((3, 3))


def round_curve(s):
    """A smooth closed curve overhead."""
    a = 2.0 * np.pi * np.arange(16) / 16
    curve = flatland.closed_curve(np.stack([np.cos(a), 2.0 + np.sin(a)], -1), 2)
    return eqx.tree_at(lambda c: c.cosines, curve, curve.cosines.at[:, 1, 0].add(0.1 * s))


PROBES = {
    "fields.Affine": lambda s: jet(fields.Affine(jnp.stack([s, 1.0]), s)),
    "fields.Bars": lambda s: jet(transport.comb_blocker(s, 3, SLOPE).transparency),
    "fields.Box": lambda s: fields.Box(s, "x", SLOPE).transform(jnp.asarray(0.3)),
    "fields.Constant": lambda s: jet(fields.Constant(s)),
    "fields.Covariance": lambda s: fields.Covariance(jnp.eye(2) * s).matrix,
    "fields.Dirac": lambda s: fields.Dirac("x", weight=s).transform(jnp.asarray(0.3)),
    "fields.Edge": lambda s: (
        mask(s).edges()[0].crossing(ray(SLOPE), 0, jnp.asarray(-2.0), jnp.asarray(2.0))
    ),
    "fields.Environment": lambda s: jet(
        fields.Environment(fields.Harmonics(jnp.stack([1.0, s]), jnp.stack([0.0, 0.2])))
    ),
    "fields.Flat": lambda s: jet(fields.Flat(height=s)),
    "fields.Function": lambda s: jet(fields.Function(lambda x, theta: jnp.sin(s * x + theta))),
    "fields.Gaussian": lambda s: jet(fields.Gaussian(jnp.zeros(2), jnp.eye(2) * s)),
    "fields.GaussianProfile": lambda s: jet(fields.GaussianProfile(s)),
    "fields.Grating": lambda s: jet(transport.grating_blocker(s, SLOPE).transparency),
    "fields.Grid": lambda s: GRID.sample(light(s)),
    "fields.HalfPlane": lambda s: jet(fields.HalfPlane(fields.Affine(jnp.ones(2), s), 0.0, s)),
    "fields.Harmonics": lambda s: jet(fields.Harmonics(jnp.stack([1.0, s]), jnp.stack([0.0, s]))),
    "fields.Jet": lambda s: light(s).jet(ray(FLATLAND)).scaled(s),
    "fields.NearLight": lambda s: jet(
        fields.NearLight(
            jnp.stack([s, 2.0]), fields.Gaussian(jnp.zeros(1), jnp.eye(1) * 4.0, frame=OFFSET)
        )
    ),
    "fields.Sampled": lambda s: jet(fields.Sampled(GRID.sample(light(s)), GRID)),
    "fields.SampledSpectrum": lambda s: fields.SampledSpectrum.of(light(s), GRID).at(ray(FLATLAND)),
    "fields.Separable": lambda s: jet(
        fields.Separable(
            jnp.stack([s, 0.0]),
            (fields.GaussianProfile(s, "x"), fields.GaussianProfile(0.5, "theta")),
        )
    ),
    "fields.Series": lambda s: light(s).series(GRID).coefficients,
    "fields.SoftSlit": lambda s: jet(
        fields.SoftSlit(fields.Affine(jnp.stack([1.0, s]), 0.1), s, 0.2 + s)
    ),
    "fields.SoftEdge": lambda s: jet(fields.SoftEdge(fields.Affine(jnp.ones(2), 0.1), s)),
    "fields.Sum": lambda s: jet(fields.Sum((light(s), light(2.0 * s)), jnp.stack([s, 1.0]))),
    "fields.Wavelet": lambda s: fields.Wavelet.of(
        light(s), Grid.spanning((4, 8), (2.0, 2.0))
    ).samples(),
    "fields.autodiff_jet": lambda s: fields.autodiff_jet(light(s).at, ray(FLATLAND), FLATLAND),
    "fields.covariance_of": lambda s: fields.covariance_of(light(s), GRID).matrix,
    "fields.covariance_of_samples": lambda s: (
        fields.covariance_of_samples(GRID.sample(light(s)), GRID, FLATLAND).matrix
    ),
    "fields.discrete_transform": lambda s: fields.discrete_transform(
        GRID.sample(light(s)), GRID, np.array([0.1, 0.3]), np.array([0.2])
    ),
    "fields.gaussian": lambda s: light(s).spectrum().at(ray(FLATLAND)),
    "fields.haar_matrix": lambda s: s * jnp.asarray(fields.haar_matrix(4)),
    "fields.half_plane": lambda s: jet(mask(s)),
    "fields.line_light": lambda s: jet(fields.line_light(light(s, SLOPE), s)),
    "fields.point_light": lambda s: (
        fields.point_light(s, fields.GaussianProfile(0.3, "v", SLOPE)).spectrum().at(ray(SLOPE))
    ),
    "fields.spot_light": lambda s: jet(
        fields.spot_light(s, 0.5, fields.GaussianProfile(0.3, "v", SLOPE))
    ),
    "fields.triple_products": lambda s: s * jnp.asarray(fields.triple_products(4)),
    "fields.windowed_covariance": lambda s: fields.windowed_covariance(wave(s), light(s), 8).matrix,
    "space.Ellipsoids": lambda s: reached(space.Ellipsoids((0.0, 0.0, 0.0), slanted(s))),
    "space.Boxes": lambda s: space.Boxes((0.0, 0.0, 0.0), slanted(s)),
    "space.Cylinders": lambda s: reached(space.Cylinders((0.0, 0.0, 0.0), slanted(s))),
    "space.Discs": lambda s: reached(space.Discs((0.0, 0.0, 0.0), slanted(s))),
    "space.Rectangles": lambda s: reached(space.Rectangles((0.0, 0.0, 0.0), slanted(s))),
    "space.Triangles": lambda s: reached(space.Triangles((0.0, 0.0, 0.0), slanted(s))),
    "space.Planes": lambda s: space.Planes((0.0, 0.0, 0.0), slanted(s)),
    "space.sphere": lambda s: space.sphere((0.0, 0.0, 2.0), s),
    "space.ellipsoid": lambda s: space.ellipsoid((0.0, 0.0, 2.0), slanted(s)),
    "space.box": lambda s: space.box((0.0, 0.0, 0.0), jnp.stack([s, 2.0 * s, 1.0])),
    "space.cylinder": lambda s: space.cylinder((0.0, 0.0, 0.0), (0.0, 1.0, 1.0), s),
    "space.disc": lambda s: space.disc((0.0, 0.0, 1.0), jnp.stack([s, 1.0, 1.0]), 1.0),
    "space.rectangle": lambda s: space.rectangle(
        (0.0, 0.0, 1.0), jnp.stack([s, 1.0, 0.0]), (0.0, 1.0, 1.0)
    ),
    "space.triangle": lambda s: space.triangle(
        (0.0, 0.0, 1.0), jnp.stack([s, 1.0, 0.0]), (0.0, 1.0, 1.0)
    ),
    "space.polygon": lambda s: space.polygon(
        jnp.stack([jnp.stack([s, 0.0, 0.0]), jnp.array([0.0, 2.0, 0.0]), jnp.array([-1.0, 0, 0])])
    ),
    "space.plane": lambda s: space.plane((0.0, 0.0, 0.0), jnp.stack([s, 0.0, 1.0])),
    "space.Material": lambda s: space.thing(space.sphere((0, 0, 2), 1.0), emission=s).material,
    "space.Thing": lambda s: space.thing(space.sphere((0, 0, 2), 1.0), albedo=0.5 * s).material,
    "space.thing": lambda s: space.thing(space.sphere((0, 0, 2), 1.0), specular=0.5 * s).material,
    "space.Scene": lambda s: ball(s).surface(0, *(a[0] for a in towards(s))),
    "space.Receiver": lambda s: under(s).moved(jnp.stack([s, 0.1])),
    "space.receiver": lambda s: space.receiver(jnp.stack([s, 0.0, 0.0]), (0.0, 1.0, 1.0)),
    "space.Hits": lambda s: space.nearest(ball(s), *towards(s)).t,
    "space.first_shape": lambda s: s * space.first_shape(ball(s), *towards(s)),
    "space.nearest": lambda s: space.nearest(ball(s), *towards(s)),
    "space.occluded": lambda s: s * space.occluded(ball(s), *towards(s)),
    "space.Straight": lambda s: space.outline(ball(s), under(s).position).straight.start + s,
    "space.Curved": lambda s: space.outline(ball(s), under(s).position).curved,
    "space.Outline": lambda s: space.outline(ball(s), under(s).position),
    "space.outline": lambda s: space.outline(ball(s), under(s).position).curved.center,
    "space.Sides": lambda s: space.exposed(ball(s), under(s)).rims.jump(jnp.stack([s, 2.0 * s])),
    "space.Pieces": lambda s: space.exposed(ball(s), under(s)).on_arcs(4),
    "space.exposed": lambda s: space.exposed(ball(s), under(s)),
    "space.net_visibility": lambda s: space.net_visibility(ball(s), under(s), 4),
    "space.irradiance": lambda s: space.irradiance(ball(s), under(s), 4),
    "space.vector_irradiance": lambda s: space.vector_irradiance(ball(s), under(s), 4),
    "space.boundary_gradient": lambda s: space.boundary_gradient(ball(s), under(s), nodes=4),
    "flatland.Arcs": lambda s: hit_of(flatland.Arcs((0.0, 2.0), 0.5 + s, 0.5, -5.0)),
    "flatland.Circles": lambda s: hit_of(flatland.Circles((0.0, 2.0), s)),
    "flatland.Curves": lambda s: hit_of(round_curve(s)),
    "flatland.Derivatives": lambda s: flatland.rotation(lit(s))(above(s)).second,
    "flatland.Ellipses": lambda s: hit_of(
        flatland.Ellipses((0.0, 2.0), jnp.stack([s, 0.5 * s]), s)
    ),
    "flatland.Frenet": lambda s: shadowed(s).frame(1, 0.1).normal,
    "flatland.Hits": lambda s: flatland.nearest(shadowed(s), *up(s)).s,
    "flatland.Material": lambda s: flatland.thing(beam(s), emission=s).material,
    "flatland.PointLights": lambda s: flatland.PointLights((0.0, 1.0), s),
    "flatland.Receiver": lambda s: above(s).normal,
    "flatland.Scene": lambda s: shadowed(s).length(0),
    "flatland.Segments": lambda s: hit_of(beam(s)),
    "flatland.Thing": lambda s: flatland.thing(beam(s), albedo=s).material,
    "flatland.View": lambda s: flatland.view(shadowed(s), above(s)).angles,
    "flatland.along": lambda s: flatland.along(lit(s))(shadowed(s), 1, 0.1 * s),
    "flatland.box": lambda s: flatland.box((0.0, 0.0), jnp.stack([s, 1.0])),
    "flatland.closed_curve": lambda s: hit_of(round_curve(s)),
    "flatland.gathered": lambda s: flatland.gathered(shadowed(s), above(s), jnp.cos, nodes=4),
    "flatland.in_mirrors": lambda s: flatland.in_mirrors(shadowed(s), above(s), (0,)),
    "flatland.irradiance": lambda s: flatland.irradiance(shadowed(s), above(s)),
    "flatland.nearest": lambda s: flatland.nearest(shadowed(s), *up(s)),
    "flatland.occluded": lambda s: s * flatland.occluded(shadowed(s), *up(s)),
    "flatland.polyline": lambda s: flatland.polyline(
        jnp.stack([jnp.stack([s, s]), s * jnp.eye(2)[0]])
    ),
    "flatland.receiver": lambda s: flatland.receiver(shadowed(s), 1, s),
    "flatland.rotation": lambda s: flatland.rotation(lit(s))(above(s)),
    "flatland.thing": lambda s: flatland.thing(beam(s), mirror=s).material,
    "flatland.translation": lambda s: flatland.translation(lit(s))(above(s)),
    "flatland.view": lambda s: flatland.view(shadowed(s), above(s)).angles,
    "flatland.ConstantSky": lambda s: flatland.ConstantSky(s)(s),
    "flatland.GaussianSky": lambda s: flatland.GaussianSky(0.1, 0.5 + s, s)(s),
    "flatland.RowSky": lambda s: flatland.RowSky(jnp.stack([s, 2.0 * s, 1.0 + s, s]), True)(s),
    "laws.Circle": lambda s: value_on(laws.Convolve(lobe(s), laws.Circle(), 8), s),
    "laws.Convolve": lambda s: on(laws.Convolve(lobe(s), nodes=8), s),
    "laws.Hemisphere": lambda s: value_on(
        laws.Convolve(lobe(s), laws.Hemisphere(fields.Constant(s)), 8), s
    ),
    "laws.Image": lambda s: jet(laws.Image(laws.Multiply(light(s)), light(s))),
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
    "transport.Incidence": lambda s: on(transport.Incidence(s), s),
    "transport.Layers": lambda s: on(
        transport.Layers((mask(s), mask(-1.0)), jnp.stack([s, 1.0])), s, SLOPE
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
    "transport.cos_plus_transform": lambda s: transport.cos_plus_transform(s),
    "transport.diffuse": lambda s: on(transport.diffuse(s, 2.0, nodes=8), s, SLOPE),
    "transport.fresnel_reflection": lambda s: on(transport.fresnel_reflection(1.0 + s), s),
    "transport.grating_blocker": lambda s: on(transport.grating_blocker(s, SLOPE), s, SLOPE),
    "transport.half_plane_blocker": lambda s: on(transport.half_plane_blocker(s, SLOPE), s, SLOPE),
    "transport.refraction": lambda s: value_on(transport.refraction(1.0 + s), s),
    "transport.separable": lambda s: value_on(transport.separable(lobe(s), nodes=8), s),
    "transport.slit_blocker": lambda s: on(transport.slit_blocker(-1.0, s, SLOPE), s, SLOPE),
    "transport.theta_D_v": lambda s: transport.theta_D_v(s),
    "transport.v_D_theta": lambda s: transport.v_D_theta(s),
    "transport.wave": lambda s: jet(wave(s)),
    "transport.Base": lambda s: transport.Base(s).position(s),
    "transport.Camera": lambda s: value_on(transport.Camera(jnp.stack([s, 2.0]), 1.0), s, OUT),
    "transport.CosinePower": lambda s: profile(transport.CosinePower(1.0 + s)),
    "transport.Ggx": lambda s: transport.Ggx(s).derivatives(0.2 * s, 0.3 + s),
    "transport.Light": lambda s: jet(
        transport.Light(lambda x, t: x * t, lambda x, t: (x * t, t, x, 0 * x, 1 + 0 * x, 0 * x))
    ),
    "transport.Lobe": lambda s: shaded(s, transport.Lobe(lobe(s))).at(ray(OUT)),
    "transport.LobeBrdf": lambda s: transport.LobeBrdf(transport.glossy(s)).derivatives(
        0.1 * s, 0.2 + s
    ),
    "transport.Reflected": lambda s: jet(shaded(s, transport.glossy(0.1 + s))),
    "transport.Surface": lambda s: transport.Surface(wave(s), (transport.glossy(s),)).normal_at(s),
    "transport.Tabulate": lambda s: on(transport.Tabulate(GRID), s),
    "transport.Tabulated": lambda s: profile(
        transport.Tabulated(jnp.stack([0.0 * s, s, 2.0 * s, s]), 0.2)
    ),
    "transport.TabulatedBrdf": lambda s: transport.TabulatedBrdf(s * jnp.ones((5, 6))).derivatives(
        0.1 * s, 0.2 * s
    ),
    "transport.Terms": lambda s: shaded(s, transport.glossy(0.1 + s)).terms(0.2, 0.1),
    "transport.View": lambda s: view(s),
    "transport.far_light_ratio": lambda s: transport.far_light_ratio(1.0 + s, 0.1, s),
    "transport.glossy": lambda s: profile(transport.glossy(s).kernel),
    "transport.image_jet": lambda s: transport.image_jet(view(s), light(s).jet(ray(FLATLAND))),
    "transport.lambert": lambda s: profile(transport.lambert(s).kernel),
    "transport.phong": lambda s: profile(transport.phong(1.0 + s).kernel),
    "transport.retro": lambda s: profile(transport.retro(s).kernel),
    "visibility.Alpha": lambda s: visibility.point_alpha(jnp.stack([s, 1.0]), kappa=s),
    "visibility.Brackets": lambda s: (s, disc(s)[1].angle),
    "visibility.Edges": lambda s: slab(s).gradient,
    "visibility.Limbs": lambda s: visibility.limbs(*disc(s)).alpha().alpha_x,
    "visibility.Elevation": lambda s: (
        visibility.rim_elevation((s, 0.2, 1.0), (0.1, 1.0, s)).gradient
    ),
    "visibility.limb_bend": lambda s: visibility.limb_bend((0.0, 0.0, s), LIMB, s * FLAT, 0.0),
    "visibility.limb_elevation": lambda s: visibility.limb_elevation((0.0, s, 2.0), LIMB, 0.2 * s),
    "visibility.rim_bend": lambda s: visibility.rim_bend((s, 0.2, 1.0), (0.1, 1.0, s)),
    "visibility.rim_elevation": lambda s: visibility.rim_elevation((s, 0.2, 1.0), (0.1, 1.0, s)),
    "visibility.Shading": lambda s: shadow(s).hessian.total,
    "visibility.Split": lambda s: shadow(s).gradient.interior,
    "visibility.angular_by_parts": lambda s: visibility.angular_by_parts(
        lambda x, w: s * jnp.cos(w), lambda a: jnp.exp(-s * a**2), 0.1, s, slab(s)
    ),
    "visibility.blocked_measure": lambda s: visibility.blocked_measure(*slots(s), jnp.sin),
    "visibility.bracketed": lambda s: (s, disc(s)[1].sign),
    "visibility.circle_alpha": lambda s: visibility.circle_alpha(jnp.stack([s, 2.0]), s, kappa=s),
    "visibility.clipped": lambda s: visibility.clipped(*slots(s), (-0.1, 0.2)),
    "visibility.differentiated_edges": lambda s: visibility.differentiated_edges(
        lambda p: slots(p[0] * s), jnp.stack([s, 1.0])
    ),
    "visibility.exposed": lambda s: s * visibility.exposed(*slots(s))[0],
    "visibility.exposed_edges": lambda s: slab(s),
    "visibility.limbs": lambda s: visibility.limbs(*disc(s)),
    "visibility.merged": lambda s: visibility.merged(*slots(s)),
    "visibility.point_alpha": lambda s: visibility.point_alpha(jnp.stack([s, 2.0]), radius=s),
    "visibility.rotated": lambda s: visibility.rotated(visibility.point_alpha(jnp.stack([s, 2.0]))),
    "visibility.shaded": lambda s: shadow(s).value,
    "visibility.shading": lambda s: shadow(s),
    "visibility.sight": lambda s: visibility.sight(jnp.stack([s, 2.0]), radius=s),
    "visibility.signed_edges": lambda s: visibility.signed_edges(*slots(s)),
    "visibility.spanned": lambda s: visibility.spanned(*slots(s)),
    "visibility.visible_gaps": lambda s: visibility.visible_gaps(*slots(s)),
    "visibility.visible_measure": lambda s: visibility.visible_measure(*slots(s), jnp.sin),
    "sampling.Cosine": lambda s: (sampling.Cosine().sample(s), sampling.Cosine().density(s)),
    "sampling.Estimate": lambda s: sampling.Estimate(s, s, 9.0).scaled(s).z(0.1),
    "sampling.Lobe": lambda s: (sampling.Lobe(s).sample(s, s), sampling.Lobe(s, s).density(0.3)),
    "sampling.Moments": lambda s: sampling.Moments.none((), s.dtype).add(s).add(2.0 * s).variance(),
    "sampling.Pick": lambda s: sampling.Pick(jnp.stack([s, 1.0 + s])).probability,
    "sampling.Piecewise": lambda s: sampling.Piecewise(jnp.stack([s, 2.0]), -s, s).sample(0.4),
    "sampling.Uniform": lambda s: (sampling.Uniform().sample(s), sampling.Uniform().density(s)),
    "sampling.combine": lambda s: sampling.combine([sampling.estimate(jnp.stack([s, -s]))] * 2),
    "sampling.estimate": lambda s: sampling.estimate(jnp.stack([s, 2.0 * s, 0.1])),
    "sampling.jittered": lambda s: s * sampling.jittered(jax.random.key(0), 3),
    "sampling.midpoints": lambda s: s * sampling.midpoints(3),
    "methods.BandLimit": lambda s: (band(s).reach(ray(FLATLAND)), band(s).farthest(ray(FLATLAND))),
    "methods.Cell": lambda s: cell(s).mean(1),
    "methods.GridInterpolant": lambda s: methods.GridInterpolant(
        jnp.stack([0.0 * s, s]), jnp.stack([-s, s]), s * jnp.ones((2, 2, 3))
    )(0.4 * s, 0.1 * s),
    "methods.LineSamples": lambda s: sampled(s).interpolant()(0.4 * s),
    "methods.by_curvature": lambda s: methods.by_curvature(cell(s)),
    "methods.by_differences": lambda s: methods.by_differences(cell(s)),
    "methods.by_disagreement": lambda s: methods.by_disagreement(2)(cell(s)),
    "methods.by_gradient": lambda s: methods.by_gradient(cell(s)),
    "methods.by_length": lambda s: methods.by_length(cell(s)),
    "methods.sample_line": lambda s: sampled(s).data,
    "methods.Interpolant": lambda s: methods.Interpolant(
        jnp.stack([0.0 * s, s]), jnp.stack([s, 1.0 + 0.0 * s, -s, s]).reshape(2, 2)
    )(0.4 * s),
    "methods.after": lambda s: methods.after(laws.Convolve(lobe(s)), band(s)).extent("x"),
    "methods.band_limit": lambda s: methods.band_limit(light(s)).extent("x"),
    "methods.band_limits": lambda s: methods.band_limits(light(s) >> transport.Curvature(s))[
        -1
    ].extent("x"),
    "methods.glossy_bandwidth": lambda s: methods.glossy_bandwidth(s, s, -s, s, s),
    "methods.glossy_bandwidth_in_space": lambda s: methods.glossy_bandwidth_in_space(
        s, s, jnp.eye(2) * s, s
    ),
    "methods.glossy_criterion": lambda s: methods.glossy_criterion(s, s, s, s),
    "methods.hermite_basis": lambda s: methods.hermite_basis(s, 3),
    "methods.interpolation_error": lambda s: methods.interpolation_error(s, s, 2),
    "methods.occluded_bandwidth": lambda s: methods.occluded_bandwidth(s, s, s, s, s, s, s, s),
    "methods.occluded_criterion": lambda s: methods.occluded_criterion(s, s, s, s, s),
}


def exported():
    """Dotted names of all that is exported and can be made."""
    for package in PACKAGES:
        module = importlib.import_module(f"firstorder.{package}")
        for name in getattr(module, "__all__", ()):
            if not inspect.isabstract(getattr(module, name)):
                yield f"{package}.{name}"


def test_every_export_is_walked():
    assert sorted(set(exported()) ^ set(PROBES)) == []


def numbers(tree):
    """All floating arrays of a result."""
    leaves = [leaf for leaf in jax.tree.leaves(tree) if eqx.is_inexact_array(leaf)]
    assert leaves
    return leaves


def total(leaves):
    return sum(jnp.sum(jnp.real(leaf)) + jnp.sum(jnp.imag(leaf)) for leaf in leaves)


def walk(probe, bits):
    """Evaluates a probe and its gradient at three numbers, compiled; the faults that it finds."""

    def summed(s):
        leaves = numbers(probe(s))
        return total(leaves), leaves

    with jax.enable_x64(bits == 64):
        s = jnp.array([0.31, 0.47, 0.63])
        assert s.dtype == f"float{bits}"
        compiled = jax.jit(
            jax.vmap(jax.value_and_grad(summed, has_aux=True)),
            compiler_options={"xla_backend_optimization_level": 0},  # it runs once
        )
        (_, leaves), gradient = compiled(s)
    right = (f"float{bits}", f"complex{2 * bits}")
    faults = [f"a result in {leaf.dtype}" for leaf in leaves if leaf.dtype not in right]
    if not all(np.all(np.isfinite(leaf)) for leaf in leaves):
        faults.append("a value that is not finite")
    if not np.all(np.isfinite(gradient)):
        faults.append("a gradient that is not finite")
    return faults


@pytest.mark.parametrize("bits", [32, 64])
@pytest.mark.parametrize("name", sorted(PROBES))
def test_jit_vmap_and_grad_are_finite_and_keep_the_precision(name, bits):
    assert walk(PROBES[name], bits) == []


@pytest.mark.parametrize(
    ("wrong", "fault"),
    [
        (lambda s: jnp.sqrt(0.0 * s), "a gradient that is not finite"),
        (lambda s: 1.0 / jnp.floor(s), "a value that is not finite"),
        (lambda s: s.astype("float16"), "a result in float16"),
    ],
)
def test_the_walk_sees_what_is_wrong(wrong, fault):
    assert fault in walk(wrong, 32)
