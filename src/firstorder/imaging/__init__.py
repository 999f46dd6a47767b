"""Images in space: cameras, surface maps, and shading under area lights and skies.

Parts:

- `imaging.camera`: rays of a pinhole camera, and their footprints;
- `imaging.images`: images of a scene, with gradients;
- `imaging.hits`: G-buffers, the surface attributes of each pixel;
- `imaging.shading`: shading of pixels, term by term of their gradients;
- `imaging.sky_lights`: skies and distant lamps as nodes;
- `imaging.surface_maps`: bumps, normal maps and textures;
- `imaging.facets`: shading points of meshes.
"""

from firstorder.imaging._area_lights import SurfaceReflectance
from firstorder.imaging._bumps import NormalMap
from firstorder.imaging._lamps import Lamp, SampledLight
from firstorder.imaging._point_shading import ShadedPixels
from firstorder.imaging._reflection import (
    ReflectedRadiance,
    SurfacePoint,
    reflected_radiance,
    surface_point,
)
from firstorder.imaging._textures import (
    HeightMap,
    ImageTexture,
    SolidSlopes,
    SolidWaves,
    image_normal_map,
)
from firstorder.imaging.camera import Pinhole, PixelFootprint, image_gradient, pinhole
from firstorder.imaging.facets import Facets, mesh_facets
from firstorder.imaging.hits import GBuffer, PrimaryHits, facet_gbuffer, gbuffer, primary_hits
from firstorder.imaging.images import (
    RenderedImage,
    pixel_grid,
    pixel_labels,
    pixel_positions,
    render,
)
from firstorder.imaging.shading import shade_pixels
from firstorder.imaging.sky_lights import CosineSkyLight, DistantLight, distant_lamp, sky_light
from firstorder.imaging.surface_maps import PerPrimitive, SurfaceMaps, UVMaps

__all__ = [
    "Pinhole",
    "pinhole",
    "PixelFootprint",
    "image_gradient",
    "primary_hits",
    "PrimaryHits",
    "GBuffer",
    "gbuffer",
    "facet_gbuffer",
    "Facets",
    "mesh_facets",
    "SurfacePoint",
    "surface_point",
    "ReflectedRadiance",
    "reflected_radiance",
    "SurfaceReflectance",
    "SurfaceMaps",
    "UVMaps",
    "PerPrimitive",
    "SolidWaves",
    "SolidSlopes",
    "ImageTexture",
    "HeightMap",
    "NormalMap",
    "image_normal_map",
    "SampledLight",
    "Lamp",
    "DistantLight",
    "CosineSkyLight",
    "sky_light",
    "distant_lamp",
    "ShadedPixels",
    "shade_pixels",
    "RenderedImage",
    "pixel_grid",
    "pixel_positions",
    "pixel_labels",
    "render",
]
