"""Where the errors of shared rays stop falling, taken apart; and how far that floor is pushed down.

Ours, not the paper's. A window of 96 x 96 pixels of Fig. 13's scene, 256 x 256 pixels, the one with
most penumbra; its ground traces rays, and that of its inner half is judged (a, 729 pixels: light,
penumbra and shadow at a ball's foot). Runs with different rays have their noise apart and what the
method leaves out in common: (e) is the root of the mean product of their errors at 64 rays a
pixel, each against a reference of its own. Pixels among blockers have 256 own rays and more.

The floor of 2 cycles and 4 x 4 cells, 1.87 %, is for the most part neither the band limit (8 cycles
alone: 1.71) nor the cells (8 x 8 alone: 1.64), nor that few rays know few blockers (bounds by 2
rays: 1.80), nor where rays start, which on ground alone changes nothing. It is that bounds of
depths know what is between the lamp and the pixel, and the filter looks at places beside it: in
full light next to a penumbra (the streak in b) a frustum grazes one thing at one depth, which
allows any width, and rays that other things hide at other depths are slid to the wrong place. With
bounds under the filter (`space.depths_under_filter`; red, c) it is 1.03, and then limit and
cells count: .93 with 8 cycles, .77 with 8 x 8 cells, .60 with both. Too many cells are worse again
(16 x 16: 1.34): the filter of such a limit holds fewer rays than cells, and a cell without rays
takes the mean of all rays, which the light's falloff does not weigh. The last part, filters of half
a pixel at least against references of points, is in all of them.

So the floor is pushed down by bounds under the filter, a band limit that grows with the fourth root
of the rays, and cells as there are rays to fill them (`e11.shared.methods.band_of`, `cells_of`):
(d) falls from 16 to 256 rays by a factor of 2.9, where 2 cycles and bounds of the pixel stand
still. What is judged are 20 pairs of runs of 16 rays a pixel. The limit of each pixel
(`select_band_limits`) halves that floor at 256 rays, by bounds of the pixel as well. The figures of
the paper have bounds of the pixel, as the paper does.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from figures.e11.shared import limits, methods
from figures.e11.shared import space as scenes
from figures.style import Drawing
from figures.verdicts import OURS, Measurement, Statement, at_most
from firstorder import plotting
from firstorder.shadowfield.rendering.band_limit_choice import band_limit_sweep, select_band_limits
from firstorder.shadowfield.rendering.depth_bounds import blocker_depths
from firstorder.shadowfield.rendering.ray_table import RayTable, trace_shadow_rays
from firstorder.shadowfield.rendering.sheared_filter import depths_under_filter, sheared_shadow

WINDOW, QUICK_WINDOW = 96, 24  # pixels along a side that trace rays; those of the inner half count
RAYS, QUICK_RAYS = 64, 16  # a pixel, of the floors
BUDGETS, QUICK_BUDGETS = (1, 4, 16, 64, 256), (1, 4, 16)
CYCLES, CELLS = 2.0, 4  # what is held
LADDER = 2.0 ** np.arange(6)  # cycles that are offered to each pixel
OWN = 256  # rays of pixels among the blockers
SEED = 31
HELD, UNDER = "2 cycles, 4 x 4 cells", "bounds under the filter"
RAISED = "... and 8 cycles, 8 x 8 cells"
LABELS = {
    "held": "2 cycles, 4 x 4 cells",
    "raised": "limit and cells raised",
    "automatic": "limit of each pixel",
    "under": "raised, bounds under the filter",
    "stratified": "stratified",
}


class Part(NamedTuple):
    """Ground in a window of an image.

    Attributes:
        scene: all of it.
        around: numbers of its pixels.
        where: numbers of those that are judged, in the middle.
        truths: what they see, by two references with rays of their own.
    """

    scene: scenes.Scene
    around: np.ndarray
    where: np.ndarray
    truths: tuple[np.ndarray, np.ndarray]

    @property
    def points(self) -> np.ndarray:
        """Of those that are judged."""
        return self.scene.receivers[self.where]

    @property
    def diameter(self) -> float:
        """Of the lamp [m]."""
        return 2.0 * float(self.scene.lamp.half[0])

    def traced(self, rays: int, seed: int) -> RayTable:
        """Shared rays of the window."""
        lamp, points = self.scene.lamp, self.scene.receivers[self.around]
        return trace_shadow_rays(lamp, points, rays, self.scene.blockers, seed)[0]

    def own(self, seed: int, rays: int = OWN) -> np.ndarray:
        """Stratified rays of the judged pixels' own."""
        return scenes.own_rays(self.scene, self.where, rays, [SEED, seed])

    def rms(self, found: np.ndarray) -> float:
        """Error, the reference's own taken out by the other one."""
        a, b = (found - t for t in self.truths)
        return float(np.sqrt(max(np.mean(a * b), 0.0)))

    @property
    def own_error(self) -> float:
        """Of a reference, by the two of them."""
        a, b = self.truths
        return float(np.sqrt(0.5 * np.mean((a - b) ** 2)))

    def floor(self, pair: list[np.ndarray]) -> float:
        """What two runs with other rays have in common of their errors: no noise."""
        a, b = (found - t for found, t in zip(pair, self.truths, strict=True))
        return float(np.sqrt(max(np.mean(a * b), 0.0)))


