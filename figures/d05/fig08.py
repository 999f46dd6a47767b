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
from figures.d05.shared.readings import ALIKE, alike
from figures.style import Drawing
from figures.verdicts import OURS, Measurement, Statement, at_most
from firstorder import plotting
from firstorder.fields import Grid
from firstorder.transport.events.slopes import ToAngle

CYCLES = 8.0
SPREADS = (0.05, 0.1, 0.2, 0.35)  # of the light's slopes: the last one is that of Fig. 6
NO_ERROR = "no significant error"


def draw(quick: bool) -> Drawing:
    n, samples = (65, (2048, 192)) if quick else (161, (3072, 768))
    Omega = np.linspace(-6.0, 6.0, n)
    F = np.asarray(scene.closed(scene.path().steps[4].spectrum(), Omega, Omega))
    G = _in_angles(scene.path(), samples, Omega)
    coarse = Omega[:: 4 if quick else 8]
    apart = [_apart(s, (1024, 128) if quick else (2048, 256), coarse) for s in SPREADS]
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
        ax.axhspan(1.0 - ALIKE, 1.0 + ALIKE, color="0.9")
        ax.plot(degrees, curve, label="measured")
        ax.set(xlabel="a (degrees)", ylabel="angles / slopes")
        ax.set_title(title, loc="left")
    axes[0, 3].plot(degrees, np.cos(np.radians(degrees)) ** -2.0, label=r"$1/\cos^2 a$")
    axes[0, 3].legend()
    return Drawing(
        figure,
        {"Omega": Omega, "slopes": F, "angles": G},
        [*_alike(_distance(F, G), apart), *_bandwidths(degrees, spread, packet)],
        {
            "ratios": {"degrees": degrees, "spread": spread, "packet": packet},
            "distances": {"slopes": np.array(SPREADS), "distance": np.array(apart)},
        },
        size=f"{samples[0]} x {samples[1]} samples, {n}^2 frequencies",
    )


def _in_angles(path, samples: tuple[int, int], Omega) -> np.ndarray:
    """Spectrum of the light on the receiver over positions and angles, from samples."""
    grid = Grid.spanning(samples, (scene.HALF, 1.35))
    return scene.transformed(ToAngle()(path.steps[4]), grid, Omega, Omega)


def _apart(sigma: float, samples: tuple[int, int], Omega) -> float:
    """How far the two spectra differ for a light of this spread of slopes."""
    path = scene.path(sigma_v=sigma)
    F = np.asarray(scene.closed(path.steps[4].spectrum(), Omega, Omega))
    return _distance(F, _in_angles(path, samples, Omega))


def _distance(F, G) -> float:
    """Of magnitudes, over the norm of the first."""
    return float(np.linalg.norm(np.abs(F) - np.abs(G)) / np.linalg.norm(F))


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


def _alike(distance: float, apart) -> list[Statement | Measurement]:
    """Whether the two spectra are "very similar"."""
    return [
        Statement("The two spectra of Fig. 6's light on the receiver are very similar: magnitudes "
                  "differ by", "very similar", distance, alike("very similar"), "D05 §4 Fig. 8",
                  "of their norm",
                  reason="Angles lie closer than slopes by 1 + v^2, so frequencies grow by that: "
                  "light of a spread of 0.35 in slope, to 35 degrees and more, is stretched by a "
                  "fifth and more; up to a spread of about 0.2 the spectra are alike."),
        *(Measurement(f"... light of a spread of {s:g} in slope", d, "of their norm")
          for s, d in zip(SPREADS, apart, strict=True)),
    ]  # fmt: skip


def _bandwidths(degrees, spread, packet) -> list[Statement | Measurement]:
    """Whether bandwidths are the same."""

    def at(curve, angle):
        return float(np.interp(angle, degrees, curve) - 1.0)

    def off(kind, curve, angle, reason):
        return Statement(f"{kind} {angle:g} degrees, in angles over in slopes, less 1", NO_ERROR,
                         at(curve, angle), at_most(ALIKE, f"'{NO_ERROR}': a tenth"),
                         "D05 §4", reason=reason)  # fmt: skip

    whole = ("A slope's derivative by the angle is 1 / cos^2, 1.33 at 30 and 2 at 45 degrees: 99 % "
             "of the energy reaches a tenth farther beyond 27 degrees.")  # fmt: skip
    local = ("A frequency grows as the slope's derivative by the angle, 1 / cos^2: a tenth is "
             "exceeded beyond 17 degrees from the central ray.")  # fmt: skip
    exact = float(np.max(np.abs(packet * np.cos(np.radians(degrees)) ** 2 - 1.0)))
    return [
        *(off("Bandwidth of light within", spread, a, whole) for a in (10.0, 30.0, 45.0)),
        *(off("Frequency of a packet at", packet, a, local) for a in (10.0, 30.0, 45.0)),
        Measurement("Angle within which the bandwidth is a tenth larger",
                    float(np.interp(1.0 + ALIKE, spread, degrees)), "degrees"),
        Statement("Corrected, the frequency is multiplied by 1 / cos^2: largest departure", 0.0,
                  exact, at_most(ALIKE**2, "the packet's own width"), OURS, "relative"),
    ]  # fmt: skip
