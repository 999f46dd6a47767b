"""D05 §6.2 on a scene of `d05.shared.shading`: slopes of blockers, criteria, samples, images.

Lobes count with their root mean square frequencies (`rms_cutoff`), the light with that of its lamp.
A pixel's bandwidth is the larger of its lobes'. "Mirror" is the criterion without blockers (gloss
alone, as D05 has it, from differences between pixels), "plain" adds the paper's mean over 100 rays
about the normal, "light" the one it asks for: rays drawn where the light is, weighted by it, 50 for
each lobe.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import equinox as eqx
import jax.numpy as jnp
import numpy as np

from figures.d05.shared import shading
from figures.d05.shared.shading import Points, View, World, about, mirrored, shown
from firstorder.bandwidth import pixel_rates as maps
from firstorder.bandwidth import screen_space as screen
from firstorder.caching import ssim
from firstorder.numerics._vectors import dot, matvec, orthonormal_frame
from firstorder.reconstruction.bilateral import bilateral_widths, cross_bilateral
from firstorder.reconstruction.blue_noise import blue_noise_samples
from firstorder.reconstruction.delaunay import delaunay_image

RAYS = 100  # to find blockers, at some of the samples
OF_SKY = dict(lamp=30, fill=10, ambient=10)  # of them, where slopes are weighted by light
LIGHT = float(maps.rms_cutoff(1.0 / shading.WIDE**2))


def budget(quick: bool) -> int:
    """Samples: the paper's 20,000 of 400,000 pixels, or the same share."""
    return 288 if quick else 20000


def chosen(density: np.ndarray, count: int, seed: int = 0) -> np.ndarray:
    """Pixels to look at, shape (count, 2); the seed is that of the blue noise."""
    return np.argwhere(blue_noise_samples(density, count, seed=seed, exactly=True))


# --- blockers ------------------------------------------------------------------------------------


def slopes_at(kind: Callable, world: World, view: View, at: np.ndarray, seed: int = 0):
    """Mean slopes of blockers at pixels, 100 rays each [1/m].

    Args:
        kind: `plain_rays` or `lit_rays`.
        world: the scene.
        view: its pixels.
        at: those that are asked, shape (n, 2).
        seed: of turns of the rays about the normal.

    Returns:
        For each set of weights, shape (m, n).
    """
    turn = np.random.default_rng(seed).random(len(at))
    points = shading.some(view.points, at @ (view.label.shape[1], 1))
    exponent, parts = jnp.asarray(world.lobes.exponent), []
    for block, rows in shading.blocks(points):
        w, weight = kind(block, exponent, jnp.asarray(turn[rows]))
        parts.append(np.asarray(_slopes(jnp.asarray(world.rays.distance(block, w)), weight)))
    return np.concatenate(parts, 1)[:, : len(at)]


@eqx.filter_jit
def _slopes(distance, weight):
    return maps.mean_inverse_distance(jnp.broadcast_to(distance, weight.shape), weight)


def _spun(w, turn):
    """Directions turned about +z by a share of a full turn for each point."""
    c, s = jnp.cos(2.0 * jnp.pi * turn)[:, None], jnp.sin(2.0 * jnp.pi * turn)[:, None]
    x, y, z = w[..., 0], w[..., 1], w[..., 2]
    return jnp.stack([c * x - s * y, s * x + c * y, jnp.broadcast_to(z, (c * x).shape)], -1)


@eqx.filter_jit
def plain_rays(points: Points, exponent, turn):
    """The paper's: rays by the cosine, all of one weight; directions and weights (1, n, 100)."""
    w = matvec(orthonormal_frame(points.at.normal)[:, None], _spun(about(RAYS, 1.0), turn))
    return w, jnp.ones((1, *w.shape[:2]))


