"""Meshes from files by trimesh, and rays through them by embreex, both imported here alone.

Both come with `pip install "firstorder[mesh]"`. Embree finds faces in single precision, on the
host. What leaves this module is in double: every face that it proposes is met again, and refused
if the ray does not meet it after all.
"""

from __future__ import annotations

import math
import os
import pathlib
from typing import Any, NamedTuple

import numpy as np

from firstorder._display import in_print
from firstorder.io._faces import valid_faces
from firstorder.io._mesh_files import read_parts
from firstorder.space.meshes.triangle_mesh import NO_FACE, Mesh, mesh
from firstorder.space.silhouettes.face_tracers import BruteForceTracer

ENDINGS = (".obj", ".ply", ".gltf", ".glb")
# How often a ray is sent on behind a face that it does not count, before all faces are tested.
_ROUNDS = 8
# Rounding of single precision over the size of the mesh, with a reserve.
_SINGLE = 4e-6
_FAN = 8192  # rays made at a time: origins and directions fit the second cache


def read_mesh(path: str | os.PathLike[str]) -> Mesh:
    r"""Reads a mesh from an OBJ, PLY, GLTF or GLB file.

    All parts of the file become one mesh, placed as the file says; vertices at the very same point
    become one, whatever their texture or normals, so that neighbours know each other. Polygons
    become triangles that cover them once, convex or not. Units and axes are those of the file
    (GLTF: metres, y up).

    Args:
        path: the file; its ending says what it is.

    Raises:
        ValueError: one sentence that names the file, if it is no mesh, damaged, too large
            (`docs/files.md`), has a face that crosses itself, or names another that cannot be
            opened; or if a coordinate is not finite, or so large that the square of an area is not.
        FileNotFoundError: one sentence that names the path, if there is no such file.
        ModuleNotFoundError: without the extra `mesh`.

    Example:
        >>> import pathlib, tempfile
        >>> from firstorder.io import read_mesh
        >>> file = pathlib.Path(tempfile.mkdtemp(), "one.obj")
        >>> _ = file.write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3")
        >>> read_mesh(file).area.item()
        0.5
    """
    return read_mesh_uv(path)[0]


def read_mesh_uv(path: str | os.PathLike[str]) -> tuple[Mesh, np.ndarray | None]:
    r"""Reads a mesh as `read_mesh` does, and where its corners lie in a picture.

    Args:
        path: the file.

    Returns:
        The mesh; and (u, v) at the corners of each face, shape (f, 3, 2), None if a part of
        the file has none: from 0 to 1, v upwards.

    Raises:
        ValueError, FileNotFoundError, ModuleNotFoundError: as `read_mesh`.

    Example:
        >>> import pathlib, tempfile
        >>> from firstorder.io import read_mesh_uv
        >>> file = pathlib.Path(tempfile.mkdtemp(), "one.obj")
        >>> lines = "v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 0.5\nf 1/1 2/2 3/3"
        >>> _ = file.write_text(lines)
        >>> read_mesh_uv(file)[1].tolist()
        [[[0.0, 0.0], [1.0, 0.0], [0.0, 0.5]]]
    """
    path = pathlib.Path(path)
    if path.suffix.lower() not in ENDINGS:
        raise ValueError(f"{path.name}: a mesh must be an .obj, .ply, .gltf or .glb file.")
    trimesh = _needs("trimesh", path.name)
    parts = read_parts(path, trimesh)
    try:
        first = np.cumsum([0, *(len(one.vertices) for one in parts)])
        vertices = np.concatenate([one.vertices for one in parts])
        same, number = np.unique(vertices + 0.0, axis=0, return_inverse=True)
        faces = np.concatenate([one.faces + k for one, k in zip(parts, first, strict=False)])
        merged = number.ravel()[faces]
        made = mesh(same, merged)
    except ValueError as error:
        words = str(error).removeprefix("Argument ")
        raise ValueError(f"{path.name}: {words}") from None
    uv = [one.uv for one in parts if one.uv is not None]
    return made, np.concatenate(uv)[faces][valid_faces(merged)] if len(uv) == len(parts) else None


