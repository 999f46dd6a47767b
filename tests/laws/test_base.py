"""What a law is by itself: where it sends a portrait, and what it refuses until it has a rule."""

import equinox as eqx
import jax.numpy as jnp
import numpy as np
import pytest

from firstorder.conventions import FLATLAND, FLATLAND_SLOPE, Frame
from firstorder.errors import Refused
from firstorder.fields import Affine, Constant, Edge, Grid, gaussian
from firstorder.fields._series import Series
from firstorder.fields.covariance import Covariance
from firstorder.fields.extent import Extent
from firstorder.fields.spectrum import Spectrum
from firstorder.fields.wavelet import Wavelet
from firstorder.laws.base import FieldImage, Law, SpectrumImage

L = gaussian((0.2, -0.1), (0.5, 0.8), 0.3, 2.0)
U = jnp.array([0.4, 0.1])


class Plain(Law):
    """`3 f`, with values and jets only."""

    jumps: bool = eqx.field(static=True, default=False)

    def value(self, f, u):
        return 3.0 * f.at(u)

    def jet(self, f, u):
        return f.jet(u).scaled(3.0)

    def edges(self, f):
        return (Edge(Affine([1.0, 0.0], 0.0), Constant(1.0)),) if self.jumps else ()


class Full(Plain):
    """With rules for all portraits, each of which is seen in the answer."""

    def frame(self, frame):
        return FLATLAND_SLOPE

    def spectrum(self, F, Omega):
        return 3.0 * F.at(Omega) + 1.0j

    def extent(self, extent, frame):
        return Extent(extent.center + frame.dims, extent.spread, extent.sides)

    def covariance(self, S):
        return Covariance(9.0 * S.matrix, S.frame)

    def wavelet(self, W):
        return W

    def series(self, f, window):
        return Series(jnp.zeros((1, 2)), f.at(U)[None] + 1j * window.size[0])


class Endless(Spectrum):
    """Of light whose extent nobody knows."""

    frame: Frame = eqx.field(static=True, default=FLATLAND)

    def at(self, Omega):
        return 1.0 + 0.0j * Omega[0]


def test_a_law_of_values_and_jets_refuses_the_other_portraits():
    law = Plain()
    W = Wavelet.of_samples(jnp.eye(4), Grid((4, 4), (0.5, 0.5)), FLATLAND)
    assert Full()(W) is W
    for refused, words in (
        (lambda: law.push(L.jet(U), U), "^plain looks at many rays"),
        (lambda: law(L.spectrum()), "^plain has no simple Fourier formula"),
        (lambda: law(L.covariance()), "^plain has no covariance rule"),
        (lambda: law(W), "^plain has no simple wavelet formula"),
        (lambda: law(L.jet(U)), r"use push\(jet, u\)"),
        (lambda: Plain(jumps=True).series(L, Grid((4, 4), (1.0, 1.0))), "a plain with edges"),
    ):  # fmt: skip
        with pytest.raises(Refused, match=words):
            refused()
    assert law.extent(L.spectrum().extent(), FLATLAND) is None
    assert law.frame(FLATLAND) == FLATLAND


def test_what_is_no_portrait_is_refused():
    with pytest.raises(TypeError, match="portrait"):
        Plain()(3.0)


def test_the_image_of_a_field_asks_the_law():
    image = Full(jumps=True)(L)
    assert isinstance(image, FieldImage)
    assert image.frame == FLATLAND_SLOPE
    assert image.at(U) == 3.0 * L.at(U)
    jet, true = image.jet(U), L.jet(U)
    np.testing.assert_array_equal(jet.gradient, 3.0 * true.gradient)
    np.testing.assert_array_equal(jet.hessian, 3.0 * true.hessian)
    assert len(image.edges()) == 1
    assert Full()(L).edges() == ()
    window = Grid((4, 4), (1.0, 1.0))
    np.testing.assert_array_equal(image.series(window).coefficients, [L.at(U) + 4.0j])
    np.testing.assert_allclose(image.covariance().matrix, 9.0 * L.covariance().matrix)
    Omega = jnp.array([0.3, -0.2])
    assert image.spectrum().at(Omega) == 3.0 * L.spectrum().at(Omega) + 1.0j


def test_the_series_of_a_law_without_edges_is_that_of_its_samples():
    """A bell within a wide window: at its middle the series sums to three times the bell."""
    series = Plain().series(L, Grid.spanning((48, 48), (6.0, 6.0)))
    waves = np.exp(2j * np.pi * np.asarray(series.frequencies) @ np.asarray(U))
    assert waves @ np.asarray(series.coefficients) == pytest.approx(3.0 * float(L.at(U)), rel=1e-8)


def test_the_image_of_a_spectrum_asks_the_law_and_knows_its_extent_if_the_light_has_one():
    F = L.spectrum()
    image = Full()(F)
    assert isinstance(image, SpectrumImage)
    assert image.frame == FLATLAND_SLOPE
    Omega = jnp.array([0.3, -0.2])
    assert image.at(Omega) == 3.0 * F.at(Omega) + 1.0j
    extent, own = image.extent(), F.extent()
    assert extent is not None
    assert own is not None
    np.testing.assert_array_equal(extent.center, own.center + 2)
    assert SpectrumImage(Full(), Endless()).extent() is None


def test_a_law_is_shown_by_its_name():
    assert "Plain" in repr(Plain())