@eqx.filter_jit
def lit_rays(points: Points, exponent, turn):
    """Weighted by light: rays to the sky for the diffuse lobe, mirrored ones for gloss.

    Returns:
        Directions, and the light that each brings to one lobe and to the other, (2, n, 100).
    """
    at, n, half = points.at, len(points.thing), RAYS // 2
    s = exponent[jnp.maximum(points.thing, 0), None]
    lamp, lamp_power = shading.lobe_nodes(shading.LAMP, OF_SKY["lamp"])
    fill, fill_power = shading.lobe_nodes(shading.FILL, OF_SKY["fill"])
    fixed = [jnp.broadcast_to(w, (n, *w.shape)) for w in (lamp, fill)]
    ambient = matvec(
        orthonormal_frame(at.normal)[:, None], _spun(about(OF_SKY["ambient"], 1.0), turn)
    )
    gloss = matvec(orthonormal_frame(mirrored(at))[:, None], _spun(about(half, s), turn))
    w = jnp.concatenate([*fixed, ambient, gloss], 1)
    cosine = jnp.maximum(dot(w, at.normal[:, None]), 0.0)
    powers = (lamp_power, fill_power, jnp.pi * shading.AMBIENT)
    share = [jnp.full(k, p / k) for k, p in zip(OF_SKY.values(), powers, strict=True)]
    by_cosine = jnp.arange(half) >= half - OF_SKY["ambient"]  # these are as dense as the cosine
    lit = jnp.concatenate(share) * jnp.where(by_cosine, 1.0, cosine[:, :half])
    polished = shading.sky(w[:, half:]) * cosine[:, half:]
    none = jnp.zeros((n, half))
    weight = [jnp.concatenate([lit, none], 1), jnp.concatenate([none, polished], 1)]
    return w, jnp.stack(weight)


# --- criteria ------------------------------------------------------------------------------------


class Criterion(NamedTuple):
    """What a criterion needs at every pixel.

    Attributes:
        turns: differences between pixels.
        gloss: bandwidth of each pixel's glossy lobe [1/rad].
        met: whether a pixel shows a shape.
    """

    turns: screen.PixelDifferences
    gloss: np.ndarray
    met: np.ndarray


def criterion(world: World, view: View) -> Criterion:
    """Differences and bandwidths of an image."""
    position = np.asarray(view.at.position).reshape(view.normal.shape)
    turns = screen.pixel_differences(position, view.normal, world.camera.eye, view.label)
    s = world.lobes.exponent[np.maximum(view.shows, 0)]
    return Criterion(turns, np.asarray(maps.rms_cutoff(s)), view.shows >= 0)


_glossy, _diffuse = (
    eqx.filter_jit(screen.screen_glossy_bandwidth),
    eqx.filter_jit(screen.screen_diffuse_bandwidth),
)


def mirror(c: Criterion) -> np.ndarray:
    """Without blockers: D05 (20) from differences."""
    return plain(c, np.zeros(c.met.shape))


def plain(c: Criterion, slope: np.ndarray, light: float = 0.0) -> np.ndarray:
    """With blockers: D05 (21) from differences, one slope for all."""
    return np.where(c.met, _glossy(c.gloss, c.turns, slope, np.array(light)), 0.0)


def lobes(c: Criterion, diffuse: np.ndarray, gloss: np.ndarray) -> np.ndarray:
    """Both lobes with the light's bandwidth, each past its own blockers; the larger of the two."""
    cosine = np.array(maps.rms_cutoff(1.0))
    spread = np.where(c.met, _diffuse(cosine, c.turns, diffuse, np.array(LIGHT)), 0.0)
    return np.maximum(plain(c, gloss, LIGHT), spread)


# --- images --------------------------------------------------------------------------------------


def filtered(view: View, at: np.ndarray, value: np.ndarray, width: np.ndarray):
    """Values at samples over the image, by the cross-bilateral filter; samples keep their own."""
    found = cross_bilateral(at + 0.5, value, width, view.depth, view.normal)
    found[tuple(at.T)] = value
    return found


