"""What the checks of scenes ask of each world, and its programs, compiled once a precision."""

from __future__ import annotations

import contextlib
import functools
from collections.abc import Callable, Iterator, Mapping
from typing import Any, NamedTuple

import jax
import numpy as np

from tests.fuzz.flatland import changes as flat_changes
from tests.fuzz.flatland import classes as flat_classes
from tests.fuzz.flatland import digits, layout
from tests.fuzz.flatland import rays as flat_rays
from tests.fuzz.space import changes as space_changes
from tests.fuzz.space import layout as space_layout
from tests.fuzz.space import planes as space_planes
from tests.fuzz.space import rays as space_rays

RAYS = 1 << 12
PRECISIONS = {"float64": np.float64, "float32": np.float32}


class World(NamedTuple):
    """A world's scenes, and the questions that can be asked about them.

    Scenes are a tuple of arrays with one scene a row.

    Attributes:
        name: of it.
        classes: by name, for their docstrings.
        drawn: class, random numbers and count to scenes.
        light: irradiance of one scene, by the library.
        changes: of scenes, that leave irradiance as it is.
        by_rays: scenes, row, precision and number of rays to irradiance and a bound on its error.
        truth: the same, exact enough to tell two numbers so far apart from each other.
        refused: which scenes may be NaN.
        unanswered: which may be wrong.
        sharpness: by how much rounding of coordinates turns a surface.
        hemisphere: irradiance under a sky of radiance one.
        batch: scenes that are drawn and computed together.
    """

    name: str
    classes: Mapping[str, Any]
    drawn: Callable[..., Any]
    light: Callable[..., Any]
    changes: tuple[Callable[..., Any], ...]
    by_rays: Callable[..., tuple[float, float]]
    truth: Callable[..., tuple[float, float]]
    refused: Callable[..., np.ndarray]
    unanswered: Callable[..., np.ndarray]
    sharpness: Callable[..., Any]
    hemisphere: float
    batch: int


FLATLAND = World(
    name="flatland",
    classes=flat_classes.CLASSES,
    drawn=flat_classes.drawn,
    light=layout.light,
    changes=flat_changes.CHANGES,
    by_rays=flat_rays.by_rays,
    truth=digits.exact,
    refused=flat_rays.refused,
    unanswered=flat_rays.unanswered,
    sharpness=lambda s: 1.0,
    hemisphere=2.0,
    batch=512,
)
SPACE = World(
    name="space",
    classes=space_planes.CLASSES,
    drawn=space_planes.drawn,
    light=space_layout.light,
    changes=space_changes.CHANGES,
    by_rays=space_rays.by_rays,
    truth=space_rays.truth,
    refused=space_rays.refused,
    unanswered=space_rays.unanswered,
    sharpness=space_layout.sharpness,
    hemisphere=np.pi,
    batch=64,
)
WORLDS = {world.name: world for world in (FLATLAND, SPACE)}


@contextlib.contextmanager
def numbers_of(precision: str) -> Iterator[None]:
    """JAX's default precision for a while."""
    with jax.enable_x64(precision == "float64"):
        yield


def _compiled(world: str, function: Callable[..., Any]) -> Callable[..., Any]:
    """A function of a batch; in space, where it runs the longest, optimised as tests are not."""
    options = {"xla_backend_optimization_level": 3} if world == "space" else None
    return jax.jit(jax.vmap(function), compiler_options=options)


@functools.cache
def value(world: str, precision: str) -> Callable[..., Any]:
    """Irradiance of a batch, compiled."""
    return _compiled(world, WORLDS[world].light)


@functools.cache
def jet(world: str, precision: str) -> Callable[..., Any]:
    """Irradiance, gradient in all numbers, and in flatland the Hessian times a direction."""
    light = jax.value_and_grad(WORLDS[world].light)

    def both(s: Any, steps: Any) -> Any:
        if world == "space":
            return (*light(s), None)
        (E, g), (_, turned) = jax.jvp(light, (s,), (steps,))
        return E, g, turned

    return _compiled(world, both)
