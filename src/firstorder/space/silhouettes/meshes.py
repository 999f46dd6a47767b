"""Silhouettes of meshes: edges between front and back faces, and the visible parts of them.

Seen from a point, the boundary of what a mesh covers is made of edges between a face seen from the
front and one seen from behind, and of the mesh's own boundary edges. `mesh_silhouette` gives them
all. `visible_mesh_silhouettes` cuts them where they cross each other in direction and keeps, of
each piece, whether anything is before it and what is behind it: numbers, found once on the host in
double precision. The pieces' points then follow from the vertices in closed form, differentiable in
the vertices and in the eye, to any order.

A tracer finds the face that a ray meets. `BruteForceTracer` tests all faces in double precision.
The one of `firstorder.io.meshes` lets Embree propose faces in single precision and tests them in
double; nothing here takes a distance from single precision.
"""

from __future__ import annotations

from typing import Any

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Bool, Float, Int

from firstorder._argument_checks import is_concrete
from firstorder._display import Module
from firstorder.numerics._vectors import cross, dot, near_one
from firstorder.scene._arguments import numbers
from firstorder.space.meshes.triangle_mesh import NO_FACE, Mesh
from firstorder.space.receiver import Receiver, in_receiver_frame
from firstorder.space.silhouettes._curves import SilhouetteSegments
from firstorder.space.silhouettes.face_tracers import (
    BruteForceTracer,
    FaceTracer,
    _touched_face,
)
from firstorder.visibility._contour import segment_solid_angle, segment_translation_rate

NOT_CUT = -1
# Distances along a ray to a piece's middle, in units of that distance, below which two are one.
_CLOSE = 1e-9
# How far a tracer in single precision may step on behind a face that does not count, in units of
# the mesh's size, with a reserve.
_STEP = 1e-5
# What points are rounded by in double precision, in units of their coordinates, with a reserve.
_ROUNDED = 1e-13


def mesh_silhouette(mesh: Mesh, eye: ArrayLike) -> SilhouetteSegments:
    """All silhouette edges of a mesh, hidden ones too; may be traced.

    Args:
        mesh: any.
        eye: where it is seen from, shape (3,) [m].

    Returns:
        As many segments as the mesh has edges; `live` says which are silhouettes from here, and
        `owner` is the face that they end. They run so that `(p - eye) x dp` points to that face.

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.space.meshes import mesh
        >>> one = mesh([[0, 0, 1], [1, 0, 1], [0, 1, 1]], [[0, 1, 2]])
        >>> int(mesh_silhouette(one, jnp.array([0.2, 0.2, 0.0])).live.sum())
        3
    """
    v = mesh.vertices
    corner = v[mesh.faces[:, 0]]
    # Cubes of lengths would leave the range of single precision.
    front = dot(near_one(numbers("eye", eye) - corner), near_one(mesh.area_vectors)) > 0.0
    live, owner, forward = _turned(jnp, front, mesh.sides)
    first, second = v[mesh.edges[:, 0]], v[mesh.edges[:, 1]]
    start = jnp.where(forward[:, None], first, second)
    end = jnp.where(forward[:, None], second, first)
    return SilhouetteSegments(start, end, owner, live)


def _turned(np: Any, front, sides):
    """Silhouette edges, their faces, and whether they run as `mesh.edges` has them.

    A front face to the left of an edge, as seen from the front, lies to the right of it for
    `(p - eye) x dp`, which counts from behind: such an edge is turned about.
    """
    left, right = sides[:, 0], sides[:, 1]
    rim = right == NO_FACE
    left_front, right_front = front[left], front[right]
    live = rim | (left_front != right_front)
    ours = rim | left_front
    return live, np.where(ours, left, right), np.where(rim, ~left_front, ~ours)


