"""Radiance's ambient files as text: printed by `lookamb -d`, read by `lookamb -d -r`.

One record a line. Since radii are ellipses there are 21 columns:

    position 3, normal 3, u 3, level, weight, radii 2, value 3, gradient 2, turning 2, corral

and before that 18: position 3, normal 3, level, weight, radius, value 3, gradient 3, turning 3.
Here v = normal x u. The first radius, the shorter, is along u; a record covers a place if the step
to it, with components over the radii, is shorter than the accuracy (`-aa`). The value is
irradiance over pi, in three colours. Both gradients are shares of the value: per metre along u and
v, and per radian about u and v. `corral` holds flags for directions in which light may leak.

A header (from "#?RADIANCE" to an empty line) is there unless `-h` was given.
"""

from __future__ import annotations

import dataclasses
import math
import os
import pathlib

import jax.numpy as jnp
import numpy as np

from firstorder._argument_checks import check_positive
from firstorder._display import in_print
from firstorder.caching import Cache, Candidates, ValidityRegion
from firstorder.io._regular import read_regular_file
from firstorder.io.files import write_text
from firstorder.io.scenes._elements import Place

COLUMNS = 21
COLUMNS_BEFORE = 18
_WORD = 2**32  # flags fill one, and no level is as high
# Radiance's weights of red, green and blue in a brightness.
BRIGHTNESS = (0.265074126, 0.670114631, 0.064811243)


@dataclasses.dataclass(frozen=True)
class AmbientRecords:
    """Records of an ambient file, one row each.

    Attributes:
        position: (r, 3), in the unit of the scene.
        normal: (r, 3), of length one.
        u: (r, 3), of length one and in the tangent plane: direction of the first radius.
        level: (r,), how many bounces before this one.
        weight: (r,), of the ray that asked for it, in (0, 1].
        radii: (r, 2), along u and v, before the accuracy; the first is not the longer [unit of the
            scene].
        value: (r, 3), irradiance over pi in red, green and blue.
        gradient: (r, 2), along u and v, as a share of the value per unit of length.
        turning: (r, 2), about u and v, as a share of the value per radian.
        corral: (r,), flags of leaks.
    """

    position: np.ndarray
    normal: np.ndarray
    u: np.ndarray
    level: np.ndarray
    weight: np.ndarray
    radii: np.ndarray
    value: np.ndarray
    gradient: np.ndarray
    turning: np.ndarray
    corral: np.ndarray

    __repr__ = in_print

    @property
    def count(self) -> int:
        """Number of records."""
        return len(self.level)


def read_ambient(path: str | os.PathLike[str]) -> AmbientRecords:
    """Reads the text that `lookamb -d` wrote, of either release, with or without a header.

    Args:
        path: of the text.

    Raises:
        ValueError: in one sentence with the line, if the file is none.
        FileNotFoundError: one sentence that names the path, if there is no such file.

    Example:
        >>> import pathlib, tempfile
        >>> from firstorder.io import read_ambient
        >>> file = pathlib.Path(tempfile.mkdtemp(), "a.txt")
        >>> _ = file.write_text("0 0 0 0 0 1 1 0 0 0 1.0 0.5 0.8 1e-1 1e-1 1e-1 0.25 0 0 0 0")
        >>> read_ambient(file).radii.tolist()
        [[0.5, 0.8]]
    """
    path = pathlib.Path(path)
    try:
        text = read_regular_file(path).decode("utf-8")
    except UnicodeDecodeError:
        raise Place(path.name).error(
            "the text form of an ambient file is expected (`lookamb -d`), but this is binary."
        ) from None
    return _ambient_from_text(text, path.name)


