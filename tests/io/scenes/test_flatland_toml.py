from typing import Any

import jax
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from firstorder.flatland import (
    Arcs,
    Circles,
    ConstantSky,
    Curves,
    Ellipses,
    GaussianSky,
    PanoramaSky,
    PointLights,
    Scene,
    Segments,
    primitive,
)
from firstorder.io import flatland_from_toml, flatland_to_toml, read_flatland, write_flatland
from firstorder.io.scenes import flatland_toml, space_toml
from tests.io.scenes.sentences import refuses_in_one_sentence

LAMP = """
[[shape]]
kind = "segment"
start = [0.5, 1]
end = [-0.5, 1.0]
name = "lamp"
emission = 1.0

[[shape]]
kind = "circle"
center = [0, 0.5]
radius = 0.1
albedo = [0.5, 0.25]

[[light]]
position = [0.0, 2.0]
intensity = 3.0

[environment]
kind = "gaussian"
sigma = 0.4
"""


def same(a: Scene, b: Scene):
    """Whether two scenes are alike to the bit."""
    one, other = (jax.tree.flatten(scene) for scene in (a, b))
    return one[1] == other[1] and all(
        np.array_equal(p, q) and np.array_equal(np.signbit(p), np.signbit(q))
        for p, q in zip(one[0], other[0], strict=True)
    )


def everything(seed=3, sky=None):
    """A scene of every kind of shape, material and light, with full mantissas."""
    draw = np.random.default_rng(seed)
    p = draw.uniform(-3.0, 3.0, (40, 2))
    u = draw.uniform(0.1, 0.9, 40)
    return Scene.of(
        primitive(Segments(p[:3], p[3:6]), name="sticks", emission=(u[0], u[1]), albedo=u[2]),
        primitive(Arcs(p[6:8], u[3:5], u[5:7], -u[7:9]), name="arcs", albedo=(u[9], u[10])),
        primitive(
            Circles(p[8], u[11]), name='say "hi"\\ \t\x7f ü', specular=u[12] / 2, exponent=9.1
        ),
        primitive(
            Ellipses(p[10:12], abs(p[12:14]) + 0.1, u[13:15]), ior=1.0 + u[15], emission=u[16]
        ),
        primitive(Curves(p[14:18], p[18:22], 32), name="blob", mirror=u[17]),
        primitive(Segments(p[22], -0.0 * p[23]), name="last", two_sided=True, emission=u[18]),
        points=PointLights(p[24:26], u[19:21]),
        environment=sky,
    )


SKIES = [
    None,
    ConstantSky(1 / 3),
    GaussianSky(0.1, 1 / 7, 2 / 3),
    PanoramaSky(np.arange(5) / 7, True),
]


@pytest.mark.smoke
@pytest.mark.parametrize("sky", SKIES, ids=lambda sky: type(sky).__name__)
def test_a_scene_comes_back_to_the_bit(tmp_path, sky):
    scene = everything(sky=sky)
    write_flatland(tmp_path / "scene.toml", scene)
    assert same(read_flatland(tmp_path / "scene.toml"), scene)
    # ... and the comparison sees the last bit of one number
    moved = everything(sky=sky).groups[0].start.at[1, 1].multiply(1 + 2**-52)
    other = jax.tree.map(lambda x: moved if x.shape == moved.shape else x, scene)
    assert not same(other, scene)


def test_what_a_hand_writes_is_what_it_means():
    scene = flatland_from_toml(LAMP)
    assert scene.names == ("lamp", "")
    np.testing.assert_array_equal(scene.groups[0].start, [[0.5, 1.0]])
    np.testing.assert_array_equal(scene.material.emission, [[1.0, 0.0], [0.0, 0.0]])
    np.testing.assert_array_equal(scene.material.albedo, [[0.0, 0.0], [0.5, 0.25]])
    np.testing.assert_array_equal(scene.points.intensity, [3.0])
    sky: Any = scene.environment
    assert sky(0.0) == 1.0
    assert sky(0.4) == pytest.approx(np.exp(-0.5), rel=1e-14)


