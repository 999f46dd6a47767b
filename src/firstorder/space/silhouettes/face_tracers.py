"""Which face of a mesh a ray meets first: what is asked of a tracer, and one that tests all."""

from __future__ import annotations

import functools
from typing import Protocol, runtime_checkable

import numpy as np

from firstorder.numerics._order import morton
from firstorder.space.meshes.triangle_mesh import NO_FACE, Mesh

_RUN = 64  # faces that lie together, which are tested for one ray, or none of them
_PAIRS = 4_000_000  # of a point and a face, at most looked at together


@runtime_checkable
class FaceTracer(Protocol):
    """Protocol of tracers that find the first face along a ray."""

    def first_face(
        self,
        eye: np.ndarray,
        directions: np.ndarray,
        low: float,
        high: float,
        skip: np.ndarray,
    ) -> np.ndarray:
        """The first face with `low < t < high` along `eye + t direction`, or -1.

        Args:
            eye: shape (3,) [m].
            directions: shape (r, 3), of any length; t counts in that length.
            low: t is above.
            high: t is below.
            skip: shape (r, 2), faces that a ray does not meet; -1 for none.
        """
        ...


class BruteForceTracer:
    """A tracer that tests every face, in double precision.

    For a single ray it tests those in runs of 64 whose bounding spheres the ray's line meets: the
    same answer in a hundredth of the time.

    All rays leave one eye, so that three products with each direction tell which faces it passes:
    with the corners A, B, C relative to the eye, a direction d is inside if d . (B x C),
    d . (C x A) and d . (A x B) have one sign, and then `t = A . (B x C) / (their sum)`.

    Args:
        mesh: whose faces are tested.
        block: rays at a time, times faces.

    Example:
        >>> import numpy as np
        >>> from firstorder.space.meshes import mesh
        >>> from firstorder.space.silhouettes import BruteForceTracer
        >>> one = mesh([[0, 0, 1], [1, 0, 1], [0, 1, 1]], [[0, 1, 2]])
        >>> up, none = np.array([[0.0, 0.0, 1.0]]), np.full((1, 2), -1)
        >>> BruteForceTracer(one).first_face((0.2, 0.3, 0.0), up, 0.0, np.inf, none).tolist()
        [0]
    """

    def __init__(self, mesh: Mesh, block: int = 4_000_000):
        self._corners = np.asarray(mesh.vertices, float)[np.asarray(mesh.faces)]
        self._rows = max(1, block // len(self._corners))

    def __repr__(self) -> str:
        return f"BruteForceTracer of {len(self._corners)} faces"

    def first_face(self, eye, directions, low, high, skip):
        """First face along each ray, as `FaceTracer` asks."""
        eye = np.asarray(eye, float)
        if len(directions) == 1:
            near = self._near(eye, directions[0])
            near = near[~np.isin(near, skip)]
            found = _first_of(_planes(self._corners[near], eye), directions, low, high, skip[:, :0])
            return np.append(near, NO_FACE)[found]
        planes, found = _planes(self._corners, eye), np.full(len(directions), NO_FACE)
        for first in range(0, len(directions), self._rows):
            part = slice(first, first + self._rows)
            found[part] = _first_of(planes, directions[part], low, high, skip[part])
        return found

    def _near(self, eye, direction) -> np.ndarray:
        """Numbers of the faces in those runs whose spheres a ray's line meets."""
        order, middle, radius = self._runs
        away = middle - eye
        reach = radius + 1e-9 * np.linalg.norm(away, axis=-1)  # more than is rounded
        by = np.linalg.norm(np.cross(away, direction), axis=-1)
        met = np.flatnonzero(by <= reach * np.linalg.norm(direction))
        places = (_RUN * met[:, None] + np.arange(_RUN)).ravel()
        return np.sort(order[places[places < len(order)]])

    @functools.cached_property
    def _runs(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Faces in an order in which they lie together; spheres about each run of them."""
        order = np.argsort(morton(self._corners.mean(1)))
        corners, starts = self._corners[order], np.arange(0, len(order), _RUN)
        low = np.minimum.reduceat(corners.min(1), starts)
        high = np.maximum.reduceat(corners.max(1), starts)
        return order, 0.5 * (low + high), 0.5 * np.linalg.norm(high - low, axis=-1)


def _planes(corners, eye):
    """Normals of the planes through an eye and the sides of faces, and volumes of their corners."""
    A, B, C = (corners[:, k] - eye for k in range(3))
    sides = np.cross(B, C), np.cross(C, A), np.cross(A, B)
    return sides, np.sum(A * sides[0], -1)


def _first_of(planes, directions, low, high, skip) -> np.ndarray:
    """The first of some faces along each ray: its place among them, or `NO_FACE`."""
    sides, volume = planes
    # Written out and not as matrix products, which may fuse and round: faces that share an edge
    # get the very same number for it but for its sign, and no ray slips between them.
    x, y, z = (directions[:, k, None] for k in range(3))
    u, v, w = (x * s[:, 0] + y * s[:, 1] + z * s[:, 2] for s in sides)
    total = u + v + w
    inside = ((u >= 0.0) & (v >= 0.0) & (w >= 0.0)) | ((u <= 0.0) & (v <= 0.0) & (w <= 0.0))
    with np.errstate(divide="ignore", invalid="ignore"):
        t = np.where(inside & (total != 0.0), volume / total, np.inf)
    t = np.where((t > low) & (t < high), t, np.inf)
    for k in range(skip.shape[1]):
        rows = np.flatnonzero(skip[:, k] != NO_FACE)
        t[rows, skip[rows, k]] = np.inf
    if not t.size:
        return np.full(len(t), NO_FACE)
    best = np.argmin(t, -1)
    return np.where(np.isfinite(t[np.arange(len(t)), best]), best, NO_FACE)


def _touched_face(corners, eye, ways, aside, near, skip) -> np.ndarray:
    """The face on which a point lies and that a ray just aside of it meets first; or -1.

    A ray through the point itself meets that face or not as rounding has it, and another shape's
    edge may lie there too.

    Args:
        corners: of all faces, shape (f, 3, 3) [m].
        eye: shape (3,) [m].
        ways: from the eye to the points, shape (r, 3) [m].
        aside: from the points to the rays, shape (r, 3) [m].
        near: how close to a face counts as on it, shape (r,) [m].
        skip: shape (r, 2), faces that do not count; -1 for none.
    """
    found = np.full(len(ways), NO_FACE)
    point, face = _near_boxes(corners, eye + ways, near)
    counts = ~np.any(face[:, None] == skip[point], 1)
    point, face = point[counts], face[counts]
    A, B, C = (corners[face, k] - eye for k in range(3))
    normal = np.cross(B - A, C - A)
    height = np.abs(np.sum(normal * (ways[point] - A), -1))
    ray = (ways + aside)[point]
    u, v, w = (np.sum(ray * np.cross(p, q), -1) for p, q in ((B, C), (C, A), (A, B)))
    total = u + v + w
    met = ((u >= 0.0) & (v >= 0.0) & (w >= 0.0)) | ((u <= 0.0) & (v <= 0.0) & (w <= 0.0))
    t = np.sum(A * np.cross(B, C), -1) / np.where(total != 0.0, total, np.inf)
    met &= (t > 0.0) & (height <= near[point] * np.linalg.norm(normal, axis=-1))
    t, point, face = t[met], point[met], face[met]
    nearest_last = np.argsort(-t)
    found[point[nearest_last]] = face[nearest_last]
    return found


def _near_boxes(corners, points, near) -> tuple[np.ndarray, np.ndarray]:
    """Numbers of points and of the faces whose boxes they lie in, or near to."""
    if not len(points):
        return np.zeros(0, int), np.zeros(0, int)
    axis = np.argmax(np.ptp(points, axis=0))  # along which they are sorted
    order = np.argsort(points[:, axis])
    along, most = points[order, axis], near.max()
    low, high = _bounds(corners[..., axis])
    first = np.searchsorted(along, low - most)
    count = np.searchsorted(along, high + most, side="right") - first
    some = np.flatnonzero(count)
    rows, pairs = max(1, _PAIRS // len(points)), []
    for start in range(0, len(some), rows):
        part = some[start : start + rows]
        ends = np.cumsum(count[part])
        whose = np.repeat(np.arange(len(part)), count[part])
        turn = np.arange(ends[-1]) - (ends - count[part])[whose]
        point = order[first[part][whose] + turn]
        for k in range(3):
            low, high = _bounds(corners[part, :, k])
            p, slack = points[point, k], near[point]
            inside = (p >= low[whose] - slack) & (p <= high[whose] + slack)
            point, whose = point[inside], whose[inside]
        pairs.append((point, part[whose]))
    if not pairs:
        return np.zeros(0, int), np.zeros(0, int)
    point, face = zip(*pairs, strict=True)
    return np.concatenate(point), np.concatenate(face)


def _bounds(corners) -> tuple[np.ndarray, np.ndarray]:
    """Least and largest coordinates of each face."""
    a, b, c = (corners[:, k] for k in range(3))
    return np.minimum(np.minimum(a, b), c), np.maximum(np.maximum(a, b), c)
