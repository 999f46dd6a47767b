"""R07 Fig. 15's times, as curves over the cost of a pixel: 8 x 8 to 100 x 100 shadow rays.

The scene is `r07.shared.meshes` at the paper's 512 x 512 pixels. The paper's own pixel takes 17 ms;
its shadow rays are not counted there. Ours takes as many rays as a lamp's nodes, 50 ns each by
Embree on one core, so that the cost of a pixel is moved by their number. "Full image" is a value at
every pixel and nothing else. An adaptive image is 17 % of as many samples with gradients, placed by
the quad-tree of Fig. 15 and put together over its own triangles (`quadtree_image`), linearly; both
include the primary rays of all pixels. All are whole runs of processor time, in turns.

With 100 x 100 rays the same runs would take hours. There values and gradients are timed at random
pixels of the image, and gradients at random ones of the samples that the runs with 32 x 32 rays
took; tree, triangles and primary rays are those runs', for they do not know of shadow rays.

A gradient is value and image gradient with moving shadows, which the paper leaves out
(`Renderer.radiance`): sums over nodes are a few moments more than the value's, and rays for depths
of blockers go to the nodes beside a shadow's edge, one or two a row of the lamp. The ceiling is one
over the share of samples, 5.9: where a gradient and all else are free, and a sample costs what a
pixel does. The paper's 6.6 lies above it ("slightly superlinear": the samples that it leaves out
are dearer than those that it takes). In our scene it is the other way round: a seventh of the
pixels is sky, which costs nothing, and samples stand on leaves, knots and in penumbras.

Second order (`by_tangent_planes`, with gradients that know shadows, and images put together with
them) takes the samples that it needs for the error of R07's way in the same scene: 17 % by
gradient, put together linearly. Their number is found with 12 x 12 rays on looked-up images; how it
varies over lamps is in Fig. 15.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from figures import timing
from figures.r07.fig15 import SHARE, SOURCE, equal_share
from figures.r07.shared import meshes as shared
from figures.r07.shared import table
from figures.style import Drawing
from figures.verdicts import OURS, Measurement, Statement, at_least, at_most, near
from firstorder import plotting
from firstorder.imaging.hits import facet_gbuffer
from firstorder.reconstruction import ShadedSamples, quadtree_image, sample_image
from firstorder.reconstruction.importance import by_density, by_gradient, by_tangent_planes
from firstorder.rendering import Renderer
from firstorder.rendering.image_files import image_coordinates

PIXEL = 75.9 * 60.0 / 512**2  # the paper's time of a pixel [s]
PAPER = (1e6 * PIXEL, 6.6, 2.0)  # microseconds, times faster, per cent by gradients
FINE = 100  # nodes along an edge of the dearest lamp
ROUNDS = {8: 5, 12: 5, 32: 3}
PART = 4096  # pixels at which values and gradients are compared
FEW = 256  # of the dearest ones


def draw(quick: bool) -> Drawing:
    side, rounds = (96, {6: 2, 8: 2}) if quick else (512, ROUNDS)
    fine, few = (12, 64) if quick else (FINE, FEW)
    share = equal_share(shared.lattices(side, 6 if quick else shared.NODES))
    labels = shared.label_of(Renderer(shared.world()), table.grid(side), side).reshape(side, side)
    others = timing.Others()
    timed = {n: _timed(side, n, labels, share, times) for n, times in rounds.items()}
    last = max(rounds)
    timed[fine] = _extended(side, fine, few, timed[last], 2 if quick else 5)
    ratios = {
        n: {k: timing.of_times(v, others) for k, v in t.pairs.items()} for n, t in timed.items()
    }

    figure, axes = plotting.panels(1, 3, 4.4, 3.6)
    _gains(axes[0, 0], ratios)
    _overheads(axes[0, 1], ratios)
    _shares(axes[0, 2], ratios, [n for n in ratios if n != fine])
    names = sorted({k for r in ratios.values() for k in r})
    columns = {
        k: np.array([r[k].mean if k in r else np.nan for r in ratios.values()]) for k in names
    }
    curves = {"ratios": {"nodes": np.array(list(ratios)), **columns}}
    size = (
        f"{side} x {side} pixels, {int(SHARE * side**2)} samples; "
        f"{', '.join(f'{n} x {n}' for n in ratios)} shadow rays"
    )
    return Drawing(figure, {"share": np.array(share)}, _claims(ratios, share), curves, size)


# --- times ---------------------------------------------------------------------------------------


class Run(NamedTuple):
    """Processor time of one adaptive image, but for the primary rays of all pixels [s]."""

    shading: float
    tree: float
    together: float

    @property
    def all(self) -> float:
        """Of it all."""
        return sum(self)


class Timed(NamedTuple):
    """What was measured with one lamp: pairs of times, and what the dearest lamp takes over.

    Attributes:
        pairs: times of which ratios are taken, by name, one pair a round [s].
        p: the samples by gradient [pixels].
        fixed: time of primary rays, tree and triangles, a round [s].
    """

    pairs: dict[str, list[tuple[float, float]]]
    p: np.ndarray
    fixed: list[float]


class Shading:
    """A function for `sample_image` that is timed apart."""

    def __init__(self, made: Renderer, side: int):
        self.made, self.side, self.spent = made, side, 0.0

    def __call__(self, p: np.ndarray) -> ShadedSamples:
        """Values and gradients per pixel."""
        got = shared.timed(lambda: self.made.radiance(image_coordinates(p, self.side, self.side)))
        self.spent += got.seconds
        found = got.found
        return ShadedSamples(found.value, found.gradient * 2.0 / self.side)  # pyright: ignore

    def d05(self, p: np.ndarray) -> ShadedSamples:
        """Values alone, and D05's criterion from the G-buffer."""
        q = image_coordinates(p, self.side, self.side)

        def look():
            seen = self.made.seen(q)
            value = self.made.radiance(q, seen=seen, gradients=False).value
            at = facet_gbuffer(self.made._facets, self.made.world.camera, q, seen.face)  # pyright: ignore
            bent = np.sqrt(np.sum(at.S**2, (1, 2)))
            return value, shared.criterion(seen.index, bent, at.distance, at.cosine)

        got = shared.timed(look)
        self.spent += got.seconds
        return ShadedSamples(got.found[0], None, got.found[1])  # pyright: ignore

    def run(self, shade, budget: int, metric, labels, scheme: str) -> tuple[Run, np.ndarray]:
        """One adaptive image, and where its samples are."""
        self.spent, side = 0.0, self.side
        got = shared.timed(
            lambda: sample_image(shade, side, side, budget, metric, labels=labels, smallest=1.0)
        )
        found, shading = got.found, self.spent
        together = shared.timed(lambda: quadtree_image(found, side, side, scheme=scheme))  # pyright: ignore
        return Run(shading, got.seconds - shading, together.seconds), found.p  # pyright: ignore


