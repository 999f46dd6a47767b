"""Inverse rendering of a shadow: disc and lamp from the light on a floor, by exact gradients.

Our own figure. 61 irradiances on a floor are all that is known, with 0.5 % of noise (or none).
Unknown are six numbers: the disc's place and radius, the lamp's middle, half its width, and its
radiance; the lamp's height, 1 m, is known. Least squares by SciPy's trust region, with the Jacobian
from one of three sources:

* exact: forward autodiff of the exact irradiance; edges of the shadow move with disc and lamp;
* autodiff of sampled visibility: 256 rays at fixed angles. Only the radiance has a derivative, so
  it alone is fitted; place, size and width stay where they were;
* differences of sampled visibility, of a function with stairs; steps of 0.02, about the best.

What limits the exact fit is the noise alone: its errors are compared with the standard errors that
the exact Jacobian predicts, `sigma^2 (J^T J)^-1`.

The problem has other minima, and gradients that are exact find those too: from starts spread
evenly about the truth (by 0.4, 0.2 and 0.06 m for the disc, 0.3 and 0.2 m and 0.5 for the lamp)
some fifteen in a hundred end in one. No start is tried twice.
"""

from __future__ import annotations

import functools

import jax
import jax.numpy as jnp
import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Circle
from scipy.optimize import least_squares

from figures.spread import spread
from figures.style import Drawing
from figures.verdicts import OURS, Measurement, Statement, at_least, at_most, between, near
from firstorder import plotting
from firstorder.flatland import Circles, Receiver, Scene, Segments, irradiance, nearest, primitive

NAMES = ("disc x", "disc y", "radius", "lamp middle", "lamp half-width", "radiance")
TRUE = np.array([0.15, 0.5, 0.13, -0.1, 0.5, 1.3])
START = np.array([-0.1, 0.35, 0.08, 0.1, 0.4, 1.0])
APART = np.array([0.4, 0.2, 0.06, 0.3, 0.2, 0.5])  # how far other starts lie from the truth
LOW = np.array([-0.9, 0.1, 0.01, -0.9, 0.05, 0.0])
HIGH = np.array([0.9, 0.75, 0.2, 0.9, 1.5, 5.0])
RAYS, RECEIVERS, NOISE, STEP, SEED = 256, 61, 0.005, 0.02, 5
FLOOR = np.linspace(-1.0, 1.0, RECEIVERS)
INK, RED, BLUE, GREEN, GOLD = "#1b1b1b", "#c2410c", "#2563eb", "#0f766e", "#e0a526"


def scene(p) -> Scene:
    """The scene of six numbers."""
    x, y, r, middle, half, L = p
    one = jnp.ones_like(x)
    lamp = Segments(jnp.stack([middle + half, one]), jnp.stack([middle - half, one]))
    return Scene.of(primitive(lamp, emission=L), primitive(Circles(jnp.stack([x, y]), r)))


def exact(p, x):
    """Irradiance at a place on the floor."""
    return irradiance(scene(p), Receiver(jnp.stack([x, 0.0 * x]), 0.0 * x))


def sampled(p, x):
    """The same from rays at fixed angles."""
    theta = np.pi * ((np.arange(RAYS) + 0.5) / RAYS - 0.5)
    along = jnp.asarray(np.stack([-np.sin(theta), np.cos(theta)], -1))
    here = scene(p)
    hits = nearest(here, jnp.broadcast_to(jnp.stack([x, 0.0 * x]), along.shape), along)
    L = jnp.where(hits.index >= 0, here.material.emission[hits.index, 0], 0.0)
    return jnp.sum(L * np.cos(theta)) * np.pi / RAYS


@functools.cache
def _compiled(model):
    """The profile and its Jacobian by autodiff."""

    def profile(p):
        return jax.vmap(lambda x: model(p, x))(jnp.asarray(FLOOR))

    return jax.jit(profile), jax.jit(jax.jacfwd(profile))


def _fit(model, data, differences: float | None = None, start=START):
    """Least squares from START; the numbers visited, and the misfit at each."""
    profile, slope = _compiled(model)
    visited = []

    def residual(p):
        return np.asarray(profile(jnp.asarray(p))) - data

    def jacobian(p):
        visited.append(np.array(p))
        if differences is None:
            return np.asarray(slope(jnp.asarray(p)))
        each = differences * np.eye(p.size)
        return np.stack([(residual(p + e) - residual(p - e)) / (2 * differences) for e in each], 1)

    done = least_squares(
        residual, start, jacobian, bounds=(LOW, HIGH), xtol=1e-15, ftol=1e-15, gtol=1e-15,
        max_nfev=60,
    )  # fmt: skip
    visited.append(done.x)
    misfit = [float(np.sqrt(np.mean(residual(p) ** 2))) for p in visited]
    return np.array(visited), np.array(misfit)


