"""Vertices, edges and faces of the flat shapes of a scene, on the host.

Vertices that shapes share are one vertex, and edges that they share one edge. A vertex may lie
within an edge, where bodies touch; it then ends the edge for an eye, on either side.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float, Int

from firstorder.space.receiver import Receiver
from firstorder.space.scene import Scene
from firstorder.space.shapes._bounds import bounds
from firstorder.space.shapes.kinds import (
    Boxes,
    Cylinders,
    Discs,
    Ellipsoids,
    Planes,
    Rectangles,
    Shape,
    Triangles,
)

ROUND = Ellipsoids | Discs | Cylinders  # shapes whose outline is round, and that have no edges


def dot(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """The scalar product, on the host."""
    return np.sum(a * b, -1)


def unit(a: np.ndarray) -> np.ndarray:
    """The vector of length one along another, on the host; the zero vector stays what it is."""
    length = np.linalg.norm(a, axis=-1, keepdims=True)
    return a / np.where(length > 0.0, length, 1.0)


class Faces(NamedTuple):
    """Flat faces `corner + x u + y v`, 0 <= x, y <= 1; of triangles `x + y <= 1` too."""

    corner: Float[np.ndarray, "f 3"]
    spans: Float[np.ndarray, "f 2 3"]
    triangular: Bool[np.ndarray, " f"]


class Edges(NamedTuple):
    """Vertices and edges of all flat faces of a scene, and which of them touch.

    Attributes:
        vertices: [m].
        ends: numbers of the two vertices of each edge.
        touch: whether a vertex lies on an edge.
        coplanar: whether two edges lie in one plane, shape (e, e); an edge does with itself.
        faces: of all shapes.
        size: extent of all shapes [m].
        near: distance at which points are one [m].
    """

    vertices: Float[np.ndarray, "v 3"]
    ends: Int[np.ndarray, "e 2"]
    touch: Bool[np.ndarray, "v e"]
    coplanar: Bool[np.ndarray, "e e"]
    faces: Faces
    size: float
    near: float

    @property
    def start(self) -> Float[np.ndarray, "e 3"]:
        """Where edges start [m]."""
        return self.vertices[self.ends[:, 0]]

    @property
    def along(self) -> Float[np.ndarray, "e 3"]:
        """From where edges start to where they end [m]."""
        return self.vertices[self.ends[:, 1]] - self.start


def edges_of(scene: Scene, at: Receiver) -> Edges:
    """Vertices, edges and faces of all flat shapes.

    Args:
        scene: concrete boxes, rectangles and triangles; round shapes, which have none.
        at: the receivers' plane, which may be a plane of the scene.

    Raises:
        ValueError: if there is a plane in which the receivers do not lie, or a shape that is too
            small beside the extent of all of them.

    Example:
        >>> from firstorder.space import Receiver, Scene, box, primitive
        >>> from firstorder.space.discontinuities._edges import edges_of
        >>> cube = Scene.of(primitive(box((0, 0, 1), (1, 1, 2))))
        >>> found = edges_of(cube, Receiver.at((0.0, 0.0, 0.0)))
        >>> found.vertices.shape, found.ends.shape
        ((8, 3), (12, 2))
    """
    points, ends, faces = [np.zeros((0, 3))], [np.zeros((0, 2), int)], [_no_faces()]
    for group in scene.groups:
        for center, axes in zip(np.asarray(group.center), np.asarray(group.axes), strict=True):
            corners, pairs, sides = _parts(group, center, axes, at)
            ends.append(pairs + sum(map(len, points)))
            points.append(corners)
            faces.append(sides)
    vertices, pairs = np.concatenate(points), np.concatenate(ends)
    size = _size(scene, vertices)
    near = size * float(np.sqrt(np.finfo(at.position.dtype).eps))
    _check_extents(points[1:], near)
    vertices, pairs = _merged(vertices, pairs, near)
    start, along = vertices[pairs[:, 0]], vertices[pairs[:, 1]] - vertices[pairs[:, 0]]
    sides = Faces(*(np.concatenate(parts) for parts in zip(*faces, strict=True)))
    touch, coplanar = _touching(vertices, start, along, near), _coplanar(start, along, near)
    return Edges(vertices, pairs, touch, coplanar, sides, size, near)


def _size(scene: Scene, vertices) -> float:
    """Extent of vertices and of round shapes."""
    round_shapes = [bounds(group) for group in scene.groups if isinstance(group, ROUND)]
    points = np.concatenate([vertices, *(np.concatenate(ends) for ends in round_shapes)])
    return float(np.max(np.ptp(points, axis=0))) if len(points) else 1.0


def _check_extents(shapes: list[np.ndarray], near: float) -> None:
    """Refuse a shape whose corners would all be one."""
    extents = [float(np.max(np.ptp(corners, axis=0))) for corners in shapes if len(corners)]
    if extents and min(extents) <= near:
        raise ValueError(
            f"A shape is {min(extents):.2g} m long, but beside the extent of all of them points "
            f"within {near:.2g} m count as one in this precision. Leave out what is far away."
        )


def _merged(vertices, pairs, near) -> tuple[np.ndarray, np.ndarray]:
    """Vertices in one place made one, and edges between the same two likewise."""
    if not len(vertices):
        return vertices, pairs
    same = np.linalg.norm(vertices[:, None] - vertices, axis=-1) <= near
    kept, number = np.unique(np.argmax(same, axis=1), return_inverse=True)
    return vertices[kept], np.unique(np.sort(number[pairs], axis=1), axis=0)


def _no_faces() -> Faces:
    return Faces(np.zeros((0, 3)), np.zeros((0, 2, 3)), np.zeros(0, bool))


def _parts(group: Shape, center, axes, at: Receiver) -> tuple[np.ndarray, np.ndarray, Faces]:
    """Corners, pairs of corners and faces of one shape."""
    u, v, w = axes.T
    if isinstance(group, Triangles):
        corners = np.stack([center, center + u, center + v])
        face = Faces(center[None], np.stack([u, v])[None], np.ones(1, bool))
        return corners, np.array([[0, 1], [1, 2], [2, 0]]), face
    if isinstance(group, Rectangles):
        corners = center + np.array([-u - v, u - v, u + v, v - u])
        face = Faces(corners[:1], 2.0 * np.stack([u, v])[None], np.zeros(1, bool))
        return corners, np.array([[0, 1], [1, 2], [2, 3], [3, 0]]), face
    if isinstance(group, Boxes):
        return _box_parts(center, u, v, w)
    if isinstance(group, Planes):
        _check_below(center, w, at)
    return np.zeros((0, 3)), np.zeros((0, 2), int), _no_faces()


def _box_parts(center, u, v, w) -> tuple[np.ndarray, np.ndarray, Faces]:
    signs = np.array([[i, j, k] for i in (-1, 1) for j in (-1, 1) for k in (-1, 1)])
    corners = center + signs @ np.stack([u, v, w])
    pairs = np.array(
        [(i, j) for i in range(8) for j in range(i) if np.sum(signs[i] != signs[j]) == 1]
    )
    low = corners[0]
    spans = 2.0 * np.array([[u, v], [v, w], [w, u]])
    across = 2.0 * np.stack([w, u, v])
    corner = np.concatenate([np.broadcast_to(low, (3, 3)), low + across])
    return corners, pairs, Faces(corner, np.concatenate([spans, spans]), np.zeros(6, bool))


def _check_below(point, normal, at: Receiver) -> None:
    """Receivers must lie in a plane without end: its horizon does not move for them then."""
    n, offset = unit(normal), np.asarray(at.position) - point
    small = 1e-6 * (np.linalg.norm(point) + np.linalg.norm(offset))
    if np.max(np.abs(np.cross(n, np.asarray(at.normal)))) > 1e-6 or abs(offset @ n) > small:
        raise ValueError(
            "Argument `scene` must not hold a plane without end, but for the receivers' own."
        )


def _touching(vertices, start, along, near) -> Bool[np.ndarray, "v e"]:
    """Whether vertices lie on edges."""
    w = vertices[:, None] - start
    share = np.clip(dot(w, along) / dot(along, along), 0.0, 1.0)
    return np.linalg.norm(w - share[..., None] * along, axis=-1) <= near


def _coplanar(start, along, near) -> Bool[np.ndarray, "e e"]:
    """Whether two edges lie in one plane."""
    way = unit(along)
    volume = dot(np.cross(way[:, None], way), start[:, None] - start)
    return np.abs(volume) <= near


def fans(edges: Edges) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The parts of edges that leave each vertex.

    Returns:
        Numbers of vertices and of edges, and the ways to the ends of the parts, shape (f, 3) [m].
    """
    vertex, edge = np.nonzero(edges.touch)
    vertex, edge = np.repeat(vertex, 2), np.repeat(edge, 2)
    end = edges.vertices[edges.ends[edge, np.arange(len(edge)) % 2]]
    way = end - edges.vertices[vertex]
    leaves = np.linalg.norm(way, axis=-1) > edges.near
    return vertex[leaves], edge[leaves], way[leaves]
