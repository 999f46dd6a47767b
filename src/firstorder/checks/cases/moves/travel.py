"""Travel in slopes: outgoing and incoming light, which shear opposite ways, and light in space."""

import jax.numpy as jnp
import numpy as np

from firstorder.checks.cases import FREQUENCIES, GRID, RAYS, bell, light
from firstorder.checks.faults import Fault, twin_law
from firstorder.checks.squares import Case
from firstorder.conventions import FLATLAND_SLOPE, SPACE_SLOPE, Frame
from firstorder.fields import Gaussian, Grid
from firstorder.laws import Move
from firstorder.transport import Travel

D, D4 = 0.8, 0.5
LEAVING = Frame(("x", "v"), "outgoing")

# In space: off-centre, every pair of coordinates correlated.
CENTER4 = np.array([0.2, -0.1, 0.15, -0.05])
PRECISION4 = np.array(
    [[3.0, 0.4, 0.7, -0.2], [0.4, 2.7, 0.2, 0.6], [0.7, 0.2, 3.9, 0.3], [-0.2, 0.6, 0.3, 3.5]]
)
W_X, W_V = 4.5, 3.9  # some seven standard deviations of the travelled light
GRID4 = Grid.spanning((24, 25, 24, 25), (W_X, W_X, W_V, W_V))
RAYS4 = np.array([[0.3, -0.2, 0.1, 0.25], [-0.4, 0.3, 0.2, -0.3], [0.1, 0.5, -0.3, 0.0]])
FREQUENCIES4 = tuple(np.array(f) for f in ([-0.3, 0.1], [0.0, 0.25], [-0.2, 0.3], [0.15, -0.25]))


def bell4(u) -> float:
    """The light in space, in plain NumPy."""
    h = np.asarray(u) - CENTER4
    return 0.9 * float(np.exp(-0.5 * h @ PRECISION4 @ h))


def leaving(u):
    """Follow the ray back, as a straight line in the plane, from the line y = D to y = 0."""
    x, v = u
    along = np.array([-np.sin(np.arctan(v)), np.cos(np.arctan(v))])
    # (x0, 0) + t along = (x, D)
    x0, _ = np.linalg.solve(np.array([[1.0, along[0]], [0.0, along[1]]]), np.array([x, D]))
    return bell(x0, v)


def coming(u):
    """Look along the ray, from the line y = 0 up to y = D, where the light was known."""
    x, v = u
    along = np.array([-np.sin(np.arctan(v)), np.cos(np.arctan(v))])
    # (x, 0) + t along = (x0, D)
    x0, _ = np.linalg.solve(np.array([[1.0, -along[0]], [0.0, -along[1]]]), np.array([x, -D]))
    return bell(x0, v)


def coming4(u):
    """Light in space that has come along the vector (-v, -w, 1)."""
    along = np.array([-u[2], -u[3], 1.0]) / np.sqrt(1.0 + u[2] ** 2 + u[3] ** 2)
    there = np.array([u[0], u[1], 0.0]) + D4 / along[2] * along
    return bell4([there[0], there[1], u[2], u[3]])


CASES = tuple(
    Case(name, Travel(d), L, grid, f, rays, brute, expected={"wavelet": "refused"})
    for name, d, L, grid, f, rays, brute in (
        ("travel", D, light(LEAVING), GRID, FREQUENCIES, RAYS, leaving),
        ("travel, incoming light", D, light(FLATLAND_SLOPE), GRID, FREQUENCIES, RAYS, coming),
        (
            "travel, in space",
            D4,
            Gaussian(CENTER4, PRECISION4, 0.9, SPACE_SLOPE),
            GRID4,
            FREQUENCIES4,
            RAYS4,
            coming4,
        ),
    )
)

EVERY = ("value", "gradient", "hessian", "spectrum", "covariance")
FAULTS = (
    Fault("flip the shear", lambda s: twin_law(s, lambda m: Move(jnp.linalg.inv(m.M))), EVERY),
    Fault("rows for columns", lambda s: twin_law(s, lambda m: Move(m.M.T)), EVERY),
    Fault("half as far", lambda s: Travel(0.5 * s.d), EVERY),
    Fault("stay where you are", lambda s: Travel(0.0), EVERY),
)
