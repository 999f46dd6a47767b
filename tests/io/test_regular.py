"""Only regular files are read, and none that is too large: every reader refuses the others."""

import os
import pathlib
import socket

import pytest

from firstorder.io import (
    is_space,
    read_ambient,
    read_flatland,
    read_image,
    read_layers,
    read_mesh,
    read_mitsuba,
    read_panorama,
    read_panorama_row,
    read_rays,
    read_scene,
    read_space,
    read_svg,
)
from firstorder.io._regular import check_regular_file, read_regular_file


def folder(path):
    path.mkdir()


def pipe(path):
    os.mkfifo(path)


def device(path):
    path.symlink_to("/dev/zero")


def unix_socket(path):
    here = pathlib.Path.cwd()
    os.chdir(path.parent)  # names of sockets are short
    try:
        with socket.socket(socket.AF_UNIX) as one:
            one.bind(path.name)
    finally:
        os.chdir(here)


KINDS = [(folder, "directory"), (pipe, "pipe"), (device, "device"), (unix_socket, "socket")]
READERS = {
    "a.bin": read_regular_file,
    "a.hdr": read_image,
    "a.png": read_image,
    "a.jpg": read_image,
    "a.exr": read_layers,
    "a.obj": read_mesh,
    "a.glb": read_mesh,
    "a.rays": read_rays,
    "a.txt": read_ambient,
    "sky.hdr": read_panorama,
    "row.hdr": read_panorama_row,
    "a.toml": read_scene,
    "flat.toml": read_flatland,
    "deep.toml": read_space,
    "which.toml": is_space,
    "a.xml": read_mitsuba,
    "a.svg": read_scene,
    "b.svg": read_svg,
}


@pytest.mark.parametrize("name", READERS)
@pytest.mark.parametrize(("make", "word"), KINDS)
def test_what_is_no_regular_file_is_refused_before_it_is_opened(tmp_path, name, make, word):
    make(tmp_path / name)
    with pytest.raises(ValueError, match=name) as caught:
        READERS[name](tmp_path / name)
    assert str(caught.value) == f"{name}: the file cannot be opened (is a {word})."


@pytest.mark.parametrize("name", READERS)
def test_what_is_not_there_is_named_with_its_path(tmp_path, name):
    with pytest.raises(FileNotFoundError) as caught:
        READERS[name](tmp_path / name)
    path = tmp_path / name
    assert str(caught.value) == f"{path}: the file cannot be opened (no such file or directory)."


@pytest.mark.skipif(os.geteuid() == 0, reason="root may read everything")
def test_what_may_not_be_read_is_named_with_its_path(tmp_path):
    (tmp_path / "a.txt").touch(0)
    with pytest.raises(PermissionError, match=r"a\.txt: the file cannot be opened \(permission"):
        read_regular_file(tmp_path / "a.txt")


def test_a_link_to_a_regular_file_is_read(tmp_path):
    (tmp_path / "a.txt").write_bytes(b"light")
    (tmp_path / "b.txt").symlink_to("a.txt")
    assert read_regular_file(tmp_path / "b.txt") == b"light"


def test_a_file_may_have_so_many_bytes_and_no_more(tmp_path):
    (tmp_path / "a.txt").write_bytes(b"light")
    check_regular_file(tmp_path / "a.txt", 5)
    with pytest.raises(ValueError, match=r"^a\.txt: the file has 5 bytes, but at most 4 are read"):
        read_regular_file(tmp_path / "a.txt", 4)


@pytest.mark.parametrize("name", ["a.hdr", "a.exr", "a.png", "a.obj"])
def test_a_file_of_too_many_bytes_is_refused_before_it_is_read(tmp_path, name):
    with (tmp_path / name).open("wb") as file:
        file.truncate(2**40)  # it holds nothing, and takes no place
    with pytest.raises(ValueError, match="but at most 1073741824 are read"):
        READERS[name](tmp_path / name)


def test_a_name_with_a_zero_byte_is_one_sentence(tmp_path):
    with pytest.raises(ValueError, match=r"^'a\\x00\.hdr': no file can have such a name\.$"):
        check_regular_file(tmp_path / "a\0.hdr")
