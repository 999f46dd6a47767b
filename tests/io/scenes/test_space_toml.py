import functools

import jax
import jax.numpy as jnp
import numpy as np
import OpenEXR
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from firstorder.cli import main
from firstorder.io import (
    MeshModel,
    SpaceFile,
    describe_space,
    is_space,
    read_panorama,
    read_space,
    space_from_toml,
    space_to_toml,
    write_space,
)
from firstorder.space import (
    Scene,
    Triangles,
    box,
    cylinder,
    disc,
    plane,
    primitive,
    rectangle,
    sphere,
)
from firstorder.space.meshes import mesh
from firstorder.space.shapes.build import triangle
from firstorder.space.shapes.kinds import Ellipsoids
from firstorder.space.skies import GaussianSky, HarmonicSky, PanoramaSky

ROOM = """
dimensions = 3

[[shape]]
kind = "sphere"
center = [0, 0, 1.5]
radius = 0.5
name = "ball"
albedo = [0.5, 0.25]

[[shape]]
kind = "rectangle"
center = [0.0, 0.0, 3.0]
u = [0.0, 0.2, 0.0]
v = [0.2, 0.0, 0.0]
emission = 2.0
two_sided = true

[[mesh]]
vertices = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]
faces = [[0, 1, 2], [0, 2, 3]]
name = "floor"
albedo = 0.3

[environment]
kind = "gaussian"
sigma = 0.4

[camera]
eye = [0, -4, 1]
look_at = [0, 0, 1]
gamma = 2.0
"""


def test_meshes_are_described_by_their_names_if_they_have_any():
    without = ROOM.replace('name = "floor"\n', "")
    for text, name in ((ROOM, "floor"), (without, "unnamed")):
        line = describe_space(space_from_toml(text)).splitlines()[2]
        assert line.startswith(f"mesh       {name:13} 2 faces, 4 vertices, with a boundary")


def test_a_file_says_what_it_holds():
    assert repr(space_from_toml(ROOM)).splitlines() == [
        "SpaceFile: 2 shapes, 1 mesh, x -0.5 to 1 m, y -0.5 to 1 m, z 0 to 3 m",
        "  ball       1 ellipsoid          x -0.5 to 0.5, y -0.5 to 0.5, z 1 to 2  albedo 0.5",
        "  (no name)  1 rectangle          x -0.2 to 0.2, y -0.2 to 0.2, z 3       emits 2",
        "  floor      mesh of 2 triangles  x 0 to 1, y 0 to 1, z 0                 albedo 0.3",
        "  sky: GaussianSky",
        "  camera at (0, -4, 1) m, looking along (0, 1, 0)",
    ]


def test_a_file_says_which_maps_are_worn_and_that_it_has_no_camera():
    coated = ROOM.partition("[environment]")[0] + "[mesh.bump]\nkind = 'waves'\nsize = 0.1\n"
    file = space_from_toml(f"{coated}waves = [[1, 0, 0]]")
    assert repr(file).splitlines()[4:] == ["  surface maps: floor (bump)", "  no camera"]
    assert repr(SpaceFile(())) == "SpaceFile: empty\n  no camera"


def test_a_file_of_traced_shapes_says_so_and_one_of_numbers_prints_them():
    room, seen = space_from_toml(ROOM), []

    def printed(radius):
        seen.extend([repr(SpaceFile((primitive(sphere((0.0, 0.0, 1.0), radius)),))), repr(room)])
        return radius

    jax.jit(printed)(0.5)
    assert seen == ["SpaceFile: 1 shape, traced", repr(room)]


def same(a, b):
    """Whether two trees are alike to the bit."""
    one, other = jax.tree.flatten(a), jax.tree.flatten(b)
    return one[1] == other[1] and all(
        np.array_equal(p, q) and np.array_equal(np.signbit(p), np.signbit(q))
        for p, q in zip(one[0], other[0], strict=True)
    )


def everything(sky=0.0):
    """A scene of every kind of shape, with full mantissas."""
    found = shapes_of_every_kind()
    sky = sky if callable(sky) else jnp.asarray(sky)
    return Scene(found.groups, found.material, sky, found.names)


