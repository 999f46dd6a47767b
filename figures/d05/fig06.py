"""D05 Fig. 6: light from a source past blockers to a diffuse receiver, with its spectra.

The paper gives no numbers for its 2D scene. Ours: a Gaussian area light (deviation 0.2 m, slopes
0.35), 1 m of travel, a comb of 7 opaque bars of period 0.25 m and half open, 1 m of travel, a
receiver facing the light (arrival turns x round), diffuse with rho = 1/2. The paper's 3D row
belongs to another figure. Upper spectra: closed form, step by step from that of the source. Lower
spectra: the transform of samples of the light at that step, which shares nothing with them; where
the light jumps (steps 3 to 5) the samples have a grid error, printed in the claims. At step 6 the
light is smooth again, and they agree to rounding.
"""

from __future__ import annotations

import itertools

import equinox as eqx
import jax.numpy as jnp
import numpy as np

from figures.d05.shared import scene
from figures.d05.shared.readings import equal, less, most
from figures.style import Drawing
from figures.verdicts import Statement, at_most, near
from firstorder import plotting
from firstorder.fields import Grid, discrete_transform

TITLES = ("1 source", "2 travel", "3 blockers", "4 travel, arrival", "5 times $g(v)$")
SHOWN = (0, 1, 2, 4, 5)  # steps of the path; step 3 is travel before arrival


def draw(quick: bool) -> Drawing:
    frequencies = 25 if quick else 61
    samples = (2048, 128) if quick else (4096, 384)
    path = scene.path()
    steps, spectra = path.steps, path.spectra
    Omega = np.linspace(-6.0, 6.0, frequencies)
    grid = Grid.spanning(samples, (scene.HALF, scene.REACH))
    lights = [np.asarray(scene.sample(steps[k], grid)) for k in SHOWN]
    forms = [np.asarray(scene.closed(spectra[k], Omega, Omega)) for k in SHOWN]
    measured = [scene.transformed(steps[k], grid, Omega, Omega) for k in SHOWN]
    receiver = _receiver(path, 256 if quick else 512)

    figure, axes = plotting.panels(3, 6, 2.15, 2.1)
    for i, title in enumerate(TITLES):
        plotting.show_light_field(
            axes[0, i], lights[i], grid.axis(0), grid.axis(1), names=("x", "v"), title=title
        )
        axes[0, i].set(xlim=(-2.2, 2.2), ylim=(-1.2, 1.2))
        for row, F in ((1, forms[i]), (2, measured[i])):
            plotting.show_spectrum(
                axes[row, i],
                F,
                Omega,
                Omega,
                decades=3.0,
                names=("x", "v"),
                title=("closed form", "samples")[row - 1],
            )
    _draw_receiver(axes[:, 5], receiver)
    plotting.share_labels(axes[:, :5])
    errors = [
        float(np.max(np.abs(a - b)) / np.max(np.abs(b)))
        for a, b in zip(forms, measured, strict=True)
    ]
    bounds = _edge_bounds(lights, forms, grid)
    arrays = {f"light_{k + 1}": a for k, a in enumerate(lights)}
    arrays |= {f"closed_{k + 1}": a for k, a in enumerate(forms)}
    arrays |= {f"sampled_{k + 1}": a for k, a in enumerate(measured)}
    arrays |= {"Omega_x": Omega, "Omega_v": Omega, "x": grid.axis(0), "v": grid.axis(1)}
    return Drawing(
        figure,
        arrays,
        [*_agreement(errors, bounds, receiver), *_shears(path), *_replicas(path)],
        {"receiver": {k: receiver[k] for k in ("x", "light")}},
        size=f"{samples[0]} x {samples[1]} samples, {frequencies}^2 frequencies",
    )


def _receiver(path, n: int) -> dict[str, np.ndarray]:
    """Light on the receiver, with both spectra."""
    line = Grid.spanning((n,), (scene.HALF,))
    Omega = np.linspace(-6.0, 6.0, 121)
    light = np.asarray(scene.sample(path.light, line))
    F = np.asarray(eqx.filter_jit(path.spectra[-1])(jnp.asarray(Omega)))
    sampled = np.asarray(discrete_transform(jnp.asarray(light), line, Omega))
    return {
        "x": np.asarray(line.axis(0)),
        "light": light,
        "Omega": Omega,
        "closed": F,
        "sampled": sampled,
    }


def _draw_receiver(axes, r) -> None:
    axes[0].plot(r["x"], r["light"])
    axes[0].set(xlim=(-2.2, 2.2), ylim=(0.0, None), xlabel=plotting.label("x"))
    axes[0].set_title("6 gathered: $l_o(x)$", loc="left")
    for ax, name, title in ((axes[1], "closed", "closed form"), (axes[2], "sampled", "samples")):
        magnitude = np.abs(r[name])
        ax.semilogy(r["Omega"], np.maximum(magnitude, 1e-16))
        ax.set(ylim=(1e-6 * magnitude.max(), 2.0 * magnitude.max()))
        ax.set(xlabel=plotting.label("Omega_x"))
        ax.set_title(title, loc="left")


