"""What J12's figures in space share: tables of the box scenes, the exact light on their floor.

Candidates are the middles of equal cells of the floor; those under the block are left out. A cache
has about the wanted number of records (within 0.2 %), by a threshold found for each order of
insertion. Radii are held between a cell, below which they cover nothing, and 1.5 m, above which
nothing is left to cover. Errors are RMS over the same cells, against the exact irradiance.
"""

from __future__ import annotations

import functools
from dataclasses import dataclass

import numpy as np

from figures.j12.shared import caching
from figures.j12.shared.caching import Asked, Limits, Outcome, Regions, pointwise, split
from firstorder.caching import elliptic_regions, rms, ssim
from firstorder.caching.candidate_tables import (
    CandidateTable,
    gather_directions,
    tabulate_candidates,
)
from firstorder.plotting.style import COLOURS
from firstorder.space import Boxes, Scene, box, primitive
from firstorder.space.bounces._radiance_maps import RadianceMaps, face_layout, refine_maps
from firstorder.space.bounces.radiosity import solve_radiosity
from firstorder.space.library import _scenes


@dataclass(frozen=True)
class Size:
    """Cells of the floor along a side, strata of the hemisphere, records, orders of insertion."""

    pixels: int
    rows: int
    columns: int
    records: int
    orders: int

    def words(self) -> str:
        """For the table of claims."""
        rays = self.rows * self.columns
        return f"{self.pixels}^2 places, {rays} rays, {self.records} records, {self.orders} orders"


def size(quick: bool) -> Size:
    """30,000 rays and a thousand records; or fewer of both."""
    return Size(32, 20, 60, 110, 2) if quick else Size(96, 100, 300, 1000, 3)


@dataclass(frozen=True)
class Case:
    """A scene, the table of its floor and the true irradiance there.

    Attributes:
        maps: the light that surfaces send.
        table: one row for each place.
        truth: irradiance at each place, exact or from more rays.
        open: which cells of the floor are places.
        size: of the table.
    """

    maps: RadianceMaps
    table: CandidateTable
    truth: np.ndarray
    open: np.ndarray
    size: Size

    def image(self, values) -> np.ndarray:
        """Numbers at places as an image of the floor, NaN under the block."""
        found = np.full(self.open.size, np.nan)
        found[self.open] = values
        return found.reshape(self.size.pixels, -1)

    @property
    def noise(self) -> float:
        """RMS error of the table's own irradiance."""
        return float(rms(self.table.E, self.truth))


@functools.cache
def case(name: str, size: Size, wall: str = "black", albedo: float = 0.5) -> Case:
    """One of the box scenes: "j12_box" or "j12_occluder"."""
    if name == "j12_box":
        return tabulated(_scenes.j12_box(wall), size)
    return tabulated(_scenes.j12_occluder(wall, albedo), size)


def random_block(seed: int) -> Scene:
    """The box of J12 with a block of any size and albedo at any place, with the wall or without."""
    rng = np.random.default_rng(seed)
    half = 0.5 * rng.uniform((0.1, 0.1), (0.4, 0.4))
    middle = rng.uniform(half + 0.15, 0.85 - half)
    low, high = np.append(middle - half, 0.0), np.append(middle + half, rng.uniform(0.1, 0.4))
    block = primitive(box(low, high), name="block", albedo=rng.uniform(0.0, 0.9))
    return Scene.of(*_scenes._box(("black", "none")[seed % 2], 1.0), block)


def tabulated(scene: Scene, size: Size) -> Case:
    """A box with a block or without, the table of its floor and the exact light there."""
    maps = refine_maps(solve_radiosity(scene, cells=32, shadow=0), 128)
    x = places(size.pixels)
    shut = np.zeros(len(x), bool)
    if "block" in scene.names:
        low, high = block_of(scene)[:, :2]
        shut = np.all((x > low) & (x < high), axis=1)
    table = tabulate_candidates(
        maps, x[~shut], gather_directions(size.rows, size.columns), scene.named("floor")[0]
    )
    return Case(maps, table, exact(maps, x[~shut]), ~shut, size)


def places(pixels: int) -> np.ndarray:
    """Middles of equal cells of the unit square."""
    s = (np.arange(pixels) + 0.5) / pixels
    return np.stack(np.meshgrid(s, s), -1).reshape(-1, 2)


# --- exact light ---------------------------------------------------------------------------------


def block_of(scene: Scene) -> np.ndarray:
    """Lower and upper corner of a scene's block [m]."""
    (blocks,) = (group for group in scene.groups if isinstance(group, Boxes))
    half = np.diagonal(np.asarray(blocks.axes[0]))
    return np.asarray(blocks.center[0]) + np.stack([-half, half])


