"""J12 §9: does a third-order radius pay for second-order extrapolation?

J12 keeps the Hessian's radius for second order, and expects third derivatives to be more trouble
than they are worth. Fields that are known exactly
(`j12.shared.shadows`): a wide lamp alone, whose light is smooth, and with plates before it, whose
penumbra has lines across which the Hessian jumps. Records hold exact value, gradient and Hessian.
Radii: by the Hessian as J12 has it (|lambda_1|, power -1/4), by the mean of |T[x, x, x]| around
(power -1/5), and all alike. Third derivatives are differences of exact values, at a cost that no
renderer would pay: where it does not pay here it does not pay at all.

"Outweigh" is read as the paper counts costs: its Hessian takes "roughly 50 %" more time, and third
derivatives are not had for less. So the Hessian's radii get half as many records again, and leave
less error. At equal records third order gains some per cent, and hardly more than radii that are
all alike where light is smooth. Second order itself does pay, up to 30 times where light is smooth.
"""

from __future__ import annotations

import functools

import jax.numpy as jnp
import numpy as np

from figures.j12.shared.box import (
    Case,
    Size,
    compare,
    floor_limits,
    places,
    show_error,
    show_light,
)
from figures.j12.shared.caching import Outcome, pointwise, scaled
from figures.j12.shared.shadows import PLATES, exact_jet, lit
from figures.spread import Spread, grouped, ratio_of_means
from figures.style import Drawing
from figures.verdicts import Measurement, Statement, at_least
from firstorder import plotting
from firstorder.caching import derivative_norm, radius_for
from firstorder.caching.candidate_tables import CandidateTable

FIELDS = {"lamp": "lamp alone", "plate": "lamp and plate"}
METHODS = ("alike", "Hessian", "third order")
COST = 1.5  # J12 §8: time with the Hessian over time without it


def draw(quick: bool) -> Drawing:
    s = Size(24, 0, 0, 40, 2) if quick else Size(48, 0, 0, 56, 4)
    counts = (s.records, 3 * s.records)
    names = tuple(FIELDS) if quick else ("lamp", *PLATES)
    found = {name: _compared(name, s, counts) for name in names}
    figure, axes = plotting.panels(2, 4, 2.1, 2.3)
    arrays = {}
    for row, (name, words) in enumerate(FIELDS.items()):
        c, _ = _case(name, s)
        show_light(axes[row, 0], c, words)
        few = found[name][0]
        for k, method in enumerate(METHODS):
            show_error(axes[row, k + 1], c, few[method], 4.0 * few["Hessian"].mean, method)
    for name, of_counts in found.items():
        for count, here in zip(counts, of_counts, strict=True):
            arrays |= {f"{name}_{count}_{m}".replace(" ", "_"): o.errors for m, o in here.items()}
    size = f"{s.pixels}^2 places, {counts[0]} and {counts[1]} records, {s.orders} orders"
    size += f", {len(names)} lamps and plates"
    return Drawing(figure, arrays, _claims(found), size=size, seed=12)


def _compared(name: str, s: Size, counts) -> list[dict[str, Outcome]]:
    """Caches of every method, with few records and with many."""
    c, T = _case(name, s)
    n, within = s.pixels, floor_limits(s.pixels)
    by_hessian = pointwise(c.table.hessian, within)
    radii = {
        "alike": lambda R: within.held(np.full(n * n, R)),
        "Hessian": by_hessian,
        "third order": _third(T, within),
    }
    found = []
    for count in counts:
        here = compare(c, radii, count, order=2)
        here |= {
            "more records": compare(c, {"x": by_hessian}, round(COST * count), order=2)["x"],
            "first order": compare(c, {"x": by_hessian}, count, order=1)["x"],
        }
        found.append(here)
    return found


@functools.cache
def _case(name: str, s: Size) -> tuple[Case, np.ndarray]:
    x = places(s.pixels)
    jet = exact_jet(name, x)
    none = np.zeros(len(x))
    table = CandidateTable(
        x, jet.E, jet.gradient, jet.gradient, jet.hessian, jet.hessian, none, none, none
    )
    return Case(lit(name), table, jet.E, np.ones(len(x), bool), s), jet.third


def _third(T: np.ndarray, within):
    size = derivative_norm(jnp.asarray(T), 3, "mean")
    return scaled(np.asarray(radius_for(size, 1.0, order=2, dims=2)), 0.2, within)


def _claims(found) -> list[Statement | Measurement]:
    def over(method: str, under: str, names) -> Spread:
        """Geometric mean over fields, each of all numbers of records; of one field over these."""
        return grouped([[h[method].mean / h[under].mean for h in found[n]] for n in names])

    plates = [n for n in found if n != "lamp"]
    pays = over("third order", "more records", found)
    second = min(
        (
            ratio_of_means(h["first order"].errors, h["Hessian"].errors)
            for of_counts in found.values()
            for h in of_counts
        ),
        key=lambda r: r.mean,
    )
    words = f"{len(found)} fields, few and many records"
    return [
        Statement(
            "With second order, the complexity of third derivatives outweighs the advantages: "
            f"error with their radii over that of the Hessian's with {COST:g} times the records",
            paper="outweigh",
            measured=pays.mean,
            rule=at_least(1.0, "'outweigh': what they cost is better spent on records"),
            source="J12 §9",
            error=pays.error,
            scanned=words,
            reason="The Hessian's radii are wrong wherever the Hessian is nearly constant.",
        ),
        Statement(
            "Second-order expansion reduces the error of reconstruction, exact derivatives: first "
            "order over second, same records, least of all",
            paper="some benefits",
            measured=second.mean,
            rule=at_least(1.0, "'benefits': a smaller error"),
            source="J12 §9",
            error=second.error,
            scanned=words,
        ),
        *(
            Measurement(f"Second order: error with radii {what}", r.mean, error=r.error)
            for what, r in (
                (
                    "of third order over the Hessian's, lamp alone",
                    over("third order", "Hessian", ("lamp",)),
                ),
                (
                    "of third order over the Hessian's, plates",
                    over("third order", "Hessian", plates),
                ),
                ("all alike over the Hessian's, lamp alone", over("alike", "Hessian", ("lamp",))),
                ("all alike over the Hessian's, plates", over("alike", "Hessian", plates)),
            )
        ),
        *(
            Measurement(f"First order over second, same records, {what}", r.mean, error=r.error)
            for what, r in (
                ("lamp alone", over("first order", "Hessian", ("lamp",))),
                ("plates", over("first order", "Hessian", plates)),
            )
        ),
    ]
