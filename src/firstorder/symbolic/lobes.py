"""Lobes from expressions."""

from __future__ import annotations

import functools
from collections.abc import Callable, Mapping
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import sympy

from firstorder._argument_checks import check_positive, is_concrete, nan_unless
from firstorder.conventions import UNSTATED, Frame, fourier_kernel
from firstorder.fields.kernel import Profile
from firstorder.numerics._quadrature import composite_gauss_legendre, gauss_legendre
from firstorder.symbolic._energy import LobeBandLimit, measured_band_limit
from firstorder.symbolic._jumps import check_one_number, check_real_expression, refuse_jumps
from firstorder.symbolic._programs.exact import Expr
from firstorder.symbolic._programs.moments import moment
from firstorder.symbolic._programs.numeric import Expressions, free_of
from firstorder.symbolic._programs.reading import inserted, reading
from firstorder.symbolic._transforms import ClosedTransform, closed_transform, with_moments_at_once
from firstorder.typing import Array, Scalar, as_float

NODES = 128  # of the quadratures of transform and spread
DEAD = 1e-17  # share of the peak at which a lobe has died out
FARTHEST = 64.0  # where it must have
STEPS = 64 * 512  # in which that is looked for
FEWEST = 64  # steps that a lobe takes, or it is looked for in smaller ones
ALIVE = 1e-10  # share of the peak at the end beyond which the whole line's transform is not its own
FINEST = 12.0  # waves over half a lobe that 128 nodes resolve to rounding
TRUSTED = 1024.0  # roundings of the lobe's mass by which a closed transform may be off


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

    Its derivatives are those of the expression, in closed form. So is its transform
    `int rho(t) exp(-2 pi i Omega t) dt` (conventions, Fourier), if the expression is a sum of
    products of powers, exponentials, bells and waves. It is compared with that of samples
    before it is trusted. Where there is none, and where parameters are not numbers, the
    transform is a quadrature over the lobe with 128 nodes, as the spread always is: exact to
    rounding for a smooth lobe up to `|Omega| = 12 / half_width` (`resolved`), beyond which the
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
        ValueError: if a symbol has no number, the lobe has a kink or a jump, is complex, no number
            or zero, or neither dies out nor is given an end.

    Example:
        >>> import sympy
        >>> from firstorder.symbolic import lobe
        >>> t, a = sympy.symbols("t a")
        >>> satin = lobe(sympy.cos(t)**8 * (1 + a * t**2), t, parameters={a: 0.3})
        >>> round(satin.half_width().item(), 6), round(satin(0.0, 0.5).item(), 6)
        (1.564453, 0.378192)
        >>> satin.closed is not None, round(satin.band_limit(0.01).Omega, 6)
        (True, 0.802976)
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
    if sympy.diff(entry, symbol, 2).has(sympy.DiracDelta):
        raise ValueError(
            "Argument `profile` must have no kink: its second derivative is a Dirac there, which "
            "the Hessian of light after the lobe would miss."
        )
    for s, number in numbers.items():
        check_one_number(f"parameters[{s}]", number)
    values = tuple(numbers[s.name] for s in free)
    expressions = Expressions((entry,), (symbol,), tuple(free), values)
    check_real_expression("profile", entry)
    if half_width is None:
        half_width = _end(expressions, axis)
    half_width = as_float(half_width)
    check_positive("half_width", half_width)
    refuse_jumps(expressions, half_width)
    return ExpressionLobe(expressions, half_width, _trusted(expressions, half_width), axis, frame)


