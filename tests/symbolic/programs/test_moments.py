"""Moments of exponentials, against mpmath."""

import mpmath
import numpy as np
import pytest

from firstorder.symbolic._programs.moments import moment

PLACES = [0.0, 1e-9, -0.3, 0.99, -1.01, 2.7, 3.9, 4.1, -9.0, 20.0, 2.5j, -0.4 + 0.7j, 30.0j]


@pytest.mark.parametrize("m", [0, 1, 2, 3, 5, 8])
@pytest.mark.parametrize("xp", [np, None])
def test_moments_are_integrals(m, xp):
    """Digits are lost by parts where the power is high and the rate is not: a few of them."""
    w = np.array(PLACES, complex)
    true = [
        complex(mpmath.quad(lambda s, z=z: s**m * mpmath.exp(z * s), [0, 0.5, 1])) for z in PLACES
    ]
    found = moment(m, w) if xp is None else moment(m, w, xp)
    np.testing.assert_allclose(found, true, rtol=1e-12)
    real = moment(m, w[:10].real, np)
    assert real.dtype == float
    np.testing.assert_allclose(real, np.real(true[:10]), rtol=1e-12)


@pytest.mark.parametrize("m", [0, 1, 4, 8])
def test_the_series_and_the_parts_meet(m):
    """Where one takes over from the other there is no step."""
    w = max(1, m // 2) * (1.0 + np.array([-1e-12, 1e-12]))
    below, above = moment(m, w, np)
    np.testing.assert_allclose(below, above, rtol=1e-11)
