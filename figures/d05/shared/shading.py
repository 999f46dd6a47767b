"""How the scenes of D05's Figs. 16 and 17 are lit and shaded: distant light with soft shadows.

A sky of a constant, a lamp 0.12 rad wide on the right and a broad lobe on the left. Surfaces are
lit once, by the sky: what hides it is black, as D05's blockers are. A pixel is shaded along 384
fixed rays: 128 to the lamp, 32 to the lobe, 96 about the normal for the constant, 128 about the
mirrored direction for the gloss. All errors are against that image itself.

A scene is a `World`; what its rays meet is left to a `Tracer`, of shapes (`d05.shared.creatures`)
or of meshes (`d05.shared.meshes`). Radiance is in W/(m^2 sr), as everywhere.
"""

from __future__ import annotations

import pathlib
from typing import Any, NamedTuple, Protocol

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int

from firstorder.conventions import cylindrical
from firstorder.imaging.camera import Pinhole
from firstorder.imaging.hits import GBuffer
from firstorder.imaging.images import pixel_grid, pixel_positions
from firstorder.numerics._vectors import dot, matvec, norm, orthonormal_frame, unit
from firstorder.rendering.tiles import render_tiles
from firstorder.space.skies import GaussianSky

BLOCK = 1024  # pixels of one compiled size
GOLDEN = 0.5 * (5.0**0.5 - 1.0)
RAYS = dict(lamp=128, fill=32, ambient=96, gloss=128)
PER_SAMPLE = sum(RAYS.values())
FOLDER = pathlib.Path(__file__).parents[2] / "out" / "references"

WIDE = 0.12
LAMP: dict[str, Any] = dict(center=(0.7, -0.5, 0.75), sigma=WIDE, radiance=24.0)
FILL: dict[str, Any] = dict(center=(-0.8, -0.3, 0.5), sigma=0.3, radiance=2.0)
AMBIENT = 0.25
SHINY: dict[str, Any] = dict(albedo=0.12, specular=0.6, exponent=250.0)
DULL: dict[str, Any] = dict(albedo=0.4, specular=0.3, exponent=40.0)
FLOOR: dict[str, Any] = dict(albedo=0.45, specular=0.15, exponent=20.0)
QUARTERS = np.array([(-0.25, -0.25), (-0.25, 0.25), (0.25, -0.25), (0.25, 0.25)])


class Lobes(NamedTuple):
    """What things do with light, by their numbers.

    Attributes:
        albedo: share of the flux that is spread evenly, BRDF albedo / pi.
        specular: share that goes into the glossy lobe.
        exponent: of that lobe, `cos^exponent` about the mirrored direction.
    """

    albedo: Float[np.ndarray, " n"]
    specular: Float[np.ndarray, " n"]
    exponent: Float[np.ndarray, " n"]


class Points(NamedTuple):
    """Points that are seen and may be shaded.

    Attributes:
        at: where they are and how they lean.
        thing: its number, -1 for none.
        face: normal of what rays meet there; a mesh is shaded by another one (`at.normal`).
    """

    at: GBuffer
    thing: Int[np.ndarray | Array, " n"]
    face: Float[np.ndarray | Array, "n 3"]


class Tracer(Protocol):
    """What rays through a scene meet. All come in blocks of some 1,000 points."""

    def seen(self, camera: Pinhole, p: np.ndarray) -> tuple[Points, np.ndarray]:
        """What image coordinates show, and labels across which nothing is smooth."""
        ...

    def free(self, points: Points, w: Float[Array, "n k 3"]) -> Any:
        """1 where a ray meets nothing, else 0; rays below the horizon may have either."""
        ...

    def distance(self, points: Points, w: Float[Array, "n k 3"]) -> Any:
        """To what a ray meets, infinity for nothing [m]."""
        ...


class World(NamedTuple):
    """The scene, the eye, and the size of the image.

    Attributes:
        name: of the folder of its reference.
        key: what that depends on, in words.
        rays: what they meet.
        lobes: of its things.
        floor: number of the floor.
        camera: the eye.
        columns: of pixels.
        rows: of pixels.
    """

    name: str
    key: str
    rays: Tracer
    lobes: Lobes
    floor: int
    camera: Pinhole
    columns: int
    rows: int

    @property
    def side(self) -> float:
        """Of a pixel, in image coordinates."""
        return 2.0 / self.columns

    @property
    def folder(self) -> pathlib.Path:
        """Where the reference is kept."""
        return FOLDER / f"{self.name}_{self.columns}x{self.rows}"

    def coordinates(self, p) -> np.ndarray:
        """Image coordinates of places in pixels."""
        return (np.asarray(p) - 0.5 * np.array([self.columns, self.rows])) * self.side


class View(NamedTuple):
    """Depth, normals and things of all pixels: what costs one ray for each.

    Attributes:
        p: image coordinates, shape (n, 2).
        points: what is seen, all leaves (w h, ...).
        label: across which nothing is smooth, (w, h).
    """

    p: np.ndarray
    points: Points
    label: np.ndarray

    @property
    def at(self) -> GBuffer:
        return self.points.at

    @property
    def shows(self) -> np.ndarray:
        """Number of the thing, -1 for none; (w, h)."""
        return np.asarray(self.points.thing).reshape(self.label.shape)

    @property
    def depth(self) -> np.ndarray:
        return np.asarray(self.at.distance).reshape(self.label.shape)

    @property
    def normal(self) -> np.ndarray:
        return np.asarray(self.at.normal).reshape(*self.label.shape, 3)


def view(world: World) -> View:
    """What every pixel shows."""
    p = pixel_positions(*pixel_grid(world.columns, world.rows))
    return view_at(world, p, (world.columns, world.rows))


