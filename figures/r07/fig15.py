"""R07 Fig. 15: meshes and soft shadows from 17 % of the samples, by six metrics and evenly.

The scene is `r07.shared.meshes`; in place of the paper's cow and teapot stand meshes of our own.
All ways use one quad-tree (`reconstruction.quadtree`): 8 x 8 blocks, silhouettes split to the pixel
first, then the metric, with as many samples each. Metrics: the size of the gradient, without and
with what moving shadows add to it (R07 names shadow gradients as missing); second order, from
differences of those gradients; D05's criterion as R07 §9 states it; the cheap product of R07 §9;
the variance of a square's value and its three siblings' ("numeric variance" is that of neighbours,
not of shadow rays). Evenly: squares by their area. Images are put together linearly over a Delaunay
triangulation, as in the paper, and with the samples' own gradients (`reconstruction.delaunay`).

Silhouettes count within an object too: each leaf and each piece of the knot is a label of its own
(`r07.shared.meshes`). With one label an object, gradients do not see where it hides itself, and the
gradient's error at 17 % is that of D05's criterion and 2.6 times that by variance.

By variance and by second order the error is still smaller than by the gradient: second order sees
that linear interpolation needs few samples on even slopes, variance sees jumps that no gradient
knows of (limbs, a shadow's core). The gradient is ahead up to 10 % of samples, and on the bumps.

Times are processor time of whole runs, not of the clock on the wall. "Full image" is a value at
every pixel; all runs include the primary rays of all pixels, by which silhouettes are found. The
paper's ratios do not come out, because its shadow rays are dear: a value takes it 17 ms and a
gradient 0.3 ms more; here 144 rays of Embree's and their sum take some 42 us, and a gradient, with
the moving shadows that the paper leaves out, some 20 us more; small batches are filled up besides.
So 17 % of the samples cost half of the time. Its tree takes 6 minutes of 75.9; ours is arrays.
"""

from __future__ import annotations

import time

import numpy as np

from figures.r07.shared import meshes as shared
from figures.r07.shared import table
from figures.style import Claim, Drawing
from firstorder import plotting
from firstorder.reconstruction.delaunay import delaunay_image
from firstorder.reconstruction.importance import (
    by_area,
    by_density,
    by_gradient,
    by_hessian_differences,
    by_variance,
)
from firstorder.reconstruction.quadtree import sample_image
from firstorder.rendering.image_files import image_coordinates

SHARE = 0.17
SHARES = (0.05, 0.1, 0.17, 0.35, 0.7, 1.34)
# What each way asks of the lattices: metric, whether gradients know shadows, and the density.
WAYS = {
    "gradient": (by_gradient, True, None),
    "no shadow motion": (by_gradient, False, None),
    "second order": (by_hessian_differences, True, None),
    "product": (by_density, True, shared.heuristic),
    "D05": (by_density, True, shared.d05),
    "variance": (by_variance, True, None),
    "even": (by_area, True, None),
}
SCHEMES = ("linear", "gradient")


