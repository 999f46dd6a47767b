"""R07 Fig. 5: where light varies in space and where in direction: SV, DV, CDV and their ratio.

The scene is `r07.shared.table`; the paper gives no numbers. The lamp has 8 x 8 Gauss nodes and
casts no shadows (R07 §5 has none). Both lobes are taken together: lengths of the sums over lobes of
each term. Medians are over the pixels that show an object and receive light; "diffuse regions" are
the pixels of the diffuse sphere.

CDV goes with brightness: on our bumpy sphere, which is darker than the diffuse one and farther from
the lamp, it is half as large, though it turns the light much faster. Taken as a share of the
radiance it is highest there, as the paper says.
"""

from __future__ import annotations

import numpy as np

from figures.r07.shared import table as shared
from figures.style import Claim, Drawing
from firstorder import plotting


def draw(quick: bool) -> Drawing:
    side = 96 if quick else 512
    world = shared.table()
    p = shared.coordinates(shared.grid(side), side)
    found, index = shared.shaded(world, [shared.lamp()], p, shadows=False)
    SV, DV, CDV = (np.sum(a, -1) for a in (found.SV, found.DV, found.CDV))
    lit = (index >= 0) & (SV > 0.0)
    ratio = np.divide(CDV, SV, out=np.zeros_like(CDV), where=lit)

    square = (side, side)
    figure, axes = plotting.panels(2, 3, 3.3, 3.0)
    first = shared.show(axes[0, 0], found.value.reshape(square), "a) image", cmap=plotting.RADIANCE,
                        vmin=0.0, vmax=np.quantile(found.value, 0.998))  # fmt: skip
    figure.colorbar(first, ax=axes[0, 0], label="W/(m$^2$ sr)")
    panels = (
        (axes[0, 1], SV, "b) spatial variation, SV", "log$_{10}$ W/(m$^3$ sr)", -3.0),
        (axes[0, 2], DV, "c) directional variation, DV", "log$_{10}$ W/(m$^2$ sr rad)", -3.0),
        (axes[1, 0], found.CV[:, 0], "d) curvature, CV", "log$_{10}$ 1/m", -2.0),
        (axes[1, 1], CDV, "e) CDV = CV x DV", "log$_{10}$ W/(m$^3$ sr)", -3.0),
        (axes[1, 2], ratio, "f) CDV / SV", "log$_{10}$", -2.0),
    )
    for ax, values, title, unit, low in panels:
        drawn = shared.show_decades(ax, np.reshape(values, square), title, low)
        figure.colorbar(drawn, ax=ax, label=unit)

    medians = {}
    for name in shared.NAMES:
        here = lit & (index == world.scene.named(name)[0])
        medians[name] = {"SV": np.median(SV[here]), "CDV": np.median(CDV[here]),
                         "ratio": np.median(ratio[here]),
                         "share": np.median(CDV[here] / found.value[here]),
                         "comparable": np.mean(abs(np.log10(ratio[here])) < 0.5)}  # fmt: skip
    arrays = {
        "value": found.value.reshape(square), "SV": SV.reshape(square), "DV": DV.reshape(square),
        "CV": np.reshape(found.CV[:, 0], square), "CDV": CDV.reshape(square),
        "index": index.reshape(square),
    }  # fmt: skip
    return Drawing(figure, arrays, _claims(medians), {}, f"{side} x {side} pixels, 64 light nodes")


def _claims(medians) -> list[Claim]:
    CDV = {name: m["CDV"] for name, m in medians.items()}
    ratio = {name: m["ratio"] for name, m in medians.items()}
    share = {name: m["share"] for name, m in medians.items()}
    return [
        Claim(
            "CDV is very low on the table: median, of that on the bumpy sphere",
            "very low",
            float(CDV["table"] / CDV["bumpy"]),
            "times",
            bool(CDV["table"] < 0.1 * CDV["bumpy"]),
        ),
        Claim(
            "CDV is highest on the bumpy sphere: its median over the next highest",
            "highest",
            float(CDV["bumpy"] / max(v for k, v in CDV.items() if k != "bumpy")),
            "times",
            bool(max(CDV, key=CDV.__getitem__) == "bumpy"),
        ),
        Claim(
            "CDV over radiance is highest on the bumpy sphere: its median over the next highest",
            "highest",
            float(share["bumpy"] / max(v for k, v in share.items() if k != "bumpy")),
            "times",
            bool(max(share, key=share.__getitem__) == "bumpy"),
        ),
        Claim(
            "CDV / SV on the bumpy sphere, median: the angular term dominates",
            "very high",
            float(ratio["bumpy"]),
            "",
            bool(ratio["bumpy"] > 3.0),
        ),
        Claim("CDV / SV on the table, median", "very low", float(ratio["table"]), "",
              bool(ratio["table"] < 0.1)),
        Claim(
            "Share of the diffuse sphere where CDV and SV are within a factor of 3.2",
            "comparable in parts",
            float(medians["diffuse"]["comparable"]),
            "",
            bool(medians["diffuse"]["comparable"] > 0.25),
        ),
    ]  # fmt: skip
