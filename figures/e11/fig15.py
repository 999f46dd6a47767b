"""What few and more shared rays show of fine shadows, and what even those miss.

E11 Fig. 15 shows an inset of its Fig. 1 with contrast times 4, and no numbers. Ours: the ground of
our stand-in for that scene (a plant of 1.3 M triangles over a flat ground), 256 x 256 pixels, 1 ray
for each at 1 cycle of the lamp's diameter and 10 rays at 4, beside 2,048 stratified rays. Detail
is what lies between Gaussians of 1 and 4 pixels, and is counted as far as it agrees with that of
the reference (its projection on it): noise is none. Contrast is stretched four times about the
median of the penumbra in the inset. Ground up to 32 pixels beside the inset traces rays, too.

The paper tells neither limit. So what is said of the high one is asked of 2, 4, 8 and 16 cycles,
of 20 seeds each and 100 of the low one, and is judged by the limit at which it does worst. Errors
are measured at all of them: they grow with the limit, for at 10 rays a pixel noise outweighs what
the blur takes.

The last panel is 10 rays at the limit that each pixel chooses by itself.
"""

from __future__ import annotations

import numpy as np
import scipy.ndimage

from figures.e11.shared import limits
from figures.e11.shared import space as scenes
from figures.spread import spread
from figures.style import Drawing
from figures.verdicts import Measurement, Statement, at_least, at_most
from firstorder import plotting
from firstorder.shadowfield.rendering.depth_bounds import blocker_depths
from firstorder.shadowfield.rendering.sheared_filter import sheared_shadow

LOW, HIGH = 0, 2  # of the ladder, as shown
EDGE = 32  # pixels around the inset that trace rays
FEW, MANY = 1, 10
CONTRAST = 4.0
FINE, COARSE = 1.0, 4.0  # standard deviations between which detail lies, in pixels
REACH = 16  # pixels at which SciPy ends the wider Gaussian
LADDER = np.array([1.0, 2.0, 4.0, 8.0, 16.0])  # cycles


