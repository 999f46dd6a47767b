"""Shared by stills of flatland: the light at a place from all around, and shapes as outlines."""

from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np
from matplotlib.axes import Axes

from firstorder.flatland import Receiver, Scene, weighted_irradiance


def fluence(scene: Scene, nodes: int = 1, radiance=None):
    """A function of a place: all light that arrives there, whatever its direction [W/m].

    `int L d(theta)` over the whole circle, exact: gaps between silhouettes, with one node for each
    emitter, which is uniform.
    """

    def at(place):
        def half(n):
            return weighted_irradiance(scene, Receiver(place, n), weight=jnp.ones_like,
                                       nodes=nodes, radiance=radiance)  # fmt: skip

        return half(0.0) + half(jnp.pi)

    return at


def draw_shapes(ax: Axes, scene: Scene, width: float, dark="#05070c", rim="#c9d4e8") -> None:
    """Bodies as dark shapes with a rim, lamps as bright lines."""
    t = jnp.linspace(0.0, 1.0, 257)
    for k in range(scene.count):
        p = np.asarray(jax.vmap(lambda s, k=k: scene.motion(jnp.asarray(k), s)[0])(t))
        lamp = float(np.max(np.asarray(scene.material.emission)[k])) > 0.0
        closed = np.linalg.norm(p[0] - p[-1]) < 1e-6
        if closed and not lamp:
            ax.fill(*p.T, facecolor=dark, edgecolor=rim, linewidth=width,
                    linestyle="-")  # fmt: skip
        else:
            ax.plot(*p.T, "-", color="#fff7e0" if lamp else rim,
                    linewidth=(3 if lamp else 2) * width,
                    solid_capstyle="round")  # fmt: skip
