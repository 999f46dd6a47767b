"""The ways to a gradient in a soft shadow, each as calls by budget that take a seed.

A call answers with one array (n, 2) of gradients at the places, or with one for each step that it
tried, all of which cost the same.
"""

from __future__ import annotations

import pathlib
import tempfile
from collections.abc import Callable
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from benchmarks.peers import measure, mitsuba_renderer, radiance
from benchmarks.peers.soft_shadows import HALF, HEIGHT, STILL, SoftShadow
from firstorder.space import Receiver, Scene, irradiance, occluded

OURS = "firstorder, exact"
SAMPLED = "autodiff of sampled visibility"
RADIANCE = "Radiance, gradients of its cache"
RADIANCE_STEPS = "Radiance, differences"
MITSUBA_STEPS = "Mitsuba, differences"
PROJECTIVE = "Mitsuba, direct_projective"
STEPS = (0.003, 0.01, 0.03)  # of differences, half their width [m]
ENDS = np.array([(1.0, 0.0), (-1.0, 0.0), (0.0, 1.0), (0.0, -1.0)])
EXACT_DIRECT = ("-ab", 0, "-dj", 1, "-ds", 0.02, "-dt", 0, "-dc", 1)

Call = Callable[[int], list[np.ndarray]]


class Way(NamedTuple):
    """A way by its name, its calls by budget, and what a budget counts."""

    name: str
    budgets: dict[int, Call]
    unit: str


def derives() -> bool:
    """Whether Mitsuba is there with a variant that has derivatives."""
    return measure.is_there("mitsuba") and mitsuba_renderer.variant() != "scalar_rgb"


def left_out() -> list[str]:
    """A sentence for each peer that cannot run here."""
    found = [measure.missing(p) for p in ("pyradiance", "mitsuba") if not measure.is_there(p)]
    if measure.is_there("mitsuba") and not derives():
        found.append("Mitsuba found no LLVM of 19 or newer here: its scalar variant ran, which has "
                     "no derivatives.")  # fmt: skip
    return found


def ways(shadow: SoftShadow, places: np.ndarray, question: str) -> list[Way]:
    """All that can run here."""
    found = [_ours(shadow, places, question), _sampled(shadow, places, question)]
    if measure.is_there("pyradiance"):
        found += [_radiance_steps(shadow, places, question)]
        found += [_radiance(shadow, places)] if question == "receiver" else []
    if measure.is_there("mitsuba"):
        found.append(_mitsuba_steps(shadow, places, question))
    return found


# --- ours, and autodiff of samples ---------------------------------------------------------------


def _asked(shadow: SoftShadow, question: str):
    """E as a function of what moves, and its gradient there, for one place."""

    def E(step, place):
        scene = shadow.scene(step if question == "blocker" else STILL)
        at = jnp.append(place + (step if question == "receiver" else 0.0), 0.0)
        return irradiance(scene, Receiver.at(at, on=scene.named("floor")[0]))

    return jax.grad(E)


def _ours(shadow: SoftShadow, places: np.ndarray, question: str) -> Way:
    """Place by place, though in one call many cost less each."""
    compiled, still = jax.jit(_asked(shadow, question)), jnp.zeros(2)
    at = list(jnp.asarray(places))
    return Way(OURS, {1: lambda seed: [np.stack([compiled(still, p) for p in at])]}, "call")


def light(shadow: SoftShadow, places: np.ndarray) -> np.ndarray:
    """E at places of the floor [W/m^2]; NaN below a body that stands on it."""
    scene = shadow.scene()
    (floor,) = scene.named("floor")

    def one(place):
        return irradiance(scene, Receiver.at(jnp.append(place, 0.0), on=floor))

    each = jax.jit(lambda places: jax.lax.map(one, places, batch_size=64))
    return np.asarray(each(jnp.asarray(places)))


def pixels(shadow: SoftShadow, window: mitsuba_renderer.Window, question: str) -> np.ndarray:
    """Our gradient averaged over each pixel, by 2 x 2 nodes of Gauss."""
    one, still = _asked(shadow, question), jnp.zeros(2)
    each = jax.jit(lambda places: jax.lax.map(lambda p: one(still, p), places, batch_size=16))
    away = 0.5 * window.pixel / np.sqrt(3.0) * np.array([(-1, -1), (1, -1), (-1, 1), (1, 1)])
    return np.mean([np.asarray(each(jnp.asarray(window.centers() + a))) for a in away], 0)


