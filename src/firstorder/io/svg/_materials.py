"""Albedos from the colours of a drawing."""

from __future__ import annotations

import contextlib
import re
from typing import Any

from firstorder.io.svg._shapes import svgelements

_LONGEST = 200  # longer words are no colour, and the library takes quadratic time to say so
_PATTERNS = r"#[0-9a-f]{3}|#[0-9a-f]{6}|(rgb|hsl)a?\([-+0-9.%,/ deg]*\)"


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
    color: Any = None
    if len(paint) <= _LONGEST and (re.fullmatch(_PATTERNS, paint) or paint.isalpha()):
        package = svgelements()
        with contextlib.suppress(Exception):  # whatever the library thinks of it
            color = package.Color(paint)
    # it takes what it does not know for black
    named = paint.isalpha() and paint != "black"
    if color is None or color.value is None or (named and color.value == 255):
        raise ValueError(f"{paint[:40]!r} is not a colour.")
    return (0.2126 * color.red + 0.7152 * color.green + 0.0722 * color.blue) / 255.0