def draw(quick: bool) -> Drawing:
    side, nodes = (96, 6) if quick else (512, shared.NODES)
    known = shared.lattices(side, nodes)
    true = known.reference["value"]
    budget = int(SHARE * side**2)
    samples = {name: _sampled(known, name, budget) for name in WAYS}
    images = {name: {s: _image(known, got, s) for s in SCHEMES} for name, got in samples.items()}
    rmse = {n: {s: _rms(i - true) for s, i in each.items()} for n, each in images.items()}
    shares = SHARES[1::2] + SHARES[-1:] if quick else SHARES
    sweep = {n: _sweep(known, n, shares) for n in ("gradient", "D05", "variance", "even")}
    seconds = _seconds(side, nodes, budget, known.labels)

    figure, axes = plotting.panels(3, 4, 3.0, 3.0)
    white = np.quantile(true, 0.998)
    options = dict(cmap=plotting.RADIANCE, vmin=0.0, vmax=white)
    table.show(axes[0, 0], true, "a) every pixel", **options)
    shown = None
    for k, name in enumerate(("gradient", "D05", "even")):
        picture = images[name]["linear"]
        table.show(axes[0, k + 1], picture, f"{'bcd'[k]}) 17 %, {name}, linear", **options)
        _map(axes[1, k + 1], samples[name], side, f"{'fgh'[k]}) samples, {name}")
        error = abs(picture - true)
        title = f"{'jkl'[k]}) error, {name}"
        shown = table.show_decades(axes[2, k + 1], error, title, -4.0, -0.5)
    figure.colorbar(shown, ax=axes[2, 1:], shrink=0.8, label="log$_{10}$ W/(m$^2$ sr)")
    _map(axes[1, 0], samples["variance"], side, "e) samples, variance")
    _errors(axes[2, 0], np.array(shares), sweep)

    curves = {
        "rmse": {s: np.array([rmse[n][s] for n in WAYS]) for s in SCHEMES},
        "budgets": {"share": np.array(shares), **sweep},
        "seconds": {k: np.array([v]) for k, v in seconds.items()},
    }
    arrays = {"true": true, "labels": known.labels, **{f"p {n}": g.p for n, g in samples.items()}}
    claims = [*_errors_claims(rmse), *_sweep_claims(sweep), *_bumps(known, images),
              *_time_claims(seconds)]  # fmt: skip
    size = f"{side} x {side} pixels, {budget} samples, {nodes**2} shadow rays each"
    return Drawing(figure, arrays, claims, curves, size)


# --- images --------------------------------------------------------------------------------------


def _sampled(known, name: str, budget: int):
    metric, shadows, more = WAYS[name]
    side = known.side
    return sample_image(known.shade(more, shadows), side, side, budget, metric,
                        labels=known.labels, smallest=shared.FINEST, thorough=True)  # fmt: skip


def _image(known, got, scheme: str, count: int | None = None):
    """The image of all samples, or of the first `count`."""
    p, value = got.p[:count], got.value[:count]
    label = known.at(p, "label").astype(int)
    options = dict(gradient=known.gradient(p), label=label, labels=known.labels)
    return delaunay_image(p, value, known.side, known.side, scheme=scheme, **options)


def _sweep(known, name: str, shares) -> np.ndarray:
    """RMSE with the budget, linear."""
    out = []
    for share in shares:
        got = _sampled(known, name, int(share * known.side**2))
        out.append(_rms(_image(known, got, "linear") - known.reference["value"]))
    return np.array(out)


def _rms(a) -> float:
    return float(np.sqrt(np.mean(np.square(a))))


def _map(ax, got, side: int, title: str) -> None:
    ax.plot(*got.p.T, ",", color="0.1")
    ax.set(title=title, xticks=[], yticks=[], xlim=(0, side), ylim=(0, side), aspect="equal")


def _errors(ax, shares, sweep) -> None:
    for name, errors in sweep.items():
        some = errors > 1e-12
        ax.loglog(100.0 * shares[some], errors[some], "o-", markersize=3, label=name)
    ax.set(title="i) error with the budget (134 %: 0)", xlabel="samples (% of pixels)",
           ylabel="RMSE (W/(m$^2$ sr))")  # fmt: skip
    ax.set_xticks([5.0, 10.0, 17.0, 35.0, 70.0], ["5", "10", "17", "35", "70"])
    ax.xaxis.minorticks_off()
    ax.legend(fontsize=7)


# --- times ---------------------------------------------------------------------------------------


