"""D05 Fig. 6, the 3D row: spectra of the 4D light field at each step, by rays and predicted.

The paper's own come from photons; ours from rays through a scene like its Fig. 9(b): a round area
light (Gaussian, deviations 0.15 m and 0.3 in slopes, for which spectra have a closed form), 1 m of
travel, a layer of opaque balls of radius 0.12 m, one jittered in each cell of 0.4 m, 1 m of travel,
a diffuse receiver. 32^4 rays under a Gaussian window, padded to 48^4. The prediction is the
calculus of the 2D figure in four coordinates: shears, and a convolution with the balls' spectrum,
taken for discs. Shown: mean power over rings of spatial and of angular frequency. Samples of sharp
edges alias, as the paper says of its own.

Moments are compared past soft balls, jittered anew in every lay-out: behind a sharp rim the second
moment of a spectrum has no value (`d05.shared.space`). What the receiver keeps of the blockers'
lobe is read off the predicted spectrum, for four periods, without the light that balls let through
evenly; it meets the lobe at half the frequency, as it lies twice as far from the light as the
balls.
"""

from __future__ import annotations

import functools

import numpy as np

from figures.d05.shared import receiver, space
from figures.d05.shared.readings import alike, less, more, most
from figures.spread import spread
from figures.style import Drawing
from figures.verdicts import Statement, near
from firstorder import plotting

PERIOD = 0.4
PERIODS = (0.6, 0.4, 0.24, 0.12)
TITLES = ("1 source", "2 travel", "3 blockers", "4 travel, arrival")


def draw(quick: bool) -> Drawing:
    n, tried = (16, 12) if quick else (32, 28)
    balls = space.Balls.jittered(PERIOD)
    series = balls.series(24 if quick else 44)
    steps = [receiver.step(p, series) for p in _places(balls, n, 1.5)]
    scanned = receiver.layouts(functools.partial(_places, n=tried, pad=1.0), PERIOD, quick)
    f = np.linspace(-4.0, 4.0, 65)
    places, nodes = np.linspace(-1.6, 1.6, 24 if quick else 72), 40 if quick else 112
    light = receiver.irradiance(balls, places, nodes)
    measured = receiver.spectrum_of(light, places, 0.5, f)
    predicted = receiver.predicted_irradiance(balls.series(24), f, 0.5, 40 if quick else 56)

    figure, axes = plotting.panels(2, 5, 2.4, 2.3)
    receiver.draw_steps(axes[:, :4], steps)
    _draw_receiver(axes[:, 4], places, light, f, measured, predicted)
    arrays = {"x": places, "light": light, "Omega": f, "measured": measured}
    arrays |= {"predicted": predicted}
    for k, step in enumerate(steps, start=1):
        arrays |= {f"measured_{k}": step.rings[0], f"predicted_{k}": step.rings[1]}
        arrays |= {f"Omega_x_{k}": step.axes[0], f"Omega_v_{k}": step.axes[1]}
    claims = [
        *receiver.agreement(steps, scanned),
        _on_the_receiver(quick),
        *_effects(steps, scanned),
        *_lobes(quick),
    ]
    size = f"{n}^4 rays a step, {tried}^4 in each lay-out, {nodes}^2 a point"
    return Drawing(figure, arrays, claims, size=size, seed=7)


def _places(balls, n: int, pad: float) -> list[receiver.Place]:
    """Source, travel, blockers, travel and arrival."""
    p = [space.source()]
    p.append(space.travelled(p[0], space.FIRST))
    p.append((p[1][0].blocked(), p[1][1].blocked()))
    p.append(space.turned(space.travelled(p[2], space.SECOND)))
    lights = (
        space.Light(None, 0.0),
        space.Light(None, space.FIRST),
        space.Light(balls, space.FIRST),
        space.Light(balls, space.FIRST + space.SECOND, arriving=True),
    )
    windows = [space.Window(0.4, 0.5, n, pad)] + [space.Window(0.5, 0.35, n, pad)] * 3
    rows = zip(TITLES, windows, lights, p, strict=True)
    return [receiver.Place(*row, behind=k > 1) for k, row in enumerate(rows)]


