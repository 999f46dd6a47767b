"""Fourier transforms of profiles in closed form, term by term.

A sum of terms `t^m exp(-a t^2 + b t + c)`, waves for imaginary b, has a transform that needs no
search. Any other profile is left to its samples.
"""

from __future__ import annotations

import functools
from collections.abc import Callable
from typing import Any, NamedTuple

import jax.numpy as jnp
import numpy as np
import sympy

from firstorder.conventions import fourier_kernel
from firstorder.symbolic._programs.exact import Expr
from firstorder.symbolic._programs.functions import Moment
from firstorder.symbolic._programs.lowering import SPECIAL, as_function
from firstorder.symbolic._programs.moments import moment
from firstorder.symbolic._programs.reading import array, expression, read

LARGE = 60  # operations of a profile that is expanded
MOST = 64  # terms of what it expands to
HIGHEST = 8  # power of t in a term: moments of higher ones lose digits


class ClosedTransform(NamedTuple):
    """A transform as an expression.

    Attributes:
        expression: in the frequency, the end, and the profile's parameters.
        Omega: the symbol of the frequency.
        end: the symbol of the place where the profile is cut off, on both sides.
        endless: whether the expression is that of the whole line: it holds for a profile that has
            died out where it is cut off.
    """

    expression: Expr
    Omega: sympy.Symbol
    end: sympy.Symbol
    endless: bool


@functools.lru_cache(maxsize=256)
def closed_transform(profile: Expr, t: sympy.Symbol, dies: bool) -> ClosedTransform | None:
    """`int_-end^end p(t) exp(-2 pi i Omega t) dt` where its terms have one.

    Args:
        profile: p.
        t: its variable.
        dies: whether it has died out at the end.

    Returns:
        The transform, or None: nothing is searched for.

    Example:
        >>> import sympy
        >>> from firstorder.symbolic._transforms import closed_transform
        >>> t = sympy.Symbol("t", real=True)
        >>> closed_transform(sympy.exp(-(t**2) / 2), t, True).expression
        sqrt(2)*sqrt(pi)*exp(-2*pi**2*Omega**2)
    """
    Omega = sympy.Symbol("Omega", real=True)
    end = sympy.Symbol("half_width", positive=True)
    rate = sympy.diff(_kernel(Omega, t).args[0], t)
    terms = _terms(profile, t)
    parts = [_parts(term, t) for term in terms]
    integrals = [None if part is None else _integral(*part, rate, end, dies) for part in parts]
    found = [integral for integral in integrals if integral is not None]
    if not found or len(found) < len(integrals):
        return None
    total = sympy.Add(*(integral for integral, _ in found))
    return ClosedTransform(total, Omega, end, any(endless for _, endless in found))


def _kernel(Omega: sympy.Symbol, t: sympy.Symbol) -> Expr:
    """The Fourier kernel, as `conventions` has it."""
    return expression(read(fourier_kernel, array(Omega), array(t)))


def _terms(profile: Expr, t: sympy.Symbol) -> list[Expr]:
    """Terms whose waves are exponentials; none where there are too many."""
    if sympy.count_ops(profile) > LARGE or _steep(profile, t):
        return []
    waves = profile.rewrite([sympy.cos, sympy.sin, sympy.cosh, sympy.sinh], sympy.exp)
    found = sympy.Add.make_args(sympy.expand_mul(sympy.expand_multinomial(waves)))
    return list(found) if len(found) <= MOST else []


def _steep(profile: Expr, t: sympy.Symbol) -> bool:
    """Whether a power is too high to be expanded."""
    powers = (p.exp for p in profile.atoms(sympy.Pow) if p.base.has(t))
    return any(n.is_Integer and n > 2 * HIGHEST for n in powers)


def _parts(term: Expr, t: sympy.Symbol) -> tuple[Expr, int, list[Expr]] | None:
    """`weight, m, [c, b, -a]` of `weight t^m exp(-a t^2 + b t + c)`; None for any other term."""
    weight, rest = term.as_independent(t, as_Add=False)
    power, exponent = 0, sympy.Integer(0)
    for factor in sympy.Mul.make_args(rest):
        base, n = factor.as_base_exp()
        if factor.func is sympy.exp:
            exponent += sympy.expand(factor.args[0])
        elif base == t and n.is_Integer and 0 < n <= HIGHEST:
            power += int(n)
        elif factor != 1:
            return None
    if not exponent.is_polynomial(t) or sympy.degree(exponent, t) > 2:
        return None
    numbers = sympy.Poly(exponent, t).all_coeffs()[::-1]
    return weight, power, [*numbers, 0, 0][:3]


def _integral(
    weight: Expr, m: int, exponent: list, rate: Expr, end: Expr, dies: bool
) -> tuple[Expr, bool] | None:
    """The integral of a term times the kernel `exp(rate t)`, and whether it has no ends."""
    c, b, square = exponent
    z, weight = sympy.expand(b + rate), weight * sympy.exp(c)
    if square != 0:
        s = sympy.Dummy("s")
        bell = sympy.diff(sympy.exp(-(s**2) / (4 * square)), s, m).subs(s, z)
        return (weight * sympy.sqrt(sympy.pi / -square) * bell, True) if dies else None
    if m == 0 and (z / sympy.I).is_real:
        return weight * 2 * end * sympy.sinc(z / sympy.I * end), False
    ends = end ** (m + 1) * Moment(m, z * end) - (-end) ** (m + 1) * Moment(m, -z * end)
    return weight * ends, False


@functools.lru_cache(maxsize=256)
def with_moments_at_once(found: Expr, symbols: tuple) -> Callable:
    """An expression as a function of numbers, its moments of one order in one call.

    A sum of waves has a dozen moments or more, and each written apart takes long to compile.
    """
    groups: dict[Any, list[Expr]] = {}
    for part in sorted(found.atoms(Moment, sympy.sinc), key=str):
        groups.setdefault(part.args[0] if isinstance(part, Moment) else None, []).append(part)
    parts = [part for group in groups.values() for part in group]
    known = [sympy.Dummy() for _ in parts]
    arguments = as_function(symbols, [part.args[-1] for part in parts], SPECIAL)
    rest = found.xreplace(dict(zip(parts, known, strict=True)))
    total = as_function([*known, *symbols], [rest], SPECIAL)

    def run(*values):
        given, numbers = iter(arguments(*values)), []
        for order, group in groups.items():
            w = jnp.stack(jnp.broadcast_arrays(*(jnp.asarray(next(given)) for _ in group)))
            numbers += list(jnp.sinc(w / np.pi) if order is None else moment(int(order), w))
        return total(*numbers, *values)[0]

    return run
