"""Scenes from SVG drawings: shapes with materials.

Geometry
    A user unit is a metre (times `data-scale` of the root, or the argument `scale`). SVG's y points
    down: the drawing is turned upside down within its viewBox, which keeps the place it covers
    (without one, within its height; without that, about y = 0), so that the scene looks as drawn.
    Lines and circular arcs are exact, circles and ellipses too; Béziers and arcs of ellipses become
    chords within `tolerance`. Transforms, groups and <use> are followed;
    of a <switch> the first element is drawn that asks for no extension and no language.
Sides
    Normals lie to the left of the pen's travel, as seen on the page. What is closed (and circles,
    rectangles, polygons) is travelled so that its normals point outward, whichever way it was
    drawn; class `inward` turns them inward (a room), class `drawn` keeps the pen's travel.
Materials
    | what | means |
    |---|---|
    | stroke, or without one the fill | a diffuse albedo: the luminance 0.2126 R + 0.7152 G + 0.0722 B of the colour as it is written, so black is 0, white 1, #808080 0.502 |
    | a fill without a stroke | an open path is closed by a line |
    | neither | is not in the scene, unless a class or a `data-` attribute says otherwise |
    | class `light` | emission 1, albedo 0 |
    | class `mirror` | mirror 1, albedo 0 |
    | class `glass` | ior 1.5, albedo 0 |
    | class `point-light` | a light without size in its middle, intensity 1 |
    | class `ignore`; display or visibility | is not in the scene |
    | `data-emission`, `-albedo`, `-mirror`, `-specular`, `-exponent`, `-ior`, `-intensity` | that number; two numbers for front and back of emission and albedo |
    | `id` (or a label, or that of the group around it) | the name |
    | root: `data-sky="L"`, or `"L center sigma"` | distant light: constant, or a Gaussian [rad] |

    Classes and `data-` attributes of a group hold for all in it; those of an element come last.
    Styles may stand in attributes, in `style`, or in a <style> sheet of plain selectors, also under
    `@media screen`; rules under another condition are left out with a warning. Opacity,
    line widths, clips, masks and other classes say nothing (one that is nearly ours and in no
    style sheet is an error); texts and pictures are left out.
"""  # noqa: E501 (a table)

from __future__ import annotations

import dataclasses
import os
import pathlib
from collections.abc import Iterator
from typing import Any

import numpy as np

from firstorder.flatland.scene import Scene
from firstorder.flatland.skies import ConstantSky, GaussianSky
from firstorder.io._regular import MOST_TEXT_BYTES, read_regular_file
from firstorder.io.scenes._elements import (
    MATERIAL,
    Element,
    LightElement,
    Place,
    assemble,
    nearest_known,
)
from firstorder.io.svg._materials import albedo_of
from firstorder.io.svg._paths import Subpath, shapes
from firstorder.io.svg._shapes import SHAPES, affine, floats, length, subpaths
from firstorder.io.svg._xml import Node, StyleSheet, tree

GROUPS = ("svg", "g", "a", "switch", "use", "symbol")
# What may stand in a drawing and is nothing that light meets.
SILENT = frozenset((
    "defs", "clipPath", "mask", "pattern", "marker", "linearGradient", "radialGradient", "stop",
    "filter", "metadata", "title", "desc", "style", "script", "text", "tspan", "textPath", "image",
    "foreignObject", "view", "animate", "animateTransform", "animateMotion", "set", "font",
    "cursor", "meshgradient", "hatch", "solidColor",
))  # fmt: skip
# Albedo and what else a class means.
CLASSES: dict[str, dict[str, Any]] = {
    "light": {"emission": 1.0, "albedo": 0.0},
    "mirror": {"mirror": 1.0, "albedo": 0.0},
    "glass": {"ior": 1.5, "albedo": 0.0},
}
# What else a class may say.
DRAWN = ("point-light", "ignore", "inward", "drawn")
CLOSE = 0.75  # how like one of ours a foreign class is taken for a slip
DATA = (*MATERIAL, "intensity", "scale", "sky", "name")
# How much one file may ask for; docs/files.md tells users.
MOST_USED, MOST_PIECES = 20_000, 50_000
_FARTHEST = 1e60


