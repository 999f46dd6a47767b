"""E11's scenes in space, or what stands in for them: seeded, of our own pieces.

The paper's foliage (1.3 M triangles), trees and shapes are production models that cannot be had.
Ours are trees, grids, knots, blobs and bumpy spheres from `firstorder.space`, of as many triangles.
An image shows, pixel by pixel, the share of a lamp that the point in the middle of the pixel sees;
the lamp has the paper's Gaussian falloff, two standard deviations to its edge. References are
stratified rays, kept tile by tile under `figures/out/references`: figures that show the same scene
share them, and what a kill leaves is gone on with.

Shared rays start on the ground and serve the ground (`Scene.floor`), and what the camera sees of
objects has rays of its own, as in E11 §6.2. One table for both is possible, since rays know where
they start, but no better: the surfaces of these objects lie among the blockers, which are they
themselves, so that 0.55 of a gathering's object pixels need own rays anyway (trees .85, array .39,
grids .06). Measured at 96 x 96 pixels and 2 cycles, RMS of objects with 1 shared ray a pixel and 4
own ones where they are needed, and with 4 own ones everywhere:

    gathering .089, .061    array .086, .048    trees .094, .068    grids .073, .037

With 4 shared and 16 own ones it is .025 and .023 in the gathering, .021 and .017 in the array. And
the ground gains nothing by the rays of what stands on it: .0667 for .0649, .1275 for .1267, .0583
for .0581, .0852 for .0852 at 1 ray.
"""

from __future__ import annotations

import functools
import hashlib
import pathlib
from collections.abc import Callable
from typing import NamedTuple

import jax
import numpy as np
import scipy.ndimage

from figures.e11.competitors.baselines import stratified
from firstorder.imaging.camera import pinhole
from firstorder.io import Embree
from firstorder.models.blobs import metaballs
from firstorder.models.knots import torus_knot
from firstorder.models.plants import tree
from firstorder.models.primitives import (
    bar_lattice,
    bumpy_sphere,
    displaced_ground,
    join_meshes,
    place_mesh,
    ripples,
    rotation_about,
)
from firstorder.rendering.shadow_rays import camera_hits, is_visible, mesh_blockers
from firstorder.rendering.tiles import render_tiles
from firstorder.shadowfield.rendering.depth_bounds import smooth_depths
from firstorder.shadowfield.rendering.lamp import LampFrame, lamp_frame
from firstorder.shadowfield.rendering.ray_table import Blockers
from firstorder.space.meshes.triangle_mesh import Mesh

SIDE, QUICK_SIDE = 256, 48
PAPER_SIDE = 1024  # of the paper's images, whose pixels closeups have
DENSE = (PAPER_SIDE / SIDE) ** 2  # pixels of these to one of ours
Window = tuple[int, int, int]
RAYS, QUICK_RAYS = 2048, 256  # of the reference
OUT = pathlib.Path(__file__).parents[2] / "out" / "references"
_HAIR = 1e-4  # receivers are this far off their surface [m]
_VERSION = 1  # of what a reference's rays are, beside what its key tells anyway


