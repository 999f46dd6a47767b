"""D05 Fig. 10: the seven steps of local shading, in ray space and in frequency.

The paper gives no numbers. Ours: light of 0.3 m and 0.18 rad, correlated by 0.3, that arrives at
25 degrees on a valley of curvature 0.5 rad/m with a Gaussian lobe of 0.15 rad, and is seen along
the mirrored central ray. Spectra are made by the rules of the steps alone, from that of the light;
the last one is compared with the transform of the samples. As in the library, spectra of steps 1
and 7 are those of the corrected (9) and (10), and angles grow counter-clockwise.
"""

from __future__ import annotations

import equinox as eqx
import numpy as np

from figures.d05.shared.readings import ALIKE, less, most
from figures.style import Drawing
from figures.verdicts import Measurement, Statement, at_most, near
from firstorder import plotting
from firstorder.checks.tolerance import normwise
from firstorder.conventions import FLATLAND
from firstorder.fields import GaussianProfile, Grid, discrete_transform, gaussian
from firstorder.transport import Cosine, Curvature, Mirror, Reflection
from firstorder.transport.events.incidence import Incidence, Outgoing

KAPPA, ANGLE, SIGMA = 0.5, np.radians(25.0), 0.15
STEPS = (
    "incoming",
    "1) incidence",
    "2) rotation",
    "3) cosine",
    "4) mirror",
    "5) BRDF",
    "6) rotation back",
    "7) outgoing",
)


def draw(quick: bool) -> Drawing:
    n = 48 if quick else 128
    x, theta = np.linspace(-1.2, 1.2, n), np.linspace(-1.2, 1.2, n)
    Ox, Ot = np.linspace(-2.4, 2.4, n + 1), np.linspace(-2.4, 2.4, n + 1)
    path = (
        gaussian((0.0, 0.0), (0.3, 0.18), 0.3)
        >> Incidence(ANGLE)
        >> Curvature(KAPPA)
        >> Cosine(window=Grid.spanning((2, 72), (3.0, 3.2)))
        >> Mirror()
        >> Reflection(GaussianProfile(SIGMA, frame=FLATLAND.turned()), nodes=48)
        >> Curvature(KAPPA, back=True)
        >> Outgoing(-ANGLE)
    )
    light = [eqx.filter_jit(lambda f: f(x[:, None], theta[None, :]))(f) for f in path.steps]
    spectra = [eqx.filter_jit(lambda F: F(Ox[:, None], Ot[None, :]))(F) for F in path.spectra]
    light, spectra = [np.asarray(a) for a in light], [np.asarray(a) for a in spectra]

    figure, axes = plotting.panels(2, 8, 1.75, 2.05)
    for c, step in enumerate(STEPS):
        plotting.show_light_field(
            axes[0, c], light[c], x, theta, limit=1.0, equal=True, title=step, scale=False
        )
        plotting.show_spectrum(
            axes[1, c], spectra[c], Ox, Ot, decades=4.0, reference=0.42, equal=True, scale=False
        )
        for ax in axes[:, c] if c else ():
            ax.set_ylabel("")
            ax.tick_params(labelleft=False)
    figure.suptitle(
        "radiance 0 to 1, spectra over 4 decades from 0.42", fontsize=8, x=0.99, ha="right"
    )
    arrays = {"x": x, "theta": theta, "Omega_x": Ox, "Omega_theta": Ot}
    arrays |= {f"light_{i}": a for i, a in enumerate(light)}
    arrays |= {f"spectrum_{i}": a for i, a in enumerate(spectra)}
    claims = _claims(path, light, spectra, x, theta, Ox, Ot)
    return Drawing(figure, arrays, claims, size=f"{n} x {n} rays, {n + 1} x {n + 1} frequencies")


def _claims(path, light, spectra, x, theta, Ox, Ot) -> list[Statement | Measurement]:
    grid = Grid((len(x), len(theta)), (float(x[1] - x[0]), float(theta[1] - theta[0])))
    sampled = discrete_transform(light[-1], grid, Ox[::8], Ot[::8])
    seen = normwise(spectra[-1][::8, ::8], sampled)
    up = [np.sqrt(_moment(F, Ox, Ot)[1, 1]) for F in spectra]
    slopes = [S[0, 1] / S[1, 1] for S in (_moment(F, Ox, Ot) for F in spectra)]
    blur = up[3] / up[2]
    shear = slopes[2] - slopes[1]
    back = slopes[5] - slopes[6]  # the mirror has turned the slope that step 2 gave
    turned = abs(slopes[4] + slopes[3])
    within = near(KAPPA, 0.01, "D05 (11), to the band that is drawn")
    angles, lights = np.radians(np.arange(0.0, 81.0, 5.0)), np.geomspace(0.03, 0.3, 11)
    growth = np.array([[_blur(a, s) for a in angles] for s in lights])
    return [
        Statement("The spectrum by rules alone is the transform of the light that leaves", 0.0,
                  seen, at_most(0.01, "the window that cuts the samples"), "D05 Fig. 10",
                  "normwise"),
        Statement("Step 2 shears the spectrum by k", KAPPA, shear, within, "D05 (11)", "rad/m"),
        Statement("Step 3, the cosine, has only a small blurring effect: growth of the angular "
                  "frequencies, root mean square", "small", blur - 1.0,
                  at_most(ALIKE, "'small': a tenth"), "D05 §4.1"),
        Statement("... share of lights for which that is so", "small",
                  float(np.mean(growth < ALIKE)), most("small"), "D05 §4.1",
                  scanned="light of 0.03 to 0.3 rad, at 0 to 80 degrees"),
        Measurement("... least width times tangent of the angle, of those for which it is not",
                    float(np.min((lights[:, None] * np.tan(angles))[growth >= ALIKE])), "rad"),
        Statement("Step 4 turns the slope of the spectrum over: what is left of the sum", 0.0,
                  turned, at_most(1e-6, "rounding"), "D05 (14)", "rad/m"),
        Statement("Step 5, the BRDF, band-limits the light: angular frequencies, times", "less",
                  up[5] / up[4], less("low-pass"), "D05 §4.2"),
        Statement("Step 6 shears on by k, the way that the mirror has turned", KAPPA, back, within,
                  "D05 §4.1", "rad/m"),
    ]  # fmt: skip


def _blur(angle: float, sigma: float) -> float:
    """By how much the cosine raises the angular frequencies of a Gaussian light, less 1.

    The mean square of the frequencies is that of the derivative, by Parseval.
    """
    t = np.linspace(-0.5 * np.pi, 0.5 * np.pi, 4001)
    bell = np.exp(-0.5 * ((t - angle) / sigma) ** 2)
    slope = -(t - angle) / sigma**2 * bell
    lit, changed = np.cos(t) * bell, np.cos(t) * slope - np.sin(t) * bell
    mean = [np.sum(d**2) / np.sum(f**2) for d, f in ((changed, lit), (slope, bell))]
    return float(np.sqrt(mean[0] / mean[1]) - 1.0)


def _moment(F, Ox, Ot) -> np.ndarray:
    """Second moments of the power on the drawn band."""
    power = np.abs(F) ** 2
    W = np.stack(np.meshgrid(Ox, Ot, indexing="ij"))
    return np.einsum("ixy,jxy,xy->ij", W, W, power) / np.sum(power)
