"""Probes of light and of what it is made of."""

import jax.numpy as jnp
import numpy as np

from firstorder import fields, transport
from firstorder.conventions import FLATLAND
from firstorder.fields import Grid, _haar, _series
from tests.probes.light import GRID, OFFSET, SLOPE, jet, light, mask, ray

PROBES = {
    "fields.Affine": lambda s: jet(fields.Affine(jnp.stack([s, 1.0]), s)),
    "fields.Bars": lambda s: jet(transport.comb_blocker(s, 3, SLOPE).transparency),
    "fields.BoxProfile": lambda s: fields.BoxProfile(s, "x", SLOPE).transform(jnp.asarray(0.3)),
    "fields.Constant": lambda s: jet(fields.Constant(s)),
    "fields.Covariance": lambda s: fields.Covariance(jnp.eye(2) * s).matrix,
    "fields.DiracProfile": lambda s: fields.DiracProfile("x", weight=s).transform(jnp.asarray(0.3)),
    "fields.Edge": lambda s: (
        mask(s).edges()[0].crossing(ray(SLOPE), 0, jnp.asarray(-2.0), jnp.asarray(2.0))
    ),
    "fields.Environment": lambda s: jet(
        fields.Environment(fields.Harmonics(jnp.stack([1.0, s]), jnp.stack([0.0, 0.2])))
    ),
    "fields.Extent": lambda s: fields.Extent.box([s, 0.0], [s, 1.0]).along([1.0, s]),
    "fields.UniformProfile": lambda s: jet(fields.UniformProfile(height=s)),
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
    "fields.Spline": lambda s: jet(fields.Spline(GRID.sample(light(s)), GRID)),
    "fields.SampledSpectrum": lambda s: fields.SampledSpectrum.of(light(s), GRID).at(ray(FLATLAND)),
    "fields.Separable": lambda s: jet(
        fields.Separable(
            jnp.stack([s, 0.0]),
            (fields.GaussianProfile(s, "x"), fields.GaussianProfile(0.5, "theta")),
        )
    ),
    "fields._series.Series": lambda s: light(s).series(GRID).coefficients,
    "fields.SoftSlit": lambda s: jet(
        fields.SoftSlit(fields.Affine(jnp.stack([1.0, s]), 0.1), s, 0.2 + s)
    ),
    "fields.SoftEdge": lambda s: jet(fields.SoftEdge(fields.Affine(jnp.ones(2), 0.1), s)),
    "fields.Sum": lambda s: jet(fields.Sum((light(s), light(2.0 * s)), jnp.stack([s, 1.0]))),
    "fields.SumSpectrum": lambda s: fields.SumSpectrum(
        (light(s).spectrum(), light(2.0 * s).spectrum()), jnp.stack([s, 1.0])
    ).at(ray(FLATLAND)),
    "fields.Wavelet": lambda s: fields.Wavelet.of(
        light(s), Grid.spanning((4, 8), (2.0, 2.0))
    ).samples(),
    "fields.autodiff_jet": lambda s: fields.autodiff_jet(light(s).at, ray(FLATLAND), FLATLAND),
    "fields._series.axis_series": lambda s: _series.axis_series(
        lambda k, period: s / (1.0 + (k / period) ** 2), jnp.stack([s, 1.0]), GRID, 0
    ),
    "fields.covariance_of": lambda s: fields.covariance_of(light(s), GRID).matrix,
    "fields.covariance_of_samples": lambda s: (
        fields.covariance_of_samples(GRID.sample(light(s)), GRID, FLATLAND).matrix
    ),
    "fields.discrete_transform": lambda s: fields.discrete_transform(
        GRID.sample(light(s)), GRID, np.array([0.1, 0.3]), np.array([0.2])
    ),
    "fields.gaussian": lambda s: light(s).spectrum().at(ray(FLATLAND)),
    "fields._haar.haar_matrix": lambda s: s * jnp.asarray(_haar.haar_matrix(4)),
    "fields.half_plane": lambda s: jet(mask(s)),
    "fields.point_light": lambda s: (
        fields.point_light(s, fields.GaussianProfile(0.3, "v", SLOPE)).spectrum().at(ray(SLOPE))
    ),
    "fields._series.sampled_series": lambda s: _series.sampled_series(light(s), GRID),
    "fields.spot_light": lambda s: jet(
        fields.spot_light(s, 0.5, fields.GaussianProfile(0.3, "v", SLOPE))
    ),
    "fields._haar.triple_products": lambda s: s * jnp.asarray(_haar.triple_products(4)),
}
