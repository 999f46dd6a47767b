"""D05 Fig. 16: the criterion without and with blockers, and the samples that follow it.

The scene is `d05.shared.creatures`, shaded as `d05.shared.shading` says; criteria are
`d05.shared.sampling`'s. The density is the bandwidth itself, as the paper has "a set of image
samples given a bandwidth map" (Fig. 17 scans its powers), and a tenth of the samples anywhere. The
mean distance of blockers is found as in the paper from 100 rays at 20,000 points, between which
slopes are linear over triangles. Beside the paper's criterion stands what it asks for at its end,
slopes weighted by the light, which also counts the diffuse lobe and the band of the light.

"Increased in areas of ...": median density in the upper quarter of that quantity over the rest,
seen from twelve sides at a quarter of the resolution. The criterion is also judged by where a
uniform image errs, linear over a triangulation: rank correlation over blocks of 10 x 10 pixels,
whose errors are root mean squares, for 20 seeds of the samples.
"""

from __future__ import annotations

import numpy as np
from scipy.stats import spearmanr

from figures.d05.shared import creatures, shading
from figures.d05.shared import sampling as shared
from figures.d05.shared.readings import ALIKE
from figures.r07.shared.look import BRASS, CLAY, SLATE, WOOD, look, show_levels
from figures.r07.shared.table import show
from figures.spread import spread
from figures.style import Drawing
from figures.verdicts import OURS, Measurement, Statement, at_least, at_most
from firstorder import plotting
from firstorder.bandwidth import pixel_rates as maps
from firstorder.imaging.camera import pinhole

TINTS = {"floor": WOOD, "creature": SLATE, "ball": BRASS, "box": CLAY}
SIDE = 10  # of the blocks over which a criterion is compared with errors [pixels]


def draw(quick: bool) -> Drawing:
    world, count = creatures.world(quick), shared.budget(quick)
    view = shading.view(world)
    truth = shading.reference(world).sum(-1)
    found = shared.criteria(world, view, count, share=1.0)
    density = {name: shared.spread(B) for name, B in found.maps.items()}
    samples = {name: shared.chosen(d, count) for name, d in density.items()}

    figure, axes = plotting.panels(2, 4, 4.3, 2.8)
    picture = _picture(world, view, truth)
    show_levels(axes[0, 0], picture, "a) the scene")
    _criterion(axes[1, 0], found.maps["mirror"], "e) without blockers (cycles per pixel)")
    distance = 1.0 / np.maximum(found.plain, 1e-3)
    met = view.shows >= 0
    drawn = show(axes[0, 1], np.where(met, np.log10(distance), np.nan),
                 "b) harmonic mean distance of blockers (m)", vmin=-0.5, vmax=1.5)  # fmt: skip
    _decades(figure, axes[0, 1], drawn, (-0.5, 0.0, 0.5, 1.0, 1.5))
    _criterion(axes[0, 2], found.maps["plain"], "c) with blockers, as the paper has it")
    _criterion(axes[1, 2], found.maps["light"], "g) with blockers, weighted by light")
    for ax, name, title in ((axes[0, 3], "plain", "d) samples for c"),
                            (axes[1, 3], "light", "h) samples for g"),
                            (axes[1, 1], "mirror", "f) samples for e")):  # fmt: skip
        faint = (0.35 * picture + 0.65 * 255.0).astype(np.uint8)
        ax.imshow(faint, extent=(0, world.columns, 0, world.rows), origin="upper")
        ax.plot(*(samples[name] + 0.5).T, ",", color="0.05", alpha=0.8)
        ax.set(title=f"{title}: {len(samples[name]):,}", xticks=[], yticks=[],
               xlim=(0, world.columns), ylim=(0, world.rows), aspect="equal")  # fmt: skip
    claims = [
        *_increased(quick),
        *_differences(world, view, found),
        *_judged(view, truth, found, count, 3 if quick else 20),
    ]
    arrays = {**found.maps, "plain_slope": found.plain,
              **{f"samples {k}": v for k, v in samples.items()}}  # fmt: skip
    size = f"{world.columns} x {world.rows} pixels, {count} samples, {shared.RAYS} rays at as many"
    return Drawing(figure, arrays, claims, {}, size, 0)


def _picture(world, view, truth) -> np.ndarray:
    """The scene in tints, levels of a screen."""
    names = world.rays.scene.names
    tints = np.array([TINTS.get(name, (1.0, 1.0, 1.0)) for name in names])
    return look(truth, np.asarray(view.shows), tints).levels(truth)


def _criterion(ax, values, title: str) -> None:
    with np.errstate(divide="ignore"):
        shown = np.where(values > 0.0, np.maximum(np.log10(values), -3.0), np.nan)
    drawn = show(ax, shown, title, cmap=plotting.MAGNITUDE, vmin=-3.0, vmax=-0.3)
    ax.set_facecolor("0.92")  # where there is nothing, or nothing varies
    _decades(ax.figure, ax, drawn, (-3.0, -2.0, -1.0))


def _decades(figure, ax, drawn, ticks) -> None:
    bar = figure.colorbar(drawn, ax=ax, shrink=0.8)
    bar.set_ticks(ticks, labels=[f"{10.0**t:.2g}" for t in ticks])


