"""What each operation of a JAX program does to expressions.

An operation is looked up by its name. Those that act entry by entry are functions of expressions;
those that only move entries are done once on the entries' numbers, and looked up; loops whose
counts are numbers are unrolled, and calls are followed (`reading`).
"""

from __future__ import annotations

import itertools
import operator
from collections.abc import Callable
from typing import Any

import numpy as np
import sympy

from firstorder.errors import Refused
from firstorder.symbolic._programs.exact import Expr, exact_array

Entries = np.ndarray


def entries(a) -> Entries:
    """Numbers as expressions; expressions as they are."""
    return a if a.dtype == object else exact_array(a)


def is_condition(a) -> bool:
    """Whether an expression is true or false; a symbol, which SymPy counts with these, is not."""
    return isinstance(a, sympy.logic.boolalg.Boolean) and not isinstance(a, sympy.Symbol)


def _compared(relation: Callable) -> Callable:
    """A relation that is decided between numbers alone: SymPy would think about others for long."""

    def compared(a, b):
        return relation(a, b, evaluate=bool(a.is_number and b.is_number))

    return compared


def _joined(join: Callable) -> Callable:
    """A join of conditions; numbers have none that says anything."""

    def joined(*args):
        if not all(map(is_condition, args)):
            raise Refused("a program that computes with the bits of a number has no formula")
        return join(*args)

    return joined


def _as_number(a):
    """A condition as 0 or 1; a number as it is."""
    if is_condition(a):
        return sympy.Piecewise((1, a), (0, True))
    return a


# --- entry by entry ------------------------------------------------------------------------------

UNARY: dict[str, Callable] = {
    "neg": operator.neg,
    "sin": sympy.sin,
    "cos": sympy.cos,
    "tan": sympy.tan,
    "asin": sympy.asin,
    "acos": sympy.acos,
    "atan": sympy.atan,
    "sinh": sympy.sinh,
    "cosh": sympy.cosh,
    "tanh": sympy.tanh,
    "asinh": sympy.asinh,
    "acosh": sympy.acosh,
    "atanh": sympy.atanh,
    "exp": sympy.exp,
    "exp2": lambda a: 2**a,
    "expm1": lambda a: sympy.exp(a) - 1,
    "log": sympy.log,
    "log1p": lambda a: sympy.log(1 + a),
    "sqrt": sympy.sqrt,
    "rsqrt": lambda a: 1 / sympy.sqrt(a),
    "cbrt": lambda a: sympy.sign(a) * sympy.cbrt(sympy.Abs(a)),  # SymPy's own is complex
    "square": lambda a: a**2,
    "abs": sympy.Abs,
    "sign": sympy.sign,
    "floor": sympy.floor,
    "ceil": sympy.ceiling,
    "erf": sympy.erf,
    "erfc": sympy.erfc,
    "logistic": lambda a: 1 / (1 + sympy.exp(-a)),
    "real": sympy.re,
    "imag": sympy.im,
    "conj": sympy.conjugate,
    "is_finite": lambda a: sympy.true,
    "not": _joined(sympy.Not),
    "convert_element_type": _as_number,
    "copy": lambda a: a,
    "copy_p": lambda a: a,
    "reduce_precision": lambda a: a,
    "stop_gradient": lambda a: a,
}
BINARY: dict[str, Callable] = {
    "add": operator.add,
    "add_any": operator.add,
    "sub": operator.sub,
    "mul": operator.mul,
    "div": operator.truediv,
    "pow": operator.pow,
    # With the sign of the dividend; SymPy's has that of the divisor.
    "rem": lambda a, b: sympy.sign(a) * sympy.Mod(sympy.Abs(a), sympy.Abs(b)),
    "atan2": sympy.atan2,
    "max": sympy.Max,
    "min": sympy.Min,
    "complex": lambda a, b: a + sympy.I * b,
    "lt": _compared(sympy.Lt),
    "le": _compared(sympy.Le),
    "gt": _compared(sympy.Gt),
    "ge": _compared(sympy.Ge),
    "eq": _compared(sympy.Eq),
    "ne": _compared(sympy.Ne),
    "and": _joined(sympy.And),
    "or": _joined(sympy.Or),
    "xor": _joined(sympy.Xor),
}
MOVING = {
    "broadcast_in_dim",
    "reshape",
    "squeeze",
    "expand_dims",
    "transpose",
    "rev",
    "slice",
    "dynamic_slice",
    "dynamic_update_slice",
    "gather",
    "concatenate",
    "stack",
    "unstack",
    "scatter",
    "split",
    "pad",
    "tile",
}
REDUCING: dict[str, Callable] = {
    "reduce_sum": lambda row: sympy.Add(*row),
    "reduce_prod": lambda row: sympy.Mul(*row),
    "reduce_max": lambda row: sympy.Max(*row),
    "reduce_min": lambda row: sympy.Min(*row),
    "reduce_and": lambda row: sympy.And(*row),
    "reduce_or": lambda row: sympy.Or(*row),
}
CUMULATING: dict[str, Callable] = {
    "cumsum": operator.add,
    "cumprod": operator.mul,
    "cummax": sympy.Max,
    "cummin": sympy.Min,
}


