"""Random directions in the sectors of a hemicircle."""

import jax
import numpy as np
import pytest

from firstorder.checks.statistics import LEVEL
from firstorder.flatland.estimators.strata import gap_quadrature, hemicircle_strata
from tests.samplers import uniform_p_value

BORDERS = np.array([-0.5 * np.pi, -0.7, 0.4, 0.5 * np.pi])


def test_borders_out_of_order_are_refused():
    with pytest.raises(ValueError, match="must ascend from -pi/2 to pi/2"):
        hemicircle_strata(BORDERS[[0, 2, 1, 3]])


def test_a_number_of_sectors_is_any_integer():
    assert hemicircle_strata(np.int64(4)).angles.tolist() == hemicircle_strata(4).angles.tolist()
    with pytest.raises(ValueError, match="must be how many sectors, or a row of borders"):
        hemicircle_strata(4.0)


def test_no_borders_and_ends_of_many_receivers_are_refused():
    with pytest.raises(ValueError, match="must be how many sectors, or a row of borders"):
        hemicircle_strata(np.zeros(0))
    with pytest.raises(ValueError, match="`ends` must be a row of two angles or more"):
        gap_quadrature(np.zeros((2, 3)), 4)


def places(key, cosine):
    """Where in its sector each of many directions lies, by angle or by sine: (n, 3)."""
    keys = jax.random.split(key, 8000)
    angles = jax.jit(jax.vmap(lambda k: hemicircle_strata(BORDERS, k, cosine).angles))(keys)
    low, high = (np.sin(b) if cosine else b for b in (BORDERS[:-1], BORDERS[1:]))
    return ((np.sin(angles) if cosine else np.asarray(angles)) - low) / (high - low)


@pytest.mark.parametrize("cosine", [False, True])
def test_directions_in_a_sector_follow_its_measure(cosine, key):
    """And those of one sector do not know of the others'."""
    assert uniform_p_value(places(key, cosine)) > LEVEL


def test_the_wrong_measure_is_noticed(key):
    angles = BORDERS[0] + places(key, False)[:, 0] * (BORDERS[1] - BORDERS[0])
    low, high = np.sin(BORDERS[:2])
    assert uniform_p_value((np.sin(angles) - low) / (high - low)) < LEVEL
