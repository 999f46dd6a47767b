"""Checks of a batch of nasty scenes: finite, within bounds, invariant, right by rays and digits.

A number is right if it lies where the truth of the scene lies, or of one whose numbers differ by a
few roundings: a receiver within rounding of a wall is on either side of it. Where a change that
should change nothing changes the light by more than rounding does, both numbers are judged so.
"""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Callable, Iterator
from typing import Any, NamedTuple

import numpy as np

from firstorder.checks.tolerance import rounding
from tests.fuzz import worlds
from tests.fuzz.flatland import digits
from tests.fuzz.limits import known
from tests.fuzz.worlds import FLATLAND, RAYS, World

OPERATIONS = 100  # that round, one after the other
NEIGHBOURS = 12  # scenes a few roundings away whose truth is asked for
ROUNDINGS = 4.0
LOST = 1e-6  # digits of second derivatives
# Of differences in float64, as shares of the size: in a large one light may break off twice.
STEPS = 1e-5, 1e-6, 1e-7
# Of these something is smaller than the largest step, or runs into another thing within it.
FINE = ("near_", "hardly_", "without_", "sliver", "mixed_", "on_a_", "quarters", "far_off", "lamp_")
# Parallel planes of unlike light run into each other when they are turned ever so little.
FINE += "shining_planes", "all_shine", "planes_far_off", "small_planes"


class Finding(NamedTuple):
    """Something that is wrong with a scene.

    Attributes:
        kind: what was checked.
        row: of the scene in its batch.
        amount: by how much it is wrong.
    """

    kind: str
    row: int
    amount: float


@dataclasses.dataclass(frozen=True)
class Asked:
    """A batch of scenes and what the library says of it.

    Attributes:
        world: of the scenes.
        precision: name of it.
        name: of the class.
        scenes: in double precision, of the very numbers that were asked.
        steps: a direction, of lengths as large as the scene.
        E: irradiance.
        gradient: of it, by all numbers.
        turned: the Hessian times the direction; None in space.
    """

    world: World
    precision: str
    name: str
    scenes: Any
    steps: Any
    E: np.ndarray
    gradient: Any
    turned: Any

    @property
    def eps(self) -> float:
        """Of the precision."""
        return float(np.finfo(self.precision).eps)

    @functools.cached_property
    def condition(self) -> np.ndarray:
        """Light that a relative change of all numbers by one would change, and its derivative."""
        sums = _weighted(self.scenes, self.gradient)
        if self.turned is not None:
            sums = sums + _weighted(self.scenes, self.turned)
        return (1.0 + np.nan_to_num(sums)) * self.world.sharpness(self.scenes)

    @functools.cached_property
    def tolerance(self) -> np.ndarray:
        """What rounding may do to irradiance."""
        return rounding(OPERATIONS, dtype=self.precision) * self.condition

    @functools.cached_property
    def refused(self) -> np.ndarray:
        """Which scenes may be NaN."""
        return self.world.refused(self.scenes, self.eps)

    @functools.cached_property
    def unanswered(self) -> np.ndarray:
        """Which may be wrong."""
        return self.world.unanswered(self.scenes, self.eps)


def drawn(world: World, precision: str, name: str, seed: int, batch: int) -> tuple[Any, Any]:
    """A batch of scenes, and a direction for each in which differences are taken."""
    rng = _random(world, name, seed, batch)
    s = _in(precision, world.drawn(name, rng, world.batch))
    steps = type(s)(*(rng.normal(size=a.shape) for a in s))
    # What is dark stays dark: a wall that shines ever so little would be seen before a lamp.
    steps = steps._replace(on=np.zeros(world.batch), emission=steps.emission * (s.emission > 0.0))
    for a in steps.lengths:
        a *= s.size.reshape(-1, *(1,) * (a.ndim - 1))
    return s, _in(precision, steps)


def asked(world: World, precision: str, name: str, s: Any, steps: Any) -> Asked:
    """What the library says of a batch."""
    with worlds.numbers_of(precision):
        found = worlds.jet(world.name, precision)(_typed(precision, s), _typed(precision, steps))
        E, *rest = (a if a is None else _doubles(a) for a in found)
    return Asked(world, precision, name, s, steps, E, *rest)


def judged(
    world: World, precision: str, name: str, seed: int, batch: int, rows: range
) -> list[Finding]:
    """All that is wrong with a batch of a class.

    Args:
        world: of the scenes.
        precision: in which the library computes.
        name: of the class.
        seed: of the random numbers.
        batch: number of the batch.
        rows: which are also compared with rays and digits, which take long.
    """
    a = asked(world, precision, name, *drawn(world, precision, name, seed, batch))
    found = [*_not_finite(a), *_out_of_bounds(a), *_broken_sums(a)]
    rng = _random(world, name, seed, batch + (1 << 40))
    for change in world.changes:
        found += _not_invariant(a, change, rng)
    if precision == "float64" and not name.startswith(FINE):
        found += _against_differences(a)
    for row in rows:
        found += [*_against_rays(a, row), *_against_digits(a, row)]
    return found


