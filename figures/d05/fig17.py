"""D05 Fig. 17: an image of 20,000 shaded pixels, evenly spread or where bandwidth says.

Scene, criteria and samples are those of Fig. 16. All errors are against the image of which every
pixel is shaded; "on screen" means clipped at the 99 % quantile of radiance, gamma 2.2, and so is
SSIM. The pictures have four visibility samples a pixel, as the paper's: depth and normals of each
guide the filter, and 2 x 2 values are averaged; their truth shades all four where their labels
differ. Elsewhere one sample a pixel is reconstructed.

A shaded pixel keeps its value. So every error falls to nothing when all are shaded; a filter that
blurs its samples too would keep what it blurs.

Cost. Primary rays (4 a pixel) and the filter serve both ways. Only the adaptive way needs 100 rays
at 20,000 points to find blockers, 26 % of the 384 rays a shaded pixel takes here. Equal rays: the
uniform image gets as many samples more as these rays would shade. Equal time: as many as processor
time of blockers, their filter and differences would shade, measured in this run. The paper counts
neither, and gives no numbers: "better captures the sharp detail in the shiny dinosaur's head and
feet" is judged there.

What loses, at full size. At equal time the uniform image has twice the samples; the adaptive one
still has the lower errors, but by the paper's filter SSIM, which looks at the floor too, where few
samples are left, ties: who wins its fourth digit is the clock's to say (lost in four runs, won in
one). Three fifths of that time go to the blockers' rays (each takes twice as long as one that
shades, as it needs a distance), the rest to the filter that spreads what they find; processor
times, of which only ratios within one run count (2.0 to 2.2 in five). What is not counted is the
sum that makes a map of these, 0.03 s where differences take 0.2. Blockers matter on screen; without
them the criterion costs 5 to 8 %, and radiance alone gains as much. The filter loses most: over a
triangulation that does not cross labels uniform images err a sixth less and adaptive ones a third
less, and there the adaptive image wins by all measures at equal time too. The filter blurs what is
curved or slanted, where its normals admit little. It also fails where it looks at the nearest
samples alone: beside a densely sampled shape they all lie on the shape (`reconstruction.bilateral`
looks farther; errors on screen were 2 to 3 times larger before). Nyquist's rate, the square of the
bandwidth, is the worst density: it spends what it has on slants.
"""

from __future__ import annotations

import numpy as np

from figures.d05.shared import compared, creatures
from figures.d05.shared import sampling as shared
from figures.style import Claim, Drawing
from firstorder.reconstruction.bilateral import bilateral_widths

POWERS = {"1": 1.0, "4/3": 4.0 / 3.0, "2": 2.0}
CROPS = {
    "the shiny creature's head": (0.40, 0.54, 0.56, 0.79),
    "the shiny creature's feet": (0.22, 0.17, 0.47, 0.43),
}


def draw(quick: bool) -> Drawing:
    run = compared.Run(creatures.world(quick), shared.budget(quick))
    found = compared.compared(run, quick)
    figure = compared.drawn(run, found, CROPS)
    *shared_claims, falling = compared.claims(run, found, CROPS)
    claims = [*shared_claims, *_parts(run, found), falling]
    arrays, curves, size = compared.kept(run, found)
    return Drawing(figure, arrays, claims, curves, size, 0)


def _parts(run: compared.Run, found: compared.Compared) -> list[Claim]:
    """Power of the density and placement, one changed at a time."""
    even, claims = found.table["even", "bilateral"], []
    for name in ("plain", "light"):
        for power, number in POWERS.items():
            e = run.errors(shared.spread(run.found.maps[name], number), run.count)
            words = f"Density as bandwidth to the power {power}, {compared.NAMES[name]}"
            claims.append(Claim(words, None, compared.triple(e), "", compared.better(e, even)))
    blue, white = found.table["plain", "bilateral"], _without_blue(run)
    words = "Independent samples in place of blue noise, with blockers"
    holds = compared.better(blue, white)
    return [*claims, Claim(words, "blue noise", compared.triple(white), "", holds)]


def _without_blue(run: compared.Run) -> compared.Errors:
    """Errors of samples placed at the paper's density, but independently."""
    density = run.density["plain"]
    rng = np.random.default_rng(2)
    key = rng.exponential(size=density.shape) / density  # the smallest: drawn without replacement
    at = np.argwhere(key <= np.partition(key.ravel(), run.count - 1)[run.count - 1])
    width = bilateral_widths(density, len(at))
    made = shared.filtered(run.view, at, run.truth[tuple(at.T)], width)
    return shared.errors(made, run.truth, run.white)