class ExpressionLobe(Profile):
    """A lobe from an expression, zero beyond its half width; `lobe` makes it.

    Attributes:
        expressions: the profile with its parameters.
        end: the half width.
        closed: its transform in closed form, or None.
        axis: the coordinate that it acts along.

    Raises:
        ValueError: if the half width is not positive.
    """

    expressions: Expressions
    end: Scalar
    closed: ClosedTransform | None = eqx.field(static=True, default=None)
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
        beyond = jnp.abs(t) >= self.end
        (p,), d, dd = self.expressions.derivatives(jnp.where(beyond, 0.0, t)[None])
        parts = (jnp.where(beyond, 0.0, a) for a in (p, d[0, 0], dd[0, 0, 0]))
        if not is_concrete(self.end):
            parts = (nan_unless(self.end > 0.0, a) for a in parts)
        p, d, dd = parts
        return p, d, dd

    def _nodes(self) -> tuple[Array, Array, tuple[Array, Array, Array]]:
        t, w = composite_gauss_legendre(-self.end, self.end, [0.0 * self.end], NODES // 2)
        return t, w, jax.vmap(self.derivatives)(t)

    def transform(self, Omega: Scalar) -> Array:
        """In closed form, or by quadrature.

        NaN for a closed form of the whole line if new numbers of the parameters have made the lobe
        so wide that it no longer dies out at its end.
        """
        if self.closed is None:
            return _quadrature(*self._nodes(), Omega)
        u = jnp.stack([Omega, self.end, *self.expressions.values])
        symbols = (self.closed.Omega, self.closed.end, *self.expressions.symbols)
        if reading():
            found = self.closed.expression
            return inserted(
                lambda *to: found.xreplace(dict(zip(symbols, to, strict=True))), u, complex
            )
        found = with_moments_at_once(self.closed.expression, symbols)(*u)
        found = jnp.asarray(found, jnp.result_type(u, 1j))
        return nan_unless(self._dead(), found) if self.closed.endless else found

    def _dead(self) -> Array:
        """Whether the lobe has died out where it is cut off."""
        across = jnp.linspace(-1.0, 1.0, 17)[:, None] * self.end
        size = jnp.abs(jax.vmap(self.expressions)(across)[0])
        return jnp.maximum(size[0], size[-1]) <= ALIVE * jnp.max(size)

    def resolved(self) -> Scalar:
        """The frequency up to which the transform is exact to rounding, for a smooth lobe."""
        return jnp.asarray(jnp.inf) if self.closed is not None else FINEST / self.end

    def band_limit(self, share: float = 0.01) -> LobeBandLimit:
        """The frequency beyond which less than a share of the lobe's energy lies, measured.

        `int_{|Omega| > B} |F|^2 = share int |F|^2`. The energy up to B is a double quadrature of
        `rho(s) rho(t) sin(2 pi B (s - t)) / (pi (s - t))`, so no transform is asked. Nodes are
        doubled until B stands still; its last step is the error.

        Args:
            share: of the energy, between 0 and 1.

        Raises:
            ValueError: if `share` is none, or the lobe's parameters are not numbers.
            Refused: if B does not stand still: what jumps has energy at all frequencies.

        Example:
            >>> import sympy
            >>> from firstorder.symbolic import lobe
            >>> t = sympy.Symbol("t")
            >>> limit = lobe(sympy.exp(-(t**2) / 2), t, axis="v").band_limit(0.01)
            >>> round(limit.Omega, 6), limit.error < 1e-9  # erfc(2 pi B) = 0.01
            (0.289883, True)
        """
        if not is_concrete((self.expressions.values, self.end)):
            raise ValueError("Arguments `parameters` must be numbers: a band limit is measured.")
        profile = functools.partial(_samples, self.expressions)
        return measured_band_limit(profile, float(self.end), share)

    def spread(self) -> Scalar:
        """`int p'^2 / (4 pi^2 int p^2)`, by quadrature."""
        _, w, (p, d, _) = self._nodes()
        return jnp.sum(w * d * d) / (4.0 * np.pi**2 * jnp.sum(w * p * p))


def _quadrature(
    t: Array, w: Array, derivatives: tuple[Array, Array, Array], Omega: Scalar
) -> Array:
    """The transform by nodes."""
    return jnp.sum(w * derivatives[0] * fourier_kernel(Omega[None, None], t[:, None]))


@functools.lru_cache(maxsize=256)
def _on_host(expression: Expr, symbols: tuple) -> Callable:
    """An expression as a function of NumPy's numbers: nothing is compiled."""
    calls = {"Moment": functools.partial(moment, xp=np)}
    return sympy.lambdify(symbols, expression, modules=[calls, "numpy", "scipy"], cse=True)


def _samples(expressions: Expressions, t: np.ndarray) -> np.ndarray:
    """The lobe at places."""
    run = _on_host(expressions.entries[0], (*expressions.coordinates, *expressions.symbols))
    with np.errstate(all="ignore"):  # pieces are evaluated where they are not chosen too
        return np.broadcast_to(run(t, *map(float, expressions.values)), t.shape)


def _trusted(expressions: Expressions, end: Array) -> ClosedTransform | None:
    """The transform in closed form, if it is that of samples; None where nobody can compare."""
    if not is_concrete((expressions.values, end)):
        return None
    h = float(end)
    across = np.abs(_samples(expressions, np.linspace(-h, h, 257)))
    dies = bool(max(across[0], across[-1]) <= ALIVE * np.max(across))
    found = closed_transform(expressions.entries[0], expressions.coordinates[0], dies)
    return found if found is not None and _agrees(found, expressions, h) else None


def _agrees(found: ClosedTransform, expressions: Expressions, end: float) -> bool:
    """Whether a transform is that of samples, at frequencies of both signs."""
    x, weights = gauss_legendre(2 * NODES)
    t, w = end * x, end * weights
    p = _samples(expressions, t)
    Omega = np.linspace(-0.4 * FINEST, 0.5 * FINEST, 9) / end
    sampled = np.asarray(fourier_kernel(Omega[:, None, None], t[:, None])) @ (w * p)
    run = _on_host(found.expression, (found.Omega, found.end, *expressions.symbols))
    off = np.max(np.abs(run(Omega, end, *map(float, expressions.values)) - sampled))
    return bool(
        off <= TRUSTED * float(jnp.finfo(jnp.result_type(float)).eps) * np.sum(w * np.abs(p))
    )


def _end(expressions: Expressions, axis: str) -> float:
    """Where the lobe has died out."""
    if not is_concrete(expressions.values):
        raise ValueError("Argument `half_width` must be given where parameters are not numbers.")
    far, tiny = FARTHEST, float(jnp.finfo(jnp.result_type(float)).tiny)
    while True:
        t = np.linspace(0.0, far, STEPS + 1)
        t = t[t < 0.5 * np.pi] if axis in ("theta", "phi") else t
        alive = _last_alive(expressions, t)
        if alive + 1 >= t.size:
            break
        far = float(t[alive + 1])
        if alive >= FEWEST or far <= STEPS * tiny:
            return far
    if far < FARTHEST:
        return far  # alive in smaller steps to where the larger ones saw it dead
    if axis in ("theta", "phi"):
        return 0.5 * np.pi
    raise ValueError(f"Argument `half_width` must be given: the lobe lives on at {FARTHEST:g}.")


def _last_alive(expressions: Expressions, t: np.ndarray) -> int:
    """Number of the last place at which a lobe has not died out, on either side."""
    run = jax.vmap(lambda t: expressions(t[None])[0])
    size = np.maximum(np.abs(run(jnp.asarray(t))), np.abs(run(jnp.asarray(-t))))
    if not np.all(np.isfinite(size)):
        where = t[~np.isfinite(size)][0]
        raise ValueError(
            f"Argument `profile` must be a finite number wherever the lobe is, but is none at "
            f"{where:.3g} or {-where:.3g}: give `half_width`, where it ends."
        )
    alive = np.flatnonzero(~(size <= DEAD * np.max(size)))
    if not alive.size:
        raise ValueError("Argument `profile` must not be zero, but is, wherever it is looked at.")
    return int(alive[-1])
