"""Scenes that several tests of flatland look at."""

import numpy as np

from firstorder.flatland import (
    Arcs,
    Circles,
    Ellipses,
    PointLights,
    Receiver,
    Scene,
    Segments,
    closed_curve,
    primitive,
)
from firstorder.flatland.skies import GaussianSky
from tests.precision import as_dtype


def bean(x=0.0, y=0.0, size=1.0):
    """A smooth closed curve with a dent."""
    a = 2.0 * np.pi * np.arange(128) / 128
    points = np.stack([np.cos(a), 0.7 * np.sin(a) + 0.35 * np.cos(2.0 * a)], -1)
    return closed_curve(np.array([x, y]) + size * points, 6)


def everything(dtype=None, curve=True):
    """All five kinds above a floor."""
    things = (
        primitive(Segments((-3.0, 0.0), (3.0, 0.0)), name="floor", albedo=0.5),
        primitive(Segments((0.4, 2.6), (-0.9, 3.0)), name="lamp", emission=1.0),
        primitive(Arcs((1.6, 1.4), 0.5, 0.3, -2.5), name="arc"),
        primitive(Circles((-1.5, 1.2), 0.4), name="circle", emission=0.7),
        primitive(Ellipses((0.1, 1.5), (0.6, 0.2), 0.5), name="ellipse"),
        primitive(bean(2.2, 2.4, 0.4), name="bean", emission=0.4),
    )
    scene = Scene.of(*things[: 6 if curve else 5])
    if dtype is None:
        return scene
    return Scene(
        *(as_dtype(part, dtype) for part in (scene.groups, scene.material, scene.points)),
        None,
        as_dtype(scene.crossings, dtype),
        scene.names,
    )


def all_lights():
    """A lamp that shines down, a bright circle, a dark floor, a point light and a sky."""
    return Scene.of(
        primitive(Segments((0.5, 1.0), (-0.5, 1.0)), emission=1.0),
        primitive(Circles((1.5, 0.5), 0.2), emission=0.8),
        primitive(Segments((-1.0, 0.0), (1.0, 0.0))),
        points=PointLights((-1.0, 0.4), 0.2),
        environment=GaussianSky(0.3, 0.4),
    )


def two_rooms(turn):
    """Two rooms that each draw the wall between them, a lamp in one, a receiver in the other."""
    T = np.array([[np.cos(turn), np.sin(turn)], [-np.sin(turn), np.cos(turn)]])
    square = np.array([(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0), (0.0, 0.0)])
    rooms = [(square + np.array([x, 0.0])) @ T for x in (0.0, 1.0)]
    walls = [primitive(Segments(a[:-1], a[1:]), albedo=0.8) for a in rooms]
    lamp = PointLights(np.array([[0.4, 0.5]]) @ T, np.array([1.0]))
    return Scene.of(*walls, points=lamp), Receiver(np.array([1.5, 0.5]) @ T, 0.0, -1)
