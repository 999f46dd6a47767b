"""Files: scenes, drawings, panoramas, records; no other package imports file readers."""

from firstorder.io.exr import read_layers, write_layers
from firstorder.io.files import atomic_write, write_csv, write_json, write_npz, write_text
from firstorder.io.images import linear_from_srgb, read_image, read_panorama_row
from firstorder.io.labelled import curve_to_pandas, layers_to_xarray
from firstorder.io.meshes import Embree, MeshHits, read_mesh, read_mesh_uv
from firstorder.io.radiance_ambient import (
    AmbientRecords,
    ambient_from_cache,
    cache_from_ambient,
    read_ambient,
    write_ambient,
)
from firstorder.io.rays import read_rays, write_rays
from firstorder.io.scenes._skies import read_panorama
from firstorder.io.scenes._surface_maps import MapSet, surface_maps_of
from firstorder.io.scenes.flatland_toml import (
    flatland_from_toml,
    flatland_to_toml,
    read_flatland,
    write_flatland,
)
from firstorder.io.scenes.mitsuba import read_mitsuba, space_from_mitsuba
from firstorder.io.scenes.mitsuba_text import space_to_mitsuba, write_mitsuba
from firstorder.io.scenes.read import read_scene
from firstorder.io.scenes.space_text import describe_space, space_to_toml, write_space
from firstorder.io.scenes.space_toml import (
    MeshModel,
    SpaceFile,
    is_space,
    read_space,
    space_from_toml,
)
from firstorder.io.svg.reader import read_svg

__all__ = [
    "read_scene",
    "read_flatland",
    "write_flatland",
    "flatland_from_toml",
    "flatland_to_toml",
    "read_svg",
    "read_space",
    "write_space",
    "space_from_toml",
    "space_to_toml",
    "is_space",
    "describe_space",
    "read_mitsuba",
    "write_mitsuba",
    "space_from_mitsuba",
    "space_to_mitsuba",
    "SpaceFile",
    "MeshModel",
    "MapSet",
    "surface_maps_of",
    "read_mesh",
    "read_mesh_uv",
    "Embree",
    "MeshHits",
    "read_image",
    "linear_from_srgb",
    "read_panorama_row",
    "read_panorama",
    "write_layers",
    "read_layers",
    "curve_to_pandas",
    "layers_to_xarray",
    "read_rays",
    "write_rays",
    "AmbientRecords",
    "read_ambient",
    "write_ambient",
    "ambient_from_cache",
    "cache_from_ambient",
    "atomic_write",
    "write_text",
    "write_json",
    "write_npz",
    "write_csv",
]
