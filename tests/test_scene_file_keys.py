"""The page of keys of scene files: all that readers ask for, and nothing that they do not."""

import ast
import inspect
import re
import sys

import pytest

from docs.generate import scene_files
from firstorder import io
from firstorder.io.scenes import _skies, _surface_maps, flatland_toml, space_toml

TRIANGLE = """ply
format ascii 1.0
element vertex 3
property float x
property float y
property float z
element face 1
property list uchar int vertex_indices
end_header
0 0 0
1 0 0
0 1 0
3 0 1 2
"""
MESH = "[[mesh]]\nvertices = [[0, 0, 0], [1, 0, 0], [0, 1, 0]]\nfaces = [[0, 1, 2]]"


def asked_in(module):
    """Keys that the source of a reader of TOML names where it asks for one."""
    calls = (n for n in ast.walk(ast.parse(inspect.getsource(module))) if isinstance(n, ast.Call))
    asks = ("take", "inner", "_rows")
    found = set()
    for call in calls:
        if getattr(call.func, "attr", getattr(call.func, "id", "")) in asks:
            found |= {a.value for a in call.args[:1] if isinstance(a, ast.Constant)}
            found |= {k.arg for k in call.keywords}
    return found


def keys_told(tables):
    return {row[1].strip("`") for rows in tables.values() for row in rows}


@pytest.mark.parametrize(
    ("modules", "tables"),
    [
        ([flatland_toml], scene_files.flatland),
        ([space_toml, _skies], scene_files.space),
        ([_surface_maps], scene_files.surface_maps),
    ],
    ids=["flatland", "space", "surface maps"],
)
def test_every_key_that_a_reader_asks_for_is_told(modules, tables):
    asked = set.union(*map(asked_in, modules))
    assert len(asked) > 5
    assert asked - keys_told(tables()) == set()


def test_a_key_that_is_new_is_missed(monkeypatch):
    make, reads = space_toml._GEOMETRY["sphere"]
    more = reads | {"spin": lambda value: 1.0}
    monkeypatch.setitem(space_toml._GEOMETRY, "sphere", (make, more))
    with pytest.raises(ValueError, match="`spin` is missing"):
        scene_files.space.__wrapped__()


def test_a_kind_that_is_new_is_missed(monkeypatch):
    monkeypatch.setitem(flatland_toml._GEOMETRY, "spiral", flatland_toml._circle)
    with pytest.raises(KeyError, match="spiral"):
        scene_files.flatland.__wrapped__()


@pytest.mark.parametrize(
    ("start", "read", "skies"),
    [
        ("", io.flatland_from_toml, scene_files.FLATLAND_SKIES),
        ("dimensions = 3\n" + MESH, io.space_from_toml, scene_files.SPACE_SKIES),
    ],
    ids=["flatland", "space"],
)
def test_every_kind_of_sky_is_told(start, read, skies):
    with pytest.raises(ValueError, match="known are") as caught:
        read(f'{start}\n[environment]\nkind = "zzz"')
    assert str(caught.value).endswith(f"known are {', '.join(sorted(skies))}.")


@pytest.mark.parametrize("module", [flatland_toml, space_toml, _surface_maps])
def test_the_head_of_a_reader_names_every_key(module):
    tables = {
        flatland_toml: scene_files.flatland,
        space_toml: scene_files.space,
        _surface_maps: scene_files.surface_maps,
    }
    head = inspect.getdoc(module) or ""
    named = set(re.findall(r"`(\w+)`", head)) | set(re.findall(r"^ *(\w+) = ", head, re.M))
    named |= set(re.findall(r"\[shape\.(\w+)\]", head)) | set(re.findall(r"`(\w+) =", head))
    named |= set(re.findall(r"\w+", " ".join(re.findall(r"\((.*?)\)", head))))
    assert keys_told(tables[module]()) - named - {"uv"} == set()


@pytest.mark.parametrize("name", ["flatland_from_toml", "space_from_toml"])
def test_the_head_of_a_reader_is_a_scene(name, tmp_path):
    read = getattr(io, name)
    head = inspect.getdoc(sys.modules[read.__module__]) or ""
    text = "\n".join(line[4:] for line in head.splitlines() if line.startswith("    "))
    (tmp_path / "bunny.ply").write_text(TRIANGLE)
    scene = read(text, folder=tmp_path)
    assert getattr(scene, "scene", scene).count == len(
        re.findall(r"^ +\[\[(shape|mesh)", head, re.M)
    )


def test_an_attribute_is_told_of_the_element_that_asks_for_it():
    asked = scene_files.attributes()
    assert asked["circle"][-3:] == ("r", "cx", "cy")
    assert {"href", "x", "y"} <= set(asked["use"])
    assert {"data-scale", "data-sky", "viewBox"} <= set(asked["svg"])
    assert "x1" not in asked["g"]