class MeshSilhouettes(Module):
    """Pieces of visible mesh silhouettes, as numbers: constant until a visual event.

    Attributes:
        ends: the vertices between which the piece's edge runs.
        cut_first, cut_last: vertices of the edge in front of, or behind, which it starts or ends;
            -1 where it starts or ends at its own vertex.
        face: that it ends.
        visible: whether nothing is before it.
        behind: the face seen beyond it, or -1.
    """

    ends: Int[Any, "m 2"]
    cut_first: Int[Any, "m 2"]
    cut_last: Int[Any, "m 2"]
    face: Int[Any, " m"]
    visible: Bool[Any, " m"]
    behind: Int[Any, " m"]

    @property
    def outer(self) -> Bool[Array, " m"]:
        """Mask of the pieces that bound all that the mesh covers: seen, and with nothing behind."""
        return jnp.asarray(self.visible) & (jnp.asarray(self.behind) == NO_FACE)

    def straight(self, mesh: Mesh, eye: Float[Array, "3"]) -> SilhouetteSegments:
        """The pieces as segments, live where visible; differentiable in vertices and eye."""
        a, b = mesh.vertices[self.ends[:, 0]], mesh.vertices[self.ends[:, 1]]
        start = _where_cut(mesh.vertices, a, b, self.cut_first, eye, a)
        end = _where_cut(mesh.vertices, a, b, self.cut_last, eye, b)
        return SilhouetteSegments(start, end, jnp.asarray(self.face), jnp.asarray(self.visible))


def _where_cut(vertices: Array, a: Array, b: Array, by: Any, eye: Array, instead: Array) -> Array:
    """The point of each edge a-b in the plane through the eye and the edge that cuts it."""
    cut = by[:, 0] != NOT_CUT
    normal = cross(vertices[by[:, 0]] - eye, vertices[by[:, 1]] - eye)
    high, low = dot(b - eye, normal), dot(a - eye, normal)
    apart = jnp.where(cut & (low != high), low - high, 1.0)
    s = low / apart
    return jnp.where(cut[:, None], a + s[:, None] * (b - a), instead)


def visible_mesh_silhouettes(
    mesh: Mesh, eye: Any, tracer: FaceTracer | None = None
) -> MeshSilhouettes:
    """Silhouettes of a mesh, cut where they cross in direction, with the faces before and behind.

    On the host, in double precision, from numbers: under differentiation call it outside, and the
    `MeshSilhouettes`'s methods inside.

    Valid when: the eye is in general position (no vertex exactly in line with another edge) and
    the mesh does not pass through itself. Where it does, what is `visible_mesh_silhouettes` is
    decided by each piece's middle; `outer` stays right, for nothing that enters the mesh is on its
    outer boundary.

    Args:
        mesh: any.
        eye: where it is seen from, shape (3,) [m].
        tracer: that finds the first face along a ray; all faces are tested, if left out.

    Raises:
        ValueError: if the eye is not concrete.

    Example:
        >>> from firstorder.space.meshes import mesh
        >>> from firstorder.space.silhouettes import visible_mesh_silhouettes
        >>> one = mesh([[0, 0, 1], [1, 0, 1], [0, 1, 1]], [[0, 1, 2]])
        >>> visible_mesh_silhouettes(one, (0.2, 0.3, 0.0)).visible.tolist()  # its three sides
        [True, True, True]
    """
    if not is_concrete((mesh.vertices, eye)):
        raise ValueError("Arguments `mesh` and `eye` must be concrete, but are traced.")
    v, faces = np.asarray(mesh.vertices, float), np.asarray(mesh.faces)
    eye = np.asarray(eye, float)
    p = v[faces]
    front = np.sum((eye - p[:, 0]) * np.cross(p[:, 1] - p[:, 0], p[:, 2] - p[:, 0]), -1) > 0.0
    live, owner, forward = _turned(np, front, np.asarray(mesh.sides))
    ends = np.where(forward[:, None], np.asarray(mesh.edges), np.asarray(mesh.edges)[:, ::-1])
    number = np.flatnonzero(live)
    ends, owner, sides = ends[number], owner[number], np.asarray(mesh.sides)[number]
    edge, first, last, s = _pieces(v - eye, ends)
    a, b = v[ends[edge, 0]], v[ends[edge, 1]]
    middle = a + np.mean(s, -1)[:, None] * (b - a)
    tracer = BruteForceTracer(mesh) if tracer is None else tracer
    ways, skip = middle - eye, sides[edge]
    before = tracer.first_face(eye, ways, 0.0, 1.0 - _CLOSE, skip)
    seen = before == NO_FACE
    behind = np.full(len(edge), NO_FACE)
    behind[seen] = tracer.first_face(eye, ways[seen], 1.0 + _CLOSE, np.inf, skip[seen])
    # What the edge stands on begins there: no ray through the edge itself tells whether it is met.
    near = 2.0 * _CLOSE * np.linalg.norm(ways[seen], axis=1) + _STEP * mesh.size
    aside = _outwards(ways, (s[:, 1] - s[:, 0])[:, None] * (b - a), eye)
    touched = _touched_face(p, eye, ways[seen], aside[seen], near, skip[seen])
    behind[seen] = np.where(touched != NO_FACE, touched, behind[seen])
    return MeshSilhouettes(ends[edge], first, last, owner[edge], seen, behind.astype(np.int32))


