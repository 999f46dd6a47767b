"""Flat ground that mirrors a lamp behind two grids, for E11's factoring: what is true, by lobe.

Two halves of stratified rays say independently of each other what receivers reflect, and which
share of the light of each of 8 x 8 cells of the lamp they see.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from figures.e11.shared import space as scenes
from firstorder.shadowfield.rendering._glossy_receivers import (
    GlossySurface,
    cell_light,
    glossy_surface,
)

LOBES = (0, 5, 20, 80)  # exponents; 0 for diffuse
CELLS = (1, 2, 4, 8)
SEED = 5
_ROWS = 1 << 19


class Ground(NamedTuple):
    """What the image shows of the ground, with its truths.

    Attributes:
        scene: all of it.
        points: receivers [m].
        whole: reflected radiance without blockers, by lobe.
        light: of it, what each of 8 x 8 cells brings, by lobe.
        true: reflected radiance by each half of the rays, by lobe.
        seen: share of each cell's light, by each half of the rays.
        share: of the lamp's light, by cell.
    """

    scene: scenes.Scene
    points: np.ndarray
    whole: np.ndarray
    light: list[np.ndarray]
    true: np.ndarray
    seen: np.ndarray
    share: np.ndarray

    def factored(self, lobe: int, seen: np.ndarray, cells: int, some=slice(None)) -> np.ndarray:
        """Shading times visibility in each of `cells` x `cells` cells, summed."""
        light = merged(self.light[lobe][some], cells)
        return np.sum(light * merged(seen * self.share, cells) / merged(self.share, cells), -1)

    def every(self, n: int) -> np.ndarray:
        """Which receivers every n-th pixel of every n-th column shows."""
        column, row = np.divmod(np.flatnonzero(self.scene.floor), self.scene.side)
        return (column % n == 0) & (row % n == 0)

    def rms(
        self, lobe: int, found: np.ndarray | list[np.ndarray], some=slice(None)
    ) -> tuple[float, float]:
        """Error over the mean radiance without blockers, and what noise of rays may make of 0.

        The errors of both halves are multiplied: their noises are independent and average out.
        """
        a, b = (found, found) if isinstance(found, np.ndarray) else found
        product = (a - self.true[0, lobe, some]) * (b - self.true[1, lobe, some])
        floor = 2.0 * np.std(product) / np.sqrt(len(product))
        both = np.sqrt([max(np.mean(product), 0.0), floor]) / np.mean(self.whole[lobe])
        return float(both[0]), float(both[1])

    @property
    def visible(self) -> np.ndarray:
        """Share of the lamp's light that is seen, by each half of the rays."""
        return self.seen @ self.share


def merged(values: np.ndarray, cells: int) -> np.ndarray:
    """Sums over cells of 8 x 8 that make up larger ones."""
    side = CELLS[-1] // cells
    shaped = values.reshape(*values.shape[:-1], cells, side, cells, side)
    return shaped.sum((-3, -1)).reshape(*values.shape[:-1], cells**2)


def surface(points: np.ndarray, lobe: int, up=(0.0, 0.0, 1.0)) -> GlossySurface:
    """Receivers that reflect all light evenly or into a lobe."""
    normal = np.tile(up, (len(points), 1))
    way = np.asarray(scenes.MIRROR_EYE) - points
    return glossy_surface(normal, way, float(lobe == 0), float(lobe > 0), float(max(lobe, 1)))


def shading(points: np.ndarray, places: np.ndarray, lamp) -> list[np.ndarray]:
    """K rho of each lobe between points of the ground and places on the lamp, by its definition."""
    to_eye = np.asarray(scenes.MIRROR_EYE) - points
    mirrored = to_eye * (-1.0, -1.0, 1.0) / np.linalg.norm(to_eye, axis=1, keepdims=True)
    way = places - points[:, None]
    square = np.einsum("kri,kri->kr", way, way)
    far = np.sqrt(square)
    K = way[..., 2] * -(way @ lamp.axes[2]) / square**2
    lobe = np.maximum(np.einsum("kri,ki->kr", way, mirrored) / far, 0.0).astype(np.float32)
    return [K / np.pi] + [K * ((e + 2) / (2 * np.pi)) * lobe**e for e in LOBES[1:]]


def hidden(scene: scenes.Scene, strata: int) -> tuple[np.ndarray, np.ndarray]:
    """Radiance and light of cells that blockers take away, by two halves of stratified rays.

    What is taken away is nothing where the lamp is free, so that rays leave no noise there.
    """
    points, lamp, cells = scene.receivers[scene.floor], scene.lamp, CELLS[-1]
    true = np.empty((2, len(LOBES), len(points)))
    seen = np.empty((2, len(points), cells**2))
    grid = np.indices((strata, strata)).reshape(2, -1).T
    step, per = _ROWS // strata**2, strata // cells
    for half in range(2):
        rng = np.random.default_rng([SEED, half])
        for begin in range(0, len(points), step):
            some = slice(begin, min(begin + step, len(points)))
            at = points[some]
            p = 2.0 * (grid + rng.random((len(at), strata**2, 2))) / strata - 1.0
            flat = np.concatenate([p * lamp.half, np.zeros((*p.shape[:2], 1))], -1).reshape(-1, 3)
            ends = lamp.world(flat)
            free = scene.visible(np.repeat(at, strata**2, 0), ends).reshape(len(at), -1)
            lit = scenes.falloff(p) * ~free * (4.0 * np.prod(lamp.half) / strata**2)
            k = shading(at, ends.reshape(*p.shape[:2], 3), lamp)
            true[half, :, some] = [np.sum(lit * a, 1) for a in k]
            seen[half, some] = (
                lit.reshape(-1, cells, per, cells, per).sum((2, 4)).reshape(len(at), -1)
            )
    return true, seen


def ground(side: int, strata: int) -> Ground:
    """The scene, measured."""
    scene = scenes.mirror(side)
    points, lamp = scene.receivers[scene.floor], scene.lamp
    light = [
        cell_light(lamp, points, surface(points, e), CELLS[-1], scenes.falloff, nodes=2)
        for e in LOBES
    ]
    radiance, dark = hidden(scene, strata)
    x = (np.arange(256) + 0.5) / 128.0 - 1.0
    line = np.exp(-2.0 * x**2).reshape(CELLS[-1], -1).sum(1) * lamp.half[0] / 128.0
    power = np.outer(line, line).ravel()  # of the cells
    whole = np.array([a.sum(1) for a in light])
    share = power / power.sum()
    return Ground(scene, points, whole, light, whole - radiance, 1.0 - dark / power, share)
