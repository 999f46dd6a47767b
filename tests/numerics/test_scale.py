"""Powers of two, against those of logarithms."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from firstorder.numerics._scale import power_of_two


@pytest.mark.parametrize("dtype", ["float32", "float64"])
def test_it_is_the_power_at_or_below_the_largest_number(dtype):
    rng = np.random.default_rng(0)
    a = (rng.normal(size=(500, 3)) * 10.0 ** rng.uniform(-36.0, 36.0, (500, 1))).astype(dtype)
    found = np.asarray(jax.jit(power_of_two)(a))
    most = np.max(np.abs(a), 1)
    np.testing.assert_array_equal(np.frexp(found)[0], 0.5)  # powers of two
    assert found.dtype == a.dtype
    assert np.all((found <= most) & (0.5 * most < found))


def test_powers_of_two_are_their_own():
    a = 2.0 ** np.arange(-1022, 1023)
    np.testing.assert_array_equal(power_of_two(jnp.asarray(a[:, None])), a)


def test_without_a_size_it_is_one():
    assert power_of_two(jnp.zeros(3)).item() == 1.0


@pytest.mark.parametrize("wrong", [np.nan, np.inf, -np.inf])
def test_what_is_no_number_makes_no_plausible_quotient(wrong):
    a = jnp.array([1.0, wrong])
    assert not np.isfinite((a / power_of_two(a))[1])


def test_it_has_no_derivative():
    slope = jax.grad(lambda a: jnp.sum(a / power_of_two(a)))(jnp.array([3.0, -20.0]))
    assert slope.tolist() == [1.0 / 16.0, 1.0 / 16.0]
