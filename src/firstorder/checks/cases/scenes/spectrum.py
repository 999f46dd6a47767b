"""The spectrum of light that comes through a scene: its light field as a factor.

A Gaussian times the light field of two lit segments, one of which hides part of the other. The
field is constant on polygons of (x, v), whose Fourier series is closed form (`spectrum_in`). The
samples that it is compared with jump, so that their transform has the error of the midpoint rule
across oblique edges: 6e-4 here, and 7e-5 at half the step.
`tests/flatland/light_fields/test_field.py` compares it with the closed form of two planes, to
rounding.
"""

import equinox as eqx
import jax.numpy as jnp
import numpy as np

from firstorder.checks.cases import bell, light
from firstorder.checks.faults import Fault, twin
from firstorder.checks.squares import Case
from firstorder.conventions import FLATLAND_SLOPE
from firstorder.fields import Grid
from firstorder.flatland import (
    LightField,
    Receiver,
    Scene,
    Segments,
    StraightEdges,
    light_field,
    primitive,
)
from firstorder.flatland.light_fields.spectrum import series_in
from firstorder.laws import Multiply

GRID = Grid.spanning((1024, 1025), (4.5, 3.5))
WINDOW = Grid.spanning((80, 80), (4.5, 3.5))
GRID_ERROR = 1e-3
RAYS = np.array([[-0.3, 0.0], [0.3, 0.1], [0.9, 0.25]])  # to the lamp, the board, the lamp
FREQUENCIES = (np.array([-0.45, 0.0, 0.33, 1.6]), np.array([-1.0, -0.5, 0.05, 0.4]))

LAMP = np.array([[1.1, 2.0], [-0.9, 2.4]])
BOARD = np.array([[0.5, 0.8], [-0.1, 1.1]])
POSITION, LEAN = np.array([0.1, -0.2]), 0.15
ABOVE, BELOW, BACK = 1.0, 0.3, 0.6  # radiance of the lamp, and of the board's front and back


def scene_light(lean: float = LEAN, board: float = 0.0, lamp=ABOVE) -> LightField:
    """The scene's light on a leaning line; a fault leans it, or moves the board."""
    things = (
        primitive(Segments(*LAMP), emission=lamp),
        primitive(Segments(*(BOARD + np.array([board, 0.0]))), emission=(BELOW, BACK)),
    )
    return light_field(Scene.of(*things), Receiver(POSITION, lean), frame=FLATLAND_SLOPE)


def met(ends, start, along):
    """Distance to a segment, or infinity, and whether its left side is met."""
    edge = ends[1] - ends[0]
    t, s = np.linalg.solve(np.stack([along, -edge], 1), ends[0] - start)
    hit = t > 0.0 and 0.0 <= s <= 1.0
    return (t if hit else np.inf), edge[0] * along[1] - edge[1] * along[0] < 0.0


def brute(u):
    """One ray, in plain NumPy."""
    tangent, normal = np.array([[np.cos(LEAN), np.sin(LEAN)], [-np.sin(LEAN), np.cos(LEAN)]])
    start, along = POSITION + u[0] * tangent, normal - u[1] * tangent
    (lamp, lit), (board, front) = (met(ends, start, along) for ends in (LAMP, BOARD))
    if board < lamp:
        return bell(*u) * (BELOW if front else BACK)
    return bell(*u) * (ABOVE if lit and np.isfinite(lamp) else 0.0)


CASES = (
    Case(
        "scene, spectrum",
        Multiply(scene_light(), WINDOW),
        light(FLATLAND_SLOPE),
        GRID,
        FREQUENCIES,
        RAYS,
        brute,
        Grid.spanning((16, 16), (3.0, 3.0)),
        bounds={"spectrum": GRID_ERROR},
        expected={"covariance": "refused"},
    ),
)


def through(change):
    """The light with the coefficients of its series tampered with."""

    def wrong(step):
        def series(field, window):
            s = series_in(field, window)
            return eqx.tree_at(lambda s: s.coefficients, s, change(field, window, s))

        return Multiply(twin(step.factor, series=series), step.window)

    return wrong


def open_box(field, window, s):
    """The edges inside the box without its sides."""
    F = field.spectrum_in(window)
    inside = jnp.abs(F.middle - np.array(window.center)) < 0.5 * np.array(window.extent) - 1e-9
    jump = jnp.where(inside.all(1), F.jump, 0.0)
    rest = StraightEdges(F.middle, F.along, jump, F.frame)
    return rest(*s.frequencies.T) / (window.extent[0] * window.extent[1])


JETS = ("gradient", "hessian")
EVERY = ("value", *JETS, "spectrum", "wavelet")
FAULTS = (
    Fault("lean the line the other way", lambda s: Multiply(scene_light(-LEAN), WINDOW), EVERY),
    Fault("move the board", lambda s: Multiply(scene_light(LEAN, 0.5), WINDOW), EVERY),
    Fault("front for back", lambda s: Multiply(scene_light(lamp=(0.0, ABOVE)), WINDOW), EVERY),
    Fault("walk the edges the other way", through(lambda f, w, s: -s.coefficients), ("spectrum",)),
    Fault("the other sign of i", through(lambda f, w, s: s.coefficients.conj()), ("spectrum",)),
    Fault("forget the box's sides", through(open_box), ("spectrum",)),
    Fault(
        "shift by half a sample",
        through(
            lambda f, w, s: s.coefficients * jnp.exp(1j * np.pi * s.frequencies[:, 0] * w.step[0])
        ),
        ("spectrum",),
    ),
)
