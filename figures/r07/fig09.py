"""R07 Fig. 9: a floor shadowed by a box and a circle; its gradient three ways; adaptive sampling.

The paper gives no numbers. The scene is `flatland.library._scenes.r07_fig09`: a floor 6 m wide, a
box of 0.9 m by 0.45 m and a circle of 0.35 m radius above it, a sky 0.5 rad wide about the zenith.
Numeric gradients are central differences over neighbouring pixels of 513. "The same at the scale of
the figure" is taken for an rms error below 1 % of the gradient's range, about a line's width.

The paper's "semi-analytic" gradients do not quite reach that at 256 rays as it describes them, from
the rays as they were traced: half a step in the edge's angle matters little, but the first hit
beside the edge of a circle, or on a wall seen edge-on, is at the wrong distance. With each edge
bisected and the tangent's length they are exact, but for receivers whose gap between the blockers
falls between two rays.

"Much more accurate" is taken for half the error. Gradient-driven sampling wins at 33 samples, by
less, and loses at 129: it spends samples on slopes that are steep and straight, which lines through
few samples follow as well. The second derivative, the error of those lines, is the right driver
(R07 section 9.3 says so).
"""

from __future__ import annotations

import jax.numpy as jnp
import numpy as np

from figures.r07.shared import shadows as shared
from figures.style import Claim, Drawing
from firstorder import plotting
from firstorder.flatland.library._scenes import r07_fig09

PIXELS, INITIAL, BUDGET, SHOWN = 513, 9, 129, 33
WIDTH = 0.01  # of a line, in units of the range that is plotted


def draw(quick: bool) -> Drawing:
    n = 1025 if quick else 8193
    scene = r07_fig09()
    floor = shared.Shadow(scene)
    x = np.linspace(-3.0, 3.0, n)
    E, exact, _ = (np.asarray(a) for a in shared.along(floor, jnp.asarray(x)))
    every = (n - 1) // (PIXELS - 1)
    pixel = x[::every]
    rays = {count: shared.traced(scene, pixel, count) for count in (256, 512)}
    lines = shared.samplings(floor, -3.0, 3.0, BUDGET, INITIAL)
    budgets = np.array([17, 33, 65, 129])  # at which halving makes an even grid
    errors = {
        name: np.array([_error(shared.one_of(lines, name), b, x, E) for b in budgets])
        for name in shared.DRIVERS
    }
    at_pixels = exact[::every]
    gradients = {f"numeric, {k} rays": np.gradient(r[0], pixel) for k, r in rays.items()}
    gradients |= {f"first hits, {k} rays": r[1] for k, r in rays.items()}
    gradients |= {f"bisected, {k} rays": r[2] for k, r in rays.items()}
    formula = shared.formula(scene, x)

    figure, axes = plotting.panels(2, 3, 3.5, 2.7)
    _scene(axes[0, 0])
    axes[0, 1].plot(x, E)
    axes[0, 1].set(title="b) shading", xlabel="$x$ (m)", ylabel="$E$ (W/m)")
    _gradients(axes[0, 2], x, exact, pixel, gradients)
    for ax, title in ((axes[1, 0], "d) 33 samples"), (axes[1, 1], "d) closeup")):
        _samples(ax, lines, x, E)
        ax.set(title=title, xlabel="$x$ (m)", ylabel="$E$ (W/m)")
    axes[1, 1].set(xlim=(-1.6, -0.1), ylim=(-0.03, 0.9))
    axes[1, 0].legend(fontsize=7, loc="lower right")
    for name in ("uniform", "numeric", "gradient", "second order"):
        axes[1, 2].loglog(budgets, errors[name], label=name)
    axes[1, 2].set(title="error of linear interpolation", xlabel="samples", ylabel="rms (W/m)")
    axes[1, 2].set_xticks(budgets, [str(b) for b in budgets])
    axes[1, 2].minorticks_off()
    axes[1, 2].legend(fontsize=7)

    claims = [*_gradient_claims(gradients, at_pixels, formula, exact, rays, pixel)]
    claims += _sampling_claims(budgets, errors)
    curves = {
        "shading": {"x": x, "E": E, "gradient": exact},
        "gradients": {"x": pixel, "exact": at_pixels, **gradients},
        "errors": {"samples": budgets, **errors},
        "adaptive": shared.cut(shared.one_of(lines, "gradient"), SHOWN).columns(),
    }
    arrays = {"x": x, "E": E, "gradient": exact}
    return Drawing(figure, arrays, claims, curves, f"{n} receivers, {PIXELS} pixels, 256 rays")


def _error(line, budget, x, E) -> float:
    return shared.rms(shared.curve(shared.cut(line, budget), x) - E)


# --- panels --------------------------------------------------------------------------------------