def test_polylines_and_boxes_become_segments():
    scene = flatland_from_toml("""
        shape = [
          {kind = "polyline", points = [[0, 0], [1, 0], [1, 1]], closed = true, albedo = 0.3},
          {kind = "box", low = [2, 2], high = [3, 3], name = "box"},
          {kind = "segment", start = [5, 5], end = [6, 6], two_sided = true, emission = 2},
        ]""")
    assert scene.names == ("",) * 3 + ("box",) * 4 + ("",)
    np.testing.assert_array_equal(scene.groups[0].end[2], [0, 0])
    np.testing.assert_array_equal(scene.material.emission[-1], [2.0, 2.0])
    np.testing.assert_array_equal(scene.material.albedo[:4, 1], [0.3, 0.3, 0.3, 0.0])


def test_many_shapes_become_one_group_quickly():
    shape = '[[shape]]\nkind="circle"\ncenter=[{}, 0]\nradius=0.1\nname="{}"\n'
    scene = flatland_from_toml("".join(shape.format(i, "ab"[i > 50]) for i in range(100)))
    assert scene.groups[0].count == 100
    np.testing.assert_array_equal(scene.groups[0].center[:, 0], np.arange(100))


def with_line(key, value):
    """LAMP with another value, or with one more key at its end."""
    lines = LAMP.splitlines()
    at = [i for i, line in enumerate(lines) if line.startswith(f"{key} =")]
    if at:
        lines[at[0]] = f"{key} = {value}"
    else:
        lines.insert(len(lines) - 3, f"{key} = {value}")
    return "\n".join(lines)


FIRST, SECOND, SKY = 'shape 1 ("lamp")', "shape 2", "environment"
SENTENCES = [
    (with_line("radius", "-1"), 12, SECOND, "`radius` must be positive, but is -1.0."),
    (with_line("start", "[1]"), 4, FIRST, "`start` must be two numbers, but is [1]."),
    (
        with_line("start", "[nan, 1]"),
        4,
        FIRST,
        "`start` must be two finite numbers, but is [nan, 1].",
    ),
    (with_line("emission", "-2.0"), 7, FIRST, "`emission` must not be negative, but is -2.0."),
    (
        with_line("albedo", "0.5\nmirror = 0.75"),
        13,
        SECOND,
        "`albedo`, `mirror` and `specular` must add up to at most 1, but add up to 1.25.",
    ),
    (
        with_line("radius", "0.1\nradios = 2"),
        13,
        SECOND,
        "`radios` is not known here: did you mean `radius`?",
    ),
    (
        LAMP.replace("radius", "radios"),
        12,
        SECOND,
        "`radios` is not known here: did you mean `radius`?",
    ),
    (LAMP.replace("radius = 0.1", ""), 9, SECOND, "`radius` is missing."),
    (
        LAMP.replace('"circle"', '"circel"'),
        10,
        SECOND,
        'kind "circel" is not known: did you mean `circle`?',
    ),
    (LAMP.replace('"circle"', "7"), 10, SECOND, "`kind` must be text in quotes, but is 7."),
    (with_line("intensity", "-3"), 17, "light 1", "`intensity` must not be negative, but is -3.0."),
    (
        with_line("intensity", "true"),
        17,
        "light 1",
        "`intensity` must be a number, or one for each band, but is True.",
    ),
    (with_line("sigma", "0"), 21, SKY, "`sigma` must be positive, but is 0.0."),
    (
        LAMP.replace('"gaussian"', '"sunny"'),
        20,
        SKY,
        'kind "sunny" is not known: known are constant, gaussian, row.',
    ),
    ("shape = 3", 1, "", "`shape` must be written [[shape]], each with its own keys."),
    (
        'shape = [{kind = "segment", start = [0, 0], end = [1, 0]}, 3]',
        1,
        "",
        "`shape` must be written [[shape]], each with its own keys.",
    ),
    ("[shape]\na = 1", 1, "", "`shape` must be written [[shape]], each with its own keys."),
    ("\nshapes = 3", 2, "", "`shapes` is not known here: did you mean `shape`?"),
    ("environment = 3", 1, "", "`environment` must be written [environment], with its own keys."),
    ("", None, "", "a scene must have at least one shape, but there is none."),
    ("a = ", 1, "", "invalid value."),
    ('name = """\n[[shape]]\n"""\nshape = 3', 1, "", None),
    (b"# fine\n\xff", 2, "", "the text must be UTF-8, but is not."),
    ("a = " + "[" * 5000, None, "", "values are nested too deeply."),
    (
        '[[shape]]\nkind = "polyline"\npoints = [[0, 0]]',
        3,
        "shape 1",
        "`points` must have shape (n > 1, 2), but has (1, 2).",
    ),
    (
        '[[shape]]\nkind = "curve"\ncosines = [[0, 0]]\nsines = [[0, 0], [1, 1]]',
        4,
        "shape 1",
        "`sines` must have shape (1, 1, 2), but has (1, 2, 2).",
    ),
    (
        '[[shape]]\nkind = "curve"\ncosines = []\nsines = []',
        3,
        "shape 1",
        "`cosines` must be a list of pairs of numbers, but is [].",
    ),
    (
        '[[shape]]\nkind = "arc"\ncenter = [0, 0]\nradius = 1\nstart = 0\nsweep = 0',
        6,
        "shape 1",
        "`|sweep|` must be positive, but is 0.0.",
    ),
    (
        '[environment]\nkind = "row"\nvalues = [1, 2]',
        3,
        SKY,
        "`values` must be four or more numbers, but has (2,).",
    ),
]


