import pathlib
import struct
import sys
import tempfile
import time
import tracemalloc
import zlib

import numpy as np
import OpenEXR
import pytest
from hypothesis import given
from hypothesis import strategies as st
from PIL import Image

from firstorder.io import images, read_image, read_panorama, read_panorama_row
from tests.io.scenes.sentences import refuses_in_one_sentence

PICTURE = np.random.default_rng(5).uniform(0.0, 4.0, (5, 12, 3)).astype(np.float32)
LUMINANCE = PICTURE.astype(float) @ [0.2126, 0.7152, 0.0722]


def rgbe(picture):
    """The shared-exponent bytes of a picture, by the definition of the format."""
    picture = picture.astype(float)
    most = picture.max(-1)
    exponent = np.where(most > 0, np.floor(np.log2(np.maximum(most, 1e-38))) + 1, -128)
    mantissa = np.floor(picture * 2.0 ** (8 - exponent)[..., None])
    return np.concatenate([mantissa, (exponent + 128)[..., None]], -1).astype(np.uint8)


def packed(row):
    """A row in runs of at most three alike, and pieces of at most five."""
    out = bytes([2, 2, len(row) >> 8, len(row) & 255])
    for channel in row.T:
        at = 0
        while at < len(channel):
            if at % 4 == 0 and np.all(channel[at : at + 3] == channel[at]):
                run = len(channel[at : at + 3])
                out += bytes([128 + run, channel[at]])
            else:
                run = len(channel[at : at + 5])
                out += bytes([run, *channel[at : at + run]])
            at += run
    return out


