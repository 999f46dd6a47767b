"""Where light lies: checked against the light itself, on samples."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from firstorder.checks.cases import light
from firstorder.conventions import FLATLAND_SLOPE
from firstorder.fields import (
    BoxProfile,
    Extent,
    GaussianProfile,
    Grid,
    SampledSpectrum,
    Separable,
    Spline,
    gaussian,
    half_plane,
    spot_light,
)
from firstorder.laws import Circle, Convolve, Integrate, Move, Multiply
from firstorder.transport import Curvature, Mirror, Reflection, Travel, VaryingGaussian, wave

SPOT = spot_light(0.3, 0.5, GaussianProfile(0.2, "v", FLATLAND_SLOPE))
LIGHTS = {
    "bell": light(FLATLAND_SLOPE),
    "travelled": Travel(2.0)(light(FLATLAND_SLOPE)),
    "spot": SPOT,
    "spot from afar": Travel(2.0)(SPOT),
    "two": gaussian((0.0, 0.0), (0.3, 0.2)) + gaussian((2.0, 1.0), (0.1, 0.4)),
    "two from afar": Travel(1.0)(light(FLATLAND_SLOPE) + SPOT),
    "blurred": Convolve(GaussianProfile(0.3))(light()),
    "turned and blurred": (Curvature(0.4) >> Mirror() >> Reflection(GaussianProfile(0.2)))(light()),
    "behind an edge": Multiply(half_plane(0.1))(light()),
    "sampled": Spline.of(gaussian((0.2, 0.1), (0.3, 0.3)), Grid.spanning((16, 17), (2.0, 2.2))),
}


@pytest.mark.parametrize("name", LIGHTS)
def test_light_is_dark_outside_its_extent_and_bright_near_its_ends(name):
    field = LIGHTS[name]
    extent = field.spectrum().extent()
    for axis in np.eye(2):
        low, high = extent.along(axis, 4.0)
        span = float(high - low)
        t = np.linspace(float(low) - 0.5 * span, float(high) + 0.5 * span, 81)
        s = np.linspace(-6.0, 6.0, 241)
        across = np.array([-axis[1], axis[0]])
        points = t[:, None, None] * axis + s[None, :, None] * across
        values = np.max(np.abs(jax.jit(lambda p, f=field: f(p[..., 0], p[..., 1]))(points)), axis=1)
        peak, inside = np.max(values), (t > low - 1e-9) & (t < high + 1e-9)
        assert np.max(values[~np.asarray(inside)]) < 1e-3 * peak
        if name not in ("behind an edge", "sampled"):  # there it is wider than it must be
            assert np.max(values[np.abs(t - float(low)) < 0.35 * span]) > 1e-3 * peak


def test_the_extent_moves_as_its_points_do():
    box = Extent(jnp.array([[1.0, 2.0]]), jnp.zeros((1, 2, 2)), jnp.array([[[0.5, 0.25]]]))
    moved = box.moved(jnp.array([[0.0, 3.0], [1.0, 0.0]]), jnp.array([10.0, -5.0]))
    np.testing.assert_allclose(moved.along([1.0, 0.0]), (15.25, 16.75))
    np.testing.assert_allclose(moved.along([0.0, 1.0]), (-4.5, -3.5))


def test_a_coordinate_that_is_integrated_is_gone():
    f = light(FLATLAND_SLOPE)
    E = Integrate("v", -9.0, 9.0)(Travel(2.0)(f)).spectrum().extent()
    moved = Travel(2.0)(f).spectrum().extent()
    assert E is not None
    assert moved is not None
    np.testing.assert_allclose(E.along([1.0]), moved.along([1.0, 0.0]), rtol=1e-14)


def test_what_is_not_known_is_not_said():
    F = light().spectrum()
    assert Convolve(GaussianProfile(0.3), Circle())(F).extent() is None
    assert (F + Convolve(GaussianProfile(0.3), Circle())(F)).extent() is None
    box = SampledSpectrum.of(light(), Grid.spanning((8, 8), (1.0, 2.0))).extent()
    np.testing.assert_allclose(box.along([0.0, 1.0]), [-2.0, 2.0])


def test_lobes_that_vary_widen_by_their_widest():
    lobe = VaryingGaussian(wave(0.25, 0.05, mean=0.2), 0.25)
    blurred = Convolve(lobe, window=Grid.spanning((64, 8), (6.0, 6.0)))(light().spectrum())
    own, wider = light().spectrum().extent(), blurred.extent()
    assert own is not None
    assert wider is not None
    low, high = own.along([0.0, 1.0], 4.0)
    np.testing.assert_allclose(wider.along([0.0, 1.0], 4.0), [low - 2.25, high + 2.25], rtol=1e-14)


def test_the_ends_of_a_box_have_derivatives():
    def end(w):
        light = Separable([0.0, 0.0], (BoxProfile(w, "x"), BoxProfile(0.2, "v")))
        extent = Move([[1.0, 0.5], [0.0, 1.0]])(light).spectrum().extent()
        assert extent is not None
        return extent.along([1.0, 0.0])[1]

    assert abs(jax.grad(end)(0.7) - 1.0) < 1e-14
    assert isinstance(Extent.box([0.0], [jnp.asarray(1.0)]), Extent)
