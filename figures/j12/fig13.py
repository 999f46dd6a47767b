"""J12 Fig. 13: the radius that the true error would give, and the one that E'' gives instead.

Scene A as in Fig. 12, one record at x = 0.2 m, total error 0.02 W. Open in the paper: where the
record is, and the tolerance. The ideal radius is found by halving (53) with the closed form of E;
the estimate is (55). Panel c shows both along the whole floor, for several tolerances.

The second-order oracle holds to second order in R. It fails where E'' vanishes, at the two
inflections near |x| = 0.65 m: there it says "as far as you like", and a radius is only had from a
clamp, or from the next derivative (dotted), which the paper leaves as future work. What is judged
is the total error within a radius, over the one that was tolerated.
"""

from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np

from figures.j12.shared.caching import line_light
from figures.style import Drawing
from figures.verdicts import OURS, Measurement, Statement, at_most, near
from firstorder import plotting
from firstorder.caching import (
    Candidates,
    circular_regions,
    derivative_norm,
    expected_error,
    ideal_region,
    radius_for,
    radius_with_events,
    taylor,
    true_error,
)
from firstorder.checks.tolerance import fitted_order
from firstorder.plotting.style import COLOURS

AT, TOLERANCE = 0.2, 2e-2
TOLERANCES = (2e-2, 2e-3, 2e-4)
LIMITS = (1e-3, 1.5)
SCANNED = "the floor from -1.2 to 1.2 m, three tolerances"


def draw(quick: bool) -> Drawing:
    n = 61 if quick else 241
    x = np.linspace(-1.2, 1.2, n)
    along = Candidates.from_function(line_light, x, derivatives=3)
    ideal, estimate, guarded = _radii(along)
    one = Candidates.from_function(line_light, np.array([AT]))
    own = [
        float(ideal_region(line_light, one, TOLERANCE, *LIMITS).radius[0]),
        float(radius_for(derivative_norm(one.derivative(2), 2), TOLERANCE)[0]),
    ]
    figure, axes = plotting.panels(1, 3, 3.1, 2.7, gridspec_kw={"width_ratios": (1, 1, 1.25)})
    _oracle(axes[0, 0], one, own[0], exact=True)
    _oracle(axes[0, 1], one, own[1], exact=False)
    _along(axes[0, 2], x, ideal, estimate, guarded)
    arrays = {"x": x, "ideal": ideal, "estimate": estimate, "guarded": guarded, "own": own}
    columns = {f"{k}_{t:g}": v[i] for i, t in enumerate(TOLERANCES) for k, v in (
        ("ideal", ideal), ("estimate", estimate), ("guarded", guarded)
    )}  # fmt: skip
    claims = _claims(own, one, along, ideal, estimate, guarded)
    curves = {"radii": {"x": x} | columns}
    return Drawing(figure, arrays, claims, curves, size=f"{n} places, 3 tolerances")


def _radii(along: Candidates):
    """Ideal, estimated and guarded radii, one row for each tolerance."""
    tolerances = jnp.asarray(TOLERANCES)

    @jax.jit
    def ideal(tolerance):
        return ideal_region(line_light, along, tolerance, *LIMITS).radius

    found = np.stack([ideal(t) for t in tolerances])
    h, third = (derivative_norm(along.derivative(k), k) for k in (2, 3))
    by_events = radius_with_events([h, third], tolerances[:, None], *LIMITS)
    estimate = circular_regions(radius_for(h, tolerances[:, None]), *LIMITS).radius
    guarded = circular_regions(by_events, *LIMITS).radius
    return found, np.asarray(estimate), np.asarray(guarded)


def _oracle(ax, one, R, exact: bool) -> None:
    x = np.linspace(AT - 1.0, AT + 1.0, 401)
    data = [one.derivative(k) for k in (0, 1, 2)]
    line, parabola = (np.asarray(taylor(*data, (x - AT)[:, None], k)) for k in (1, 2))
    oracle = line_light(x) if exact else parabola
    inside = np.abs(x - AT) <= R
    ax.fill_between(x[inside], line[inside], oracle[inside], color=COLOURS[3], alpha=0.6, lw=0)
    ax.plot(x, line_light(x), "-", color=COLOURS[1], linewidth=2.0, label="true")
    ax.plot(x, line, "-", color=COLOURS[4], label="first order")
    if not exact:
        ax.plot(x, oracle, "-", color=COLOURS[2], label="second order")
    ax.plot([AT], [line_light(AT)], "o", color=COLOURS[0], markersize=5)
    for side in (-R, R):
        ax.axvline(AT + side, color="0.4", linestyle=":", linewidth=0.9)
    ax.set(xlim=(x[0], x[-1]), ylim=(0.2, 1.3), xlabel="$x$ (m)", ylabel="$E$ (W/m)")
    words = f"a) ideal, $R$ = {R:.3f} m" if exact else f"b) by $E''$, $R$ = {R:.3f} m"
    ax.set_title(words, loc="left")
    ax.legend(loc="lower left")


