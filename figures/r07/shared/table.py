"""R07's table: a diffuse, a glossy and a bumpy sphere in the light of a close lamp, from above.

The paper gives no numbers. Ours: three spheres of radius 0.5 m on a table that is nearly flat (a
sphere of radius 40 m), a lamp of 1.0 m x 1.0 m some 2.5 m above, left of and before them; bumps of
12 mm that repeat every 0.25 m in x, y and z. The table and the bumpy sphere are a little glossy.

What the paper leaves open is scanned by `layouts`. Each is drawn at random: albedos from 0.2 to
0.8; of the rest 0.2 to 0.8 is gloss, with exponents from 10 to 100 (the diffuse sphere has none);
the lamp in any azimuth, 35 to 70 degrees above the table, 3 m away, 0.5 to 1.5 m wide; bumps with
slopes of 0.3 whose wave lengths along x, y and z are three numbers from 0.15 to 0.4 m.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from figures.r07.shared import look
from firstorder import plotting
from firstorder.imaging import Lamp
from firstorder.imaging._point_shading import ShadedPixels
from firstorder.imaging.camera import pinhole
from firstorder.imaging.images import pixel_labels
from firstorder.imaging.shading import SurfaceMaps, shade_pixels
from firstorder.numerics._batching import host_blocks
from firstorder.reconstruction.importance import ShadedSamples
from firstorder.space import Scene, primitive, sphere

RADIUS = 0.5
BUMP, WAVE = 0.012, 2.0 * np.pi / 0.25
SCENE = {
    "table": (sphere((0.0, 0.0, -40.0), 40.0), dict(albedo=0.5, specular=0.2, exponent=30.0)),
    "diffuse": (sphere((-1.2, 0.0, RADIUS), RADIUS), dict(albedo=0.8)),
    "glossy": (sphere((0.0, 0.0, RADIUS), RADIUS), dict(albedo=0.3, specular=0.4, exponent=40.0)),
    "bumpy": (sphere((1.2, 0.0, RADIUS), RADIUS), dict(albedo=0.5, specular=0.2, exponent=20.0)),
}
NAMES = tuple(SCENE)
TINTS = {"table": look.WOOD, "diffuse": look.CLAY, "glossy": look.BRASS, "bumpy": look.SLATE}
FLOOR = -4.0  # decades: what is darker is drawn as this


class Bumps(eqx.Module):
    """Waves in space on one shape: a product of three sines.

    Attributes:
        index: of the shape.
        height: of the waves [m].
        waves: wave numbers along x, y and z [rad/m].
        phases: of the three [rad].
    """

    index: int
    height: jax.Array
    waves: jax.Array
    phases: jax.Array

    def __call__(self, index, x):
        """Height [m] of what stands on shape `index` at x."""
        waves = jnp.prod(jnp.sin(self.waves * x + self.phases))
        return jnp.where(index == self.index, self.height * waves, 0.0)


class Table(NamedTuple):
    """The scene, where it is looked at from, and which shape has bumps."""

    scene: Scene
    camera: object
    bumpy: int
    height: Bumps


def table(material=None, waves=(WAVE, WAVE, WAVE), phases=(0.0, 0.0, 0.0)) -> Table:
    """The three spheres on their table.

    Args:
        material: of each object, by name; those of `SCENE` if left out.
        waves: wave numbers of the bumps along x, y and z; their slope is that of `SCENE`'s.
        phases: of the bumps.
    """
    of = material or {name: how for name, (_, how) in SCENE.items()}
    scene = Scene.of(*(primitive(s, name=name, **of[name]) for name, (s, _) in SCENE.items()))
    camera = pinhole((0.0, -5.0, 2.4), (0.0, 0.0, 0.35), gamma=2.6)
    bumpy = scene.named("bumpy")[0]
    height = jnp.asarray(BUMP * WAVE / np.mean(waves))
    return Table(scene, camera, bumpy, Bumps(bumpy, height, *map(jnp.asarray, (waves, phases))))


def lamp(distance: float = 1.0, count: int = 8, even: bool = False) -> Lamp:
    """The lamp, `distance` times as far from the middle of the spheres as usual, turned to it."""
    middle, at = np.array([0.0, 0.0, 0.4]), np.array([-1.0, -1.5, 2.5])
    way = (at - middle) * distance
    u = np.array([0.5, 0.0, 0.0])
    v = 0.5 * np.cross(way, u) / np.linalg.norm(np.cross(way, u))
    return Lamp(middle + way, v, u, 8.0 * distance**2, count, even)


class Layout(NamedTuple):
    """One choice of all that the paper leaves open.

    Attributes:
        world: the scene.
        toward: where the lamp is from the middle of the spheres, a unit vector.
        half: half of the lamp's edge [m].
    """

    world: Table
    toward: np.ndarray
    half: float

    def lamp(self, distance: float = 1.0) -> Lamp:
        """The lamp, `distance` times 3 m away, with the irradiance that it has at 3 m."""
        u = np.cross(self.toward, (0.0, 0.0, 1.0))
        u *= self.half / np.linalg.norm(u)
        v = np.cross(self.toward, u)
        middle = np.array([0.0, 0.0, 0.4]) + 3.0 * distance * self.toward
        return Lamp(middle, v, u, 2.0 * (distance / self.half) ** 2, 8)


def layouts(count: int, seed: int = 5) -> Iterator[Layout]:
    """Lay-outs at random, in the ranges that stand above.

    Args:
        count: how many.
        seed: of the random numbers.
    """
    random = np.random.default_rng(seed)
    for _ in range(count):
        materials = {name: _material(random, name != "diffuse") for name in NAMES}
        waves, phases = 2.0 * np.pi / random.uniform(0.15, 0.4, 3), random.uniform(0.0, 6.28, 3)
        up, turn = np.radians(random.uniform((35.0, 0.0), (70.0, 360.0)))
        toward = np.array([np.cos(up) * np.cos(turn), np.cos(up) * np.sin(turn), np.sin(up)])
        yield Layout(table(materials, waves, phases), toward, random.uniform(0.25, 0.75))


def _material(random: np.random.Generator, glossy: bool) -> dict[str, float]:
    albedo, share, decades = random.uniform((0.2, 0.2, 1.0), (0.8, 0.8, 2.0))
    gloss = dict(specular=(1.0 - albedo) * share, exponent=10.0**decades)
    return dict(albedo=albedo, **(gloss if glossy else {}))


def coordinates(p: np.ndarray, side: int) -> np.ndarray:
    """Image coordinates of places in pixels of a square image."""
    return 2.0 * p / side - 1.0


def grid(side: int) -> np.ndarray:
    """Centres of all pixels [pixels], first axis across."""
    x = np.arange(side) + 0.5
    return np.stack(np.meshgrid(x, x, indexing="ij"), -1).reshape(-1, 2)


def tints(world: Table) -> np.ndarray:
    """Of each shape, for pictures."""
    found = np.ones((world.scene.count, 3))
    for name, tint in TINTS.items():
        found[world.scene.named(name)[0]] = tint
    return found


def shown(world: Table, p: np.ndarray) -> np.ndarray:
    """Which shape each image coordinate shows, in blocks of one compiled size."""
    return host_blocks(lambda q: pixel_labels(world.scene, world.camera, q), p, 4096)[0]


def shaded(world: Table, lamps, p: np.ndarray, shadows: bool) -> tuple[ShadedPixels, np.ndarray]:
    """Pixels at image coordinates, and which shape each shows."""
    index = shown(world, p)
    finish = SurfaceMaps(world.height)
    found = shade_pixels(world.scene, world.camera, lamps, p, index, finish, shadows)
    return found, index


def seen_by_tree(world: Table, lamps, side: int, *, shadows: bool = True, more=None):
    """A function for `sample_image`: values and gradients per pixel.

    Args:
        world: the scene.
        lamps: the light.
        side: of the image [pixels].
        shadows: whether lamps are hidden.
        more: what else a metric wants: a function of the pixels and their shapes.
    """

    def shade(p):
        found, index = shaded(world, lamps, coordinates(p, side), shadows)
        extra = None if more is None else more(found, index)
        return ShadedSamples(found.value, (found.gradient + found.edges) * 2.0 / side, extra)

    return shade


def d05_density(world: Table):
    """D05's criterion as R07 §9 writes it: `2 k z Omega_rho / (n . v)`, without bumps.

    k: root mean square of the principal curvatures; Omega_rho: `sqrt(6 s)`, or 2 where nothing is
    glossy (the degree at which a clamped cosine has all but vanished).
    """
    material = world.scene.material
    band = np.where(material.specular > 0.0, np.sqrt(6.0 * np.asarray(material.exponent)), 2.0)

    def density(found: ShadedPixels, index: np.ndarray) -> np.ndarray:
        k = found.curvature / np.sqrt(2.0)
        cosine = np.maximum(np.asarray(found.cosine), 1e-3)
        return np.where(index >= 0, 2.0 * k * found.distance / cosine * band[index], 0.0)

    return density


def show(ax, values, title: str, **options):
    """An image as it is looked at."""
    drawn = ax.imshow(np.asarray(values).T, origin="lower", interpolation="nearest", **options)
    ax.set(title=title, xticks=[], yticks=[])
    return drawn


def show_decades(ax, values, title: str, low: float = FLOOR, high: float | None = None):
    """An image of magnitudes on a scale of decades; zeros, as where nothing is, stay blank."""
    values = np.asarray(values)
    with np.errstate(divide="ignore", invalid="ignore"):
        shown = np.where(values > 0.0, np.maximum(np.log10(values), low), np.nan)
    ax.set_facecolor("0.92")
    return show(ax, shown, title, cmap=plotting.MAGNITUDE, vmin=low, vmax=high)
