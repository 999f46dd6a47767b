"""Four passes against one sum over all coordinates, and against NumPy's loops."""

import time

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from figures.e11.competitors import factored as module
from figures.e11.competitors.factored import direct, factored, gridded_axis

Y = np.linspace(-0.45, 0.45, 6)


def box(y):
    return jnp.where(jnp.abs(y) <= 0.5, 1.0, 0.0)


def bell(y):
    return jnp.exp(-2.0 * (y / 0.5) ** 2)


def problem(light=bell, sizes=(9, 7), sigma=(0.12, 0.2)):
    f = np.random.default_rng(0).random((*sizes, len(Y), len(Y) - 1))
    first = gridded_axis(0.1, jnp.array(Y), sigma[0], 0.7, light)
    second = gridded_axis(0.15, jnp.array(Y[:-1]), sigma[1], -0.4, light)
    return jnp.asarray(f), first, second


def by_hand(f, light, sizes, sigma):
    """The definition, one receiver and ray at a time."""
    found = np.zeros(sizes)
    for X in np.ndindex(*sizes):
        total = above = 0.0
        for at in np.ndindex(*f.shape):
            w = 1.0
            for i, (step, s, shear) in enumerate(((0.1, sigma[0], 0.7), (0.15, sigma[1], -0.4))):
                d = step * (X[i] - at[i])
                w *= np.exp(-0.5 * (d / s) ** 2) * (abs(d) <= 3.0 * s)
                w *= float(light(Y[at[2 + i]] - shear * d))
            total, above = total + w, above + w * f[at]
        found[X] = above / total
    return found


@pytest.mark.smoke
@pytest.mark.parametrize("light", [box, bell])
def test_four_passes_are_the_sum_over_all(light):
    f, first, second = problem(light)
    np.testing.assert_allclose(factored(f, first, second), direct(f, first, second), rtol=1e-12)


def test_both_are_what_is_defined():
    sizes, sigma = (3, 4), (0.05, 0.08)
    f, first, second = problem(bell, sizes, sigma)
    true = by_hand(np.asarray(f), lambda y: np.exp(-2.0 * (y / 0.5) ** 2), sizes, sigma)
    np.testing.assert_allclose(factored(f, first, second), true, rtol=1e-12)


@pytest.mark.parametrize("fault", ["slanted the other way", "no shear", "kernel turned round"])
def test_faults_are_noticed(fault):
    f, first, second = problem()
    true = direct(f, first, second)
    if fault == "slanted the other way":
        first = first._replace(along=first.along[::-1])
    if fault == "no shear":
        first = first._replace(
            along=first.along[len(first.along) // 2] * jnp.ones_like(first.along)
        )
    if fault == "kernel turned round":
        lean = jnp.linspace(0.5, 1.5, len(first.across))
        true = direct(f, first._replace(across=lean), second)
        first = first._replace(across=lean[::-1])
    assert np.max(abs(factored(f, first, second) - true)) > 1e-3


def test_free_and_hidden_are_exact():
    f, first, second = problem()
    np.testing.assert_allclose(factored(jnp.ones_like(f), first, second), 1.0, rtol=1e-14)
    np.testing.assert_array_equal(factored(jnp.zeros_like(f), first, second), 0.0)


def test_passes_are_many_times_as_fast():
    """Processor time, once compiled; the count of products says 40 times."""
    f, first, second = problem(sizes=(16, 16), sigma=(0.3, 0.45))

    def cost(call):
        call(f, first, second).block_until_ready()
        start = time.process_time()
        call(f, first, second).block_until_ready()
        return time.process_time() - start

    assert cost(jax.jit(direct)) > 3.0 * min(cost(factored) for _ in range(3))


def test_widths_must_be_positive():
    with pytest.raises(ValueError, match="`sigma` must be positive"):
        module.gridded_axis(0.1, jnp.array(Y), 0.0, 0.0, box)
