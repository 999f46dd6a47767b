"""One scene in all portraits: gradient, spectrum, cache and brute force beside each other.

Not a figure of the papers; it puts theirs on one scene. A lamp hangs 1 m above a floor, from
x = -0.5 to 0.5; a strip at 0.5 m from -0.2 to 0.2 and a disc of radius 0.06 about (0.45, 0.62)
stand between them; all is black. The receiver of the table lies at x = 0.26.

Left: the scene; what the floor sees over (x, v), with the silhouettes of every shape as lines; the
spectrum of the blockers' visibility under a Hann window, and the wedge between the depths of strip
and disc (E11). Middle: E, E' and E'' along the floor, in several ways on top of each other: lines
are intervals and their autodiff, marks every fourth receiver are other ways, in turn. Where two
edges are in line, E' jumps (dotted lines: visual events). Right: the table that
`firstorder.checks.agreements` prints. Errors are distances from the reference, bounds are computed
from rounding, conditioning, steps and standard errors; E'' by random paths and photons has error
bars of its own size, which is what second derivatives cost by chance.
"""

from __future__ import annotations

import numpy as np

from figures.style import Drawing
from figures.verdicts import OURS, Statement, at_least, at_most, met
from firstorder import plotting
from firstorder.checks.agreements import (
    FULL,
    QUICK,
    Agreements,
    agreements,
)
from firstorder.checks.agreements import (
    _spectra as spectra,
)
from firstorder.checks.agreements import (
    _wedge as wedge,
)
from firstorder.checks.agreements._irradiances import irradiance_rows
from firstorder.fields import Grid
from firstorder.flatland import Circles, Receiver, Scene, Segments, primitive, receiver
from firstorder.flatland.discontinuities import events
from firstorder.shadowfield import power_spectrum

X, SEED = 0.26, 0
WAYS = {
    "50 digits": ("o", "#c2410c"),
    "visible edges": ("+", "#0f766e"),
    "laws": ("x", "#7c3aed"),
    "rays, edges": ("s", "#a16207"),
    "a cached": ("d", "#be185d"),
}


def the_scene() -> Scene:
    """The docstring's."""
    return Scene.of(
        primitive(Segments((-1.0, 0.0), (1.0, 0.0)), name="floor"),
        primitive(Segments((0.5, 1.0), (-0.5, 1.0)), name="lamp", emission=1.0),
        primitive(Segments((-0.2, 0.5), (0.2, 0.5)), name="strip"),
        primitive(Circles((0.45, 0.62), 0.06), name="disc"),
    )


def draw(quick: bool) -> Drawing:
    scene = the_scene()
    sizes = QUICK if quick else FULL
    at = receiver(scene, 0, 0.5 * (X + 1.0))
    table = agreements(scene, at, sizes=sizes, seed=SEED, name="lamp, strip and disc")
    marks = np.linspace(-0.93, 0.93, 8 if quick else 32)
    along = [irradiance_rows(scene, _on_floor(x), sizes, SEED, tuple(WAYS)) for x in marks]
    figure, axes = plotting.panels(3, 3, 4.5, 2.45, width_ratios=(1.0, 1.0, 1.9))
    _draw_map(axes[0, 0], scene)
    field = _draw_light(axes[1, 0], scene, 128 if quick else 512)
    _draw_spectrum(axes[2, 0], scene, at, sizes)
    curves = _draw_curves(axes[:, 1], scene, marks, along, 101 if quick else 801)
    for ax in axes[:, 2]:
        ax.set_axis_off()
    words = axes[0, 2].text(
        0.0, 1.06, str(table), family="monospace", fontsize=6.9, va="top",
        transform=axes[0, 2].transAxes, linespacing=1.12,
    )  # fmt: skip
    words.set_in_layout(False)
    arrays = {"light": field, "marks": marks}
    numbers = {name: np.array(column) for name, column in _numeric(table).items()}
    size = f"{sizes.rays} rays, {sizes.paths * sizes.runs} paths, {sizes.photons} photons"
    return Drawing(
        figure, arrays, _claims(table, along), {"along": curves, "table": numbers}, size, SEED
    )


def _on_floor(x: float) -> Receiver:
    return receiver(the_scene(), 0, 0.5 * (x + 1.0))


def _draw_map(ax, scene: Scene) -> None:
    plotting.draw_scene(ax, scene, receivers=("floor",))
    ax.plot([X], [0.0], "^", color="#c2410c", markersize=5, clip_on=False)
    ax.set_title("a) scene, and the receiver", loc="left")


