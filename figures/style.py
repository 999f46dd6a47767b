"""What a figure's script hands back: a picture, the arrays behind it, and its claims.

A figure is a module `figures/<name>.py` whose docstring opens with what is shown and the
parameters that were chosen where the paper leaves them open. It defines `draw(quick) -> Drawing`.
It draws with `firstorder.plotting`, whose house style is switched on around `draw`. Modules whose
name begins with an underscore are shared by several figures and are none themselves.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from typing import Any

from matplotlib.figure import Figure

from figures.verdicts import Measurement, Statement


@dataclasses.dataclass(frozen=True)
class Drawing:
    """A figure, ready to be written.

    Attributes:
        figure: the picture (see `firstorder.plotting.panels`; it need not be pyplot's).
        arrays: what is shown, by name; written as NPZ.
        claims: what the paper says, beside what we measure (`figures.verdicts`).
        curves: sets of columns of equal length, by name; each is also written as CSV.
        size: what decides accuracy and cost, in words: "96 x 97 samples, 64 nodes".
        seed: of the random numbers, if there are any.
    """

    figure: Figure
    arrays: dict[str, Any]
    claims: Sequence[Statement | Measurement]
    curves: dict[str, dict[str, Any]] = dataclasses.field(default_factory=dict)
    size: str = ""
    seed: int | None = None