# --- at once -------------------------------------------------------------------------------------


def _not_finite(a: Asked) -> Iterator[Finding]:
    """NaN that nothing explains, and derivatives that are not finite where the value is."""
    if np.any(lost := ~np.isfinite(a.E)):
        yield from _rows("nan", lost & ~a.refused)
    for kind, tree in (("gradient", a.gradient), ("hessian", a.turned)):
        if tree is not None:
            whole = np.all([np.all(np.isfinite(_flat(b)), -1) for b in tree], 0)
            yield from _rows(kind, np.isfinite(a.E) & ~whole)


def _out_of_bounds(a: Asked) -> Iterator[Finding]:
    """Less than nothing, or more than the whole hemisphere full of the brightest light.

    So each thing that shines has a share of the hemisphere between none and all.
    """
    most = a.world.hemisphere * np.max(_flat(a.scenes.emission), -1)
    over = np.maximum(-a.E, a.E - most)
    yield from _rows("bounds", over > a.tolerance, over)
    share = np.where(a.scenes.emission > 0.0, a.gradient.emission, 0.0)
    over = np.max(_flat(np.maximum(-share, share - a.world.hemisphere)), -1)
    yield from _rows("share", over > a.tolerance, over)


def _broken_sums(a: Asked) -> Iterator[Finding]:
    """Gradients of what no shift and no unit changes, and what is linear in the emission.

    sum of dE/dp over all places = 0, sum of p dE/dp over all lengths = 0, and sum of L dE/dL = E.
    """
    s, g, size = a.scenes, a.gradient, a.scenes.size
    shifted = sum(np.sum(b.reshape(len(b), -1, b.shape[-1]), 1) for b in g.places)
    scaled = sum(np.sum(_flat(b * p), -1) for b, p in zip(g.lengths, s.lengths, strict=True))
    linear = np.sum(_flat(g.emission * s.emission), -1) - a.E
    errors = {
        "shifted gradient": size * np.sum(np.abs(shifted), -1),
        "scaled gradient": np.abs(scaled),
        "light of emission": np.abs(linear),
    }
    for kind, error in errors.items():
        yield from _rows(kind, error > a.tolerance, error)


def _not_invariant(a: Asked, change: Callable[..., Any], rng: np.random.Generator):
    """Light that a change changes by more than rounding does."""
    s = _in(a.precision, change(a.scenes, rng))
    with worlds.numbers_of(a.precision):
        E = _doubles(worlds.value(a.world.name, a.precision)(_typed(a.precision, s)))
    apart, kind = np.abs(E - a.E), change.__name__
    # A shift by ten sizes leaves a tenth of the digits of coordinates.
    share = np.maximum(1.0, s.size / a.scenes.size) if kind == "shift" else 1.0
    if not np.any(~(apart <= share * a.tolerance)):
        return
    lost = np.isnan(E) != np.isnan(a.E)
    if np.any(lost):
        lost &= ~a.refused
        yield from _rows(kind, lost & ~_of_some(a.world.refused, s, a.eps, lost), np.inf)
    other = asked(a.world, a.precision, a.name, s, a.steps)
    doubtful = (apart > share * (a.tolerance + other.tolerance)) & ~a.unanswered
    doubtful &= ~_of_some(a.world.unanswered, s, a.eps, doubtful)
    for row in np.flatnonzero(doubtful):
        named = known(a.world.name, a.precision, a.name, kind, apart[row]) is not None
        if named or not (_is_right(a, row, apart[row]) and _is_right(other, row, apart[row])):
            yield Finding(kind, int(row), float(apart[row]))


def _against_differences(a: Asked) -> Iterator[Finding]:
    """Gradients outside of what differences to either side leave open, for steps of every size.

    By how far the difference of half the step is off the other, it may be off the derivative.
    """
    along, outside = _along(a.gradient, a.steps), np.full(len(a.E), np.inf)
    doubtful = np.ones(len(a.E), bool)
    for step in STEPS:
        ends = []
        for h in (-step, step):
            wide, half = ((_moved(a, way) - a.E) / way for way in (h, 0.5 * h))
            ends += [half - 2.0 * np.abs(half - wide), half + 2.0 * np.abs(half - wide)]
        over = np.maximum(np.min(ends, 0) - along, along - np.max(ends, 0))
        doubtful &= np.isfinite(over) & (over > 4.0 * a.tolerance / step)
        outside = np.fmin(outside, over)
        if not np.any(doubtful):
            return
    doubtful &= ~a.unanswered
    yield from _rows("differences", doubtful, outside)


def _moved(a: Asked, h: float) -> np.ndarray:
    """Irradiance a step along the direction."""
    s = type(a.scenes)(*(p + h * d for p, d in zip(a.scenes, a.steps, strict=True)))
    return _doubles(worlds.value(a.world.name, a.precision)(_typed(a.precision, s)))


# --- one by one ----------------------------------------------------------------------------------


