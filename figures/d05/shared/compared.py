"""D05 Fig. 17 on any scene of `shared.shading`: few samples, spread evenly or by bandwidth.

What both scenes are asked (`d05_fig17`, `d05_fig17_meshes`): RMSE, RMSE on screen and SSIM at equal
samples, at equal rays and at equal processor time, by the filter and over triangulations. All are
told as ratios, the uniform image's error over the adaptive one's (of SSIM: what it lacks of 1),
over the seeds of the blue noise that places the samples.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from matplotlib.ticker import LogLocator

from figures import timing
from figures.d05.shared import sampling as shared
from figures.d05.shared import shading
from figures.d05.shared.shading import World
from figures.r07.shared.table import show
from figures.spread import spread
from figures.timing import Ratio
from figures.verdicts import OURS, Measurement, Statement, at_least, at_most
from firstorder import plotting
from firstorder.caching import ssim

WAYS = ("delaunay", "bilateral")  # the default, and the paper's
STEPS = (0.25, 1.0, 4.0)  # times the paper's samples
NAMES = {"even": "uniform", **shared.WORDS}
COMPARED = ("even", "plain", "light")  # over budgets
MEASURES = ("RMSE", "RMSE on screen", "1 - SSIM")
COSTS = ("rays", "time", "mirror")
BY = {"delaunay": "", "bilateral": ", both by the filter"}

Errors = tuple[float, float, float]
Crops = dict[str, tuple[float, float, float, float]]


class Run:
    """A scene with its truth, and images made of few samples.

    Attributes:
        world: the scene.
        count: of samples.
        view: what its pixels show.
        truth: the image of which every pixel is shaded.
        white: radiance that a screen shows as white.
        found: criteria.
        density: of samples by name; "even" is 1.
    """

    def __init__(self, world: World, count: int):
        self.world, self.count = world, count
        self.view = shading.view(world)
        self.truth = shading.reference(world).sum(-1)
        self.white = float(np.quantile(self.truth, 0.99))
        self.found = shared.criteria(world, self.view, count)
        self.density = {"even": np.ones(self.truth.shape)}
        self.density |= {k: shared.spread(B) for k, B in self.found.maps.items()}

    def errors(self, density: np.ndarray, count: int, way: str = WAYS[0]) -> Errors:
        """RMSE, RMSE on screen and SSIM of an image of that many samples."""
        made = shared.image(self.view, self.truth, density, count, way)
        return shared.errors(made, self.truth, self.white)

    def seeds(self, crops: Crops, count: int) -> dict[tuple[str, str], np.ndarray]:
        """Errors by density and way at each seed: the three, then on screen at each crop."""
        true = shared.shown(self.truth, self.white)
        found = {(name, way): [] for name in ("even", "plain") for way in WAYS}
        for seed in range(count):
            for (name, way), rows in found.items():
                if way != WAYS[0] and seed >= max(count // 4, 3):
                    continue  # the filter takes three times as long
                density = self.density[name]
                made = shared.image(self.view, self.truth, density, self.count, way, seed)
                miss = shared.shown(made, self.white) - true
                at = [miss[_crop(true, box)] for box in crops.values()]
                own = lacks(shared.errors(made, self.truth, self.white))
                rows.append([*own, *(float(np.sqrt(np.mean(m**2))) for m in at)])
        return {name: np.array(rows) for name, rows in found.items()}

    def costs(self, rounds: int) -> dict[str, Ratio]:
        """What a criterion costs over the shading of all samples, measured in turns.

        Rays to find blockers, their triangles and differences are timed as they are used; shading
        for some of the samples.
        """
        at = shared.chosen(self.density["even"], self.count)
        first = shared.chosen(self.density["even"], self.found.asked)
        some = at[: 4 * shading.BLOCK]
        points = shading.some(self.view.points, some @ (self.truth.shape[1], 1))
        value, share = self.found.plain[tuple(first.T)], self.count / len(some)

        def blockers():
            return shared.slopes_at(shared.plain_rays, self.world, self.view, first)

        others, spent = timing.Others(), []
        for _ in range(rounds + 1):
            rays = timing.seconds(blockers)
            shaded = share * timing.seconds(lambda: shading.shade(self.world, points))
            over = timing.seconds(lambda: shared.between(self.view, first, value))
            turns = timing.seconds(lambda: shared.criterion(self.world, self.view))
            spent.append((rays + over + turns, turns, shaded, rays, over))
        found = {"time": 0, "mirror": 1, "rays alone": 3, "triangles": 4}  # round 0 compiles
        asked = self.found.asked / self.count * shared.RAYS / shading.PER_SAMPLE
        rays = Ratio(asked, 0.0)
        return {"rays": rays} | {
            name: timing.of_times([(one[k], one[2]) for one in spent[1:]], others)
            for name, k in found.items()
        }

    def finely(self) -> tuple[np.ndarray, dict[str, np.ndarray]]:
        """The truth and the images with four visibility samples a pixel, on a screen."""
        fine = self.world._replace(columns=2 * self.world.columns, rows=2 * self.world.rows)
        seen, images = shading.view(fine), {}
        for name in ("even", "plain"):
            at = shared.chosen(self.density[name], self.count)
            value = self.truth[tuple(at.T)]
            images[name] = shared.finely(self.view, seen, at, value, self.white)
        return shading.finer(self.world, self.truth, self.view.label, self.white), images


class Compared(NamedTuple):
    """Errors of images, and the images of four visibility samples.

    Attributes:
        seeds: errors by density and way, (seeds, three measures and a crop each).
        table: errors by density and way, at equal samples.
        cost: of a criterion over the shading of all samples, by what is counted.
        equal: errors of uniform images that cost as much, by what is counted and way.
        budgets: of samples.
        curves: the three errors at them by density and way, (budgets, 3).
        true: the truth with four visibility samples a pixel, as a screen shows it.
        images: the same of few samples, uniform and with blockers.
    """

    seeds: dict[tuple[str, str], np.ndarray]
    table: dict[tuple[str, str], np.ndarray]
    cost: dict[str, Ratio]
    equal: dict[tuple[str, str], np.ndarray]
    budgets: np.ndarray
    curves: dict[tuple[str, str], np.ndarray]
    true: np.ndarray
    images: dict[str, np.ndarray]


def lacks(e: Errors) -> Errors:
    """Errors of which all are best at nothing: 1 - SSIM in place of SSIM."""
    return e[0], e[1], 1.0 - e[2]


def compared(run: Run, crops: Crops, quick: bool) -> Compared:
    """All that both scenes are asked."""
    density, N = run.density, run.count
    budgets = np.array([int(N * s) for s in STEPS])
    curves = {
        (k, w): np.array([lacks(run.errors(density[k], n, w)) for n in budgets])
        for k in COMPARED
        for w in WAYS
    }
    table = {key: curve[STEPS.index(1.0)] for key, curve in curves.items()}
    table |= {("mirror", w): np.array(lacks(run.errors(density["mirror"], N, w))) for w in WAYS}
    seeds, cost = run.seeds(crops, 3 if quick else 20), run.costs(2 if quick else 5)
    equal = {
        (k, w): np.array(lacks(run.errors(density["even"], int(N * (1.0 + c.mean)), w)))
        for k, c in cost.items()
        if k in COSTS
        for w in WAYS
    }
    return Compared(seeds, table, cost, equal, budgets, curves, *run.finely())


# --- pictures ------------------------------------------------------------------------------------


def drawn(run: Run, found: Compared, crops: Crops) -> Any:
    """The picture: images, the first crop of each, errors, and errors by budget."""
    figure, axes = plotting.panels(3, 3, 4.4, 2.75)
    even, plain = found.images["even"], found.images["plain"]
    words = next(iter(crops))
    looks = {"reference": found.true, "uniform": even, "adaptive": plain}
    for k, (name, values) in enumerate(looks.items()):
        part = values[_crop(values, _as_wide(crops[words]))]
        options = dict(cmap="gray", vmin=0.0, vmax=1.0)
        show(axes[0, k], values, f"{'abc'[k]}) {name}", **options)
        show(axes[1, k], part, f"{'def'[k]}) {name}, the {words.split()[-1]}", **options)
    _error(axes[2, 0], even - found.true, "g) error, uniform")
    _error(axes[2, 1], plain - found.true, "h) error, adaptive")
    _curves(axes[2, 2], found)
    return figure


def _crop(values: np.ndarray, box: tuple[float, float, float, float]) -> tuple[slice, slice]:
    """Part of an image, from shares of its sides: left, low, right, high."""
    w, h = values.shape
    left, low, right, high = box
    return slice(int(left * w), int(right * w)), slice(int(low * h), int(high * h))


def _as_wide(box: tuple[float, float, float, float]) -> tuple[float, float, float, float]:
    """The part about a box that has the image's proportions, so that all panels are alike."""
    left, low, right, high = box
    side = max(right - left, high - low)
    x, y = (
        min(max(0.5 * (a + b - side), 0.0), 1.0 - side) for a, b in ((left, right), (low, high))
    )
    return x, y, x + side, y + side