class Scene(NamedTuple):
    """What a camera sees, a lamp above it, and what comes between.

    Attributes:
        name: of the scene.
        side: of the image [pixels].
        lamp: the lamp.
        tracer: rays through everything, the ground too.
        receivers: what pixels show, a hair off its surface; NaN for nothing; rows vary fastest [m].
        normals: there, towards the eye.
        part: of what is shown; 0 is the ground, -1 nothing, or what is not before the lamp.
        pixel: side of a pixel on the ground, in the middle of the image [m].
    """

    name: str
    side: int
    lamp: LampFrame
    tracer: Embree
    receivers: np.ndarray
    normals: np.ndarray
    part: np.ndarray
    pixel: float

    @property
    def shown(self) -> np.ndarray:
        """Pixels that show something."""
        return self.part >= 0

    @property
    def floor(self) -> np.ndarray:
        """Pixels that show the ground."""
        return self.part == 0

    @property
    def blockers(self) -> Blockers:
        """Depths of what hides the lamp, for `rays.trace`."""
        return mesh_blockers(self.tracer)

    @property
    def triangles(self) -> int:
        """Of everything."""
        return self.tracer.mesh.count

    def visible(self, receivers: np.ndarray, ends: np.ndarray) -> np.ndarray:
        """Whether places on the lamp are seen; some times as fast as `mesh_blockers`."""
        return is_visible(self.tracer, receivers, ends)

    def hides(self, receivers: np.ndarray, ends: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Free or not, in the form of `mesh_blockers`, with no depth that means anything."""
        free = self.visible(receivers, ends)
        return np.where(free, np.inf, 0.5), np.where(free, -np.inf, 0.5)

    def picture(self, values: np.ndarray, where: np.ndarray | None = None) -> np.ndarray:
        """Values of pixels, or of those `where` alone, as an image; NaN elsewhere."""
        whole = np.full(self.side**2, np.nan)
        whole[slice(None) if where is None else where] = values
        return whole.reshape(self.side, self.side)

    def every(self, n: int, edge: int = 0) -> np.ndarray:
        """Mask of every n-th pixel of every n-th column, `edge` pixels off the image's edges."""
        inside = np.zeros((self.side, self.side), bool)
        part = slice(edge, self.side - edge, n)
        inside[part, part] = True
        return inside.ravel()

    def light(self) -> np.ndarray:
        """Unshadowed light of pixels for a picture to look at: cosines and distance of the lamp."""
        local = self.lamp.local(self.receivers)
        way = self.lamp.center - self.receivers
        far = np.linalg.norm(way, axis=1)
        cosine = np.abs(np.sum(self.normals * way, 1)) / far
        light = cosine * np.maximum(local[:, 2] / far, 0.0) / far**2
        light *= np.where(self.floor, 1.0, 0.6)
        return np.minimum(light / np.nanpercentile(light, 98.0), 1.0)


def falloff(place: np.ndarray) -> np.ndarray:
    """Of the lamp's light over places in [-1, 1]^2: two standard deviations to the edges."""
    return np.exp(-2.0 * np.sum(np.square(place), -1))


def _warped(u: np.ndarray) -> np.ndarray:
    """Places in [-1, 1] as dense as the falloff along an axis, from numbers in [0, 1].

    In a third of `on_lamp`'s time, which knows of no axes: .13 and .36 microseconds, where a ray
    takes .7.
    """
    x = np.linspace(-1.0, 1.0, 1025)
    middle = np.exp(-2.0 * (0.5 * (x[1:] + x[:-1])) ** 2)
    share = np.r_[0.0, np.cumsum(middle)]
    return np.interp(u, share / share[-1], x)


def own_rays(scene: Scene, where: np.ndarray, rays: int, seed: int | list[int] = 0) -> np.ndarray:
    """What pixels see of the lamp by stratified rays of their own, at pixels `where`.

    Args:
        scene: the scene.
        where: numbers of pixels, or a mask.
        rays: for each pixel.
        seed: of the random numbers.
    """
    points = scene.receivers[where]
    return stratified(scene.lamp, points, rays, scene.hides, seed, warp=_warped)


def reference(
    scene: Scene, rays: int = RAYS, where: np.ndarray | None = None, quiet: bool | None = None
) -> np.ndarray:
    """What every pixel sees of the lamp by many stratified rays, shape (side, side); NaN for none.

    Made once: tiles are kept in a folder named by the scene and a digest of the mesh, receivers,
    lamp and falloff. Who changes what `own_rays` makes of these counts `_VERSION` up.

    Args:
        scene: the scene.
        rays: for each pixel.
        where: mask of the pixels that are wanted, all that show something by default.
        quiet: whether to show no progress; by default it is shown on a terminal.
    """
    wanted = scene.shown if where is None else where
    mesh, chosen = scene.tracer.mesh, [] if where is None else [where]
    places = _digest(mesh.vertices, scene.receivers, *scene.lamp, *chosen)
    x = np.linspace(-1.0, 1.0, 17)
    light = falloff(np.stack(np.meshgrid(x, x), -1))
    whole = _digest(np.frombuffer(places.encode(), np.uint8), mesh.faces, light, _VERSION)
    key = f"{scene.name} {rays} rays {whole[:16]}"
    # Frames of an animation, which choose their pixels, are to have rays of their own.
    own = [] if where is None else [int(places[:8], 16)]

    def shade(places: np.ndarray, number: int) -> dict[str, np.ndarray]:
        column, row = np.floor(places).astype(int).T
        k = column * scene.side + row
        values = np.full(len(k), np.nan)
        some = wanted[k]
        values[some] = own_rays(scene, k[some], rays, [int(k[0]), number, *own])
        return {"visible": values}

    folder = OUT / key.replace(" ", "-")
    return render_tiles(shade, scene.side, scene.side, folder, side=32, key=key, quiet=quiet)[
        "visible"
    ]


def penumbra_reference(scene: Scene, rays: int = RAYS, reach: int = 2) -> np.ndarray:
    """The reference on the ground where it is needed, shape (side, side); NaN off the ground.

    That is where 64 pilot rays of a pixel, or of one no farther than `reach` pixels, do not all
    agree; elsewhere the pilots' 0 or 1 stand.
    """
    pilot = scene.picture(own_rays(scene, scene.floor, 64, 7), scene.floor)
    partly = (pilot > 0.0) & (pilot < 1.0)
    partly = scipy.ndimage.binary_dilation(partly, iterations=reach) & np.isfinite(pilot)
    return np.where(partly, reference(scene, rays, partly.ravel(), quiet=True), pilot)


def _digest(*arrays) -> str:
    """Of numbers, as hexadecimal digits."""
    digest = hashlib.sha256()
    for a in arrays:
        digest.update(np.ascontiguousarray(np.asarray(a), float).tobytes())
    return digest.hexdigest()


def smoothed_bounds(
    scene: Scene, where: np.ndarray, bounds: tuple[np.ndarray, np.ndarray], radius: int
) -> tuple[np.ndarray, np.ndarray]:
    """Bounds of depths at pixels `where`, smoothed over the image; others bound nothing."""
    near, far = (scene.picture(a, where) for a in bounds)
    off = np.isnan(near)
    found = smooth_depths(np.where(off, np.inf, near), np.where(off, -np.inf, far), radius)
    return found[0].ravel()[where], found[1].ravel()[where]


def blended_bounds(
    scene: Scene, where: np.ndarray, bounds: tuple[np.ndarray, np.ndarray], radius: float
) -> tuple[np.ndarray, np.ndarray]:
    """Bounds of depths at pixels `where`, blurred by a Gaussian of so many pixels.

    Where `smoothed_bounds` widens, this is E11's own word, "blurring": means of those neighbours
    that have bounds. They do not hold every blocker any more. Pixels without stay without.
    """
    found = []
    for a in bounds:
        image = scene.picture(a, where)
        some = np.isfinite(image)
        weight = scipy.ndimage.gaussian_filter(some.astype(float), radius)
        spread = scipy.ndimage.gaussian_filter(np.where(some, image, 0.0), radius)
        found.append(np.where(some, spread / np.where(some, weight, 1.0), image).ravel()[where])
    return found[0], found[1]


# --- making scenes -------------------------------------------------------------------------------


def lamp_towards(center, target, half: float) -> LampFrame:
    """A square lamp that shines at a target."""
    way = np.asarray(target, float) - np.asarray(center, float)
    way /= np.linalg.norm(way)
    u = np.cross((0.0, 1.0, 0.0), way)
    u /= np.linalg.norm(u)
    return lamp_frame(center, half * u, half * np.cross(way, u))


def _double(make):
    """Makes a scene in double precision whatever the session's is: its reference names its bits."""

    @functools.wraps(make)
    def made(*args, **options) -> Scene:
        with jax.enable_x64(True):
            return make(*args, **options)

    return made


def _scene(name, side, lamp, parts, eye, target, gamma, window=None) -> Scene:
    """Parts, the ground first, seen by a camera; a `window` alone: first pixels and a side."""
    i, j, size = (0, 0, side) if window is None else window
    whole, part = join_meshes(parts)
    tracer = Embree(whole)
    camera = pinhole(eye, target, gamma=gamma)
    x, y = ((2.0 * np.arange(k, k + size) + 1.0) / side - 1.0 for k in (i, j))
    p = np.stack(np.meshgrid(x, y, indexing="ij"), -1).reshape(-1, 2)
    found = camera_hits(tracer, camera, p, part)
    points = found.position + _HAIR * found.normal
    # What lies beside or behind the lamp has no shadow to speak of.
    dark = np.isfinite(points[:, 0]) & (lamp.local(points)[:, 2] < 0.2 * abs(lamp.center[2]))
    points[dark], found.part[dark] = np.nan, -1
    middle = np.linalg.norm(np.subtract(target, eye)) * 2.0 / (gamma * side)
    return Scene(name, size, lamp, tracer, points, found.normal, found.part, float(middle))


@_double
def plant(side: int = SIDE, quick: bool = False) -> Scene:
    """Fig. 1: a plant of 1.3 M triangles with thin features over a flat ground; 11,000 if quick."""
    leaves, forks = (3000, (8, 6)) if quick else (540_000, (12, 8, 6, 5))
    leaf = 0.06 if quick else 0.0065
    grown, _ = tree(leaves, seed=11, height=1.5, forks=forks, leaf=leaf)
    lamp = lamp_towards((-1.0, 0.6, 3.6), (0.0, 0.1, 0.3), 0.4)
    parts = [displaced_ground(6.0, cells=1), grown]
    return _scene("plant", side, lamp, parts, (0.5, -4.0, 4.4), (0.42, 0.0, 0.4), 4.2)


@_double
def grids(side: int = SIDE, height: float = 0.15, window: Window | None = None) -> Scene:
    """Figs. 9, 14: two grids that lean over a flat ground: shadows from sharp to wide.

    Args:
        side: of the image [pixels].
        height: of the grids' lower edges above the ground [m]; they descend in Fig. 14.
        window: a part of the image that is all that is made: first pixels and a side.
    """
    plate = bar_lattice((6, 6), (0.75, 0.75), 0.08, 0.02)
    lamp = lamp_towards((0.0, 0.0, 4.0), (0.0, 0.0, 0.0), 0.35)
    lean = rotation_about((0.0, 1.0, 0.0), -0.5)
    rise = 0.75 * np.sin(0.5)
    one = place_mesh(plate, (-0.9, 0.1, height + rise), lean @ rotation_about((0, 0, 1), 0.2))
    two = place_mesh(
        plate, (0.95, -0.1, height + 0.3 + rise), lean @ rotation_about((0, 0, 1), -0.4)
    )
    parts = [displaced_ground(6.0, cells=1), one, two]
    return _scene("grids", side, lamp, parts, (0.0, -4.4, 4.4), (0.0, 0.0, 0.2), 3.1, window)


@_double
def trees(
    side: int = SIDE,
    half: float = 0.35,
    angle: float = 0.0,
    leaves: int = 20_000,
    window: Window | None = None,
) -> Scene:
    """Figs. 11, 14: two trees over a curved ground, under a medium or a large lamp.

    Args:
        side: of the image [pixels].
        half: of the lamp's side [m]; 1.05 for the large lamp.
        angle: by which each tree is turned about its trunk, one either way [rad].
        leaves: of each tree.
        window: as of `grids`.
    """
    parts: list[Mesh] = [displaced_ground(12.0, lambda p: 0.12 * np.cos(0.9 * p[:, 0]), 256)]
    for k, (x, y) in enumerate(((-1.0, 0.4), (0.5, -0.2))):
        grown, _ = tree(leaves, seed=21 + k, height=1.7, forks=(9, 7, 6), leaf=0.05)
        turn = rotation_about((0, 0, 1), angle if k else -angle)
        parts.append(place_mesh(grown, (x, y, 0.12 * np.cos(0.9 * x) - 0.02), turn))
    lamp = lamp_towards((-1.3, 0.8, 4.4), (0.0, 0.0, 0.2), half)
    eye, target = (0.2, -4.6, 4.6), (0.2, 0.05, 0.5)
    return _scene("trees", side, lamp, parts, eye, target, 3.4, window)


MIRROR_EYE = (0.0, -4.0, 4.0)


@_double
def mirror(side: int = SIDE) -> Scene:
    """Two grids, one behind the other, before a lamp that flat ground mirrors to the camera."""
    lamp = lamp_towards((0.0, 2.6, 2.6), (0.0, 0.0, 0.0), 0.5)
    lean = rotation_about((1.0, 0.0, 0.0), -0.25 * np.pi)
    high = place_mesh(bar_lattice((4, 4), (0.5, 0.5), 0.09, 0.02), (-0.35, 1.2, 1.2), lean)
    low = place_mesh(bar_lattice((5, 5), (0.4, 0.4), 0.05, 0.02), (0.25, 0.7, 0.7), lean)
    parts = [displaced_ground(8.0, cells=1), high, low]
    return _scene("mirror", side, lamp, parts, MIRROR_EYE, (0.0, 0.0, 0.1), 3.7)


def _relief(height: float, wavelength: float, seed: int) -> Callable[[np.ndarray], np.ndarray]:
    """A curved ground with a relief on it."""
    small = ripples(height, wavelength, seed, waves=40)
    return lambda p: 0.15 * np.sin(0.8 * p[:, 0] + 0.5) * np.cos(0.6 * p[:, 1]) + small(p)


@_double
def array(side: int = SIDE, cells: int = 500) -> Scene:
    """Fig. 12: a wide array of knots, blobs, balls and grids over ground with a fine relief."""
    rng = np.random.default_rng(12)
    pieces = (
        place_mesh(torus_knot(2, 3, 0.2, 160, 10), scale=0.2),
        place_mesh(metaballs(0.7 * rng.normal(size=(6, 3)), np.full(6, 0.5), 24), scale=0.13),
        place_mesh(bumpy_sphere(0.16, ripples(0.12, 0.6, 5), 4)),
        place_mesh(bar_lattice((4, 4), (0.2, 0.2), 0.035, 0.03)),
    )
    parts = [displaced_ground(4.0, _relief(0.006, 0.07, 3), cells)]
    x = np.linspace(-1.6, 1.6, 7)
    for k, (i, j) in enumerate(np.ndindex(7, 7)):
        turn = rotation_about(rng.normal(size=3), rng.uniform(0.0, 2.0 * np.pi))
        at = (x[i] + 0.1 * rng.normal(), x[j] + 0.1 * rng.normal(), rng.uniform(0.35, 1.1))
        parts.append(place_mesh(pieces[(i + 2 * j + k // 5) % 4], at, turn))
    lamp = lamp_towards((-1.0, 0.8, 4.0), (0.0, 0.0, 0.0), 0.35)
    return _scene("array", side, lamp, parts, (0.0, -4.0, 5.0), (0.05, -0.05, 0.3), 3.6)


@_double
def gathering(side: int = SIDE, leaves: int = 60_000, cells: int = 400) -> Scene:
    """Fig. 13: a plant, a knot, a grid, a blob and a ball over ground with a relief."""
    rng = np.random.default_rng(13)
    grown, _ = tree(leaves, seed=11, height=1.3, forks=(10, 7, 6), leaf=0.022)
    soft = metaballs(0.6 * rng.normal(size=(9, 3)), rng.uniform(0.3, 0.5, 9), 40)
    low = _relief(0.008, 0.12, 7)
    parts = [
        displaced_ground(5.0, low, cells),
        place_mesh(grown, (-0.7, 0.3, low(np.array([[-0.7, 0.3]]))[0] - 0.02)),
        place_mesh(
            torus_knot(2, 3, 0.16, 300, 16),
            (0.45, -0.55, 0.5),
            rotation_about((1, 0, 0), 0.9),
            0.38,
        ),
        place_mesh(
            bar_lattice((6, 6), (0.5, 0.5), 0.05, 0.03),
            (0.35, 0.7, 0.95),
            rotation_about((1, 0.4, 0), 0.5),
        ),
        place_mesh(soft, (1.25, 0.1, 0.55), scale=0.28),
        place_mesh(bumpy_sphere(0.25, ripples(0.08, 0.5, 2), 5), (-0.5, -0.65, 0.45)),
    ]
    lamp = lamp_towards((-1.1, 0.7, 3.8), (0.0, 0.0, 0.2), 0.4)
    return _scene("gathering", side, lamp, parts, (0.3, -4.0, 4.0), (0.3, 0.0, 0.4), 3.5)


def show(ax, image: np.ndarray, title: str, **options):
    """An image whose first axis runs across."""
    found = ax.imshow(np.asarray(image).T, origin="lower", interpolation="nearest", **options)
    ax.set(title=title, xticks=[], yticks=[])
    return found
