"""D05 Fig. 11: a simple caustic. A parallel beam on a concave mirror converges to a focal point.

The paper gives no numbers. Ours: a beam 0.25 m wide and parallel within 0.02 rad (a Dirac in angle
cannot be drawn), a mirror of curvature 0.8 rad/m: a valley, positive in the library's convention
and negative in D05's. Below: rays traced off a circle of the same curvature, for the aberration
that n = k x leaves out.
"""

from __future__ import annotations

import equinox as eqx
import jax.numpy as jnp
import numpy as np

from figures.style import Drawing
from figures.verdicts import OURS, Statement, at_least, near
from firstorder import plotting
from firstorder.fields import gaussian
from firstorder.laws import Integrate
from firstorder.transport import Curvature, Mirror, Travel
from firstorder.transport.events.slopes import ToSlope

KAPPA, WIDTH, SPREAD = 0.8, 0.25, 0.02
FOCUS = 1.0 / (2.0 * KAPPA)


def draw(quick: bool) -> Drawing:
    n = 121 if quick else 361
    x, v = np.linspace(-0.8, 0.8, n), np.linspace(-1.2, 1.2, n)
    Ox, Ov = np.linspace(-12.0, 12.0, n), np.linspace(-12.0, 12.0, n)
    path = gaussian((0.0, 0.0), (WIDTH, SPREAD)) >> _mirror(KAPPA) >> Travel(FOCUS)
    chosen = {"incoming beam": 0, "after the mirror": 4, "at the focus": 5}

    figure, axes = plotting.panels(2, 4, 2.7, 2.5)
    arrays = {"x": x, "v": v, "Omega_x": Ox, "Omega_v": Ov}
    for c, (name, step) in enumerate(chosen.items()):
        names = ("x", "theta") if step == 0 else ("x", "v")
        light = np.asarray(eqx.filter_jit(lambda f: f(x[:, None], v))(path.steps[step]))
        F = np.asarray(eqx.filter_jit(lambda F: F(Ox[:, None], Ov))(path.spectra[step]))
        title = f"{'abc'[c]}) {name}"
        plotting.show_light_field(axes[0, c], light, x, v, names=names, title=title, limit=1.0)
        plotting.show_spectrum(axes[1, c], F, Ox, Ov, names=names, decades=4.0, equal=True)
        arrays |= {f"light_{step}": light, f"spectrum_{step}": F}
    aberration = _scene(axes[0, 3])
    d = np.linspace(0.5, 1.5, 41 if quick else 161) * FOCUS
    valley, hill = (_irradiance_width(k, d) for k in (KAPPA, -KAPPA))
    ax = axes[1, 3]
    ax.plot(d, valley, label="valley")
    ax.plot(d, hill, label="hill")
    ax.axvline(FOCUS, color="0.6", linewidth=0.8, linestyle=":")
    ax.set(
        xlabel=plotting.label("d"), ylabel="width of the light (m)", title="e) width over distance"
    )
    ax.set_ylim(bottom=0.0)
    ax.legend()

    found = float(d[np.argmin(valley)])
    curves = {"width": {"d": d, "valley": valley, "hill": hill}}
    claims = _claims(found, float(np.min(valley)), hill, aberration)
    return Drawing(figure, arrays, claims, curves, size=f"{n} x {n} rays")


def _claims(found, least, hill, aberration) -> list[Statement]:
    spreads = np.array([4.0, 2.0, 1.0]) * SPREAD
    left = [_angular_left(s) for s in spreads]
    order = float(np.polyfit(np.log(spreads), np.log(left), 1)[0])
    focus, beam = near(FOCUS, 0.02, "the distances tried"), SPREAD * FOCUS
    return [
        Statement("The beam converges to a focal point, at 1 / (2 k)", FOCUS, found, focus,
                  "D05 §4.2", "m"),
        Statement("Width there, beside what the beam's own spread makes of a Dirac", beam, least,
                  near(beam, 0.02, "the distances tried"), "D05 §4.2", "m"),
        Statement("At the focal point all energy is in space: the angular frequencies that are "
                  "left fall as the beam's spread to this power", 1.0, order,
                  near(1.0, 0.01, "a parallel beam leaves none"), "D05 §4.2",
                  scanned="spreads of 0.08, 0.04 and 0.02 rad"),
        Statement("A hill of the same curvature only widens the beam: least growth from one "
                  "distance to the next", None, float(np.min(hill[1:] / hill[:-1])),
                  at_least(1.0, "wider"), OURS),
        Statement("A circular mirror misses the focus by this power of its aperture", 2.0,
                  aberration, near(2.0, 0.025, "what n = k x leaves out, to first order"), OURS),
    ]  # fmt: skip


def _mirror(kappa: float):
    """Reflection off a surface of this curvature, leaving over slopes: v = theta, as in D05."""
    bent = Curvature(kappa) >> Mirror() >> Curvature(kappa, back=True)
    return bent >> ToSlope().linearised(jnp.zeros(2))


def _angular_left(spread: float) -> float:
    """Angular frequency at the focus over that at the mirror, root mean squares."""
    at_mirror = _mirror(KAPPA)(gaussian((0.0, 0.0), (WIDTH, spread)).covariance())
    at_focus = Travel(FOCUS)(at_mirror)
    return float(np.sqrt(at_focus.matrix[1, 1] / at_mirror.matrix[1, 1]))


def _irradiance_width(kappa: float, distances) -> np.ndarray:
    """Standard deviation of the irradiance, from the path's covariance.

    A Gaussian of standard deviation s has the spectral variance 1 / (8 pi^2 s^2).
    """
    at_mirror = _mirror(kappa)(gaussian((0.0, 0.0), (WIDTH, SPREAD)).covariance())
    over_slopes = Integrate("v", -9.0, 9.0)
    variances = [float(over_slopes(Travel(d)(at_mirror)).matrix[0, 0]) for d in distances]
    return 1.0 / np.sqrt(8.0 * np.pi**2 * np.array(variances))


def _scene(ax) -> float:
    """Rays off a circle of curvature KAPPA; returns the fitted order of their miss."""
    R = 1.0 / KAPPA
    place = np.linspace(-0.55, 0.55, 13)
    bend = np.arcsin(place / R)
    points = np.stack([place, R - R * np.cos(bend)], -1)
    arc = np.linspace(-0.5, 0.5, 81)
    plotting.map_axes(ax, "d) traced on a circle")
    plotting.draw_surface(ax, np.stack([R * np.sin(arc), R - R * np.cos(arc)], -1))
    plotting.draw_rays(ax, points, np.zeros(13), 0.9, color="0.75")
    plotting.draw_rays(ax, points, 2.0 * bend, 0.9)
    ax.plot([0.0], [FOCUS], "o", color="black", markersize=3)
    apertures = np.array([0.02, 0.04, 0.08, 0.16])
    crossing = R - R * np.cos(apertures) + R * np.sin(apertures) / np.tan(2.0 * apertures)
    return float(np.polyfit(np.log(apertures), np.log(np.abs(crossing - FOCUS)), 1)[0])
