"""Expressions from text that a user has typed, of which nothing is evaluated."""

from __future__ import annotations

import ast
import math
import operator
from collections.abc import Iterable

import sympy

from firstorder.symbolic._programs.exact import Expr

LONGEST = 300  # characters
LARGEST = 256  # bits of a number that powers may make
FUNCTIONS = {
    name: getattr(sympy, name)
    for name in ("sin", "cos", "tan", "asin", "acos", "atan", "sinh", "cosh", "tanh", "exp", "log")
} | {"sqrt": sympy.sqrt, "erf": sympy.erf, "abs": sympy.Abs, "sign": sympy.sign}
CONSTANTS = {"pi": sympy.pi}
OPERATORS = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.Div: operator.truediv,
    ast.Pow: operator.pow,
}


def parse_expression(text: str, names: Iterable[str]) -> Expr:
    """An expression from text: numbers, the given names, + - * / **, and known functions.

    SymPy's own `parse_expr` and `sympify` evaluate what they are given as Python, so whoever types
    can run anything. Here the text is taken apart by Python's parser, which runs nothing, and put
    together again from the parts that are allowed: sin, cos, tan, asin, acos, atan, sinh, cosh,
    tanh, exp, log, sqrt, erf, abs, sign and pi.

    Args:
        text: at most 300 characters.
        names: of the symbols that it may hold.

    Returns:
        The expression, in symbols without assumptions; typed decimals are exact fractions.

    Raises:
        ValueError: if it holds anything else, in one sentence.

    Example:
        >>> from firstorder.symbolic import parse_expression
        >>> parse_expression("theta - x / 0.5", ["x", "theta"])
        theta - 2*x
    """
    if len(text) > LONGEST:
        raise ValueError(f"An expression has at most {LONGEST} characters, but this {len(text)}.")
    try:
        tree = ast.parse(text.strip(), mode="eval")
    except (SyntaxError, ValueError, RecursionError, MemoryError):
        raise ValueError(f"{text.strip()!r} is no expression.") from None
    symbols = {name: sympy.Symbol(name) for name in names}
    found = _built(tree.body, symbols)
    if found.has(sympy.zoo, sympy.nan, sympy.oo):
        raise ValueError(f"{text.strip()!r} is not finite.")
    for part in sympy.preorder_traversal(found):
        if part.is_number and part.is_extended_real is False:
            raise ValueError(f"{text.strip()!r} is not real.")
    return found


def _built(node: ast.AST, symbols: dict[str, sympy.Symbol]) -> Expr:
    """A part of the text as an expression, from its own parts."""
    match node:
        case ast.Constant(value=int() | float() as number) if not isinstance(number, bool):
            if not math.isfinite(number):
                raise ValueError("A number in the expression is too large.")
            return _moderate(sympy.Rational(repr(number)))
        case ast.Name(id=name) if name in symbols:
            return symbols[name]
        case ast.Name(id=name) if name in CONSTANTS:
            return CONSTANTS[name]
        case ast.Name(id=name):
            known = ", ".join(symbols)
            raise ValueError(f"{name!r} is unknown: the names here are {known}.")
        case ast.UnaryOp(op=ast.USub(), operand=inner):
            return -_built(inner, symbols)
        case ast.UnaryOp(op=ast.UAdd(), operand=inner):
            return _built(inner, symbols)
        case ast.BinOp(left=left, op=op, right=right) if type(op) in OPERATORS:
            parts = _built(left, symbols), _built(right, symbols)
            return _moderate(OPERATORS[type(op)](*_allowed(op, *parts)))
        case ast.Call(func=ast.Name(id=name), args=[inner], keywords=[]) if name in FUNCTIONS:
            return FUNCTIONS[name](_built(inner, symbols))
        case ast.Call(func=ast.Name(id=name)):
            known = ", ".join(FUNCTIONS)
            raise ValueError(f"{name!r} is no function of one argument here: known are {known}.")
    raise ValueError(f"{ast.unparse(node)!r} is no part of an expression that is known here.")


def _allowed(op: ast.AST, left: Expr, right: Expr) -> tuple[Expr, Expr]:
    """Operands, unless they make a power that takes long to write down."""
    endless = right.has(sympy.zoo, sympy.nan, sympy.oo)  # which SymPy does not compare
    if isinstance(op, ast.Pow) and right.is_number and (endless or abs(right) > 64):
        raise ValueError("Exponents are at most 64.")
    return left, right


def _moderate(found: Expr) -> Expr:
    """An expression, unless it is a number that nobody could have meant."""
    for number in found.atoms(sympy.Rational):
        if max(abs(number.p), number.q).bit_length() > LARGEST:
            raise ValueError("A number in the expression is too large.")
    return found