def view_at(world: World, p: np.ndarray, shape: tuple[int, ...]) -> View:
    """What is shown at image coordinates."""
    points, label = world.rays.seen(world.camera, p)
    return View(p, points, label.reshape(shape))


def some(points: Points, rows: np.ndarray) -> Points:
    """Some of them."""
    return jax.tree.map(lambda a: a[rows], points)


def blocks(points: Points):
    """Points on the device, in blocks of one size, and their numbers; the last ones come again."""
    count = len(points.thing)
    for rows in np.resize(np.arange(count), -(-count // BLOCK) * BLOCK).reshape(-1, BLOCK):
        yield jax.tree.map(jnp.asarray, some(points, rows)), rows


# --- the sky -------------------------------------------------------------------------------------


def sky(w):
    """Radiance from a direction."""
    return AMBIENT + GaussianSky(**LAMP)(w) + GaussianSky(**FILL)(w)


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
    return matvec(orthonormal_frame(m / norm(m)), local), 2.0 * jnp.pi * s2 * which[
        "radiance"
    ] * whole


def mirrored(at: GBuffer):
    """Unit vectors in which an eye sees a mirror's light."""
    return unit(2.0 * dot(at.normal, at.to_eye)[:, None] * at.normal - at.to_eye)


# --- shading -------------------------------------------------------------------------------------


def shade(world: World, points: Points) -> np.ndarray:
    """Radiance of many points, diffuse and glossy apart, in blocks of one compiled size."""
    lobes = Lobes(*(jnp.asarray(a) for a in world.lobes))
    parts = []
    for block, _ in blocks(points):
        w = _ways(block, lobes)
        free = jnp.asarray(world.rays.free(block, w))
        parts.append(np.asarray(_gathered(block, lobes, w, free)))
    return np.concatenate(parts)[: len(points.thing)]


@eqx.filter_jit
def _ways(points: Points, lobes: Lobes):
    """Rays of each point, shape (n, 384, 3)."""
    at, n = points.at, len(points.thing)
    s = lobes.exponent[jnp.maximum(points.thing, 0), None]
    fixed = [
        jnp.broadcast_to(w, (n, *w.shape))
        for w in (lobe_nodes(LAMP, RAYS["lamp"])[0], lobe_nodes(FILL, RAYS["fill"])[0])
    ]
    ambient = matvec(orthonormal_frame(at.normal)[:, None], about(RAYS["ambient"], 1.0))
    gloss = matvec(orthonormal_frame(mirrored(at))[:, None], about(RAYS["gloss"], s))
    return jnp.concatenate([*fixed, ambient, gloss], 1)


@eqx.filter_jit
def _gathered(points: Points, lobes: Lobes, w, free):
    """What those that are free bring, shape (n, 2)."""
    m = jax.tree.map(lambda a: a[jnp.maximum(points.thing, 0)], lobes)
    lamp, fill = (lobe_nodes(k, RAYS[name])[1] for k, name in ((LAMP, "lamp"), (FILL, "fill")))
    lit = jnp.maximum(dot(w, points.at.normal[:, None]), 0.0) * free
    a, b, c = np.cumsum([RAYS[k] for k in ("lamp", "fill", "ambient")])
    E = lamp * jnp.mean(lit[:, :a], 1) + fill * jnp.mean(lit[:, a:b], 1)
    E = E + jnp.pi * AMBIENT * jnp.mean(free[:, b:c], 1)
    gloss = jnp.mean(sky(w[:, c:]) * lit[:, c:], 1) * (m.exponent + 2.0) / (m.exponent + 1.0)
    value = jnp.stack([m.albedo / jnp.pi * E, m.specular * gloss], -1)
    return jnp.where((points.thing >= 0)[:, None], value, 0.0)


def shown(value: np.ndarray, white: float) -> np.ndarray:
    """As on a screen, in [0, 1]."""
    return np.clip(value / white, 0.0, 1.0) ** (1.0 / 2.2)


# --- references ----------------------------------------------------------------------------------


def reference(world: World) -> np.ndarray:
    """The full image, by lobes, (w, h, 2); tiles that are made are kept."""

    def tile(p, _):
        value = shade(world, view_at(world, world.coordinates(p), (len(p),)).points)
        return {"diffuse": value[:, 0], "gloss": value[:, 1]}

    made = render_tiles(tile, world.columns, world.rows, world.folder, side=100, key=world.key)
    return np.stack([made["diffuse"], made["gloss"]], -1)


def finer(world: World, truth: np.ndarray, label: np.ndarray, white: float) -> np.ndarray:
    """The image on a screen, means of four visibility samples a pixel, kept as well.

    Args:
        world: the scene.
        truth: radiance of all pixels.
        label: theirs; where a visibility sample's is another one it is shaded, elsewhere it takes
            its pixel's radiance.
        white: radiance that a screen shows as white. Means are taken on the screen, so that edges
            of what is brighter are smooth too.
    """

    def tile(p, _):
        i, j = p.astype(int).T
        four = (p[:, None] + QUARTERS).reshape(-1, 2)
        fine = view_at(world, world.coordinates(four), (len(p), 4))
        value = np.repeat(truth[i, j], 4)
        edge = np.any(fine.label != label[i, j][:, None], 1)
        rows = np.flatnonzero(np.repeat(edge, 4))
        if len(rows):
            value[rows] = shade(world, some(fine.points, rows)).sum(-1)
        return {"four": shown(value, white).reshape(-1, 4).mean(1)}

    folder = world.folder.with_name(world.folder.name + "_screen")
    key = f"{world.key} {white!r}"
    return render_tiles(tile, world.columns, world.rows, folder, side=100, key=key)["four"]
