"""What is looked at before a scene is asked for light: numbers, counts, and whether any comes.

All of it by NumPy on concrete arguments, in some microseconds: under `jit` nothing is looked at. An
answer of zero that has a plain reason comes with a warning, `errors.NoLight`, that says the reason;
Python shows it once for each line of the caller.
"""

from __future__ import annotations

import functools
import math
import warnings
import weakref
from collections.abc import Callable
from typing import Any, NamedTuple, ParamSpec, TypeVar

import jax
import jax.numpy as jnp
import numpy as np

from firstorder._argument_checks import check_count, check_index, is_concrete
from firstorder.errors import NoLight
from firstorder.scene._primitives import BACK, FRONT
from firstorder.scene._words import check_one_scene
from firstorder.session import warn_of_single_precision

P = ParamSpec("P")
R = TypeVar("R")

# From the warning to the caller of a public function.
_LEVEL = 4

_DARK = (
    "Nothing in the scene shines, so no light arrives: give a primitive an `emission`, or the "
    "scene an `environment`."
)


def check_question(scene: Any, at: Any, *, nodes: Any = None, **_: Any) -> None:
    """Refuses a receiver on a shape that is not there, and a count that is none.

    Raises:
        TypeError: if the number of the receiver's shape is no integer.
        ValueError: if there is no such shape, or `nodes` is not positive.
    """
    warn_of_single_precision(_LEVEL - 1)
    if nodes is not None:
        check_count("nodes", nodes)
    _on(scene, at)


def check_lit(scene: Any, at: Any, *, radiance: Any = None, **options: Any) -> None:
    """`check_question`, and a warning if plainly no light arrives.

    Told are a scene in which nothing shines, lamps that all turn their dark side to the receiver,
    and a receiver inside of a circle with all light outside. What stands in the way, and lamps
    below the horizon, are not looked at: their zero is an answer.

    Args:
        scene: of either world.
        at: one receiver.
        radiance: given, it is the light, and emission does not count.
        options: of the public function.
    """
    warn_of_single_precision(_LEVEL - 1)
    if (nodes := options.get("nodes")) is not None:
        check_count("nodes", nodes)
    on = _on(scene, at)
    if on is None or radiance is not None:
        return
    known = _lights(scene)
    if not known.any:
        _warn(_DARK)
    elif known.sided:
        _check_sides(scene, known, np.asarray(at.position), on)


def check_shines(scene: Any) -> None:
    """Warns if nothing in a scene shines; a traced scene is not looked at.

    Called by functions that are plain Python outside and compile what is inside of them.
    """
    if getattr(scene, "material", None) is None or not is_concrete(scene):
        return  # what is no scene is refused by the function itself
    warn_of_single_precision(_LEVEL - 1)
    if not _lights(scene).any:
        _warn(_DARK)


def warns_if_dark(function: Callable[P, R]) -> Callable[P, R]:
    """A function of a scene that asks `check_shines` first, of all bands at once."""

    @functools.wraps(function)
    def warning(*args: P.args, **kwargs: P.kwargs) -> R:
        check_shines(args[0] if args else kwargs.get("scene"))
        return function(*args, **kwargs)

    return warning


def _check_sides(scene: Any, known: _Lights, position: np.ndarray, on: int) -> None:
    """Warns if the receiver sees dark sides alone, or the inside of a circle that is dark."""
    if not math.isfinite(position.sum()):
        return
    # By the class: a method of a module is itself a module, which takes longer than its answer.
    heights = np.concatenate([type(group).height(group, position) for group in known.groups])
    lit = known.emission
    shown = lit[~(heights <= 0.0), FRONT].any() or lit[~(heights >= 0.0), BACK].any()
    if not (known.far or shown or (on >= 0 and lit[on].any())):
        _warn(
            "All that shines turns its dark side or its edge to the receiver, so no light arrives: "
            "give `primitive` a point to look at, `facing=`, or `two_sided=True`."
        )
        return
    for k in np.flatnonzero(known.closed & (heights < 0.0)):
        if k != on and not _lit_inside(scene, known, int(k)):
            name = f" (`{scene.names[k]}`)" if scene.names[k] else ""
            _warn(
                f"The receiver lies inside of shape {k}{name} and all that shines outside of it, "
                "so no light arrives."
            )
            return


