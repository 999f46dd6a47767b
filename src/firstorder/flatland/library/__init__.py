"""Scenes by name, the blockers of E11's figures, and bumpy ground."""

from firstorder.flatland.library._scenes import (
    describe_scene,
    fig14,
    fig15,
    named_scene,
    r07_fig09,
    r07_fig16,
    r07_fig17,
    scene_a,
    scene_b,
    scene_c,
    scene_d,
    scene_names,
)
from firstorder.flatland.library.bumps import Bumps, ChirpBumps, SineBumps, bumpy_ground

__all__ = [
    "scene_a",
    "scene_b",
    "scene_c",
    "scene_d",
    "fig14",
    "fig15",
    "r07_fig09",
    "r07_fig16",
    "r07_fig17",
    "scene_names",
    "named_scene",
    "describe_scene",
    "Bumps",
    "SineBumps",
    "ChirpBumps",
    "bumpy_ground",
]
