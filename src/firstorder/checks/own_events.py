"""`check`: all squares of anybody's event, with faults that are made for it.

The squares are those of the library's own events: the event's rules against autodiff, transforms
and brute force. The light is one off-centre, correlated bell; grid, frequencies and rays are found
from the light after the event. A check that nobody has seen fail is no check, so the event and its
rules are then broken on purpose, and each break must be seen.
"""

from __future__ import annotations

import dataclasses
import itertools
import time
from collections.abc import Callable, Iterator
from typing import Any

import jax.numpy as jnp
import numpy as np
import sympy
from scipy import integrate

from firstorder.checks.faults import twin
from firstorder.checks.squares import (
    PORTRAITS,
    Case,
    Square,
    Step,
    _converted_once,
    goes_red,
    square,
)
from firstorder.conventions import Frame
from firstorder.fields import Gaussian, Grid, covariance_of_samples, gaussian
from firstorder.fields.field import Field
from firstorder.fields.spectrum import Spectrum
from firstorder.laws import Move, Warp
from firstorder.symbolic import ExpressionLobe, FactorEvent, RayEvent
from firstorder.symbolic._laws import fitting_frame, laws_of
from firstorder.transport import Chain, Event, Reflection

CENTER, SIGMA, TILT = np.array([0.2, -0.1]), np.array([0.4, 0.25]), 0.35
SAMPLES, RAYS = 385, 12
SMALL = "off by 0.1 %"
# What is left of a bell where it counts as dark.
DARK = 1e-13
BOXES = 40  # in which it is looked for
# Share of a bell's height by which neighbours may differ: it is then two steps wide, and 3e-9 of it
# is left at the highest frequencies.
JUMP = 0.3
UNITS = "choose units in which the event stretches and shears less"
TOO_FINE = f"{SAMPLES} samples along each axis do not tell this light: {UNITS}"


@dataclasses.dataclass(frozen=True)
class FaultVerdict:
    """A fault that was made, and whether the square saw it.

    Example:
        >>> from firstorder.checks import FaultVerdict
        >>> FaultVerdict("a sign", "spectrum", killed=True).killed
        True
    """

    name: str
    portrait: str
    killed: bool


@dataclasses.dataclass(frozen=True)
class Report:
    """Squares and faults of an event, as `check` found them.

    Attributes:
        name: of the event.
        squares: one for each portrait.
        faults: made and judged, for each portrait that has a rule.
        seconds: that it took.
    """

    name: str
    squares: tuple[Square, ...]
    faults: tuple[FaultVerdict, ...]
    seconds: float

    @property
    def sound(self) -> bool:
        """Whether every square holds or refuses, and every fault was seen."""
        held = all(s.verdict != "unequal" for s in self.squares)
        return held and all(f.killed for f in self.faults)

    def __str__(self) -> str:
        """One line for each portrait."""
        lines = [f"{self.name}: {'sound' if self.sound else 'NOT SOUND'}, {self.seconds:.1f} s"]
        for s in self.squares:
            mine = [f for f in self.faults if f.portrait == s.portrait]
            killed = f"{sum(f.killed for f in mine)} of {len(mine)} faults seen" if mine else ""
            error = s.reason if s.error is None else f"{s.error:.1e}"
            lines.append(f"  {s.portrait:11}{s.verdict:10}{error:10}{killed}")
        lines += [f"  not seen: {f.name}, {f.portrait}" for f in self.faults if not f.killed]
        return "\n".join(lines)


