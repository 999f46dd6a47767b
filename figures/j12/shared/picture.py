"""The box scenes as a camera before them sees them: one reflection, rendered, antialiased.

Walls and block send what the radiance maps say, the lamp what it emits. The floor is black for the
light, so that what is measured on it is one reflection; in the picture it is drawn as if of albedo
0.5, with direct light and with the indirect light of `box.Case.truth`.
"""

from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np
from scipy.interpolate import RegularGridInterpolator
from scipy.ndimage import distance_transform_edt

from figures.j12.shared.box import Case, places
from figures.r07.shared.look import GROUND
from firstorder.imaging import pinhole
from firstorder.plotting import develop
from firstorder.rendering import image_coordinates, subpixels
from firstorder.space import Receiver, irradiance
from firstorder.space.bounces import trace_maps

CAMERA = pinhole((0.80, -1.75, 0.95), (0.5, 0.5, 0.44), gamma=2.9)
ALBEDO, EXPOSURE = 0.5, 6.0
FINER = 4  # cells of direct light along one of indirect light, whose shadows are softer
TINTS = {"left": (0.9, 0.45, 0.3), "block": (0.45, 0.6, 0.9)}  # for show, of luminance about 0.6


def rendered(c: Case, width: int, height: int) -> np.ndarray:
    """Levels of a screen, rows from the top; 3 x 3 places a pixel."""
    floor, total = _floor(c), 0.0
    x = np.stack(np.meshgrid(np.arange(width), np.arange(height), indexing="ij"), -1)
    for place in subpixels(3):
        total = total + _seen(c, image_coordinates(x.reshape(-1, 2) + place, width, height), floor)
    image, nothing = np.split(np.asarray(total).reshape(width, height, 4) / 9.0, [3], -1)
    share = np.linspace(1.0, 0.0, height)[:, None, None]
    ground = share * GROUND[1] + (1.0 - share) * GROUND[0]
    nothing = nothing.swapaxes(0, 1)[::-1]
    solid = np.maximum(1.0 - nothing, 1e-9).swapaxes(0, 1)[:, ::-1]
    levels = develop(image / solid, EXPOSURE)
    return np.rint(nothing * ground + (1.0 - nothing) * levels).astype(np.uint8)


def _seen(c: Case, p: np.ndarray, floor) -> np.ndarray:
    """Radiance in three bands, and whether nothing is met: shape (n, 4)."""
    scene = c.maps.scene
    along = np.asarray(jax.vmap(CAMERA.direction)(jnp.asarray(p)))
    eye = np.broadcast_to(np.asarray(CAMERA.eye), along.shape)
    hits = trace_maps(c.maps, tuple(map(jnp.asarray, eye.T)), tuple(map(jnp.asarray, along.T)), -1)
    index, L = np.asarray(hits.index), np.asarray(hits.radiance)
    emitted = np.asarray(scene.material.emission)[index, 0]
    out = np.repeat(np.where(index >= 0, L + emitted, 0.0)[:, None], 3, 1)
    for name, tint in TINTS.items():
        if name in scene.names:
            out[index == scene.named(name)[0]] *= np.array(tint) / 0.6
    here = index == scene.named("floor")[0]
    at = eye + np.asarray(hits.distance)[:, None] * along
    out[here] = ALBEDO / np.pi * floor(at[here, :2])[:, None]
    return np.concatenate([out, (index < 0)[:, None]], 1)


def _floor(c: Case):
    """Irradiance of the floor, direct and indirect, between places; under the block the nearest."""
    scene, few, many = c.maps.scene, c.size.pixels, FINER * c.size.pixels

    @jax.jit
    def direct(x):
        return jax.vmap(lambda p: irradiance(scene, Receiver.at(jnp.append(p, 0.0))))(x)

    indirect = c.image(c.truth)
    known = distance_transform_edt(np.isnan(indirect), return_distances=False, return_indices=True)
    row, column = np.asarray(known)
    parts = []
    for n, E in ((few, indirect[row, column]), (many, direct(jnp.asarray(places(many))))):
        s = (np.arange(n) + 0.5) / n
        E = np.asarray(E).reshape(n, n).T
        parts.append(RegularGridInterpolator((s, s), E, "linear", False, None))
    return lambda x: parts[0](x) + parts[1](x)
