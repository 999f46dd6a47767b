"""E11 Fig. 8: the steps of the algorithm, on the scene of Fig. 13.

The paper's models cannot be had; the scene is ours (`e11.shared.space.gathering`). One shared ray a
pixel, light band limit 1 wavelength per side of the lamp, filters as wide as 3 standard deviations.
(a) and (b) show one of the two subspaces, along the lamp's first edge; in (b) are the rays that the
filter of the marked pixel reaches in the other one. The paper stores a ray as five numbers, its
last one the depth of what hides it; ours have two depths, of the first and of the last blocker,
from which bounds of depths come, and that of their start. Whether five are enough is asked with 20
seeds, on every third pixel both ways: without the others the last blocker is the first, and all
rays start below all receivers.

What the map says at marked pixels is what a plain sum over all rays gives, written here once more.
"""

from __future__ import annotations

import numpy as np

from figures.e11.shared import compared, space
from figures.spread import spread
from figures.style import Drawing
from figures.verdicts import OURS, Measurement, Statement, at_most
from firstorder import plotting
from firstorder.shadowfield.rendering._filter_shape import filter_shape
from firstorder.shadowfield.rendering.ray_table import trace_shadow_rays
from firstorder.shadowfield.rendering.sheared_filter import sheared_shadow

BAND = 1.0
REACH = 3.0
CELLS = 4
LEVEL = 0.02  # depths that differ by this share of the receiver's are one
INK = {"hidden": "0.15", "free": "#e0a526", "filter": "#2563eb"}


