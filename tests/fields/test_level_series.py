"""Series of functions of a straight level, against their sums and against integrals by hand."""

import jax.numpy as jnp
import numpy as np
import pytest

from firstorder.conventions import Frame
from firstorder.fields import Affine, Grid
from firstorder.fields import _level_series as module

LEVEL = Affine([0.7, -1.5], 0.4)
WINDOW = Grid((6, 9), (0.5, 0.3), (0.2, -0.1))
# Over the box: 3 m by 2.7, about (0.2, -0.1).
MIDDLE, REACH = 0.7 * 0.2 + 1.5 * 0.1 + 0.4, 0.5 * (0.7 * 3.0 + 1.5 * 2.7)


def summed(series, u):
    """The series at rays, by hand."""
    waves = np.exp(2j * np.pi * np.asarray(u) @ np.asarray(series.frequencies).T)
    return waves @ np.asarray(series.coefficients)


def test_the_range_of_a_level_is_that_of_the_corners():
    low, high = module.level_range(LEVEL, WINDOW)
    assert low == pytest.approx(MIDDLE - REACH)
    assert high == pytest.approx(MIDDLE + REACH)
    corners = [
        0.7 * x - 1.5 * y + 0.4 for x in (0.2 - 1.5, 0.2 + 1.5) for y in (-0.1 - 1.35, -0.1 + 1.35)
    ]
    assert (low, high) == (pytest.approx(min(corners)), pytest.approx(max(corners)))


def test_a_series_of_a_level_is_that_of_its_function():
    """`3 + 2 cos(2 pi s / P) - sin(4 pi s / P)`, of s = level."""
    low, high = jnp.array(-5.0), jnp.array(7.0)
    seen = []

    def coefficients(k, period):
        seen.append((list(k), float(period)))
        return jnp.asarray(
            3.0 * (k == 0) + 1.0 * (abs(k) == 1) + np.where(abs(k) == 2, 0.5j * np.sign(k), 0.0)
        )

    found = module.level_series(coefficients, LEVEL, low, high, WINDOW)
    assert seen == [([-4, -3, -2, -1, 0, 1, 2, 3, 4], 12.0)]
    u = np.random.default_rng(0).normal(size=(5, 2))
    s = u @ np.array([0.7, -1.5]) + 0.4
    true = 3.0 + 2.0 * np.cos(2 * np.pi * s / 12.0) - np.sin(4 * np.pi * s / 12.0)
    np.testing.assert_allclose(summed(found, u), true, rtol=0.0, atol=1e-12)
    assert found.frequencies.shape == (9, 2)


PLACES, HEIGHTS = np.array([-1.0, 0.5, 1.2]), np.array([2.0, -1.0, 4.0, 0.5])


def by_integral(k, low, high):
    """`1/P int stair exp(-2 pi i k s / P) ds`, piece by piece in closed form."""
    P = high - low
    ends = np.clip(np.concatenate([[low], PLACES, [high]]), low, high)
    w = -2j * np.pi * k / P
    pieces = np.diff(ends) if k == 0 else np.diff(np.exp(w * ends)) / w
    return np.sum(HEIGHTS * pieces) / P


@pytest.mark.parametrize(("low", "high"), [(-3.0, 4.0), (-0.2, 4.0), (-3.0, 0.9), (2.0, 3.0)])
def test_a_stair_has_the_coefficients_of_its_pieces(low, high):
    """Places before or behind the period are as good as at its ends."""
    along = Affine([1.0], 0.0, Frame(("x",)))
    found = module.stair_waves(
        along, jnp.asarray(PLACES), jnp.asarray(HEIGHTS), jnp.array(low), jnp.array(high), 5
    )
    true = [by_integral(k, low, high) for k in range(-5, 6)]
    np.testing.assert_allclose(found.coefficients, true, rtol=0.0, atol=1e-13)
    np.testing.assert_allclose(found.frequencies[:, 0], np.arange(-5, 6) / (high - low))


def test_a_stair_on_a_window_has_its_levels_range_for_a_period():
    found = module.stair_series(LEVEL, jnp.asarray(PLACES), jnp.asarray(HEIGHTS), WINDOW)
    low, high = MIDDLE - REACH, MIDDLE + REACH
    k = np.arange(-4, 5)
    true = [by_integral(n, low, high) * np.exp(2j * np.pi * n * 0.4 / (high - low)) for n in k]
    np.testing.assert_allclose(found.coefficients, true, rtol=0.0, atol=1e-13)
    np.testing.assert_allclose(found.frequencies, np.outer(k / (high - low), [0.7, -1.5]))
