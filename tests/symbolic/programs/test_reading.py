"""What programs compute, read as expressions, is what they compute."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
import sympy

from firstorder.errors import Refused
from firstorder.symbolic._programs.reading import array, expression, inserted, matrix, read

a, b = sympy.symbols("a b", real=True)
AT = {a: 0.7, b: -1.3}

PROGRAMS = {
    "arithmetic": lambda u: (u[0] - 2.0 * u[1]) ** 3 / (1.0 + u[0] ** 2),
    "functions": lambda u: jnp.sin(u[0]) * jnp.exp(-u[1]) + jnp.arctan2(u[0], u[1]),
    "roots": lambda u: jnp.sqrt(u[0]) + jnp.cbrt(u[0]) + jax.lax.rsqrt(u[0]) + jnp.abs(u[1]),
    "special": lambda u: jax.scipy.special.erf(u[0]) + jax.nn.sigmoid(u[1]) + jnp.log1p(u[0]),
    "inverse hyperbolic": lambda u: jnp.arcsinh(u[1]) + jnp.arccosh(2.0 + u[0]) + jnp.arctanh(u[0]),
    "so far": lambda u: (jnp.cumprod(u) + jax.lax.cummax(u) + jax.lax.cummin(u, reverse=True))[1],
    "repeated": lambda u: jnp.tile(u, 2) @ jnp.arange(4.0),
    "either": lambda u: jnp.where((u[0] > 0.0) ^ (u[1] > 0.0), u[0], u[1]),
    "hyperbolic": lambda u: jnp.tanh(u[0]) + jnp.sinh(u[1]) + jnp.cosh(u[0]) + jnp.expm1(u[1]),
    "choice": lambda u: jnp.where(u[1] > 0.0, u[0], 3.0 * u[1]),
    "extremes": lambda u: jnp.maximum(u[0], u[1]) + jnp.clip(u[1], -1.0, 1.0) + jnp.max(u),
    "sums": lambda u: jnp.sum(jnp.outer(u, u)) + jnp.prod(u) + jnp.cumsum(u)[1],
    "matrix": lambda u: (jnp.array([[1.0, 2.0], [3.0, 4.0]]) @ u) @ u,
    "batched": lambda u: jnp.einsum("bij,bj->bi", jnp.ones((3, 2, 2)), u + jnp.ones((3, 2))).sum(),
    "scatter": lambda u: (jnp.zeros(3).at[jnp.array([0, 2, 2])].add(u[0]) * jnp.arange(3.0)).sum(),
    "set": lambda u: jnp.sum(jnp.eye(2).at[0, 1].set(u[0]) @ u),
    "inverse": lambda u: jnp.linalg.inv(jnp.diag(jnp.array([2.0, 1.0])) + jnp.outer(u, u)).sum(),
    "inverses": lambda u: jnp.linalg.inv(jnp.diag(jnp.array([2.0, 1.0])) + u[:, None, None]).sum(),
    "determinant": lambda u: jnp.linalg.det(jnp.diag(jnp.array([1.0, 2.0, 3.0])) + u[0]),
    "reversed": lambda u: jnp.concatenate([u[::-1], jnp.pad(u, 1)]) @ jnp.arange(6.0),
    "derivative": lambda u: jax.hessian(lambda w: jnp.sin(w[0] * w[1]))(u)[0, 1],
    "loop": lambda u: jax.lax.fori_loop(0, 3, lambda i, s: s * u[0] + i, u[1]),
    "while": lambda u: jax.lax.while_loop(
        lambda s: s[0] < 3.0, lambda s: (s[0] + 1.0, s[1] * u[0] - s[0] * u[1]), (0.0, u[1])
    )[1],
    "a whole number beside an unknown one": lambda u: u[0]
    * jnp.where(jnp.stack([u[0] > 0.0, u[1] - u[1] == 0.0]), 3, 5)[1],
    "scan": lambda u: jax.lax.scan(lambda s, w: (s + w, s * w * u[0]), u[1], jnp.ones(3))[1].sum(),
    "custom rule": lambda u: jax.nn.relu(u[0]) + jax.nn.softplus(u[1]),
    "called": lambda u: jax.jit(lambda w: w[0] * w[1])(u) + jax.checkpoint(jnp.sin)(u[0]),
    "a branch": lambda u: jax.lax.cond(jnp.array(True), lambda w: w[0], lambda w: w[1], u),
    "complex": lambda u: jnp.real(jnp.exp(2j * u[0]) * jnp.conj(u[1] + 1j)) + jnp.imag(1j * u[0]),
}  # fmt: skip


@pytest.mark.parametrize("name", PROGRAMS)
def test_a_program_read_is_the_program(name):
    found = expression(read(PROGRAMS[name], array(a, b)))
    true = PROGRAMS[name](jnp.array([AT[a], AT[b]]))
    assert abs(complex(found.subs(AT).evalf()) - complex(true)) < 1e-12


def test_what_is_taken_beyond_an_end_is_not_a_number_and_what_fills_is_what_is_asked_for():
    beyond = read(lambda u: jnp.take(u, jnp.array([1, 5]), mode="fill"), array(a, b))
    assert [str(one) for one in beyond.entries.ravel()] == ["b", "nan"]
    filled = read(lambda u: u.at[5].get(mode="fill", fill_value=2.0), array(a, b))
    assert expression(filled) == 2.0


@pytest.mark.parametrize("left", [True, False])
@pytest.mark.parametrize("lower", [True, False])
@pytest.mark.parametrize("turned", [True, False])
@pytest.mark.parametrize("unit", [True, False])
def test_of_a_triangular_system_the_other_triangle_is_not_looked_at(left, lower, turned, unit):
    """By NumPy, with zeros in its place."""
    start, right = np.array([[2.0, 0.5], [-0.7, 3.0]]), np.array([[1.0, 2.0], [4.0, 7.0]])

    def program(u):
        return jax.lax.linalg.triangular_solve(
            start + jnp.outer(u, u), jnp.asarray(right), left_side=left, lower=lower,
            transpose_a=turned, unit_diagonal=unit,
        )  # fmt: skip

    part = start + np.outer(list(AT.values()), list(AT.values()))
    part = np.tril(part) if lower else np.triu(part)
    if unit:
        np.fill_diagonal(part, 1.0)
    inverse = np.linalg.inv(part.T if turned else part)
    found = matrix(read(program, array(a, b))).subs(AT)
    np.testing.assert_allclose(
        np.array(found, float), inverse @ right if left else right @ inverse, rtol=1e-12
    )


def test_an_invalid_choice_is_no_choice():
    """NaN answers for invalid numbers: the formula is the valid one, and guards inside it go."""
    guarded = read(
        lambda u: jnp.where(u[0] > 0, jnp.sqrt(jnp.where(u[0] > 0, u[0], 1.0)), jnp.nan), array(a)
    )
    assert expression(guarded) == sympy.sqrt(a)
    twice = read(
        lambda u: jnp.where(u[0] > 0, jnp.log(jnp.where(u[0] > 0, u[0], 1.0)), 0.0), array(a)
    )
    assert expression(twice) == sympy.Piecewise((sympy.log(a), a > 0), (0, True))


def test_a_formula_stands_before_what_is_beyond_its_ends():
    def one_end(u):
        return jnp.where(jnp.abs(u[0]) >= 2.0, 0.0, jnp.cos(u[0]))

    def two_ends(u):
        return jnp.where((u[0] > 3.0) | (jnp.abs(u[0]) >= 2.0), 1.0, jnp.cos(u[0]))

    one, two = (expression(read(program, array(a))) for program in (one_end, two_ends))
    inside = sympy.Abs(a) < 2
    assert one == sympy.Piecewise((sympy.cos(a), inside), (0, True))
    assert two == sympy.Piecewise((sympy.cos(a), sympy.And(a <= 3, inside)), (1, True))


def test_trees_keep_what_is_no_number():
    found = read(lambda u: {"a": u[0] * 2.0, "b": jnp.ones(2), "name": "left"}, array(a))
    assert expression(found["a"]) == 2 * a
    np.testing.assert_array_equal(found["b"], [1.0, 1.0])
    assert found["name"] == "left"
    assert matrix(found["b"]) == sympy.ones(2, 1)


def test_an_expression_inside_a_program_is_put_in():
    f = sympy.Function("f")
    found = read(lambda u: 2.0 * jax.vmap(lambda w: inserted(f, w))(u[None] + 1.0)[0], array(a))
    assert expression(found) == 2 * f(a + 1)
    assert jnp.isnan(inserted(f, jnp.ones(1)))  # a program that runs has no number for it


REFUSED = {
    "an operation": (lambda u: jnp.sort(u)[0], "operation 'sort'"),
    "a loop that a symbol ends": (
        lambda u: jax.lax.while_loop(lambda s: s < u[0], lambda s: s + 1.0, u[1]),
        "ends when a symbol says so",
    ),
    "a long loop": (lambda u: jax.lax.fori_loop(0, 99, lambda i, s: s + u[0], u[1]), "64 turns"),
    "a long scan": (
        lambda u: jax.lax.scan(lambda s, w: (s + u[0], w), u[1], jnp.ones(99))[0],
        "64 turns",
    ),
    "a branch": (
        lambda u: jax.lax.cond(u[0] > 0, lambda w: w[0], lambda w: w[1], u),
        "whole numbers",
    ),
    "whole numbers": (lambda u: u[0].astype(int), "whole numbers"),
    "unknown light, differentiated": (
        lambda u: jax.grad(lambda w: inserted(sympy.Function("f"), w))(u)[0],
        "by autodiff has no formula",
    ),
}  # fmt: skip


@pytest.mark.parametrize("turns", [64, 65])
def test_loops_of_64_turns_are_written_out_and_no_longer_ones(turns):
    def counted(u):
        def step(s):
            return s[0] + 1, s[1] + u[0]

        return jax.lax.while_loop(lambda s: s[0] < turns, step, (0, u[1]))[1]

    def scanned(u):
        return jax.lax.scan(lambda s, _: (s + u[0], None), u[1], None, length=turns)[0]

    for function in (counted, scanned):
        if turns > 64:
            with pytest.raises(Refused, match="64 turns"):
                read(function, array(a, b))
        else:
            assert expression(read(function, array(a, b))) == 64 * a + b


@pytest.mark.parametrize("name", REFUSED)
def test_what_is_no_formula_is_refused(name):
    function, words = REFUSED[name]
    with pytest.raises(Refused, match=words):
        read(function, array(a, b))


@pytest.mark.parametrize("at", [-8.3, -0.4, 0.6, 2.5])
@pytest.mark.parametrize(
    "program",
    [
        lambda u: jax.lax.rem(u[0], 2.0),
        lambda u: jax.lax.rem(u[0], -2.0),
        lambda u: jnp.mod(u[0], 2.0),
        lambda u: jnp.mod(u[0], -2.0),
        lambda u: jnp.cbrt(u[0]),
    ],
)
def test_remainders_and_roots_of_negative_numbers_are_the_programs(program, at):
    found = expression(read(program, array(a))).subs(a, sympy.Rational(str(at)))
    np.testing.assert_allclose(float(found), program(jnp.array([at])), rtol=0.0, atol=1e-12)
