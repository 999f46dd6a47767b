"""A second scene for D05's Fig. 17, of triangle meshes: shading normals, leaves, ground that rolls.

A shiny knot (s = 250), a dull lump of seven balls that flow together (s = 40), a shiny bumpy ball,
and a fern, on displaced ground of little gloss, under the sky of `d05.shared.shading`. What is
hidden is asked of Embree: in single precision where only visibility counts, as distances of
blockers in double. Rays start a hair off their face. What lies below a face is hidden by it,
however its shading normal leans, but it is no blocker: the surface itself has no distance.

Labels are finer than things, where a thing may hide itself: each frond and leaflet has its own, and
so has each 24th of the knot's tube.
"""

from __future__ import annotations

import functools
from typing import Any, NamedTuple

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from scipy.sparse import csr_array
from scipy.sparse.csgraph import connected_components

from figures.d05.shared.shading import (
    AMBIENT,
    DULL,
    FILL,
    FLOOR,
    LAMP,
    RAYS,
    SHINY,
    Lobes,
    Points,
    World,
)
from firstorder.imaging.camera import Pinhole, pinhole
from firstorder.imaging.facets import Facets, mesh_facets
from firstorder.imaging.hits import facet_gbuffer
from firstorder.io import Embree
from firstorder.models.blobs import metaballs
from firstorder.models.knots import torus_knot
from firstorder.models.plants import fern
from firstorder.models.primitives import (
    bumpy_sphere,
    displaced_ground,
    join_meshes,
    place_mesh,
    ripples,
    rotation_about,
)
from firstorder.rendering import shadow_rays as embree
from firstorder.space.meshes.triangle_mesh import Mesh, vertex_normals

LEAF: dict[str, Any] = dict(albedo=0.5, specular=0.08, exponent=20.0)
HAIR = 1e-4  # rays start this far in front of a face [m]
ARCS = 24  # of the knot's tube

# Centres and radii of the balls of the lump [m].
BALLS = (
    ((0.0, 0.0, 0.42), 0.36),
    ((0.34, 0.06, 0.78), 0.24),
    ((-0.30, 0.12, 0.82), 0.22),
    ((0.05, -0.05, 1.12), 0.22),
    ((0.36, -0.34, 0.24), 0.20),
    ((-0.36, -0.28, 0.22), 0.20),
    ((0.02, 0.42, 0.22), 0.20),
)


class Meshes(NamedTuple):
    """Rays through meshes: a `Tracer`.

    Attributes:
        tracer: of all of them together.
        known: their faces with the normals that shade them.
        part: of which thing each face is.
        label: of each face.
    """

    tracer: Embree
    known: Facets
    part: np.ndarray
    label: np.ndarray

    def seen(self, camera: Pinhole, p: np.ndarray) -> tuple[Points, np.ndarray]:
        """See `Tracer`."""
        found = embree.camera_hits(self.tracer, camera, p, self.part)
        met = found.face >= 0
        at = facet_gbuffer(self.known, camera, p, found.face)
        face = np.where(met[:, None], found.normal, np.asarray(at.normal))
        return Points(at, found.part, face), np.where(met, self.label[found.face], -1)

    def free(self, points: Points, w) -> np.ndarray:
        """See `Tracer`: 0 below the horizon, of the face or of what shades it."""
        start, w, rows = self._above(points, w, np.asarray(points.at.normal))
        free = np.zeros(w.shape[:2])
        far = start + 2.0 * self.tracer.mesh.size * w[rows]
        free[rows] = embree.is_visible(self.tracer, start, far)
        return free

    def distance(self, points: Points, w) -> np.ndarray:
        """See `Tracer`: infinity for what the face itself hides."""
        start, w, rows = self._above(points, w)
        found = np.full(w.shape[:2], np.inf)
        found[rows] = self.tracer.nearest(start, w[rows]).t
        return found

    def _above(self, points: Points, w, *normals: np.ndarray):
        """Rays above faces and above other normals: starts, all directions, which they are."""
        w, face = np.asarray(w), np.asarray(points.face)
        rows = (np.asarray(points.thing) >= 0)[:, None] & np.ones(w.shape[1], bool)
        for n in (face, *normals):
            rows &= np.einsum("nki,ni->nk", w, n) > 0.0
        start = np.asarray(points.at.position) + HAIR * face
        return start[np.nonzero(rows)[0]], w, rows


