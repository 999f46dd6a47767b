"""The discontinuity mesh under balls: where two outlines meet before one's eye.

A square lamp over four balls and a disc, exact irradiance in every third pixel (a cubic spline
between them) in warm light, and over it the visual events of `space.discontinuities`: green where
two outlines touch, one of them round, behind which the second derivative of irradiance grows
without bound; blue where its Hessian jumps. These are the borders of umbra and penumbra, each a
smooth curve for every edge and body. Brighter lines jump more.
"""

from __future__ import annotations

from firstorder.space import Scene, disc, primitive, rectangle, sphere
from gallery.frame import Frame
from gallery.stills._mesh_lines import lit_mesh


def scene() -> Scene:
    """A lamp, four balls and a disc."""
    lamp = rectangle((0.1, 0.0, 2.4), (0.0, 0.4, 0.0), (0.4, 0.0, 0.0))
    balls = [
        sphere((-0.72, -0.12, 0.6), 0.4),
        sphere((-0.1, 0.36, 0.95), 0.3),
        sphere((0.62, -0.28, 0.5), 0.32),
        sphere((0.72, 0.3, 1.1), 0.22),
    ]
    plate = disc((0.0, -0.5, 0.62), (0.08, -0.06, 1.0), 0.26)
    return Scene.of(primitive(lamp, emission=4.0), *map(primitive, [*balls, plate]))


def still(frame: Frame):
    return lit_mesh(frame, scene(), (0.0, 0.02), width=4.2, reach=2.2)
