"""Shadow and camera rays against meshes, by Embree: for pictures, by the million.

Built on `io.meshes.Embree`. Where only visibility is asked, rays are left to single precision
(`Embree.between` says what that means). Where depths of blockers are asked they are in double.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float, Int

from firstorder._display import in_print
from firstorder.imaging.camera import Pinhole
from firstorder.io.meshes import Embree
from firstorder.shadowfield.rendering.ray_table import Blockers
from firstorder.space.meshes.triangle_mesh import NO_FACE

Points = Float[np.ndarray, "n 3"]


def mesh_blockers(tracers: Embree | Sequence[Embree]) -> Blockers:
    """First and last blockers between receivers and lamp, as `trace_shadow_rays` asks for them.

    Args:
        tracers: one, or several whose meshes hide together.

    Returns:
        From receivers and places on the lamp, shape (n, 3) each, to shares of the way from the lamp
        of the first and the last surface in between; infinity and minus infinity for a free ray.
        The last one is met first from the receiver. Free rays are told by single precision, the
        others from both ends in double.

    Raises:
        ValueError: if there is no tracer.

    Example:
        >>> import numpy as np
        >>> from firstorder.io import Embree
        >>> from firstorder.rendering import mesh_blockers
        >>> from firstorder.models import bar_lattice, join_meshes, place_mesh
        >>> plates = join_meshes([place_mesh(bar_lattice((0, 0), thickness=0.1), (0, 0, z)) for z in
        ...     (1, 2)])[0]
        >>> found = mesh_blockers(Embree(plates))(np.zeros((1, 3)), np.array([[0.0, 0.0, 4.0]]))
        >>> [a.round(4).tolist() for a in found]  # 4 - 2.05 and 4 - 0.95 of 4 m
        [[0.4875], [0.7625]]
    """
    several = _several(tracers)

    def between(receivers: Points, lamp: Points) -> tuple[np.ndarray, np.ndarray]:
        first, last = np.full(len(lamp), np.inf), np.full(len(lamp), -np.inf)
        for one in several:
            hidden = np.flatnonzero(one.between(receivers, lamp))
            a, b = receivers[hidden], lamp[hidden]
            back, down = one.nearest(a, b - a).t, one.nearest(b, a - b).t
            some = (back < 1.0) & (down < 1.0)
            hidden = hidden[some]
            last[hidden] = np.maximum(last[hidden], 1.0 - back[some])
            first[hidden] = np.minimum(first[hidden], down[some])
        return first, last

    return between


def is_visible(
    tracers: Embree | Sequence[Embree], receivers: Points, lamp: Points
) -> Bool[np.ndarray, " n"]:
    """Whether nothing lies between points, in single precision.

    Args:
        tracers: one, or several whose meshes hide together.
        receivers: one end of each ray [m].
        lamp: the other one [m].

    Raises:
        ValueError: if there is no tracer.

    Example:
        >>> import numpy as np
        >>> from firstorder.io import Embree
        >>> from firstorder.rendering import is_visible
        >>> from firstorder.models import bar_lattice
        >>> ends = np.array([[0.5, 0.5, 1.0], [4.0, 0.5, 1.0]])
        >>> is_visible(Embree(bar_lattice((0, 0))), ends * [1, 1, -1], ends).tolist()
        [False, True]
    """
    free = np.ones(len(receivers), bool)
    for one in _several(tracers):
        left = np.flatnonzero(free)
        free[left] = ~one.between(receivers[left], lamp[left])
    return free


def _several(tracers: Embree | Sequence[Embree]) -> tuple[Embree, ...]:
    found = (tracers,) if isinstance(tracers, Embree) else tuple(tracers)
    if not found:
        raise ValueError("Argument `tracers` must hold a tracer, but is empty.")
    return found


class CameraHits(NamedTuple):
    """First hits of camera rays on a mesh.

    Attributes:
        position: where; NaN for nothing [m].
        normal: of the face, towards the eye; NaN for nothing.
        face: its number, -1 for nothing.
        part: of which part of the mesh the face is, -1 for nothing.
        distance: from the eye, infinity for nothing [m].
        weights: barycentric, one for each corner of the face; zeros for nothing.
    """

    position: Points
    normal: Points
    face: Int[np.ndarray, " n"]
    part: Int[np.ndarray, " n"]
    distance: Float[np.ndarray, " n"]
    weights: Points

    __repr__ = in_print


def camera_hits(
    tracer: Embree,
    camera: Pinhole,
    p: Float[np.ndarray, "n 2"],
    parts: Int[np.ndarray, " f"] | None = None,
) -> CameraHits:
    """First hits of camera rays on a mesh, at places of the image.

    Args:
        tracer: of the mesh.
        camera: where it is seen from.
        p: image coordinates.
        parts: of which part each face is, as `models.primitives.join_meshes` says it; None if all
            are one.

    Raises:
        ValueError: if `parts` does not name every face.

    Example:
        >>> import numpy as np
        >>> from firstorder.io import Embree
        >>> from firstorder.rendering import camera_hits
        >>> from firstorder.imaging import pinhole
        >>> from firstorder.models import bar_lattice
        >>> eye = pinhole((0, 0, 3), (0, 0, 0), up=(0, 1, 0))
        >>> found = camera_hits(Embree(bar_lattice((0, 0), thickness=0.5)), eye, np.array([[0.0, 0],
        ...     [2, 0]]))
        >>> found.distance.tolist(), found.normal[0].tolist()
        ([2.75, inf], [0.0, 0.0, 1.0])
    """
    count = tracer.mesh.count
    part = np.zeros(count, int) if parts is None else np.asarray(parts)
    if part.shape != (count,):
        raise ValueError(f"Argument `parts` must have shape ({count},), but has {part.shape}.")
    eye, axes = np.asarray(camera.eye, float), np.asarray(camera.axes, float)
    way = np.column_stack([p, np.full(len(p), -float(camera.gamma))]) @ axes.T
    way /= np.linalg.norm(way, axis=1)[:, None]
    hits = tracer.nearest(np.broadcast_to(eye, way.shape), way)
    met = hits.face != NO_FACE
    normal = np.full_like(way, np.nan)
    a, b, c = np.moveaxis(np.asarray(tracer.mesh.corners, float)[hits.face[met]], 1, 0)
    n = np.cross(b - a, c - a)
    n /= np.linalg.norm(n, axis=1)[:, None]
    normal[met] = np.where(np.sum(n * way[met], 1) > 0.0, -1.0, 1.0)[:, None] * n
    t = np.where(met, hits.t, np.nan)
    where = np.where(met, part[np.where(met, hits.face, 0)], NO_FACE)
    return CameraHits(eye + t[:, None] * way, normal, hits.face, where, hits.t, hits.weights)
