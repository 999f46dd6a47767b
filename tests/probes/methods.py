"""Probes of samplers and of the methods that plan by derivatives."""

import jax
import jax.numpy as jnp

from firstorder import laws, methods, sampling, transport
from firstorder.conventions import FLATLAND
from tests.probes.light import light, lobe, ray


def band(s):
    return methods.BandLimit.box(jnp.stack([s, 2.0 + s])).cut("theta", 1.0)


def cell(s):
    return methods.Cell(s, jnp.stack([s, 1.0, -s]), jnp.stack([s**2, -s, 1.0]))


def sampled(s):
    """Adaptive samples of a function with a parameter, on a line that grows with it."""
    return methods.sample_line(lambda x: (s * x**2, 2.0 * s * x), 0.0, s, 6, initial=3)


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
