"""Bands in scene files: they come back to the bit, in both worlds, and errors are sentences."""

from typing import Any

import jax
import numpy as np
import pytest

from firstorder import flatland, space
from firstorder.imaging._textures import ImageTexture
from firstorder.io import (
    describe_space,
    flatland_from_toml,
    flatland_to_toml,
    read_space,
    space_from_toml,
    space_to_toml,
)
from firstorder.io.scenes._surface_maps import MapSet
from firstorder.io.scenes.space_toml import SpaceFile

RANDOM = np.random.default_rng(4).uniform(size=(9, 3))

FLAT = """
[[shape]]
kind = "polyline"
points = [[0, 1], [1, 1], [1, 2]]
name = "lamp"
emission = [0.1, 0.2, 0.3]
two_sided = true
[[shape]]
kind = "segment"
start = [0, 0]
end = [1, 0]
name = "lamp"
emission = 1.0
albedo = [[0.1, 0.2, 0.3], [0.4, 0.5, 0.6]]
[[light]]
position = [0, 5]
intensity = [1, 2, 3]
[[light]]
position = [1, 5]
intensity = 4
[environment]
kind = "constant"
radiance = [0.5, 0.25, 0.125]
"""

BALL = """
dimensions = 3
[[shape]]
kind = "sphere"
center = [0, 0, 1]
radius = 0.5
"""


def same(a, b):
    """Whether two scenes hold the same bits in the same form."""
    assert jax.tree.structure(a) == jax.tree.structure(b)
    for x, y in zip(jax.tree.leaves(a), jax.tree.leaves(b), strict=True):
        np.testing.assert_array_equal(np.asarray(x), np.asarray(y))
        assert np.shape(x) == np.shape(y)


def test_a_file_of_flatland_is_read_and_comes_back():
    scene = flatland_from_toml(FLAT)
    assert scene.bands == 3
    m = scene.material
    assert m.emission[0].tolist() == m.emission[1].tolist() == [[0.1, 0.2, 0.3]] * 2
    assert m.emission[2].tolist() == [[1.0] * 3, [0.0] * 3]  # a grey one of the same name
    assert m.albedo[2].tolist() == [[0.1, 0.2, 0.3], [0.4, 0.5, 0.6]]
    assert scene.points.intensity.tolist() == [[1.0, 2.0, 3.0], [4.0, 4.0, 4.0]]
    same(flatland_from_toml(flatland_to_toml(scene)), scene)


@pytest.mark.parametrize(
    "sky",
    [
        flatland.ConstantSky(RANDOM[0]),
        flatland.GaussianSky(0.3, 0.4, RANDOM[1]),
        flatland.PanoramaSky(RANDOM),
        flatland.PanoramaSky(RANDOM, smooth=True),
    ],
)
def test_skies_of_flatland_come_back(sky):
    lamp = flatland.primitive(
        flatland.Circles((0.0, 1.0), 0.3), emission=RANDOM[2], albedo=RANDOM[3]
    )
    scene = flatland.Scene.of(lamp, environment=sky)
    same(flatland_from_toml(flatland_to_toml(scene)), scene)


@pytest.mark.parametrize(
    "sky",
    [
        RANDOM[0],
        space.GaussianSky((0.0, 0.6, 0.8), 0.4, RANDOM[1]),
        space.PanoramaSky(RANDOM[:8].reshape(2, 4, 3)),
        space.HarmonicSky(RANDOM),
    ],
)
def test_scenes_of_space_come_back(sky):
    things = (
        space.primitive(space.sphere((0, 0, 1), 0.5), albedo=RANDOM[4], name="ball"),
        space.primitive(space.disc((0, 0, 3), (0, 0, -1), 0.5), emission=[RANDOM[5], RANDOM[6]]),
    )
    coats = (MapSet(ImageTexture(RANDOM[:8].reshape(2, 4, 3))), MapSet())
    file = SpaceFile(things, sky=sky, coats=coats)
    again = space_from_toml(space_to_toml(file))
    same(again.things, things)
    same(again.coats, coats)
    same(again.scene, file.scene)
    same(space_from_toml(space_to_toml(file.scene)).scene, file.scene)


def test_two_sided_bands_are_those_of_both_sides():
    text = BALL + "emission = [1.0, 2.0, 3.0]\n"
    one, both = space_from_toml(text), space_from_toml(text + "two_sided = true\n")
    assert one.scene.material.emission.tolist() == [[[1.0, 2.0, 3.0], [0.0] * 3]]
    assert both.scene.material.emission.tolist() == [[[1.0, 2.0, 3.0]] * 2]


