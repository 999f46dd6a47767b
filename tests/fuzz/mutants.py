"""Files of every format that is read, and what accidents make of them.

A mutant is known by its name, a seed and a number: the same three give the same bytes.
"""

from __future__ import annotations

import pathlib
import random
import tempfile
from collections.abc import Callable
from typing import Any, NamedTuple

from firstorder.flatland.library import named_scene
from firstorder.io import (
    read_flatland,
    read_image,
    read_mesh_uv,
    read_mitsuba,
    read_space,
    read_svg,
    write_flatland,
    write_space,
)
from tests.io import test_damaged, test_greedy_files

NUMBERS = (b"nan", b"inf", b"-inf", b"1e400", b"-0", b"1e308", b"4294967295", b"1979-05-27", b"")
BRACKETS = (b"[", b"]", b"{", b"}", b"(", b")", b"<", b">", b'"', b"'", b"</")
BAD_TEXT = (
    b"\xff",
    b"\xc3",
    b"\xed\xa0\x80",
    b"\x00",
    b"\xfe\xff",
    b"\xef\xbb\xbf",
    b"\xe2\x80\xa8",
)


class Sample(NamedTuple):
    """A whole file and how it is read.

    Attributes:
        read: from its path.
        make: writes it into a folder.
        file: its name there.
    """

    read: Callable[[pathlib.Path], Any]
    make: Callable[[pathlib.Path], Any]
    file: str


def _text(name: str) -> Callable[[pathlib.Path], Any]:
    return lambda folder: (folder / name).write_text(test_greedy_files.SAMPLES[name][1])


def _written_flatland(folder: pathlib.Path) -> None:
    write_flatland(folder / "flat.toml", named_scene("scene_b"))


def _written_space(folder: pathlib.Path) -> None:
    _text("space.toml")(folder)
    write_space(folder / "space.toml", read_space(folder / "space.toml"))


SAMPLES = {
    "hdr": Sample(read_image, test_damaged.hdr_file, "a.hdr"),
    "exr": Sample(read_image, test_damaged.exr_file, "a.exr"),
    "obj": Sample(read_mesh_uv, test_damaged.obj_file, "a.obj"),
    "ply": Sample(read_mesh_uv, test_damaged.ply_file, "a.ply"),
    "text_ply": Sample(read_mesh_uv, test_damaged.text_ply_file, "a.ply"),
    "glb": Sample(read_mesh_uv, test_damaged.glb_file, "a.glb"),
    "svg": Sample(read_svg, _text("a.svg"), "a.svg"),
    "flatland": Sample(read_flatland, _text("flat.toml"), "flat.toml"),
    "flatland_written": Sample(read_flatland, _written_flatland, "flat.toml"),
    "space": Sample(read_space, _text("space.toml"), "space.toml"),
    "space_written": Sample(read_space, _written_space, "space.toml"),
    "mitsuba": Sample(read_mitsuba, _text("m.xml"), "m.xml"),
}


def whole(name: str) -> bytes:
    """The bytes of a sample."""
    with tempfile.TemporaryDirectory() as folder:
        SAMPLES[name].make(pathlib.Path(folder))
        return (pathlib.Path(folder) / SAMPLES[name].file).read_bytes()


def mutant(name: str, data: bytes, seed: int, number: int) -> bytes:
    """A file after one to three accidents.

    Args:
        name: of the sample.
        data: its bytes.
        seed: of the random numbers.
        number: of the mutant.
    """
    draw = random.Random(f"{name} {seed} {number}")
    for _ in range(draw.choice((1, 1, 1, 2, 3))):
        data = draw.choice(ACCIDENTS)(data, draw)
    return data


# --- accidents -----------------------------------------------------------------------------------


def _span(data: bytes, draw: random.Random, most: int = 60) -> tuple[int, int]:
    start = draw.randint(0, len(data))
    return start, min(len(data), start + draw.randint(0, most))


def _flip(data: bytes, draw: random.Random) -> bytes:
    """Some bits the other way."""
    changed = bytearray(data)
    for _ in range(draw.randint(1, 8) if data else 0):
        changed[draw.randrange(len(data))] ^= 1 << draw.randrange(8)
    return bytes(changed)


def _truncate(data: bytes, draw: random.Random) -> bytes:
    """Nothing after some place."""
    return data[: draw.randint(0, len(data))]


def _cut(data: bytes, draw: random.Random) -> bytes:
    """A piece less."""
    a, b = _span(data, draw)
    return data[:a] + data[b:]


def _double(data: bytes, draw: random.Random) -> bytes:
    """A piece two to 400 times."""
    a, b = _span(data, draw)
    return data[:b] + data[a:b] * draw.choice((1, 1, 3, 399)) + data[b:]


def _swap(data: bytes, draw: random.Random) -> bytes:
    """Two pieces in each other's place."""
    a, b, c, d = sorted((*_span(data, draw), *_span(data, draw)))
    return data[:a] + data[c:d] + data[b:c] + data[a:b] + data[d:]


def _number(data: bytes, draw: random.Random) -> bytes:
    """Another number for one."""
    digits = [k for k, c in enumerate(data) if chr(c).isdigit()]
    if not digits:
        return data
    start = end = draw.choice(digits)
    while end < len(data) and (chr(data[end]).isdigit() or data[end] in b".eE+-"):
        end += 1
    return data[:start] + draw.choice(NUMBERS) + data[end:]


def _insert(words: tuple[bytes, ...]) -> Callable[[bytes, random.Random], bytes]:
    def accident(data: bytes, draw: random.Random) -> bytes:
        at = draw.randint(0, len(data))
        return data[:at] + draw.choice(words) * draw.choice((1, 1, 1, 3, 400)) + data[at:]

    return accident


def _noise(data: bytes, draw: random.Random) -> bytes:
    """Random bytes for a piece."""
    a, b = _span(data, draw, 8)
    return data[:a] + draw.randbytes(b - a) + data[b:]


ACCIDENTS = (
    _flip,
    _truncate,
    _cut,
    _double,
    _swap,
    _number,
    _number,
    _insert(BRACKETS),
    _insert(BAD_TEXT),
    _noise,
)