def _timed(side: int, nodes: int, labels, share: float, rounds: int) -> Timed:
    made = Renderer(shared.world()._replace(lamps=(shared.lamp(nodes),)))
    look, q = Shading(made, side), image_coordinates(table.grid(side), side, side)
    part = q[np.random.default_rng(0).permutation(len(q))[:PART]]
    budget, fewer = int(SHARE * side**2), int(share * side**2)
    ways = {
        "gradient": (look, budget, by_gradient, labels, "linear"),
        "second order": (look, fewer, by_tangent_planes, labels, "gradient"),
        "D05": (look.d05, budget, by_density, labels, "linear"),
    }
    look.run(*ways["D05"])  # all sizes of blocks are compiled once
    _, p = look.run(*ways["gradient"])
    _both(made, part)
    found, fixed = Timed({}, p, []), []
    for _ in range(rounds):
        full = shared.timed(lambda: made.radiance(q, gradients=False)).seconds
        value, both = _both(made, part)
        primary = shared.timed(lambda: made.seen(q)).seconds
        runs = {name: look.run(*way)[0] for name, way in ways.items()}
        by = {name: run.all + primary for name, run in runs.items()}
        ours = runs["gradient"]
        for name, pair in {
            "gain": (full, by["gradient"]),
            "gain, equal": (full, by["second order"]),
            "gradients": (both, value),
            "shading": (ours.shading, full),
            "tree": (ours.tree, full),
            "together": (ours.together, full),
            "primary": (primary, full),
            "D05": (by["D05"], by["gradient"]),
            "microseconds": (1e6 * value / len(part), 1.0),
        }.items():
            found.pairs.setdefault(name, []).append(pair)
        fixed.append(by["gradient"] - ours.shading)
    return found._replace(fixed=fixed)


