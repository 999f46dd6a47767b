"""Channels of an OpenEXR file, and levels of .png and .jpg files."""

from __future__ import annotations

import io
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


def read_levels(path: pathlib.Path) -> np.ndarray:
    """Levels of a .png or .jpg file from 0 to 1, shape (rows from the top, columns, RGB)."""
    from PIL import Image

    data = path.read_bytes()
    try:
        with Image.open(io.BytesIO(data)) as image:
            if image.mode.startswith("I"):  # grey, of 16 bits
                grey = np.asarray(image, float) / 65535.0
                return np.repeat(grey[..., None], 3, -1)
            return np.asarray(image.convert("RGB"), float) / 255.0
    except Exception:  # whatever the library thinks of the bytes
        kind = path.suffix[1:].upper()
        raise ValueError(f"{path.name}: the file is no {kind} picture.") from None


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