def finely(view: View, fine: View, at: np.ndarray, value: np.ndarray, white: float):
    """Values over the image at four visibility samples a pixel, by triangles: means on a screen."""
    label = view.label[tuple(at.T)]
    found = delaunay_image(2.0 * at + 1.0, value, *fine.label.shape, label=label, labels=fine.label)
    return averaged(shown(found, white))


def averaged(fine: np.ndarray) -> np.ndarray:
    """Means of 2 x 2 pixels."""
    w, h = fine.shape
    return fine.reshape(w // 2, 2, h // 2, 2).mean((1, 3))


def triangulated(view: View, at: np.ndarray, value: np.ndarray) -> np.ndarray:
    """Linear over a triangulation, not across labels; no value is negative."""
    label = view.label[tuple(at.T)]
    found = delaunay_image(at + 0.5, value, *view.label.shape, label=label, labels=view.label)
    return np.maximum(found, 0.0)


def between(view: View, at: np.ndarray, slope: np.ndarray) -> np.ndarray:
    """Slopes of blockers over the image, as `triangulated`, at every second pixel each way."""
    coarse = view.label[::2, ::2]
    label = view.label[tuple(at.T)]
    found = delaunay_image(0.5 * (at + 0.5), slope, *coarse.shape, label=label, labels=coarse)
    w, h = view.label.shape
    return np.repeat(np.repeat(np.maximum(found, 0.0), 2, 0), 2, 1)[:w, :h]


POWER, EVEN = 1.0, 0.1  # of densities: the bandwidth itself, and a tenth of the samples anywhere


def spread(bandwidth: np.ndarray, power: float = POWER, even: float = EVEN) -> np.ndarray:
    """Density of samples for a bandwidth per radian or pixel."""
    return maps.sampling_density(bandwidth, power=power, even=even)


def image(
    view: View,
    truth: np.ndarray,
    density: np.ndarray,
    count: int,
    way: str = "delaunay",
    seed: int = 0,
) -> np.ndarray:
    """What is made of samples that are placed at a density."""
    at = chosen(density, count, seed)
    value = truth[tuple(at.T)]
    if way == "delaunay":
        return triangulated(view, at, value)
    return filtered(view, at, value, bilateral_widths(density, len(at)))


def errors(found: np.ndarray, truth: np.ndarray, white: float) -> tuple[float, float, float]:
    """RMSE of radiance, and of what a screen shows, and SSIM of that."""
    a, b = shown(found, white), shown(truth, white)
    rms = [float(np.sqrt(np.mean((x - y) ** 2))) for x, y in ((found, truth), (a, b))]
    return rms[0], rms[1], ssim(a, b, 1.0)


# --- all of it -----------------------------------------------------------------------------------

WORDS = {
    "mirror": "without blockers",
    "plain": "with blockers",
    "light": "with blockers, weighted by light",
}


class Found(NamedTuple):
    """Criteria of an image.

    Attributes:
        maps: bandwidths by name [cycles per pixel].
        plain: mean slope of blockers, the paper's [1/m].
        criterion: what they were made of.
        asked: number of points from which blockers were looked for.
    """

    maps: dict[str, np.ndarray]
    plain: np.ndarray
    criterion: Criterion
    asked: int


def criteria(world: World, view: View, count: int, share: float = EVEN) -> Found:
    """All criteria of an image of `count` samples, with slopes from a share of as many points.

    Args:
        world: the scene.
        view: its pixels.
        count: of samples.
        share: of which blockers are found. `EVEN` of the samples lie evenly in every density and
            are among the first of the blue noise: they are samples of the image as well.
    """
    at, slopes = chosen(np.ones(view.label.shape), max(int(share * count), 64)), []
    for kind in (plain_rays, lit_rays):
        slopes += [between(view, at, a) for a in slopes_at(kind, world, view, at)]
    c = criterion(world, view)
    made = {"mirror": mirror(c), "plain": plain(c, slopes[0]), "light": lobes(c, *slopes[1:])}
    return Found(made, slopes[0], c, len(at))
