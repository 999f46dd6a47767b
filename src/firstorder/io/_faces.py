"""Faces of meshes as files have them."""

from __future__ import annotations

import numpy as np


def valid_faces(faces: np.ndarray) -> np.ndarray:
    """Mask of faces with three vertices: `space.meshes.triangle_mesh.mesh` omits the others."""
    a, b, c = faces.T
    return (a != b) & (b != c) & (c != a)
