"""BRDF convolution: one lobe for all points."""

import equinox as eqx
import numpy as np

from firstorder.checks.cases import FLATLAND, FREQUENCIES, RAYS, bell, light
from firstorder.checks.faults import Fault, twin, twin_law
from firstorder.checks.squares import Case
from firstorder.conventions import Frame
from firstorder.fields import Covariance, GaussianProfile, Grid
from firstorder.transport import Reflection

OUT = Frame(FLATLAND.coordinates, "outgoing")


def blurred(lobe):
    """The shading integral by the trapezoid rule, which is spectrally accurate for bells."""

    def brute(u):
        omega = np.linspace(-6.0, 6.0, 4001)
        light_there = np.array([bell(u[0], w) for w in omega])
        return float(np.sum(light_there * lobe(u[0], u[1] - omega)) * (omega[1] - omega[0]))

    return brute


def gauss(t, sigma):
    """Normalised bell in plain NumPy."""
    return np.exp(-0.5 * (t / sigma) ** 2) / (sigma * np.sqrt(2.0 * np.pi))


GLOSSY = GaussianProfile(0.25, frame=OUT, weight=0.9)
CASES = (
    Case(
        "reflection",
        Reflection(GLOSSY, nodes=80),
        light(OUT),
        Grid.spanning((64, 65), (4.5, 5.0)),
        FREQUENCIES,
        RAYS,
        blurred(lambda x, t: 0.9 * gauss(t, 0.25)),
        expected={"wavelet": "refused"},
    ),
)


def _lobe(sigma, weight):
    return lambda s: eqx.tree_at(
        lambda r: r.lobe, s, GaussianProfile(sigma, frame=OUT, weight=weight)
    )


EVERY = ("value", "gradient", "hessian", "spectrum")
FAULTS = (
    Fault("twice as rough", _lobe(0.5, 0.9), (*EVERY, "covariance")),
    Fault("variance for standard deviation", _lobe(0.0625, 0.9), (*EVERY, "covariance")),
    Fault("forget the albedo", _lobe(0.25, 1.0), EVERY),
    Fault(
        "blurring widens the spectrum",
        lambda s: twin_law(
            s,
            lambda c: twin(
                c,
                covariance=lambda self, S: Covariance(
                    S.matrix.at[1, 1].add(self.kernel.spread()), S.frame
                ),
            ),
        ),
        ("covariance",),
    ),
)