def _draw_receiver(axes, places, light, f, measured, predicted) -> None:
    axes[0].pcolormesh(places, places, light.T, cmap="gray", rasterized=True)
    axes[0].set(aspect="equal", xlabel="$x$  [m]", ylabel="$y$  [m]")
    axes[0].set_title("5 diffuse receiver", loc="left")
    for F, name in ((measured, "measured"), (predicted, "predicted")):
        r, mean = receiver.ring_mean(F, f, 24)
        axes[1].semilogy(r, mean, label=name, linestyle="-" if name == "measured" else "--")
    axes[1].set(xlabel="$|\\Omega_{xy}|$  [cycles/m]")
    axes[1].set_title("its spectrum: $\\Omega_{vw} = 0$ alone", loc="left")
    axes[1].legend()


def _on_the_receiver(quick: bool) -> Statement:
    """Spectra on the receiver, by rays and predicted, past opaque balls."""
    f, places = np.linspace(-3.0, 3.0, 31), np.linspace(-1.6, 1.6, 36)
    apart = []
    for seed in range(3 if quick else 20):
        balls = space.Balls.jittered(PERIOD, seed)
        light = receiver.irradiance(balls, places, 40 if quick else 80)
        measured = receiver.spectrum_of(light, places, 0.5, f)
        predicted = receiver.predicted_irradiance(balls.series(20), f, 0.5, 40)
        apart.append(np.linalg.norm(measured - predicted) / np.linalg.norm(measured))
    mean, error = spread(apart)
    return Statement(
        "5 diffuse receiver: spectra by rays and predicted differ, opaque balls", receiver.AGREE,
        mean, alike(receiver.AGREE), receiver.PATHS, "of the norm", error,
        f"{len(apart)} lay-outs of balls",
    )  # fmt: skip


def _effects(steps, scanned) -> list[Statement]:
    """What the paper reads off the figure."""
    spatial, angular = receiver.growth(scanned, 0, 2, 1), receiver.growth(scanned, 1, 3, 2)
    S, window = steps[1].moments[0][0], steps[1].place.window
    # the window adds its own spread to the source's, sheared
    own = (2.0 * np.pi * window.x) ** -2.0 / 2.0
    slope = S[0, 1] / (S[0, 0] - own)
    said = receiver.said(scanned)
    return [
        Statement("Visibility increases the spatial frequency content: root mean square, times",
                  "increases", spatial[0], more("increases"), "D05 §3.4", "", spatial[1], said),
        Statement("The second transport pushes it to the angular domain: angular frequency, times",
                  "pushes", angular[0], more("pushes"), "D05 §3.4", "", angular[1], said),
        Statement("The slope of the first transport's shear is the travel distance (less the "
                  "window's own spread)", space.FIRST, slope,
                  near(space.FIRST, 0.02, "the window, and the samples' band"), "D05 §3.4", "m"),
    ]  # fmt: skip


def _lobes(quick: bool) -> list[Statement]:
    """What is left of the blockers' lobe on the receiver, over the mean light."""
    count = 3 if quick else 20
    left = np.array([[_lobe(p, seed) for seed in range(count)] for p in PERIODS])
    grows = spread(np.max(left[1:] / left[:-1], 0))
    removed = spread(1.0 - left[-1] / left[0])
    scanned = f"periods of 0.6 to 0.12 m, {count} lay-outs of balls each"
    return [
        Statement("The smaller the blockers, the less of their lobe is on the receiver: over that "
                  "of the next larger ones, at most", "more pronounced", grows[0],
                  less("more pronounced for high-frequency blockers"), "D05 §3.4", "", grows[1],
                  scanned),
        Statement("Small-enough blockers: share of their main lobe that diffuse shading removes, "
                  "beside the largest ones'", "most removed", removed[0], most("most removed"),
                  "D05 §3.4", "", removed[1], scanned),
    ]  # fmt: skip


def _lobe(period: float, seed: int) -> float:
    """Mean strength on the receiver, about the magnified frequency of the balls, over the mean."""
    met = 0.5 / period
    f = np.linspace(-1.25 * met, 1.25 * met, 41)
    harmonics = int(1.5 * space.BOX / period)
    s, V = space.Balls.jittered(period, seed).series(harmonics)
    mean = np.abs(receiver.predicted_irradiance((s, V), np.zeros(1), 0.5, 40)[0, 0])
    V[harmonics, harmonics] = 0.0  # light that passes evenly: its own lobe reaches that far
    F = receiver.predicted_irradiance((s, V), f, 0.5, 40)
    r = np.hypot(*np.meshgrid(f, f, indexing="ij"))
    about = (r > 0.75 * met) & (r < 1.25 * met)
    return float(np.sqrt(np.mean(np.abs(F[about]) ** 2)) / mean)
