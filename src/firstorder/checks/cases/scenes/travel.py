"""Travel of a scene's light: from one line to another, with nothing in between.

The lamp shines unevenly, so that there are derivatives to compare. By brute force the rays of the
far line are followed among the same shapes, in plain NumPy: a segment by two equations, a circle by
a quadratic one.
"""

import jax.numpy as jnp
import numpy as np

from firstorder.checks.cases import FREQUENCIES, GRID
from firstorder.checks.faults import Fault, twin_law
from firstorder.checks.squares import Case
from firstorder.conventions import FLATLAND_SLOPE
from firstorder.flatland import Circles, Receiver, Scene, Segments, light_field, primitive
from firstorder.laws import Move
from firstorder.transport import Travel

D = 0.8
LAMP = np.array([[0.9, 2.0], [-0.8, 2.3]])
DISC, RADIUS = np.array([-0.2, 1.4]), 0.25
POSITION, LEAN = np.array([0.1, 0.9]), 0.15
# One ray to the lamp on each side of the disc, and one to the disc.
RAYS = np.array([[0.5, 0.1], [-0.6, -0.15], [0.1, 0.35]])


def radiance(number, s, front, along):
    """Radiance that the shapes send: the lamp from its front, the disc everywhere."""
    uneven = 1.0 + 0.5 * jnp.sin(3.0 * s) + 0.2 * along[0] ** 2
    return jnp.where(number == 0, jnp.where(front, uneven, 0.0), 0.3 + 0.1 * jnp.cos(5.0 * s))


SCENE = Scene.of(primitive(Segments(*LAMP)), primitive(Circles(DISC, RADIUS)))


def brute(u):
    """Follow one ray of the line that lies D farther from the lamp."""
    tangent, normal = np.array([[np.cos(LEAN), np.sin(LEAN)], [-np.sin(LEAN), np.cos(LEAN)]])
    start = POSITION - D * normal + u[0] * tangent
    along = (normal - u[1] * tangent) / np.hypot(1.0, u[1])
    gap = start - DISC
    half = gap @ along
    root = half**2 - gap @ gap + RADIUS**2
    if root > 0.0 and half < 0.0:
        point = gap - (half + np.sqrt(root)) * along
        turns = np.mod(np.arctan2(point[0], point[1]) / (2.0 * np.pi), 1.0)
        return 0.3 + 0.1 * np.cos(5.0 * turns)
    t, s = np.linalg.solve(np.stack([along, LAMP[0] - LAMP[1]], 1), LAMP[0] - start)
    lit = t > 0.0 and 0.0 <= s <= 1.0
    return 1.0 + 0.5 * np.sin(3.0 * s) + 0.2 * along[0] ** 2 if lit else 0.0


CASES = (
    Case(
        "scene, travel",
        Travel(D),
        light_field(SCENE, Receiver(POSITION, LEAN), frame=FLATLAND_SLOPE, radiance=radiance),
        GRID,
        FREQUENCIES,
        RAYS,
        brute,
        expected={"spectrum": "refused", "covariance": "refused", "wavelet": "refused"},
    ),
)

EVERY = ("value", "gradient", "hessian")
FAULTS = (
    Fault("flip the shear", lambda s: twin_law(s, lambda m: Move(jnp.linalg.inv(m.M))), EVERY),
    Fault("rows for columns", lambda s: twin_law(s, lambda m: Move(m.M.T)), EVERY),
    Fault("half as far", lambda s: Travel(0.5 * s.d), EVERY),
    Fault("stay", lambda s: Travel(0.0), EVERY),
)
