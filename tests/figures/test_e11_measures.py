"""What E11's figures measure by, on numbers of which the answer is known."""

import numpy as np
import pytest

from figures.e11.shared import measures


def test_errors_of_known_differences():
    found, true = np.zeros((10, 10)), np.zeros((10, 10))
    found[0, 0] = -0.5
    off = measures.errors(found, true)
    assert off.rms == pytest.approx(0.05)
    assert off.largest == 0.5
    assert off.percentile99 == pytest.approx(0.005)  # a hundredth of the way to the largest


def test_pixels_outside_the_mask_do_not_count():
    found, true = np.array([0.5, np.nan]), np.array([0.25, 0.0])
    assert measures.errors(found, true, [True, False]) == (0.25, 0.25, 0.25)


def test_only_the_penumbra_has_effective_rays():
    true = np.array([0.0, 0.5, 1.0, 0.25])
    assert measures.effective(np.array([1e9, 10.0, 1e9, 20.0]), true) == 15.0


@pytest.mark.parametrize("target", [0.5, 0.1, 0.031])
def test_rays_of_equal_error_on_a_power_law(target):
    rays = np.array([1, 4, 16, 64, 256])
    found = measures.equal_rays(rays, 0.5 * rays**-0.75, target)
    assert found.rays == pytest.approx((0.5 / target) ** (4.0 / 3.0))
    assert found.inside


@pytest.mark.parametrize("target", [2.0, 1e-4])
def test_beyond_the_ends_the_curve_is_continued_and_says_so(target):
    rays = np.array([1, 4, 16])
    found = measures.equal_rays(rays, rays**-0.5, target)
    assert found.rays == pytest.approx(target**-2)
    assert not found.inside
    assert "continued" in found.text


def test_rays_of_equal_error_on_a_curve_that_bends():
    """Between the second and the third, on the segment of slope -1."""
    found = measures.equal_rays([1, 10, 100], [1.0, 0.3, 0.03], 0.03 * 10**0.5)
    assert found.rays == pytest.approx(100 / 10**0.5)


def test_slopes():
    assert measures.slope([1, 2, 4, 8], 3.0 * np.array([1, 2, 4, 8]) ** -0.5) == pytest.approx(-0.5)


def test_the_references_error_is_taken_out():
    true = np.array([0.04, 0.001])
    seen = np.sqrt(true**2 + 0.002**2)
    np.testing.assert_allclose(measures.without_reference(seen, 0.002), true)
    assert np.isnan(measures.without_reference(0.001, 0.002))
