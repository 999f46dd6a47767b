"""Whole images: killed and gone on with to the bit, files with layers, worlds from scene files."""

import os
import signal
import subprocess
import sys
import time

import jax.numpy as jnp
import matplotlib.image
import numpy as np
import pytest

from firstorder.cli import main
from firstorder.io import MeshModel, SpaceFile, read_space, space_from_toml
from firstorder.io.exr import read_layers, write_layers
from firstorder.io.scenes.space_toml import CLASSES
from firstorder.rendering.image_files import (
    image_coordinates,
    render_to_files,
    scene_fingerprint,
    world_from_scene,
)
from firstorder.rendering.renderer import Renderer
from firstorder.space import irradiance, receiver
from firstorder.space.meshes import mesh
from firstorder.space.skies import HarmonicSky, PanoramaSky
from tests.io.scenes.coated import INLINE, PICTURES, REST, START, TEXELS, WAVES

SCENE = """dimensions = 3
[[mesh]]
vertices = [[0, 0, 1], [0.6, 0, 0.2], [-0.3, 0.5, 0.2], [-0.3, -0.5, 0.2]]
faces = [[0, 1, 2], [0, 2, 3], [0, 3, 1], [1, 3, 2]]
albedo = 0.7
[[shape]]
kind = "plane"
point = [0, 0, 0]
normal = [0, 0, 1]
albedo = 0.5
[[shape]]
kind = "rectangle"
center = [0, 0, 2.5]
u = [0, 0.5, 0]
v = [0.5, 0, 0]
emission = 5.0
[camera]
eye = [0, -4, 2]
look_at = [0, 0, 0.4]
gamma = 1.6
"""
PROGRAM = """
import sys, time
from firstorder import session
session.start(cache=sys.argv[4])
from firstorder.cli import main
from firstorder.io import read_space, space_from_toml
from firstorder.rendering import renderer
from firstorder.rendering.image_files import render_to_files, world_from_scene
plain = renderer.Renderer.layers
def slow(self, p, number=0):
    time.sleep(float(sys.argv[3]))
    return plain(self, p, number)
renderer.Renderer.layers = slow
world = world_from_scene(read_space(sys.argv[1]), nodes=3)
layers = render_to_files(world, 24, 16, sys.argv[2], side=8, passes=2, quiet=True)
print(b"".join(layers[k].tobytes() for k in sorted(layers)).hex())
"""


@pytest.fixture
def file(tmp_path):
    (tmp_path / "scene.toml").write_text(SCENE)
    return tmp_path / "scene.toml"


def test_a_killed_image_goes_on_to_the_bit(file, tmp_path):
    """`kill -9` in the middle: what is finished stays, the rest is made, nothing differs."""

    def start(folder, wait):
        given = [str(file), str(tmp_path / folder), str(wait), str(tmp_path / "cache")]
        command = [sys.executable, "-c", PROGRAM, *given]
        return subprocess.Popen(command, stdout=subprocess.PIPE, text=True)

    first = start("a", 0.3)
    while len(list((tmp_path / "a").glob("pass*"))) < 4:
        assert first.poll() is None
        time.sleep(0.02)
    os.kill(first.pid, signal.SIGKILL)
    first.communicate()
    kept = {f: f.stat().st_mtime_ns for f in (tmp_path / "a").glob("pass*")}
    assert 4 <= len(kept) < 12
    again = start("a", 0.0).communicate()[0]
    assert again == start("b", 0.0).communicate()[0] != ""
    assert {f: f.stat().st_mtime_ns for f in kept} == kept


def test_two_programs_share_an_image_and_one_with_other_passes_is_told(file, tmp_path, monkeypatch):
    """The second starts while the first is at work, here between two of its tiles."""
    pytest.importorskip("fcntl")
    pytest.importorskip("OpenEXR")
    world, plain, seen = world_from_scene(read_space(file), nodes=3), Renderer.layers, []

    def render(passes, name="a.exr"):
        about = dict(passes=passes, side=8, quiet=True, out=tmp_path / name)
        return render_to_files(world, 16, 8, tmp_path / "tiles", **about)

    def meanwhile(self, p, number=0):
        if not seen:
            seen.append(None)
            with pytest.raises(ValueError, match=r"a.exr: process .* \(passes 2 and not 1\)"):
                render(1)
            seen.append(render(1, "b.exr")["value"])
            seen.append(render(2)["value"])
        return plain(self, p, number)

    monkeypatch.setattr(Renderer, "layers", meanwhile)
    np.testing.assert_array_equal(render(2)["value"], seen[2])
    np.testing.assert_array_equal(render(1)["value"], seen[1])
    assert not list(tmp_path.glob(".*"))


