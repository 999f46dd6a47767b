"""R07 Fig. 15: meshes and soft shadows from 17 % of the samples, by six metrics and evenly.

The scene is `r07.shared.meshes`; in place of the paper's cow and teapot stand meshes of our own.
All ways use one quad-tree (`reconstruction.quadtree`): 8 x 8 blocks, silhouettes split to the pixel
first, then the metric, with as many samples each. Metrics: the size of the gradient, without and
with what moving shadows add to it (R07 names shadow gradients as missing); second order, from
differences of those gradients; D05's criterion as R07 §9 states it; the cheap product of R07 §9;
the variance of a square's value and its three siblings' ("numeric variance" is that of neighbours,
not of shadow rays). Evenly: squares by their area. Images are put together over the triangles of
the tree itself (`reconstruction.quadtree_image`; the paper takes Delaunay's, whose error stands
beside), linearly as in the paper, and with the samples' own gradients.

Silhouettes count within an object too: each leaf and each piece of the knot is a label of its own
(`r07.shared.meshes`). With one label an object, gradients do not see where it hides itself. What is
claimed of errors is judged over lamps (`r07.shared.meshes.lamps`), by geometric means.

Second order sees that interpolation needs few samples on even slopes (R07 §9.3 says so); its
Hessians are differences of the gradients that are there. In the scene that is shown, and under 84
of a hundred lamps, it is ahead of the gradient; under three, all from the right, it is more than
twice as far off: where one square is all dark and the next all lit, gradients of both are zero, and
it sees no edge between. "Planes" (`by_tangent_planes`) adds how far a sample's tangent plane misses
its neighbours' values, which knows of such edges and is of the same order where there are none. It
is the way that we put forward, with images put together with the samples' gradients: no further
light is asked for it. Six of the hundred lamps are in the picture; they have labels of their own.

What all this costs and saves is in `r07_cost_of_a_pixel`.
"""

from __future__ import annotations

import numpy as np

from figures.r07.shared import look, table
from figures.r07.shared import meshes as shared
from figures.spread import geometric, rms
from figures.style import Drawing
from figures.verdicts import OURS, Measurement, Statement, at_least, at_most, met, near
from firstorder import plotting
from firstorder.reconstruction.delaunay import delaunay_image
from firstorder.reconstruction.importance import (
    by_area,
    by_density,
    by_gradient,
    by_hessian_differences,
    by_tangent_planes,
    by_variance,
)
from firstorder.reconstruction.quadtree import sample_image
from firstorder.reconstruction.quadtree_mesh import quadtree_image

SOURCE = "R07 §9.1, Fig. 15"
SHARE = 0.17
SHARES = (0.05, 0.1, 0.17, 0.35, 0.7, 1.34)
# What each way asks of the lattices: metric, whether gradients know shadows, and the density.
WAYS = {
    "gradient": (by_gradient, True, None),
    "no shadow motion": (by_gradient, False, None),
    "second order": (by_hessian_differences, True, None),
    "planes": (by_tangent_planes, True, None),
    "product": (by_density, True, shared.heuristic),
    "D05": (by_density, True, shared.d05),
    "variance": (by_variance, True, None),
    "even": (by_area, True, None),
}
SCHEMES = ("linear", "gradient")
SHOWN = (
    ("gradient", "linear"),
    ("planes", "gradient"),
    ("D05", "linear"),
    ("even", "linear"),
)
CLOSEUP = (0.66, 0.96), (0.42, 0.72)  # of the width, of the height
SWEPT = ("gradient", "second order", "planes", "D05", "variance", "even")
JUDGED = ("gradient", "second order", "planes", "D05", "variance", "no shadow motion", "even")
REASONS = {
    "variance": "Variance is blind to what lies between its four samples, which gradients see.",
    "no shadow motion": "Where shadows are soft and bumps are not, samples are better spent there.",
}


