"""Tubes of power: lines of the net flux from two lamps to where it ends.

The vector `int L w dw` of all light that arrives at a place has no divergence in empty space. Lines
along it that leave the lamps at equal steps of power bound tubes, each of which carries the same
power all its way: count the lines that end on a body, and you have what it receives. They bend
round what hides a lamp although all rays are straight. The vector is exact at every step; below it,
the exact fluence.
"""

from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np
from matplotlib.collections import LineCollection

from firstorder.flatland import (
    Circles,
    Ellipses,
    Receiver,
    Scene,
    Segments,
    irradiance,
    occluded,
    primitive,
)
from gallery.frame import Frame, developed, drawn
from gallery.stills._flatland import draw_shapes, fluence

LAMPS = (((-3.4, 3.6), (-5.2, 3.2)), ((6.0, 1.7), (5.0, 3.2)))
TINTS = (1.0, 0.70, 0.36), (0.34, 0.64, 1.0)
DISCS = ((-2.2, 0.5, 0.75), (2.6, 0.9, 0.5), (0.3, -1.7, 0.55), (-5.5, -0.7, 0.45))
STEP, STEPS = 0.04, 400  # [m]; two vectors each


def scene(tints=TINTS) -> Scene:
    """Lamps, a floor and bodies."""
    lamps = zip(LAMPS, tints, strict=True)
    return Scene.of(
        *(primitive(Segments(a, b), emission=tint) for (a, b), tint in lamps),
        primitive(Segments((-12.0, -3.7), (12.0, -3.7))),
        primitive(Ellipses((4.4, -1.9), (1.0, 0.42), -0.4)),
        *(primitive(Circles((x, y), r)) for x, y, r in DISCS),
    )


def starts(world: Scene, share: float) -> np.ndarray:
    """Places on the lamps between which a share of power leaves [W], shape (n, 2)."""
    found, s = [], (np.arange(256) + 0.5) / 256
    back = jax.jit(jax.vmap(lambda k, s: irradiance(world, Receiver.on_shape(world, k, s))))
    for lamp, (a, b) in enumerate(np.array(LAMPS)):
        out = 2.0 - np.asarray(back(jnp.full(s.shape, lamp), jnp.asarray(s)))
        power = np.append(0.0, np.cumsum(out)) * np.hypot(*(b - a)) / s.size
        even = np.interp(np.arange(0.5 * share, power[-1], share), power, np.arange(257) / 256)
        found.append(a + even[:, None] * (b - a) + 1e-6 * np.array([a[1] - b[1], b[0] - a[0]]))
    return np.concatenate(found)


def lines(world: Scene, p: np.ndarray) -> np.ndarray:
    """Places along the net flux from places p, shape (n, steps, 2), by the midpoint rule."""
    angles = jnp.pi * jnp.array([-0.5, 0.5, 0.0, 1.0])

    def way(p, before):
        E = jax.vmap(lambda n: irradiance(world, Receiver(p, n)))(angles)
        flux = jnp.stack([E[1] - E[0], E[3] - E[2]])  # from where it is bright to where it is not
        size = jnp.sqrt(jnp.sum(flux**2))
        return jnp.where(size > 0.0, flux / jnp.where(size > 0.0, size, 1.0), before)

    def step(places, whole):
        start, at, along = places  # half a step to the middle, then a whole one as light goes there
        along = way(at, along)  # inside what it meets it goes on as before
        at = start + jnp.where(whole, STEP, 0.5 * STEP) * along
        return (jnp.where(whole, at, start), at, along), at

    def line(p):
        whole = jnp.arange(2 * STEPS) % 2 == 1
        return jax.lax.scan(step, (p, p, jnp.zeros(2)), whole)[1][1::2]

    followed = jax.jit(jax.vmap(line))(jnp.asarray(p))
    return np.concatenate([p[:, None], followed], 1)


def cut(world: Scene, path: np.ndarray) -> np.ndarray:
    """A line up to what it meets."""
    a, b = jnp.asarray(path[:-1]), jnp.asarray(path[1:])
    met = np.flatnonzero(np.asarray(occluded(world, a, b)))
    return path[: met[0] + 2] if met.size else path


def still(frame: Frame):
    world, extent = scene(), frame.extent((0.2, -0.1), 14.0)
    ax = frame.canvas(developed(frame.field(fluence(world), extent, rows=1), 0.2), extent)
    grey = scene((1.0, 1.0))
    found = lines(grey, starts(grey, 0.2 if frame.width < 400 else 0.0285))
    ax.add_collection(LineCollection(
        [cut(grey, line) for line in found], colors="#fff3d6", alpha=0.8,
        linewidths=1.1 * frame.fine, zorder=0.5))  # fmt: skip
    draw_shapes(ax, world, 1.6 * frame.fine)
    return drawn(ax)