def hdr(picture, header=b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n", pack=True, axes=b"-Y %d +X %d\n"):
    rows = rgbe(picture)
    body = b"".join(packed(r) if pack else r.tobytes() for r in rows)
    return header + b"\n" + axes % picture.shape[:2] + body


def written(tmp_path, data, name="sky.hdr"):
    (tmp_path / name).write_bytes(data)
    return tmp_path / name


@pytest.mark.parametrize("pack", [False, True])
def test_radiance_files_come_back_to_their_eight_bits(tmp_path, pack):
    flat = PICTURE.copy()
    flat[1, 4:9] = flat[1, 4]  # something to run
    flat[2] = 0.0
    found = read_image(written(tmp_path, hdr(flat, pack=pack)))
    most = flat.max(-1, keepdims=True)
    assert found.shape == flat.shape
    # half a step of a mantissa between 128 and 256
    assert np.all(np.abs(found - flat) <= most / 256)
    assert np.all(found[2] == 0.0)


def test_rows_packed_the_old_way_repeat_the_last_pixel(tmp_path):
    data = b"#?RGBE\n\n-Y 1 +X 9\n" + bytes([128, 128, 128, 129, 1, 1, 1, 7, 64, 64, 64, 129])
    found = read_image(written(tmp_path, data))[0, :, 0]
    np.testing.assert_array_equal(found, [128.5 / 128] * 8 + [64.5 / 128])


def test_a_picture_that_is_written_upside_down_is_turned(tmp_path):
    upright = read_image(written(tmp_path, hdr(PICTURE)))
    turned = read_image(written(tmp_path, hdr(PICTURE, axes=b"+Y %d -X %d\n")))
    np.testing.assert_array_equal(turned, upright[::-1, ::-1])


@pytest.mark.parametrize("dtype", [np.float32, np.float16])
def test_exr_files_come_back(tmp_path, dtype):
    file = tmp_path / "sky.exr"
    OpenEXR.File({}, {"RGB": PICTURE.astype(dtype)}).write(str(file))
    np.testing.assert_array_equal(read_image(file), PICTURE.astype(dtype))
    np.testing.assert_allclose(
        read_panorama_row(file, 1).values, LUMINANCE[1], rtol=2 * np.finfo(dtype).eps
    )


def test_grey_exr_files_are_grey(tmp_path):
    grey = np.ascontiguousarray(PICTURE[..., 0])
    OpenEXR.File({}, {"Y": grey}).write(str(tmp_path / "sky.exr"))
    np.testing.assert_array_equal(read_image(tmp_path / "sky.exr")[..., 2], grey)


@pytest.mark.smoke
def test_the_middle_row_is_the_sky_and_may_be_made_coarser(tmp_path):
    file = written(tmp_path, hdr(PICTURE))
    step = PICTURE[2].max(-1) / 256
    sky = read_panorama_row(file)
    assert np.all(np.abs(sky.values - LUMINANCE[2]) <= step)
    np.testing.assert_allclose(sky(sky.breaks), sky.values, rtol=1e-12)
    coarse = read_panorama_row(file, 0, 4).values
    assert np.all(np.abs(coarse - LUMINANCE[0].reshape(4, 3).mean(1)) <= PICTURE[0].max() / 256)


def test_without_the_package_the_sentence_names_the_extra(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "OpenEXR", None)
    with pytest.raises(ModuleNotFoundError) as caught:
        read_image(tmp_path / "sky.exr")
    assert str(caught.value) == (
        "sky.exr: .exr files need the package OpenEXR, which comes with the extra `images`: "
        'pip install "firstorder[images]".'
    )


NO_PICTURE = "the file is no Radiance picture in RGBE with rows across."


@pytest.mark.parametrize(
    ("name", "data", "sentence"),
    [
        ("a.gif", b"", "a picture must be an .hdr, .exr, .png or .jpg file."),
        ("a.png", b"no picture", "the file is damaged or is no PNG picture."),
        ("a.jpg", b"", "the file is damaged or is no JPG picture."),
        ("a.hdr", b"", NO_PICTURE),
        ("a.hdr", b"#?RADIANCE\n\n+X 4 -Y 4\n", NO_PICTURE),
        ("a.hdr", hdr(PICTURE).replace(b"rgbe", b"xyze"), NO_PICTURE),
        ("a.hdr", hdr(PICTURE)[:-9], "the file ends in row 4 of 5."),
        (
            "a.hdr",
            b"#?RADIANCE\n\n-Y 99999 +X 99999\n",
            "a picture of 99999 x 99999 pixels is not read here: at most 134217728.",
        ),
        ("a.exr", b"no picture", "the file is damaged or is no OpenEXR picture."),
    ],
)
def test_what_is_no_picture_is_one_sentence(tmp_path, capfd, name, data, sentence):
    with pytest.raises(ValueError, match=name) as caught:
        read_panorama_row(written(tmp_path, data, name))
    assert str(caught.value) == f"{name}: {sentence}"
    assert capfd.readouterr() == ("", "")


def test_a_picture_of_other_channels_is_one_sentence(tmp_path):
    file = tmp_path / "depth.exr"
    OpenEXR.File({}, {"Z": PICTURE[..., 0].copy()}).write(str(file))
    with pytest.raises(ValueError, match=r"the channels must be R, G, B or Y, but are Z\."):
        read_image(file)


@pytest.mark.parametrize("reader", [read_panorama_row, read_panorama])
def test_light_below_zero_is_one_sentence(tmp_path, reader):
    """In one band already, though its luminance is positive; a normal map may be negative."""
    bad = PICTURE.copy()
    bad[2, 3, 2] = -0.25
    OpenEXR.File({}, {"RGB": bad}).write(str(tmp_path / "sky.exr"))
    with pytest.raises(ValueError, match=r"^sky.exr: `radiance` must not be negative, but is -0"):
        reader(tmp_path / "sky.exr")
    assert read_image(tmp_path / "sky.exr")[2, 3, 2] == -0.25


def test_a_sky_that_is_not_finite_is_one_sentence(tmp_path):
    bad = PICTURE.copy()
    bad[0, 0] = np.inf
    OpenEXR.File({}, {"RGB": bad}).write(str(tmp_path / "sky.exr"))
    with pytest.raises(ValueError, match=r"^sky.exr: the picture holds numbers that are not"):
        read_panorama_row(tmp_path / "sky.exr", 0)


WHOLE = hdr(PICTURE)


@given(st.data())
def test_mutilated_radiance_files_never_crash_the_reader(data):
    at, cut = data.draw(st.integers(0, len(WHOLE))), data.draw(st.integers(0, 40))
    source = WHOLE[:at] + data.draw(st.binary(max_size=8)) + WHOLE[at + cut :]
    refuses_in_one_sentence(images._hdr, source)


# --- more pixels than the file can hold -----------------------------------------------------------

BLACK = bytes([128, 128, 128, 129])


def png_of(width, height):
    """A picture of one pixel whose header says that it has more."""
    chunk = b"IHDR" + struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)
    pixel = b"IDAT" + zlib.compress(bytes(4))
    chunks = [
        struct.pack(">I", len(c) - 4) + c + struct.pack(">I", zlib.crc32(c))
        for c in (chunk, pixel, b"IEND")
    ]
    return b"\x89PNG\r\n\x1a\n" + b"".join(chunks)


