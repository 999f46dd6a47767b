import numpy as np
import pytest

from firstorder.io import read_scene

FILES = {
    "a.toml": '[[shape]]\nkind = "circle"\ncenter = [1, 2]\nradius = 0.5',
    "b.svg": '<svg height="4"><circle cx="1" cy="2" r="0.5"/></svg>',
    "C.SVG": '<svg viewBox="0 0 9 4"><circle cx="1" cy="2" r="0.5"/></svg>',
}


@pytest.mark.smoke
@pytest.mark.parametrize("name", FILES)
def test_the_ending_says_how_a_scene_is_read(tmp_path, name):
    (tmp_path / name).write_text(FILES[name])
    scene = read_scene(tmp_path / name)
    np.testing.assert_array_equal(scene.groups[0].center, [[1.0, 2.0]])
    np.testing.assert_array_equal(scene.groups[0].radius, [0.5])


@pytest.mark.parametrize(
    ("name", "sentence"),
    [
        ("a.json", "a.json: a scene must be a .toml or .svg file."),
        ("folder.svg", "folder.svg: the file cannot be opened (is a directory)."),
    ],
)
def test_what_is_no_scene_is_one_sentence(tmp_path, name, sentence):
    (tmp_path / "folder.svg").mkdir()
    with pytest.raises(ValueError, match=r"^\w+\.") as caught:
        read_scene(tmp_path / name)
    assert str(caught.value) == sentence
