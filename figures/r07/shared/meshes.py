"""R07's scene with geometric objects and shadows: what its figures 1 and 15 share.

The paper's cow and teapot cannot be had; in their places stand meshes of our own on a flat, glossy
table: a bumpy sphere (a smooth one with a bump map, as in the paper), a lumpy ball (diffuse), a
knot (glossy) and a fern (diffuse). The lamp of 1.0 m x 1.0 m hangs some 2.5 m above, left of and
before them; 12 x 12 shadow rays a sample. Nothing else lights the scene.

Silhouettes are where labels change. An object may hide itself, so labels are finer than objects:
each leaf has its own, and so has each sixteenth of the knot's tube.

The paper shows one scene; what is claimed of samples is judged over `lamps`: in any azimuth, 35 to
70 degrees above the table, 3 m from the middle of the objects, 0.5 to 1.5 m wide.

Squares of the quad-tree are left whole at one pixel, so that all samples of all trees lie on four
lattices, 8, 4, 2 and 1 pixels apart. Those are rendered once (`rendering.tiles`, under
`figures/out/references`) and looked up; the finest one is the reference. What is timed is rendered.
"""

from __future__ import annotations

import functools
import hashlib
import pathlib
import time
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from scipy.sparse import csr_array
from scipy.sparse.csgraph import connected_components

from figures.r07.shared import look, table
from firstorder.imaging import Lamp
from firstorder.imaging.camera import pinhole
from firstorder.imaging.shading import SurfaceMaps
from firstorder.io.scenes.space_toml import MeshModel, SpaceFile
from firstorder.models.knots import torus_knot
from firstorder.models.plants import fern
from firstorder.models.primitives import (
    bumpy_sphere,
    displaced_ground,
    place_mesh,
    ripples,
    rotation_about,
)
from firstorder.reconstruction.importance import ShadedSamples, importance_product
from firstorder.rendering.image_files import image_coordinates, scene_fingerprint
from firstorder.rendering.renderer import Renderer, World
from firstorder.rendering.tiles import render_tiles

FOLDER = pathlib.Path(__file__).parents[2] / "out" / "references"
NODES = 12
VERSION = 3  # of the code on which the references depend
BUMP, WAVE = 0.012, 2.0 * np.pi / 0.25
NAMES = ("table", "bumpy", "lumpy", "knot", "fern")
MATERIAL = {
    "table": dict(albedo=0.5, specular=0.15, exponent=30.0),
    "bumpy": dict(albedo=0.5, specular=0.2, exponent=20.0),
    "lumpy": dict(albedo=0.8),
    "knot": dict(albedo=0.3, specular=0.4, exponent=40.0),
    "fern": dict(albedo=0.6),
}
TINTS = np.array([look.WOOD, look.SLATE, look.CLAY, look.BRASS, look.LEAF])  # in pictures
BLOCK, FINEST = 8, 1


def _height(index, x):
    """Of the bumps [m]."""
    waves = jnp.sin(WAVE * x[0]) * jnp.sin(WAVE * x[1]) * jnp.sin(WAVE * x[2])
    return jnp.where(index == NAMES.index("bumpy"), BUMP * waves, 0.0)


@functools.cache
def world() -> World:
    """The scene; it takes some seconds to build."""
    turn = rotation_about((0.0, 1.0, 0.2), 1.1)
    lumps = bumpy_sphere(0.5, ripples(0.08, 1.1, 3), 5)
    plant, _ = fern(7, 9, seed=4, height=0.55, leaf=0.2)
    meshes = {
        "table": displaced_ground(9.0, cells=1),
        "bumpy": place_mesh(bumpy_sphere(0.5, lambda v: 0.0 * v[:, 0], 5), (1.25, -0.1, 0.5)),
        "lumpy": place_mesh(lumps, (-1.25, 0.0, 0.5)),
        "knot": place_mesh(torus_knot(2, 3, 0.13, 500, 32, 0.5), (0.0, 0.0, 0.62), turn),
        "fern": place_mesh(plant, (0.35, -1.15, 0.0)),
    }
    models = tuple(MeshModel(m, name, MATERIAL[name]) for name, m in meshes.items())
    camera = pinhole((0.0, -5.0, 2.4), (0.0, -0.35, 0.3), gamma=2.7)
    return World(camera, None, models, (lamp(),), finish=SurfaceMaps(_height))


