"""Shadow boundaries as thread: what two long lamps and a few bodies weave.

From each of many points of a lamp, a line touches each body and goes on until it meets something:
one edge of the shadow which that point alone would cast. The fan of them is a penumbra, the two
outermost bound it, and the light of a place changes as fast as lines cross it there. The visible
silhouettes of flatland, one ink for each lamp.
"""

from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np
from matplotlib.collections import LineCollection

from firstorder.flatland import Circles, Ellipses, Scene, Segments, nearest, occluded, primitive
from gallery.frame import Frame, drawn
from gallery.stills._flatland import draw_shapes

POINTS = 56  # on each lamp
PAPER, INK = "#f5f0e6", "#1b1a1f"
LAMPS = (((-5.9, 3.55), (-3.3, 3.55), "#b8371e"), ((2.9, 3.55), (5.7, 3.55), "#1f4e8c"))
ROOM = ((-7.2, -3.75), (7.2, -3.75), (7.2, 3.75), (-7.2, 3.75))


def bodies() -> list:
    """What casts shadows."""
    discs = ((-4.3, 1.2, 0.62), (0.0, 1.75, 0.42), (3.1, 0.5, 0.85), (-1.4, -0.7, 0.30),
             (5.4, -0.9, 0.42))  # fmt: skip
    return [
        *(primitive(Circles((x, y), r)) for x, y, r in discs),
        primitive(Ellipses((-3.2, -1.4), (0.85, 0.36), 0.5)),
        primitive(Segments((0.6, -1.1), (1.9, -1.7))),
    ]


def threads(a, b) -> np.ndarray:
    """Edges of the shadows of points between a and b, shape (n, 2, 2)."""
    walls = (primitive(Segments(*ends)) for ends in zip(ROOM, ROOM[1:] + ROOM[:1], strict=True))
    things, room = Scene.of(*bodies()), Scene.of(*bodies(), *walls)
    t = (np.arange(POINTS) + 0.5) / POINTS
    eyes = jnp.asarray(np.array(a) + t[:, None] * np.subtract(b, a))
    touched, valid = jax.vmap(things.silhouettes)(eyes)
    eye = jnp.broadcast_to(eyes[:, None], touched.shape)[valid]
    touched = touched[valid]
    along = (touched - eye) / jnp.linalg.norm(touched - eye, axis=1, keepdims=True)
    seen = ~occluded(things, eye, touched - 1e-3 * along)
    start = touched + 1e-3 * along
    far = nearest(room, start, along).t
    return np.stack([start, start + far[:, None] * along], 1)[np.asarray(seen & jnp.isfinite(far))]


def still(frame: Frame):
    extent = frame.extent((0.0, 0.0), 14.9)
    ax = frame.canvas(None, extent, PAPER)
    for a, b, ink in LAMPS:
        ax.add_collection(LineCollection(
            threads(a, b), colors=ink, alpha=0.42, linewidths=0.9 * frame.fine))  # fmt: skip
        ax.plot(*np.transpose([a, b]), "-", color=ink, linewidth=7.0 * frame.fine,
                solid_capstyle="round")  # fmt: skip
    draw_shapes(ax, Scene.of(*bodies()), 1.6 * frame.fine, dark=INK, rim=INK)
    ax.plot(*np.transpose([*ROOM, ROOM[0]]), "-", color=INK, linewidth=2.2 * frame.fine)
    return drawn(ax)
