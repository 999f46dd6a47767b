"""What a scene names lies below its own folder, unless the caller says otherwise."""

import os
import pathlib

import pytest

from firstorder.cli import main
from firstorder.io import (
    flatland_from_toml,
    read_flatland,
    read_mitsuba,
    read_scene,
    read_space,
    space_from_mitsuba,
    space_from_toml,
)
from firstorder.io.scenes._beside import Beside

SKY = b"#?RADIANCE\n\n-Y 2 +X 4\n" + bytes([128, 128, 128, 129]) * 8
LEAF = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"
BALL = 'dimensions = 3\n[[shape]]\nkind = "sphere"\ncenter = [0, 0, 1]\nradius = 0.5\n'
LINE = '[[shape]]\nkind = "segment"\nstart = [-1, 0]\nend = [1, 0]\n'
MITSUBA = """<scene version="3.0.0"><shape type="obj"><string name="filename" value="{}"/>
<boolean name="face_normals" value="true"/></shape></scene>"""
# What names a file: the scene's ending, its text, its reader, and the ending of what it names.
NAMING = {
    "row": (".toml", LINE + '[environment]\nkind = "row"\nfile = "{}"\n', read_flatland, ".hdr"),
    "panorama": (
        ".toml",
        BALL + '[environment]\nkind = "panorama"\nfile = "{}"\n',
        read_space,
        ".hdr",
    ),
    "texture": (
        ".toml",
        BALL + '[shape.texture]\nkind = "picture"\nfile = "{}"\n',
        read_space,
        ".hdr",
    ),
    "mesh": (".toml", 'dimensions = 3\n[[mesh]]\nfile = "{}"\n', read_space, ".obj"),
    "Mitsuba's mesh": (".xml", MITSUBA, read_mitsuba, ".obj"),
}


def a_file(path: pathlib.Path) -> pathlib.Path:
    """A picture or a mesh, by its ending."""
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(SKY if path.suffix == ".hdr" else LEAF.encode())
    return path


def a_scene(folder: pathlib.Path, what: str, name: str) -> pathlib.Path:
    """A scene in its folder that names a file."""
    ending, text, _, _ = NAMING[what]
    folder.mkdir(exist_ok=True)
    path = folder / f"scene{ending}"
    path.write_text(text.format(name))
    return path


def outside(tmp_path: pathlib.Path, ending: str) -> dict[str, str]:
    """Names that lead out of the folder `scene`, each in its way, to a file that is there."""
    found = a_file(tmp_path / f"out{ending}")
    (tmp_path / "scene").mkdir(exist_ok=True)
    (tmp_path / "scene" / f"link{ending}").symlink_to(found)
    (tmp_path / "scene" / "folder").symlink_to(tmp_path)
    return {
        "dots": f"../out{ending}",
        "absolute": str(found),
        "a link": f"link{ending}",
        "a linked folder": f"folder/out{ending}",
        "dots behind a folder": f"folder/../{tmp_path.name}/out{ending}",
    }


@pytest.mark.parametrize("what", NAMING)
def test_a_file_outside_of_the_scene_s_folder_is_refused_and_read_when_that_is_allowed(
    what, tmp_path
):
    _, _, read, ending = NAMING[what]
    for name in outside(tmp_path, ending).values():
        path = a_scene(tmp_path / "scene", what, name)
        with pytest.raises(ValueError, match=r"outside=True") as caught:
            read(path)
        words = str(caught.value)
        assert words.startswith(path.name)
        assert "must lie below the scene's folder" in words
        assert "\n" not in words
        read(path, outside=True)


@pytest.mark.parametrize("what", NAMING)
def test_files_below_the_folder_are_read_by_whatever_name(what, tmp_path):
    _, _, read, ending = NAMING[what]
    folder = tmp_path / "scene"
    inner = a_file(folder / "deep" / f"in{ending}")
    (folder / f"link{ending}").symlink_to(inner)
    for name in (f"deep/in{ending}", f"deep/../deep/in{ending}", f"link{ending}", str(inner)):
        read(a_scene(folder, what, name))


