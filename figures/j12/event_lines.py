"""A metric of caches in space that knows visual events, which J12's do not.

J12 §5 and Fig. 15 show that derivatives jump where edges align; its metrics look at one Hessian
at one place. `caching.radius_with_lines` adds what lies behind the lines of the discontinuity mesh,
each in closed form. Ten floors under the lamp of `j12.shared.shadows`: its four plates, turned
against the lamp, whose edges align with the lamp's in single lines of sight (only second
derivatives jump), and six that are not turned, whose edges align in planes (first derivatives
jump), as shelves, tables and boxes do in rooms.

All records hold exact light and gradients. Both metrics have the exact Hessian, its mean around,
the same orders of insertion and the same limits; only one of them knows the lines. "Largest" is
the exact Hessian by its largest eigenvalue, as J12 (70) has it. Errors are of 100 and 390 records.

Where edges are parallel the lines leave a third less error, and the more records there are the more
they save: records that reach across a line are the last ones to shrink. Where only second
derivatives jump they save next to nothing.
"""

from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np
from matplotlib.ticker import LogLocator, NullLocator

from figures.j12.shared.box import Size, compare, floor_limits, show_error, show_light
from figures.j12.shared.caching import Limits, Outcome, Regions, pointwise, scaled
from figures.j12.shared.shadows import ALIGNED, PLATES, Shadow, above, shadow
from figures.spread import Spread, grouped
from figures.style import Drawing
from figures.verdicts import OURS, Measurement, Statement, at_least
from firstorder import plotting
from firstorder.caching import (
    EventLines,
    derivative_norm,
    expected_error_with_lines,
    radius_for,
)
from firstorder.plotting.style import COLOURS
from firstorder.space import Receiver
from firstorder.space.discontinuities import DiscontinuityMesh, discontinuity_mesh

SHOWN = "bar"
BLIND, KNOWING, LARGEST = "Hessian", "Hessian and lines", "largest eigenvalue"
MIDDLE = Receiver.at((0.5, 0.5, 0.0))
RADII = 48  # at which errors are tabulated
COUNTS = (50, 100, 200, 400, 800)  # of records, on the floor that is shown


def draw(quick: bool) -> Drawing:
    s = Size(40, 8, 16, 60, 2) if quick else Size(80, 8, 16, 100, 5)
    counts = (60, 120) if quick else (100, 390)
    names = ("plate", SHOWN) if quick else (*PLATES, *ALIGNED)
    meshes = {name: discontinuity_mesh(above(name), MIDDLE, points=17, reach=0.5) for name in names}
    radii = {n: _metrics(shadow(n, s), EventLines.of(mesh, MIDDLE)) for n, mesh in meshes.items()}
    found = {n: [compare(shadow(n, s).case, of, count) for count in counts]
             for n, of in radii.items()}  # fmt: skip

    figure, axes = plotting.panels(2, 3, 2.9, 2.7)
    lit, (here, *_) = shadow(SHOWN, s), found[SHOWN]
    show_light(axes[0, 0], lit.case, f"a) {SHOWN}: irradiance")
    _show_lines(axes[0, 1], meshes[SHOWN])
    most = 3.0 * here[KNOWING].mean
    for ax, letter, method in ((axes[1, 0], "d", BLIND), (axes[1, 1], "e", KNOWING)):
        show_error(ax, lit.case, here[method], most, f"{letter}) {method}")
    _gains(axes[0, 2], found, counts)
    budgets = COUNTS[:2] if quick else COUNTS
    curve = {n: compare(lit.case, radii[SHOWN], n) for n in budgets}
    _by_records(axes[1, 2], curve)
    arrays = {f"{n}_{c}_{m}".replace(" ", "_"): o.errors for n, of in found.items()
              for c, by in zip(counts, of, strict=True) for m, o in by.items()}  # fmt: skip
    size = f"{s.pixels}^2 places, {counts[0]} and {counts[1]} records, {s.orders} orders"
    return Drawing(figure, arrays, _claims(found), size=f"{size}, {len(names)} floors", seed=12)


# --- radii ---------------------------------------------------------------------------------------


def _metrics(lit: Shadow, lines: EventLines) -> dict[str, Regions]:
    within, H = floor_limits(lit.case.size.pixels), jnp.asarray(lit.jet.hessian)
    size = derivative_norm(H, 2, "mean")
    return {
        LARGEST: pointwise(H, within),
        BLIND: scaled(np.asarray(radius_for(size, 1.0, dims=2)), 0.25, within),
        KNOWING: _with_lines(size, lit.case.table.position, lines, within),
    }


