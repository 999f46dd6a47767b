"""Lobes from expressions."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import sympy

from firstorder._argument_checks import check_positive, is_concrete
from firstorder.conventions import UNSTATED, Frame, fourier_kernel
from firstorder.fields.kernel import Profile
from firstorder.numerics._quadrature import composite_gauss_legendre
from firstorder.symbolic._exact import Expr
from firstorder.symbolic._numeric import Expressions, free_of
from firstorder.typing import Array, Scalar, as_float

NODES = 128  # of the quadratures of transform and spread
DEAD = 1e-17  # share of the peak at which a lobe has died out
FARTHEST = 64.0  # where it must have


def lobe(
    profile: Any,
    variable: Any,
    *,
    parameters: Mapping[Any, Any] | None = None,
    half_width: Any = None,
    axis: str = "theta",
    frame: Frame = UNSTATED,
) -> ExpressionLobe:
    """A lobe `rho(t)` from an expression, for `Reflection` and `Convolve`.

    Its derivatives are those of the expression, in closed form. Its transform
    `int rho(t) exp(-2 pi i Omega t) dt` and its spread are quadratures over the lobe with 128
    nodes: exact to rounding for a smooth lobe up to `|Omega| = 12 / half_width`, beyond which the
    waves are finer than the nodes.

    Args:
        profile: the expression.
        variable: its symbol: the angle from the mirror direction.
        parameters: symbols and their numbers, which are differentiable leaves.
        half_width: where the lobe ends. Left out, where it has died out to 1e-17 of its peak, for
            the numbers that the parameters have now; lobes of an angle end at pi / 2 at the latest.
        axis: name of the coordinate that it acts along.
        frame: names of all coordinates; left out, those that the axis names.

    Raises:
        ValueError: if a symbol has no number, or the lobe neither dies out nor is given an end.

    Example:
        >>> import sympy
        >>> from firstorder.symbolic import lobe
        >>> t, a = sympy.symbols("t a")
        >>> satin = lobe(sympy.cos(t)**8 * (1 + a * t**2), t, parameters={a: 0.3})
        >>> round(satin.half_width().item(), 6), round(satin(0.0, 0.5).item(), 6)
        (1.564453, 0.378192)
    """
    symbol = sympy.Symbol(str(variable), real=True)
    real = {s: sympy.Symbol(s.name, real=True) for s in sympy.sympify(profile).free_symbols}
    entry = sympy.sympify(profile).xreplace(real | {sympy.sympify(variable): symbol})
    numbers = {str(s): as_float(v) for s, v in (parameters or {}).items()}
    if symbol.name in numbers:
        raise ValueError(f"Argument `parameters` gives a number for the variable {symbol.name}.")
    free = sorted(free_of((entry,), (symbol,)), key=lambda s: s.name)
    for missing in (s.name for s in free if s.name not in numbers):
        raise ValueError(f"Argument `parameters` must give a number for {missing} of the lobe.")
    values = tuple(numbers[s.name] for s in free)
    expressions = Expressions((entry,), (symbol,), tuple(free), values)
    if half_width is None:
        half_width = _end(expressions, axis)
    return ExpressionLobe(expressions, as_float(half_width), axis, frame)


class ExpressionLobe(Profile):
    """A lobe from an expression, zero beyond its half width; `lobe` makes it.

    Attributes:
        expressions: the profile with its parameters.
        end: the half width.
        axis: the coordinate that it acts along.
    """

    expressions: Expressions
    end: Scalar
    axis: str = eqx.field(static=True, default="theta")
    frame: Frame = eqx.field(static=True, default=UNSTATED)

    def __check_init__(self):
        """Refuse an end that is none."""
        check_positive("half_width", self.end)
        self._state_frame()

    @property
    def profile(self) -> Expr:
        """The expression."""
        return self.expressions.entries[0]

    def half_width(self) -> Scalar:
        """Where the lobe ends."""
        return self.end

    def derivatives(self, t: Scalar) -> tuple[Scalar, Scalar, Scalar]:
        """The expression and its derivatives; zeros beyond the end."""
        inside = jnp.abs(t) < self.end
        (p,), d, dd = self.expressions.derivatives(jnp.where(inside, t, 0.0)[None])
        p, d, dd = (jnp.where(inside, a, 0.0) for a in (p, d[0, 0], dd[0, 0, 0]))
        return p, d, dd

    def _nodes(self) -> tuple[Array, Array, tuple[Array, Array, Array]]:
        t, w = composite_gauss_legendre(-self.end, self.end, [0.0 * self.end], NODES // 2)
        return t, w, jax.vmap(self.derivatives)(t)

    def transform(self, Omega: Scalar) -> Array:
        """By quadrature."""
        t, w, (p, _, _) = self._nodes()
        return jnp.sum(w * p * fourier_kernel(Omega[None, None], t[:, None]))

    def spread(self) -> Scalar:
        """`int p'^2 / (4 pi^2 int p^2)`, by quadrature."""
        _, w, (p, d, _) = self._nodes()
        return jnp.sum(w * d * d) / (4.0 * np.pi**2 * jnp.sum(w * p * p))


def _end(expressions: Expressions, axis: str) -> float:
    """Where the lobe has died out."""
    if not is_concrete(expressions.values):
        raise ValueError("Argument `half_width` must be given where parameters are not numbers.")
    t = np.linspace(0.0, FARTHEST, 64 * 512 + 1)
    t = t[t < 0.5 * np.pi] if axis in ("theta", "phi") else t
    run = jax.vmap(lambda t: expressions(t[None])[0])
    size = np.maximum(np.abs(run(jnp.asarray(t))), np.abs(run(jnp.asarray(-t))))
    alive = np.flatnonzero(~(size <= DEAD * np.max(size)))[-1]
    if alive + 1 < t.size:
        return float(t[alive + 1])
    if axis in ("theta", "phi"):
        return 0.5 * np.pi
    raise ValueError(f"Argument `half_width` must be given: the lobe lives on at {FARTHEST:g}.")
