"""Boxes around shapes of flatland, against points of the shapes themselves."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from firstorder.flatland import Arcs, Circles, Ellipses, Segments, closed_curve
from firstorder.flatland.shapes._bounds import bounds

S = jnp.linspace(0.0, 1.0, 4097)
A = 2.0 * np.pi * np.arange(64) / 64


@pytest.mark.parametrize(
    "group",
    [
        Segments([(0.0, 1.0), (2.0, -1.0)], [(1.0, -3.0), (-2.0, 0.0)]),
        Circles([(0.0, 1.0), (2.0, -1.0)], [0.5, 2.0]),
        Arcs([(0.0, 1.0), (2.0, -1.0)], [0.5, 2.0], [0.3, -1.0], [2.0, -0.7]),
        Ellipses([(0.0, 1.0), (2.0, -1.0)], [(2.0, 0.5), (0.1, 1.0)], [0.4, -1.0]),
        closed_curve(np.stack([2.0 * np.cos(A), 1.0 + np.sin(A) + 0.3 * np.cos(2.0 * A)], -1), 4),
    ],
    ids=lambda group: type(group).__name__,
)
def test_a_box_touches_its_shape_on_all_sides(group):
    points = np.asarray(jax.vmap(lambda one: jax.vmap(lambda s: one.motion(s)[0])(S))(group))
    low, high = bounds(group)
    # Both are polygons where the shape is round: off by less than its rise over half a chord.
    near = 0.5 * np.ptp(points, axis=1).max() * (np.pi / 256) ** 2
    np.testing.assert_allclose(low, points.min(1), rtol=0.0, atol=near)
    np.testing.assert_allclose(high, points.max(1), rtol=0.0, atol=near)
