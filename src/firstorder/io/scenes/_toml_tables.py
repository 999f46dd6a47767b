"""TOML tables with line numbers: keys are taken one by one, and what is left over is an error.

tomllib tells the line of a text that is no TOML, but not the line of a value that is no good: a
small scan for headers and keys finds it. Its answer is only ever used in sentences.
"""

from __future__ import annotations

import dataclasses
import difflib
import math
import pathlib
import re
import tomllib
from collections.abc import Callable, Mapping
from typing import Any, TypeAlias

from firstorder.io.scenes._beside import Beside
from firstorder.io.scenes._elements import Place, nearest_known

# Texts, of one line or the first of several, and comments.
_NO_BRACKETS = r'"""(?:.*"""|.*$)|\'\'\'(?:.*\'\'\'|.*$)|"(?:[^"\\]|\\.)*"|\'[^\']*\'|#.*'
Lines: TypeAlias = Mapping[tuple[str, int, str], int]


def parsed(source: str | bytes, file: str) -> tuple[str, dict[str, Any]]:
    """The text and what tomllib reads from it; its refusals become our sentences."""
    try:
        text = source.decode("utf-8-sig") if isinstance(source, bytes) else source
    except UnicodeDecodeError as error:
        line = source[: error.start].count(b"\n") + 1
        raise Place(file, line).error("the text must be UTF-8, but is not.") from None
    text = text.replace("\r\n", "\n")
    _check_dots(text, file)
    try:
        return text, tomllib.loads(text)
    except RecursionError:
        raise Place(file).error("values are nested too deeply.") from None
    except ValueError as error:  # also the numbers of thousands of digits that Python refuses
        words, line = str(error), None
        if found := re.search(r"^(.*) \(at (?:line (\d+)|end of document)", words, re.S):
            words, line = found[1], int(found[2] or text.count("\n") + 1)
        words = " ".join(words.split())
        raise Place(file, line).error(f"{words[:1].lower()}{words[1:].rstrip('.')}.") from None


# Texts and comments: quotes that nobody closes go to the end, so that one pass is enough.
_TEXT = re.compile(
    r'"""(?:[^"\\]|\\.|"(?!""))*+(?:"{3,5}+)?+'
    r"|'''(?:[^']|'(?!''))*+(?:'{3,5}+)?+"
    r'|"(?:[^"\\\n]|\\[^\n])*+"?+'
    r"|'[^'\n]*+'?+"
    r"|(\#[^\n]*+)",
    re.S,
)
MOST_DOTS = 16  # in a key: tomllib takes quadratic time for more
_DOTTED = re.compile(rf"(?<![\w-])(?:[\w-]++[ \t]*+\.[ \t]*+){{{MOST_DOTS + 1}}}")


def _check_dots(text: str, file: str) -> None:
    """Refuses keys of very many parts, `a.b.c...`, wherever they stand outside of texts.

    No number or date has more than one dot, so whatever is joined by many is a key.
    """
    bare = _TEXT.sub(lambda t: "" if t[1] else "q" + "\n" * t[0].count("\n"), text)
    if found := _DOTTED.search(bare):
        line = bare.count("\n", 0, found.start()) + 1
        raise Place(file, line).error(f"a key must have at most {MOST_DOTS} dots, but has more.")


def lines_of(text: str) -> dict[tuple[str, int, str], int]:
    """The line of each table's header, and of each key in it, which tomllib does not tell."""
    found: dict[tuple[str, int, str], int] = {}
    counts: dict[str, int] = {}
    table, inside, depth = ("", 0), None, 0
    for number, line in enumerate(text.split("\n"), 1):
        opened, within = inside, depth > 0
        for quote in re.findall(r'"""|\'\'\'', line):
            inside = None if inside == quote else inside or quote
        if opened:
            continue
        bare = re.sub(_NO_BRACKETS, "", line)
        depth += bare.count("[") - bare.count("]")
        if within:
            continue
        if header := re.match(r'\s*\[\[?\s*["\']?([\w-]+)["\']?\s*\]', line):
            name = header[1]
            i = counts[name] = counts.get(name, -1) + 1
            table = (name, i)
            found.setdefault((name, i, ""), number)
        elif inner := re.match(r"\s*\[\s*([\w-]+)\s*\.\s*([\w-]+)\s*\]", line):
            table = (f"{inner[1]}.{inner[2]}", counts.get(inner[1], 0))
            found.setdefault((*table, ""), number)
        elif key := re.match(r'\s*["\']?([\w-]+)["\']?\s*[=.]', line):
            if table == ("", 0):
                found.setdefault((key[1], 0, ""), number)
            else:
                found.setdefault((*table, key[1]), number)
    return found


