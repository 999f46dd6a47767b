"""What samples are, and what they are not."""

import numpy as np
import pytest

from firstorder.reconstruction._samples import gaussian_weights, sample_places, sampled


def test_places_and_values_are_arrays_of_numbers():
    found = sample_places([(0, 1), (2, 3), (4, 5)])
    assert found.tolist() == [[0.0, 1.0], [2.0, 3.0], [4.0, 5.0]]
    assert found.dtype == float
    values = sampled("value", [[1, 2]], (1, 2))
    assert values.tolist() == [[1.0, 2.0]]
    assert values.dtype == float


@pytest.mark.parametrize(
    ("p", "words"),
    [
        ([], "at least one sample"),
        ([(1, 2, 3)], r"shape \(n, 2\), but has \(1, 3\)"),
        ([1, 2], r"shape \(n, 2\), but has \(2,\)"),
        ([[[1, 2]]], r"shape \(n, 2\), but has \(1, 1, 2\)"),
        ([(1, np.inf)], "finite"),
    ],
)
def test_what_is_no_place_is_refused(p, words):
    with pytest.raises(ValueError, match=f"`p` must .*{words}"):
        sample_places(p)


def test_values_have_the_shape_that_is_asked_for():
    with pytest.raises(ValueError, match="`value`"):
        sampled("value", np.zeros(3), (2,))


def test_complex_numbers_are_refused():
    with pytest.raises(ValueError, match="Argument `p` must be real"):
        sample_places([(0.0, 1.0j)])
    with pytest.raises(ValueError, match="Argument `value` must be real"):
        sampled("value", [1.0j], (1,))


def test_weights_are_ratios_of_gaussians():
    size = np.array([1.0, 2.0, 3.0])
    np.testing.assert_allclose(
        gaussian_weights(size, 1.0), np.exp(-0.5 * size**2) / np.exp(-0.5), rtol=1e-14
    )
    assert gaussian_weights(np.array([1e300, 1e300]), 1e300).tolist() == [1.0, 1.0]
