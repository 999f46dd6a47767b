"""Why autodiff fails on shadows: three ways to ask how irradiance changes along a floor.

Our own figure, to open with. A lamp 1.2 m wide (radiance 1, 1 m above the floor) shines past a box
and a disc on a floor from x = -1 m to 1 m.

*Sampled visibility*: E is a sum over rays at fixed angles, each blocked or not. It is piecewise
constant in x, so its derivative is zero wherever it exists, and automatic differentiation says so.
With fixed points on the lamp instead of fixed angles, autodiff sees the lamp's own falloff, but
shadows that stand still: the interior part of the derivative without the boundary part.
*Finite differences* of the same sums divide their steps by the distance: noise at small
distances, blur at large ones, and nothing good between.
*Exact visibility*: the angles at which blockers begin and end are differentiable functions of the
receiver, and so E is; autodiff through them holds both parts. It is judged by differences, in 50
digits, of a closed form that casts shadows on the lamp's line and knows no angles.

Finite differences are central, over neighbours of 513 pixels; both sides see the same rays, which
is the kindest way. Errors are rms over the floor, relative to the rms of the true derivative; box
and disc are also moved along the floor by up to 0.35 m, and the errors of wrong ways found again.
"""

from __future__ import annotations

import functools

import jax
import jax.numpy as jnp
import mpmath as mp
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle, Polygon

from figures.spread import rms, spread
from figures.style import Drawing
from figures.verdicts import OURS, Statement, at_least, at_most
from firstorder import plotting
from firstorder.flatland import (
    Circles,
    Receiver,
    Scene,
    Segments,
    box,
    derivatives,
    irradiance,
    nearest,
    primitive,
)

LAMP, HEIGHT = (-0.6, 0.6), 1.0
BOX = ((0.12, 0.34), (0.42, 0.5))
DISC = ((-0.32, 0.48), 0.13)
PIXELS, RAYS = 513, 256
TICKS = (-1.0, -0.5, 0.0, 0.5, 1.0)
INK, RED, BLUE, GOLD = "#1b1b1b", "#c2410c", "#2563eb", "#e0a526"


def _scene(shift=(0.0, 0.0)) -> Scene:
    """Lamp, box and disc, these two shifted along the floor."""
    lamp = Segments((LAMP[1], HEIGHT), (LAMP[0], HEIGHT))
    low, high = (jnp.stack([x + shift[0], 1.0 * y]) for x, y in jnp.asarray(BOX))
    middle = jnp.stack([DISC[0][0] + shift[1], jnp.asarray(DISC[0][1])])
    blockers = primitive(box(low, high)), primitive(Circles(middle, DISC[1]))
    return Scene.of(primitive(lamp, emission=1.0), *blockers)


def _receiver(x) -> Receiver:
    return Receiver(jnp.stack([x, 0.0 * x]), 0.0 * x)


def _jet(x, scene: Scene):
    """E, E', E'' with the edges' angles differentiated."""
    d = derivatives(lambda at: irradiance(scene, at), _receiver(x), freedoms=("x",))
    return d.value, d.first, d.second


@jax.jit
@jax.vmap
def _exact(x):
    return _jet(x, _scene())


def by_angle(x, rays: int, scene: Scene | None = None):
    """E from rays at fixed angles: what a path tracer would return with a fixed seed."""
    theta = np.pi * ((np.arange(rays) + 0.5) / rays - 0.5)
    along = jnp.asarray(np.stack([-np.sin(theta), np.cos(theta)], -1))
    scene = _scene() if scene is None else scene
    origins = jnp.broadcast_to(jnp.stack([x, 0.0 * x]), along.shape)
    hits = nearest(scene, origins, along)
    L = jnp.where(hits.index >= 0, scene.material.emission[hits.index, 0], 0.0)
    return jnp.sum(L * np.cos(theta)) * np.pi / rays


def by_point(x, points: int, scene: Scene | None = None):
    """E from fixed points on the lamp, `sum V cos cos / r` each."""
    at = LAMP[0] + (LAMP[1] - LAMP[0]) * (np.arange(points) + 0.5) / points
    way = jnp.stack([at - x, jnp.full(points, HEIGHT)], -1)
    r = jnp.sqrt(jnp.sum(way**2, -1))
    origins = jnp.broadcast_to(jnp.stack([x, 0.0 * x]), way.shape)
    scene = _scene() if scene is None else scene
    seen = nearest(scene, origins, way / r[:, None]).index == 0  # the lamp itself
    each = jnp.where(seen, HEIGHT**2 / r**3, 0.0)
    return jnp.sum(each) * (LAMP[1] - LAMP[0]) / points


