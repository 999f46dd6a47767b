"""E11 §5: the ray database as a 2D grid over slopes, and as a 4D grid over slopes and feet.

The paper keeps rays in a grid over v1 and v2, and has found of a 4D grid and other structures that
"they delivered little speedup when queried with the highly anisotropic shapes and varied
orientations of sheared filters". Here both are one code (`competitors.ray_grids`), whose grids have
32 to 256 cells over each slope and 1 to 16 over each foot; 1 is the paper's. 1,024 x 1,024 pixels,
1 shared ray a pixel, so that there are as many rays as in the paper's Fig. 1 (637,000). Every
twelfth pixel of the ground both ways asks that has a filter: the filters of `sheared_shadow` at 4
cycles across the lamp, as in Fig. 10's closeup, from the blockers' depths at each receiver.

Above: the processor's time of a receiver. Below: rays that are weighed for each that counts. What
the library does instead, rows of rays at a common depth (`_weighted_sums`), is drawn as a line. It
tells cells of the lamp apart besides, which the grids here do not.

"Little speedup" is read as less than half as fast again: at most 1.5 between the best of each.
"""

from __future__ import annotations

import time
from typing import NamedTuple

import numpy as np

from figures import timing
from figures.e11.competitors.ray_grids import Query, query, ray_grid
from figures.e11.shared import methods
from figures.e11.shared import space as e11
from figures.style import Drawing
from figures.verdicts import OURS, Measurement, Statement, at_least, at_most
from firstorder import plotting
from firstorder.shadowfield.rendering._filter_shape import filter_shape
from firstorder.shadowfield.rendering._weighted_sums import gather
from firstorder.shadowfield.rendering.depth_bounds import blocker_depths
from firstorder.shadowfield.rendering.lamp import LampFrame
from firstorder.shadowfield.rendering.ray_table import RayTable, trace_shadow_rays

SEED = 5
SLOPES, QUICK_SLOPES = (32, 64, 128, 256), (8, 16)
FEET, QUICK_FEET = (1, 2, 4, 8, 16), (1, 2, 4)
EVERY, QUICK_EVERY = 12, 2  # pixels of which one is answered, both ways
LITTLE = 1.5  # times as fast


class Filters(NamedTuple):
    """Rays, and the filters over them.

    Attributes:
        lamp: the lamp.
        table: the rays.
        local: receivers in the lamp's frame [m].
        sigma: of the Gaussian [m].
        shear: of the filter.
    """

    lamp: LampFrame
    table: RayTable
    local: np.ndarray
    sigma: np.ndarray
    shear: np.ndarray

    def by_grid(self, slopes: int, feet: int):
        """A call that asks a grid of so many cells for all receivers."""
        grid = ray_grid(self.lamp, self.table, slopes, feet)
        return lambda: query(grid, self.lamp, self.local, self.sigma, self.shear)

    def by_rows(self):
        """The same by the library, without cells of the lamp."""
        return gather(self.lamp, self.table, self.local, self.sigma, self.shear, 1)


class Race(NamedTuple):
    """A scene's grids, by cells of slopes and of feet.

    Attributes:
        seconds: of a receiver.
        answers: of each.
        rows: of a receiver by the library.
    """

    seconds: np.ndarray
    answers: dict[tuple[int, int], Query]
    rows: float


def filters(scene: e11.Scene, every: int, dense: float) -> Filters:
    """The rays of all pixels of the ground, `dense` for each of 256 x 256; the filters of some."""
    points = scene.receivers[scene.floor]
    table, _ = trace_shadow_rays(scene.lamp, points, 1, scene.blockers, SEED)
    some = scene.receivers[scene.floor & scene.every(every)]
    near, far = blocker_depths(scene.lamp, table, some, scene.pixel)
    local, limit = scene.lamp.local(some), methods.band_of(scene, dense)
    half = float(np.max(scene.lamp.half))
    shape = filter_shape(local[:, 2], near, far, limit, scene.pixel, half)
    use = np.isfinite(shape.sigma)
    return Filters(scene.lamp, table, local[use], shape.sigma[use], shape.shear[use])


def race(given: Filters, slopes, feet) -> Race:
    """All grids, and the library's rows, each once; the best are timed again, in turns."""
    count, answers, seconds = len(given.local), {}, np.empty((len(slopes), len(feet)))
    given.by_grid(slopes[-1], feet[-1])()  # compiles
    given.by_rows()
    for i, n in enumerate(slopes):
        for k, m in enumerate(feet):
            ask, before = given.by_grid(n, m), time.process_time()
            answers[n, m] = ask()
            seconds[i, k] = (time.process_time() - before) / count
    return Race(seconds, answers, timing.seconds(given.by_rows) / count)


