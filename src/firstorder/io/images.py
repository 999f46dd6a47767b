"""Pictures with linear values, and rows of them as light that arrives from all around.

Radiance's .hdr files are read here, .png and .jpg files by Pillow, and OpenEXR's .exr files by the
package OpenEXR, which comes with `pip install "firstorder[images]"`.
"""

from __future__ import annotations

import os
import pathlib
import re
from typing import TypeAlias

import numpy as np
from jaxtyping import Float

from firstorder.flatland.skies import PanoramaSky
from firstorder.io._channels import check_pixels, check_radiances, read_channels, read_levels
from firstorder.io._regular import read_regular_file

Picture: TypeAlias = np.ndarray

# Rec. 709 luminance of linear red, green and blue.
LUMINANCE = np.array([0.2126, 0.7152, 0.0722])
RADIANCE_FILES = (".hdr", ".pic", ".rgbe")


def read_panorama_row(
    path: str | os.PathLike[str],
    row: int | None = None,
    columns: int | None = None,
    colour: bool = False,
) -> PanoramaSky:
    r"""Reads one row of a panorama as the sky of flatland.

    The picture goes once around; flatland is the plane of that row. Its radiance is the Rec. 709
    luminance `0.2126 R + 0.7152 G + 0.0722 B`, in the picture's own unit, or has the bands red,
    green and blue. The middle of the row is straight up (+y), the right of it +x (`PanoramaSky`).

    Args:
        path: a picture that `read_image` reads.
        row: from the top, 0 first; the middle one, if left out: the horizon.
        columns: how many to keep, each the average of those it covers; all, if left out. Every
            column is a break at which quadrature cuts, so a few hundred at most are wise.
        colour: whether the picture's three bands are kept.

    Raises:
        ValueError: one sentence that names the file, if it cannot be read or has no such row, or
            if a radiance in that row is negative.
        FileNotFoundError: one sentence that names the path, if there is no such file.
        ModuleNotFoundError: if an .exr file is asked for without the extra `images`.

    Example:
        >>> import pathlib, tempfile
        >>> from firstorder.io import read_panorama_row
        >>> file = pathlib.Path(tempfile.mkdtemp(), "sky.hdr")
        >>> _ = file.write_bytes(b"#?RADIANCE\n\n-Y 1 +X 4\n" + bytes([128, 128, 128, 129]) * 4)
        >>> print(read_panorama_row(file)(0.3).item())
        1.00390625
    """
    picture = read_image(path)
    name, height = pathlib.Path(path).name, picture.shape[0]
    chosen = height // 2 if row is None else row
    if not 0 <= chosen < height:
        raise ValueError(f"{name}: `row` must lie in [0, {height - 1}], but is {chosen}.")
    values = picture[chosen].astype(float)
    check_radiances(name, values)
    values = values if colour else values @ LUMINANCE
    try:
        sky = PanoramaSky(values)
        return sky if columns is None else sky.coarser(columns)
    except ValueError as error:
        raise ValueError(f"{name}: {str(error).removeprefix('Argument ')}") from None


def read_image(path: str | os.PathLike[str], srgb: bool = True) -> Picture:
    r"""Reads a picture with linear values, shape (rows from the top, columns, RGB).

    Args:
        path: a .hdr (or .pic), .exr, .png or .jpg file. A grey one has three equal bands; how
            transparent pixels are is left out. One that its camera says to turn is turned.
        srgb: whether levels of .png and .jpg files are those of a screen, and are made linear by
            the curve of sRGB; if not, they are numbers from 0 to 1, as in normal maps.

    Raises:
        ValueError: one sentence that names the file, if it is none of these, damaged, too large
            (`docs/files.md`), or holds a number that is not finite.
        FileNotFoundError: one sentence that names the path, if there is no such file.
        ModuleNotFoundError: if an .exr file is asked for without the extra `images`.

    Example:
        >>> import pathlib, tempfile
        >>> from firstorder.io import read_image
        >>> file = pathlib.Path(tempfile.mkdtemp(), "sky.hdr")
        >>> _ = file.write_bytes(b"#?RADIANCE\n\n-Y 1 +X 4\n" + bytes([128, 128, 128, 129]) * 4)
        >>> read_image(file).shape
        (1, 4, 3)
    """
    path = pathlib.Path(path)
    match path.suffix.lower():
        case suffix if suffix in RADIANCE_FILES:
            return _hdr(read_regular_file(path), path.name)
        case ".exr":
            return _exr(path)
        case ".png" | ".jpg" | ".jpeg":
            levels = read_levels(path)
            for row in levels if srgb else ():  # in its place: pictures may be large
                row[:] = linear_from_srgb(row)
            return levels
    raise ValueError(f"{path.name}: a picture must be an .hdr, .exr, .png or .jpg file.")


