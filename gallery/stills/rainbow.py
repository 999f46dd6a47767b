"""Rainbows and caustics of glass in flatland, by tubes between neighbouring rays.

Slanted beams as wide as three discs of strongly dispersive glass (index 1.44 to 1.60). Each of 61
wavelengths sends 1,200 rays through each body by the library's `trace_path`, straight through and
once and twice reflected inside, with Fresnel's shares. Two neighbours bound a tube whose flux is
known, and spread it evenly over its width in each row of pixels that it crosses: folds, where the
width goes through zero, are as sharp as a pixel, and nothing is random.
"""

from __future__ import annotations

import functools

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from firstorder.flatland import Circles, Scene, primitive
from firstorder.flatland.refraction import Beam, through_body, trace_path
from gallery.frame import Frame, developed, drawn
from gallery.stills._flatland import draw_shapes
from gallery.stills._tubes import spread

TURN = np.pi + 0.42  # direction of the beam: down, a little to the right
BODIES = (((-2.6, 1.0), 1.7), ((3.4, -0.4), 0.9), ((6.6, 1.6), 0.5))
INDICES = np.linspace(1.44, 1.60, 61)  # red to violet
INSIDE = (0, 1, 2)  # reflections


def scene(index: float) -> Scene:
    """Discs of glass."""
    return Scene.of(*(primitive(Circles(c, r), ior=index) for c, r in BODIES))


def colours(count: int) -> np.ndarray:
    """Red, green and blue of each wavelength; the sum is white."""
    t = np.linspace(0.0, 1.0, count)[:, None]
    bells = np.exp(-(((t - [0.12, 0.5, 0.85]) / [0.2, 0.17, 0.2]) ** 2))
    return bells / bells.sum(0)


@functools.partial(eqx.filter_jit)
def paths(index, center, q, inside: int):
    """Places where rays turn, shape (k, n, 2), and the share of power on each way between them."""
    body = Scene.of(primitive(Circles(center[:2], center[2]), ior=index))
    beam = Beam(center[:2] - 12.0 * jnp.stack([-jnp.sin(TURN), jnp.cos(TURN)]), TURN)
    path = through_body(0, inside=inside)

    def until(k):
        return jax.vmap(lambda q: trace_path(body, path[:k], *beam.ray(q)))(q)

    ends = [until(k) for k in range(len(path) + 1)]
    places = [end.position for end in ends]
    places.append(ends[-1].position + 40.0 * ends[-1].along)
    return jnp.stack(places), jnp.stack([end.share for end in ends])


def light(frame: Frame, extent) -> np.ndarray:
    """Fluence of the beam and of all that glass does to it, shape (width, height, 3)."""
    rays, indices = (200, INDICES[::5]) if frame.width < 400 else (1200, INDICES)
    image = np.zeros((frame.height, frame.width, 3))
    for n, colour in zip(indices, colours(len(indices)), strict=True):
        one = np.zeros((frame.height, frame.width))
        for center, r in BODIES:
            q = r * np.sin(np.linspace(-1.0, 1.0, rays) * 0.49999 * np.pi)
            for inside in INSIDE:
                places, share = map(np.asarray, paths(n, jnp.array([*center, r]), q, inside))
                # Ways inside are drawn once each: the first ones belong to the path before.
                for k in range(inside + 1 if inside else 0, len(places) - 1):
                    flux = np.diff(q) * 0.5 * (share[k, 1:] + share[k, :-1])
                    spread(one, places[k : k + 2], flux, extent)
        image += colour * one[..., None]
    return image.swapaxes(0, 1)


def still(frame: Frame):
    extent = frame.extent((0.4, -0.4), 15.0)
    ax = frame.canvas(developed(light(frame, extent), 0.75), extent)
    draw_shapes(ax, scene(1.5), 1.2 * frame.fine, dark="none", rim="#dbe7ff")
    return drawn(ax)
