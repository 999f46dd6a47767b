"""What an expression must not be: complex, without a number, or broken inside."""

from __future__ import annotations

from typing import Any

import numpy as np
import sympy

from firstorder._argument_checks import check_finite, check_one, check_real, is_concrete
from firstorder.symbolic._programs.exact import Expr
from firstorder.symbolic._programs.numeric import Expressions
from firstorder.typing import Array

CELLS = 4096  # in which a break is looked for
HALVINGS = 25  # of the one that looks broken most
BROKEN = 1e-6  # share of the largest by which a break is one
STEPS = (sympy.floor, sympy.ceiling, sympy.frac, sympy.Mod)


def check_one_number(name: str, x: Any) -> None:
    """Refuse what is not one real finite number; symbols and traced ones pass.

    Example:
        >>> from firstorder.symbolic._jumps import check_one_number
        >>> check_one_number("a", 0.5)
    """
    check_real(name, x)
    check_one(name, x)
    check_finite(name, x)


def check_real_expression(name: str, expression: Expr) -> None:
    """Refuse what holds numbers that are not real, or are none.

    Raises:
        ValueError: if so.

    Example:
        >>> import sympy
        >>> from firstorder.symbolic._jumps import check_real_expression
        >>> check_real_expression("factor", sympy.sqrt(2) * sympy.Symbol("x"))
    """
    for part in sympy.preorder_traversal(expression):
        if part in (sympy.nan, sympy.zoo):
            raise ValueError(f"Argument `{name}` must be finite, but is {expression}.")
        if getattr(part, "is_number", False) and part.is_extended_real is False:
            raise ValueError(f"Argument `{name}` must be real, but is {expression}.")


def refuse_jumps(expressions: Expressions, end: Array) -> None:
    """Refuse a lobe that jumps or has a kink within its half width, where it is made of pieces.

    SymPy differentiates each piece and forgets the Dirac between. What changes over a cell is
    compared with the integral of the derivative, and the worst cell is halved: over a break both
    stay apart.

    Raises:
        ValueError: if so.

    Example:
        >>> import jax.numpy as jnp, sympy
        >>> from firstorder.symbolic._jumps import refuse_jumps
        >>> from firstorder.symbolic._programs.numeric import Expressions
        >>> t = sympy.Symbol("t", real=True)
        >>> smooth = sympy.Piecewise((t**4, t > 0), (0, True))
        >>> refuse_jumps(Expressions((smooth,), (t,), (), ()), jnp.array(1.0))
    """
    (profile,), (t,) = expressions.entries, expressions.coordinates
    if profile.has(*STEPS):
        raise ValueError(f"Argument `profile` must have no jump, but is {profile}.")
    if not profile.has(sympy.Piecewise) or not is_concrete((expressions.values, end)):
        return
    slopes = [profile, sympy.diff(profile, t), sympy.diff(profile, t, 2)]
    run = sympy.lambdify((t, *expressions.symbols), slopes, ["numpy", "scipy"])

    def at(places):
        with np.errstate(all="ignore"):  # pieces are evaluated where they are not chosen too
            found = run(places, *map(float, expressions.values))
        return [np.broadcast_to(np.asarray(a, float), places.shape) for a in found]

    places = np.linspace(-1.0, 1.0, CELLS + 1)[1:-1] * float(end)
    largest = [np.max(np.abs(a)) for a in at(places)]
    for order, words in enumerate(("jump", "kink")):
        low, high = places[:-1], places[1:]
        for _ in range(HALVINGS):
            middle = 0.5 * (low + high)
            before, between, after = (at(x) for x in (low, middle, high))
            for scale, *seen in zip(range(3), before, between, after, strict=True):
                # A feature that is narrower than a cell is seen only now.
                largest[scale] = max(largest[scale], *(np.max(np.abs(a)) for a in seen))
            rate = before[order + 1] + 4.0 * between[order + 1] + after[order + 1]
            missed = np.abs(after[order] - before[order] - (high - low) * rate / 6.0)
            worst = int(np.argmax(missed))
            if not missed[worst] > BROKEN * largest[order]:
                break
            ends = low[worst], middle[worst], high[worst]
            low, high = np.array(ends[:2]), np.array(ends[1:])
        else:
            raise ValueError(
                f"Argument `profile` must have no {words}, but has one near {t} = {low[0]:.3g}, "
                "which the derivatives of light after the lobe would miss."
            )
