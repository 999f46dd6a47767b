import pytest

from firstorder.ledger import Counterexample, Row, na


def test_a_row_cannot_lean_on_routes_that_it_does_not_have():
    with pytest.raises(ValueError, match="they do not"):
        Row("T.1", "identity", fourier=na("two routes"))


def test_a_misprint_without_counterexample_is_refused():
    with pytest.raises(ValueError, match="counterexample"):
        Row("T.1", "misprint", corrected="something")


def test_a_kind_must_be_one_of_the_few():
    with pytest.raises(ValueError, match="kind"):
        Row("T.1", "theorem")


def test_a_reason_must_be_one_of_the_few():
    with pytest.raises(ValueError, match="reason"):
        na("I did not feel like it")


def test_a_counterexample_is_data():
    example = Counterexample({"x": 1.0}, printed=lambda x: x, true=lambda x: 2 * x)
    assert example.true(**example.inputs) == 2.0


def test_the_paper_is_what_stands_before_the_dot():
    assert Row("R07.fig2.move", "identity").paper == "R07"
