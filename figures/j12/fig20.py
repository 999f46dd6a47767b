"""J12 Fig. 20: where a block is nearly black, the radiometric Hessian sees nothing to sample.

The box with the block of albedo 0.01 (the paper's), 0.001 and 0; above are the library's sizes, and
errors are scanned over 20 rooms. Records hold the exact light (`shared.exact_box`), first order,
and no radius has a limit but the floor.

Behind the block no light of the wall arrives, only the block's own. There the Hessian is as small
as the albedo, and radii go as its power -1/4: at 0.01 the longest radiometric radius is no more
than a few times the geometric one, at 0 irradiance, gradient and Hessian vanish together and a
record reaches everywhere, at any tolerance. The geometric Hessian takes all surfaces as equally
bright, and its radii are finite at all places.
"""

from __future__ import annotations

import numpy as np

from figures.j12.shared import exact_box
from figures.j12.shared.exact_box import Light, Room, factor, image
from figures.j12.shared.floor import (
    letter,
    records_of,
    scale,
    show_error,
    show_map,
    show_records,
)
from figures.j12.shared.picture import show_box
from figures.style import Drawing
from figures.verdicts import OURS, Measurement, Statement, at_least, at_most, near
from firstorder import plotting
from firstorder.caching import derivative_norm, radius_for
from firstorder.plotting.style import COLOURS

ALBEDOS = (0.01, 0.001, 0.0)
METHODS = ("minimum", "harmonic", "radiometric", "geometric")


def draw(quick: bool) -> Drawing:
    cells, records = (40, 200) if quick else (120, 1000)
    by = {a: exact_box.blocked_case(Room(albedo=a), cells) for a in ALBEDOS}
    light, asked = by[0.01]
    here = exact_box.race(light, asked, _methods(light), records)
    tolerance = float(here["radiometric"].fit.threshold[0])
    radii = {a: _radius(by[a][0].hessian, tolerance) for a in ALBEDOS}
    radii["geometric"] = _radius(light.geometric, float(here["geometric"].fit.threshold[0]))
    figure, axes = plotting.panels(2, 5, 2.2, 2.5)
    records_shown = records_of(here["geometric"])
    show_box(axes[0, 0], Room(albedo=0.01), image(asked.x, asked.truth), "box, records of c)",
             records=records_shown, blocked=True)  # fmt: skip
    _show_light(axes[1, 0], light)
    for ax, m in zip(axes[0, 1:], METHODS[2:] + METHODS[:2], strict=True):
        show_error(ax, asked, here[m], 4.0 * here["geometric"].mean, f"error, {m}")
    scale(axes[0, 1:])
    for ax, key in zip(axes[1, 1:], radii, strict=True):
        name = key if key == "geometric" else f"radiometric, albedo {key:g}"
        _show_radii(ax, light, radii[key], name)
    scale(axes[1, 1:], "log$_{10}$ of the radius (m)")
    letter(axes)
    found = _scan(quick)
    arrays = {f"rms_{m}": np.array([h[m] for h in found]) for m in METHODS}
    arrays |= {f"radii_{key}": R for key, R in radii.items()}
    size = f"{cells}^2 places, {records} records, {len(found)} rooms"
    claims = [*_unbounded(by, radii, light), *_errors(found)]
    return Drawing(figure, arrays, claims, size=size, seed=12)


def _methods(light: Light):
    return {m: light.metrics()[m] for m in METHODS}


def _radius(H: np.ndarray, tolerance: float) -> np.ndarray:
    return np.asarray(radius_for(derivative_norm(H, 2), tolerance, dims=2))


def _scan(quick: bool) -> list[dict[str, float]]:
    """Errors with a block of the paper's albedo in rooms of random sizes."""
    cells, records = (20, 60) if quick else (60, 400)
    found = []
    for room in exact_box.rooms_with_block(3 if quick else 20):
        light, asked = exact_box.blocked_case(room._replace(albedo=0.01), cells)
        outcomes = exact_box.race(light, asked, _methods(light), records)
        found.append({m: o.mean for m, o in outcomes.items()})
    return found


def _unbounded(by, radii, light: Light) -> list:
    none = by[0.0][0]
    dark = ~np.isfinite(radii[0.0])
    zero = dark & (none.E == 0.0) & np.all(none.gradient == 0.0, axis=1)
    growth = float(np.median(radii[0.001][dark] / radii[0.01][dark]))
    every = float(np.mean(~np.isfinite(_radius(light.geometric, 1.0))))
    longest = {key: float(np.max(R[np.isfinite(R)])) for key, R in radii.items()}
    source = "J12 §8.2-8.3, Fig. 20"
    return [
        Statement(
            "The radiometric metric can predict unbounded radii when the irradiance and all "
            "gradients are zero: share of the floor beside a block of albedo 0",
            "unbounded",
            float(np.mean(zero)),
            at_least(1.0 / len(zero), "'can': at one place"),
            source,
        ),
        Statement(
            "In the dark a radius grows by the fourth root of 10 when the block's albedo goes "
            "from 0.01 to 0.001: median",
            None,
            growth,
            near(10.0**0.25, 0.01, "(70), and light that is linear in the albedo"),
            OURS,
        ),
        Statement(
            "The geometric Hessian robustly resolves this: share of the floor with an unbounded "
            "radius",
            "well-behaved",
            every,
            at_most(0.0, "'resolves': none"),
            source,
        ),
        *(
            Measurement(
                "Longest radius by the radiometric Hessian over the geometric one's, albedo "
                f"{albedo:g}, tolerance of as many records at 0.01",
                longest[albedo] / longest["geometric"],
                source=source,
            )
            for albedo in (0.01, 0.001)
        ),
    ]


def _errors(found) -> list:
    over = factor(found, "radiometric", "geometric")
    claims: list = [
        Statement(
            "A nearly black block is a failure case of the radiometric Hessian: its RMS error "
            "over the geometric one's, albedo 0.01",
            "failure",
            over.mean,
            at_least(1.0, "'failure': larger error"),
            "J12 §8.2-8.3, Fig. 20",
            error=over.error,
            scanned=exact_box.SCANNED_BLOCK,
            reason="A hundredth of the light is still light: radii in the dark grow only by the "
            "fourth root of the albedo, and the edge of the shadow errs with either metric.",
        )
    ]
    for m in ("minimum", "harmonic"):
        over = factor(found, m, "geometric")
        claims.append(
            Measurement(
                f"RMS error of the {m} split sphere over the geometric Hessian's, albedo 0.01",
                over.mean,
                error=over.error,
                source="J12 Fig. 20",
            )
        )
    return claims


# --- pictures ------------------------------------------------------------------------------------


def _show_light(ax, light: Light) -> None:
    E = np.maximum(light.E, 1e-7)
    words = f"{np.min(E):.1e} to {np.max(E):.1e} W/m²"
    show_map(ax, light.position, np.log10(E), "logarithm of E, albedo 0.01", words, cmap="viridis")


def _show_radii(ax, light: Light, R: np.ndarray, name: str):
    """Radii on a scale of logarithms; orange where they are infinite."""
    finite = np.isfinite(R)
    words = f"up to {np.max(R[finite]):.2f} m" + ("" if finite.all() else "; orange: infinite")
    shown = np.log10(np.where(finite, R, np.nan))
    show_map(ax, light.position, shown, name, words, cmap="Greys_r", vmin=-2.0, vmax=0.0)
    show_records(ax, light.position[~finite], color=COLOURS[1], markersize=1.6)