def test_layers_and_a_picture_are_written(file, tmp_path):
    pytest.importorskip("OpenEXR")
    out = tmp_path / "image.exr"
    world = world_from_scene(read_space(file), nodes=3)
    layers = render_to_files(
        world, 24, 16, tmp_path / "tiles", side=8, passes=2, out=out, quiet=True
    )
    kept = read_layers(out)
    assert set(kept) == set(layers) >= {"value", "grad.u", "grad.v", "SV", "DV", "CV", "CDV.glossy"}
    np.testing.assert_allclose(kept["value"], layers["value"], rtol=1e-6)
    picture = matplotlib.image.imread(out.with_suffix(".png"))
    assert picture.shape[:2] == (16, 24)
    assert np.ptp(picture[..., 0]) > 0.5
    assert set(np.unique(layers["index"])) >= {0.0, 1.0}  # the floor and the mesh


def test_coordinates_are_those_of_square_pixels():
    p = image_coordinates(np.array([(0.0, 0.0), (4.0, 2.0), (2.0, 1.0)]), 4, 2)
    assert p.tolist() == [[-1.0, -0.5], [1.0, 0.5], [0.0, 0.0]]


@pytest.mark.parametrize(
    ("old", "new", "sentence"),
    [
        ("[camera]\neye = [0, -4, 2]\nlook_at = [0, 0, 0.4]\ngamma = 1.6\n", "", "a camera"),
        ("normal = [0, 0, 1]\nalbedo = 0.5", "normal = [0, 0, 1]\nemission = 1.0", "rectangles"),
        ("albedo = 0.7", "emission = 1.0", "meshes that do not emit"),
    ],
)
def test_what_cannot_be_rendered_is_refused(file, old, new, sentence):
    file.write_text(SCENE.replace(old, new))
    with pytest.raises(ValueError, match=f"must have .*{sentence}"):
        world_from_scene(read_space(file))


# --- what things wear ----------------------------------------------------------------------------


def test_the_key_of_tiles_knows_pictures():
    """A texel, what is beyond the border, what the texels are, and on which thing."""

    def letters(old="", new=""):
        return scene_fingerprint(space_from_toml("dimensions = 3" + text.replace(old, new, 1)))

    waves = f"kind = 'waves'\n{WAVES}"
    text = PICTURES.format(INLINE, INLINE)
    found = [letters(), letters("0.125", "0.126"), letters("hold = true", "hold = false")]
    text = START + f"[shape.bump]\nsize = 0.5\n{waves}"
    text = text.removeprefix("dimensions = 3")
    found += [letters(), letters("shape.bump", "shape.texture"), letters("9.0, 1.0", "9.0, 2.0")]
    discs = '\n[[shape]]\nkind = "disc"\ncenter = [0, 0, 0]\nnormal = [0, 0, 1]\nradius = 1\n'
    coats = [f"[shape.texture]\nmean = {mean}\nsize = 0\n{waves}" for mean in (0.2, 0.4)]
    for first, second in (coats, coats[::-1], ("", coats[0]), (coats[0], "")):
        text = discs + first + discs + second
        found.append(letters())
    text = PICTURES.format(INLINE, INLINE)
    found += [letters("[[0, 0], [1, 0], [1, 1]]", "[[0, 0], [1, 0], [1, 0.5]]")]
    assert len(set(found)) == 11


NAMED = {
    "lamp": ("shape", """kind = "rectangle"
center = [0, 0, 5]
u = [0, 1, 0]
v = [1, 0, 0]
emission = 3.0"""),
    "ground": ("shape", 'kind = "plane"\npoint = [0, 0, 0]\nnormal = [0, 0, 1]'),
    "kite": ("shape", 'kind = "polygon"\nvertices = [[0, 0, 1], [2, 0, 1], [3, 2, 1], [0, 1, 1]]'),
    "first": ("mesh", "vertices = [[0, 0, 3], [1, 0, 3], [0, 1, 3]]\nfaces = [[0, 1, 2]]"),
    "ball": ("shape", 'kind = "sphere"\ncenter = [0, 0, 0]\nradius = 1'),
    "three": ("shape", 'kind = "triangle"\ncorners = [[0, 0, 2], [1, 0, 2], [0, 1, 2]]'),
    "second": ("mesh", "vertices = [[0, 0, 4], [1, 0, 4], [0, 1, 4]]\nfaces = [[0, 1, 2]]"),
}  # fmt: skip


