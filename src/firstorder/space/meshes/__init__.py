"""Triangle meshes: adjacency, curvature."""

from firstorder.space.meshes.curvature import Curvatures, curvatures_from_normals, fitted_curvatures
from firstorder.space.meshes.triangle_mesh import Mesh, mesh, vertex_normals, vertex_rings

__all__ = [
    "Mesh",
    "mesh",
    "vertex_normals",
    "vertex_rings",
    "Curvatures",
    "fitted_curvatures",
    "curvatures_from_normals",
]
