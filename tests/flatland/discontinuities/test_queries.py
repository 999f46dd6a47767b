"""What the search for events asks of a scene."""

import numpy as np

from firstorder.flatland import Circles, Scene, primitive
from firstorder.flatland.discontinuities._queries import batched, extent, trace


def scene():
    return Scene.of(primitive(Circles([(0.0, 3.0), (0.0, 9.0)], [1.0, 1.0]), emission=1.0))


def test_rays_find_the_nearest_shape_and_its_side():
    hits = trace(scene(), np.array([[0.0, 0.0], [0.0, 3.0]]), np.array([[0.0, 1.0], [0.0, 1.0]]))
    np.testing.assert_allclose(hits.t, [2.0, 1.0])
    assert hits.number.tolist() == [0, 0]
    assert hits.front.tolist() == [True, False]


def test_batches_of_any_length_come_back_as_they_are():
    for count in (0, 1, 64, 65):
        out = batched(lambda scene, x: 2.0 * x, scene(), np.arange(count, dtype=float))
        np.testing.assert_array_equal(out, 2.0 * np.arange(count))


def test_the_extent_is_the_larger_side_of_all_shapes():
    np.testing.assert_allclose(extent(scene()), 8.0)