def check(event: Event | Chain, frame: Frame | None = None, name: str = "") -> Report:
    """All squares of an event, and whether they see it when it is wrong.

    Values are compared with NumPy's and SciPy's of the expression, where the event is one. Spectrum
    and covariance are refused where samples do not tell the light after the event.

    Args:
        event: of `firstorder.symbolic.event`, a `Reflection` by `lobe`, or any other.
        frame: of the light in flatland; left out, the first of angles and slopes, incoming and
            outgoing, and of (x, t), that the event takes.
        name: what the report calls it.

    Returns:
        The report; `print` shows it as a table.

    Raises:
        TypeError: if it is no event, as a plain function is none.
        ValueError: if the event takes no light of flatland, or leaves none that is found.

    Example:
        >>> import sympy
        >>> from firstorder.checks import check
        >>> from firstorder.symbolic import event
        >>> x, theta, f = sympy.symbols("x theta f")
        >>> check(event({theta: theta - x / f}, parameters={f: 0.5}, name="lens")).sound
        True
    """
    _check_event(event)
    begin = time.perf_counter()
    case = _case_of(event, frame, name)
    known = isinstance(event, (RayEvent, FactorEvent)) or _lobe(event) is not None
    portraits = [p for p in PORTRAITS if p != "wavelet" and (known or p != "value")]
    squares = tuple(_judged(case, p) for p in portraits)
    faults = tuple(
        FaultVerdict(label, s.portrait, goes_red(case, s.portrait, wrong))
        for s in squares
        if s.verdict in ("equal", "approximate")
        for label, wrong in _faults(event, s.portrait)
        if s.verdict == "equal" or label != SMALL  # an approximation cannot see it
    )
    return Report(case.name, squares, faults, time.perf_counter() - begin)


def _check_event(event: Any) -> None:
    """Refuse what is no event, in one sentence."""
    if not isinstance(event, (Event, Chain)):
        raise TypeError(
            f"Argument `event` must be an event, but is a {type(event).__name__}: `symbolic.event` "
            "makes one of an expression, `Reflection` of a lobe."
        )


# --- the case ------------------------------------------------------------------------------------


def _case_of(event: Event | Chain, frame: Frame | None = None, name: str = "") -> Case:
    """Light, grid, frequencies and rays for an event."""
    events = event.events if isinstance(event, Chain) else (event,)
    light = gaussian(CENTER, SIGMA, TILT, frame=frame or fitting_frame(events))
    result = event(light)
    laws = laws_of(events, light.frame)
    low, high = _box(result, not any(isinstance(law, Warp) for law in laws))
    moves = all(isinstance(law, (Move, Warp)) for law in laws)
    half, middle = (0.5 * (high - low)).tolist(), (0.5 * (high + low)).tolist()
    grid = Grid.spanning((SAMPLES, SAMPLES), tuple(half), tuple(middle))
    samples = np.nan_to_num(np.asarray(grid.sample(result)))
    width = np.sqrt(np.diag(covariance_of_samples(samples, grid, result.frame).matrix))
    rng = np.random.default_rng(0)
    bright = grid.points()[samples > 0.02 * np.max(samples)]
    rays = bright[rng.integers(0, len(bright), RAYS)]
    return Case(
        name=name or getattr(event, "name", type(event).__name__),
        step=event,
        field=light,
        grid=grid,
        frequencies=tuple(np.linspace(-2.0, 1.5, 6) * w for w in width),
        rays=rays + 0.1 * np.array(grid.step) * rng.uniform(-1.0, 1.0, rays.shape),
        brute=_brute(event, light),
        # Products and convolutions have a covariance rule that is exact for bells alone.
        bounds={} if moves else {"covariance": 0.05},
        expected={} if moves else {"covariance": "approximate"},
    )


def _box(result: Field, grows: bool) -> tuple[np.ndarray, np.ndarray]:
    """Ends of the box beyond which the light after the event is dark.

    It starts as wide as the light before is many times over, is cut to the light, and is doubled
    along an axis at whose ends there is light. Where light may have no end (past a warp such as a
    tangent) it is not.
    """
    low, high = np.full(2, -16.0), np.full(2, 16.0)
    for turn in range(BOXES):
        grid, bright = _where_bright(result, low, high)
        ends = [np.any(np.take(bright, [0, -1], axis)) for axis in range(2)]
        wider = grows & (np.array(ends) | ~bright.any())
        places, margin = np.asarray(grid.points())[bright], 2.0 * np.array(grid.step)
        cut = places.min(0, initial=np.inf) - margin, places.max(0, initial=-np.inf) + margin
        low, high = (np.where(wider, 2.0 * a, b) for a, b in zip((low, high), cut, strict=True))
        if turn >= 2 and not wider.any():
            break
    else:
        raise ValueError(f"Argument `event` must leave light whose ends are found: {UNITS}.")
    return low, high