def _outwards(ways: np.ndarray, along: np.ndarray, eye: np.ndarray) -> np.ndarray:
    """Just off the middles of pieces, away from the faces that they end.

    A small part of a piece and of its distance, and yet far above what its vertices are rounded by.
    """
    distance, length = np.linalg.norm(ways, axis=1), np.linalg.norm(along, axis=1)
    rounded = np.linalg.norm(ways + eye, axis=1) + np.linalg.norm(eye)
    epsilon = _CLOSE * np.minimum(distance, length) + _ROUNDED * rounded
    out = np.cross(along, ways)
    wide = np.linalg.norm(out, axis=1)
    return (epsilon / np.where(wide > 0.0, wide, 1.0))[:, None] * out


def _pieces(v: np.ndarray, ends: np.ndarray, block: int = 1024):
    """Edges cut where they cross in direction, seen from the origin.

    Returns:
        The number of each piece's edge, the vertices of those that cut it at its start and its end,
        and the two parameters along the edge, shape (pieces, 2).
    """
    m = len(ends)
    a, b = v[ends[:, 0]], v[ends[:, 1]]
    normal = np.cross(a, b)
    middle = a / np.linalg.norm(a, axis=1)[:, None] + b / np.linalg.norm(b, axis=1)[:, None]
    cuts, by, where = [], [], []
    for first in range(0, m, block):
        part = slice(first, first + block)
        low, high = a[part] @ normal.T, b[part] @ normal.T
        # Transposed: where the others' ends lie, relative to the planes of these.
        other_low, other_high = normal[part] @ a.T, normal[part] @ b.T
        crossing = (low * high < 0.0) & (other_low * other_high < 0.0)
        for k in (0, 1):
            for n in (0, 1):
                crossing &= ends[part, k][:, None] != ends[None, :, n]
        i, j = np.nonzero(crossing)
        s = low[i, j] / (low[i, j] - high[i, j])
        q = a[part][i] + s[:, None] * (b - a)[part][i]
        same = np.sum(q * middle[j], -1) > 0.0  # and not on the far side of the sphere
        cuts.append(i[same] + first)
        by.append(j[same])
        where.append(s[same])
    cuts, by, where = (np.concatenate([np.zeros(0, d), *x]) for d, x in
                       ((int, cuts), (int, by), (float, where)))  # fmt: skip
    # Each edge's own ends count as cuts by nobody.
    edge = np.concatenate([np.arange(m), cuts, np.arange(m)])
    s = np.concatenate([np.zeros(m), where, np.ones(m)])
    nobody = np.full((m, 2), NOT_CUT)
    cutter = np.concatenate([nobody, ends[by], nobody])
    order = np.lexsort((s, edge))
    edge, s, cutter = edge[order], s[order], cutter[order]
    inside = edge[1:] == edge[:-1]
    return (
        edge[:-1][inside],
        cutter[:-1][inside].astype(np.int32),
        cutter[1:][inside].astype(np.int32),
        np.stack([s[:-1], s[1:]], -1)[inside],
    )


# --- what the outer pieces tell ------------------------------------------------------------------


