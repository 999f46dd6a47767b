"""Images of which few pixels are shaded; gradients fill in the others, not across edges.

R07 §8 interpolates soft shadows on a plane that is seen head-on. Here the same is done in the image
of any scene: primary rays are cheap and tell where the edges are, shading is expensive. In cells
that an edge cuts, corners of one side alone are left, and gradients gain little there; along the
contour of a curved shape the image's own gradient has no bound.
"""

from __future__ import annotations

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array

from firstorder.imaging.camera import Pinhole
from firstorder.imaging.images import (
    RenderedImage,
    pixel_grid,
    pixel_labels,
    pixel_positions,
    render_pixels,
)
from firstorder.reconstruction.grid import GridInterpolant
from firstorder.space.scene import Scene


def interpolate_image(
    scene: Scene,
    camera: Pinhole,
    columns: int,
    rows: int,
    step: int,
    *,
    scheme: str = "hermite",
    half_width: float = 1.0,
    rays: int = 256,
) -> RenderedImage:
    """Image whose every `step`-th pixel is shaded; gradients fill in the others, not across edges.

    Every pixel has its primary ray; it is shaded only where it is a node of the grid, outside of
    the nodes, or where no corner of its cell shows the same face.

    Args:
        scene: what is seen.
        camera: the eye.
        columns: pixels across.
        rows: pixels upwards.
        step: pixels from node to node.
        scheme: one of `firstorder.reconstruction.grid.SCHEMES`.
        half_width: as in `render`.
        rays: as in `render`.

    Raises:
        ValueError: if fewer than two nodes fit.

    Reference: R07 §8.
    """
    px, py = pixel_grid(columns, rows, half_width)
    p = pixel_positions(px, py)
    index, label = (np.asarray(a) for a in pixel_labels(scene, camera, jnp.asarray(p)))
    number = np.arange(columns * rows).reshape(columns, rows)
    nodes = number[::step, ::step]
    known = nodes.ravel()
    value, gradient = np.full(len(p), np.nan), np.zeros((len(p), 2))
    value[known], gradient[known] = render_pixels(scene, camera, p[known], index[known], rays)
    data = np.concatenate([value[known, None], gradient[known]], -1).reshape(*nodes.shape, 3)
    patches = GridInterpolant(px[::step], py[::step], data, scheme, jnp.asarray(label[nodes]))
    found = _interpolate(patches, jnp.asarray(p), jnp.asarray(label))
    rest = np.ones(len(p), bool)
    rest[known] = False
    value[rest], gradient[rest] = (np.asarray(a)[rest] for a in found)
    left = np.flatnonzero(np.isnan(value))
    if left.size:
        value[left], gradient[left] = render_pixels(scene, camera, p[left], index[left], rays)
    shaded = np.zeros(len(p), bool)
    shaded[known], shaded[left] = True, True
    shape = (columns, rows)
    return RenderedImage(px, py, value.reshape(shape), gradient.reshape(*shape, 2),
                 label.reshape(shape), shaded.reshape(shape))  # fmt: skip


@eqx.filter_jit
def _interpolate(patches: GridInterpolant, p: Array, label: Array) -> tuple[Array, Array]:
    def at(p, label):
        return patches(p[0], p[1], label)

    return jax.vmap(jax.value_and_grad(at))(p, label)