def _error(ax, miss, title: str) -> None:
    show(ax, abs(miss), f"{title} (on screen, white: 0.1)", cmap="gray", vmin=0.0, vmax=0.1)


def _curves(ax, found: Compared) -> None:
    for (name, way), errors in found.curves.items():
        style = "o-" if way == "delaunay" else "^--"
        label = f"{NAMES[name]}, {'filter' if way == 'bilateral' else 'triangles'}"
        colour = plotting.COLOURS[COMPARED.index(name)]
        ax.loglog(found.budgets, errors[:, 0], style, color=colour, markersize=3,
                  linewidth=1.0, label=label)  # fmt: skip
    ax.set(title="i) error by budget", xlabel="samples",
           ylabel="RMSE (W/(m$^2$ sr))")  # fmt: skip
    ax.set_xticks(found.budgets, [f"{n:,}" for n in found.budgets])
    ax.set_box_aspect(found.true.shape[1] / found.true.shape[0])
    ax.yaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    ax.yaxis.set_major_formatter("{x:g}")
    ax.minorticks_off()
    ax.legend(fontsize=5.5)


def kept(run: Run, found: Compared) -> tuple[dict, dict, str]:
    """Arrays, curves and the size in words, as a `Drawing` has them."""
    arrays = {"truth": found.true, **{f"image {k}": v for k, v in found.images.items()}}
    arrays |= {f"seeds {k}, {w}": v for (k, w), v in found.seeds.items()}
    columns = {f"{NAMES[k]}, {w}": v[:, 0] for (k, w), v in found.curves.items()}
    size = f"{run.world.columns} x {run.world.rows} pixels, {run.count} samples"
    return arrays, {"rmse": {"samples": found.budgets, **columns}}, size


