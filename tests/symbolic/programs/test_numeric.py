"""Expressions with parameters, as numbers with derivatives in closed form."""

import jax
import jax.numpy as jnp
import numpy as np
import sympy

from firstorder.symbolic._programs.numeric import Expressions

x, theta, a = sympy.symbols("x theta a", real=True)
BENT = Expressions((x + a * theta**2, sympy.sin(x) * theta), (x, theta), (a,), (jnp.array(0.3),))
AT = jnp.array([0.7, -0.4])


def test_values_and_derivatives_are_those_of_the_program():
    values, jacobian, second = BENT.derivatives(AT)

    def program(u):
        return jnp.stack([u[0] + 0.3 * u[1] ** 2, jnp.sin(u[0]) * u[1]])

    np.testing.assert_allclose(jnp.stack(values), program(AT), rtol=1e-15)
    np.testing.assert_allclose(jacobian, jax.jacobian(program)(AT), rtol=1e-15)
    np.testing.assert_allclose(second, jax.hessian(program)(AT), rtol=1e-15)


def test_the_number_of_a_parameter_is_a_leaf():
    slope = jax.grad(lambda bent: bent(AT)[0])(BENT)
    np.testing.assert_allclose(slope.values[0], AT[1] ** 2, rtol=1e-15)


def test_a_constant_is_a_number_of_every_ray():
    constant = Expressions((sympy.Integer(2),), (x, theta), (), ())
    np.testing.assert_array_equal(jax.vmap(constant)(jnp.ones((5, 2)))[0], np.full(5, 2.0))
