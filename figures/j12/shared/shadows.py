"""What J12's figures on soft shadows share: a lamp, something that floats before it, exact light.

The floor is the unit square, the lamp a square of 0.9 m that shines down from 1 m with radiance 1;
nothing reflects. `plate`: a box of 0.2 x 0.25 x 0.08 m, its underside 0.25 m up, turned by 0.5 rad
against the lamp (edges that are parallel make irradiance bend in lines, where it has no Hessian).
All of its shadow is penumbra: a place that sees no light has no Hessian, and would reach
everywhere. `lamp`: without it.

Records hold the exact irradiance and its exact gradient, so that nothing but their places tells
metrics apart. The metrics come from gathered rays, as everywhere.
"""

from __future__ import annotations

import dataclasses
import functools
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from figures.j12.shared.box import Case, Size, places
from firstorder.caching.candidate_tables import gather_directions, tabulate_candidates
from firstorder.numerics._batching import host_blocks, in_batches
from firstorder.space import Boxes, Primitive, Scene, irradiance, primitive, receiver, rectangle
from firstorder.space.bounces._radiance_maps import RadianceMaps, face_layout

TURN = 0.5  # of the plate [rad]
# Centre and half sizes [m], turn [rad]: the plate, and others for scans.
PLATES = {
    "plate": ((0.45, 0.48, 0.29), (0.1, 0.125, 0.04), TURN),
    "thin plate": ((0.55, 0.4, 0.25), (0.07, 0.15, 0.02), 0.9),
    "high plate": ((0.4, 0.6, 0.5), (0.15, 0.12, 0.03), 0.3),
    "small plate": ((0.6, 0.55, 0.2), (0.06, 0.07, 0.03), 0.7),
}
# For what four plates do not decide; all of their shadows are penumbra, too.
MORE = {
    "left plate": ((0.3, 0.45, 0.35), (0.08, 0.16, 0.03), 1.2),
    "far plate": ((0.7, 0.35, 0.4), (0.12, 0.09, 0.02), 0.2),
    "low plate": ((0.5, 0.65, 0.22), (0.05, 0.1, 0.04), 1.0),
    "wide plate": ((0.5, 0.45, 0.45), (0.2, 0.14, 0.02), 0.6),
    "long plate": ((0.4, 0.35, 0.3), (0.04, 0.22, 0.03), 0.35),
    "square plate": ((0.6, 0.6, 0.32), (0.1, 0.1, 0.03), 0.8),
}
# The same and others, whose edges are parallel to the lamp's.
ALIGNED = {f"aligned {name}": (*box[:2], 0.0) for name, box in PLATES.items()} | {
    "bar": ((0.5, 0.5, 0.3), (0.02, 0.3, 0.02), 0.0),
    "shelf": ((0.3, 0.5, 0.35), (0.15, 0.3, 0.015), 0.0),
}
BLOCK = 1024  # places


class Shadow(NamedTuple):
    """A case, and the exact light at its places."""

    case: Case
    jet: Jet


def soft(name: str) -> Scene:
    """The scene: one of the plates, or "lamp" for nothing before the lamp."""
    level = rectangle((0.5, 0.5, 0.0), (0.5, 0.0, 0.0), (0.0, 0.5, 0.0))
    return Scene.of(primitive(level, name="floor"), *_things(name))


def above(name: str) -> Scene:
    """What hangs over the floor."""
    return Scene.of(*_things(name))


def _things(name: str) -> list[Primitive]:
    lamp = rectangle((0.5, 0.5, 1.0), (0.0, 0.45, 0.0), (0.45, 0.0, 0.0))
    things = [primitive(lamp, name="light", emission=1.0)]
    boxes = PLATES | MORE | ALIGNED
    if name in boxes:
        center, half, turn = boxes[name]
        c, s = np.cos(turn), np.sin(turn)
        frame = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
        plate = Boxes(center, frame * np.array(half))
        things.append(primitive(plate, name="plate"))
    return things


@functools.cache
def light(name: str):
    """The exact irradiance at a place (2,) of the floor: a function."""
    scene = above(name)
    return lambda x: irradiance(scene, receiver((0.0, 0.0, 0.0)).moved(x))


