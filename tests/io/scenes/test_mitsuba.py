"""Scenes of Mitsuba 3 against scenes made by hand, and what no scene here can hold."""

import re

import equinox as eqx
import jax
import numpy as np
import pytest

from firstorder.imaging import SolidSlopes
from firstorder.imaging.camera import pinhole
from firstorder.io import (
    MapSet,
    MeshModel,
    SpaceFile,
    read_mitsuba,
    space_from_mitsuba,
    space_to_mitsuba,
    write_mitsuba,
)
from firstorder.space import (
    ConstantSky,
    Cylinders,
    Discs,
    Ellipsoids,
    GaussianSky,
    Receiver,
    Rectangles,
    Scene,
    box,
    cylinder,
    disc,
    ellipsoid,
    irradiance,
    plane,
    primitive,
    rectangle,
    sphere,
    triangle,
)
from firstorder.space.meshes.triangle_mesh import mesh

TURN = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
DOWN = {"type": "area", "radiance": {"type": "rgb", "value": [3.0, 3.0, 3.0]}}
GREY = {"type": "diffuse", "reflectance": {"type": "rgb", "value": [0.25, 0.25, 0.25]}}


def world(axes, center=(0.0, 0.0, 0.0)):
    found = np.eye(4)
    found[:3, :3], found[:3, 3] = axes, center
    return found


def lit_room():
    """Every kind of shape that both have, names that repeat, none, and one that looks numbered."""
    lamp = rectangle((0.1, 0.2, 2.0), (0.0, 0.3, 0.0), (0.4, 0.0, 0.0))
    return Scene.of(
        primitive(lamp, name="lamp", emission=3.0),
        primitive(disc((0.3, 0.1, 0.7), (0.1, 0.2, 1.0), 0.2), name="leaf", albedo=(0.5, 0.25)),
        primitive(box((-0.3, -0.2, 0.0), (0.1, 0.7, 0.3)), name="crate", albedo=0.3),
        primitive(sphere((0.6, 0.1, 0.31), 0.1), name="ball", albedo=(0.7, 0.0)),
        primitive(sphere((0.9, 0.3, 0.1), 0.07), name="ball"),
        primitive(sphere((1.9, 0.3, 0.1), 0.07), name="ball__3"),
        primitive(sphere((2.9, 0.3, 0.1), 0.07)),
        primitive(ellipsoid((0.0, 3.0, 0.0), 0.5 * TURN)),
        primitive(cylinder((1.0, 1.0, 0.0), (1.2, 1.1, 0.9), 0.15), name="pole", albedo=0.2),
        environment=0.125,
    )


def one(**keys):
    """A scene of one shape, and a receiver's place under it to be lit."""
    return {"type": "scene", "it": {"type": "rectangle", **keys}}


# --- what comes back -----------------------------------------------------------------------------


def test_a_scene_comes_back_to_the_bit_from_the_dict():
    scene = lit_room()
    assert eqx.tree_equal(space_from_mitsuba(space_to_mitsuba(scene)).scene, scene)


@pytest.mark.smoke
def test_a_scene_comes_back_to_the_bit_from_xml(tmp_path):
    scene = lit_room()
    write_mitsuba(tmp_path / "room.xml", scene)
    assert eqx.tree_equal(read_mitsuba(tmp_path / "room.xml").scene, scene)