class Piece(NamedTuple):
    """A mesh with a label for each face, and normals at vertices if it has better ones than most.

    Attributes:
        mesh: where it stands.
        label: from 0.
        normals: that shade it; `vertex_normals`, if None.
    """

    mesh: Mesh
    label: np.ndarray
    normals: np.ndarray | None = None


def meshes(pieces: dict[str, Piece]) -> Meshes:
    """Pieces by name, ready for rays; numbers are in their order."""
    whole, part = join_meshes([piece.mesh for piece in pieces.values()])
    normals = np.array(eqx.filter_jit(vertex_normals)(whole))
    first, vertex, labels = 0, 0, []
    for mesh, own, better in pieces.values():
        labels.append(own + first)
        first += int(np.max(own)) + 1
        if better is not None:
            normals[vertex : vertex + len(better)] = better
        vertex += len(mesh.vertices)
    known = eqx.filter_jit(mesh_facets)(whole, jnp.asarray(normals))
    return Meshes(Embree(whole), known, part, np.concatenate(labels))


def one(piece: Mesh) -> Piece:
    """A mesh of one label."""
    return Piece(piece, np.zeros(piece.count, int))


def each(piece: Mesh) -> Piece:
    """A mesh with a label for each of what does not hang together."""
    f = np.asarray(piece.faces)
    ends = np.r_[f[:, 0], f[:, 1]], np.r_[f[:, 1], f[:, 2]]
    links = csr_array((np.ones(len(ends[0])), ends), shape=2 * (len(piece.vertices),))
    return Piece(piece, connected_components(links, directed=False)[1][f[:, 0]])


def arcs(tube: Mesh, count: int = ARCS) -> Piece:
    """A knot's tube in as many pieces; its faces run along it twice (see `quad_triangles`)."""
    half = tube.count // 2
    return Piece(tube, np.arange(tube.count) % half * count // half)


def lump() -> Piece:
    """Balls that flow together; normals are those of the function that `metaballs` cuts."""
    centers, radii = (np.array(a) for a in zip(*BALLS, strict=True))
    found = metaballs(centers, radii, 80)
    away = np.asarray(found.vertices)[:, None] - centers
    share = np.exp(-np.sum(away**2, -1) / radii**2) / radii**2
    n = np.sum(share[..., None] * away, 1)
    n /= np.linalg.norm(n, axis=1)[:, None]
    return one(place_mesh(found, (1.05, 0.9, 0.0), scale=1.15))._replace(normals=n)


@functools.cache
def rays() -> Meshes:
    """The scene; it takes some seconds to build."""
    tube = torus_knot(2, 3, 0.16, 600, 40, 0.66)
    return meshes(
        {
            "floor": one(displaced_ground(9.5, ripples(0.02, 1.1, 2), 260, (0.0, 2.0))),
            "knot": arcs(
                place_mesh(tube, (-0.75, -0.55, 0.72), rotation_about((1.0, 0.25, 0.1), 1.25))
            ),
            "lump": lump(),
            "ball": one(
                place_mesh(bumpy_sphere(0.26, ripples(0.03, 0.8, 1), 5), (0.65, -1.1, 0.26))
            ),
            "fern": each(place_mesh(fern(8, 9, 4, 0.8, 0.3)[0], (1.5, -0.4, 0.0))),
        }
    )


def world(quick: bool) -> World:
    """The scene at 800 x 500, or an eighth of it."""
    rows = [FLOOR, SHINY, DULL, SHINY, LEAF]
    lobes = Lobes(*(np.array([m[k] for m in rows]) for k in Lobes._fields))
    camera = pinhole((-0.3, -4.6, 2.9), (-0.1, 0.0, 0.4), gamma=2.3)
    size = (96, 60) if quick else (800, 500)
    return World("d05_meshes", KEY, rays(), lobes, 0, camera, *size)


KEY = f"2 {LAMP} {FILL} {AMBIENT} {SHINY} {DULL} {FLOOR} {LEAF} {RAYS} {BALLS}"