def draw(quick: bool) -> Drawing:
    fine, judged = (1001, 25) if quick else (8001, 121)
    dense = 1024 if quick else 8192
    x, pixel = np.linspace(-1.0, 1.0, fine), np.linspace(-1.0, 1.0, PIXELS)
    E, slope, bend = (np.asarray(a) for a in _exact(jnp.asarray(x)))
    at_pixel = np.asarray(_exact(jnp.asarray(pixel))[1])
    sampled, autodiff = _valued(by_angle, RAYS, pixel)
    _, still = _valued(by_point, RAYS, pixel)
    noisy = np.gradient(sampled, pixel)
    steps = np.logspace(-5, -0.5, 10 if quick else 19)
    errors = {n: _step_errors(n, steps, 41 if quick else 241) for n in (RAYS, dense)}
    truth = _judge(judged)

    figure = Figure(figsize=(11.0, 6.1), layout="constrained")
    top, bottom = figure.subfigures(2, 1, squeeze=False, height_ratios=(1.05, 1.0))[:, 0]
    scene_ax, light_ax, step_ax = top.subplots(1, 3, width_ratios=(1.35, 1.0, 0.95))
    _draw_scene(scene_ax, x, E)
    _draw_light(light_ax, x, E, pixel, sampled)
    _draw_steps(step_ax, steps, errors, truth, dense)
    panels = bottom.subplots(1, 3, sharey=True)
    _draw_slopes(panels, x, slope, pixel, (autodiff, still, noisy), truth)

    claims = _claims(autodiff, _layouts(steps, 3 if quick else 100), errors[dense], truth)
    arrays = {"x": x, "E": E, "first": slope, "second": bend, "steps": steps}
    arrays |= {
        "judged": truth["x"],
        "judged_first": truth["first"],
        "judged_second": truth["second"],
    }
    curves = {
        "exact": {"x": x, "E": E, "first": slope, "second": bend},
        "sampled": {
            "x": pixel, "E": sampled, "exact": at_pixel, "autodiff_by_angle": autodiff,
            "autodiff_by_point": still, "finite_differences": noisy,
        },
        "steps": {"step": steps, "few_rays": errors[RAYS], "many_rays": errors[dense]},
    }  # fmt: skip
    size = f"{PIXELS} pixels, {RAYS} and {dense} rays, {judged} places judged"
    return Drawing(figure, arrays, claims, curves, size)


# --- numbers -------------------------------------------------------------------------------------


def _valued(estimate, count: int, x) -> tuple[np.ndarray, np.ndarray]:
    """An estimate of E along the floor, and what autodiff makes of it."""
    both = jax.jit(lambda x: jax.lax.map(jax.value_and_grad(lambda t: estimate(t, count)), x))
    value, slope = both(jnp.asarray(x))
    return np.asarray(value), np.asarray(slope)


def _step_errors(rays: int, steps, receivers: int) -> np.ndarray:
    """Error of central differences of the sampled E, by step."""
    x = np.linspace(-0.95, 0.95, receivers)
    true = np.asarray(_exact(jnp.asarray(x))[1])
    E = jax.jit(lambda x: jax.lax.map(lambda t: by_angle(t, rays), x))
    found = []
    for h in steps:
        up, down = (np.asarray(E(jnp.asarray(x + s * h))) for s in (1, -1))
        found.append(rms((up - down) / (2 * h) - true) / rms(true))
    return np.array(found)


def _cast(x):
    """Shadows on the lamp's line, by similar triangles; for the disc, by its two tangents."""
    (x0, y0), (x1, y1) = BOX
    corners = [x + (p - x) * HEIGHT / q for p in (x0, x1) for q in (y0, y1)]
    (cx, cy), r = DISC
    w = (cx - x, mp.mpf(cy))
    D = mp.sqrt(w[0] ** 2 + w[1] ** 2 - mp.mpf(r) ** 2)
    ends = [x + HEIGHT * (D * w[0] + s * r * w[1]) / (D * w[1] - s * r * w[0]) for s in (1, -1)]
    return [(min(corners), max(corners)), (min(ends), max(ends))]


def closed(x):
    """E by hand: differences of sines over the visible pieces of the lamp."""
    pieces = [(mp.mpf(LAMP[0]), mp.mpf(LAMP[1]))]
    for low, high in _cast(x):
        cut = [(a, min(b, low)) for a, b in pieces] + [(max(a, high), b) for a, b in pieces]
        pieces = [(a, b) for a, b in cut if b > a]
    sine = lambda X: (X - x) / mp.sqrt((X - x) ** 2 + HEIGHT**2)  # noqa: E731
    return mp.fsum(sine(b) - sine(a) for a, b in pieces)