def _sampled(shadow: SoftShadow, places: np.ndarray, question: str) -> Way:
    """One point in each of n x n parts of the lamp, differentiated as it stands."""

    def one(place, key, n):
        corner = jnp.stack(jnp.meshgrid(jnp.arange(n), jnp.arange(n)), -1).reshape(-1, 2)
        u = (corner + jax.random.uniform(key, (n * n, 2))) / n
        lamp = jnp.concatenate([2.0 * HALF * (u - 0.5), jnp.full((n * n, 1), HEIGHT)], 1)

        def E(step):
            bodies = Scene.of(*shadow.things(step if question == "blocker" else STILL))
            at = jnp.append(place + (step if question == "receiver" else 0.0), 0.0)
            way = lamp - at
            seen = ~occluded(bodies, jnp.broadcast_to(at, lamp.shape), lamp)
            return jnp.mean(jnp.where(seen, way[:, 2] ** 2 / jnp.sum(way**2, 1) ** 2, 0.0))

        return jax.grad(E)(jnp.zeros(2))

    def call(n):
        run = jax.jit(lambda place, key: one(place, key, n))

        def gradients(seed):
            keys = jax.random.split(jax.random.key(seed), len(places))
            return [np.stack(list(map(run, jnp.asarray(places), keys)))]

        return gradients

    return Way(SAMPLED, {n * n: call(n) for n in (16, 128)}, "points")


# --- Radiance ------------------------------------------------------------------------------------


def _folder() -> pathlib.Path:
    return pathlib.Path(tempfile.mkdtemp(prefix="peers"))


def _radiance(shadow: SoftShadow, places: np.ndarray) -> Way:
    """Every place a record; the lamp glows, so that gathered rays meet it and the record has it."""
    octree = radiance.compiled(shadow.scene(), _folder(), lamp="glow")

    def call(rays):
        def gradients(seed):
            ambient = _folder() / "cache.amb"
            radiance.irradiance(octree, places, "-ab", 1, "-ad", rays, "-as", 0, "-aa", 0.02,
                                "-ar", 1000, *EXACT_DIRECT[2:], "-af", ambient)  # fmt: skip
            return [_along_floor(radiance.records(ambient), places)]

        return gradients

    return Way(RADIANCE, {4**k: call(4**k) for k in (5, 6, 7, 8)}, "gather rays")


def _along_floor(records, places: np.ndarray) -> np.ndarray:
    """Gradients of the records at the places: theirs are shares of the value, by their own axes."""
    away = np.linalg.norm(records.position[None, :, :2] - places[:, None], axis=-1)
    rows = np.argmin(away, axis=1)
    if np.max(np.min(away, axis=1)) > 1e-5:
        raise ValueError("Argument `places` must be as far apart that each becomes a record.")
    u, v = records.u, np.cross(records.normal, records.u)
    E = np.pi * records.value[:, :1]
    return (E * (records.gradient[:, :1] * u + records.gradient[:, 1:] * v))[rows, :2]


def _radiance_steps(shadow: SoftShadow, places: np.ndarray, question: str) -> Way:
    """Central differences of direct light from 64 jittered points of the lamp, over and over."""
    folder = _folder()
    still = radiance.compiled(shadow.scene(), folder)
    moved = {} if question == "receiver" else {
        (h, k): radiance.compiled(shadow.scene(h * end), folder, f"moved{h}_{k}")
        for h in STEPS for k, end in enumerate(ENDS)
    }  # fmt: skip

    def E(h: float, k: int, repeats: int):
        octree, at = (moved[h, k], places) if moved else (still, places + h * ENDS[k])
        values = radiance.irradiance(octree, np.repeat(at, repeats, axis=0), *EXACT_DIRECT)
        return values.reshape(len(at), repeats).mean(1)

    def call(repeats):
        return lambda seed: [_central([E(h, k, repeats) for k in range(4)], h) for h in STEPS]

    budgets = {64 * n: call(n) for n in (1, 16, 256)}
    return Way(RADIANCE_STEPS, budgets, "points of the lamp at each end")


def _central(values, h: float) -> np.ndarray:
    right, left, up, down = (np.asarray(v, float) for v in values)
    return np.stack([right - left, up - down], -1) / (2.0 * h)


# --- Mitsuba -------------------------------------------------------------------------------------


def _mitsuba_steps(shadow: SoftShadow, places: np.ndarray, question: str) -> Way:
    """Central differences with the same seed at all ends, stratified points of the lamp."""
    still = mitsuba_renderer.loaded(shadow.scene())
    moved = {} if question == "receiver" else {
        (h, k): mitsuba_renderer.loaded(shadow.scene(h * end))
        for h in STEPS for k, end in enumerate(ENDS)
    }  # fmt: skip

    def E(h, k, samples, seed):
        scene, at = (moved[h, k], places) if moved else (still, places + h * ENDS[k])
        return [mitsuba_renderer.irradiance(scene, p, samples, seed * len(places) + i)
                for i, p in enumerate(at)]  # fmt: skip

    def call(samples):
        return lambda seed: [_central([E(h, k, samples, seed) for k in range(4)], h) for h in STEPS]

    most = (4, 6, 8, 10) if derives() else (4, 6)
    return Way(MITSUBA_STEPS, {4**k: call(4**k) for k in most}, "points of the lamp at each end")
