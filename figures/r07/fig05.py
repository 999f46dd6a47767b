"""R07 Fig. 5: where light varies in space and where in direction: SV, DV, CDV and their ratio.

The scene is `r07.shared.table`; the paper gives no numbers. The lamp has 8 x 8 Gauss nodes and
casts no shadows (R07 §5 has none). Both lobes are taken together: lengths of the sums over lobes of
each term. Medians are over the pixels that show an object and receive light; "diffuse regions" are
the pixels of the diffuse sphere. The picture shows the first choice of materials and lamp; what is
claimed is judged over lay-outs (`r07.shared.table.layouts`), by geometric means.

CDV goes with brightness, so that it is highest on the bumpy sphere only where that is bright enough
beside the others: in some half of the lay-outs, and not in ours. As a share of the radiance it is
highest there. "Highest" is read as a statement of every such scene: it holds in 19 of 20 lay-outs.
"""

from __future__ import annotations

import numpy as np

from figures.r07.shared import look
from figures.r07.shared import table as shared
from figures.spread import geometric, spread
from figures.style import Drawing
from figures.verdicts import OURS, Measurement, Statement, at_least, at_most
from firstorder import plotting

SOURCE = "R07 §5.2, Fig. 5"


def draw(quick: bool) -> Drawing:
    side = 96 if quick else 512
    world = shared.table()
    p = shared.coordinates(shared.grid(side), side)
    found, index = shared.shaded(world, [shared.lamp()], p, shadows=False)
    SV, DV, CDV = (np.sum(a, -1) for a in (found.SV, found.DV, found.CDV))
    lit = (index >= 0) & (SV > 0.0)
    ratio = np.divide(CDV, SV, out=np.zeros_like(CDV), where=lit)
    count, small = (3, 48) if quick else (100, 128)
    varied = [_medians(o.world, o.lamp(), small) for o in shared.layouts(count)]

    square = (side, side)
    figure, axes = plotting.panels(2, 3, 3.5, 3.0)
    value, labels = found.value.reshape(square), index.reshape(square)
    look.look(value, labels, shared.tints(world)).show(axes[0, 0], value, "a) image")
    bar = figure.colorbar(axes[0, 0].images[0], ax=axes[0, 0], label=" ")
    bar.ax.set_visible(False)  # it keeps the panels in line
    panels = (
        (axes[0, 1], SV, "b) spatial variation, SV", "log$_{10}$ W/(m$^3$ sr)", -3.0),
        (axes[0, 2], DV, "c) directional variation, DV", "log$_{10}$ W/(m$^2$ sr rad)", -3.0),
        (axes[1, 0], found.CV[:, 0], "d) curvature, CV", "log$_{10}$ 1/m", -2.0),
        (axes[1, 1], CDV, "e) CDV = CV x DV", "log$_{10}$ W/(m$^3$ sr)", -4.0),
        (axes[1, 2], ratio, "f) CDV / SV", "log$_{10}$", -3.0),
    )
    for ax, values, title, unit, low in panels:
        drawn = shared.show_decades(ax, np.reshape(values, square), title, low)
        figure.colorbar(drawn, ax=ax, label=unit)

    arrays = {
        "value": found.value.reshape(square), "SV": SV.reshape(square), "DV": DV.reshape(square),
        "CV": np.reshape(found.CV[:, 0], square), "CDV": CDV.reshape(square),
        "index": index.reshape(square),
    }  # fmt: skip
    claims = [*_claims(varied, f"{count} materials, lamps and bumps"),
              *_shown(_medians(world, shared.lamp(), side))]  # fmt: skip
    size = f"{side} x {side} pixels, 64 light nodes; lay-outs {small} x {small}"
    return Drawing(figure, arrays, claims, {}, size)


def _medians(world, lamp, side: int) -> dict[str, dict[str, float]]:
    """Of each object's lit pixels: medians, and how many have CDV within a factor 3.2 of SV."""
    p = shared.coordinates(shared.grid(side), side)
    found, index = shared.shaded(world, [lamp], p, shadows=False)
    SV, CDV = (np.sum(a, -1) for a in (found.SV, found.CDV))
    out = {}
    for name in shared.NAMES:
        here = (index == world.scene.named(name)[0]) & (SV > 0.0)
        ratio = CDV[here] / SV[here]
        out[name] = {"CDV": np.median(CDV[here]), "ratio": np.median(ratio),
                     "share": np.median(CDV[here] / found.value[here]),
                     "comparable": np.mean(abs(np.log10(ratio)) < 0.5)}  # fmt: skip
    return out


def _over_next(medians, what: str) -> float:
    """The bumpy sphere's median over the highest of the others."""
    others = (m[what] for name, m in medians.items() if name != "bumpy")
    return medians["bumpy"][what] / max(others)


def _claims(varied, scanned: str) -> list[Statement]:
    """Over lay-outs: geometric means with their standard errors."""
    highest = [_over_next(m, "CDV") > 1.0 for m in varied]
    comparable = [m["diffuse"]["comparable"] for m in varied]
    rows = (
        ("CDV is very low on the table: median, of that on the bumpy sphere", "very low",
         geometric([m["table"]["CDV"] / m["bumpy"]["CDV"] for m in varied]),
         at_most(0.1, "'very low': below a tenth"), SOURCE, ""),
        ("CDV over radiance is highest on the bumpy sphere: its median over the next highest",
         None, geometric([_over_next(m, "share") for m in varied]), at_least(1.0, "highest"),
         OURS, "A sharper lobe on the glossy sphere outweighs the bumps."),
        ("CDV / SV is very high on the bumpy sphere, where the angular term dominates: median",
         "very high", geometric([m["bumpy"]["ratio"] for m in varied]),
         at_least(3.0, "'very high': the angular term has three quarters"), SOURCE, ""),
        ("CDV / SV is very low on the table: median", "very low",
         geometric([m["table"]["ratio"] for m in varied]),
         at_most(0.1, "'very low': below a tenth"), SOURCE, ""),
    )  # fmt: skip
    told = [
        Statement(claim, paper, got.mean, rule, source, "", got.error, scanned, reason)
        for claim, paper, got, rule, source, reason in rows
    ]
    told.append(
        Statement("CDV is highest on the bumpy sphere, by medians: share of lay-outs", "highest",
                  np.mean(highest), at_least(0.95, "'highest': in 19 of 20 such scenes"), SOURCE,
                  "", spread(highest).error, scanned,
                  "CDV goes with brightness: a bumpy sphere that is darker or farther from the "
                  "lamp than the glossy one turns light faster by its bumps and still has less "
                  "CDV. As a share of radiance it is the highest.")
    )  # fmt: skip
    told.append(
        Statement("Parts of the diffuse sphere have CDV and SV within a factor of 3.2: share",
                  "there are parts", np.mean(comparable), at_least(0.25, "'parts': a quarter"),
                  SOURCE, "", spread(comparable).error, scanned)
    )  # fmt: skip
    return told


def _shown(medians) -> list[Measurement]:
    """Of the scene in the picture."""
    words = "The scene that is shown: {} on the bumpy sphere over the next highest, medians"
    return [Measurement(words.format(name), _over_next(medians, what), "times", source=SOURCE)
            for what, name in (("CDV", "CDV"), ("share", "CDV over radiance"))]  # fmt: skip