def draw(quick: bool) -> Drawing:
    side, every = (e11.QUICK_SIDE, QUICK_EVERY) if quick else (e11.PAPER_SIDE, EVERY)
    slopes, feet = (QUICK_SLOPES, QUICK_FEET) if quick else (SLOPES, FEET)
    scenes = {"grids": e11.grids(side), "plant": e11.plant(side, quick)}
    figure, axes = plotting.panels(2, 2, 3.4, 2.5, sharex=True)
    claims: list[Statement | Measurement] = []
    columns = {}
    for (name, scene), above, below in zip(scenes.items(), *axes, strict=True):
        given = filters(scene, every, 1.0 if quick else e11.DENSE)
        found = race(given, slopes, feet)
        _draw_scene(above, below, found, slopes, feet, name)
        columns[name] = {"slopes": np.repeat(slopes, len(feet)), "feet": np.tile(feet, len(slopes)),
                         "seconds": found.seconds.ravel()}  # fmt: skip
        claims += _claims(name, given, found, slopes, feet, 3 if quick else 5)
    axes[0, 0].set_ylabel("time of a receiver [µs]")
    axes[1, 0].set_ylabel("rays weighed for each that counts")
    axes[1, 1].legend(*axes[0, 1].get_legend_handles_labels(), fontsize=7)
    size = f"{side} x {side} pixels, 1 ray a pixel"
    return Drawing(figure, {}, claims, columns, size, SEED)


def _draw_scene(above, below, found: Race, slopes, feet, name: str) -> None:
    for k, n in enumerate(slopes):
        colour = plotting.COLOURS[k]
        above.semilogx(feet, 1e6 * found.seconds[k], "o-", ms=3, color=colour, label=f"{n} slopes")
        shares = [_waste(found.answers[n, m]) for m in feet]
        below.semilogx(feet, shares, "o-", ms=3, color=colour)
    above.axhline(1e6 * found.rows, color="0.4", linestyle=":", label="the library's rows")
    above.set_title(f"{name}: time")
    above.set_ylim(bottom=0.0)
    below.set_ylim(bottom=0.0)
    below.set(title=f"{name}: rays", xlabel="cells over each foot (1: the paper's 2D grid)")
    below.set_xticks(feet, [str(k) for k in feet])
    below.minorticks_off()


def _waste(answer: Query) -> float:
    """Rays that are weighed for each that counts."""
    return float(answer.touched.sum() / answer.used.sum())


def _claims(name: str, given: Filters, found: Race, slopes, feet, rounds: int):
    flat = int(np.argmin(found.seconds[:, 0]))
    deep = np.unravel_index(np.argmin(found.seconds[:, 1:]), found.seconds[:, 1:].shape)
    two, four = (slopes[flat], 1), (slopes[deep[0]], feet[1 + deep[1]])
    speed = timing.ratio(given.by_grid(*two), given.by_grid(*four), rounds)
    rows = timing.ratio(given.by_grid(*four), given.by_rows, rounds)
    total = given.by_rows().total
    off = float(np.quantile(abs(found.answers[four].total - total) / total.max(), 0.95))
    scanned = (
        f"{len(slopes)} numbers of slopes, {len(feet) - 1} of feet; {len(given.local)} filters"
    )
    return [
        Statement(
            f"A 4D grid delivers little speedup over the 2D grid: time of the best of these over "
            f"that of the best of those, {name}",
            "little speedup",
            speed.mean,
            at_most(LITTLE, "'little': less than half as fast again"),
            "E11 §5",
            "times",
            speed.error,
            scanned,
            "A filter takes a thin slice of the feet that a slope's cell holds; a grid over feet "
            "skips the others, and its cells are few enough to be looked into.",
        ),
        Measurement(
            f"Cells over each slope and over each foot of the best grids, {name}",
            f"{two[0]} and 1; {four[0]} and {four[1]}",
        ),
        Measurement(
            f"Rays weighed for each that counts, in the best 2D and 4D grid, {name}",
            f"{_waste(found.answers[two]):.1f}; {_waste(found.answers[four]):.1f}",
        ),
        Statement(
            f"The library's rows of rays are no slower than grids: time of the best grid over "
            f"theirs, {name}",
            None,
            rows.mean,
            at_least(1.0, "'no slower'"),
            OURS,
            "times",
            rows.error,
            scanned,
            "A row holds rays of all feet; where filters are narrow, a grid over feet leaves more "
            "of them out than rows gain by their straight runs.",
        ),
        Statement(
            f"Grids and rows are one sum: difference of weights over the largest, 95th percentile, "
            f"{name}",
            None,
            off,
            at_most(1e-4, "single precision, but for rays on the rim of a filter"),
            OURS,
        ),
    ]
