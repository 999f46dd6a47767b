"""Functions that SymPy has not.

Those that nobody has given: light `L(x, theta)`, a lobe `rho(theta)`, and their derivatives; and
the moments of exponentials.
"""

from __future__ import annotations

from typing import Any

import sympy


class Unknown(sympy.Function):
    """An unknown function of named coordinates, or one of its partial derivatives.

    `L_x` is the derivative of `L` along x, and its own derivatives are `L_xx` and `L_xtheta`: a
    formula reads as the papers print it, at any argument.

    Attributes:
        base: name of the function.
        names: of its coordinates.
        orders: how often it was differentiated along each.
    """

    base: str
    names: tuple[str, ...]
    orders: tuple[int, ...]

    def fdiff(self, argindex=1):
        """The partial derivative along an argument."""
        orders = list(self.orders)
        orders[argindex - 1] += 1
        return unknown_function(self.base, self.names, tuple(orders))(*self.args)

    def _eval_is_extended_real(self):
        return None if self.base.endswith("_hat") else True  # a transform is complex

    def _latex(self, printer, exp=None):
        arguments = ", ".join(printer._print(a) for a in self.args)
        bare = self.base.removesuffix("_hat")
        name = printer._print(sympy.Symbol(bare))
        name = name if bare == self.base else f"\\hat{{{name}}}"
        letters = [
            printer._print(sympy.Symbol(n))
            for n, k in zip(self.names, self.orders, strict=True)
            for _ in range(k)
        ]
        index = f"_{{{' '.join(letters)}}}" if letters else ""
        power = f"^{{{exp}}}" if exp else ""
        return f"{name}{index}{power}\\left({arguments}\\right)"


def unknown_function(base: str, names: tuple[str, ...], orders: tuple[int, ...] = ()) -> Any:
    """The class of an unknown function, or of a derivative of it: one for each."""
    key = (base, names, orders or (0,) * len(names))
    if key not in _CLASSES:
        _CLASSES[key] = _class_of(*key)
    return _CLASSES[key]


# Formulas that were written before and after compare their classes: no cache, which may be cleared.
_CLASSES: dict[tuple[str, tuple[str, ...], tuple[int, ...]], Any] = {}


def _class_of(base: str, names: tuple[str, ...], orders: tuple[int, ...]) -> Any:
    index = "".join(name * k for name, k in zip(names, orders, strict=True))
    label = f"{base}_{index}" if index else base
    about = {"base": base, "names": names, "orders": orders, "nargs": len(names)}
    return type(Unknown)(label, (Unknown,), about)


class Moment(sympy.Function):
    """`int_0^1 s^m exp(w s) ds`, whose closed form divides by w: it is whole at 0 too."""

    nargs = 2

    def fdiff(self, argindex=2):
        """Along w: the next moment."""
        m, w = self.args
        return Moment(sympy.Integer(m) + 1, w)

    def _latex(self, printer, exp=None):
        m, w = self.args
        power = f"s^{{{printer._print(m)}}} " if m != 0 else ""
        integral = f"\\int_0^1 {power}e^{{s \\left({printer._print(w)}\\right)}}\\,ds"
        return f"\\left({integral}\\right)^{{{exp}}}" if exp else integral
