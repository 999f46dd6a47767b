"""R07 Fig. 10: shadows between samples, by lines and by curves that know the gradient.

The scene of Fig. 9 (`flatland.library._scenes.r07_fig09`); even samples, 25 in the picture. The
paper does not say which curve it draws; ours is the cubic Hermite interpolant, and the quintic one
that also knows the second derivative. A sample with its gradient is two numbers, so lines are also
drawn through twice as many samples. "Significantly greater" and "much higher" are taken for half
the error. Over the whole floor that is judged over rooms (`r07.shared.shadows.rooms`), and in the
closeup over where the samples lie between their steps, by geometric means.

Where two silhouettes are in line E' jumps, in four places here, and a cubic is then no better than
of second order: over the whole floor it gains less than a factor of 2 here, and lines through twice
as many samples win. (In most rooms it gains more.) In the closeup, where E' does not jump, it gains
a factor of thirty. With breaks
where it jumps (every piece sampled evenly, its ends twice) the order is four, and cubics win at
equal samples and at equal numbers.
"""

from __future__ import annotations

import jax.numpy as jnp
import numpy as np

from figures.r07.shared import shadows as shared
from figures.spread import geometric, rms
from figures.style import Drawing
from figures.verdicts import OURS, Measurement, Statement, at_least, between
from firstorder import plotting
from firstorder.checks.tolerance import fitted_order
from firstorder.flatland.library._scenes import r07_fig09
from firstorder.reconstruction import HermiteInterpolant

SHOWN, CLOSEUP = 25, (0.0, 1.5)
COUNTS = (13, 25, 49, 97, 193)  # samples on an even grid; each holds those before it
NAMES = ("linear", "cubic", "quintic")
SOURCE = "R07 §6.3, Fig. 10"


def draw(quick: bool) -> Drawing:
    n = 1024 if quick else 8192
    floor = shared.Shadow(scene := r07_fig09())
    breaks = shared.kinks(scene, floor)
    x = np.linspace(-3.0, 3.0, n)
    grids = {c: np.linspace(-3.0, 3.0, c) for c in (*COUNTS, 2 * SHOWN, 3 * SHOWN)}
    pieces = {c: _pieces(breaks, c) for c in COUNTS}
    # One call for all of them: it is compiled once.
    parts = [x, *grids.values(), *(ask for _, ask in pieces.values())]
    jets = np.asarray(shared.along(floor, jnp.asarray(np.concatenate(parts)))).T
    jets = np.split(jets, np.cumsum([p.size for p in parts])[:-1])
    E = jets[0][:, 0]
    even = dict(zip(grids, jets[1:], strict=False))
    broken = dict(zip(pieces, jets[1 + len(grids) :], strict=True))

    def error(nodes, data, kind: int) -> float:
        return rms(np.asarray(shared.value(HermiteInterpolant(nodes, data[:, :kind]), x)) - E)

    errors = {
        name: np.array([error(grids[c], even[c], k) for c in COUNTS])
        for k, name in enumerate(NAMES, 1)
    }
    errors |= {
        f"{name}, breaks": np.array([error(pieces[c][0], broken[c], k) for c in COUNTS])
        for k, name in enumerate(NAMES, 1)
    }
    equal = {k: error(grids[k * SHOWN], even[k * SHOWN], 1) for k in (1, 2, 3)}

    curves = {
        name: np.asarray(shared.value(HermiteInterpolant(grids[SHOWN], even[SHOWN][:, :k]), x))
        for k, name in enumerate(NAMES, 1)
    }
    figure, axes = plotting.panels(1, 3, 3.6, 2.9)
    _draw(axes[0], x, E, curves, grids[SHOWN], even[SHOWN][:, 0], errors)
    count, shifts = (3, 3) if quick else (24, 20)
    rooms = [_gain(shared.Shadow(room), (-3.0, 3.0)) for room in shared.rooms(count)]
    closeup = [_gain(floor, CLOSEUP, (k + 0.5) / shifts - 0.5) for k in range(shifts)]
    claims = [*_gains(rooms, closeup), *_claims(errors, equal, breaks)]
    columns = {
        "curves": {"x": x, "E": E, **curves},
        "errors": {"samples": np.array(COUNTS), **errors},
    }
    size = f"{SHOWN} samples, rms over {n} places"
    return Drawing(figure, {"breaks": breaks, "x": x, "E": E}, claims, columns, size)


def _pieces(breaks, count: int) -> tuple[np.ndarray, np.ndarray]:
    """About `count` nodes: even ones on each piece, as many as its length earns; and where to ask.

    Both sides of a break are asked for a hair's breadth inside.
    """
    ends = np.array([-3.0, *breaks, 3.0])
    shares = np.diff(ends) / 6.0
    cells = np.maximum(np.floor(shares * (count - len(shares))), 1).astype(int)
    nodes = [np.linspace(a, b, k + 1) for a, b, k in zip(ends, ends[1:], cells, strict=False)]
    asked = [np.clip(v, v[0] + 1e-10, v[-1] - 1e-10) for v in nodes]
    return np.concatenate(nodes), np.concatenate(asked)


