"""D05 §6.2 on the scene of `_d05_creatures`: criteria, slopes of blockers, samples, images.

Lobes count with their root mean square frequencies (`rms_cutoff`), the light with that of its lamp.
A pixel's bandwidth is the larger of its lobes'. "Mirror" is the criterion without blockers (gloss
alone, as D05 has it, from differences between pixels), "plain" adds the paper's mean over 100 rays
about the normal, "light" the one it asks for: rays drawn where the light is, weighted by it, 50 for
each lobe.
"""

from __future__ import annotations

import time
from typing import NamedTuple

import equinox as eqx
import jax.numpy as jnp
import numpy as np

from figures import _d05_creatures as creatures
from figures._d05_creatures import View, World
from firstorder.methods import bandwidth_map as maps
from firstorder.methods import bandwidth_screen as screen
from firstorder.methods.bilateral import cross_bilateral, widths
from firstorder.methods.caching import ssim
from firstorder.methods.delaunay import reconstruct
from firstorder.sampling.blue_noise import place
from firstorder.vectors import dot, frame, times, unit

RAYS = 100  # to find blockers, at as many points as there are samples
LIGHT = float(maps.rms_cutoff(1.0 / creatures.WIDE**2))


def budget(quick: bool) -> int:
    """Samples: the paper's 20,000 of 400,000 pixels, or the same share."""
    return 288 if quick else 20000


def chosen(density: np.ndarray, count: int) -> np.ndarray:
    """Pixels to look at, shape (count, 2)."""
    return np.argwhere(place(density, count, exactly=True))


# --- blockers ------------------------------------------------------------------------------------


