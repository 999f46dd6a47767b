"""Probes of samplers and of the methods that plan by derivatives."""

import jax
import jax.numpy as jnp

from firstorder import bandwidth, imaging, laws, reconstruction, sampling, space, transport
from firstorder.conventions import FLATLAND
from tests.probes.light import light, lobe, ray


def band(s):
    return bandwidth.BandLimit.box(jnp.stack([s, 2.0 + s])).cut("theta", 1.0)


def cell(s):
    return reconstruction.LineCell(s, jnp.stack([s, 1.0, -s]), jnp.stack([s**2, -s, 1.0]))


def sampled(s):
    """Adaptive samples of a function with a parameter, on a line that grows with it."""
    return reconstruction.sample_line(lambda x: (s * x**2, 2.0 * s * x), 0.0, s, 6, initial=3)


def shown(s):
    """Two pixels of a ball, one seen straight on and one aslant."""
    up = jnp.tile(jnp.array([0.0, 0.0, 1.0]), (2, 1))
    S = -s * jnp.eye(2) + jnp.stack([jnp.zeros((2, 2)), 0.1 * jnp.ones((2, 2))])
    return imaging.GBuffer(up, up, up, 2.0 + jnp.stack([s, s]), jnp.stack([1.0, s]), S)


def turns(s):
    """What turns from pixel to pixel: nothing at one, along one axis alone at another."""
    some = s * jnp.eye(3, 2)
    each = jnp.stack([0.0 * some, some.at[1, 1].set(0.0), some, some + 0.1])[:, None]
    return bandwidth.PixelDifferences(each, 2.0 * each, each, 0.5 * each)


def blocked(s):
    """How far rays from the floor run to a ball: one meets it, one misses it."""
    scene = space.Scene.of(space.primitive(space.sphere((0.0, 0.0, 2.0), s)))
    start = jnp.stack([0.1 * s, 0.0, 0.0])[None]
    along = jnp.array([[[0.0, 0.0, 1.0], [0.0, 1.0, 0.0]]])
    return bandwidth.blocker_distance(scene, start, along, jnp.array([-1]))


def relief(s):
    """Dents in rows."""
    return bandwidth.Relief(0.01 * s, 0.1 * s, s, 9.0, 8.0 + s, rms_slope=0.05 * s)


