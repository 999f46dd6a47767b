import functools

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from firstorder.checks.registry import all_cases
from firstorder.checks.squares import _converted_once
from firstorder.ledger import FACTORS, REQUIRED, Check, Row, attack, functions_of
from firstorder.numerics._compiled import compiled

HERE = __name__


def half(x):
    return 0.5 * x


@jax.jit
def quarter(x):
    return 0.5 * half(x)


@functools.cache
def remembered():
    return float(quarter(jnp.asarray(4.0)))


@compiled
def eighth(x):
    return 0.5 * quarter(x)


@jax.jit
def with_a_constant(x):
    return x * half(2.0)


TABLE = {"half": half}
BOUND = functools.partial(half, 2.0)


class Lens(eqx.Module):
    f: float

    def image(self, z):
        return 1.0 / (1.0 / self.f - 1.0 / z)

    @property
    def power(self):
        return 1.0 / self.f

    @staticmethod
    def of_power(power):
        return Lens(1.0 / power)

    def _hidden(self):
        return 1.0


class Record(eqx.Module):
    number: float
    name: str = eqx.field(static=True)


def scaling_maker(k):
    return lambda x: k * x


def count(x):
    return int(x)


def nan(x):
    return x if x > 0 else float("nan")


def row(name, check, bound=1e-9, **more):
    return Row("T.1", "identity", f"{HERE}.{name}", brute_force=Check(check, bound), **more)


def off(function, right):
    return lambda: abs(float(function()) / right - 1.0)


@pytest.mark.parametrize(
    ("name", "function", "right"),
    [
        ("half", lambda: half(2.0), 1.0),
        ("half", lambda: TABLE["half"](2.0), 1.0),
        ("half", lambda: BOUND(), 1.0),
        ("half", lambda: quarter(jnp.asarray(4.0)), 1.0),
        ("half", remembered, 1.0),
        ("half", lambda: eighth(jnp.asarray(8.0)), 1.0),
        ("quarter", lambda: quarter(jnp.asarray(4.0)), 1.0),
        ("eighth", lambda: eighth(jnp.asarray(8.0)), 1.0),
        ("remembered", remembered, 1.0),
        ("Lens", lambda: Lens(2.0).image(4.0), 4.0),
        ("Lens.power", lambda: Lens(2.0).power, 0.5),
        ("Lens.of_power", lambda: Lens.of_power(0.5).f, 2.0),
        ("Record", lambda: Record(2.0, "two").number, 2.0),
        ("scaling_maker", lambda: scaling_maker(3.0)(2.0), 6.0),
    ],
)
def test_what_is_named_is_put_out_wherever_it_is_held_and_right_again_afterwards(
    name, function, right
):
    assert function() == right  # compiled and remembered
    (found,) = attack([row(name, off(function, right))])
    assert found.noticed == dict.fromkeys(FACTORS, "brute_force")
    assert found.status == "notices"
    assert found.sound
    assert function() == right


def test_a_wrong_sign_is_told_and_does_not_count():
    (found,) = attack([row("half", lambda: abs(abs(half(2.0)) - 1.0))])
    assert found.noticed == dict.fromkeys(REQUIRED, "brute_force") | {-1.0: ""}
    assert found.sound


def test_a_row_that_calls_something_else_is_told():
    (found,) = attack([row("half", lambda: 0.0)])
    assert found.status == "does not call it"
    assert not found.sound


def test_a_row_with_too_wide_a_bound_is_told():
    (found,) = attack([row("half", off(lambda: half(2.0), 1.0), bound=0.01)])
    assert found.noticed == dict.fromkeys(REQUIRED, "") | {-1.0: "brute_force"}
    assert not found.sound
    assert found.status == "does not notice"
    assert "does not notice" in str(found)


def test_a_row_that_notices_one_direction_only_is_told():
    """A bound from above lets pass what is too small."""
    (found,) = attack([row("half", lambda: max(0.0, half(2.0) - 1.0))])
    assert found.noticed == {1.001: "brute_force", 0.999: "", -1.0: ""}
    assert found.status == "notices in part"
    assert not found.sound
    (excepted,) = attack([row("half", lambda: max(0.0, half(2.0) - 1.0), unnoticed="a bound")])
    assert excepted.status == "excepted"


def test_a_number_that_a_program_holds_is_not_off_by_the_factor_before():
    (found,) = attack([row("half", lambda: max(0.0, float(with_a_constant(1.0)) - 1.0))])
    assert found.noticed == {1.001: "brute_force", 0.999: "", -1.0: ""}


def test_factors_of_ones_own_all_count():
    (found,) = attack([row("half", off(lambda: half(2.0), 1.0), bound=0.01)], (1.005, 1.1))
    assert found.status == "notices in part"


def test_whole_numbers_are_not_put_out():
    assert attack([row("count", off(lambda: count(2.0), 2.0))])[0].status == "does not notice"


def test_an_exception_or_a_nan_does_not_count_as_noticed():
    def raises():
        if half(2.0) != 1.0:
            raise RuntimeError
        return 0.0

    assert not any(attack([row("half", raises)])[0].noticed.values())
    assert attack([row("half", lambda: nan(half(2.0)) - 1.0)])[0].noticed[-1.0] == ""


def test_an_exception_with_its_reason_is_sound_until_it_is_needed_no_longer():
    (excepted,) = attack([row("count", lambda: 0.0, unnoticed="a count")])
    assert excepted.status == "excepted"
    assert excepted.sound
    assert str(excepted).endswith("a count")
    (idle,) = attack([row("half", off(lambda: half(2.0), 1.0), unnoticed="for no reason")])
    assert idle.status == "notices, against its exception"
    assert not idle.sound


def test_private_methods_are_not_attacked_on_their_own():
    names = {f.__name__ for f in functions_of(f"{HERE}.Lens")}
    assert names == {"image", "power", "of_power"}


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("nowhere.at_all", "does not exist"),
        (f"{HERE}.nothing", "does not exist"),
        (f"{HERE}.TABLE", "nothing to attack"),
    ],
)
def test_what_cannot_be_attacked_is_one_sentence(name, words):
    with pytest.raises(ValueError, match=words):
        functions_of(name)


def test_a_truth_of_a_square_that_was_found_under_attack_is_forgotten():
    case = all_cases()["travel"]
    right = np.array(_converted_once(case, "gradient"))

    def error():
        return float(np.max(np.abs(_converted_once(case, "gradient") - right)))

    row = Row("T.9", "definition", "firstorder.transport.Travel", brute_force=Check(error, 1e-9))
    assert attack([row])[0].noticed == dict.fromkeys(FACTORS, "brute_force")
    assert error() == 0.0
