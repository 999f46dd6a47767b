"""Channels and levels of pictures, from files written by hand; limits, at them and one beyond."""

import re
import struct
import sys
import zlib

import numpy as np
import OpenEXR
import pytest
from PIL import Image

from firstorder.io import _channels as channels
from firstorder.io._channels import check_pixels, check_radiances, read_channels, read_levels

RNG = np.random.default_rng(0)


# --- how many pixels -----------------------------------------------------------------------------


@pytest.mark.parametrize("layers", [1, 4])
def test_pictures_have_at_most_so_many_pixels(layers):
    most = 2**27 // layers
    check_pixels("a", 2**10, most // 2**10, 2**30, layers)
    words = f"{2**10} x {most // 2**10 + 1} pixels" + (" in 4 layers" if layers > 1 else "")
    with pytest.raises(ValueError, match=f"^a: a picture of {words} is not read here: at most"):
        check_pixels("a", 2**10, most // 2**10 + 1, 2**30, layers)


def test_files_of_few_bytes_hold_few_pixels():
    check_pixels("a", 2048, 2048, 1)
    with pytest.raises(ValueError, match="2048 x 2049 pixels is not read from a file of 1 bytes"):
        check_pixels("a", 2048, 2049, 1)
    check_pixels("a", 2048, 5000, 5000)
    check_pixels("a", 2048, 2500, 5000, 2)
    with pytest.raises(ValueError, match="from a file of 5000 bytes"):
        check_pixels("a", 2048, 5001, 5000)
    with pytest.raises(ValueError, match="from a file of 5000 bytes"):
        check_pixels("a", 2048, 2501, 5000, 2)


@pytest.mark.parametrize("size", [(0, 5), (5, 0), (-1, 5), (0, 0)])
def test_a_picture_has_a_pixel(size):
    check_pixels("a", 1, 1, 1)
    with pytest.raises(ValueError, match=f"{size[0]} x {size[1]} pixels is not read here"):
        check_pixels("a", *size, 100)


def test_light_is_not_below_zero():
    check_radiances("a", np.array([[0.0, 2.5, np.nan]]))
    with pytest.raises(ValueError, match=r"^a: `radiance` must not be negative, but is -2"):
        check_radiances("a", np.array([[-1.0, 5.0], [-2.0, 1.0]]))


# --- channels ------------------------------------------------------------------------------------


def exr(folder, channels, **header):
    OpenEXR.File(header, channels).write(str(folder / "a.exr"))
    return folder / "a.exr"


def test_channels_come_back_as_they_lie_in_the_file(tmp_path):
    given = {
        "R": RNG.random((5, 3)).astype(np.float32),
        "depth.Z": RNG.random((5, 3)).astype(np.float16),
        "id": RNG.integers(0, 99, (5, 3)).astype(np.uint32),
    }
    found = read_channels(exr(tmp_path, dict(given)))
    assert set(found) == set(given)
    for name, a in given.items():
        np.testing.assert_array_equal(found[name], a)
        assert found[name].dtype == a.dtype


def test_a_header_says_window_tiles_channels_and_depth():
    window = np.array([2, 3]), np.array([11, 7])
    header = {"dataWindow": window, "channels": ["R"] * 5}
    assert channels._promise(header) == ((10, 5), (1, 1), 5, False)
    tiles = type("Tiles", (), {"xSize": 64, "ySize": 32})()
    header |= {"tiles": tiles, "type": OpenEXR.deepscanline}
    assert channels._promise(header) == ((10, 5), (64, 32), 5, True)
    header |= {"type": OpenEXR.tiledimage}
    assert not channels._promise(header).deep


def part(window=(1, 1), tile=(1, 1), count=1, deep=False):
    return channels._Promise(window, tile, count, deep)


def test_windows_and_tiles_are_looked_at_by_four_channels_a_layer(tmp_path, monkeypatch):
    file = tmp_path / "a.exr"
    file.write_bytes(b"123456789")
    monkeypatch.setattr(channels, "MOST_PIXELS_OF_A_SMALL_FILE", 40)
    monkeypatch.setattr(channels, "MOST_PIXELS_A_BYTE", 5)  # 45 pixels for 9 bytes
    for name in ("window", "tile"):
        channels._check_part(file, part(**{name: (9, 5)}, count=4))
        with pytest.raises(ValueError, match=r"^a\.exr: a picture of 23 x 2 pixels"):
            channels._check_part(file, part(**{name: (23, 2)}, count=4))
        with pytest.raises(ValueError, match=r"^a\.exr: a picture of 9 x 5 pixels"):
            channels._check_part(file, part(**{name: (9, 5)}, count=5))
    channels._check_part(file, part((11, 2), (2, 11), 8))
    with pytest.raises(ValueError, match="deep pictures"):
        channels._check_part(file, part(deep=True))


def test_a_small_picture_of_many_channels_is_read(tmp_path):
    """And one with more pixels than are allowed is refused before it is unpacked."""
    given = {str(k): np.full((3, 4), k, np.float32) for k in range(9)}
    file = exr(tmp_path, given)
    found = read_channels(file)
    np.testing.assert_array_equal([found[str(k)][2, 3] for k in range(9)], np.arange(9))


def test_a_picture_that_promises_too_much_is_refused(tmp_path, monkeypatch):
    file = exr(tmp_path, {"Y": np.zeros((3, 4), np.float32)})
    monkeypatch.setattr(channels, "MOST_PIXELS", 12)
    read_channels(file)
    monkeypatch.setattr(channels, "MOST_PIXELS", 11)
    with pytest.raises(ValueError, match="4 x 3 pixels is not read here: at most 11"):
        read_channels(file)


@pytest.mark.parametrize("keep", [0, 4, 40, -20])
def test_a_broken_file_is_one_sentence(tmp_path, keep):
    file = exr(tmp_path, {"Y": np.arange(12.0, dtype=np.float32).reshape(3, 4)})
    file.write_bytes(file.read_bytes()[:keep])
    with pytest.raises(
        ValueError, match=r"^a\.exr: the file is damaged or is no OpenEXR picture\.$"
    ):
        read_channels(file)


def test_the_package_is_named_where_it_is_missing(tmp_path, monkeypatch):
    assert channels.openexr("a.exr") is OpenEXR
    monkeypatch.setitem(sys.modules, "OpenEXR", None)
    with pytest.raises(ModuleNotFoundError, match=r"^a\.exr: .*firstorder\[images\]"):
        read_channels(tmp_path / "a.exr")


# --- levels --------------------------------------------------------------------------------------


def png(folder, kind, rows, bits, width):
    """A .png file from its rows of bytes; kind as PNG counts them."""
    head = struct.pack(">IIBBBBB", width, len(rows), bits, kind, 0, 0, 0)
    body = zlib.compress(b"".join(b"\0" + row for row in rows))
    parts = [(b"IHDR", head), (b"IDAT", body), (b"IEND", b"")]
    data = b"".join(
        struct.pack(">I", len(d)) + t + d + struct.pack(">I", zlib.crc32(t + d)) for t, d in parts
    )
    (folder / "a.png").write_bytes(b"\x89PNG\r\n\x1a\n" + data)
    return folder / "a.png"


KINDS = {"grey": (0, 1), "colour": (2, 3), "grey and clear": (4, 2), "colour and clear": (6, 4)}


@pytest.mark.parametrize("bits", [8, 16])
@pytest.mark.parametrize("name", KINDS)
def test_levels_are_shares_of_the_largest(tmp_path, name, bits):
    kind, count = KINDS[name]
    levels = RNG.integers(0, 2**bits, (5, 4, count))
    levels[0, 0], levels[0, 1] = 2**bits - 1, 0
    file = png(tmp_path, kind, [r.astype(f">u{bits // 8}").tobytes() for r in levels], bits, 4)
    colours = levels[..., :3] if count > 2 else np.repeat(levels[..., :1], 3, -1)
    np.testing.assert_allclose(read_levels(file), colours / (2**bits - 1.0), rtol=1e-14)


def test_colours_from_a_table_are_read(tmp_path):
    picture = Image.fromarray(np.array([[0, 1], [2, 1]], np.uint8), "P")
    picture.putpalette([10, 20, 30, 40, 50, 60, 70, 80, 90])
    picture.save(tmp_path / "a.png")
    table = np.array([(10, 20, 30), (40, 50, 60), (70, 80, 90)]) / 255.0
    np.testing.assert_allclose(read_levels(tmp_path / "a.png"), table[[[0, 1], [2, 1]]])


def test_too_many_levels_for_a_file_are_refused(tmp_path, monkeypatch):
    file = png(tmp_path, 0, [bytes(6)] * 2, 8, 6)
    size = file.stat().st_size
    monkeypatch.setattr(channels, "MOST_PIXELS_OF_A_SMALL_FILE", 11)
    monkeypatch.setattr(channels, "MOST_PIXELS_A_BYTE", 0)
    with pytest.raises(ValueError, match=rf"^a\.png: a picture of 6 x 2 .* of {size} bytes\.$"):
        read_levels(file)
    monkeypatch.setattr(channels, "MOST_PIXELS_OF_A_SMALL_FILE", 12)
    assert read_levels(file).shape == (2, 6, 3)


@pytest.mark.parametrize("name", ["a.png", "a.jpg"])
def test_what_is_no_picture_is_one_sentence(tmp_path, name):
    kind = name[2:].upper()
    for data in (b"", b"\x89PNG\r\n\x1a\n", b"GIF89a"):
        (tmp_path / name).write_bytes(data)
        with pytest.raises(ValueError, match=f"^{re.escape(name)}: .* is no {kind} picture"):
            read_levels(tmp_path / name)


# Rows of a picture as it is seen, whose camera stored `abc/def`, by EXIF's table.
TURNED = {
    1: ["abc", "def"], 2: ["cba", "fed"], 3: ["fed", "cba"], 4: ["def", "abc"],
    5: ["ad", "be", "cf"], 6: ["da", "eb", "fc"], 7: ["fc", "eb", "da"], 8: ["cf", "be", "ad"],
}  # fmt: skip


@pytest.mark.parametrize("orientation", [*TURNED, 0, 9])
def test_a_picture_is_turned_as_its_camera_says(tmp_path, orientation):
    stored = np.array([[0, 40, 80], [120, 160, 200]], np.uint8)
    exif = Image.Exif()
    exif[0x0112] = orientation
    Image.fromarray(stored).save(tmp_path / "a.png", exif=exif)
    rows = TURNED.get(orientation, TURNED[1])
    true = [[40.0 * "abcdef".index(c) for c in row] for row in rows]
    np.testing.assert_allclose(255.0 * read_levels(tmp_path / "a.png")[..., 2], true)


def test_a_picture_without_words_about_its_camera_stays():
    class Mute:
        def getexif(self):
            raise OSError

    assert channels._orientation(Mute()) == 1
    assert channels._orientation(Image.new("L", (1, 1))) == 1