@pytest.mark.parametrize(("text", "line", "what", "words"), SENTENCES, ids=range(len(SENTENCES)))
def test_a_bad_file_is_one_sentence_with_the_line_and_the_element(text, line, what, words):
    with pytest.raises(ValueError, match=r"scene\.toml") as caught:
        flatland_from_toml(text, "scene.toml")
    place = ", ".join(p for p in ("scene.toml", f"line {line}" if line else "", what) if p)
    assert str(caught.value).startswith(f"{place}: {words or ''}")
    assert words is None or str(caught.value).endswith(words)


def test_a_row_is_read_from_the_file_that_is_named_beside_the_scene(tmp_path):
    (tmp_path / "sky.hdr").write_bytes(
        b"#?RADIANCE\n\n-Y 1 +X 8\n" + bytes([128, 128, 128, 129, 0, 0, 0, 0] * 4)
    )
    file = tmp_path / "scene.toml"
    text = LAMP.replace('kind = "gaussian"\nsigma = 0.4', 'kind = "row"\nfile = "sky.hdr"\n')
    file.write_text(text)
    sky: Any = read_flatland(file).environment
    np.testing.assert_allclose(sky.values, [257 / 256, 0] * 4)
    file.write_text(text + "columns = 4\nsmooth = true")
    sky = read_flatland(file).environment
    np.testing.assert_allclose(sky.values, [257 / 512] * 4)
    assert sky.smooth
    for broken, sentence in (
        (text + "row = 1", "line 23, environment: sky.hdr: `row` must lie in [0, 0], but is 1."),
        (
            text + "columns = 9",
            "line 23, environment: sky.hdr: `columns` must lie in [4, 8], but is 9.",
        ),
        (text.replace("sky.hdr", "sky.gif"), "line 21, environment: sky.gif: a picture must be"),
        (
            text.replace("sky.hdr", "no.hdr"),
            f"line 21, environment: {tmp_path / 'no.hdr'}: the file cannot be opened",
        ),
    ):
        file.write_text(broken)
        with pytest.raises(ValueError, match=r"scene\.toml, line") as caught:
            read_flatland(file)
        assert str(caught.value).startswith(f"scene.toml, {sentence}")


def test_a_sky_without_a_name_cannot_be_written():
    scene = Scene.of(primitive(Circles((0.0, 0.0), 1.0)), environment=np.cos)
    with pytest.raises(ValueError, match="must have an environment that a file can name"):
        flatland_to_toml(scene)


