"""Scenes of space as arrays: a lamp, a spare rectangle, balls, a box, a triangle, and planes."""

from __future__ import annotations

from typing import Any, NamedTuple

import jax.numpy as jnp
import numpy as np

from firstorder.space import (
    Boxes,
    Cylinders,
    Discs,
    Receiver,
    Scene,
    irradiance,
    plane,
    primitive,
    rectangle,
    sphere,
    triangle,
)

LAMP, SPARE = 0, 1  # rectangles
BALL, BOX = 0, 2  # numbers of the first ball and the box in a scene
BODIES = 3  # balls and box, which come before all else in a scene
FRONT, BACK = 1.0, 0.25  # radiance of the lamp
# Rows of emission: those of the rectangles are LAMP and SPARE.
BALLS, SOLID, SHEET, ROUNDS, SKY = slice(2, 4), 4, 5, 6, -1


class Space(NamedTuple):
    """Numbers of one scene, or of many along a leading axis; all are float, so all have gradients.

    The spare rectangle lies behind the receiver until a change cuts the lamp in two. Scenes without
    planes have neither cylinders nor discs, and are compiled apart.

    Attributes:
        rectangles: centre and half edges of lamp and spare, shape (2, 3, 3) [m].
        emission: of the fronts and backs of all things, one kind after the other as they stand
            here, and last of the sky, which has no back, shape (n + 1, 2) [W/(m^2 sr)].
        spheres: centre and radius, shape (2, 4) [m].
        box: centre and half edges, shape (4, 3) [m].
        triangle: corners, shape (3, 3) [m].
        cylinders: centre, two radii and half the axis, shape (c, 4, 3) [m].
        discs: centre and two radii, shape (d, 3, 3) [m].
        planes: a point of each, shape (p, 3) [m].
        ups: their normals, of any length, shape (p, 3).
        at: place of the receiver, shape (3,) [m].
        normal: of the receiver, shape (3,).
        on: number of the shape on which it lies, or -1.
    """

    rectangles: Any
    emission: Any
    spheres: Any
    box: Any
    triangle: Any
    cylinders: Any
    discs: Any
    planes: Any
    ups: Any
    at: Any
    normal: Any
    on: Any

    @property
    def size(self) -> np.ndarray:
        """The largest coordinate or radius of each scene [m]."""
        each = [np.abs(a).reshape(len(a), -1) for a in self.lengths]
        return np.max(np.concatenate(each, -1), -1)

    @property
    def lengths(self) -> list[np.ndarray]:
        """What another unit of length scales."""
        flat = [self.rectangles, self.spheres, self.box, self.triangle]
        return [*flat, self.cylinders, self.discs, self.planes, self.at]

    @property
    def turns(self) -> list[np.ndarray]:
        """Directions, which no unit scales."""
        return [self.ups, self.normal]

    @property
    def places(self) -> list[np.ndarray]:
        """Coordinates: what a shift changes."""
        middles = self.rectangles[:, :, 0], self.spheres[..., :3], self.box[:, 0]
        rounds = self.cylinders[:, :, 0], self.discs[:, :, 0]
        return [*middles, self.triangle, *rounds, self.planes, self.at]

    @property
    def edges(self) -> list[np.ndarray]:
        """Vectors: what a turn changes, beside places."""
        rounds = self.cylinders[:, :, 1:], self.discs[:, :, 1:]
        return [self.rectangles[:, :, 1:], self.box[:, 1:], *rounds, self.ups, self.normal]

    @property
    def triangle_number(self) -> int:
        """Number of the triangle in a scene, which comes after rectangles."""
        return BODIES + self.cylinders.shape[-3] + self.discs.shape[-3] + 2

    @property
    def plane_number(self) -> int:
        """Number of the first plane in a scene."""
        return self.triangle_number + 1


def light(s: Space) -> Any:
    """Irradiance of one scene, as a program computes it whose numbers are all traced."""
    shapes = [rectangle(*r) for r in s.rectangles]
    shapes += [sphere(b[:3], b[3]) for b in s.spheres]
    shapes += [Boxes(s.box[0], jnp.stack([*s.box[1:]], -1)), triangle(*s.triangle)]
    shapes += [Cylinders(c[0], jnp.stack([*c[1:]], -1)) for c in s.cylinders]
    shapes += [Discs(d[0], rectangle(*d).axes[0]) for d in s.discs]
    shapes += [plane(*pair) for pair in zip(s.planes, s.ups, strict=True)]
    things = [primitive(a, emission=e) for a, e in zip(shapes, s.emission[:SKY], strict=True)]
    scene = Scene.of(*things, environment=s.emission[SKY, 0])
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
