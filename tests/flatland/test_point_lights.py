"""Point lights keep what they are given; their light is `E = I cos(theta) / r`."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from firstorder import flatland
from firstorder.flatland import PointLights


def test_places_and_intensities_become_rows():
    one = PointLights((0.5, 0.25), 2.0)
    np.testing.assert_array_equal(one.position, [(0.5, 0.25)])
    np.testing.assert_array_equal(one.intensity, [2.0])
    two = PointLights([(0.0, 1.0), (2.0, 3.0)], [4.0, 0.0])
    np.testing.assert_array_equal(two.position, [(0.0, 1.0), (2.0, 3.0)])
    np.testing.assert_array_equal(two.intensity, [4.0, 0.0])
    bands = PointLights([(0.0, 1.0), (2.0, 3.0)], np.arange(6.0).reshape(2, 3))
    np.testing.assert_array_equal(bands.intensity, np.arange(6.0).reshape(2, 3))


@pytest.mark.parametrize(
    ("position", "intensity", "name"),
    [
        ((0.0, np.nan), 1.0, "position"),
        ((0.0, np.inf), 1.0, "position"),
        ((0.0, 1.0), -1.0, "intensity"),
        ((0.0, 1.0), np.nan, "intensity"),
        ([(0.0, 1.0), (2.0, 3.0)], [1.0, 1.0, 1.0], "intensity"),
        ([(0.0, 1.0)] * 3, [1.0, 1.0], "intensity"),
    ],
)
def test_what_is_no_light_is_refused(position, intensity, name):
    with pytest.raises(ValueError, match=f"`{name}`"):
        PointLights(position, intensity)


def test_a_traced_intensity_below_zero_is_not_a_number():
    found = jax.jit(lambda i: PointLights((0.0, 1.0), i).intensity)(jnp.array([-1.0]))
    assert np.isnan(found).all()


def test_irradiance_of_two_lights_is_the_sum_by_hand():
    lights = PointLights([(3.0, 4.0), (-1.0, 1.0)], [10.0, 2.0])
    wall = flatland.primitive(flatland.Segments((90.0, 90.0), (91.0, 90.0)))
    E = flatland.irradiance(
        flatland.Scene.of(wall, points=lights), flatland.Receiver.at((0.0, 0.0))
    )
    true = 10.0 * 0.8 / 5.0 + 2.0 * np.sqrt(0.5) / np.sqrt(2.0)
    np.testing.assert_allclose(E, true, rtol=1e-12)
