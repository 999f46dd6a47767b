"""J12 Fig. 10: the gradient of irradiance by arc length and by strata, 100 samples a point.

Scenes A and B as in `firstorder.flatland.library._scenes` (the paper gives no sizes); E in red.
Strata are equal in angle and jittered. The penumbra of scene B is |x| < 0.9, where at least one
shadow edge lies on the light. The exact curve jumps where an edge of the blocker lines up with one
of the light (|x| = 0.1 and 0.9).
"""

from __future__ import annotations

from figures.j12.shared import forms
from figures.style import Drawing


def draw(quick: bool) -> Drawing:
    return forms.drawn(1, forms.GREEN, "E'", "gradient", quick)
