"""Numbers and lists as arrays: their precision, and what is refused."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
import sympy as sp

from firstorder.typing import as_array, as_float

HALF = jnp.ones(2, jnp.float32)


@pytest.mark.parametrize("x", [0.5, jnp.asarray(0.5)])
def test_a_number_takes_the_precision_of_what_it_meets(x):
    assert (as_float(x) * HALF).dtype == (HALF * x).dtype


@pytest.mark.parametrize("x", [1, True, np.int32(1), [1, 2], (1, 2.5), [[1, 2], (3, 4.5)]])
def test_integers_and_lists_have_the_default_precision(x):
    found = as_float(x)
    assert found.dtype == jnp.result_type(float)
    assert not found.weak_type
    np.testing.assert_array_equal(found, x)


@pytest.mark.parametrize("x", [np.float32(0.1), np.full(3, 0.1, np.float32), [np.float32(0.1)]])
def test_numbers_of_numpy_keep_their_precision(x):
    assert as_float(x).dtype == jnp.float32
    np.testing.assert_array_equal(as_float(x), x)


def test_integers_of_jax_and_complex_numbers():
    assert as_float(jnp.arange(2)).dtype == jnp.result_type(float)
    assert as_float(np.array([1.0j])).dtype == jnp.result_type(complex)


def test_entries_of_a_list_may_be_traced():
    slope = jax.jacobian(lambda x: as_float([x, 2.0, 3.0 * x]))(1.0)
    np.testing.assert_array_equal(slope, [1.0, 0.0, 3.0])


def test_symbols_are_kept():
    x = sp.Symbol("x")
    found = as_float([x, 2.0])
    assert as_float(found) is found
    assert found.entries.tolist() == [x, 2.0]


@pytest.mark.parametrize("x", ["float", None, [[1.0], [1.0, 2.0]], [1, (2, 3), 4], [1.0, "one"]])
def test_what_is_no_array_of_numbers_is_refused_in_one_sentence(x):
    with pytest.raises(TypeError, match="A number or an array is asked for"):
        as_float(x)


@pytest.mark.parametrize("a", [3, np.int64(3), np.arange(3), np.ones(2, np.float32), jnp.ones(2)])
def test_arrays_are_handed_over(a):
    assert isinstance(as_array(a), jax.Array)
    np.testing.assert_array_equal(as_array(a), a)
