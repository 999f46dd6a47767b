"""R07 Fig. 14: where image samples go, by the gradient's size and by D05's criterion; 10 %.

The scene of Fig. 5 (`r07.shared.table`), without shadows as there; the lamp has 8 x 8 Gauss nodes.
Both ways use one quad-tree (`reconstruction.quadtree`): 8 x 8 blocks, silhouettes split to the
pixel first, then importance times area. D05's criterion is `2 k z Omega_rho / (n . v)` as R07 §9
states it, with the curvature of the surface without bumps. Beside the paper's two: differences
between neighbouring samples and an even tree, all with as many samples. Images are put together
linearly over a Delaunay triangulation, as in the paper, and with the samples' own gradients
(`reconstruction.delaunay`).

Of the paper's words on where samples go one does not hold here: D05's criterion puts more of them
on the bumpy sphere than the gradient does. That sphere is a little glossy, which D05 counts (ours
has s = 20); what D05 does not know is where its bumps are. So it spends them on the rim, and the
error in the bumps and the highlights is the larger one.
"""

from __future__ import annotations

import numpy as np

from figures.r07.shared import table as shared
from figures.style import Claim, Drawing
from firstorder import plotting
from firstorder.reconstruction.delaunay import delaunay_image
from firstorder.reconstruction.importance import by_area, by_density, by_differences, by_gradient
from firstorder.reconstruction.quadtree import sample_image

WAYS = {"gradient": by_gradient, "D05": by_density, "differences": by_differences, "even": by_area}
SHARE = 0.1


def draw(quick: bool) -> Drawing:
    side = 160 if quick else 512
    world, light = shared.table(), [shared.lamp()]
    p = shared.grid(side)
    truth, index = shared.shaded(world, light, shared.coordinates(p, side), shadows=False)
    true, labels = truth.value.reshape(side, side), index.reshape(side, side)
    shade = shared.seen_by_tree(world, light, side, shadows=False, more=shared.d05_density(world))
    budget = int(SHARE * side**2)
    found, images, counts = {}, {}, {}
    for name, metric in WAYS.items():
        got = sample_image(shade, side, side, budget, metric, labels=labels)
        at = shared.shown(world, shared.coordinates(got.p, side))
        options = dict(gradient=got.gradient, label=at, labels=labels)
        found[name] = got
        images[name] = {
            scheme: delaunay_image(got.p, got.value, side, side, scheme=scheme, **options)
            for scheme in ("linear", "gradient")
        }
        counts[name] = {o: int(np.sum(at == world.scene.named(o)[0])) for o in shared.NAMES}

    figure, axes = plotting.panels(2, 4, 3.0, 3.0)
    options = dict(cmap=plotting.RADIANCE, vmin=0.0, vmax=np.quantile(true, 0.998))
    shared.show(axes[0, 0], true, "a) every pixel", **options)
    shared.show(axes[1, 0], images["gradient"]["gradient"], "e) 10 %, by gradient", **options)
    shown = []
    for k, name in enumerate(("gradient", "D05", "differences")):
        _samples(axes[0, k + 1], found[name], side, f"{'bcd'[k]}) samples, {name}")
        error = abs(images[name]["gradient"] - true)
        title = f"{'fgh'[k]}) error, {name}"
        shown.append(shared.show_decades(axes[1, k + 1], error, title, -5.0, -1.0))
    figure.colorbar(shown[0], ax=axes[1, 1:], shrink=0.8, label="log$_{10}$ W/(m$^2$ sr)")

    rmse = {
        name: {s: float(np.sqrt(np.mean((i - true) ** 2))) for s, i in each.items()}
        for name, each in images.items()
    }
    names = list(WAYS)
    curves = {
        "samples": {o: np.array([counts[n][o] for n in names]) for o in shared.NAMES},
        "rmse": {s: np.array([rmse[n][s] for n in names]) for s in ("linear", "gradient")},
    }
    arrays = {"true": true, **{f"p {n}": g.p for n, g in found.items()}}
    pixels = {o: int(np.sum(index == world.scene.named(o)[0])) for o in shared.NAMES}
    claims = _claims(counts, pixels, rmse, budget)
    return Drawing(figure, arrays, claims, curves, f"{side} x {side} pixels, {budget} samples")


def _samples(ax, found, side: int, title: str) -> None:
    ax.plot(*found.p.T, ",", color="0.1")
    ax.set(title=title, xticks=[], yticks=[], xlim=(0, side), ylim=(0, side), aspect="equal")


def _claims(counts, pixels, rmse, budget) -> list[Claim]:
    ours, theirs = counts["gradient"], counts["D05"]
    dense = {n: {o: counts[n][o] / pixels[o] for o in pixels} for n in counts}
    claims = [
        Claim(
            f"Samples on the {o}{' sphere' if o != 'table' else ''}, by gradient and by D05",
            None,
            f"{ours[o]} and {theirs[o]}",
        )
        for o in shared.NAMES
    ]
    claims += [
        Claim(
            "More samples on the bumpy sphere: by gradient over D05",
            "more",
            ours["bumpy"] / theirs["bumpy"],
            "times",
            ours["bumpy"] > theirs["bumpy"],
        ),
        Claim(
            "D05 samples the glossy sphere more densely than the diffuse one, per pixel",
            "more weight",
            dense["D05"]["glossy"] / dense["D05"]["diffuse"],
            "times",
            dense["D05"]["glossy"] > dense["D05"]["diffuse"],
        ),
        Claim(
            "Somewhat more samples on the table: by gradient over D05",
            "somewhat more",
            ours["table"] / theirs["table"],
            "times",
            ours["table"] > theirs["table"],
        ),
    ]
    for name in ("D05", "differences", "even"):
        for scheme, words in (("linear", "linear"), ("gradient", "with gradients")):
            ratio = rmse[name][scheme] / rmse["gradient"][scheme]
            claims.append(
                Claim(
                    f"RMSE by {name} over that by gradient, images put together {words}",
                    "sharper" if name == "D05" else None,
                    ratio,
                    "times",
                    ratio > 1.0,
                )
            )
    gain = rmse["gradient"]["linear"] / rmse["gradient"]["gradient"]
    claims.append(
        Claim("RMSE linear over with gradients, samples by gradient", None, gain, "times", gain > 1)
    )
    return claims
