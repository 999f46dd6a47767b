"""J12 Fig. 10: the gradient of irradiance by arc length and by strata, 100 samples a point.

Scenes A and B as in `firstorder.flatland.library` (the paper gives no sizes); E in red. Strata are
equal in angle and jittered. The penumbra of scene B is |x| < 0.9, where at least one shadow edge
lies on the light. The exact curve jumps where an edge of the blocker lines up with one of the light
(|x| = 0.1 and 0.9).
"""

from __future__ import annotations

from figures import _j12_forms as forms
from figures.style import Claim, Drawing

ORDER, COLOUR, WORDS = 1, forms.GREEN, "E'"


def draw(quick: bool) -> Drawing:
    places = 61 if quick else 401
    data = forms.curves(places)
    figure = forms.draw_pair(data, ORDER, COLOUR, WORDS)
    return Drawing(
        figure,
        data,
        _claims(forms.errors(data, ORDER)),
        {"curves": data},
        size=f"{places} places, {forms.SAMPLES} samples each",
        seed=forms.SEED,
    )


def _claims(error) -> list[Claim]:
    unit = "RMS error over the peak"
    ratio = error["B arc length"] / error["B strata"]
    return [
        Claim(
            "Without occlusion the arc-length gradient is that of the closed form",
            "works well",
            error["A arc length"],
            unit,
            error["A arc length"] < 0.05,
        ),
        Claim(
            "Without occlusion the stratified gradient is too",
            "works well",
            error["A strata"],
            unit,
            error["A strata"] < 0.05,
        ),
        Claim(
            "In the penumbra the arc-length gradient fails",
            "fails",
            error["B arc length"],
            unit,
            error["B arc length"] > 0.2,
        ),
        Claim(
            "In the penumbra the stratified gradient tracks the truth",
            "accounts for occlusion changes",
            error["B strata"],
            unit,
            error["B strata"] < 0.2,
        ),
        Claim(
            "Error of the arc-length gradient over that of the stratified one, in the penumbra",
            "fails against tracks",
            ratio,
            "ratio",
            ratio > 2.0,
        ),
    ]
