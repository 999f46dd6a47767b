"""What the library derives beside what a paper prints, and the words in which both are written."""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Callable
from typing import Any

import sympy as sp

from firstorder._symbols import SymbolicArray
from firstorder.conventions import FLATLAND, Frame
from firstorder.symbolic import UnknownField
from firstorder.symbolic._programs.functions import unknown_function
from firstorder.symbolic._programs.reading import read

x, y, theta, v, t, px = sp.symbols("x y theta v t px", real=True)
Ox, Oy, Ot, Ov = sp.symbols("Omega_x Omega_y Omega_theta Omega_v", real=True)
d = sp.Symbol("d", positive=True)
k = sp.Symbol("kappa", real=True)
oo, pi = sp.oo, sp.pi

SLOPES = ("x", "v")
LEAVING = Frame(sense="outgoing")
LIGHT = UnknownField("L", frame=FLATLAND)


@dataclasses.dataclass(frozen=True)
class Equation:
    """An equation twice: derived by the library, and as the paper prints it, corrected.

    Calling it gives what must vanish.

    Attributes:
        derived: returns what the library says: an expression, or several.
        printed: returns the same, written by hand.
    """

    derived: Callable[[], Any]
    printed: Callable[[], Any]

    def __call__(self) -> list[Any]:
        """Differences of the two, in one normal form."""
        found, printed = flat(self.derived()), flat(self.printed())
        return [normal(a) - normal(b) for a, b in zip(found, printed, strict=True)]


def flat(parts: Any) -> list[Any]:
    """An expression, or arrays and lists of them, as a list."""
    if hasattr(parts, "expression"):
        parts = parts.expression
    if isinstance(parts, sp.MatrixBase | sp.NDimArray):
        parts = list(sp.flatten(parts.tolist()))
    if isinstance(parts, list | tuple):
        return [e for part in parts for e in flat(part)]
    return [sp.sympify(parts)]


def normal(expression: Any) -> Any:
    """One integral for each term, constants in front, and its variable by a common name."""
    return sp.expand(sp.expand(expression).replace(sp.Integral, _taken_apart))


def _taken_apart(integrand: Any, *limits: Any) -> Any:
    """Integrals of terms; the variables are named by how many integrals are inside."""
    depth = len(sp.sympify(integrand).atoms(sp.Integral))
    names = [sp.Symbol(f"t_{depth}_{i}", real=True) for i, _ in enumerate(limits)]
    renamed = {limit[0]: name for limit, name in zip(limits, names, strict=True)}
    ends = [(name, *limit[1:]) for limit, name in zip(limits, names, strict=True)]
    integrand = integrand.xreplace(renamed)
    for name, *limit in ends:
        integrand = integrand.replace(sp.Piecewise, _chosen_between(name, *limit))
    terms = sp.Add.make_args(sp.expand(integrand))
    pairs = [term.as_independent(*names) for term in terms]
    return sp.Add(*(c * sp.Integral(rest, *ends) for c, rest in pairs))


def _chosen_between(name: Any, lower: Any, upper: Any) -> Callable[..., Any]:
    """The choice that is made between two ends: the clamp of a cosine does nothing inside."""
    inside = sp.Abs(name) < upper

    def choice(*pairs: Any) -> Any:
        value, condition = pairs[0]
        return value if lower == -upper and condition == inside else sp.Piecewise(*pairs)

    return choice


# --- words ---------------------------------------------------------------------------------------


def unknown(name: str, *names: str) -> Callable[..., Any]:
    """An unknown function, and its derivatives: `f(x, along="x")` is `f_x(x)`."""

    def call(*at: Any, along: tuple[str, ...] | str = ()) -> Any:
        letters = (along,) if isinstance(along, str) else along
        orders = tuple(letters.count(n) for n in names)
        return unknown_function(name, names, orders)(*at)

    return call


def hat(name: str, *names: str) -> Callable[..., Any]:
    """The transform of an unknown function."""
    return unknown(f"{name}_hat", *(f"Omega_{n}" for n in names))


L, L_hat = unknown("L", "x", "theta"), hat("L", "x", "theta")
S, S_hat = unknown("L", "x", "v"), hat("L", "x", "v")  # over slopes
n, rho = unknown("n", "x"), unknown("rho", "theta")
rho_hat = hat("rho", "theta")


def integral(integrand: Any, variable: Any = t, lower: Any = -oo, upper: Any = oo) -> Any:
    """`int integrand`, over the whole line if no ends are given."""
    return sp.Integral(integrand, (variable, lower, upper))


def after(*steps: Any, light: Any = LIGHT) -> Any:
    """Light after events and laws."""
    return functools.reduce(lambda field, step: step(field), steps, light)


def at_symbols(function: Callable, *symbols: Any) -> Any:
    """What a function of the library makes of symbols."""
    return read(function, *(SymbolicArray(s) for s in symbols))
