"""XML trees that know their lines, with style sheets; entities are refused.

The time of everything here grows as the length of the text, whatever the text is.
"""

from __future__ import annotations

import dataclasses
import re
import warnings
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
    """The rules of <style> elements whose selectors are a tag, a class or an id, as on a screen.

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
        for selectors, declarations in _rules(node.text, place):
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


# A comment that nobody closes goes to the end, as in CSS.
_COMMENT = re.compile(r"/\*.*?(?:\*/|\Z)|<!--|-->", re.S)
# What begins with @, up to the end of a statement such as @import, or to a block.
_AT = re.compile(
    r"@[\w-]++(?:[^;{}\"'(]++|\"[^\"]*+\"?+|'[^']*+'?+|\([^)]*+\)?+)*+(?:;|(?P<block>(?=[{}]))|\Z)"
)
_SELECTOR = re.compile(r"[.#]?[\w-]+|\*")
# What the reader asks of a style.
_READ = frozenset(
    ("stroke", "fill", "visibility", "color", "display", "transform", "transform-origin")
)


@dataclasses.dataclass(frozen=True)
class _Block:
    """A pair of braces of a style sheet: a rule, or a condition on the rules in it.

    Attributes:
        selectors: of the rule, with all that it stands in; None outside of rules.
        left_out: the condition that does not hold, or what is no rule.
    """

    selectors: str | None = None
    left_out: str = ""

    def inner(self, before: str) -> _Block:
        """The block within this one that follows some words."""
        words = " ".join(before.split())
        if self.left_out or (words.startswith("@") and _holds(words)):
            return self
        if words.startswith("@"):
            return _Block(left_out=words)
        # a rule in a rule is refused by the words that stand before it, of which few are shown
        return _Block(before if self.selectors is None else f"{self.selectors[:40]}{{{before}")


def _holds(words: str) -> bool:
    """Whether a condition holds for a drawing, which is seen on a screen."""
    name, _, queries = words.partition(" ")
    kinds = [query.strip().lower().removeprefix("only ") for query in queries.split(",")]
    return name.lower() == "@media" and not {"", "all", "screen"}.isdisjoint(kinds)


def _rules(text: str, place: Place) -> Iterator[tuple[str, str]]:
    """Selectors and declarations of the rules `selectors { declarations }`.

    Those under a condition are read if it holds, and left out with a warning if not; a brace that
    nobody closes makes no rule.
    """
    bare = _AT.sub(lambda at: "" if at["block"] is None else at[0], _COMMENT.sub("", text))
    *parts, _ = re.split(r"([{}])", bare)
    opened, told = [_Block()], set()
    for before, brace in zip(parts[::2], parts[1::2], strict=True):
        if brace == "{":
            opened.append(opened[-1].inner(before))
        elif len(opened) > 1:
            block = opened.pop()
            if block.selectors is not None:
                yield block.selectors, before
            elif block.left_out not in told and _declared(before):
                told.add(block.left_out)
                _warn(block.left_out, place)


def _warn(left_out: str, place: Place) -> None:
    """Say that a condition does not hold; keyframes of animations are none."""
    if not re.match(r"@(-\w+-)?keyframes\b", left_out, re.I):
        words = f"{place}: rules under `{left_out[:40]}` are left out: those for a screen are read."
        warnings.warn(words, stacklevel=8)


def _declared(text: str) -> dict[tuple[bool, str], str]:
    """The declarations `key: value; ...` of a style, of what is read here, important or not."""
    pairs = (part.split(":", 1) for part in text.split(";") if ":" in part)
    return {
        ("!important" in v, k.strip()): v.replace("!important", "").strip()
        for k, v in pairs
        if k.strip() in _READ
    }