def _where_bright(result: Field, low: np.ndarray, high: np.ndarray) -> tuple[Grid, np.ndarray]:
    """A grid about the origin that holds a box, and where on it light is not dark."""
    half = 1.05 * np.maximum(np.abs(low), np.abs(high))
    grid = Grid.spanning((257, 257), (float(half[0]), float(half[1])))
    size = np.abs(np.nan_to_num(np.asarray(grid.sample(result))))
    return grid, size > DARK * np.max(size)


def _judged(case: Case, portrait: str) -> Square:
    """A square; one of samples that do not tell the light between them is none."""
    found = square(case, portrait)
    if found.verdict != "unequal" or portrait not in ("spectrum", "covariance"):
        return found
    samples = _converted_once(case, "samples")
    jumps = [np.max(np.abs(np.diff(samples, axis=axis))) for axis in range(2)]
    if max(jumps) <= JUMP * np.max(np.abs(samples)):
        return found
    return Square(case.name, portrait, "refused", None, TOO_FINE)


def _brute(event: Event | Chain, light: Gaussian) -> Callable:
    """Radiance after the event, by NumPy and SciPy from the expressions alone."""
    P = np.asarray(light.precision)
    names = [sympy.Symbol(n, real=True) for n in light.frame.coordinates]

    def bell(u):
        h = np.asarray(u, float) - CENTER
        return float(np.exp(-0.5 * h @ P @ h))

    def function(expression, numbers, symbols):
        given = {sympy.Symbol(k, real=True): float(v) for k, v in numbers.items()}
        return sympy.lambdify(symbols, expression.xreplace(given), "numpy")

    if isinstance(event, RayEvent):
        given = dict(event.source)
        parts = [function(given.get(s.name, s), event.parameters, names) for s in names]
        return lambda u: bell([f(*u) for f in parts])
    if isinstance(event, FactorEvent):
        factor = function(event.factor, event.parameters, names)
        return lambda u: bell(u) * float(factor(*u))
    lobe = _lobe(event)
    if lobe is None:
        return lambda u: np.nan
    terms = lobe.expressions
    numbers = {s.name: v for s, v in zip(terms.symbols, terms.values, strict=True)}
    profile = function(lobe.profile, numbers, list(terms.coordinates))
    end = float(lobe.half_width())
    a = light.frame.axis(lobe.axis)

    def reflected(u):
        def product(t):
            source = np.array(u, float)
            source[a] -= t
            return bell(source) * float(profile(t))

        pieces = np.linspace(-end, end, 9)
        ends = itertools.pairwise(pieces)
        return sum(integrate.quad(product, *pair, epsabs=0, epsrel=1e-12)[0] for pair in ends)

    return reflected


def _lobe(event: Event | Chain) -> ExpressionLobe | None:
    """The lobe of a reflection, if it is made of an expression."""
    lobe = event.lobe if isinstance(event, Reflection) else None
    return lobe if isinstance(lobe, ExpressionLobe) else None


# --- faults --------------------------------------------------------------------------------------


def _faults(event: Event | Chain, portrait: str) -> Iterator[tuple[str, Step]]:
    """Wrong twins of an event for a portrait: wrong expressions, and wrong rules."""
    if portrait == "value":
        yield from _wrong_expressions(event)
    for label, rules in RULES.get(portrait, {}).items():
        yield label, _with_rules(event, rules)


