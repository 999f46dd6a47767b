"""Triangle meshes: adjacency, curvature."""