def _ambient_from_text(text: str, file: str = "text") -> AmbientRecords:
    """The records in the text that `lookamb -d` prints.

    Args:
        text: with or without its header, of 21 or of 18 columns.
        file: its name, for sentences.

    Raises:
        ValueError: in one sentence with the line.

    Example:
        >>> from firstorder.io.radiance_ambient import _ambient_from_text
        >>> row = "0 0 0 0 0 1 1 0 0 0 1.0 0.5 0.8 1e-1 1e-1 1e-1 0.25 0 0 0 0"
        >>> _ambient_from_text(row).radii.tolist()
        [[0.5, 0.8]]
    """
    lines = text.replace("\r\n", "\n").split("\n")
    start = _after_header(lines, file)
    rows, columns = [], 0
    for number, line in enumerate(lines[start:], start + 1):
        words = line.split()
        if not words:
            continue
        columns = columns or len(words)
        rows.append(_row(words, columns, Place(file, number)))
    if not rows:
        raise Place(file).error("there are no records.")
    table = np.array(rows)
    return _current(table) if columns == COLUMNS else _before(table)


def _after_header(lines: list[str], file: str) -> int:
    """Number of the first line after the header, if there is one."""
    if not lines[0].startswith("#?"):
        return 0
    for i, line in enumerate(lines):
        if line.startswith("FORMAT=") and line[7:].strip() != "ascii":
            raise Place(file, i + 1).error(
                f"the format must be ascii, but is {line[7:].strip()[:40]!r}."
            )
        if not line.strip():
            return i + 1
    raise Place(file).error("the header does not end: an empty line is missing.")


def _row(words: list[str], columns: int, place: Place) -> list[float]:
    """The numbers of a line, checked as Radiance checks them."""
    if columns not in (COLUMNS, COLUMNS_BEFORE):
        raise place.error(f"a record must have 21 columns, or 18, but has {columns}.")
    if len(words) != columns:
        raise place.error(f"a record must have {columns} columns here, but has {len(words)}.")
    row = []
    for word in words:
        try:
            number = float(word)
        except ValueError:
            number = math.nan
        if not math.isfinite(number):
            raise place.error(f"a column must be a finite number, but is {word[:40]!r}.")
        row.append(number)
    first = 9 if columns == COLUMNS else 6
    level, weight = row[first], row[first + 1]
    radii = row[first + 2 : first + (4 if columns == COLUMNS else 3)]
    value = row[first + 2 + len(radii) : first + 5 + len(radii)]
    if level != int(level) or not 0 <= level < _WORD:
        raise place.error(f"the level must be a whole number in [0, 2^32), but is {level:g}.")
    if columns == COLUMNS and (row[-1] != int(row[-1]) or not 0 <= row[-1] < _WORD):
        raise place.error(f"the corral must be a word of 32 bits, but is {row[-1]:g}.")
    if not 0.0 < weight <= 1.0:
        raise place.error(f"the weight must lie in (0, 1], but is {weight:g}.")
    if min(radii) <= 0.0:
        raise place.error(f"a radius must be positive, but is {min(radii):g}.")
    if radii[0] > radii[-1] * (1.0 + 1e-5) + 1e-6:
        raise place.error(
            f"the first radius must not exceed the second, but is {radii[0]:g} to {radii[-1]:g}."
        )
    if min(value) < 0.0:
        raise place.error(f"a value must not be negative, but is {min(value):g}.")
    if np.hypot(np.hypot(*row[3:5]), row[5]) < 1e-3:
        raise place.error("the normal must not be zero.")
    if columns == COLUMNS and np.linalg.norm(np.cross(row[3:6], row[6:9])) < 1e-3:
        raise place.error("u must not be zero or along the normal.")
    return row


def _unit(vectors: np.ndarray) -> np.ndarray:
    return vectors / np.linalg.norm(vectors, axis=1, keepdims=True)


