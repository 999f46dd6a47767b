import jax.numpy as jnp
import numpy as np
import pytest

from firstorder.checks.tolerance import normwise
from firstorder.conventions import FLATLAND, FLATLAND_SLOPE
from firstorder.fields import Constant, GaussianProfile, Grid, gaussian
from firstorder.transport import Blend, Reflection, Texture, wave

OUT = gaussian((0.0, 0.0), (1.0, 1.0)).frame.turned()
L = gaussian((0.2, -0.1), (0.7, 0.5), 0.4, frame=OUT)
WINDOW = Grid.spanning((8, 8), (6.0, 6.0))
STRIPES = wave(0.8, 0.35, 0.7, 0.6, frame=OUT)


def test_a_texture_makes_replicas_along_space_alone():
    F, T = L.spectrum(), Texture(STRIPES, WINDOW)(L.spectrum())
    Ox, Ot = jnp.array([0.1, 0.9, -0.7]), jnp.array([0.2, -0.1, 0.3])
    side = 0.5 * 0.35 * np.exp(0.7j)
    wanted = 0.6 * F(Ox, Ot) + side * F(Ox - 0.8, Ot) + np.conj(side) * F(Ox + 0.8, Ot)
    assert normwise(T(Ox, Ot), wanted) < 1e-14


def test_texture_and_reflection_commute_and_make_a_blend():
    """D05 §4.5: a BRDF separable into texture and lobe is both, in either order."""
    lobe = GaussianProfile(0.3, frame=OUT)
    ray = jnp.array([0.3, 0.2])
    first = (Texture(STRIPES) >> Reflection(lobe))(L).jet(ray)
    last = (Reflection(lobe) >> Texture(STRIPES))(L).jet(ray)
    blend = Reflection(Blend((lobe,), (STRIPES,)))(L).jet(ray)
    assert normwise(first.hessian, last.hessian) < 1e-13
    assert normwise(blend.hessian, last.hessian) < 1e-13


@pytest.mark.smoke
def test_a_white_texture_does_nothing():
    assert Texture(Constant(1.0, OUT))(L)(0.3, 0.2).item() == L(0.3, 0.2).item()


def test_bad_patterns_are_refused():
    with pytest.raises(ValueError, match="`pattern` of Texture must be over"):
        Texture(Constant(1.0, FLATLAND))(gaussian((0.0, 0.0), (1.0, 1.0), frame=FLATLAND_SLOPE))
    with pytest.raises(ValueError, match="`frequency` must be finite"):
        wave(float("inf"))
    with pytest.raises(ValueError, match="`frequency` must be one number, but has shape"):
        wave([0.5, 1.0, 1.5])


def test_derivatives_of_a_wave_are_those_of_its_cosine():
    """`mean + a cos(2 pi f x + phase)` of x alone."""
    for x in (0.0, 0.3, -0.7):
        jet = wave(0.5, 0.35, 0.7, 0.6).jet(jnp.array([x, 0.2]))
        p = np.pi * x + 0.7
        np.testing.assert_allclose(jet.value, 0.6 + 0.35 * np.cos(p), rtol=1e-14)
        slope, bend = -0.35 * np.pi * np.sin(p), -0.35 * np.pi**2 * np.cos(p)
        np.testing.assert_allclose(jet.gradient, [slope, 0.0], rtol=1e-13)
        np.testing.assert_allclose(jet.hessian, [[bend, 0.0], [0.0, 0.0]], rtol=1e-13)
