"""D05 Fig. 9: one light, one diffuse receiver, and blockers of ever higher frequency.

The three scenes differ in the period of the balls alone: 1.2 m, 0.48 m and 0.12 m (radius 0.3 of
it, one jittered in each cell, so that the same share of light is blocked); light and distances are
those of Fig. 6 (3D). On top: the scene, rendered, with the light that was measured on its receiver.
Below: that light, by rays; the spectrum over (x, v)
of the light that arrives there, in angles and positions at once, as the paper draws it: a slice of
the light field at w = 0 along a row of balls. Below: the spectrum of what the receiver keeps, by
rays and predicted from the balls' spectrum. "High" are frequencies above 0.75 cycles per metre (the
grey line), where the light without blockers, under the same window, still has 2.7 % of its energy:
this is taken off before the scenes are compared. They are compared over lay-outs, each jittered
anew, by the predicted spectra.
"""

from __future__ import annotations

import numpy as np
from matplotlib.colors import LogNorm
from scipy.interpolate import RegularGridInterpolator

from figures.d05.shared import picture, receiver, space
from figures.d05.shared.readings import ALIKE, alike
from figures.spread import spread
from figures.style import Drawing
from figures.verdicts import Measurement, Statement, at_least, at_most
from firstorder import plotting
from firstorder.imaging.camera import pinhole

PERIODS = (1.2, 0.48, 0.12)
WIDTH, CUT = 0.6, 0.75  # of the window [m], and where high frequencies begin [cycles/m]
NAMES = (((-0.42, 0.0, 2.0), "light"), ((-1.2, 0.0, 1.02), "balls"), ((-1.5, 1.8, 0.1), "receiver"))
TITLES = ("(a) large blockers", "(b) smaller", "(c) very small")


def draw(quick: bool) -> Drawing:
    places = np.linspace(-1.8, 1.8, 24 if quick else 64)
    nodes = 40 if quick else 144
    f = np.linspace(-3.0, 3.0, 61)
    figure, axes = plotting.panels(4, 3, 3.6, 2.5, height_ratios=(0.66, 1.0, 1.0, 1.0))
    arrays: dict[str, np.ndarray] = {"x": places, "Omega": f}
    apart, modes = [], []
    open_light = receiver.spectrum_of(receiver.irradiance(None, places, nodes), places, WIDTH, f)
    for column, period, title in zip(axes.T, PERIODS, TITLES, strict=True):
        balls = space.Balls.jittered(period)
        light = receiver.irradiance(balls, places, nodes)
        measured = receiver.spectrum_of(light, places, WIDTH, f)
        harmonics = 16 if quick else 30
        predicted = receiver.predicted_irradiance(balls.series(harmonics), f, WIDTH, 40)
        power, Ox, Ov = _slice(balls, 128 if quick else 384)
        picture.show(column[0], _view(places, light, quick), balls, title)
        _panels(column[1:], places, light, power, Ox, Ov, f, measured, predicted)
        modes.append(_spatial(power, Ox))
        apart.append(float(np.linalg.norm(measured - predicted) / np.linalg.norm(measured)))
        arrays |= {f"light_{period}": light, f"measured_{period}": measured}
        arrays |= {f"predicted_{period}": predicted, f"arriving_{period}": power}
    plotting.share_labels(axes[1:2])
    for point, words in NAMES:
        seen = _view(places, arrays[f"light_{PERIODS[0]}"], quick)
        picture.name(axes[0, 0], seen, point, words, ha="right")
    return Drawing(
        figure,
        arrays,
        [
            *_increase(_high(open_light, f), f, quick),
            *_arriving(modes),
            *_predicted(apart),
        ],
        size=f"{places.size}^2 points, {nodes}^2 rays each",
        seed=7,
    )


def _view(places, light, quick: bool) -> picture.View:
    """The receiver with the light that is on it, from the side."""
    read = RegularGridInterpolator((places, places), light, "linear", False, None)
    shape = (180, 112) if quick else (540, 336)
    camera = pinhole((1.0, -7.5, 1.8), (0.03, 0.0, 0.85), gamma=3.0)

    def shade(points, _):
        return 0.5 / np.pi * (read(points[:, :2]) + picture.faint_light((0.0, 0.0, 1.0)))

    half = float(places[-1])
    return picture.View(camera, picture.floor(half), shade, picture.RECEIVER, half, shape)


