"""Softplus and its inverse, against mpmath."""

import jax
import mpmath
import numpy as np
import pytest

from firstorder.numerics import free_of, positive


@pytest.mark.parametrize("scale", [1.0, 0.05])
@pytest.mark.parametrize("free", [-3.0, -0.2, 0.0, 0.1, 2.0])
def test_a_number_stays_positive(free, scale):
    true = scale * mpmath.log1p(mpmath.exp(mpmath.mpf(free) / scale))
    np.testing.assert_allclose(positive(free, scale), float(true), rtol=1e-12)
    assert positive(free, scale) > 0.0


@pytest.mark.parametrize("scale", [1.0, 0.05])
@pytest.mark.parametrize("x", [1e-9, 0.03, 0.7, 30.0])
def test_it_starts_where_one_says(x, scale):
    true = scale * mpmath.log(mpmath.expm1(mpmath.mpf(x) / scale))
    np.testing.assert_allclose(free_of(x, scale), float(true), rtol=1e-12)
    np.testing.assert_allclose(positive(free_of(x, scale), scale), x, rtol=1e-12)


def test_what_is_not_positive_has_no_start():
    for x, scale, name in [(0.0, 1.0, "x"), (-1.0, 1.0, "x"), (1.0, 0.0, "scale")]:
        with pytest.raises(ValueError, match=f"`{name}` must be positive"):
            free_of(x, scale)
    with pytest.raises(ValueError, match="`scale` must be positive"):
        positive(1.0, -1.0)
    assert np.isnan(jax.jit(free_of)(0.0))
    assert np.isnan(jax.jit(free_of)(-1.0))
    assert np.isfinite(jax.jit(free_of)(0.5))
