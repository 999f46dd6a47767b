"""R07 Fig. 13: soft shadows of three spheres on a plane, interpolated from a 20 x 20 grid.

The paper prints no numbers. Open in it: every size. Here: `space.library._scenes.three_spheres`
(radii 0.5, 0.35 and 0.25 m; the first one rests on the plane), the square from -1.5 to 1.5 m, light
that falls off from its middle, 0.5 rad from the zenith, as a Gaussian of spread 0.35 rad. Values
and gradients are those of R07 §7.3 per azimuth, blocked intervals merged, the azimuth cut where a
sphere begins and ends. Errors are given as shares of the light that arrives where nothing stands;
one grey level of 8 bits is 1/255 of it.

"Equal stored numbers": three numbers a node against one, 35 x 35 nodes of values against 20 x 20 of
values and gradients. There gradients beat bilinear values, but not the best use of values alone: a
bicubic spline of 35 x 35 is three times as good (and takes three times as many receivers). "The
paper's quadratic Bezier curve" is `bezier`: half of the gradient in a bilinear mean. With the whole
gradient the error is that of bilinear interpolation with the other sign, and nothing is gained; the
paper's words ("gradient-extrapolated", Ward and Heckbert 1992) allow that reading too.

Costs are counted in rays, as the paper counts them: 100 x 100 at each node, and gradients for
nothing. "Per-pixel evaluation" is by jittered rays in cells of equal share. At the same rays a
pixel the ratio is that of pixels to nodes, 100 by construction. At equal rms it is lower, since a
pixel need not be as good as a node: that is the paper's own caveat ("often do not require very high
accuracy"), and what "cheap 8-bit renders" measure: pixels whose rms error is half a grey level.
"""

from __future__ import annotations

import jax
import numpy as np
from scipy.interpolate import RectBivariateSpline

from figures.r07.shared import spheres as shared
from figures.style import Claim, Drawing
from firstorder import plotting
from firstorder.reconstruction import GridInterpolant
from firstorder.space.library._scenes import three_spheres

HALF, NODES, STORED = 1.5, 20, 35
RAYS = 100 * 100  # of the paper, at each node
SHOWN = ("bilinear", "bicubic", "extrapolated", "bezier", "serendipity", "hermite")
GREY = 1.0 / 255.0


def draw(quick: bool) -> Drawing:
    scene, light = three_spheres(), shared.sun()
    balls = scene.groups[0]
    world = shared.Spheres(balls.center, balls.axes[:, 0, 0])
    pixels = 80 if quick else 200
    whole = float(shared.open_light(light))
    x = HALF * (2.0 * np.arange(pixels) + 1.0 - pixels) / pixels
    truth = _on(shared.values, world, light, x) / whole
    counts = np.array([20, 35] if quick else [10, 14, 20, 28, 35, 40, 56])
    grids = {int(n): _grid(world, light, int(n), whole) for n in counts}
    found = {scheme: {n: _interpolated(g, scheme, x) for n, g in grids.items()} for scheme in SHOWN}
    found["spline of values"] = {
        n: RectBivariateSpline(a, a, d[..., 0])(x, x) for n, (a, d) in grids.items()
    }
    rms = {
        scheme: np.array([_rms(f - truth) for f in each.values()]) for scheme, each in found.items()
    }
    sides = np.array([4, 8, 16, 32] if quick else [4, 8, 16, 32, 64])
    few = slice(1, None, 2) if quick else slice(1, None, 3)  # pixels enough for an rms
    noise = np.array(
        [_rms(_rays(world, light, x[few], int(s)) / whole - truth[few, few]) for s in sides]
    )

    figure, axes = plotting.panels(2, 4, 2.9, 2.75)
    _plan(axes[0, 0], world)
    image = {"cmap": plotting.RADIANCE, "vmin": 0.0, "vmax": 1.0}
    _show(axes[0, 1], truth, "b) every pixel", **image)
    _show(axes[0, 2], found["bilinear"][NODES], "c) bilinear, 20 x 20", **image)
    _show(axes[0, 3], found["hermite"][NODES], "d) with gradients, 20 x 20", **image)
    _costs(axes[1, 0], counts, rms)
    most = 0.06
    for ax, name, title in (
        (axes[1, 1], "extrapolated", "f) error: whole gradient"),
        (axes[1, 2], "bilinear", "g) error: bilinear"),
        (axes[1, 3], "hermite", "h) error: with gradients"),
    ):
        error = found[name][NODES] - truth
        shown = _show(ax, error, title, cmap=plotting.SIGNED, vmin=-most, vmax=most)
    figure.colorbar(shown, ax=axes[1, 1:], shrink=0.85, label="share of open light")

    at = int(np.flatnonzero(counts == NODES)[0])
    dense = int(np.flatnonzero(counts == STORED)[0])
    claims = [
        *_accuracy(world, light, whole),
        *_comparisons(rms, at, dense),
        *_cost_claims(rms["hermite"][at], sides, noise),
    ]
    arrays = {"x": x, "B": truth, **{name: each[NODES] for name, each in found.items()}}
    columns = {"nodes": counts, **rms}
    curves = {"errors": columns, "rays": {"rays": sides**2, "rms": noise}}
    size = f"{pixels} x {pixels} pixels, {', '.join(map(str, counts))} nodes across"
    return Drawing(figure, arrays, claims, curves, size, 0)


