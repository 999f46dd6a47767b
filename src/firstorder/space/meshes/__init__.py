"""Triangle meshes with adjacency and normals."""

from firstorder.space.meshes.triangle_mesh import Mesh, mesh, vertex_normals

__all__ = [
    "Mesh",
    "mesh",
    "vertex_normals",
]
