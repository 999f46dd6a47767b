"""The one or the other is what `jnp.where` gives, in fewer equations."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from firstorder.numerics._select import either, whole_below
from tests.first_calls import equations

WHICH, A = np.array([[True], [False]]), np.array([[1.0, 2.0], [3.0, 4.0]])
CASES = {
    "two arrays": (WHICH[:, 0], A[0], A[1]),
    "a number behind": (WHICH[:, 0], A[0], 0.0),
    "a number before": (WHICH[:, 0], np.inf, A[0]),
    "wide": (WHICH, A, -1.0),
    "spread": (WHICH, A[0], A),
    "whole numbers": (WHICH[:, 0], np.array([1, 2], np.int32), -1),
    "one question": (np.array(True), A, 0.0),
}


@pytest.mark.parametrize("precision", [np.float32, np.float64])
@pytest.mark.parametrize("name", CASES)
def test_it_is_where(name, precision):
    which, a, b = (
        jnp.asarray(c, precision) if getattr(c, "dtype", None) == np.float64 else c
        for c in CASES[name]
    )
    found, expected = either(jnp.asarray(which), a, b), jnp.where(which, a, b)
    assert found.dtype == expected.dtype
    np.testing.assert_array_equal(found, expected)


def test_the_derivative_is_that_of_the_one_which_counts():
    slope = jax.grad(lambda x: jnp.sum(either(jnp.array([True, False]), x * x, 3.0 * x)))
    np.testing.assert_array_equal(slope(jnp.array([2.0, 2.0])), [4.0, 3.0])


def test_it_is_shorter():
    which, a = jnp.array([True, False]), jnp.ones(2)
    assert equations(lambda: either(which, a, 0.0)) < equations(lambda: jnp.where(which, a, 0.0))


@pytest.mark.parametrize("precision", [np.float32, np.float64])
def test_what_is_a_whole_number_but_for_rounding_is_it(precision):
    whole = np.arange(-50.0, 50.0)
    noise = np.finfo(precision).eps * np.array([[-2.0], [0.0], [2.0]]) * np.abs(whole)
    found = whole_below(jnp.asarray(whole + noise, precision))
    assert found.dtype == precision
    np.testing.assert_array_equal(found, np.broadcast_to(whole, found.shape))
    np.testing.assert_array_equal(whole_below(jnp.asarray(whole + 0.37, precision)), whole)