def _scene(ax) -> None:
    plotting.map_axes(ax, "a) scene")
    plotting.draw_surface(ax, [[-3.0, 0.0], [3.0, 0.0]], depth=0.12)
    (left, low), (right, high) = shared.CORNERS[0], shared.CORNERS[-1]
    ax.fill([left, right, right, left], [low, low, high, high], color="0.25", linewidth=0)
    turn = np.linspace(0.0, 2.0 * np.pi, 100)
    ax.fill(0.6 + 0.35 * np.cos(turn), 0.65 + 0.35 * np.sin(turn), color="0.25", linewidth=0)
    # The sky: arrows from the zenith's neighbourhood, as long as their light is strong.
    angles = np.linspace(-1.2, 1.2, 13)
    outer = np.stack([-np.sin(angles), np.cos(angles)], -1) * 2.6
    strength = 0.9 * np.exp(-0.5 * (angles / 0.5) ** 2)
    plotting.draw_rays(ax, outer, angles + np.pi, strength, arrows=True)
    ax.set(xlim=(-3.1, 3.1), ylim=(-0.3, 2.8))


def _gradients(ax, x, exact, pixel, gradients) -> None:
    ax.plot(pixel, gradients["numeric, 256 rays"], color=plotting.COLOURS[3], linestyle="-",
            linewidth=1.0, label="numeric, 256 rays")  # fmt: skip
    ax.plot(pixel, gradients["bisected, 256 rays"], color=plotting.COLOURS[1], linestyle="-",
            linewidth=1.9, label="semi-analytic")  # fmt: skip
    ax.plot(x, exact, color=plotting.COLOURS[0], linestyle="-", linewidth=0.6, label="exact")
    ax.set(title="c) gradient", xlabel="$x$ (m)", ylabel=r"$\partial E/\partial x$ (W/m$^2$)")
    ax.legend(fontsize=7, loc="lower right")


def _samples(ax, lines, x, E) -> None:
    ax.plot(x, E, label="exact", linestyle="-")
    for name, colour, mark in (("uniform", 2, "s"), ("gradient", 1, "o")):
        line = shared.cut(shared.one_of(lines, name), SHOWN)
        label = "adaptive" if name == "gradient" else name
        ax.plot(line.x, line.value, color=plotting.COLOURS[colour], marker=mark, markersize=2.5,
                linewidth=0.9, label=label)  # fmt: skip


# --- claims --------------------------------------------------------------------------------------


def _gradient_claims(gradients, at_pixels, formula, exact, rays, pixel) -> list[Claim]:
    span = np.ptp(exact)

    def share(found, kept=slice(None)) -> float:
        return shared.rms((found - at_pixels)[kept]) / span

    claims = [
        Claim(
            "R07 (37) with edges from the shapes: largest error of the gradient",
            0.0,
            float(np.max(np.abs(formula - exact)) / span),
            "of its range",
            bool(np.max(np.abs(formula - exact)) < 1e-10 * span),
        )
    ]
    for count in (256, 512):
        error = share(gradients[f"numeric, {count} rays"])
        words = f"Numeric differences of {count} rays per pixel: rms error of the gradient"
        claims.append(Claim(words, "very noisy", error, "of its range", error > WIDTH))
    E = rays[256][0]
    steps = np.arange(1, 33)
    best = min(
        shared.rms((E[2 * m :] - E[: -2 * m]) / (2 * m * (pixel[1] - pixel[0])) - at_pixels[m:-m])
        for m in steps
    )
    claims.append(
        Claim(
            "The same at 256 rays with the best of all steps from 1 to 32 pixels",
            None,
            best / span,
            "of its range",
        )
    )
    for kind, words in (
        ("first hits", "rays as they are traced"),
        ("bisected", "edges bisected, tangent's length"),
    ):
        for count in (256, 512):
            error = share(gradients[f"{kind}, {count} rays"])
            text = f"Semi-analytic gradient from {count} rays, {words}: rms error"
            claims.append(
                Claim(text, "identical at this scale", error, "of its range", error < WIDTH)
            )
    median = [
        float(np.median(np.abs(gradients[f"{kind}, 256 rays"] - at_pixels)) / span)
        for kind in ("numeric", "first hits", "bisected")
    ]
    claims.append(
        Claim(
            "Median errors at 256 rays: numeric, rays as traced, bisected",
            None,
            ", ".join(f"{m:.1e}" for m in median),
            "of its range",
        )
    )
    return claims


def _sampling_claims(budgets, errors) -> list[Claim]:
    at = int(np.flatnonzero(budgets == SHOWN)[0])
    told = []
    for driver, words in (
        ("gradient", "Adaptive by the gradient"),
        ("second order", "Adaptive by the second derivative"),
        ("numeric", "Adaptive by numeric differences"),
    ):
        ratio = errors["uniform"] / errors[driver]
        paper = "much more accurate" if driver == "gradient" else None
        told.append(
            Claim(
                f"{words}: rms error of uniform sampling over its own, {SHOWN} samples",
                paper,
                float(ratio[at]),
                "times",
                bool(ratio[at] > 2.0) if driver == "gradient" else None,
            )
        )
        told.append(
            Claim(
                f"{words}: the same for 17, 33, 65, 129 samples",
                None,
                ", ".join(f"{r:.2f}" for r in ratio),
                "times",
            )
        )
    return told