def test_a_mesh_has_bands(tmp_path):
    text = """
    dimensions = 3
    [[mesh]]
    vertices = [[0, 0, 0], [1, 0, 0], [0, 1, 0]]
    faces = [[0, 1, 2]]
    albedo = [0.2, 0.4, 0.6]
    """
    found = space_from_toml(text)
    assert found.scene.material.albedo.tolist() == [[[0.2, 0.4, 0.6]] * 2]
    same(space_from_toml(space_to_toml(found)).scene, found.scene)


def test_bands_are_described():
    words = describe_space(space_from_toml(BALL + "albedo = [0.2, 0.4, 0.6]\n"))
    assert words.splitlines()[0].endswith("albedo ((0.2, 0.4, 0.6), (0.2, 0.4, 0.6))")


@pytest.mark.parametrize(
    ("more", "sentence"),
    [
        ("emission = []", "`emission` must be a number, or three or more for bands; or two such"),
        ("emission = [1, 2, 'x']", "`emission` must be a number, or three or more for bands"),
        ("albedo = [[0.1], [0.2]]", "`albedo` must be a number, or three or more for bands"),
        ("albedo = [0.1, 0.2, 1.5]", "`albedo`"),
        ("emission = [1, -2, 3]", "`emission` must not be negative, but is -2"),
    ],
)
def test_what_is_no_bands_is_one_sentence_with_its_line(more, sentence):
    with pytest.raises(ValueError, match=r"^scene, line 6, shape 1: ") as found:
        space_from_toml(BALL.lstrip() + more)
    assert sentence in str(found.value)


def test_shapes_of_other_bands_are_refused():
    text = FLAT.replace("emission = 1.0", "emission = [1.0, 2.0, 3.0, 4.0]")
    with pytest.raises(ValueError, match=r"equally many, but there are things of 3 and 4\.$"):
        flatland_from_toml(text)
    with pytest.raises(ValueError, match=r"`intensity` must have equally many bands in all lights"):
        flatland_from_toml(FLAT.replace("intensity = 4", "intensity = [4, 5]"))


def test_two_bands_have_no_words_in_a_file():
    lamp = flatland.primitive(flatland.Circles((0.0, 1.0), 0.3), emission=np.ones((1, 2, 2)))
    with pytest.raises(ValueError, match=r"must have three bands or more .*, but has 2\.$"):
        flatland_to_toml(flatland.Scene.of(lamp))


# --- pictures ------------------------------------------------------------------------------------


@pytest.fixture
def folder(tmp_path):
    from PIL import Image

    levels = np.random.default_rng(1).integers(0, 256, (4, 8, 3), np.uint8)
    Image.fromarray(levels).save(tmp_path / "colours.png")
    return tmp_path, levels


def from_file(folder, text) -> Any:
    (folder / "a.toml").write_text(BALL + text)
    return read_space(folder / "a.toml")


def test_a_panorama_keeps_its_colours_or_is_its_luminance(folder):
    folder, levels = folder
    c = levels / 255.0
    linear = np.where(c <= 0.04045, c / 12.92, ((c + 0.055) / 1.055) ** 2.4)
    table = '[environment]\nkind = "panorama"\nfile = "colours.png"\n'
    np.testing.assert_allclose(from_file(folder, table + "colour = true").sky.values, linear)
    grey = from_file(folder, table).sky.values
    np.testing.assert_allclose(grey, linear @ [0.2126, 0.7152, 0.0722])
    row = '[[shape]]\nkind = "circle"\ncenter = [0, 0]\nradius = 1\n[environment]\nkind = "row"\n'
    text = row + 'file = "colours.png"\nrow = 1\ncolour = true'
    sky: Any = flatland_from_toml(text, "a", folder).environment
    np.testing.assert_allclose(sky.values, linear[1])


def test_a_texture_keeps_its_colours_and_a_normal_map_its_numbers(folder):
    folder, levels = folder
    text = '[shape.texture]\nkind = "picture"\nfile = "colours.png"\ncolour = true\n'
    text += '[shape.normal_map]\nkind = "picture"\nfile = "colours.png"\n'
    (coat,) = from_file(folder, text.replace("normal_map", "bump")).coats
    assert coat.texture.values.shape == (4, 8, 3)
    luminance = levels / 255.0 @ np.array([0.2126, 0.7152, 0.0722])
    np.testing.assert_allclose(coat.bump.values, luminance)
    assert coat.texture.values.min() < (levels / 255.0).min() + 1e-3
