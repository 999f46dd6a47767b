"""E11 Fig. 10: quality against rays: the grids of Fig. 9 and the plant of Fig. 1, closeups.

The paper gives two numbers: at one ray a pixel the largest error is below 6 %, and at four it is
"almost 0 everywhere", which is read as 2 %. Its image is of some 1,000 x 1,000 pixels. So the
closeup of the grids is 192 x 192 of 1,024 x 1,024 pixels, all of which are judged with 20 seeds
(the largest error of every sixth both ways is a third lower), against 4,096 stratified rays, whose
own error is .08 % RMS, .3 % the largest (of 1,024 it is .23 and .9 %, near that of 4 shared rays);
the ground up to 64 pixels beside it traces rays, too. From 16 rays for a pixel of 256 x 256 on
bounds of depths look where filters look (`depths_under_filter`). The light band limit is 2 cycles
across the lamp at one ray for each pixel of 256 x 256, of which these are 16, and grows with the
fourth root of the rays; the cells of the lamp are 4 x 4 up to 4 rays for each of those, 8 x 8 to
16, 16 x 16 above: what `methods` has for all figures. Pixels of the ground among blockers get 64
rays besides; they are counted.

The plant is shown at 256 x 256. Its "spotting" is what differs between 20 seeds, judged on every
eighth pixel both ways: the error without what all of them have in common, at the same band limit
for few rays and for more.

The last panel has all methods against their budget, on the grids at 256 x 256 pixels, against 2,048
stratified rays. A filter of the same size on the ground holds a sixteenth of the closeup's rays, so
that errors are larger there, and largest in the pixels at the grids' feet, which the closeup does
not show: there the filter is as narrow as a pixel. What holds the error up is taken apart in
`e11_floors`, on another scene. The axis-aligned filter converges as its width shrinks. Photons take
k ~ N^(2/3), which is best where light is smooth and would give N^(-1/3); here the ends of penumbrae
are in view, where N^(-1/4) is the best to be had for many photons. Wavelets take no fewer than two
samples a pixel. Times are the processor's, of stratified rays and of 1 shared one in turns, at the
RMS error of the latter on every fourth pixel both ways. The reference's own error is continued from
the stratified rays' slope and drawn as a line.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from matplotlib.patches import Rectangle

from figures.e11.shared import compared, measures, methods
from figures.e11.shared import space as e11
from figures.spread import spread
from figures.style import Drawing
from figures.verdicts import OURS, Measurement, Statement, at_least, at_most
from firstorder import plotting

SEED = 10
SHOWN = (0.25, 1, 4)
# Corners of the closeups and their widths, in widths of the image.
CLOSEUPS = {"grids": ((0.65, 0.2), 0.1875), "plant": ((0.5, 0.28), 0.25)}
EDGE, QUICK_EDGE = 64, 8  # pixels around that of the grids that trace rays
BUDGETS = {
    "stratified": (1, 4, 16, 64, 256),
    "shared rays": (0.25, 1, 4, 16),
    "shared rays, limit held": (1, 4, 16),
    "axis-aligned": (0.25, 1, 4, 16),
    "photons": (1, 4, 16),
    "wavelets": (4, 8, 32),
}
QUICK = {name: counts[:3] for name, counts in BUDGETS.items()}
REDS, TOP = plotting.MAGNITUDE, 0.15  # errors are drawn up to here


def draw(quick: bool) -> Drawing:
    side, rays = (e11.QUICK_SIDE, e11.QUICK_RAYS) if quick else (e11.SIDE, e11.RAYS)
    methods.warm()
    scenes = {"grids": e11.grids(side), "plant": e11.plant(side, quick)}
    true = {name: _ground(scene, e11.reference(scene, rays)) for name, scene in scenes.items()}
    answers = {
        name: [methods.ours(scene, n, SEED) for n in SHOWN] for name, scene in scenes.items()
    }
    budgets = QUICK if quick else BUDGETS
    curves = _curves(scenes["grids"], true["grids"], budgets, answers["grids"])
    off = {
        name: [measures.errors(a.visible, true[name][scenes[name].floor]) for a in found]
        for name, found in answers.items()
    }
    dense = _dense(quick)

    figure, axes = plotting.panels(3, 8, 2.0, 2.1)
    _draw_row(axes[0], dense.images, dense.true)
    _draw_row(axes[1], *_cut(scenes["plant"], true["plant"], answers["plant"]))
    for ax in axes[2]:
        ax.remove()
    grid = axes[2, 0].get_gridspec()
    where = curves["stratified"]
    falls = measures.slope(list(where), list(where.values()))
    floor_of = where[max(where)] * (rays / max(where)) ** falls
    _draw_curves(figure.add_subplot(grid[2, :5]), figure.add_subplot(grid[2, 7]), curves, floor_of)
    _draw_whole(figure.add_subplot(grid[2, 5]), scenes["plant"], true["plant"], "plant")
    _draw_whole(figure.add_subplot(grid[2, 6]), scenes["grids"], true["grids"], "grids")
    columns = {
        name.replace(",", ""): {"rays": list(c), "rms": list(c.values())}
        for name, c in curves.items()
    }
    arrays = {f"{name} reference": scenes[name].picture(true[name]) for name in scenes}
    for name, found in answers.items():
        for n, a in zip(SHOWN, found, strict=True):
            arrays[f"{name} {n}"] = scenes[name].picture(a.visible, scenes[name].floor)
    arrays["closeup reference"] = dense.true
    arrays |= {f"closeup {n}": a for n, a in zip(SHOWN, dense.images, strict=True)}
    claims = _claims(scenes, true, answers, off, curves)
    claims = [*_statements(dense, _spots(scenes["plant"], true["plant"], quick)), *claims]
    claims.append(_speed(scenes["grids"], true["grids"], quick))
    return Drawing(figure, arrays, claims, columns, f"{side} x {side} pixels", SEED)


def _ground(scene, image) -> np.ndarray:
    """Values of all pixels, NaN off the ground."""
    return np.where(scene.floor, image.ravel(), np.nan)


def _curves(scene, true, budgets, known) -> dict[str, dict[float, float]]:
    """RMS of every method by rays for each pixel of the ground, own ones counted in."""
    at = true[scene.floor]
    held = methods.band_of(scene, 1.0)
    have = dict(zip(SHOWN, known, strict=True))
    run = {
        "stratified": lambda n: methods.stratified(scene, n, SEED),
        "shared rays": lambda n: have[n] if n in have else methods.ours(scene, n, SEED),
        "shared rays, limit held": lambda n: (
            have[1] if n == 1 else methods.ours(scene, n, SEED, held)
        ),
        "axis-aligned": lambda n: methods.axis_aligned(scene, n, SEED),
        "photons": lambda n: methods.by_photons(scene, n, SEED)[0],
        "wavelets": lambda n: methods.by_wavelets(scene, n, SEED)[0],
    }
    found: dict[str, dict[float, float]] = {}
    for name, counts in budgets.items():
        pairs = [(a.rays, measures.errors(a.visible, at).rms) for a in map(run[name], counts)]
        found[name] = dict(pairs)
    return found


class Dense(NamedTuple):
    """The closeup of the grids at the paper's density.

    Attributes:
        true: the reference, an image.
        images: by each of `SHOWN`.
        runs: errors of each seed, for 1 and 4 rays.
    """

    true: np.ndarray
    images: list[np.ndarray]
    runs: list[list[measures.Errors]]


def _dense(quick: bool) -> Dense:
    """All pixels of the closeup, for errors of some of them have a lower largest one."""
    side, edge = (4 * e11.QUICK_SIDE, QUICK_EDGE) if quick else (e11.PAPER_SIDE, EDGE)
    (x, y), size = CLOSEUPS["grids"]
    i, j, size = (round(a * side) for a in (x, y, size))
    scene = e11.grids(side, window=(i - edge, j - edge, size + 2 * edge))
    inside = scene.floor & scene.every(1, edge)
    true = e11.own_rays(scene, inside, e11.QUICK_RAYS if quick else 4096, 3)
    part = slice(edge, edge + size)

    def found(rays, seed) -> np.ndarray:
        return methods.ours(scene, rays, seed, judged=inside, dense=e11.DENSE).visible

    def image(values) -> np.ndarray:
        return scene.picture(values, inside)[part, part]

    seeds = range(1, 4 if quick else 21)
    runs = [[measures.errors(found(n, k), true) for k in seeds] for n in (1, 4)]
    return Dense(image(true), [image(found(n, SEED)) for n in SHOWN], runs)


def _spots(scene, true, quick: bool) -> tuple[np.ndarray, np.ndarray]:
    """Of the plant, at 0.25 rays and at 1, what differs between seeds."""
    where, image = scene.every(4 if quick else 8), scene.picture(true)
    runs = [
        compared.repeated(scene, image, n, methods.BAND, 3 if quick else 20, where,
                          own=(methods.OWN, 0))
        for n in (0.25, 1)
    ]  # fmt: skip
    return runs[0].noise, runs[1].noise


def _speed(scene, true, quick: bool) -> Statement:
    """Whether shared rays win by time, too."""
    image, where, seeds = scene.picture(true), scene.every(4), 3 if quick else 20
    some = compared.repeated(scene, image, 1, methods.BAND, seeds, where, own=(methods.OWN, 0))
    rms = compared.stratified_rms(scene, some, where)
    equal = spread(compared.equal_stratified(some, rms))
    speed = compared.speedup(scene, equal, 1, methods.BAND, 9)
    return Statement(
        "Time of stratified rays over that of 1 shared ray a pixel, at equal RMS error, grids",
        None,
        speed.mean,
        at_least(1.0, "faster at equal error"),
        OURS,
        "times",
        speed.error,
        "rounds in turns",
        "Shared rays save fewer rays than the filter costs.",
    )


def _cut(scene, true, answers) -> tuple[list[np.ndarray], np.ndarray]:
    """Closeups of an image, and of the reference."""
    (x, y), size = CLOSEUPS[scene.name]
    i, j, n = (round(a * scene.side) for a in (x, y, size))
    part = slice(i, i + n), slice(j, j + n)
    return [scene.picture(a.visible, scene.floor)[part] for a in answers], scene.picture(true)[part]


def _draw_row(axes, images, at) -> None:
    """Closeups and their errors, at each number of rays, and the reference."""
    ground = np.isfinite(at)
    for k, (rays, image) in enumerate(zip(SHOWN, images, strict=True)):
        e = measures.errors(image, at, ground)
        e11.show(axes[2 * k], image, f"{rays:g} a pixel", cmap="gray", vmin=0.0, vmax=1.0)
        title = f"rms {100 * e.rms:.1f} %"
        e11.show(axes[2 * k + 1], abs(image - at), title, cmap=REDS, vmin=0.0, vmax=TOP)
        axes[2 * k + 1].set_xlabel(f"largest {100 * e.largest:.0f} %")
    e11.show(axes[6], at, "reference", cmap="gray", vmin=0.0, vmax=1.0)
    axes[7].axis("off")
    axes[7].figure.colorbar(
        axes[5].images[0], ax=axes[7], location="left", label="error, share of light"
    )
    for ax in axes[:7]:
        ax.set_facecolor("#5b6b86")


def _draw_curves(ax, names, curves, floor: float) -> None:
    """All methods against their budgets; their names in an axis of their own."""
    for (name, points), colour in zip(curves.items(), plotting.COLOURS, strict=True):
        ax.loglog(list(points), list(points.values()), "o-", color=colour, markersize=3,
                  linewidth=1.1, label=name)  # fmt: skip
    ax.axhline(floor, color="0.6", linestyle=":", linewidth=1.0)
    ax.text(ax.get_xlim()[0] * 1.1, floor * 1.1, "the reference's own error", fontsize=7)
    ax.set(title="grids: RMS error against budget", xlabel="rays or photons for a pixel",
           ylabel="RMS, share of light")  # fmt: skip
    names.axis("off")
    names.legend(*ax.get_legend_handles_labels(), loc="center left")


def _draw_whole(ax, scene, true, name: str) -> None:
    """The whole image, and where the closeup is."""
    e11.show(ax, scene.picture(true), name, cmap="gray", vmin=0.0, vmax=1.0)
    ax.set_facecolor("#5b6b86")
    (x, y), size = CLOSEUPS[name]
    size *= scene.side
    ax.add_patch(Rectangle((x * scene.side, y * scene.side), size, size, fill=False,
                           edgecolor=plotting.COLOURS[1], linewidth=1.2))  # fmt: skip


def _statements(dense: Dense, spots) -> list[Statement | Measurement]:
    one, four = (np.array([[e.rms, e.largest] for e in runs]).T for runs in dense.runs)
    largest = [spread(100.0 * a[1]) for a in (one, four)]
    falls, removed = spread(four[0] / one[0]), spread(spots[1] / spots[0])
    scanned = f"a closeup of 1,024 x 1,024 pixels, {one.shape[1]} seeds"
    return [
        Statement(
            "With only 1 ray a pixel the maximum pixel error is less than 6 %, grids",
            6.0,
            largest[0][0],
            at_most(6.0, "the paper's 6 %"),
            "E11 §6.1",
            "% of light",
            largest[0][1],
            scanned,
            "The largest error stands at the grids' feet, where blockers are near, the "
            "filter is as "
            "narrow as a pixel, and no ray has found some blockers yet.",
        ),
        Statement(
            "4 samples reduce the error almost to 0 everywhere in the image: largest error, grids",
            "almost 0",
            largest[1][0],
            at_most(2.0, "'almost 0': 2 % of the light"),
            "E11 §6.1",
            "% of light",
            largest[1][1],
            scanned,
            "At the grids' feet the filter is narrow, and few rays are under it.",
        ),
        Statement(
            "As the quality increases to 4 samples we are converging: RMS error over that of "
            "1 ray, "
            "grids",
            "converging",
            falls[0],
            at_most(1.0, "'converging': a smaller error"),
            "E11 Fig. 10",
            "times",
            falls[1],
            scanned,
        ),
        Statement(
            "Most of the spotting is removed by going from 0.25 rays up to 1: noise over that of "
            "0.25, plant",
            "most",
            removed[0],
            at_most(0.5, "'most is removed': half of it or less is left"),
            "E11 §6.2",
            "times",
            removed[1],
            f"{len(spots[0])} seeds",
            "Four times the rays in the same filter leave half of the noise of independent rays.",
        ),
        Measurement("Noise of the plant at 0.25 rays", *_percent(100.0 * spots[0])),
        Measurement("RMS error at 1 ray in the closeup, grids", *_percent(100.0 * one[0])),
        Measurement("RMS error at 4 rays in the closeup, grids", *_percent(100.0 * four[0])),
    ]


def _percent(values) -> tuple[float, str, float]:
    mean, error = spread(values)
    return mean, "% of light", error


def _claims(scenes, true, answers, off, curves) -> list[Measurement]:
    """Of the images of 256 x 256 pixels."""
    found = []
    plain = curves["stratified"]
    for name, scene in scenes.items():
        for n, a, e in zip(SHOWN, answers[name], off[name], strict=True):
            at = f"{n:g} shared ray{'s' * (n != 1)} a pixel"
            text = ", ".join(f"{100 * x:.2f}" for x in e)
            found.append(
                Measurement(
                    f"{name}, {at}: RMS, 99th percentile, largest error", text, "% of light"
                )
            )
            if n == 1:
                some = measures.effective(a.samples, true[name][scene.floor])
                about = f"{name}: effective rays in the penumbra at 1 ray a pixel"
                found.append(Measurement(about, some, "rays"))
    for n, a, e in zip(SHOWN, answers["grids"], off["grids"], strict=True):
        equal = measures.equal_rays(list(plain), list(plain.values()), e.rms)
        about = f"grids: stratified rays of the RMS of {n:g} shared, and these with own ones"
        found.append(Measurement(about, f"{equal.text} and {a.rays:.3g}", "rays a pixel"))
    for name, points in curves.items():
        rms = np.array(list(points.values()))
        text = ", ".join(f"{100 * r:.2f}" for r in rms)
        about = f"grids, {name}: RMS at each budget, and exponent from the first to the last"
        slope = measures.slope(list(points), rms)
        found.append(Measurement(about, f"{text}; {slope:.2f}", "% of light"))
    return found