def draw(quick: bool = False) -> Drawing:
    """Four insets, the detail in them, and the image they are from."""
    side = scenes.QUICK_SIDE if quick else scenes.SIDE
    image = limits.ground(scenes.plant(side, quick), quick)
    whole = image.picture(image.true)
    inset = limits.window(whole, side // 5)
    ground = image.part(inset, EDGE)
    few = ground.answers(ground.traced(FEW), LADDER[:2]).visible[LOW]
    rungs = ground.answers(ground.traced(MANY), LADDER)
    many, chosen = rungs.visible[HIGH], ground.chosen(rungs).visible
    shown = {
        f"{FEW} ray, {LADDER[LOW]:g} cycle": few,
        f"{MANY} rays, {LADDER[HIGH]:g} cycles": many,
        f"{MANY} rays, automatic": chosen,
        f"{ground.rays} rays of its own": ground.true,
    }
    figure, axes = plotting.panels(2, 5, width=2.5, height=2.6)
    _image(axes[0, 0], whole, inset)
    part = whole[inset]
    middle = float(np.nanmedian(part[(part > 0.02) & (part < 0.9)]))
    ends = dict(vmin=max(middle - 0.5 / CONTRAST, 0.0), vmax=middle + 0.5 / CONTRAST)
    detail = _detail(ground.picture(ground.true))[inset]
    most = float(np.quantile(abs(detail), 0.99))
    lowest = {}
    for k, (title, values) in enumerate(shown.items(), start=1):
        error = (
            "the reference" if values is ground.true else f"RMS {100 * ground.rms(values):.2f} %"
        )
        picture = ground.picture(values)
        for row, found, options in (
            (0, picture[inset], dict(cmap="gray", **ends)),
            (1, _detail(picture)[inset], dict(cmap=plotting.SIGNED, vmin=-most, vmax=most)),
        ):
            ax = axes[row, k]
            words = f"{'bcde'[k - 1]}) {title}\n{error}" if row == 0 else f"{'ghij'[k - 1]}) detail"
            lowest[row] = scenes.show(ax, found, words, **options)
            ax.set_facecolor("#5b7fa6")  # what is no ground
    _detail_seen(axes[1, 0], ground, inset, rungs)
    for row, words in ((0, "light that is seen"), (1, "detail")):
        figure.colorbar(lowest[row], ax=axes[row, 1:], label=words, shrink=0.85)
    arrays = {title: ground.picture(values) for title, values in shown.items()}
    claims = _claims(ground, inset, chosen, 3 if quick else 20)
    size = f"{side} x {side} pixels, {ground.scene.triangles} triangles, {ground.rays} rays"
    return Drawing(figure, arrays, claims, {}, size, limits.SEED)


def _image(ax, whole, inset) -> None:
    """The image, and where the inset is."""
    scenes.show(ax, whole, "a) the image", cmap="gray", vmin=0, vmax=1)
    ax.set_facecolor("#5b7fa6")
    i, j = inset
    x, y = [i.start, i.stop, i.stop, i.start, i.start], [j.start, j.start, j.stop, j.stop, j.start]
    ax.plot(x, y, "-", color=plotting.COLOURS[1], lw=1.2)


def _detail_seen(ax, ground, inset, rungs) -> None:
    """How much of the reference's detail each limit shows."""
    true = _detail(ground.picture(ground.true))[inset]
    share = [np.sum(_detail(ground.picture(v))[inset] * true) / np.sum(true**2)
             for v in rungs.visible]  # fmt: skip
    ax.semilogx(LADDER, share, "o-", markersize=3)
    ax.axhline(1.0, color="0.6", linestyle=":")
    ax.set(title=f"f) detail seen with {MANY} rays", xlabel="band limit (cycles)", ylim=(0.0, 1.1),
           ylabel="of the reference's")  # fmt: skip
    ax.set_xticks(LADDER, [f"{c:g}" for c in LADDER])
    ax.minorticks_off()


def _detail(image: np.ndarray) -> np.ndarray:
    """What lies between Gaussians of 1 and 4 pixels; what is no ground counts as lit."""
    whole = np.nan_to_num(image, nan=1.0)
    fine, coarse = (scipy.ndimage.gaussian_filter(whole, s) for s in (FINE, COARSE))
    return fine - coarse


def _insets(ground: limits.Ground, part: limits.Ground, rays: int, cycles, seed: int):
    """The inset alone, by rays of its surroundings, at some limits."""
    lamp, pixel, found = ground.scene.lamp, ground.scene.pixel, []
    table = ground.traced(rays, seed)
    known = blocker_depths(lamp, table, part.receivers, pixel)
    for limit in np.asarray(cycles) / ground.diameter:
        shadow = sheared_shadow(
            lamp, table, part.receivers, limit, pixel, part.own, falloff=scenes.falloff,
            bounds=known,
        )  # fmt: skip
        found.append(ground.scene.picture(shadow.visible, part.where))
    return found


def _claims(ground, inset, chosen, seeds: int) -> list[Statement | Measurement]:
    part = ground.part(inset, REACH)  # what is beside the inset, or detail were that of its border
    known = ground.scene.picture(part.true, part.where)
    true = _detail(known)[inset]
    low_runs = [_insets(ground, part, FEW, LADDER[:1], k) for k in range(1, 5 * seeds + 1)]
    runs = [_insets(ground, part, MANY, LADDER[1:], k) for k in range(1, seeds + 1)]
    shown = {}
    columns = (*zip(*low_runs, strict=True), *zip(*runs, strict=True))
    for cycles, images in zip(LADDER, columns, strict=True):
        detail = [float(np.sum(_detail(a)[inset] * true) / np.sum(true**2)) for a in images]
        rms = [float(np.sqrt(np.nanmean((a - known)[inset] ** 2))) for a in images]
        shown[cycles] = np.array(detail), np.array(rms)
    low, high = shown[LADDER[LOW]][0], [shown[c][0] for c in LADDER[1:]]
    blurred, most = spread(low), spread(max(high, key=np.mean))
    least, error = spread(min(high, key=np.mean))
    least, error = least / blurred[0], np.hypot(error, blurred[1] * least / blurred[0]) / blurred[0]
    scanned = f"limits of 2, 4, 8 and 16 cycles, {seeds} seeds; the worst"
    return [
        Statement(
            "With 1 ray a pixel and a low band limit the inset is overblurred: its detail",
            "overblurred",
            blurred[0],
            at_most(1.0, "'overblurred': less detail than the reference has"),
            "E11 Fig. 15",
            "of the reference's",
            blurred[1],
            f"{5 * seeds} seeds",
        ),
        Statement(
            "10 rays and a higher limit capture more shadow frequencies: detail over that of 1 ray "
            "at the low limit",
            "more",
            least,
            at_least(1.0, "'more': more detail"),
            "E11 Fig. 15",
            "times",
            float(error),
            scanned,
        ),
        Statement(
            "Even so some detail is missing: detail with 10 rays and a higher limit",
            "missing some",
            most[0],
            at_most(1.0, "'missing some': less detail than the reference has"),
            "E11 Fig. 15",
            "of the reference's",
            most[1],
            scanned,
        ),
        *(
            Measurement(f"RMS error in the inset, {name}, {c:g} cycles", *_of_the_light(rms))
            for (c, (_, rms)), name in zip(shown.items(), ["1 ray", *4 * ["10 rays"]], strict=True)
        ),
        Measurement("RMS error around the inset, 10 rays at the automatic limit",
                    ground.rms(chosen), "of the light"),
    ]  # fmt: skip


def _of_the_light(values) -> tuple[float, str, float]:
    mean, error = spread(values)
    return mean, "of the light", error
