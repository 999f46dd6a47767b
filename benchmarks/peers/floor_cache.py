"""An irradiance cache on a cluttered floor: ours beside Radiance's Hessian cache, at equal rays.

The scene is `library.clutter`, once reflected light alone. Both visit the same places of the floor
in the same random orders, gather equal numbers of rays where nothing covers a place, derive value,
gradient and radius from these, and have as many records: ours as many as Radiance found. Radii lie
between a cell and 1.3 m. Ours of second order extrapolates with the Hessian of the same rays, not
farther than three times the shortest of them: beyond that the next term is what counts. Weights of
ours end at zero on the rim of a record. Errors are RMS over the places. Truth is a gather of many
more rays on our radiance maps; how far records of Radiance with 16 times the rays are from it says
how well it is known.
"""

from __future__ import annotations

import pathlib
import tempfile
from typing import Any, NamedTuple

import jax.numpy as jnp
import numpy as np

from benchmarks.peers import measure, radiance
from firstorder.caching import (
    Candidates,
    derivative_norm,
    fit,
    gather_directions,
    radius_for,
    random_orders,
    rms,
    tabulate_candidates,
)
from firstorder.caching.occlusion import OcclusionTable, occlusion_table
from firstorder.caching.regions import circular_regions
from firstorder.io import AmbientRecords
from firstorder.space.bounces import RadianceMaps, refine_maps, solve_radiosity
from firstorder.space.library import clutter

RADIANCE = "Radiance, Hessian cache"
LARGEST = 1.3  # radius [m]; Radiance has 64 times its smallest
LENGTHS = 3.0  # of the shortest ray, within which second order is trusted
LOW, HIGH, HALVINGS = 0.03, 1.0, 6  # between which Radiance's accuracy is sought
LIGHT = ("-dj", 0, "-ds", 0.02, "-dt", 0, "-dc", 1)


class Size(NamedTuple):
    """Cells of the floor along a side, gather rays, records, orders, and what truth is made of."""

    pixels: int
    rays: int
    records: int
    orders: int
    cells: int
    truth: int


FULL, QUICK = Size(40, 1024, 200, 4, 64, 160), Size(10, 64, 30, 1, 8, 16)


def run(quick: bool) -> dict[str, Any]:
    """RMS errors of all caches, relative to the mean of E, and the images of the first order."""
    size = QUICK if quick else FULL
    scene = clutter()
    maps = refine_maps(solve_radiosity(scene, cells=size.cells, shadow=8), 2 * size.cells)
    x, open_ = _places(scene, size.pixels)
    (floor,) = scene.named("floor")
    dense = gather_directions(size.truth, 2 * size.truth, seed=1)
    known_well = tabulate_candidates(maps, x, dense, floor)
    truth = known_well.E
    orders = random_orders(len(x), size.orders, seed=19)
    theirs, known, left = {}, None, [measure.missing("pyradiance")]
    if measure.is_there("pyradiance"):
        theirs[RADIANCE], known = _theirs(scene, x, truth, orders, size)
        size, left = size._replace(records=round(theirs[RADIANCE].records)), []
    aware = occlusion_table(maps, x, floor, rays=size.rays)
    found = _ours(maps, aware, truth, orders, size, floor) | theirs
    exact = aware._replace(E=truth, gradient=known_well.gradient).candidates()
    limit = _filled(exact, aware.hessian, 2, truth, orders, size)
    mean = float(np.mean(truth))
    rows = {
        name: {
            "error": float(np.mean(c.errors)) / mean,
            "spread": float(np.std(c.errors)) / mean,
            "records": c.records,
            "own": c.own / mean,
        }
        for name, c in found.items()
    }
    images = {name: _image((c.values - truth) / mean, open_) for name, c in found.items()}
    images["truth"] = _image(truth, open_)
    return {"rows": rows, "images": images, "truth known to": known and known / mean,
            "limit": float(np.mean(limit.errors)) / mean, "size": size._asdict(),
            "left out": left}  # fmt: skip


class Filled(NamedTuple):
    """Errors of all orders, records on the average, their own error, and the first's answers."""

    errors: np.ndarray
    records: float
    own: float
    values: np.ndarray


def _places(scene, pixels: int) -> tuple[np.ndarray, np.ndarray]:
    """Middles of equal cells of the floor that no box stands on, and which cells these are."""
    s = (np.arange(pixels) + 0.5) / pixels
    x = np.stack(np.meshgrid(s, s), -1).reshape(-1, 2)
    shut = np.zeros(len(x), bool)
    for group in scene.groups:
        if type(group).__name__ == "Boxes":
            for center, axes in zip(np.asarray(group.center), np.asarray(group.axes), strict=True):
                q = (np.append(x, np.zeros((len(x), 1)), 1) - center) @ np.linalg.inv(axes).T
                shut |= np.all(np.abs(q) < 1.0 + 1e-9, axis=1)
    return x[~shut], ~shut


