"""R07 Fig. 6: as the lamp moves away, directional variation gains on spatial variation.

The scene is `r07.shared.table`, the lamp at 1, 2, 4 ... 32 times its distance of 3 m, as bright as
keeps the irradiance. R07 §5.2: for an isotropic lamp at a distance d, `L_x ~ L_theta / d`, so
that CDV / SV grows as d, and light is far where `1/d << 2 n_x`. Both lobes together, medians over
the pixels of each object; no shadows. The slope is that of the last three octaves. The paper shows
pictures and gives no numbers.
"""

from __future__ import annotations

import numpy as np

from figures.r07.shared import table as shared
from figures.style import Claim, Drawing
from firstorder import plotting

REFERENCE = 3.08  # of the lamp from the middle of the spheres [m]


def draw(quick: bool) -> Drawing:
    side = 48 if quick else 256
    factors = 2.0 ** np.arange(6)
    world = shared.table()
    p = shared.coordinates(shared.grid(side), side)
    rows, pictures = [], []
    for factor in factors:
        found, index = shared.shaded(world, [shared.lamp(factor)], p, shadows=False)
        SV, CDV = np.sum(found.SV, -1), np.sum(found.CDV, -1)
        lit = (index >= 0) & (SV > 0.0)
        ratio = np.divide(CDV, SV, out=np.zeros_like(CDV), where=lit)
        pictures.append(ratio.reshape(side, side))
        rows.append([
            np.median(ratio[lit & (index == world.scene.named(name)[0])]) for name in shared.NAMES
        ])  # fmt: skip
    medians = dict(zip(shared.NAMES, np.array(rows).T, strict=True))
    distance = REFERENCE * factors

    figure, axes = plotting.panels(1, 4, 3.0, 2.9)
    drawn = [
        shared.show_decades(
            ax, pictures[k], f"{letter}) CDV / SV, lamp at {distance[k]:.0f} m", -2.0, 3.0
        )
        for ax, k, letter in zip(axes[0], (0, 2, 4), "abc", strict=False)
    ]
    figure.colorbar(drawn[0], ax=axes[0, :3], shrink=0.8, label="log$_{10}$")
    for name, ratio in medians.items():
        axes[0, 3].loglog(distance, ratio, "o-", markersize=3, label=name)
    axes[0, 3].axhline(1.0, color="0.6", linewidth=0.8)
    axes[0, 3].set(title="d) medians", xlabel="distance of the lamp (m)", ylabel="CDV / SV")
    axes[0, 3].legend(fontsize=7)

    slopes = {
        name: float(np.polyfit(np.log(distance[-3:]), np.log(ratio[-3:]), 1)[0])
        for name, ratio in medians.items()
    }
    claims = [
        Claim(
            f"CDV / SV with the lamp's distance, {name}: log-log slope far away",
            "increases",
            slope,
            "",
            bool(abs(slope - 1.0) < 0.1),
        )
        for name, slope in slopes.items()
    ]
    claims.append(
        Claim(
            "CDV / SV rises from each distance to the next, on every object",
            "increases",
            "yes" if all(np.all(np.diff(r) > 0.0) for r in medians.values()) else "no",
            "",
            all(bool(np.all(np.diff(r) > 0.0)) for r in medians.values()),
        )
    )
    curves = {"medians": {"distance": distance, **medians}}
    arrays = {"distance": distance, "ratio": np.array(pictures)}
    return Drawing(figure, arrays, claims, curves, f"{side} x {side} pixels, 64 light nodes")