def draw(quick: bool) -> Drawing:
    side = space.QUICK_SIDE if quick else space.SIDE
    scene = space.gathering(side, *((1000, 100) if quick else ()))
    found = compared.shared(scene, 1.0, BAND, own=(16, 16))
    lamp, table = scene.lamp, found.table
    depth = lamp.local(scene.receivers)
    near, far = found.near.ravel(), found.far.ravel()
    Omega_y = 0.5 * BAND / float(np.max(lamp.half))
    floor = np.flatnonzero(scene.floor)
    shape = filter_shape(
        depth[floor, 2], near[floor], far[floor], Omega_y, scene.pixel, float(np.max(lamp.half))
    )
    sigma, shear = (scene.picture(a, floor) for a in (shape.sigma, shape.shear))

    marked = _marked(found, side)
    sums = [_plain_sum(scene, table, depth[k], sigma.flat[k], shear.flat[k]) for k in marked]
    off = max(abs(found.visible.flat[k] - s) for k, s in zip(marked, sums, strict=True))

    figure, axes = plotting.panels(2, 4, 3.0, 3.0)
    k = marked[len(marked) // 2]
    _rays(axes[0, 0], lamp, table)
    _filter(axes[0, 1], lamp, table, depth[k], sigma.flat[k], shear.flat[k])
    d1 = np.where(scene.floor, depth[:, 2], np.nan).reshape(side, side)
    maps = (
        (axes[0, 2], d1, "c) receiver's depth $d_1$"),
        (axes[0, 3], _known(found.near), "d) first blocker's $d_2$"),
        (axes[1, 0], _known(found.far), "e) last blocker's $d_2$"),
        (axes[1, 1], _known(sigma) / scene.pixel, "f) filter, in pixels"),
        (axes[1, 2], _known(np.where(found.samples > 0, found.samples, np.nan)), "g) rays in it"),
    )
    for ax, image, title in maps:
        figure.colorbar(space.show(ax, image, title, cmap="viridis"), ax=ax, shrink=0.75)
    space.show(axes[1, 3], found.visible, "h) the shadow", cmap="gray", vmin=0.0, vmax=1.0)
    for ax in (axes[0, 2], axes[1, 1], axes[1, 3]):
        ax.plot(*np.divmod(k, side), "o", color=INK["filter"], markerfacecolor="none")

    arrays = {
        "visible": found.visible,
        "d1": d1,
        "near": found.near,
        "far": found.far,
        "sigma": sigma,
        "shear": shear,
        "samples": found.samples,
        "marked": np.array(marked),
    }
    size = f"{side} x {side} pixels, {scene.triangles} triangles"
    return Drawing(
        figure,
        arrays,
        _claims(found, sigma / scene.pixel, off, _five(scene, 3 if quick else 20)),
        {},
        size,
        0,
    )


def _five(scene: space.Scene, seeds: int) -> np.ndarray:
    """RMS errors of each seed with rays of five numbers and with all of ours."""
    some = scene.floor & scene.every(3)
    true = space.own_rays(scene, some, 512, 17)
    points, limit = scene.receivers[some], 0.5 * BAND / float(np.max(scene.lamp.half))
    own = space.own_rays(scene, some, 16, 18)
    errors = []
    for seed in range(1, seeds + 1):
        ours = trace_shadow_rays(scene.lamp, scene.receivers[scene.floor], 1, scene.blockers, seed)[
            0
        ]
        far = np.where(ours.free, ours.far, ours.near).astype(ours.far.dtype)
        five = ours._replace(far=far, start=np.full_like(ours.start, np.inf))
        found = [
            sheared_shadow(
                scene.lamp, table, points, limit, scene.pixel, own, falloff=space.falloff
            ).visible
            for table in (five, ours)
        ]
        errors.append([np.sqrt(np.mean((a - true) ** 2)) for a in found])
    return np.array(errors)


def _claims(found, pixels: np.ndarray, off: float, errors) -> list[Statement | Measurement]:
    """Of a table, of widths of its filters in pixels, and of how far the map is off plain sums."""
    table = found.table
    low, high = np.nanpercentile(_known(pixels), [5.0, 95.0])
    ratio, error = spread(errors[:, 0] / errors[:, 1])
    five = sum(np.asarray(a).nbytes for a in (table.y, table.v, table.near)) / len(table.near)
    return [
        Statement(
            "A ray is (v1, v2, y1, y2) in 32 bits each and one distance: RMS error of the "
            "shadow by "
            "these alone, over that with the last blocker and the start besides",
            "consists of",
            ratio,
            at_most(1.05, "enough: within a twentieth of the error"),
            "E11 §5",
            "times",
            error,
            f"{len(errors)} seeds",
            "Without the last blocker's depth, bounds are too tight and filters too wide.",
        ),
        Statement("Memory for a ray of these five", 20, five, at_most(20.0, "five times 32 bits"),
                  "E11 §5", "bytes"),
        Measurement("Memory for a ray of ours",
                    sum(np.asarray(a).nbytes for a in table) / len(table.near), "bytes"),
        Measurement("Rays in the table", len(table.near)),
        Measurement("Filter's width, 5th and 95th percentile", f"{low:.3g} and {high:.3g}",
                    "pixels"),
        Measurement("Mean effective rays in a filter, where blockers are",
                    float(np.mean(found.samples[found.samples > 0.0])), "rays"),
        Statement(
            "The map is what plain sums over all rays give: largest difference at marked pixels",
            None,
            100.0 * off,
            at_most(0.1, "a ray at a cell's edge may be told to either side in single precision"),
            OURS,
            "% of light",
        ),
    ]  # fmt: skip


def _known(image: np.ndarray) -> np.ndarray:
    """Without what is not finite."""
    return np.where(np.isfinite(image), image, np.nan)


def _marked(found: compared.Shared, side: int) -> list[int]:
    """Pixels of the penumbra with rays in common, from those of most to those of fewest."""
    good = (found.own == 0.0) & (abs(found.visible - 0.5) < 0.3) & (found.samples > 0.0)
    k = np.flatnonzero(good)
    k = k[np.argsort(-found.samples.ravel()[k], kind="stable")]
    return k[:: max(len(k) // 8, 1)][:8].tolist()


def _plain_sum(scene: space.Scene, table, at: np.ndarray, sigma: float, shear: float) -> float:
    """Visibility at a receiver, ray by ray."""
    y, v = table.y.astype(float), table.v.astype(float)
    delta = at[:2] - (y + v * at[2])
    w = np.exp(-0.5 * np.sum(delta**2, 1) / sigma**2)
    place = (y - shear * delta) / scene.lamp.half
    counts = (np.sum(delta**2, 1) <= (REACH * sigma) ** 2) & np.all(abs(place) <= 1.0, 1)
    level = np.float32((1.0 - LEVEL) * at[2])
    counts &= table.start >= level
    free = table.near >= level
    total, light = 0.0, 0.0
    everywhere = np.sum(w[counts & free]) / np.sum(w[counts])
    fine = (np.arange(8 * CELLS) + 0.5) / (4 * CELLS) - 1.0
    bright = space.falloff(np.stack(np.meshgrid(fine, fine, indexing="ij"), -1))
    for i, j in np.ndindex(CELLS, CELLS):
        share = bright[8 * i : 8 * i + 8, 8 * j : 8 * j + 8].sum()
        low = 2.0 * np.array([i, j]) / CELLS - 1.0
        some = counts & np.all((place >= low) & (place < low + 2.0 / CELLS), 1)
        mass = np.sum(w[some])
        seen = np.sum(w[some & free]) / mass if mass > 0.0 else everywhere
        total, light = total + share * seen, light + share
    return float(total / light)


def _rays(ax, lamp, table) -> None:
    """Some rays from the side, along the lamp's first edge."""
    rng = np.random.default_rng(0)
    for free in (True, False):
        some = rng.permutation(np.flatnonzero(table.free == free))[:120]
        end = np.where(free, np.max(table.far[np.isfinite(table.far)]), table.near[some])
        x = table.y[some, 0] + table.v[some, 0] * end
        color = INK["free" if free else "hidden"]
        ax.plot([table.y[some, 0], x], [np.zeros_like(end), end], "-", color=color, linewidth=0.4)
        if not free:
            ax.plot(x, end, ".", color=color, markersize=3)
    ax.plot([-lamp.half[0], lamp.half[0]], [0.0, 0.0], "-", color=INK["filter"], linewidth=4)
    ax.invert_yaxis()
    ax.set(title="a) shadow rays", xlabel="along the lamp [m]", ylabel="depth [m]")


def _filter(ax, lamp, table, at: np.ndarray, sigma: float, shear: float) -> None:
    """Rays over (v, y) and the filter of one receiver among them."""
    beside = abs(at[1] - (table.y[:, 1] + table.v[:, 1] * at[2])) < REACH * sigma
    along = abs(at[0] - (table.y[:, 0] + table.v[:, 0] * at[2])) < 12.0 * sigma
    for free in (True, False):
        some = beside & along & (table.free == free)
        name = "free" if free else "hidden"
        ax.plot(table.v[some, 0], table.y[some, 0], ".", color=INK[name], markersize=2, label=name)
    d = REACH * sigma * np.array([1.0, 1.0, -1.0, -1.0, 1.0])
    y = lamp.half[0] * np.array([-1.0, 1.0, 1.0, -1.0, -1.0]) + shear * d
    ax.plot((at[0] - d - y) / at[2], y, "-", color=INK["filter"], label="filter")
    ax.set(title="b) rays and a filter", xlabel="$v_1$", ylabel="$y_1$ [m]")
    ax.set_ylim(-1.15 * lamp.half[0], 1.15 * lamp.half[0])
    ax.legend(loc="upper right", markerscale=4)