def part(side: int, quick: bool) -> Part:
    """The window with most penumbra in Fig. 13's scene."""
    scene = scenes.gathering(side, *((1000, 100) if quick else ()))
    rays, size = (scenes.QUICK_RAYS, QUICK_WINDOW) if quick else (scenes.RAYS, WINDOW)
    true = scenes.reference(scene, rays)
    ground = np.where(scene.picture(scene.floor) > 0.0, true, np.nan)
    square = limits.window(ground, size)
    edge = size // 4
    inner = tuple(slice(s.start + edge, s.stop - edge) for s in square)
    number = np.arange(side**2).reshape(side, side)
    around, where = (n[scene.floor[n]] for n in (number[square].ravel(), number[inner].ravel()))
    other = scenes.own_rays(scene, where, rays, [SEED, 0])
    return Part(scene, around, where, (true.ravel()[where], other))


def answer(p: Part, table: RayTable, own: np.ndarray, cycles: float, cells: int, bounds):
    """What judged pixels see by shared rays."""
    limit, pixel, light = cycles / p.diameter, p.scene.pixel, scenes.falloff
    return sheared_shadow(
        p.scene.lamp, table, p.points, limit, pixel, own, cells, light, bounds
    ).visible  # fmt: skip


# --- what is measured ----------------------------------------------------------------------------


def floors(p: Part, rays: int) -> dict[str, float]:
    """What is left of the error without noise, as parts of it are taken away or put in."""
    tables = [p.traced(rays, SEED + k) for k in range(2)]
    own = [p.own(1 + k) for k in range(2)]
    few = [p.traced(2, SEED + 7 + k) for k in range(2)]
    lamp, pixel = p.scene.lamp, p.scene.pixel
    bounds = [blocker_depths(lamp, t, p.points, pixel) for t in tables]
    rough = [blocker_depths(lamp, t, p.points, pixel) for t in few]
    dumb = [_without_starts(t) for t in tables]

    def pair(cycles=CYCLES, cells=CELLS, known=bounds, rays=tables) -> float:
        runs = zip(rays, own, known, strict=True)
        return p.floor([answer(p, t, o, cycles, cells, b) for t, o, b in runs])

    def under(cycles: float) -> list:
        return [depths_under_filter(lamp, t, p.points, cycles / p.diameter, pixel) for t in tables]

    return {
        HELD: pair(),
        "8 x 8 cells": pair(cells=8),
        "16 x 16 cells": pair(cells=16),
        "8 cycles": pair(8.0),
        "16 cycles": pair(16.0),
        "8 cycles, 8 x 8 cells": pair(8.0, 8),
        "bounds by 2 rays a pixel": pair(known=rough),
        "starts not told": pair(rays=dumb),
        UNDER: pair(known=under(CYCLES)),
        "... and 8 x 8 cells": pair(cells=8, known=under(CYCLES)),
        "... and 8 cycles": pair(8.0, known=under(8.0)),
        RAISED: pair(8.0, 8, under(8.0)),
        "... and 16 cycles, 16 x 16 cells": pair(16.0, 16, under(16.0)),
    }


