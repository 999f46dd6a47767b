"""Light shafts through a blind: the exact fluence of a room in flatland.

A sun (a warm lamp far away), a strip of sky and a small red lamp; slats, columns and a table. Every
pixel is all light that arrives at its middle, in closed form: the angles between silhouettes at
which each lamp is seen. There is no noise because nothing was sampled; each fringe in a shadow is
the beginning of a penumbra.
"""

from __future__ import annotations

import numpy as np

from firstorder.flatland import Circles, Scene, Segments, box, primitive
from gallery.frame import Frame, developed, drawn
from gallery.stills._flatland import draw_shapes, fluence

SUN, SKY, EMBER = (62.0, 41.0, 17.0), (0.07, 0.18, 0.48), (4.6, 0.62, 0.12)


def scene() -> Scene:
    """A hall 16 m wide, a blind in its roof."""
    x, y = np.linspace(-1.9, 6.3, 13), np.linspace(3.95, 3.45, 13)
    slats = primitive(Segments(np.stack([x, y], -1), np.stack([x + 0.36, y + 0.10], -1)))
    return Scene.of(
        primitive(Segments((17.6, 20.2), (16.9, 20.6)), name="sun", emission=SUN),
        primitive(Segments((60.0, 25.0), (0.0, 55.0)), name="sky", emission=SKY),
        primitive(Segments((-8.3, -2.9), (-8.1, -3.5)), name="ember", emission=EMBER),
        slats,
        primitive(Segments((-30.0, 3.2), (-1.9, 3.95))),
        primitive(Segments((6.75, 3.45), (7.6, -6.0))),
        primitive(Circles((-2.4, -0.2), 0.55)),
        primitive(Circles((1.9, -1.9), 0.9)),
        primitive(Circles((-5.0, -2.6), 0.35)),
        primitive(box((4.4, -4.6), (4.9, -0.9))),
    )


def still(frame: Frame):
    world, extent = scene(), frame.extent((-1.15, -0.35), 15.4)
    light = frame.field(fluence(world), extent, rows=1)
    ax = frame.canvas(developed(light, 0.45), extent)
    draw_shapes(ax, world, 1.6 * frame.fine)
    return drawn(ax)
