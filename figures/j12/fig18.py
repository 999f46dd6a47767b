"""J12 Fig. 18: caches of order 0, 1 and 2 on the floor of the box, and of the box with a block.

Above are the library's sizes; all is scanned over 20 rooms with lamp, walls and block of random
sizes. Records hold the exact light (no ray is cast, `shared.exact_box`), its exact gradient and the
Hessian by surface area (in the empty box that is all of it). All caches use the split sphere by the
shortest ray and have the same records, so that only the extrapolation differs; radii have no
limits.

With exact records second order errs less by more than the paper's factor of 2 in the empty box.
Beside the block it gains less, as the paper has it, and mostly where the whole wall is seen. In the
penumbra a quadric that does not know the edge of the shadow gains little over a plane.
"""

from __future__ import annotations

import numpy as np

from figures.j12.shared import exact_box
from figures.j12.shared.caching import Asked, Outcome, answered
from figures.j12.shared.exact_box import BLOCK, Light, Room, factor, image, race
from figures.j12.shared.floor import letter, records_of, scale, show_error, show_map
from figures.j12.shared.picture import show_box
from figures.style import Drawing
from figures.verdicts import Statement, at_least
from firstorder import plotting
from firstorder.caching import rms

ORDERS = ("constant", "gradient", "Hessian")
REGION = {"lit": "where the whole wall is seen", "penumbra": "where the block hides some of it"}


def draw(quick: bool) -> Drawing:
    some = exact_box.some_rooms(3 if quick else 20)
    sizes = {"box": (40, 20, 110) if quick else (160, 64, 1000)}
    figure, axes = plotting.panels(2, 5, 2.2, 2.5)
    light, asked = exact_box.empty_case(Room(), *sizes["box"][:2])
    _show(axes[0], "box", asked, _orders(light, asked, sizes["box"][2]))
    block, beside = exact_box.blocked_case(Room(), 20 if quick else 60)
    records = 60 if quick else 400
    _show(axes[1], "box with a block", beside, _orders(block, beside, records))
    letter(axes)
    empty, blocked = [], []
    for room in some:
        light, asked = exact_box.empty_case(room, *sizes["box"][:2])
        empty.append({str(k): o.mean for k, o in enumerate(_orders(light, asked, sizes["box"][2]))})
    for room in exact_box.rooms_with_block(len(some)):
        block, beside = exact_box.blocked_case(room, 20 if quick else 60)
        blocked.append(_by_region(beside, _orders(block, beside, records)))
    arrays = {f"box_{k}": np.array([here[k] for here in empty]) for k in empty[0]}
    arrays |= {f"block_{k}": np.array([here[k] for here in blocked]) for k in blocked[0]}
    size = f"{sizes['box'][0]}^2 places, {sizes['box'][2]} records, {len(some)} rooms"
    return Drawing(figure, arrays, _claims(empty, blocked), size=size, seed=12)


def _orders(light: Light, asked: Asked, records: int) -> list[Outcome]:
    """The same records, expanded to order 0, 1 and 2."""
    first = race(light, asked, {"minimum": light.metrics()["minimum"]}, records)["minimum"]
    return [answered(first.candidates, first.fit, asked, order=k) for k in (0, 1, 2)]


def _hidden(x: np.ndarray) -> np.ndarray:
    """At which places the block hides some of the left wall."""
    before = BLOCK[:, 0] < x[:, :1]
    reach = x[:, :1] / np.where(before, x[:, :1] - BLOCK[:, 0], 1.0)
    cut = x[:, 1, None, None] + (BLOCK[:, 1] - x[:, 1, None, None]) * reach[..., None]
    cut = np.where(before[..., None], cut, np.nan).reshape(len(x), -1)
    any_before = before.any(axis=1)
    low = np.min(cut, axis=1, initial=np.inf, where=~np.isnan(cut))
    high = np.max(cut, axis=1, initial=-np.inf, where=~np.isnan(cut))
    return any_before & (low < 1.0) & (high > 0.0)


def _by_region(asked: Asked, outcomes: list[Outcome]) -> dict[str, float]:
    """RMS errors by order over the whole floor, and over its lit and its shadowed part."""
    hidden = _hidden(asked.x)
    found = {str(k): o.mean for k, o in enumerate(outcomes)}
    for words, mask in (("lit", ~hidden), ("penumbra", hidden)):
        for k, o in enumerate(outcomes):
            found[f"{k} {words}"] = float(rms(o.values[:, mask], asked.truth[mask])[0])
    return found


def _claims(empty, blocked) -> list[Statement]:
    gain = factor(empty, "1", "2")
    beside = factor(blocked, "1", "2")
    less = factor(
        [{"a": a["1"] / a["2"], "b": b["1"] / b["2"]} for a, b in zip(empty, blocked, strict=True)],
        "a",
        "b",
    )
    lit, shadow = (factor(blocked, f"1 {w}", f"2 {w}") for w in REGION)
    constant = [factor(found, "0", "1") for found in (empty, blocked)]
    source, scanned = "J12 §8.1, Fig. 18", exact_box.SCANNED_BLOCK
    steps = [
        Statement(
            f"RMS error decreases from constant to gradient extrapolation, same records, {words}: "
            "the one over the other",
            "> 1",
            found.mean,
            at_least(1.0, "'decreases'"),
            source,
            error=found.error,
            scanned=where,
        )
        for words, found, where in zip(
            ("box", "box with a block"), constant, (exact_box.SCANNED, scanned), strict=True
        )
    ]
    return [
        Statement(
            "RMS error of gradient over Hessian extrapolation, same records, box",
            "more than 2",
            gain.mean,
            at_least(2.0, "the paper's factor"),
            source,
            error=gain.error,
            scanned=exact_box.SCANNED,
        ),
        Statement(
            "RMS error of gradient over Hessian extrapolation, same records, box with a block: "
            "still some benefit",
            "some benefit",
            beside.mean,
            at_least(1.0, "'benefit': smaller error"),
            source,
            error=beside.error,
            scanned=scanned,
            reason="The quadric reaches across the shadow's edge, which the surface-area Hessian "
            "does not know; what it loses there is more than it gains in the light.",
        ),
        Statement(
            "With the block the improvement is less significant: gain of the Hessian in the box "
            "over that with the block",
            "> 1",
            less.mean,
            at_least(1.0, "'less significant'"),
            source,
            error=less.error,
            scanned=scanned,
        ),
        Statement(
            "The improvement is primarily concentrated in fully-illuminated regions: gain "
            f"{REGION['lit']} over that {REGION['penumbra']}",
            "> 1",
            lit.mean / shadow.mean,
            at_least(1.0, "'primarily': the larger gain"),
            source,
            error=lit.mean
            / shadow.mean
            * np.hypot(lit.error / lit.mean, shadow.error / shadow.mean),
            scanned=scanned,
        ),
        *steps,
    ]


def _show(axes, words: str, asked: Asked, found: list[Outcome]) -> None:
    """The box with its records, the light on its floor, and the errors of every order."""
    light, blocked = image(asked.x, asked.truth), words != "box"
    options = dict(records=records_of(found[0]), blocked=blocked)
    show_box(axes[0], Room(), light, f"{words}, records", **options)
    below = f"0 to {np.max(asked.truth):.3g} W/m²"
    show_map(axes[1], asked.x, asked.truth, "indirect light", below, cmap="magma", vmin=0.0)
    most = 3.0 * found[1].mean
    for k, outcome in enumerate(found):
        title = f"error, {ORDERS[k]}"
        show_error(axes[k + 2], asked, outcome, most, title, records=k == 0)
    scale(axes[2:])