@functools.cache
def shapes_of_every_kind():
    rng = np.random.default_rng(5)
    p, u = rng.uniform(-1.0, 1.0, (30, 3)), rng.uniform(0.1, 0.5, 12)
    axes = np.eye(3) + 0.3 * rng.normal(size=(3, 3))
    return Scene.of(
        primitive(sphere(p[0], u[0]), name='say "hi" ü', albedo=u[1]),
        primitive(Ellipsoids(p[1], axes), emission=(u[2], u[3]), specular=u[4], exponent=9.1),
        primitive(box(p[2], p[2] + u[5]), albedo=(u[6], u[7])),
        primitive(cylinder(p[3], p[4], u[8]), name="pole"),
        primitive(disc(p[5], p[6], u[9])),
        primitive(rectangle(p[7], p[8], p[9]), two_sided=True, emission=u[10]),
        primitive(triangle(p[10], p[11], p[12])),
        primitive(plane(p[13], p[14]), name="ground"),
    )


SKIES = {
    "none": 0.0,
    "constant": 1 / 3,
    "gaussian": GaussianSky((0.1, 1 / 7, 2 / 3), 1 / 9, 0.7),
    "panorama": PanoramaSky(np.arange(8.0).reshape(2, 4) / 7),
    "harmonic": HarmonicSky(np.arange(4) / 3),
}


@pytest.mark.smoke
@pytest.mark.parametrize("name", SKIES)
def test_a_scene_comes_back_to_the_bit(tmp_path, name):
    scene = everything(SKIES[name])
    write_space(tmp_path / "scene.toml", scene)
    assert is_space(tmp_path / "scene.toml")
    assert same(read_space(tmp_path / "scene.toml").scene, scene)
    # ... and the comparison sees the last bit of one number
    moved = scene.groups[0].center.at[1, 1].multiply(1 + 2**-52)
    other = jax.tree.map(lambda x: moved if x is scene.groups[0].center else x, scene)
    assert not same(other, scene)


def test_what_a_hand_writes_is_what_it_means():
    space = space_from_toml(ROOM)
    scene = space.scene
    assert scene.names == ("ball", "", "floor", "floor")
    np.testing.assert_array_equal(scene.groups[0].axes[0], 0.5 * np.eye(3))
    np.testing.assert_array_equal(scene.material.emission[1], [2.0, 2.0])
    np.testing.assert_array_equal(
        scene.material.albedo, [[0.5, 0.25], [0, 0], [0.3] * 2, [0.3] * 2]
    )
    assert isinstance(scene.groups[-1], Triangles)
    assert space.models[0].mesh.count == 2
    assert scene.sky(jnp.array([0.0, 0.0, 1.0])) == 1.0
    camera = space.camera
    assert camera is not None
    np.testing.assert_allclose(
        camera.axes, [[1, 0, 0], [0, 0, -1], [0, 1, 0]], rtol=0.0, atol=1e-15
    )
    np.testing.assert_allclose(
        camera.direction(jnp.zeros(2)), [0.0, 1.0, 0.0], rtol=0.0, atol=1e-15
    )


def test_all_of_a_file_comes_back_to_the_bit():
    space = space_from_toml(ROOM)
    again = space_from_toml(space_to_toml(space))
    assert isinstance(again, SpaceFile)
    assert same(again.scene, space.scene)
    assert same(again.models[0].mesh, space.models[0].mesh)
    assert same(again.camera, space.camera)


def test_polygons_boxes_ellipsoids_and_all_friendly_forms():
    scene = space_from_toml("""dimensions = 3
        shape = [
          {kind = "polygon", vertices = [[0,0,0], [2,0,0], [2,2,0], [1,0.5,0]], name = "p"},
          {kind = "ellipsoid", center = [0, 0, 1], semi = [1, 2, 3]},
          {kind = "box", low = [0, 0, 0], high = [1, 2, 3]},
          {kind = "cylinder", base = [0, 0, 0], top = [0, 0, 2], radius = 1},
          {kind = "disc", center = [0, 0, 0], normal = [0, 0, 2], radius = 1},
          {kind = "plane", point = [0, 0, 0], normal = [0, 0, 1]},
          {kind = "triangle", corners = [[0, 0, 0], [1, 0, 0], [0, 1, 0]]},
        ]""").scene
    assert scene.count == 8
    np.testing.assert_array_equal(scene.groups[0].axes[0], np.diag([1.0, 2.0, 3.0]))
    np.testing.assert_array_equal(scene.groups[1].center[0], [0.5, 1.0, 1.5])


