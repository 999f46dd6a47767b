"""One sentence for each bad argument; traced arguments are left alone, or give NaN."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from firstorder._argument_checks import (
    check_below,
    check_between,
    check_count,
    check_finite,
    check_index,
    check_inside,
    check_integer,
    check_invertible,
    check_key,
    check_not_negative,
    check_one,
    check_positive,
    check_shape,
    is_concrete,
    nan_unless,
)
from firstorder.errors import Refused


@pytest.mark.parametrize(
    ("check", "bad", "words"),
    [
        (check_finite, np.nan, "be finite, but is nan"),
        (check_finite, [1.0, np.inf], "be finite, but is inf"),
        (check_positive, 0.0, "be positive, but is 0.0"),
        (check_positive, [1.0, -2.0], "be positive, but is -2.0"),
        (check_positive, np.nan, "be positive, but is nan"),
        (check_not_negative, -1.0, "not be negative, but is -1.0"),
        (check_not_negative, np.nan, "not be negative, but is nan"),
    ],
)
def test_a_bad_number_is_named(check, bad, words):
    with pytest.raises(ValueError, match=f"Argument `d` must {words}"):
        check("d", np.asarray(bad))


@pytest.mark.parametrize("bad", [[1.0, -2.0], (1.0, -2.0), [[3.0], [-2.0]], [jnp.array(-2.0)]])
def test_a_bad_number_in_a_list_is_named(bad):
    with pytest.raises(ValueError, match=r"^Argument `d` must be positive, but is -2\.0\.$"):
        check_positive("d", bad)


def test_a_good_number_passes():
    check_finite("d", 1.0)
    check_positive("d", np.array([1.0, 2.0]))
    check_not_negative("d", 0)
    check_between("d", jnp.array([0.0, 1.0]), 0.0, 1.0)
    check_shape("d", jnp.zeros((2, 3)), (2, 3))
    check_invertible("M", jnp.eye(3))


@pytest.mark.parametrize("bad", [2.5, 2.0, "8", None, np.float64(3.0)])
def test_what_is_no_integer_is_named(bad):
    with pytest.raises(ValueError, match=r"^Argument `paths` must be an integer, but is "):
        check_integer("paths", bad)


@pytest.mark.parametrize("good", [8, -1, np.int64(8), jnp.array(8)])
def test_an_integer_passes(good):
    check_integer("paths", good)


def test_a_traced_number_that_is_no_integer_is_named_by_its_kind():
    with pytest.raises(ValueError, match="`n` must be an integer, but is float"):
        jax.jit(lambda n: check_integer("n", n))(2.5)


@pytest.mark.parametrize("bad", [-0.1, 1.1, np.nan])
def test_an_interval_is_named(bad):
    with pytest.raises(ValueError, match=r"must lie in \[0, 1\]"):
        check_between("transparency", bad, 0.0, 1.0)


def test_a_shape_is_named():
    with pytest.raises(ValueError, match=r"must have shape \(2,\), but has \(3,\)"):
        check_shape("center", jnp.zeros(3), (2,))


@pytest.mark.parametrize("M", [[[1.0, 2.0], [2.0, 4.0]], [[0.0, 0.0], [0.0, 0.0]]])
def test_a_singular_matrix_is_named(M):
    with pytest.raises(ValueError, match="`M` must be invertible"):
        check_invertible("M", jnp.array(M))


def test_traced_arguments_pass_and_can_be_made_nan():
    @jax.jit
    def f(d):
        check_positive("d", d)
        check_finite("d", d)
        check_invertible("M", d * jnp.eye(2))
        return nan_unless(d > 0, d)

    assert np.isnan(f(-1.0))
    assert f(2.0) == 2.0


def test_a_count_of_more_than_can_be_numbered_is_refused_and_not_printed():
    check_count("rays", 2**40)
    for many in (2**63, 10**5000):
        with pytest.raises(
            ValueError, match=r"^Argument `rays` must be at most \d+, but is more\.$"
        ):
            check_count("rays", many)


@pytest.mark.parametrize("wrong", [None, "one", b"one"])
def test_one_number_is_no_word_and_not_nothing(wrong):
    with pytest.raises(TypeError, match=r"^Argument `d` must be a number, but is "):
        check_one("d", wrong)


@pytest.mark.parametrize("check", [check_positive, check_not_negative, check_finite])
def test_a_word_is_no_number(check):
    with pytest.raises(TypeError, match=r"^Argument `d` must be a number, but is 'one'\.$"):
        check("d", "one")


def test_placeholders_are_left_alone():
    check_positive("d", None)
    check_positive("d", jax.ShapeDtypeStruct((), jnp.float32))
    check_positive("d", (object(), None))
    check_positive("d", [[1.0], [2.0, 3.0]])
    assert is_concrete({"a": 1.0, "b": jnp.zeros(2)})
    assert not jax.eval_shape(lambda x: jnp.array(is_concrete(x)), 1.0).weak_type


def test_a_refusal_carries_its_reason():
    with pytest.raises(Refused) as caught:
        raise Refused("an edge has an infinite covariance")
    assert caught.value.reason == "an edge has an infinite covariance"


@pytest.mark.parametrize("x", [0.0, 1.0, np.nan, np.array([0.5, 1.0])])
def test_an_open_range_has_no_ends(x):
    check_inside("x", 0.5, 0.0, 1.0)
    with pytest.raises(ValueError, match=r"Argument `x` must lie in \(0, 1\)"):
        check_inside("x", x, 0.0, 1.0)


def test_a_bound_from_above_is_not_reached():
    check_below("x", 0.5, 1.0)
    with pytest.raises(ValueError, match="Argument `x` must be less than 1, but is"):
        check_below("x", 1.0, 1.0)


@pytest.mark.parametrize(("x", "meant"), [("lamp", "lamp"), ((0,), "floor")])
def test_a_name_in_place_of_a_shapes_number_is_told_with_what_to_write(x, meant):
    with pytest.raises(TypeError, match=rf"write scene\.named\('{meant}'\)\[0\] for the first"):
        check_index("index", x, 1)


def test_keys_of_random_numbers_of_either_kind_pass_and_seeds_do_not():
    for key in (jax.random.key(0), jax.random.PRNGKey(0)):
        check_key("key", key)
        jax.jit(lambda key: check_key("key", key))(key)
    for seed in (0, np.int32(0), np.zeros(2), None):
        with pytest.raises(TypeError, match=r"^Argument `key` must be a key of random numbers"):
            check_key("key", seed)


@pytest.mark.parametrize("derivative", [jax.grad, jax.jacfwd, jax.hessian])
@pytest.mark.parametrize("compiled", [False, True])
def test_a_derivative_of_what_is_nan_is_nan(derivative, compiled):
    found = derivative(lambda x: nan_unless(x > 0.0, x**3))
    found = jax.jit(found) if compiled else found
    assert jnp.isnan(found(-1.0))
    assert found(2.0) == 12.0


@pytest.mark.parametrize("derivative", [jax.grad, jax.jacfwd])
def test_what_is_masked_leaves_its_neighbours_their_derivatives(derivative):
    def total(x):
        known = x > 0.0
        return jnp.sum(jnp.where(known, nan_unless(known, x**3), 0.0))

    x = jnp.array([-1.0, 2.0, 3.0])
    assert derivative(total)(x).tolist() == [0.0, 12.0, 27.0]
    assert jnp.diag(jax.hessian(total)(x)).tolist() == [0.0, 12.0, 18.0]


def test_one_of_many_that_is_nan_spoils_itself_alone():
    def total(x):
        return jnp.sum(nan_unless(x > 0.0, x**2))

    x = jnp.array([-1.0, 2.0])
    np.testing.assert_array_equal(jax.grad(total)(x), [np.nan, 4.0])
    np.testing.assert_array_equal(jax.vmap(jax.grad(total))(x), [np.nan, 4.0])
