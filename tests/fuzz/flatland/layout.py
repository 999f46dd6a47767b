"""Scenes of flatland as arrays: a lamp, a spare segment, two walls, two circles, an arc."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from firstorder.flatland import Arcs, Circles, Receiver, Scene, Segments, irradiance, primitive

LAMP, SPARE, FIRST, SECOND = range(4)  # segments
ARC, CIRCLE = 4, 5  # numbers of the arc and of the first circle, behind the segments
FRONT, BACK = 1.0, 0.25  # radiance of the lamp


class Flat(NamedTuple):
    """Numbers of one scene, or of many along a leading axis; all are float, so all have gradients.

    The spare segment lies behind the receiver until a change cuts a segment in two.

    Attributes:
        segments: start and end of lamp, spare and two walls, shape (4, 2, 2) [m].
        emission: of their fronts and backs, shape (4, 2) [W/(m rad)].
        circles: centre and radius, shape (2, 3) [m].
        arc: centre, radius, start and sweep, shape (5,) [m, rad].
        at: place of the receiver and angle of its normal, shape (3,) [m, rad].
        on: number of the shape on which it lies, or -1.
    """

    segments: Any
    emission: Any
    circles: Any
    arc: Any
    at: Any
    on: Any

    @property
    def size(self) -> np.ndarray:
        """The largest coordinate or radius of each scene [m]."""
        return np.maximum.reduce([_most(a) for a in self.lengths])

    @property
    def lengths(self) -> list[np.ndarray]:
        """Coordinates and radii: what another unit of length scales."""
        return [self.segments, self.circles, self.arc[:, :3], self.at[:, :2]]

    @property
    def turns(self) -> list[np.ndarray]:
        """Angles."""
        return [self.arc[:, 3:], self.at[:, 2:]]

    @property
    def places(self) -> list[np.ndarray]:
        """Coordinates alone: what a shift changes."""
        return [self.segments, self.circles[..., :2], self.arc[:, :2], self.at[:, :2]]


def light(s: Flat) -> Any:
    """Irradiance of one scene, as a program computes it whose numbers are all traced."""
    scene = Scene.of(
        primitive(Segments(s.segments[:, 0], s.segments[:, 1]), emission=s.emission),
        primitive(Arcs(s.arc[:2], s.arc[2], s.arc[3], s.arc[4])),
        primitive(Circles(s.circles[:, :2], s.circles[:, 2])),
    )
    return irradiance(scene, Receiver(s.at[:2], s.at[2], s.on.astype("int32")))


def direction(angle: np.ndarray) -> np.ndarray:
    """Unit vectors at angles counter-clockwise from +y."""
    return np.stack([-np.sin(angle), np.cos(angle)], -1)


def away(s: Flat) -> np.ndarray:
    """A short segment far behind each receiver, in whose way nothing is [m]."""
    normal, size = direction(s.at[:, 2]), (3.0 * s.size)[:, None]
    start = s.at[:, :2] - size * normal
    return np.stack([start, start - 0.01 * size * normal], 1)


def spared(s: Flat) -> Flat:
    """The scenes with their spare segments behind their receivers."""
    s.segments[:, SPARE] = 0.0  # it does not count in the size
    s.segments[:, SPARE] = away(s)
    return s


def _most(a: np.ndarray) -> np.ndarray:
    return np.max(np.abs(a).reshape(len(a), -1), -1)