def exact(maps: RadianceMaps, x: np.ndarray, around: int = 24, up: int = 16) -> np.ndarray:
    """Irradiance on the floor of the box scenes, by quadrature that is cut where anything breaks.

    `E = int dphi 1/2 int L d(sin^2 e)` over azimuth and elevation e. Azimuths are cut at the
    corners of the wall and of the block. At each, elevations from 0 up to the block's top edge see
    the block's nearest side, those above it the wall. Gauss-Legendre nodes in `asinh(tan psi)`, psi
    from the normal of what is seen, and in `asinh(tan e)`: smooth however near the wall is.

    Args:
        maps: the light, bilinear between cells' centres here.
        x: places outside of the block (m, 2) [m].
        around: nodes in azimuth, for each piece.
        up: nodes in elevation.
    """
    plan, scene = face_layout(maps.scene), maps.scene
    L = np.asarray(maps.L, float)
    block = block_of(scene) if "block" in scene.names else None
    corners = [(0.0, 0.0), (0.0, 1.0)]
    if block is not None:
        corners += [(a, b) for a in block[:, 0] for b in block[:, 1]]
    way = np.asarray(corners)[None] - x[:, None]
    cut = np.sort(np.mod(np.arctan2(way[..., 1], way[..., 0]), 2.0 * np.pi), axis=1)
    cut = np.concatenate([cut, cut[:, :1] + 2.0 * np.pi], axis=1)
    wall = L[int(np.flatnonzero(plan.shape == scene.named("left")[0])[0])]
    E = np.zeros(len(x))
    for k in range(cut.shape[1] - 1):
        low, high = cut[:, k], cut[:, k + 1]
        middle = 0.5 * (low + high)
        c, s = np.cos(middle), np.sin(middle)
        with np.errstate(divide="ignore", invalid="ignore"):
            beyond = x[:, 1] - x[:, 0] / c * s
        sees_wall = (c < 0.0) & (beyond > 0.0) & (beyond < 1.0)
        rows = np.flatnonzero(sees_wall & (high - low > 1e-14))
        E[rows] += _piece(x[rows], low[rows], high[rows], 0, 0.0, None, wall, block, around, up)
        if block is not None:
            first = int(np.flatnonzero(plan.shape == scene.named("block")[0])[0])
            near, axis, side = _entered(x, c, s, block)
            for a in (0, 1):
                for b in (0, 1):
                    here = np.isfinite(near) & (axis == a) & (side == b) & (high - low > 1e-14)
                    rows = np.flatnonzero(here)
                    args = x[rows], low[rows], high[rows], a, block[b, a], block[:, 1 - a]
                    E[rows] += _piece(*args, L[first + 2 * a + b], block, around, up)
    return E


def _entered(x, c, s, block):
    """Distance along the floor at which a ray enters the block, infinite if not, and which side."""
    with np.errstate(divide="ignore", invalid="ignore"):
        t = [(block[:, i] - x[..., i, None]) / d[..., None] for i, d in enumerate((c, s))]
    near, far = (np.stack([f(a, axis=-1) for a in t], -1) for f in (np.min, np.max))
    axis = np.argmax(near, axis=-1)
    enter = np.max(near, axis=-1)
    hit = (enter < np.min(far, axis=-1)) & (enter > 0.0)
    side = np.where(np.where(axis == 0, c, s) > 0.0, 0, 1)
    return np.where(hit, enter, np.inf), axis, side


def _piece(x, low, high, axis, plane, span, L, block, around, up):
    """Light from one upright plane between two azimuths.

    With a span along it, it is a side of the block; without, the wall, above the block's edge.
    """
    if not len(x):
        return np.zeros(0)
    away = plane - x[:, axis]
    normal = np.where(away > 0.0, 0.0, np.pi) + (0.5 * np.pi if axis else 0.0)
    turn = np.round((0.5 * (low + high) - normal) / (2.0 * np.pi)) * 2.0 * np.pi + normal
    ends = [np.arcsinh(np.tan(np.clip(a - turn, -1.5707963, 1.5707963))) for a in (low, high)]
    t, w = np.polynomial.legendre.leggauss(around)
    tau = 0.5 * (ends[0] + ends[1])[:, None] + 0.5 * (ends[1] - ends[0])[:, None] * t
    weight = 0.5 * (ends[1] - ends[0])[:, None] * w / np.cosh(tau)
    flat = np.abs(away)[:, None] * np.cosh(tau)
    phi = turn[:, None] + np.arctan(np.sinh(tau))
    where = x[:, None] + flat[..., None] * np.stack([np.cos(phi), np.sin(phi)], -1)
    bottom, top = np.zeros_like(flat), 1.0 if span is None else block[1, 2]
    if span is None and block is not None:
        near, *_ = _entered(x[:, None] + 0.0 * where, np.cos(phi), np.sin(phi), block)
        bottom = block[1, 2] / near
    a, b = np.arcsinh(bottom), np.arcsinh(top / flat)
    t, w = np.polynomial.legendre.leggauss(up)
    mu = 0.5 * (a + b)[..., None] + 0.5 * np.maximum(b - a, 0.0)[..., None] * t
    inner = np.maximum(b - a, 0.0)[..., None] * w * np.tanh(mu) / np.cosh(mu) ** 2
    z = 2.0 * flat[..., None] * np.sinh(mu) / top - 1.0
    other = where[..., 1 - axis]
    if span is None:
        light = _bilinear(L, 2.0 * other - 1.0, z)
    else:
        across = 2.0 * (other - span[0]) / (span[1] - span[0]) - 1.0
        light = _bilinear(L, across, z) if axis == 0 else _bilinear(L.T, across, z)
    return np.sum(weight * np.sum(0.5 * inner * light, axis=-1), axis=-1)