def elementwise(function: Callable, *arrays: Entries) -> Entries:
    """A function of expressions, entry by entry."""
    found = np.frompyfunc(function, len(arrays), 1)(*map(entries, arrays))
    return np.asarray(found, dtype=object)


# --- choices -------------------------------------------------------------------------------------


def chosen(which, *cases) -> Expr:
    """One of several expressions; not a number is no choice: its case is what is refused."""
    if which in (sympy.true, sympy.false):
        return cases[int(which == sympy.true)]
    if which.is_Integer:
        return cases[int(which)]
    if not is_condition(which):
        raise Refused("a choice by a number that is not known has no formula")
    no, yes = (_where(which, case, holds) for case, holds in zip(cases, (False, True), strict=True))
    if no is sympy.nan or yes is sympy.nan:
        return yes if no is sympy.nan else no
    return no if no == yes else Choice(yes, no, which)


class Choice(sympy.Function):
    """`Choice(yes, no, condition)`: a choice as it was made; `Piecewise` rewrites conditions."""

    nargs = 3

    @classmethod
    def eval(cls, *args):
        """The choice, once the condition is decided."""
        yes, no, condition = args
        if condition in (sympy.true, sympy.false):
            return yes if condition == sympy.true else no
        return None


def settled(a: Entries) -> Entries:
    """Choices as SymPy has them, when the program is read to its end."""
    return elementwise(_settled, a) if a.dtype == object else a


def _settled(e: Expr) -> Expr:
    """A choice inside a condition stays as it is: SymPy would think about it for minutes."""
    if isinstance(e, Choice):
        yes, no, condition = _inside_first(*e.args)
        pairs = (_settled(yes), condition), (_settled(no), True)
        return sympy.Piecewise(*pairs, evaluate=False)
    return e.func(*map(_settled, e.args)) if e.has(Choice) else e


def _inside_first(yes: Expr, no: Expr, condition) -> tuple[Expr, Expr, Any]:
    """`0` beyond some ends and else an expression, as one writes it: first where it holds.

    Programs ask for what lies beyond, so that NaN is not taken for it.
    """
    ends = sympy.Or.make_args(condition)
    beyond = all(isinstance(end, (sympy.Ge, sympy.Gt)) for end in ends)
    if beyond and yes.is_number and not no.is_number:
        return no, yes, sympy.And(*(end.negated for end in ends))
    return yes, no, condition


def _where(condition, case: Expr, holds: bool) -> Expr:
    """An expression where a condition holds, or does not: choices inside that it decides are made.

    Programs choose twice, so that no branch is asked for what it cannot compute.
    """
    join = sympy.And if holds else sympy.Or
    known = set(join.make_args(condition)) | {condition}

    def decided(choice: Expr) -> bool:
        asked = choice.args[2]
        return asked in known or (holds and set(sympy.And.make_args(asked)) <= known)

    while inner := [c for c in case.atoms(Choice) if decided(c)]:
        case = case.xreplace({c: c.args[0 if holds else 1] for c in inner})
    return case


# --- moves and sums ------------------------------------------------------------------------------


def moved(run: Callable, *arrays: Entries, beyond: float = np.nan) -> list[Entries]:
    """Expressions, rearranged as an operation rearranges their numbers.

    Args:
        run: the operation on arrays of numbers; gives NaN for what lies beyond their ends.
        arrays: those that hold expressions; the others are bound in `run`.
        beyond: what stands there.
    """
    flat = np.concatenate([entries(a).ravel() for a in arrays])
    first = np.cumsum([0, *(a.size for a in arrays)])
    # Numbered from 1: what is filled in (padding) stays 0.
    labels = [
        np.arange(f, f + a.size).reshape(a.shape) + 1.0 for f, a in zip(first, arrays, strict=False)
    ]
    pool = np.array([sympy.Integer(0), *flat, sympy.sympify(beyond)], dtype=object)
    found = [pool[np.nan_to_num(out, nan=len(flat) + 1).astype(int)] for out in run(*labels)]
    return [np.asarray(a, dtype=object) for a in found]


