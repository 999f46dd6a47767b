"""Albedos from the colours of a drawing."""

from __future__ import annotations

import colorsys
import contextlib
import re
from typing import Any

from firstorder.io.svg._shapes import floats, svgelements

_LONGEST = 200  # longer words are no colour, and the library takes quadratic time to say so
_FUNCTION = re.compile(r"(rgb|hsl)a?\(([^()]*)\)")
# What stands for one whole where a number has no percent sign.
_WHOLE = {"rgb": (255.0, 255.0, 255.0), "hsl": (360.0, 100.0, 100.0)}


def albedo_of(paint: str, strict: bool = True) -> float | None:
    """The albedo that a paint stands for: its luminance; None for no paint.

    Args:
        paint: as in `stroke` or `fill`.
        strict: whether a paint without a luminance (a gradient) is an error; or else 0.

    Raises:
        ValueError: if it is no colour.
        ModuleNotFoundError: without the extra `drawings`.

    Example:
        >>> from firstorder.io.svg._materials import albedo_of
        >>> round(albedo_of("#808080"), 3), albedo_of("none")
        (0.502, None)
    """
    paint = paint.strip().lower()
    if paint in ("none", "transparent", ""):
        return None
    if paint in ("currentcolor", "context-stroke", "context-fill"):
        return 0.0
    if paint.startswith("url("):
        if strict:
            raise ValueError("a gradient or a pattern has no albedo: `data-albedo` has to say it.")
        return 0.0
    color = None
    if len(paint) <= _LONGEST:
        with contextlib.suppress(ValueError):
            call = _FUNCTION.fullmatch(paint)
            color = _named(paint) if call is None else _computed(*call.groups())
    if color is None:
        raise ValueError(f"{paint[:40]!r} is not a colour.")
    red, green, blue = color
    return 0.2126 * red + 0.7152 * green + 0.0722 * blue


def _computed(kind: str, words: str) -> tuple[float, float, float]:
    """Red, green and blue of `rgb()` or `hsl()`, with or without commas; opacity is left out.

    svgelements knows these with commas alone, and takes others for black.
    """
    parts = re.sub("[,/]", " ", words).split()
    if len(parts) not in (3, 4):
        raise ValueError("there must be three numbers, or four.")
    first, second, third = (
        floats("color", part.removesuffix("deg").removesuffix("%"), 1)[0]
        / (100.0 if part.endswith("%") else whole)
        for part, whole in zip(parts, _WHOLE[kind], strict=False)
    )
    if kind == "hsl":
        return colorsys.hls_to_rgb(first, _share(third), _share(second))
    return _share(first), _share(second), _share(third)


def _share(number: float) -> float:
    return min(max(number, 0.0), 1.0)


def _named(paint: str) -> tuple[float, float, float] | None:
    """Red, green and blue of a name or of hexadecimal digits."""
    if not (re.fullmatch("#[0-9a-f]{3}|#[0-9a-f]{6}", paint) or paint.isalpha()):
        return None
    package: Any = svgelements()
    color: Any = None
    with contextlib.suppress(Exception):  # whatever the library thinks of it
        color = package.Color(paint)
    # it takes what it does not know for black
    named = paint.isalpha() and paint != "black"
    if color is None or color.value is None or (named and color.value == 255):
        return None
    return color.red / 255.0, color.green / 255.0, color.blue / 255.0
