"""Exact numbers from the floating ones of a program: `6.283185307179586` is `2 pi`."""

from __future__ import annotations

import math
from fractions import Fraction
from typing import Any, TypeAlias

import numpy as np
import sympy

# SymPy's own types say less than its objects do, so type checkers cannot follow them.
Expr: TypeAlias = Any

# Denominators of what counts as a fraction: of a number that somebody typed, and of one that a
# program has rounded.
TYPED, ROUNDED = 10_000, 1_000
IRRATIONAL = (
    sympy.pi,
    sympy.sqrt(2),
    sympy.sqrt(sympy.pi),
    sympy.sqrt(2 * sympy.pi),
    1 / sympy.pi,
    1 / sympy.sqrt(sympy.pi),
    1 / sympy.sqrt(2 * sympy.pi),
    sympy.pi**2,
    sympy.sqrt(sympy.pi / 2),
    1 / sympy.pi**2,
)
_FLOATS = np.array([float(constant) for constant in IRRATIONAL])
_PARTS = np.arange(1.0, 65.0)


def exact(x) -> Expr:
    """A number as SymPy's: a fraction, one times a well-known constant, or the float itself.

    Example:
        >>> from firstorder.symbolic._programs.exact import exact
        >>> exact(0.3), exact(6.283185307179586)
        (3/10, 2*pi)
    """
    if isinstance(x, sympy.Basic):
        return x
    if isinstance(x, (bool, np.bool_)):
        return sympy.true if x else sympy.false
    if isinstance(x, (int, np.integer)):
        return sympy.Integer(int(x))
    if isinstance(x, (complex, np.complexfloating)):
        return exact(float(x.real)) + sympy.I * exact(float(x.imag))
    x = float(x)
    if not math.isfinite(x):
        return sympy.nan if math.isnan(x) else sympy.oo * int(math.copysign(1, x))
    fraction = Fraction(x).limit_denominator(TYPED)
    if float(fraction) != x:
        fraction = Fraction(x).limit_denominator(ROUNDED)
    if _near(x, fraction):
        return sympy.Rational(fraction.numerator, fraction.denominator)
    for constant in _that_may_divide(x):
        share = x / float(constant)
        fraction = Fraction(share).limit_denominator(len(_PARTS))
        if fraction and _near(share, fraction):
            return sympy.Rational(fraction.numerator, fraction.denominator) * constant
    return sympy.Float(x)


def _that_may_divide(x: float) -> list[Expr]:
    """Constants of which a number may be a part; to ask each by `Fraction` takes long."""
    share = (x / _FLOATS)[:, None]
    with np.errstate(over="ignore"):
        gap = np.abs(share - np.round(share * _PARTS) / _PARTS)
    near = np.any(gap <= 8.0 * np.spacing(np.abs(share)), axis=1)
    return [IRRATIONAL[i] for i in np.flatnonzero(near)]


def _near(x: float, fraction: Fraction) -> bool:
    """Whether a number is a fraction, but for a few roundings."""
    return bool(abs(x - float(fraction)) <= 4.0 * np.spacing(abs(x)))


def exact_array(a) -> np.ndarray:
    """An array of exact numbers; expressions are left as they are."""
    a = np.asarray(a)
    return np.array([exact(x) for x in a.ravel()], dtype=object).reshape(a.shape)
