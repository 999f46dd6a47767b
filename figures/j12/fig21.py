"""J12 Fig. 21: 16 rays from each record, their radiance multiplied by noise, and no clamps.

The library's box. Each place casts 4 x 4 stratified rays of its own and multiplies what each sees
by a uniform number in [0, 2], as in the paper; 20 seeds. The places of about a thousand records are
judged by what noise leaves of the radii (their scatter against the exact ones,
`shared.exact_box`), by where the records go (their density against that of exact radii, on a grid
of 8 x 8), and by the error that exact records at these places make, since the noisy values
themselves err by their own noise.

Where none of the 16 rays meets light the radiometric Hessian is zero and its radius infinite, at
any tolerance: the first such record ends the cache. The geometric one is infinite only where all
rays miss everything, one place in ten thousand; these are left out where records are compared.
Radii come out smaller than the exact ones beside the walls: one close hit decides there, and
nothing cancels it. Records crowd along both walls, which no light asks for at the black one; beside
the bright one it suits the light, and exact records at these places err less than at those of exact
radii.
"""

from __future__ import annotations

import numpy as np

from figures.j12.shared import exact_box
from figures.j12.shared.caching import Asked, Outcome, pointwise
from figures.j12.shared.exact_box import FREE, Light, Room, image, lit, race
from figures.j12.shared.floor import letter, plain, scale, show_map, show_records
from figures.j12.shared.picture import show_box
from figures.spread import spread
from figures.style import Drawing
from figures.verdicts import Measurement, Statement, at_least, at_most
from firstorder import plotting
from firstorder.caching import derivative_norm
from firstorder.plotting.style import COLOURS
from firstorder.space.estimators._gather_sums import surface_area_sums

KINDS = ("geometric", "radiometric")
RAYS = 4, 4


def draw(quick: bool) -> Drawing:
    cells, judged, records, seeds = (40, 20, 110, 3) if quick else (128, 64, 1000, 20)
    light, asked = exact_box.empty_case(Room(), cells, judged)
    clean = race(light, asked, light.metrics(), records)
    runs = [_run(light, asked, clean, records, seed) for seed in range(21, 21 + seeds)]
    figure, axes = plotting.panels(1, 6, 2.2, 2.6)
    _draw(axes[0], light, asked, clean, *_last(light, asked, records))
    letter(axes)
    arrays = {k: np.array([run[k] for run in runs]) for k in runs[0]}
    size = f"{cells}^2 places, {records} records, 16 noisy rays, {seeds} seeds"
    claims = _claims(arrays, light, clean)
    return Drawing(figure, arrays, claims, size=size, seed=21)


# --- rays ----------------------------------------------------------------------------------------


def gathered(room: Room, x: np.ndarray, seed: int):
    """Irradiance and both Hessians of stratified rays from every place, radiances noisy.

    Returns:
        E (m,), and the Hessians of the light and of the geometry alone, (m, 2, 2) each.
    """
    rng, (rows, columns) = np.random.default_rng(seed), RAYS
    up, around, noise = rng.random((3, len(x), rows, columns))
    square = ((np.arange(rows)[:, None] + up) / rows).reshape(len(x), -1)
    phi = (2.0 * np.pi * (np.arange(columns) + around) / columns).reshape(len(x), -1)
    d = np.stack([np.sqrt(square) * np.cos(phi), np.sqrt(square) * np.sin(phi)], 1)
    rise = np.sqrt(1.0 - square)
    wall = np.where(d[:, 0] < 0.0, x[:, :1], 1.0 - x[:, :1]) / np.abs(d[:, 0])
    z, y = wall * rise, x[:, 1:] + wall * d[:, 1]
    meets = (z < room.height) & (y > 0.0) & (y < 1.0)
    over = room.height / rise
    off = x[:, :, None] + over[:, None] * d - np.array([room.across, 0.5])[:, None]
    lamp = ~meets & np.all(np.abs(off) < room.lamp, axis=1)
    inverse = np.where(meets, 1.0 / wall, np.where(lamp, 1.0 / over, 0.0))
    ends = room.across - room.lamp, room.across + room.lamp
    sent = 0.5 / np.pi * np.asarray(lit(room, *ends, y, np.minimum(z, room.height)))
    L = 2.0 * noise.reshape(len(x), -1) * np.where(meets & (d[:, 0] < 0.0), sent, 0.0)
    normal = np.stack([np.where(meets, -1.0 / d[:, 0], 0.0), np.zeros_like(rise)], 1)
    share = np.pi / square.shape[1] * inverse**2
    light, geometry = (
        surface_area_sums((weight * share)[:, None], weight * share, d, normal)[1]
        for weight in (L, np.ones_like(L))
    )
    return np.pi * np.mean(L, axis=1), light, geometry


