"""Mitsuba's XML and its dict: the same scene, with the lines of its elements."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from typing import Any
from xml.sax.saxutils import quoteattr

import numpy as np
from jaxtyping import Float

from firstorder.io.scenes._elements import Place
from firstorder.io.svg._xml import Node, tree

Matrix = Float[np.ndarray, "4 4"]
OBJECTS = ("shape", "bsdf", "emitter", "texture", "integrator", "sensor", "sampler", "film",
           "rfilter", "medium", "volume", "phase", "subsurface")  # fmt: skip
VERSION = "3.0.0"
# What no name has in XML: letters that it lacks, and what a <default> would fill in.
_UNNAMED = re.compile("[^\t\n\r\x20-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]|\\$\\w+")
MOST_FILLED = 100_000  # a <default> may hold others, and two of each double with every line


# --- reading -------------------------------------------------------------------------------------


def dict_of_xml(source: bytes, file: str) -> tuple[dict[str, Any], dict[str, int]]:
    """The dict of a scene in XML, and the line of each of its elements.

    Raises:
        ValueError: one sentence with the line, if it is none.
    """
    root = tree(source, file)
    if root.tag != "scene":
        raise Place(file, root.line).error("a scene of Mitsuba must be a <scene>.")
    scene: dict[str, Any] = {"type": "scene"}
    lines: dict[str, int] = {}
    defaults: dict[str, str] = {}
    for node in root.children:
        _fill_in(node, defaults, file)
        place = Place(file, node.line, f"<{node.tag}>")
        if node.tag == "default":
            defaults[_attribute(node, "name", place)] = _attribute(node, "value", place)
            continue
        if node.tag not in OBJECTS:
            raise place.error("the element is not known here.")
        key = node.attributes.get("id", f"__{len(scene)}")
        if key in scene:
            raise place.error(f'the id "{key}" stands twice.')
        scene[key], lines[key] = _object(node, file), node.line
    return scene, lines


def _fill_in(node: Node, defaults: Mapping[str, str], file: str) -> None:
    """Replaces `$name` by what a <default> says, everywhere below an element."""
    for each in node.walk():
        for key, value in each.attributes.items():
            names = re.findall(r"\$(\w+)", value)
            for name in names:
                if name not in defaults:
                    raise Place(file, each.line).error(f"`${name}` has no <default>.")
            if names and len(value) + sum(len(defaults[name]) for name in names) > MOST_FILLED:
                raise Place(file, each.line).error(
                    f"`{key}` must have at most {MOST_FILLED} letters with every <default> filled "
                    "in, but has more."
                )
            each.attributes[key] = re.sub(r"\$(\w+)", lambda m: defaults[m[1]], value)


def _object(node: Node, file: str) -> dict[str, Any]:
    """An element with a type, and what is in it."""
    place = Place(file, node.line, f"<{node.tag}>")
    found: dict[str, Any] = {"type": _attribute(node, "type", place)}
    if "id" in node.attributes:
        found["id"] = node.attributes["id"]
    for child in node.children:
        at = Place(file, child.line, f"<{child.tag}>")
        key = child.attributes.get("name", f"{child.tag}__{len(found)}")
        if key in found:
            raise at.error(f"`{key}` stands twice.")
        if child.tag in OBJECTS:
            found[key] = _object(child, file)
        elif child.tag in _VALUES:
            found[key] = _VALUES[child.tag](child, at)
        else:
            raise at.error("the element is not known here.")
    return found


def _attribute(node: Node, key: str, place: Place) -> str:
    if key not in node.attributes:
        raise place.error(f"`{key}` is missing.")
    return node.attributes[key].strip()


def _numbers(words: str, place: Place) -> list[float]:
    """Numbers with commas or spaces between them."""
    try:
        return [float(word) for word in re.split(r"[\s,]+", words.strip())]
    except ValueError:
        raise place.error(f'"{words[:40]}" must be numbers.') from None


def _number(node: Node, place: Place) -> float:
    found = _numbers(_attribute(node, "value", place), place)
    if len(found) != 1:
        raise place.error("`value` must be one number.")
    return found[0]


def _yes(node: Node, place: Place) -> bool:
    words = _attribute(node, "value", place)
    if words not in ("true", "false"):
        raise place.error(f'`value` must be true or false, but is "{words[:40]}".')
    return words == "true"


def _vector(node: Node, place: Place, default: float = 0.0) -> list[float]:
    """Three numbers by `value` or by `x`, `y` and `z`; one stands for all three of `value`."""
    if "value" in node.attributes:
        found = _numbers(node.attributes["value"], place)
        found = found * 3 if len(found) == 1 else found
    else:
        found = [_numbers(node.attributes.get(axis, str(default)), place)[0] for axis in "xyz"]
    if len(found) != 3:
        raise place.error(f"`value` must be three numbers, but is {len(found)}.")
    return found


def _bands(node: Node, place: Place) -> dict[str, Any]:
    words = _attribute(node, "value", place)
    pairs = re.findall(r"([^\s,:]+)\s*:\s*([^\s,:]+)", words)
    found = _numbers(" ".join(value for _, value in pairs) if pairs else words, place)
    return {"type": node.tag, "value": found}


def _transform(node: Node, place: Place) -> Matrix:
    """The product of what is in a <transform>; what comes first acts first."""
    found = np.eye(4)
    for child in node.children:
        at = Place(place.file, child.line, f"<{child.tag}>")
        if child.tag not in _STEPS:
            raise at.error("the element is not known here.")
        found = _STEPS[child.tag](child, at) @ found
    return found


def _scale(node: Node, place: Place) -> Matrix:
    return np.diag([*_vector(node, place, 1.0), 1.0])


def _translate(node: Node, place: Place) -> Matrix:
    found = np.eye(4)
    found[:3, 3] = _vector(node, place)
    return found


def _rotate(node: Node, place: Place) -> Matrix:
    """Rodrigues' formula; `angle` in degrees, counter-clockwise about the axis."""
    axis = np.array(_vector(node, place))
    angle = np.radians(_numbers(_attribute(node, "angle", place), place)[0])
    if not np.any(axis):
        raise place.error("the axis must have a length, but has none.")
    x, y, z = axis / np.linalg.norm(axis)
    K = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    found = np.eye(4)
    found[:3, :3] += np.sin(angle) * K + (1.0 - np.cos(angle)) * (K @ K)
    return found


