"""Modules and their methods as JAX's functions: equal to themselves alone, and trees."""

import jax
import jax.numpy as jnp
import numpy as np

from firstorder.fields import gaussian
from firstorder.fields._held import Held, Method


class Line(Held):
    slope: jax.Array

    def at(self, u):
        return self.slope * u

    @property
    def double(self):
        return 2.0 * self.slope

    def __call__(self, u):
        return self.at(u) + 1.0


ONE, TWIN = Line(jnp.array(3.0)), Line(jnp.array(3.0))


def test_a_module_is_equal_to_itself_alone():
    assert ONE == ONE
    assert ONE != TWIN
    assert hash(ONE) == hash(ONE)
    assert hash(ONE) != hash(TWIN)
    assert (ONE == 3.0) is False


def test_a_method_is_equal_to_the_same_of_the_same_module_alone():
    assert ONE.at == ONE.at
    assert ONE.at is not ONE.at
    assert hash(ONE.at) == hash(ONE.at)
    assert ONE.at != TWIN.at
    assert (ONE.at == Line.at) is False
    assert ONE.at != Method(Line.double.fget, ONE)
    assert hash(ONE.at) != hash(TWIN.at)
    assert ONE.at.__name__ == "at"


def test_a_method_is_a_tree_of_its_modules_leaves():
    assert isinstance(ONE.at, Method)
    assert jax.tree.leaves(ONE.at) == [3.0]
    doubled = jax.tree.map(lambda a: 2.0 * a, ONE.at)
    assert doubled(5.0) == 30.0


def test_methods_and_modules_are_functions_to_jax():
    assert jax.jit(ONE.at)(2.0) == 6.0
    assert jax.jit(ONE)(2.0) == 7.0
    assert jax.grad(ONE.at)(2.0) == 3.0
    np.testing.assert_array_equal(jax.vmap(ONE.at)(jnp.arange(3.0)), [0.0, 3.0, 6.0])
    assert jax.jit(lambda f, x: f(x), static_argnums=0)(ONE.at, 2.0) == 6.0


def test_what_is_no_method_is_found_as_it_is():
    assert ONE.double == 6.0
    assert ONE.slope == 3.0
    assert not isinstance(ONE.__call__, Method)
    assert ONE(2.0) == 7.0


def test_fields_are_held():
    L = gaussian((0.0, 0.0), (1.0, 1.0))
    assert L.jet == L.jet
    assert gaussian((0.0, 0.0), (1.0, 1.0)) != L
