"""G-buffers: position, normal, distance and curvature of the surface that each pixel shows.

Of analytic shapes or of a mesh's faces, found in blocks of one compiled size.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Sequence
from typing import SupportsIndex

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int

from firstorder._display import Module
from firstorder._labelled import Dataset, Variable, data_set
from firstorder.imaging._interaction import (
    SurfaceInteraction,
    facet_interaction,
    surface_interaction,
)
from firstorder.imaging.camera import Pinhole
from firstorder.imaging.facets import Facets
from firstorder.imaging.images import pixel_grid, pixel_labels, pixel_positions
from firstorder.numerics._batching import host_blocks
from firstorder.numerics._vectors import dot
from firstorder.space.primitives import Material
from firstorder.space.scene import Scene

BLOCK = 1024  # pixels at a time
Numbers = Array | np.ndarray
SURFACE = ("tangent", "tangent_2")
UNITS = {"position": "m", "normal": "1", "to_eye": "1", "distance": "m", "cosine": "1", "S": "1/m"}


class GBuffer(Module):
    """Surface attributes of the first hit of each pixel.

    Attributes:
        position: of the surface [m].
        normal: unit, on the side of the eye.
        to_eye: unit.
        distance: from the eye [m].
        cosine: between normal and `to_eye`, positive.
        S: shape operator, first axis in the plane of view, second across it [1/m].

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.imaging import GBuffer
        >>> up, one = jnp.array([0.0, 0.0, 1.0]), jnp.ones(())
        >>> floor = GBuffer(0.0 * up, up, up, 3.0 * one, one, jnp.zeros((2, 2)))
        >>> floor.distance.item()
        3.0
    """

    position: Float[Numbers, "*n 3"]
    normal: Float[Numbers, "*n 3"]
    to_eye: Float[Numbers, "*n 3"]
    distance: Float[Numbers, "*n"]
    cosine: Float[Numbers, "*n"]
    S: Float[Numbers, "*n 2 2"]

    def to_xarray(self) -> Dataset:
        """A data set over px and py, or over `pixel` if there is no image; vectors have an `axis`.

        Raises:
            ModuleNotFoundError: without the extra `tables`.

        Example:
            >>> from firstorder.imaging import primary_hits
            >>> from firstorder.imaging import pinhole
            >>> from firstorder.space.library import sphere_over_plane
            >>> camera = pinhole((0.0, -4.0, 2.0), (0.0, 0.0, 0.5), gamma=0.5)
            >>> hits = primary_hits(sphere_over_plane(), camera, (2, 2)).to_xarray()
            >>> hits.index.sel(px=-0.5).values.tolist(), hits.distance.attrs["units"]
            ([1, -1], 'm')
        """
        whole = {f.name: getattr(self, f.name) for f in dataclasses.fields(self)}
        image = self.distance.ndim == 2
        pixels = ("px", "py") if image else ("pixel",) * self.distance.ndim
        coordinates: dict[str, Variable] = {"axis": (("axis",), ["x", "y", "z"], "")}
        p = whole.pop("p", None)
        if p is not None:
            coordinates |= _places(p, image)
        inner = {"position": ("axis",), "normal": ("axis",), "to_eye": ("axis",), "S": SURFACE}
        variables = {
            name: ((*pixels, *inner.get(name, ())), a, UNITS.get(name, ""))
            for name, a in whole.items()
        }
        return data_set(variables, coordinates)


def _places(p: Numbers, image: bool) -> dict[str, Variable]:
    """Image coordinates along the axes of an image, or of scattered pixels."""
    if image:
        rows = {"px": (("px",), p[:, 0, 0]), "py": (("py",), p[0, :, 1])}
    else:
        axes = ("pixel",) * (p.ndim - 1)
        rows = {"px": (axes, p[..., 0]), "py": (axes, p[..., 1])}
    return {name: (axes, a, "unit of the image") for name, (axes, a) in rows.items()}


class PrimaryHits(GBuffer):
    """First hits of the rays of a camera: a `GBuffer` that knows which shapes it shows.

    Attributes:
        p: image coordinates.
        index: number of the shape, -1 for none.
        label: of the face, as `pixel_labels` tells faces apart; -1 for none.
    """

    p: Float[Numbers, "*n 2"]
    index: Int[Numbers, "*n"]
    label: Int[Numbers, "*n"]


def primary_hits(
    scene: Scene,
    camera: Pinhole,
    size: SupportsIndex | Sequence[SupportsIndex] | None = None,
    *,
    p: Float[np.ndarray, "*n 2"] | None = None,
    half_width: float = 1.0,
) -> PrimaryHits:
    """First hits of all pixels of an image, or of some places, without derivatives.

    Where nothing is met, `index` is -1, and a plane at 1 m across the ray stands in for it: numbers
    that are finite, and not to be used.

    Args:
        scene: shapes.
        camera: the eye.
        size: columns and rows of the image, or one number for both; pixels are square and their
            centres are looked through.
        p: image coordinates to look through instead.
        half_width: image coordinate of the image's right edge; `gamma` is in its unit.

    Returns:
        Arrays of NumPy of shape (columns, rows, ...), or of the shape of `p`; first axis px.

    Raises:
        ValueError: if both `size` and `p` are given or neither is, one of them has another shape,
            or a number is not positive.

    Example:
        >>> from firstorder.imaging import pinhole
        >>> from firstorder.imaging import primary_hits
        >>> from firstorder.space.library import sphere_over_plane
        >>> camera = pinhole((0.0, -4.0, 2.0), (0.0, 0.0, 0.5), gamma=0.5)
        >>> hits = primary_hits(sphere_over_plane(), camera, (2, 2))
        >>> hits.index.tolist(), hits.position[:, 0, 2].round(9).tolist()  # the floor, then nothing
        ([[1, -1], [1, -1]], [0.0, 0.0])
    """
    if (size is None) == (p is None):
        raise ValueError("Argument `size` or `p` must be given, and only one of them.")
    if size is not None:
        columns, rows = _columns_and_rows(size)
        p = pixel_positions(*pixel_grid(columns, rows, half_width)).reshape(columns, rows, 2)
    p = np.asarray(p, float)
    if p.shape[-1:] != (2,):
        raise ValueError(f"Argument `p` must have two coordinates, but has shape {p.shape}.")
    q = p.reshape(-1, 2)
    index, label = host_blocks(lambda q: pixel_labels(scene, camera, q), q, BLOCK)
    at = gbuffer(scene, camera, q, index)
    known = [getattr(at, f.name) for f in dataclasses.fields(GBuffer)]
    whole = (a.reshape(*p.shape[:-1], *a.shape[1:]) for a in (*known, q, index, label))
    return PrimaryHits(*whole)


def _columns_and_rows(size: SupportsIndex | Sequence[SupportsIndex]) -> list[int]:
    """Columns and rows of an image, from both or from one number for both."""
    found = np.asarray(size)
    if found.dtype.kind not in "iu" or found.shape not in ((), (2,)):
        raise ValueError(f"Argument `size` must be one integer or two, but is {size!r}.")
    return np.broadcast_to(found, 2).tolist()


def gbuffer(
    scene: Scene, camera: Pinhole, p: Float[np.ndarray, "n 2"], index: Int[np.ndarray, " n"]
) -> GBuffer:
    """G-buffer of analytic shapes; a plane at 1 m across the ray where nothing is hit.

    Args:
        scene: shapes.
        camera: the eye.
        p: image coordinates.
        index: of the shape at each, -1 for none.

    Returns:
        Arrays of NumPy.

    Example:
        >>> import numpy as np
        >>> from firstorder.imaging import gbuffer
        >>> from firstorder.imaging import pinhole
        >>> from firstorder.space.library import sphere_over_plane
        >>> camera = pinhole((0.0, 0.0, 4.0), (0.0, 0.0, 0.0), up=(0.0, 1.0, 0.0))
        >>> at = gbuffer(sphere_over_plane(), camera, np.zeros((1, 2)), np.array([0]))
        >>> at.distance.tolist(), at.S[0].tolist()  # a ball of 0.5 m
        ([2.5], [[-2.0, -0.0], [-0.0, -2.0]])
    """
    return _in_blocks(lambda a, i: _of_shapes(scene, camera, a, i), p, index)


def facet_gbuffer(
    known: Facets, camera: Pinhole, p: Float[np.ndarray, "n 2"], face: Int[np.ndarray, " n"]
) -> GBuffer:
    """G-buffer of a mesh, with its shading normals and their rate of change.

    Where a shading normal leans away from the eye, the face's own stands in for it. `S` is that of
    `imaging.mesh_facets`, which jumps from face to face.

    Args:
        known: the faces.
        camera: the eye.
        p: image coordinates.
        face: that each pixel shows, -1 for none (`io.Embree.nearest`).

    Returns:
        Arrays of NumPy, as `gbuffer` gives them.

    Reference: D05 §6.2 on "the faceted look" of Phong normals in its Fig. 16.

    Example:
        >>> import numpy as np
        >>> from firstorder.imaging import facet_gbuffer
        >>> from firstorder.imaging import mesh_facets
        >>> from firstorder.imaging import pinhole
        >>> from firstorder.space.meshes import mesh
        >>> camera = pinhole((0.2, 0.2, 4.0), (0.2, 0.2, 0.0), up=(0.0, 1.0, 0.0))
        >>> one = mesh_facets(mesh([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]]))
        >>> at = facet_gbuffer(one, camera, np.zeros((1, 2)), np.array([0]))
        >>> at.distance.tolist(), at.normal.tolist()
        ([4.0], [[0.0, 0.0, 1.0]])
    """
    return _in_blocks(lambda a, i: _of_facets(known, camera, a, i), p, face)


def _in_blocks(
    kind: Callable[[Array, Array], GBuffer], p: np.ndarray, index: np.ndarray
) -> GBuffer:
    return host_blocks(lambda rows: kind(*rows), (np.asarray(p, float), np.asarray(index)), BLOCK)


@eqx.filter_jit
def _of_shapes(scene: Scene, camera: Pinhole, p: Array, index: Array) -> GBuffer:
    def one(p, index):
        at = surface_interaction(scene, camera, p, jnp.maximum(index, 0))
        return _known(at, at.point.base_normal, camera, p, index >= 0)

    return jax.vmap(one)(p, index)


@eqx.filter_jit
def _of_facets(known: Facets, camera: Pinhole, p: Array, face: Array) -> GBuffer:
    black = Material(jnp.zeros((1, 2)), jnp.zeros((1, 2)), jnp.zeros(1), jnp.ones(1))
    known = Facets(known.corners, known.normals, jnp.zeros_like(known.part))

    def one(p, face):
        at = facet_interaction(known, black, camera, p, jnp.maximum(face, 0))
        leans = dot(at.point.normal, at.view.to_eye) <= 0.0
        n = jnp.where(leans, at.point.base_normal, at.point.normal)
        return _known(at, n, camera, p, face >= 0)

    return jax.vmap(one)(p, face)


def _known(at: SurfaceInteraction, n: Array, camera: Pinhole, p: Array, met: Array) -> GBuffer:
    """A pixel with its normal; a plane across the ray, if nothing is met or met from behind."""
    way = at.view.to_eye
    c = dot(n, way)
    across = at.point.tangents.T @ way  # of length sqrt(1 - c^2); any axis will do at 0
    size = jnp.sqrt(jnp.sum(across * across))
    a = jnp.where(size > 1e-6, across / jnp.where(size > 1e-6, size, 1.0), jnp.eye(2)[0])
    R = jnp.stack([a, jnp.stack([-a[1], a[0]])], 1)
    found = GBuffer(at.point.position, n, way, at.view.distance, c, R.T @ at.S @ R)
    d = camera.direction(p)
    nothing = GBuffer(camera.eye + d, -d, -d, *jnp.ones(2), jnp.zeros((2, 2)))
    return jax.tree.map(lambda a, b: jnp.where(met & (c > 0.0), a, b), found, nothing)