def _current(t: np.ndarray) -> AmbientRecords:
    normal = _unit(t[:, 3:6])
    # Directions are stored in 32 bits, and not quite at a right angle.
    u = t[:, 6:9] - np.sum(t[:, 6:9] * normal, axis=1, keepdims=True) * normal
    return AmbientRecords(
        t[:, 0:3], normal, _unit(u), t[:, 9].astype(int), t[:, 10], t[:, 11:13], t[:, 13:16],
        t[:, 16:18], t[:, 18:20], t[:, 20].astype(np.uint32),
    )  # fmt: skip


def _before(t: np.ndarray) -> AmbientRecords:
    """Circles, and gradients as vectors in space: u is any direction of the plane."""
    normal = _unit(t[:, 3:6])
    least = np.eye(3)[np.argmin(np.abs(normal), axis=1)]
    u = _unit(np.cross(least, normal))
    v = np.cross(normal, u)

    def inside(vectors):
        return np.stack([np.sum(vectors * u, axis=1), np.sum(vectors * v, axis=1)], -1)

    return AmbientRecords(
        t[:, 0:3], normal, u, t[:, 6].astype(int), t[:, 7], t[:, [8, 8]], t[:, 9:12],
        inside(t[:, 12:15]), inside(t[:, 15:18]), np.zeros(len(t), np.uint32),
    )  # fmt: skip


def _ambient_to_text(records: AmbientRecords, *, header: bool = True) -> str:
    """The text of 21 columns that `lookamb -d -r` takes, with a header unless told otherwise.

    `lookamb` prints six decimals; here are nine digits, which it reads as well.
    """
    r = records
    before = np.column_stack([r.position, r.normal, r.u])
    after = np.column_stack([r.weight, r.radii, r.value, r.gradient, r.turning])
    lines = []
    for first, level, last, corral in zip(before, r.level, after, r.corral, strict=True):
        words = [*map(_digits, first), str(int(level)), *map(_digits, last), str(int(corral))]
        lines.append("\t".join(words))
    start = ["#?RADIANCE", "FORMAT=ascii", ""] if header else []
    return "\n".join([*start, *lines]) + "\n"


def _digits(number: float) -> str:
    return f"{number:.9g}"


def write_ambient(
    path: str | os.PathLike[str], records: AmbientRecords, *, header: bool = True
) -> None:
    """Writes `_ambient_to_text`, whole or not at all.

    Args:
        path: of the file.
        records: what is written.
        header: whether the lines that Radiance asks for come first.

    Example:
        >>> import pathlib, tempfile
        >>> from firstorder.io import read_ambient, write_ambient
        >>> a, b = (pathlib.Path(tempfile.mkdtemp(), name) for name in ("a.txt", "b.txt"))
        >>> _ = a.write_text("0 0 0 0 0 1 1 0 0 0 1.0 0.5 0.8 1e-1 1e-1 1e-1 0.25 0 0 0 0")
        >>> write_ambient(b, read_ambient(a))
        >>> read_ambient(b).count
        1
    """
    write_text(path, _ambient_to_text(records, header=header))