def _without_starts(table: RayTable) -> RayTable:
    """Rays as if all started below all receivers, and were hidden at the lamp."""
    near = np.where(table.free, np.inf, 0.0).astype(np.float32)
    return table._replace(near=near, start=np.full_like(near, np.inf))


def curves(p: Part, budgets: tuple[int, ...]) -> dict[str, np.ndarray]:
    """Errors by rays a pixel: with what is held, with what is raised, and by itself."""
    image = (p.where, p.scene.side)
    rows = []
    for rays in budgets:
        table, own = p.traced(rays, SEED), p.own(1, max(OWN, rays))
        bounds = blocker_depths(p.scene.lamp, table, p.points, p.scene.pixel)
        cells = methods.cells_of(rays)
        raised = methods.band_of(p.scene, rays) * p.diameter
        rungs = band_limit_sweep(
            p.scene.lamp, table, p.points, LADDER / p.diameter, p.scene.pixel, own, image, cells,
            scenes.falloff, bounds, own_rays=max(OWN, rays),
        )  # fmt: skip
        under = depths_under_filter(
            p.scene.lamp, table, p.points, raised / p.diameter, p.scene.pixel
        )
        rows.append(
            [
                rays,
                p.rms(answer(p, table, own, CYCLES, CELLS, bounds)),
                p.rms(answer(p, table, own, raised, cells, bounds)),
                p.rms(select_band_limits(rungs, image).visible),
                p.rms(answer(p, table, own, raised, cells, under)),
                p.rms(p.own(2, rays)),
            ]
        )
    names = ("rays", "held", "raised", "automatic", "under", "stratified")
    return dict(zip(names, np.array(rows, float).T, strict=True))


# --- the picture ---------------------------------------------------------------------------------


def draw(quick: bool = False) -> Drawing:
    """The window, where it is off, floors as bars, and errors by rays."""
    side = scenes.QUICK_SIDE if quick else scenes.SIDE
    p = part(side, quick)
    rays, budgets = (QUICK_RAYS, QUICK_BUDGETS) if quick else (RAYS, BUDGETS)
    found, rms = floors(p, rays), curves(p, budgets)
    maps = _maps(p, rays)
    figure, axes = plotting.panels(2, 4, 2.9, 2.9)
    grid = axes[0, 0].get_gridspec()
    for ax in (axes[0, 3], *axes[1]):
        ax.remove()
    column, row = np.divmod(p.where, side)
    part_of = slice(column.min(), column.max() + 1), slice(row.min(), row.max() + 1)
    images = [p.scene.picture(a, p.where)[part_of] for a in (p.truths[0], *maps)]
    scenes.show(axes[0, 0], images[0], "a) what is judged", cmap="gray", vmin=0.0, vmax=1.0)
    titles = ("b) off, bounds of the pixel", "c) off, bounds under the filter")
    for ax, image, title in zip(axes[0, 1:3], images[1:], titles, strict=True):
        drawn = scenes.show(ax, image, title, cmap=plotting.SIGNED, vmin=-0.1, vmax=0.1)
        figure.colorbar(drawn, ax=ax, shrink=0.75)
    for ax in axes[0, :3]:
        ax.set_facecolor("#5b6b86")
    _bars(figure.add_subplot(grid[1, 1:]), found)
    _errors(figure.add_subplot(grid[0, 3]), figure.add_subplot(grid[1, 0]), rms, p.own_error)
    arrays = {"judged": images[0], "pixel's bounds": images[1], "bounds under filter": images[2]}
    columns = {"errors": rms, "floors": {"rms": np.array(list(found.values()))}}
    size = f"{len(p.where)} pixels of the ground judged, {len(p.around)} trace rays"
    return Drawing(figure, arrays, _claims(found, rms, p, quick), columns, size, SEED)