def _needs(package: str, what: str) -> Any:
    """The package, or an error that says where it comes from."""
    import importlib

    try:
        return importlib.import_module(package)
    except ModuleNotFoundError:
        raise ModuleNotFoundError(
            f"{what}: meshes need the package {package.split('.')[0]}, which comes with the extra "
            '`mesh`: pip install "firstorder[mesh]".'
        ) from None


class MeshHits(NamedTuple):
    """First hits of rays on a mesh, in double precision.

    Attributes:
        t: distance in lengths of the ray's direction, infinity for none, shape (r,).
        face: number of the face, -1 for none, shape (r,).
        weights: barycentric, one for each corner; zeros for none, shape (r, 3).
    """

    t: np.ndarray
    face: np.ndarray
    weights: np.ndarray

    __repr__ = in_print


class Embree:
    """Rays through a mesh, by Embree on the host; implements `space.silhouettes.FaceTracer`.

    Embree proposes a face in single precision; distance and barycentric weights are then computed
    from its corners in double. Where the ray misses the proposed face in double, having passed its
    edge within rounding, all faces are tested in double.

    Args:
        mesh: any; where its vertices are now.

    Raises:
        ModuleNotFoundError: without the extra `mesh`.

    Example:
        >>> from firstorder.io import Embree
        >>> from firstorder.space.meshes import mesh
        >>> tracer = Embree(mesh([[0, 0, 2], [1, 0, 2], [0, 1, 2]], [[0, 1, 2]]))
        >>> hits = tracer.nearest([[0.25, 0.25, 0.0]], [[0.0, 0.0, 1.0]])
        >>> hits.t.tolist(), hits.weights.tolist()
        ([2.0], [[0.5, 0.25, 0.25]])
    """

    def __init__(self, mesh: Mesh):
        scenes = _needs("embreex.rtcore_scene", "Embree")
        build = _needs("embreex.mesh_construction", "Embree")
        self.mesh = mesh
        vertices = np.asarray(mesh.vertices, float)
        faces = np.asarray(mesh.faces)
        self._corners = vertices[faces]
        # Single precision counts from the middle of the mesh, in units of its size.
        self._middle = 0.5 * (vertices.min(0) + vertices.max(0))
        self._size = mesh.size or 1.0
        inside = ((vertices - self._middle) / self._size).astype(np.float32)
        self._scene = scenes.EmbreeScene(robust=True)
        build.TriangleMesh(self._scene, inside, np.ascontiguousarray(faces, np.int32))
        self._planes = np.asarray(mesh.area_vectors, float)
        self._every = BruteForceTracer(mesh)

    def __repr__(self) -> str:
        return f"Embree({self.mesh!r})"

    def nearest(self, origins: Any, directions: Any) -> MeshHits:
        """First hits of rays on the mesh.

        Args:
            origins: shape (r, 3); a ray does not meet the face on which it starts [m].
            directions: shape (r, 3), of any length but zero.
        """
        o, d = (
            np.atleast_2d(np.asarray(origins, float)),
            np.atleast_2d(np.asarray(directions, float)),
        )
        nobody = np.full((len(o), 1), NO_FACE)
        return self._search(o, d, 0.0, np.inf, nobody)

    def occluded(self, a: Any, b: Any) -> np.ndarray:
        """Whether the mesh comes between two points; faces on which they lie do not count.

        Args:
            a: shape (r, 3) [m].
            b: shape (r, 3) [m].
        """
        a, b = np.atleast_2d(np.asarray(a, float)), np.atleast_2d(np.asarray(b, float))
        nobody = np.full((len(a), 1), NO_FACE)
        return self._search(a, b - a, 0.0, 1.0, nobody).face != NO_FACE

    def between(self, a: Any, b: Any) -> np.ndarray:
        """Like `occluded`, in single precision and several times as fast: for pictures.

        Nothing counts within 4e-6 of the mesh's size from either end, so that faces on which the
        ends lie do not, unless the ray grazes them; what a ray passes as closely may be told
        either way. Both grow with the distance of `a` in sizes of the mesh; `occluded` has none.

        Args:
            a: shape (r, 3) [m].
            b: shape (r, 3), none of them at its a [m].

        Example:
            >>> from firstorder.io import Embree
            >>> from firstorder.space.meshes import mesh
            >>> tracer = Embree(mesh([[0, 0, 2], [1, 0, 2], [0, 1, 2]], [[0, 1, 2]]))
            >>> tracer.between([[0.3, 0.3, 0.0]], [[0.3, 0.3, 3.0]]).tolist()
            [True]
            >>> tracer.between([[0.3, 0.3, 0.0]], [[2.0, 2.0, 3.0]]).tolist()
            [False]
        """
        a, b = np.atleast_2d(np.asarray(a, float)), np.atleast_2d(np.asarray(b, float))
        start, d = (a - self._middle) / self._size, (b - a) / self._size
        length = np.sqrt(np.einsum("ij,ij->i", d, d))
        if not np.all((length > 0.0) & np.isfinite(length)):
            raise ValueError("Arguments `a` and `b` must be finite and apart, but are not.")
        margin = np.minimum(_SINGLE / length, 0.4)[:, None]
        answer = self._scene.run(
            np.ascontiguousarray(start + margin * d, np.float32),
            np.ascontiguousarray((1.0 - 2.0 * margin) * d, np.float32),
            dists=np.ones(len(d), np.float32),
            query="OCCLUDED",
        )
        return answer != NO_FACE

    def fan_occluded(self, starts: Any, ways: Any, reach: float = 1.0) -> np.ndarray:
        """Whether the mesh comes between each of n points and each of k others, as `between` does.

        Rays are made in single precision, as many at a time as the cache holds: from everywhere to
        the same k places, that takes a third of the time of `between`.

        Args:
            starts: shape (n, 3); off the mesh by more than 4e-6 of its size, or they hide all [m].
            ways: the k places, shape (k, 3) [m]; if `reach` is infinite, directions of any length.
            reach: 1, or infinity for what is far beyond the mesh.

        Returns:
            Mask of shape (n, k).

        Example:
            >>> import numpy as np
            >>> from firstorder.io import Embree
            >>> from firstorder.space.meshes import mesh
            >>> tracer = Embree(mesh([[0, 0, 2], [1, 0, 2], [0, 1, 2]], [[0, 1, 2]]))
            >>> ends = np.array([[0.3, 0.3, 3.0], [2.0, 2.0, 3.0]])
            >>> tracer.fan_occluded(np.array([[0.3, 0.3, 0.0]]), ends).tolist()
            [[True, False]]
        """
        far = math.isinf(reach)
        a, b = self._single(starts), self._single(ways, along=far).ravel()
        hidden = np.empty((len(a), len(b) // 3), bool)
        if not hidden.size:
            return hidden
        most = max(_FAN * 3 // len(b), 1)
        dists = np.full(most * hidden.shape[1], 1e30 if far else 1.0, np.float32)
        for first in range(0, len(a), most):
            some = a[first : first + most]
            origins = np.repeat(some, hidden.shape[1], 0)
            along = np.broadcast_to(b, (len(some), len(b)))
            along = np.ascontiguousarray(along) if far else along - origins.reshape(len(some), -1)
            face = self._scene.run(
                origins, along.reshape(-1, 3), dists=dists[: len(origins)], query="OCCLUDED"
            )
            np.not_equal(face.reshape(len(some), -1), NO_FACE, hidden[first : first + most])
        return hidden

    def first_share(self, starts: Any, ways: Any, reach: float = 1.0) -> np.ndarray:
        """Share of the way at which the mesh is met first, in single precision: for pictures.

        Args:
            starts: shape (r, 3), as in `fan_occluded` [m].
            ways: a place for each, shape (r, 3) [m]; or directions, whose lengths are then counted.
            reach: as in `fan_occluded`.

        Returns:
            Shares, infinity where nothing is met; shape (r,).
        """
        far = math.isinf(reach)
        a, b = self._single(starts), self._single(ways, along=far)
        dists = np.full(len(a), 1e30 if far else 1.0, np.float32)
        found = self._scene.run(a, b if far else b - a, dists=dists, output=1)
        return np.where(found["primID"] == NO_FACE, np.inf, found["tfar"].astype(float))

    def _single(self, x: Any, along: bool = False) -> np.ndarray:
        """Places or directions as Embree counts them: in single precision, in sizes of the mesh."""
        x = np.asarray(x, float) if along else np.asarray(x, float) - self._middle
        return np.ascontiguousarray(x / self._size, np.float32)

    def seen_from(self, eye: Any, directions: Any) -> tuple[np.ndarray, np.ndarray]:
        """The face that each ray from one point meets first, found in single precision; how far.

        A quarter of the time of `nearest`: a ray that passes an edge as closely as single precision
        tells may get the face beside it. Distances are in double, to the plane of that face.

        Args:
            eye: off the mesh [m].
            directions: shape (r, 3), of any length but zero.

        Returns:
            Distances in lengths of the directions, infinity for none, and numbers of faces, -1 for
            none; shape (r,).

        Example:
            >>> from firstorder.io import Embree
            >>> from firstorder.space.meshes import mesh
            >>> tracer = Embree(mesh([[0, 0, 2], [1, 0, 2], [0, 1, 2]], [[0, 1, 2]]))
            >>> t, face = tracer.seen_from([0.25, 0.25, 0.0], [[0.0, 0.0, 1.0], [0.0, 0.0, -1.0]])
            >>> t.tolist(), face.tolist()
            ([2.0, inf], [0, -1])
        """
        eye, d = np.asarray(eye, float), np.asarray(directions, float)
        start, along = np.broadcast_to(self._single(eye), d.shape), self._single(d, along=True)
        if np.linalg.norm(eye - self._middle) > self._size:  # begin where the mesh may
            length = np.linalg.norm(d, axis=1, keepdims=True)
            ahead = self._ahead(np.broadcast_to(eye, d.shape), d / length)[:, None]
            start = self._single(eye + ahead * (d / length))
        far = np.full(len(d), 1e30, np.float32)
        face = self._scene.run(np.ascontiguousarray(start), along, dists=far).astype(np.int64)
        met = np.flatnonzero(face != NO_FACE)
        normal, corner = self._planes[face[met]], self._corners[face[met], 0]
        with np.errstate(divide="ignore", invalid="ignore"):
            there = np.einsum("ij,ij->i", corner - eye, normal)
            there /= np.einsum("ij,ij->i", d[met], normal)
        t = np.full(len(d), np.inf)
        t[met] = there
        odd = met[~(np.isfinite(there) & (there > 0.0))]  # along a face, or behind its edge
        if len(odd):
            exact = self.nearest(np.broadcast_to(eye, (len(odd), 3)), d[odd])
            t[odd], face[odd] = exact.t, exact.face
        return t, face

    def first_face(self, eye, directions, low, high, skip):
        """First face along each ray, as `space.silhouettes.FaceTracer` asks."""
        eye = np.asarray(eye, float)
        origins = np.broadcast_to(eye, directions.shape)
        return self._search(origins, directions, low, high, skip).face

    def _search(self, o, d, low, high, skip) -> MeshHits:
        if o.shape != d.shape or o.shape[-1] != 3:
            raise ValueError(
                "Rays must be as many rows of three numbers on either side, but have shapes "
                f"{o.shape} and {d.shape}."
            )
        length = np.linalg.norm(d, axis=1)
        if not np.all((length > 0.0) & np.isfinite(length) & np.all(np.isfinite(o), 1)):
            raise ValueError("Argument `directions` must be finite and not zero, but is not.")
        t, face = np.full(len(o), np.inf), np.full(len(o), NO_FACE)
        weights = np.zeros((len(o), 3))
        # Distances on the surface itself are below this, in lengths of d.
        margin = 1e-12 * (self._size + np.linalg.norm(o, axis=1)) / length
        ahead = self._ahead(o, d / length[:, None]) / length
        o = o + ahead[:, None] * d
        low, high = np.maximum(low - ahead, 0.0), high - ahead
        least, most = low + margin, high - margin
        start = low - 0.5 * _SINGLE * self._size / length * (low > 0.0)
        left, ask = np.arange(len(o)), []
        for _ in range(_ROUNDS):
            proposed, at = self._propose(o[left], d[left], start[left], high[left])
            exact, w = _meets(self._corners[proposed], o[left], d[left])
            some = proposed != NO_FACE
            passed = np.any(proposed[:, None] == skip[left], 1) | (exact <= least[left])
            missed = some & ~passed & np.isnan(exact)
            good = some & ~passed & (exact < most[left])  # NaN is not
            done = left[good]
            t[done], face[done], weights[done] = exact[good], proposed[good], w[good]
            ask.extend(left[missed])
            # On behind what does not count; a little further than single precision can tell apart.
            start[left] = at + _SINGLE * self._size / length[left]
            left = left[some & passed]
            if not len(left):
                break
        for k in (*ask, *left):  # a ray through an edge, or along a face: rare
            face[k] = self._every.first_face(
                o[k], d[k : k + 1], least[k], most[k], skip[k : k + 1]
            )[0]
            if face[k] != NO_FACE:
                one = _meets(self._corners[face[k : k + 1]], o[k : k + 1], d[k : k + 1], sure=True)
                t[k], weights[k] = one[0][0], one[1][0]
        return MeshHits(t + ahead, face, weights)

    def _ahead(self, o: np.ndarray, along: np.ndarray) -> np.ndarray:
        """How far from its origin the mesh may begin for each ray of unit direction [m].

        From afar all faces are as good as in one place, to single precision and by volumes too.
        """
        return np.maximum(np.einsum("ij,ij->i", self._middle - o, along) - self._size, 0.0)

    def _propose(self, o, d, start, high) -> tuple[np.ndarray, np.ndarray]:
        """Embree's face for each ray and where it meets it, in lengths of d."""
        length = np.linalg.norm(d, axis=1)
        from_ = (o - self._middle + start[:, None] * d) / self._size
        reach = np.minimum(np.maximum(high - start, 0.0) * length / self._size, 1e30)
        answer = self._scene.run(
            np.ascontiguousarray(from_, np.float32),
            np.ascontiguousarray(d / length[:, None], np.float32),
            dists=reach.astype(np.float32),
            output=1,
        )
        found = answer["primID"].astype(np.int64)
        at = start + answer["tfar"].astype(float) * self._size / length
        return found, np.where(found == NO_FACE, start, at)


def _meets(
    corners: np.ndarray, o: np.ndarray, d: np.ndarray, sure: bool = False
) -> tuple[np.ndarray, np.ndarray]:
    """Distance (NaN for a miss) and barycentric weights of rays through a triangle each.

    By the signs of three volumes, as watertight tests do: faces that share an edge compute the same
    number for it but for its sign, so that no ray slips through between them. `sure` is for a face
    that is known to be met, on its very edge perhaps.
    """
    A, B, C = (corners[:, k] - o for k in range(3))
    volumes = np.stack([np.sum(d * np.cross(p, q), -1) for p, q in ((B, C), (C, A), (A, B))], -1)
    total = volumes.sum(-1)
    inside = (np.all(volumes >= 0.0, -1) | np.all(volumes <= 0.0, -1) | sure) & (total != 0.0)
    safe = np.where(inside, total, 1.0)
    t = np.where(inside, np.sum(A * np.cross(B, C), -1) / safe, np.nan)
    return t, volumes / safe[:, None]
