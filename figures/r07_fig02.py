"""R07 Fig. 2: what each of the five laws does to each portrait, with the measured error.

The paper prints formulas; here each cell is a square walked both ways: the law applied to the
portrait, and the portrait of the result drawn by a route that shares no code (autodiff, samples).
The paper leaves the light open; ours is an off-centre, correlated Gaussian
(`firstorder.checks.cases`), which no sign or phase error survives.
"""

from __future__ import annotations

import numpy as np

from figures import claims
from figures.style import Claim, Drawing
from firstorder import plotting
from firstorder.checks.registry import cases
from firstorder.checks.squares import PORTRAITS, Square, square


def draw(quick: bool) -> Drawing:
    laws = claims.laws()
    squares = [[square(cases()[law], portrait) for portrait in PORTRAITS] for law in laws]
    figure, axes = plotting.panels(1, 1, 12.0, 1.0 + 0.75 * len(laws))
    plotting.table(
        axes[0, 0],
        PORTRAITS,
        laws,
        [[_words(s) for s in row] for row in squares],
        [[s.verdict for s in row] for row in squares],
        wrap=26,
        title="Apply, then convert = convert, then apply",
    )
    errors = np.array([[np.nan if s.error is None else s.error for s in row] for row in squares])
    told = [
        Claim(f"{s.name} acts on the {s.portrait}", None, s.error, "normwise", s.verdict == "equal")
        for row in squares
        for s in row
        if s.verdict != "refused"
    ]
    arrays = {"errors": errors, "laws": np.array(laws), "portraits": np.array(PORTRAITS)}
    return Drawing(figure, arrays, told, size="96 x 97 samples")


def _words(s: Square) -> str:
    return s.reason if s.error is None else f"{s.verdict}\n{s.error:.1e}"
