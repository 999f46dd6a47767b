"""Whole images: to files in tiles and passes, through meshes, or on a budget of shadow rays."""

from firstorder.rendering._pixel_radiance import PixelRadiance
from firstorder.rendering.antialiasing import Antialiased, antialiased, subpixels
from firstorder.rendering.image_files import (
    image_coordinates,
    render_to_files,
    scene_fingerprint,
    world_from_scene,
)
from firstorder.rendering.renderer import Renderer, TileHits, World
from firstorder.rendering.shadow_rays import CameraHits, camera_hits, is_visible, mesh_blockers
from firstorder.rendering.shared_shadows import ExpectedImage, SharedShadows, share_shadow_rays
from firstorder.rendering.studio import LightRig, light_rig
from firstorder.rendering.tiles import render_tiles

__all__ = [
    "World",
    "Renderer",
    "PixelRadiance",
    "TileHits",
    "image_coordinates",
    "world_from_scene",
    "scene_fingerprint",
    "render_tiles",
    "render_to_files",
    "antialiased",
    "Antialiased",
    "subpixels",
    "light_rig",
    "LightRig",
    "mesh_blockers",
    "is_visible",
    "CameraHits",
    "camera_hits",
    "share_shadow_rays",
    "SharedShadows",
    "ExpectedImage",
]
