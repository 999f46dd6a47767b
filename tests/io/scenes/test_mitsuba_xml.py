"""Mitsuba's XML: what elements say, maps by hand and by SciPy, and what is written comes back."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from firstorder.io.scenes import _mitsuba_xml as xml
from firstorder.io.scenes._mitsuba_xml import dict_of_xml, xml_of_dict


def read(inside):
    return dict_of_xml(f"<scene>\n{inside}\n</scene>".encode(), "f")


def shape(inside):
    """What is read of the elements in a shape."""
    scene, _ = read(f'<shape type="cube" id="a">{inside}</shape>')
    return {k: v for k, v in scene["a"].items() if k not in ("type", "id")}


def placed(steps):
    return shape(f'<transform name="t">{steps}</transform>')["t"]


# --- objects -------------------------------------------------------------------------------------


def test_objects_have_their_ids_or_numbers_and_their_lines():
    scene, lines = read('<bsdf type="b"/>\n<shape type="s" id="x">\n<bsdf type="i"/></shape>')
    assert scene == {
        "type": "scene",
        "__1": {"type": "b"},
        "x": {"type": "s", "id": "x", "bsdf__2": {"type": "i"}},
    }
    assert lines == {"__1": 2, "x": 3}


@pytest.mark.parametrize(
    ("inside", "value"),
    [
        ('<float name="k" value=" 2.5 "/>', 2.5),
        ('<integer name="k" value="3"/>', 3.0),
        ('<boolean name="k" value="true"/>', True),
        ('<boolean name="k" value="false"/>', False),
        ('<string name="k" value="a b"/>', "a b"),
        ('<point name="k" value="1, 2 3"/>', [1.0, 2.0, 3.0]),
        ('<vector name="k" value="4"/>', [4.0, 4.0, 4.0]),
        ('<point name="k" y="2"/>', [0.0, 2.0, 0.0]),
        ('<rgb name="k" value="1 2 3"/>', {"type": "rgb", "value": [1.0, 2.0, 3.0]}),
        ('<spectrum name="k" value="400:1, 700 : 2"/>', {"type": "spectrum", "value": [1.0, 2.0]}),
        ('<ref name="k" id="a"/>', {"type": "ref", "id": "a"}),
    ],
)
def test_values_are_those_of_their_elements(inside, value):
    assert shape(inside) == {"k": value}


def test_defaults_fill_in_what_follows_them():
    source = '<default name="a" value="2"/><default name="b" value="$a.5"/>'
    scene, _ = read(source + '<shape type="s" id="x"><float name="k" value="$b"/></shape>')
    assert scene["x"]["k"] == 2.5
    with pytest.raises(ValueError, match=r"f, line 2: `\$a` has no <default>"):
        read('<shape type="$a"/><default name="a" value="2"/>')


def test_defaults_in_defaults_may_not_fill_a_memory(monkeypatch):
    monkeypatch.setattr(xml, "MOST_FILLED", 12)
    defaults = '<default name="a" value="12345"/>'
    scene, _ = read(defaults + '<shape type="a $a b" id="13 letters..."/>')  # six letters and five
    assert scene["13 letters..."]["type"] == "a 12345 b"
    with pytest.raises(ValueError, match="`type` must have at most 12 letters with every"):
        read(defaults + '<shape type="$a$a"/>')  # four letters and twice five


@pytest.mark.parametrize(
    ("inside", "sentence"),
    [
        ('<float name="k" value="1 2"/>', "f, line 2, <float>: `value` must be one number."),
        ('<float name="k" value="x"/>', 'f, line 2, <float>: "x" must be numbers.'),
        ('<point name="k" value="1 2"/>', "<point>: `value` must be three numbers, but is 2."),
        ('<boolean name="k" value="1"/>', '`value` must be true or false, but is "1".'),
        ('<float name="k"/>', "f, line 2, <float>: `value` is missing."),
        ('<float name="k" value="1"/>\n<float name="k" value="1"/>',
         "f, line 3, <float>: `k` stands twice."),
        ("<other/>", "f, line 2, <other>: the element is not known here."),
        ('<transform name="t">\n<shear/></transform>',
         "f, line 3, <shear>: the element is not known here."),
        ('<transform name="t"><rotate angle="9"/></transform>', "must have a length, but has none"),
        ('<transform name="t"><matrix value="1 2"/></transform>', "must be 16 numbers, but is 2."),
        ('<transform name="t"><lookat origin="0 0" target="0 0 1" up="0 1 0"/></transform>',
         "must be three numbers each."),
        ('<transform name="t"><lookat origin="0 0 1" target="0 0 3" up="0 0 1"/></transform>',
         "`up` must not be along the view, but is."),
    ],
)  # fmt: skip
def test_what_is_wrong_in_an_object_is_told_with_its_line(inside, sentence):
    with pytest.raises(ValueError, match="f, line") as caught:
        shape(inside)
    assert sentence in str(caught.value)


# --- maps ----------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("step", "diagonal", "shift"),
    [
        ('<scale value="2"/>', [2, 2, 2], [0, 0, 0]),
        ('<scale x="3" z="2"/>', [3, 1, 2], [0, 0, 0]),
        ('<translate y="5"/>', [1, 1, 1], [0, 5, 0]),
        ('<translate value="1 2 3"/><scale x="2"/>', [2, 1, 1], [2, 2, 3]),
        ('<scale x="2"/><translate value="1 2 3"/>', [2, 1, 1], [1, 2, 3]),
        ('<matrix value="1 0 0 5  0 2 0 6  0 0 1 7  0 0 0 1"/>', [1, 2, 1], [5, 6, 7]),
    ],
)
def test_steps_act_in_their_order(step, diagonal, shift):
    expected = np.diag([*diagonal, 1.0])
    expected[:3, 3] = shift
    np.testing.assert_array_equal(placed(step), expected)


@pytest.mark.parametrize("axis", [(1.0, 0.0, 0.0), (0.0, -2.0, 0.0), (0.3, -1.2, 2.0)])
@pytest.mark.parametrize("angle", [30.0, -110.0])
def test_a_turn_is_that_of_scipy(axis, angle):
    x, y, z = axis
    found = placed(f'<rotate x="{x}" y="{y}" z="{z}" angle="{angle}"/>')
    unit = np.array(axis) / np.linalg.norm(axis)
    expected = np.eye(4)
    expected[:3, :3] = Rotation.from_rotvec(np.radians(angle) * unit).as_matrix()
    np.testing.assert_allclose(found, expected, rtol=0.0, atol=1e-15)


def test_a_frame_looks_at_its_target_with_up_upward():
    found = placed('<lookat origin="1 2 3" target="3 1 5" up="0.1 1 0.2"/>')
    left, up, ahead, at = found[:3].T
    np.testing.assert_array_equal(at, [1.0, 2.0, 3.0])
    np.testing.assert_array_equal(found[3], [0.0, 0.0, 0.0, 1.0])
    np.testing.assert_allclose(ahead, np.array([2.0, -1.0, 2.0]) / 3.0, rtol=1e-15)
    np.testing.assert_allclose(found[:3, :3].T @ found[:3, :3], np.eye(3), rtol=0.0, atol=1e-15)
    assert np.linalg.det(found[:3, :3]) > 0.0
    assert up @ [0.1, 1.0, 0.2] > 0.0
    assert left @ [0.1, 1.0, 0.2] == pytest.approx(0.0, abs=1e-15)


# --- writing -------------------------------------------------------------------------------------


def test_what_is_written_comes_back_to_the_bit():
    world = np.random.default_rng(0).normal(size=(4, 4))
    light = {"type": "area", "radiance": {"type": "rgb", "value": [0.1, 1 / 3, 2e-300]}}
    scene = {
        "type": "scene",
        'a"<b': {"type": "cube", "to_world": world, "flip": False, "emitter": light},
        "c": {"type": "ball", "center": [0.1, 0.2, 0.3], "radius": 1 / 3, "filename": "a & b"},
    }
    tags = {"cube": "shape", "ball": "shape", "area": "emitter"}
    text = xml_of_dict(scene, tags)
    found, lines = dict_of_xml(text.encode(), "f")
    assert lines == {'a"<b': 2, "c": 11}
    np.testing.assert_array_equal(found['a"<b'].pop("to_world"), world)
    scene['a"<b'].pop("to_world")
    emitter = found['a"<b'].pop("emitter__4")
    assert emitter == scene['a"<b'].pop("emitter")
    for key in ('a"<b', "c"):
        assert found[key] == {"id": key, **scene[key]}
    assert text.startswith('<scene version="3.0.0">\n    <shape type="cube"')
    assert text.endswith("    </shape>\n</scene>\n")
