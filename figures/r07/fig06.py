"""R07 Fig. 6: as the lamp moves away, directional variation gains on spatial variation.

The scene is `r07.shared.table`, the lamp at 1, 2, 4 ... 32 times its distance of 3 m, as bright as
keeps the irradiance. R07 §5.2: for an isotropic lamp at a distance d, `L_x ~ L_theta / d`, so
that CDV / SV grows as d, and light is far where `1/d << 2 n_x`. Both lobes together, medians over
the pixels of each object; no shadows. The slope is that of the last three octaves. The paper shows
pictures and gives no numbers. What is claimed is judged over lay-outs of materials, lamps and bumps
(`r07.shared.table.layouts`), on the object for which it holds least.
"""

from __future__ import annotations

import numpy as np

from figures.r07.shared import table as shared
from figures.spread import geometric, spread
from figures.style import Drawing
from figures.verdicts import Statement, at_least, at_most
from firstorder import plotting

REFERENCE = 3.08  # of the lamp from the middle of the spheres [m]


def draw(quick: bool) -> Drawing:
    side = 48 if quick else 256
    factors = 2.0 ** np.arange(6)
    world = shared.table()
    medians, pictures = _medians(world, [shared.lamp(f) for f in factors], side)
    count, small = (3, 32) if quick else (24, 96)
    scan = [
        _medians(o.world, [o.lamp(f) for f in factors], small)[0] for o in shared.layouts(count)
    ]
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

    curves = {"medians": {"distance": distance, **medians}}
    arrays = {"distance": distance, "ratio": np.array(pictures)}
    size = f"{side} x {side} pixels, 64 light nodes; lay-outs {small} x {small}"
    return Drawing(figure, arrays, _claims(scan, f"{count} lay-outs"), curves, size)


def _medians(world, lamps, side: int):
    """CDV / SV with the lamp's distance: medians of each object, and images."""
    p = shared.coordinates(shared.grid(side), side)
    rows, pictures = [], []
    for lamp in lamps:
        found, index = shared.shaded(world, [lamp], p, shadows=False)
        SV, CDV = np.sum(found.SV, -1), np.sum(found.CDV, -1)
        lit = (index >= 0) & (SV > 0.0)
        ratio = np.divide(CDV, SV, out=np.zeros_like(CDV), where=lit)
        pictures.append(ratio.reshape(side, side))
        rows.append([
            np.median(ratio[lit & (index == world.scene.named(name)[0])]) for name in shared.NAMES
        ])  # fmt: skip
    return dict(zip(shared.NAMES, np.array(rows).T, strict=True)), pictures


def _claims(scan, scanned: str) -> list[Statement]:
    """Of each lay-out's least obedient object."""
    octaves = np.log(2.0) * np.arange(3)
    slopes = np.array([
        [np.polyfit(octaves, np.log(ratio[-3:]), 1)[0] for ratio in medians.values()]
        for medians in scan
    ])  # fmt: skip
    furthest = np.max(abs(slopes - 1.0), 1)  # of either sign: a mean of slopes would cancel them
    steps = [min(np.min(ratio[1:] / ratio[:-1]) for ratio in m.values()) for m in scan]
    off = spread(furthest)
    grows = geometric(steps)
    return [
        Statement("L_x ~ L_theta / d: how far the log-log slope of CDV / SV far away is from 1, "
                  "the object furthest from it", 0.0, off.mean,
                  at_most(0.1, "proportional to d"), "R07 §5.2", "", off.error, scanned),
        Statement("CDV / SV increases as the light moves away: least factor of all doublings of "
                  "the distance, over objects", "increases", grows.mean,
                  at_least(1.0, "'increases'"), "R07 Fig. 6", "times", grows.error, scanned,
                  "Near the lamp the median pixel of an object changes."),
    ]  # fmt: skip