# --- numbers -------------------------------------------------------------------------------------


def _places(x) -> np.ndarray:
    return np.stack(np.meshgrid(x, x, indexing="ij"), -1).reshape(-1, 2)


def _on(function, world, light, x) -> np.ndarray:
    return function(world, light, _places(x)).reshape(len(x), len(x))


def _grid(world, light, n: int, whole: float):
    a = np.linspace(-HALF, HALF, n)
    E, dE = shared.with_gradients(world, light, _places(a))
    data = np.concatenate([E[:, None], dE], -1) / whole
    return a, data.reshape(n, n, 3)


def _interpolated(grid, scheme: str, x) -> np.ndarray:
    a, data = grid
    across, up = np.meshgrid(x, x, indexing="ij")
    return np.asarray(jax.jit(GridInterpolant(a, a, data, scheme).__call__)(across, up))


def _rays(world, light, x, side: int) -> np.ndarray:
    found = shared.by_rays(world, light, _places(x), side, jax.random.key(0))
    return found.reshape(len(x), len(x))


def _rms(a) -> float:
    return float(np.sqrt(np.mean(np.square(a))))


# --- panels --------------------------------------------------------------------------------------


def _plan(ax, world) -> None:
    """From above: spheres, the grid, and where the light comes from."""
    plotting.map_axes(ax, "a) spheres and grid")
    a = np.linspace(-HALF, HALF, NODES)
    across, up = np.meshgrid(a, a)
    ax.plot(across.ravel(), up.ravel(), ".", color="0.6", markersize=1.5)
    turn = np.linspace(0.0, 2.0 * np.pi, 90)
    for c, r in zip(np.asarray(world.center), np.asarray(world.radius), strict=True):
        ax.fill(c[0] + r * np.cos(turn), c[1] + r * np.sin(turn), color="0.35", linewidth=0)
        ax.text(c[0], c[1], f"$z={c[2]:.2f}$", color="w", ha="center", va="center", fontsize=6)
    toward = np.array([np.cos(0.8), np.sin(0.8)])
    ax.annotate("", 1.35 * toward, 1.85 * toward,
                arrowprops={"arrowstyle": "->", "color": "#e0a526", "linewidth": 2})  # fmt: skip
    ax.set(xlim=(-HALF, HALF), ylim=(-HALF, HALF), xlabel="$x$ (m)", ylabel="$y$ (m)")


def _show(ax, a, title: str, **options):
    shown = ax.imshow(a.T, origin="lower", extent=(-HALF, HALF, -HALF, HALF), **options)
    ax.set_title(title, loc="left")
    ax.set(xticks=[], yticks=[])
    ax.grid(False)
    return shown


