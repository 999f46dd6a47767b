"""D05 Fig. 17 on any scene of `shared.shading`: few samples, spread evenly or by bandwidth.

What both scenes are asked (`d05_fig17`, `d05_fig17_meshes`): RMSE, RMSE on screen and SSIM at equal
samples, at equal rays and at equal processor time, by the filter and over triangulations.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from figures.d05.shared import sampling as shared
from figures.d05.shared import shading
from figures.d05.shared.shading import World
from figures.r07.shared.table import show
from figures.style import Claim
from firstorder import plotting
from firstorder.reconstruction.bilateral import bilateral_widths

WAYS = ("bilateral", "delaunay")
STEPS = (0.125, 0.25, 0.5, 1.0, 2.0, 4.0, 8.0)  # times the paper's samples
NAMES = {"even": "uniform", **shared.WORDS}
COMPARED = ("even", "plain", "light")  # over budgets

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

    def errors(self, density: np.ndarray, count: int, way: str = "bilateral") -> Errors:
        """RMSE, RMSE on screen and SSIM of an image of that many samples."""
        made = shared.image(self.view, self.truth, density, count, way)[1]
        return shared.errors(made, self.truth, self.white)

    def shading(self) -> float:
        """Processor time of a shaded pixel [s]."""
        rows = np.random.default_rng(1).permutation(self.truth.size)[: 4 * shading.BLOCK]
        points = shading.some(self.view.points, rows)
        shading.shade(self.world, shading.some(points, np.arange(shading.BLOCK)))  # compiled
        return shared.timed(lambda: shading.shade(self.world, points))[0] / len(rows)

    def costs(self) -> dict[str, int]:
        """Samples of a uniform image that costs what the paper's adaptive one does."""
        took, each = self.found.seconds, self.shading()
        blockers = took["plain"] + took["plain filter"]
        return {
            "rays": int(self.count * (1.0 + shared.RAYS / shading.PER_SAMPLE)),
            "time": int(self.count + (blockers + took["differences"]) / each),
            "mirror": int(self.count + took["differences"] / each),
        }

    def finely(self) -> tuple[np.ndarray, dict[str, np.ndarray]]:
        """The truth and the images with four visibility samples a pixel."""
        fine = self.world._replace(columns=2 * self.world.columns, rows=2 * self.world.rows)
        seen, images = shading.view(fine), {}
        for name in ("even", "plain"):
            at = shared.chosen(self.density[name], self.count)
            width = bilateral_widths(self.density[name], len(at))
            images[name] = shared.finely(self.view, seen, at, self.truth[tuple(at.T)], width)
        return shading.finer(self.world, self.truth, self.view.label), images


class Compared(NamedTuple):
    """Errors of images, and the images of four visibility samples.

    Attributes:
        table: errors by density and way, at equal samples.
        cost: samples of uniform images, by what is equal.
        equal: their errors, by what is equal and way.
        budgets: of samples.
        curves: RMSE at them, by density and way.
        true: the truth with four visibility samples a pixel.
        images: the same of few samples, uniform and with blockers.
    """

    table: dict[tuple[str, str], Errors]
    cost: dict[str, int]
    equal: dict[tuple[str, str], Errors]
    budgets: np.ndarray
    curves: dict[tuple[str, str], np.ndarray]
    true: np.ndarray
    images: dict[str, np.ndarray]


def compared(run: Run, quick: bool) -> Compared:
    """All that both scenes are asked."""
    density, N = run.density, run.count
    table = {(k, w): run.errors(d, N, w) for k, d in density.items() for w in WAYS}
    cost = run.costs()
    equal = {(k, w): run.errors(density["even"], n, w) for k, n in cost.items() for w in WAYS}
    budgets = np.array([int(N * s) for s in STEPS[:: 3 if quick else 1]] + [run.truth.size])
    curves = {
        (k, w): np.array([run.errors(density[k], n, w)[0] for n in budgets])
        for k in COMPARED
        for w in WAYS
    }
    return Compared(table, cost, equal, budgets, curves, *run.finely())


# --- pictures ------------------------------------------------------------------------------------


def drawn(run: Run, found: Compared, crops: Crops) -> Any:
    """The picture: images, the first crop of each, errors, and errors by budget."""
    figure, axes = plotting.panels(3, 3, 4.4, 2.75)
    even, plain = found.images["even"], found.images["plain"]
    words = next(iter(crops))
    looks = {"reference": found.true, "uniform": even, "adaptive": plain}
    for k, (name, values) in enumerate(looks.items()):
        screen = shared.shown(values, run.white)
        part = screen[_crop(screen, crops[words])]
        options = dict(cmap="gray", vmin=0.0, vmax=1.0)
        show(axes[0, k], screen, f"{'abc'[k]}) {name}", **options)
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


def _error(ax, miss, title: str) -> None:
    show(ax, abs(miss), f"{title} (white: 0.1 W/(m$^2$ sr))", cmap="gray", vmin=0.0, vmax=0.1)