def _draw_light(ax, scene: Scene, n: int) -> np.ndarray:
    """Radiance over (x, v), with every silhouette."""
    x, v = np.linspace(-1.0, 1.0, n), np.linspace(-1.6, 1.6, n)
    line = Receiver((0.0, 0.0), 0.0, 0)
    field = np.asarray(spectra.radiances(scene, line, x, v))
    plotting.show_light_field(
        ax,
        field,
        x,
        v,
        limit=1.6,
        names=("x", "v"),
        title="b) light field, silhouettes",
        scale=False,
    )
    slopes = np.stack([_slopes(scene, p) for p in x])
    for k, slope in enumerate(slopes.T):
        ax.plot(x, slope, ("-", "--", ":")[k // 2], color="white", linewidth=1.0)
    ax.set_ylim(-1.6, 1.6)
    plotting.print_scale(ax, "lamp -  strip - -  disc ···")
    return field


def _slopes(scene: Scene, x: float) -> np.ndarray:
    """Where the silhouettes stand: v grows to the left."""
    points, valid = scene.silhouettes(np.array([x, 0.0]), 0)
    points = np.asarray(points)[np.asarray(valid)]
    return (x - points[:, 0]) / points[:, 1]


def _draw_spectrum(ax, scene: Scene, at: Receiver, sizes) -> None:
    """Energy of the blockers' visibility, and the wedge."""
    blockers, depths = wedge.depths_of(scene, at)
    half = spectra.window_of(scene, at, sizes).half
    n = max(sizes.samples // 4, 64)
    grid = Grid.spanning((n, n), (half, wedge.STEEP))
    together = np.sum(wedge.shadows(scene, at, blockers, grid), 0)
    energy = power_spectrum(wedge.coarser(1.0 - np.minimum(together, 1.0)), grid)
    Omega = [np.asarray(grid.frequencies(i)) for i in range(2)]
    near = [np.abs(a) <= 16.0 for a in Omega]
    plotting.show_spectrum(
        ax, np.sqrt(np.asarray(energy))[np.ix_(*near)],
        *(a[m] for a, m in zip(Omega, near, strict=True)),
        decades=3.0, names=("x", "v"), title="c) visibility's spectrum, wedge", scale=False,
    )  # fmt: skip
    box = ax.get_xlim(), ax.get_ylim()
    for z in depths:
        ax.plot([-20.0, 20.0], [20.0 * z, -20.0 * z], color="white", linestyle="--", linewidth=1.0)
    ax.set(xlim=box[0], ylim=box[1])


def _draw_curves(axes, scene: Scene, marks, along, count: int) -> dict:
    """E, E' and E'' along the floor."""
    curve = plotting.receiver_curve(scene, "floor", count)
    kinks = np.asarray(events.jumps_on(scene, 0).s) * 2.0 - 1.0
    for k, (ax, key, name) in enumerate(
        zip(axes, ("E", "dE", "d2E"), ("E", "E'", "E''"), strict=True)
    ):
        for kink in kinks:
            ax.axvline(kink, color="0.85", linestyle=":", linewidth=0.8)
        ax.plot(curve["x"], curve[key], color="0.35", linestyle="-", label="intervals, autodiff")
        for j, (way, (mark, color)) in enumerate(WAYS.items()):
            shown = [
                (x, row.value)
                for x, rows in list(zip(marks, along, strict=True))[j % 4 :: 4]
                for row in rows
                if row.quantity == name and row.way.startswith(way) and row.value is not None
            ]
            if shown:
                ax.plot(
                    *np.array(shown).T, mark, color=color, markersize=4.5, label=way,
                    markerfacecolor="none", linestyle="",
                )  # fmt: skip
        ax.set_xticks([-1.0, -0.5, 0.0, 0.5, 1.0])
        ax.set_xlabel(plotting.label("x"))
        ax.set_title(f"{'def'[k]}) ${name}$", loc="left")
    axes[0].legend(fontsize=6, loc="upper right")
    return {key: np.asarray(curve[key]) for key in ("x", "E", "dE", "d2E")}


def _numeric(table: Agreements) -> dict[str, list]:
    """The table's columns with NaN for what is not there."""
    columns = table.columns()
    empty = {key: [np.nan if v is None else v for v in columns[key]] for key in ("value", "error",
             "bound", "spread")}  # fmt: skip
    return {"quantity": columns["quantity"], "way": columns["way"], **empty,
            "verdict": columns["verdict"]}  # fmt: skip


def _claims(table: Agreements, along) -> list[Statement]:
    judged = [row for row in table.rows if row.verdict in ("agrees", "differs")]
    floor = [row for rows in along for row in rows if row.verdict in ("agrees", "differs")]
    right = [sum(row.verdict == "agrees" for row in rows) for rows in (judged, floor)]
    exact = [
        table.row(q, way).error
        for q in ("E", "E'", "E''")
        for way in ("intervals", "visible edges", "laws")
    ]
    moment, slope = (table.row("int |f'|^2", way) for way in ("second moment", "intervals"))
    lost = table.row(wedge.QUANTITY, "traced")
    bound = "the bound of the table: rounding, steps and standard errors"
    return [
        Statement("One receiver: share of ways that apply and agree with 50 digits", None,
                  right[0] / len(judged), at_least(1.0, bound), OURS,
                  scanned=f"{len(judged)} ways and quantities"),
        Statement("Along the floor: share of 50 digits, edges, laws, mended rays and cached "
                  "records that agree", None, right[1] / len(floor), at_least(1.0, bound), OURS,
                  scanned=f"{len(floor)} ways, quantities and places"),
        Statement("E, E', E'' by intervals, edges and laws: largest error", None,
                  float(max(exact)), at_most(1e-11, "rounding"), OURS, "W/m, W/m^2, W/m^3"),
        Statement("D05's second moment of the spectrum is R07's mean square gradient: ratio", 1.0,
                  float(np.divide(moment.value, slope.value)),
                  met(moment.verdict == "agrees", bound), OURS),
        Statement("Energy of the shadows outside of E11's wedge", "little", float(lost.value),
                  met(lost.verdict == "agrees", bound), "E11 Fig. 7"),
    ]  # fmt: skip