def _both(made: Renderer, q: np.ndarray) -> tuple[float, float]:
    """Times of values alone, and of values with gradients, primary rays included."""
    value, both = (
        shared.timed(lambda g=g: made.radiance(q, gradients=g)).seconds for g in (False, True)
    )
    return value, both


def _extended(side: int, nodes: int, few: int, known: Timed, rounds: int) -> Timed:
    """The same with a lamp of many nodes, from a few pixels and a few samples."""
    made = Renderer(shared.world()._replace(lamps=(shared.lamp(nodes),)))
    random = np.random.default_rng(1)
    q, r = (
        image_coordinates(p[random.permutation(len(p))[:few]], side, side)
        for p in (table.grid(side), known.p)
    )
    _both(made, q)
    pairs: dict[str, list[tuple[float, float]]] = {}
    for k in range(rounds):
        value, both = _both(made, q)
        sample = shared.timed(lambda: made.radiance(r)).seconds
        full = value / few * side**2
        whole = sample / few * len(known.p) + known.fixed[k % len(known.fixed)]
        for name, pair in {
            "gain": (full, whole),
            "gradients": (both, value),
            "microseconds": (1e6 * value / few, 1.0),
        }.items():
            pairs.setdefault(name, []).append(pair)
    return Timed(pairs, known.p, known.fixed)


# --- pictures ------------------------------------------------------------------------------------


def _column(ratios, name: str) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Microseconds a pixel, a ratio and its error, with all lamps that have it."""
    some = [r for r in ratios.values() if name in r]
    us = np.array([r["microseconds"].mean for r in some])
    return us, *(np.array([getattr(r[name], k) for r in some]) for k in ("mean", "error"))  # pyright: ignore


def _gains(ax, ratios) -> None:
    for name, words in (("gain", "17 %, by gradient"), ("gain, equal", "second order, same error")):
        us, mean, error = _column(ratios, name)
        ax.errorbar(us, mean, 2.0 * error, fmt="o-", markersize=4, capsize=2, label=words)
    ax.axhline(1.0 / SHARE, color="0.4", linestyle="--", label="ceiling of 17 %: 5.9")
    ax.plot(PAPER[0], PAPER[1], "k*", markersize=9, label="R07: 17 ms, 6.6")
    ax.set(xscale="log", xlabel="cost of a pixel (us)", ylabel="times faster than every pixel",
           title="a) full image over adaptive one", ylim=(0.0, None))  # fmt: skip
    ax.legend(fontsize=7, loc="lower right")


def _overheads(ax, ratios) -> None:
    us, mean, error = _column(ratios, "gradients")
    ax.errorbar(us, 100.0 * (mean - 1.0), 200.0 * error, fmt="o-", markersize=4, capsize=2,
                label="gradient, moving shadows included")  # fmt: skip
    ax.plot(PAPER[0], PAPER[2], "k*", markersize=9, label="R07: 17 ms, 2 %, shadows still")
    for n, r in ratios.items():
        at = r["microseconds"].mean, 100.0 * (r["gradients"].mean - 1.0)
        ax.annotate(f"{n} x {n}", at, (4, 5), textcoords="offset points", fontsize=7)
    ax.set(xscale="log", xlabel="cost of a pixel (us)", ylabel="% of the value's time",
           title="b) what gradients add", ylim=(0.0, None))  # fmt: skip
    ax.legend(fontsize=7, loc="upper right")


def _shares(ax, ratios, counts) -> None:
    """Of the full image's time, what the adaptive one spends on what."""
    below = np.zeros(len(counts))
    where = np.arange(len(counts))
    for name, words in (("shading", "samples with gradients"), ("primary", "primary rays"),
                        ("together", "triangles"), ("tree", "tree")):  # fmt: skip
        part = 100.0 * np.array([ratios[n][name].mean for n in counts])
        ax.bar(where, part, 0.6, below, label=words)
        below += part
    ax.axhline(100.0 * SHARE, color="0.4", linestyle="--", label="17 %")
    ax.set(title="c) adaptive image", ylabel="% of the full image's time", xticks=where,
           xlabel="shadow rays", ylim=(0.0, 1.5 * below.max()))  # fmt: skip
    ax.set_xticklabels([f"{n} x {n}" for n in counts])
    ax.legend(fontsize=7, ncols=2, loc="upper center")


# --- claims --------------------------------------------------------------------------------------


