"""R07 Fig. 9: a floor shadowed by a box and a circle; its gradient three ways; adaptive sampling.

The paper gives no numbers. The scene is `flatland.library._scenes.r07_fig09`: a floor 6 m wide, a
box of 0.9 m by 0.45 m and a circle of 0.35 m radius above it, a sky 0.5 rad wide about the zenith.
Numeric gradients are central differences over neighbouring pixels of 513. "The same at the scale of
the figure" is taken for an rms error below 1 % of the gradient's range, about a line's width.
Errors by rays are means over where the rays lie between their steps; adaptive sampling is judged
over rooms (`r07.shared.shadows.rooms`), by geometric means.

The paper's "semi-analytic" gradients reach that as it describes them, from the rays as they were
traced, at 512 rays and not at 256: half a step in the edge's angle matters little, but the first
hit beside the edge of a circle, or on a wall seen edge-on, is at the wrong distance. With each edge
bisected and the tangent's length they are exact, but for receivers whose gap between the blockers
falls between two rays.

"Much more accurate" is taken for half the error. Gradient-driven sampling does not reach it: it
spends samples on slopes that are steep and straight, which lines through few samples follow as
well. The size of the gradient is the wrong driver; the second derivative, the error of those lines,
is the right one (R07 section 9.3 says so).

The paper says after (37) that the sum over edges of 1/D "confirms" the harmonic mean of blockers'
distances as a metric for sampling. That mean runs over all rays and not over edges, and it is as
small under the middle of a blocker, where nothing changes, as beside it. Still it ranks places much
as the gradient does. Samples are placed so that between any two lies the same integral of its
inverse, and lines are drawn through them.
"""

from __future__ import annotations

import jax.numpy as jnp
import numpy as np

from figures.r07.shared import shadows as shared
from figures.spread import Spread, geometric, rms, spread
from figures.style import Drawing
from figures.verdicts import OURS, Measurement, Statement, at_least, at_most
from firstorder import plotting
from firstorder.flatland.library._scenes import r07_fig09

PIXELS, INITIAL, BUDGET, SHOWN = 513, 9, 129, 33
ROOM = 2049  # places at which errors are taken in a room
SOURCE = "R07 §6.3, Fig. 9"
WIDTH = 0.01  # of a line, in units of the range that is plotted


def draw(quick: bool) -> Drawing:
    n = 1025 if quick else 8193
    scene = r07_fig09()
    floor = shared.Shadow(scene)
    x = np.linspace(-3.0, 3.0, n)
    E, exact, _ = (np.asarray(a) for a in shared.along(floor, jnp.asarray(x)))
    every = (n - 1) // (PIXELS - 1)
    pixel = x[::every]
    rays = {count: shared.traced(scene, pixel, count) for count in (256, 512)}
    lines = shared.samplings(floor, -3.0, 3.0, BUDGET, INITIAL)
    budgets = np.array([17, 33, 65, 129])  # at which halving makes an even grid
    errors = {
        name: np.array([_error(shared.one_of(lines, name), b, x, E) for b in budgets])
        for name in shared.DRIVERS
    }
    at_pixels = exact[::every]
    gradients = {f"numeric, {k} rays": np.gradient(r[0], pixel) for k, r in rays.items()}
    gradients |= {f"first hits, {k} rays": r[1] for k, r in rays.items()}
    gradients |= {f"bisected, {k} rays": r[2] for k, r in rays.items()}
    formula = shared.formula(scene, x)

    figure, axes = plotting.panels(2, 3, 3.5, 2.7)
    _scene(axes[0, 0])
    axes[0, 1].plot(x, E)
    axes[0, 1].set(title="b) shading", xlabel="$x$ (m)", ylabel="$E$ (W/m)")
    _gradients(axes[0, 2], x, exact, pixel, gradients)
    for ax, title in ((axes[1, 0], "d) 33 samples"), (axes[1, 1], "d) closeup")):
        _samples(ax, lines, x, E)
        ax.set(title=title, xlabel="$x$ (m)", ylabel="$E$ (W/m)")
    axes[1, 1].set(xlim=(-1.6, -0.1), ylim=(-0.03, 0.9))
    axes[1, 0].legend(fontsize=7, loc="lower right")
    for name in ("uniform", "numeric", "gradient", "second order"):
        axes[1, 2].loglog(budgets, errors[name], label=name)
    axes[1, 2].set(title="error of linear interpolation", xlabel="samples", ylabel="rms (W/m)")
    axes[1, 2].set_xticks(budgets, [str(b) for b in budgets])
    axes[1, 2].minorticks_off()
    axes[1, 2].legend(fontsize=7)

    shifts, rooms = (3, 2) if quick else (60, 24)
    scan = [_room(room, budgets) for room in shared.rooms(rooms)]
    claims = [*_gradient_claims(scene, pixel, at_pixels, formula, exact, shifts),
              *_sampling_claims(scan, budgets, f"{rooms} rooms")]  # fmt: skip
    curves = {
        "shading": {"x": x, "E": E, "gradient": exact},
        "gradients": {"x": pixel, "exact": at_pixels, **gradients},
        "errors": {"samples": budgets, **errors},
        "adaptive": shared.cut(shared.one_of(lines, "gradient"), SHOWN).columns(),
    }
    arrays = {"x": x, "E": E, "gradient": exact}
    return Drawing(figure, arrays, claims, curves, f"{n} receivers, {PIXELS} pixels, 256 rays")


