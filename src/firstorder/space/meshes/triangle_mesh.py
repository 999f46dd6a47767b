"""Triangle meshes: their adjacency, and a normal for every vertex.

A mesh is a pytree. Its vertices are differentiable leaves; faces and edges are numbers found once,
on the host, by `mesh`. Seen from its front, a face's corners follow each other counter-clockwise.
"""

from __future__ import annotations

import math
from typing import Any

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int

from firstorder._argument_checks import check_finite, check_shape, is_concrete
from firstorder._display import Module
from firstorder.numerics._compiled import compiled
from firstorder.numerics._scale import power_of_two
from firstorder.numerics._vectors import cross, dot, near_one, norm, unit
from firstorder.typing import as_float

NO_FACE = -1


class Mesh(Module):
    """Triangles that share vertices. Make one with `mesh`.

    Attributes:
        vertices: [m].
        faces: three vertices each, counter-clockwise as seen from the front.
        edges: two vertices each; every edge is here once, from the view of `sides[:, 0]`.
        sides: the face in which the edge runs forward, and the one in which it runs backward, or
            -1 at a boundary.

    Example:
        >>> from firstorder.space.meshes import mesh
        >>> square = mesh([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 1, 2], [0, 2, 3]])
        >>> square.count, len(square.edges), square.closed, square.area.item()
        (2, 5, False, 1.0)
    """

    vertices: Float[Array, "v 3"]
    faces: Int[Any, "f 3"]
    edges: Int[Any, "e 2"]
    sides: Int[Any, "e 2"]

    @property
    def count(self) -> int:
        """Number of faces."""
        return self.faces.shape[0]

    @property
    def closed(self) -> bool:
        """Whether no edge is a boundary."""
        return bool(np.all(np.asarray(self.sides) != NO_FACE))

    @property
    def corners(self) -> Float[Array, "f 3 3"]:
        """The corners of each face [m]."""
        return self.vertices[self.faces]

    @property
    def area_vectors(self) -> Float[Array, "f 3"]:
        """Vectors along each face's normal, twice its area long [m^2]."""
        a, b, c = (self.corners[:, k] for k in range(3))
        return cross(b - a, c - a)

    @property
    def area(self) -> Float[Array, ""]:
        """Area of all faces together [m^2]."""
        size = power_of_two(self.area_vectors)
        return 0.5 * jnp.sum(size * norm(self.area_vectors / size[:, None]))

    @property
    def size(self) -> float:
        """The diagonal of the smallest box along the axes that holds the mesh [m]."""
        v = np.asarray(self.vertices, float)
        return math.hypot(*(v.max(0) - v.min(0)))

    def at(self, vertices: Any) -> Mesh:
        """Mesh of the same faces with other vertices, as differentiation wants it.

        Args:
            vertices: as many as there are [m].

        Raises:
            ValueError: if there are not as many.
        """
        vertices = as_float(vertices)
        check_shape("vertices", vertices, self.vertices.shape)
        return eqx.tree_at(lambda m: m.vertices, self, vertices)


def mesh(vertices: Any, faces: Any) -> Mesh:
    """A mesh from its vertices and faces; its edges are found here, on the host.

    An edge at which two faces disagree about which side is the front, and an edge of more than two
    faces, count as boundaries of some of them. Every other edge has two faces or is a boundary.

    Vertices in one place are joined where faces would end there, so that triangles that share no
    vertices are one surface. Edges then name the first of them, to which derivatives of silhouettes
    go. A face with two vertices in one place, as at the poles of a sphere, has no edges: the faces
    beside it share one. Traced vertices are not looked at.

    Args:
        vertices: shape (v, 3) [m].
        faces: shape (f, 3), numbers of vertices from 0; counter-clockwise as seen from the front.
            Faces that name a vertex twice are left out.

    Raises:
        ValueError: if a face names a vertex that is not there, or nothing is left.

    Example:
        >>> from firstorder.space.meshes import mesh
        >>> square = mesh([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 1, 2], [0, 2, 3]])
        >>> square.count, square.area.item()
        (2, 1.0)
    """
    v = as_float(vertices)
    try:
        f = np.asarray(faces)
    except ValueError:
        raise ValueError(
            "Argument `faces` must be rows of three, but some are longer than others: cut polygons "
            "into triangles."
        ) from None
    if v.ndim != 2 or v.shape[1] != 3 or not v.shape[0]:
        raise ValueError(f"Argument `vertices` must have shape (v, 3), but has {tuple(v.shape)}.")
    check_finite("vertices", v)
    if f.ndim != 2 or f.shape[1] != 3 or not np.issubdtype(f.dtype, np.integer):
        raise ValueError(
            f"Argument `faces` must be whole numbers of shape (f, 3), but is {f.dtype} {f.shape}."
        )
    wrong = f[(f < 0) | (f >= v.shape[0])]
    if wrong.size:
        raise ValueError(
            f"Argument `faces` must number vertices from 0 to {v.shape[0] - 1}, but has {wrong[0]}."
        )
    f = f[_three(f)]
    edges, sides = _edges(f)
    if is_concrete(v):
        rim = edges[np.any(sides == NO_FACE, axis=1)]
        joined = _joined(np.asarray(v), f, rim)
        if np.any(joined != f):
            three = _three(joined)
            edges, sides = _edges(joined[three])
            sides = np.where(sides == NO_FACE, NO_FACE, np.flatnonzero(three)[sides])
    return Mesh(v, f.astype(np.int32), edges, sides.astype(np.int32))