def read_svg(
    path: str | os.PathLike[str], scale: float | None = None, tolerance: float | None = None
) -> Scene:
    """Reads a scene from an SVG drawing.

    What means what stands at the head of `firstorder.io.svg.reader`.

    Args:
        path: the file.
        scale: metres in a user unit; what the root's `data-scale` says, or else 1.
        tolerance: how far chords may be from a curve that has to be flattened [m]; one thousandth
            of the larger side of the drawing, if left out.

    Raises:
        ValueError: one sentence that names the file, the line and the element, if it is no scene.
        ModuleNotFoundError: without the extra `drawings`.
        FileNotFoundError: one sentence that names the path, if there is no such file.

    Example:
        >>> import pathlib, tempfile
        >>> from firstorder.io import read_svg
        >>> file = pathlib.Path(tempfile.mkdtemp(), "disc.svg")
        >>> _ = file.write_text('<svg viewBox="0 0 4 3"><circle cx="1" cy="1" r="0.5"/></svg>')
        >>> read_svg(file).groups[0].center.tolist()
        [[1.0, 2.0]]
    """
    path = pathlib.Path(path)
    source = read_regular_file(path, MOST_TEXT_BYTES)
    return _scene_from_svg(source, path.name, scale, tolerance)


def _scene_from_svg(
    source: str | bytes,
    file: str = "drawing",
    scale: float | None = None,
    tolerance: float | None = None,
) -> Scene:
    """Reads a scene from the text of an SVG drawing.

    Args:
        source: the text, or its bytes.
        file: how sentences about errors call it.
        scale: metres in a user unit; what the root's `data-scale` says, or else 1.
        tolerance: as for `read_svg`.

    Raises:
        ValueError: one sentence that names the line and the element.
        ModuleNotFoundError: without the extra `drawings`.

    Example:
        >>> from firstorder.io.svg.reader import _scene_from_svg
        >>> scene = _scene_from_svg('''<svg viewBox="-1 0 2 2">
        ...   <line id="floor" x1="-1" y1="2" x2="1" y2="2" stroke="#808080"/>
        ...   <path id="lamp" class="light" d="M 0.5 1 H -0.5"/></svg>''')
        >>> scene.names, scene.groups[0].start.tolist()
        (('floor', 'lamp'), [[-1.0, 0.0], [0.5, 1.0]])
    """
    for name, value in (("scale", scale), ("tolerance", tolerance)):
        if value is not None and not 0.0 < value < np.inf:
            raise ValueError(f"Argument `{name}` must be positive, but is {value}.")
    data = source.encode("utf-8", "replace") if isinstance(source, str) else source
    root = tree(data, file)
    if root.tag != "svg" or root.foreign:
        raise Place(file, root.line).error(f"the drawing must be <svg>, but is <{root.tag[:40]}>.")
    reader = _Reader(root, file, scale)
    drawn = list(reader.walk(root, reader.start, 0))
    elements = _elements(drawn, tolerance, file)
    return assemble(elements, reader.lights, reader.sky, file)


@dataclasses.dataclass(frozen=True)
class _Context:
    """Properties that an element inherits."""

    A: np.ndarray
    b: np.ndarray
    style: dict[str, str]
    data: dict[str, str]
    classes: frozenset[str]
    name: str

    def mapped(self, matrix: np.ndarray) -> _Context:
        """Context with a further transform before its own."""
        A, b = matrix[:, :2], matrix[:, 2]
        return dataclasses.replace(self, A=self.A @ A, b=self.A @ b + self.b)


@dataclasses.dataclass(frozen=True)
class _Drawn:
    """A path in the scene's coordinates, before its curves are flattened."""

    path: Subpath
    material: dict[str, Any]
    name: str
    place: Place