def test_things_wear_their_own_in_whatever_order():
    """A scene counts kind by kind, then models; a lamp is none of them. Each has its own shade."""
    text, shades = "dimensions = 3\n", {}
    for k, (name, (table, keys)) in enumerate(NAMED.items()):
        text += f'[[{table}]]\nname = "{name}"\n{keys}\n'
        if name != "lamp":
            shades[name] = k / 10
            text += f'[{table}.texture]\nkind = "waves"\nsize = 0\nmean = {k / 10}\n{WAVES}\n'
    world = world_from_scene(space_from_toml(text + "[camera]\n" + REST.split("[camera]\n")[1]))
    scene, finish = world.scene, world.finish
    assert scene is not None
    assert finish is not None
    assert finish.albedo is not None
    names = [*scene.names, *(m.name for m in world.models)]
    assert (set(names), names.count("kite")) == (set(shades), 2)  # a kite is two triangles
    found = [finish.albedo(jnp.array(k), jnp.zeros(3)) for k in range(len(names))]
    np.testing.assert_allclose(found, [shades[name] for name in names])


def test_tiles_of_another_texture_are_not_gone_on_with(tmp_path, capsys):
    """The scene file is the same; only the picture beside it has changed."""
    text = PICTURES.format(*2 * ['file = "grey.exr"'])
    (tmp_path / "scene.toml").write_text("dimensions = 3" + text)
    write_layers(tmp_path / "grey.exr", {"Y": TEXELS.T})
    out = tmp_path / "image.exr"
    size = "--width 8 --height 4 --sky-rows 2 --sky-nodes cosine"
    command = ["render", str(tmp_path / "scene.toml"), "--out", str(out), *size.split()]
    assert main(command) == main(command) == 0
    assert read_layers(out)["value"].max() > 0.1
    write_layers(tmp_path / "grey.exr", {"Y": 0.999 * TEXELS.T})
    assert main(command) == 2
    assert "holds those of another one (key differ)" in capsys.readouterr().err


def test_the_key_of_tiles_knows_kinds_of_shapes_skies_and_materials():
    """Seven kinds of shapes, two of skies, and two materials, of the same numbers each."""
    axes = "center = [0, 0, 1]\naxes = [[1, 0, 0], [0, 1, 0], [0, 0, 1]]"
    found = [
        scene_fingerprint(space_from_toml(f'dimensions = 3\n[[shape]]\nkind = "{kind}"\n{axes}'))
        for kind in CLASSES
    ]
    skies = PanoramaSky(np.ones((4, 9))), HarmonicSky(np.ones((4, 9)))
    found += [scene_fingerprint(SpaceFile((), sky=sky)) for sky in skies]
    leaf = mesh([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])
    found += [
        scene_fingerprint(SpaceFile((), (MeshModel(leaf, "leaf", {key: 0.5}),)))
        for key in ("albedo", "specular")
    ]
    assert len(set(found)) == len(CLASSES) + 4


@pytest.mark.parametrize("edges", ["[0, 0.3, 0], [0.3, 0, 0]", "[0.3, 0, 0], [0, 0.3, 0]"])
def test_a_lamp_shines_to_where_its_front_looks(edges):
    """As the scene has it, whose irradiance is exact, also of axes that are left-handed."""
    space = space_from_toml(f"""dimensions = 3
[[shape]]
kind = "disc"
center = [0, 0, 0]
normal = [0, 0, 1]
radius = 5
albedo = 1.0
[[shape]]
kind = "rectangle"
center = [0, 0, 2]
axes = [{edges}, [0, 0, -1]]
emission = 1.0
[camera]
eye = [0, -3, 1]
look_at = [0, 0, 0]
gamma = 1.0
""")
    E = irradiance(space.scene, receiver((0.0, 0.0, 0.0), (0.0, 0.0, 1.0)))
    found, _ = Renderer(world_from_scene(space)).pixels(np.zeros((1, 2)))
    assert E > 0.08
    np.testing.assert_allclose(found.value, E / np.pi, rtol=1e-3)


def test_another_kind_of_file_is_refused_before_anything_is_rendered(file, tmp_path):
    world = world_from_scene(read_space(file), nodes=2)
    with pytest.raises(ValueError, match=r"^a\.png: layers are written to \.exr files\."):
        render_to_files(world, 4, 3, tmp_path / "tiles", out=tmp_path / "a.png", quiet=True)
    assert not (tmp_path / "tiles").exists()
