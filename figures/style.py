"""What a figure's script hands back: a picture, the arrays behind it, and its claims.

A figure is a module `figures/<name>.py` whose docstring opens with what is shown and the
parameters that were chosen where the paper leaves them open. It defines `draw(quick) -> Drawing`.
It draws with `firstorder.plotting`, whose house style is switched on around `draw`. Modules whose
name begins with an underscore are shared by several figures and are none themselves.
"""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
from matplotlib.figure import Figure

Quantity = float | str | None


@dataclasses.dataclass(frozen=True)
class Claim:
    """Something that the paper says, beside what we measure.

    Attributes:
        claim: one line, the same at every size (numbers that depend on a run are `measured`).
        paper: the paper's value, or its words, or None where it gives none.
        measured: ours.
        unit: of both.
        holds: whether it is so; None where there is nothing to decide.
    """

    claim: str
    paper: Quantity
    measured: Quantity
    unit: str = ""
    holds: bool | None = None

    def as_json(self) -> dict[str, Any]:
        """Plain values; numbers stay numbers."""
        return {
            "claim": self.claim,
            "paper": _plain(self.paper),
            "measured": _plain(self.measured),
            "unit": self.unit,
            "holds": None if self.holds is None else bool(self.holds),
        }


@dataclasses.dataclass(frozen=True)
class Drawing:
    """A figure, ready to be written.

    Attributes:
        figure: the picture (see `firstorder.plotting.panels`; it need not be pyplot's).
        arrays: what is shown, by name; written as NPZ.
        claims: what the paper says, beside what we measure.
        curves: sets of columns of equal length, by name; each is also written as CSV.
        size: what decides accuracy and cost, in words: "96 x 97 samples, 64 nodes".
        seed: of the random numbers, if there are any.
    """

    figure: Figure
    arrays: dict[str, Any]
    claims: list[Claim]
    curves: dict[str, dict[str, Any]] = dataclasses.field(default_factory=dict)
    size: str = ""
    seed: int | None = None


def _plain(quantity: Any) -> Quantity:
    """A number that JSON can hold; NumPy's and JAX's scalars are neither `int` nor `float`."""
    if quantity is None or isinstance(quantity, str):
        return quantity
    value = np.asarray(quantity)
    if value.ndim:
        raise ValueError(f"A claim's value must be one number, but has shape {value.shape}.")
    if not np.isfinite(value):
        raise ValueError(f"A claim's value must be finite, but is {value}.")
    return float(value)
