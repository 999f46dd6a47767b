"""Sunlight in a pool: every wave of the water is a lens.

A slanted beam in flatland falls on a surface of five waves. Each of three bands sends thousands of
rays by Snell's law, with Fresnel's share, until a stone or the bottom stops them; two neighbours
bound a tube whose flux is known. Light piles up on curves, the envelopes of the rays, where the
map from surface to depth folds; below a crest they are bright, below a trough light spreads. Water
takes red first.
"""

from __future__ import annotations

import jax.numpy as jnp
import numpy as np

from firstorder.conventions import direction
from firstorder.flatland import Circles, Ellipses, Scene, Segments, nearest, primitive
from firstorder.flatland.library.bumps import SineBumps
from firstorder.flatland.refraction import fresnel_reflectance
from gallery.frame import Frame, developed, drawn
from gallery.stills._flatland import draw_shapes
from gallery.stills._tubes import spread

SUN = np.pi + 0.30  # direction of the beam, counter-clockwise from upwards: down, to the right
WAVES = ((0.085, 0.23, 0.4), (0.040, 0.41, 1.9), (0.022, 0.77, 0.3), (0.010, 1.31, 2.2),
         (0.0020, 2.9, 1.0))  # fmt: skip
INDICES = (1.331, 1.334, 1.340)
BEAM = np.array([0.72, 0.86, 1.0])
KEPT = np.array([0.72, 0.915, 0.96])  # of the light, by a metre of water
SKY = np.array([0.006, 0.030, 0.062])  # that is everywhere
FLOOR, REACH = -6.6, 22.0


def scene() -> Scene:
    """The bottom, and stones."""
    stones = (((-4.6, -3.7), 0.62), ((3.3, -4.7), 0.85), ((5.9, -2.6), 0.36))
    return Scene.of(
        primitive(Segments((-REACH, FLOOR), (REACH, FLOOR))),
        *(primitive(Circles(c, r)) for c, r in stones),
        primitive(Ellipses((-0.9, FLOOR + 0.25), (1.5, 0.55), 0.0)),
    )


def surface(x) -> tuple[np.ndarray, np.ndarray]:
    """Height [m] and slope."""
    waves = [SineBumps(*wave).heights(jnp.asarray(x)) for wave in WAVES]
    height, slope = (np.sum([w[k] for w in waves], axis=0) for k in (0, 1))
    return height, slope


def rays(world: Scene, x, index: float):
    """Where rays enter and end, shape (2, n, 2), and the share of power that goes in."""
    height, slope = surface(x)
    normal = np.arctan(slope)
    inside = np.pi + normal + np.arcsin(np.sin(SUN - np.pi - normal) / index)
    start = np.stack([x, height], -1)
    along = np.asarray(direction(jnp.asarray(inside)))
    t = np.asarray(nearest(world, jnp.asarray(start), jnp.asarray(along)).t)
    share = 1.0 - np.asarray(fresnel_reflectance(index, np.cos(SUN - np.pi - normal)))
    return np.stack([start, start + np.minimum(t, 40.0)[:, None] * along]), share


def still(frame: Frame):
    world, extent = scene(), frame.extent((0.0, -2.95), 14.4)
    x = np.linspace(-9.5, 9.0, 2 * frame.width * 4)
    image = np.zeros((frame.height, frame.width, 3))
    for band, index in enumerate(INDICES):
        one = np.zeros(image.shape[:2])
        p, share = rays(world, x, index)
        across = p[0] @ np.array([np.cos(SUN), np.sin(SUN)])  # of the beam [m]
        spread(one, p, np.abs(np.diff(across)) * 0.5 * (share[1:] + share[:-1]), extent)
        image[..., band] = one
    _, _, low, high = extent
    y = low + (np.arange(frame.height) + 0.5) * (high - low) / frame.height
    image *= BEAM * KEPT ** (np.maximum(-y, 0.0)[:, None, None] / np.cos(0.22))
    image += SKY
    ax = frame.canvas(developed(image.swapaxes(0, 1), 0.42), extent)
    line = np.linspace(*extent[:2], 1200)
    top = surface(line)[0]
    draw_shapes(ax, world, 1.4 * frame.fine, dark="#060a10", rim="#8fb4c8")
    ax.fill_between(line, top, high, color="#dcebf5", linewidth=0)
    ax.plot(line, top, "-", color="white", linewidth=2.4 * frame.fine)
    ax.fill_between(line, FLOOR, low, color="#060a10", linewidth=0, zorder=3)
    return drawn(ax)