def _three(faces: np.ndarray) -> np.ndarray:
    """Which faces have three corners.

    Raises:
        ValueError: if none has.
    """
    three = np.all(faces != np.roll(faces, 1, axis=1), axis=1)
    if not np.any(three):
        raise ValueError("Argument `faces` must hold a triangle, but holds none.")
    return three


def _joined(vertices: np.ndarray, faces: np.ndarray, rim: np.ndarray) -> np.ndarray:
    """Faces with vertices in one place as one, on the rim and of faces that have two such."""
    corners = vertices[faces]
    pinched = np.any(np.all(corners == np.roll(corners, 1, axis=1), axis=-1), axis=1)
    some = np.zeros(len(vertices), bool)
    some[rim] = some[faces[pinched]] = True
    return _by_place(vertices, np.flatnonzero(some))[faces]


def _by_place(vertices: np.ndarray, some: np.ndarray) -> np.ndarray:
    """Numbers of all vertices; of some, that of the first among them in the same place."""
    places = vertices[some] + 0.0  # -0 and 0 are one place
    _, first, which = np.unique(places, axis=0, return_index=True, return_inverse=True)
    number = np.arange(len(vertices))
    number[some] = some[first[which.ravel()]]
    return number


def _edges(faces: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Edges, each once, with the faces on either side."""
    half = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]).astype(np.int64)
    owner = np.tile(np.arange(len(faces), dtype=np.int32), 3)
    low, high = half.min(1), half.max(1)
    ahead = half[:, 0] == low
    # One number for a pair of vertices and the way it is run, so that one sort does: backward
    # runs along each pair come first, then forward ones. Equal ranks among them are one edge.
    key = 2 * (low * (int(faces.max()) + 1) + high) + ahead
    order = np.argsort(key, kind="stable")
    run = key[order]
    rank = _since(np.r_[True, run[1:] != run[:-1]])
    new = np.r_[True, run[1:] // 2 != run[:-1] // 2]
    pair = np.cumsum(new) - 1
    most = np.maximum.reduceat(rank, np.flatnonzero(new)) + 1
    first = np.cumsum(most) - most
    which = first[pair] + rank
    sides = np.full((int(most.sum()), 2), NO_FACE, np.int32)
    sides[which, np.where(ahead[order], 0, 1)] = owner[order]
    edges = np.empty((len(sides), 2), np.int32)
    edges[which] = np.stack([low[order], high[order]], -1)
    # What has no face in which it runs forward is turned about.
    turned = sides[:, 0] == NO_FACE
    edges[turned], sides[turned] = edges[turned, ::-1], sides[turned, ::-1]
    return edges, sides


def _since(fresh: np.ndarray) -> np.ndarray:
    """Number of places since it was last fresh; it is at first."""
    place = np.arange(len(fresh))
    return place - np.maximum.accumulate(np.where(fresh, place, 0))


@compiled
def vertex_normals(mesh: Mesh) -> Float[Array, "v 3"]:
    """A unit normal for each vertex, from the faces around it.

    Each corner counts with `(a x b) / (|a|^2 |b|^2)`, a and b the edges that leave it: exact if all
    neighbours lie on one sphere with the vertex, whatever the triangles. On other surfaces the
    error falls with the square of the edges' length where neighbours lie point-symmetrically, and
    with the first power where they do not.

    Reference: N. Max, "Weights for computing vertex normals from facet normals", JGT 4(2), 1999.

    Example:
        >>> from firstorder.space.meshes import mesh, vertex_normals
        >>> square = mesh([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 1, 2], [0, 2, 3]])
        >>> vertex_normals(square)[2].tolist()
        [0.0, 0.0, 1.0]
    """
    edges = jnp.roll(mesh.corners, -1, 1) - mesh.corners
    size = power_of_two(edges)
    # In units of the least edge around each vertex: squares of lengths would leave the range.
    least = jnp.full_like(mesh.vertices[:, 0], jnp.inf)
    least = least.at[mesh.faces].min(size).at[jnp.roll(mesh.faces, -1, 1)].min(size)
    before, sizes = -jnp.roll(edges, 1, 1), (size, jnp.roll(size, 1, 1))
    a, b = (edge / s[..., None] for edge, s in zip((edges, before), sizes, strict=True))
    weight = dot(a, a) * dot(b, b)
    share = (least[mesh.faces] / sizes[0]) * (least[mesh.faces] / sizes[1])
    each = cross(a, b) * (share / jnp.where(weight > 0.0, weight, jnp.inf))[..., None]
    total = jnp.zeros_like(mesh.vertices).at[mesh.faces].add(each)
    return unit(near_one(total))