def _curves(ax, found: Compared) -> None:
    for (name, way), rmse in found.curves.items():
        style = "o-" if way == "bilateral" else "^--"
        label = f"{NAMES[name]}, {'filter' if way == 'bilateral' else 'triangles'}"
        colour = plotting.COLOURS[COMPARED.index(name)]
        ax.loglog(found.budgets[:-1], rmse[:-1], style, color=colour, markersize=3,
                  linewidth=1.0, label=label)  # fmt: skip
    ax.set(title="i) error by budget; 0 when all are shaded", xlabel="samples",
           ylabel="RMSE (W/(m$^2$ sr))")  # fmt: skip
    ax.legend(fontsize=5.5)


def kept(run: Run, found: Compared) -> tuple[dict, dict, str]:
    """Arrays, curves and the size in words, as a `Drawing` has them."""
    arrays = {"truth": found.true, **{f"image {k}": v for k, v in found.images.items()}}
    columns = {f"{NAMES[k]}, {w}": v for (k, w), v in found.curves.items()}
    size = f"{run.world.columns} x {run.world.rows} pixels, {run.count} samples"
    return arrays, {"rmse": {"samples": found.budgets, **columns}}, size


# --- claims --------------------------------------------------------------------------------------


def triple(e: Errors) -> str:
    """The three measures in words."""
    return f"{e[0]:.4f}, {e[1]:.4f}, {e[2]:.4f}"


def better(e: Errors, other: Errors) -> bool:
    """In all three measures."""
    return e[0] < other[0] and e[1] < other[1] and e[2] > other[2]


def claims(run: Run, found: Compared, crops: Crops) -> list[Claim]:
    """What holds of both scenes, or does not."""
    return [
        *_equal_samples(found.table),
        *_with_four(run, found, crops),
        *_equal_cost(run, found),
        *_triangulated(found.table),
        _falling(found.curves),
    ]


def _equal_samples(table) -> list[Claim]:
    even = table["even", "bilateral"]
    about = "RMSE (W/(m^2 sr)), RMSE on screen, SSIM at 20,000 samples"
    claims = [Claim(f"{about}: uniform", None, triple(even))]
    for name, words in shared.WORDS.items():
        e = table[name, "bilateral"]
        paper = "better than uniform" if name == "plain" else None
        claims.append(Claim(f"{about}: {words}", paper, triple(e), "", better(e, even)))
    return claims


def _with_four(run: Run, found: Compared, crops: Crops) -> list[Claim]:
    four = {k: shared.errors(v, found.true, run.white) for k, v in found.images.items()}
    claims = [
        Claim("The same with four visibility samples a pixel: uniform, then with blockers",
              "better than uniform", f"{triple(four['even'])}; {triple(four['plain'])}", "",
              better(four["plain"], four["even"]))
    ]  # fmt: skip
    true = shared.shown(found.true, run.white)
    miss = {k: shared.shown(v, run.white) - true for k, v in found.images.items()}
    for words, box in crops.items():
        crop = _crop(true, box)
        even, own = (float(np.sqrt(np.mean(miss[k][crop] ** 2))) for k in ("even", "plain"))
        text = f"Error on screen at {words}, uniform over adaptive"
        paper = "sharp detail better captured"
        claims.append(Claim(text, paper, even / own, "times", even > own))
    return claims


def _equal_cost(run: Run, found: Compared) -> list[Claim]:
    words = {
        "rays": ("plain", "equal rays, those to find blockers counted"),
        "time": ("plain", "equal processor time, all that a criterion costs counted"),
        "mirror": ("mirror", "equal processor time, criterion without blockers"),
    }
    claims = []
    for kind, (name, how) in words.items():
        claims.append(Claim(f"Uniform samples at {how}, over adaptive ones", None,
                            found.cost[kind] / run.count, "times"))  # fmt: skip
        for way, other in (("bilateral", ""), ("delaunay", ", both over triangulations")):
            e, even = found.table[name, way], found.equal[kind, way]
            text = f"Uniform image's RMSE, RMSE on screen, SSIM at {how}{other}"
            paper = "adaptive is better (at equal samples)" if name == "plain" else None
            claims.append(Claim(text, paper, triple(even), "", better(e, even)))
    return claims


def _triangulated(table) -> list[Claim]:
    claims = []
    for name, words in NAMES.items():
        e, other = table[name, "delaunay"], table[name, "bilateral"]
        claims.append(Claim(f"Over a triangulation in place of the filter: {words}", None,
                            triple(e), "", better(e, other)))  # fmt: skip
    return claims


def _falling(curves) -> Claim:
    falls = all(np.all(np.diff(rmse) < 0.0) for rmse in curves.values())
    least = max(float(rmse[-1]) for rmse in curves.values())
    words = "Every error falls from each budget to the next, and is nothing when all are shaded"
    return Claim(words, None, f"{'yes' if falls else 'no'}, {least:.1e}", "", falls and not least)