def exr_of(width, height):
    with tempfile.TemporaryDirectory() as folder:
        OpenEXR.File({}, {"RGB": PICTURE}).write(f"{folder}/a.exr")
        data = pathlib.Path(folder, "a.exr").read_bytes()
    window = struct.pack("<4i", 0, 0, 11, 4)
    assert data.count(window) == 2
    return data.replace(window, struct.pack("<4i", 0, 0, width - 1, height - 1))


def old_runs(width):
    """The file of 89 bytes: one row, of one pixel and runs of it."""
    return b"#?RADIANCE\n\n-Y 1 +X %d\n" % width + BLACK + bytes([1, 1, 1, 255]) * 8


@pytest.mark.parametrize(
    ("name", "data", "pixels"),
    [
        ("a.hdr", old_runs(2**27), "134217728 x 1"),
        ("a.hdr", old_runs(2**24), "16777216 x 1"),
        ("a.hdr", old_runs(999999999), "999999999 x 1"),
        ("a.exr", exr_of(2**15, 2**13), "32768 x 8192"),
        ("a.exr", exr_of(2**11 + 1, 2**11), "2049 x 2048"),
        ("a.png", png_of(9000, 9000), "9000 x 9000"),
        ("a.png", png_of(10000, 10000), "10000 x 10000"),  # Pillow warns here ...
        ("a.png", png_of(13000, 13000), "13000 x 13000"),
        ("a.png", png_of(60000, 60000), ""),  # ... and refuses here
    ],
    ids=lambda value: value if isinstance(value, str) else "",
)
@pytest.mark.filterwarnings("error")
def test_a_picture_larger_than_its_file_is_refused_before_it_is_unpacked(
    tmp_path, capfd, name, data, pixels
):
    file = written(tmp_path, data, name)
    tracemalloc.start()
    try:
        with pytest.raises(ValueError, match=rf"^{name}: ") as caught:
            read_image(file)
        most = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    words = str(caught.value)
    assert words.endswith((f"from a file of {len(data)} bytes.", "134217728.", "to be read."))
    assert pixels in words
    assert most < 4e6
    assert capfd.readouterr() == ("", "")


def test_one_grey_all_over_is_read(tmp_path):
    """A texture of one colour packs a thousand pixels into a byte."""
    from PIL import Image

    Image.new("L", (3000, 2000), 128).save(tmp_path / "a.png", optimize=True)
    assert (tmp_path / "a.png").stat().st_size < 9000
    np.testing.assert_allclose(read_image(tmp_path / "a.png", srgb=False)[::999], 128 / 255)


def test_a_header_of_empty_lines_takes_no_time(tmp_path):
    """Lines that may belong to two parts of a pattern are tried in all ways."""
    file = written(tmp_path, b"#?RADIANCE\n" + b" \n" * 30000)
    start = time.process_time()
    with pytest.raises(ValueError, match=NO_PICTURE):
        read_image(file)
    assert time.process_time() - start < 1.0


def test_deep_pictures_are_refused(tmp_path):
    pixels = np.empty((2, 3), object)
    pixels[:] = [[np.ones(2, np.float32)] * 3] * 2
    header = {"type": OpenEXR.deepscanline, "compression": OpenEXR.ZIPS_COMPRESSION}
    OpenEXR.File(header, {"Y": pixels}).write(str(tmp_path / "a.exr"))
    with pytest.raises(ValueError, match=r"^a\.exr: deep pictures, of many samples in a pixel"):
        read_image(tmp_path / "a.exr")


