"""Files of shadow rays, traced by one program and filtered by another.

Little-endian, no compression, so that it can be read anywhere and mapped into memory:

    bytes     what
    0-7       `1storay2`: what it is, and which edition
    8-15      number of rays n, an unsigned integer of 64 bits
    16-135    the lamp in doubles: center (3), axes (9, row by row), half edges (2), 1 to spare
    136-      the rays in singles, seven columns of n each: y1, y2, v1, v2, near, far, start

Seven numbers of four bytes make 28 bytes a ray: E11's database of 637,000 rays takes 17.8 MB here
and 17 MB there, where one depth is kept, and not where rays start. The first edition (24 bytes) did
not keep that either, so that its rays were of use at the level of their receivers alone; it is
refused.
"""

from __future__ import annotations

import os
import pathlib
import struct

import numpy as np

from firstorder.io._regular import read_regular_file
from firstorder.io.files import atomic_write
from firstorder.shadowfield.rendering.lamp import LampFrame
from firstorder.shadowfield.rendering.ray_table import RayTable

MAGIC, FORMER = b"1storay2", b"1storay1"
BYTES_A_RAY = 28
_MOST_BYTES = 2**40  # as many as there is memory for
_HEAD = struct.Struct("<8sQ15d")


def write_rays(path: str | os.PathLike[str], lamp: LampFrame, table: RayTable) -> None:
    """Writes a lamp and its rays, whole or not at all.

    Args:
        path: ends in .rays.
        lamp: in whose frame the rays are given.
        table: the rays.

    Raises:
        ValueError: for another kind of file.

    Example:
        >>> import pathlib, tempfile
        >>> import numpy as np
        >>> from firstorder.io import read_rays, write_rays
        >>> from firstorder.shadowfield import lamp_frame
        >>> from firstorder.shadowfield import trace_shadow_rays
        >>> lamp = lamp_frame((0, 0, 1), (0, 1, 0), (1, 0, 0))
        >>> free = lambda a, b: (np.full(len(a), np.inf), np.full(len(a), -np.inf))
        >>> file = pathlib.Path(tempfile.mkdtemp(), "a.rays")
        >>> write_rays(file, lamp, trace_shadow_rays(lamp, np.zeros((1, 3)), 8, free)[0])
        >>> file.stat().st_size, len(read_rays(file)[1].near)  # 136 + 8 * 28
        (360, 8)
    """
    path = pathlib.Path(path)
    _check_ending(path)
    numbers = np.concatenate([np.ravel(a).astype(float) for a in lamp])
    columns = [*table.y.T, *table.v.T, table.near, table.far, table.start]
    with atomic_write(path) as part, part.open("wb") as file:
        file.write(_HEAD.pack(MAGIC, len(table.near), *numbers, 0.0))
        for column in columns:
            file.write(np.ascontiguousarray(column, "<f4").tobytes())


def read_rays(path: str | os.PathLike[str]) -> tuple[LampFrame, RayTable]:
    """Reads a lamp and its rays, to the bit as they were written.

    Args:
        path: ends in .rays.

    Raises:
        ValueError: one sentence that names the file, if it is none of these, of the first edition,
            or not whole.
        FileNotFoundError: one sentence that names the path, if there is no such file.

    Example:
        >>> import pathlib, tempfile
        >>> import numpy as np
        >>> from firstorder.io import read_rays, write_rays
        >>> from firstorder.shadowfield import lamp_frame, trace_shadow_rays
        >>> lamp = lamp_frame((0, 0, 1), (0, 1, 0), (1, 0, 0))
        >>> free = lambda a, b: (np.full(len(a), np.inf), np.full(len(a), -np.inf))
        >>> file = pathlib.Path(tempfile.mkdtemp(), "a.rays")
        >>> write_rays(file, lamp, trace_shadow_rays(lamp, np.zeros((1, 3)), 8, free)[0])
        >>> len(read_rays(file)[1].near)
        8
    """
    path = pathlib.Path(path)
    _check_ending(path)
    data = read_regular_file(path, _MOST_BYTES)
    if data[:8] == FORMER:
        raise ValueError(
            f"{path.name}: the rays are of the first edition, which does not say where they start: "
            "trace and write them again."
        )
    if len(data) < _HEAD.size or data[:8] != MAGIC:
        raise ValueError(f"{path.name}: the file holds no shadow rays (it does not begin so).")
    _, count, *numbers = _HEAD.unpack_from(data)
    expected = _HEAD.size + BYTES_A_RAY * count
    if len(data) != expected:
        raise ValueError(
            f"{path.name}: {count} rays take {expected} bytes, but the file has {len(data)}."
        )
    lamp = LampFrame(
        np.array(numbers[:3]), np.array(numbers[3:12]).reshape(3, 3), np.array(numbers[12:14])
    )
    columns = np.frombuffer(data, "<f4", 7 * count, _HEAD.size).reshape(7, count)
    table = RayTable(columns[:2].T.copy(), columns[2:4].T.copy(), *(a.copy() for a in columns[4:]))
    _check_rays(path.name, lamp, table)
    return lamp, table


def _check_ending(path: pathlib.Path) -> None:
    if path.suffix.lower() != ".rays":
        raise ValueError(f"{path.name}: shadow rays are kept in .rays files.")


def _check_rays(name: str, lamp: LampFrame, table: RayTable) -> None:
    """A file that is whole may still be nonsense: the filter must not be fed with it."""
    frame = np.all(np.isfinite(lamp.center)) and np.allclose(lamp.axes @ lamp.axes.T, np.eye(3))
    if not (frame and np.all((lamp.half > 0.0) & np.isfinite(lamp.half))):
        raise ValueError(
            f"{name}: the lamp's frame is none (axes must be orthogonal, edges positive)."
        )
    hidden = ~table.free
    depths = (table.near >= 0.0) & np.where(hidden, table.near <= table.far, np.isneginf(table.far))
    depths &= (table.start > 0.0) & (table.far <= table.start)
    if not (all(np.all(np.isfinite(a)) for a in (table.y, table.v, table.start)) and depths.all()):
        raise ValueError(
            f"{name}: a ray is none (places finite, first blocker before the last one, that before "
            "its start)."
        )
