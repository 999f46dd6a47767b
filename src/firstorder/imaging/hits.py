"""What pixels show, as far as D05's criteria ask: where it is, how it leans, how it curves.

Of analytic shapes or of a mesh's faces, found in blocks of one compiled size.
"""

from __future__ import annotations

from collections.abc import Callable

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int

from firstorder.imaging.camera import Pinhole
from firstorder.imaging.facets import Facets, look_at_facet
from firstorder.imaging.pixels import Looked, look
from firstorder.numerics.vectors import dot
from firstorder.space.scene import Material, Scene

BLOCK = 1024  # pixels at a time


class Seen(eqx.Module):
    """What pixels show, as far as a criterion asks.

    Attributes:
        position: of the surface [m].
        normal: unit, on the side of the eye.
        to_eye: unit.
        distance: from the eye [m].
        cosine: between normal and `to_eye`, positive.
        S: shape operator, first axis in the plane of view, second across it [1/m].
    """

    position: Float[Array, "*n 3"]
    normal: Float[Array, "*n 3"]
    to_eye: Float[Array, "*n 3"]
    distance: Float[Array, "*n"]
    cosine: Float[Array, "*n"]
    S: Float[Array, "*n 2 2"]


def seen(
    scene: Scene, camera: Pinhole, p: Float[np.ndarray, "n 2"], index: Int[np.ndarray, " n"]
) -> Seen:
    """What each pixel shows; where nothing is met, a plane at 1 m across the ray.

    Args:
        scene: shapes.
        camera: the eye.
        p: image coordinates.
        index: of the shape at each, -1 for none.

    Returns:
        Arrays of NumPy.

    Example:
        >>> import numpy as np
        >>> from firstorder.imaging.hits import seen
        >>> from firstorder.imaging.camera import pinhole
        >>> from firstorder.space.library import sphere_over_plane
        >>> camera = pinhole((0.0, 0.0, 4.0), (0.0, 0.0, 0.0), up=(0.0, 1.0, 0.0))
        >>> at = seen(sphere_over_plane(), camera, np.zeros((1, 2)), np.array([0]))
        >>> at.distance.tolist(), at.S[0].tolist()  # a ball of 0.5 m
        ([2.5], [[-2.0, -0.0], [-0.0, -2.0]])
    """
    return _in_blocks(lambda a, i: _of_shapes(scene, camera, a, i), p, index)


def seen_facets(
    known: Facets, camera: Pinhole, p: Float[np.ndarray, "n 2"], face: Int[np.ndarray, " n"]
) -> Seen:
    """What each pixel shows of a mesh, with the normals that shade it and how they turn.

    Where a shading normal leans away from the eye, the face's own stands in for it. `S` is that of
    `imaging.facets`, which jumps from face to face.

    Args:
        known: the faces.
        camera: the eye.
        p: image coordinates.
        face: that each pixel shows, -1 for none (`io.Embree.nearest`).

    Returns:
        Arrays of NumPy, as `seen` gives them.

    Reference: D05 §6.2 on "the faceted look" of Phong normals in its Fig. 16.

    Example:
        >>> import numpy as np
        >>> from firstorder.imaging.hits import seen_facets
        >>> from firstorder.imaging.facets import facets
        >>> from firstorder.imaging.camera import pinhole
        >>> from firstorder.space.meshes.mesh import mesh
        >>> camera = pinhole((0.2, 0.2, 4.0), (0.2, 0.2, 0.0), up=(0.0, 1.0, 0.0))
        >>> one = facets(mesh([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]]))
        >>> at = seen_facets(one, camera, np.zeros((1, 2)), np.array([0]))
        >>> at.distance.tolist(), at.normal.tolist()
        ([4.0], [[0.0, 0.0, 1.0]])
    """
    return _in_blocks(lambda a, i: _of_facets(known, camera, a, i), p, face)


def _in_blocks(kind: Callable[[Array, Array], Seen], p: np.ndarray, index: np.ndarray) -> Seen:
    count, index = len(p), np.asarray(index)
    fill = -count % BLOCK
    p = np.concatenate([p, np.zeros((fill, 2))]).reshape(-1, BLOCK, 2)
    index = np.concatenate([index, np.full(fill, -1)]).reshape(-1, BLOCK)
    parts = [
        jax.tree.map(np.asarray, kind(jnp.asarray(a), jnp.asarray(i)))
        for a, i in zip(p, index, strict=True)
    ]
    return jax.tree.map(lambda *a: np.concatenate(a)[:count], *parts)


@eqx.filter_jit
def _of_shapes(scene: Scene, camera: Pinhole, p: Array, index: Array) -> Seen:
    def one(p, index):
        at = look(scene, camera, p, jnp.maximum(index, 0))
        return _known(at, at.point.base_normal, camera, p, index >= 0)

    return jax.vmap(one)(p, index)


@eqx.filter_jit
def _of_facets(known: Facets, camera: Pinhole, p: Array, face: Array) -> Seen:
    black = Material(jnp.zeros((1, 2)), jnp.zeros((1, 2)), jnp.zeros(1), jnp.ones(1))
    known = Facets(known.corners, known.normals, jnp.zeros_like(known.part))

    def one(p, face):
        at = look_at_facet(known, black, camera, p, jnp.maximum(face, 0))
        leans = dot(at.point.normal, at.view.to_eye) <= 0.0
        n = jnp.where(leans, at.point.base_normal, at.point.normal)
        return _known(at, n, camera, p, face >= 0)

    return jax.vmap(one)(p, face)


def _known(at: Looked, n: Array, camera: Pinhole, p: Array, met: Array) -> Seen:
    """A pixel with its normal; a plane across the ray, if nothing is met or met from behind."""
    way = at.view.to_eye
    c = dot(n, way)
    across = at.point.tangents.T @ way  # of length sqrt(1 - c^2); any axis will do at 0
    size = jnp.sqrt(jnp.sum(across * across))
    a = jnp.where(size > 1e-6, across / jnp.where(size > 1e-6, size, 1.0), jnp.eye(2)[0])
    R = jnp.stack([a, jnp.stack([-a[1], a[0]])], 1)
    found = Seen(at.point.position, n, way, at.view.distance, c, R.T @ at.S @ R)
    d = camera.direction(p)
    nothing = Seen(camera.eye + d, -d, -d, *jnp.ones(2), jnp.zeros((2, 2)))
    return jax.tree.map(lambda a, b: jnp.where(met & (c > 0.0), a, b), found, nothing)


__all__ = ["Seen", "seen", "seen_facets"]