XML = """<scene version="3.0.0">
    <default name="grey" value="0.25"/>
    <bsdf type="diffuse" id="paint"><rgb name="reflectance" value="$grey, $grey $grey"/></bsdf>
    <shape type="rectangle" id="lamp">
        <transform name="to_world">
            <lookat origin="1, 2, 3" target="1, 2, 0" up="1, 0, 0"/>
        </transform>
        <emitter type="area"><rgb name="radiance" value="3"/></emitter>
        <bsdf type="twosided">
            <bsdf type="diffuse"><rgb name="reflectance" value="0.25"/></bsdf>
        </bsdf>
    </shape>
    <shape type="sphere" id="ball">
        <point name="center" x="1" y="2" z="3"/>
        <float name="radius" value="0.5"/>
        <ref id="paint"/>
    </shape>
    <shape type="cube" id="crate">
        <transform name="to_world">
            <scale x="3" z="2"/>
            <rotate x="1" y="1" z="1" angle="120"/>
            <translate value="0.5, 0.25, 4"/>
        </transform>
    </shape>
    <shape type="disk" id="lid">
        <transform name="to_world">
            <matrix value="1 0 0 5  0 2 0 6  0 0 1 7  0 0 0 1"/>
        </transform>
        <boolean name="flip_normals" value="true"/>
    </shape>
    <shape type="obj" id="leaf">
        <string name="filename" value="one.obj"/>
        <boolean name="face_normals" value="true"/>
    </shape>
    <emitter type="constant"><spectrum name="radiance" value="400:0.5, 700:0.5"/></emitter>
</scene>
"""