def _image(values: np.ndarray, open_: np.ndarray) -> list[list[float | None]]:
    """Numbers at places as an image, None where a box stands."""
    flat = np.full(len(open_), np.nan)
    flat[open_] = values
    side = round(len(open_) ** 0.5)
    rounded = [None if np.isnan(v) else float(f"{v:.3g}") for v in flat]
    return [rounded[k * side : (k + 1) * side] for k in range(side)]


# --- ours ----------------------------------------------------------------------------------------


def _ours(
    maps: RadianceMaps, aware: OcclusionTable, truth, orders, size: Size, floor: int
) -> dict[str, Filled]:
    """Caches of records that need one gather each, by name."""
    x = aware.position
    rows = round((size.rays / 3.0) ** 0.5)
    table = tabulate_candidates(maps, x, gather_directions(rows, size.rays // rows), floor)
    kinds = {
        "firstorder, second order": (aware.candidates(), aware.hessian, 2),
        "firstorder, occlusion-aware": (aware.candidates(), aware.hessian, 1),
        "firstorder, radiometric": (table.candidates(), table.hessian, 1),
        "firstorder, geometric": (table.candidates(), table.geometric, 1),
    }
    return {name: _filled(*kind, truth, orders, size) for name, kind in kinds.items()}


def _filled(candidates: Candidates, hessian, order: int, truth, orders, size: Size) -> Filled:
    x = np.asarray(candidates.position)
    radius = np.asarray(radius_for(derivative_norm(jnp.asarray(hessian), 2), 1.0, dims=2))
    most = LENGTHS * np.asarray(candidates.minimum) if order == 2 else LARGEST

    def regions(tolerance: float):
        reach = np.minimum(radius * tolerance**0.25, most)
        return circular_regions(reach, 1.0 / size.pixels, LARGEST, dims=2)

    fitted = fit(candidates, regions, orders, size.records, low=1e-14, high=1e9)
    values = np.asarray(fitted.lookup(candidates, x, order=order, fade=True).value)
    own = float(rms(np.asarray(candidates.value), truth))
    return Filled(np.asarray(rms(values, truth)), float(np.mean(fitted.size)), own, values[0])


# --- Radiance ------------------------------------------------------------------------------------


def _theirs(scene, x, truth, orders, size: Size) -> tuple[Filled, float]:
    """Caches of `rtrace`, by the accuracy that gives the records; and how far finer records are."""
    folder = pathlib.Path(tempfile.mkdtemp(prefix="peers"))
    octree = radiance.compiled(scene, folder)
    direct = radiance.irradiance(octree, x, "-ab", 0, *LIGHT)
    filled = [_searched(octree, folder, x, order, direct, size) for order in orders]
    values = np.stack([v for v, _ in filled])
    few = np.arange(0, len(x), max(1, len(x) // 40))
    fine = _records(octree, folder / "fine.amb", x[few], 0.02, 1000, 16 * size.rays)[0]
    answer = Filled(
        np.asarray(rms(values, truth)),
        float(np.mean([r.count for _, r in filled])),
        float(np.mean([_own(r, x, truth) for _, r in filled])),
        values[0],
    )
    return answer, float(rms(fine - direct[few], truth[few]))


def _own(records: AmbientRecords, x: np.ndarray, truth: np.ndarray) -> float:
    """RMS error of the records themselves."""
    at = np.argmin(np.linalg.norm(records.position[:, None, :2] - x, axis=-1), axis=1)
    return float(rms(np.pi * records.value[:, 0], truth[at]))


def _searched(octree, folder, x, order, direct, size: Size) -> tuple[np.ndarray, AmbientRecords]:
    """The cache whose number of records comes nearest to the wanted one, by halving."""
    low, high = LOW, HIGH
    tried = []
    for _ in range(HALVINGS):
        accuracy = (low * high) ** 0.5
        # Its smallest radius is the scene's size times -aa over -ar.
        finest = max(1, round(accuracy * size.pixels))
        ambient = folder / f"{accuracy:.6f}.amb"
        _, records = _records(octree, ambient, x[order], accuracy, finest, size.rays)
        tried.append((accuracy, finest, ambient, records))
        more = records.count > size.records
        low, high = (accuracy, high) if more else (low, accuracy)
    best = min(tried, key=lambda t: abs(t[3].count - size.records))
    accuracy, finest, ambient, records = best
    values = radiance.irradiance(octree, x, *_options(accuracy, finest, size.rays, ambient))
    return values - direct, records


def _records(octree, ambient, places, accuracy: float, finest: int, rays: int):
    """What `rtrace` answers as it fills a cache in the order of the places, and its records."""
    ambient.unlink(missing_ok=True)
    found = radiance.irradiance(octree, places, *_options(accuracy, finest, rays, ambient))
    return found, radiance.records(ambient)


def _options(accuracy: float, finest: int, rays: int, ambient: pathlib.Path) -> tuple:
    return ("-ab", 1, "-ad", rays, "-as", 0, "-aa", f"{accuracy:.6f}", "-ar", finest, *LIGHT,
            "-af", ambient)  # fmt: skip
