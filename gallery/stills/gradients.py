"""Irradiance of a floor in three colours, with its gradient and its Hessian where they stand.

Two lamps over a floor with three bodies, seen from above: irradiance exact in every fourth pixel
both ways, by integrals along silhouettes, and a cubic spline between them. Arrows are gradients of
the green band, shadow edges included; ellipses have the Hessian's principal curvatures, long where
light bends little: what an irradiance cache would make of this floor.
"""

from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np
from matplotlib.collections import EllipseCollection

from firstorder.numerics._batching import host_blocks
from firstorder.space import (
    Receiver,
    Scene,
    box,
    derivatives,
    irradiance,
    primitive,
    rectangle,
    sphere,
)
from gallery.frame import Frame, developed, drawn

COLUMNS = 24


def scene() -> Scene:
    """Lamps that look down, two balls, a box."""

    def lamp(x, y, z, u, v, L):
        return primitive(rectangle((x, y, z), (0.0, v, 0.0), (u, 0.0, 0.0)), emission=L)

    return Scene.of(
        lamp(-1.9, 1.5, 1.7, 0.12, 0.12, (44.0, 19.0, 6.0)),
        lamp(2.3, 0.9, 1.6, 0.10, 0.15, (5.0, 18.0, 44.0)),
        primitive(sphere((-0.7, 0.25, 0.42), 0.36)),
        primitive(sphere((1.05, -0.35, 0.35), 0.27)),
        primitive(box((-1.9, -0.8, 0.1), (-1.2, -0.6, 0.5))),
    )


def still(frame: Frame):
    world, extent = scene(), frame.extent((0.0, 0.0), 6.4)

    def at(p):
        return irradiance(world, Receiver.at(jnp.append(p, 0.0)))

    light = frame.field(at, extent, rows=1, block=512, every=4)
    ax = frame.canvas(developed(light, 0.75), extent)
    _draw_derivatives(ax, world.band(1), extent, frame)
    return drawn(ax)


def _draw_derivatives(ax, world: Scene, extent, frame: Frame) -> None:
    left, right, low, high = extent
    step = (right - left) / COLUMNS
    sides = (left, right, COLUMNS), (low, high, COLUMNS * 9 // 16)
    x, y = (0.5 * (a + b) + step * (np.arange(n) - 0.5 * (n - 1)) for a, b, n in sides)
    p = np.stack(np.meshgrid(x, y, indexing="ij"), -1).reshape(-1, 2)

    def jet(p):
        d = derivatives(irradiance, world, Receiver.at(jnp.append(p, 0.0)))
        return d.gradient[..., :2], d.hessian[..., :2, :2]

    g, H = host_blocks(jax.jit(jax.vmap(jet)), p, 256)
    size = np.linalg.norm(g, axis=1)
    way = 0.42 * step * g / np.maximum(size, 1e-12)[:, None]
    way *= np.clip(np.log10(size / np.quantile(size, 0.98) + 1e-9) / 1.6 + 1.0, 0.05, 1.0)[:, None]
    bend, frames = np.linalg.eigh(H)
    radii = 1.0 / np.sqrt(np.maximum(np.abs(bend), 1e-6))
    radii = 0.46 * step * radii / np.maximum(radii.max(1), np.quantile(radii, 0.6))[:, None]
    radii = np.maximum(radii, 0.04 * step)
    turn = np.degrees(np.arctan2(frames[:, 1, 0], frames[:, 0, 0]))
    ax.add_collection(EllipseCollection(
        2 * radii[:, 0], 2 * radii[:, 1], turn, units="xy", offsets=p,
        offset_transform=ax.transData, facecolors="none", edgecolors="#ffffff", alpha=0.5,
        linewidths=1.2 * frame.fine))  # fmt: skip
    ax.quiver(*p.T, *way.T, angles="xy", scale_units="xy", scale=1.0, color="white", alpha=0.95,
              width=0.0016, headwidth=4.5, headlength=5.5)  # fmt: skip