def slopes_at(kind, world: World, view: View, at: np.ndarray, seed: int = 0):
    """Mean slopes of blockers at pixels by `plain_slopes` or `lit_slopes`, 100 rays each [1/m]."""
    rows = at @ (view.shows.shape[1], 1)
    turn = np.random.default_rng(seed).random(len(rows))
    fill = np.resize(np.arange(len(rows)), -(-len(rows) // 1024) * 1024).reshape(-1, 1024)
    index = view.shows.ravel()
    parts = [
        kind(world.scene, *creatures.taken(view.at, index, rows[k]), jnp.asarray(turn[k]))
        for k in fill
    ]
    return np.concatenate([np.asarray(p) for p in parts], 1)[:, : len(rows)]


def _spun(w, turn):
    """Directions turned about +z by a share of a full turn for each point."""
    c, s = jnp.cos(2.0 * jnp.pi * turn)[:, None], jnp.sin(2.0 * jnp.pi * turn)[:, None]
    x, y, z = w[..., 0], w[..., 1], w[..., 2]
    return jnp.stack([c * x - s * y, s * x + c * y, jnp.broadcast_to(z, (c * x).shape)], -1)


@eqx.filter_jit
def plain_slopes(scene, at, index, turn):
    """The paper's: rays by the cosine, all of one weight."""
    w = times(frame(at.normal)[:, None], _spun(creatures.about(RAYS, 1.0), turn))
    return maps.mean_slope(maps.blocker_distance(scene, at.position, w, index))[None]


@eqx.filter_jit
def lit_slopes(scene, at, index, turn):
    """Weighted by light: rays to the sky's lobes for the diffuse lobe, mirrored ones for gloss."""
    half = RAYS // 2
    lamp, fill = (creatures.lobe_nodes(which, n) for which, n in ((creatures.LAMP, half - 20),
                                                                 (creatures.FILL, 10)))  # fmt: skip
    ambient = times(frame(at.normal)[:, None], _spun(creatures.about(10, 1.0), turn))
    n = len(index)
    sky = [jnp.broadcast_to(w, (n, *w.shape)) for w in (lamp[0], fill[0])]
    mirrored = 2.0 * dot(at.normal, at.to_eye)[:, None] * at.normal - at.to_eye
    s = scene.material.exponent[jnp.maximum(index, 0)]
    gloss = times(frame(unit(mirrored))[:, None], _spun(creatures.about(half, s[:, None]), turn))
    w = jnp.concatenate([*sky, ambient, gloss], 1)
    cosine = jnp.maximum(dot(w, at.normal[:, None]), 0.0)
    share = [lamp[1] / (half - 20), fill[1] / 10, jnp.pi * creatures.AMBIENT / 10]
    power = jnp.repeat(jnp.stack(share), jnp.array([half - 20, 10, 10]), total_repeat_length=half)
    lit = jnp.where(jnp.arange(half) < half - 10, cosine[:, :half], 1.0) * power
    polished = creatures.sky(w[:, half:]) * cosine[:, half:]
    distance = maps.blocker_distance(scene, at.position, w, index)
    found = maps.mean_slope(distance[:, :half], lit), maps.mean_slope(distance[:, half:], polished)
    return jnp.stack(found)


# --- criteria ------------------------------------------------------------------------------------


class Criterion(NamedTuple):
    """What a criterion needs at every pixel.

    Attributes:
        turns: differences between pixels.
        gloss: bandwidth of each pixel's glossy lobe [1/rad].
        met: whether a pixel shows a shape.
    """

    turns: screen.Turns
    gloss: np.ndarray
    met: np.ndarray


def criterion(world: World, view: View) -> Criterion:
    """Differences and bandwidths of an image."""
    shape = view.shows.shape
    position = np.asarray(view.at.position).reshape(*shape, 3)
    turns = screen.screen_turns(position, view.normal, world.camera.eye, view.label)
    s = np.asarray(world.scene.material.exponent)[np.maximum(view.shows, 0)]
    return Criterion(turns, np.asarray(maps.rms_cutoff(s)), view.shows >= 0)


def mirror(c: Criterion) -> np.ndarray:
    """Without blockers: D05 (20) from differences."""
    return np.where(c.met, screen.screen_glossy(c.gloss, c.turns), 0.0)


def plain(c: Criterion, slope: np.ndarray) -> np.ndarray:
    """With blockers: D05 (21) from differences, one slope for all."""
    return np.where(c.met, screen.screen_glossy(c.gloss, c.turns, slope), 0.0)


def lobes(c: Criterion, diffuse: np.ndarray, gloss: np.ndarray) -> np.ndarray:
    """Both lobes with the light's bandwidth, each past its own blockers; the larger of the two."""
    polished = screen.screen_glossy(c.gloss, c.turns, gloss, LIGHT)
    spread = screen.screen_diffuse(maps.rms_cutoff(1.0), c.turns, diffuse, LIGHT)
    return np.where(c.met, np.maximum(polished, spread), 0.0)


# --- images --------------------------------------------------------------------------------------


def filtered(view: View, at: np.ndarray, value: np.ndarray, width: np.ndarray):
    """Values at samples over the image, by the cross-bilateral filter; samples keep their own."""
    found = cross_bilateral(at + 0.5, value, width, view.depth, view.normal)
    found[tuple(at.T)] = value
    return found


def finely(view: View, fine: View, at: np.ndarray, value: np.ndarray, width: np.ndarray):
    """The same at four visibility samples a pixel, and their mean."""
    shows = view.depth[tuple(at.T)], view.normal[tuple(at.T)]
    wide = 2.0 * np.repeat(np.repeat(width, 2, 0), 2, 1)
    found = cross_bilateral(2.0 * at + 1.0, value, wide, fine.depth, fine.normal, shows=shows)
    return averaged(found)


def averaged(fine: np.ndarray) -> np.ndarray:
    """Means of 2 x 2 pixels."""
    w, h = fine.shape
    return fine.reshape(w // 2, 2, h // 2, 2).mean((1, 3))


def triangulated(view: View, at: np.ndarray, value: np.ndarray) -> np.ndarray:
    """Linear over a triangulation, not across labels."""
    label = view.label[tuple(at.T)]
    return reconstruct(at + 0.5, value, *view.label.shape, label=label, labels=view.label)


POWER, EVEN = 1.0, 0.1  # of densities: the bandwidth itself, and a tenth of the samples anywhere


def spread(bandwidth: np.ndarray, power: float = POWER, even: float = EVEN) -> np.ndarray:
    """Density of samples for a bandwidth per radian or pixel."""
    return maps.density(bandwidth, power=power, even=even)


def image(view: View, truth: np.ndarray, density: np.ndarray, count: int, way: str = "bilateral"):
    """Samples placed at a density, and what is made of them."""
    at = chosen(density, count)
    value = truth[tuple(at.T)]
    if way == "delaunay":
        return at, triangulated(view, at, value)
    return at, filtered(view, at, value, widths(density, len(at)))


def shown(value: np.ndarray, white: float) -> np.ndarray:
    """As on a screen, in [0, 1]."""
    return np.clip(value / white, 0.0, 1.0) ** (1.0 / 2.2)


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
        seconds: processor time by step.
    """

    maps: dict[str, np.ndarray]
    plain: np.ndarray
    criterion: Criterion
    seconds: dict[str, float]


def criteria(world: World, view: View, count: int) -> Found:
    """All criteria of an image, with slopes from `count` points."""
    even = np.ones(view.shows.shape)
    at = chosen(even, count)
    took, slopes = {}, []
    width = widths(even, len(at))
    for name, kind in (("plain", plain_slopes), ("light", lit_slopes)):
        slopes_at(kind, world, view, at[:1])  # compiled before it is timed
        took[name], found = timed(lambda kind=kind: slopes_at(kind, world, view, at))
        over = timed(lambda found=found: [filtered(view, at, each, width) for each in found])
        took[f"{name} filter"] = over[0]
        slopes += over[1]
    took["differences"], c = timed(lambda: criterion(world, view))
    made = {"mirror": mirror(c), "plain": plain(c, slopes[0]), "light": lobes(c, *slopes[1:])}
    return Found(made, slopes[0], c, took)


def timed(run):
    """Processor time of a call, and what it gives."""
    start = time.process_time()
    found = run()
    return time.process_time() - start, found
