"""D05 Fig. 17: an image of 20,000 shaded pixels, evenly spread or where bandwidth says.

Scene, criteria and samples are those of Fig. 16. All errors are against the image of which every
pixel is shaded; "on screen" means clipped at the 99 % quantile of radiance, gamma 2.2, and so is
SSIM. The pictures have four visibility samples a pixel, as the paper's, averaged on the screen: the
label of each says which samples count there; their truth shades all four where labels differ.
Elsewhere one sample a pixel is reconstructed.

Images are linear over triangles that do not cross labels. The paper's cross-bilateral filter stands
beside that: its errors are larger everywhere. It blurs what is curved or slanted, where its normals
admit little, and leaves pale blotches beside a densely sampled shape.

A shaded pixel keeps its value. So every error falls to nothing when all are shaded; a filter that
blurs its samples too would keep what it blurs.

Cost. Primary rays (4 a pixel) and triangles serve both ways. Only the adaptive way needs rays to
find blockers. The paper asks 100 at as many points as there are samples; a tenth of the points does
as well. That is the tenth of the samples which lies evenly in every density: the blue noise nests
it, so that it can be shaded first. These rays are 2.6 % of all, and their slopes are made linear
over triangles at every second pixel. Equal rays: the uniform image gets as many samples more as
these rays would shade. Equal time: as many as processor time of blockers, their triangles and
differences would shade, measured in turns in this run. The paper counts neither, and gives no
numbers: "better captures the sharp detail in the shiny dinosaur's head and feet" is judged there,
over 20 seeds of the blue noise.

The density is the bandwidth map itself: "a set of image samples given a bandwidth map". Other
powers of it are scanned. Nyquist's rate, the square, is the worst: it spends what it has on slants.

What loses. Soft shadows on the floor: the criterion is that of gloss alone, and the floor has
little of it. Weighted by light, it counts the diffuse lobe as well.
"""

from __future__ import annotations

import numpy as np

from figures.d05.shared import compared, creatures
from figures.d05.shared import sampling as shared
from figures.d05.shared.readings import most
from figures.style import Drawing
from figures.verdicts import Measurement, Statement

POWERS = (0.5, 0.75, 1.0, 1.25, 1.5, 1.75, 2.0)
CROPS = {
    "the shiny creature's head": (0.40, 0.54, 0.56, 0.79),
    "the shiny creature's feet": (0.22, 0.17, 0.47, 0.43),
}


def draw(quick: bool) -> Drawing:
    run = compared.Run(creatures.world(quick), shared.budget(quick))
    found = compared.compared(run, CROPS, quick)
    figure = compared.drawn(run, found, CROPS)
    claims = [*compared.claims(run, found, CROPS), *_powers(run, found), _without_blue(run, found)]
    arrays, curves, size = compared.kept(run, found)
    return Drawing(figure, arrays, claims, curves, size, 0)


def _powers(run: compared.Run, found: compared.Compared) -> list[Statement | Measurement]:
    """The density as powers of the bandwidth with blockers."""
    even, least = found.table["even", compared.WAYS[0]], {}
    for power in POWERS:
        e = run.errors(shared.spread(run.found.maps["plain"], power), run.count)
        least[power] = float(np.min(even / compared.lacks(e)))
    better = float(np.mean([ratio > 1.0 for ratio in least.values()]))
    return [
        Statement("Share of densities, powers of the bandwidth, with which the adaptive image is "
                  "better in all three measures", "based on B'", better, most("based on B'"),
                  "D05 §6.2", scanned="powers from 1/2 to 2 in steps of 1/4"),
        *(Measurement(f"Density as bandwidth to the power {power:g}, uniform over adaptive: least "
                      "of the three measures", ratio, "times") for power, ratio in least.items()),
    ]  # fmt: skip


def _without_blue(run: compared.Run, found: compared.Compared) -> Measurement:
    """Errors of samples placed at the paper's density, but independently."""
    density = run.density["plain"]
    rng = np.random.default_rng(2)
    key = rng.exponential(size=density.shape) / density  # the smallest: drawn without replacement
    at = np.argwhere(key <= np.partition(key.ravel(), run.count - 1)[run.count - 1])
    made = shared.triangulated(run.view, at, run.truth[tuple(at.T)])
    e = np.array(compared.lacks(shared.errors(made, run.truth, run.white)))
    words = "Independent samples over blue noise, with blockers, the three measures"
    return Measurement(words, compared.triple(e / found.table["plain", compared.WAYS[0]]))