@functools.cache
def _judge(count: int) -> dict[str, np.ndarray]:
    """The exact route and differences of the closed form in 50 digits, side by side."""
    x = np.linspace(-0.97, 0.97, count)
    first, second = [], []
    with mp.workdps(50):
        h = mp.mpf(10) ** -15
        for t in x:
            low, middle, high = (closed(mp.mpf(float(t)) + k * h) for k in (-1, 0, 1))
            first.append(float((high - low) / (2 * h)))
            second.append(float((high - 2 * middle + low) / h**2))
    _, d, dd = (np.asarray(a) for a in _exact(jnp.asarray(x)))
    first, second = np.array(first), np.array(second)
    return {
        "x": x, "first": first, "second": second,
        "error": np.max(np.abs(d - first)) / np.max(np.abs(first)),
        "error_2": np.max(np.abs(dd - second)) / np.max(np.abs(second)),
    }  # fmt: skip


def _layouts(steps, count: int) -> np.ndarray:
    """Errors of wrong ways with blockers elsewhere: (lay-outs, 3), see `_wrong`."""
    shifts = np.random.default_rng(0).uniform(-0.35, 0.35, (count, 2))
    return np.array([_wrong(jnp.asarray(shift), jnp.asarray(steps)) for shift in shifts])


@jax.jit
def _wrong(shift, steps):
    """Relative errors: rays to fixed points, differences of next pixels, and by the best step."""
    scene = _scene(shift)

    def E(x):
        return jax.lax.map(lambda t: by_angle(t, RAYS, scene), x)

    def error(wrong, x):
        true = jax.vmap(lambda t: _jet(t, scene)[1])(x)
        return jnp.sqrt(jnp.mean((wrong - true) ** 2) / jnp.mean(true**2))

    pixel, x = jnp.linspace(-1.0, 1.0, PIXELS), jnp.linspace(-0.95, 0.95, 121)
    still = jax.lax.map(jax.grad(lambda t: by_point(t, RAYS, scene)), x)
    light = E(pixel)
    next_pixels = (light[2:] - light[:-2]) / (pixel[2:] - pixel[:-2])
    best = jax.lax.map(lambda h: error((E(x + h) - E(x - h)) / (2 * h), x), steps)
    return jnp.stack([error(still, x), error(next_pixels, pixel[1:-1]), jnp.min(best)])


def _claims(autodiff, found, many, truth) -> list[Statement]:
    scanned = f"{len(found)} lay-outs of box and disc"
    (still, still_error), (noise, noise_error), (best, best_error) = map(spread, found.T)
    exactly = at_most(1e-12, "rounding")
    return [
        Statement("Autodiff of visibility sampled by angle is zero everywhere: largest", None,
                  float(np.max(np.abs(autodiff))), at_most(0.0, "zero"), OURS, "W/m^2"),
        Statement("Autodiff of visibility sampled on the lamp, where shadows stand still, is off "
                  "by half the signal and more", None, still, at_least(0.5, "half"), OURS,
                  "of its rms", still_error, scanned),
        Statement("Finite differences over next pixels, 256 rays, are off by more than the signal",
                  None, noise, at_least(1.0, "the signal"), OURS, "of its rms", noise_error,
                  scanned),
        Statement("No step makes finite differences of 256 rays good to 10 %: error at the best "
                  "one", None, best, at_least(0.1, "10 %"), OURS, "of its rms", best_error,
                  scanned),
        Statement("With many times the rays the best step still gives no gradient to 1 %", None,
                  float(many.min()), at_least(0.01, "1 %"), OURS, "of its rms"),
        Statement("Autodiff of exact visibility gives E': error", None, float(truth["error"]),
                  exactly, OURS, "of the largest"),
        Statement("... and E''", None, float(truth["error_2"]), exactly, OURS, "of the largest"),
    ]  # fmt: skip


# --- picture -------------------------------------------------------------------------------------


def _draw_scene(ax: Axes, x, E) -> None:
    """The scene, the cone of one receiver's edges, and the floor in its own light."""
    plotting.map_axes(ax, "A lamp, two blockers, a floor, and what one point of it sees")
    at = -0.08
    for low, high in _cast(at):
        fan = [(at, 0.0), (float(low), HEIGHT), (float(high), HEIGHT)]
        ax.add_patch(Polygon(fan, facecolor="0.55", alpha=0.28, linewidth=0))
        for X in (low, high):
            ax.plot([at, float(X)], [0.0, HEIGHT], color=RED, linestyle="-", linewidth=0.9)
    ax.plot(LAMP, (HEIGHT, HEIGHT), color=GOLD, linestyle="-", linewidth=5, solid_capstyle="butt")
    (x0, y0), (x1, y1) = BOX
    ax.add_patch(Polygon([(x0, y0), (x0, y1), (x1, y1), (x1, y0)], facecolor=INK))
    ax.add_patch(Circle(*DISC, facecolor=INK))
    ax.imshow(
        E[None], extent=(-1.0, 1.0, -0.11, -0.01), cmap="gray", vmin=0.0, vmax=float(E.max()),
        aspect="auto", interpolation="bilinear", origin="lower",
    )  # fmt: skip
    ax.plot([-1, 1, 1, -1, -1], [-0.11, -0.11, -0.01, -0.01, -0.11], color=INK, lw=0.6, ls="-")
    ax.plot([at], [0.0], "o", color=RED, markersize=5)
    ax.annotate("edges move\nwith the point", (0.37, 0.66), fontsize=8, color=RED)
    ax.annotate("$E(x)$", (-1.0, 0.03), fontsize=9)
    ax.set(xlim=(-1.03, 1.03), ylim=(-0.13, 1.05), aspect="equal")


