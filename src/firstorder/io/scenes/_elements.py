"""Elements of scene files of any format, each with its place in the file.

A reader turns its file into elements; `assemble` makes the scene. What is wrong with an element is
said in one sentence that names the file, the line and the element.
"""

from __future__ import annotations

import dataclasses
import difflib
import itertools
import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from firstorder.flatland.point_lights import PointLights
from firstorder.flatland.primitives import primitive
from firstorder.flatland.scene import Scene
from firstorder.flatland.shapes.kinds import Arcs, Circles, Curves, Ellipses, Segments, Shape

SHAPES: Mapping[str, Callable[..., Shape]] = {
    "segment": Segments,
    "arc": Arcs,
    "circle": Circles,
    "ellipse": Ellipses,
    "curve": Curves,
}
MOST_SHAPES = 50_000
# What `primitive` takes besides a shape and its name.
MATERIAL = ("emission", "albedo", "mirror", "specular", "exponent", "ior")
SIDED = ("emission", "albedo")  # of these there are two, front and back, and perhaps bands


@dataclasses.dataclass(frozen=True)
class Place:
    """A place in a file, in words: 'scene.toml, line 12, shape 3 ("lamp")'."""

    file: str
    line: int | None = None
    what: str = ""

    def __str__(self):
        line = "" if self.line is None else f"line {self.line}"
        return ", ".join(part for part in (self.file, line, self.what) if part)

    def error(self, reason: object) -> ValueError:
        """Error with this place before its reason; a constructor's argument becomes a key."""
        words = str(reason)
        for start in ("Argument ", "Arguments "):
            words = words.removeprefix(start)
        return ValueError(" ".join(f"{self}: {words}".splitlines()))


@dataclasses.dataclass(frozen=True)
class Element:
    """One shape (a number of segments, if it is a polyline) with its material.

    Attributes:
        kind: key of `SHAPES`.
        geometry: its arguments, as arrays with a leading axis of shapes.
        material: of all of them: numbers, or pairs (front, back) for emission and albedo, of
            numbers or of rows of bands.
        name: for `Scene.named`.
        at: where in the file a key of it stands; the element itself for a key that does not.
    """

    kind: str
    geometry: Mapping[str, Any]
    material: Mapping[str, Any]
    name: str
    at: Callable[[str], Place]


@dataclasses.dataclass(frozen=True)
class LightElement:
    """A light without size."""

    position: Sequence[float]
    intensity: float | Sequence[float]
    at: Callable[[str], Place]


def nearest_known(word: str, known: Iterable[str], cutoff: float = 0.6) -> str:
    """Words for an unknown key: the one that was meant, or all there are.

    Args:
        word: the key.
        known: all keys.
        cutoff: how alike two must be, from 0 to 1.
    """
    known = sorted(known)
    close = difflib.get_close_matches(word, known, 1, cutoff)
    return f"did you mean `{close[0]}`?" if close else f"known are {', '.join(known)}."


def both_sides(value: Any, both: bool) -> Any:
    """Front and back of what a file says: two already, or a single number or row of bands.

    Args:
        value: a number, or a list as `_toml_tables.sided` reads it.
        both: whether a single one holds for the back too.

    Example:
        >>> from firstorder.io.scenes._elements import both_sides
        >>> both_sides(1.0, False), both_sides([0.2, 0.4, 0.6], True), both_sides([1.0, 0.5], True)
        ([1.0, 0.0], [[0.2, 0.4, 0.6], [0.2, 0.4, 0.6]], [1.0, 0.5])
    """
    if isinstance(value, list) and len(value) == 2:
        return value
    dark = [0.0] * len(value) if isinstance(value, list) else 0.0
    return [value, value if both else dark]


def assemble(elements: Sequence[Element], lights: Sequence[LightElement], sky, file: str) -> Scene:
    """The scene of elements; a refusal is reported at the first element that is refused by itself.

    Elements of one kind and name that follow each other become one primitive, so that a polyline of
    a thousand pieces costs no more than one segment.
    """
    if not elements:
        raise Place(file).error("a scene must have at least one shape, but there is none.")
    if sum(len(next(iter(e.geometry.values()))) for e in elements) > MOST_SHAPES:
        raise Place(file).error(f"a scene must have at most {MOST_SHAPES} shapes, but has more.")
    runs = itertools.groupby(elements, _alike)
    things = [_thing(list(run)) for _, run in runs]
    points = None
    if lights:
        for light in lights:
            refused_at(light.at, lambda light=light: _points([light]))
        points = _points(lights)
    try:
        return Scene.of(*things, points=points, environment=sky)
    except ValueError as error:  # of all together: too much overlaps, or bands disagree
        raise Place(file).error(error) from None


def _alike(e: Element) -> tuple[Any, ...]:
    """Equal for elements that one primitive can hold."""
    bands = (np.shape(both_sides(e.material.get(key, 0.0), True))[1:] for key in SIDED)
    # Of curves, how many harmonics and samples they have.
    sizes = (
        (key, value if isinstance(value, int) else np.shape(value)[1:])
        for key, value in sorted(e.geometry.items())
    )
    return e.kind, e.name, tuple(sizes), *bands


def _thing(run: list[Element]):
    try:
        return _built(run)
    except ValueError:
        for element in run:
            refused_at(element.at, lambda element=element: _built([element]))
        raise


def refused_at(at: Callable[[str], Place], make: Callable[[], Any]) -> Any:
    """Result of `make`; a refusal is reported at the key that it names, a lost file too."""
    try:
        return make()
    except (ValueError, OSError) as error:
        named = re.search(r"`\W?(\w+)", str(error))
        raise at(named[1] if named else "").error(error) from None


def _built(run: list[Element]):
    first = run[0]
    geometry = {
        key: value
        if isinstance(value, int)
        else np.concatenate([np.asarray(e.geometry[key], float) for e in run])
        for key, value in first.geometry.items()
    }
    shape = SHAPES[first.kind](**geometry)
    counts = [len(next(iter(e.geometry.values()))) for e in run]
    material = {key: _column(key, run, counts) for key in MATERIAL}
    return primitive(shape, name=first.name, **material)


def _column(key: str, run: list[Element], counts: list[int]) -> np.ndarray:
    """One row for each shape of all elements; front and back for what has sides."""
    rows = [np.asarray(e.material.get(key, 0.0), float) for e in run]
    if key in SIDED:
        rows = [np.asarray(both_sides(r.tolist(), key == "albedo"), float) for r in rows]
    return np.concatenate(
        [np.repeat(r[None], n, axis=0) for r, n in zip(rows, counts, strict=True)]
    )


def _points(lights: Sequence[LightElement]) -> PointLights:
    each = [np.asarray(light.intensity, float) for light in lights]
    bands = max(a.shape for a in each)
    if any(a.shape not in ((), bands) for a in each):
        raise ValueError(
            "Argument `intensity` must have equally many bands in all lights, but has not."
        )
    each = [a if a.shape == bands else np.full(bands, a) for a in each]
    return PointLights(np.array([light.position for light in lights], float), np.array(each))
