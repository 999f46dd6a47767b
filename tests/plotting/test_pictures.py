"""Tone mapping: the sRGB curve, white, and which way is up."""

import matplotlib.image
import numpy as np
import pytest

from firstorder.plotting import house_style, write_still
from firstorder.plotting.pictures import WHITE, tone_map, write_png


def test_the_curve_is_the_screens():
    """IEC 61966-2-1, from its other side."""
    L = np.linspace(0.0, 1.0, 33)
    v = tone_map(L[:, None], 1.0)[0] / 255.0
    back = np.where(v <= 0.04045, v / 12.92, ((v + 0.055) / 1.055) ** 2.4)
    np.testing.assert_allclose(
        back, L, rtol=0.0, atol=2.4 / 255.0
    )  # one level, at the curve's steepest


def test_white_is_what_few_pixels_exceed_and_darkness_is_black():
    L = np.linspace(0.0, 1.0, 1000)[:, None]
    white = np.quantile(L, 0.995)
    rounded = white * ((254.5 / 255.0 + 0.055) / 1.055) ** 2.4
    assert 5 < (tone_map(L) == 255).sum() == (rounded <= L).sum() < 15
    assert tone_map(np.zeros((3, 2))).max() == 0


def test_up_is_up(tmp_path):
    L = np.zeros((4, 3))
    L[1, 2] = 1.0  # second from the left, in the top row
    write_png(tmp_path / "a.png", L, 1.0)
    picture = matplotlib.image.imread(tmp_path / "a.png")[..., 0]
    assert picture.shape == (3, 4)
    assert np.argwhere(picture > 0.5).tolist() == [[0, 1]]


def test_what_is_no_number_is_black_and_spoils_nothing_else():
    values = np.array([[0.0, 1.0, np.nan], [np.inf, 0.5, -np.inf]])
    found = tone_map(values)
    plain = tone_map(np.array([[0.0, 1.0, 0.0], [1.0, 0.5, 0.0]]), np.quantile([0, 1, 0.5], WHITE))
    np.testing.assert_array_equal(found, plain)
    np.testing.assert_array_equal(tone_map(np.full((2, 2), np.nan)), 0)


@pytest.mark.parametrize("white", [0.0, -1.0, np.nan, np.inf])
def test_white_is_a_positive_radiance(white):
    """Another was once taken for 1."""
    with pytest.raises(ValueError, match="`white` must be positive"):
        tone_map(np.ones((2, 2)), white)


def test_a_row_is_no_image():
    with pytest.raises(ValueError, match="`values` must be an image"):
        tone_map(np.ones((2, 2, 3, 1)))


@pytest.mark.parametrize("write", [write_png, write_still])
def test_up_is_up_in_any_style(tmp_path, write):
    L = np.zeros((4, 3))
    L[1, 2] = 1.0
    with house_style():  # there images begin at the bottom
        write(tmp_path / "a.png", L, 1.0)
    picture = matplotlib.image.imread(tmp_path / "a.png")[..., 0]
    assert np.argwhere(picture > 0.5).tolist() == [[0, 1]]


@pytest.mark.parametrize("write", [write_png, write_still])
def test_a_file_of_another_kind_is_refused(tmp_path, write):
    with pytest.raises(ValueError, match=r"^a.exr: a picture is written to a .png file\.$"):
        write(tmp_path / "a.exr", np.ones((4, 3)))
