"""D05 Fig. 16: the criterion without and with blockers, and the samples that follow it.

The scene is `d05.shared.creatures`, shaded as `d05.shared.shading` says; criteria are
`d05.shared.sampling`'s. The paper leaves open what power of the bandwidth the density is: here the
bandwidth itself, which gave the smallest errors (Fig. 17 compares), and a tenth of the samples
anywhere. The mean distance of blockers is found as in the paper from 100 rays at 20,000 points and
spread over the image by the filter of Fig. 17. Beside the paper's criterion stands what it asks for
at its end, slopes weighted by the light, which also counts the diffuse lobe and the band of the
light.

"Increased in areas of ...": median density in the upper quarter of that quantity over the rest.
The criterion is also judged by where a uniform image errs: rank correlation over blocks of 10 x 10
pixels, whose errors are root mean squares.
"""

from __future__ import annotations

import numpy as np
from scipy.stats import spearmanr

from figures.d05.shared import creatures, shading
from figures.d05.shared import sampling as shared
from figures.r07.shared.table import show
from figures.style import Claim, Drawing
from firstorder import plotting
from firstorder.bandwidth import pixel_rates as maps
from firstorder.reconstruction.bilateral import bilateral_widths

SIDE = 10  # of the blocks over which a criterion is compared with errors [pixels]


def draw(quick: bool) -> Drawing:
    world, count = creatures.world(quick), shared.budget(quick)
    view = shading.view(world)
    truth = shading.reference(world).sum(-1)
    found = shared.criteria(world, view, count)
    density = {name: shared.spread(B) for name, B in found.maps.items()}
    samples = {name: shared.chosen(d, count) for name, d in density.items()}

    figure, axes = plotting.panels(2, 3, 4.4, 2.9)
    _criterion(axes[0, 0], found.maps["mirror"], "a) without blockers (cycles per pixel)")
    distance = 1.0 / np.maximum(found.plain, 1e-3)
    drawn = show(axes[0, 1], np.where(view.shows >= 0, np.log10(distance), np.nan),
                 "b) harmonic mean distance of blockers (m)", vmin=-0.5, vmax=1.5)  # fmt: skip
    _decades(figure, axes[0, 1], drawn, (-0.5, 0.0, 0.5, 1.0, 1.5))
    _criterion(axes[0, 2], found.maps["plain"], "c) with blockers, as the paper has it")
    _criterion(axes[1, 0], found.maps["light"], "d) with blockers, weighted by light")
    for ax, name, title in ((axes[1, 1], "plain", "e) samples for c"),
                            (axes[1, 2], "light", "f) samples for d")):  # fmt: skip
        ax.plot(*(samples[name] + 0.5).T, ",", color="0.1", alpha=0.8)
        ax.set(title=f"{title}: {len(samples[name]):,}", xticks=[], yticks=[],
               xlim=(0, world.columns), ylim=(0, world.rows), aspect="equal")  # fmt: skip
    claims = [
        *_increased(world, view, found, density["plain"]),
        *_differences(world, view, found),
        *_judged(view, truth, found, count),
    ]
    arrays = {**found.maps, "plain_slope": found.plain,
              **{f"samples {k}": v for k, v in samples.items()}}  # fmt: skip
    size = f"{world.columns} x {world.rows} pixels, {count} samples, {shared.RAYS} rays at as many"
    return Drawing(figure, arrays, claims, {}, size, 0)


def _criterion(ax, values, title: str) -> None:
    with np.errstate(divide="ignore"):
        drawn = show(ax, np.log10(values), title, cmap=plotting.RADIANCE, vmin=-3.0, vmax=-0.3)
    _decades(ax.figure, ax, drawn, (-3.0, -2.0, -1.0))


def _decades(figure, ax, drawn, ticks) -> None:
    bar = figure.colorbar(drawn, ax=ax, shrink=0.8)
    bar.set_ticks(ticks, labels=[f"{10.0**t:.2g}" for t in ticks])


def _increased(world, view, found, density) -> list[Claim]:
    """Where the paper's density is higher."""
    at, met = view.at, view.shows.ravel() >= 0
    curved = np.linalg.norm(np.asarray(at.S), 2, axis=(-2, -1))
    body = met & (curved > 0.0)
    floor = met & (view.shows.ravel() == world.floor)
    places = (
        ("high curvature", curved, body),
        ("grazing angles", 1.0 / np.asarray(at.cosine), body),
        ("near occluders, on the floor", found.plain.ravel(), floor),
    )
    claims = []
    for name, quantity, where in places:
        q, d = quantity[where], density.ravel()[where]
        upper = q > np.quantile(q, 0.75)
        ratio = float(np.median(d[upper]) / np.median(d[~upper]))
        claims.append(Claim(f"Median density where it is high over the rest: {name}",
                            "increased", ratio, "times", ratio > 1.0))  # fmt: skip
    return claims


def _differences(world, view, found) -> list[Claim]:
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
    return [
        Claim("Criterion from differences off the closed form in space: median", "included for "
              "free", 100.0 * float(np.median(off)), "%", bool(np.median(off) < 0.05)),
        Claim("The same: 95 % of pixels are below", None, 100.0 * float(np.quantile(off, 0.95)),
              "%"),
        Claim("Eq. 20 as printed, over the closed form in space: least, and median on bodies",
              "a bound", f"{np.min(printed[met] / exact[met]):.2f}, "
              f"{np.median((printed / exact)[met & (k > 0.0)]):.2f}", "",
              bool(np.min(printed[met] / exact[met]) >= 1.0)),
    ]  # fmt: skip


def _judged(view, truth, found, count) -> list[Claim]:
    """Rank correlation with the errors of a uniform image."""
    at = shared.chosen(np.ones(truth.shape), count)
    width = bilateral_widths(np.ones(truth.shape), len(at))
    error = _blocks((shared.filtered(view, at, truth[tuple(at.T)], width) - truth) ** 2)
    rank = {
        k: float(spearmanr(error.ravel(), _blocks(B).ravel())[0]) for k, B in found.maps.items()
    }
    best = max(rank, key=lambda k: rank[k])
    return [
        *(Claim(f"Rank correlation of criterion and error of a uniform image: {words}", None,
                rank[name], "") for name, words in shared.WORDS.items()),
        Claim("The criterion with blockers foretells errors better than that without", "yes",
              f"{rank['plain']:.2f} against {rank['mirror']:.2f}", "",
              rank["plain"] > rank["mirror"]),
        Claim("The criterion that foretells them best", None, shared.WORDS[best], ""),
    ]  # fmt: skip


def _blocks(values: np.ndarray) -> np.ndarray:
    w, h = (n // SIDE for n in values.shape)
    return values[: w * SIDE, : h * SIDE].reshape(w, SIDE, h, SIDE).mean((1, 3))