def place_of(file: str, lines: Lines, table: str, i: int, value: Mapping[str, Any]) -> Place:
    """The place of the i-th table of a name."""
    name = value.get("name")
    named = f' ("{" ".join(name.split())[:40]}")' if isinstance(name, str) and name else ""
    line = lines.get((table, i, ""), lines.get((table, 0, "")))
    return Place(file, line, f"{table} {i + 1}{named}")


class TomlTable:
    """A table whose keys are taken one by one; what is left over in the end is unknown."""

    def __init__(self, values: Mapping[str, Any], place: Place, lines: Lines, name: str, i: int):
        self.values, self.place, self._lines, self._at = values, place, lines, (name, i)
        self._asked: list[str] = []

    def at(self, key: str) -> Place:
        """The place of a key, or of the table."""
        line = self._lines.get((*self._at, key), self.place.line)
        return dataclasses.replace(self.place, line=line)

    def take(self, key: str, read: Callable[[Any], Any], default: Any = ...) -> Any:
        """A key's value, read and checked; the default if it is not there."""
        self._asked.append(key)
        if key not in self.values:
            if default is ...:
                raise self._missing(key)
            return default
        try:
            return read(self.values[key])
        except ValueError as error:
            shown = _shown(self.values[key])
            raise self.at(key).error(f"`{key}` must be {error}, but is {shown}.") from None

    def file(self, beside: Beside, key: str = "file") -> pathlib.Path:
        """The path of a file that the table names."""
        name = self.take(key, word)
        try:
            return beside.file(name)
        except ValueError as error:
            raise self.at(key).error(str(error).replace("`file`", f"`{key}`")) from None

    def inner(self, key: str) -> TomlTable | None:
        """A table within this one, or None if it is not there."""
        self._asked.append(key)
        if key not in self.values:
            return None
        (outer, i), value = self._at, self.values[key]
        name = f"{outer}.{key}"
        if not isinstance(value, dict):
            raise self.at(key).error(f"`{key}` must be written [{name}], with its own keys.")
        line = self._lines.get((name, i, ""), self.at(key).line)
        return TomlTable(value, Place(self.place.file, line, f"{self.place.what}, {key}"),
                     self._lines, name, i)  # fmt: skip

    def _missing(self, key: str) -> ValueError:
        """Error for a key that is missing or misspelt."""
        left = [k for k in self.values if k not in self._asked]
        meant = difflib.get_close_matches(key, left, 1)
        if not meant:
            return self.place.error(f"`{key}` is missing.")
        return self.at(meant[0]).error(f"`{meant[0]}` is not known here: did you mean `{key}`?")

    def done(self) -> None:
        """Refuse the keys that nobody asked for."""
        for key in self.values:
            if key not in self._asked:
                meant = nearest_known(key, self._asked)
                raise self.at(key).error(f"`{key}` is not known here: {meant}")


def tables_of(tables: Mapping[str, Any], key: str, file: str, lines: Lines) -> list[TomlTable]:
    """All tables [[key]] of a file, in its order."""
    found = enumerate(tables.get(key, []))
    return [TomlTable(v, place_of(file, lines, key, i, v), lines, key, i) for i, v in found]


def _shown(value: Any) -> str:
    try:
        words = " ".join(repr(value).split())
    except ValueError:  # an integer of thousands of digits
        words = "a very long number"
    return words if len(words) <= 40 else words[:37] + "..."


def number(value: Any) -> float:
    """A finite number."""
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise ValueError("a number")
    try:
        found = float(value)
    except OverflowError:
        found = math.inf
    if not math.isfinite(found):
        raise ValueError("a finite number")
    return found


