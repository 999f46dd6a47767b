"""D05 Fig. 17 on meshes: an image of 20,000 shaded pixels, evenly spread or where bandwidth says.

The scene is `d05.shared.meshes`: a knot, a lump, a bumpy ball and a fern on displaced ground,
290,508 triangles, whose shadow rays are Embree's. All else is Fig. 17's: what it says of errors, of
four visibility samples a pixel and of costs holds here too (`d05.shared.compared`). Times are
processor times of one run, over that of its own shading; only their ratio counts.

At equal samples, equal rays and equal time the adaptive image is better in all measures, by the
filter and over triangles. A ray that is asked for a distance takes two to three times as long as
one that is only asked whether it is hidden; so blockers are looked for at a tenth of the samples.
"""

from __future__ import annotations

from figures.d05.shared import compared, meshes
from figures.d05.shared import sampling as shared
from figures.style import Drawing

CROPS = {
    "the knot's crossings": (0.26, 0.22, 0.52, 0.63),
    "the fern": (0.72, 0.20, 0.98, 0.62),
}


def draw(quick: bool) -> Drawing:
    run = compared.Run(meshes.world(quick), shared.budget(quick))
    found = compared.compared(run, CROPS, quick)
    figure = compared.drawn(run, found, CROPS)
    arrays, curves, size = compared.kept(run, found)
    size = f"{size}, {meshes.rays().tracer.mesh.count:,} triangles"
    return Drawing(figure, arrays, compared.claims(run, found, CROPS), curves, size, 0)