def lamp(count: int = NODES):
    """Its nodes are even, so that shadows move."""
    return table.lamp(1.0, count, even=True)


def lamps(count: int, nodes: int, seed: int = 15) -> list[Lamp]:
    """Lamps at random, in the ranges that stand above, as bright as keeps the irradiance."""
    random, found = np.random.default_rng(seed), []
    for _ in range(count):
        up, turn = np.radians(random.uniform((35.0, 0.0), (70.0, 360.0)))
        toward = np.array([np.cos(up) * np.cos(turn), np.cos(up) * np.sin(turn), np.sin(up)])
        half = random.uniform(0.25, 0.75)
        u = np.cross(toward, (0.0, 0.0, 1.0))
        u *= half / np.linalg.norm(u)
        middle = np.array([0.0, 0.0, 0.4]) + 3.0 * toward
        found.append(Lamp(middle, np.cross(toward, u), u, 2.0 / half**2, nodes, even=True))
    return found


@functools.cache
def patches() -> np.ndarray:
    """A label for each face of all meshes: one for each piece that may hide another of its kind."""
    found, first = [], 0
    for model in world().models:
        count = model.mesh.count
        if model.name == "knot":
            own = (np.arange(count) % (count // 2)) * 16 // (count // 2)
        elif model.name == "fern":
            f = np.asarray(model.mesh.faces)
            ends = np.r_[f[:, 0], f[:, 1]], np.r_[f[:, 1], f[:, 2]]
            links = csr_array((np.ones(2 * count), ends), shape=2 * (len(model.mesh.vertices),))
            own = connected_components(links, directed=False)[1][f[:, 0]]
        else:
            own = np.zeros(count, int)
        found.append(own + first)
        first += own.max() + 1
    return np.concatenate(found)


# --- all places where a tree may look ------------------------------------------------------------


class Lattices(NamedTuple):
    """Everything that is known of every place: layers by the distance between places.

    Attributes:
        side: of the image [pixels].
        layers: by distance in pixels, and then by name.
    """

    side: int
    layers: dict[int, dict[str, np.ndarray]]

    @property
    def reference(self) -> dict[str, np.ndarray]:
        """At the centres of all pixels."""
        return self.layers[FINEST]

    @property
    def labels(self) -> np.ndarray:
        """Which patch each pixel shows."""
        return self.reference["label"].astype(int)

    def at(self, p: np.ndarray, name: str) -> np.ndarray:
        """A layer at places of a tree [pixels]."""
        out = np.empty(len(p))
        for step, layers in self.layers.items():
            number = p / step - 0.5
            mine = np.all(number == np.rint(number), axis=1)
            i, j = number[mine].astype(int).T
            out[mine] = layers[name][i, j]
        return out

    def gradient(self, p: np.ndarray, shadows: bool = True) -> np.ndarray:
        """Of the image, per pixel, with or without what moving shadows add."""
        both = [self.at(p, f"grad.{k}") - (0.0 if shadows else self.at(p, f"shadow.{k}"))
                for k in "uv"]  # fmt: skip
        return np.stack(both, -1) * 2.0 / self.side

    def shade(self, more=None, shadows: bool = True):
        """A function for `sample_image`; `more` is what else a metric wants, of places."""

        def look(p):
            extra = None if more is None else more(self, p)
            return ShadedSamples(self.at(p, "value"), self.gradient(p, shadows), extra)

        return look


def lattices(side: int, nodes: int = NODES, light: Lamp | None = None, name: str = "") -> Lattices:
    """Rendered, or taken from where an earlier call has left them.

    Args:
        side: of the image [pixels].
        nodes: of the lamp, along each edge.
        light: another lamp.
        name: of that, to tell its files by.
    """
    scene = world()._replace(lamps=(light or lamp(nodes),))
    made, layers = Renderer(scene), {}
    whole = f"r07_meshes_{VERSION}_{side}_{nodes}{name}_{_digest(scene)}"
    for step in (8, 4, 2, 1):
        count = side // step
        folder = FOLDER / whole / f"step{step}"

        def shade(places, number, step=step):
            return made.layers(image_coordinates(places * step, side, side), number)

        layers[step] = render_tiles(
            shade, count, count, folder, side=64, key=f"R07 meshes {VERSION}"
        )
        layers[step]["label"] = label_of(made, table.grid(count) * step, side).reshape(count, count)
    return Lattices(side, layers)


def _digest(scene: World) -> str:
    """Letters that change with all that its pictures depend on: another scene is rendered anew."""
    models = scene_fingerprint(SpaceFile((), scene.models, camera=scene.camera))
    numbers = [np.asarray(leaf).tolist() for leaf in jax.tree.leaves((scene.lamps, BUMP, WAVE))]
    return hashlib.sha256(f"{models} {numbers}".encode()).hexdigest()[:12]


def label_of(made: Renderer, p: np.ndarray, side: int) -> np.ndarray:
    """The patches that places show [pixels]: -1 for the sky, -2 for a lamp."""
    seen = made.seen(image_coordinates(p, side, side))
    elsewhere = np.where(seen.index < 0, -1, -2)
    return np.where(seen.face >= 0, patches()[seen.face], elsewhere)


# --- densities -----------------------------------------------------------------------------------


def _bands(index: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Shares and band limits of the diffuse and the glossy lobe, by what is shown.

    Sky and lamp have none.
    """
    rows = [MATERIAL[n] for n in NAMES]
    specular = np.array([m.get("specular", 0.0) for m in rows])
    gloss = np.sqrt(6.0 * np.array([m.get("exponent", 0.0) for m in rows]))
    share = np.stack([np.array([m["albedo"] for m in rows]), specular], -1)
    band = np.stack([np.full(len(rows), 2.0), gloss], -1)
    here = _is_surface(index)
    number = np.where(here, index, 0)
    return here[:, None] * share[number], here[:, None] * band[number]


def _is_surface(index: np.ndarray) -> np.ndarray:
    """Where an object is seen, and not the sky or a lamp."""
    return (index >= 0) & (index < len(NAMES))


def criterion(index, curvature, distance, cosine) -> np.ndarray:
    """D05's criterion as R07 §9 has it (`table.d05_density`): no bumps, the sharpest lobe."""
    band = np.max(_bands(index)[1], -1)
    k = curvature / np.sqrt(2.0)
    found = 2.0 * k * distance / np.maximum(cosine, 1e-3) * band
    return np.where(_is_surface(index), found, 0.0)


def d05(known: Lattices, p: np.ndarray) -> np.ndarray:
    """D05's criterion at places of a tree [pixels]."""
    index = known.at(p, "index").astype(int)
    return criterion(index, *(known.at(p, name) for name in ("curvature", "distance", "cosine")))


def heuristic(known: Lattices, p: np.ndarray) -> np.ndarray:
    """The cheap product of R07 §9: curvature with bumps, grazing view, gloss, lamp's distance."""
    index = known.at(p, "index").astype(int)
    share, band = _bands(index)
    turning = np.stack([known.at(p, f"CV.{lobe}") for lobe in ("diffuse", "glossy")], -1)
    q = image_coordinates(p, known.side, known.side)
    camera = world().camera
    d = np.concatenate([q, np.full((len(q), 1), -float(camera.gamma))], -1)
    d = d @ np.asarray(camera.axes).T / np.linalg.norm(d, axis=1)[:, None]
    distance = known.at(p, "distance")
    x = np.asarray(camera.eye) + distance[:, None] * d
    away = np.linalg.norm(x - np.asarray(lamp().center), axis=1)
    found = importance_product(turning, share, band, distance, known.at(p, "cosine"), away)
    return np.where(_is_surface(index), found, 0.0)


# --- what takes how long -------------------------------------------------------------------------


class Timed(NamedTuple):
    """Processor time of calls [s]."""

    seconds: float
    found: object


def timed(run) -> Timed:
    """Of this process, on all its threads: the clock on the wall counts what else is running."""
    start = time.process_time()
    found = run()
    return Timed(time.process_time() - start, found)
