"""Procedural models: primitives, blobs, knots, plants."""

from firstorder.models.blobs import isosurface, metaballs
from firstorder.models.knots import torus_knot
from firstorder.models.plants import fern, tree
from firstorder.models.primitives import (
    bar_lattice,
    bumpy_sphere,
    displaced_ground,
    join_meshes,
    place_mesh,
    quad_triangles,
    ripples,
    rotation_about,
)

__all__ = [
    "bumpy_sphere",
    "displaced_ground",
    "ripples",
    "bar_lattice",
    "metaballs",
    "isosurface",
    "torus_knot",
    "tree",
    "fern",
    "join_meshes",
    "place_mesh",
    "rotation_about",
    "quad_triangles",
]
