"""Sorting by one key, against NumPy's stable sort; known neighbours, by a loop; Morton's curve."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from firstorder.numerics._order import morton, nearest_known, order_of


@pytest.mark.parametrize("n", [1, 2, 15, 16, 17, 33, 200])
@pytest.mark.parametrize("dtype", ["float64", "float32"])
def test_the_order_is_that_of_a_stable_sort(n, dtype):
    rng = np.random.default_rng(n)
    a = rng.normal(size=(20, n)) * 10.0 ** rng.uniform(-300 if dtype == "float64" else -30, 3, n)
    a = a.astype(dtype)
    a[:5] = np.round(a[:5]) + 0.0  # many equal ones
    a[5:8, ::3] = -np.inf
    a[8:10, ::2] = 0.0
    found = jax.jit(jax.vmap(order_of))(a)
    np.testing.assert_array_equal(found, np.argsort(a, axis=1, kind="stable"))


@pytest.mark.parametrize("n", [3, 40])
def test_false_comes_before_true(n):
    a = np.random.default_rng(n).uniform(size=(20, n)) < 0.4
    found = jax.vmap(order_of)(a)
    np.testing.assert_array_equal(found, np.argsort(a, axis=1, kind="stable"))


def test_only_the_last_bits_give_way():
    """Numbers apart by as many roundings as there are numbers are told apart."""
    n = 100
    a = 1.0 + 128.0 * np.finfo(float).eps * np.arange(n)[::-1]
    np.testing.assert_array_equal(order_of(jnp.asarray(a)), np.arange(n)[::-1])


def test_single_precision_without_long_integers():
    a = np.random.default_rng(0).normal(size=50).astype(np.float32)
    with jax.enable_x64(False):
        found = order_of(jnp.asarray(a))
    np.testing.assert_array_equal(found, np.argsort(a))


def test_it_has_no_derivative():
    slope = jax.jacobian(lambda a: a[order_of(a)])(jnp.arange(20.0)[::-1])
    np.testing.assert_array_equal(slope, np.eye(20)[::-1])


@pytest.mark.parametrize("n", [1, 2, 5, 16, 33])
def test_the_nearest_known_number_is_that_of_a_loop(n):
    rng = np.random.default_rng(n)
    for share in (0.0, 0.2, 0.7, 1.0):
        a, known = rng.integers(-1, 9, n), rng.random(n) < share
        before, after = a.copy(), a.copy()
        for k in range(1, n):
            before[k] = a[k] if known[k] else before[k - 1]
        for k in reversed(range(n - 1)):
            after[k] = a[k] if known[k] else after[k + 1]
        found = nearest_known(jnp.asarray(a), jnp.asarray(known))
        assert np.array_equal(found[0], before)
        assert np.array_equal(found[1], after)


def test_bits_of_the_cells_in_turns():
    corners = [(0, 0, 0), (1024, 1024, 1024)]  # so that a cell is 1
    cells = [(1, 0, 0), (0, 1, 0), (0, 0, 1), (2, 3, 0), (1023, 1023, 1023)]
    numbers = morton(np.array([*corners, *cells], float))
    assert numbers.tolist() == [0, 2**30 - 1, 1, 2, 4, 2 + 8 + 16, 2**30 - 1]


def test_neighbours_on_the_curve_are_near():
    points = np.random.default_rng(0).uniform(size=(4096, 3))
    along = points[np.argsort(morton(points))]
    steps = np.linalg.norm(np.diff(along, axis=0), axis=1)
    assert np.median(steps) < 0.1  # 0.66 in any order; 1 / 16 is the mean spacing


def test_a_curve_of_points_in_one_plane_or_place():
    flat = np.array([[0.0, 0, 5], [1, 0, 5], [0, 1, 5]])
    assert len(set(morton(flat).tolist())) == 3
    assert morton(np.zeros((2, 3))).tolist() == [0, 0]
