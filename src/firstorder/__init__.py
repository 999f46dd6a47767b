"""The calculus of light: radiance, its gradient, its Hessian and its spectrum, from source to eye.

The table of contents, in reading order:

- `conventions`: every sign, origin and unit, written once;
- `fields`: what light is (a field and its portraits: jet, spectrum, covariance, wavelets);
- `laws`: what mathematics does to it (move, warp, multiply, integrate, convolve);
- `transport`: what happens to light (travel, occlusion, rotation, reflection, ...), and paths;
- `visibility`: where light breaks (edges of shadows and their motion, merged blockers);
- `sampling`: where to look (strata, samplers with their densities, estimates with error bars);
- `scene`: what scenes of both worlds share (primitives, intersection, the geometry term);
- `flatland`: a world small enough to be exact (shapes, scenes, irradiance, light that bounces);
- `space`: the same in three dimensions (silhouettes, light along them, gathered light, meshes);
- `imaging`: images in space (camera, hits, surface maps, shading);
- `models`: procedural models (primitives, blobs, knots, plants);

and what the calculus buys:

- `caching`: irradiance caches (radii, records, what either choice costs);
- `shadowfield`: shadows as a light field (its spectrum, the wedge, sheared filters);
- `bandwidth`: how densely light must be sampled;
- `reconstruction`: where to put samples, and what lies between them;
- `rendering`: whole images to files (tiles, passes, shadow rays through meshes);

beside which stand

- `checks`: why you can believe it;
- `io`: files (scenes, drawings, meshes, images, records);
- `plotting`: pictures (import it yourself: it brings matplotlib).

Importing the package sets no JAX flag; see `firstorder.session` for float64.
"""

import importlib
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from firstorder import conventions as conventions
    from firstorder import fields as fields
    from firstorder import laws as laws
    from firstorder import transport as transport
    from firstorder import visibility as visibility
    from firstorder import sampling as sampling
    from firstorder import scene as scene
    from firstorder import flatland as flatland
    from firstorder import space as space
    from firstorder import imaging as imaging
    from firstorder import models as models
    from firstorder import caching as caching
    from firstorder import shadowfield as shadowfield
    from firstorder import bandwidth as bandwidth
    from firstorder import reconstruction as reconstruction
    from firstorder import rendering as rendering
    from firstorder import checks as checks
    from firstorder import io as io

__version__ = "0.1.0"

__all__ = [
    "conventions",
    "fields",
    "laws",
    "transport",
    "visibility",
    "sampling",
    "scene",
    "flatland",
    "space",
    "imaging",
    "models",
    "caching",
    "shadowfield",
    "bandwidth",
    "reconstruction",
    "rendering",
    "checks",
    "io",
]


def __getattr__(name: str):
    """Import a chapter when it is first asked for, so that the table of contents costs nothing."""
    if name in __all__:
        return importlib.import_module(f"firstorder.{name}")
    raise AttributeError(f"module 'firstorder' has no attribute {name!r}")
