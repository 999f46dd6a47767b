"""Probes of samplers and of the methods that plan by derivatives."""

import jax
import jax.numpy as jnp

from firstorder import bandwidth, laws, reconstruction, sampling, transport
from firstorder.conventions import FLATLAND
from tests.probes.light import light, lobe, ray


def band(s):
    return bandwidth.BandLimit.box(jnp.stack([s, 2.0 + s])).cut("theta", 1.0)


def cell(s):
    return reconstruction.Cell(s, jnp.stack([s, 1.0, -s]), jnp.stack([s**2, -s, 1.0]))


def sampled(s):
    """Adaptive samples of a function with a parameter, on a line that grows with it."""
    return reconstruction.sample_line(lambda x: (s * x**2, 2.0 * s * x), 0.0, s, 6, initial=3)


PROBES = {
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
    "bandwidth.BandLimit": lambda s: (
        band(s).reach(ray(FLATLAND)),
        band(s).farthest(ray(FLATLAND)),
    ),
    "reconstruction.Cell": lambda s: cell(s).mean(1),
    "reconstruction.GridInterpolant": lambda s: reconstruction.GridInterpolant(
        jnp.stack([0.0 * s, s]), jnp.stack([-s, s]), s * jnp.ones((2, 2, 3))
    )(0.4 * s, 0.1 * s),
    "reconstruction.LineSamples": lambda s: sampled(s).interpolant()(0.4 * s),
    "reconstruction.by_curvature": lambda s: reconstruction.by_curvature(cell(s)),
    "reconstruction.by_differences": lambda s: reconstruction.by_differences(cell(s)),
    "reconstruction.by_disagreement": lambda s: reconstruction.by_disagreement(2)(cell(s)),
    "reconstruction.by_gradient": lambda s: reconstruction.by_gradient(cell(s)),
    "reconstruction.by_length": lambda s: reconstruction.by_length(cell(s)),
    "reconstruction.sample_line": lambda s: sampled(s).data,
    "reconstruction.Interpolant": lambda s: reconstruction.Interpolant(
        jnp.stack([0.0 * s, s]), jnp.stack([s, 1.0 + 0.0 * s, -s, s]).reshape(2, 2)
    )(0.4 * s),
    "bandwidth.after": lambda s: bandwidth.after(laws.Convolve(lobe(s)), band(s)).extent("x"),
    "bandwidth.band_limit": lambda s: bandwidth.band_limit(light(s)).extent("x"),
    "bandwidth.band_limits": lambda s: bandwidth.band_limits(light(s) >> transport.Curvature(s))[
        -1
    ].extent("x"),
    "bandwidth.glossy_bandwidth": lambda s: bandwidth.glossy_bandwidth(s, s, -s, s, s),
    "bandwidth.glossy_bandwidth_in_space": lambda s: bandwidth.glossy_bandwidth_in_space(
        s, s, jnp.eye(2) * s, s
    ),
    "bandwidth.glossy_criterion": lambda s: bandwidth.glossy_criterion(s, s, s, s),
    "reconstruction.hermite_basis": lambda s: reconstruction.hermite_basis(s, 3),
    "reconstruction.interpolation_error": lambda s: reconstruction.interpolation_error(s, s, 2),
    "bandwidth.occluded_bandwidth": lambda s: bandwidth.occluded_bandwidth(s, s, s, s, s, s, s, s),
    "bandwidth.occluded_criterion": lambda s: bandwidth.occluded_criterion(s, s, s, s, s),
}