_INHERITED = ("stroke", "fill", "visibility", "color")


@dataclasses.dataclass(frozen=True)
class _Own:
    """Properties that an element has of its own, read once however often it is used."""

    matrix: np.ndarray | None
    style: dict[str, str]
    data: dict[str, str]
    classes: frozenset[str]
    name: str | None
    hidden: bool


class _Work:
    """Counts what is done for a file, so that a short file cannot ask for much.

    A <use> draws its element again, and one in another one doubles the work with every line.
    """

    def __init__(self, elements: int):
        self._visits, self._pieces = elements + MOST_USED, MOST_PIECES

    def visit(self) -> None:
        """Count an element, each time that it is come by, whether it draws or not."""
        self._visits -= 1
        if self._visits < 0:
            raise ValueError(f"`href` must repeat at most {MOST_USED} elements, but repeats more.")

    def draw(self, pieces: int) -> None:
        """Count pieces of paths."""
        self._pieces -= pieces
        if self._pieces < 0:
            raise ValueError(_TOO_MANY)


_TOO_MANY = f"the drawing must be of at most {MOST_PIECES} pieces, but is of more."


class _Reader:
    """Walks the tree; point lights are collected on the way."""

    def __init__(self, root: Node, file: str, scale: float | None):
        self.root, self.file, self.lights = root, file, []
        self.work = _Work(sum(1 for _ in root.walk()))
        # by id(); the tree lives as long as its reader
        self._owns: dict[int, _Own] = {}
        self._paths: dict[int, list[Subpath]] = {}
        self.sheet = StyleSheet(root, file)
        self.by_id = {n.attributes["id"]: n for n in root.walk() if "id" in n.attributes}
        place = self._place(root)
        try:
            given = root.attributes.get("data-scale", "1")
            unit = scale if scale is not None else floats("data-scale", given, 1)[0]
            if unit <= 0.0:
                raise ValueError(f"`data-scale` must be positive, but is {unit:g}.")
            A = unit * np.array([[1.0, 0.0], [0.0, -1.0]])
            b = np.array([0.0, unit * _flip(root.attributes)])
            self.sky = _sky(root.attributes.get("data-sky"))
        except ValueError as error:
            raise place.error(error) from None
        self.start = _Context(A, b, {}, {}, frozenset(), "")

    def _place(self, node: Node) -> Place:
        name = " ".join(node.attributes.get("id", "").split())[:40]
        return Place(
            self.file, node.line, f'<{node.tag[:40]} id="{name}">' if name else f"<{node.tag[:40]}>"
        )

    def walk(self, node: Node, context: _Context, depth: int) -> Iterator[_Drawn]:
        """Everything drawn by an element and those in it."""
        if node.foreign or node.tag in SILENT:
            return
        place = self._place(node)
        if depth > 200:
            raise place.error("`href` leads back to the element itself.")
        try:
            self.work.visit()
            own = self._owns.get(id(node)) or self._own(node)
            inner = _inner(own, context)
            hidden = own.hidden or "ignore" in inner.classes
            if node.tag not in GROUPS and node.tag not in SHAPES:
                known = nearest_known(node.tag, (*GROUPS, *SHAPES))
                raise ValueError(f"<{node.tag[:40]}> is not known here: {known}")
            if hidden:
                return
            if node.tag in SHAPES:
                yield from self._shape(node, inner, place)
                return
            children, inner = self._children(node, inner)
        except ValueError as error:
            raise error if str(error).startswith(self.file) else place.error(error) from None
        for child in children:
            yield from self.walk(child, inner, depth + 1)

    def _own(self, node: Node) -> _Own:
        """Style, material and transform of an element itself, without those it inherits."""
        style, data, own = self.sheet.of(node), {}, node.attributes
        transform = style.get("transform", "none")
        for key, value in own.items():
            if key.startswith("data-"):
                word = key.removeprefix("data-")
                if word in DATA:
                    data[word] = value
                elif "did you mean" in (meant := nearest_known(word, DATA)):
                    raise ValueError(f"`{key}` is not known here: {meant}")
        self._owns[id(node)] = found = _Own(
            matrix=None if transform == "none" else _about(style, affine(transform)),
            style={k: style[k] for k in _INHERITED if style.get(k, "inherit") != "inherit"},
            data=data,
            classes=self._known_classes(own.get("class", "").split()),
            name=own.get("id") or own.get("label") or data.get("name"),
            hidden=style.get("display") == "none",
        )
        return found

    def _known_classes(self, words: list[str]) -> frozenset[str]:
        """Those of our classes; one that is almost ours and in no style sheet is refused."""
        known = (*CLASSES, *DRAWN)
        for word in words:
            if word in known or self.sheet.knows(f".{word}"):
                continue
            if "did you mean" in (meant := nearest_known(word, known, CLOSE)):
                raise ValueError(f"the class `{word[:40]}` is not known here: {meant}")
        return frozenset(known).intersection(words)

    def _children(self, node: Node, context: _Context) -> tuple[list[Node], _Context]:
        """Children of a group; the target of a <use>; none of a symbol that is not used."""
        nested = node.tag in ("svg", "symbol") and node is not self.root
        if nested and "viewBox" in node.attributes:
            raise ValueError("`viewBox` is read at the root only.")
        if node.tag != "use":
            inner = context.mapped(_shift(node)) if nested else context
            children = [c for c in node.children if c.tag != "symbol"]
            return _chosen(children) if node.tag == "switch" else children, inner
        href = node.attributes.get("href", "")
        if not href.startswith("#") or href[1:] not in self.by_id:
            raise ValueError(f"`href` must name an element of this file, but is {href[:40]!r}.")
        return [self.by_id[href[1:]]], context.mapped(_shift(node))

    def _shape(self, node: Node, context: _Context, place: Place) -> Iterator[_Drawn]:
        """Shapes drawn by one element."""
        if id(node) not in self._paths:
            self._paths[id(node)] = subpaths(node.tag, node.attributes)
        drawn = self._paths[id(node)]
        self.work.draw(sum(len(path.pieces) for path in drawn))
        if not drawn or context.style.get("visibility") in ("hidden", "collapse"):
            return
        with np.errstate(over="ignore", invalid="ignore"):
            paths = [p.mapped(context.A, context.b) for p in drawn]
            corners = np.concatenate([piece.points(8) for p in paths for piece in p.pieces])
        if not np.all(np.abs(corners) < _FARTHEST):
            raise ValueError(f"the coordinates must stay below {_FARTHEST:g}, but do not.")
        if "point-light" in context.classes:
            middle = 0.5 * (corners.min(0) + corners.max(0))
            strength = floats("data-intensity", context.data.get("intensity", "1"), 1)[0]
            self.lights.append(LightElement(middle.tolist(), strength, lambda _: place))
            return
        strict = "albedo" not in context.data
        stroke = albedo_of(_paint(context.style, "stroke", "none"), strict)
        inside = "none" if node.tag == "line" else _paint(context.style, "fill", "black")
        fill = albedo_of(inside, strict)
        material = _material(context, fill if stroke is None else stroke)
        if material is None:
            return
        filled = stroke is None and fill is not None and "fill" in context.style
        for path in paths:
            whole = path.shut() if filled and not path.closed else path
            yield _Drawn(_sided(whole, context.classes), material, context.name, place)


