"""Squares: apply, then convert, must equal convert, then apply.

Each (law or event) x (portrait) is one square. Along one way the step acts on the radiance and
the portrait is drawn afterwards by a *converter* that knows nothing of the step: autodiff for
jets, a discrete transform of samples for spectra and covariances, a Haar transform of samples
for wavelets. Along the other way the step's own rule acts on the portrait of the source.
"""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Callable
from typing import Any, Literal

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from firstorder.checks.tolerance import normwise
from firstorder.errors import Refused
from firstorder.fields import (
    Field,
    Grid,
    Wavelet,
    autodiff_jet,
    covariance_of_samples,
    discrete_transform,
)
from firstorder.laws import Law
from firstorder.numerics._batching import batched
from firstorder.transport import Chain, Event

Step = Law | Event | Chain
PORTRAITS = ("value", "gradient", "hessian", "spectrum", "covariance", "wavelet")


@dataclasses.dataclass(frozen=True)
class Case:
    """A step, the light it acts on, and where the portraits are compared.

    Attributes:
        name: what the step is called in tables ("move", "travel", ...).
        step: the law or event.
        field: off-centre, correlated light.
        grid: samples of the *result*: wide and fine enough for its spectrum.
        frequencies: one array per coordinate of the result.
        rays: rays at which jets are compared, an array with one in each row.
        wavelet_grid: grid with sizes 2^k for the *operand*, or None if the step has no rule.
        brute: the result by brute force: a callable of a ray that shares no code with the step.
        bounds: largest accepted error per portrait, where it is not the default: the stated grid
            error, or the measured error of an approximation.
        expected: verdict per portrait, where it is not "equal".

    Raises:
        ValueError: without a ray or a frequency, where every step would be right.

    Example:
        >>> from firstorder.checks import all_cases
        >>> from firstorder.checks import Case
        >>> isinstance(all_cases()["travel"], Case)
        True
    """

    name: str
    step: Step
    field: Field
    grid: Grid
    frequencies: tuple[np.ndarray, ...]
    rays: np.ndarray
    brute: Callable
    wavelet_grid: Grid | None = None
    bounds: dict[str, float] = dataclasses.field(default_factory=dict)
    expected: dict[str, str] = dataclasses.field(default_factory=dict)

    def __post_init__(self):
        """Refuse squares that compare nothing."""
        for name, numbers in (("rays", [self.rays]), ("frequencies", self.frequencies)):
            if any(np.size(a) == 0 for a in numbers):
                raise ValueError(f"Argument `{name}` must not be empty, but is.")

    def bound(self, portrait: str) -> float:
        """Largest error that counts as equal."""
        return self.bounds.get(portrait, DEFAULT_BOUNDS[portrait])


# Float64: jets 1e-10 normwise; spectra and covariances 1e-9 on Gaussian fields.
DEFAULT_BOUNDS = {
    "value": 1e-10,
    "gradient": 1e-10,
    "hessian": 1e-10,
    "spectrum": 1e-9,
    "covariance": 1e-9,
    "wavelet": 1e-10,
}


@dataclasses.dataclass(frozen=True)
class Square:
    """Outcome of one square: verdict, error, and the reason of a refusal.

    Example:
        >>> from firstorder.checks import Square
        >>> Square("travel", "wavelet", "refused", None, "it shears the grid").verdict
        'refused'
    """

    name: str
    portrait: str
    verdict: Literal["equal", "approximate", "refused", "unequal"]
    error: float | None
    reason: str = ""


def by_conversion(case: Case, portrait: str):
    """The portrait of the result, drawn from its radiance alone: the way round by conversion.

    Args:
        case: the step, and the light it acts on.
        portrait: one of `PORTRAITS`.

    Example:
        >>> from firstorder.checks import all_cases
        >>> from firstorder.checks import by_conversion
        >>> by_conversion(all_cases()["mirror"], "value").ndim  # one number for each ray
        1
    """
    result = case.step(case.field)
    rays = jnp.asarray(case.rays)
    if portrait == "value":
        return np.array([case.brute(ray) for ray in case.rays])
    if portrait == "jets":
        return jax.jit(jax.vmap(lambda u: autodiff_jet(result.at, u, result.frame)))(rays)
    if portrait in ("gradient", "hessian"):
        return getattr(_converted_once(case, "jets"), portrait)
    if portrait == "wavelet":
        return _wavelets(result, _result_grid(case)).coefficients
    if portrait == "samples":
        return _in_blocks(result.at, case.grid)
    samples = jnp.asarray(_converted_once(case, "samples"))
    if portrait == "spectrum":
        return discrete_transform(samples, case.grid, *case.frequencies)
    return covariance_of_samples(samples, case.grid, result.frame).matrix


def _in_blocks(at: Callable, grid: Grid):
    """Samples on a grid, in blocks that fit into memory in four dimensions too."""
    points = np.reshape(grid.points(), (-1, len(grid.size)))
    sample = jax.jit(lambda u: jax.lax.map(at, u, batch_size=min(len(points), 16384)))
    return np.reshape(sample(points), grid.size)


