"""Coats of scene files: what a hand writes, what is refused, and what pixels come of it."""

import pathlib
import re

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from firstorder.imaging._textures import ImageTexture, SolidSlopes, SolidWaves
from firstorder.imaging.shading import SurfaceMaps
from firstorder.io import read_space, space_from_toml, space_to_toml
from firstorder.io.exr import write_layers
from firstorder.io.scenes._surface_maps import MapSet, Picture
from firstorder.io.scenes.space_text import describe_space
from firstorder.rendering.image_files import scene_fingerprint, world_from_scene
from firstorder.rendering.renderer import Renderer
from tests.io.scenes.coated import INLINE, PICTURES, REST, START, TEXELS, WAVES

EXAMPLE = pathlib.Path(__file__).parents[3] / "examples" / "coats.toml"
P = np.stack(np.meshgrid(np.linspace(-0.4, 0.4, 5), np.linspace(-0.4, 0.5, 5)), -1).reshape(-1, 2)


def k(x):
    """The product of sines of `WAVES`, by hand."""
    rows = jnp.array([[9.0, 1.0, 0.0], [0.0, 8.0, 3.0]])
    return jnp.prod(jnp.sin(rows @ (x - jnp.array([0.1, 0.0, 0.2]))))


def on_ball(f, plain):
    return lambda index, x: jnp.where(index == 0, f(x), plain)


LEAN = jnp.array([0.3, 0.0, -0.1])
IN_SPACE = {
    "bump": (
        f"size = 0.02\n{WAVES}",
        SurfaceMaps(height=on_ball(lambda x: 0.0 + 0.02 * k(x), 0.0)),
    ),
    "normal_map": (
        f"lean = [0.3, 0.0, -0.1]\n{WAVES}",
        SurfaceMaps(slopes=on_ball(lambda x: LEAN * (0.0 + 1.0 * k(x)), jnp.zeros(3))),
    ),
    "texture": (
        f"mean = 0.6\nsize = 0.3\n{WAVES}",
        SurfaceMaps(albedo=on_ball(lambda x: 0.6 + 0.3 * k(x), 1.0)),
    ),
}


@pytest.mark.smoke
def test_a_file_says_what_python_says_to_the_bit():
    """The same pixels and gradients as with functions written by hand."""
    tables = (f'[shape.{name}]\nkind = "waves"\n{keys}\n' for name, (keys, _) in IN_SPACE.items())
    world = world_from_scene(space_from_toml(START + "".join(tables) + REST), nodes=2)
    parts = {k: getattr(f, k) for _, f in IN_SPACE.values() for k in ("height", "slopes", "albedo")
             if getattr(f, k) is not None}  # fmt: skip
    bare = world._replace(finish=None)
    found, _ = Renderer(world).pixels(P)
    expected, index = Renderer(bare._replace(finish=SurfaceMaps(**parts))).pixels(P)
    plain, _ = Renderer(bare).pixels(P)
    assert {0, 1} <= set(index)
    for layer in ("value", "gradient", "CDV"):
        np.testing.assert_array_equal(getattr(found, layer), getattr(expected, layer))
    ball = (index == 0) & (plain.value > 0.0)
    assert np.all(found.value[ball] != plain.value[ball])
    np.testing.assert_allclose(found.value[index == 1], plain.value[index == 1], rtol=1e-14)


def test_a_wall_and_a_mesh_show_the_texels(tmp_path):
    """Seen from above, u to the right and v upwards; from the table and from a file, to the bit.

    Each pixel looks at the middle of a texel: value = sky * albedo * texel.
    """
    p = np.array([((2 * (j + 0.5) / 3 - 1 + x - 1.5) / 3, (1 - 2 * (i + 0.5) / 2) / 3)
                  for x in (0.0, 3.0) for i in (0, 1) for j in (0, 1, 2)])  # fmt: skip
    write_layers(tmp_path / "grey.exr", {"Y": TEXELS.T[:, ::-1]})
    texts = (PICTURES.format(a, a) for a in (INLINE, 'file = "grey.exr"'))
    for text in texts:
        world = world_from_scene(
            space_from_toml("dimensions = 3" + text, folder=tmp_path), sky_rows=6
        )
        found, index = Renderer(world._replace(sky_nodes="cosine")).pixels(p)
        assert index.tolist() == [0] * 6 + [1] * 6
        np.testing.assert_allclose(found.value, 0.8 * np.tile(TEXELS.ravel(), 2), rtol=1e-9)


def test_a_mesh_takes_u_and_v_from_its_file(tmp_path):
    lines = "v 2 -1 0\nv 4 -1 0\nv 4 1 0\nv 2 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\n"
    (tmp_path / "quad.obj").write_text(lines + "f 1/1 2/2 3/3\nf 1/1 3/3 4/4\n")
    inline = space_from_toml("dimensions = 3" + PICTURES.format(INLINE, INLINE)).models[0]
    text = 'dimensions = 3\n[[mesh]]\nfile = "quad.obj"\n'
    read = space_from_toml(text, folder=tmp_path).models[0]
    corners = (np.asarray(m.mesh.corners) for m in (inline, read))
    for a, u, b, v in zip(*(x for m, c in zip((inline, read), corners, strict=True)
                            for x in (c, m.uv)), strict=True):  # fmt: skip
        np.testing.assert_array_equal(a, b)
        np.testing.assert_array_equal(u, v)


