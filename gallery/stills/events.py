"""Visual events: every line on which two edges of a scene meet, and the light that they cut.

The exact fluence of three lamps among discs and plates in flatland, and over it the critical lines,
by the size of the jump that each makes in the derivative of the irradiance of what it meets.
"""

from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np

from firstorder.flatland import Circles, Scene, Segments, primitive
from firstorder.flatland.discontinuities.events import visual_events
from gallery.frame import Frame, developed, drawn
from gallery.stills._flatland import draw_shapes, fluence

LAMPS = (((-4.2, 3.75), (-5.2, 3.6), (5.0, 2.7, 1.0)), ((5.8, 3.2), (5.3, 3.9), (0.9, 2.0, 5.2)),
         ((1.1, 3.95), (0.5, 3.95), (2.2, 2.6, 2.0)))  # fmt: skip
DISCS = ((-2.6, 0.9, 0.55), (0.4, -0.2, 0.8), (3.4, 1.1, 0.45), (-4.9, -0.9, 0.5), (5.6, -0.8, 0.6),
         (-1.2, 2.3, 0.22), (2.0, 2.2, 0.25))  # fmt: skip
PLATES = (((-6.6, 1.4), (-5.6, 1.1)), ((1.6, -1.9), (2.9, -1.6)))


def scene() -> Scene:
    """A floor, lamps that look down, discs and plates."""
    return Scene.of(
        primitive(Segments((-8.5, -3.85), (8.5, -3.85)), name="floor"),
        *(primitive(Segments(a, b), emission=L) for a, b, L in LAMPS),
        *(primitive(Circles((x, y), r)) for x, y, r in DISCS),
        *(primitive(Segments(a, b)) for a, b in PLATES),
    )


def still(frame: Frame):
    world, extent = scene(), frame.extent((0.0, 0.1), 15.0)
    light = frame.field(fluence(world), extent, rows=1)
    ax = frame.canvas(developed(light, 0.25), extent)
    lines, sizes = critical(world)
    strength = np.clip((np.log10(sizes) + 3.0) / 3.5, 0.05, 1.0)
    for (a, b), s in zip(lines, strength, strict=True):
        ax.plot([a[0], b[0]], [a[1], b[1]], "-", color="#ffe9b8", alpha=0.75 * s,
                linewidth=(0.5 + 1.3 * s) * frame.fine)  # fmt: skip
    draw_shapes(ax, world, 1.8 * frame.fine)
    return drawn(ax)


def critical(world: Scene):
    """Ends of the lines that cut light, (n, 2, 2), and the sizes of the jumps there."""
    grey = world.band(1)
    table = visual_events(grey)
    table = table.take(np.abs(table.jump_E1) > 0.0)
    ends = jax.vmap(lambda k, s: grey.motion(k, s)[0])(
        jnp.asarray(table.receiver), jnp.asarray(table.s)
    )
    return np.stack([np.asarray(ends), table.far.point], 1), np.abs(table.jump_E1)