def _seconds(side: int, nodes: int, budget: int, labels) -> dict[str, float]:
    """Processor time of the full image, of what gradients add, and of whole adaptive runs."""
    made, look, clock = shared.renders(side, nodes)
    p = table.grid(side)
    part = np.random.default_rng(0).permutation(len(p))[: max(len(p) // 16, 2048)]
    q = image_coordinates(p, side, side)
    plain = shared.timed(lambda: made.pixels(q, gradients=False)).seconds
    few = [
        [shared.timed(lambda g=g: made.pixels(q[part], gradients=g)).seconds for g in (False, True)]
        for _ in range(2)
    ]
    value, gradient = np.min(few, 0)
    primary = shared.timed(lambda: made.seen(q)).seconds
    out = {"full": plain, "gradient over value": gradient / value, "primary": primary}
    for name, metric in (("gradient", by_gradient), ("D05", by_density)):
        clock["shading"] = 0.0
        start = time.process_time()
        got = sample_image(look, side, side, budget, metric, labels=labels, smallest=1.0)
        sampled = time.process_time() - start
        start = time.process_time()
        delaunay_image(got.p, got.value, side, side)
        put = time.process_time() - start
        out |= {f"{name}: shading": clock["shading"], f"{name}: tree": sampled - clock["shading"],
                f"{name}: put together": put, name: sampled + put + primary}  # fmt: skip
    return out


# --- claims --------------------------------------------------------------------------------------


def _errors_claims(rmse) -> list[Claim]:
    claims = []
    for name in ("even", "D05", "variance", "product", "second order", "no shadow motion"):
        for scheme, words in (("linear", "linear"), ("gradient", "with gradients")):
            ratio = rmse[name][scheme] / rmse["gradient"][scheme]
            paper = "larger" if name in ("even", "D05") and scheme == "linear" else None
            words = f"RMSE by {name} over that by gradient, 17 % of samples, {words}"
            claims.append(Claim(words, paper, ratio, "times", ratio > 1.0))
    gain = rmse["gradient"]["linear"] / rmse["gradient"]["gradient"]
    claims.append(
        Claim("RMSE linear over with gradients, samples by gradient", None, gain, "times", gain > 1)
    )
    return claims


def _sweep_claims(sweep) -> list[Claim]:
    falls = {n: bool(np.all(np.diff(e) < 0.0)) and e[-1] < 1e-12 for n, e in sweep.items()}
    words = (
        "yes" if all(falls.values()) else "not " + ", ".join(n for n, f in falls.items() if not f)
    )
    claim = "RMSE falls from each budget to the next, to 0 where every pixel has its sample"
    return [Claim(claim, None, words, "", all(falls.values()))]


def _bumps(known, images) -> list[Claim]:
    """Where uniform samples and D05 blur: the bumpy sphere."""
    here = known.reference["index"] == shared.NAMES.index("bumpy")
    error = {n: _rms((i["linear"] - known.reference["value"])[here]) for n, i in images.items()}
    ratio = {name: error[name] / error["gradient"] for name in ("even", "D05", "variance")}
    claim = "RMSE on the bumpy sphere by {} over that by gradient, linear"
    return [
        Claim(claim.format(name), "blurs the bumps" if name != "variance" else None, r, "times",
              r > 1.0)
        for name, r in ratio.items()
    ]  # fmt: skip


def _time_claims(seconds) -> list[Claim]:
    full = seconds["full"]
    share = {k: 100.0 * v / full for k, v in seconds.items()}
    gain, over = full / seconds["gradient"], 100.0 * (seconds["gradient over value"] - 1.0)
    tree, put = share["gradient: tree"], share["gradient: put together"]
    longer = seconds["D05"] / seconds["gradient"]
    return [
        Claim("Time of the full image over that of 17 % by gradient", 6.6, gain, "times",
              gain > 1.0 / SHARE),
        Claim("What gradients add to the time of values, same pixels", 2.0, over, "%", over < 2.0),
        Claim("The tree's time, of the full image's", 8.0, tree, "%", tree < 8.0),
        Claim("Time of triangulation and interpolation, of the full image's", None, put, "%"),
        Claim("Time of all primary rays, of the full image's", None, share["primary"], "%"),
        Claim("Time by D05's metric, of the full image's (17.5 of 75.9 minutes)", 23.0,
              share["D05"], "%"),
        Claim("Time by D05's metric over that by gradient (17.5 and 11.5 minutes)", 1.5, longer,
              "times", longer > 1.0),
    ]  # fmt: skip