def _claims(ratios, share: float) -> list[Statement | Measurement]:
    """Ratios with their spread over rounds; thresholds are the paper's numbers, or issue 19's."""
    first, *_, last, fine = ratios
    middle = list(ratios)[1]  # 12 x 12
    told: list[Statement | Measurement] = [
        _gain("32 x 32 shadow rays", ratios[last]["gain"], at_least(6.6, "the paper's number"), 6.6,
              SOURCE, "The ceiling is 1 / 0.17 = 5.9, where gradients and all else are free, and "
              "samples cost what pixels do. Ours stand on leaves and in penumbras, whose rays are "
              "dearer than the mean pixel's, a seventh of which are sky."),
        _gain("100 x 100 shadow rays", ratios[fine]["gain"],
              near(1.0 / SHARE, 0.1, "'proportional to the pixels': 1 / 0.17"), 1.0 / SHARE,
              SOURCE, "Samples stand in penumbras, whose pixels are dearer than the mean one."),
        _gain("8 x 8 shadow rays", ratios[first]["gain"], at_least(4.0, "our aim"), None, OURS,
              "A pixel takes 8 us, so that primary rays, triangles and what a round of few samples "
              "costs count, beside samples that are dearer than the mean pixel."),
        _gain("our aim at 32 x 32 shadow rays", ratios[last]["gain"], at_least(5.3, "our aim"),
              None, OURS, "Samples stand in penumbras, where edges of shadows are; with primary "
              "rays of all pixels that leaves less than the ceiling."),
        Statement("Time of the full image over that by second order with the error of R07's way, "
                  "32 x 32 shadow rays", None, ratios[last]["gain, equal"].mean,
                  at_least(10.0, "our aim"), OURS, "times", ratios[last]["gain, equal"].error,
                  "rounds in turns",
                  f"It needs {100.0 * share:.1f} % of the samples in this scene, so that its own "
                  f"ceiling is {1.0 / share:.1f}."),
    ]  # fmt: skip
    for n, name in ((first, "8 x 8"), (last, "32 x 32"), (fine, "100 x 100")):
        got = ratios[n]["gradients"]
        told.append(
            Statement(f"What gradients add to the time of values, {name} shadow rays", 2.0,
                      100.0 * (got.mean - 1.0), at_most(2.0, "the paper's 2 %"), SOURCE, "%",
                      100.0 * got.error, "rounds in turns",
                      "Beside a node's ray of 50 ns its moments are 3 ns, and edges of moving "
                      "shadows, which the paper leaves out, are as much again: it fails for rays "
                      "as cheap as Embree's.")
        )  # fmt: skip
    got, d05 = ratios[middle]["tree"], ratios[middle]["D05"]
    told += [
        Statement("The tree's time, of the full image's, 12 x 12 shadow rays", 8.0,
                  100.0 * got.mean, at_most(8.0, "the paper's 8 %"), SOURCE, "%",
                  100.0 * got.error, "rounds in turns"),
        Statement("Time by D05's metric over that by gradient (17.5 and 11.5 minutes), 12 x 12 "
                  "shadow rays", 1.5, d05.mean, at_least(17.5 / 11.5, "the paper's minutes"),
                  SOURCE, "times", d05.error, "rounds in turns",
                  "Both place as many samples, D05's have no gradients, and all samples cost about "
                  "the same here: without the paper's dear ray-tracing of some objects nothing "
                  "makes D05's take longer."),
        Measurement("Share of samples by which second order has the error of 17 % by gradient",
                    100.0 * share, "%"),
    ]  # fmt: skip
    for name, words in (("together", "Time of triangles and interpolation"),
                        ("primary", "Time of all primary rays")):  # fmt: skip
        r = ratios[middle][name]
        told.append(Measurement(f"{words}, of the full image's, 12 x 12 shadow rays",
                                100.0 * r.mean, "%", 100.0 * r.error))  # fmt: skip
    us = {n: r["microseconds"] for n, r in ratios.items()}
    told.append(
        Measurement("Time of a value with its shadow rays",
                    ", ".join(f"{n} x {n}: {t.mean:.3g}" for n, t in us.items()), "us")
    )  # fmt: skip
    return told


def _gain(words: str, got: timing.Ratio, rule, paper, source: str, reason: str) -> Statement:
    claim = f"Time of the full image over that of 17 % by gradient, {words}"
    return Statement(
        claim, paper, got.mean, rule, source, "times", got.error, "rounds in turns", reason
    )
