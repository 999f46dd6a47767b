"""Events from expressions: a map of rays, a factor, or both, in one line."""

from __future__ import annotations

import itertools
from collections.abc import Mapping
from typing import Any

import equinox as eqx
import jax.numpy as jnp
import numpy as np
import sympy

from firstorder._argument_checks import is_concrete
from firstorder.conventions import ANGLES, POSITIONS, SLOPES, TIMES, Frame
from firstorder.fields.spectrum import Grid
from firstorder.laws.base import Law
from firstorder.laws.move import Move
from firstorder.laws.multiply import Multiply
from firstorder.laws.warp import Warp
from firstorder.symbolic._jumps import check_one_number, check_real_expression
from firstorder.symbolic._programs.exact import Expr
from firstorder.symbolic._programs.numeric import (
    ExpressionField,
    ExpressionMap,
    Expressions,
    Symbols,
    compiled_expressions,
    free_of,
)
from firstorder.transport.event import Chain, Event, require_frame
from firstorder.typing import Array, as_float

COORDINATES = (*POSITIONS, *ANGLES, *SLOPES, *TIMES)
# Where a map is looked at: rays about the central one, in the units of the coordinates.
PROBES = np.linspace(-0.9, 0.9, 13)


def event(
    rays: Mapping[Any, Any] | None = None,
    *,
    source: Mapping[Any, Any] | None = None,
    factor: Any = None,
    parameters: Mapping[Any, Any] | None = None,
    window: Grid | None = None,
    name: str = "event",
) -> Event | Chain:
    """An event from expressions: where rays go, and what they are multiplied by.

    A map of rays says where a ray of the light before is found after the event; its inverse is
    taken, for the light after it at a ray is the light before it at the ray's source:
    `h(u) = factor(u) f(source(u))`. An affine map is a `Move` and has every portrait; any other
    is a `Warp` with its derivatives in closed form, and refuses spectra until it is linearised.
    A factor alone is a `Multiply`.

    Args:
        rays: a new expression for each coordinate that changes, in the old ones.
        source: instead of `rays`, the source of each ray, where the inverse has no closed form.
        factor: an expression in the coordinates after the event.
        parameters: symbols and their numbers, which are differentiable leaves; numbers may be
            symbols again, for `derive`.
        window: box for the factor's spectrum (see `Multiply`).
        name: what errors call it.

    Returns:
        The event; a chain of two where both a map and a factor are given.

    Raises:
        ValueError: if a symbol has no number, an expression is complex, or the map has no inverse
            near the central ray: then it says where it folds.

    Example:
        >>> import sympy
        >>> from firstorder.fields import gaussian
        >>> from firstorder.symbolic import event
        >>> x, theta, f = sympy.symbols("x theta f")
        >>> lens = event({theta: theta - x / f}, parameters={f: 0.5})
        >>> lens(gaussian((0.0, 0.0), (1.0, 1.0)))(1.0, -2.0).item()  # a parallel ray, bent
        0.6065306597126334
    """
    for what, given in (("rays", rays), ("source", source)):
        for expression in (given or {}).values():
            check_real_expression(what, sympy.sympify(expression))
    if factor is not None:
        check_real_expression("factor", sympy.sympify(factor))
    rays, source = rays or None, source or None  # a map of nothing is none
    if rays is not None and source is not None:
        raise ValueError("Arguments `rays` and `source` say the same: give one of them.")
    numbers = _parameters(parameters)
    parts: list[Event] = []
    if rays is not None:
        parts.append(RayEvent(_inverse(_named(rays), numbers, name), numbers, name))
    if source is not None:
        parts.append(RayEvent(_named(source), numbers, name))
    if factor is not None:
        parts.append(FactorEvent(_real(factor), numbers, window, name))
    if not parts:
        raise ValueError("Arguments `rays`, `source` and `factor` are all left out: give one.")
    return parts[0] if len(parts) == 1 else Chain(tuple(parts))


