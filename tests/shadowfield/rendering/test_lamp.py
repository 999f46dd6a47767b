"""The frame of a lamp, by hand."""

import numpy as np
import pytest

from firstorder.shadowfield.rendering.lamp import below, lamp_frame

LAMP = lamp_frame((1.0, 2.0, 3.0), (0.0, 3.0, 4.0), (2.0, 0.0, 0.0))


def test_a_lamp_shines_across_both_edges():
    np.testing.assert_allclose(LAMP.half, [5.0, 2.0])
    np.testing.assert_allclose(LAMP.axes, [[0.0, 0.6, 0.8], [1.0, 0.0, 0.0], [0.0, 0.8, -0.6]])


def test_places_go_into_its_frame_and_back():
    points = np.array([[1.0, 2.0, 3.0], [2.0, 2.8, 2.4], [1.0, 1.2, 3.6]])
    local = LAMP.local(points)
    np.testing.assert_allclose(local, [[0, 0, 0], [0, 1, 1], [0, 0, -1]], rtol=0.0, atol=1e-12)
    np.testing.assert_allclose(LAMP.world(local), points)
    assert below(LAMP, points).tolist() == [False, True, False]
    odd = np.array([[np.nan, 2.8, 2.4], [2.0, 2.8, -np.inf], [2.0, 2.8, 2.4]])
    assert below(LAMP, odd).tolist() == [False, False, True]


def test_edges_are_at_right_angles_but_for_rounding():
    lamp_frame((0, 0, 0), (1.0, 0.0, 0.0), (5e-10, 1.0, 0.0))
    single = np.float32([5e-7, 1.0, 0.0])
    lamp_frame((0, 0, 0), np.float32([1.0, 0.0, 0.0]), single)
    for u, v in [
        ((3.0, 0, 0), (2e-9, 1.0, 0.0)),
        ((3.0, 0, 0), (0.3, 1.0, 0.0)),
        (np.float32([1, 0, 0]), 1e1 * single + np.float32([0, -9, 0])),
    ]:
        with pytest.raises(ValueError, match="must be orthogonal"):
            lamp_frame((0, 0, 0), u, v)
    lamp_frame((0, 0, 0), (1e6, 0.0, 0.0), (1e-4, 1e6, 0.0))
    with pytest.raises(ValueError, match="must be orthogonal"):
        lamp_frame((0, 0, 0), (1e-6, 0.0, 0.0), (1e-8, 1e-6, 0.0))


@pytest.mark.parametrize(
    ("center", "u", "v", "name"),
    [
        ((0, 0, 0), (0, 0, 0), (1, 0, 0), "u"),
        ((0, 0, 0), (1, 0, 0), (0, 0, 0), "v"),
        ((0, 0), (1, 0, 0), (0, 1, 0), "center"),
        ((0, 0, 0), (1, 0, np.nan), (0, 1, 0), "u"),
    ],
)
def test_a_lamp_has_a_place_and_two_edges(center, u, v, name):
    with pytest.raises(ValueError, match=f"`{name}`"):
        lamp_frame(center, u, v)
