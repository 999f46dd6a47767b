"""Each operation of a program, read as expressions, gives the numbers that the program gives."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
import sympy
from jax import lax

from firstorder.symbolic._programs.primitives import Choice, settled
from firstorder.symbolic._programs.reading import array, expression, read

SYMBOLS = sympy.symbols("a b c d e f", real=True)
NUMBERS = (0.7, -1.3, 2.4, 0.31, -0.52, 1.9)


def numbers(entries):
    """Expressions at the numbers, as NumPy has them."""
    known = dict(zip(SYMBOLS, NUMBERS, strict=True))
    found = [complex(sympy.sympify(e).subs(known).evalf()) for e in np.ravel(entries)]
    return np.reshape(found, np.shape(entries))


def check(program):
    """A program of six symbols, read and then put in numbers, against the program that runs."""
    found = read(program, array(*SYMBOLS))
    true = np.asarray(program(jnp.array(NUMBERS)))
    found = np.asarray(getattr(found, "entries", found))
    assert found.shape == true.shape
    np.testing.assert_allclose(numbers(found), true, rtol=1e-12, atol=1e-13)


EACH = {
    "powers": lambda u: jnp.stack([jnp.exp2(u[0]), u[0] ** u[1], u[1] ** 3, u[1] ** -2]),
    "squares": lambda u: lax.square(u) - u * u[::-1],
    "waves": lambda u: jnp.sin(u) + 2.0 * jnp.cos(u) - 3.0 * jnp.exp(-u),
    "inverse hyperbolic": lambda u: jnp.stack(
        [jnp.arcsinh(u[1]), jnp.arccosh(u[2]), jnp.arctanh(u[3])]
    ),
    "as they are": lambda u: jnp.stack(
        [lax.reduce_precision(u[0], 11, 52), lax.stop_gradient(u[1]), jnp.copy(u[2])]
    ),
    "always finite": lambda u: jnp.where(jnp.isfinite(u), u, 7.0),
    "logarithms": lambda u: jnp.stack([jnp.log(u[2]), jnp.log1p(u[3]), jnp.expm1(u[4])]),
    "roots": lambda u: jnp.stack([jnp.sqrt(u[2]), lax.rsqrt(u[0]), jnp.cbrt(u[2])]),
    "circular": lambda u: jnp.stack([jnp.tan(u[1]), jnp.arcsin(u[4]), jnp.arccos(u[3])]),
    "hyperbolic": lambda u: jnp.stack([jnp.sinh(u[1]), jnp.cosh(u[1]), jnp.tanh(u[4])]),
    "quadrants": lambda u: jnp.arctan2(u[:3], u[3:]) + jnp.arctan(u[1]),
    "steps": lambda u: jnp.stack([jnp.sign(u), jnp.floor(u), jnp.ceil(u), jnp.abs(u)]),
    "remainders": lambda u: lax.rem(u, u[::-1]),
    "errors": lambda u: jnp.stack([lax.erf(u[0]), lax.erfc(u[1]), jax.nn.sigmoid(u[2])]),
    "differences": lambda u: (u[:3] - u[3:]) / (u[3:] + 2.0),
    "extremes": lambda u: jnp.maximum(u[:3], u[3:]) - 2.0 * jnp.minimum(u[:3], u[3:]),
    "clipped": lambda u: jnp.clip(u, u[4], u[0]),
    "complex": lambda u: lax.complex(u[:3], u[3:]) ** 2 * jnp.conj(lax.complex(u[1], u[2])),
    "parts": lambda u: jnp.stack([jnp.real(u[0] * (1 + 2j)), jnp.imag(u[1] * (1 + 2j))]),
    "as numbers": lambda u: (u > u[0]).astype(float) + (u[::-1] == u).astype(float),
}


@pytest.mark.parametrize("name", EACH)
def test_entry_by_entry(name):
    check(EACH[name])


@pytest.mark.parametrize(
    "compared",
    [jnp.less, jnp.less_equal, jnp.greater, jnp.greater_equal, jnp.equal, jnp.not_equal],
)
def test_choices_by_comparisons(compared):
    check(lambda u: jnp.where(compared(u[:3], u[3:]), u[:3], 2.0 * u[3:]))
    check(lambda u: jnp.where(~compared(u[:3], u[3:]), u[:3], 2.0 * u[3:]))
    check(lambda u: jnp.where(compared(u, u), u, 2.0 * u))


@pytest.mark.parametrize("joined", [jnp.logical_and, jnp.logical_or, jnp.logical_xor])
def test_choices_by_conditions_that_are_joined(joined):
    check(lambda u: jnp.where(joined(u[:3] > 0.0, u[3:] > 0.0), u[:3], 7.0))
    check(lambda u: jnp.where(joined(u[:3] > 0.0, True), u[:3], 7.0))
    check(lambda u: jnp.where(joined(u[:3] > 0.0, False), u[:3], 7.0))


@pytest.mark.parametrize("turned", [False, True])
def test_choices_inside_choices(turned):
    """The inner one is asked for the same, for the opposite, for part of it, for something else."""

    def inner(u, condition):
        yes, no = (u[0], 3.0 * u[2]) if turned else (u[2], u[3] - 5.0)
        return jnp.where(condition, yes, no)

    for condition in (
        lambda u: u[1] > 0.0,
        lambda u: (u[1] > 0.0) | (u[2] > 0.0),
        lambda u: (u[1] > 0.0) & (u[2] > 0.0),
        lambda u: ~(u[1] > 0.0),
    ):
        for outer in (
            lambda u: u[1] > 0.0,
            lambda u: u[1] <= 0.0,
            lambda u: (u[1] > 0) & (u[2] > 0),
        ):
            check(lambda u, o=outer, c=condition: jnp.where(o(u), inner(u, c(u)), 1.0 + u[5]))
            check(lambda u, o=outer, c=condition: jnp.where(o(u), 1.0 + u[5], inner(u, c(u)) ** 2))


def test_a_choice_among_cases_by_a_number():
    which = jnp.array([2, 0, 1])
    check(lambda u: lax.select_n(which, u[:3], u[3:], 2.0 * u[:3]))
    assert expression(read(lambda u: lax.select_n(which, u[:3], u[3:], 2.0 * u[:3])[0],
                           array(*SYMBOLS))) == 2 * SYMBOLS[0]  # fmt: skip


def test_a_choice_is_made_when_its_condition_is_known_and_told_by_sympy_when_it_is_not():
    a, b, c = SYMBOLS[:3]
    choice = Choice(a, Choice(b, c, b > 1), a > 0)
    assert choice.subs(a, 2) == 2
    assert choice.subs({a: -2, b: 3}) == 3
    assert choice.subs({a: -2, b: 0}) == c
    told = settled(np.array(sympy.Add(1, choice), dtype=object))[()]
    assert not told.has(Choice)
    for values in ((2, 3, 7), (-2, 3, 7), (-2, 0, 7)):
        known = dict(zip((a, b, c), values, strict=True))
        assert told.subs(known) == sympy.Add(1, choice.subs(known))


# --- moves and sums ------------------------------------------------------------------------------

MOVED = {
    "two arrays one after the other": lambda u: jnp.concatenate([u[4:], u[1:4], jnp.ones(2)]),
    "beside each other": lambda u: jnp.stack([u[:2], u[2:4], u[4:]], 1),
    "padded with a symbol": lambda u: lax.pad(u[:4].reshape(2, 2), u[5], [(1, 0, 1), (0, 2, 0)]),
    "a window of a table": lambda u: lax.dynamic_slice(u.reshape(2, 3), (0, 1), (2, 2)),
    "a window put in": lambda u: lax.dynamic_update_slice(
        u.reshape(3, 2), -u[:2].reshape(2, 1), (1, 1)
    ),
    "rows by number": lambda u: u.reshape(3, 2)[jnp.array([2, 0, 2])],
    "entries set": lambda u: u.at[jnp.array([4, 1])].set(u[:2] ** 2),
    "axes of one entry": lambda u: jnp.squeeze(u[:2, None] * u[None, 2:3], 1),
    "repeated": lambda u: jnp.tile(u[:2], (2, 2)),
    "turned over": lambda u: u.reshape(1, 2, 3).transpose(2, 0, 1)[::-1, 0],
    "beyond the end": lambda u: u[jnp.array([7, 9])],
    "split": lambda u: jnp.split(u.reshape(2, 3), 3, 1)[1] * 2.0,
    "sums along axes": lambda u: u.reshape(1, 2, 3).sum((0, 2)),
    "products along an axis": lambda u: u.reshape(3, 2).prod(0),
    "extremes along an axis": lambda u: u.reshape(3, 2).max(0) - 2.0 * u.reshape(3, 2).min(0),
    "so far along an axis": lambda u: jnp.cumsum(u.reshape(3, 2), 1) * jnp.cumprod(
        u.reshape(3, 2), 0
    ),
    "so far from the end": lambda u: lax.cummax(u.reshape(2, 3), 1, reverse=True)
    + lax.cummin(u.reshape(2, 3), 1),
    "all and any": lambda u: jnp.where(jnp.all(u.reshape(3, 2) > -1.0, 0), u[:2], 5.0)
    + jnp.where(jnp.any(u.reshape(3, 2) > 2.0, 0), u[:2], 50.0),
    "products of tables": lambda u: u.reshape(2, 3) @ u.reshape(3, 2),
    "products of many tables": lambda u: jnp.einsum(
        "abi,ic->acb", u.reshape(1, 2, 3), jnp.arange(6.0).reshape(3, 2)
    ),
    "products, batch by batch": lambda u: jnp.einsum(
        "ib,bij->jb", u[:4].reshape(2, 2), u[2:].reshape(2, 1, 2) + jnp.arange(8.0).reshape(2, 2, 2)
    ),
    "over two axes": lambda u: jnp.tensordot(
        u.reshape(2, 3), u.reshape(3, 2), axes=((0, 1), (1, 0))
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", MOVED)
def test_entries_go_where_the_program_puts_them(name):
    check(MOVED[name])


@pytest.mark.parametrize("size", [2, 3])
def test_linear_systems(size):
    matrix = jnp.asarray(np.random.default_rng(0).normal(size=(2, size, size)))
    right = jnp.asarray(np.random.default_rng(1).normal(size=(2, size, 2)))

    def left(u):  # two symbols are enough, and soon done
        return matrix.at[:, 0, 1].set(u[0]).at[1, size - 1, 0].set(u[1])

    check(lambda u: jnp.linalg.solve(left(u), right))
    check(lambda u: jnp.linalg.det(left(u)))
    check(lambda u: jnp.linalg.solve(matrix, right.at[:, 1, 0].set(u[2])))