def _error(line, budget, x, E) -> float:
    return rms(shared.curve(shared.cut(line, budget), x) - E)


# --- panels --------------------------------------------------------------------------------------


def _scene(ax) -> None:
    plotting.map_axes(ax, "a) scene")
    plotting.draw_surface(ax, [[-3.0, 0.0], [3.0, 0.0]], depth=0.12)
    (left, low), (right, high) = shared.CORNERS[0], shared.CORNERS[-1]
    ax.fill([left, right, right, left], [low, low, high, high], color="0.25", linewidth=0)
    turn = np.linspace(0.0, 2.0 * np.pi, 100)
    ax.fill(0.6 + 0.35 * np.cos(turn), 0.65 + 0.35 * np.sin(turn), color="0.25", linewidth=0)
    # The sky: arrows from the zenith's neighbourhood, as long as their light is strong.
    angles = np.linspace(-1.2, 1.2, 13)
    outer = np.stack([-np.sin(angles), np.cos(angles)], -1) * 2.6
    strength = 0.9 * np.exp(-0.5 * (angles / 0.5) ** 2)
    plotting.draw_rays(ax, outer, angles + np.pi, strength, arrows=True)
    ax.set(xlim=(-3.1, 3.1), ylim=(-0.3, 2.8))


def _gradients(ax, x, exact, pixel, gradients) -> None:
    ax.plot(pixel, gradients["numeric, 256 rays"], color=plotting.COLOURS[3], linestyle="-",
            linewidth=1.0, label="numeric, 256 rays")  # fmt: skip
    ax.plot(pixel, gradients["bisected, 256 rays"], color=plotting.COLOURS[1], linestyle="-",
            linewidth=1.9, label="semi-analytic")  # fmt: skip
    ax.plot(x, exact, color=plotting.COLOURS[0], linestyle="-", linewidth=0.6, label="exact")
    ax.set(title="c) gradient", xlabel="$x$ (m)", ylabel=r"$\partial E/\partial x$ (W/m$^2$)")
    ax.legend(fontsize=7, loc="lower right")


def _samples(ax, lines, x, E) -> None:
    ax.plot(x, E, label="exact", linestyle="-")
    for name, colour, mark in (("uniform", 2, "s"), ("gradient", 1, "o")):
        line = shared.cut(shared.one_of(lines, name), SHOWN)
        label = "adaptive" if name == "gradient" else name
        ax.plot(line.x, line.value, color=plotting.COLOURS[colour], marker=mark, markersize=2.5,
                linewidth=0.9, label=label)  # fmt: skip


# --- claims --------------------------------------------------------------------------------------


def _gradient_claims(scene, pixel, at_pixels, formula, exact, shifts: int):
    """Of the gradient: errors as shares of its range, over where the rays lie."""
    span = np.ptp(exact)
    kinds = ("numeric", "first hits", "bisected")
    off = {kind: {256: [], 512: []} for kind in kinds}
    for count in (256, 512):
        for shift in (np.arange(shifts) + 0.5) / shifts:
            E, *slopes = shared.traced(scene, pixel, count, shift)
            for kind, found in zip(kinds, (np.gradient(E, pixel), *slopes), strict=True):
                off[kind][count].append(rms(found - at_pixels) / span)
    scanned = f"{shifts} places of the rays between their steps"
    worst = float(np.max(np.abs(formula - exact)) / span)
    told: list[Statement | Measurement] = [
        Statement("R07 (37) with edges from the shapes is exact: largest error of the gradient",
                  "exact", worst, at_most(1e-10, "an identity"), "R07 (37)", "of its range")
    ]  # fmt: skip
    at_scale = "'identical at the scale of this figure': a line's width"
    reason = (
        "The first hit beside the edge of a circle, or on a wall seen edge-on, is at the wrong "
        "distance D. It fails at 256 rays and fewer, and not at 512."
    )
    rows = (
        ("numeric", "Numerical differentiation is very noisy", "very noisy",
         at_least(WIDTH, "'very noisy': seen at the scale of this figure"), SOURCE, ""),
        ("first hits", "Semi-analytic gradients, rays as they are traced, are identical at this "
         "scale", "identical", at_most(WIDTH, at_scale), SOURCE, reason),
        ("bisected", "The same with edges bisected and the tangent's length", None,
         at_most(WIDTH, at_scale), OURS, ""),
    )  # fmt: skip
    for kind, words, paper, rule, source, why in rows:
        for count in (256, 512):
            got = spread(off[kind][count])
            told.append(
                Statement(f"{words}: rms error of the gradient, {count} rays", paper, got.mean,
                          rule, source, "of its range", got.error, scanned, why)
            )  # fmt: skip
    return told


