"""Channels of an OpenEXR file, and levels of .png and .jpg files; how many pixels are read."""

from __future__ import annotations

import io
import os
import pathlib
from typing import Any, NamedTuple

import numpy as np

from firstorder.io._quietly import quietly
from firstorder.io._regular import check_regular_file, named_errors, read_regular_file

# Pixels of one picture, 16,384 x 8,192. A file of few bytes may unpack to 2,048 x 2,048, a larger
# one to 2,048 for each of its bytes: one grey all over, packed by deflate, stays below that.
MOST_PIXELS = 2**27
MOST_PIXELS_OF_A_SMALL_FILE = 2**22
MOST_PIXELS_A_BYTE = 2**11


def check_pixels(name: str, width: int, height: int, file_bytes: int, layers: int = 1) -> None:
    """Refuses a picture before anything is allocated for it, if it is too large.

    Args:
        name: of the file.
        width: in pixels, as the header has it.
        height: in pixels.
        file_bytes: of the file.
        layers: how many pictures of that size it holds.

    Raises:
        ValueError: one sentence that names the file.

    Example:
        >>> from firstorder.io._channels import check_pixels
        >>> check_pixels("a.hdr", 4096, 2048, 10_000_000)
        >>> try:
        ...     check_pixels("a.hdr", 134_217_727, 1, 89)
        ... except ValueError as error:
        ...     print(error)
        a.hdr: a picture of 134217727 x 1 pixels is not read from a file of 89 bytes.
    """
    if width < 1 or height < 1:
        raise ValueError(f"{name}: a picture of {width} x {height} pixels is not read here.")
    pixels = width * height * layers
    if pixels > MOST_PIXELS:
        what = f"{width} x {height} pixels" + f" in {layers} layers" * (layers > 1)
        raise ValueError(f"{name}: a picture of {what} is not read here: at most {MOST_PIXELS}.")
    if pixels > max(MOST_PIXELS_OF_A_SMALL_FILE, MOST_PIXELS_A_BYTE * file_bytes):
        raise ValueError(
            f"{name}: a picture of {width} x {height} pixels is not read from a file of "
            f"{file_bytes} bytes."
        )


def check_radiances(name: str, pixels: np.ndarray) -> None:
    """Refuses light below zero in a picture.

    Args:
        name: of the file.
        pixels: of any shape.

    Raises:
        ValueError: one sentence that names the file.

    Example:
        >>> import numpy as np
        >>> from firstorder.io._channels import check_radiances
        >>> check_radiances("a.exr", np.array([[0.0, 2.5]]))
    """
    if np.any(pixels < 0.0):
        raise ValueError(f"{name}: `radiance` must not be negative, but is {np.min(pixels):g}.")


def read_channels(path: pathlib.Path) -> dict[str, np.ndarray]:
    """All channels of an .exr file as they lie in it: rows from the top."""
    OpenEXR = openexr(path.name)
    check_regular_file(path)
    with named_errors(path):
        path.open("rb").close()  # a file that may not be opened is no broken one
    try:
        with quietly(), OpenEXR.File(os.fspath(path), header_only=True) as file:
            parts = [_promise(part.header) for part in file.parts]
    except Exception:  # whatever the library thinks of the bytes
        raise _broken_exr(path) from None
    for part in parts:
        _check_part(path, part)
    try:
        with quietly(), OpenEXR.File(os.fspath(path), separate_channels=True) as file:
            found = {name: np.array(c.pixels) for name, c in file.channels().items()}
    except Exception:
        raise _broken_exr(path) from None
    if any(a.dtype.kind not in "fu" or a.ndim != 2 for a in found.values()):
        raise _broken_exr(path)
    return found


class _Promise(NamedTuple):
    """One of the pictures in an .exr file, as its header has it."""

    window: tuple[int, int]
    tile: tuple[int, int]
    channels: int
    deep: bool