class _Itself:
    """A case or step as the key of what is remembered of it: no other is equal, and it lives on."""

    def __init__(self, thing: Any):
        self.thing = thing

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _Itself) and other.thing is self.thing

    def __hash__(self) -> int:
        return id(self.thing)


# Caches of `functools`, which `ledger.attacks` knows how to make forget.
@functools.cache
def _converted(case: _Itself, portrait: str):
    return jax.tree.map(np.asarray, by_conversion(case.thing, portrait))


def _converted_once(case: Case, portrait: str):
    """`by_conversion`, remembered: every fault of a cell is compared with the same truth."""
    return _converted(_Itself(case), portrait)


@functools.lru_cache(maxsize=1)
def _ruled(case: _Itself, step: _Itself):
    return _jets(step.thing(case.thing.field), jnp.asarray(case.thing.rays))


def _ruled_once(case: Case, step: Step):
    """Jets by the rule of a step, remembered until the next step: gradient and Hessian are both."""
    return _ruled(_Itself(case), _Itself(step))


# Compiled once for all steps that differ in numbers alone, as many faults do.


@eqx.filter_jit
def _values(field, rays):
    return jax.vmap(field.at)(rays)


@eqx.filter_jit
def _wavelets(field, grid):
    return Wavelet.of(field, grid)


@eqx.filter_jit
def _jets(field, rays):
    return batched(field.jet)(rays)


@eqx.filter_jit
def _spectra(spectrum, *frequencies):
    return spectrum(*frequencies)


def by_rule(case: Case, portrait: str, step: Step | None = None):
    """The portrait of the result by the step's own rule, from the portrait of the source.

    Args:
        case: the step, and the light it acts on.
        portrait: one of `PORTRAITS`.
        step: in place of the case's own.

    Example:
        >>> from firstorder.checks import all_cases
        >>> from firstorder.checks import by_rule
        >>> by_rule(all_cases()["mirror"], "value").ndim  # one number for each ray
        1
    """
    step = case.step if step is None else step
    if portrait == "value":
        return _values(step(case.field), jnp.asarray(case.rays))
    if portrait in ("gradient", "hessian"):
        return getattr(_ruled_once(case, step), portrait)
    if portrait == "wavelet":
        grid = case.wavelet_grid or Grid.spanning(
            (8,) * case.field.frame.dims, (3.0,) * case.field.frame.dims
        )
        return step(_wavelets(case.field, grid)).coefficients
    if portrait == "spectrum":
        spectrum = step(case.field.spectrum())
        mesh = np.meshgrid(*case.frequencies, indexing="ij")
        return _spectra(spectrum, *mesh)
    return step(case.field.covariance()).matrix


def _result_grid(case: Case) -> Grid:
    """Grid of the result's wavelets: the rule knows which axes are left."""
    grid = case.wavelet_grid
    assert grid is not None
    return case.step(_wavelets(case.field, grid)).grid


def square(case: Case, portrait: str) -> Square:
    """Walk one square and judge it.

    An error within the bound is *equal*, unless the case declares the cell an approximation;
    then it is *approximate* with its measured error. Outside the bound it is *unequal*.

    Args:
        case: the step, and the light it acts on.
        portrait: one of `PORTRAITS`.

    Raises:
        ValueError: if the rule gives numbers of another shape.

    Example:
        >>> from firstorder.checks import all_cases
        >>> from firstorder.checks import square
        >>> square(all_cases()["mirror"], "value").verdict
        'equal'
    """
    try:
        rule = by_rule(case, portrait)
    except Refused as refusal:
        return Square(case.name, portrait, "refused", None, refusal.reason)
    error = normwise(rule, _converted_once(case, portrait))
    if error > case.bound(portrait):
        return Square(case.name, portrait, "unequal", error)
    verdict = "approximate" if case.expected.get(portrait) == "approximate" else "equal"
    return Square(case.name, portrait, verdict, error)


def goes_red(case: Case, portrait: str, wrong: Step) -> bool:
    """Whether the square goes red for a wrong twin of the step (see `faults`).

    A twin must give wrong numbers: one that raises has not tested the check, so it raises here too.

    Args:
        case: the step, and the light it acts on.
        portrait: one of `PORTRAITS`.
        wrong: a wrong twin of the step.

    Raises:
        ValueError: if the twin gives NaN, infinity or another shape.

    Example:
        >>> from firstorder.checks import twin_law
        >>> from firstorder.checks import all_cases
        >>> from firstorder.checks import goes_red
        >>> from firstorder.laws import Move
        >>> case = all_cases()["mirror"]
        >>> goes_red(case, "value", twin_law(case.step, lambda law: Move(1.1 * law.M)))
        True
    """
    numbers = np.asarray(by_rule(case, portrait, wrong))
    if not np.all(np.isfinite(numbers)):
        raise ValueError("Argument `wrong` must give numbers, but gives NaN or infinity.")
    return normwise(numbers, _converted_once(case, portrait)) > case.bound(portrait)
