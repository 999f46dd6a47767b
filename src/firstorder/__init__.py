"""The calculus of light: radiance, its gradient, its Hessian and its spectrum, from source to eye.

The table of contents, in reading order:

- `conventions`: every sign, origin and unit, written once;
- `fields`: light fields and their portraits (jet, spectrum, covariance, wavelets);
- `laws`: the five operators on them (move, warp, multiply, integrate, convolve);
- `transport`: events of light (travel, occlusion, rotation, reflection, ...), and paths;
- `visibility`: edges of blockers (their angles and motion, merged blockers);
- `sampling`: random sampling (strata, distributions, estimates with error bars);
- `scene`: parts that both worlds share (derivatives, primitives, intersection);
- `flatland`: a world small enough to be exact (shapes, scenes, irradiance, indirect light);
- `space`: the world of three dimensions (shapes, silhouettes, irradiance, meshes);
- `imaging`: images in space (camera, hits, surface maps, shading);
- `models`: procedural models (primitives, blobs, knots, plants);

and what the calculus buys:

- `caching`: irradiance caches (records, radii, errors);
- `shadowfield`: shadows as a light field (its spectrum, the wedge, sheared filters);
- `bandwidth`: band limits of light, and sampling rates of pixels;
- `reconstruction`: adaptive sampling and interpolation of curves and images;
- `rendering`: whole images to files (tiles, passes, shadow rays through meshes);

beside which stand

- `checks`: verification (squares, faults, tolerances, statistics);
- `ledger`: ledgers of equations (rows, proofs, numeric routes, attacks);
- `jobs`: many independent jobs, here or on other machines (sweeps of a table);
- `io`: files (scenes, drawings, meshes, images, records);
- `symbolic`: formulas of fields and paths, events from expressions (brings sympy);
- `plotting`: pictures (brings matplotlib);
- `session`: float64, and a cache of what was compiled;
- `numerics`: numerical tools (quadrature, batches, vectors);
- `errors`, `typing`: exceptions and types.

Importing the package sets no JAX flag and loads none of these: each comes when it is first asked
for, `firstorder.space` as well as `from firstorder import space`.
"""

from typing import TYPE_CHECKING

from firstorder._on_demand import on_demand

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
    from firstorder import ledger as ledger
    from firstorder import jobs as jobs
    from firstorder import io as io
    from firstorder import symbolic as symbolic
    from firstorder import plotting as plotting
    from firstorder import session as session
    from firstorder import numerics as numerics
    from firstorder import errors as errors
    from firstorder import typing as typing

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
    "ledger",
    "jobs",
    "io",
    "symbolic",
    "plotting",
    "session",
    "numerics",
    "errors",
    "typing",
]

# A chapter is imported when it is first asked for, so that the table of contents costs nothing.
__getattr__, __dir__ = on_demand(__name__, __all__)
