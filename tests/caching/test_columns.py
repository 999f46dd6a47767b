"""Tables of caches in print; `test_cache.py` writes and reads them."""

import jax.numpy as jnp
import numpy as np
import pytest

from firstorder import caching
from firstorder.caching._columns import printed, records_of


def test_numbers_stand_below_their_names():
    table = {"x": np.array([1.0 / 3.0, 2.0]), "clamp": np.array(["raised", ""])}
    assert printed(table) == "      x   clamp\n0.33333  raised\n      2"


def test_records_of_a_plane_are_read_from_their_columns():
    """An ellipse whose longer axis, 2 m, leans by 30 degrees."""
    table = {name: np.array([float(k)]) for k, name in enumerate(("x", "y", "E", "dE_dx", "dE_dy"))}
    second = {"d2E_dx2": np.array([5.0]), "d2E_dxdy": np.array([6.0]), "d2E_dy2": np.array([7.0])}
    size = {"radius": np.array([2.0]), "shorter": np.array([0.5]), "angle": np.array([np.pi / 6])}
    records, region = records_of(table | second | size)
    np.testing.assert_array_equal(records.position, [[0.0, 1.0]])
    np.testing.assert_array_equal(records.value, [2.0])
    np.testing.assert_array_equal(records.gradient, [[3.0, 4.0]])
    np.testing.assert_array_equal(records.hessian, [[[5.0, 6.0], [6.0, 7.0]]])
    assert records.third is None
    along, across = np.array([3.0**0.5, 1.0]), np.array([-1.0, 3.0**0.5])  # of both axes' ends
    np.testing.assert_allclose(region.matrix[0] @ along, along / 2.0, rtol=1e-14)
    np.testing.assert_allclose(region.matrix[0] @ across, across / 0.5, rtol=1e-14)


@pytest.mark.parametrize(
    ("name", "column", "words"),
    [
        ("radius", -np.ones(3), "`radius` must be positive, but is -1.0"),
        ("radius", np.zeros(3), "`radius` must be positive, but is 0.0"),
        ("radius", np.ones(2), "`radius` must have shape"),
        ("clamp", ["cut"], "`clamp` must have shape"),
    ],
)
def test_a_table_that_is_no_cache_is_refused(name, column, words):
    line = caching.Candidates.from_function(jnp.cos, jnp.linspace(0.0, 1.0, 3))
    cache = caching.Cache.of(line, caching.circular_regions(jnp.full(3, 0.5), 0.1, 1.0))
    with pytest.raises(ValueError, match=words):
        caching.Cache.from_columns({**cache.columns(), name: column})


@pytest.mark.parametrize(
    ("name", "column", "words"),
    [
        ("y", np.ones(2), r"`y` must have shape \(3,\), but has \(2,\)"),
        ("dE_dy", np.ones(2), r"`dE_dy` must have shape \(3,\), but has \(2,\)"),
        ("angle", np.full(3, np.nan), "`angle` must be finite, but is nan"),
    ],
)
def test_a_table_that_is_no_cache_of_a_plane_is_refused(name, column, words):
    """NumPy once said that arrays cannot be stacked, and a radius was blamed for the angle."""
    plane = caching.Candidates.of(np.eye(3)[:, :2], np.ones(3), np.zeros((3, 2)))
    regions = caching.circular_regions(jnp.full(3, 0.5), 0.1, 1.0, dims=2)
    cache = caching.Cache.of(plane, regions)
    with pytest.raises(ValueError, match=words):
        caching.Cache.from_columns({**cache.columns(), name: column})