def _on(scene: Any, at: Any) -> int | None:
    """Number of the shape on which the receiver lies, checked.

    None if it is no scene and one receiver of its world: the function itself refuses these.

    Raises:
        ValueError: if there are several scenes in one.
    """
    worlds = [type(x).__module__.split(".", 2)[:2] for x in (scene, at)]
    names, on = (getattr(x, name, None) for x, name in ((scene, "names"), (at, "on")))
    if worlds[0] != worlds[1] or names is None or on is None or np.ndim(on):
        return None
    check_one_scene(scene)
    number = int(on)
    if number >= len(names):
        check_index("on", number, len(names))
    return number


class _Lights(NamedTuple):
    """Lights of a scene: what is looked at once and holds for every receiver.

    Attributes:
        far: whether there is light that has no shape.
        emission: front and back of each shape.
        closed: which shapes are.
        sided: whether it may matter on which side of the shapes a point lies.
        groups: the shapes, with NumPy's numbers.
    """

    far: bool
    emission: np.ndarray
    closed: np.ndarray
    sided: bool
    groups: tuple[Any, ...]

    @property
    def any(self) -> bool:
        """Whether there is a light at all."""
        return self.far or bool(self.emission.any())


# By the scene's identity, for as long as it lives: a module has no hash.
_kept: dict[int, tuple[weakref.ref, _Lights]] = {}


def _lights(scene: Any) -> _Lights:
    """The lights of a scene, looked at once."""
    key = id(scene)
    kept = _kept.get(key)
    if kept is not None and kept[0]() is scene:
        return kept[1]
    groups = jax.tree.map(np.asarray, scene.groups)
    closed = np.repeat([g.closed for g in groups], [g.count for g in groups])
    emission, far = np.asarray(scene.material.emission), _shines_from_afar(scene)
    if emission.ndim == 3:  # what shines in any band shines
        emission = emission.max(-1)
    found = _Lights(far, emission, closed, not far or bool(closed.any()), groups)
    _kept[key] = weakref.ref(scene, lambda _: _kept.pop(key, None)), found
    return found


def _shines_from_afar(scene: Any) -> bool:
    """Whether there is light that has no shape: a sky that is not black, or point lights."""
    points = getattr(scene, "points", None)
    if points is not None and np.asarray(points.intensity).any():
        return True
    sky = scene.environment
    if callable(sky):
        radiance = getattr(sky, "radiance", 1.0)
        return callable(radiance) or bool(np.any(np.asarray(radiance)))
    return sky is not None and bool(np.any(np.asarray(sky)))


def _lit_inside(scene: Any, known: _Lights, k: int) -> bool:
    """Whether something shines inside of a closed shape of flatland, or may."""
    if known.emission[k, BACK] or k in np.ravel(scene.crossings.pairs):
        return True
    with jax.ensure_compile_time_eval():  # a jitted function may ask about a concrete scene
        half = jnp.asarray(0.5)
        middles = [jax.vmap(lambda one: one.motion(half)[0])(g) for g in scene.groups]
    lamps = np.concatenate(middles)[known.emission.any(-1)]
    points = np.asarray(scene.points.position)[np.asarray(scene.points.intensity) != 0.0]
    first = np.cumsum([0, *(g.count for g in known.groups)])
    group = np.searchsorted(first, k, side="right") - 1
    row = k - first[group]
    return any(known.groups[group].height(place)[row] < 0.0 for place in (*lamps, *points))


def _warn(words: str) -> None:
    warnings.warn(words, NoLight, stacklevel=_LEVEL)