class RayEvent(Event):
    """Light relabelled by an expression for the source of each ray; `event` makes it.

    Attributes:
        source: the source's coordinates that change, by name.
        parameters: numbers by name.
        name: what errors call it.
    """

    source: tuple[tuple[str, Expr], ...] = eqx.field(static=True)
    parameters: dict[str, Array]
    name: str = eqx.field(static=True)

    def __init__(self, source: dict[str, Expr], parameters: dict[str, Any], name: str):
        """Store the expressions."""
        self.source, self.name = tuple(sorted(source.items())), name
        self.parameters = {k: as_float(v) for k, v in parameters.items()}

    def law(self, frame: Frame) -> Law:
        """A move if the map is affine, else a warp."""
        given = dict(self.source)
        fits = set(given) <= set(frame.coordinates)
        require_frame(fits, self, frame, f"the coordinates {', '.join(sorted(given))}")
        coordinates = tuple(_symbol(c) for c in frame.coordinates)
        entries = tuple(given.get(c.name, c) for c in coordinates)
        map_ = ExpressionMap(_with(entries, coordinates, self.parameters, self.name))
        slopes = tuple(sympy.diff(e, c) for e in entries for c in coordinates)
        if set(coordinates) & set().union(*(s.free_symbols for s in slopes)):
            return Warp(map_)
        zero = jnp.zeros(frame.dims)
        shift, M, _ = map_.expressions.derivatives(zero)
        return Move(M, jnp.stack(shift))


class FactorEvent(Event):
    """Light multiplied by an expression; `event` makes it.

    Attributes:
        factor: the expression.
        parameters: numbers by name.
        window: box for the spectrum.
        name: what errors call it.
    """

    factor: Expr = eqx.field(static=True)
    parameters: dict[str, Array]
    window: Grid | None
    name: str = eqx.field(static=True)

    def __init__(self, factor: Expr, parameters: dict[str, Any], window: Grid | None, name: str):
        """Store the expression."""
        self.factor, self.window, self.name = factor, window, name
        self.parameters = {k: as_float(v) for k, v in parameters.items()}

    def law(self, frame: Frame) -> Law:
        """Multiply."""
        coordinates = tuple(_symbol(c) for c in frame.coordinates)
        field = ExpressionField(
            _with((self.factor,), coordinates, self.parameters, self.name), frame
        )
        return Multiply(field, self.window, self.name)


# --- symbols -------------------------------------------------------------------------------------


def _symbol(name: str) -> sympy.Symbol:
    """A coordinate or a parameter: real, whatever the user's symbol of that name assumes."""
    return sympy.Symbol(name, real=True)


def _real(expression: Any) -> Expr:
    """An expression in real symbols."""
    expression = sympy.sympify(expression)
    return expression.xreplace({s: _symbol(s.name) for s in expression.free_symbols})


def _named(rays: Mapping[Any, Any]) -> dict[str, Expr]:
    """Expressions by the name of their coordinate."""
    return {str(c): _real(e) for c, e in rays.items()}


def _parameters(parameters: Mapping[Any, Any] | None) -> dict[str, Any]:
    """Numbers by name."""
    numbers = {str(s): as_float(value) for s, value in (parameters or {}).items()}
    for name, number in numbers.items():
        check_one_number(f"parameters[{name}]", number)
    return numbers


def _with(entries: tuple, coordinates: Symbols, parameters: dict[str, Array], name: str):
    """Expressions with the numbers of their parameters."""
    for symbol in coordinates:
        if symbol.name in parameters:
            raise ValueError(
                f"Argument `parameters` of {name} gives a number for {symbol.name}, which is a "
                "coordinate of the light that it meets: call the parameter otherwise."
            )
    free = sorted(free_of(entries, coordinates), key=lambda s: s.name)
    for symbol in free:
        if symbol.name not in parameters:
            raise _no_number(symbol, name)
    return Expressions(entries, coordinates, tuple(free), tuple(parameters[s.name] for s in free))


