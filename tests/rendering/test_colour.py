"""Rendering in bands: an image of three is three images, in files that others show in colour."""

import pathlib

import numpy as np
import pytest

from firstorder.imaging import Lamp, pinhole
from firstorder.io import read_layers, read_space, space_from_toml
from firstorder.io.images import linear_from_srgb, read_image
from firstorder.plotting.pictures import tone_map, write_png
from firstorder.rendering import Renderer, World, render_to_files, world_from_scene
from firstorder.rendering import _programs as programs
from firstorder.scene._bands import one_band
from firstorder.space import GaussianSky, Scene, primitive, rectangle, sphere

EXAMPLE = pathlib.Path(__file__).parents[2] / "examples" / "colour.toml"
SHAPES_ALONE = {"index", "distance", "cosine", "curvature", "CV", "CV.diffuse", "CV.glossy"}

TEXTURED = """
dimensions = 3
[[shape]]
kind = "rectangle"
center = [0, 0, 0]
u = [2, 0, 0]
v = [0, 2, 0]
albedo = [0.8, 0.6, 0.4]
specular = 0.1
exponent = 8.0
[shape.texture]
kind = "picture"
values = [[[1.0, 0.5, 0.2], [0.1, 0.3, 0.9]], [[0.4, 0.4, 0.4], [0.2, 0.8, 0.1]]]
[[shape]]
kind = "sphere"
center = [0.2, 0, 0.6]
radius = 0.4
albedo = 0.5
[environment]
kind = "gaussian"
radiance = [0.2, 0.3, 0.6]
[camera]
eye = [0, -4, 2]
look_at = [0, 0, 0.4]
gamma = 1.5
"""


def world_of(name):
    space = read_space(EXAMPLE) if name == "colour" else space_from_toml(TEXTURED)
    return world_from_scene(space, nodes=3, sky_rows=3, sky_nodes="cosine")


def places(n=5):
    return np.stack(np.meshgrid(*(np.linspace(-0.9, 0.9, n),) * 2), -1).reshape(-1, 2)


@pytest.mark.parametrize("name", ["colour", "textured"])
def test_layers_of_three_bands_are_those_of_three_worlds(name):
    world, p = world_of(name), places()
    found = Renderer(world).layers(p)
    each = [Renderer(one_band(world, k)).layers(p) for k in range(3)]
    assert {n for n, a in found.items() if a.ndim == 1} == SHAPES_ALONE
    for layer, values in found.items():
        for k in range(3):
            here = values if layer in SHAPES_ALONE else values[:, k]
            alone, scale = each[k][layer], np.max(np.abs(each[k][layer]))
            np.testing.assert_allclose(here, alone, rtol=1e-9, atol=1e-10 * scale, err_msg=layer)
    assert not np.allclose(found["value"][:, 0], found["value"][:, 1])
    assert np.all(found["value"][found["index"] >= 0].max(0) > 0.0)


def test_lamps_and_skies_of_one_number_are_the_same_in_all_bands():
    ball = Scene.of(primitive(sphere((0, 0, 0.5), 0.5), albedo=(0.9, 0.5, 0.1)))
    lamp = Lamp((0, 0, 2), (0, 1, 0), (1, 0, 0), 5.0, count=2, even=True)
    world = World(
        pinhole((0, -4, 0.8), (0, 0, 0.8)), ball, lamps=(lamp,), sky=GaussianSky(), sky_rows=2
    )
    layers = Renderer(world).layers(places())
    beside = layers["index"] < 0
    assert np.all(layers["value"][beside] == layers["value"][beside][:, :1])
    met = layers["index"] == 0
    diffuse = layers["value"][met]
    np.testing.assert_allclose(diffuse * [1.0, 0.9 / 0.5, 9.0], diffuse[:, :1] * np.ones(3))


def test_shadow_rays_are_traced_once_for_all_bands(monkeypatch):
    traced, shares = [], programs.shares
    monkeypatch.setattr(programs, "shares", lambda *a: traced.append(1) or shares(*a))
    for made in (world_of("colour"), one_band(world_of("colour"), 0)):
        Renderer(made).pixels(places())
    assert len(traced) == 2  # there is one block of pixels


def test_what_shows_nothing_still_has_bands():
    found, _ = Renderer(world_of("colour")).pixels(np.array([[0.0, 30.0]]))
    assert found.value.shape == (1, 3)
    assert found.gradient.shape == (1, 3, 2)


def test_files_are_in_colour(tmp_path):
    pytest.importorskip("OpenEXR")
    out = tmp_path / "a.exr"
    layers = render_to_files(
        world_of("colour"), 8, 6, tmp_path / "tiles", side=5, passes=2, out=out, quiet=True
    )
    assert layers["value"].shape == (8, 6, 3)
    found = read_layers(out)
    for k, band in enumerate("RGB"):
        np.testing.assert_array_equal(found[band], layers["value"][..., k].astype(np.float32))
        np.testing.assert_array_equal(found[f"grad.u.{band}"], layers["grad.u"][..., k].astype("f"))
    assert "value" not in found
    assert "index" in found
    np.testing.assert_array_equal(
        read_image(out), layers["value"].swapaxes(0, 1)[::-1].astype(np.float32)
    )
    levels = read_image(out.with_suffix(".png"), srgb=False) * 255.0
    np.testing.assert_allclose(levels, tone_map(layers["value"]), rtol=0.0, atol=1e-9)


def test_pixels_of_a_picture_are_its_radiance_again(tmp_path):
    values = np.random.default_rng(2).uniform(size=(5, 4, 3))
    write_png(tmp_path / "a.png", values, 1.0)
    found = read_image(tmp_path / "a.png").swapaxes(0, 1)[:, ::-1]
    # Half a step of 255 levels, times the greatest slope of the curve, 2.4 / 1.055.
    np.testing.assert_allclose(found, values, rtol=0.0, atol=0.5 / 255.0 * 2.4 / 1.055)
    np.testing.assert_allclose(
        linear_from_srgb(np.array([0.04045, 0.5])), [0.04045 / 12.92, 0.21404114]
    )


@pytest.mark.parametrize("bands", [1, 2, 4])
def test_a_picture_of_other_bands_than_three_is_refused(bands, tmp_path):
    with pytest.raises(ValueError, match=rf"must have three bands .* but has {bands}\.$"):
        tone_map(np.ones((2, 2, bands)))


def test_four_bands_are_written_as_channels_and_not_as_a_picture(tmp_path):
    pytest.importorskip("OpenEXR")
    floor = primitive(rectangle((0, 0, 0), (1, 0, 0), (0, 1, 0)), albedo=(0.1, 0.2, 0.3, 0.4))
    lamp = Lamp((0, 0, 2), (0, 1, 0), (1, 0, 0), count=2, even=True)
    world = World(pinhole((0, -2, 2), (0, 0, 0)), Scene.of(floor), lamps=(lamp,))
    out = tmp_path / "four.exr"
    render_to_files(world, 2, 2, tmp_path / "tiles", out=out, quiet=True)
    assert {f"value.{k}" for k in (1, 2, 3, 4)} <= set(read_layers(out))
    assert not out.with_suffix(".png").exists()