def _increased(quick: bool) -> list[Statement]:
    """Where the paper's density is higher, from all sides."""
    sides = np.linspace(0.0, 2.0 * np.pi, 3 if quick else 12, endpoint=False)
    found = np.array([_ratios(angle, quick) for angle in sides])
    places = ("areas of high curvature", "grazing angles", "near occluders, on the floor")
    return [
        Statement(f"Sampling density is increased at {name}: median over that of the rest",
                  "increased", mean, at_least(1.0, "'increased'"), "D05 §6.2", "times", error,
                  f"{len(sides)} views of the scene")
        for name, (mean, error) in zip(places, map(spread, found.T), strict=True)
    ]  # fmt: skip


def _ratios(angle: float, quick: bool) -> list[float]:
    """Median density where curvature, slant and slopes of blockers are high, over the rest."""
    eye = 4.6 * np.sin(angle) - 0.4, -4.6 * np.cos(angle), 2.3
    world = creatures.world(quick)._replace(camera=pinhole(eye, (0.0, 0.0, 0.45), gamma=2.2))
    if not quick:
        world = world._replace(columns=200, rows=125)
    view = shading.view(world)
    count = view.label.size // 20
    found = shared.criteria(world, view, count)
    density = shared.spread(found.maps["plain"]).ravel()
    at, met = view.at, view.shows.ravel() >= 0
    curved = np.linalg.norm(np.asarray(at.S), 2, axis=(-2, -1))
    body = met & (curved > 0.0)
    floor = met & (view.shows.ravel() == world.floor)
    places = (
        (curved, body),
        (1.0 / np.asarray(at.cosine), body),
        (found.plain.ravel(), floor),
    )
    ratios = []
    for quantity, where in places:
        q, d = quantity[where], density[where]
        upper = q > np.quantile(q, 0.75)
        ratios.append(float(np.median(d[upper]) / np.median(d[~upper])))
    return ratios


def _differences(world, view, found) -> list[Statement | Measurement]:
    """Differences between pixels against the closed form."""
    step = np.asarray(maps.radians_per_pixel(world.camera, view.p, world.side))
    cutoff = np.asarray(found.criterion.gloss).ravel()
    exact = np.asarray(maps.glossy_bandwidth_map(cutoff, view.at)) * step
    own = found.maps["mirror"].ravel()
    met = (view.shows.ravel() >= 0) & (own > 0.0)
    off = abs(own / np.where(met, exact, 1.0) - 1.0)[met]
    c, d = np.asarray(view.at.cosine), np.asarray(view.at.distance)
    k = np.max(abs(np.linalg.eigvalsh(np.asarray(view.at.S))), -1)
    printed = 2.0 * k * d / c * cutoff * step
    low = np.mean((printed < (1.0 - ALIKE) * exact)[met])
    return [
        Statement("Differences between pixels include normal angle, distance and anisotropy for "
                  "free: off the closed form in space, median", "included for free",
                  float(np.median(off)), at_most(ALIKE, "'included': a tenth"), "D05 §6.2"),
        Measurement("... 95 % of pixels are below", float(np.quantile(off, 0.95))),
        Statement("(20) as printed is an approximate bound: share of pixels on which it is more "
                  "than a tenth below the closed form in space", 0.0, float(low),
                  at_most(0.0, "a bound"), "D05 (20)",
                  reason="The eye's own turn is left out: on all that is flat, floor and box, the "
                  "printed bound is nothing, and the image of the mirrored sky is not (Fig. 15)."),
        Measurement("(20) as printed over the closed form in space, median on what is curved",
                    float(np.median((printed / exact)[met & (k > 0.0)]))),
    ]  # fmt: skip


def _judged(view, truth, found, count, seeds: int) -> list[Statement | Measurement]:
    """Rank correlation with the errors of uniform images."""
    rank = {name: [] for name in found.maps}
    for seed in range(seeds):
        even = np.ones(truth.shape)
        made = shared.image(view, truth, even, count, "delaunay", seed)
        error = _blocks((made - truth) ** 2).ravel()
        for name, B in found.maps.items():
            rank[name].append(float(spearmanr(error, _blocks(B).ravel())[0]))
    gain, error = spread(np.array(rank["plain"]) - np.array(rank["mirror"]))
    return [
        *(Measurement(f"Rank correlation of criterion and error of a uniform image: {words}",
                      *_with_error(rank[name])) for name, words in shared.WORDS.items()),
        Statement("The criterion with blockers foretells where a uniform image errs better than "
                  "that without: by", None, gain, at_least(0.0, "'better'"), OURS,
                  "of the rank correlation", error, f"{seeds} seeds of the samples"),
    ]  # fmt: skip


def _with_error(values) -> tuple[float, str, float]:
    """Mean, no unit, standard error."""
    mean, error = spread(values)
    return mean, "", error


def _blocks(values: np.ndarray) -> np.ndarray:
    w, h = (n // SIDE for n in values.shape)
    return values[: w * SIDE, : h * SIDE].reshape(w, SIDE, h, SIDE).mean((1, 3))