def _along(ax, x, ideal, estimate, guarded) -> None:
    for i, tolerance in enumerate(TOLERANCES):
        first = i == 0
        ax.semilogy(x, ideal[i], "-", color=COLOURS[1], lw=1.8, label="ideal" if first else None)
        ax.semilogy(x, estimate[i], "-", color=COLOURS[2], label="by $E''$" if first else None)
        words = "by $E''$ and $E'''$" if first else None
        ax.semilogy(x, guarded[i], ":", color=COLOURS[0], label=words)
        ax.annotate(f"{1e3 * tolerance:g} mW", (0.0, 1.04 * estimate[i].min()), fontsize=7,
                    ha="center", va="bottom")  # fmt: skip
    ax.set(xlabel="$x$ (m)", ylabel="radius (m)", ylim=(0.03, 2.5))
    ax.set_title("c) along the floor", loc="left")
    ax.legend(loc="lower right", fontsize=7)


def _claims(own, one, along, ideal, estimate, guarded) -> list[Statement | Measurement]:
    free = (ideal < 0.99 * LIMITS[1]) & (estimate < 0.99 * LIMITS[1])
    spent = _spent(along, estimate)
    x = np.broadcast_to(np.abs(np.asarray(along.position[:, 0])), spent.shape)
    return [
        Statement(
            "The second-order expansion serves as an oracle of the true irradiance: radius over "
            "the ideal one, at the record shown",
            paper=1.0,
            measured=own[1] / own[0],
            rule=near(1.0, 0.1, "an approximation: within a tenth"),
            source="J12 §6.4, Fig. 13",
        ),
        Statement(
            "A way to enforce a user-specified error bound: how far the total error is off the "
            "tolerated one, median",
            paper="approximate bound",
            measured=float(np.median(np.abs(spent - 1.0)[free])),
            rule=at_most(0.1, "an approximation: within a tenth"),
            source="J12 §6.4",
            scanned=SCANNED,
        ),
        Statement(
            "A way to enforce a user-specified error bound: largest total error over the tolerated "
            "one, as far as no clamp acts",
            paper="approximate bound",
            measured=float(np.max(spent[free])),
            rule=at_most(1.1, "an approximation: within a tenth"),
            source="J12 §6.4",
            scanned=SCANNED,
            reason=_where(x[free], spent[free] > 1.1),
        ),
        Statement(
            "Estimated total error tends to the true one with the second power of the radius",
            paper=None,
            measured=_order(one),
            rule=near(2.0, 0.05, "of what (54) leaves out, odd powers cancel"),
            source=OURS,
        ),
        Statement(
            "With the third derivative in the metric the bound is enforced: largest total error "
            "over the tolerated one",
            paper=None,
            measured=float(np.max(_spent(along, guarded)[guarded < 0.99 * LIMITS[1]])),
            rule=at_most(1.1, "within a tenth, as without it"),
            source=OURS,
            scanned=SCANNED,
        ),
    ]


def _spent(along: Candidates, radii: np.ndarray) -> np.ndarray:
    """True total error within radii over the tolerated one, a row for each tolerance."""
    regions = [circular_regions(r, *LIMITS) for r in radii]
    found = np.stack([np.asarray(true_error(line_light, along, r)) for r in regions])
    return found / np.asarray(TOLERANCES)[:, None]


def _order(one: Candidates) -> float:
    """Power of the radius with which the estimated total error tends to the true one."""
    sizes = np.array([0.04, 0.08, 0.16])
    reach = circular_regions(sizes[:, None], *LIMITS)
    misses = [
        abs(float((expected_error(one.derivative(2), r) / true_error(line_light, one, r))[0]) - 1.0)
        for r in (reach.at(i) for i in range(len(sizes)))
    ]
    return fitted_order(sizes, misses)


def _where(x: np.ndarray, bad: np.ndarray) -> str:
    """The mechanism, and the part of the floor in which it acts."""
    if not bad.any():
        return ""
    return (
        "E'' vanishes at the inflections near |x| = 0.65 m and says 'as far as you like': so at "
        f"{100.0 * np.mean(bad):.0f} % of places and tolerances, all of them between |x| = "
        f"{x[bad].min():.2f} and {x[bad].max():.2f} m."
    )