def _infinite(H: np.ndarray) -> np.ndarray:
    return np.all(H == 0.0, axis=(1, 2))


def _records(light: Light, asked: Asked, H: np.ndarray, records: int) -> Outcome:
    """Exact records at places by a Hessian; those without a radius are left out."""
    there = ~_infinite(H)
    held = Light(*(a[there] for a in light))
    return race(held, asked, {"x": pointwise(H[there], FREE)}, records)["x"]


def _last(light: Light, asked: Asked, records: int):
    """What one seed gives, for the picture."""
    E, _, geometric = gathered(Room(), light.position, 21)
    return E, geometric, _records(light, asked, geometric, records)


def _run(light: Light, asked: Asked, clean, records: int, seed: int) -> dict[str, float]:
    """All numbers of one seed."""
    E, radiometric, geometric = gathered(Room(), light.position, seed)
    found = {"noise": float(np.sqrt(np.mean((E - light.E) ** 2)) / np.mean(light.E))}
    for name, H, exact in (
        ("geometric", geometric, light.geometric),
        ("radiometric", radiometric, light.hessian),
    ):
        blind = _infinite(H)
        k, right = (np.asarray(derivative_norm(a[~blind], 2)) for a in (H, exact))
        found[f"{name} scatter"] = float(np.std(0.25 * np.log(k / right)))
        found[f"{name} miss"] = float(np.median(np.abs(k / right - 1.0)))
        found[f"{name} R miss"] = float(np.median(np.abs((right / k) ** 0.25 - 1.0)))
        found[f"{name} blind"] = float(np.mean(blind))
    found["E miss"] = float(np.median(np.abs(E / light.E - 1.0)))
    found["spoiled"] = _spoiled(light, asked, geometric, records)
    outcome = _records(light, asked, geometric, records)
    found["cost"] = outcome.mean / clean["geometric"].mean
    found["split"] = min(clean[m].mean for m in ("minimum", "harmonic")) / outcome.mean
    densities = _density(outcome), _density(clean["geometric"])
    found["alike"] = float(np.corrcoef(*densities)[0, 1])
    return found


def _spoiled(light: Light, asked: Asked, H: np.ndarray, records: int) -> float:
    """1 if no cache of so many records is found, or one of them reaches everywhere; else 0."""
    try:
        chosen = race(light, asked, {"x": pointwise(H, FREE)}, records)["x"].fit.records[0]
    except ValueError:
        return 1.0
    return float(np.any(chosen & _infinite(H)))


def _density(outcome: Outcome) -> np.ndarray:
    """Records in each of 8 x 8 squares."""
    every = outcome.positions()
    return np.histogram2d(every[:, 1], every[:, 0], 8, [[0, 1], [0, 1]])[0].ravel()


# --- what is said --------------------------------------------------------------------------------


