"""Mitsuba 3: which variant runs here, light at a place, and images of derivatives.

Its LLVM variants want a shared library of LLVM 19 or newer: that of `DRJIT_LIBLLVM_PATH`, or else
of the wheel karellen-llvm-core, which the extra `peers` has for Linux, or else what lies in the
usual places. Without one `scalar_rgb` runs, which has no derivatives.
"""

from __future__ import annotations

import functools
import importlib.metadata
import os
import pathlib
from typing import Any, NamedTuple

import equinox as eqx
import jax.numpy as jnp
import numpy as np

from firstorder.io import space_to_mitsuba
from firstorder.space import Scene

LLVM, WHEEL = "DRJIT_LIBLLVM_PATH", "karellen-llvm-core"
OLDEST = 19  # of LLVM: Dr.Jit also takes older ones, which end the process in some kernels
EYE = 0.01  # how far above a place its ray starts [m]
CAMERA = 0.5  # how far above the floor the camera is, below what hangs there [m]


@functools.cache
def variant() -> str:
    """The one that runs here, which is then set, on one thread."""
    if LLVM not in os.environ and (library := _library()):
        os.environ[LLVM] = library
    import drjit as dr
    import mitsuba as mi

    mi.set_variant("scalar_rgb")
    try:
        mi.set_variant("llvm_ad_rgb")
        version = int(dr.detail.llvm_version()[0])
    except ImportError:
        version = 0
    if version < OLDEST:
        mi.set_variant("scalar_rgb")
    mi.set_log_level(mi.LogLevel.Error)
    dr.set_thread_count(1)
    return mi.variant()


def _library() -> str | None:
    """Where the wheel has its LLVM, if it is installed."""
    try:
        files = importlib.metadata.files(WHEEL) or []
    except importlib.metadata.PackageNotFoundError:
        return None
    found = [path for file in files if (path := pathlib.Path(str(file.locate()))).is_file()
             and file.name.startswith("libLLVM.so")]  # fmt: skip
    return os.path.realpath(found[0]) if found else None


def loaded(scene: Scene) -> Any:
    """A scene of ours as Mitsuba's, by the library's own export."""
    variant()  # before Mitsuba is imported: it looks for LLVM then
    import mitsuba as mi

    return mi.load_dict(space_to_mitsuba(scene, transform=mi.ScalarTransform4f))


def irradiance(
    scene: Any, place: Any, samples: int, seed: int, depth: int = 2, albedo=1.0
) -> float:
    """E at a place of a floor, from what the floor sends up.

    Args:
        scene: of `loaded`.
        place: x and y [m].
        samples: on the place.
        seed: of the random numbers.
        depth: of the paths; 2 for direct light, which is then sampled on the lamps alone.
        albedo: of the floor.
    """
    import mitsuba as mi

    direct = {"type": "direct", "emitter_samples": 1, "bsdf_samples": 0}
    path = {"type": "path", "max_depth": depth, "rr_depth": 1000}
    integrator = mi.load_dict(direct if depth == 2 else path)
    image = mi.render(scene, sensor=_meter(place), integrator=integrator, spp=samples, seed=seed)
    return float(np.mean(np.array(image))) * np.pi / albedo


def _meter(place: Any) -> Any:
    import mitsuba as mi

    x, y = map(float, place)
    down = mi.ScalarTransform4f().look_at([x, y, EYE], [x, y, 0.0], [0.0, 1.0, 0.0])
    return mi.load_dict({
        "type": "radiancemeter", "to_world": down, "film": _film(1, 1),
        "sampler": {"type": "stratified"},
    })  # fmt: skip


def _film(columns: int, rows: int) -> dict[str, Any]:
    return {"type": "hdrfilm", "width": columns, "height": rows, "rfilter": {"type": "box"},
            "pixel_format": "luminance", "component_format": "float32"}  # fmt: skip


def with_white(scene: Scene, number: int) -> Scene:
    """The scene with one shape made white, so that what it sends up is seen."""
    albedo = jnp.asarray(scene.material.albedo).at[number].set(1.0)
    return eqx.tree_at(lambda s: s.material.albedo, scene, albedo)


# --- images of derivatives -----------------------------------------------------------------------


class Window(NamedTuple):
    """A part of the floor in square pixels, row by row from the top."""

    low: tuple[float, float]
    columns: int
    rows: int
    pixel: float

    def centers(self) -> np.ndarray:
        """Middles of the pixels (n, 2) [m]."""
        x = self.low[0] + (np.arange(self.columns) + 0.5) * self.pixel
        y = self.low[1] + (np.arange(self.rows)[::-1] + 0.5) * self.pixel
        return np.stack(np.meshgrid(x, y), -1).reshape(-1, 2)


def projective(
    scene: Any, window: Window, moved: list[str], samples: int, seed: int, guiding: str = "octree"
) -> np.ndarray:
    """How E of each pixel changes as some shapes move along x and y (n, 2) [W/m^3].

    By `direct_projective` in forward mode; an octree guides the samples on silhouettes, unless
    `guiding` is "none". The camera itself sees no silhouette.
    """
    import drjit as dr
    import mitsuba as mi

    parameters = mi.traverse(scene)
    integrator = mi.load_dict({"type": "direct_projective", "sppp": 0, "guiding": guiding})
    keys = [f"{name}.{k}" for name in moved for k in ("to_world", "vertex_positions")]
    start = {key: dr.copy(parameters[key]) for key in keys if key in parameters}
    images = []
    for axis in (0, 1):
        step = mi.Float(0.0)
        dr.enable_grad(step)
        shift = mi.Vector3f(step, 0.0, 0.0) if axis == 0 else mi.Vector3f(0.0, step, 0.0)
        for key, value in start.items():
            parameters[key] = _moved(value, shift)
        parameters.update()
        image = mi.render(
            scene, parameters, sensor=_camera(window), integrator=integrator,
            spp=1, spp_grad=samples, seed=2 * seed + axis, seed_grad=2 * seed + axis + 1_000_000,
        )  # fmt: skip
        dr.forward(step)
        images.append(np.pi * np.array(dr.grad(image))[..., 0].ravel())
    for key, value in start.items():
        parameters[key] = value
    parameters.update()
    return np.stack(images, -1)


def _moved(value: Any, shift: Any) -> Any:
    """A transform, or the corners of a mesh, after a step."""
    import drjit as dr
    import mitsuba as mi

    if isinstance(value, mi.Transform4f):
        return mi.Transform4f().translate(shift) @ value
    return dr.ravel(dr.unravel(mi.Point3f, value) + shift)


def _camera(window: Window) -> Any:
    import mitsuba as mi

    wide, high = window.columns * window.pixel, window.rows * window.pixel
    x, y = window.low[0] + 0.5 * wide, window.low[1] + 0.5 * high
    down = mi.ScalarTransform4f().look_at([x, y, CAMERA], [x, y, 0.0], [0.0, 1.0, 0.0])
    return mi.load_dict({
        "type": "perspective", "fov": float(np.degrees(2.0 * np.arctan(0.5 * wide / CAMERA))),
        "fov_axis": "x", "near_clip": EYE, "far_clip": 10.0, "to_world": down,
        "film": _film(window.columns, window.rows), "sampler": {"type": "independent"},
    })  # fmt: skip
