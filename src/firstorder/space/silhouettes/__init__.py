"""Silhouettes of shapes and meshes, their visible parts, and integrals along them."""

from firstorder.space.silhouettes.analytic import Silhouette, silhouette
from firstorder.space.silhouettes.face_tracers import BruteForceTracer, FaceTracer
from firstorder.space.silhouettes.meshes import (
    MeshSilhouettes,
    mesh_net_visibility,
    mesh_silhouette,
    visible_mesh_silhouettes,
)
from firstorder.space.silhouettes.visible import VisibleSilhouettes, visible_silhouettes

__all__ = [
    "Silhouette",
    "silhouette",
    "VisibleSilhouettes",
    "visible_silhouettes",
    "mesh_silhouette",
    "MeshSilhouettes",
    "visible_mesh_silhouettes",
    "mesh_net_visibility",
    "FaceTracer",
    "BruteForceTracer",
]