def test_xml_and_dict_are_the_same_scene(tmp_path):
    (tmp_path / "one.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    (tmp_path / "scene.xml").write_text(XML)
    # A turn by 120 degrees about (1, 1, 1) sends x to y, y to z and z to x.
    turned = world([[0.0, 0.0, 2.0], [3.0, 0.0, 0.0], [0.0, 1.0, 0.0]], (0.5, 0.25, 4.0))
    # z looks down, y along `up`, and x is what is left.
    look = world([[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, -1.0]], (1.0, 2.0, 3.0))
    lid = world(np.diag([1.0, 2.0, 1.0]), (5.0, 6.0, 7.0))
    scene = {
        "type": "scene",
        "paint": GREY,
        "lamp": {"type": "rectangle", "to_world": look, "emitter": DOWN,
                 "bsdf": {"type": "twosided", "inner": GREY}},
        "ball": {"type": "sphere", "center": (1, 2, 3), "radius": 0.5,
                 "bsdf": {"type": "ref", "id": "paint"}},
        "crate": {"type": "cube", "to_world": turned},
        "lid": {"type": "disk", "to_world": lid, "flip_normals": True},
        "leaf": {"type": "obj", "filename": "one.obj", "face_normals": True},
        "sky": {"type": "constant", "radiance": {"type": "spectrum", "value": 0.5}},
    }  # fmt: skip
    one_way, other = read_mitsuba(tmp_path / "scene.xml"), space_from_mitsuba(scene, tmp_path)
    assert one_way.scene.names == ("ball", "crate", "lid", "lamp", "leaf")
    assert jax.tree.structure(one_way.scene) == jax.tree.structure(other.scene)
    leaves = (jax.tree.leaves(each.scene) for each in (one_way, other))
    for a, b in zip(*leaves, strict=True):
        np.testing.assert_allclose(a, b, rtol=0.0, atol=4 * np.finfo(float).eps)


def test_meshes_come_back_from_files_beside_the_scene(tmp_path):
    vertices = np.array([[0.0, 0.0, 1.0], [1.0 / 3.0, 0.1, 1.0], [0.2, np.pi, 1.5]])
    leaf = {"emission": [1.5, 0.0], "albedo": [0.5, 0.25], "specular": 0.0, "exponent": 0.0}
    space = SpaceFile((), (MeshModel(mesh(vertices, np.array([[0, 1, 2]])), "leaf", leaf),))
    write_mitsuba(tmp_path / "leaf.xml", space)
    again = read_mitsuba(tmp_path / "leaf.xml")
    np.testing.assert_array_equal(again.models[0].mesh.corners, space.models[0].mesh.corners)
    assert (again.models[0].name, again.models[0].material) == ("leaf", leaf)


def test_a_mesh_is_turned_and_then_moved(tmp_path):
    (tmp_path / "one.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    leaf = {"type": "obj", "filename": "one.obj", "to_world": world(TURN, (5.0, 0.0, 1.0))}
    found = space_from_mitsuba({"type": "scene", "leaf": leaf}, tmp_path).models[0].mesh
    corners = {tuple(p) for p in np.asarray(found.vertices).tolist()}
    # A quarter turn about z sends x to y, and y to -x.
    assert corners == {(5.0, 0.0, 1.0), (5.0, 1.0, 1.0), (4.0, 0.0, 1.0)}


# --- what it means -------------------------------------------------------------------------------


def test_a_scene_of_mitsuba_has_the_light_of_the_same_scene_by_hand():
    """A lamp of 3 W/(m^2 sr) that looks down, a ball before it and half a sky."""
    lamp = {"type": "rectangle", "emitter": DOWN,
            "to_world": world([[0.4, 0, 0], [0, -0.3, 0], [0, 0, -0.4]], (0, 0, 2))}  # fmt: skip
    ball = {"type": "sphere", "to_world": world(0.2 * TURN, (0.3, 0, 1)), "bsdf": GREY}
    sky = {"type": "constant", "radiance": 0.5}
    read = space_from_mitsuba({"type": "scene", "lamp": lamp, "ball": ball, "sky": sky}).scene
    hand = Scene.of(
        primitive(rectangle((0, 0, 2), (0.4, 0, 0), (0, -0.3, 0)), emission=3.0),
        primitive(sphere((0.3, 0, 1), 0.2)),
        environment=0.5,
    )
    at = Receiver.at((0.1, 0.05, 0.0))
    assert float(irradiance(read, at)) == pytest.approx(float(irradiance(hand, at)), rel=1e-12)
    assert float(irradiance(read, at)) > 0.5 * np.pi  # the lamp is seen: its front is below


def test_a_shape_without_a_bsdf_is_grey_in_front():
    assert space_from_mitsuba(one()).things[0].material.albedo.tolist() == [[0.5, 0.0]]


@pytest.mark.parametrize(
    ("bsdf", "albedo"),
    [
        (GREY, [0.25, 0.0]),
        ({"type": "twosided", "a": GREY}, [0.25, 0.25]),
        ({"type": "twosided", "a": GREY, "b": {"type": "diffuse"}}, [0.25, 0.5]),
        ({"type": "diffuse", "reflectance": 0.75}, [0.75, 0.0]),
        ({"type": "diffuse", "reflectance": {"type": "uniform", "value": 0.1}}, [0.1, 0.0]),
    ],
)
def test_what_a_diffuse_surface_reflects(bsdf, albedo):
    assert space_from_mitsuba(one(bsdf=bsdf)).things[0].material.albedo.tolist() == [albedo]


def test_a_transform_may_be_an_object_with_a_matrix():
    class Transform:
        matrix = world(np.diag([1.0, 2.0, 3.0]), (4.0, 5.0, 6.0))

    shape = space_from_mitsuba(one(to_world=Transform())).things[0].shape
    assert isinstance(shape, Rectangles)
    assert shape.center.tolist() == [[4.0, 5.0, 6.0]]
    # The third axis of a flat shape is its unit normal, whatever the map does along it.
    assert shape.axes.tolist() == [[[1.0, 0.0, 0.0], [0.0, 2.0, 0.0], [0.0, 0.0, 1.0]]]


def test_a_sphere_scaled_unevenly_is_an_ellipsoid():
    egg = {"type": "sphere", "center": [1, 1, 1], "radius": 2}
    egg["to_world"] = world(np.diag([1.0, 2.0, 3.0]), (0.0, 0.0, 0.5))
    shape = space_from_mitsuba({"type": "scene", "egg": egg}).things[0].shape
    assert isinstance(shape, Ellipsoids)
    assert shape.center[0].tolist() == [1.0, 2.0, 3.5]  # the centre is moved and scaled too
    assert shape.axes[0].tolist() == np.diag([2.0, 4.0, 6.0]).tolist()


def test_flipped_normals_turn_a_flat_shape_round():
    shape = space_from_mitsuba(one(flip_normals=True)).things[0].shape
    assert shape.axes[0, :, 2].tolist() == [0.0, 0.0, -1.0]


def test_a_tube_from_p0_to_p1_with_two_discs_is_a_cylinder():
    up = {"type": "disk", "to_world": world(np.diag([0.5, 0.5, 1.0]), (0, 0, 3))}
    down = {"type": "disk", "to_world": world(np.diag([0.5, -0.5, -1.0]), (0, 0, 1))}
    leaf = {"type": "disk"}
    tube = {"type": "cylinder", "p0": [0, 0, 1], "p1": [0, 0, 3], "radius": 0.5}
    space = space_from_mitsuba({"type": "scene", "a": up, "b": tube, "c": down, "d": leaf})
    assert [thing.name for thing in space.things] == ["b", "d"]
    assert isinstance(space.things[1].shape, Discs)
    by_hand = cylinder((0, 0, 1), (0, 0, 3), 0.5)
    found = space.things[0].shape
    assert (found.center - by_hand.center).tolist() == [[0.0, 0.0, 0.0]]
    np.testing.assert_allclose(
        found.axes[0] @ found.axes[0].T, by_hand.axes[0] @ by_hand.axes[0].T, rtol=0.0, atol=1e-15
    )


def test_a_tube_that_leans_has_its_ends_where_they_are_said_to_be():
    tube = {"type": "cylinder", "p0": [1, 0, 0], "p1": [2, 2, -1], "radius": 0.25}
    hand = cylinder((1, 0, 0), (2, 2, -1), 0.25)
    written = space_to_mitsuba(Scene.of(primitive(hand, albedo=(0.5, 0.0))))
    caps = {k: v for k, v in written.items() if isinstance(v, dict) and v["type"] == "disk"}
    shape = space_from_mitsuba({"type": "scene", **caps, "it": tube}).things[0].shape
    np.testing.assert_allclose(shape.center, hand.center, rtol=0.0, atol=1e-15)
    np.testing.assert_allclose(
        shape.axes[0] @ shape.axes[0].T, hand.axes[0] @ hand.axes[0].T, rtol=0.0, atol=1e-15
    )


# --- what is left out, and what is refused -------------------------------------------------------


def test_what_holds_no_light_is_left_out_with_a_warning_that_names_it():
    scene = one() | {"how": {"type": "path", "max_depth": 8}, "eye": {"type": "perspective"}}
    with pytest.warns(UserWarning, match=r"how \(path\), eye \(perspective\) left out"):
        assert len(space_from_mitsuba(scene).things) == 1


def test_a_camera_is_left_out_with_a_warning():
    space = SpaceFile((primitive(sphere((0, 0, 0), 1.0)),), camera=pinhole((4, 0, 0), (0, 0, 0)))
    with pytest.warns(UserWarning, match="Left out: the camera;"):
        space_to_mitsuba(space)


def test_a_constant_sky_is_a_number():
    ball = primitive(sphere((0, 0, 0), 1.0))
    made = space_to_mitsuba(Scene.of(ball, environment=ConstantSky(2.0)))
    assert space_from_mitsuba(made).sky == 2.0


def test_three_bands_are_rgb_and_come_back_to_the_bit(tmp_path):
    """A warm lamp, a wall that is red on one side, a sky, and a ball of one band."""
    wall = rectangle((-1.0, 0.0, 1.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
    scene = Scene.of(
        primitive(sphere((0.0, 0.0, 2.0), 0.5), name="lamp", emission=[(1.2, 1.0, 0.8), (0,) * 3]),
        primitive(wall, name="wall", albedo=[(0.8, 0.1, 0.1), (0.2, 0.3, 0.4)]),
        primitive(sphere((0.5, 0.0, 0.5), 0.2), name="ball", albedo=(0.3, 0.0)),
        environment=(0.1, 0.2, 0.3),
    )
    made = space_to_mitsuba(scene)
    assert made["lamp"]["emitter"]["radiance"] == {"type": "rgb", "value": [1.2, 1.0, 0.8]}
    assert made["ball"]["bsdf"]["reflectance"] == {"type": "rgb", "value": [0.3, 0.3, 0.3]}
    write_mitsuba(tmp_path / "a.xml", scene)
    for again in (space_from_mitsuba(made), read_mitsuba(tmp_path / "a.xml")):
        assert again.scene.bands == 3
        assert eqx.tree_equal(again.scene, scene)


def test_four_bands_are_not_those_of_mitsuba():
    sides = [(0.1, 0.2, 0.3, 0.4), (0.0,) * 4]
    with pytest.raises(ValueError, match="Mitsuba has three bands, but here are 4"):
        space_to_mitsuba(Scene.of(primitive(sphere((0, 0, 0), 1.0), albedo=sides)))


TUBE = {"type": "cylinder", "p0": [0, 0, -1]}
LID = {"type": "disk", "to_world": world(np.eye(3), (0, 0, 1))}
FOOT = {"type": "disk", "to_world": world(np.diag([1.0, -1.0, -1.0]), (0, 0, -1))}
BENT = {"type": "diffuse", "reflectance": {"type": "spectrum", "value": [(400, 0.1), (700, 0.2)]}}


@pytest.mark.parametrize(
    ("scene", "sentence"),
    [
        ({}, 'scene: a scene of Mitsuba must say `"type": "scene"`.'),
        ({"type": "scene"}, "scene: a scene must have at least one shape, but there is none."),
        ({"type": "scene", "it": 3}, "an element of a scene must be a dict with a `type`."),
        ({"type": "scene", "it": {"type": "shapegroup"}}, 'the type "shapegroup" is not known'),
        ({"type": "scene", "it": {"type": "point"}}, 'the type "point" is not known here'),
        ({"type": "scene", "it": {"type": "envmap"}}, 'the type "envmap" is not known here'),
        (one(radius=2.0), "`radius` is not known here"),
        (one(interior={"type": "homogeneous"}), '`interior` of type "homogeneous" is not known'),
        (one(bsdf={"type": "roughconductor"}), '`bsdf` of type "roughconductor" is not known'),
        (one(bsdf={"type": "ref", "id": "paint"}), "`bsdf` must name a diffuse or twosided BSDF"),
        (one(a=GREY, b=GREY), "a shape has one BSDF, but there are two."),
        (one(bsdf=BENT), "`reflectance` must be the same at all wavelengths, or rgb"),
        (one(bsdf={"type": "diffuse", "reflectance": {"type": "bitmap"}}), 'but is "bitmap".'),
        (one(bsdf={"type": "diffuse", "reflectance": "red"}), "`reflectance` must be a number in"),
        (one(bsdf={"type": "diffuse", "reflectance": 1.5}), "must add up to at most 1"),
        (one(bsdf={"type": "twosided", "a": BENT | {"type": "plastic"}}), "must hold one diffuse"),
        (one(bsdf={"type": "diffuse", "nested": 1.0}), "`nested` is not known here"),
        (one(to_world=np.diag([-1.0, 1, 1, 1])), "a map that has an inverse and does not mirror"),
        (one(to_world=np.zeros((4, 4))), "the last row 0 0 0 1"),
        (one(to_world="left"), "`to_world` must be a 4 x 4 matrix of numbers"),
        ({"type": "scene", "it": {"type": "sphere", "radius": -1.0}}, "`radius` must be positive"),
        ({"type": "scene", "it": {"type": "cube", "flip_normals": True}}, "`flip_normals` must be"),
        ({"type": "scene", "it": {"type": "cylinder"}}, "a cylinder is a tube in Mitsuba"),
        ({"type": "scene", "it": TUBE, "a": LID, "b": FOOT | {"bsdf": GREY}}, "a cylinder is a"),
        ({"type": "scene", "it": {"type": "cylinder", "p1": [0, 0, 0]}}, "`p1` must not be `p0`"),
        (one() | {"a": {"type": "constant"}, "b": {"type": "constant"}}, "one constant emitter at"),
        ({"type": "scene", "it": {"type": "ply"}}, "`filename` is missing."),
    ],
)
def test_what_has_no_counterpart_is_refused_in_one_sentence(scene, sentence):
    with pytest.raises(ValueError, match=re.escape(sentence)) as refusal:
        space_from_mitsuba(scene)
    said = str(refusal.value)
    assert (said[:5], said[-1], said.count("\n")) == ("scene", ".", 0)


def test_meshes_with_normals_or_turned_inside_out_are_refused(tmp_path):
    text = "v 0 0 0\nv 1 0 0\nv 0 1 0\nvn 0 0 1\nf 1//1 2//1 3//1\n"
    (tmp_path / "one.obj").write_text(text)
    leaf = {"type": "obj", "filename": "one.obj"}
    with pytest.raises(ValueError, match=r"`face_normals` must be true, as one\.obj has normals"):
        space_from_mitsuba({"type": "scene", "leaf": leaf}, tmp_path)
    leaf |= {"face_normals": True}
    assert space_from_mitsuba({"type": "scene", "leaf": leaf}, tmp_path).models[0].name == "leaf"
    with pytest.raises(ValueError, match="`flip_normals` must be false for a mesh"):
        space_from_mitsuba({"type": "scene", "leaf": leaf | {"flip_normals": True}}, tmp_path)


BALL = sphere((0, 0, 0), 1.0)


@pytest.mark.parametrize(
    ("space", "sentence"),
    [
        (Scene.of(primitive(plane((0, 0, 0), (0, 0, 1)), name="floor")), 'shape "floor": Mitsuba'),
        (Scene.of(primitive(triangle((0, 0, 0), (1, 0, 0), (0, 1, 0)))), "no shape for triangles"),
        (Scene.of(primitive(ellipsoid((0, 0, 0), np.diag([1.0, 2, 3])))), "and no ellipsoids"),
        (Scene.of(primitive(ellipsoid((0, 0, 0), -np.eye(3)))), "`axes` must be right-handed"),
        (Scene.of(primitive(BALL, emission=1.0, two_sided=True)), "from the front alone"),
        (Scene.of(primitive(BALL, specular=0.5, exponent=9.0)), "glossy lobes are not written"),
        (Scene.of(primitive(BALL, name="a.b")), 'no name with a dot in it, such as "a.b"'),
        (Scene.of(primitive(BALL), environment=GaussianSky((0, 0, 1), 0.5)), "has GaussianSky."),
        (
            SpaceFile((primitive(BALL),), coats=(MapSet(normal_map=SolidSlopes((0.5, 0, 0))),)),
            "Surface maps",
        ),
    ],
)
def test_what_mitsuba_lacks_is_refused_in_one_sentence(space, sentence):
    with pytest.raises(ValueError, match=re.escape(sentence)):
        space_to_mitsuba(space)


def test_a_leaning_or_flat_cylinder_and_a_mesh_without_a_folder_are_refused():
    axes = np.array([[1.0, 0.0, 0.5], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])
    for wrong in (axes, np.diag([1.0, 2.0, 1.0])):
        with pytest.raises(ValueError, match="round upright cylinders alone"):
            space_to_mitsuba(Scene.of(primitive(Cylinders((0, 0, 0), wrong))))
    model = MeshModel(mesh(np.eye(3), np.array([[0, 1, 2]])), "leaf", {})
    with pytest.raises(ValueError, match="`folder` must be given"):
        space_to_mitsuba(SpaceFile((), (model,)))


@pytest.mark.parametrize(
    ("name", "held"), [("a\0", r"'\x00'"), ("\x1b[", r"'\x1b'"), ("$a", "'$a'")]
)
def test_names_that_xml_would_not_give_back_are_refused(tmp_path, name, held):
    """Control characters are no XML, and a dollar asks for a <default>."""
    with pytest.raises(ValueError, match=re.escape(f"takes no name with {held} in it.")):
        write_mitsuba(tmp_path / "a.xml", Scene.of(primitive(BALL, name=name)))
    assert not list(tmp_path.iterdir())
    held = "é <&>\"' \n\t\r\u2028\x85 5$ $"
    write_mitsuba(tmp_path / "a.xml", Scene.of(primitive(BALL, name=held)))
    assert read_mitsuba(tmp_path / "a.xml").things[0].name == held


@pytest.mark.parametrize(
    ("inside", "sentence"),
    [
        ('<bsdf type="diffuse" id="a"/><bsdf type="diffuse" id="a"/>', 'the id "a" stands twice'),
        ("<include/>", "<include>: the element is not known here."),
        ('<shape type="$kind"/>', "`$kind` has no <default>."),
        ("<shape/>", "<shape>: `type` is missing."),
        ('<shape type="sphere"><float name="radius" value="x"/></shape>', '"x" must be numbers.'),
        ('<shape type="sphere"><float name="radius" value="1 2"/></shape>', "must be one number"),
        ('<shape type="sphere"><point name="center" value="1 2"/></shape>', "be three numbers"),
        ('<shape type="sphere"><boolean name="a" value="1"/></shape>', "must be true or false"),
        ('<shape type="sphere"><ref id="a"/><animation/></shape>', "<animation>: the element"),
        ('<shape type="sphere"><ref name="a" id="a"/><ref name="a" id="a"/></shape>', "`a` stands"),
    ],
)  # fmt: skip
def test_wrong_xml_is_refused_with_its_line(tmp_path, inside, sentence):
    (tmp_path / "a.xml").write_text(f"<scene>\n{inside}\n</scene>")
    with pytest.raises(ValueError, match=re.escape(sentence)) as refusal:
        read_mitsuba(tmp_path / "a.xml")
    assert str(refusal.value).startswith("a.xml, line 2")


@pytest.mark.parametrize(
    ("step", "sentence"),
    [
        ('<rotate angle="9"/>', "the axis must have a length"),
        ('<matrix value="1 2 3"/>', "must be 16 numbers, but is 3"),
        ('<lookat origin="0 0 0" target="0 0 1" up="0 0 2"/>', "`up` must not be along the view"),
        ('<lookat origin="0 0" target="0 0 1" up="0 0 2"/>', "must be three numbers each"),
        ("<shear/>", "<shear>: the element is not known here."),
    ],
)
def test_wrong_transforms_are_refused_with_their_line(tmp_path, step, sentence):
    inside = f'<shape type="cube">\n<transform name="to_world">{step}</transform></shape>'
    (tmp_path / "a.xml").write_text(f"<scene>{inside}</scene>")
    with pytest.raises(ValueError, match=re.escape(sentence)) as refusal:
        read_mitsuba(tmp_path / "a.xml")
    assert str(refusal.value).startswith("a.xml, line 2, <")


def test_a_file_that_is_not_there_or_is_no_scene_is_refused(tmp_path):
    with pytest.raises(FileNotFoundError, match=r"none.xml: the file cannot be opened"):
        read_mitsuba(tmp_path / "none.xml")
    (tmp_path / "a.xml").write_text("<svg/>")
    with pytest.raises(ValueError, match=r"a.xml, line 1: a scene of Mitsuba must be a <scene>"):
        read_mitsuba(tmp_path / "a.xml")
