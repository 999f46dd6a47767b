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
paper's words ("gradient-extrapolated", Ward and Heckbert 1992) allow that reading too. What
gradients gain is judged over rooms (`r07.shared.spheres.rooms`), by geometric means;
"substantially" is taken for half the error.

Costs are counted in rays, as the paper counts them: 100 x 100 at each node, and gradients for
nothing; and in time, with gradients and interpolation. "Per-pixel evaluation" is by jittered rays
in cells of equal share, and where rays are compared at equal rms so are the values at the nodes:
their noise is nearly as large as what interpolation leaves of exact ones. At the same rays a pixel
the ratio is that of pixels to nodes, 100 by construction, less what gradients and interpolation
take. At equal rms it is lower in rays, since a pixel need not be as good as a node: that is the
paper's own caveat ("often do not require very high accuracy"), and what "cheap 8-bit renders"
measure: pixels whose rms error is half a grey level. Rays are traced beyond what is needed, so that
nothing is extrapolated.
"""

from __future__ import annotations

import jax
import numpy as np
from scipy.interpolate import RectBivariateSpline

from figures import timing
from figures.r07.shared import spheres as shared
from figures.spread import Spread, geometric, rms, spread
from figures.style import Drawing
from figures.verdicts import Measurement, Statement, at_least, between
from firstorder import plotting
from firstorder.reconstruction import GridInterpolant
from firstorder.space.library._scenes import three_spheres

HALF, NODES, STORED = 1.5, 20, 35
RAYS = 100 * 100  # of the paper, at each node
SIDES = np.array([16, 32, 64, 112])  # of the squares of rays a pixel
SOURCE = "R07 §8.1, Fig. 13"
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
    off = {
        scheme: np.array([rms(f - truth) for f in each.values()]) for scheme, each in found.items()
    }
    sides, seeds = (SIDES[:3], 3) if quick else (SIDES, 20)
    some = x[len(x) // 32 :: len(x) // 16][:16]  # pixels enough for an rms
    known = _on(shared.values, world, light, some)
    noise = np.array([
        [rms((_rays(world, light, some, int(s), seed) - known) / whole) for s in sides]
        for seed in range(seeds)
    ])  # fmt: skip
    nodes = _traced_nodes(world, light, grids[NODES], whole, x, truth, seeds)
    count, small = (2, 32) if quick else (24, 60)
    scan = [_gains(*room, small) for room in shared.rooms(count)]

    figure, axes = plotting.panels(2, 4, 2.9, 2.75)
    _plan(axes[0, 0], world)
    image = {"cmap": plotting.RADIANCE, "vmin": 0.0, "vmax": 1.0}
    _show(axes[0, 1], truth, "b) every pixel", **image)
    _show(axes[0, 2], found["bilinear"][NODES], "c) bilinear, 20 x 20", **image)
    _show(axes[0, 3], found["hermite"][NODES], "d) with gradients, 20 x 20", **image)
    _costs(axes[1, 0], counts, off)
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
        *_comparisons(scan, f"{count} rooms"),
        *_cost_claims(nodes, sides, noise),
        _time_claim(world, light, grids[NODES], 2 if quick else 5),
        *_accuracy(world, light, whole),
        *_shown(off, at, dense),
    ]
    arrays = {"x": x, "B": truth, **{name: each[NODES] for name, each in found.items()}}
    columns = {"nodes": counts, **off}
    curves = {"errors": columns, "rays": {"rays": sides**2, "rms": np.mean(noise, 0)}}
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


def _rays(world, light, x, side: int, seed: int) -> np.ndarray:
    found = shared.by_rays(world, light, _places(x), side, jax.random.key(seed))
    return found.reshape(len(x), len(x))


def _traced_nodes(world, light, grid, whole: float, x, truth, seeds: int) -> np.ndarray:
    """Errors of interpolation, by seed, where the values at the nodes are of 100 x 100 rays."""
    a, exact = grid
    across, up = np.meshgrid(x, x, indexing="ij")
    put = jax.jit(lambda data: GridInterpolant(a, a, data, "hermite")(across, up))
    off = []
    for seed in range(seeds, 2 * seeds):  # others than those of the pixels
        E = _rays(world, light, a, round(RAYS**0.5), seed) / whole
        data = np.concatenate([E[..., None], exact[..., 1:]], -1)
        off.append(rms(np.asarray(put(data)) - truth))
    return np.array(off)


def _gains(world, light, pixels: int) -> dict[str, float]:
    """Of one room: error of bilinear interpolation over those that know gradients, 20 x 20."""
    x = HALF * (2.0 * np.arange(pixels) + 1.0 - pixels) / pixels
    truth = _on(shared.values, world, light, x)
    grid = _grid(world, light, NODES, 1.0)
    off = {s: rms(_interpolated(grid, s, x) - truth) for s in ("bilinear", "bezier", "hermite")}
    return {scheme: off["bilinear"] / error for scheme, error in off.items()}


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


def _accuracy(world, light, whole: float) -> list[Measurement]:
    """Nodes of the quadrature doubled, at places of no pattern."""
    rng = np.random.default_rng(0)
    x = rng.uniform(-HALF, HALF, (256, 2))
    E, dE = shared.with_gradients(world, light, x)
    fine = shared.with_gradients(world, light, x, 64, 16)
    off = [float(np.max(np.abs(a - b))) / whole for a, b in zip((E, dE), fine, strict=True)]
    return [
        Measurement("Largest change of a value when nodes are doubled", off[0], "of open light"),
        Measurement("Largest change of a gradient when nodes are doubled", off[1], "per m"),
    ]


def _comparisons(scan, scanned: str) -> list[Statement]:
    """Over rooms: geometric means with their standard errors."""
    told = []
    for scheme, words in (
        ("bezier", "quadratic Bezier, the paper's choice"),
        ("hermite", "bicubic Hermite"),
    ):
        got = geometric([room[scheme] for room in scan])
        told.append(
            Statement("Gradient interpolation substantially lowers the error from linear "
                      f"interpolation, 20 x 20: rms error of bilinear over that of {words}",
                      "substantially", got.mean, at_least(2.0, "'substantially': half the error"),
                      SOURCE, "times", got.error, scanned)
        )  # fmt: skip
    return told


def _shown(rms, at: int, dense: int) -> list[Measurement]:
    """Of the scene in the picture."""
    best, plain = rms["hermite"][at], rms["bilinear"][at]
    others = ("extrapolated", "bezier", "serendipity", "spline of values", "hermite")
    return [
        Measurement("The scene that is shown: rms error of gradient interpolation, 20 x 20", best,
                    "of open light"),
        Measurement("The scene that is shown: rms error of bilinear over that of others, 20 x 20",
                    ", ".join(f"{k} {plain / rms[k][at]:.1f}" for k in others), "times"),
        Measurement("At equal stored numbers, over gradient interpolation: bilinear of 35 x 35 "
                    "values, and their bicubic spline",
                    ", ".join(f"{rms[k][dense] / best:.2f}"
                              for k in ("bilinear", "spline of values")), "times"),
    ]  # fmt: skip


def _cost_claims(nodes, sides, noise) -> list[Statement | Measurement]:
    """Rays a pixel at equal rms, read off what was traced; both by seed."""
    counts = np.log(sides**2.0)

    def rays(rms) -> Spread:
        pairs = zip(np.broadcast_to(rms, len(noise)), noise, strict=True)
        needed = [np.interp(-np.log(r), -np.log(row), counts) for r, row in pairs]
        return geometric(np.exp(needed))

    pixels, scanned = 100.0, f"{len(noise)} seeds"  # pixels for each node
    needed, grey, own = rays(nodes), rays(0.5 * GREY), spread(nodes)
    slope = float(np.polyfit(counts, np.mean(np.log(noise), 0), 1)[0])
    share = pixels / RAYS
    return [
        Statement("One to two orders of magnitude more efficient than explicitly evaluating each "
                  "pixel: ratio of rays at equal rms error, 10,000 at a node", "10 to 100",
                  share * needed.mean, between(10.0, 100.0, "one to two orders of magnitude"),
                  SOURCE, "times", share * needed.error, scanned),
        Statement("Still likely to lead to a speedup over renders that need 8 bits only: the same "
                  "for pixels with an rms error of half a grey level", "speedup",
                  share * grey.mean, at_least(1.0, "'speedup'"), "R07 §8.2", "times",
                  share * grey.error, scanned),
        Measurement("Rms error of gradient interpolation, 20 x 20 nodes of 10,000 rays",
                    own.mean, "of open light", own.error),
        Measurement("Jittered rays per pixel for the same rms error", needed.mean, "rays",
                    needed.error),
        Measurement("Rays per pixel for an rms error of half a grey level of 8 bits", grey.mean,
                    "rays", grey.error),
        Measurement("Order of the rays' error in their number", slope),
    ]  # fmt: skip


def _time_claim(world, light, grid, rounds: int) -> Statement:
    """Pixels with 10,000 rays each, against nodes with as many, gradients and interpolation."""
    a, data = grid
    places = np.random.default_rng(1).uniform(-HALF, HALF, (256, 2))
    across, up = np.random.default_rng(2).uniform(-HALF, HALF, (2, 100 * len(places)))
    put, key, side = (
        jax.jit(GridInterpolant(a, a, data, "hermite").__call__),
        jax.random.key(0),
        100,
    )

    def explicit():
        return shared.by_rays(world, light, places, side, key)

    def interpolated():
        slopes = shared.with_gradients(world, light, places)
        return explicit(), slopes, put(across, up)

    got = timing.ratio(explicit, interpolated, rounds)
    return Statement(
        "The same in time, 10,000 rays at each pixel and at each node, gradients and "
        "interpolation included", "10 to 100", 100.0 * got.mean,
        between(10.0, 100.0, "one to two orders of magnitude"), SOURCE, "times",
        100.0 * got.error, f"{rounds} rounds in turns",
    )  # fmt: skip
