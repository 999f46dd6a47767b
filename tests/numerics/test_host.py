"""What is computed on the host, and in which precision."""

import jax
import jax.numpy as jnp
import numpy as np

from firstorder.numerics._host import (
    double_precision,
    hosted,
    joined_arrays,
    spread,
    with_floats,
)


def test_numbers_are_for_numpy_and_what_is_traced_is_for_jax():
    xp, a, b = hosted(jnp.array([3.0, 4.0]), np.array([1, 2]))
    assert xp is np
    assert type(a) is type(b) is np.ndarray

    def traced(x):
        assert hosted(x, np.zeros(2))[0] is jnp
        return x

    jax.jit(traced)(1.0)


def test_a_weak_scalar_is_pythons_number_and_a_weak_array_stays():
    weak = jnp.asarray(0.5)
    assert weak.weak_type
    xp, number, other = hosted(weak, jnp.zeros(2, jnp.float32))
    assert xp is np
    assert type(number) is float
    assert (number * other).dtype == np.float32
    row = jnp.broadcast_to(weak, (2,))
    assert row.weak_type
    assert hosted(row)[0] is jnp


def test_arrays_are_joined_and_spread():
    found = joined_arrays([jnp.array([1.0]), jnp.array([2.0, 3.0])])
    assert found.tolist() == [1.0, 2.0, 3.0]
    assert spread(jnp.array([1.0, 2.0]), (3, 2)).tolist() == [[1.0, 2.0]] * 3
    assert jax.jit(lambda x: spread(x, (2,)))(1.5).tolist() == [1.5, 1.5]


def test_precision_is_double_inside_and_what_it_was_outside():
    with jax.enable_x64(False):
        with double_precision():
            assert jnp.zeros(1).dtype == np.float64
        assert jnp.zeros(1).dtype == np.float32


def test_only_floating_numbers_change_their_type():
    found = with_floats({"a": np.float64([0.5]), "b": np.int64([1]), "c": "word"}, np.float32)
    assert found["a"].dtype == np.float32
    assert found["b"].dtype == np.int64
    assert found["c"] == "word"
