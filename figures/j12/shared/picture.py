"""The box scenes as a camera before them sees them: one reflection, rendered, antialiased.

Walls and block send what they are known to send in closed form (`shared.exact_box`), the lamp what
it emits. The floor is black for the light, so that what is measured on it is one reflection; in the
picture it is drawn as if of albedo 0.5, with the lamp's light, by 32 x 32 places on the lamp, and
the indirect light that a figure measures.
"""

from __future__ import annotations

import functools

import jax
import jax.numpy as jnp
import numpy as np
from jax.scipy.ndimage import map_coordinates
from matplotlib.axes import Axes
from scipy.interpolate import RegularGridInterpolator
from scipy.ndimage import distance_transform_edt

from figures.j12.shared.exact_box import BLOCK, Room, lamp_seen, middles, side_light, wall_light
from figures.r07.shared.look import FRAMES, GROUND
from firstorder.imaging import pinhole
from firstorder.plotting import develop
from firstorder.rendering import image_coordinates, subpixels

CAMERA = pinhole((0.80, -1.75, 0.95), (0.46, 0.5, 0.43), gamma=3.2)
ALBEDO, EXPOSURE = 0.5, 6.0
CELLS = 96  # of the floor along a side, whose light is interpolated
TINTS = np.array([(0.9, 0.45, 0.3), (0.45, 0.6, 0.9)]) / 0.6  # left wall and block, for show
SHAPE = (360, 360)  # of a picture, width and height [pixels]


def rendered(room: Room, indirect: np.ndarray, blocked: bool, shape=SHAPE) -> np.ndarray:
    """Levels of a screen, rows from the top; 3 x 3 places a pixel.

    Args:
        room: the box.
        indirect: irradiance of the floor at the middles of equal cells, rows along y; NaN under
            the block.
        blocked: whether the block is there.
        shape: width and height [pixels].
    """
    width, height = shape
    floor = jnp.asarray(ALBEDO / np.pi * (_direct(room, blocked) + _spread(indirect)))
    x = np.stack(np.meshgrid(np.arange(width), np.arange(height), indexing="ij"), -1)
    total = np.zeros((width * height, 4))
    for place in subpixels(3):
        p = image_coordinates(x.reshape(-1, 2) + place, width, height)
        total = total + np.asarray(_seen(room, floor, jnp.asarray(p), blocked))
    image, nothing = np.split(total.reshape(width, height, 4) / 9.0, [3], -1)
    share = np.linspace(1.0, 0.0, height)[:, None, None]
    ground = share * GROUND[1] + (1.0 - share) * GROUND[0]
    levels = develop(image / np.maximum(1.0 - nothing, 1e-9), EXPOSURE)
    nothing = nothing.swapaxes(0, 1)[::-1]
    return np.rint(nothing * ground + (1.0 - nothing) * levels).astype(np.uint8)


def show_box(
    ax: Axes, room: Room, indirect: np.ndarray, title: str, *, records=None, blocked=False
):
    """The rendered box, and where records lie on its floor (m, 2), but for those out of sight."""
    width, height = SHAPE
    ax.imshow(rendered(room, indirect, blocked), extent=(0, width, 0, height), origin="upper")
    ax.set(xticks=[], yticks=[], xlim=(0, width), ylim=(0, height))
    ax.set_title(title, fontsize=8)
    if records is None:
        return
    x = np.asarray(records)
    ground = np.concatenate([x, np.zeros((len(x), 1))], 1)
    right, up, ahead = ((ground - np.asarray(CAMERA.eye)) @ np.asarray(CAMERA.axes)).T
    if blocked:
        low, high = _slabs(np.asarray(CAMERA.eye), ground - np.asarray(CAMERA.eye), room.block)
        hidden = (low < high) & (low > 0.0) & (low < 1.0 - 1e-9)
        right, up, ahead = right[~hidden], up[~hidden], ahead[~hidden]
    scale = 0.5 * width * float(CAMERA.gamma) / -ahead
    at = 0.5 * width + scale * right, 0.5 * height + scale * up
    ax.plot(*at, ".", color=FRAMES[1], markersize=1.6, markeredgewidth=0.0)


# --- light of the floor --------------------------------------------------------------------------


def _direct(room: Room, blocked: bool) -> np.ndarray:
    """The lamp's irradiance of the floor, rows along y."""
    found = _lamp_light(room, jnp.asarray(middles(CELLS)), blocked)
    return np.asarray(found).reshape(CELLS, CELLS)