def _promise(header: dict[str, Any]) -> _Promise:
    (left, top), (right, bottom) = (corner.tolist() for corner in header["dataWindow"])
    tile, kind = header.get("tiles"), getattr(header.get("type"), "name", "")
    return _Promise(
        (right - left + 1, bottom - top + 1),
        (1, 1) if tile is None else (tile.xSize, tile.ySize),
        len(header["channels"]),
        kind.startswith("deep"),
    )


def _check_part(path: pathlib.Path, part: _Promise) -> None:
    """Refuses what is too large, as a whole or in one tile, and what is no picture of one depth."""
    if part.deep:
        raise ValueError(f"{path.name}: deep pictures, of many samples in a pixel, are not read.")
    size, layers = path.stat().st_size, -(-part.channels // 4)
    check_pixels(path.name, *part.window, size, layers)
    check_pixels(path.name, *part.tile, size, layers)


def _broken_exr(path: pathlib.Path) -> ValueError:
    return ValueError(f"{path.name}: the file is damaged or is no OpenEXR picture.")


def read_levels(path: pathlib.Path) -> np.ndarray:
    """Levels of a .png or .jpg file from 0 to 1, shape (rows from the top, columns, RGB)."""
    from PIL import Image

    data = read_regular_file(path)
    try:
        # Pillow has a limit of its own, which warns first, and others of what text may unpack to.
        with quietly(), Image.open(io.BytesIO(data), formats=("PNG", "JPEG")) as image:
            check_pixels(path.name, *image.size, len(data))
            packed = str(image.tile[0][3])
            if image.mode.startswith("I"):  # grey, of 16 bits
                levels = np.repeat(np.asarray(image, float)[..., None], 3, -1)
                levels /= 65535.0
            else:
                levels = np.asarray(image.convert("RGB"), float)
                if packed in _SECOND_BYTES:
                    levels = 256.0 * levels + _second_bytes(data, packed)
                levels /= 65535.0 if packed in _SECOND_BYTES else 255.0
            turn = _orientation(image)
    except Image.DecompressionBombError:
        raise ValueError(
            f"{path.name}: the picture has more than {MOST_PIXELS} pixels, too many to be read."
        ) from None
    except Exception as error:  # whatever the library thinks of the bytes
        if str(error).startswith(f"{path.name}: "):
            raise
        kind = path.suffix[1:].upper()
        raise ValueError(f"{path.name}: the file is damaged or is no {kind} picture.") from None
    return _turned(levels, turn)


# Of numbers of 16 bits in colour Pillow has the first byte alone. Taken for another kind of pixels,
# the same file gives the second: by Pillow's names, and the bands in which it then lies.
_SECOND_BYTES = {
    "RGB;16B": ("RGB;16L", (0, 1, 2)),
    "RGBA;16B": ("RGBA;16L", (0, 1, 2)),
    "LA;16B": ("RGBA", (1, 1, 1)),
}


def _second_bytes(data: bytes, packed: str) -> np.ndarray:
    """Second bytes of red, green and blue of a .png file of 16 bits."""
    from PIL import Image

    other, bands = _SECOND_BYTES[packed]
    with Image.open(io.BytesIO(data), formats=("PNG",)) as image:
        image.tile = [image.tile[0]._replace(args=other)]
        return np.asarray(image, float)[..., bands]


def _orientation(image: Any) -> int:
    """Orientation of a picture as EXIF counts it, 1 to 8; 1 where its camera says nothing."""
    try:
        return image.getexif().get(0x0112, 1)
    except Exception:  # words about a picture that cannot be read say nothing
        return 1


def _turned(levels: np.ndarray, orientation: int) -> np.ndarray:
    """A picture as it is to be seen."""
    if orientation in (5, 6, 7, 8):
        levels = levels.swapaxes(0, 1)
    rows = slice(None, None, -1 if orientation in (3, 4, 7, 8) else 1)
    columns = slice(None, None, -1 if orientation in (2, 3, 6, 7) else 1)
    return levels[rows, columns]


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
