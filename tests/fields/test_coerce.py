"""What a user gives in place of a field, and what becomes of it."""

import functools
import operator

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from firstorder.conventions import FLATLAND, SPACE, Frame
from firstorder.fields import Constant, gaussian
from firstorder.fields import _coerce as coerce
from firstorder.fields._coerce import as_field

BELL = gaussian((0.0, 0.0), (1.0, 1.0))
U = jnp.array([1.5, 0.25])


def test_a_field_stays_itself():
    assert as_field(BELL, "normal") is BELL


@pytest.mark.parametrize("x", [3, 3.0, np.float32(3.0), np.array(3.0), jnp.array(3.0), True])
def test_a_number_is_constant(x):
    field = as_field(x, "normal", FLATLAND)
    assert isinstance(field, Constant)
    assert field.frame == FLATLAND
    assert field.at(U) == float(x)
    assert field.at(U).dtype == float


def test_a_function_of_one_argument_is_one_of_the_coordinate_that_is_said():
    for axis, true in ((0, 4.5), (1, 0.75)):
        field = as_field(lambda a: 3.0 * a, "normal", FLATLAND, axis)
        assert field.at(U) == true
        assert field.frame == FLATLAND
        slope = np.zeros(2)
        slope[axis] = 3.0
        np.testing.assert_array_equal(field.jet(U).gradient, slope)
    assert as_field(lambda a: 3.0 * a, "normal").at(U) == 4.5


def test_other_functions_take_all_coordinates():
    assert as_field(lambda x, v: x - v, "normal").at(U) == 1.25
    assert as_field(lambda *u: u[0] * u[1], "normal").at(U) == 0.375
    assert as_field(lambda x, v, power=2.0: (x - v) ** power, "normal").at(U) == 1.25**2
    assert as_field(lambda x, /, v, *, power=2.0: v * power, "normal").at(U) == 0.5
    assert as_field(functools.partial(lambda k, x, v: k * x, 2.0), "normal").at(U) == 3.0
    assert as_field(operator.sub, "normal").at(U) == 1.25
    wide = as_field(lambda x, y, v, w: x - w, "normal", SPACE)
    assert wide.at(jnp.array([4.0, 3.0, 2.0, 1.0])) == 3.0


def test_a_function_may_return_plain_numbers_of_any_kind():
    for one in (lambda x: 2, lambda x: np.float32(2.0), lambda x, v: True + 1):
        field = as_field(one, "normal")
        assert field.at(U) == 2.0
        np.testing.assert_array_equal(field.jet(U).gradient, [0.0, 0.0])
    assert jax.vmap(coerce.Plain(lambda x, v: 2.0))(jnp.ones(3), jnp.ones(3)).shape == (3,)


def test_a_constant_function_is_finite_at_zero_and_of_one_coordinate_too():
    assert as_field(lambda x, v: 2.0, "normal").at(jnp.zeros(2)) == 2.0
    assert as_field(lambda x: 2.0, "normal", Frame(("x",))).at(jnp.zeros(1)) == 2.0


@pytest.mark.parametrize(
    ("x", "words"),
    [
        (lambda x, v, w: x, "a function of x or of x and theta, but takes 3 arguments"),
        (lambda: 1.0, "but takes 0 arguments"),
        ("bright", "a field, a function or a number or a name, but is a str"),
        ([1.0, 2.0], "but is a list"),
        (np.ones(2), "but is a ndarray"),
        (float, "but is the class float"),
        (None, "but is a NoneType"),
        (jnp.ones(3), "but is an ArrayImpl"),
    ],
)
def test_what_is_none_of_these_is_refused(x, words):
    with pytest.raises(TypeError, match=f"^Argument `normal` must be .*{words}"):
        as_field(x, "normal", extra=" or a name")


def test_the_coordinate_of_a_function_is_named():
    with pytest.raises(TypeError, match="a function of theta or of x and theta, but takes 3"):
        as_field(lambda x, v, w: x, "normal", FLATLAND, 1)


def test_a_module_of_its_own_is_no_plain_function():
    with pytest.raises(TypeError, match="but is a Plain"):
        as_field(coerce.Plain(lambda x: x), "normal")


# --- converters ----------------------------------------------------------------------------------


def test_converters_know_their_arguments_name_frame_and_coordinate():
    frame = Frame(("x", "v"))
    convert = coerce.field_of("height", frame, 1)
    assert convert(lambda v: 2.0 * v).at(U) == 0.5
    assert convert(1.0).frame == frame
    with pytest.raises(TypeError, match="`height`"):
        convert("no")
    maybe = coerce.field_or_none("height")
    assert maybe(None) is None
    assert isinstance(maybe(2.0), Constant)
    assert maybe(BELL) is BELL


def test_one_or_several_fields():
    many = coerce.fields_of("height")
    assert many(BELL) == (BELL,)
    assert [f.at(U).item() for f in many([1.0, lambda x: x])] == [1.0, 1.5]
    assert many(()) == ()
    one_or_many = coerce.field_or_fields("height")
    assert one_or_many(BELL) is BELL
    assert one_or_many(2.0).at(U) == 2.0
    assert one_or_many((BELL, BELL)) == (BELL, BELL)
    assert one_or_many([BELL]) == (BELL,)


def test_several_of_given_kinds():
    words = coerce.several("names", (str, int), "words or numbers")
    assert words("a") == ("a",)
    assert words(["a", 2]) == ("a", 2)
    assert words(()) == ()
    with pytest.raises(
        TypeError, match=r"^Argument `names` must hold words or numbers, but holds a f"
    ):
        words(["a", 2.0])
