"""E11 Fig. 12: a wide array of blockers over curved ground with a fine relief, 1 ray a pixel.

The paper's models cannot be had; ours are 49 knots, blobs, bumpy balls and grids at random heights
and turns, 0.7 M triangles in all (`e11.shared.space`). Light band limit: 1 wavelength per side of
the lamp. Shown are, as in the paper, the bounds of the blockers' depths that each pixel's frustum
has, and how many rays its filter weighs. The paper's figure has no rays of pixels' own; here pixels
of the ground among blockers have 4, since the relief hides the lamp too, and so do all that show an
object, whose shadows are not judged.

The paper expects smoothed bounds to help against ringing where bounds jump. Smoothed over one pixel
they take the steps out of the image, but not out of the error: bounds can only grow, so that
filters become narrower and somewhat noisier.
"""

from __future__ import annotations

import numpy as np

from figures.e11.shared import compared, space
from figures.style import Claim, Drawing
from firstorder import plotting

BAND = 1.0
OWN = (4, 4)


def draw(quick: bool) -> Drawing:
    side, rays = (space.QUICK_SIDE, space.QUICK_RAYS) if quick else (space.SIDE, space.RAYS)
    scene = space.array(side, 120 if quick else 500)
    true = space.reference(scene, rays)
    compared.warm()
    plain = compared.stratified(scene, true)
    one = compared.judged(scene, true, plain, 1.0, BAND, own=OWN)
    smooth = compared.judged(scene, true, plain, 1.0, BAND, own=OWN, radius=1)
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
        (axes[1, 2], smooth.found.visible, "g) ... smoothed bounds"),
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
        "smoothed": smooth.found.visible,
    }
    curves = {"stratified": {"rays": np.array(compared.COUNTS), "rms": plain.rms}}
    size = f"{side} x {side} pixels, {scene.triangles} triangles, reference of {rays} rays"
    return Drawing(figure, arrays, _claims(one, smooth, near, far), curves, size, 0)


def _claims(one: compared.Judged, smooth: compared.Judged, near, far) -> list[Claim]:
    some = np.isfinite(near) & np.isfinite(far)
    low, high = np.percentile((far - near)[some], [5.0, 95.0])
    return [
        *compared.error_claims(1.0, one),
        Claim("Effective rays at 1 a pixel", None, one.effective, "rays"),
        Claim(
            "Range of blockers' depths of a pixel, 5th and 95th percentile",
            "varies by large amounts",
            f"{low:.3g} and {high:.3g}",
            "m",
            high > 2.0 * low,
        ),
        Claim(
            "RMS error with bounds smoothed over one pixel, over that without",
            "blurring would help",
            smooth.off.rms / one.off.rms,
            "times",
            smooth.off.rms < one.off.rms,
        ),
    ]