def _shift(node: Node) -> np.ndarray:
    """The matrix (2, 3) that moves by x and y of an element."""
    x, y = (length(k, node.attributes.get(k, "0")) for k in ("x", "y"))
    return np.array([[1.0, 0.0, x], [0.0, 1.0, y]])


def _about(style: dict[str, str], matrix: np.ndarray) -> np.ndarray:
    """A transform about the point that `transform-origin` says."""
    words = style.get("transform-origin", "0 0")
    if len(words.split()) != 2:
        raise ValueError(f"`transform-origin` must be two lengths, but is {words[:40]!r}.")
    origin = np.array([length("transform-origin", word) for word in words.split()])
    A, b = matrix[:, :2], matrix[:, 2]
    return np.column_stack([A, b + origin - A @ origin])


def _chosen(children: list[Node]) -> list[Node]:
    """The child of a <switch> that is drawn: the first that asks for no extension or language."""
    asks = ("requiredExtensions", "systemLanguage")
    drawn = [c for c in children if not c.foreign and c.tag not in SILENT]
    return [c for c in drawn if not any(c.attributes.get(key) for key in asks)][:1]


def _paint(style: dict[str, str], key: str, default: str) -> str:
    """A paint; that of `color`, black without one, where it says so."""
    paint = style.get(key, default)
    return style.get("color", "black") if paint.strip().lower() == "currentcolor" else paint


