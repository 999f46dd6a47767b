"""The light field of a scene, integrated under a cosine: irradiance with all its derivatives.

The scene has a lamp, and a disc and a tilted board that cross before it. The truth is
`flatland.irradiance`, which sums over the gaps of one view and knows neither fields nor laws;
`tests/flatland/light_fields/test_field.py` compares its derivatives as well, and scenes with walls,
curves and a sky that jumps.
"""

import numpy as np

from firstorder.checks.cases.laws.integrate import scaled
from firstorder.checks.cases.laws.integrate_edge import Unbroken, interior, reversed_jump, through
from firstorder.checks.faults import Fault, twin
from firstorder.checks.squares import Case
from firstorder.fields import Grid
from firstorder.flatland import (
    Circles,
    Receiver,
    Scene,
    Segments,
    irradiance,
    light_field,
    primitive,
)
from firstorder.laws import Integrate
from firstorder.transport import Cosine

HORIZON = 0.5 * np.pi
LEAN, OTHERWISE = 0.15, -0.15
X = Grid.spanning((97,), (6.0,))
FREQUENCIES = (np.array([0.0, 0.3]),)
RAYS = np.array([[0.3], [-0.4], [0.7]])


def scene(board: float = 0.6) -> Scene:
    """The scene; the height of the board's right end can be made wrong."""
    return Scene.of(
        primitive(Segments((0.9, 2.0), (-0.8, 2.3)), emission=1.0),
        primitive(Segments((0.5, board), (-0.3, 1.1)), emission=0.1),
        primitive(Circles((-0.2, 1.2), 0.25), emission=0.3),
    )


def weighted(lean: float = LEAN, board: float = 0.6):
    """Light of the scene on a leaning line, times the cosine."""
    return Cosine()(light_field(scene(board), Receiver((0.1, 0.0), lean)))


def brute(u):
    """The irradiance."""
    line = Receiver((0.1, 0.0), LEAN)
    at = Receiver(line.position + u[0] * line.tangent, line.n)
    return float(irradiance(scene(), at, nodes=32))


def instead(*wrong):
    """The law on other light, made before tracing: a traced scene is not searched for crossings."""

    def change(step):
        other = weighted(*wrong)
        return through(lambda f: other)(step)

    return change


WAVELETS = Grid.spanning((32, 32), (1.2, HORIZON))
CASES = (
    Case(
        "scene, irradiance",
        Integrate("theta", -HORIZON, HORIZON, 24),
        weighted(),
        X,
        FREQUENCIES,
        RAYS,
        brute,
        WAVELETS,
        # A jump is misplaced by at most half a sample; the ones before the lamp are one high.
        bounds={"wavelet": 0.5 * np.pi / 32},
        expected={"spectrum": "refused", "covariance": "refused", "wavelet": "approximate"},
    ),
)

JETS = ("gradient", "hessian")
EVERY = ("value", *JETS)
FAULTS = (
    Fault("do not split at the silhouettes", through(Unbroken), EVERY),
    Fault("split beside them", through(lambda f: Unbroken(f, 0.1)), EVERY),
    Fault("forget the jump", lambda s: twin(s, jet=interior), JETS),
    Fault("flip the jump", lambda s: twin(s, jet=reversed_jump), JETS),
    Fault("lean the line the other way", instead(OTHERWISE), EVERY),
    Fault("another board", instead(LEAN, 0.7), EVERY),
    Fault("forget the cosine", through(lambda f: f.operand), EVERY),
    Fault("take the mean", scaled(1.0 / np.pi), (*EVERY, "wavelet")),
    Fault("divide by 2 pi", scaled(0.5 / np.pi), ("wavelet",)),
    Fault("integrate over the position", lambda s: Integrate("x", s.lower, s.upper), ("wavelet",)),
)