def test_a_folder_that_is_itself_a_link_holds_its_files(tmp_path, monkeypatch):
    a_scene(tmp_path / "scene", "row", "sky.hdr")
    a_file(tmp_path / "scene" / "sky.hdr")
    (tmp_path / "way").symlink_to(tmp_path / "scene")
    assert read_flatland(tmp_path / "way" / "scene.toml").count == 1
    monkeypatch.chdir(tmp_path / "way")
    assert read_flatland("scene.toml").count == 1


def test_texts_and_dicts_are_held_to_their_folder_too(tmp_path):
    a_file(tmp_path / "out.hdr")
    a_file(tmp_path / "out.obj")
    (tmp_path / "scene").mkdir()
    mesh = {"type": "obj", "filename": "../out.obj", "face_normals": True}
    for read, text in (
        (flatland_from_toml, NAMING["row"][1].format("../out.hdr")),
        (space_from_toml, NAMING["panorama"][1].format("../out.hdr")),
        (lambda s, _, **k: space_from_mitsuba(s, **k), {"type": "scene", "leaf": mesh}),
    ):
        with pytest.raises(ValueError, match=r"^f.*`file(name)?` must lie below"):
            read(text, "f", folder=tmp_path / "scene") if isinstance(text, str) else read(
                text, "f", folder=tmp_path / "scene", file="f"
            )
        read(text, "f", folder=tmp_path / "scene", outside=True)


def test_the_command_line_allows_it_by_a_flag(tmp_path, capsys):
    a_file(tmp_path / "out.hdr")
    flat = a_scene(tmp_path / "scene", "row", "../out.hdr")
    assert main(["scene", str(flat), "--samples", "2"]) == 2
    assert "`--outside`" in capsys.readouterr().err
    assert main(["scene", str(flat), "--samples", "2", "--outside"]) == 0
    space = a_scene(tmp_path / "scene", "panorama", "../out.hdr")
    assert main(["scene", str(space)]) == 2
    assert main(["scene", str(space), "--outside"]) == 0


@pytest.mark.parametrize("name", ["a\0b", "loop", "x" * 300, "pipe", ".", ""])
def test_names_of_nothing_and_of_no_regular_file_are_one_sentence(name, tmp_path):
    (tmp_path / "loop").symlink_to("loop")
    os.mkfifo(tmp_path / "pipe")
    for what in NAMING:
        text = NAMING[what][1].format(name).replace("\0", "\\u0000")
        if what == "Mitsuba's mesh":
            leaf = {"type": "obj", "filename": name, "face_normals": True}
            with pytest.raises(ValueError, match=r"^f, ") as caught:
                space_from_mitsuba({"type": "scene", "leaf": leaf}, tmp_path, "f")
        else:
            read = flatland_from_toml if what == "row" else space_from_toml
            with pytest.raises(ValueError, match=r"^f, ") as caught:
                read(text, "f", tmp_path)
        assert "\n" not in str(caught.value)


def test_scenes_and_drawings_are_regular_files(tmp_path):
    for name, read in (
        ("a.toml", read_flatland),
        ("a.toml", read_scene),
        ("b.toml", read_space),
        ("c.xml", read_mitsuba),
        ("d.svg", read_scene),
    ):
        pipe = tmp_path / name
        if not pipe.exists():
            os.mkfifo(pipe)
        with pytest.raises(ValueError, match=rf"^{name}: the file cannot be opened \(is a pipe\)"):
            read(pipe)


def test_a_name_is_asked_for_from_the_folder_on(tmp_path):
    a_file(tmp_path / "in.hdr")
    assert Beside(tmp_path).file("in.hdr") == tmp_path / "in.hdr"
    assert Beside(tmp_path).file("in.hdr").read_bytes() == SKY


@pytest.mark.parametrize(
    ("name", "shown"),
    [("../" + "x" * 37, "../" + "x" * 37), ("../" + "x" * 38, "../" + "x" * 34 + "...")],
)
def test_a_long_name_is_shown_by_its_beginning(name, shown, tmp_path):
    with pytest.raises(ValueError, match="must lie below the scene's folder") as caught:
        Beside(tmp_path).file(name)
    assert f", but '{shown}' does not:" in str(caught.value)
