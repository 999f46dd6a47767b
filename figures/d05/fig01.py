"""D05 Fig. 1: spectra of the light field at several places of a scene in space, along one path.

The paper shows its 3D scene without numbers. Ours goes on from that of Fig. 6 (3D): a round light
(Gaussian, 0.15 m and 0.3 in slopes), balls of radius 0.12 m a metre away, a metre more to a glossy
ball of radius 2 m that the central ray meets at 40 degrees (lobe of 0.08 rad), and half a metre on.
Upper row: n^4 rays traced against the balls and off the curved, glossy surface (a paraboloid with
the ball's curvature), windowed, transformed with padding, and averaged over rings of spatial and of
angular frequency. Lower row: the prediction of the same path in four coordinates, its last steps by
`GlossyPatch`, D05's §5.2 with the cosine that it leaves out. Aliasing is there, as in the paper's.
"""

from __future__ import annotations

import jax.numpy as jnp
import numpy as np

from figures.d05.shared import receiver, space
from figures.style import Claim, Drawing
from firstorder import plotting

RADIUS, ASLANT, SIGMA, ON = 2.0, np.deg2rad(40.0), 0.08, 0.5
SHAPE = -np.eye(2) / RADIUS
TITLES = (
    "1 at the light",
    "2 before the blockers",
    "3 behind them",
    "4 at the ball",
    "5 off the ball",
    "6 further on",
)


def draw(quick: bool) -> Drawing:
    n = 12 if quick else 24
    balls = space.Balls.jittered(0.4)
    steps = _steps(balls, n, 24 if quick else 44, 3 if quick else 5)
    figure, axes = plotting.panels(2, 6, 2.3, 2.3)
    receiver.draw_steps(axes, steps)
    claims = [c for k, s in enumerate(steps) for c in s.claims(k < 2)]
    arrays = {}
    for k, step in enumerate(steps):
        names = "measured", "predicted", "Omega_x", "Omega_v"
        arrays |= {f"{a}_{k + 1}": b for a, b in zip(names, step.rings(), strict=True)}
    claims += [*_effects(steps), *_cosine(balls, steps[5], 24 if quick else 44)]
    return Drawing(figure, arrays, claims, size=f"{n}^4 rays a step", seed=7)


def _steps(balls, n: int, harmonics: int, nodes: int) -> list[receiver.Step]:
    """Light, balls, glossy ball, and on."""
    p = [space.source()]
    p.append(space.travelled(p[0], space.FIRST))
    p.append((p[1][0].blocked(), p[1][1].blocked()))
    p.append(space.turned(space.travelled(p[2], space.SECOND)))
    p.append(space.glossy(p[3], jnp.asarray(SHAPE), ASLANT, SIGMA))
    p.append(_on(p[3], SHAPE))

    def off(x, y, v, w, far=0.0):
        at = x + far * v, y + far * w, v, w
        return space.reflected(*at, balls, SHAPE, ASLANT, SIGMA, nodes)

    lights = (
        space.emitted,
        lambda *u: space.outgoing(*u, None, space.FIRST),
        lambda *u: space.outgoing(*u, balls, space.FIRST),
        lambda *u: space.arrived(*u, balls),
        off,
        lambda *u: off(*u, far=ON),
    )
    windows = [space.Window(0.4, 0.5, n)] + [space.Window(0.35, 0.3, n)] * 5
    series, found = balls.series(harmonics), []
    for k, (title, light, pairs, window) in enumerate(zip(TITLES, lights, p, windows, strict=True)):
        predicted = space.predicted(pairs, window, series if k > 1 else None)
        found.append(receiver.Step(title, window, window.power(light), predicted))
    return found


def _on(pairs, shape) -> space.Pairs:
    """From the ball's plane off it and on."""
    return space.travelled(space.glossy(pairs, jnp.asarray(shape), ASLANT, SIGMA), ON)


def _cosine(balls, last, harmonics: int) -> list[Claim]:
    """The last step with the shear as D05 prints it: k, not k cos, across the plane."""
    p = space.travelled(space.source(), space.FIRST)
    p = space.turned(space.travelled((p[0].blocked(), p[1].blocked()), space.SECOND))
    found = []
    for name, across in (("with the cosine", 1.0), ("as printed", 1.0 / np.cos(ASLANT))):
        pairs = _on(p, SHAPE @ np.diag([1.0, across]))
        power = space.predicted(pairs, last.window, balls.series(harmonics))
        f = last.window.frequencies
        apart = space.moments_apart(
            space.moments(last.measured, *f, 0.5)[1:], space.moments(power, *f, 0.5)[1:]
        )
        found.append(
            Claim(
                f"6 further on: moments over (y, w), shear {name}, differ by",
                0.0,
                apart,
                "of the deviations",
                apart < 0.03,
            )
        )
    return found


def _effects(steps) -> list[Claim]:
    """What the paper's caption says, by rays."""
    _, there, behind, arrived, off, _ = (s.extent() for s in steps)
    spatial, angular, kept = behind[0] / there[0], arrived[1] / behind[1], off[1] / arrived[1]
    return [
        Claim(
            "blockers result in higher spatial frequency: root mean square, times",
            "higher",
            spatial,
            "",
            spatial > 1.1,
        ),
        Claim(
            "travel transfers these to the angular domain: root mean square, times",
            "transfers",
            angular,
            "",
            angular > 1.1,
        ),
        Claim(
            "the glossy ball lets through less of the angular frequencies, times",
            "low-pass (§4.1)",
            kept,
            "",
            kept < 1.0,
        ),
    ]
