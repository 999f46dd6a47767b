"""D05 Fig. 8: one light field's spectrum in slopes and in angles, and how far bandwidths agree.

The paper shows one scene without numbers and says that renaming the directions "introduces no
significant error" for bandwidths. (a), (b): light on the receiver of Fig. 6 (slopes of deviation
0.35), its spectrum in slopes in closed form and in angles from samples (a warp has no closed form).
(c): soft blockers of 8 cycles per unit slope, seen over an angular extent a (deviation of the
slopes tan(a) / 2); the bandwidth that holds 99 % of the energy, in angles over in slopes. (d): the
same for a narrow packet at the slope tan(a), off the centre, where the ratio is 1 / cos^2(a).

The claim holds near the centre and not beyond: a packet is 10 % off at 17 degrees, and its
frequency doubles at 45.
"""

from __future__ import annotations

import numpy as np

from figures.d05.shared import scene
from figures.style import Claim, Drawing
from firstorder import plotting
from firstorder.fields import Grid
from firstorder.transport.events.slopes import ToAngle

SIGNIFICANT = 0.1
CYCLES = 8.0


def draw(quick: bool) -> Drawing:
    n, samples = (65, (2048, 192)) if quick else (161, (3072, 768))
    light, angular = (scene.path().steps[4], ToAngle()(scene.path().steps[4]))
    Omega = np.linspace(-6.0, 6.0, n)
    F = np.asarray(scene.closed(light.spectrum(), Omega, Omega))
    grid = Grid.spanning(samples, (scene.HALF, 1.35))
    G = scene.transformed(angular, grid, Omega, Omega)
    degrees = np.linspace(2.0, 50.0, 9 if quick else 25)
    spread = np.array([_bandwidth_ratio(0.0, 0.5 * np.tan(a)) for a in np.radians(degrees)])
    packet = np.array([_bandwidth_ratio(np.tan(a), 0.02, 60.0) for a in np.radians(degrees)])

    figure, axes = plotting.panels(1, 4, 2.9, 2.5)
    for ax, data, names, title in (
        (axes[0, 0], F, ("x", "v"), "(a) in slopes"),
        (axes[0, 1], G, ("x", "theta"), "(b) in angles"),
    ):
        plotting.show_spectrum(ax, data, Omega, Omega, decades=3.0, names=names, title=title)
    for ax, curve, title in (
        (axes[0, 2], spread, "(c) bandwidth ratio, |angle| to a"),
        (axes[0, 3], packet, "(d) frequency ratio at a"),
    ):
        ax.axhspan(1.0 - SIGNIFICANT, 1.0 + SIGNIFICANT, color="0.9")
        ax.plot(degrees, curve, label="measured")
        ax.set(xlabel="a (degrees)", ylabel="angles / slopes")
        ax.set_title(title, loc="left")
    axes[0, 3].plot(degrees, np.cos(np.radians(degrees)) ** -2.0, label=r"$1/\cos^2 a$")
    axes[0, 3].legend()
    return Drawing(
        figure,
        {"Omega": Omega, "slopes": F, "angles": G},
        _claims(F, G, degrees, spread, packet),
        {"ratios": {"degrees": degrees, "spread": spread, "packet": packet}},
        size=f"{samples[0]} x {samples[1]} samples, {n}^2 frequencies",
    )


def _bandwidth_ratio(v0: float, sigma: float, cycles: float = CYCLES) -> float:
    """Frequency holding 99 % of the energy in angles, over that in slopes (1D, from samples)."""
    low, high = np.arctan(v0 - 6.5 * sigma), np.arctan(v0 + 6.5 * sigma)
    n = 8192
    theta = low + (np.arange(n) + 0.5) * (high - low) / n
    slope = np.linspace(v0 - 6.5 * sigma, v0 + 6.5 * sigma, n)

    def bandwidth(v, step):
        bell = np.exp(-0.5 * ((v - v0) / sigma) ** 2)
        return _holding(bell * np.exp(2j * np.pi * cycles * v), step)

    return bandwidth(np.tan(theta), theta[1] - theta[0]) / bandwidth(slope, slope[1] - slope[0])


def _holding(signal, step: float, share: float = 0.99) -> float:
    """Least |frequency| below which `share` of the energy lies; padded to a fine grid."""
    n = 8 * signal.size
    power = np.abs(np.fft.fft(signal, n)) ** 2
    W = np.abs(np.fft.fftfreq(n, step))
    order = np.argsort(W, kind="stable")  # frequencies come in pairs: the same order everywhere
    total = np.cumsum(power[order])
    return float(np.interp(share * total[-1], total, W[order]))


def _claims(F, G, degrees, spread, packet) -> list[Claim]:
    distance = np.linalg.norm(np.abs(F) - np.abs(G)) / np.linalg.norm(F)
    words = "no significant error"

    def at(curve, angle):
        return float(np.interp(angle, degrees, curve) - 1.0)

    claims = [
        Claim(
            "the two spectra of Fig. 6's receiver differ by (magnitudes, L2)",
            "similar",
            float(distance),
            "of their norm",
            None,
        )
    ]
    for angle in (10.0, 30.0, 45.0):
        change = at(spread, angle)
        claims.append(
            Claim(
                f"bandwidth of light within {angle:g} degrees, in angles against in slopes",
                words,
                change,
                "relative change",
                abs(change) < SIGNIFICANT,
            )
        )
    for angle in (10.0, 30.0, 45.0):
        change = at(packet, angle)
        claims.append(
            Claim(
                f"frequency of a packet at {angle:g} degrees, in angles against in slopes",
                words,
                change,
                "relative change",
                abs(change) < SIGNIFICANT,
            )
        )
    exact = float(np.max(np.abs(packet * np.cos(np.radians(degrees)) ** 2 - 1.0)))
    claims.append(
        Claim(
            "corrected: the frequency is multiplied by 1 / cos^2; largest departure",
            0.0,
            exact,
            "relative (width of the packet)",
            exact < 0.1,
        )
    )
    return claims
