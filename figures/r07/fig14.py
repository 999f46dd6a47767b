"""R07 Fig. 14: where image samples go, by the gradient's size and by D05's criterion; 10 %.

The scene of Fig. 5 (`r07.shared.table`), without shadows as there; the lamp has 8 x 8 Gauss nodes.
Both ways use one quad-tree (`reconstruction.quadtree`): 8 x 8 blocks, silhouettes split to the
pixel first, then importance times area. D05's criterion is `2 k z Omega_rho / (n . v)` as R07 §9
states it, with the curvature of the surface without bumps. Beside the paper's two: differences
between neighbouring samples and an even tree, all with as many samples. Images are put together
linearly over a Delaunay triangulation, as in the paper, and with the samples' own gradients
(`reconstruction.delaunay`).

What is claimed is judged over lay-outs (`r07.shared.table.layouts`), by geometric means. Of the
paper's words on where samples go one does not hold: D05's criterion puts more of them on the bumpy
sphere than the gradient does. That sphere is glossy (the paper's has highlights, too), which D05
counts; what D05 does not know is where its bumps are. So it spends them on the rim, and the error
in the bumps and the highlights is the larger one.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from figures.r07.shared import look
from figures.r07.shared import table as shared
from figures.spread import geometric
from figures.style import Drawing
from figures.verdicts import OURS, Measurement, Statement, at_least
from firstorder import plotting
from firstorder.reconstruction.delaunay import delaunay_image
from firstorder.reconstruction.importance import by_area, by_density, by_differences, by_gradient
from firstorder.reconstruction.quadtree import ImageSamples, sample_image

WAYS = {"gradient": by_gradient, "D05": by_density, "differences": by_differences, "even": by_area}
SCHEMES = ("linear", "gradient")
SHARE = 0.1
JUDGED = ("gradient", "D05", "even")  # over lay-outs; differences are in Fig. 18

SOURCE = "R07 §9.1, Fig. 14"
CLOSEUPS = (
    look.Closeup((0.72, 0.88), (0.46, 0.62), (0.58, 0.66, 0.40, 0.33)),
    look.Closeup((0.40, 0.56), (0.48, 0.64), (0.04, 0.66, 0.40, 0.33), look.FRAMES[1]),
)
BAND = (
    "D05's criterion counts gloss, sqrt(6 s), and so puts samples on every glossy sphere, bumps "
    "or not, most of them at its rim. Gradients put more on the bumpy one only where its lobe is "
    "broad, exponents below some 35, and not on all of these."
)


def draw(quick: bool) -> Drawing:
    side = 160 if quick else 512
    world, lamp = shared.table(), shared.lamp()
    got = _compared(world, lamp, side, tuple(WAYS))
    true, found, images = got.true, got.found, got.images
    count, small = (3, 128) if quick else (24, 256)
    scan = [_compared(o.world, o.lamp(), small, JUDGED) for o in shared.layouts(count)]

    figure, axes = plotting.panels(2, 4, 3.2, 3.2)
    seen = look.look(true, got.labels, shared.tints(world), CLOSEUPS)
    seen.show(axes[0, 0], true, "a) every pixel")
    faint = seen.levels(true)
    shown = []
    for k, name in enumerate(("gradient", "D05")):
        title = f"{'ef'[k]}) 10 %, {name}"
        seen.show(axes[1, k], images[name]["linear"], f"{title}, linear")
    for k, name in enumerate(("gradient", "D05", "differences")):
        look.show_samples(axes[0, k + 1], found[name].p, side, f"{'bcd'[k]}) samples, {name}",
                          faint)  # fmt: skip
    for k, name in enumerate(("gradient", "D05")):
        error = abs(images[name]["linear"] - true)
        title = f"{'gh'[k]}) error of {'ef'[k]}"
        shown.append(shared.show_decades(axes[1, k + 2], error, title, -5.0, -1.0))
    figure.colorbar(shown[0], ax=axes[1, 2:], shrink=0.8, label="log$_{10}$ W/(m$^2$ sr)")

    curves = {
        "samples": {o: np.array([got.counts[n][o] for n in WAYS]) for o in shared.NAMES},
        "rmse": {s: np.array([got.rmse(n, s) for n in WAYS]) for s in SCHEMES},
    }
    arrays = {"true": true, **{f"p {n}": g.p for n, g in found.items()}}
    claims = [*_claims(scan, f"{count} materials, lamps and bumps"), *_shown(got)]
    size = f"{side} x {side} pixels, {SHARE:.0%} of samples; lay-outs {small} x {small}"
    return Drawing(figure, arrays, claims, curves, size)


class Compared(NamedTuple):
    """One scene sampled in several ways.

    Attributes:
        true: the image.
        pixels: of it, by the object that they show.
        labels: which object each pixel shows.
        bumpy: whether a pixel shows the bumpy sphere.
        found: samples, by way.
        counts: of the samples, by way and object.
        images: put together from samples, by way and scheme.
    """

    true: np.ndarray
    pixels: dict[str, int]
    labels: np.ndarray
    bumpy: np.ndarray
    found: dict[str, ImageSamples]
    counts: dict[str, dict[str, int]]
    images: dict[str, dict[str, np.ndarray]]

    def rmse(self, way: str, scheme: str = "linear", where=slice(None)) -> float:
        """Error of an image, over some of its pixels."""
        return float(np.sqrt(np.mean((self.images[way][scheme] - self.true)[where] ** 2)))

    def more(self, o: str) -> float:
        """Samples on an object by gradient, over those by D05."""
        return self.counts["gradient"][o] / self.counts["D05"][o]

    def density(self, way: str, o: str) -> float:
        """Samples a pixel on an object."""
        return self.counts[way][o] / self.pixels[o]


def _compared(world, lamp, side: int, ways) -> Compared:
    """A tenth of the samples, placed in several ways."""
    p = shared.grid(side)
    truth, index = shared.shaded(world, [lamp], shared.coordinates(p, side), shadows=False)
    labels = index.reshape(side, side)
    shade = shared.seen_by_tree(world, [lamp], side, shadows=False, more=shared.d05_density(world))
    number = {o: world.scene.named(o)[0] for o in shared.NAMES}
    found, images, counts = {}, {}, {}
    for way in ways:
        budget = int(SHARE * side**2)
        got = sample_image(shade, side, side, budget, WAYS[way], labels=labels)
        at = shared.shown(world, shared.coordinates(got.p, side))
        options = dict(gradient=got.gradient, label=at, labels=labels)
        found[way] = got
        images[way] = {
            scheme: delaunay_image(got.p, got.value, side, side, scheme=scheme, **options)
            for scheme in SCHEMES
        }
        counts[way] = {o: int(np.sum(at == k)) for o, k in number.items()}
    pixels = {o: int(np.sum(index == k)) for o, k in number.items()}
    true = truth.value.reshape(side, side)
    return Compared(true, pixels, labels, labels == world.bumpy, found, counts, images)


def _claims(scan, scanned: str) -> list[Statement]:
    """Over lay-outs: geometric means with their standard errors."""
    told = [
        ("Gradients place more samples on the bumpy sphere than D05: ratio of counts", "more",
         [got.more("bumpy") for got in scan], "'more'", SOURCE, BAND),
        ("Gradients sample somewhat more densely on the table: samples over those by D05",
         "somewhat more", [got.more("table") for got in scan], "'more'", SOURCE, BAND),
        ("D05 gives more weight to the glossy sphere than to the Lambertian one: ratio of samples "
         "a pixel", "more",
         [got.density("D05", "glossy") / got.density("D05", "diffuse") for got in scan],
         "'more'", SOURCE, ""),
        ("Samples by gradient capture the bumps: rms error on the bumpy sphere by D05 over that by "
         "gradient, linear", "accurately",
         [got.rmse("D05", where=got.bumpy) / got.rmse("gradient", where=got.bumpy)
          for got in scan], "smaller error by gradient", SOURCE, ""),
        ("Image put together with gradients: rms error of the linear one over its own", None,
         [got.rmse("gradient") / got.rmse("gradient", "gradient") for got in scan],
         "smaller error with gradients", OURS, ""),
    ]  # fmt: skip
    for way in JUDGED[1:]:
        ratio = [got.rmse(way) / got.rmse("gradient") for got in scan]
        paper = "sharper" if way == "D05" else None
        told.append(
            (f"Image by gradient: rms error by {way} over its own, linear", paper, ratio,
             "smaller error by gradient", SOURCE if paper else OURS, "")
        )  # fmt: skip
    return [
        Statement(claim, paper, got.mean, at_least(1.0, why), source, "times", got.error, scanned,
                  reason)
        for claim, paper, ratio, why, source, reason in told
        for got in (geometric(ratio),)
    ]  # fmt: skip


def _shown(got: Compared) -> list[Measurement]:
    """Of the scene in the picture."""
    words = "The scene that is shown: samples on {}, by gradient and by D05"
    names = {o: "the table" if o == "table" else f"the {o} sphere" for o in shared.NAMES}
    ours, theirs = got.counts["gradient"], got.counts["D05"]
    told = [
        Measurement(words.format(name), f"{ours[o]} and {theirs[o]}", source=SOURCE)
        for o, name in names.items()
    ]
    ratio = got.rmse("D05") / got.rmse("gradient")
    words = "The scene that is shown: rms error by D05 over that by gradient, linear"
    return [*told, Measurement(words, ratio, "times")]