def reduced(function: Callable, a: Entries, axes: tuple[int, ...]) -> Entries:
    """A reduction over some axes."""
    a = entries(a)
    rest = [i for i in range(a.ndim) if i not in axes]
    rows = a.transpose((*rest, *axes)).reshape((*(a.shape[i] for i in rest), -1))
    out = np.empty(rows.shape[:-1], dtype=object)
    for place in np.ndindex(*out.shape):
        out[place] = function(rows[place])
    return out


def contracted(a: Entries, b: Entries, dimension_numbers) -> Entries:
    """`dot_general`: products summed over the contracted axes, batch axes first."""
    (ca, cb), (ba, bb) = dimension_numbers
    a, b = entries(a), entries(b)
    fa = [i for i in range(a.ndim) if i not in (*ca, *ba)]
    fb = [i for i in range(b.ndim) if i not in (*cb, *bb)]
    batch = tuple(a.shape[i] for i in ba)
    n = int(np.prod([a.shape[i] for i in ca], dtype=int))
    left = a.transpose((*ba, *fa, *ca)).reshape((*batch, -1, n))
    right = b.transpose((*bb, *cb, *fb)).reshape((*batch, n, -1))
    out = np.empty((*batch, left.shape[-2], right.shape[-1]), dtype=object)
    for place in np.ndindex(*out.shape):
        *where, i, j = place
        pairs = zip(left[(*where, i)], right[(*where, slice(None), j)], strict=True)
        out[place] = sympy.Add(*(x * y for x, y in pairs))
    return out.reshape((*batch, *(a.shape[i] for i in fa), *(b.shape[i] for i in fb)))


def cumulated(join: Callable, a: Entries, axis: int, reverse: bool) -> Entries:
    """All entries so far along an axis, joined."""
    a = np.moveaxis(entries(a), axis, 0)
    rows = list(itertools.accumulate(a[::-1] if reverse else a, np.frompyfunc(join, 2, 1)))
    return np.moveaxis(np.stack(rows[::-1] if reverse else rows), 0, axis)


# --- matrices ------------------------------------------------------------------------------------


def factored(a: Entries) -> list[Entries]:
    """LU factors of matrices of expressions, without exchanges of rows.

    Numbers are exchanged for accuracy; expressions are exact, and a pivot is zero for some
    values of its symbols only.
    """
    a = entries(a).copy()
    n = a.shape[-1]
    for where in np.ndindex(a.shape[:-2]):
        one = a[where]
        for k in range(n):
            for i in range(k + 1, n):
                one[i, k] = one[i, k] / one[k, k]
                for j in range(k + 1, n):
                    one[i, j] = sympy.cancel(one[i, j] - one[i, k] * one[k, j])
    kept = np.broadcast_to(np.arange(n, dtype=np.int32), a.shape[:-1])
    return [a, kept, kept]


def solved(a: Entries, b: Entries, params: dict) -> Entries:
    """`triangular_solve`: `a x = b`, or `x a = b`, by substitution."""
    a, b = entries(a), entries(b)
    out = np.empty(b.shape, dtype=object)
    for where in np.ndindex(b.shape[:-2]):
        out[where] = _substituted(a[where], b[where], params)
    return out


def _substituted(a: Entries, b: Entries, params: dict) -> Entries:
    """`solved` for one matrix."""
    left, right = sympy.Matrix(a), sympy.Matrix(b)
    n = left.shape[0]
    keep = (lambda i, j: j <= i) if params["lower"] else (lambda i, j: j >= i)
    one = params["unit_diagonal"]
    t = sympy.Matrix(n, n, lambda i, j: (1 if one and i == j else left[i, j]) if keep(i, j) else 0)
    t = t.T if params["transpose_a"] else t
    x = t.LUsolve(right) if params["left_side"] else t.T.LUsolve(right.T).T
    return np.array(x.applyfunc(sympy.cancel).tolist(), dtype=object)
