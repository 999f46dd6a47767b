"""Colour that bleeds: all light in three rooms of flatland, after any number of bounces.

White plaster, two coloured walls, and lamps in two of the rooms; the one between them has none. The
radiosity of the walls is solved once, exact but for its panels; every pixel is then all light that
arrives at its middle from all around, gap by gap between silhouettes. Nothing is sampled at random.
"""

from __future__ import annotations

from firstorder.flatland import Circles, Scene, Segments, primitive
from firstorder.flatland.bounces import Discretization, solve_radiosity
from gallery.frame import Frame, developed, drawn
from gallery.stills._flatland import draw_shapes, fluence

PLASTER, RED, TEAL, GOLD = (
    (0.52, 0.50, 0.47),
    (0.62, 0.05, 0.03),
    (0.03, 0.30, 0.48),
    (0.7, 0.42, 0.05),
)
WARM, COOL = (9.0, 6.4, 3.4), (1.0, 2.2, 4.4)


def scene() -> Scene:
    """Three rooms in a row, with a gap below one wall and above the other."""
    left, right, low, high = -7.3, 7.3, -3.98, 3.98

    def wall(a, b, albedo=PLASTER):
        return primitive(Segments(a, b), albedo=albedo)

    return Scene.of(
        wall((left, low), (-2.5, low)),
        wall((-2.5, low), (2.3, low), TEAL),
        wall((2.3, low), (right, low)),
        wall((right, low), (right, high), GOLD),
        wall((right, high), (left, high)),
        wall((left, high), (left, low), RED),
        wall((-2.5, -1.6), (-2.5, high)),
        wall((2.3, low), (2.3, 1.5)),
        primitive(Segments((-3.6, 3.85), (-4.9, 3.85)), emission=WARM),
        primitive(Segments((5.9, 3.85), (4.9, 3.85)), emission=COOL),
        primitive(Circles((-4.6, -1.3), 0.7), albedo=PLASTER),
        primitive(Circles((0.3, 0.2), 0.85), albedo=PLASTER),
        primitive(Circles((4.6, -1.5), 0.6), albedo=PLASTER),
    )


def still(frame: Frame):
    world, extent = scene(), frame.extent((0.0, 0.0), 15.2)
    few = frame.width < 400
    light = solve_radiosity(
        world, fineness=Discretization(3, 0.1) if few else Discretization(5, 1e-3)
    )
    field = frame.field(fluence(world, 4, light), extent, rows=1)
    ax = frame.canvas(developed(field, 0.2), extent)
    draw_shapes(ax, world, 1.6 * frame.fine)
    return drawn(ax)