def ambient_from_cache(
    cache: Cache, origin: np.ndarray, axes: np.ndarray, *, accuracy: float = 1.0
) -> AmbientRecords:
    """The records of a cache as Radiance has them: grey, of level 0 and weight 1.

    Args:
        cache: on the plane through the origin, in coordinates along the first two axes.
        origin: (3,), where the plane's coordinates are zero [m].
        axes: (3, 3), columns t, b and normal.
        accuracy: the `-aa` with which it will be used: radii are the reaches over it.

    Raises:
        ValueError: if the accuracy is not positive.

    Example:
        >>> import jax.numpy as jnp
        >>> import numpy as np
        >>> from firstorder.caching import Cache, Candidates, circular_regions
        >>> from firstorder.io import ambient_from_cache
        >>> one = Candidates.of(jnp.zeros((1, 2)), jnp.ones(1), jnp.zeros((1, 2)))
        >>> cache = Cache.of(one, circular_regions(jnp.array([0.5]), 0.1, 1.0, dims=2))
        >>> ambient_from_cache(cache, np.zeros(3), np.eye(3)).radii.tolist()
        [[0.5, 0.5]]
    """
    check_positive("accuracy", accuracy)
    t, b, n = np.asarray(axes, float).T
    records, r = cache.records, cache.count
    x = np.asarray(records.position)
    lengths, angle = cache.region.axes()
    # u is along the shorter axis.
    c, s = np.cos(angle + 0.5 * np.pi)[:, None], np.sin(angle + 0.5 * np.pi)[:, None]
    u = c * t + s * b
    v = np.cross(n, u)
    E, g = np.asarray(records.value), np.asarray(records.gradient)
    g3 = g[:, :1] * t + g[:, 1:] * b
    share = np.stack([np.sum(g3 * u, axis=1), np.sum(g3 * v, axis=1)], -1)
    share = np.where(E[:, None] > 0.0, share / np.where(E > 0.0, E, 1.0)[:, None], 0.0)
    return AmbientRecords(
        np.asarray(origin, float) + x[:, :1] * t + x[:, 1:] * b,
        np.broadcast_to(n, (r, 3)),
        u,
        np.zeros(r, int),
        np.ones(r),
        lengths[:, ::-1] / accuracy,
        np.repeat(np.maximum(E, 0.0)[:, None] / np.pi, 3, axis=1),
        share,
        np.zeros((r, 2)),
        np.zeros(r, np.uint32),
    )


def cache_from_ambient(
    records: AmbientRecords,
    origin: np.ndarray,
    axes: np.ndarray,
    *,
    accuracy: float = 1.0,
    thickness: float = 1e-4,
    level: int = 0,
) -> Cache:
    """The records on one plane as a cache of order 1, their colours weighted as a brightness.

    Args:
        records: of all surfaces.
        origin: (3,), a point of the plane [m].
        axes: (3, 3), columns t, b and normal.
        accuracy: the `-aa` with which they were made: reaches are the radii times it.
        thickness: how far from the plane a record may be [m].
        level: of the records to take.

    Raises:
        ValueError: if no record is there, or the accuracy is not positive.

    Example:
        >>> import jax.numpy as jnp
        >>> import numpy as np
        >>> from firstorder.caching import Cache, Candidates, circular_regions
        >>> from firstorder.io import ambient_from_cache, cache_from_ambient
        >>> one = Candidates.of(jnp.zeros((1, 2)), jnp.ones(1), jnp.zeros((1, 2)))
        >>> cache = Cache.of(one, circular_regions(jnp.array([0.5]), 0.1, 1.0, dims=2))
        >>> records = ambient_from_cache(cache, np.zeros(3), np.eye(3))
        >>> round(cache_from_ambient(records, np.zeros(3), np.eye(3)).records.value[0].item(), 6)
        1.0
    """
    check_positive("accuracy", accuracy)
    t, b, n = np.asarray(axes, float).T
    away = records.position - np.asarray(origin, float)
    near = (np.abs(away @ n) <= thickness) & (records.normal @ n > 0.999)
    rows = np.flatnonzero(near & (records.level == level))
    if len(rows) == 0:
        raise ValueError("Argument `records` must hold some on the plane, but holds none.")
    away, u = away[rows], records.u[rows]
    v = np.cross(records.normal[rows], u)
    E = np.pi * records.value[rows] @ np.array(BRIGHTNESS)
    g = E[:, None] * (records.gradient[rows, :1] * u + records.gradient[rows, 1:] * v)
    c, s = u @ t, u @ b
    turn = np.stack([np.stack([c, s], -1), np.stack([-s, c], -1)], -2)  # rows u and v
    scale = 1.0 / (accuracy * records.radii[rows])
    matrix = np.swapaxes(turn, 1, 2) @ (scale[:, :, None] * turn)
    position, gradient = (np.stack([a @ t, a @ b], -1) for a in (away, g))
    return Cache(Candidates.of(position, E, gradient), ValidityRegion(jnp.asarray(matrix)))