PROBES = {
    "sampling.CosineDirections": lambda s: (
        sampling.CosineDirections().sample(s),
        sampling.CosineDirections().density(s),
    ),
    "sampling.Estimate": lambda s: sampling.Estimate(s, s, 9.0).scaled(s).z(0.1),
    "sampling.CosinePowerLobe": lambda s: (
        sampling.CosinePowerLobe(s).sample(s, s),
        sampling.CosinePowerLobe(s, s).density(0.3),
    ),
    "sampling.Moments": lambda s: sampling.Moments.none((), s.dtype).add(s).add(2.0 * s).variance(),
    "sampling.Discrete": lambda s: sampling.Discrete(jnp.stack([s, 1.0 + s])).probability,
    "sampling.PiecewiseConstant": lambda s: sampling.PiecewiseConstant(
        jnp.stack([s, 2.0]), -s, s
    ).sample(0.4),
    "sampling.UniformDirections": lambda s: (
        sampling.UniformDirections().sample(s),
        sampling.UniformDirections().density(s),
    ),
    "sampling.combine": lambda s: sampling.combine([sampling.estimate(jnp.stack([s, -s]))] * 2),
    "sampling.estimate": lambda s: sampling.estimate(jnp.stack([s, 2.0 * s, 0.1])),
    "sampling.jittered": lambda s: s * sampling.jittered(jax.random.key(0), 3),
    "sampling.midpoints": lambda s: s * sampling.midpoints(3),
    "bandwidth.BandLimit": lambda s: (
        band(s).reach(ray(FLATLAND)),
        band(s).farthest(ray(FLATLAND)),
    ),
    "reconstruction.LineCell": lambda s: cell(s).mean(1),
    "reconstruction.GridInterpolant": lambda s: reconstruction.GridInterpolant(
        jnp.stack([0.0 * s, s]), jnp.stack([-s, s]), s * jnp.ones((2, 2, 3))
    )(0.4 * s, 0.1 * s),
    "reconstruction.LineSamples": lambda s: sampled(s).interpolant()(0.4 * s),
    "reconstruction.line_by_curvature": lambda s: reconstruction.line_by_curvature(cell(s)),
    "reconstruction.line_by_differences": lambda s: reconstruction.line_by_differences(cell(s)),
    "reconstruction.line_by_disagreement": lambda s: reconstruction.line_by_disagreement(2)(
        cell(s)
    ),
    "reconstruction.line_by_gradient": lambda s: reconstruction.line_by_gradient(cell(s)),
    "reconstruction.line_by_length": lambda s: reconstruction.line_by_length(cell(s)),
    "reconstruction.sample_line": lambda s: sampled(s).data,
    "reconstruction.HermiteInterpolant": lambda s: reconstruction.HermiteInterpolant(
        jnp.stack([0.0 * s, s]), jnp.stack([s, 1.0 + 0.0 * s, -s, s]).reshape(2, 2)
    )(0.4 * s),
    "bandwidth.band_limit_after": lambda s: bandwidth.band_limit_after(
        laws.Convolve(lobe(s)), band(s)
    ).extent("x"),
    "bandwidth.band_limit": lambda s: bandwidth.band_limit(light(s)).extent("x"),
    "bandwidth.path_band_limits": lambda s: bandwidth.path_band_limits(
        light(s) >> transport.Curvature(s)
    )[-1].extent("x"),
    "bandwidth.PixelDifferences": lambda s: bandwidth.screen_glossy_bandwidth(s, turns(s)),
    "bandwidth.blocker_distance": lambda s: blocked(s)[:, 0],
    "bandwidth.diffuse_bandwidth_map": lambda s: bandwidth.diffuse_bandwidth_map(s, shown(s), s, s),
    "bandwidth.glossy_bandwidth_map": lambda s: bandwidth.glossy_bandwidth_map(s, shown(s), s, s),
    "bandwidth.mean_inverse_distance": lambda s: (
        bandwidth.mean_inverse_distance(blocked(s)),
        bandwidth.mean_inverse_distance(jnp.stack([s, 2.0]), jnp.stack([s, 1.0])),
    ),
    "bandwidth.radians_per_pixel": lambda s: bandwidth.radians_per_pixel(
        imaging.pinhole((0.0, 0.0, 4.0), (0.0, 0.0, 0.0), up=(0.0, 1.0, 0.0), gamma=1.0 + s),
        jnp.stack([jnp.stack([0.0, s]), jnp.zeros(2)]),
        0.1 * s,
    ),
    "bandwidth.rms_cutoff": lambda s: bandwidth.rms_cutoff(0.5 + s),
    "bandwidth.screen_diffuse_bandwidth": lambda s: bandwidth.screen_diffuse_bandwidth(
        s, turns(s), s, s
    ),
    "bandwidth.screen_glossy_bandwidth": lambda s: bandwidth.screen_glossy_bandwidth(
        s, turns(s), s, s
    ),
    "bandwidth.glossy_bandwidth": lambda s: bandwidth.glossy_bandwidth(s, s, -s, s, s),
    "bandwidth.glossy_bandwidth_in_space": lambda s: bandwidth.glossy_bandwidth_in_space(
        s, s, jnp.eye(2) * s, s
    ),
    "bandwidth.ReliefCutoffs": lambda s: bandwidth.ReliefCutoffs(s, s, s, s).bumps,
    "bandwidth.relief_cutoffs": lambda s: tuple(
        bandwidth.relief_cutoffs(0.1 * s, 9.0, s, s, width=s, view=0.1 * s, reach=0.5)
    ),
    "bandwidth.flat_relief_error": lambda s: bandwidth.flat_relief_error(
        0.01 * s, s, s, s, view=s, reach=s
    ),
    "bandwidth.bump_relief_error": lambda s: bandwidth.bump_relief_error(
        0.01 * s, s, s, s, view=s, reach=s
    ),
    "bandwidth.brdf_relief_error": lambda s: bandwidth.brdf_relief_error(
        0.01 * s, 9.0, s, s, width=0.1 * s, view=s, reach=s
    ),
    "bandwidth.relief_transfer": lambda s: jnp.abs(bandwidth.relief_transfer(s, 0.1 * s, s)),
    "bandwidth.Relief": lambda s: (
        relief(s).rms_slope,
        bandwidth.Relief.waves(s, s).curvature,
        bandwidth.Relief.of(jnp.stack([0.0 * s, s, -s, 0.5 * s]), 1.0).slope,
    ),
    "bandwidth.flat_shape_error": lambda s: bandwidth.flat_shape_error(
        relief(s), s, s, view=0.1 * s, reach=0.5
    ),
    "bandwidth.bump_shape_error": lambda s: bandwidth.bump_shape_error(
        relief(s), s, s, view=0.1 * s, reach=0.5
    ),
    "bandwidth.brdf_shape_error": lambda s: bandwidth.brdf_shape_error(
        relief(s), s, s, width=0.1 * s, view=0.1 * s, reach=0.5
    ),
    "bandwidth.shape_cutoffs": lambda s: tuple(
        bandwidth.shape_cutoffs(0.1 * s, relief(s), s, s, width=s, view=0.1 * s, reach=0.5)
    ),
    "bandwidth.shape_transfer": lambda s: jnp.abs(
        bandwidth.shape_transfer(s, jnp.stack([0.1 * s, -0.2 * s]), 0.3 * s)
    ),
    "bandwidth.shape_transfer_in_space": lambda s: jnp.abs(
        bandwidth.shape_transfer_in_space(
            jnp.stack([s, 2.0, 1.0]),
            jnp.stack([jnp.stack([0.1 * s, 0.2]), -jnp.ones(2) * s]),
            jnp.stack([0.6, 0.0 * s, 0.8]),
        )
    ),
    "bandwidth.PitCutoffs": lambda s: bandwidth.PitCutoffs(s, s, s).brdf,
    "bandwidth.pit_texture_error": lambda s: bandwidth.pit_texture_error(
        0.1 * s, s, albedo=0.5 * s
    ),
    "bandwidth.pit_brdf_error": lambda s: bandwidth.pit_brdf_error(
        0.1 * s, 9.0, s, width=0.1 * s, albedo=0.5 * s, share=0.5 * s
    ),
    "bandwidth.pit_cutoffs": lambda s: tuple(
        bandwidth.pit_cutoffs(0.1 * s, 9.0, s, width=s, albedo=0.5 * s)
    ),
    "bandwidth.glossy_criterion": lambda s: bandwidth.glossy_criterion(s, s, s, s),
    "reconstruction.hermite_basis": lambda s: reconstruction.hermite_basis(s, 3),
    "reconstruction.interpolation_error": lambda s: reconstruction.interpolation_error(s, s, 2),
    "bandwidth.occluded_bandwidth": lambda s: bandwidth.occluded_bandwidth(s, s, s, s, s, s, s, s),
    "bandwidth.occluded_criterion": lambda s: bandwidth.occluded_criterion(s, s, s, s, s),
}
