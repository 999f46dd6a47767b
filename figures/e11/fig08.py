"""E11 Fig. 8: the steps of the algorithm, on the scene of Fig. 13.

The paper's models cannot be had; the scene is ours (`e11.shared.space.gathering`). One shared ray a
pixel, light band limit 1 wavelength per side of the lamp, filters as wide as 3 standard deviations.
(a) and (b) show one of the two subspaces, along the lamp's first edge; in (b) are the rays that the
filter of the marked pixel reaches in the other one. The paper stores rays that were hidden with one
depth; ours have two, of the first and of the last blocker, from which bounds of depths come, and
that of their start.

The claim that is checked: what the map says at marked pixels is what a plain sum over all rays
gives, written here once more.
"""

from __future__ import annotations

import numpy as np

from figures.e11.shared import compared, space
from figures.style import Claim, Drawing
from firstorder import plotting
from firstorder.shadowfield.rendering._filter_shape import filter_shape

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
    return Drawing(figure, arrays, _claims(found, sigma / scene.pixel, off), {}, size, 0)


def _claims(found: compared.Shared, pixels: np.ndarray, off: float) -> list[Claim]:
    """Of a table, of widths of its filters in pixels, and of how far the map is off plain sums."""
    table = found.table
    low, high = np.nanpercentile(_known(pixels), [5.0, 95.0])
    return [
        Claim("Rays in the table", None, len(table.near)),
        Claim("Memory for a ray", 20, sum(np.asarray(a).nbytes for a in table) / len(table.near)),
        Claim(
            "Filter's width, 5th and 95th percentile", None, f"{low:.3g} and {high:.3g}", "pixels"
        ),
        Claim(
            "Mean effective rays in a filter, where blockers are",
            None,
            float(np.mean(found.samples[found.samples > 0.0])),
            "rays",
        ),
        Claim(
            "Largest difference of the map from plain sums at marked pixels",
            None,
            100.0 * off,
            "% of light",
            off < 1e-3,  # a ray at a cell's edge may be told to either side in single precision
        ),
    ]


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