def _slice(balls, n: int):
    """Arriving light over (x, v) along a row of balls, and the power of its windowed spectrum."""
    x, v = np.linspace(-1.8, 1.8, n), np.linspace(-1.2, 1.2, n)
    X, V = np.meshgrid(x, v, indexing="ij")
    row = 0.0 * X + 0.5 * balls.period  # through the middles of cells
    light = np.asarray(space.arrived(X, row, V, 0.0 * X, balls))
    light = light * np.exp(-0.5 * ((X / WIDTH) ** 2 + (V / 0.4) ** 2))
    F = np.fft.fftshift(np.abs(np.fft.fft2(light, (2 * n, 2 * n))) ** 2)
    Ox, Ov = (np.fft.fftshift(np.fft.fftfreq(2 * n, a[1] - a[0])) for a in (x, v))
    return F / F.max(), Ox, Ov


def _spatial(power, Ox) -> float:
    """Share of the arriving energy at high spatial frequencies, at whatever angular ones."""
    return float(power[np.abs(Ox) > CUT].sum() / power.sum())


def _high(F, f) -> float:
    """Share of the receiver's energy above the cut."""
    r = np.hypot(*np.meshgrid(f, f, indexing="ij"))
    power = np.abs(F) ** 2
    return float(power[r > CUT].sum() / power.sum())


def _panels(column, places, light, power, Ox, Ov, f, measured, predicted) -> None:
    drawn = column[0].pcolormesh(places, places, light.T, cmap="gray", vmin=0.0, rasterized=True,
                                 shading="gouraud")  # fmt: skip
    column[0].figure.colorbar(drawn, ax=column[0], label="W/m$^2$")
    column[0].set(aspect="equal", xlabel="$x$  [m]", ylabel="$y$  [m]")
    column[0].set_title("light on the receiver", loc="left")
    near = [np.abs(o) < 12.0 for o in (Ox, Ov)]
    drawn = column[1].pcolormesh(
        Ox[near[0]],
        Ov[near[1]],
        np.maximum(power[np.ix_(*near)], 1e-7).T,
        norm=LogNorm(1e-6, 1.0),
        cmap="magma",
        rasterized=True,
    )
    column[1].figure.colorbar(drawn, ax=column[1], label="energy, of the largest")
    column[1].set(xlabel="$\\Omega_x$  [cycles/m]", ylabel="$\\Omega_v$  [cycles]")
    column[1].set_title("arriving light", loc="left")
    for F, name, style in ((measured, "rays", "-"), (predicted, "predicted", "--")):
        r, mean = receiver.ring_mean(F, f, 24)
        column[2].semilogy(r, mean / mean[0], style, label=name)
    column[2].set(xlabel="$|\\Omega_{xy}|$  [cycles/m]", ylim=(1e-4, 1.5))
    column[2].axvline(CUT, color="0.7", linewidth=0.8)
    column[2].set_title("on the receiver", loc="left")
    column[2].legend()


def _increase(none: float, f, quick: bool) -> list[Statement | Measurement]:
    """High frequencies on the receiver, of the three scenes in many lay-outs."""
    count = 3 if quick else 20
    shares = np.array([[_share(p, s, f) - none for s in range(count)] for p in PERIODS])
    a, b, c = shares
    scanned = f"{count} lay-outs of balls"
    few, rise, gone = spread(a), spread(b - a), spread(c / b)
    return [
        Statement("(a) Large blockers result in few high frequencies on the receiver", "few",
                  few[0], at_most(ALIKE, "'few': a tenth of the energy"), "D05 Fig. 9",
                  "of its energy", few[1], scanned),
        Statement("(b) With smaller blockers they increase, over (a) by", "increase", rise[0],
                  at_least(0.0, "'increase'"), "D05 Fig. 9", "of its energy", rise[1], scanned),
        Statement("(c) With very high-frequency blockers they nearly disappear: over (b)",
                  "nearly disappear", gone[0], at_most(ALIKE, "'nearly disappear': a tenth"),
                  "D05 Fig. 9", "times", gone[1], scanned),
        Measurement("... lay-outs in which all three hold",
                    float(np.mean((a < ALIKE) & (b > a) & (c < ALIKE * b))), "of all"),
        Measurement("High frequencies without blockers", none, "of the energy"),
    ]  # fmt: skip


def _share(period: float, seed: int, f) -> float:
    """Predicted share of the receiver's energy at high frequencies."""
    series = space.Balls.jittered(period, seed).series(30)
    return _high(receiver.predicted_irradiance(series, f, WIDTH, 40), f)


def _arriving(modes) -> list[Measurement]:
    return [
        Measurement(f"{title}: energy of the arriving light at high spatial frequencies", mode,
                    "of its energy")
        for title, mode in zip(TITLES, modes, strict=True)
    ]  # fmt: skip


def _predicted(apart) -> list[Statement]:
    return [
        Statement(f"{title}: spectra on the receiver, by rays and predicted, differ",
                  receiver.AGREE, e, alike(receiver.AGREE), receiver.PATHS, "of the norm")
        for title, e in zip(TITLES, apart, strict=True)
    ]  # fmt: skip
