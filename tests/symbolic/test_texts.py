import pathlib

import pytest
import sympy

from firstorder.symbolic import parse_expression

x, theta, f = sympy.symbols("x theta f")
NAMES = ["x", "theta", "f"]

READ = {
    "theta - x / f": theta - x / f,
    "asin(sin(theta) / 1.5)": sympy.asin(sympy.sin(theta) * sympy.Rational(2, 3)),
    "1 / (1 + exp(-(x - 0.1) / 2))": 1 / (1 + sympy.exp(-(x - sympy.Rational(1, 10)) / 2)),
    "+cos(x)**8 * sqrt(2 * pi)": sympy.cos(x) ** 8 * sympy.sqrt(2 * sympy.pi),
    " -abs(x) ": -sympy.Abs(x),
}


@pytest.mark.parametrize("text", READ)
def test_what_is_typed_is_the_expression(text):
    assert parse_expression(text, NAMES) == READ[text]


REFUSED = {
    "theta -": "is no expression",
    "theta - y": "'y' is unknown: the names here are x, theta, f",
    "__import__('os')": "'__import__' is no function",
    "x.__class__": "is no part of an expression",
    "[x for x in (1,)]": "is no part of an expression",
    "(lambda: 1)()": "is no part of an expression",
    "'x'": "is no part of an expression",
    "True": "is no part of an expression",
    "x if x else theta": "is no part of an expression",
    "atan(x, theta)": "no function of one argument",
    "x = 3": "is no expression",
    "9**9**9": "Exponents are at most 64",
    "((2**64)**64)**64": "too large",
    "1e999": "too large",
    "1 / 0": "is not finite",
    "x" * 301: "at most 300 characters",
    "(" * 200 + "x" + ")" * 99: "is no expression",
}


@pytest.mark.parametrize("text", REFUSED)
def test_what_is_no_expression_is_refused_in_one_sentence(text):
    with pytest.raises(ValueError, match=REFUSED[text]) as refusal:
        parse_expression(text, NAMES)
    assert str(refusal.value).endswith(".")


def test_nothing_that_is_typed_is_run(tmp_path):
    made = tmp_path / "made"
    text = f"__import__('pathlib').Path({str(made)!r}).touch()"
    with pytest.raises(ValueError, match="is no part of an expression"):
        parse_expression(text, NAMES)
    assert not made.exists()
    sympy.parse_expr(text)  # SymPy's own runs it
    assert pathlib.Path(made).exists()


@pytest.mark.parametrize("text", ["x**(0/0)", "x**(1/0)", "x**log(0)", "2**(1/0 - 1/0)"])
def test_a_power_that_is_no_number_is_refused_in_words_of_ours(text):
    with pytest.raises(ValueError, match="Exponents are at most 64"):
        parse_expression(text, ["x"])


@pytest.mark.parametrize(
    "text", ["sqrt(-1)", "x * log(-1)", "asin(2)", "(-8)**(1/3)", "1 + sqrt(-4)*x"]
)
def test_an_expression_is_real(text):
    with pytest.raises(ValueError, match="is not real"):
        parse_expression(text, ["x"])
    assert parse_expression("sqrt(x) + asin(1) - log(2)", ["x"]) is not None
