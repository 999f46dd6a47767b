"""Expressions with parameters, as numbers with derivatives in closed form."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
import sympy

from firstorder.conventions import Frame
from firstorder.errors import Refused
from firstorder.symbolic._programs.numeric import (
    ExpressionField,
    ExpressionMap,
    Expressions,
    free_of,
)

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
    still = Expressions((sympy.Integer(2),), (x,), (), ())
    np.testing.assert_array_equal(still(jnp.array([7.0]))[0], 2.0)


y = sympy.Symbol("y", real=True)
U = jnp.array([0.7, -0.4, 1.3])
WIDE = Expressions((x**2 * y + theta, x * theta * y**3), (x, theta, y), (), ())
VALUES = [0.7**2 * 1.3 - 0.4, 0.7 * -0.4 * 1.3**3]
RATES = [[2 * 0.7 * 1.3, 1.0, 0.7**2], [-0.4 * 1.3**3, 0.7 * 1.3**3, 3 * 0.7 * -0.4 * 1.3**2]]
BENDS = [
    [[2 * 1.3, 0.0, 2 * 0.7], [0.0, 0.0, 0.0], [2 * 0.7, 0.0, 0.0]],
    [
        [0.0, 1.3**3, 3 * -0.4 * 1.3**2],
        [1.3**3, 0.0, 3 * 0.7 * 1.3**2],
        [3 * -0.4 * 1.3**2, 3 * 0.7 * 1.3**2, 6 * 0.7 * -0.4 * 1.3],
    ],
]


def test_two_expressions_of_three_coordinates_have_their_derivatives_by_hand():
    values, jacobian, second = WIDE.derivatives(U)
    np.testing.assert_allclose(values, VALUES, rtol=1e-14)
    np.testing.assert_allclose(jacobian, RATES, rtol=1e-14)
    np.testing.assert_allclose(second, BENDS, rtol=1e-14)


def test_a_map_is_its_expressions():
    """`(x + 0.3 theta^2, sin(x) theta)`, by hand."""
    u, v = 0.7, -0.4
    sine, cosine = np.sin(u), np.cos(u)
    bent = ExpressionMap(BENT)
    np.testing.assert_allclose(bent(AT), [u + 0.3 * v**2, sine * v], rtol=1e-14)
    values, jacobian, second = bent.derivatives(AT)
    np.testing.assert_allclose(values, [u + 0.3 * v**2, sine * v], rtol=1e-14)
    np.testing.assert_allclose(jacobian, [[1.0, 0.6 * v], [cosine * v, sine]], rtol=1e-14)
    np.testing.assert_allclose(second[0], [[0.0, 0.0], [0.0, 0.6]], rtol=1e-14)
    np.testing.assert_allclose(second[1], [[-sine * v, cosine], [cosine, 0.0]], rtol=1e-14)


def test_a_field_is_the_first_of_its_expressions():
    one = Expressions(WIDE.entries[1:], *(getattr(WIDE, k) for k in ("coordinates", "symbols")), ())
    frame = Frame(("x", "theta", "y"))
    field = ExpressionField(one, frame)
    assert field.at(U) == pytest.approx(VALUES[1], rel=1e-14)
    jet = field.jet(U)
    np.testing.assert_allclose(jet.value, VALUES[1], rtol=1e-14)
    np.testing.assert_allclose(jet.gradient, RATES[1], rtol=1e-14)
    np.testing.assert_allclose(jet.hessian, BENDS[1], rtol=1e-14)
    assert jet.frame == frame


def test_kinks_have_no_derivatives():
    kinked = Expressions((theta, x * sympy.Heaviside(x - 1)), (x, theta), (), ())
    np.testing.assert_array_equal(kinked(jnp.array([3.0, 5.0]))[1], 3.0)
    with pytest.raises(Refused, match="Diracs"):
        kinked.derivatives(jnp.array([3.0, 5.0]))


def test_what_is_no_coordinate_is_a_parameter():
    assert free_of((x + a * theta, y, 3), (x, theta)) == {a, y}
