"""The calculus of light: radiance, its gradient, its Hessian and its spectrum, from source to eye.

The table of contents, in reading order:

- `conventions`: every sign, origin and unit, written once;
- `fields`: what light is (a field and its portraits: jet, spectrum, covariance, wavelets);
- `laws`: what mathematics does to it (move, warp, multiply, integrate, convolve);
- `transport`: what happens to light (travel, occlusion, rotation, reflection, ...), and paths;
- `visibility`: where light breaks (edges of shadows and their motion, merged blockers);
- `sampling`: where to look (strata, samplers with their densities, estimates with error bars);
- `flatland`: a world small enough to be exact (shapes, scenes, irradiance, light that bounces);
- `space`: the same in three dimensions (silhouettes, light along them, gathered light, meshes);
- `methods`: what the calculus buys (interpolation, caching, adaptive sampling, sheared filters);
- `checks`: why you can believe it;
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
    from firstorder import flatland as flatland
    from firstorder import space as space
    from firstorder import methods as methods

__version__ = "0.1.0"

__all__ = [
    "conventions",
    "fields",
    "laws",
    "transport",
    "visibility",
    "sampling",
    "flatland",
    "space",
    "methods",
]


def __getattr__(name: str):
    """Import a chapter when it is first asked for, so that the table of contents costs nothing."""
    if name in __all__:
        return importlib.import_module(f"firstorder.{name}")
    raise AttributeError(f"module 'firstorder' has no attribute {name!r}")
