"""Texture: stripes that are neither even nor odd about the light's centre."""

import numpy as np

from firstorder.checks.cases import FREQUENCIES, GRID, RAYS, bell, light
from firstorder.checks.cases.products.reflection import OUT
from firstorder.checks.faults import Fault, twin, twin_law
from firstorder.checks.squares import Case
from firstorder.fields import Grid
from firstorder.transport import Texture, wave

CASES = (
    Case(
        "texture",
        Texture(wave(0.8, 0.35, 0.7, 0.6, frame=OUT), window=GRID),
        light(OUT),
        GRID,
        FREQUENCIES,
        RAYS,
        lambda u: bell(*u) * (0.6 + 0.35 * float(np.cos(1.6 * np.pi * u[0] + 0.7))),
        wavelet_grid=Grid.spanning((16, 8), (3.0, 3.0)),
        expected={"covariance": "refused"},
    ),
)


def _pattern(*args, axis="x"):
    return lambda s: Texture(wave(*args, axis=axis, frame=OUT), s.window)


EVERY = ("value", "gradient", "hessian", "spectrum", "wavelet")
FAULTS = (
    Fault("the stripes the other way", _pattern(0.8, 0.35, -0.7, 0.6), EVERY),
    Fault("drop the 2 pi", _pattern(0.8 / (2 * np.pi), 0.35, 0.7, 0.6), EVERY),
    Fault("stripes over the angle", _pattern(0.8, 0.35, 0.7, 0.6, axis="theta"), EVERY),
    Fault("forget the mean", _pattern(0.8, 0.35, 0.7, 0.0), EVERY),
    Fault(
        "forget T_x",
        lambda s: twin_law(
            s, lambda m: twin(m, push=lambda self, j, u: j.scaled(self.factor.at(u)))
        ),
        ("gradient", "hessian"),
    ),
)
