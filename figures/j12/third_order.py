"""J12 §9: does a third-order radius pay for second-order extrapolation?

J12 keeps the Hessian's radius for second order, and expects third derivatives to be more trouble
than they are worth. Fields that are known exactly
(`j12.shared.shadows`): a wide lamp alone, whose light is smooth, and with a plate before it, whose
penumbra has lines across which the Hessian jumps. Records hold exact value, gradient and Hessian.
Radii: by the Hessian as J12 has it (|lambda_1|, power -1/4), by the mean of |T[x, x, x]| around
(power -1/5), and all alike. Third derivatives are differences of exact values, at a cost that no
renderer would pay: where it does not pay here it does not pay at all.

It gains 4 to 9 % of the error at equal records, and no more than radii that are all alike where
light is smooth: four numbers more for each record do not pay. Second order itself does, up to 30
times where light is smooth.
"""

from __future__ import annotations

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
from figures.j12.shared.caching import pointwise, scaled
from figures.j12.shared.shadows import exact_jet, lit
from figures.style import Claim, Drawing
from firstorder import plotting
from firstorder.caching import derivative_norm, radius_for
from firstorder.caching.candidate_tables import CandidateTable

FIELDS = {"lamp": "lamp alone", "plate": "lamp and plate"}
METHODS = ("alike", "Hessian", "third order")


def draw(quick: bool) -> Drawing:
    s = Size(24, 0, 0, 40, 2) if quick else Size(64, 0, 0, 100, 3)
    counts = (s.records, 3 * s.records)
    figure, axes = plotting.panels(2, 4, 2.1, 2.3)
    claims, arrays = [], {}
    for row, (name, words) in enumerate(FIELDS.items()):
        c, T = _case(name, s)
        n, within = s.pixels, floor_limits(s.pixels)
        radii = {
            "alike": lambda R, n=n, within=within: within.held(np.full(n * n, R)),
            "Hessian": pointwise(c.table.hessian, within),
            "third order": _third(T, within),
        }
        found = [compare(c, radii, count, order=2) for count in counts]
        first = compare(c, {"Hessian": radii["Hessian"]}, order=1)["Hessian"]
        show_light(axes[row, 0], c, words)
        most = 4.0 * found[0]["Hessian"].mean
        for k, method in enumerate(METHODS):
            show_error(axes[row, k + 1], c, found[0][method], most, method)
        for count, here in zip(counts, found, strict=True):
            arrays |= {f"{name}_{count}_{m}".replace(" ", "_"): o.errors for m, o in here.items()}
        claims += _claims(words, found, first)
    size = f"{s.pixels}^2 places, {counts[0]} and {counts[1]} records, {s.orders} orders"
    return Drawing(figure, arrays, claims, size=size, seed=12)


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


def _claims(words: str, found, first) -> list[Claim]:
    claims = []
    for here, count in zip(found, ("few", "many"), strict=True):
        for method in ("alike", "third order"):
            ratio = here[method].mean / here["Hessian"].mean
            pays = method == "third order"
            claims.append(
                Claim(
                    f"Second order: RMS error with radii {'of' if pays else 'all'} {method} over "
                    f"that with the Hessian's, {words}, {count} records",
                    "no gain worth it" if pays else "> 1",
                    ratio,
                    "",
                    ratio >= 1.0,
                )
            )
    ratio = first.mean / found[0]["Hessian"].mean
    claims.append(
        Claim(
            f"RMS error of first over second order, same records, exact derivatives, {words}",
            "> 2",
            ratio,
            "",
            ratio > 2.0,
        )
    )
    return claims