# --- levels of a screen ---------------------------------------------------------------------------


def saved(tmp_path, levels, name, **how):
    Image.fromarray(levels).save(tmp_path / name, **how)
    return tmp_path / name


def test_levels_become_linear_and_go_back(tmp_path):
    levels = np.arange(256, dtype=np.uint8).reshape(16, 16)
    levels = np.stack([levels, levels[::-1], levels.T], -1)
    linear = read_image(saved(tmp_path, levels, "a.png"))
    screen = np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)
    np.testing.assert_allclose(255.0 * screen, levels, rtol=0.0, atol=1e-4)
    assert linear[0, 0, 0] == 0.0
    assert linear.max() == 1.0
    numbers = read_image(tmp_path / "a.png", srgb=False)
    np.testing.assert_allclose(numbers, levels / 255.0, rtol=1e-15)


def test_grey_transparent_and_deep_pictures_are_read(tmp_path):
    grey = np.array([[0, 128, 255]], np.uint8)
    found = read_image(saved(tmp_path, grey, "grey.png"), srgb=False)
    np.testing.assert_allclose(found, np.repeat(grey[..., None], 3, -1) / 255.0)
    clear = np.concatenate([np.repeat(grey[..., None], 3, -1), np.full((1, 3, 1), 9, np.uint8)], -1)
    np.testing.assert_array_equal(read_image(saved(tmp_path, clear, "a.png"), srgb=False), found)
    deep = np.array([[0, 257 * 128, 65535]], np.uint16)
    np.testing.assert_allclose(read_image(saved(tmp_path, deep, "b.png"), srgb=False), found)


def test_a_jpeg_is_nearly_its_picture(tmp_path):
    flat = np.full((8, 8, 3), (200, 100, 50), np.uint8)
    found = read_image(saved(tmp_path, flat, "a.jpg", quality=95), srgb=False)
    np.testing.assert_allclose(255.0 * found, flat, rtol=0.0, atol=3.0)


@pytest.mark.parametrize(("kind", "channels"), [(0, 1), (2, 3), (4, 2), (6, 4)])
def test_sixteen_bits_come_back(tmp_path, kind, channels):
    """Grey and in colour, with and without transparency: all of PNG's kinds of that depth."""
    levels = np.random.default_rng(0).integers(0, 65536, (5, 4, channels))
    rows = b"".join(b"\0" + row.astype(">u2").tobytes() for row in levels)
    head = struct.pack(">IIBBBBB", 4, 5, 16, kind, 0, 0, 0)
    chunks = [(b"IHDR", head), (b"IDAT", zlib.compress(rows)), (b"IEND", b"")]
    data = b"".join(
        struct.pack(">I", len(d)) + t + d + struct.pack(">I", zlib.crc32(t + d)) for t, d in chunks
    )
    (tmp_path / "a.png").write_bytes(b"\x89PNG\r\n\x1a\n" + data)
    found = 65535.0 * read_image(tmp_path / "a.png", srgb=False)
    colours = levels[..., :3] if channels > 2 else np.repeat(levels[..., :1], 3, -1)
    np.testing.assert_allclose(found, colours, rtol=0.0, atol=1e-9)


@pytest.mark.parametrize("orientation", range(1, 9))
def test_a_picture_is_turned_as_its_camera_says(tmp_path, orientation):
    """The corners, by EXIF's table of where the first row and the first column are."""
    corners = {1: "abcd", 2: "badc", 3: "dcba", 4: "cdab", 5: "acbd", 6: "cadb", 7: "dbca",
               8: "bdac"}[orientation]  # fmt: skip
    levels = np.kron([[0, 80], [160, 240]], np.ones((16, 24))).astype(np.uint8)
    exif = Image.Exif()
    exif[0x0112] = orientation
    found = (
        255.0
        * read_image(saved(tmp_path, levels, "a.jpg", exif=exif, quality=95), srgb=False)[..., 0]
    )
    shown = found[4, 4], found[4, -4], found[-4, 4], found[-4, -4]
    np.testing.assert_allclose(shown, [80.0 * "abcd".index(c) for c in corners], rtol=0.0, atol=3.0)
