"""Changes that leave irradiance as it is, of scenes of either world."""

from __future__ import annotations

from typing import Any, TypeVar

import numpy as np

S = TypeVar("S", bound=Any)  # scenes by the batch: `flatland.layout.Flat` or `space.layout.Space`
Rng = np.random.Generator


def copied(s: S) -> S:
    """The same numbers in arrays of their own, in double precision."""
    return type(s)(*(np.array(a, float) for a in s))


def shift(s: S, rng: Rng) -> S:
    """By up to ten times its size."""
    s = copied(s)
    d = s.places[0].shape[-1]
    step = rng.uniform(-10.0, 10.0, (len(s.at), d)) * s.size[:, None]
    for places in s.places:
        places += step.reshape(len(step), *(1,) * (places.ndim - 2), d)
    return s


def _in_unit(s: S, unit: float) -> S:
    s = copied(s)
    for lengths in s.lengths:
        lengths *= unit
    return s


def power_of_two(s: S, rng: Rng) -> S:
    """In another unit of length, without rounding."""
    return _in_unit(s, 2.0 ** rng.integers(-20, 21))


def power_of_ten(s: S, rng: Rng) -> S:
    """In another unit of length."""
    return _in_unit(s, 10.0 ** rng.integers(-6, 7))