class Jet(NamedTuple):
    """Irradiance at places, with its derivatives up to the third."""

    E: np.ndarray
    gradient: np.ndarray
    hessian: np.ndarray
    third: np.ndarray


STAR = np.array([(a, b) for a in range(-2, 3) for b in range(-2, 3) if abs(a) + abs(b) <= 2])


def exact_values(name: str, x) -> np.ndarray:
    """Exact irradiance at places (..., 2) of the floor."""
    x = np.asarray(x, float)
    return host_blocks(_block(name), x.reshape(-1, 2), BLOCK).reshape(x.shape[:-1])


@functools.cache
def _block(name: str):
    """The exact irradiance at a block of places, compiled."""
    E = light(name)
    return jax.jit(lambda p: in_batches(E, p, 64))


def exact_jet(name: str, x: np.ndarray, h: float = 3e-4) -> Jet:
    """Exact irradiance at places (m, 2), and its derivatives by differences of exact values.

    Errors are of order `h^2` and of rounding over `h^3`: 1e-6 of gradient and Hessian, 1e-4 of the
    third derivatives. Within 2 h of a line where two edges align the latter are too large.
    Compiling values alone takes a few seconds, their second derivatives half a minute.
    """
    v = exact_values(name, x[:, None] + h * STAR)
    at = {(int(a), int(b)): v[:, k] for k, (a, b) in enumerate(STAR)}

    def along(i, j, a, b):
        """Differences of order i along x and j along y about a place of the star."""
        if i:
            return along(i - 1, j, a + 1, b) - along(i - 1, j, a - 1, b)
        if j:
            return along(i, j - 1, a, b + 1) - along(i, j - 1, a, b - 1)
        return at[a, b]

    def second(axis, a=0, b=0):
        p, q = (1, 0) if axis == 0 else (0, 1)
        return at[a + p, b + q] - 2.0 * at[a, b] + at[a - p, b - q]

    gradient = np.stack([along(1, 0, 0, 0), along(0, 1, 0, 0)], -1) / (2.0 * h)
    xx, yy, xy = second(0), second(1), 0.25 * along(1, 1, 0, 0)
    hessian = np.stack([np.stack([xx, xy], -1), np.stack([xy, yy], -1)], -2) / h**2
    slope = 0.5 / h**3
    xxx = slope * (at[2, 0] - 2.0 * at[1, 0] + 2.0 * at[-1, 0] - at[-2, 0])
    yyy = slope * (at[0, 2] - 2.0 * at[0, 1] + 2.0 * at[0, -1] - at[0, -2])
    xxy = slope * (second(0, 0, 1) - second(0, 0, -1))
    xyy = slope * (second(1, 1, 0) - second(1, -1, 0))
    rows = [[[xxx, xxy], [xxy, xyy]], [[xxy, xyy], [xyy, yyy]]]
    return Jet(at[0, 0], gradient, hessian, np.moveaxis(np.array(rows), -1, 0))


def lit(name: str) -> RadianceMaps:
    """The scene for gather rays: the lamp's front sends radiance 1."""
    scene = soft(name)
    owner = face_layout(scene).shape
    L = np.zeros((len(owner), 2, 2))
    L[owner == scene.named("light")[0]] = 1.0
    return RadianceMaps(scene, jnp.asarray(L))


@functools.cache
def shadow(name: str, size: Size) -> Shadow:
    """The floor's table under one of the scenes."""
    maps, x = lit(name), places(size.pixels)
    (floor,) = maps.scene.named("floor")
    table = tabulate_candidates(maps, x, gather_directions(size.rows, size.columns), floor)
    jet = exact_jet(name, x)
    table = table._replace(E=jet.E, gradient=jet.gradient)
    return Shadow(Case(maps, table, jet.E, np.ones(len(x), bool), size), jet)


def with_hessian(c: Case, hessian) -> Case:
    """The same records, but for the Hessian by which they extrapolate."""
    return dataclasses.replace(c, table=c.table._replace(hessian=np.asarray(hessian)))
