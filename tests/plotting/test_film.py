"""Film: exposure by the log-average, the curve, and colour that keeps luminance."""

import warnings

import matplotlib.image
import numpy as np
import pytest

from firstorder import plotting
from firstorder.io.images import LUMINANCE
from firstorder.plotting import develop, exposure_of, film, filmic, tinted, write_still

RANDOM = np.random.default_rng(0).lognormal(0.0, 1.5, (40, 30, 3))


def check_light_of_any_unit_is_the_same_picture():
    np.testing.assert_array_equal(develop(1024.0 * RANDOM), develop(RANDOM))


def check_a_bright_lamp_does_not_decide():
    """One pixel of 1200 that is 10,000 times as bright moves the exposure by a hundredth."""
    values = np.ones((40, 30))
    values[3, 4] = 1e4
    assert abs(exposure_of(values) / exposure_of(np.ones((40, 30))) - 1.0) < 0.01


def check_a_grey_card_is_where_the_curve_says():
    level = develop(np.full((2, 2), 17.0))[0, 0] / 255.0
    linear = ((level + 0.055) / 1.055) ** 2.4
    x = 0.18
    assert abs(linear - x * (2.51 * x + 0.03) / (x * (2.43 * x + 0.59) + 0.14)) < 0.005


def check_the_curve_rises_from_black_to_white():
    x = np.linspace(0.0, 7.24, 2001)
    y = filmic(x)
    assert y[0] == 0.0
    assert np.all(np.diff(y) > 0.0)
    assert 0.999 < y[-1] <= 1.0
    # A shoulder: the brightest half of the range has less than a tenth of the levels.
    assert 1.0 - filmic(np.array([3.62]))[0] < 0.1


CHECKS = (
    check_light_of_any_unit_is_the_same_picture,
    check_a_bright_lamp_does_not_decide,
    check_a_grey_card_is_where_the_curve_says,
    check_the_curve_rises_from_black_to_white,
)


@pytest.mark.parametrize("check", CHECKS)
def test_film(check):
    check()


def _arithmetic(values, middle=0.18):
    return middle / np.mean(values)


FAULTS = {
    "the exposure is one": (film, "exposure_of", lambda values: 1.0, CHECKS[0]),
    "the arithmetic mean": (None, "exposure_of", _arithmetic, CHECKS[1]),
    "no curve": (film, "filmic", lambda x: np.clip(x, 0.0, 1.0), CHECKS[2]),
    "no shoulder": (None, "filmic", lambda x: np.clip(x / 7.24, 0.0, 1.0), CHECKS[3]),
}


@pytest.mark.parametrize("name", [n for n, fault in FAULTS.items() if fault[3]])
def test_a_fault_is_seen(name, monkeypatch):
    where, what, wrong, check = FAULTS[name]
    if where is not None:
        monkeypatch.setattr(where, what, wrong)
    monkeypatch.setitem(globals(), what, wrong)
    with pytest.raises(AssertionError):
        check()


def test_tints_keep_luminance():
    grey = RANDOM[..., 0]
    labels = np.arange(grey.size).reshape(grey.shape) % 4 - 1
    tints = np.array([[0.9, 0.1, 0.1], [0.1, 0.6, 0.2], [0.1, 0.2, 1.0]])
    found = tinted(grey, labels, tints)
    np.testing.assert_allclose(found @ LUMINANCE, grey, rtol=1e-12)
    nothing = found[labels == -1]
    np.testing.assert_allclose(nothing, np.repeat(nothing[:, :1], 3, 1))  # no tint
    with pytest.raises(ValueError, match="row for label 2, but has 2"):
        tinted(grey, labels, tints[:2])
    with pytest.raises(ValueError, match="`labels` must be -1 or more, but one is -2"):
        tinted(grey, labels - 1, tints)


def test_what_is_no_number_is_black_and_infinity_white():
    found = develop(np.array([[np.nan, np.inf], [1.0, -1.0]]))
    assert found.tolist() == [[255, 0], [0, found[1, 1]]]
    assert found[1, 1] > 0
    assert develop(np.zeros((3, 2))).max() == 0


def test_bad_input_is_refused():
    with pytest.raises(ValueError, match="three bands"):
        develop(np.ones((2, 2, 4)))
    with pytest.raises(ValueError, match="`exposure` must be positive"):
        develop(np.ones((2, 2)), 0.0)


def test_a_still_is_what_was_developed(tmp_path):
    write_still(tmp_path / "a.png", RANDOM)
    picture = matplotlib.image.imread(tmp_path / "a.png")[..., :3]
    np.testing.assert_allclose(255.0 * picture, develop(RANDOM), rtol=0.0, atol=0.01)


@pytest.mark.parametrize(
    ("labels", "tints", "sentence"),
    [
        (np.zeros((1, 1)), np.ones((1, 3)), r"`labels` must be integers, but is float64\."),
        (np.zeros((1, 1), int), np.zeros((1, 3)), r"`tints` must have a luminance, but row 0"),
    ],
)
def test_tints_and_labels_that_are_none_are_refused(labels, tints, sentence):
    with pytest.raises(ValueError, match=sentence):
        tinted(np.ones((1, 1)), labels, tints)


def test_what_is_infinite_is_white_without_a_warning():
    values = np.array([[np.inf, 0.0], [np.nan, -np.inf]])
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert plotting.develop(values, 3.0).tolist() == [[0, 0], [255, 0]]
        assert plotting.tone_map(np.array([[1e300, 0.0]]), 1e-300).tolist() == [[0], [255]]


def test_an_image_has_a_label_for_each_pixel():
    with pytest.raises(ValueError, match="Argument `labels` must have shape"):
        plotting.tinted(np.ones((2, 2)), np.array([[0]]), np.ones((1, 3)))
