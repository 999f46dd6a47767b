import numpy as np
import pytest

from firstorder.conventions import FLATLAND
from firstorder.fields import Grid, covariance_of, covariance_of_samples, gaussian
from firstorder.laws import Move

GRID = Grid.spanning((64, 65), (4.5, 4.0))


def light():
    return gaussian((0.21, -0.13), (0.5, 0.4), 0.35, 1.3)


def test_both_forms_of_the_definition_agree():
    """Moments of the power, and mean squared gradients: Parseval's theorem."""
    by_power = covariance_of_samples(GRID.sample(light()), GRID, light().frame).matrix
    by_gradient = covariance_of(light(), GRID).matrix
    np.testing.assert_allclose(by_power, by_gradient, rtol=1e-10)
    np.testing.assert_allclose(by_gradient, light().covariance().matrix, rtol=1e-10)


def test_about_zero_and_blind_to_place_and_strength():
    S = light().covariance().matrix
    other = gaussian((1.0, 2.0), (0.5, 0.4), 0.35, 7.0).covariance().matrix
    np.testing.assert_allclose(S, other)


def test_units():
    """In another unit of position frequencies scale inversely, their moments with the square."""
    S = Move([[1e-2, 0.0], [0.0, 1.0]])(light().covariance()).matrix  # x in centimetres
    np.testing.assert_allclose(S, light().covariance().matrix * np.array([[1e-4, 1e-2], [1e-2, 1]]))


def test_it_is_narrower_where_light_is_wider():
    S = light().covariance().matrix
    assert float(S[0, 0]) == pytest.approx(1 / (8 * np.pi**2 * 0.5**2 * (1 - 0.35**2)))


def test_samples_that_do_not_fit_their_grid_are_one_sentence():
    with pytest.raises(ValueError, match="`samples` must have shape"):
        covariance_of_samples(np.ones((4, 5)), Grid((4, 4), (1.0, 1.0)), FLATLAND)
