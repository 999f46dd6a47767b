"""XML trees that know their lines, with style sheets; entities are refused.

The time of everything here grows as the length of the text, whatever the text is.
"""

from __future__ import annotations

import dataclasses
import re
from collections.abc import Iterator
from xml.parsers import expat

from firstorder.io.scenes._elements import Place

SVG = "http://www.w3.org/2000/svg"
_DEEPEST = 200


@dataclasses.dataclass
class Node:
    """An element: its name without a namespace, attributes, children, text, and line.

    Attributes:
        foreign: whether it belongs to another namespace than SVG's.
    """

    tag: str
    attributes: dict[str, str]
    line: int
    foreign: bool = False
    children: list[Node] = dataclasses.field(default_factory=list)
    text: str = ""

    def walk(self) -> Iterator[Node]:
        """All nodes of the tree below and with this one, in order."""
        yield self
        for child in self.children:
            yield from child.walk()


def tree(source: bytes, file: str) -> Node:
    """The root element.

    Raises:
        ValueError: one sentence with the line, if the text is no XML, nests more than 200 deep, has
            an encoding that is not known, or declares entities (a few lines of which can unfold to
            gigabytes).
    """
    parser = expat.ParserCreate(namespace_separator=" ")
    parser.buffer_text = True
    top = Node("", {}, 0)
    stack, words_of = [top], [[""]]

    def start(name: str, attributes: dict[str, str]) -> None:
        line = parser.CurrentLineNumber
        if len(stack) > _DEEPEST:
            raise Place(file, line).error("elements are nested too deeply.")
        space, _, tag = name.rpartition(" ")
        local = {key.rpartition(" ")[2]: value for key, value in attributes.items()}
        # an attribute without a namespace wins over one that shares its name
        local.update({key: value for key, value in attributes.items() if " " not in key})
        node = Node(tag, local, line, foreign=space not in ("", SVG))
        stack[-1].children.append(node)
        stack.append(node)
        words_of.append([])

    def end(name: str) -> None:
        stack.pop().text = "".join(words_of.pop())

    def text(words: str) -> None:
        words_of[-1].append(words)

    def entity(*_) -> None:
        raise Place(file, parser.CurrentLineNumber).error("entities are not read here.")

    parser.StartElementHandler, parser.EndElementHandler = start, end
    parser.CharacterDataHandler, parser.EntityDeclHandler = text, entity
    try:
        parser.Parse(source, True)
    except expat.ExpatError as error:
        words = expat.ErrorString(error.code)
        raise Place(file, error.lineno).error(f"the text is no XML: {words}.") from None
    except (LookupError, ValueError) as error:
        if str(error).startswith(str(Place(file))):
            raise
        raise Place(file, 1).error("the encoding of the text is not known here.") from None
    return top.children[0]


class StyleSheet:
    """The rules of <style> elements whose selectors are a tag, a class or an id.

    Raises:
        ValueError: at another selector, which might have meant something here.
    """

    def __init__(self, root: Node, file: str):
        self._rules: dict[str, dict[tuple[bool, str], tuple[int, str]]] = {}
        self._read_so_far = 0
        for node in root.walk():
            if node.tag == "style" and not node.foreign:
                self._read(node, Place(file, node.line, "<style>"))

    def _read(self, node: Node, place: Place) -> None:
        for selectors, declarations in _rules(node.text):
            self._read_so_far += 1
            declared = {k: (self._read_so_far, v) for k, v in _declared(declarations).items()}
            for selector in (" ".join(s.split()) for s in selectors.split(",")):
                if not _SELECTOR.fullmatch(selector):
                    raise place.error(f"the selector `{selector[:40]}` is not understood here.")
                self._rules.setdefault(selector, {}).update(declared)

    def knows(self, selector: str) -> bool:
        """Whether there is a rule for a selector."""
        return selector in self._rules

    def of(self, node: Node) -> dict[str, str]:
        """Declarations that hold for an element: attributes, then the rules, then its own style.

        Of the rules, those of tags come before those of classes and ids; of as many classes, the
        one that stands last in the sheet holds. What is important comes after all that is not.
        """
        words = node.attributes
        classes = [f".{c}" for c in words.get("class", "").split()]
        levels = (["*"], [node.tag], classes, [f"#{words.get('id', '')}"])
        held = [
            ((important, level, late), key, value)
            for level, selectors in enumerate(levels)
            for selector in selectors
            for (important, key), (late, value) in self._rules.get(selector, {}).items()
        ]
        for (important, key), value in _declared(words.get("style", "")).items():
            held.append(((important, len(levels), 0), key, value))
        held.sort(key=lambda one: one[0])
        return {**words, **{key: value for _, key, value in held}}


# What is no rule. A comment that nobody closes goes to the end, as in CSS.
_BESIDE = re.compile(r"/\*.*?(?:\*/|\Z)|<!--|-->|@(?:import|charset)[^;]*+;?", re.S)
_SELECTOR = re.compile(r"[.#]?[\w-]+|\*")
# What the reader asks of a style.
_READ = frozenset(
    ("stroke", "fill", "visibility", "color", "display", "transform", "transform-origin")
)


def _rules(text: str) -> Iterator[tuple[str, str]]:
    """Selectors and declarations of the rules `selectors { declarations }`.

    A rule within another, or under a condition such as `@media`, has all that stands before it as
    selectors; a brace that nobody closes makes no rule.
    """
    *closed, _ = _BESIDE.sub("", text).split("}")
    for part in closed:
        before, opened, declarations = part.rpartition("{")
        if opened:
            yield before, declarations


def _declared(text: str) -> dict[tuple[bool, str], str]:
    """The declarations `key: value; ...` of a style, of what is read here, important or not."""
    pairs = (part.split(":", 1) for part in text.split(";") if ":" in part)
    return {
        ("!important" in v, k.strip()): v.replace("!important", "").strip()
        for k, v in pairs
        if k.strip() in _READ
    }