def draw(quick: bool) -> Drawing:
    trials, count = (20, 12) if quick else (200, 100)
    clean = np.asarray(_compiled(exact)[0](jnp.asarray(TRUE)))
    rng = np.random.default_rng(SEED)
    sigma = NOISE * float(clean.max())
    noisy = clean + sigma * rng.normal(size=RECEIVERS)
    fits = {
        "exact": _fit(exact, noisy),
        "autodiff": _fit(sampled, noisy),
        "differences": _fit(sampled, noisy, STEP),
    }
    ideal = _fit(exact, clean)
    tried = _trials(clean, sigma, trials, rng)
    reached = _starts(clean, count, rng)
    jacobian = np.asarray(_compiled(sampled)[1](jnp.asarray(START)))

    figure, axes = plotting.panels(1, 3, 3.7, 3.1, width_ratios=(1.15, 1.0, 1.0))
    _draw_scene(axes[0, 0], fits)
    _draw_profiles(axes[0, 1], clean, noisy, fits)
    _draw_misfit(axes[0, 2], fits, ideal, sigma)
    claims = _claims(fits, ideal, sigma, tried, jacobian, reached)
    arrays = {"true": TRUE, "start": START, "clean": clean, "noisy": noisy, "x": FLOOR}
    arrays |= {f"visited_{k}": v for k, (v, _) in fits.items()} | {"visited_ideal": ideal[0]}
    arrays |= {"standard_errors": tried[1], "spread": np.sqrt(np.mean(tried[0] ** 2, 0))}
    ends = {k: np.asarray(_compiled(exact)[0](jnp.asarray(v[-1]))) for k, (v, _) in fits.items()}
    curves = {"profiles": {"x": FLOOR, "measured": noisy, "true": clean, **ends}}
    size = f"{RECEIVERS} receivers, {RAYS} rays, {trials} repetitions, {count} starts"
    return Drawing(figure, arrays, claims, curves, size, SEED)


def _trials(clean, sigma, count, rng):
    """Errors of fits to fresh noise, what the Jacobian predicts of them, and misfits."""
    J = np.asarray(_compiled(exact)[1](jnp.asarray(TRUE)))
    predicted = np.sqrt(np.diag(np.linalg.inv(J.T @ J))) * sigma
    fits = [_fit(exact, clean + sigma * rng.normal(size=RECEIVERS)) for _ in range(count)]
    misfit = np.array([m[-1] for _, m in fits]) / sigma
    return np.array([visited[-1] for visited, _ in fits]) - TRUE, predicted, misfit


def _starts(clean, count, rng) -> tuple[np.ndarray, np.ndarray]:
    """From which other starts the truth is found: exactly, and by sampled differences.

    For samples the truth counts as found within 0.05 of every number.
    """
    starts = TRUE + rng.uniform(-1.0, 1.0, (count, TRUE.size)) * APART
    starts = np.clip(starts, LOW + 1e-3, HIGH - 1e-3)
    exactly = [_fit(exact, clean, start=s)[0][-1] for s in starts]
    roughly = [_fit(sampled, clean, STEP, s)[0][-1] for s in starts]
    near = [np.max(np.abs(np.array(e) - TRUE), 1) for e in (exactly, roughly)]
    return near[0] < 1e-8, near[1] < 0.05


def _claims(fits, ideal, sigma, trials, jacobian, reached) -> list[Statement | Measurement]:
    return [
        *_noisy(ideal, *trials),
        *_wrong(fits, sigma, jacobian),
        *_found(*reached),
        Measurement("Jacobians of the exact fit", len(fits["exact"][0]) - 1),
        Measurement("Differences of sampled visibility: misfit over that of exact gradients",
                    float(fits["differences"][1][-1] / fits["exact"][1][-1]), "times"),
    ]  # fmt: skip


def _noisy(ideal, errors, predicted, misfit) -> list[Statement]:
    """What exact gradients find, with noise and without."""
    left = float(np.sqrt(1.0 - TRUE.size / RECEIVERS))  # of the noise: six numbers are fitted
    ratio = np.sqrt(np.mean(errors**2, 0)) / predicted
    # Of a root mean square of n normal numbers: a share 1 / sqrt(2 n); the six are not independent.
    scatter = float(np.exp(np.mean(np.log(ratio))) / np.sqrt(2.0 * len(errors)))
    mean, error = spread(misfit)
    fresh = f"{len(errors)} draws of the noise"
    return [
        Statement("Without noise exact gradients recover all six numbers: largest error", None,
                  float(np.max(np.abs(ideal[0][-1] - TRUE))), at_most(1e-9, "rounding"), OURS,
                  "m, W/(m rad)"),
        Statement("With 0.5 % of noise the misfit of the exact fit is what least squares leave of "
                  "the noise", None, mean, near(left, 0.05, "sqrt(1 - 6 / 61)"), OURS,
                  "of the noise", error, fresh),
        Statement("Its errors are those that the exact Jacobian predicts: geometric mean of six "
                  "ratios", None, float(np.exp(np.mean(np.log(ratio)))),
                  between(1.0 / 1.5, 1.5, "to first order, a factor of 1.5"), OURS, "", scatter,
                  fresh),
    ]  # fmt: skip


