"""What is looked at before a scene is asked for light: numbers, counts, and whether any comes.

All of it by NumPy on concrete arguments, in some microseconds: under `jit` nothing is looked at. An
answer of zero that has a plain reason comes with a warning, `errors.NoLight`, that says the reason;
Python shows it once for each line of the caller.
"""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from typing import Any

import jax
import numpy as np

from firstorder._argument_checks import check_count, check_index
from firstorder.errors import NoLight
from firstorder.scene._primitives import BACK, FRONT

# From the warning to the caller of a public function: `_warn`, the check, the entry.
_LEVEL = 4


def check_question(scene: Any, at: Any, *, nodes: Any = None, **_: Any) -> None:
    """Refuses a receiver on a shape that is not there, and a count that is none.

    Raises:
        TypeError: if the number of the receiver's shape is no integer.
        ValueError: if there is no such shape, or `nodes` is not positive.
    """
    if nodes is not None:
        check_count("nodes", nodes)
    if _one_of_a_world(scene, at) and int(at.on) >= scene.count:
        check_index("on", at.on, scene.count)


def check_lit(scene: Any, at: Any, *, radiance: Any = None, **options: Any) -> None:
    """`check_question`, and a warning if plainly no light arrives.

    Told are a scene in which nothing shines, lamps that all turn their dark side to the receiver,
    and a receiver inside of a closed shape (circles) with all light outside. What stands in the
    way, and lamps below the horizon, are not looked at: their zero is an answer.

    Args:
        scene: of either world.
        at: one receiver.
        radiance: given, it is the light, and emission does not count.
        options: of the public function.
    """
    check_question(scene, at, **options)
    if radiance is not None or not _one_of_a_world(scene, at):
        return
    emission = np.asarray(scene.material.emission)
    far = shines_from_afar(scene)
    if not (far or emission.any()):
        _warn(
            "Nothing in the scene shines, so no light arrives: give a primitive an `emission`, or "
            "the scene an `environment`."
        )
        return
    position, on = np.asarray(at.position), int(at.on)
    if not np.all(np.isfinite(position)):
        return
    heights = [group.height(position) for group in scene.groups]
    on_lamp = on >= 0 and emission[on].any()
    if not (far or on_lamp or _shown(scene, emission, heights)):
        _warn(
            "All that shines turns its dark side or its edge to the receiver, so no light arrives: "
            "give `primitive` a point to look at, `facing=`, or `two_sided=True`."
        )
        return
    for k, group, row in _around(scene, heights, on):
        if not _lit_inside(scene, emission, k, group, row):
            name = f" (`{scene.names[k]}`)" if scene.names[k] else ""
            _warn(
                f"The receiver lies inside of shape {k}{name} and all that shines outside of it, "
                "so no light arrives."
            )
            return


def _one_of_a_world(scene: Any, at: Any) -> bool:
    """Whether it is a scene and one receiver of its world; the function itself refuses the rest."""
    where = [type(x).__module__.split(".")[:2] for x in (scene, at)]
    return where[0] == where[1] and hasattr(scene, "groups") and np.ndim(getattr(at, "on", ())) == 0


def shines_from_afar(scene: Any) -> bool:
    """Whether there is light that has no shape: a sky that is not black, or point lights."""
    points = getattr(scene, "points", None)
    if points is not None and np.any(points.intensity):
        return True
    sky = scene.environment
    if sky is None:
        return False
    if callable(sky):
        radiance = getattr(sky, "radiance", 1.0)
        return callable(radiance) or bool(np.any(radiance))
    return bool(np.any(sky))


def _shown(scene: Any, emission: np.ndarray, heights: list) -> bool:
    """Whether a side that shines may be turned to the receiver."""
    first = 0
    for group, height in zip(scene.groups, heights, strict=True):
        rows = emission[first : first + group.count]
        first += group.count
        if height is None:
            if rows.any():
                return True
        elif rows[~(height <= 0.0), FRONT].any() or rows[~(height >= 0.0), BACK].any():
            return True
    return False


def _around(scene: Any, heights: list, on: int) -> Iterator[tuple[int, Any, int]]:
    """Closed shapes around the receiver: number, group and row in it; of kinds that tell it."""
    first = 0
    for group, height in zip(scene.groups, heights, strict=True):
        if group.closed and height is not None:
            for row in np.flatnonzero(height < 0.0):
                if first + row != on:
                    yield first + int(row), group, int(row)
        first += group.count


def _lit_inside(scene: Any, emission: np.ndarray, k: int, group: Any, row: int) -> bool:
    """Whether something shines inside of a closed shape of flatland, or may."""
    if emission[k, BACK] or k in np.ravel(scene.crossings.pairs):
        return True
    middles = [jax.vmap(lambda one: one.motion(0.5)[0])(g) for g in scene.groups]
    lamps = np.concatenate(middles)[emission.any(-1)]
    places = [*lamps, *np.asarray(scene.points.position)[np.asarray(scene.points.intensity) != 0.0]]
    return any(group.height(place)[row] < 0.0 for place in places)


def _warn(words: str) -> None:
    warnings.warn(words, NoLight, stacklevel=_LEVEL)