def draw(quick: bool) -> Drawing:
    side, nodes = (96, 6) if quick else (512, shared.NODES)
    known = shared.lattices(side, nodes)
    true = known.reference["value"]
    budget = int(SHARE * side**2)
    samples = {name: _sampled(known, name, budget) for name in WAYS}
    images = {name: {s: _image(known, got, s) for s in SCHEMES} for name, got in samples.items()}
    rmse = {n: {s: rms(i - true) for s, i in each.items()} for n, each in images.items()}
    shares = SHARES[1::2] + SHARES[-1:] if quick else SHARES
    sweep = {n: _sweep(known, n, shares) for n in SWEPT}
    count, small, few = (2, 160, 4) if quick else (100, 256, 6)
    scan = [
        _ratios(shared.lattices(small, few, light, f"_lamp{k}"))
        for k, light in enumerate(shared.lamps(count, few))
    ]

    figure, axes = plotting.panels(4, 5, 2.9, 2.9)
    seen = look.look(true, known.reference["index"].astype(int), shared.TINTS)
    _picture(axes[0, 0], seen.levels(true), "a) every pixel")
    shown = None
    for k, (name, scheme) in enumerate(SHOWN):
        image = images[name][scheme]
        words = name if scheme == "linear" else f"{name}, with gradients"
        levels = seen.levels(image)
        _picture(axes[0, k + 1], levels, f"{'bcde'[k]}) {words}")
        _closeup(axes[1, k + 1], levels, f"{'ghij'[k]}) rms {1e3 * rms(image - true):.2f}e-3")
        look.show_samples(axes[2, k + 1], samples[name].p, side, f"{'lmno'[k]}) samples, {name}")
        title = f"{'qrst'[k]}) error, {words}"
        shown = table.show_decades(axes[3, k + 1], abs(image - true), title, -4.0, -0.5)
    _closeup(axes[1, 0], seen.levels(true), "f) every pixel")
    figure.colorbar(shown, ax=axes[3, 1:], shrink=0.8, label="log$_{10}$ W/(m$^2$ sr)")
    look.show_samples(axes[2, 0], samples["variance"].p, side, "k) samples, variance")
    _errors(axes[3, 0], np.array(shares), sweep)

    curves = {
        "rmse": {s: np.array([rmse[n][s] for n in WAYS]) for s in SCHEMES},
        "budgets": {"share": np.array(shares), **sweep},
    }
    arrays = {"true": true, "labels": known.labels, **{f"p {n}": g.p for n, g in samples.items()}}
    ratio = {n: r["linear"] / rmse["gradient"]["linear"] for n, r in rmse.items()}
    claims = [
        *_errors_claims(scan, f"{count} lamps"),
        *_sweep_claims(sweep),
        Measurement("The scene that is shown: rms errors over that by gradient, linear",
                    ", ".join(f"{n} {r:.2f}" for n, r in ratio.items() if n != "gradient")),
    ]  # fmt: skip
    size = f"{side} x {side} pixels, {budget} samples, {nodes**2} shadow rays each"
    return Drawing(figure, arrays, claims, curves, f"{size}; lamps at {small}")


# --- images --------------------------------------------------------------------------------------


def _sampled(known, name: str, budget: int):
    metric, shadows, more = WAYS[name]
    side = known.side
    return sample_image(known.shade(more, shadows), side, side, budget, metric,
                        labels=known.labels, smallest=shared.FINEST, thorough=True)  # fmt: skip


def _image(known, got, scheme: str):
    """The image of all samples, over the triangles of their tree."""
    got = got._replace(gradient=known.gradient(got.p))
    label = known.at(got.p, "label").astype(int)
    return quadtree_image(
        got, known.side, known.side, scheme=scheme, label=label, labels=known.labels
    )


def _over_delaunay(known, got):
    """The linear image over Delaunay's triangles, as the paper has it."""
    label = known.at(got.p, "label").astype(int)
    options = dict(gradient=known.gradient(got.p), label=label, labels=known.labels)
    return delaunay_image(got.p, got.value, known.side, known.side, **options)


def equal_share(known, name: str = "planes", scheme: str = "gradient") -> float:
    """Share of samples by which a way has the error of R07's: 17 % by gradient, linear.

    By bisection of logarithms, to 1 %.
    """
    true, side = known.reference["value"], known.side

    def error(name: str, scheme: str, share: float) -> float:
        return rms(_image(known, _sampled(known, name, int(share * side**2)), scheme) - true)

    wanted = error("gradient", "linear", SHARE)
    low, high = 1.01 / shared.BLOCK**2, 1.0
    while high > 1.01 * low:
        middle = float(np.sqrt(low * high))
        if error(name, scheme, middle) > wanted:
            low = middle
        else:
            high = middle
    return high


def _sweep(known, name: str, shares) -> np.ndarray:
    """RMSE with the budget, linear."""
    out = []
    for share in shares:
        got = _sampled(known, name, int(share * known.side**2))
        out.append(rms(_image(known, got, "linear") - known.reference["value"]))
    return np.array(out)


def _picture(ax, levels, title: str) -> None:
    """A picture as it is looked at, with a frame where the closeup is."""
    look.show_levels(ax, levels, title)
    low, high = (len(levels) * np.array(ends) for ends in zip(*CLOSEUP, strict=True))
    corners = low, (high[0], low[1]), high, (low[0], high[1]), low
    ax.plot(*zip(*corners, strict=True), "-", color=look.FRAMES[0], lw=0.9)