def _wrong_expressions(event: Event | Chain) -> Iterator[tuple[str, Step]]:
    """The event with a term's sign turned, or a term doubled."""
    if isinstance(event, RayEvent):
        for coordinate, expression in event.source:
            for label, wrong in _mutated(expression):
                source = {**dict(event.source), coordinate: wrong}
                yield f"{coordinate}: {label}", RayEvent(source, event.parameters, event.name)
    elif isinstance(event, FactorEvent):
        for label, wrong in _mutated(event.factor):
            yield label, FactorEvent(wrong, event.parameters, event.window, event.name)
    elif (lobe := _lobe(event)) is not None:
        for label, wrong in _mutated(lobe.profile):
            terms = dataclasses.replace(lobe.expressions, entries=(wrong,))
            other = dataclasses.replace(lobe, expressions=terms)
            yield label, dataclasses.replace(event, lobe=other)


def _mutated(expression: sympy.Expr) -> Iterator[tuple[str, sympy.Expr]]:
    """An expression with one term changed."""
    terms = sympy.Add.make_args(sympy.expand_mul(expression))
    for term in terms:
        rest = sympy.Add(*(t for t in terms if t is not term))
        yield f"sign of {term}", rest - term
        yield f"twice {term}", rest + 2 * term


def _with_rules(event: Event | Chain, rules: dict[str, Callable]) -> Any:
    """A copy of an event with other rules in its (last) law."""
    if isinstance(event, Chain):
        return Chain((*event.events[:-1], _with_rules(event.events[-1], rules)))

    right: Any = type(event).law
    return twin(event, law=lambda self, frame: twin(right(self, frame), **rules))


def _jet(change: Callable) -> dict[str, Callable]:
    """Rules by which a law's jets go through a change."""

    def jet(self, f, u):
        return change(type(self).__mro__[1].jet(self, f, u))

    return {"jet": jet}


def _changed(jet, **parts):
    return dataclasses.replace(jet, **{k: change(getattr(jet, k)) for k, change in parts.items()})


def _spectrum(change: Callable) -> dict[str, Callable]:
    def spectrum(self, F: Spectrum, Omega):
        right = type(self).__mro__[1].spectrum
        return change(lambda w: right(self, F, w), Omega)

    return {"spectrum": spectrum}


def _covariance(change: Callable) -> dict[str, Callable]:
    def covariance(self, S):
        found = type(self).__mro__[1].covariance(self, S)
        return dataclasses.replace(found, matrix=change(found.matrix))

    return {"covariance": covariance}


RULES: dict[str, dict[str, dict[str, Callable]]] = {
    "gradient": {
        "coordinates exchanged": _jet(lambda j: _changed(j, gradient=lambda g: g[::-1])),
        "one sign turned": _jet(lambda j: _changed(j, gradient=lambda g: g.at[0].multiply(-1.0))),
        SMALL: _jet(lambda j: _changed(j, gradient=lambda g: 1.001 * g)),
    },
    "hessian": {
        "coordinates exchanged": _jet(lambda j: _changed(j, hessian=lambda H: H[::-1, ::-1])),
        "no mixed part": _jet(lambda j: _changed(j, hessian=lambda H: jnp.diag(jnp.diag(H)))),
        SMALL: _jet(lambda j: _changed(j, hessian=lambda H: 1.001 * H)),
    },
    "spectrum": {
        "frequencies turned": _spectrum(lambda F, w: F(-w)),
        "frequencies exchanged": _spectrum(lambda F, w: F(w[::-1])),
        SMALL: _spectrum(lambda F, w: 1.001 * F(w)),
    },
    "covariance": {
        "coordinates exchanged": _covariance(lambda M: M[::-1, ::-1]),
        "mixed part turned": _covariance(lambda M: 2.0 * jnp.diag(jnp.diag(M)) - M),
        SMALL: _covariance(lambda M: 1.001 * M),
    },
}