def _agreement(errors, bounds, receiver) -> list[Statement]:
    """Closed forms against samples; those of an edge are off by what a misplaced edge makes."""
    difference = np.max(np.abs(receiver["closed"] - receiver["sampled"]))
    last = float(difference / np.max(np.abs(receiver["sampled"])))
    names = ("source", "travel", "blockers", "second travel", "times g(v)")
    edges = f"{2 * scene.BARS} edges, each misplaced by half a sample"
    found = [
        Statement(f"Spectrum after step {k + 1} ({name}): the analytic one and that of samples "
                  "differ by", 0.0, e, equal() if k < 2 else at_most(bound, edges), "D05 Fig. 6",
                  "of the peak")
        for k, (name, e, bound) in enumerate(zip(names, errors, bounds, strict=True))
    ]  # fmt: skip
    words = "Spectrum on the receiver: the analytic one and that of samples differ by"
    return [*found, Statement(words, 0.0, last, equal(), "D05 Fig. 6", "of the peak")]


def _edge_bounds(lights, forms, grid: Grid) -> list[float]:
    """What half a sample at each edge can add to a spectrum, over its peak.

    Each edge lets through `int l dv` for a step of x, and radiance is the same all along a ray, so
    that of the light before the blockers holds for every step behind them.
    """
    across, up = grid.step
    most_through = float(np.max(np.sum(lights[1], 1))) * up
    return [scene.BARS * across * most_through / float(np.max(np.abs(F))) for F in forms]


def _shears(path) -> list[Statement]:
    """Slope of the line on which the source's spatial frequencies lie after a travel."""
    S = np.asarray(path.covariances[1].matrix)
    slope = S[0, 1] / S[0, 0]
    words = "The slope of the first transport's shear is the travel distance (outgoing light)"
    rule = near(scene.FIRST, 1e-9, "rounding")
    return [Statement(words, scene.FIRST, slope, rule, "D05 §3.4", "m")]


PERIODS = {0.5: 4, 0.25: 7, 0.125: 14}  # of combs, with their bars [m]


def _replicas(path) -> list[Statement]:
    """Where the first replica lies, how wide it is, and what the receiver sees of it."""
    series = path.events[1].transparency.series(Grid.spanning((2048, 8), (scene.HALF, 1.0)))
    s, c = np.asarray(series.frequencies)[:, 0], np.abs(np.asarray(series.coefficients))
    near_it = (s > 2.0) & (s < 6.0)
    peak = s[near_it][np.argmax(c[near_it])]
    wide = s[near_it][c[near_it] > 0.5 * c[near_it].max()]
    width, expected = wide.max() - wide.min(), 1.207 / (scene.BARS * scene.PERIOD)
    step = 0.5 / scene.HALF  # of the series
    left = [_left(p, n) for p, n in PERIODS.items()]
    scanned = "periods of " + ", ".join(f"{p:g}" for p in PERIODS) + " m"
    grows = max(b / a for a, b in itertools.pairwise(left))
    return [
        Statement("The blockers' side lobes lie at their main frequency", 1.0 / scene.PERIOD, peak,
                  near(1.0 / scene.PERIOD, step * scene.PERIOD, "one step of the series"),
                  "D05 §3.4", "cycles/m"),
        Statement("A finite number of blockers makes the lobes blurry: width at half height",
                  "blurry", width,
                  near(expected, step / expected, "a box's 1.207 over its length, to one step"),
                  "D05 §3.4", "cycles/m"),
        Statement("The smaller the blockers, the less of their main frequency is on the receiver: "
                  "side lobe over that of blockers twice as large, at most", "more pronounced",
                  grows, less("more pronounced for high-frequency blockers"), "D05 §3.4",
                  scanned=scanned),
        Statement("Small-enough blockers: share of the side lobe that is removed, over that of the "
                  "largest", "most removed", 1.0 - left[-1] / left[0], most("most removed"),
                  "D05 §3.4", scanned=scanned),
    ]  # fmt: skip


def _left(period: float, bars: int) -> float:
    """What the receiver sees of the pattern: on Omega_v = 0 it is met at a magnified period."""
    met = scene.FIRST / (scene.FIRST + scene.SECOND) / period
    F = eqx.filter_jit(scene.path((320, 160), period, bars).spectra[-1])
    near = np.asarray(F(jnp.linspace(met - 0.25, met + 0.25, 41)))
    return float(np.max(np.abs(near)) / abs(complex(F(0.0))))