def _closeup(ax, levels, title: str) -> None:
    """The part of a picture in the frame, pixel by pixel."""
    (x0, x1), (y0, y1) = (np.rint(len(levels) * np.array(ends)).astype(int) for ends in CLOSEUP)
    part = levels[len(levels) - y1 : len(levels) - y0, x0:x1]
    ax.imshow(part, interpolation="nearest", origin="upper")
    ax.set(title=title, xticks=[], yticks=[])
    for edge in ax.spines.values():
        edge.set(color=look.FRAMES[0], linewidth=1.4)


def _errors(ax, shares, sweep) -> None:
    for name, errors in sweep.items():
        some = errors > 1e-12
        ax.loglog(100.0 * shares[some], errors[some], "o-", markersize=3, label=name)
    ax.set(title="p) error with the budget, linear", xlabel="samples (% of pixels)",
           ylabel="RMSE (W/(m$^2$ sr))")  # fmt: skip
    ax.set_xticks([5.0, 10.0, 17.0, 35.0, 70.0], ["5", "10", "17", "35", "70"])
    ax.xaxis.minorticks_off()
    ax.legend(fontsize=7, loc="lower left")


# --- claims --------------------------------------------------------------------------------------


def _ratios(known) -> dict[str, float]:
    """Errors of one scene over that by gradient: linear, on the bumpy sphere, with gradients."""
    true, budget = known.reference["value"], int(SHARE * known.side**2)
    here = known.reference["index"] == shared.NAMES.index("bumpy")
    off: dict[str, float] = {}
    for name in JUDGED:
        got = _sampled(known, name, budget)
        error = _image(known, got, "linear") - true
        off[name], off[f"{name}, bumps"] = rms(error), rms(error[here])
    got = _sampled(known, "gradient", budget)
    off["with gradients"] = rms(_image(known, got, "gradient") - true)
    off["Delaunay"] = rms(_over_delaunay(known, got) - true)
    got = _sampled(known, "planes", budget)
    off["ours"] = rms(_image(known, got, "gradient") - true)
    base = {True: off["gradient, bumps"], False: off["gradient"]}
    ratios = {name: error / base[name.endswith("bumps")] for name, error in off.items()}
    return ratios | {"fewer": equal_share(known) / SHARE}


def _errors_claims(scan, scanned: str) -> list[Statement]:
    """Over lamps: geometric means with their standard errors."""
    larger, smaller = at_least(1.0, "larger error"), at_most(1.0, "smaller error")
    considerably = at_least(2.0, "'considerably': twice the error")
    over = "rms error over that by gradient, 17 % of samples, linear"
    rows = (
        (f"Uniform sampling has large errors: {over}", "large", "even", larger, SOURCE),
        (f"D05's metric has large errors: {over}", "large", "D05", larger, SOURCE),
        ("Uniform samples blur the bumps considerably: rms error on the bumpy sphere over that by "
         "gradient", "considerably", "even, bumps", considerably, SOURCE),
        ("So does D05's metric", "considerably", "D05, bumps", considerably, SOURCE),
        (f"Shadow gradients make for more robust sampling: without them, {over}", "more robust",
         "no shadow motion", larger, "R07 §9.3"),
        (f"A second-order analysis should guide sampling: {over}", "should", "second order",
         smaller, "R07 §9.3"),
        (f"The variance of four neighbours does as well as the gradient: {over}", None, "variance",
         smaller, OURS),
        ("Image put together with the samples' gradients: rms error over that of the linear one",
         None, "with gradients", smaller, OURS),
        (f"Second order, and how far tangent planes miss values: {over}", None, "planes", smaller,
         OURS),
        ("The same, put together with the samples' gradients: rms error over that by gradient, "
         "linear", None, "ours", smaller, OURS),
        ("Samples by which that has the error of 17 % by gradient, over these 17 %", None, "fewer",
         smaller, OURS),
        ("Over the tree's own triangles images are as good as over Delaunay's: rms error of the "
         "latter, by gradient", None, "Delaunay", near(1.0, 0.05, "as good"), OURS),
    )  # fmt: skip
    told = []
    for claim, paper, name, rule, source in rows:
        got = geometric([row[name] for row in scan])
        told.append(Statement(claim, paper, got.mean, rule, source, "times", got.error, scanned,
                              REASONS.get(name, "")))  # fmt: skip
    return told


def _sweep_claims(sweep) -> list[Statement]:
    falls = {n: bool(np.all(np.diff(e) < 0.0)) and e[-1] < 1e-12 for n, e in sweep.items()}
    words = (
        "yes" if all(falls.values()) else "not " + ", ".join(n for n, f in falls.items() if not f)
    )
    claim = "RMSE falls from each budget to the next, to 0 where every pixel has its sample"
    return [Statement(claim, None, words, met(all(falls.values()), "by every metric"), OURS)]
