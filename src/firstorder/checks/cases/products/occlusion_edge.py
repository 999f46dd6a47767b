"""Occlusion by sharp edges: half-plane, slit, comb and grating, of any transparency.

The spectrum is compared with samples of a field that jumps. Their transform has the error of the
midpoint rule across the edge, which is oblique to the grid (the blockers stand at a depth), so
that the errors of its rows average out; what is left is below 1e-3 here and falls with the square
of the step: `GRID_ERROR`. `products.shadow` compares the same edges at 1e-9, where the light is
smooth again.
"""

import numpy as np

from firstorder.checks.cases import RAYS, bell, light
from firstorder.checks.faults import Fault, twin
from firstorder.checks.squares import Case
from firstorder.conventions import FLATLAND_SLOPE
from firstorder.fields import Grid
from firstorder.fields.mask import half_plane
from firstorder.laws import Move, Multiply
from firstorder.transport.events.occlusion import (
    Occlusion,
    comb_blocker,
    grating_blocker,
    slit_blocker,
)

GRID = Grid.spanning((512, 513), (4.5, 3.5))
WINDOW = Grid.spanning((192, 192), (4.5, 3.5))
DEPTH, LET_THROUGH = 0.7, 0.25
GRID_ERROR = 1e-3
FRAME = FLATLAND_SLOPE
# The last ones are near the first replica of the grating, 1 / 0.6 = 1.67 cycles per metre.
FREQUENCIES = (np.array([-0.45, 0.0, 0.33, 1.6]), np.array([-1.0, -0.5, 0.05, 0.4]))


def met(u) -> float:
    """Point on the blocker's line that the ray from the receiver crosses."""
    x, v = u
    along = np.array([-np.sin(np.arctan(v)), np.cos(np.arctan(v))])
    return x + DEPTH / along[1] * along[0]


def behind(blocks):
    """The light, dimmed where the ray meets the blocker."""
    return lambda u: bell(*u) * (LET_THROUGH if blocks(met(u)) else 1.0)


BLOCKERS = {
    "half-plane": (
        Occlusion(half_plane(0.1, LET_THROUGH, 1.0, "x", FRAME), DEPTH, WINDOW),
        lambda x: x < 0.1,
    ),
    "slit": (
        slit_blocker(-0.5, 0.3, FRAME, LET_THROUGH, DEPTH, WINDOW),
        lambda x: not -0.5 < x < 0.3,
    ),
    "comb": (
        comb_blocker(0.6, 3, FRAME, 0.4, LET_THROUGH, DEPTH, WINDOW),
        lambda x: any(abs(x - c) < 0.18 for c in (-0.6, 0.0, 0.6)),
    ),
    "grating": (
        grating_blocker(0.6, FRAME, 0.4, LET_THROUGH, DEPTH, WINDOW),
        lambda x: abs((x + 0.3) % 0.6 - 0.3) > 0.12,
    ),
}
CASES = tuple(
    Case(
        f"occlusion, {name}",
        step,
        light(FRAME),
        GRID,
        FREQUENCIES,
        RAYS,
        behind(blocks),
        Grid.spanning((16, 16), (3.0, 3.0)),
        bounds={"spectrum": GRID_ERROR},
        expected={"covariance": "refused"},
    )
    for name, (step, blocks) in BLOCKERS.items()
)


def upwards(frame):
    """The shear of the wrong sign."""
    return Move(np.array([[1.0, DEPTH], [0.0, 1.0]]), to=frame)


FAULTS = (
    Fault(
        "let all light through",
        lambda s: Occlusion(half_plane(-9.0, 0.0, 1.0, "x", FRAME), 0.0, WINDOW),
        ("value", "gradient", "hessian", "spectrum", "wavelet"),
    ),
    Fault(
        "do not shear the blocker",
        lambda s: Occlusion(s.transparency, 0.0, WINDOW),
        ("spectrum", "wavelet"),
    ),
    Fault(
        "shear it the other way",
        lambda s: twin(s, law=lambda s, frame: Multiply(upwards(frame)(s.transparency), WINDOW)),
        ("spectrum", "wavelet"),
    ),
    Fault(
        "forget to dim the gradient",
        lambda s: twin(
            s,
            law=lambda s, frame: twin(
                Occlusion.law(s, frame), push=lambda m, jet, u: jet.scaled(0.5)
            ),
        ),
        ("gradient", "hessian"),
    ),
    Fault(
        "half the light",
        lambda s: Occlusion(0.5 * s.transparency, s.depth, WINDOW),
        ("value", "gradient", "hessian", "spectrum", "wavelet"),
    ),
    Fault(
        "blocker and opening exchanged",
        lambda s: Occlusion(
            half_plane(-9.0, 0.0, 1.0 + LET_THROUGH, "x", FRAME) + (-1.0) * s.transparency,
            s.depth,
            WINDOW,
        ),
        ("value", "gradient", "hessian", "spectrum", "wavelet"),
    ),
)