def test_meshes_and_panoramas_are_read_from_beside_the_file(tmp_path):
    (tmp_path / "one.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    picture = np.random.default_rng(0).uniform(size=(4, 8, 3)).astype(np.float32)
    OpenEXR.File({}, {"RGB": picture}).write(str(tmp_path / "sky.exr"))
    (tmp_path / "scene.toml").write_text(
        'dimensions = 3\n[[mesh]]\nfile = "one.obj"\nscale = 2.0\nmove = [0, 0, 1]\nname = "one"\n'
        '[environment]\nkind = "panorama"\nfile = "sky.exr"\n'
    )
    space = read_space(tmp_path / "scene.toml")
    np.testing.assert_allclose(space.models[0].mesh.area, 2.0)
    np.testing.assert_array_equal(space.models[0].mesh.vertices[:, 2], 1.0)
    values = picture.astype(float) @ [0.2126, 0.7152, 0.0722]
    np.testing.assert_allclose(space.sky.values, values, rtol=1e-6)
    np.testing.assert_array_equal(read_panorama(tmp_path / "sky.exr").values, space.sky.values)


def with_line(key, value):
    """ROOM with another value."""
    lines = ROOM.splitlines()
    at = next(i for i, line in enumerate(lines) if line.startswith(f"{key} ="))
    lines[at] = f"{key} = {value}"
    return "\n".join(lines)


BALL, LAMP, FLOOR = 'shape 1 ("ball")', "shape 2", 'mesh 1 ("floor")'
SENTENCES = [
    (with_line("radius", "-1"), 7, BALL, "`radius` must be positive, but is -1.0."),
    (with_line("center", "[1, 2]"), 6, BALL, "`center` must be three numbers, but is [1, 2]."),
    (
        with_line("center", "[nan, 1, 2]"),
        6,
        BALL,
        "`center` must be three finite numbers, but is [nan, 1, 2].",
    ),
    (with_line("albedo", "1.5"), 9, BALL,
     "`albedo` and `specular` must add up to at most 1, but add up to 1.5."),
    (with_line("radius", "0.5\nradios = 2"), 8, BALL,
     "`radios` is not known here: did you mean `radius`?"),
    (with_line("u", "[0.4, 0, 0]"), 14, LAMP, "`u` and `v` must not be parallel, but are."),
    (with_line("faces", "[[0, 1, 4]]"), 21, FLOOR,
     "`faces` must number vertices from 0 to 3, but has 4."),
    (with_line("faces", "[[0, 1]]"), 21, FLOOR,
     "`faces` must be a list of triples of whole numbers, but is [[0, 1]]."),
    (with_line("sigma", "0"), 27, "environment", "`sigma` must be positive, but is 0.0."),
    (with_line("look_at", "[0, -4, 9]"), None, "camera",
     "`up` must not be along the view, but is."),
    (with_line("gamma", "-1"), 32, "camera", "`gamma` must be positive, but is -1.0."),
    (with_line("dimensions", "2"), None, "",
     "a scene of space must say `dimensions = 3` at its top."),
    ("dimensions = 3", None, "",
     "a scene must have at least one shape or mesh, but there is none."),
    ("dimensions = 3\nshapes = 3", 2, "", "`shapes` is not known here: did you mean `shape`?"),
    ("dimensions = 3\nmesh = 3", 2, "", "`mesh` must be written [[mesh]], each with its own keys."),
    ('dimensions = 3\n[[mesh]]\nfile = "no.obj"', 3, "mesh 1",
     "no.obj: the file cannot be opened (no such file or directory)."),
    ('dimensions = 3\n[[mesh]]\nfile = "no.stl"', 3, "mesh 1",
     "no.stl: a mesh must be an .obj, .ply, .gltf or .glb file."),
    ('dimensions = 3\n[[shape]]\nkind = "sfere"', 3, "shape 1",
     'kind "sfere" is not known: did you mean `sphere`?'),
    (ROOM.replace('"gaussian"\nsigma = 0.4', '"panorama"\nfile = "no.hdr"'), 27, "environment",
     "no.hdr: the file cannot be opened (no such file or directory)."),
    (ROOM.replace('"gaussian"\nsigma = 0.4', '"panorama"\nvalues = [[1, 2], [1]]'), 27,
     "environment", "`values` must be rows of equally many numbers, but is [[1, 2], [1]]."),
]  # fmt: skip


@pytest.mark.parametrize(("text", "line", "what", "reason"), SENTENCES)
def test_a_bad_file_is_one_sentence_with_its_place(text, line, what, reason):
    with pytest.raises(ValueError, match=r"^room\.toml") as caught:
        space_from_toml(text, "room.toml")
    words = str(caught.value)
    assert words.endswith(f": {reason}")
    assert "\n" not in words
    if line is not None:
        assert f", line {line}" in words
    assert what in words


def test_the_command_lists_what_is_there(tmp_path, capsys):
    (tmp_path / "room.toml").write_text(ROOM)
    copy = tmp_path / "copy.toml"
    assert main(["scene", str(tmp_path / "room.toml"), "--toml", str(copy)]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert " ".join(lines[0].split()) == "sphere ball at (0, 0, 1.5), albedo (0.5, 0.25)"
    assert " ".join(lines[2].split()) == (
        "mesh floor 2 faces, 4 vertices, with a boundary, albedo (0.3, 0.3)"
    )
    assert lines[3].startswith("sky        gaussian, center [0.0, 0.0, 1.0], sigma 0.4")
    assert lines[4] == "camera     at (0, -4, 1), looking along (0, 1, 0)"
    assert main(["scene", str(copy), "--out", "a.png"]) == 2
    assert capsys.readouterr().err == (
        "Arguments `out`, `receivers` and `indirect` are for scenes of flatland, "
        "but copy.toml is one of space.\n"
    )


def test_a_sky_without_a_name_cannot_be_written():
    scene = everything(jax.tree_util.Partial(lambda w: w[2] ** 2))
    with pytest.raises(ValueError, match=r"must have a sky that a file can name .* has Partial\.$"):
        space_to_toml(scene)


SMALL = ROOM[: ROOM.index("[[mesh]]")]


@settings(max_examples=15)
@given(st.data())
def test_mutilated_files_never_crash_the_reader(data):
    at, cut = data.draw(st.integers(0, len(SMALL))), data.draw(st.integers(0, 12))
    source = SMALL[:at] + data.draw(st.text(max_size=4)) + SMALL[at + cut :]
    try:
        words = f"f {space_from_toml(source, 'f')}"[:1]
    except ValueError as error:
        words = str(error)
    assert words.startswith("f")
    assert "\n" not in words


FLAT = """dimensions = 3
[[mesh]]
vertices = [[0, 0, 0], [1, 0, 0], [0, 1, 0]]
faces = [[0, 1, 1], [0, 1, 2]]
uv = [[[9, 9], [9, 9], [9, 9]], [[0, 0], [1, 0], [0, 1]]]
"""


def test_the_triangles_of_a_mesh_have_the_corners_of_its_faces():
    text = """
dimensions = 3
[[mesh]]
vertices = [[1, 2, 0], [2, 2, 1], [2, 3, 0], [1, 3, 4]]
faces = [[0, 1, 2], [0, 2, 3]]
"""
    v = np.array([[1, 2, 0], [2, 2, 1], [2, 3, 0], [1, 3, 4]], float)
    triangles = space_from_toml(text).models[0].thing.shape
    a, u, w = triangles.center, triangles.axes[..., 0], triangles.axes[..., 1]
    np.testing.assert_allclose(np.stack([a, a + u, a + w], 1), v[[[0, 1, 2], [0, 2, 3]]])


@pytest.mark.parametrize("material", [{}, {"albedo": 0.5}, {"emission": 2.0, "albedo": [0.1, 0.2]}])
def test_a_mesh_is_written_with_as_much_of_a_material_as_was_said(material):
    corners = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]
    made = SpaceFile((), (MeshModel(mesh(corners, [[0, 1, 2]]), "leaf", material),))
    found = space_from_toml(space_to_toml(made)).scene.material
    jax.tree.map(np.testing.assert_array_equal, found, made.scene.material)


def test_u_and_v_of_a_face_without_area_are_left_out_with_it():
    model = space_from_toml(FLAT).models[0]
    assert model.mesh.count == 1
    np.testing.assert_array_equal(model.uv, [[[0, 0], [1, 0], [0, 1]]])
    with pytest.raises(ValueError, match="three pairs for each of 2 faces, but is of 1"):
        space_from_toml(FLAT.replace("[[9, 9], [9, 9], [9, 9]], ", ""))


def test_rows_on_their_own_lines_are_no_headers():
    """The line and the table of what follows them, whatever brackets, quotes and comments say."""
    text = """dimensions = 3
[[shape]]
kind = "disc"
name = "a [ in # a name"   # [ and here
center = [0, 0, 0]
normal = [0, 0, 1]
radius = 1
[shape.texture]
kind = "picture"
values = [
  [0.5],   # [[
  [1],
  [0.25]
]
repeat = [0, 1]
"""
    with pytest.raises(ValueError, match=r"^scene, line 15, .* texture: `repeat` must be positive"):
        space_from_toml(text)
    with pytest.raises(ValueError, match=r"^scene, line 15, .* texture: `repeated` is not known"):
        space_from_toml(text.replace("repeat = [0, 1]", "repeated = 1"))
