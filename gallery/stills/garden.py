"""A fern, a knot and a pebble in warm light: soft shadows of meshes, in colour.

Meshes of `firstorder.models` by `rendering.Renderer`, direct light of a lamp and a sky, four
places a pixel, each with other nodes of the lamps: exposed by the log-average and bent by the curve
of `plotting.develop`.
"""

from __future__ import annotations

import numpy as np

from firstorder.imaging import pinhole
from firstorder.io import MeshModel
from firstorder.models.knots import torus_knot
from firstorder.models.plants import fern
from firstorder.models.primitives import (
    bumpy_sphere,
    displaced_ground,
    place_mesh,
    ripples,
    rotation_about,
)
from firstorder.rendering import World, light_rig
from gallery.frame import Frame, developed

CLAY = dict(albedo=(0.42, 0.40, 0.38))
LEAF = dict(albedo=(0.10, 0.34, 0.07), specular=0.06, exponent=30.0)
BRASS = dict(albedo=(0.42, 0.22, 0.05), specular=0.35, exponent=60.0)
GLAZE = dict(albedo=(0.06, 0.17, 0.40), specular=0.25, exponent=50.0)


def world() -> World:
    """On a floor that bends up behind."""
    plant, _ = fern(26, 44, seed=2, height=1.0, leaf=0.15)
    knot = torus_knot(2, 3, 0.16, 900, 48, 0.62)
    pebble = bumpy_sphere(0.58, ripples(0.085, 1.3, 3), 6)
    low = float(np.asarray(pebble.vertices)[:, 2].min())
    turn = rotation_about((0.9, 0.2, 0.1), 1.15)
    high = float(np.asarray(place_mesh(knot, turn=turn).vertices)[:, 2].min())
    models = (
        MeshModel(displaced_ground(12.0, _bend, 160), "floor", CLAY),
        MeshModel(place_mesh(plant, (-1.72, 0.1, 0.0)), "fern", LEAF),
        MeshModel(place_mesh(knot, (0.2, 0.0, -high), turn), "knot", BRASS),
        MeshModel(place_mesh(pebble, (1.75, -0.1, -low)), "pebble", GLAZE),
    )
    rig = light_rig(
        (0.0, 0.0, 0.4), 1.4, (0.0, -1.0, 0.3), nodes=8, fill=0.16, rim=0.0, softness=0.13
    )
    camera = pinhole((0.25, -5.6, 2.1), (0.1, 0.0, 0.52), gamma=1.95)
    return World(camera, None, models, rig.lamps, rig.sky, sky_rows=4)


def _bend(p: np.ndarray) -> np.ndarray:
    """Flat, and from 2.6 m behind on a rising curve."""
    back = np.maximum(p[:, 1] - 2.6, 0.0)
    return 0.16 * back**2


def still(frame: Frame):
    return developed(frame.rendered(world()))
