"""Files: scenes, drawings, panoramas, records; only here are packages imported that read them."""

from firstorder.io.images import read_picture, read_row
from firstorder.io.meshes import Embree, MeshHits, read_mesh
from firstorder.io.records import whole, write_csv, write_json, write_npz, write_text
from firstorder.io.scenes.flatland_toml import (
    read_toml,
    scene_from_toml,
    scene_to_toml,
    write_toml,
)
from firstorder.io.scenes.read import read_scene
from firstorder.io.scenes.space_text import described, space_to_toml, write_space
from firstorder.io.scenes.space_toml import Model, Space, is_space, read_space, space_from_toml
from firstorder.io.skies import read_panorama
from firstorder.io.svg.svg import read_svg, scene_from_svg

__all__ = [
    "read_scene",
    "read_toml",
    "write_toml",
    "scene_from_toml",
    "scene_to_toml",
    "read_svg",
    "scene_from_svg",
    "read_picture",
    "read_row",
    "read_space",
    "write_space",
    "space_from_toml",
    "space_to_toml",
    "is_space",
    "described",
    "Space",
    "Model",
    "read_panorama",
    "read_mesh",
    "Embree",
    "MeshHits",
    "whole",
    "write_csv",
    "write_json",
    "write_npz",
    "write_text",
]