def _costs(ax, counts, rms) -> None:
    for name in ("bilinear", "extrapolated", "bicubic", "spline of values", "bezier", "hermite"):
        ax.loglog(counts, rms[name], label=name)
    ax.axhline(GREY / np.sqrt(12.0), color="0.7", linewidth=0.8, linestyle="--")
    ax.set_title("e) error over nodes across", loc="left")
    ax.set(xlabel="nodes across", ylabel="rms (open light)")
    ax.set_xticks(counts, [str(c) for c in counts])
    ax.minorticks_off()
    ax.legend(fontsize=5.5, loc="lower left")


# --- claims --------------------------------------------------------------------------------------


def _accuracy(world, light, whole: float) -> list[Claim]:
    """Nodes of the quadrature doubled, at places of no pattern."""
    rng = np.random.default_rng(0)
    x = rng.uniform(-HALF, HALF, (256, 2))
    E, dE = shared.with_gradients(world, light, x)
    fine = shared.with_gradients(world, light, x, 64, 16)
    off = [float(np.max(np.abs(a - b))) / whole for a, b in zip((E, dE), fine, strict=True)]
    return [
        Claim("Largest change of a value when nodes are doubled", None, off[0], "of open light"),
        Claim("Largest change of a gradient when nodes are doubled", None, off[1], "per m"),
    ]


def _comparisons(rms, at: int, dense: int) -> list[Claim]:
    best = rms["hermite"][at]
    told = [
        Claim(
            "Rms error of bilinear over that of gradient interpolation (bicubic Hermite), 20 x 20",
            "substantially lowers the error",
            float(rms["bilinear"][at] / best),
            "times",
            bool(rms["bilinear"][at] > 2.0 * best),
        ),
        Claim(
            "The same at equal stored numbers: bilinear of 35 x 35 values",
            None,
            float(rms["bilinear"][dense] / best),
            "times",
        ),
        Claim(
            "The same: bicubic spline of 35 x 35 values, the best use of values alone",
            None,
            float(rms["spline of values"][dense] / best),
            "times",
        ),
        Claim("Rms error of gradient interpolation, 20 x 20", None, float(best), "of open light"),
    ]
    for scheme, words in (
        ("bezier", "quadratic Bezier, the paper's choice"),
        ("extrapolated", "whole gradients in a bilinear mean"),
        ("serendipity", "from one cell alone"),
        ("spline of values", "bicubic spline of values"),
    ):
        ratio = float(rms["bilinear"][at] / rms[scheme][at])
        told.append(
            Claim(f"Rms error of bilinear over that of: {words}, 20 x 20", None, ratio, "times")
        )
    return told


def _cost_claims(best: float, sides, noise) -> list[Claim]:
    """Rays a pixel at equal rms, by the power law through the rays that were traced."""
    slope, level = np.polyfit(np.log(sides**2.0), np.log(noise), 1)

    def rays(rms: float) -> float:
        return float(np.exp((np.log(rms) - level) / slope))

    pixels = 100.0  # per node
    needed, grey = rays(best), rays(0.5 * GREY)
    return [
        Claim("Jittered rays per pixel for the same rms error", None, needed, "rays"),
        Claim(
            "Rays of per-pixel evaluation over those of gradient interpolation at equal rms, "
            "10,000 at a node",
            "10 to 100",
            pixels * needed / RAYS,
            "times",
            bool(10.0 <= pixels * needed / RAYS <= 100.0),
        ),
        Claim(
            "The same with as many rays at a node as at a pixel",
            "10 to 100",
            pixels,
            "times",
        ),
        Claim("Rays per pixel for an rms error of half a grey level of 8 bits", None, grey, "rays"),
        Claim(
            "Cheap 8-bit render over gradient interpolation, 10,000 rays at a node",
            "still likely to lead to a speedup",
            pixels * grey / RAYS,
            "times",
            bool(pixels * grey / RAYS > 1.0),
        ),
        Claim("Order of the rays' error in their number", None, float(slope), ""),
    ]