def _against_rays(a: Asked, row: int) -> Iterator[Finding]:
    """Light that rays do not see."""
    if np.isnan(a.E[row]) or a.unanswered[row]:
        return
    seen, bound = a.world.by_rays(a.scenes, row, a.eps, RAYS)
    apart = abs(seen - a.E[row])
    if apart > bound + a.tolerance[row] and not _is_right(a, row, float(apart)):
        yield Finding("rays", row, float(apart))


def _against_digits(a: Asked, row: int) -> Iterator[Finding]:
    """Derivatives in flatland against differences of 60 digits; at a kink of either side."""
    if a.world is not FLATLAND or a.precision != "float64" or np.isnan(a.E[row]):
        return
    if a.unanswered[row]:
        return
    given = np.array([_along(a.gradient, a.steps)[row], _along(a.turned, a.steps)[row]])
    slack = np.array([a.tolerance[row], LOST * a.condition[row]])
    low, high = np.full(2, np.inf), np.full(2, -np.inf)
    errors = np.zeros(2)
    for s, k in _neighbours(a, row):
        steps = type(s)(*(d[row - k :] for d in a.steps))
        found = np.array(digits.differences(s, k, steps, a.eps))
        low, high = np.minimum(low, np.min(found, -1)), np.maximum(high, np.max(found, -1))
        if high[0] - low[0] > slack[0]:
            slack[1] = np.inf  # there is no second derivative at a kink
        errors = np.maximum(np.maximum(low - given, given - high), 0.0)
        if np.all(errors <= slack):
            return
    for kind, error, allowed in zip(("first", "second"), errors, slack, strict=True):
        if error > allowed:
            yield Finding(f"{kind} digits", row, float(error))


def _is_right(a: Asked, row: int, apart: float) -> bool:
    """Whether a value is that of the scene, or of one whose numbers are a few roundings away.

    What rays are too coarse to tell counts as wrong.
    """
    low, high = np.inf, -np.inf
    for s, k in _neighbours(a, row):
        E, bound = a.world.truth(s, k, a.eps, apart)
        if bound > apart:
            return False
        low, high = min(low, E - bound), max(high, E + bound)
        if low - a.tolerance[row] <= a.E[row] <= high + a.tolerance[row]:
            return True
    return False


def _neighbours(a: Asked, row: int) -> Iterator[tuple[Any, int]]:
    """A scene, and scenes whose lengths and angles are off by roundings of the largest, by row."""
    yield a.scenes, row
    rng = np.random.default_rng(row)
    for _ in range(NEIGHBOURS):
        s = type(a.scenes)(*(np.array(b[row : row + 1]) for b in a.scenes))
        for b in s.lengths:
            b += ROUNDINGS * a.eps * s.size[0] * rng.uniform(-1.0, 1.0, b.shape)
        for b in s.turns:
            b += ROUNDINGS * a.eps * rng.uniform(-1.0, 1.0, b.shape)
        yield s, 0


# --- arrays --------------------------------------------------------------------------------------


def _random(world: World, name: str, seed: int, batch: int) -> np.random.Generator:
    """Random numbers of a batch of a class."""
    return np.random.default_rng([seed, len(world.name), *name.encode(), batch])


def _of_some(ask: Callable[..., np.ndarray], s: Any, eps: float, which: np.ndarray) -> np.ndarray:
    """What a world says of some scenes of a batch; of the others no."""
    said = np.zeros(len(which), bool)
    if np.any(which):
        said[which] = ask(type(s)(*(b[which] for b in s)), eps)
    return said


def _rows(kind: str, which: np.ndarray, amounts: Any = np.nan) -> Iterator[Finding]:
    amounts = np.broadcast_to(amounts, which.shape)
    return (Finding(kind, int(row), float(amounts[row])) for row in np.flatnonzero(which))


def _flat(a: np.ndarray) -> np.ndarray:
    return a.reshape(len(a), -1)


def _weighted(s: Any, rates: Any) -> np.ndarray:
    """Sum of the magnitudes of rates of change, per size of the scene and per radian."""
    lengths = sum(np.sum(np.abs(_flat(b)), -1) for b in rates.lengths)
    return s.size * lengths + sum(np.sum(np.abs(_flat(b)), -1) for b in rates.turns)


def _along(rates: Any, steps: Any) -> np.ndarray:
    """Rate of change along a direction."""
    each = [np.sum(_flat(b * d), -1) for b, d in zip(rates, steps, strict=True)]
    return np.sum(each, 0)


def _in(precision: str, s: Any) -> Any:
    """The numbers that a precision can hold, as doubles."""
    return type(s)(*(np.asarray(a, precision).astype(float) for a in s))


def _typed(precision: str, s: Any) -> Any:
    return type(s)(*(np.asarray(a, precision) for a in s))


def _doubles(a: Any) -> Any:
    """What a program gives, as arrays of doubles."""
    if isinstance(a, tuple):
        return type(a)(*(np.asarray(b, float) for b in a))
    return np.asarray(a, float)