@given(st.binary(max_size=200) | st.text(max_size=200).map(str.encode))
def test_random_bytes_never_crash_the_reader(source):
    refuses_in_one_sentence(flatland_from_toml, source)


VALUES = (
    '-1|0|1e400|nan|-inf|[]|[1]|[[1, 2], [3, 4]]|true|"x"|"row"|"arc"|1979-05-27|{a = 1}|1e-320|'
    + f"1e300|-0.0|0x{'f' * 5000}"
).split("|")
KEYS = [
    "start",
    "end",
    "center",
    "radius",
    "emission",
    "albedo",
    "position",
    "intensity",
    "sigma",
    "kind",
    "name",
]


@given(st.lists(st.tuples(st.sampled_from(KEYS), st.sampled_from(VALUES)), min_size=1, max_size=3))
def test_values_of_every_kind_never_crash_the_reader(changes):
    text = LAMP
    for key, value in changes:
        text = "\n".join(
            f"{key} = {value}" if line.startswith(f"{key} =") else line
            for line in text.splitlines()
        )
    refuses_in_one_sentence(flatland_from_toml, text)


SMALL = Scene.of(
    primitive(Circles((0.1, 0.0), 1.0), name="é"), environment=PanoramaSky(np.arange(6.0))
)


@given(st.data())
def test_mutilated_files_never_crash_the_reader(data):
    text = flatland_to_toml(SMALL).encode()
    at = data.draw(st.integers(0, len(text)))
    cut = data.draw(st.integers(0, 30))
    refuses_in_one_sentence(
        flatland_from_toml, text[:at] + data.draw(st.binary(max_size=8)) + text[at + cut :]
    )


CURVE = """
[[shape]]
kind = "curve"
cosines = {}
sines = {}
samples = {}
"""


@pytest.mark.parametrize("harmonics", [1, 2])
def test_curves_that_follow_each_other_may_have_other_samples_and_harmonics(harmonics):
    rows = np.array([[0.0, 0.0], [1.0, 0.0], [0.1, 0.0]])[: harmonics + 1]
    far = [[5.0, 0.0], [1.0, 0.0]], [[0.0, 0.0], [0.0, 1.0]]
    first, second = Curves(rows, rows[:, ::-1], samples=64), Curves(*far, samples=128)
    text = CURVE.format(rows.tolist(), rows[:, ::-1].tolist(), 64) + CURVE.format(*far, 128)
    (found,) = flatland_from_toml(text).groups
    (wanted,) = Scene.of(primitive(first), primitive(second)).groups
    assert found.samples == wanted.samples == 128
    np.testing.assert_array_equal(found.cosines, wanted.cosines)
    np.testing.assert_array_equal(found.sines, wanted.sines)


@pytest.mark.parametrize("samples", [1, 2, 4096])
def test_curves_of_few_and_of_many_samples_come_back(samples):
    ring = Curves([(0.0, 0.0), (0.0, 1.0)], [(0.0, 0.0), (1.0, 0.0)], samples)
    (found,) = flatland_from_toml(flatland_to_toml(Scene.of(primitive(ring)))).groups
    assert found.samples == samples


def test_curves_of_too_many_samples_are_not_written():
    ring = Curves([(0.0, 0.0), (0.0, 1.0)], [(0.0, 0.0), (1.0, 0.0)], 4097)
    with pytest.raises(ValueError, match="at most 4096 samples to be written, but one has 4097"):
        flatland_to_toml(Scene.of(primitive(ring)))


@pytest.mark.parametrize("kind", sorted({*space_toml._GEOMETRY} - {*flatland_toml._GEOMETRY}))
def test_a_shape_of_space_without_its_dimensions_is_told_to_state_them(kind):
    words = f'kind "{kind}" is one of space: a scene of space begins with `dimensions = 3`'
    with pytest.raises(ValueError, match=words):
        flatland_from_toml(f'[[shape]]\nkind = "{kind}"\ncenter = [0, 0, 1]\n')