@functools.partial(jax.jit, static_argnums=2)
def _lamp_light(room: Room, x, blocked: bool):
    def at(p):
        return jnp.sum(lamp_seen(room, p, BLOCK if blocked else None, 32).weight)

    return jax.lax.map(at, x, batch_size=64)


def _spread(indirect: np.ndarray) -> np.ndarray:
    """Indirect light at the floor's cells; under the block the nearest."""
    known = distance_transform_edt(np.isnan(indirect), return_distances=False, return_indices=True)
    row, column = np.asarray(known)
    y, x = ((np.arange(n) + 0.5) / n for n in indirect.shape)
    read = RegularGridInterpolator((y, x), indirect[row, column], "linear", False, None)
    return read(middles(CELLS)[:, ::-1]).reshape(CELLS, CELLS)


# --- rays ----------------------------------------------------------------------------------------


@functools.partial(jax.jit, static_argnums=3)
def _seen(room: Room, floor, p, blocked: bool):
    """Radiance in three bands, and whether nothing is met: shape (n, 4)."""
    eye, d = CAMERA.eye, jax.vmap(CAMERA.direction)(p)

    def plane(axis: int, at: float):
        """Distance to a plane, and whether it is met in the room."""
        t = (at - eye[axis]) / d[:, axis]
        hit = eye + t[:, None] * d
        size = jnp.array([1.0, 1.0, room.height])
        inside = jnp.delete((hit >= 0.0) & (hit <= size), axis, axis=1)
        return jnp.where((t > 0.0) & jnp.all(inside, 1), t, jnp.inf), hit

    bottom, on_floor = plane(2, 0.0)
    left, on_left = plane(0, 0.0)
    right, _ = plane(0, 1.0)
    top, on_top = plane(2, room.height)
    off = jnp.abs(on_top[:, :2] - jnp.array([room.across, 0.5]))
    top = jnp.where(jnp.all(off < room.lamp, 1), top, jnp.inf)
    right = jnp.where(room.wall > 0.0, right, jnp.inf)
    way = [bottom, left, top, right]
    cells = (CELLS * on_floor[:, 1::-1] - 0.5).T
    light = [
        jnp.repeat(map_coordinates(floor, list(cells), 1, "nearest")[:, None], 3, 1),
        wall_light(room, on_left[:, 1], on_left[:, 2])[:, None] * TINTS[0],
        jnp.broadcast_to(jnp.where(d[:, 2:] > 0.0, 1.0, 0.0), d.shape),
        jnp.zeros_like(d),
    ]
    if blocked:
        near, shade = _block(room, eye, d)
        way, light = [*way, near], [*light, shade[:, None] * TINTS[1]]
    first = jnp.argmin(jnp.stack(way), 0)
    nothing = jnp.isinf(jnp.min(jnp.stack(way), 0))
    L = jnp.take_along_axis(jnp.stack(light), first[None, :, None], 0)[0]
    return jnp.concatenate([jnp.where(nothing[:, None], 0.0, L), nothing[:, None]], 1)


def _block(room: Room, eye, d):
    """Distance to the block, and what the side that is met sends."""
    near, far = _slabs(eye, d, room.block)
    hit = eye + near[:, None] * d
    under = room._replace(height=room.height - room.block)
    from_lamp = jax.vmap(lambda q: jnp.sum(lamp_seen(under, q, None, 4).weight))(hit[:, :2])
    sides = [room.albedo / jnp.pi * from_lamp]
    chosen = jnp.zeros(len(d), int)
    for axis in (0, 1):
        for sign in (-1.0, 1.0):
            plane = BLOCK[int(sign > 0.0), axis]
            here = (jnp.abs(hit[:, axis] - plane) < 1e-9) & (d[:, axis] * sign < 0.0)
            sides.append(side_light(room, axis, sign)(hit[:, 1 - axis], hit[:, 2]))
            chosen = jnp.where(here, len(sides) - 1, chosen)
    met = (near < far) & (near > 0.0)
    light = jnp.take_along_axis(jnp.stack(sides), chosen[None], 0)[0]
    return jnp.where(met, near, jnp.inf), light


def _slabs(eye, d, height):
    """Where rays enter and leave the block, in units of `d`; they miss it if not in this order."""
    low, high = (np.append(BLOCK[0], 0.0), jnp.append(BLOCK[1], height))
    one, two = (low - eye) / d, (high - eye) / d
    return jnp.max(jnp.minimum(one, two), -1), jnp.min(jnp.maximum(one, two), -1)