def _inner(own: _Own, context: _Context) -> _Context:
    """The context with what an element itself says."""
    if own.matrix is not None:
        context = context.mapped(own.matrix)
    return dataclasses.replace(
        context,
        style={**context.style, **own.style},
        data={**context.data, **own.data},
        classes=context.classes | own.classes,
        name=own.name or context.name,
    )


def _flip(attributes: dict[str, str]) -> float:
    """The sum of y and its image: top and bottom of the page change places."""
    box = attributes.get("viewBox")
    if box is not None:
        _, top, width, height = floats("viewBox", box, 4)
        if width <= 0.0 or height <= 0.0:
            raise ValueError("`viewBox` must have a positive size.")
        return 2.0 * top + height
    height = attributes.get("height", "0")
    return 0.0 if height.strip().endswith("%") else length("height", height)


def _sky(words: str | None):
    if words is None:
        return None
    numbers = floats("data-sky", words)
    if len(numbers) == 1:
        return ConstantSky(numbers[0])
    if len(numbers) == 3:
        radiance, center, sigma = numbers
        return GaussianSky(center, sigma, radiance)
    raise ValueError(f"`data-sky` must be one number or three, but is {words[:40]!r}.")


def _material(context: _Context, paint: float | None) -> dict[str, Any] | None:
    """Material of an element; None for an element that is not in the scene."""
    material: dict[str, Any] = {} if paint is None else {"albedo": paint}
    for word, means in CLASSES.items():
        if word in context.classes:
            material.update(means)
    for key in MATERIAL:
        if key in context.data:
            numbers = floats(f"data-{key}", context.data[key])
            sided = key in ("emission", "albedo")
            if len(numbers) not in ((1, 2) if sided else (1,)):
                many = "one number, or two for front and back" if sided else "one number"
                raise ValueError(f"`data-{key}` must be {many}, but is {context.data[key][:40]!r}.")
            material[key] = numbers[0] if len(numbers) == 1 else list(numbers)
    return material or None


def _sided(path: Subpath, classes: frozenset[str]) -> Subpath:
    """Path with its direction chosen so that the normals point where they should."""
    if not path.closed or "drawn" in classes:
        return path
    wrong = path.area < 0.0 if "inward" in classes else path.area > 0.0
    return path.turned() if wrong else path


def _elements(drawn: list[_Drawn], tolerance: float | None, file: str) -> list[Element]:
    """Elements of paths, flattened where they have to be."""
    if not drawn:
        return []
    corners = np.concatenate([piece.points(8) for d in drawn for piece in d.path.pieces])
    extent = float(np.max(corners.max(0) - corners.min(0)))
    within = tolerance or 1e-3 * extent or 1.0
    elements, count = [], 0
    for d in drawn:

        def at(_: str, place: Place = d.place) -> Place:
            return place

        try:
            found = shapes(d.path, within)
        except ValueError as error:
            raise d.place.error(error) from None
        for kind, geometry in found:
            elements.append(Element(kind, geometry, d.material, d.name, at))
            count += len(next(iter(geometry.values())))
        if count > MOST_PIECES:
            raise d.place.error(_TOO_MANY)
    return elements