def _matrix(node: Node, place: Place) -> Matrix:
    found = _numbers(_attribute(node, "value", place), place)
    if len(found) != 16:
        raise place.error(f"`value` must be 16 numbers, but is {len(found)}.")
    return np.array(found).reshape(4, 4)


def _look_at(node: Node, place: Place) -> Matrix:
    """A frame at `origin` whose z looks at `target`, and whose y is as near `up` as it can be."""
    at, target, up = (np.array(_numbers(_attribute(node, k, place), place))
                      for k in ("origin", "target", "up"))  # fmt: skip
    if any(v.shape != (3,) for v in (at, target, up)):
        raise place.error("`origin`, `target` and `up` must be three numbers each.")
    left = np.cross(up, target - at)
    if not np.any(left):
        raise place.error("`up` must not be along the view, but is.")
    ahead, left = ((v / np.linalg.norm(v)) for v in (target - at, left))
    found = np.eye(4)
    found[:3] = np.stack([left, np.cross(ahead, left), ahead, at], -1)
    return found


_STEPS: Mapping[str, Callable[[Node, Place], Matrix]] = {
    "scale": _scale,
    "translate": _translate,
    "rotate": _rotate,
    "matrix": _matrix,
    "lookat": _look_at,
}
_VALUES: Mapping[str, Callable[[Node, Place], Any]] = {
    "float": _number,
    "integer": _number,
    "boolean": _yes,
    "string": lambda node, place: _attribute(node, "value", place),
    "point": _vector,
    "vector": _vector,
    "rgb": _bands,
    "spectrum": _bands,
    "transform": _transform,
    "ref": lambda node, place: {"type": "ref", "id": _attribute(node, "id", place)},
}


# --- writing -------------------------------------------------------------------------------------


def xml_of_dict(scene: Mapping[str, Any], tags: Mapping[str, str]) -> str:
    """The XML of a dict of a scene.

    Args:
        scene: as `space_to_mitsuba` makes it, with arrays as transforms.
        tags: the element's name by the type of an object.

    Raises:
        ValueError: if a name holds what no name has in XML.
    """
    lines = [f'<scene version="{VERSION}">']
    for key, value in scene.items():
        if key != "type":
            lines += _object_lines(value, tags, f" id={quoteattr(key)}")
    text = "\n".join([*lines, "</scene>"]) + "\n"
    if found := _UNNAMED.search(text):
        raise ValueError(f"In XML Mitsuba takes no name with {found[0]!r} in it.")
    return text


def _object_lines(value: Mapping[str, Any], tags: Mapping[str, str], words: str) -> list[str]:
    tag = tags[value["type"]]
    lines = [f"    <{tag} type={quoteattr(value['type'])}{words}>"]
    for key, inner in value.items():
        if key != "type":
            lines += (f"    {line}" for line in _value_lines(key, inner, tags))
    return [*lines, f"    </{tag}>"]


def _value_lines(key: str, value: Any, tags: Mapping[str, str]) -> list[str]:
    """Numbers are written such that reading them back gives the same bits."""
    name = f"name={quoteattr(key)}"
    match value:
        case dict() if value["type"] == "rgb":
            return [f'    <rgb {name} value="{_words(value["value"])}"/>']
        case dict():
            return _object_lines(value, tags, "")
        case np.ndarray():
            step = f'        <matrix value="{_words(value.ravel().tolist())}"/>'
            return [f"    <transform {name}>", step, "    </transform>"]
        case bool():
            return [f'    <boolean {name} value="{str(value).lower()}"/>']
        case float():
            return [f'    <float {name} value="{value!r}"/>']
        case list():
            return [f'    <point {name} value="{_words(value)}"/>']
    return [f"    <string {name} value={quoteattr(value)}/>"]


def _words(numbers: list[float]) -> str:
    return ", ".join(map(repr, numbers))
