"""Scenes of space as arrays: a lamp, a spare rectangle, two balls, a box, a triangle."""

from __future__ import annotations

from typing import Any, NamedTuple

import jax.numpy as jnp
import numpy as np

from firstorder.space import (
    Boxes,
    Receiver,
    Scene,
    irradiance,
    primitive,
    rectangle,
    sphere,
    triangle,
)

LAMP, SPARE = 0, 1  # rectangles
BALL, BOX, TRIANGLE = 0, 2, 5  # numbers of the first ball, the box and the triangle in a scene
FRONT, BACK = 1.0, 0.25  # radiance of the lamp


class Space(NamedTuple):
    """Numbers of one scene, or of many along a leading axis; all are float, so all have gradients.

    The spare rectangle lies behind the receiver until a change cuts the lamp in two.

    Attributes:
        rectangles: centre and half edges of lamp and spare, shape (2, 3, 3) [m].
        emission: of their fronts and backs, shape (2, 2) [W/(m^2 sr)].
        spheres: centre and radius, shape (2, 4) [m].
        box: centre and half edges, shape (4, 3) [m].
        triangle: corners, shape (3, 3) [m].
        at: place of the receiver, shape (3,) [m].
        normal: of the receiver, shape (3,).
        on: number of the shape on which it lies, or -1.
    """

    rectangles: Any
    emission: Any
    spheres: Any
    box: Any
    triangle: Any
    at: Any
    normal: Any
    on: Any

    @property
    def size(self) -> np.ndarray:
        """The largest coordinate or radius of each scene [m]."""
        return np.maximum.reduce([np.max(np.abs(a).reshape(len(a), -1), -1) for a in self.lengths])

    @property
    def lengths(self) -> list[np.ndarray]:
        """What another unit of length scales."""
        return [self.rectangles, self.spheres, self.box, self.triangle, self.at]

    @property
    def turns(self) -> list[np.ndarray]:
        """Directions, which no unit scales."""
        return [self.normal]

    @property
    def places(self) -> list[np.ndarray]:
        """Coordinates: what a shift changes."""
        middles = self.rectangles[:, :, 0], self.spheres[..., :3], self.box[:, 0]
        return [*middles, self.triangle, self.at]

    @property
    def edges(self) -> list[np.ndarray]:
        """Vectors: what a turn changes, beside places."""
        return [self.rectangles[:, :, 1:], self.box[:, 1:], self.normal]


def light(s: Space) -> Any:
    """Irradiance of one scene, as a program computes it whose numbers are all traced."""
    lamps = [
        primitive(rectangle(*r), emission=e) for r, e in zip(s.rectangles, s.emission, strict=True)
    ]
    balls = [primitive(sphere(b[:3], b[3])) for b in s.spheres]
    box = primitive(Boxes(s.box[0], jnp.stack([*s.box[1:]], -1)))
    scene = Scene.of(*lamps, *balls, box, primitive(triangle(*s.triangle)))
    return irradiance(scene, Receiver.at(s.at, s.normal, on=s.on.astype("int32")))


def unit(a: np.ndarray) -> np.ndarray:
    """Vectors of length one."""
    return a / np.linalg.norm(a, axis=-1, keepdims=True)


def spared(s: Space) -> Space:
    """The scenes with their spare rectangles small and far behind their receivers."""
    s.rectangles[:, SPARE] = 0.0  # it does not count in the size
    size, normal = (3.0 * s.size)[:, None], unit(s.normal)
    side = unit(np.cross(normal, np.roll(normal, 1, -1) + np.array([0.3, 0.2, 0.1])))
    middle = s.at - size * normal
    half = 0.01 * size * side
    s.rectangles[:, SPARE] = np.stack([middle, half, np.cross(normal, half)], 1)
    return s


def sharpness(s: Space) -> np.ndarray:
    """By how much rounding turns the flattest triangle or rectangle: 1 / sin of its angle."""
    sides = [(s.triangle[:, 1] - s.triangle[:, 0], s.triangle[:, 2] - s.triangle[:, 0])]
    sides += [(s.rectangles[:, k, 1], s.rectangles[:, k, 2]) for k in range(2)]
    worst = np.ones(len(s.at))
    for u, v in sides:
        area = np.linalg.norm(np.cross(u, v), axis=-1)
        product = np.linalg.norm(u, axis=-1) * np.linalg.norm(v, axis=-1)
        worst = np.maximum(worst, product / np.maximum(area, 1e-300))
    return worst
