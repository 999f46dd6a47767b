"""How the leaves of shapes are made of what is given."""

import numpy as np
import pytest

from firstorder.flatland.shapes._base import column, rows, same, stack


def test_one_shape_is_a_row_of_many():
    assert rows((1, 2)).tolist() == [[1.0, 2.0]]
    assert rows([(1, 2), (3, 4)]).shape == (2, 2)
    assert column(3).tolist() == [3.0]
    assert column([3, 4]).tolist() == [3.0, 4.0]
    assert stack(np.zeros((5, 2))).shape == (1, 5, 2)
    assert stack(np.zeros((4, 5, 2))).shape == (4, 5, 2)


def test_what_does_not_fit_is_named():
    with pytest.raises(ValueError, match=r"must have two coordinates, but has shape \(3,\)"):
        rows((1, 2, 3))
    with pytest.raises(ValueError, match="`radius` must hold 2 shapes, but holds 3"):
        same("radius", column([1, 2, 3]), rows([(0, 0), (1, 1)]))
    same("radius", column([1, 2]), rows([(0, 0), (1, 1)]))