def _draw(axes, x, E, curves, nodes, values, errors) -> None:
    for ax, title in zip(axes[:2], ("a) 25 samples", "b) closeup"), strict=True):
        ax.plot(x, E, color=plotting.COLOURS[0], linestyle="-", label="exact")
        ax.plot(x, curves["linear"], color=plotting.COLOURS[2], linestyle="--", label="linear")
        ax.plot(x, curves["cubic"], color=plotting.COLOURS[1], linestyle="-", linewidth=1.0,
                label="with gradients")  # fmt: skip
        ax.plot(nodes, values, "o", color="0.3", markersize=2.8, linestyle="none")
        ax.set(title=title, xlabel="$x$ (m)", ylabel="$E$ (W/m)")
    axes[1].set(xlim=CLOSEUP, ylim=(0.1, 1.08))
    axes[1].legend(fontsize=7, loc="lower right")
    for k, (name, error) in enumerate(errors.items()):
        style = {"color": plotting.COLOURS[(2, 1, 4)[k % 3]], "marker": "o", "markersize": 2.5}
        axes[2].loglog(COUNTS, error, linestyle="--" if k > 2 else "-", label=name, **style)
    axes[2].set(title="c) error", xlabel="samples", ylabel="rms (W/m)")
    axes[2].set_xticks(COUNTS, [str(c) for c in COUNTS])
    axes[2].minorticks_off()
    axes[2].legend(fontsize=7)


def _gain(floor, ends, shift: float = 0.0) -> float:
    """Error of lines over that of cubics through samples 0.25 m apart, between two ends."""
    nodes = np.linspace(-3.0, 3.0, SHOWN) + shift * 6.0 / (SHOWN - 1)
    x = np.linspace(*ends, 1025)
    jets = np.asarray(shared.along(floor, jnp.asarray(np.concatenate([nodes, x])))).T
    data, E = jets[:SHOWN], jets[SHOWN:, 0]
    off = [
        rms(np.asarray(shared.value(HermiteInterpolant(nodes, data[:, :k]), x)) - E) for k in (1, 2)
    ]
    return off[0] / off[1]


def _gains(rooms, closeup) -> list[Statement]:
    """Cubics instead of lines, at equal samples."""
    near, whole = geometric(closeup), geometric(rooms)
    return [
        Statement("As seen in the closeup, using gradients gives significantly greater accuracy: "
                  "rms error of lines over that of cubics, 25 samples", "significantly greater",
                  near.mean, at_least(2.0, "'significantly': half the error"), SOURCE, "times",
                  near.error, f"{len(closeup)} places of the samples between their steps"),
        Statement("It is clear that gradient interpolation gives much higher accuracy: the same "
                  "over the whole floor", "much higher", whole.mean,
                  at_least(2.0, "'much': half the error"), SOURCE, "times", whole.error,
                  f"{len(rooms)} rooms",
                  "Where two silhouettes are in line the gradient itself jumps, and a cubic across "
                  "such a place is no better than of second order. It fails on floors on which "
                  "that happens between samples, and not where they stand at these places."),
    ]  # fmt: skip


def _claims(errors, equal, breaks) -> list[Statement | Measurement]:
    """Of the scene that is shown: equal numbers, and orders."""
    at = COUNTS.index(SHOWN)
    ratio = equal[2] / errors["cubic"][at]
    told: list[Statement | Measurement] = [
        Measurement("The whole floor that is shown: lines through 50 samples over cubics through "
                    "25, as many numbers are stored", ratio, "times"),
        Measurement("Places at which E' jumps: two silhouettes in line", float(len(breaks))),
    ]  # fmt: skip
    for kind, words in (("", "even samples"), (", breaks", "samples with breaks where E' jumps")):
        linear, cubic = errors["linear" + kind], errors["cubic" + kind]
        row = ", ".join(f"{r:.3g}" for r in linear / cubic)
        told.append(Measurement(f"Lines over cubics through 13, 25, 49, ... {words}", row, "times"))
    last = [COUNTS[-2] - 1, COUNTS[-1] - 1]
    for name, order in (("linear", 2), ("cubic", 4), ("quintic", 6)):
        found = -fitted_order(last, errors[name + ", breaks"][-2:])
        rule = between(order - 0.5, order + 0.5, "twice as many numbers as it takes at each end")
        words = f"Order of the {name} interpolant's error, with breaks where E' jumps"
        told.append(Statement(words, None, found, rule, OURS))
    found = ", ".join(f"{-fitted_order(last, errors[n][-2:]):.2f}" for n in NAMES)
    words = "Orders on an even grid: lines, cubics, quintics"
    return [*told, Measurement(words, found)]
