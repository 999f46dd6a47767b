"""Band limits of profiles whose spectra one knows."""

import numpy as np
import pytest
from scipy.special import erfcinv, sici

from firstorder.errors import Refused
from firstorder.symbolic._energy import measured_band_limit


@pytest.mark.parametrize("share", [0.3, 1e-2, 1e-6])
@pytest.mark.parametrize("sigma", [0.1, 3.0])
def test_a_bell_has_the_energy_of_a_bell_beyond(sigma, share):
    """Its power is `exp(-4 pi^2 sigma^2 Omega^2)`."""
    found = measured_band_limit(lambda t: np.exp(-0.5 * (t / sigma) ** 2), 8.0 * sigma, share)
    true = erfcinv(share) / (2.0 * np.pi * sigma)
    np.testing.assert_allclose(found.Omega, true, rtol=1e-7)
    assert abs(found.Omega - true) <= found.error <= 1e-7 * found.Omega
    assert found.share == share


def test_rounding_counts_where_little_energy_is_left():
    """The share is known to some roundings, and the limit to these over its density there."""
    share, eps = 1e-7, np.finfo(float).eps
    found = measured_band_limit(lambda t: np.exp(-0.5 * t**2), 9.0, share)
    x = 2.0 * np.pi * found.Omega
    density = 4.0 * np.sqrt(np.pi) * np.exp(-(x**2))
    assert 200.0 * eps / density < found.error < 400.0 * eps / density  # 256 nodes


def test_a_box_has_the_energy_of_a_squared_sinc_beyond():
    """Within `|Omega| < 1/2` of a box of width one: `2 Si(pi) / pi - 4 / pi^2`."""
    share = 1.0 - (2.0 * sici(np.pi)[0] / np.pi - 4.0 / np.pi**2)
    found = measured_band_limit(lambda t: np.ones_like(t), 0.5, share)
    np.testing.assert_allclose(found.Omega, 0.5, rtol=1e-9)
    wider = measured_band_limit(lambda t: 3.0 * np.ones_like(t), 2.0, share)
    np.testing.assert_allclose(wider.Omega, 0.125, rtol=1e-9)


def test_profiles_need_not_be_even():
    """A shift changes no power."""
    shifted = measured_band_limit(lambda t: np.exp(-0.5 * (t - 1.0) ** 2), 10.0, 1e-3)
    np.testing.assert_allclose(shifted.Omega, erfcinv(1e-3) / (2.0 * np.pi), rtol=1e-7)


def test_what_jumps_has_energy_at_all_frequencies():
    with pytest.raises(Refused, match="larger share"):
        measured_band_limit(lambda t: np.ones_like(t), 0.5, 1e-5)


@pytest.mark.parametrize("share", [1e-9, 1e-12, 1e-15, 1e-18])
def test_a_share_that_is_lost_in_rounding_is_said_to_be(share):
    """A bell jumps nowhere."""
    with pytest.raises(Refused, match="lost in rounding; ask for a larger share"):
        measured_band_limit(lambda t: np.exp(-0.5 * t**2), 9.0, share)


@pytest.mark.parametrize("share", [1e-4, 1e-6, 1e-9, 1e-12])
def test_a_jump_is_said_to_be_one(share):
    with pytest.raises(Refused, match="what jumps"):
        measured_band_limit(lambda t: np.exp(-t), 1.0, share)


@pytest.mark.parametrize("share", [0.0, 1.0, -0.1, 1.1, np.nan])
def test_a_share_lies_between_nothing_and_all(share):
    with pytest.raises(ValueError, match="`share` must lie between 0 and 1"):
        measured_band_limit(np.cos, 1.0, share)