def _claims(arrays, light: Light, clean) -> list:
    noise, blind = spread(arrays["noise"]), spread(arrays["geometric blind"])
    spoiled, split_ = spread(arrays["spoiled"]), spread(arrays["split"])
    scatter = spread(arrays["geometric scatter"] / arrays["radiometric scatter"])
    radius = spread(arrays["geometric R miss"] / arrays["E miss"])
    robust = spread(arrays["geometric miss"] / arrays["E miss"])
    more = spread(arrays["radiometric blind"] - arrays["geometric blind"])
    cost, alike = spread(arrays["cost"]), spread(arrays["alike"])
    own = min(clean[m].mean for m in ("minimum", "harmonic")) / clean["geometric"].mean
    source, seeds = "J12 §8.3, Fig. 21", "seeds of rays and noise"
    return [
        Statement(
            "With 16 noisy rays the geometric metric produces high-quality distributions: error of "
            "the better split sphere with exact lengths over that of its places, records exact",
            "high-quality",
            split_[0],
            at_least(1.0, "'high-quality': no worse than what the paper replaces by it"),
            source,
            error=split_[1],
            scanned=seeds,
        ),
        Statement(
            "While the irradiance is very noisy, the maximum eigenvalue can already be estimated "
            "robustly: relative error of the geometric Hessian's over that of E, medians",
            "robustly",
            robust[0],
            at_most(1.0, "'while': the eigenvalue errs less than the irradiance"),
            source,
            error=robust[1],
            scanned=seeds,
            reason="The kernel of the Hessian has both signs and goes as 1 / r^2: of 16 rays the "
            "few that meet a wall close by decide it, while E is a plain mean of radiances. Its "
            "fourth root, the radius, errs less than E.",
        ),
        Statement(
            "Fewer of its radii are unbounded than of the radiometric one's: share of places, the "
            "radiometric minus the geometric",
            "more robust",
            more[0],
            at_least(0.0, "'more robust'"),
            "J12 §8.3",
            error=more[1],
            scanned=seeds,
        ),
        Statement(
            "It is robust without the need for clamping: share of places whose radius is unbounded",
            "without the need for clamping",
            blind[0],
            at_most(0.0, "'without the need': none"),
            source,
            error=blind[1],
            scanned=seeds,
            reason="Here and there all 16 rays leave the box through its open sides; the radius is "
            "infinite there, and as a record such a place covers the floor. With rays enough, and "
            "in closed rooms, none is.",
        ),
        Measurement(
            "Share of seeds in which a record's radius is unbounded, or no cache of about a "
            "thousand records is found",
            *_told(spoiled, source),
        ),
        Measurement("RMS error of the noisy irradiance over its mean", *_told(noise, source)),
        Measurement(
            "Relative error of the geometric radius, its fourth root, over that of E, medians",
            *_told(radius, source),
        ),
        Measurement(
            "Scatter of log R where it is finite, against exact radii, geometric over radiometric",
            *_told(scatter, source),
        ),
        Measurement(
            "Correlation of the records' density with that of exact radii, geometric Hessian",
            *_told(alike, source),
        ),
        Measurement(
            "RMS error of exact records at places by 16 noisy rays over places by exact radii, "
            "geometric Hessian",
            *_told(cost, source),
        ),
        Measurement(
            "RMS error of the better split sphere over that of the geometric Hessian, all exact",
            own,
            source=source,
        ),
    ]


def _told(found: tuple[float, float], source: str):
    """Value, unit, error and source of a measurement."""
    return found[0], "", found[1], source


# --- pictures ------------------------------------------------------------------------------------


def _draw(axes, light: Light, asked: Asked, clean, E, geometric, noisy: Outcome) -> None:
    records = noisy.positions()
    show_box(axes[0], Room(), image(asked.x, asked.truth), "box, records of d)", records=records)
    error = 100.0 * np.sqrt(np.mean((E - light.E) ** 2)) / np.mean(light.E)
    words = f"0 to {np.max(E):.2g} W/m², RMS error {error:.0f} %"
    show_map(axes[1], light.position, E, "E of 16 noisy rays", words, cmap="magma", vmin=0.0)
    for ax, outcome, title in (
        (axes[2], clean["geometric"], "geometric, exact"),
        (axes[3], noisy, "geometric, 16 rays"),
    ):
        show_records(ax, outcome.positions(), color=COLOURS[0], markersize=2.0)
        plain(ax, title, f"exact records: RMS {outcome.mean:.1e}")
    there = ~_infinite(geometric)
    k, right = (np.asarray(derivative_norm(a[there], 2)) for a in (geometric, light.geometric))
    ratio = np.full(len(there), np.nan)
    ratio[there] = -0.25 * np.log2(k / right)
    signed = dict(cmap="RdBu", vmin=-2.0, vmax=2.0)
    show_map(axes[4], light.position, ratio, "R over exact R", "dots: infinite", **signed)
    scale([axes[4]], "log$_2$")
    show_records(axes[4], light.position[~there], color=COLOURS[1], markersize=6)
    axes[5].hist(ratio[there], 40, (-3, 3), histtype="step")
    axes[5].set(yticks=[], title="R over exact R, all places", box_aspect=1.0)
    axes[5].set_xlabel("log$_2$", fontsize=7.5)
