"""R07 Fig. 18: the bumpy sphere from near, sampled by analytic gradients and by differences.

The scene of Fig. 5 (`r07.shared.table`), the camera on the bumpy sphere; no shadows. Both trees
begin with 8 x 8 blocks and end with as many samples. The paper gives pictures; we take three
budgets, images linear over the samples' triangulation as in the paper. "Underestimates": the mean
size of differences between the first grid's samples against that of the true gradients at them.

Seen from here the bumps repeat every 107 pixels, 13 of the first grid's steps: differences know
nearly as much as gradients do, and lose little.
"""

from __future__ import annotations

import numpy as np

from figures.r07.shared import table as shared
from figures.style import Claim, Drawing
from firstorder import plotting
from firstorder.imaging.camera import pinhole
from firstorder.reconstruction.delaunay import delaunay_image
from firstorder.reconstruction.importance import QuadtreeCells, by_area, by_differences, by_gradient
from firstorder.reconstruction.quadtree import sample_image

SHARES = (0.05, 0.1, 0.17)
WAYS = {"gradient": by_gradient, "differences": by_differences, "even": by_area}


def draw(quick: bool) -> Drawing:
    side = 160 if quick else 512
    world = shared.table()._replace(camera=pinhole((1.0, -5.0, 2.4), (1.2, 0.0, 0.5), gamma=9.0))
    light = [shared.lamp()]
    p = shared.grid(side)
    truth, index = shared.shaded(world, light, shared.coordinates(p, side), shadows=False)
    true, labels = truth.value.reshape(side, side), index.reshape(side, side)
    bumpy = labels == world.bumpy
    shade = shared.seen_by_tree(world, light, side, shadows=False)
    slopes = _first_slopes(shade, side, labels)

    rmse, pictures, samples = {}, {}, {}
    for name, metric in WAYS.items():
        rmse[name] = []
        for share in SHARES:
            got = sample_image(shade, side, side, int(share * side**2), metric, labels=labels)
            at = shared.shown(world, shared.coordinates(got.p, side))
            picture = delaunay_image(got.p, got.value, side, side, label=at, labels=labels)
            rmse[name].append(float(np.sqrt(np.mean((picture - true)[bumpy] ** 2))))
            if share == SHARES[1]:
                pictures[name], samples[name] = picture, got.p

    figure, axes = plotting.panels(2, 4, 3.0, 3.0)
    options = dict(cmap=plotting.RADIANCE, vmin=0.0, vmax=np.quantile(true[bumpy], 0.998))
    shared.show(axes[0, 0], true, "a) every pixel", **options)
    for k, name in enumerate(WAYS):
        ax = axes[0, k + 1]
        ax.plot(*samples[name].T, ",", color="0.1")
        ax.set(title=f"{'bcd'[k]}) samples, {name}", xticks=[], yticks=[], xlim=(0, side),
               ylim=(0, side), aspect="equal")  # fmt: skip
        shared.show(axes[1, k + 1], pictures[name], f"{'fgh'[k]}) 10 %, {name}", **options)
    for name, errors in rmse.items():
        axes[1, 0].loglog(100.0 * np.array(SHARES), errors, "o-", markersize=3, label=name)
    axes[1, 0].set(title="e) error on the sphere", xlabel="samples (% of pixels)",
                   ylabel="RMSE (W/(m$^2$ sr))")  # fmt: skip
    axes[1, 0].set_xticks([5.0, 10.0, 17.0], ["5", "10", "17"])
    axes[1, 0].xaxis.minorticks_off()
    axes[1, 0].legend(fontsize=7)

    curves = {"rmse": {"share": np.array(SHARES), **{k: np.array(v) for k, v in rmse.items()}}}
    arrays = {"true": true, **{f"p {k}": v for k, v in samples.items()}, **pictures}
    claims = _claims(rmse, slopes)
    return Drawing(figure, arrays, claims, curves, f"{side} x {side} pixels, 64 light nodes")


def _first_slopes(shade, side: int, labels) -> float:
    """On the first grid: mean size of differences over that of gradients, inside of the sphere."""
    seen: list[QuadtreeCells] = []

    def metric(squares):
        seen.append(squares)
        return by_area(squares)

    blocks = -(-side // 8)
    sample_image(shade, side, side, blocks**2, metric)
    first = seen[0]
    # Blocks that show the sphere, and whose neighbours show it too.
    whole = labels[4::8, 4::8] == labels[side // 2, side // 2]
    inner = whole.copy()
    for axis in (0, 1):
        inner &= np.roll(whole, 1, axis) & np.roll(whole, -1, axis)
    numeric = np.linalg.norm(first.differences, axis=1)[inner.ravel()]
    gradient = first.shaded.gradient
    assert gradient is not None
    return float(np.mean(numeric) / np.mean(np.linalg.norm(gradient, axis=1)[inner.ravel()]))


def _claims(rmse, slopes) -> list[Claim]:
    claims = [
        Claim(
            "Differences on the first grid underestimate gradients: mean size, of the true one's",
            "somewhat",
            slopes,
            "",
            bool(slopes < 1.0),
        )
    ]
    for k, share in enumerate(SHARES):
        ratio = rmse["differences"][k] / rmse["gradient"][k]
        claims.append(
            Claim(
                f"RMSE by differences over that by gradients, {100 * share:.0f} % samples",
                "somewhat sharper",
                ratio,
                "times",
                bool(ratio > 1.0),
            )
        )
    even = rmse["even"][1] / rmse["gradient"][1]
    claims.append(
        Claim("RMSE of an even tree over that by gradients, 10 % samples", None, even, "times",
              bool(even > 1.0))
    )  # fmt: skip
    return claims