def _room(scene, budgets) -> dict[str, np.ndarray]:
    """Of one room: errors of lines, by driver and budget, and by metrics' inverse distances."""
    floor = shared.Shadow(scene)
    x = np.linspace(-3.0, 3.0, ROOM)
    E, slope, _ = (np.asarray(a) for a in shared.along(floor, jnp.asarray(x)))
    lines = shared.samplings(floor, -3.0, 3.0, BUDGET, INITIAL)
    out = {
        name: np.array([_error(shared.one_of(lines, name), b, x, E) for b in budgets])
        for name in shared.DRIVERS
    }
    inverse = shared.inverse_distance(scene, x)
    for name, density in (("1/distance", inverse), ("|slope|", abs(slope) + 1e-3)):
        total = np.concatenate([[0.0], np.cumsum(0.5 * (density[1:] + density[:-1]))])
        at = [np.interp(np.linspace(0.0, total[-1], b), total, x) for b in budgets]
        out[name] = np.array([rms(np.interp(x, a, np.interp(a, x, E)) - E) for a in at])
    ranks = [np.argsort(np.argsort(np.abs(v))) for v in (inverse, slope)]
    out["ranks"] = np.corrcoef(*ranks)[:1, 1]
    return out


def _sampling_claims(scan, budgets, scanned: str) -> list[Statement | Measurement]:
    """Over rooms: geometric means of ratios of errors, all budgets and that of the picture."""
    at = int(np.flatnonzero(budgets == SHOWN)[0])

    def over(worse: str, better: str, k: int | slice = slice(None)) -> Spread:
        """A ratio of errors; that of a room is its mean over budgets."""
        each = [shared.geometric_mean(row[worse][k] / row[better][k]) for row in scan]
        return geometric(np.array(each))

    gain, driver, metric = (
        over("uniform", "gradient"), over("gradient", "second order"),
        over("uniform", "1/distance"),
    )  # fmt: skip
    slope = over("uniform", "|slope|")
    budget = ", ".join(f"{over('uniform', 'gradient', k).mean:.2f}" for k in range(len(budgets)))
    second = ", ".join(
        f"{over('uniform', 'second order', k).mean:.2f}" for k in range(len(budgets))
    )
    words = "of uniform sampling over its own, 17, 33, 65, 129 samples"
    ranks = spread([row["ranks"][0] for row in scan])
    shown = over("uniform", "gradient", at)
    return [
        Statement("Adaptive sampling by gradients leads to a much more accurate reconstruction: "
                  "error of uniform sampling over its own, 17 to 129 samples",
                  "much more accurate", gain.mean, at_least(2.0, "'much': half the error"),
                  SOURCE, "times", gain.error, scanned,
                  "|gradient| is the wrong driver: it spends samples on slopes that are steep and "
                  "straight, which lines follow anyway. By the second derivative, the error of "
                  "those lines, the same sampler does better from 33 samples on."),
        Statement("The same at 33 samples, as in the picture", "much more accurate", shown.mean,
                  at_least(2.0, "'much': half the error"), SOURCE, "times", shown.error, scanned,
                  "|gradient| is the wrong driver, as above."),
        Measurement(f"Adaptive by the gradient: error {words}", budget, "times"),
        Measurement(f"Adaptive by the second derivative: error {words}", second, "times"),
        Statement("The second derivative is the right driver: error by the gradient over its own, "
                  "17 to 129 samples", "should be using second order", driver.mean,
                  at_least(1.0, "smaller error by second order"), "R07 §9.3", "times",
                  driver.error, scanned),
        Statement("(37) confirms the harmonic mean of blockers' distances as a metric for "
                  "sampling: error of uniform samples over that of its samples, 17 to 129",
                  "confirms", metric.mean, at_least(1.0, "smaller error than without a metric"),
                  "R07 §6.2", "times", metric.error, scanned),
        Measurement("The same for samples placed by the size of the gradient itself", slope.mean,
                    "times", slope.error),
        Measurement("Rank correlation of the inverse harmonic mean with the gradient's size",
                    ranks.mean, "", ranks.error, "R07 §6.2"),
    ]  # fmt: skip
