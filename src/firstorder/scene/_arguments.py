"""What the public calls of both worlds refuse by the look of it: names that are gone, wrong types.

A type is known without looking at numbers, so wrong ones are one sentence under `jit` too.
"""

from __future__ import annotations

import dataclasses
import functools
import inspect
from collections.abc import Mapping, Sequence
from typing import Any, TypeVar

import jax.numpy as jnp
from jaxtyping import Array

from firstorder._argument_checks import check_real
from firstorder.numerics._host import spread
from firstorder.scene._bands import check_one_band
from firstorder.scene._words import check_one_scene
from firstorder.typing import as_array, as_float

C = TypeVar("C", bound=type)

WORLDS = ("flatland", "space")
# How each thing is made, for those who gave something else.
MADE = {
    "Receiver": "write Receiver.at(position, normal)",
    "Scene": "write Scene.of(primitive(...), ...)",
}
# How a shape is made of what is none.
MADE_OF = {"Mesh": "write triangles(mesh)"}


def made_elsewhere(cls: C) -> C:
    """A class that another function makes: a call by hand that lacks a field names that function.

    Raises:
        TypeError: by the class, if a field is missing or another one is given.
    """
    make, signature = cls.__init__, inspect.signature(cls.__init__)

    @functools.wraps(make)
    def __init__(self, *fields, **named):
        try:
            signature.bind(self, *fields, **named)
        except TypeError:
            *first, last = (field.name for field in dataclasses.fields(cls))
            raise TypeError(
                f"A {cls.__name__} of {_world(cls)} holds {', '.join(first)} and {last}: "
                f"{MADE[cls.__name__]}."
            ) from None
        make(self, *fields, **named)

    cls.__init__ = __init__
    return cls


def check_names(others: Mapping[str, Any], renamed: Mapping[str, str]) -> None:
    """Answers keyword arguments that a function does not have.

    Args:
        others: what was given beside its own arguments.
        renamed: new names by old ones.

    Raises:
        TypeError: if there is any.
    """
    for name in others:
        if name in renamed:
            raise TypeError(f"Argument `{name}` is called `{renamed[name]}`.")
        raise TypeError(f"Argument `{name}` does not exist.")


def check_kind(name: str, x: Any, kind: type) -> None:
    """Refuses what is no scene, no receiver or no shape of a world.

    Args:
        name: of the argument.
        x: what was given.
        kind: the class of that world, or of all its shapes.

    Raises:
        TypeError: if x is something else, or of the other world.
    """
    if not isinstance(x, kind):
        raise TypeError(f"Argument `{name}` must be {_asked(x, kind)}{_hint(x, kind)}.")


def check_asked(
    scene: Any, kind: type, at: Any, receiver: type, name: str = "at", bands: bool = False
) -> None:
    """Refuses a scene and a receiver that are none of one world; every public call asks this.

    A scene of several bands is refused too: functions that map themselves over bands (`by_band`)
    see one at a time, and those that look at shapes alone say that bands may be there.

    Args:
        scene: what was given as one.
        kind: the class of that world's scenes.
        at: what was given as a receiver.
        receiver: the class of that world's receivers.
        name: of the argument that is the receiver.
        bands: whether the scene may have bands.

    Raises:
        TypeError: if one is something else, or of the other world.
        ValueError: if the scene has bands and may not.
    """
    check_kind("scene", scene, kind)
    check_kind(name, at, receiver)
    if not bands:
        check_one_band("scene", scene)


def check_asked_one(scene: Any, kind: type, at: Any, receiver: type, bands: bool = False) -> None:
    """`check_asked`, and refuses several scenes or receivers, for calls that answer one.

    Raises:
        TypeError: if one is something else, or of the other world.
        ValueError: if there are several scenes or receivers, or the scene has bands and may not.
    """
    check_asked(scene, kind, at, receiver, bands=bands)
    check_one_scene(scene)
    if at.position.ndim != 1:
        raise ValueError(
            f"Argument `at` must be one receiver, but holds {at.position.shape[:-1]} of them: "
            "ask for each by jax.vmap."
        )


def check_sky(x: Any, kind: type) -> None:
    """Refuses an environment that is a class, or was made in the other world.

    Args:
        x: what was given, of any kind.
        kind: the class of the world's scenes.

    Raises:
        TypeError: if it is one of these.
    """
    if isinstance(x, type):
        raise TypeError(
            f"Argument `environment` must be a sky, but is {_what(x)}: write {x.__name__}(...)."
        )
    here, there = _world(kind), _world(type(x))
    if there not in (None, here):
        raise TypeError(f"Argument `environment` must be of {here}, but is {_what(x)} of {there}.")