def _draw_light(ax: Axes, x, E, pixel, sampled) -> None:
    ax.plot(pixel, sampled, color=BLUE, linestyle="-", linewidth=0.9, label=f"{RAYS} rays")
    ax.plot(x, E, color=INK, linestyle="-", linewidth=1.6, label="exact")
    low, high = 0.05, 0.11
    close = np.linspace(low, high, 601)
    stairs = np.asarray(jax.jit(jax.vmap(lambda t: by_angle(t, RAYS)))(jnp.asarray(close)))
    zoom = ax.inset_axes((0.09, 0.09, 0.36, 0.4))
    zoom.plot(close, stairs, color=BLUE, linestyle="-", linewidth=1.1)
    inside = (x > low) & (x < high)
    zoom.plot(x[inside], E[inside], color=INK, linestyle="-", linewidth=1.3)
    zoom.set(xticks=(), yticks=(), xlim=(low, high))
    zoom.annotate("stairs", (0.08, 0.1), xycoords="axes fraction", fontsize=8, color=BLUE)
    ax.indicate_inset_zoom(zoom, edgecolor="0.4")
    ax.set_title("Irradiance looks fine either way", loc="left")
    ax.set(xlabel="$x$ (m)", ylabel="$E$ (W/m)", xlim=(-1, 1), ylim=(0.0, 0.68))
    ax.set_xticks(TICKS)
    ax.legend(loc="upper right", fontsize=7)


def _draw_slopes(axes, x, slope, pixel, wrong, truth) -> None:
    autodiff, still, noisy = wrong
    titles = (
        "Autodiff of sampled visibility: nothing moves",
        "Finite differences of it: noise",
        "Autodiff of exact visibility: right",
    )
    for ax, title in zip(axes, titles, strict=True):
        ax.set_title(title, loc="left")
        ax.set(xlabel="$x$ (m)", xlim=(-1, 1))
        ax.set_xticks(TICKS)
        ax.axhline(0.0, color="0.85", linewidth=0.6, linestyle="-", zorder=0)
    for ax in axes[:2]:
        ax.plot(x, slope, color="0.6", linestyle="-", linewidth=2.4, label="the truth", zorder=3)
    thin = {"linestyle": "-", "linewidth": 1.1}
    axes[0].plot(pixel, autodiff, color=RED, linestyle="-", label="rays by angle: zero", zorder=4)
    words = "points on the lamp: shadows stand still"
    axes[0].plot(pixel, still, color=BLUE, **thin, label=words, zorder=4)
    axes[1].plot(
        pixel, noisy, color=BLUE, linestyle="-", linewidth=0.5, label=f"{RAYS} rays, next pixels"
    )
    axes[2].plot(x, slope, color=INK, linestyle="-", linewidth=2.0, label="exact")
    places = {"color": RED, "markersize": 3.2, "markerfacecolor": "none", "linestyle": "none"}
    words = "closed form, differences in 50 digits"
    axes[2].plot(truth["x"][::2], truth["first"][::2], marker="o", **places, label=words, zorder=4)
    reach = float(np.max(np.abs(slope)))
    axes[0].set(ylabel="$E'$ (W/m$^2$)", ylim=(-1.85 * reach, 1.15 * reach))
    for ax in axes:
        ax.legend(loc="lower left", fontsize=7, frameon=True, facecolor="white", edgecolor="none",
                  framealpha=0.9)  # fmt: skip


def _draw_steps(ax: Axes, steps, errors, truth, dense) -> None:
    for (n, e), colour, dash in zip(errors.items(), (BLUE, "#0f766e"), ("-", "--"), strict=True):
        ax.loglog(steps, e, color=colour, linestyle=dash, label=f"differences, {n} rays")
    ax.axhline(1.0, color=RED, linestyle="-.", linewidth=1.2, label="autodiff of samples")
    ax.axhline(truth["error"], color=INK, linestyle="-", linewidth=1.6, label="autodiff, exact")
    ax.set_title("No step saves differences", loc="left")
    ax.set(xlabel="step (m)", ylabel="relative error of $E'$", ylim=(1e-17, 1e4))
    ax.legend(loc="center right", fontsize=7, bbox_to_anchor=(1.0, 0.45))