# --- claims --------------------------------------------------------------------------------------

WHY = {
    "rays": "As many samples more as the rays to find blockers would shade buy more than these do.",
    "time": "What finding blockers costs would shade more than it saves.",
    "mirror": "What the criterion costs would shade more than it saves.",
}


def triple(e) -> str:
    """The three measures in words."""
    return ", ".join(f"{a:.4f}" for a in e)


def smaller(words: str = "better"):
    """The rule for a ratio of errors."""
    return at_least(1.0, f"'{words}': smaller error")


def claims(run: Run, found: Compared, crops: Crops) -> list[Statement | Measurement]:
    """What holds of both scenes, or does not."""
    return [
        *_equal_samples(found, crops),
        *_equal_cost(found),
        *_measured(run, found),
        _falling(found.curves),
    ]


def _equal_samples(found: Compared, crops: Crops) -> list[Statement]:
    """Uniform over adaptive by seeds; the adaptive one's density is the bandwidth itself."""
    ratio, claims = found.seeds["even", WAYS[0]] / found.seeds["plain", WAYS[0]], []
    scanned = f"{len(ratio)} seeds of the samples"
    for way in WAYS:
        over_seeds = f"{len(found.seeds['even', way])} seeds of the samples"
        each = found.seeds["even", way] / found.seeds["plain", way]
        for k, words in enumerate(MEASURES):
            mean, error = spread(each[:, k])
            claims.append(Statement(f"Uniform over adaptive at 20,000 samples{BY[way]}: {words}",
                                    "better", mean, smaller(), "D05 Fig. 17", "times", error,
                                    over_seeds))  # fmt: skip
    for k, words in enumerate(crops, start=len(MEASURES)):
        mean, error = spread(ratio[:, k])
        claims.append(Statement(f"Uniform over adaptive, error on screen at {words}",
                                "better captures", mean, smaller("better captures"), "D05 Fig. 17",
                                "times", error, scanned))  # fmt: skip
    return claims


