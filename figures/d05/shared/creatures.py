"""D05's two creatures on a floor: the scene of its Figs. 16 and 17, of analytic shapes.

The paper has two dinosaurs and an environment map, and gives neither. Ours: two animals of 13
ellipsoids each, the near one shiny (s = 250), the far one dull (s = 40), a ball and a box, on a
floor of little gloss (s = 20), under the sky of `d05.shared.shading`.
"""

from __future__ import annotations

import equinox as eqx
import jax.numpy as jnp
import numpy as np

from figures.d05.shared.shading import (
    AMBIENT,
    DULL,
    FILL,
    FLOOR,
    LAMP,
    RAYS,
    SHINY,
    Lobes,
    Points,
    World,
)
from firstorder.imaging.camera import Pinhole, pinhole
from firstorder.imaging.hits import gbuffer
from firstorder.imaging.images import pixel_labels
from firstorder.numerics._batching import host_blocks, in_blocks
from firstorder.scene._intersect import free_ways
from firstorder.space import Scene, box, ellipsoid, plane, primitive, sphere

LOOKED = 4096  # primary rays at a time
TOGETHER = 64  # points whose rays fit the second cache

# Centre (forward, left, up) and half-axes of a creature's parts, in its own frame [m].
PARTS = (
    ((0.0, 0.0, 0.62), (0.52, 0.27, 0.28)),
    ((0.46, 0.0, 0.82), (0.20, 0.13, 0.15)),
    ((0.60, 0.0, 0.99), (0.14, 0.10, 0.16)),
    ((0.70, 0.0, 1.17), (0.13, 0.11, 0.12)),
    ((0.88, 0.0, 1.15), (0.15, 0.075, 0.07)),
    ((-0.52, 0.0, 0.58), (0.24, 0.13, 0.13)),
    ((-0.76, 0.03, 0.50), (0.18, 0.08, 0.08)),
    ((-0.95, 0.08, 0.44), (0.14, 0.05, 0.05)),
    ((-1.10, 0.15, 0.40), (0.11, 0.03, 0.03)),
    ((0.30, 0.19, 0.25), (0.09, 0.08, 0.26)),
    ((0.30, -0.19, 0.25), (0.09, 0.08, 0.26)),
    ((-0.30, 0.19, 0.25), (0.10, 0.09, 0.26)),
    ((-0.30, -0.19, 0.25), (0.10, 0.09, 0.26)),
)


class Shapes(eqx.Module):
    """Rays through analytic shapes: a `Tracer`."""

    scene: Scene

    def seen(self, camera: Pinhole, p: np.ndarray) -> tuple[Points, np.ndarray]:
        """See `Tracer`; labels are shapes and their faces."""
        index, label = host_blocks(lambda q: pixel_labels(self.scene, camera, q), p, LOOKED)
        at = gbuffer(self.scene, camera, p, index)
        return Points(at, index, at.normal), label

    @eqx.filter_jit
    def free(self, points: Points, w):
        """See `Tracer`."""
        return jnp.isinf(self.distance(points, w)).astype(w.dtype)

    @eqx.filter_jit
    def distance(self, points: Points, w):
        """See `Tracer`."""

        def some(rows):
            x, w, on = rows
            return free_ways(self.scene.groups, x, [w[..., k] for k in range(3)], on)

        return in_blocks(some, (points.at.position, w, points.thing), TOGETHER)


def world(quick: bool) -> World:
    """The scene at 800 x 500, or an eighth of it."""
    things = [primitive(plane((0, 0, 0), (0, 0, 1)), name="floor", **FLOOR)]
    for at, turn, scale, how in (
        ((-0.75, -0.55), 0.35, 1.0, SHINY),
        ((1.05, 1.0), 2.6, 1.15, DULL),
    ):
        things += creature(at, turn, scale, how)
    things.append(primitive(sphere((0.75, -0.9, 0.22), 0.22), name="ball", **SHINY))
    things.append(primitive(box((-2.2, 0.9, 0.0), (-1.5, 1.5, 0.7)), name="box", **FLOOR))
    scene = Scene.of(*things)
    m = scene.material
    lobes = Lobes(*(np.asarray(a) for a in (m.albedo[:, 0], m.specular, m.exponent)))
    camera = pinhole((-0.4, -4.6, 2.3), (0.0, 0.0, 0.45), gamma=2.2)
    size = (96, 60) if quick else (800, 500)
    floor = scene.named("floor")[0]
    return World("d05_creatures", KEY, Shapes(scene), lobes, floor, camera, *size)


def creature(at, turn: float, scale: float, how: dict) -> list:
    """An animal that stands on the floor."""
    c, s = np.cos(turn), np.sin(turn)
    axes = scale * np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    base = np.array([*at, 0.0])
    return [
        primitive(
            ellipsoid(base + axes @ np.array(p), axes * np.array(half)), name="creature", **how
        )
        for p, half in PARTS
    ]


KEY = f"{LAMP} {FILL} {AMBIENT} {SHINY} {DULL} {FLOOR} {RAYS} {PARTS}"
