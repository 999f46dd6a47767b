"""Channels of an OpenEXR file."""

from __future__ import annotations

import os
import pathlib
from typing import Any

import numpy as np


def read_channels(path: pathlib.Path) -> dict[str, np.ndarray]:
    """All channels of an .exr file as they lie in it: rows from the top."""
    OpenEXR = openexr(path.name)
    path.open("rb").close()  # a file that is not there is no broken one
    try:
        with OpenEXR.File(os.fspath(path), separate_channels=True) as file:
            return {name: np.array(c.pixels) for name, c in file.channels().items()}
    except Exception as error:  # whatever the library thinks of the bytes
        words = " ".join(str(error).split()).rstrip(".")
        raise ValueError(f"{path.name}: the file is no OpenEXR picture ({words}).") from None


def openexr(name: str) -> Any:
    """The package OpenEXR, or one sentence about the file that wants it."""
    try:
        import OpenEXR
    except ModuleNotFoundError:
        raise ModuleNotFoundError(
            f"{name}: .exr files need the package OpenEXR, which comes with the extra "
            '`images`: pip install "firstorder[images]".'
        ) from None
    return OpenEXR
