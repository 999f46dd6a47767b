"""The discontinuity mesh of a floor: where two or three edges meet before one's eye.

A square lamp over a rosette of boards, exact irradiance in every third pixel (a cubic spline
between them) in warm light, and over it the visual events of `space.discontinuities`: along each
line the gradient of irradiance jumps (orange), or its Hessian (blue). Between the lines everything
is smooth. Brighter lines jump more.
"""

from __future__ import annotations

import numpy as np

from firstorder.space import Scene, primitive, rectangle
from gallery.frame import Frame
from gallery.stills._mesh_lines import lit_mesh


def scene() -> Scene:
    """A lamp and five boards, tilted."""

    def board(x, y, z, turn, half, wide, tilt=0.0):
        c, s = np.cos(turn), np.sin(turn)
        u = half * np.array([c, s, 0.0])
        v = wide * np.array([-s * np.cos(tilt), c * np.cos(tilt), np.sin(tilt)])
        return primitive(rectangle((x, y, z), u, v))

    lamp = rectangle((0.15, 0.1, 2.3), (0.0, 0.45, 0.0), (0.45, 0.0, 0.0))
    rosette = [
        board(0.72 * np.cos(a), 0.62 * np.sin(a), z, a + 1.05, 0.62, 0.17, tilt)
        for a, z, tilt in ((0.1, 0.33, 0.3), (1.36, 0.58, 0.0), (2.62, 0.38, -0.35),
                           (3.87, 0.64, 0.2), (2.0 * np.pi - 1.05, 0.42, 0.0))
    ]  # fmt: skip
    return Scene.of(primitive(lamp, emission=4.0), *rosette)


def still(frame: Frame):
    return lit_mesh(frame, scene(), (-0.15, -0.05), width=6.2, reach=3.2)
