"""E11 Fig. 13: a plant and other things over a relief: errors by rays a pixel, and where time goes.

The paper's models cannot be had; ours are a tree of 150,000 triangles, a knot, a grid, a blob and a
bumpy ball over displaced ground, 0.5 M triangles in all (`e11.shared.space`). Light band limit: 1
wavelength per side of the lamp; bounds of depths by each pixel's frustum. As in the paper's figure,
pixels of the ground among blockers have 4 rays of their own, and all of the objects'; they are
counted. Errors are those of the ground.

At one band limit errors stop falling: what is left is the blur of the filter, and of the few own
rays. (g) shows that it goes with the band limit, as in the paper's Fig. 16: a low one is best for
few rays, a high one for many, and that is judged there; pixels among blockers have 64 own rays, and
every third pixel both ways is judged. What is left of it at
16 rays is threefold, and taken apart in `e11_floors`: bounds of depths know the pixel's frustum,
and filters look beyond it, which is the most of it and can be cured; filters are at least half a
pixel wide, and the reference is of points; and answers are told by 4 x 4 cells of the lamp: 8 x 8
take 7, 17 and 22 % off the error at band limits of 2, 4 and 8 (16 rays, 96 x 96 pixels), but want
more rays to fill them. That is not for the light's falloff alone: under an even lamp, behind bars
at two depths, the mean of eight runs is off by .0131, .0090 and .0069 with 4, 8 and 16 cells a side
(16 rays, 16 cycles/m).

The paper says nothing of this figure but that it shows the method's robustness, so that all numbers
are measured and none is judged. Times are judged in Figs. 1 and 11, for which the paper gives some.
"""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from figures.e11.shared import compared, picture, space
from figures.style import Drawing
from figures.verdicts import Measurement
from firstorder import plotting

BAND = 1.0
BUDGETS = (0.25, 1.0, 4.0)
BANDS = (1.0, 2.0, 4.0)  # whose errors are plotted, with one more budget
MOST = 16.0
OWN = (4, 4)


def draw(quick: bool) -> Drawing:
    side, rays = (space.QUICK_SIDE, space.QUICK_RAYS) if quick else (space.SIDE, space.RAYS)
    scene = space.gathering(side, *((1000, 100) if quick else ()))
    true = space.reference(scene, rays)
    compared.warm()
    plain = compared.stratified(scene, true)
    each = [compared.judged(scene, true, plain, b, BAND, own=OWN) for b in BUDGETS]
    floor = compared.ground_of(scene)
    bands = {}
    for band in BANDS:
        more = [
            compared.repeated(scene, true, b, band, 1, scene.every(3), own=(64, 0))
            for b in (*BUDGETS, MOST)
        ]
        bands[f"{band:g}"] = np.array([some.rms[0] for some in more])

    edges = dict(left=0.015, right=0.985, top=0.96, bottom=0.1)
    figure = Figure(figsize=(12.8, 7.5))  # laid out by hand, so that all gaps are alike
    gaps = dict(wspace=0.22, hspace=0.42)
    axes = figure.subplots(2, 4, squeeze=False, gridspec_kw=edges | gaps)
    light = np.sqrt(scene.picture(scene.light()))  # as it is looked at
    grey = dict(cmap="gray", vmin=0.0, vmax=1.0)
    space.show(axes[0, 0], light * np.sqrt(true), f"a) {rays} stratified rays", **grey)
    space.show(axes[0, 1], light * np.sqrt(each[1].found.visible), "b) 1 shared ray", **grey)
    signed = dict(cmap=plotting.SIGNED, vmin=-0.15, vmax=0.15)
    for ax, letter, budget, one in zip(
        (axes[0, 2], axes[0, 3], axes[1, 0]), "cde", BUDGETS, each, strict=True
    ):
        off = np.where(floor, one.found.visible - true, np.nan)
        drawn = space.show(ax, off, f"{letter}) error, {budget:g} shared", **signed)
        picture.scale_below(ax, drawn, "share of the light")
    off = np.where(floor, plain.of(16) - true, np.nan)
    drawn = space.show(axes[1, 1], off, "f) error, 16 stratified", **signed)
    picture.scale_below(axes[1, 1], drawn, "share of the light")
    _errors(axes[1, 2], plain, bands)
    _times(axes[1, 3], each)

    spent = np.array([[one.found.tracing, one.found.filtering] for one in each])
    curves = {
        "shared": {
            "rays": np.array([one.found.floor_rays for one in each]),
            "rms": np.array([one.off.rms for one in each]),
            "percentile 99": np.array([one.off.percentile99 for one in each]),
            "largest": np.array([one.off.largest for one in each]),
            "effective": np.array([one.effective for one in each]),
            "tracing": spent[:, 0],
            "filtering": spent[:, 1],
        },
        "stratified": {"rays": np.array(compared.COUNTS), "rms": plain.rms},
        "bands": {"rays": np.array([*BUDGETS, MOST])} | bands,
    }
    arrays = {"true": true} | {
        f"shared {b:g}": one.found.visible for b, one in zip(BUDGETS, each, strict=True)
    }
    size = f"{side} x {side} pixels, {scene.triangles} triangles, reference of {rays} rays"
    return Drawing(figure, arrays, _claims(each, bands), curves, size, 0)


def _errors(ax, plain: compared.Stratified, bands: dict[str, np.ndarray]) -> None:
    ax.loglog(compared.COUNTS, plain.rms, "s--", label="stratified")
    for band, rms in bands.items():
        ax.loglog([*BUDGETS, MOST], rms, "o-", label=f"band limit {band}")
    ax.set(title="g) RMS error on the ground", xlabel="rays for each pixel", box_aspect=1.0)
    ax.legend()


def _times(ax, each: list[compared.Judged]) -> None:
    tracing = np.array([one.found.tracing for one in each])
    filtering = np.array([one.found.filtering for one in each])
    x = np.arange(len(each))
    ax.bar(x, tracing, label="tracing")
    ax.bar(x, filtering, bottom=tracing, label="filtering")
    ax.set_xticks(x, [f"{b:g}" for b in BUDGETS])
    ax.set(title="h) processor time [s]", xlabel="shared rays for each pixel", box_aspect=1.0)
    ax.legend()


def _claims(each: list[compared.Judged], bands: dict[str, np.ndarray]) -> list[Measurement]:
    claims = []
    for budget, one in zip(BUDGETS, each, strict=True):
        claims += compared.error_measurements(budget, one)
        spent = one.found.tracing + one.found.filtering
        claims += [
            Measurement(f"Effective rays at {budget:g} a pixel", one.effective, "rays"),
            Measurement(
                f"Share of the time that is tracing at {budget:g} rays a pixel",
                one.found.tracing / spent,
            ),
        ]
    rms = np.array([one.off.rms for one in each])
    falls = f"{rms[0] / rms[1]:.3g} and {rms[1] / rms[2]:.3g}"
    low, high = (bands[f"{BANDS[k]:g}"] for k in (0, -1))
    name = "RMS error of a high band limit over that of a low one"
    return [
        *claims,
        Measurement("RMS error falls with the steps of rays by", falls, "times"),
        Measurement(f"{name} at 0.25 shared rays", high[0] / low[0], "times"),
        Measurement(f"{name} at 16 shared rays", high[-1] / low[-1], "times"),
    ]