def check_primitives(things: Sequence[Any], kind: type, shape: type) -> None:
    """Refuses what a scene cannot hold.

    Args:
        things: in the order in which they were given, from 1.
        kind: the class of what the world's `primitive` makes.
        shape: the class of its shapes.

    Raises:
        TypeError: if one is something else, or of the other world.
    """
    for number, x in enumerate(things, 1):
        if isinstance(x, kind):
            continue
        hint = ""
        if isinstance(x, shape):
            hint = f": write primitive({type(x).__name__}(...), emission=...)"
        elif isinstance(x, (list, tuple)):
            hint = ": write Scene.of(*things)"
        elif type(x).__name__ in MADE_OF:
            hint = ": write primitive(triangles(mesh), emission=...)"
        raise TypeError(f"Argument {number} must be {_asked(x, kind)}{hint}.")


def numbers(name: str, x: Any) -> Array:
    """Floating numbers from an argument.

    Raises:
        TypeError: if it holds none, such as text.
    """
    try:
        found = as_float(x)
    except TypeError:
        raise TypeError(
            f"Argument `{name}` must be a number or an array, but is {_what(x)}."
        ) from None
    check_real(name, found)
    return found


def shape_number(name: str, x: Any) -> Array:
    """The number of the shape on which a receiver lies, as an array.

    Raises:
        TypeError: if it is no integer, such as a shape's name.
    """
    if isinstance(x, str):
        raise TypeError(
            f"Argument `{name}` must be a shape's number, but is {x!r}: "
            f"write scene.named({x!r})[0]."
        )
    number = as_array(x)
    if not jnp.issubdtype(number.dtype, jnp.integer):
        raise TypeError(f"Argument `{name}` must be a shape's number, an integer, but is {x!r}.")
    return number


def rays_of(
    origins: Any, along: Any, dims: int, names: tuple[str, str] = ("origins", "along")
) -> tuple[Array, Array]:
    """Starts and directions of rays, or starts and ends, as arrays of one row for each.

    Raises:
        TypeError: if they hold no numbers.
        ValueError: if one has another shape.
    """
    rays = numbers(names[0], origins), numbers(names[1], along)
    for name, a in zip(names, rays, strict=True):
        if a.ndim != 2 or a.shape[-1] != dims:
            raise ValueError(
                f"Argument `{name}` must have shape (rays, {dims}), but has {a.shape}: "
                "a single ray is one row."
            )
    return rays


def check_rows(receiver: Any, **shapes: tuple[int, ...]) -> None:
    """Refuses leaves of receivers that are not one for each position, by their shapes for one.

    Raises:
        ValueError: if a leaf has another shape.
    """
    rows = receiver.position.shape[:-1]
    for name, shape in shapes.items():
        found = getattr(receiver, name).shape
        if found != (*rows, *shape):
            raise ValueError(
                f"Argument `{name}` must have shape {(*rows, *shape)}, but has {found}: "
                f"{MADE['Receiver']}."
            )


def spread_over(receiver: Any, shape: tuple[int, ...], *names: str) -> None:
    """Let single numbers of receivers stand for all of their positions."""
    for name in names:
        leaf = getattr(receiver, name)
        if shape and not jnp.shape(leaf):
            object.__setattr__(receiver, name, spread(leaf, shape))


def _asked(x: Any, kind: type) -> str:
    """Words for the kind asked and the thing that came, with their worlds if these differ."""
    here, there = _world(kind), _world(type(x))
    if here is None or there is None or there == here:
        return f"{_named(kind)}, but is {_what(x)}"
    return f"{_named(kind)} of {here}, but is {_what(x)} of {there}"


def _hint(x: Any, kind: type) -> str:
    """How to make what must be, unless it was made in the other world."""
    other = _world(type(x)) not in (None, _world(kind))
    made = MADE.get(kind.__name__) or MADE_OF.get(type(x).__name__)
    return "" if other or made is None else f": {made}"


def _world(kind: type) -> str | None:
    """The world whose class it is."""
    package, _, rest = kind.__module__.partition(".")
    world = rest.partition(".")[0]
    return world if package == "firstorder" and world in WORLDS else None


def _named(kind: type) -> str:
    """A class with its article; what `primitive` and shapes are called is no class's name."""
    if kind.__name__ in ("Primitive", "Shape"):
        return f"a {kind.__name__.lower()}"
    return f"{'an' if kind.__name__[0] in 'AEIOUaeiou' else 'a'} {kind.__name__}"


def _what(x: Any) -> str:
    """A thing in a word or two; text as it stands."""
    if x is None or isinstance(x, str):
        return repr(x)
    if isinstance(x, type):
        return f"the class {x.__name__}"
    return _named(type(x))
