"""D05 Fig. 9: one light, one diffuse receiver, and blockers of ever higher frequency.

The three scenes differ in the period of the balls alone: 1.2 m, 0.48 m and 0.12 m (radius 0.3 of
it, one jittered in each cell, so that the same share of light is blocked); light and distances are
those of Fig. 6 (3D). Above: the light on the receiver, by rays. Middle: the spectrum over (x, v)
of the light that arrives there, in angles and positions at once, as the paper draws it: a slice of
the light field at w = 0 along a row of balls. Below: the spectrum of what the receiver keeps, by
rays and predicted from the balls' spectrum. "High" are frequencies above 0.75 cycles per metre (the
grey line), where the light without blockers, under the same window, still has 2.7 % of its energy:
this is taken off before the scenes are compared.
"""

from __future__ import annotations

import numpy as np
from matplotlib.colors import LogNorm

from figures.d05.shared import receiver, space
from figures.style import Claim, Drawing
from firstorder import plotting

PERIODS = (1.2, 0.48, 0.12)
WIDTH, CUT = 0.6, 0.75  # of the window [m], and where high frequencies begin [cycles/m]
TITLES = ("(a) large blockers", "(b) smaller", "(c) very small")


def draw(quick: bool) -> Drawing:
    places = np.linspace(-1.8, 1.8, 24 if quick else 64)
    nodes = 40 if quick else 144
    f = np.linspace(-3.0, 3.0, 61)
    figure, axes = plotting.panels(3, 3, 2.9, 2.3)
    arrays: dict[str, np.ndarray] = {"x": places, "Omega": f}
    shares, apart, modes = [], [], []
    open_light = receiver.spectrum_of(receiver.irradiance(None, places, nodes), places, WIDTH, f)
    for column, period, title in zip(axes.T, PERIODS, TITLES, strict=True):
        balls = space.Balls.jittered(period)
        light = receiver.irradiance(balls, places, nodes)
        measured = receiver.spectrum_of(light, places, WIDTH, f)
        harmonics = 16 if quick else 30
        predicted = receiver.predicted_irradiance(balls, f, WIDTH, 40, harmonics)
        power, Ox, Ov = _slice(balls, 128 if quick else 384)
        _panels(column, title, places, light, power, Ox, Ov, f, measured, predicted)
        shares.append(_high(measured, f))
        modes.append(_spatial(power, Ox))
        apart.append(float(np.linalg.norm(measured - predicted) / np.linalg.norm(measured)))
        arrays |= {f"light_{period}": light, f"measured_{period}": measured}
        arrays |= {f"predicted_{period}": predicted, f"arriving_{period}": power}
    plotting.share_labels(axes[:1])
    return Drawing(
        figure,
        arrays,
        _claims(shares, apart, modes, _high(open_light, f)),
        size=f"{places.size}^2 points, {nodes}^2 rays each",
        seed=7,
    )


def _slice(balls, n: int):
    """Arriving light over (x, v) along a row of balls, and the power of its windowed spectrum."""
    x, v = np.linspace(-1.8, 1.8, n), np.linspace(-1.2, 1.2, n)
    X, V = np.meshgrid(x, v, indexing="ij")
    row = 0.0 * X + 0.5 * balls.period  # through the middles of cells
    light = space.arrived(X, row, V, 0.0 * X, balls)
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


def _panels(column, title, places, light, power, Ox, Ov, f, measured, predicted) -> None:
    column[0].pcolormesh(places, places, light.T, cmap="gray", rasterized=True)
    column[0].set(aspect="equal", xlabel="$x$  [m]", ylabel="$y$  [m]")
    column[0].set_title(title, loc="left")
    near = [np.abs(o) < 12.0 for o in (Ox, Ov)]
    column[1].pcolormesh(
        Ox[near[0]],
        Ov[near[1]],
        np.maximum(power[np.ix_(*near)], 1e-7).T,
        norm=LogNorm(1e-6, 1.0),
        cmap="magma",
        rasterized=True,
    )
    column[1].set(xlabel="$\\Omega_x$  [cycles/m]", ylabel="$\\Omega_v$  [cycles]")
    column[1].set_title("arriving light", loc="left")
    for F, name, style in ((measured, "rays", "-"), (predicted, "predicted", "--")):
        r, mean = receiver.ring_mean(F, f, 24)
        column[2].semilogy(r, mean / mean[0], style, label=name)
    column[2].set(xlabel="$|\\Omega_{xy}|$  [cycles/m]", ylim=(1e-4, 1.5))
    column[2].axvline(CUT, color="0.7", linewidth=0.8)
    column[2].set_title("on the receiver", loc="left")
    column[2].legend()


def _claims(shares, apart, modes, none) -> list[Claim]:
    a, b, c = (s - none for s in shares)
    found = [
        Claim(
            f"{title}: energy at high frequencies on the receiver",
            words,
            share,
            "of its energy",
            holds,
        )
        for title, words, share, holds in zip(
            TITLES,
            ("few", "increase", "nearly disappear"),
            shares,
            (None, b > a, c < 0.1 * b),
            strict=True,
        )
    ]
    found.append(Claim("the same without blockers", None, none, "of its energy"))
    found += [
        Claim(
            f"{title}: energy at high spatial frequencies of the arriving light",
            None,
            mode,
            "of its energy",
        )
        for title, mode in zip(TITLES, modes, strict=True)
    ]
    found += [
        Claim(
            f"{title}: spectra on the receiver by rays and predicted differ by",
            0.0,
            e,
            "of the norm (balls are no discs)",
            e < 0.05,
        )
        for title, e in zip(TITLES, apart, strict=True)
    ]
    return found
