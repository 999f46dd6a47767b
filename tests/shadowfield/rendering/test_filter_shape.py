"""The sheared filter's width and shear, by E11's wedge of two depths."""

import numpy as np
import pytest

from firstorder.shadowfield.rendering import _filter_shape as shapes
from firstorder.shadowfield.rendering._weighted_sums import Sums


def shape(d1, near, far, Omega_y=2.0, pixel=0.01, **options):
    return shapes.filter_shape(
        *(np.array([float(a)]) for a in (d1, near, far)), Omega_y, pixel, **options
    )


@pytest.mark.parametrize(("d1", "near", "far"), [(1.0, 0.25, 0.5), (3.0, 0.6, 2.0)])
def test_the_filter_lies_between_the_slopes_of_both_depths(d1, near, far):
    """A blocker at the depth z moves its shadow on the lamp by z / (d1 - z) of its way."""
    found = shape(d1, near, far)
    slopes = np.array([near / (d1 - near), far / (d1 - far)])
    np.testing.assert_allclose(found.shear, np.mean(slopes))
    np.testing.assert_allclose(found.sigma, 1.0 / (np.pi * 2.0 * np.ptp(slopes)))
    assert found.touched == 0.0
    np.testing.assert_allclose(shape(d1, near, far, Omega_y=4.0).sigma, 0.5 * found.sigma)


def test_a_width_is_no_less_than_half_a_pixel_and_no_more_than_slides_over_the_lamp():
    assert shape(1.0, 0.25, 0.5, pixel=1.0).sigma == 0.5
    np.testing.assert_allclose(shape(1.0, 0.5, 0.5, extent=0.3).sigma, 0.3 / 1.0)
    np.testing.assert_allclose(shape(1.0, 0.4, 0.4, extent=0.3).sigma, 0.3 / (0.4 / 0.6))
    assert shape(1.0, 0.25, 0.25).sigma == np.inf
    pixels = np.array([1.0, 2.0])
    many = shapes.filter_shape(*np.tile([[1.0], [0.25], [0.5]], 2), 2.0, pixels)
    assert many.sigma.tolist() == [0.5, 1.0]


def test_nothing_that_hides_leaves_the_width_open():
    found = shape(1.0, np.inf, -np.inf)
    assert found.sigma == np.inf
    assert found.touched == 0.0
    # of some depths within, so that no number is wrong
    np.testing.assert_allclose(found.shear, 0.5 * (1.0 / 3.0 + 1.0))


@pytest.mark.parametrize(
    ("gap", "touched"),
    [
        (0.02, 1.0),
        (0.01, 1.0),
        (-0.5, 1.0),
        (0.06, 0.0),
        (0.04, 0.5),
        (0.05, 0.15625),
        (0.03, 0.84375),
    ],
)
def test_blockers_touch_a_receiver_by_degrees(gap, touched):
    """From three times the margin to the margin, by `t^2 (3 - 2 t)`."""
    found = shape(2.0, 0.5, 2.0 * (1.0 - gap))
    np.testing.assert_allclose(found.touched, touched, rtol=0.0, atol=1e-12)
    assert np.isfinite(found.sigma) == (touched < 1.0)
    assert np.isfinite(found.shear)
    wider = shape(2.0, 0.5, 2.0 * (1.0 - 2.0 * gap), margin=0.04)
    np.testing.assert_allclose(wider.touched, touched, rtol=0.0, atol=1e-12)


@pytest.mark.parametrize("name", ["Omega_y", "pixel"])
def test_a_band_limit_and_a_pixel_are_positive(name):
    with pytest.raises(ValueError, match=f"`{name}` must be positive"):
        shape(1.0, 0.25, 0.5, **{name: 0.0})


def sums(square):
    return Sums(
        *(np.array(square) if name == "square" else np.zeros(len(square)) for name in Sums._fields)
    )


def test_receivers_without_rays_are_lit_or_ask_their_own():
    some = sums([0.0, 2.0, 0.0])
    seen = np.array([0.3, 0.4, np.nan])
    assert shapes.or_lit(seen, some).tolist() == [1.0, 0.4, 1.0]
    two = np.stack([seen, 0.5 * seen], -1)
    assert shapes.or_lit(two, some).tolist() == [[1.0, 1.0], [0.4, 0.2], [1.0, 1.0]]
    touched = np.array([0.25, 0.5, 0.75])
    like = shapes.FilterShape(touched, touched, touched)
    near = np.array([1.0, 1.0, np.inf])
    assert shapes.own_share(some, near, like).tolist() == [1.0, 0.5, 0.75]


def test_cells_share_the_light_by_what_falls_on_them():
    assert shapes.cell_shares(2).tolist() == [0.25] * 4
    # Light of 1 + x/2 on [-1, 1]: halves of 3/4 and 5/4, along the first axis.
    found = shapes.cell_shares(2, lambda p: 1.0 + 0.5 * p[:, 0])
    np.testing.assert_allclose(found, np.array([3.0, 3.0, 5.0, 5.0]) / 16.0)
    found = shapes.cell_shares(2, lambda p: 1.0 * (p[:, 1] > 0.5))
    np.testing.assert_allclose(found, [0.0, 0.5, 0.0, 0.5])
    (one,) = shapes.cell_shares(1, lambda p: np.max(np.abs(p), axis=1))
    assert one == 1.0
    seen = []
    shapes.cell_shares(3, lambda p: seen.append(p) or np.ones(len(p)))
    np.testing.assert_allclose(
        [seen[0].min(), seen[0].max()], [-1.0 + 1.0 / 24.0, 1.0 - 1.0 / 24.0]
    )
    assert len(np.unique(seen[0], axis=0)) == 24**2


@pytest.mark.parametrize("falloff", [lambda p: p[:, 0], lambda p: 0.0 * p[:, 0]])
def test_light_is_positive_somewhere_and_negative_nowhere(falloff):
    with pytest.raises(ValueError, match="`falloff` must be positive somewhere"):
        shapes.cell_shares(2, falloff)
    with pytest.raises(ValueError, match="cells"):
        shapes.cell_shares(0)
