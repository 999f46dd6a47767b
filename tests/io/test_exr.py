"""Named layers in EXR files: written whole, read back the right way up."""

import sys

import numpy as np
import OpenEXR
import pytest

from firstorder.io.exr import read_layers, write_layers

LAYERS = {
    "value": np.arange(12.0).reshape(4, 3),
    "grad.u": -np.ones((4, 3)),
    "CDV": np.full((4, 3), np.float32(0.1)),
}


def test_layers_come_back(tmp_path):
    write_layers(tmp_path / "a.exr", LAYERS)
    found = read_layers(tmp_path / "a.exr")
    assert set(found) == set(LAYERS)
    for name, values in LAYERS.items():
        np.testing.assert_array_equal(found[name], values.astype(np.float32))


def test_other_programs_see_rows_from_the_top(tmp_path):
    write_layers(tmp_path / "a.exr", LAYERS)
    with OpenEXR.File(str(tmp_path / "a.exr"), separate_channels=True) as file:
        pixels = np.array(file.channels()["value"].pixels)
    np.testing.assert_array_equal(pixels[0], [2.0, 5.0, 8.0, 11.0])  # the highest row


@pytest.mark.parametrize(
    ("name", "layers", "sentence"),
    [
        ("a.png", LAYERS, "a.png: layers are written to .exr files"),
        ("a.exr", {}, "`layers` must hold arrays of one shape"),
        ("a.exr", {"a": np.ones((2, 2)), "b": np.ones((3, 2))}, "of one shape"),
        ("a.exr", {"a": np.ones(3)}, "of one shape"),
        ("a.exr", {"a": np.ones((2, 2)), "": np.ones((2, 2))}, "must name each layer"),
        ("a.exr", {"a": 1j * np.ones((2, 2))}, "must be real, but is complex"),
        ("a.exr", {"a": np.ones((0, 4))}, "must have pixels, but has"),
        ("a.exr", {"a": np.ones((4, 3, 0))}, "must have pixels, but has"),
        ("a.exr", {"value": np.ones((4, 3, 3)), "R": np.ones((4, 3))}, "two are called R"),
        ("a.exr", {"a.2": np.ones((4, 3)), "a": np.ones((4, 3, 2))}, "two are called a.2"),
    ],
)
def test_bad_layers_get_one_sentence(tmp_path, name, layers, sentence):
    with pytest.raises(ValueError, match=sentence):
        write_layers(tmp_path / name, layers)
    assert not list(tmp_path.iterdir())


def test_a_broken_file_gets_one_sentence(tmp_path):
    (tmp_path / "a.exr").write_bytes(b"no picture")
    with pytest.raises(ValueError, match=r"a\.exr: the file is damaged or is no OpenEXR picture"):
        read_layers(tmp_path / "a.exr")


def test_without_the_package_the_extra_is_named(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "OpenEXR", None)
    with pytest.raises(ModuleNotFoundError, match=r"firstorder\[images\]"):
        write_layers(tmp_path / "a.exr", LAYERS)
