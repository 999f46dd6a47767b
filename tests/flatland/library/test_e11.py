import jax
import numpy as np
import pytest

from firstorder.flatland.library._e11 import (
    FIG03_DEPTHS,
    FIG07_DEPTHS,
    FIG18_DEPTHS,
    e11_fig03,
    e11_fig07,
    e11_fig18a,
    e11_fig18b,
)
from firstorder.shadowfield import depth_range, visible_lengths

X = np.linspace(0.013, 0.987, 41)


@pytest.fixture(scope="module")
def lengths():
    return jax.jit(visible_lengths)


@pytest.mark.smoke
@pytest.mark.parametrize(
    ("scene", "depths"),
    [
        (e11_fig03, FIG03_DEPTHS),
        (e11_fig07, FIG07_DEPTHS),
        (e11_fig18a, FIG18_DEPTHS),
        (e11_fig18b, FIG18_DEPTHS),
    ],
)
def test_blockers_stand_between_the_stated_depths(scene, depths):
    low, high = depth_range(scene())
    assert depths[0] - 1e-12 <= low < high <= depths[1] + 1e-12
    assert len(scene().named("light")) == len(scene().named("floor")) == 1


def test_blockers_are_as_long_and_as_wide_as_they_are_said_to_be_and_fill_their_strip():
    """Each in a direction of its own, anywhere between the depths and anywhere over the light."""
    scene = e11_fig07(1, thin=1500, round=150)
    strips, discs = scene.groups[-2:]
    first, last = (np.asarray(a)[2:] for a in (strips.start, strips.end))  # without floor and light
    along, middle = last - first, 0.5 * (first + last)
    length, angle = np.linalg.norm(along, axis=1), np.arctan2(along[:, 1], along[:, 0])
    radius, center = np.asarray(discs.radius), np.asarray(discs.center)
    for found, (low, high) in (
        (length, (0.04, 0.10)),
        (radius, (0.008, 0.025)),
        (angle, (0.0, np.pi)),
        (middle[:, 0], (0.02, 0.98)),
        (center[:, 0], (0.02, 0.98)),
    ):
        share = (found - low) / (high - low)
        assert -1e-12 < share.min() < 0.04
        assert 0.96 < share.max() < 1.0 + 1e-12
        assert np.mean(share) == pytest.approx(0.5, abs=0.07)
    for place, reach in ((middle, 0.5 * np.abs(along[:, 1])), (center, radius)):
        share = (place[:, 1] - reach - 0.6) / (0.3 - 2.0 * reach)  # 0.1 to 0.4 below the light
        assert -1e-9 < share.min() < 0.04
        assert 0.96 < share.max() < 1.0 + 1e-9


def test_the_seed_alone_decides_where_blockers_stand():
    one, same, other = (jax.tree.leaves(e11_fig07(s)) for s in (3, 3, 4))
    assert all(np.array_equal(a, b) for a, b in zip(one, same, strict=True))
    assert not all(np.array_equal(a, b) for a, b in zip(one, other, strict=True))


@pytest.mark.parametrize("period", [0.125, 0.25])
def test_the_double_slit_is_a_triangle_wave_of_full_height(lengths, period):
    """Half of every period is open; the two combs slide by x (1 - 1/3) against each other."""
    slid = X * (1.0 - 1.0 / 3.0) / period
    truth = 0.5 - np.abs(slid - np.round(slid))
    np.testing.assert_allclose(lengths(e11_fig18a(period), X), truth, rtol=0.0, atol=1e-12)


@pytest.mark.parametrize("walls", [5, 17])
def test_the_funnel_is_a_spike_that_its_walls_narrow(lengths, walls):
    """A wall hides |s| (1 / 0.5 - 1 / 0.75) of the light at a distance s from where it points."""
    truth = np.maximum(0.0, 1.0 - (2.0 - 4.0 / 3.0) * walls * np.abs(X - 0.5))
    np.testing.assert_allclose(lengths(e11_fig18b(walls), X), truth, rtol=0.0, atol=1e-12)


@pytest.mark.smoke
def test_bad_input_is_one_sentence():
    with pytest.raises(ValueError, match=r"^Argument `thin` must be positive, but is 0.$"):
        e11_fig07(1, thin=0)
    with pytest.raises(
        ValueError, match=r"^Argument `period` must lie in \(0, 0.5\], but is 0.7.$"
    ):
        e11_fig18a(0.7)
    with pytest.raises(ValueError, match=r"^Argument `walls` must be at least 2, but is 1.$"):
        e11_fig18b(1)
    with pytest.raises(ValueError, match=r"^Argument `middle` must lie in \[0, 1\], but is 2.0.$"):
        e11_fig18b(5, 2.0)
