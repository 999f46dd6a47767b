import json

import jax.numpy as jnp
import numpy as np
import pytest

from figures import timing, verdicts
from figures.verdicts import Measurement, Statement, at_least, at_most, between, met, near


def judged(measured, rule, error=None):
    return Statement("c", None, measured, rule, "R07 §1", error=error).verdict


@pytest.mark.parametrize(
    ("rule", "inside", "outside"),
    [
        (at_least(2.0), 2.0, 1.999),
        (at_most(2.0), 2.0, 2.001),
        (between(1.0, 2.0), 2.0, 2.001),
        (between(1.0, 2.0), 1.0, 0.999),
        (near(-2.0, 0.1), -1.85, -1.75),
        (near(2.0, 0.1), 2.15, 2.25),
    ],
)
def test_a_rule_decides_at_its_threshold(rule, inside, outside):
    assert judged(inside, rule) == verdicts.HOLDS
    assert judged(outside, rule) == verdicts.REFUTED


def test_a_number_within_two_standard_errors_of_the_threshold_decides_nothing():
    assert judged(2.19, at_least(2.0), 0.1) == verdicts.UNDECIDED
    assert judged(1.81, at_least(2.0), 0.1) == verdicts.UNDECIDED
    assert judged(2.21, at_least(2.0), 0.1) == verdicts.HOLDS
    assert judged(1.79, at_least(2.0), 0.1) == verdicts.REFUTED
    assert judged(1.05, between(1.0, 2.0), 0.1) == verdicts.UNDECIDED


def test_words_are_judged_by_a_condition_and_not_by_a_number():
    assert judged("0.1, 0.2", met(np.bool_(True), "both small")) == verdicts.HOLDS
    assert judged("0.1, 0.2", met(jnp.array(False), "both small")) == verdicts.REFUTED
    with pytest.raises(ValueError, match="'at least 1' wants a number, but 'c' measured 'much'"):
        _ = judged("much", at_least(1.0))


def test_a_refuted_statement_says_why_and_no_other():
    rule, reason = at_most(1.0), "It is large."
    told = Statement("c", "small", jnp.float64(2.0), rule, "R07 §1", reason=reason).as_json()
    assert (told["verdict"], told["reason"], told["measured"]) == ("refuted", reason, 2.0)
    told = Statement("c", "small", 0.5, rule, "R07 §1", reason=reason).as_json()
    assert (told["verdict"], told["reason"]) == ("holds", "")


def test_a_measurement_has_the_keys_of_a_statement_and_no_verdict():
    number = Measurement("time", np.float32(0.5), "s", error=0.1).as_json()
    assert list(number) == list(Statement("c", 1.0, 1.0, at_least(1.0), "R07").as_json())
    assert number["verdict"] == verdicts.MEASURED
    assert json.loads(json.dumps(number))["measured"] == 0.5


@pytest.mark.parametrize(
    ("measured", "words"), [(np.nan, "finite"), (np.inf, "finite"), (np.zeros(2), r"shape \(2,\)")]
)
def test_a_value_that_is_not_one_finite_number_is_refused(measured, words):
    with pytest.raises(ValueError, match=words):
        Measurement("c", measured).as_json()


def test_the_spread_of_a_ratio_is_that_of_its_rounds():
    spent = [(2.0, 1.0), (4.0, 1.0), (8.0, 1.0)]
    found = timing.of_rounds(spent)
    assert found.mean == pytest.approx(4.0)
    assert found.error == pytest.approx(4.0 * np.log(2.0) / np.sqrt(3.0))
    with pytest.raises(ValueError, match="at least two rounds, not 1"):
        timing.of_rounds(spent[:1])


def test_what_takes_twice_as_long_has_twice_the_time():
    def work(n):
        return lambda: sum(i * i for i in range(n))

    found = timing.ratio(work(200_000), work(100_000))
    assert abs(found.mean - 2.0) < 5.0 * found.error + 0.2
