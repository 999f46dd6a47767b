"""Fresnel reflectance of glass, and of a thinner medium with total reflection."""

import jax.numpy as jnp
import numpy as np

from firstorder.checks.cases import FREQUENCIES, bell, light
from firstorder.checks.faults import Fault, twin, twin_law
from firstorder.checks.squares import Case
from firstorder.fields import Function, Grid
from firstorder.laws import Multiply
from firstorder.transport import AngularFactor, Fresnel, Transmission

RAYS = np.array([[0.3, 0.1], [-0.4, 0.45], [0.7, -0.35], [0.1, 1.2]])
GRID = Grid.spanning((48, 2048), (4.0, 4.0))
WINDOW = Grid.spanning((48, 240), (4.0, 4.0))


def reflectance(eta, t):
    """Fresnel's sine and tangent formulas, which the library does not use."""
    t = abs(t)
    if t >= 0.5 * np.pi or np.sin(t) >= eta:
        return 1.0
    b = np.arcsin(np.sin(t) / eta)
    if t < 1e-9:
        return ((eta - 1.0) / (eta + 1.0)) ** 2
    s = np.sin(t - b) / np.sin(t + b)
    p = np.tan(t - b) / np.tan(t + b)
    return float(0.5 * (s * s + p * p))


def _across(theta) -> float:
    """The light at one angle, summed over space: Gaussian, by its moments."""
    return sum(bell(x, theta) for x in np.linspace(-4.0, 4.0, 161)) * 0.05


def _missed(rule, breaks, plain) -> float:
    """Error of the samples' own spectrum: what the midpoint rule misses at the breaks.

    Relative to the integral of the product, the peak of its spectrum.
    """
    angles = np.linspace(-1.57, 1.57, 400)
    total = sum(plain(t) * _across(t) for t in angles) * (angles[1] - angles[0])
    return float(1e-9 + rule * sum(map(_across, breaks)) / total)


def _case(name, factor, plain, rule, *breaks) -> Case:
    return Case(
        name,
        AngularFactor(factor, WINDOW),
        light(),
        GRID,
        FREQUENCIES,
        RAYS,
        lambda u: bell(*u) * plain(u[1]),
        wavelet_grid=Grid.spanning((8, 16), (3.0, 3.0)),
        bounds={"spectrum": _missed(rule, breaks, plain)},
        expected={"covariance": "refused"},
    )


H, GRAZING, CRITICAL = GRID.step[1], 0.5 * np.pi, float(np.arcsin(0.7))
KINK = 6.0 * H**2 / 12.0  # the slope of R at grazing incidence on glass is 5.8
ROOT = 0.21 * 8.6 * H**1.5  # 1 - R = 8.5 sqrt(theta_c - theta) inside; |zeta(-1/2)| = 0.208
CASES = (
    _case("fresnel", Fresnel(1.5), lambda t: reflectance(1.5, t), KINK, -GRAZING, GRAZING),
    _case(
        "total reflection", Fresnel(0.7), lambda t: reflectance(0.7, t), ROOT, -CRITICAL, CRITICAL
    ),
    _case(
        "transmission",
        Transmission(1.5),
        lambda t: 1.5 * (1.0 - reflectance(1.5, t)),
        1.5 * KINK,
        -GRAZING,
        GRAZING,
    ),
)

EVERY = ("value", "gradient", "hessian", "spectrum", "wavelet")


def _s_only(factor):
    """Light of one polarisation."""

    def at(x, theta):
        c = jnp.cos(theta)
        g = jnp.sqrt(jnp.maximum(factor.eta**2 - 1.0 + c**2, 1e-12))
        return ((c - g) / (c + g)) ** 2 + 0.0 * x

    return Function(at)


FAULTS = (
    Fault(
        "one polarisation only",
        lambda s: twin_law(s, lambda m: Multiply(_s_only(m.factor), m.window)),
        EVERY,
    ),
    Fault(
        "the inverse index",
        lambda s: AngularFactor(type(s.factor)(1.0 / s.factor.eta), s.window),
        EVERY,
    ),
    Fault(
        "the amplitude, not the power",
        lambda s: twin_law(
            s,
            lambda m: Multiply(
                Function(lambda x, t: jnp.sqrt(m.factor.at(jnp.stack([x, t])))), m.window
            ),
        ),
        EVERY,
    ),
    Fault(
        "forget the slope of R",
        lambda s: twin_law(
            s, lambda m: twin(m, push=lambda self, j, u: j.scaled(self.factor.at(u)))
        ),
        ("gradient", "hessian"),
    ),
)
