"""D05's two creatures on a floor, under distant light that casts soft shadows; no other light.

The paper has two dinosaurs and an environment map, and gives neither. Ours: two animals of 13
ellipsoids each, the near one shiny (s = 250), the far one dull (s = 40), a ball and a box, on a
floor of little gloss (s = 20); a sky of a constant, a lamp 0.12 rad wide on the right and a broad
lobe on the left. Surfaces are lit once, by the sky: what hides it is black, as D05's blockers are.

A pixel is shaded along 384 fixed rays: 128 to the lamp, 32 to the lobe, 96 about the normal for the
constant, 128 about the mirrored direction for the gloss. All errors are against that image itself.
"""

from __future__ import annotations

import pathlib
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from firstorder.conventions import cylindrical
from firstorder.io.tiles import render_tiles
from firstorder.methods.bandwidth_map import Seen, seen
from firstorder.space import Scene, box, ellipsoid, first_shape, plane, sphere, thing
from firstorder.space.environment import GaussianSky
from firstorder.space.image import Pinhole, pinhole
from firstorder.space.render import grid, labels, places
from firstorder.vectors import dot, frame, norm, times, unit

BLOCK = 1024
GOLDEN = 0.5 * (5.0**0.5 - 1.0)
RAYS = dict(lamp=128, fill=32, ambient=96, gloss=128)
PER_SAMPLE = sum(RAYS.values())
FOLDER = pathlib.Path(__file__).parent / "out" / "references"

WIDE = 0.12
LAMP: dict[str, Any] = dict(center=(0.7, -0.5, 0.75), sigma=WIDE, radiance=24.0)
FILL: dict[str, Any] = dict(center=(-0.8, -0.3, 0.5), sigma=0.3, radiance=2.0)
AMBIENT = 0.25
SHINY: dict[str, Any] = dict(albedo=0.12, specular=0.6, exponent=250.0)
DULL: dict[str, Any] = dict(albedo=0.4, specular=0.3, exponent=40.0)
FLOOR: dict[str, Any] = dict(albedo=0.45, specular=0.15, exponent=20.0)

# Centre (forward, left, up) and half-axes of a creature's parts, in its own frame [m].
PARTS = (
    ((0.0, 0.0, 0.62), (0.52, 0.27, 0.28)),
    ((0.46, 0.0, 0.82), (0.20, 0.13, 0.15)),
    ((0.60, 0.0, 0.99), (0.14, 0.10, 0.16)),
    ((0.70, 0.0, 1.17), (0.13, 0.11, 0.12)),
    ((0.88, 0.0, 1.15), (0.15, 0.075, 0.07)),
    ((-0.52, 0.0, 0.58), (0.24, 0.13, 0.13)),
    ((-0.76, 0.03, 0.50), (0.18, 0.08, 0.08)),
    ((-0.95, 0.08, 0.44), (0.14, 0.05, 0.05)),
    ((-1.10, 0.15, 0.40), (0.11, 0.03, 0.03)),
    ((0.30, 0.19, 0.25), (0.09, 0.08, 0.26)),
    ((0.30, -0.19, 0.25), (0.09, 0.08, 0.26)),
    ((-0.30, 0.19, 0.25), (0.10, 0.09, 0.26)),
    ((-0.30, -0.19, 0.25), (0.10, 0.09, 0.26)),
)


class World(NamedTuple):
    """The scene, the eye, and the size of the image."""

    scene: Scene
    camera: Pinhole
    columns: int
    rows: int

    @property
    def side(self) -> float:
        """Of a pixel, in image coordinates."""
        return 2.0 / self.columns

    def coordinates(self, p):
        """Image coordinates of places in pixels."""
        return (np.asarray(p) - 0.5 * np.array([self.columns, self.rows])) * self.side


class View(NamedTuple):
    """Depth, normals and shapes of all pixels: what costs one ray for each.

    Attributes:
        p: image coordinates, shape (n, 2).
        shows: number of the shape, -1 for none; (w, h).
        label: shapes and their faces, (w, h).
        at: geometry, all leaves (w h, ...).
    """

    p: np.ndarray
    shows: np.ndarray
    label: np.ndarray
    at: Seen

    @property
    def depth(self) -> np.ndarray:
        return np.asarray(self.at.distance).reshape(self.shows.shape)

    @property
    def normal(self) -> np.ndarray:
        return np.asarray(self.at.normal).reshape(*self.shows.shape, 3)


def world(quick: bool) -> World:
    """The scene at 800 x 500, or an eighth of it."""
    things = [thing(plane((0, 0, 0), (0, 0, 1)), name="floor", **FLOOR)]
    for at, turn, scale, how in (
        ((-0.75, -0.55), 0.35, 1.0, SHINY),
        ((1.05, 1.0), 2.6, 1.15, DULL),
    ):
        things += creature(at, turn, scale, how)
    things.append(thing(sphere((0.75, -0.9, 0.22), 0.22), name="ball", **SHINY))
    things.append(thing(box((-2.2, 0.9, 0.0), (-1.5, 1.5, 0.7)), name="box", **FLOOR))
    camera = pinhole((-0.4, -4.6, 2.3), (0.0, 0.0, 0.45), gamma=2.2)
    columns, rows = (96, 60) if quick else (800, 500)
    return World(Scene.of(*things, sky=sky), camera, columns, rows)


def creature(at, turn: float, scale: float, how: dict) -> list:
    """An animal that stands on the floor."""
    c, s = np.cos(turn), np.sin(turn)
    axes = scale * np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    base = np.array([*at, 0.0])
    return [
        thing(ellipsoid(base + axes @ np.array(p), axes * np.array(half)), name="creature", **how)
        for p, half in PARTS
    ]


