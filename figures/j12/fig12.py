"""J12 Fig. 12: first- and second-order extrapolation around two records of scene A.

Scene A as the library has it: a line light of radiance 1, 1 m long and 1 m above the floor. Open in
the paper: where the records are, and how far they are extrapolated. Here: x = -0.25 m and 0.9 m,
off the inflections at 0.65 m, over the whole floor; full lines and ticks mark the radius that
each order's own derivative gives for a total error of 3 mW.

Second order is better near both records, by a factor that grows as the distance shrinks, and at
all others along the floor (scanned). Far away its parabola overshoots; the last claim says
from where on it may be the worse of the two.
"""

from __future__ import annotations

import numpy as np

from figures.j12.shared.caching import columns, line_light
from figures.spread import geometric
from figures.style import Drawing
from figures.verdicts import OURS, Measurement, Statement, at_least, at_most
from firstorder import plotting
from firstorder.caching import (
    Candidates,
    circular_regions,
    derivative_norm,
    radius_for,
    taylor,
    true_error,
)
from firstorder.checks.tolerance import fitted_order
from firstorder.plotting.style import COLOURS

RECORDS = np.array([-0.25, 0.9])
TOLERANCE = 3e-3
EXTENT = 1.5
SCAN = np.linspace(-1.195, 1.195, 96)
NAMES = ("constant", "first order", "second order")


def draw(quick: bool) -> Drawing:
    n = 301 if quick else 1201
    x = np.linspace(-EXTENT, EXTENT, n)
    E = line_light(x)
    records = Candidates.from_function(line_light, RECORDS, derivatives=3)
    dx = x - RECORDS[:, None]
    data = [records.derivative(k)[:, None] for k in (0, 1, 2)]
    expansions = np.stack([np.asarray(taylor(*data, dx[..., None], order)) for order in (0, 1, 2)])
    reach = np.stack(
        [
            radius_for(derivative_norm(records.derivative(k + 1), k + 1), TOLERANCE, order=k)
            for k in (0, 1, 2)
        ]
    )
    figure, axes = plotting.panels(1, 2, 4.0, 2.8)
    _curves(axes[0, 0], x, E, expansions, reach)
    _errors(axes[0, 1], dx, np.abs(expansions - E), reach)
    arrays = {"x": x, "E": E, "records": RECORDS, "expansions": expansions, "reach": reach}
    arrays["derivatives"] = columns(records)
    curves = {
        "expansions": {"x": x, "E": E}
        | {
            f"{name.replace(' ', '_')}_{i}": expansions[k, i]
            for k, name in enumerate(NAMES)
            for i in range(2)
        }
    }
    claims = _claims(dx, np.abs(expansions - E))
    return Drawing(figure, arrays, claims, curves, size=f"{n} places, 2 records")


def _curves(ax, x, E, expansions, reach) -> None:
    ax.plot(x, E, "-", color=COLOURS[1], linewidth=2.2, label="true")
    for i, at in enumerate(RECORDS):
        for order, style in ((1, "-"), (2, "-")):
            colour = COLOURS[4] if order == 1 else COLOURS[2]
            own = np.abs(x - at) <= reach[order, i]
            words = NAMES[order] if i == 0 else None
            ax.plot(x, expansions[order, i], ":", color=colour, linewidth=0.9)
            ax.plot(x[own], expansions[order, i][own], style, color=colour, label=words)
        ax.plot([at], [line_light(at)], "o", color=COLOURS[0], markersize=5, zorder=5)
    ax.set(xlim=(-EXTENT, EXTENT), ylim=(0.2, 1.15), xlabel="$x$ (m)", ylabel="$E$ (W/m)")
    ax.set_title("a) two records; full lines as far as their radius", loc="left")
    ax.legend(loc="lower center")


def _errors(ax, dx, errors, reach) -> None:
    for order, colour in ((0, "0.6"), (1, COLOURS[4]), (2, COLOURS[2])):
        for i, dash in enumerate(("-", "--")):
            right = dx[i] > 0.01
            words = NAMES[order] if i == 0 else None
            d, miss = dx[i][right], errors[order, i][right]
            ax.loglog(d, miss, dash, color=colour, linewidth=1.2, label=words)
            ax.plot([reach[order, i]] * 2, [2e-8, 6e-8], "-", color=colour, linewidth=1.5)
    ax.set(xlabel="distance to the right of the record (m)", ylabel="error (W/m)")
    ax.set(xlim=(0.01, 2.5), ylim=(2e-8, 2.0))
    ax.set_title("b) error (dashed: right record); ticks: radius", loc="left")
    ax.legend(loc="lower right")


def _claims(dx, errors) -> list[Statement | Measurement]:
    gain, power = _scanned()
    over = geometric(gain)
    return [
        Statement(
            "A second-order expansion matches more closely: error of first order over second, "
            "within the first-order radius, geometric mean",
            paper="more closely",
            measured=over.mean,
            rule=at_least(1.0, "'more closely'"),
            source="J12 §6.3",
            scanned=f"{len(SCAN)} records along the floor",
        ),
        Measurement(
            "Share of those records at which second order errs less", float(np.mean(gain > 1.0))
        ),
        Statement(
            "Errors fall with the second and third power of the distance: largest departure of the "
            "fitted power, at the records shown",
            paper=None,
            measured=power,
            rule=at_most(0.15, "three distances up to 1 cm"),
            source=OURS,
        ),
        Statement(
            "The distance must be set carefully: second order overshoots, and beyond this distance "
            "from a record errs more than first order",
            paper="overshoots",
            measured=_ahead(dx, errors),
            rule=at_most(EXTENT, "on the floor"),
            source="J12 §6.3, Fig. 12",
            unit="m",
        ),
    ]


def _scanned() -> tuple[np.ndarray, float]:
    """First over second order at all records, and how far the powers shown are from 2 and 3."""
    along = Candidates.from_function(line_light, SCAN)
    own = circular_regions(
        radius_for(derivative_norm(along.derivative(2), 2), TOLERANCE), 1e-3, EXTENT
    )
    first, second = (np.asarray(true_error(line_light, along, own, order=k)) for k in (1, 2))
    records = Candidates.from_function(line_light, RECORDS)
    # A place where the remainder's own leading term does not vanish, approached from afar.
    steps, off = np.array([0.0025, 0.005, 0.01]), []
    for i, at in enumerate(RECORDS):
        data = [records.at(slice(i, i + 1)).derivative(j) for j in (0, 1, 2)]
        for k in (1, 2):
            miss = np.abs(np.asarray(taylor(*data, steps[:, None], k)) - line_light(at + steps))
            off.append(abs(fitted_order(steps, miss) - (k + 1)))
    return first / second, max(off)


def _ahead(dx, errors) -> float:
    """Distance at which second order is first worse than first order, over records and sides."""
    # Where the two cross at a zero of the first-order error, they meet only in a point.
    worse = (errors[2] > errors[1]) & (np.abs(dx) > 0.02)
    return float(np.min(np.abs(dx), where=worse, initial=2.0 * EXTENT))
