"""SVG shapes as paths: attributes are read strictly, and interpreted by svgelements.

svgelements knows the grammar of path data, of transforms and of colours. It forgives what it does
not understand; a scene should not, so the words are checked before they get there.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from firstorder.io.svg._paths import Bezier, Conic, Piece, Subpath

# Nothing that is matched is given back (++, *+, ?+), so that no text takes more than one pass.
_NUMBER = r"[-+]?+(?:\d++\.?+\d*+|\.\d++)(?:[eE][-+]?+\d++)?+"
_NUMBERS = re.compile(rf"\s*+(?:{_NUMBER}(?:\s*+,\s*+|\s++|(?=[-+])|\Z))*+")
_STEP = re.compile(r"(?<!\w)(\w++)\s*+\(([^()]*+)\)\s*+,?+\s*+")
# CSS: an inch is 96 px.
_UNITS = {"": 1.0, "px": 1.0, "in": 96.0, "cm": 96.0 / 2.54, "mm": 96.0 / 25.4, "pt": 96.0 / 72.0,
          "pc": 16.0, "q": 96.0 / 101.6}  # fmt: skip

Attributes = Mapping[str, str]


def svgelements() -> Any:
    """The package svgelements, which comes with an extra.

    Raises:
        ModuleNotFoundError: in one sentence that names it.
    """
    try:
        import svgelements as package
    except ModuleNotFoundError:
        raise ModuleNotFoundError(
            "SVG drawings need the package svgelements, which comes with the extra `drawings`: "
            'pip install "firstorder[drawings]".'
        ) from None
    return package


# --- attributes ----------------------------------------------------------------------------------


def floats(key: str, words: str, count: int | None = None) -> list[float]:
    """Finite numbers between spaces or commas.

    Raises:
        ValueError: if they are no numbers, or not as many as they should be.
    """
    if not _NUMBERS.fullmatch(words):
        raise ValueError(f"`{key}` must be numbers, but is {words[:40]!r}.")
    numbers = [float(n) for n in re.findall(_NUMBER, words)]
    if not all(math.isfinite(n) for n in numbers):
        raise ValueError(f"`{key}` must be finite, but is {words[:40]!r}.")
    if count is not None and len(numbers) != count:
        many = "a number" if count == 1 else f"{count} numbers"
        raise ValueError(f"`{key}` must be {many}, but is {words[:40]!r}.")
    return numbers


def length(key: str, words: str) -> float:
    """A length in user units; absolute units by CSS, 96 px to the inch.

    Raises:
        ValueError: if it is none, or relative to something (%, em).
    """
    found = re.fullmatch(rf"\s*+({_NUMBER})\s*+([a-zA-Z]*+)\s*+", words)
    if found is None or found[2].lower() not in _UNITS or not math.isfinite(float(found[1])):
        raise ValueError(f"`{key}` must be a length, but is {words[:40]!r}.")
    return float(found[1]) * _UNITS[found[2].lower()]


def affine(words: str) -> np.ndarray:
    """The matrix (2, 3) of a transform.

    Raises:
        ValueError: if it is none, or flattens the plane.
    """
    counts = {"matrix": (6,), "translate": (1, 2), "scale": (1, 2), "rotate": (1, 3),
              "skewx": (1,), "skewy": (1,)}  # fmt: skip
    matrix, rest = np.eye(2, 3), _STEP.sub("", words)
    if rest.strip():
        raise ValueError(f"`transform` is not understood: {words[:40]!r}.")
    for name, numbers in _STEP.findall(words):
        given = floats("transform", re.sub(r"px|deg", "", numbers))
        if len(given) not in counts.get(name.lower(), ()):
            raise ValueError(f"`transform` is not understood: {words[:40]!r}.")
        m = svgelements().Matrix(f"{name}({' '.join(map(repr, given))})")
        A, b = np.array([[m.a, m.c], [m.b, m.d]]), np.array([m.e, m.f])
        matrix = np.concatenate([matrix[:, :2] @ A, (matrix[:, :2] @ b + matrix[:, 2])[:, None]], 1)
    if not np.all(np.isfinite(matrix)) or abs(np.linalg.det(matrix[:, :2])) < 1e-200:
        raise ValueError(f"`transform` must be invertible, but is {words[:40]!r}.")
    return matrix


# --- shapes --------------------------------------------------------------------------------------


def subpaths(tag: str, attributes: Attributes) -> list[Subpath]:
    """Subpaths that an element draws, in its own coordinates; none if its size is zero.

    Raises:
        ValueError: if an attribute is missing or wrong.
    """
    return SHAPES[tag](attributes)


def _get(attributes: Attributes, key: str, default: str = "0") -> float:
    return length(key, attributes.get(key, default))


def _size(attributes: Attributes, key: str) -> float:
    if key not in attributes:
        raise ValueError(f"`{key}` is missing.")
    value = _get(attributes, key)
    if value < 0.0:
        raise ValueError(f"`{key}` must not be negative, but is {value:g}.")
    return value


def _lines(points: np.ndarray, closed: bool) -> list[Subpath]:
    if closed:
        points = np.concatenate([points, points[:1]])
    pieces = tuple(Bezier(points[i : i + 2]) for i in range(len(points) - 1))
    whole = len(points) > 3 and np.array_equal(points[0], points[-1])
    return [Subpath(pieces, closed or whole)] if pieces else []


def _line(a: Attributes) -> list[Subpath]:
    return _lines(np.array([[_get(a, "x1"), _get(a, "y1")], [_get(a, "x2"), _get(a, "y2")]]), False)


def _poly(closed: bool) -> Callable[[Attributes], list[Subpath]]:
    def read(a: Attributes) -> list[Subpath]:
        numbers = floats("points", a.get("points", ""))
        if len(numbers) % 2:
            raise ValueError(f"`points` must be pairs of numbers, but has {len(numbers)} numbers.")
        return _lines(np.array(numbers).reshape(-1, 2), closed)

    return read


def _oval(x: float, y: float, rx: float, ry: float) -> list[Subpath]:
    if rx == 0.0 or ry == 0.0:
        return []
    middle, u, v = np.array([x, y]), np.array([rx, 0.0]), np.array([0.0, ry])
    return [Subpath((Conic(middle, u, v, 0.0, 2.0 * math.pi),), True)]


def _circle(a: Attributes) -> list[Subpath]:
    r = _size(a, "r")
    return _oval(_get(a, "cx"), _get(a, "cy"), r, r)


def _ellipse(a: Attributes) -> list[Subpath]:
    return _oval(_get(a, "cx"), _get(a, "cy"), _size(a, "rx"), _size(a, "ry"))


def _rect(a: Attributes) -> list[Subpath]:
    x, y, w, h = _get(a, "x"), _get(a, "y"), _size(a, "width"), _size(a, "height")
    if w == 0.0 or h == 0.0:
        return []
    rx, ry = (_size(a, k) if a.get(k, "auto") != "auto" else None for k in ("rx", "ry"))
    rx, ry = (rx if rx is not None else ry or 0.0), (ry if ry is not None else rx or 0.0)
    rx, ry = min(rx, 0.5 * w), min(ry, 0.5 * h)
    if rx == 0.0 or ry == 0.0:
        return _lines(np.array([[x, y], [x + w, y], [x + w, y + h], [x, y + h]]), True)
    u, v = np.array([rx, 0.0]), np.array([0.0, ry])
    pieces: list[Piece] = []
    # quarter turns about the middles of the rounding, from the upper right on
    corners = [
        (x + w - rx, y + ry),
        (x + w - rx, y + h - ry),
        (x + rx, y + h - ry),
        (x + rx, y + ry),
    ]
    for k, middle in enumerate(corners):
        turn = Conic(np.array(middle), u, v, (k - 1) * 0.5 * math.pi, 0.5 * math.pi)
        if pieces:
            pieces.append(Bezier(np.stack([pieces[-1].points(1)[-1], turn.points(1)[0]])))
        pieces.append(turn)
    pieces.append(Bezier(np.stack([pieces[-1].points(1)[-1], pieces[0].points(1)[0]])))
    return [Subpath(tuple(pieces), True)]


# Smooth curves behind curves of another degree.
_ABRUPT = frozenset(("qs", "ts", "ct", "st"))
_COMMANDS = {"m": 2, "l": 2, "h": 1, "v": 1, "c": 6, "s": 4, "q": 4, "t": 2, "z": 0}


def _path(a: Attributes) -> list[Subpath]:
    d = a.get("d", "").strip()
    if d in ("", "none"):
        return []
    words = _checked_path(d)
    try:
        segments = list(svgelements().Path(words))
        return _pieces(segments)
    except ModuleNotFoundError:
        raise
    except Exception:  # whatever the library thinks of it
        raise ValueError(f"`d` is no path: {_short(d)!r}.") from None


def _checked_path(d: str) -> str:
    """The data of a path in which every piece behind a z begins with a move.

    svgelements looks for the last move at each z, which takes quadratic time if there is none; and
    it skips what it does not know, which is refused. It goes on smoothly from curves of any degree;
    by SVG, only cubics go on from cubics and quadratics from quadratics, so that a line of no
    length comes between the others.
    """
    parts = re.findall(r"([A-DF-Za-df-z])([^A-DF-Za-df-z]*)", d)
    if not re.match(r"[Mm]", d):
        raise ValueError(f"`d` must begin with a move, but is {_short(d)!r}.")
    for command, numbers in parts:
        if command in "aA":  # its flags need no space between them
            ok = re.fullmatch(r"[-+0-9.eE,\s]+", numbers) is not None
        elif command.lower() in _COMMANDS:
            count, many = _COMMANDS[command.lower()], len(floats("d", numbers))
            ok = many == 0 if count == 0 else many > 0 and many % count == 0
        else:
            ok = False
        if not ok:
            raise ValueError(f"`d` has a wrong part: {_short((command + numbers).strip())!r}.")
    before = ["", *(c.lower() for c, _ in parts)]
    return "".join(
        "l0 0" * (b + c.lower() in _ABRUPT) + c + n + "m0 0" * (c in "zZ")
        for b, (c, n) in zip(before, parts, strict=False)
    )


def _short(words: str) -> str:
    words = " ".join(words.split())
    return words if len(words) <= 40 else words[:37] + "..."


def _pieces(segments: list[Any]) -> list[Subpath]:
    """Subpaths from the segments of svgelements."""
    found: list[Subpath] = []
    pieces: list[Piece] = []

    def finish(closed: bool) -> None:
        if pieces:
            whole = np.array_equal(pieces[0].points(1)[0], pieces[-1].points(1)[-1])
            found.append(Subpath(tuple(pieces), closed or whole))
            pieces.clear()

    for segment in segments:
        kind = type(segment).__name__
        if kind == "Move":
            finish(False)
        elif kind == "Arc" and min(abs(segment.sweep), segment.rx, segment.ry) > 0.0:
            middle = _xy(segment.center)
            u, v = _xy(segment.prx) - middle, _xy(segment.pry) - middle
            pieces.append(Conic(middle, u, v, float(segment.get_start_t()), float(segment.sweep)))
        else:
            names = {"CubicBezier": ("start", "control1", "control2", "end"),
                     "QuadraticBezier": ("start", "control", "end")}  # fmt: skip
            ends = names.get(kind, ("start", "end"))
            control = np.stack([_xy(getattr(segment, name)) for name in ends])
            if np.any(control != control[0]):
                pieces.append(Bezier(control))
            if kind == "Close":
                finish(True)
    finish(False)
    return found


def _xy(point: Any) -> np.ndarray:
    return np.array([float(point.x), float(point.y)])


SHAPES: dict[str, Callable[[Attributes], list[Subpath]]] = {
    "line": _line,
    "polyline": _poly(False),
    "polygon": _poly(True),
    "rect": _rect,
    "circle": _circle,
    "ellipse": _ellipse,
    "path": _path,
}
