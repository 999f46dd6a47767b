"""J12 Fig. 12: first- and second-order extrapolation around two records of scene A.

Scene A as the library has it: a line light of radiance 1, 1 m long and 1 m above the floor. Open in
the paper: where the records are, and how far they are extrapolated. Here: x = -0.25 m and 0.9 m,
off the inflections at 0.65 m, over the whole floor; full lines and ticks mark the radius that
each order's own derivative gives for a total error of 3 mW.

Second order is better near both records, by a factor that grows as the distance shrinks. Far away
its parabola overshoots; the last claim says from where on it may be the worse of the two.
"""

from __future__ import annotations

import numpy as np

from figures.j12.shared.caching import columns, line_light
from figures.style import Claim, Drawing
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
    claims = _claims(records, dx, np.abs(expansions - E))
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


def _claims(records, dx, errors) -> list[Claim]:
    ratios, orders = [], []
    for i in range(2):
        one = records.at(slice(i, i + 1))
        own = circular_regions(
            radius_for(derivative_norm(one.derivative(2), 2), TOLERANCE), 1e-3, 1e3
        )
        total = [float(true_error(line_light, one, own, order=k)[0]) for k in (1, 2)]
        ratios.append(total[0] / total[1])
        for k in (1, 2):
            # A place where the remainder's own leading term does not vanish, approached from afar.
            steps = np.array([0.0025, 0.005, 0.01])
            data = [one.derivative(j) for j in (0, 1, 2)]
            line = np.asarray(taylor(*data, steps[:, None], k))
            miss = np.abs(line - line_light(RECORDS[i] + steps))
            orders.append(fitted_order(steps, miss) - (k + 1))
    overshoot = _ahead(dx, errors)
    return [
        Claim(
            "Second-order extrapolation matches more faithfully: error of first order over "
            "second, within the first-order radius, worse of two records",
            "more faithful",
            min(ratios),
            "",
            min(ratios) > 1.0,
        ),
        Claim(
            "Errors fall with the second and third power of the distance: largest departure "
            "of the fitted power",
            0.0,
            float(np.max(np.abs(orders))),
            "",
            bool(np.max(np.abs(orders)) < 0.15),
        ),
        Claim(
            "The distance must be set carefully: second order overshoots, and beyond this "
            "distance from a record is worse than first order",
            "overshoots",
            overshoot,
            "m",
            overshoot < EXTENT,
        ),
    ]


def _ahead(dx, errors) -> float:
    """Distance at which second order is first worse than first order, over records and sides."""
    found = [EXTENT]
    for i in range(2):
        # Where the two cross at a zero of the first-order error, they meet only in a point.
        worse = (errors[2, i] > errors[1, i]) & (np.abs(dx[i]) > 0.02)
        if worse.any():
            found.append(float(np.min(np.abs(dx[i][worse]))))
    return min(found)