def point(value: Any) -> list[float]:
    """Two finite numbers."""
    if not isinstance(value, list) or len(value) != 2:
        raise ValueError("two numbers")
    try:
        return [number(v) for v in value]
    except ValueError:
        raise ValueError("two finite numbers") from None


def points(value: Any) -> list[list[float]]:
    """A list of pairs of finite numbers, not empty."""
    if not isinstance(value, list) or not value:
        raise ValueError("a list of pairs of numbers")
    try:
        return [point(v) for v in value]
    except ValueError:
        raise ValueError("a list of pairs of finite numbers") from None


def numbers(value: Any) -> list[float]:
    """A list of finite numbers."""
    if not isinstance(value, list):
        raise ValueError("a list of numbers")
    try:
        return [number(v) for v in value]
    except ValueError:
        raise ValueError("a list of finite numbers") from None


def sided(value: Any) -> float | list[Any]:
    """A number, or three or more for bands; or two such, for front and back."""
    try:
        if not isinstance(value, list):
            return number(value)
        if len(value) != 2 or not isinstance(value[0], list):
            return point(value) if len(value) < 3 else numbers(value)
        if len(value[0]) > 2:
            return rows(value)
        raise ValueError
    except ValueError:
        raise ValueError(
            "a number, or three or more for bands; or two such for front and back"
        ) from None


def banded(value: Any) -> float | list[float]:
    """A number, or a list of them, one for each band."""
    try:
        found = numbers(value) if isinstance(value, list) else number(value)
    except ValueError:
        found = []
    if found == []:
        raise ValueError("a number, or one for each band")
    return found


def row(value: Any) -> list[Any]:
    """A list of finite numbers, or of rows of bands."""
    nested = isinstance(value, list) and value and isinstance(value[0], list)
    return rows(value) if nested else numbers(value)


def picture(value: Any) -> list[Any]:
    """Rows of numbers, or of rows of bands; all as long as the first."""
    if not isinstance(value, list) or not value or not isinstance(value[0], list):
        raise ValueError("rows of numbers")
    if not value[0] or not isinstance(value[0][0], list):
        return rows(value)
    found = [rows(v) for v in value]
    if len({(len(v), len(v[0])) for v in found}) != 1:
        raise ValueError("rows of equally many bands")
    return found


def yes(value: Any) -> bool:
    """True or false."""
    if not isinstance(value, bool):
        raise ValueError("true or false")
    return value


def whole(value: Any) -> int:
    """A whole number, not negative."""
    if isinstance(value, bool) or not isinstance(value, int) or not 0 <= value < 2**31:
        raise ValueError("a whole number, not negative")
    return value


def word(value: Any) -> str:
    """A text."""
    if not isinstance(value, str):
        raise ValueError("text in quotes")
    return value


def vector(value: Any) -> list[float]:
    """Three finite numbers."""
    if not isinstance(value, list) or len(value) != 3:
        raise ValueError("three numbers")
    try:
        return [number(v) for v in value]
    except ValueError:
        raise ValueError("three finite numbers") from None


def vectors(value: Any) -> list[list[float]]:
    """A list of vectors, not empty."""
    if not isinstance(value, list) or not value:
        raise ValueError("a list of triples of numbers")
    try:
        return [vector(v) for v in value]
    except ValueError:
        raise ValueError("a list of triples of finite numbers") from None


def three_vectors(value: Any) -> list[list[float]]:
    """Exactly three vectors."""
    if not isinstance(value, list) or len(value) != 3:
        raise ValueError("three vectors of three numbers")
    return vectors(value)


def triples(value: Any) -> list[list[int]]:
    """A list of triples of whole numbers, not empty."""
    if not isinstance(value, list) or not value or any(
        not isinstance(v, list) or len(v) != 3 for v in value
    ):  # fmt: skip
        raise ValueError("a list of triples of whole numbers")
    return [[whole(n) for n in v] for v in value]


def rows(value: Any) -> list[list[float]]:
    """Lists of numbers, all as long as the first."""
    if not isinstance(value, list) or not value or not isinstance(value[0], list):
        raise ValueError("rows of numbers")
    found = [numbers(v) for v in value]
    if len({len(row) for row in found}) != 1:
        raise ValueError("rows of equally many numbers")
    return found