def _maps(p: Part, rays: int) -> list[np.ndarray]:
    """Errors at 8 cycles and 8 x 8 cells, with either bounds."""
    table, own, lamp, pixel = p.traced(rays, SEED), p.own(1), p.scene.lamp, p.scene.pixel
    limit = 8.0 / p.diameter
    both = (
        blocker_depths(lamp, table, p.points, pixel),
        depths_under_filter(lamp, table, p.points, limit, pixel),
    )
    true = 0.5 * (p.truths[0] + p.truths[1])
    return [answer(p, table, own, 8.0, 8, b) - true for b in both]


def _bars(ax, found: dict[str, float]) -> None:
    colours = [plotting.COLOURS[int("under" in k or k.startswith("..."))] for k in found]
    ax.barh(range(len(found)), [100.0 * v for v in found.values()], color=colours)
    ax.set_yticks(range(len(found)), list(found), fontsize=7)
    ax.invert_yaxis()
    ax.set(title="e) what is left without noise", xlabel="RMS, % of light")


def _errors(ax, names, rms: dict[str, np.ndarray], least: float) -> None:
    """Curves, and in an axis of their own what they are."""
    for (key, label), colour in zip(LABELS.items(), plotting.COLOURS, strict=False):
        ax.loglog(rms["rays"], rms[key], "o-", color=colour, markersize=3, label=label)
    ax.axhline(least, color="0.6", linestyle=":", label="a reference's own error")
    ax.set_xticks(rms["rays"], [f"{r:g}" for r in rms["rays"]])
    ax.minorticks_off()
    ax.set(title="d) RMS error", xlabel="rays for each pixel")
    names.axis("off")
    names.legend(*ax.get_legend_handles_labels(), loc="center")


def _lowered(p: Part, cycles: float, cells: int, runs: int) -> tuple[float, float]:
    """Error of bounds under the filter over that of bounds of the pixel, as noise averages out.

    Runs come in pairs that have no ray in common: mean products of their errors are free of noise.
    """
    lamp, pixel = p.scene.lamp, p.scene.pixel
    products = np.empty((runs, 2))
    for k in range(runs):
        pairs: tuple[list, list] = ([], [])
        for half in range(2):
            seed = SEED + 100 + 2 * k + half
            table, own = p.traced(QUICK_RAYS, seed), p.own(seed)
            plain = blocker_depths(lamp, table, p.points, pixel)
            under = depths_under_filter(lamp, table, p.points, cycles / p.diameter, pixel)
            for pair, bounds in zip(pairs, (plain, under), strict=True):
                pair.append(answer(p, table, own, cycles, cells, bounds))
        for i, pair in enumerate(pairs):
            a, b = (found - t for found, t in zip(pair, p.truths, strict=True))
            products[k, i] = np.mean(a * b)
    # The standard error by leaving out one pair after the other.
    sums = np.maximum(np.sum(products, 0), 1e-12)
    without = np.maximum(np.sum(products, 0) - products, 1e-12)
    ratio, others = np.sqrt(sums[1] / sums[0]), np.sqrt(without[:, 1] / without[:, 0])
    return float(ratio), float(np.std(others) * np.sqrt(runs - 1))


def _claims(found: dict[str, float], rms, p: Part, quick: bool) -> list[Statement | Measurement]:
    claims: list[Statement | Measurement] = [
        Measurement(
            f"RMS error without noise, {name.replace('...', UNDER)}", 100.0 * value, "% of light"
        )
        for name, value in found.items()
    ]
    claims += [
        Measurement(
            f"RMS error at each budget, {label}",
            ", ".join(f"{100.0 * e:.2f}" for e in rms[key]),
            "% of light",
        )
        for key, label in LABELS.items()
    ]
    runs = 3 if quick else 20
    ratio = _lowered(p, CYCLES, CELLS, runs)
    claims.append(
        Statement(
            "Bounds under the filter lower the floor: RMS error without noise over that with "
            "bounds "
            "of the pixel, 16 rays, 2 cycles, 4 x 4 cells",
            None,
            ratio[0],
            at_most(1.0, "'lower': a smaller error"),
            OURS,
            "times",
            ratio[1],
            f"{runs} pairs of runs",
        )
    )
    return [*claims, Measurement("RMS error of a reference", 100.0 * p.own_error, "% of light")]