def mesh_net_visibility(mesh: Mesh, rim: MeshSilhouettes, at: Receiver) -> Float[Array, ""]:
    r"""Solid angle of the upper hemisphere that a mesh leaves free, from its outer silhouette.

    `V = 2 pi - sum over outer pieces of the solid angle between normal and piece`, less the parts
    of the horizon that the mesh covers. Exact for the mesh as it is, and differentiable in the
    receiver and in the vertices.

    Valid when: `rim` is that of the receiver's position, the receiver is not inside the mesh, and
    no piece passes exactly below the receiver.

    Args:
        mesh: the blocker.
        rim: from `visible_mesh_silhouettes`.
        at: the receiver.

    Returns:
        In sr, between 0 and 2 pi.

    Reference: R07 §7, (47); Van Oosterom and Strackee 1983 for the triangle.

    Example:
        >>> from firstorder.space import receiver
        >>> from firstorder.space.meshes import mesh
        >>> from firstorder.space.silhouettes import mesh_net_visibility, visible_mesh_silhouettes
        >>> one, at = mesh([[0, 0, 1], [1, 0, 1], [0, 1, 1]], [[0, 1, 2]]), receiver((0.2, 0.3, 0))
        >>> rim = visible_mesh_silhouettes(one, at.position)
        >>> round(mesh_net_visibility(one, rim, at).item(), 4)  # 2 pi less that of the triangle
        5.8587
    """
    a, b, live, through = _above(mesh, rim, at)
    pieces = jnp.sum(jnp.where(live, segment_solid_angle(a, b), 0.0))
    # Where a piece leaves or enters the upper hemisphere the region's edge follows the horizon.
    foot = jnp.where((through > 0)[:, None], a, b)
    foot = jnp.where((through != 0)[:, None], foot, jnp.zeros_like(foot).at[:, 0].set(1.0))
    blocked = pieces + jnp.sum(through * jnp.arctan2(foot[:, 1], foot[:, 0]))
    # The azimuths are known up to whole turns, the blocked solid angle lies in one, but for
    # rounding: more than that would take a sky that is almost hidden for an open one.
    slack = float(jnp.finfo(blocked.dtype).eps) ** 0.5
    turn = 2.0 * np.pi
    return turn - (jnp.mod(blocked + slack, turn) - slack)


def _net_visibility_gradient(mesh: Mesh, rim: MeshSilhouettes, at: Receiver) -> Float[Array, "3"]:
    """The gradient of `mesh_net_visibility` under translation of the receiver, in its frame [sr/m].

    The law of Biot and Savart for each piece, in closed form: cheaper than differentiation, which
    gives the same.

    Reference: R07 §7, (48), without a parametrisation.
    """
    a, b, live, _ = _above(mesh, rim, at)
    return -jnp.sum(jnp.where(live[:, None], segment_translation_rate(a, b), 0.0), 0)


def _above(mesh: Mesh, rim: MeshSilhouettes, at: Receiver):
    """Outer pieces above the horizon in the receiver's frame.

    Returns:
        Start, end, which of them count, and +1 where one ends at the horizon, -1 where one starts.
    """
    pieces = rim.straight(mesh, at.position)
    a, b = (
        in_receiver_frame(at, pieces.start - at.position),
        in_receiver_frame(at, pieces.end - at.position),
    )
    a_up, b_up = a[:, 2] > 0.0, b[:, 2] > 0.0
    live = rim.outer & (a_up | b_up)
    through = jnp.where(live, b_up.astype(int) - a_up.astype(int), 0)
    fall = jnp.where(through != 0, a[:, 2] - b[:, 2], 1.0)
    cut = a + (a[:, 2] / fall)[:, None] * (b - a)
    cut = cut.at[:, 2].multiply(0.0)
    start = jnp.where((through > 0)[:, None], cut, a)
    end = jnp.where((through < 0)[:, None], cut, b)
    # Harmless ones instead of those that do not count: derivatives pass through both.
    x, y = (jnp.zeros_like(a).at[:, k].set(1.0) for k in (0, 1))
    start, end = jnp.where(live[:, None], start, x), jnp.where(live[:, None], end, y)
    return start, end, live, through
