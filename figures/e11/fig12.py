"""E11 Fig. 12: a wide array of blockers over curved ground with a fine relief, 1 ray a pixel.

The paper's models cannot be had; ours are 49 knots, blobs, bumpy balls and grids at random heights
and turns, 0.7 M triangles in all (`e11.shared.space`). Light band limit: 1 wavelength per side of
the lamp. Shown are, as in the paper, the bounds of the blockers' depths that each pixel's frustum
has, and how many rays its filter weighs. The paper's figure has no rays of pixels' own; here pixels
of the ground among blockers have 4, since the relief hides the lamp too, and so do all that show an
object, whose shadows are not judged.

The paper expects blurred bounds to help against ringing where bounds jump from pixel to pixel. That
is asked of the pixels beside which the filter's width jumps twofold, in a window of 96 x 96 pixels
with most penumbra, with 20 seeds: bounds blurred by a Gaussian of 1 or 2 pixels, and `smoothed`
ones, which are widened first, so that they still hold what they held. Panel (g) has those blurred
by 1.
"""

from __future__ import annotations

import numpy as np

from figures.e11.shared import bounds, compared, limits, space
from figures.spread import spread
from figures.style import Drawing
from figures.verdicts import Measurement, Statement, at_least, at_most
from firstorder import plotting
from firstorder.shadowfield.rendering.sheared_filter import sheared_shadow

BAND = 1.0
OWN = (4, 4)
MILLIMETRE = 1e-3  # ranges below are one


def draw(quick: bool) -> Drawing:
    side, rays = (space.QUICK_SIDE, space.QUICK_RAYS) if quick else (space.SIDE, space.RAYS)
    scene = space.array(side, 120 if quick else 500)
    true = space.reference(scene, rays)
    compared.warm()
    plain = compared.stratified(scene, true)
    one = compared.judged(scene, true, plain, 1.0, BAND, own=OWN)
    smooth = _blurred(scene, one.found)
    ground = limits.ground_of(scene, true, rays, OWN[0])
    part = limits.window(ground.picture(ground.true), side * 3 // 8)
    ways = bounds.compared(ground, part, 1.0, BAND, 3 if quick else 20)
    floor = compared.ground_of(scene)
    depth = scene.picture(scene.lamp.local(scene.receivers)[:, 2])
    near, far = (np.where(np.isfinite(a), a, np.nan) for a in (one.found.near, one.found.far))

    figure, axes = plotting.panels(2, 4, 3.0, 3.0)
    light = np.sqrt(scene.picture(scene.light()))  # as it is looked at
    grey = dict(cmap="gray", vmin=0.0, vmax=1.0)
    space.show(axes[0, 0], light * np.sqrt(one.found.visible), "a) 1 shared ray", **grey)
    space.show(axes[0, 1], light * np.sqrt(true), f"b) {rays} stratified rays", **grey)
    same = dict(cmap="viridis", vmin=float(np.nanmin(near)), vmax=float(np.nanmax(far)))
    space.show(axes[0, 2], near, "c) first blockers' depth", **same)
    drawn = space.show(axes[0, 3], far, "d) last blockers' depth", **same)
    figure.colorbar(drawn, ax=axes[0, 3], shrink=0.75, label="m")
    with np.errstate(divide="ignore", invalid="ignore"):
        decades = np.log10(one.found.samples)
    shown = dict(cmap="viridis", vmin=0.0)
    drawn = space.show(axes[1, 0], decades, "e) effective rays", **shown)
    figure.colorbar(drawn, ax=axes[1, 0], shrink=0.75, label="log$_{10}$")
    signed = dict(cmap=plotting.SIGNED, vmin=-0.2, vmax=0.2)
    for ax, image, title in (
        (axes[1, 1], one.found.visible, "f) error, 1 shared"),
        (axes[1, 2], smooth, "g) ... blurred bounds"),
        (axes[1, 3], plain.of(16), "h) ... 16 stratified"),
    ):
        drawn = space.show(ax, np.where(floor, image - true, np.nan), title, **signed)
    figure.colorbar(drawn, ax=axes[1, 3], shrink=0.75)

    arrays = {
        "true": true,
        "shared": one.found.visible,
        "near": one.found.near,
        "far": one.found.far,
        "depth": depth,
        "samples": one.found.samples,
        "blurred": smooth,
    }
    curves = {"stratified": {"rays": np.array(compared.COUNTS), "rms": plain.rms}}
    size = f"{side} x {side} pixels, {scene.triangles} triangles, reference of {rays} rays"
    return Drawing(figure, arrays, _claims(one, ways, near, far), curves, size, 0)


def _blurred(scene: space.Scene, found: compared.Shared) -> np.ndarray:
    """The image by the same rays with bounds that are blurred by one pixel."""
    floor = scene.floor
    both = tuple(a.ravel()[floor] for a in (found.near, found.far))
    own = space.own_rays(scene, floor, OWN[0], [0, 1])
    points, limit = scene.receivers[floor], 0.5 * BAND / float(np.max(scene.lamp.half))
    answer = sheared_shadow(
        scene.lamp, found.table, points, limit, scene.pixel, own, falloff=space.falloff,
        bounds=space.blended_bounds(scene, floor, both, 1.0),
    )  # fmt: skip
    return scene.picture(answer.visible, floor)


def _claims(one: compared.Judged, ways, near, far) -> list[Statement | Measurement]:
    some = np.isfinite(near) & np.isfinite(far)
    low, high = np.percentile((far - near)[some], [5.0, 95.0])
    seeds = len(ways.share[bounds.JUMPS])
    found = [
        *compared.error_measurements(1.0, one),
        Measurement("Effective rays at 1 a pixel", one.effective, "rays"),
        Statement(
            "The range of the occluders' depths varies by large amounts from pixel to pixel: 95th "
            "over 5th percentile",
            "large amounts",
            high / max(low, MILLIMETRE),
            at_least(2.0, "'by large amounts': twofold"),
            "E11 §6.3",
            "times",
        ),
    ]
    for way in (*bounds.BLURRED, bounds.WIDENED):
        at_jumps, everywhere = (
            ways.ratio(way, bounds.PLAIN, k) for k in (bounds.JUMPS, bounds.ALL)
        )
        found += [
            Statement(
                "Blurring the bounds helps where they jump, 1 ray a pixel: RMS error there with "
                f"bounds {way}, over that without",
                "would help",
                at_jumps[0],
                at_most(1.0, "'help to alleviate': a smaller error beside jumps"),
                "E11 §7",
                "times",
                at_jumps[1],
                f"{seeds} seeds",
                bounds.REASONS[way == bounds.WIDENED],
            ),
            Measurement(f"The same on all ground, {way}", everywhere[0], "times", everywhere[1]),
        ]
    share = spread(ways.share[bounds.JUMPS])
    return [*found, Measurement("Pixels beside a jump", share[0], "of the ground", share[1])]