def test_everything_comes_back_to_the_bit():
    grid = np.random.default_rng(1).uniform(0.51, 1.0, (4, 5, 3))
    text = START + (
        f'[shape.bump]\nkind = "picture"\nsize = 0.3\nrepeat = [2, 3]\nvalues = '
        f'{grid[..., 0].tolist()}\n[shape.normal_map]\nkind = "picture"\nvalues = {grid.tolist()}\n'
    )
    text += PICTURES.format(INLINE, INLINE)
    for name, (keys, _) in IN_SPACE.items():
        text += '[[shape]]\nkind = "disc"\ncenter = [0, 0, 9]\nnormal = [0, 0, 1]\nradius = 1\n'
        text += f'[shape.{name}]\nkind = "waves"\n{keys}\n'
    space = space_from_toml(text)
    again = space_from_toml(space_to_toml(space))
    names = ["bump", "normal_map"], ["texture"], ["bump"], ["normal_map"], ["texture"], ["texture"]
    assert [list(c.names) for c in space.coats] == list(names)
    assert jax.tree.structure(space.coats) == jax.tree.structure(again.coats)
    for a, b in zip(jax.tree.leaves(space.coats), jax.tree.leaves(again.coats), strict=True):
        np.testing.assert_array_equal(a, b)
    np.testing.assert_array_equal(space.models[0].uv, again.models[0].uv)
    assert scene_fingerprint(space) == scene_fingerprint(again)
    assert "ball          at (0, 0, 0.6), with bump, normal map, albedo" in describe_space(space)


def test_the_example_is_rendered():
    space = read_space(EXAMPLE)
    assert [c.names for c in space.coats] == [("texture",), ("bump",), ("texture",), ("bump",), ()]
    world = world_from_scene(space, nodes=2, sky_rows=2, sky_nodes="cosine")
    p = np.random.default_rng(0).uniform(-0.5, 0.5, (200, 2))
    found, index = Renderer(world).pixels(p, gradients=False)
    assert set(index) >= {0, 1, 2, 3}
    assert np.all(np.isfinite(found.value))
    assert found.value.max() > 0.3


# --- sentences -----------------------------------------------------------------------------------

BALL = 'shape 1 ("ball"), '
SENTENCES = [
    ("[shape.texture]\nkind = 'wood'", 9, 'texture: kind "wood" is not known: known are'),
    ("[shape.texture]\nkind = 'picture'", 8, "texture: `values` is missing."),
    (
        "[shape.texture]\nkind = 'picture'\nvalues = [[0.5, 1.5]]",
        10,
        "texture: a texture must lie in [0, 1], but goes from 0.5 to 1.5.",
    ),
    (
        f"[shape.texture]\nkind = 'waves'\nsize = 0.7\n{WAVES}",
        10,
        "texture: a texture must lie in [0, 1], but goes from -0.2 to 1.2.",
    ),
    (
        "[shape.texture]\nkind = 'picture'\nvalues = [[0.5]]\nrepeat = [0, 1]",
        11,
        "texture: `repeat` must be positive, but is 0.0.",
    ),
    (
        "[shape.texture]\nkind = 'picture'\nfile = 'none.exr'",
        10,
        "texture: none.exr: the file cannot be opened (no such file or directory).",
    ),
    ("[shape.bump]\nkind = 'waves'\nsize = 1.0", 8, "bump: `waves` is missing."),
    (
        f"[shape.bump]\nkind = 'waves'\nsize = 1.0\nheight = 1.0\n{WAVES}",
        11,
        "bump: `height` is not known here",
    ),
    (
        "[shape.bump]\nkind = 'picture'\nvalues = [[0.5]]",
        10,
        "bump: `values` must be at least 4 x 4 pixels, but is 1 x 1.",
    ),
    (
        f"[shape.bump]\nkind = 'picture'\nsize = 1e300\nvalues = {[4 * [1e300]] * 4}",
        11,
        "bump: `values` must be finite, but is inf.",
    ),
    (
        "[shape.texture]\nkind = 'picture'\nfile = 'wood.gif'",
        10,
        "texture: wood.gif: a picture must be an .hdr, .exr, .png or .jpg file.",
    ),
    (
        "[shape.normal_map]\nkind = 'picture'\nvalues = [[[1, 1, 0.2]]]",
        8,
        "normal_map: `pixels` must be at least 4 x 4 pixels, but is 1 x 1.",
    ),
    (
        "[shape.normal_map]\nkind = 'picture'\nvalues = [[1, 2]]",
        10,
        "normal_map: `values` must be rows of equally many triples of numbers, but is [[1, 2]].",
    ),
]