def _with_lines(size, position, lines: EventLines, within: Limits) -> Regions:
    """Radii by `expected_error_with_lines`, tabulated: a search asks for many thresholds."""
    x = jnp.asarray(position)[:, :2] - MIDDLE.position[:2]
    radii = np.geomspace(0.5 * within.low, within.high, RADII)
    error = jax.jit(lambda R: expected_error_with_lines(R, size, x, lines))
    table = np.log(np.maximum([error(R) for R in radii], 1e-300)).T

    def regions(tolerance):
        at = [np.interp(np.log(tolerance), row, np.log(radii)) for row in table]
        return within.held(np.exp(at))

    return regions


# --- pictures ------------------------------------------------------------------------------------


def _show_lines(ax, mesh: DiscontinuityMesh) -> None:
    """Lines on the floor, by the derivative that jumps."""
    words = {1: "first derivative jumps", 2: "second"}
    for order, line in zip(mesh.order, mesh.lines, strict=True):
        label = words.pop(int(order), None)
        ax.plot(line[:, 0], line[:, 1], "-", color=COLOURS[order - 1], lw=2.2 - 0.7 * order,
                label=label)  # fmt: skip
    ax.set(xlim=(0, 1), ylim=(0, 1), xticks=[], yticks=[], aspect="equal")
    ax.set_title("b) where edges align", fontsize=8)
    ax.legend(fontsize=6.5, loc="upper center", bbox_to_anchor=(0.5, 0.0), ncols=2, frameon=False)


def _gains(ax, found, counts) -> None:
    """How much less error the lines leave, floor by floor."""
    for k, count in enumerate(counts):
        gains = [of[k][BLIND].mean / of[k][KNOWING].mean for of in found.values()]
        ax.plot(gains, range(len(found)), "os"[k], markersize=4, label=f"{count} records")
    ax.axvline(1.0, color="0.5", linestyle="--", linewidth=0.8)
    ax.set(yticks=range(len(found)), xlim=(0.8, None), xlabel="RMS without lines over with them")
    ax.set_yticklabels(list(found), fontsize=6.5)
    ax.invert_yaxis()
    ax.set_title("c) what the lines save", fontsize=8)
    ax.legend(fontsize=6.5)


def _by_records(ax, curve: dict[int, dict[str, Outcome]]) -> None:
    for method in (LARGEST, BLIND, KNOWING):
        ax.loglog(list(curve), [here[method].mean for here in curve.values()], "o-", markersize=3,
                  label=method)  # fmt: skip
    ax.set(xlabel="records", xticks=list(curve), xticklabels=[str(n) for n in curve])
    ax.xaxis.set_minor_locator(NullLocator())
    ax.yaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    ax.yaxis.set_major_formatter("{x:.0e}")
    ax.yaxis.set_minor_locator(NullLocator())
    ax.set_title(f"f) {SHOWN}: RMS error (W/m$^2$)", fontsize=8)
    ax.legend(fontsize=6.5)


# --- claims --------------------------------------------------------------------------------------


def _claims(found) -> list[Statement | Measurement]:
    every, aligned, turned = (
        [of for name, of in found.items() if name in some] for some in (found, ALIGNED, PLATES)
    )
    saved = _less(BLIND, aligned)
    words = "RMS of the Hessian alone over that with lines"
    return [
        Statement(
            "A metric that knows lines of visual events leaves less error where edges are "
            f"parallel: {words}, geometric mean",
            None,
            saved.mean,
            at_least(1.0, "less error"),
            OURS,
            "times",
            saved.error,
            f"{len(aligned)} floors, few and many records",
        ),
        Measurement(f"{words}, where only second derivatives jump", *_told(_less(BLIND, turned))),
        Measurement(
            "RMS of J12's largest eigenvalue over that of the mean with lines, all floors",
            *_told(_less(LARGEST, every)),
        ),
    ]


def _less(method: str, here) -> Spread:
    """Error of a method over that with lines: geometric mean over floors, each of all counts."""
    return grouped([[by[method].mean / by[KNOWING].mean for by in of] for of in here])


def _told(ratio: Spread) -> tuple[float, str, float]:
    return ratio.mean, "times", ratio.error
