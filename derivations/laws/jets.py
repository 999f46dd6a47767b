"""Generic jets: what a proof about first and second derivatives starts from.

A statement about derivatives of order two at one ray holds for every twice differentiable field if
it holds for a second-order Taylor polynomial with symbols for coefficients: by Taylor's theorem the
rest is o(|h|^2), which neither products, nor compositions, nor integrals over a bounded interval
bring back.
"""

from __future__ import annotations

import sympy as sp


def taylor(name: str, variables, order: int = 2):
    """A polynomial with one symbol per monomial up to `order`: the generic jet at the origin."""
    terms = [
        sp.Symbol(f"{name}_{''.join(map(str, powers))}", real=True)
        * sp.Mul(*[v**k for v, k in zip(variables, powers, strict=True)])
        for powers in _powers(len(variables), order)
    ]
    return sp.Add(*terms)


def _powers(n: int, order: int):
    if n == 0:
        yield ()
        return
    for k in range(order + 1):
        for rest in _powers(n - 1, order - k):
            yield (k, *rest)


def gradient(f, variables, at=None):
    """Partial derivatives as a column, at the origin unless told otherwise."""
    result = sp.Matrix([sp.diff(f, v) for v in variables])
    return result.subs(at or dict.fromkeys(variables, 0), simultaneous=True)


def hessian(f, variables, at=None):
    """Second partial derivatives, at the origin unless told otherwise."""
    return sp.hessian(f, variables).subs(at or dict.fromkeys(variables, 0), simultaneous=True)