def _bilinear(L, across, z):
    """Between the centres of cells; `across` runs along columns, z along rows."""
    k = L.shape[0]
    u, v = (0.5 * (a + 1.0) * k - 0.5 for a in np.broadcast_arrays(across[..., None], z))
    i, j = (np.clip(np.floor(a), 0, k - 2).astype(int) for a in (u, v))
    a, b = u - i, v - j
    low, high = (L[j + d, i] * (1.0 - a) + L[j + d, i + 1] * a for d in (0, 1))
    return (1.0 - b) * low + b * high


# --- regions -------------------------------------------------------------------------------------


def floor_limits(pixels: int, low: float = 1.0, high: float = 1.5) -> Limits:
    """Smallest radius in cells, and largest [m]."""
    return Limits(low / pixels, high, 2)


def ellipse(H: np.ndarray, within: Limits, printed: bool = False) -> Regions:
    """Ellipses along the eigenvectors."""
    return lambda tolerance: elliptic_regions(
        np.asarray(H), tolerance, within.low, within.high, printed=printed
    )


def metrics(c: Case) -> dict[str, Regions]:
    """The radii that J12 compares."""
    within, table = floor_limits(c.size.pixels), c.table
    return {
        "minimum": split(table.minimum, within),
        "harmonic": split(table.harmonic, within),
        "radiometric": pointwise(table.hessian, within),
        "geometric": pointwise(table.geometric, within),
    }


# --- comparison ----------------------------------------------------------------------------------


def asked(c: Case) -> Asked:
    """All cells of the floor, the same number in all scenes; those that are open count."""
    return Asked(places(c.size.pixels), c.truth, c.open)


def compare(
    c: Case, methods: dict[str, Regions], records: int | None = None, order: int = 1
) -> dict[str, Outcome]:
    """Caches of every method at equal numbers of records, in the same orders of insertion."""
    count, orders = records or c.size.records, dict.fromkeys(methods, order)
    return caching.compare(c.table.candidates(), methods, asked(c), c.size.orders, count, orders)


def similar(c: Case, outcome: Outcome) -> float:
    """Structural similarity of the image of the floor to the true one, mean over the orders."""
    span, truth = float(np.max(c.truth)), np.nan_to_num(c.image(c.truth))
    images = (np.nan_to_num(c.image(v)) for v in outcome.values)
    return float(np.mean([ssim(image, truth, span) for image in images]))


@dataclass(frozen=True)
class Tuned:
    """The best of several limits, and its caches.

    Attributes:
        limits: smallest radius in cells, and largest [m].
        outcome: with these.
        least: error of the first limits over that of the best.
    """

    limits: tuple[float, float]
    outcome: Outcome
    least: float


def tuned(c: Case, lengths: np.ndarray, limits, records: int | None = None) -> Tuned:
    """Split spheres with the limits that leave the least error; what has too few records is out.

    Args:
        c: the case.
        lengths: mean length of rays at each place.
        limits: pairs of the smallest radius in cells and the largest [m], to try.
        records: wanted; as many as the case asks for if left out.
    """
    tried = {}
    for low, high in limits:
        try:
            regions = split(lengths, floor_limits(c.size.pixels, low, high))
            tried[low, high] = compare(c, {"x": regions}, records)["x"]
        except ValueError:  # these limits allow no such number of records
            continue
    if not tried:
        raise ValueError("No limits gave the wanted number of records.")
    best = min(tried, key=lambda k: tried[k].mean)
    return Tuned(best, tried[best], next(iter(tried.values())).mean / tried[best].mean)


# --- pictures ------------------------------------------------------------------------------------

EXTENT = (0.0, 1.0, 0.0, 1.0)


def show_error(ax, c: Case, outcome: Outcome, most: float, title: str, dots: bool = True):
    """The error over the floor, signed, with the records of the first order of insertion."""
    image = c.image(outcome.values[0] - c.truth)
    drawn = ax.imshow(image, cmap="RdBu_r", vmin=-most, vmax=most, extent=EXTENT)
    if dots:
        x = np.asarray(outcome.cache(0).records.position)
        ax.plot(x[:, 0], x[:, 1], ".", color=COLOURS[0], markersize=1.8, markeredgewidth=0.0)
    ax.set(xticks=[], yticks=[], xlim=(0, 1), ylim=(0, 1))
    ax.set_title(title, fontsize=8)
    ax.set_xlabel(f"RMS {outcome.mean:.2e} ± {outcome.spread:.0e}", fontsize=7.5)
    return drawn


def show_light(ax, c: Case, title: str):
    """The true irradiance of the floor."""
    drawn = ax.imshow(c.image(c.truth), cmap="magma", vmin=0.0, extent=EXTENT)
    ax.set(xticks=[], yticks=[])
    ax.set_title(title, fontsize=8)
    ax.set_xlabel(f"max {np.max(c.truth):.3g} W/m²", fontsize=7.5)
    return drawn
