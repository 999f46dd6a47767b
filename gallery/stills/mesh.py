"""The discontinuity mesh of a floor: where two or three edges meet before one's eye.

A square lamp over a rosette of boards, exact irradiance in every third pixel (a cubic spline
between them) in warm light, and over it the visual events of `space.discontinuities`: along each
line the gradient of irradiance jumps (orange), or its Hessian (blue). Between the lines everything
is smooth. Brighter lines jump more.
"""

from __future__ import annotations

import jax.numpy as jnp
import numpy as np
from matplotlib.collections import LineCollection

from firstorder.space import Receiver, Scene, irradiance, primitive, rectangle
from firstorder.space.discontinuities import discontinuity_mesh
from gallery.frame import Frame, developed, drawn


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
    world, extent = scene(), frame.extent((-0.15, -0.05), 6.2)

    def at(p):
        return irradiance(world, Receiver.at(jnp.append(p, 0.0)))

    light = frame.field(at, extent, rows=1, block=512, every=3)
    warm = light[..., None] * np.array([1.12, 0.98, 0.80])
    ax = frame.canvas(developed(warm, 0.13 / np.median(light)), extent)
    found = discontinuity_mesh(world, Receiver.at((0.0, 0.0, 0.0)), points=257, reach=3.2)
    for order, color in ((2, "#2f9bff"), (1, "#ff7a2e")):
        rows = np.flatnonzero(found.order == order)
        if not rows.size:
            continue
        sizes = np.array([np.median(found.jumps[k]) for k in rows])
        strength = np.clip(1.0 + np.log10(sizes / sizes.max() + 1e-9) / 3.0, 0.35, 1.0)
        ax.add_collection(LineCollection(
            [found.lines[k][:, :2] for k in rows], colors=color, alpha=strength,
            linewidths=(1.2 + 1.8 * strength) * frame.fine))  # fmt: skip
    return drawn(ax)
