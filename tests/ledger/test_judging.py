import math

import pytest
import sympy as sp

from firstorder.ledger import (
    ROUTES,
    Check,
    Counterexample,
    Entry,
    Row,
    judge,
    judge_route,
    na,
    vanishes,
)

x = sp.Symbol("x")
ENTRY = Entry("T.1", "A statement.", "printed")
OUT = dict.fromkeys(ROUTES, na("definition"))


def nothing():
    return x - x


def row(**parts):
    return Row(**{"equation": "T.1", "kind": "identity"} | parts)


def test_a_false_identity_fails():
    assert not vanishes(sp.sin(x) - x)
    assert judge_route("symbolic", lambda: sp.sin(x) - x).verdict == "fail"


def test_a_proof_may_return_several_expressions_and_matrices():
    assert judge_route("symbolic", lambda: [nothing(), (sp.zeros(2), nothing())]).verdict == "pass"
    wrong = judge_route("symbolic", lambda: [nothing(), sp.Matrix([0, x])])
    assert wrong.verdict == "fail"


@pytest.mark.parametrize(
    ("proof", "words"),
    [
        (lambda: 0, "uses no name"),
        (lambda: [0, 0.0], "uses no name"),
        (lambda: int(x - x), "plain number 0"),
        (lambda: float(nothing()), "plain number 0.0"),
        (lambda: bool(nothing() == 0), "truth value"),
        (lambda: list(ROUTES[:0]), "returns nothing"),
    ],
)
def test_what_computes_nothing_is_no_proof(proof, words):
    verdict = judge_route("symbolic", proof)
    assert verdict.verdict == "fail"
    assert words in verdict.reason


def test_names_inside_a_proof_count_wherever_they_stand():
    def closed(f=nothing):
        return (lambda: f())()

    def inner():
        return (lambda: nothing())()

    assert judge_route("symbolic", closed).verdict == "pass"
    assert judge_route("symbolic", inner).verdict == "pass"


@pytest.mark.parametrize("error", [math.nan, math.inf, 2.0])
def test_an_error_that_is_none_or_too_large_never_passes(error):
    assert judge_route("autodiff", Check(lambda: error, 1.0)).verdict == "fail"


def test_a_numeric_route_is_no_bare_function():
    assert "must be a Check" in judge_route("fourier", nothing).reason


def test_an_unchecked_row_says_not_yet():
    assert judge(ENTRY, row()).status == "not yet"
    assert judge(ENTRY, row(kind="definition")).status == "not yet"
    some = row(symbolic=nothing, autodiff=Check(lambda: 0.0, 1e-9))
    assert judge(ENTRY, some).status == "not yet"


def test_a_definition_with_nothing_to_judge_is_stated():
    assert judge(ENTRY, row(kind="definition", **OUT)).status == "stated"


def test_a_route_that_raises_fails_with_its_reason():
    result = judge(ENTRY, row(symbolic=lambda: nothing() + 1 / int(nothing())))
    assert result.status == "fail"
    assert "ZeroDivisionError" in result.verdicts["symbolic"].reason


def test_a_warning_fails_a_numeric_route():
    import warnings

    def warned():
        warnings.warn("overflow", RuntimeWarning, stacklevel=1)
        return 0.0

    assert "overflow" in judge_route("autodiff", Check(warned, 1.0)).reason


# --- the library's own proof ---------------------------------------------------------------------


def test_nobody_misses_a_derived_proof():
    result = judge(ENTRY, row(**OUT))
    assert "derived" not in result.verdicts
    assert "derived" not in result.as_json()
    assert result.status == "stated"


def test_a_derived_proof_is_judged_like_a_symbolic_one():
    right = judge(ENTRY, row(**OUT, derived=nothing))
    assert right.status == "pass"
    assert right.as_json()["derived"]["verdict"] == "pass"
    assert right.as_json()["status"] == right.status
    assert judge(ENTRY, row(**OUT, derived=lambda: x - 1)).status == "fail"
    assert judge(ENTRY, row(**OUT, derived=lambda: 0)).status == "fail"


# --- kinds ---------------------------------------------------------------------------------------


def example(printed, true):
    return Counterexample({"x": 2}, printed=lambda x: printed, true=lambda x: true)


@pytest.mark.parametrize("kind", ["misprint", "over-claim"])
@pytest.mark.parametrize(
    ("printed", "true", "holds"),
    [
        (1.0, 1.1, True),
        (0.0, 1e-6, True),
        (math.inf, 1.0, True),
        (1.0, 1.0005, False),
        (0.0, 0.0, False),
        (math.nan, 1.0, False),
        (1.0, math.nan, False),
        (math.inf, math.inf, False),
    ],
)
def test_what_is_wrong_in_print_differs_from_the_truth(kind, printed, true, holds):
    wrong = row(kind=kind, corrected="c", counterexample=example(printed, true), **OUT)
    result = judge(ENTRY, wrong)
    assert (result.status == "stated") is holds
    assert result.kind is not None
    assert ("no difference" in result.kind.reason) is not holds
    told = result.as_json()
    assert told["counterexample"]["inputs"] == {"x": 2}
    assert told["kind_judged"]["verdict"] == result.kind.verdict


def test_an_identity_with_a_counterexample_fails():
    result = judge(ENTRY, row(counterexample=example(1.0, 2.0), **OUT))
    assert result.status == "fail"
    assert result.kind is not None
    assert result.kind.reason == "An identity has no counterexample."


def test_a_counterexample_that_raises_fails_with_its_reason():
    bad = Counterexample({"x": 0}, printed=lambda x: 1 / x, true=lambda x: x)
    result = judge(ENTRY, row(kind="misprint", corrected="c", counterexample=bad, **OUT))
    assert result.status == "fail"
    assert result.kind is not None
    assert "ZeroDivisionError" in result.kind.reason
    assert result.as_json()["counterexample"] is None