def _equal_cost(found: Compared) -> list[Statement | Measurement]:
    words = {
        "rays": ("plain", "equal rays, those to find blockers counted"),
        "time": ("plain", "equal processor time, all that a criterion costs counted"),
        "mirror": ("mirror", "equal processor time, criterion without blockers"),
    }
    claims = []
    for kind, (name, how) in words.items():
        cost = found.cost[kind]
        claims.append(Measurement(f"Uniform samples at {how}, over adaptive ones", 1.0 + cost.mean,
                                  "times", cost.error or None))  # fmt: skip
        for way in WAYS:
            least, error = _least(found, kind, name, way)
            count = len(found.seeds["even", way])
            claims.append(Statement(
                f"Uniform over adaptive at {how}{BY[way]}: least of the three measures", None,
                least, smaller(), OURS, "times", error, f"{count} seeds of the samples", WHY[kind],
            ))  # fmt: skip
    cost = found.cost["time"]
    claims.append(Statement("Finding blockers over the shading of 20,000 samples, processor time",
                            None, cost.mean, at_most(0.2, "a fifth"), OURS, "times", cost.error,
                            "rounds in turns"))  # fmt: skip
    parts = (("rays alone", "rays"), ("triangles", "triangles"), ("mirror", "differences"))
    for kind, words in parts:
        cost = found.cost[kind]
        claims.append(Measurement(f"... of that {words}", cost.mean, "times", cost.error))
    return claims


def _least(found: Compared, kind: str, name: str, way: str) -> tuple[float, float]:
    """The least ratio where a uniform image costs as much as an adaptive one, and its error.

    At equal samples the ratio with blockers is the mean over seeds; without blockers there is one
    seed. What more samples gain is measured at one seed; the cost is known to its own error.
    """
    cost, count = found.cost[kind], len(found.seeds["even", way])
    each = {k: np.log(found.seeds[k, way][:, : len(MEASURES)]) for k in ("even", "plain")}
    spread = np.std(each["even"] - each["plain"], 0, ddof=1)
    ratio = np.log(found.table["even", way] / found.table[name, way])
    if name == "plain":
        ratio, spread = np.mean(each["even"] - each["plain"], 0), spread / np.sqrt(count)
    gain = np.log(found.equal[kind, way] / found.table["even", way])
    by_cost = gain / np.log1p(cost.mean) * cost.error / (1.0 + cost.mean)
    by_gain = np.std(each["even"], 0, ddof=1) * np.sqrt(2.0)
    k = int(np.argmin(ratio + gain))
    least = float(np.exp(ratio[k] + gain[k]))
    return least, least * float(np.sqrt(spread[k] ** 2 + by_cost[k] ** 2 + by_gain[k] ** 2))


def _measured(run: Run, found: Compared) -> list[Measurement]:
    """Errors themselves, and what the filter costs beside a triangulation."""
    rows = [
        Measurement(f"{', '.join(MEASURES)} at 20,000 samples, first seed: {words}",
                    triple(found.table[name, WAYS[0]]))
        for name, words in NAMES.items()
    ]  # fmt: skip
    rows += [
        Measurement(f"The filter over a triangulation, RMSE: {words}",
                    float(found.table[name, "bilateral"][0] / found.table[name, "delaunay"][0]),
                    "times")
        for name, words in NAMES.items()
    ]  # fmt: skip
    four = {k: np.array(_on_screen(v, found.true)) for k, v in found.images.items()}
    return [
        *rows,
        Measurement("Uniform over adaptive with four visibility samples a pixel, RMSE on screen "
                    "and 1 - SSIM", triple(four["even"] / four["plain"])),
    ]  # fmt: skip


def _on_screen(found: np.ndarray, true: np.ndarray) -> tuple[float, float]:
    """RMSE of what a screen shows, and what SSIM lacks of 1."""
    return float(np.sqrt(np.mean((found - true) ** 2))), 1.0 - ssim(found, true, 1.0)


def _falling(curves) -> Statement:
    most = max(float(np.max(e[1:, 0] / e[:-1, 0])) for e in curves.values())
    words = "RMSE falls from each budget to the next, four times as large: largest ratio"
    return Statement(words, None, most, at_most(1.0, "falls"), OURS,
                     scanned="three densities, by the filter and over triangulations")  # fmt: skip
