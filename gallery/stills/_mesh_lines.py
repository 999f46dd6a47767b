"""Exact light on a floor, and the lines of its discontinuity mesh over it."""

from __future__ import annotations

import jax.numpy as jnp
import numpy as np
from matplotlib.collections import LineCollection

from firstorder.space import Receiver, Scene, irradiance
from firstorder.space.discontinuities import DiscontinuityMesh, discontinuity_mesh
from gallery.frame import Frame, developed, drawn

WARM = np.array([1.12, 0.98, 0.80])
GRADIENT, HESSIAN, TOUCHES = "#ff7a2e", "#2f9bff", "#6dff9c"  # what jumps, or grows without bound


def lit_mesh(frame: Frame, world: Scene, middle, width: float, reach: float, every: int = 3):
    """Irradiance in every third pixel, a cubic spline between them, under the lines of events."""
    extent = frame.extent(middle, width)

    def at(p):
        return irradiance(world, Receiver.at(jnp.append(p, 0.0)))

    light = frame.field(at, extent, rows=1, block=512, every=every)
    ax = frame.canvas(developed(light[..., None] * WARM, 0.13 / np.median(light)), extent)
    found = discontinuity_mesh(world, Receiver.at((0.0, 0.0, 0.0)), points=257, reach=reach)
    touches = found.kind == "outlines that touch"
    for rows, color in (
        (touches, TOUCHES),
        (~touches & (found.order == 2), HESSIAN),
        (~touches & (found.order == 1), GRADIENT),
    ):
        _add(ax, frame, found, np.flatnonzero(rows), color)
    return drawn(ax)


def _add(ax, frame: Frame, found: DiscontinuityMesh, rows, color: str):
    """Lines of one color; those that jump more are brighter and wider."""
    if not rows.size:
        return
    sizes = np.array([np.median(found.jumps[k]) for k in rows])
    strength = np.clip(1.0 + np.log10(sizes / sizes.max() + 1e-9) / 3.0, 0.45, 1.0)
    ax.add_collection(LineCollection(
        [found.lines[k][:, :2] for k in rows], colors=color, alpha=strength,
        linewidths=(1.2 + 1.8 * strength) * frame.fine))  # fmt: skip
