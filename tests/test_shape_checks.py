"""The plugin that checks annotations notices wrong types and shapes; a user's run is without it."""

import os
import subprocess
import sys

import equinox as eqx
import jax.numpy as jnp
import pytest
from jaxtyping import Array, Float

from tests.shape_checks import SWITCH, checked


@checked
def outer(a: Float[Array, " n"], b: Float[Array, " m"]) -> Float[Array, "n m"]:
    return jnp.outer(a, b) if a.size < 5 else jnp.outer(b, a)


@checked
class Pair(eqx.Module):
    a: Float[Array, " n"]
    b: Float[Array, " n"]


def test_a_name_is_one_number_in_arguments_and_in_what_comes_back():
    assert outer(jnp.ones(2), jnp.ones(3)).shape == (2, 3)
    with pytest.raises(TypeError, match="return"):
        outer(jnp.ones(6), jnp.ones(3))


def test_each_call_has_names_of_its_own():
    @checked
    def twice(a: Float[Array, " n"]) -> Float[Array, " n"]:
        outer(jnp.ones(2), jnp.ones(3))
        return a

    assert twice(jnp.ones(4)).shape == (4,)


@pytest.mark.parametrize("a", [jnp.ones((2, 2)), jnp.ones(2, int), 1.0])
def test_another_shape_another_kind_of_number_and_no_array_are_refused(a):
    with pytest.raises(TypeError, match="parameter a"):
        outer(a, jnp.ones(3))


def test_what_is_held_is_checked_where_it_is_made():
    assert Pair(jnp.ones(2), jnp.ones(2)).a.shape == (2,)
    with pytest.raises(TypeError, match="parameter b"):
        Pair(jnp.ones(2), jnp.ones(3))


def test_this_run_checks_the_package():
    from firstorder.typing import as_array

    is_checked = hasattr(as_array, "__wrapped__")
    assert is_checked == (os.environ.get(SWITCH) != "off")


@pytest.mark.smoke
def test_import_alone_checks_nothing():
    code = (
        "import sys; from firstorder.typing import as_array; "
        "raise SystemExit('beartype' in sys.modules or hasattr(as_array, '__wrapped__'))"
    )
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0
