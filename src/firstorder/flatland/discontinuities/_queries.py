"""Queries of the search for visual events: many rays or points at a time.

Answers are NumPy arrays. Batches are filled up to a power of two, so that few programs are
compiled.
"""

from __future__ import annotations

from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from firstorder.flatland.direct_lighting import Radiance
from firstorder.flatland.intersect import nearest
from firstorder.flatland.scene import Scene
from firstorder.flatland.shapes._crossings import points_of
from firstorder.numerics._batching import host_rows
from firstorder.numerics._planar import left
from firstorder.scene._primitives import BACK, FRONT


class FirstHits(NamedTuple):
    """First hits of rays: distance, number of the shape (-1 for none), parameter, side."""

    t: np.ndarray
    number: np.ndarray
    s: np.ndarray
    front: np.ndarray


def trace(scene: Scene, origins, along) -> FirstHits:
    """First hits of rays."""
    hits, front = batched(_traced, scene, origins, along)
    return FirstHits(hits.t, hits.index, hits.s, front)


def batched(program, scene: Scene, *rows):
    """Runs a program on rows filled up to a power of two from 64 on: few lengths to compile."""
    return host_rows(lambda rows: program(scene, *rows), rows)


@eqx.filter_jit
def _traced(scene, origins, along):
    hits = nearest(scene, origins, along)
    normal = jax.vmap(lambda i, s: left(scene.motion(i, s)[1]))(jnp.maximum(hits.index, 0), hits.s)
    return hits, jnp.sum(normal * along, -1) < 0.0


@eqx.filter_jit
def on_line(scene, index, origin, along):
    """Hits of rays with one given shape each: distance, parameter and frame."""
    t, s = jax.vmap(scene.hit)(index, origin, along)
    return t, s, jax.vmap(scene.frame)(index, s)


@eqx.filter_jit
def frames(scene, index, s):
    """Frames at given points of shapes."""
    return jax.vmap(scene.frame)(index, s)


def radiance_on_host(scene: Scene, radiance: Radiance | None):
    """Radiance of many points, on the host."""
    if radiance is None:
        emission = np.asarray(scene.material.emission)
        return lambda index, s, front, u: emission[index, np.where(front, FRONT, BACK)]

    @eqx.filter_jit
    def sent(scene, index, s, front, u):
        return jax.vmap(radiance)(index, s, front, u)

    def ask(index, s, front, u):
        return batched(sent, scene, index, s, front, u)

    return ask


def extent(scene: Scene) -> float:
    """The extent of all shapes."""
    s = jnp.linspace(0.0, 1.0, 9)
    points = np.concatenate(
        [np.asarray(points_of(group, s)).reshape(-1, 2) for group in scene.groups]
    )
    return float(np.max(np.ptp(points, axis=0)))