@pytest.mark.parametrize(("lines", "line", "words"), SENTENCES)
def test_what_is_wrong_is_said_in_a_sentence(lines, line, words):
    with pytest.raises(ValueError, match="^" + re.escape(f"scene, line {line}, {BALL}{words}")):
        space_from_toml(START + lines + "\n" + REST)


def test_what_has_no_u_and_v_wears_no_picture():
    polygon = 'kind = "polygon"\nvertices = [[0, 0, 0], [1, 0, 0], [0, 1, 0]]\n'
    faces = "vertices = [[0, 0, 0], [1, 0, 0], [0, 1, 0]]\nfaces = [[0, 1, 2]]\n"
    for name, keys in (("shape", polygon), ("mesh", faces)):
        start = f"dimensions = 3\n[[{name}]]\n{keys}[{name}.texture]\n"
        with pytest.raises(
            ValueError, match=rf"`texture` lies over \(u, v\), which this {name} has not"
        ):
            space_from_toml(start + 'kind = "picture"\nvalues = [[0.5]]\n')
        waves = space_from_toml(start + f'kind = "waves"\n{WAVES}\n')
        assert isinstance(waves.coats[0].texture, SolidWaves)
    with pytest.raises(ValueError, match="`uv` must be three pairs for each of 1 faces"):
        space_from_toml(f"dimensions = 3\n[[mesh]]\n{faces}uv = []\n")
    with pytest.raises(ValueError, match=r"`texture` must be written \[shape.texture\]"):
        space_from_toml(START + "texture = 0.5\n")


@pytest.mark.parametrize(("mean", "size"), [(0.8, 0.2), (0.6, 0.4), (0.85, 0.15), (0.3, -0.3)])
def test_waves_may_reach_0_and_1_in_single_precision_too(mean, size):
    """Rounded to it, 0.6 + 0.4 is above 1."""
    table = f"[shape.texture]\nkind = 'waves'\nmean = {mean}\nsize = {size}\n{WAVES}\n"
    with jax.enable_x64(False):
        coat = space_from_toml(START + table + REST).coats[0]
        assert isinstance(coat.texture, SolidWaves)
        assert coat.texture.mean.dtype == jnp.float32
        assert MapSet(coat.texture).names == ("texture",)


def hdr(colours):
    """A row of bytes of red, green, blue and the exponent."""
    return b"#?RADIANCE\n\n-Y 4 +X 4\n" + bytes(colours) * 16


def test_radiance_files_may_be_white(tmp_path):
    """They tell 1 as 1 + 1/256, the middle of a step; and of a flat normal half a step's slope."""
    (tmp_path / "white.hdr").write_bytes(hdr((128, 128, 128, 129)))
    (tmp_path / "flat.hdr").write_bytes(hdr((64, 64, 128, 129)))
    (tmp_path / "above.hdr").write_bytes(hdr((129, 129, 129, 129)))
    tables = '[shape.{}]\nkind = "picture"\nfile = "{}.hdr"\n'

    def coat(name, file):
        return space_from_toml(START + tables.format(name, file) + REST, folder=tmp_path).coats[0]

    texture, bump = coat("texture", "white").texture, coat("bump", "white").bump
    normals = coat("normal_map", "flat").normal_map
    assert isinstance(texture, ImageTexture)
    assert isinstance(bump, Picture)
    assert isinstance(normals, Picture)
    np.testing.assert_array_equal(texture.values, 1.0)
    np.testing.assert_allclose(normals.values[0, 0], [0.5039, 0.5039, 1.0], rtol=0.0, atol=1e-4)
    assert np.max(bump.values) > 1.0  # a height is no share
    with pytest.raises(ValueError, match="a texture must lie in"):
        coat("texture", "above")
    with pytest.raises(ValueError, match="a texture must lie in"):
        space_from_toml(START + "[shape.texture]\nkind = 'picture'\nvalues = [[1.003]]" + REST)
    with pytest.raises(ValueError, match=r"`pixels` must lie in \[0, 1\]"):
        coat("normal_map", "above")


def test_coats_of_python_are_refused_as_those_of_files():
    for texture in (
        ImageTexture([[0.5, 1.5]]),
        ImageTexture([[-0.1]]),
        SolidWaves([[1.0, 0.0, 0.0]], 0.5, mean=0.6),
        SolidWaves([[1.0, 0.0, 0.0]], 0.5, mean=0.4),
    ):
        with pytest.raises(ValueError, match=r"Argument `texture` must lie in \[0, 1\], but"):
            MapSet(texture)


def test_lamps_wear_nothing():
    text = START + REST.replace(
        "[camera]", '[shape.texture]\nkind = "picture"\nvalues = [[0.5]]\n[camera]'
    )
    with pytest.raises(ValueError, match="must have lamps without textures"):
        world_from_scene(space_from_toml(text))


def test_coats_name_what_they_have():
    coat = MapSet(ImageTexture([[0.5]]), None, SolidSlopes((1.0, 0.0, 0.0)))
    assert coat.names == ("texture", "normal_map")
    assert coat.pictures == ("texture",)
