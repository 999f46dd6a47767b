"""J12 Fig. 22: about 256 records as circles and as ellipses, by the geometric Hessian.

The box, sizes as in the library, 30,000 rays, first order. Circles are J12's (70); ellipses are
drawn by the corrected (73), whose axes keep the total error, and by the printed axes. As in the
paper, reaches are drawn at half their size. Ratios of the axes are held at 8 in the corrected form,
since an eigenvalue may vanish. The radiometric Hessian stands beside it: its eigenvectors are those
of the light.

Forty per cent are not found. Over most of this floor the two eigenvalues of the geometric Hessian
are alike, so that ellipses are nearly circles and change the error by a few per cent, within the
spread over orders of insertion. Those of the radiometric Hessian are long, and lose: where one
eigenvalue crosses zero the ellipse reaches far along it, to where that Hessian no longer holds.
The sizes of the paper's box are not printed, and another box may have other eigenvalues.
"""

from __future__ import annotations

import numpy as np
from matplotlib.patches import Ellipse

from figures.j12.shared.box import case, compare, ellipse, floor_limits, show_error, size
from figures.j12.shared.caching import pointwise
from figures.style import Claim, Drawing
from firstorder import plotting

RECORDS = {False: 256, True: 64}


def draw(quick: bool) -> Drawing:
    s = size(quick)
    c, within = case("j12_box", s), floor_limits(s.pixels)
    methods = {
        f"{kind} {shape}": made
        for kind, H in (("geometric", c.table.geometric), ("radiometric", c.table.hessian))
        for shape, made in (
            ("circles", pointwise(H, within)),
            ("ellipses", ellipse(H, within)),
            ("printed ellipses", ellipse(H, within, printed=True)),
        )
    }
    found = compare(c, methods, RECORDS[quick])
    figure, axes = plotting.panels(2, 4, 2.2, 2.6)
    for row, kind in enumerate(("geometric", "radiometric")):
        most = 3.0 * found[f"{kind} circles"].mean
        for k, shape in enumerate(("circles", "ellipses")):
            outcome = found[f"{kind} {shape}"]
            _reaches(axes[row, 2 * k], outcome.cache(0))
            axes[row, 2 * k].set_title(f"{kind}, {shape}", fontsize=8)
            show_error(axes[row, 2 * k + 1], c, outcome, most, "error")
    claims = []
    for kind in ("geometric", "radiometric"):
        for shape in ("ellipses", "printed ellipses"):
            lower = 1.0 - found[f"{kind} {shape}"].mean / found[f"{kind} circles"].mean
            claims.append(
                Claim(
                    f"RMS error of {shape} below that of circles, {kind} Hessian",
                    40.0 if kind == "geometric" else None,
                    100.0 * lower,
                    "%",
                    lower > 0.3 if kind == "geometric" else None,
                )
            )
    arrays = {f"rms_{k.replace(' ', '_')}": o.errors for k, o in found.items()}
    curves = {
        f"{kind}_ellipses": found[f"{kind} ellipses"].cache(0).columns()
        for kind in ("geometric", "radiometric")
    }
    words = s.words().replace(f"{s.records} records", f"{RECORDS[quick]} records")
    return Drawing(figure, arrays, claims, curves, size=words, seed=12)


def _reaches(ax, cache) -> None:
    """Ellipses at half their size."""
    lengths, angle = cache.region.axes()
    x = np.asarray(cache.records.position)
    for (a, b), at, turn in zip(lengths, x, np.degrees(angle), strict=True):
        ax.add_patch(Ellipse(at, a, b, angle=turn, fill=False, linewidth=0.5))
    ax.plot(x[:, 0], x[:, 1], ".", color="black", markersize=1.5, markeredgewidth=0.0)
    ax.set(xlim=(0, 1), ylim=(0, 1), aspect="equal", xticks=[], yticks=[])
