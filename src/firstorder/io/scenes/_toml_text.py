"""Values of scenes as TOML text that is read back to the bit."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np


def quoted(name: str) -> str:
    """A TOML string: JSON's, but for DEL, which TOML wants escaped too."""
    return json.dumps(name, ensure_ascii=False).replace("\x7f", "\\u007f")


def exact_text(value: Any) -> str:
    """Numbers such that reading them back gives the same bits."""
    array = np.asarray(value)
    if array.ndim:
        return "[" + ", ".join(exact_text(v) for v in array) + "]"
    return repr(float(array))


def material_lines(given: Mapping[str, Any]) -> Iterator[str]:
    """Lines of TOML for the numbers of a material that differ from the defaults.

    Raises:
        ValueError: if there are bands, but fewer than three, which a file has no words for.
    """
    for key, value in given.items():
        value = np.asarray(value)
        if value.ndim > 1 and value.shape[1] < 3:
            raise ValueError(
                "Argument `scene` must have three bands or more to be written, or none, but has "
                f"{value.shape[1]}."
            )
        if value.ndim:
            front, back = (exact_text(v) for v in value)
            alike = exact_text(np.zeros_like(value[0])) if key == "emission" else front
            words = front if back == alike else f"[{front}, {back}]"
        else:
            words = exact_text(value)
        if words != "0.0":
            yield f"{key} = {words}"
