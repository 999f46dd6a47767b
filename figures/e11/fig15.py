"""What few and more shared rays show of fine shadows, and what even those miss.

E11 Fig. 15 shows an inset of its Fig. 1 with contrast times 4, and no numbers. Ours: the ground of
our stand-in for that scene (a plant of 1.3 M triangles over a flat ground), 256 x 256 pixels, 1 ray
for each at 1 cycle of the lamp's diameter and 10 rays at 4, beside 2,048 stratified rays (at 16
cycles, which was tried first, 10 rays are so noisy that 1 ray at 2 cycles is better by far). Detail
is what lies between Gaussians of 1 and 4 pixels, and is counted as far as it agrees with that of
the reference (its projection on it): noise is none. Contrast is stretched four times about the
median of the penumbra in the inset.

The last panel is 10 rays at the limit that each pixel chooses by itself.
"""

from __future__ import annotations

import numpy as np
import scipy.ndimage

from figures.e11.shared import limits
from figures.e11.shared import space as scenes
from figures.style import Claim, Drawing
from firstorder import plotting

LOW, HIGH, TOO_HIGH = 0, 2, 4  # of the ladder
FEW, MANY = 1, 10
CONTRAST = 4.0
LADDER = np.array([1.0, 2.0, 4.0, 8.0, 16.0])  # cycles


def draw(quick: bool = False) -> Drawing:
    """Four insets and the image they are from."""
    side = scenes.QUICK_SIDE if quick else scenes.SIDE
    ground = limits.ground(scenes.plant(side, quick), quick)
    few = ground.answers(ground.traced(FEW), LADDER[:2]).visible[LOW]
    rungs = ground.answers(ground.traced(MANY), LADDER)
    many, chosen = rungs.visible[HIGH], ground.chosen(rungs).visible
    shown = {
        f"{FEW} ray, {LADDER[LOW]:g} cycle": few,
        f"{MANY} rays, {LADDER[HIGH]:g} cycles": many,
        f"{MANY} rays, automatic": chosen,
        f"{ground.rays} rays of its own": ground.true,
    }
    whole = ground.picture(ground.true)
    inset = limits.window(whole, side // 4)
    figure, axes = plotting.panels(1, 5, width=2.3, height=2.9)
    scenes.show(axes[0, 0], whole, "the image", cmap="gray", vmin=0, vmax=1)
    i, j = inset
    x, y = [i.start, i.stop, i.stop, i.start, i.start], [j.start, j.start, j.stop, j.stop, j.start]
    axes[0, 0].plot(x, y, color=plotting.COLOURS[1], lw=1.0)
    part = whole[inset]
    middle = float(np.nanmedian(part[(part > 0.02) & (part < 0.9)]))
    ends = dict(vmin=middle - 0.5 / CONTRAST, vmax=middle + 0.5 / CONTRAST)
    for ax, (title, values) in zip(axes[0, 1:], shown.items(), strict=True):
        error = "" if values is ground.true else f"\nRMS {100 * ground.rms(values):.2f} %"
        scenes.show(ax, ground.picture(values)[inset], title + error, cmap="gray", **ends)
    arrays = {title: ground.picture(values) for title, values in shown.items()}
    claims = _claims(ground, few, many, chosen, rungs.visible[TOO_HIGH], inset)
    size = f"{side} x {side} pixels, {ground.scene.triangles} triangles, {ground.rays} rays"
    return Drawing(figure, arrays, claims, {}, size, limits.SEED)


def _detail(image: np.ndarray) -> np.ndarray:
    """What lies between Gaussians of 1 and 4 pixels; what is no ground counts as lit."""
    whole = np.nan_to_num(image, nan=1.0)
    return scipy.ndimage.gaussian_filter(whole, 1.0) - scipy.ndimage.gaussian_filter(whole, 4.0)


def _claims(ground, few, many, chosen, noisy, inset) -> list[Claim]:
    true = _detail(ground.picture(ground.true))[inset]
    low, high = (
        float(np.sum(_detail(ground.picture(a))[inset] * true) / np.sum(true**2))
        for a in (few, many)
    )
    errors = [ground.rms(a) for a in (few, many, chosen)]
    return [
        Claim("RMS error, 1 ray and low band limit", None, errors[0]),
        Claim("RMS error, 10 rays and high band limit", None, errors[1]),
        Claim(
            "RMS error of 10 rays at a high limit over 1 ray at a low one",
            "captures more",
            errors[1] / errors[0],
            "times",
            errors[1] < errors[0],
        ),
        Claim(
            "Detail of 1 ray at a low limit", "overblurred", low, "of the reference's", low < 1.0
        ),
        Claim(
            "Detail of 10 rays at a high limit over that of 1 ray at a low one",
            "captures more shadow frequencies",
            high / low,
            "times",
            high > low,
        ),
        Claim(
            "Detail of 10 rays at a high limit",
            "still missing some",
            high,
            "of the reference's",
            high < 1.0,
        ),
        Claim("RMS error, 10 rays at the automatic limit", None, errors[2]),
        Claim("RMS error, 10 rays at 16 cycles: their noise", None, ground.rms(noisy)),
    ]
