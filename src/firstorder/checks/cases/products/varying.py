"""Spatially varying BRDFs: a roughness that varies, and a blend of two fixed lobes."""

import equinox as eqx
import numpy as np

from firstorder.checks.cases import FREQUENCIES, RAYS, light
from firstorder.checks.cases.products.reflection import GLOSSY, OUT, blurred, gauss
from firstorder.checks.faults import Fault
from firstorder.checks.squares import Case
from firstorder.fields import GaussianProfile, Grid
from firstorder.transport import Blend, Reflection, VaryingGaussian, wave

PERIOD = 2.4
WINDOW = Grid.spanning((96, 8), (6.0, 6.0))  # five periods
DULL = GaussianProfile(0.6, frame=OUT, weight=0.7)


def _wave(amplitude, mean, period=PERIOD):
    return wave(1.0 / period, amplitude, 0.4, mean, frame=OUT)


def _swing(x):
    return np.cos(2.0 * np.pi * x / PERIOD + 0.4)


def _case(name, lobe, plain) -> Case:
    return Case(
        name,
        Reflection(lobe, nodes=128, window=WINDOW),
        light(OUT),
        Grid.spanning((64, 65), (4.5, 5.5)),
        FREQUENCIES,
        RAYS,
        blurred(plain),
        expected={"wavelet": "refused", "covariance": "refused"},
    )


CASES = (
    _case(
        "spatially varying BRDF",
        VaryingGaussian(_wave(0.1, 0.35), 0.45),
        lambda x, t: gauss(t, 0.35 + 0.1 * _swing(x)),
    ),
    _case(
        "blend of BRDFs",
        Blend((GLOSSY, DULL), (_wave(0.4, 0.5), _wave(-0.4, 0.5))),
        lambda x, t: (
            (0.5 + 0.4 * _swing(x)) * 0.9 * gauss(t, 0.25)
            + (0.5 - 0.4 * _swing(x)) * 0.7 * gauss(t, 0.6)
        ),
    ),
)


def _both(varying, weights):
    """Wrong twins of the two lobes: each file's faults hold for all of its cases."""

    def change(s):
        wrong = varying if isinstance(s.lobe, VaryingGaussian) else Blend((GLOSSY, DULL), weights)
        return eqx.tree_at(lambda r: r.lobe, s, wrong)

    return change


EVERY = ("value", "gradient", "hessian", "spectrum")
FAULTS = (
    Fault(
        "the same BRDF everywhere",
        _both(VaryingGaussian(_wave(0.0, 0.35), 0.45), (_wave(0.0, 0.5), _wave(0.0, 0.5))),
        EVERY,
    ),
    Fault(
        "the pattern upside down",
        _both(VaryingGaussian(_wave(-0.1, 0.35), 0.45), (_wave(-0.4, 0.5), _wave(0.4, 0.5))),
        EVERY,
    ),
    Fault(
        "a pattern twice as fine",
        _both(
            VaryingGaussian(_wave(0.1, 0.35, 1.2), 0.45),
            (_wave(0.4, 0.5, 1.2), _wave(-0.4, 0.5, 1.2)),
        ),
        EVERY,
    ),
)
