"""The scene of `d05.shared.space` rendered: the light, balls below it, what receives the rest.

Coordinates are the receiver's, who looks up: (x, y, height), the receiver at height 0, the balls at
`SECOND`, the light at `FIRST + SECOND`; light on its way has -x (`space.arrived`). Balls and what
receives are shaded by the light itself; a faint light is added, most of it from above, so that what
is dark can be told apart. The light is drawn as a disc of two deviations.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from matplotlib.axes import Axes

from figures.d05.shared import space
from figures.r07.shared.look import CLAY, FRAMES, GROUND, SLATE, WOOD
from firstorder.imaging.camera import Pinhole
from firstorder.io.images import LUMINANCE
from firstorder.plotting import develop, exposure_of
from firstorder.rendering import image_coordinates, subpixels

TOP = space.FIRST + space.SECOND  # height of the light [m]
FILL = 0.04  # the faint light, of what arrives at the balls on the axis
LAMP = 2.0 * space.SIGMA_X  # radius of the disc that is drawn for the light [m]
RECEIVER, BALL = (np.array(c) / (np.array(c) @ LUMINANCE) for c in (WOOD, SLATE))
GLOSSY = np.array(CLAY) / (np.array(CLAY) @ LUMINANCE)


class View(NamedTuple):
    """What is rendered, and from where.

    Attributes:
        camera: that looks.
        meet: distance from the eye to what receives along directions (n, 3), infinite if missed.
        shade: radiance of its points, seen along directions, both (n, 3).
        tint: of the receiver.
        reach: balls whose middles lie as near the axis, in x and y, are drawn [m].
        shape: width and height of the picture [pixels].
    """

    camera: Pinhole
    meet: Any
    shade: Any
    tint: np.ndarray
    reach: float
    shape: tuple[int, int]

    def at(self, points) -> np.ndarray:
        """Where on the picture points are seen [pixels]."""
        way = (np.atleast_2d(points) - np.asarray(self.camera.eye)) @ np.asarray(self.camera.axes)
        scale = 0.5 * self.shape[0] * float(self.camera.gamma) / -way[:, 2]
        return 0.5 * np.array(self.shape) + scale[:, None] * way[:, :2]


def rendered(view: View, balls: space.Balls) -> np.ndarray:
    """Levels of a screen, rows from the top; 2 x 2 places a pixel."""
    width, height = view.shape
    x = np.stack(np.meshgrid(np.arange(width), np.arange(height), indexing="ij"), -1)
    total = np.zeros((width * height, 4))
    for place in subpixels(2):
        p = image_coordinates(x.reshape(-1, 2) + place, width, height)
        way = np.column_stack([p, np.full(len(p), -float(view.camera.gamma))])
        way = way @ np.asarray(view.camera.axes).T
        way /= np.linalg.norm(way, axis=1)[:, None]
        total += _seen(view, balls, way) / 4.0
    image, shown = np.split(total.reshape(width, height, 4), [3], -1)
    colour = image / np.maximum(shown, 1e-9)
    share = np.linspace(1.0, 0.0, height)[:, None, None]
    ground = share * GROUND[1] + (1.0 - share) * GROUND[0]
    shown = shown.swapaxes(0, 1)[::-1]
    levels = develop(colour, exposure_of(colour, 0.2))
    return np.rint(shown * levels + (1.0 - shown) * ground).astype(np.uint8)


def show(ax: Axes, view: View, balls: space.Balls, title: str) -> None:
    """The picture, the light, and the central ray down to the receiver."""
    width, height = view.shape
    ax.imshow(rendered(view, balls), extent=(0, width, 0, height), origin="upper")
    ax.set(xticks=[], yticks=[], xlim=(0, width), ylim=(0, height))
    ax.set_title(title, loc="left")
    draw_path(ax, view, [(0.0, 0.0, TOP), (0.0, 0.0, 0.0)])
    a = np.linspace(0.0, 2.0 * np.pi, 61)
    rim = np.stack([LAMP * np.cos(a), LAMP * np.sin(a), np.full(61, TOP)], -1)
    ax.fill(*view.at(rim).T, facecolor="#ffe9a8", edgecolor=FRAMES[1], linewidth=1.4)


def draw_path(ax: Axes, view: View, points) -> None:
    """Points that a ray passes, joined."""
    ax.plot(*view.at(points).T, "-", color=FRAMES[1], linewidth=1.0)


def name(ax: Axes, view: View, point, words: str, **options) -> None:
    """A name beside a point."""
    (x, y), *_ = view.at(point)
    shared = dict(fontsize=8, va="center", color="0.15")
    ax.text(x, y, words, **(shared | options))


def source_light(points, normals, balls: space.Balls | None = None, nodes: int = 6, lobe=None):
    """Irradiance by the light of points (n, 3) that face it, less what balls above them hide.

    `int L cos cos' / r^2 dA` by Gauss-Hermite nodes over the light.

    Args:
        points: [m].
        normals: unit vectors.
        balls: in the way, for points below them; None for none.
        nodes: on the light, along each axis.
        lobe: mirrored directions (n, 3) and a deviation: the radiance that a glossy surface sends,
            in place of the irradiance.
    """
    return np.asarray(_source_light(jnp.asarray(points), jnp.asarray(normals), balls, nodes, lobe))


@eqx.filter_jit
def _source_light(points, normals, balls, nodes: int, lobe):
    t, weight = np.polynomial.hermite_e.hermegauss(nodes)
    weight = weight / np.sqrt(2.0 * np.pi)
    area = 2.0 * np.pi * space.SIGMA_X**2
    grid = [a.ravel() for a in np.meshgrid(space.SIGMA_X * t, space.SIGMA_X * t)]
    table = jnp.asarray(np.stack([*grid, area * np.outer(weight, weight).ravel()], -1))
    down = TOP - points[:, 2]

    def node(total, row):
        way = jnp.array([row[0], row[1], TOP]) - points
        far = jnp.linalg.norm(way, axis=1)
        v, w = -way[:, 0] / down, -way[:, 1] / down  # slopes on the way down
        L = jnp.exp(-0.5 * (v * v + w * w) / space.SIGMA_V**2)
        if balls is not None:
            x, y = row[0] + space.FIRST * v, row[1] + space.FIRST * w
            L = L * balls.through(-x, y, -v, w)
        if lobe is None:
            kernel = jnp.maximum(jnp.sum(normals * way, 1), 0.0) / far
        else:
            off = jnp.sum((way / far[:, None] - lobe[0]) ** 2, 1) / lobe[1] ** 2
            kernel = jnp.exp(-0.5 * off) / (2.0 * np.pi * lobe[1] ** 2)
        return total + row[2] * L * kernel * down / far**3, None

    return jax.lax.scan(node, jnp.zeros(len(points)), table)[0]


def _seen(view: View, balls: space.Balls, way: np.ndarray) -> np.ndarray:
    """Radiance in three bands, and whether anything is met, by rays from the eye: shape (n, 4)."""
    eye = np.asarray(view.camera.eye)
    to_ball, middles = (np.asarray(a) for a in _nearest_ball(balls, eye, way, view.reach))
    far = np.stack([view.meet(eye, way), to_ball])
    first = np.where(np.isinf(far.min(0)), -1, far.argmin(0))
    P = eye + np.where(first < 0, 0.0, far.min(0))[:, None] * way
    out = np.zeros((len(P), 4))
    out[:, 3] = first >= 0
    at = first == 0
    out[at, :3] = view.shade(P[at], way[at])[:, None] * view.tint
    at = first == 1
    normals = (P[at] - middles[at]) / balls.radius
    light = source_light(P[at], normals, nodes=3) + faint_light(normals)
    out[at, :3] = (0.5 / np.pi * light)[:, None] * BALL
    return out


@eqx.filter_jit
def _nearest_ball(balls: space.Balls, eye, way, reach: float):
    """Distance to the nearest ball, infinite if none is met, and its middle.

    Rays look up the balls of the cells that they pass between the layer's faces.
    """
    r, cells = balls.radius, len(balls.centers)
    rise = jnp.where(jnp.abs(way[:, 2]) > 1e-6, way[:, 2], 1e-6)
    ends = jnp.stack([(space.SECOND + s * r - eye[2]) / rise for s in (-1.0, 1.0)])
    begin, end = jnp.maximum(ends.min(0), 0.0), jnp.maximum(ends.max(0), 0.0)
    steps = 48
    stride = jnp.minimum((end - begin) / steps, 0.5 * balls.period)

    def look(k, found):
        at = eye + (begin + (k + 0.5) * stride)[:, None] * way
        i, j = (jnp.floor((a + 0.5 * space.BOX) / balls.period) for a in (-at[:, 0], at[:, 1]))
        i, j = (jnp.clip(a.astype(int), 0, cells - 1) for a in (i, j))
        c = balls.centers[i, j] * jnp.array([-1.0, 1.0])
        middle = jnp.column_stack([c, jnp.full(len(c), space.SECOND)])
        t = _to_sphere(eye, way, middle, r)
        drawn = jnp.all(jnp.abs(c) < reach - r, 1)
        closer = drawn & (t < found[0])
        return jnp.where(closer, t, found[0]), jnp.where(closer[:, None], middle, found[1])

    start = jnp.full(len(way), jnp.inf), jnp.zeros(way.shape)
    return jax.lax.fori_loop(0, steps, look, start)


def _to_sphere(eye, way, middle, radius):
    """Distance to a sphere from outside, infinite if it is missed."""
    off = eye - middle
    b = jnp.sum(off * way, -1)
    inside = b * b - jnp.sum(off * off, -1) + radius**2
    t = -b - jnp.sqrt(jnp.maximum(inside, 0.0))
    return jnp.where((inside > 0.0) & (t > 0.0), t, jnp.inf)


def sphere(middle, radius: float):
    """Where rays meet a ball that receives."""
    return lambda eye, way: np.asarray(_to_sphere(eye, way, np.asarray(middle), radius))


def floor(half: float):
    """Where rays meet the square of a flat receiver."""

    def meet(eye, way):
        with np.errstate(divide="ignore"):
            t = -eye[2] / way[:, 2]
        inside = np.all(np.abs(eye[:2] + t[:, None] * way[:, :2]) < half, 1)
        return np.where((t > 0.0) & inside, t, np.inf)

    return meet


def faint_light(normals) -> np.ndarray:
    """Irradiance by the faint light."""
    up = np.array([[0.0, 0.0, 1.0]])
    return FILL * source_light(space.SECOND * up, up) * (1.0 + np.asarray(normals)[..., 2])
