"""Scenes of space by name: those of the papers, and others."""

from firstorder.space.library._scenes import (
    clutter,
    describe_scene,
    j12_box,
    j12_occluder,
    named_scene,
    scene_names,
    sphere_over_plane,
    tables,
    three_spheres,
)

__all__ = [
    "j12_box",
    "j12_occluder",
    "clutter",
    "tables",
    "sphere_over_plane",
    "three_spheres",
    "scene_names",
    "named_scene",
    "describe_scene",
]