def _wrong(fits, sigma, jacobian) -> list[Statement]:
    """What autodiff of sampled visibility does."""
    stuck = np.max(np.abs(fits["autodiff"][0][-1] - START)[:5])
    return [
        Statement("Autodiff of sampled visibility: derivatives by place, size and width are zero: "
                  "largest", None, float(np.max(np.abs(jacobian[:, :5]))),
                  at_most(0.0, "zero"), OURS),
        Statement("It moves nothing but the radiance: largest motion", None, float(stuck),
                  at_most(1e-3, "rounding of the trust region"), OURS, "m"),
        Statement("Its misfit stays far above the noise", None,
                  float(fits["autodiff"][1][-1] / sigma), at_least(5.0, "far: five times"), OURS,
                  "of the noise"),
    ]  # fmt: skip


def _found(exactly, roughly) -> list[Statement]:
    """From which starts the truth is found."""
    (mean, error), (gain, gain_error) = spread(exactly), spread(exactly * 1.0 - roughly)
    scanned = f"{len(exactly)} starts"
    return [
        Statement("Starts about the truth from which exact gradients find it to 1e-8", None, mean,
                  at_least(0.5, "most"), OURS, "of all", error, scanned),
        Statement("... more than those from which differences of sampled visibility find it to "
                  "0.05, by", None, gain, at_least(0.0, "more"), OURS, "of all", gain_error,
                  scanned),
    ]  # fmt: skip


# --- picture -------------------------------------------------------------------------------------

LINES = {
    "exact": (RED, "-", "exact gradients"),
    "autodiff": (BLUE, "--", "autodiff of samples"),
    "differences": (GREEN, "-.", "differences of samples"),
}


def _draw_scene(ax: Axes, fits) -> None:
    plotting.map_axes(ax, "a) found from the floor's light alone")
    ax.plot((-1, 1), (0, 0), color=INK, linestyle="-", linewidth=1.6)
    x, y, r, middle, half, _ = TRUE
    ax.add_patch(Circle((x, y), r, facecolor="0.75", linewidth=0))
    ax.annotate("truth", (x + r + 0.03, y), ha="left", va="center", fontsize=8)
    ax.plot((middle - half, middle + half), (1.0, 1.0), color=GOLD, linestyle="-", linewidth=7,
            solid_capstyle="butt", alpha=0.6)  # fmt: skip
    for k, (name, (visited, _)) in enumerate(fits.items()):
        colour, dash, _ = LINES[name]
        x, y, r, middle, half, _ = visited[-1]
        ax.add_patch(Circle((x, y), r, fill=False, edgecolor=colour, linestyle=dash, linewidth=1.5))
        up = 1.03 + 0.03 * k
        ax.plot((middle - half, middle + half), (up, up), color=colour, linestyle=dash)
    path = fits["exact"][0]
    ax.plot(path[:, 0], path[:, 1], color=RED, linestyle="-", marker=".", linewidth=0.7, ms=3)
    x, y, r = START[:3]
    ax.annotate("start", (x - r - 0.02, y), fontsize=8, ha="right", va="center")
    ax.set(xlim=(-1.02, 1.02), ylim=(-0.03, 1.13))


def _draw_profiles(ax: Axes, clean, noisy, fits) -> None:
    ax.plot(FLOOR, noisy, "o", color="0.35", markersize=2.5, linestyle="none", label="measured")
    for name, (visited, _) in fits.items():
        colour, dash, words = LINES[name]
        fitted = np.asarray(_compiled(exact)[0](jnp.asarray(visited[-1])))
        ax.plot(FLOOR, fitted, color=colour, linestyle=dash, label=words)
    ax.set_title("b) what each solution would give", loc="left")
    ax.set(xlabel="$x$ (m)", ylabel="$E$ (W/m)", ylim=(0.0, 1.45 * float(clean.max())))
    ax.set_xticks((-1.0, -0.5, 0.0, 0.5, 1.0))
    ax.legend(fontsize=7, loc="upper right")


def _draw_misfit(ax: Axes, fits, ideal, sigma) -> None:
    for name, (_, misfit) in fits.items():
        colour, dash, words = LINES[name]
        ax.semilogy(misfit, color=colour, linestyle=dash, marker=".", ms=4, label=words)
    ax.semilogy(ideal[1], color=RED, linestyle=":", marker=".", ms=3, label="exact, without noise")
    ax.axhline(sigma, color="0.6", linestyle="-", linewidth=0.8)
    ax.annotate("noise", (0.98, 0.7 * sigma), xycoords=("axes fraction", "data"), fontsize=8,
                ha="right", va="top", color="0.4")  # fmt: skip
    ax.set_title("c) misfit", loc="left")
    ax.set(xlabel="iteration", ylabel="rms misfit (W/m)")
    ax.legend(fontsize=7, loc="center right", bbox_to_anchor=(1.0, 0.42))