def linear_from_srgb(levels: Float[np.ndarray, "*n"]) -> Float[np.ndarray, "*n"]:
    """Linear light from levels of a screen, both from 0 to 1: the inverse of the curve of sRGB.

    `c / 12.92` up to 0.04045, and `((c + 0.055) / 1.055)^2.4` above.

    Reference: IEC 61966-2-1.

    Example:
        >>> import numpy as np
        >>> from firstorder.io import linear_from_srgb
        >>> linear_from_srgb(np.array([0.0, 0.5, 1.0])).round(6).tolist()
        [0.0, 0.214041, 1.0]
    """
    c = np.asarray(levels, float)
    return np.where(c <= 0.04045, c / 12.92, ((c + 0.055) / 1.055) ** 2.4)


# --- OpenEXR -------------------------------------------------------------------------------------


def _exr(path: pathlib.Path) -> Picture:
    found = read_channels(path)
    names = ("R", "G", "B") if "R" in found else ("Y", "Y", "Y")
    picture = [found[name] for name in names if name in found]
    if len(picture) < 3 or any(c.ndim != 2 or c.shape != picture[0].shape for c in picture):
        listed = ", ".join(sorted(found)) or "none"
        raise ValueError(f"{path.name}: the channels must be R, G, B or Y, but are {listed}.")
    picture = np.stack(picture, -1)
    if not np.all(np.isfinite(picture)):
        raise ValueError(f"{path.name}: the picture holds numbers that are not finite.")
    return picture


# --- Radiance ------------------------------------------------------------------------------------


def _hdr(data: bytes, name: str) -> Picture:
    """The shared-exponent format of Radiance: a header in lines, then rows, packed or not."""
    head = re.match(
        rb"#\?[^\n]*\n(?:[^\n]*\n)*?[^\S\n]*\n([-+]Y) (\d{1,9}) ([-+]X) (\d{1,9})\n", data
    )
    if head is None or b"xyze" in data[: head.end()]:
        raise ValueError(f"{name}: the file is no Radiance picture in RGBE with rows across.")
    height, width = int(head[2]), int(head[4])
    check_pixels(name, width, height, len(data))
    picture, at = np.empty((height, width, 3)), head.end()
    for i in range(height):
        try:
            row, at = _packed_row(data, at, width)
        except IndexError:
            raise ValueError(f"{name}: the file ends in row {i} of {height}.") from None
        # As Radiance has it: the middle of what was truncated; an exponent of 0 is black.
        scale = np.where(row[:, 3:] > 0, np.ldexp(1.0, row[:, 3:].astype(int) - 136), 0.0)
        picture[i] = (row[:, :3] + 0.5) * scale
    return picture[:: 1 if head[1] == b"-Y" else -1, :: 1 if head[3] == b"+X" else -1]


def _packed_row(data: bytes, at: int, width: int) -> tuple[np.ndarray, int]:
    """One row of bytes (width, 4), and where the next begins."""
    begins = data[at : at + 4]
    if not (8 <= width < 32768 and begins[:2] == b"\2\2" and width == begins[2] << 8 | begins[3]):
        return _plain_row(data, at, width)
    at += 4
    channels = bytearray()
    for channel in range(1, 5):
        while len(channels) < channel * width:
            count = data[at]
            if count > 128:  # a run of one byte
                channels.extend(data[at + 1 : at + 2] * (count - 128))
                at += 2
            else:
                channels.extend(data[at + 1 : at + 1 + count])
                at += 1 + count
            if at > len(data) or count == 0 or len(channels) > channel * width:
                raise IndexError
    return np.frombuffer(bytes(channels), np.uint8).reshape(4, width).T, at


def _plain_row(data: bytes, at: int, width: int) -> tuple[np.ndarray, int]:
    """One row that is not packed, or packed the old way: pixels (1, 1, 1, n) repeat the last."""
    pixels, shift = bytearray(), 0
    while len(pixels) < 4 * width:
        pixel = data[at : at + 4]
        if len(pixel) < 4:
            raise IndexError
        at += 4
        if pixel[:3] == b"\1\1\1" and pixels:
            pixels.extend(pixels[-4:] * min(pixel[3] << shift, width))
            shift += 8
        else:
            pixels.extend(pixel)
            shift = 0
    return np.frombuffer(bytes(pixels[: 4 * width]), np.uint8).reshape(width, 4), at
