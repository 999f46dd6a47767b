"""D05 Fig. 6, the 3D row: spectra of the 4D light field at each step, by rays and predicted.

The paper's own come from photons; ours from rays through a scene like its Fig. 9(b): a round area
light (Gaussian, deviations 0.15 m and 0.3 in slopes, for which spectra have a closed form), 1 m of
travel, a layer of opaque balls of radius 0.12 m, one jittered in each cell of 0.4 m, 1 m of travel,
a diffuse receiver. 32^4 rays under a Gaussian window, padded to 48^4. The prediction is the
calculus of the 2D figure in four coordinates: shears, and a convolution with the balls' spectrum,
taken for discs. Shown: mean power over rings of spatial and of angular frequency. Samples of sharp
edges alias, as the paper says of its own; moments are therefore also compared within the inner
half of the band. Right behind the balls even those do not hold to 15 %: rays stand 0.1 m apart over
balls 0.24 m wide, and what aliases there falls back into the inner half too. At the receiver the
travel has drawn the edges' energy apart, and they agree to some 2 %.
"""

from __future__ import annotations

import numpy as np

from figures.d05.shared import receiver, space
from figures.style import Claim, Drawing
from firstorder import plotting

PERIOD = 0.4
ROUGH = ("3 blockers", "4 travel, arrival")


def draw(quick: bool) -> Drawing:
    n = 16 if quick else 32
    balls = space.Balls.jittered(PERIOD)
    series = balls.series(24 if quick else 44)
    steps = _steps(balls, series, n)
    f = np.linspace(-4.0, 4.0, 65)
    places = np.linspace(-1.6, 1.6, 24 if quick else 72)
    nodes = 40 if quick else 112
    light = receiver.irradiance(balls, places, nodes)
    measured = receiver.spectrum_of(light, places, 0.5, f)
    predicted = receiver.predicted_irradiance(balls, f, 0.5, 40 if quick else 56, 24)

    figure, axes = plotting.panels(2, 5, 2.4, 2.3)
    receiver.draw_steps(axes[:, :4], steps)
    _draw_receiver(axes[:, 4], places, light, f, measured, predicted)
    apart = np.linalg.norm(measured - predicted) / np.linalg.norm(measured)
    claims = [c for s in steps for c in s.claims(s.title not in ROUGH)]
    claims.append(
        Claim(
            "5 diffuse receiver: spectra by rays and predicted differ by",
            0.0,
            float(apart),
            "of the norm (balls are no discs)",
            float(apart) < 0.03,
        )
    )
    claims += _effects(steps, f, measured)
    arrays = {
        f"{k}_{i + 1}": getattr(s, k) for i, s in enumerate(_rings(steps)) for k in s.__dict__
    }
    arrays |= {"x": places, "light": light, "Omega": f, "measured": measured}
    arrays |= {"predicted": predicted}
    return Drawing(figure, arrays, claims, size=f"{n}^4 rays a step, {nodes}^2 a point", seed=7)


def _rings(steps):
    """What is shown, as plain arrays."""

    class Shown:
        def __init__(self, step):
            self.measured, self.predicted, self.Omega_x, self.Omega_v = step.rings()

    return [Shown(s) for s in steps]


def _steps(balls, series, n: int) -> list[receiver.Step]:
    """Source, travel, blockers, travel and arrival."""
    p = [space.source()]
    p.append(space.travelled(p[0], space.FIRST))
    p.append((p[1][0].blocked(), p[1][1].blocked()))
    p.append(space.turned(space.travelled(p[2], space.SECOND)))
    lights = (
        space.emitted,
        lambda *u: space.outgoing(*u, None, space.FIRST),
        lambda *u: space.outgoing(*u, balls, space.FIRST),
        lambda *u: space.arrived(*u, balls),
    )
    titles = ("1 source", "2 travel", *ROUGH)
    found = []
    for k, (title, light, pairs) in enumerate(zip(titles, lights, p, strict=True)):
        window = space.Window(0.4, 0.5, n) if k == 0 else space.Window(0.5, 0.35, n)
        waves = series if k > 1 else None
        predicted = space.predicted(pairs, window, waves)
        found.append(receiver.Step(title, window, window.power(light), predicted))
    return found


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


def _effects(steps, f, measured) -> list[Claim]:
    """What the paper reads off the figure."""
    _, there, blocked, arrived = (s.extent() for s in steps)
    spatial, angular = blocked[0] / there[0], arrived[1] / blocked[1]
    S = steps[1].moments()[0][0]
    slope = S[0, 1] / S[0, 0]
    window = steps[1].window
    # the window adds its own spread to the source's, sheared
    own = (2.0 * np.pi * window.x) ** -2.0 / 2.0
    expected = space.FIRST * (S[0, 0] - own) / S[0, 0]
    r, mean = receiver.ring_mean(measured, f, 24)
    pattern = float(mean[np.argmin(np.abs(r - 0.5 / PERIOD))] / mean[0])
    main = float(mean[np.argmin(np.abs(r - 1.0 / PERIOD))] / mean[0])
    return [
        Claim("blockers raise spatial frequencies by", "higher", spatial, "times", spatial > 1.1),
        Claim("the second travel raises the angular frequencies by", "pushed to the angular domain",
              angular, "times", angular > 1.1),
        Claim("the travel's shear: cross over spatial moment, beside its distance under the window",
              expected, slope, "m", abs(slope - expected) < 0.02),
        Claim("what the receiver keeps of the blockers' main frequency, magnified", None, pattern,
              "of its mean light"),
        Claim("and at the blockers' own frequency", "eliminated", main, "of its mean light",
              main < 0.02),
    ]  # fmt: skip