def _no_number(symbol: sympy.Symbol, name: str) -> ValueError:
    return ValueError(
        f"Argument `parameters` of {name} must give a number for {symbol.name}, which is no "
        "coordinate of the light that it meets."
    )


# --- inverse -------------------------------------------------------------------------------------


def _inverse(rays: dict[str, Expr], parameters: dict[str, Any], name: str) -> dict[str, Expr]:
    """The source of each ray, by solving the map for the old coordinates."""
    old = {c: _symbol(c) for c in rays}
    new = {c: sympy.Dummy(c, real=True) for c in rays}
    for symbol in free_of(tuple(rays.values()), tuple(old.values())):
        if symbol.name not in parameters and symbol.name not in COORDINATES:
            raise _no_number(symbol, name)
    _refuse_folds(rays, parameters, name)
    equations = [sympy.Eq(rays[c], new[c]) for c in rays]
    try:
        found = sympy.solve(equations, list(old.values()), dict=True)
    except NotImplementedError:  # SymPy's words for an equation that it cannot solve
        found = []
    back = {new[c]: old[c] for c in rays}
    for solution in found:
        source = {c: solution.get(old[c], old[c]).xreplace(back) for c in rays}
        if _undoes(source, rays, parameters):
            return source
    raise ValueError(
        f"The map of {name} has no inverse in closed form: give `source`, the ray that each ray "
        "comes from, instead of `rays`."
    )


def _refuse_folds(rays: dict[str, Expr], parameters: dict[str, Any], name: str) -> None:
    """Where the Jacobian's determinant changes its sign, two rays go to one."""
    names = list(rays)
    coordinates = [_symbol(c) for c in names]
    J = sympy.Matrix([rays[c] for c in names]).jacobian(coordinates)
    places, values = _probed(J.det(), parameters)
    middle = np.sign(values[len(values) // 2])
    folded = np.flatnonzero((np.sign(values) != middle) | (values == 0.0))
    folded = folded[np.isfinite(values[folded])]
    if not folded.size:
        return
    far = sum((a[folded] ** 2 for a in places.values()), np.zeros(folded.size))
    near = folded[np.argmin(far)]
    where = ", ".join(f"{c} = {a[near]:.2g}" for c, a in places.items()) or "every ray"
    raise ValueError(
        f"The map of {name} folds near {where}, where the determinant of its Jacobian passes "
        "zero: several rays go to one, and none of them is its source."
    )


def _undoes(source: dict[str, Expr], rays: dict[str, Expr], parameters: dict[str, Any]) -> bool:
    """Whether a solution leads back, at the probes where the map itself is a number."""
    forward = {_symbol(c): e for c, e in rays.items()}
    misses = [source[c].xreplace(forward) - _symbol(c) for c in rays]
    off = sum(sympy.Abs(m) for m in misses)
    _, values = _probed(off, parameters)
    known = values[np.isfinite(values)]
    return bool(known.size) and bool(np.median(known) < 1e-6)


def _probed(expression: Expr, parameters: dict[str, Any]) -> tuple[dict[str, Any], np.ndarray]:
    """An expression at rays about the central one: places by name, and values there.

    A parameter whose number is not known here, a symbol or a traced one, is taken for 1.
    """
    symbols = sorted(expression.free_symbols, key=lambda s: s.name)
    free = [s for s in symbols if s.name not in parameters]
    rays = np.array(list(itertools.product(PROBES, repeat=len(free))))
    places = {s.name: rays[:, i] for i, s in enumerate(free)}
    known = {k: float(v) if is_concrete(v) else 1.0 for k, v in parameters.items()}
    run = compiled_expressions((expression,), tuple(symbols))
    given = (places[s.name] if s in free else known[s.name] for s in symbols)
    (values,) = run(*map(jnp.asarray, given))
    return places, np.broadcast_to(np.asarray(values, float), (len(rays),))
