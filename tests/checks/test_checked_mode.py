import jax
import jax.numpy as jnp
import pytest

from firstorder.checks.checked_mode import checked
from firstorder.conventions import FLATLAND_SLOPE
from firstorder.fields import gaussian
from firstorder.transport import Travel

LIGHT = gaussian((0.1, 0.0), (1.0, 0.5), frame=FLATLAND_SLOPE)


def travelled(d):
    return Travel(d)(LIGHT)(0.3, 0.2)


def test_a_traced_negative_distance_is_nan_and_the_checked_mode_says_so():
    assert jnp.isnan(jax.jit(travelled)(-1.0))
    with pytest.raises(ValueError, match="A NaN was made"):
        checked(jax.jit(travelled))(jnp.array(-1.0))


def test_a_valid_call_is_unchanged():
    assert checked(travelled)(jnp.array(1.0)) == travelled(1.0)