def sky(w):
    """Radiance from a direction."""
    return AMBIENT + GaussianSky(**LAMP)(w) + GaussianSky(**FILL)(w)


def view(world: World) -> View:
    """What every pixel shows."""
    px, py = grid(world.columns, world.rows)
    return view_at(world, places(px, py), (world.columns, world.rows))


def view_at(world: World, p: np.ndarray, shape: tuple[int, ...]) -> View:
    """What is shown at image coordinates."""
    fill = np.resize(p, (-(-len(p) // 4096) * 4096, 2)).reshape(-1, 4096, 2)
    found = [
        [np.asarray(a) for a in labels(world.scene, world.camera, jnp.asarray(q))] for q in fill
    ]
    index, label = (np.concatenate([f[k] for f in found])[: len(p)] for k in (0, 1))
    at = seen(world.scene, world.camera, p, index)
    return View(p, index.reshape(shape), label.reshape(shape), at)


# --- shading -------------------------------------------------------------------------------------


def shade(world: World, at: Seen, index: np.ndarray) -> np.ndarray:
    """Radiance of many pixels, diffuse and glossy apart, in blocks of one compiled size."""
    count = len(index)
    fill = np.resize(np.arange(count), -(-count // BLOCK) * BLOCK).reshape(-1, BLOCK)
    parts = [np.asarray(_shaded(world.scene, *taken(at, index, rows))) for rows in fill]
    return np.concatenate(parts)[:count]


def taken(at: Seen, index: np.ndarray, rows: np.ndarray):
    """Some pixels, on the device."""
    return jax.tree.map(jnp.asarray, some(at, rows)), jnp.asarray(index[rows])


def some(at: Seen, rows: np.ndarray) -> Seen:
    """Some pixels."""
    return jax.tree.map(lambda a: a[rows], at)


@eqx.filter_jit
def _shaded(scene: Scene, at: Seen, index):
    lamp, fill = (lobe_nodes(which, RAYS[name]) for which, name in ((LAMP, "lamp"), (FILL, "fill")))
    ambient = times(frame(at.normal)[:, None], about(RAYS["ambient"], 1.0))
    mirrored = 2.0 * dot(at.normal, at.to_eye)[:, None] * at.normal - at.to_eye
    m = jax.tree.map(lambda a: a[jnp.maximum(index, 0)], scene.material)
    gloss = times(frame(unit(mirrored))[:, None], about(RAYS["gloss"], m.exponent[:, None]))
    n = len(index)
    fixed = [jnp.broadcast_to(w, (n, *w.shape)) for w in (lamp[0], fill[0])]
    w = jnp.concatenate([*fixed, ambient, gloss], 1)
    open_ = seen_sky(scene, at.position, w, index)
    cosine = jnp.maximum(dot(w, at.normal[:, None]), 0.0)
    a, b, c = np.cumsum([RAYS[k] for k in ("lamp", "fill", "ambient")])
    lit = cosine * open_
    E = lamp[1] * jnp.mean(lit[:, :a], 1) + fill[1] * jnp.mean(lit[:, a:b], 1)
    E = E + jnp.pi * AMBIENT * jnp.mean(open_[:, b:c], 1)
    lobe = jnp.mean(sky(w[:, c:]) * lit[:, c:], 1) * (m.exponent + 2.0) / (m.exponent + 1.0)
    value = jnp.stack([m.albedo[:, 0] / jnp.pi * E, m.specular * lobe], -1)
    return jnp.where((index >= 0)[:, None], value, 0.0)


def seen_sky(scene: Scene, x, w, on):
    """1 where rays from points meet nothing."""
    start, whose = jnp.broadcast_to(x[:, None], w.shape), jnp.broadcast_to(on[:, None], w.shape[:2])
    met = first_shape(scene, start.reshape(-1, 3), w.reshape(-1, 3), whose.ravel())
    return (met < 0).reshape(w.shape[:2]).astype(w.dtype)


def about(count: int, exponent):
    """Directions about +z with the density of `cos^s`; a lattice, shape (..., count, 3)."""
    k = jnp.arange(count)
    height = ((k + 0.5) / count) ** (1.0 / (exponent + 1.0))
    phi = 2.0 * jnp.pi * k * GOLDEN
    return cylindrical(jnp.sqrt(jnp.maximum(1.0 - height**2, 0.0)), phi + 0.0 * height, height)


def lobe_nodes(which: dict, count: int):
    """Directions with the density of a lobe of the sky, and the lobe's integral."""
    s2, k = which["sigma"] ** 2, jnp.arange(count)
    whole = 1.0 - jnp.exp(-2.0 / s2)
    height = 1.0 + s2 * jnp.log1p(-(k + 0.5) / count * whole)
    rho = jnp.sqrt(jnp.maximum(1.0 - height**2, 0.0))
    local = cylindrical(rho, 2.0 * jnp.pi * k * GOLDEN, height)
    m = jnp.asarray(which["center"])
    return times(frame(m / norm(m)), local), 2.0 * jnp.pi * s2 * which["radiance"] * whole


def reference(world: World) -> np.ndarray:
    """The full image, by lobes, (w, h, 2); tiles that are made are kept."""

    def tile(p, _):
        found = view_at(world, world.coordinates(p), (len(p),))
        value = shade(world, found.at, found.shows)
        return {"diffuse": value[:, 0], "gloss": value[:, 1]}

    folder = FOLDER / f"d05_creatures_{world.columns}x{world.rows}"
    made = render_tiles(tile, world.columns, world.rows, folder, side=100, key=KEY)
    return np.stack([made["diffuse"], made["gloss"]], -1)


KEY = f"{LAMP} {FILL} {AMBIENT} {SHINY} {DULL} {FLOOR} {RAYS} {PARTS}"
