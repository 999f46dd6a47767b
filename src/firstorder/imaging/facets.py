r"""Shading points of a mesh: they move on faces, and are shaded by vertices' normals.

On a face with corners A, B, C and unit normals at them, with b the barycentric coordinates,

    m(x) = sum_i b_i(x) n_i,    n = m / |m|,    dn = (I - n n^T) sum_i n_i db_i / |m|

db_i is constant on the face, so that this is the exact derivative of what is shaded: a mesh is a
surface without curvature of its own whose shading normal turns, as a bumpy one's does. `S` is the
shape operator that the shading normal shows, for criteria that ask for a curvature; across edges it
jumps.
"""

from __future__ import annotations

from typing import Any

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int

from firstorder._argument_checks import check_shape
from firstorder._display import Module
from firstorder.imaging._reflection import SurfacePoint
from firstorder.numerics._compiled import compiled
from firstorder.numerics._vectors import cross, dot, near_one, orthonormal_frame, unit
from firstorder.space.meshes.triangle_mesh import Mesh, vertex_normals


class Facets(Module):
    """Faces with a normal at each corner. Make them with `mesh_facets`.

    Attributes:
        corners: of each face [m].
        normals: unit normals at them.
        part: number of the primitive to which each face belongs.
        uv: of a picture, at the corners; None for none.

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.imaging import Facets
        >>> up = jnp.broadcast_to(jnp.array([0.0, 0.0, 1.0]), (1, 3, 3))
        >>> Facets(jnp.eye(3)[None], up, jnp.array([0])).corners.shape
        (1, 3, 3)
    """

    corners: Float[Array, "f 3 3"]
    normals: Float[Array, "f 3 3"]
    part: Int[Array, " f"]
    uv: Float[Array, "f 3 2"] | None = None

    def point(self, face: Int[Array, ""], x: Float[Array, "3"]) -> SurfacePoint:
        """The shading point at a place on a face, on the side of its front.

        Args:
            face: its number.
            x: on it [m].

        Example:
            >>> import jax.numpy as jnp
            >>> from firstorder.imaging import mesh_facets
            >>> from firstorder.space.meshes import mesh
            >>> one = mesh([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])
            >>> lean = jnp.array([[0.0, 0.0, 1.0], [0.6, 0.0, 0.8], [0.0, 0.0, 1.0]])
            >>> at = mesh_facets(one, lean).point(jnp.array(0), jnp.zeros(3))
            >>> at.normal.tolist(), at.base_normal.tolist()
            ([0.0, 0.0, 1.0], [0.0, 0.0, 1.0])
        """
        up, weights, slopes = self._weights(face, x)
        around = self.normals[face]
        m = weights @ around
        length = jnp.sqrt(dot(m, m))
        length = jnp.where(length > 0.0, length, 1.0)
        n = m / length
        tangents = orthonormal_frame(unit(up))[:, :2]
        moved = around.T @ (slopes @ tangents) / length
        return SurfacePoint(x, tangents, n, moved - n[:, None] * (n @ moved))

    def uv_at(self, face: Int[Array, ""], x: Float[Array, "3"]) -> Float[Array, "2"]:
        """The (u, v) of a place on a face, linear between its corners; zeros where none are known.

        Args:
            face: its number.
            x: on it [m].
        """
        if self.uv is None:
            return jnp.zeros(2, x.dtype)
        b, (first, second, third) = self._weights(face, x)[1], self.uv[face]
        # By differences: corners at one point of the picture leave no slope, nor one of rounding.
        return third + b[0] * (first - third) + b[1] * (second - third)

    def _weights(self, face, x):
        """Along the normal; barycentric coordinates; their gradients."""
        A, B, C = self.corners[face]
        area = cross(B - A, C - A)
        up = near_one(area)
        whole = dot(area, up)
        whole = jnp.where(whole > 0.0, whole, 1.0)
        edges = jnp.stack([C - B, A - C, B - A])
        slopes = cross(up, edges) / whole  # db_i
        b = jnp.stack([dot(cross(C - B, x - B), up), dot(cross(A - C, x - C), up)]) / whole
        return up, jnp.append(b, 1.0 - jnp.sum(b)), slopes


def mesh_facets(mesh: Mesh, normals: Any = None, part: Any = None, uv: Any = None) -> Facets:
    """The faces of a mesh, ready to be shaded.

    Args:
        mesh: any.
        normals: unit normals at the vertices; `vertex_normals`, if left out. A vertex without one
            takes each face's own, so that zeros give sharp edges, as bars and leaves have.
        part: number of the primitive to which each face belongs; 0, if left out.
        uv: of a picture, at the corners of each face, shape (f, 3, 2); zeros, if left out.

    Raises:
        ValueError: if there is not one normal for each vertex, or uv for each corner.

    Example:
        >>> from firstorder.imaging import mesh_facets
        >>> from firstorder.space.meshes import mesh
        >>> one = mesh([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])
        >>> mesh_facets(one).normals[0, 0].tolist()
        [0.0, 0.0, 1.0]
    """
    n = vertex_normals(mesh) if normals is None else jnp.asarray(normals)
    check_shape("normals", n, mesh.vertices.shape)
    corners, around = _corners(mesh, n)
    part = np.zeros(mesh.count, np.int32) if part is None else np.asarray(part, np.int32)
    uv = jnp.zeros((mesh.count, 3, 2), n.dtype) if uv is None else jnp.asarray(uv)
    check_shape("uv", uv, (mesh.count, 3, 2))
    return Facets(corners, around, jnp.asarray(part), uv)


@compiled
def _corners(mesh: Mesh, n: Float[Array, "v 3"]):
    """The corners of each face, and normals at them."""
    flat = unit(near_one(mesh.area_vectors))
    around = n[mesh.faces]
    none = jnp.sum(around**2, -1, keepdims=True) == 0.0
    return mesh.corners, jnp.where(none, flat[:, None], around)
