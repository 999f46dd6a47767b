import functools
import io as memory
import re
import sys
from typing import Any

import jax
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial import KDTree

from firstorder.flatland import Arcs, Circles, Curves, Ellipses, Scene, Segments
from firstorder.io import flatland_from_toml, flatland_to_toml, read_svg
from firstorder.io.svg import _paths as paths
from firstorder.io.svg import reader as svg_module
from firstorder.io.svg._materials import albedo_of
from firstorder.io.svg._shapes import affine, floats, length, subpaths
from firstorder.io.svg._xml import tree
from firstorder.io.svg.reader import _scene_from_svg
from tests.io.scenes.sentences import refuses_in_one_sentence


def svg(inside: str, root: str = "") -> Scene:
    return _scene_from_svg(f"<svg {root}>{inside}</svg>", "d.svg")


def group(scene: Scene, kind: type) -> Any:
    (found,) = [g for g in scene.groups if isinstance(g, kind)]
    return found


def ends(scene: Scene) -> np.ndarray:
    """Starts and ends (n, 2, 2) of the segments."""
    found = group(scene, Segments)
    return np.stack([found.start, found.end], 1)


def area(p: np.ndarray) -> float:
    """Of a closed polyline given by its starts: positive if counter-clockwise."""
    q = np.roll(p, -1, 0)
    return float(0.5 * np.sum(p[:, 0] * q[:, 1] - p[:, 1] * q[:, 0]))


# --- geometry ------------------------------------------------------------------------------------

CLOSED = {
    "rect": '<rect x="1" y="1" width="2" height="1"/>',
    "polygon": '<polygon points="1,1 3,1 3,2 1,2"/>',
    "polygon, the other way": '<polygon points="1,1 1,2 3,2 3,1"/>',
    "path": '<path d="M1 1h2v1h-2z"/>',
    "path without z": '<path d="M1 1h2v1h-2v-1"/>',
    "open, but filled": '<path d="M1 1h2v1h-2" fill="black"/>',
    "polyline": '<polyline points="1 1 1 2 3 2 3 1 1 1"/>',
}


@pytest.mark.smoke
@pytest.mark.parametrize("name", CLOSED)
def test_closed_shapes_are_upright_and_face_outward_or_inward(name):
    for css, sign in (("", -1.0), ("inward", 1.0)):
        scene = svg(f'<g class="{css}">{CLOSED[name]}</g>', 'viewBox="0 0 10 4"')
        found = ends(scene)
        np.testing.assert_allclose(area(found[:, 0]), 2.0 * sign)
        np.testing.assert_array_equal(found[:, 1], np.roll(found[:, 0], -1, 0))
        corners = {tuple(p) for p in found[:, 0].tolist()}
        assert corners == {(1.0, 2.0), (3.0, 2.0), (3.0, 3.0), (1.0, 3.0)}


def test_an_open_line_keeps_the_pen_s_travel_and_so_its_side():
    found = ends(svg('<path stroke="red" d="M 0 0 L 2 0"/><line x1="2" x2="0" stroke="red"/>'))
    np.testing.assert_array_equal(found, [[[0, 0], [2, 0]], [[2, 0], [0, 0]]])
    kept = ends(svg('<path class="drawn" d="M1 1h2v1h-2z"/>'))  # clockwise on the page
    assert area(kept[:, 0]) < 0
    assert area(ends(svg('<path class="drawn" d="M1 1v1h2v-1z"/>'))[:, 0]) > 0


@pytest.mark.parametrize(
    ("root", "y"),
    [
        ("", -1.0),
        ('height="5"', 4.0),
        ('height="100%"', -1.0),
        ('width="10mm" height="20mm" viewBox="0 0 10 20"', 19.0),
        ('viewBox="-3 -2 6 4"', -1.0),
        ('viewBox="0 2 6 4"', 7.0),
        ('viewBox="0,2,6,4" data-scale="0.5"', 3.5),
    ],
)
def test_the_page_is_turned_within_its_view_box(root, y):
    scale = 0.5 if "scale" in root else 1.0
    scene = svg('<circle cx="2" cy="1" r="1"/>', root)
    np.testing.assert_allclose(group(scene, Circles).center, [[2.0 * scale, y]])
    np.testing.assert_allclose(group(scene, Circles).radius, [scale])


def test_circles_and_ellipses_stay_what_they_are():
    scene = svg(
        '<g transform="translate(1 2) rotate(-30) scale(2)"><circle id="o" r="1"/>'
        '<ellipse id="e" rx="3" ry="1"/></g><ellipse id="f" rx="2" ry="2"/>'
        '<circle id="s" r="1" transform="scale(2 1)"/>'
    )
    assert scene.names == ("o", "f", "e", "s")
    round_ones, ovals = group(scene, Circles), group(scene, Ellipses)
    np.testing.assert_allclose(round_ones.center, [[1, -2], [0, 0]])
    np.testing.assert_allclose(round_ones.radius, [2, 2])
    np.testing.assert_allclose(ovals.semi, [[6, 2], [2, 1]])
    # -30 degrees on the page, whose y points down, is counter-clockwise
    np.testing.assert_allclose(np.mod(ovals.tilt[0], np.pi), np.pi / 6)
    np.testing.assert_allclose(np.mod(ovals.tilt[1] + 1, np.pi), 1.0)


def test_round_rooms_have_their_normals_inward():
    scene = svg('<g class="inward"><circle cx="1" cy="-2" r="2"/><ellipse rx="3" ry="1"/></g>')
    for index, center in enumerate([(1.0, 2.0), (0.0, 0.0)]):
        for s in (0.1, 0.6):
            frame = scene.frame(index, s)
            assert np.dot(frame.normal, np.asarray(center) - frame.position) > 0
    assert isinstance(scene.groups[0], Arcs)
    curve = group(scene, Curves)
    s = np.linspace(0, 1, 9)[:, None] * 2 * np.pi
    middle, right, up = (np.asarray(a) for a in (*curve.cosines[0], curve.sines[0, 1]))
    points = middle + np.cos(s) * right + np.sin(s) * up
    np.testing.assert_allclose(np.sum((points / [3, 1]) ** 2, 1), 1.0, rtol=1e-12)


def test_arcs_of_circles_are_arcs_even_when_they_are_turned_and_mirrored():
    for transform in ("", "rotate(20)", "scale(-2 2)", "matrix(0 1 1 0 3 4)"):
        scene = svg(f'<path stroke="red" transform="{transform}" d="M 0 0 A 2 2 0 0 1 2 2"/>')
        frames = [scene.frame(0, s) for s in (0.0, 0.5, 1.0)]
        m = affine(transform)
        expected = np.array([[0, 0], [np.sqrt(2), 2 - np.sqrt(2)], [2, 2]]) @ m[:, :2].T + m[:, 2]
        found = np.array([f.position for f in frames])
        np.testing.assert_allclose(found, expected * [1, -1], rtol=0.0, atol=1e-12)
        assert isinstance(scene.groups[0], Arcs)


def test_a_drawing_within_a_drawing_is_moved_to_its_place():
    scene = svg('<svg x="10" y="20"><svg x="1"><circle r="1"/></svg></svg>')
    np.testing.assert_allclose(group(scene, Circles).center, [[11.0, -20.0]])


@pytest.mark.parametrize(
    ("d", "control"),
    [
        ("M0 0Q1 1 2 0S4 1 5 0", [[2, 0], [2, 0], [4, 1], [5, 0]]),
        ("M0 0Q1 1 2 0t2 0s2 1 3 0", [[4, 0], [4, 0], [6, 1], [7, 0]]),
        ("M0 0C1 1 2 1 3 0T5 0", [[3, 0], [3, 0], [5, 0]]),
        ("M0 0C1 1 2 1 3 0S5 1 6 0", [[3, 0], [4, -1], [5, 1], [6, 0]]),
        ("M0 0Q1 1 2 0T4 0", [[2, 0], [3, -1], [4, 0]]),
    ],
)
def test_only_a_curve_of_the_same_degree_is_gone_on_from_smoothly(d, control):
    (path,) = subpaths("path", {"d": d})
    np.testing.assert_array_equal(path.pieces[-1].control, control)


def test_exponents_of_numbers_in_paths_may_be_capitals():
    found = ends(svg('<path stroke="red" d="M1E0 2L3.0E-1-4e+0"/>'))
    np.testing.assert_allclose(found, [[[1, -2], [0.3, 4]]])


def test_a_rounded_rectangle_is_lines_and_arcs_around_its_area():
    scene = svg('<rect x="1" y="1" width="4" height="3" rx="1"/>')
    assert [g.count for g in scene.groups] == [4, 4]
    lengths = [float(scene.length(i)) for i in range(8)]
    np.testing.assert_allclose(sorted(lengths), [1, 1] + [np.pi / 2] * 4 + [2, 2], rtol=1e-12)
    np.testing.assert_allclose(group(scene, Arcs).sweep, [-np.pi / 2] * 4)


@pytest.mark.parametrize("tolerance", [1e-2, 1e-4])
@pytest.mark.parametrize("d", ["M0 0C2 3 3 -3 4 1", "M0 0Q2 3 4 0t2 2", "M0 0A 3 1 20 1 0 2 2"])
def test_curves_are_flattened_within_the_tolerance(d, tolerance):
    from svgelements import Path

    source = f'<svg><path stroke="red" d="{d}"/></svg>'
    found = ends(_scene_from_svg(source, tolerance=tolerance))
    exact = np.asarray(Path(d).npoint(np.linspace(0, 1, 4001))) * [1, -1]
    start, edge = found[:, 0], found[:, 1] - found[:, 0]
    t = np.einsum("pnk,nk->pn", exact[:, None] - start, edge) / np.sum(edge**2, 1)
    foot = start + np.clip(t, 0, 1)[..., None] * edge
    distance = np.linalg.norm(exact[:, None] - foot, axis=-1).min(1)
    assert distance.max() <= tolerance
    assert distance.max() > 1e-3 * tolerance  # and not by far too many chords


def test_groups_uses_and_transforms_add_up():
    scene = svg(
        '<defs><g id="pair"><circle r="1"/><circle cx="5" r="1"/></g></defs>'
        '<g transform="translate(10)"><use href="#pair" x="1" y="2" transform="scale(2)"/></g>'
        '<use xlink:href="#pair" xmlns:xlink="http://www.w3.org/1999/xlink"/>'
    )
    found = group(scene, Circles)
    np.testing.assert_allclose(found.center, [[12, -4], [22, -4], [0, 0], [5, 0]])
    np.testing.assert_allclose(found.radius, [2, 2, 1, 1])
    assert scene.names == ("pair",) * 4


# --- against svgelements' own reading of the whole document --------------------------------------

# Everything that has a place: nested transforms, a skew, a mirror image, arcs of all kinds.
BUSY = """<svg width="60" height="40" viewBox="0 0 60 40">
  <g transform="translate(8 6) rotate(20)">
    <rect width="9" height="5" rx="1.5"/> <ellipse cx="16" cy="4" rx="4" ry="1.5"/>
    <g transform="skewX(15) scale(1 -1.5)"><polygon points="24,-4 27,-4 26,-7"/></g>
  </g>
  <path stroke="red"
    d="M5 25 c 4-9 8 9 12 0 q 3-6 6 0 t 6 0 a 4 4 30 0 1 5 3 A 6 3 20 1 0 40 30 z"/>
  <g transform="matrix(0.5 0 0 0.5 40 10)"><polyline stroke="red" points="0,0 5,9 10,0 15,9"/>
    <path stroke="red" transform="scale(-1 1)" d="M-30 30 h 8 v 6 a 4 4 0 1 1 -8 0 z"/></g>
</svg>"""


@functools.cache
def theirs():
    """Where svgelements has the drawing, with y upward."""
    from svgelements import SVG, Path, Shape

    t = np.linspace(0, 1, 4000)
    elements = SVG.parse(memory.StringIO(BUSY), reify=True).elements()
    points = [Path(e).reify().npoint(t) for e in elements if isinstance(e, Shape)]
    return np.concatenate(points) * [1, -1] + [0, 40]


def misplaced(tolerance=1e-3):
    """How far the scene is from svgelements' points, and these from the scene (in units)."""
    scene = _scene_from_svg(BUSY, tolerance=tolerance)
    s = np.linspace(0, 1, 801)
    ours = [
        np.asarray(
            jax.vmap(jax.vmap(lambda shape, s: shape.motion(s)[0], (None, 0)), (0, None))(g, s)
        )
        for g in scene.groups
    ]
    a, b = theirs(), np.concatenate([p.reshape(-1, 2) for p in ours])
    return max(KDTree(a).query(b)[0].max(), KDTree(b).query(a)[0].max())


# The longest line (37 units) in 800 steps, a path of 80 units in 4000: half a step, and the chords.
NEAR = 0.025


@pytest.mark.parametrize("style", ['{}="{}" {}="{}"', 'style="{}: {}; {}: {}"'])
def test_a_transform_is_about_its_origin(style):
    """A quarter turn, by hand: (1, 0) about (3, 1) goes to (4, -1), and y is turned upside down."""
    turn = style.format("transform", "rotate(90)", "transform-origin", "3px 1")
    scene = svg(f'<circle cx="1" r="0.5" {turn}/>')
    np.testing.assert_allclose(group(scene, Circles).center, [[4.0, 1.0]], rtol=0.0, atol=1e-12)


def test_of_a_switch_there_is_one():
    """The first for those who know no extension and no language."""
    one, two, three = (f'<circle id="{k}" r="{k}" {{}}/>' for k in (1, 2, 3))
    foreign = one.format('requiredExtensions="http://ns.adobe.com/AdobeIllustrator/10.0/"')
    inside = foreign + two.format("") + three.format("")
    assert svg(f"<switch><title>t</title>{inside}</switch>").names == ("2",)
    words = "".join(c.format(f'systemLanguage="{k}"') for c, k in ((one, "de"), (two, "fr")))
    assert svg(f"<switch>{words}{three.format('')}</switch>").names == ("3",)


def test_a_whole_drawing_lies_where_svgelements_has_it():
    assert misplaced() < NEAR


def test_a_skewed_circle_is_the_right_ellipse():
    """Here svgelements is no judge: it skews the two radii and takes them for half-axes."""
    scene = svg('<g transform="rotate(20) skewX(15)"><circle cx="4" cy="1" r="3"/></g>')
    oval = group(scene, Ellipses)
    t = np.linspace(0, 2 * np.pi, 50)
    x, y = 4 + 3 * np.cos(t), 1 + 3 * np.sin(t)
    x = x + np.tan(np.pi / 12) * y
    c, s = np.cos(np.pi / 9), np.sin(np.pi / 9)
    p = np.stack([c * x - s * y, -(s * x + c * y)], -1) - oval.center[0]
    c, s = np.cos(oval.tilt[0]), np.sin(oval.tilt[0])
    along = np.stack([c * p[:, 0] + s * p[:, 1], c * p[:, 1] - s * p[:, 0]], -1) / oval.semi[0]
    np.testing.assert_allclose(np.sum(along**2, 1), 1.0, rtol=1e-12)


def of_class(name, wrong):
    return lambda patch: patch.setattr(paths.Conic, name, property(wrong))


TURN: Any = paths.Conic.turn.fget
AXES: Any = paths.Conic.axes.fget
FAULTS = {
    "the page is not turned within its box": lambda p: p.setattr(
        svg_module, "_flip", lambda a: 0.0
    ),
    "transforms are transposed": lambda p: p.setattr(
        svg_module, "affine", lambda w: np.c_[affine(w)[:, :2].T, affine(w)[:, 2]]
    ),
    "arcs sweep the other way": of_class("turn", lambda c: -TURN(c)),
    "ellipses lean the other way": of_class("axes", lambda c: (AXES(c)[0], -AXES(c)[1])),
    "arcs of ellipses pass for round": of_class("is_round", lambda c: True),
    "a curve is one chord": lambda p: p.setattr(paths.Bezier, "bend", 0.0),
}


@pytest.mark.parametrize("fault", FAULTS)
def test_a_fault_moves_the_drawing(monkeypatch, fault):
    FAULTS[fault](monkeypatch)
    assert NEAR < misplaced() < np.inf


# --- materials -----------------------------------------------------------------------------------


def materials(inside: str) -> Any:
    return svg(inside).material


@pytest.mark.parametrize(
    ("attributes", "albedo"),
    [
        ("", 0.0),
        ('fill="white"', 1.0),
        ('fill="none" stroke="#333"', 0.2),
        ('fill="white" stroke="#808080"', 128 / 255),
        ('style="fill: white; stroke: #ff0000"', 0.2126),
        ('fill="rgb(0%, 100%, 0%)"', 0.7152),
        ('fill="white" data-albedo="0.25"', 0.25),
        ('fill="url(#g)" data-albedo="0.25"', 0.25),
        ('class="half"', 0.5),
        ('id="third"', 0.3),
        ('class="light" fill="white"', 0.0),
        ('class="light" data-albedo="0.4"', 0.4),
        ('fill="none" data-albedo="0.4"', 0.4),
    ],
)
def test_colours_classes_and_data_say_what_is_reflected(attributes, albedo):
    rules = ".half, .other { fill: red; stroke: rgb(50%,50%,50%) } /* */ #third{fill:#4d4d4d}"
    scene = svg(f'<style>{rules}</style><circle r="1" {attributes}/>')
    np.testing.assert_allclose(scene.material.albedo, [[albedo, albedo]], rtol=0.0, atol=2.1e-3)


def test_the_current_colour_is_that_of_the_element_or_of_those_around_it():
    circle = '<circle r="1" fill="currentColor"'
    scene = svg(f'<g color="#808080">{circle}/>{circle} style="color: white"/></g>{circle}/>')
    np.testing.assert_allclose(scene.material.albedo[:, 0], [128 / 255, 1, 0], rtol=0.0, atol=1e-12)


@pytest.mark.parametrize(
    ("rules", "attributes", "albedo"),
    [
        (".a {fill: red} .b {fill: white}", 'class="a b"', 1.0),
        (".a {fill: red} .b {fill: white}", 'class="b a"', 1.0),
        (".b {fill: white} .a {fill: red} .b {fill: white}", 'class="b a"', 1.0),
        (".a {fill: white} circle {fill: red}", 'class="a"', 1.0),
        (".a {fill: white !important}", 'class="a" style="fill: red"', 1.0),
        (".a {fill: white !important; fill: red}", 'class="a"', 1.0),
    ],
)
def test_of_several_rules_the_same_holds_as_in_css(rules, attributes, albedo):
    scene = svg(f'<style>{rules}</style><circle r="1" {attributes}/>')
    np.testing.assert_allclose(scene.material.albedo[0, 0], albedo, rtol=0.0, atol=1e-12)


@pytest.mark.parametrize(
    "rules",
    [
        "@media screen {.a {fill: white}}",
        "@media all {circle {fill: red} .a {fill: white}}",
        "@media print, only Screen {.a {fill: white}}",
        "@media screen {@media all {.a {fill: white}}} circle {fill: red}",
        "@import url('https://a.org/css2?family=Roboto:wght@400;700'); .a {fill: white}",
        '@namespace svg url("http://www.w3.org/2000/svg"); .a {fill: white}',
        '@font-face {font-family: "A"; src: url(a.woff)} .a {fill: white}',
        "@keyframes pulse {from {fill: red} 50% {fill: blue}} .a {fill: white}",
    ],
)
def test_rules_that_hold_on_a_screen_are_those_of_the_drawing(rules):
    scene = svg(f'<style>{rules}</style><circle r="1" class="a"/>')
    np.testing.assert_allclose(scene.material.albedo[0, 0], 1.0, rtol=0.0, atol=1e-12)


@pytest.mark.parametrize("condition", ["print", "(prefers-color-scheme: dark)", "not screen"])
def test_rules_under_another_condition_are_left_out_with_a_warning(condition):
    dark = f"@media {condition} {{g > a {{fill: red}} .a {{fill: black}} .a {{stroke: black}}}}"
    words = rf"<style>: rules under `@media {re.escape(condition)}` are left out"
    with pytest.warns(UserWarning, match=words) as warned:
        scene = svg(f'<style>.a {{fill: white}} {dark}</style><circle r="1" class="a"/>')
    assert len(warned) == 1
    np.testing.assert_allclose(scene.material.albedo[0, 0], 1.0, rtol=0.0, atol=1e-12)


def test_a_condition_on_what_is_not_read_is_left_out_in_silence():
    calm = "@media (prefers-reduced-motion: reduce) {.a {animation: none}}"
    assert svg(f'<style>{calm}</style><circle r="1" class="a"/>').count == 1


def test_what_is_not_drawn_is_not_there():
    shown = '<circle r="1"/>'
    for hidden in (
        '<circle r="1" fill="none"/>',
        '<line x1="1"/>',
        '<circle r="0"/>',
        '<rect width="0" height="3"/>',
        '<path d=""/>',
        '<g display="none"><circle r="1"/></g>',
        '<g style="visibility:hidden"><circle r="1"/></g>',
        '<g class="ignore"><circle r="1"/></g>',
        '<text>words</text><title>t</title><image href="x.png"/>',
        '<symbol id="s"><circle r="1"/></symbol>',
        '<other xmlns="http://example.org"><circle r="1"/></other>',
    ):
        assert svg(shown + hidden).count == 1, hidden


def test_classes_and_data_make_lights_mirrors_and_glass():
    found = materials(
        '<circle r="1" class="light"/><circle r="1" class="light" data-emission="3 4"/>'
        '<g data-emission="5"><circle r="1"/><circle r="1" data-emission="6"/></g>'
        '<circle r="1" class="mirror"/><circle r="1" class="glass" data-ior="1.33"/>'
        '<circle r="1" data-specular="0.5" data-exponent="20"/>'
    )
    np.testing.assert_array_equal(
        found.emission, [[1, 0], [3, 4], [5, 0], [6, 0], [0, 0], [0, 0], [0, 0]]
    )
    np.testing.assert_array_equal(found.mirror, [0, 0, 0, 0, 1, 0, 0])
    np.testing.assert_array_equal(found.ior, [0, 0, 0, 0, 0, 1.33, 0])
    np.testing.assert_array_equal(found.specular, [0, 0, 0, 0, 0, 0, 0.5])
    np.testing.assert_array_equal(found.exponent, [0, 0, 0, 0, 0, 0, 20])


def test_lights_without_size_and_skies():
    scene = svg(
        '<circle r="1"/><circle class="point-light" cx="3" cy="-4" r="0.1" data-intensity="2"/>',
        'data-sky="0.5"',
    )
    np.testing.assert_array_equal(scene.points.position, [[3, 4]])
    np.testing.assert_array_equal(scene.points.intensity, [2])
    assert scene.environment is not None
    assert scene.environment(0.3) == 0.5
    sky = svg('<circle r="1"/>', 'data-sky="2 0.1 0.5"').environment
    assert sky is not None
    np.testing.assert_allclose(sky(0.6), 2 * np.exp(-0.5), rtol=1e-12)


def test_a_drawing_is_a_scene_like_any_other(tmp_path):
    """From a file, and through TOML."""
    file = tmp_path / "d.svg"
    file.write_text('<svg><rect width="2" height="1"/><circle id="b" r="3"/></svg>')
    scene = read_svg(file, scale=0.01)
    again = flatland_from_toml(flatland_to_toml(scene))
    for a, b in zip(jax.tree.leaves(scene), jax.tree.leaves(again), strict=True):
        np.testing.assert_array_equal(a, b)
    np.testing.assert_allclose(scene.length(4), 2 * np.pi * 0.03, rtol=1e-12)


def test_a_class_of_the_drawing_programs_may_be_anything_unlike_ours_or_in_a_style_sheet():
    css = "<style>.lights {fill: white}</style>"
    scene = svg(f'{css}<circle r="1" class="st0"/><circle r="1" class="lights"/>')
    assert scene.count == 2
    np.testing.assert_array_equal(scene.material.emission, 0.0)


# --- what is wrong -------------------------------------------------------------------------------

PAGE = "d.svg, line 1, <svg>: "
WRONG = [
    ('<circle r="-1"/>', "<circle>: `r` must not be negative, but is -1."),
    ('<circle id="lamp"/>', '<circle id="lamp">: `r` is missing.'),
    ('<circle r="1em"/>', "<circle>: `r` must be a length, but is '1em'."),
    ('<circle r="1e400"/>', "<circle>: `r` must be a length, but is '1e400'."),
    ('<circle r="1e80"/>', "<circle>: the coordinates must stay below 1e+60, but do not."),
    ('<circel r="1"/>', "<circel>: <circel> is not known here: did you mean `circle`?"),
    ('<path d="L 1 1"/>', "<path>: `d` must begin with a move, but is 'L 1 1'."),
    ('<path d="M 0 0 L 1"/>', "<path>: `d` has a wrong part: 'L 1'."),
    ('<path d="M 0 0 X 3"/>', "<path>: `d` has a wrong part: 'X 3'."),
    ('<path d="M 0 0 A 1 1 0 2 1 3 0"/>', "<path>: `d` is no path: 'M 0 0 A 1 1 0 2 1 3 0'."),
    (
        '<polygon points="1 2 3"/>',
        "<polygon>: `points` must be pairs of numbers, but has 3 numbers.",
    ),
    ('<polygon points="1 x"/>', "<polygon>: `points` must be numbers, but is '1 x'."),
    ('<g transform="rotate(30"/>', "<g>: `transform` is not understood: 'rotate(30'."),
    ('<g transform="turn(30)"/>', "<g>: `transform` is not understood: 'turn(30)'."),
    ('<g transform="scale(0)"/>', "<g>: `transform` must be invertible, but is 'scale(0)'."),
    ('<circle r="1" fill="blurple"/>', "<circle>: 'blurple' is not a colour."),
    (
        '<circle r="1" fill="url(#g)"/>',
        "<circle>: a gradient or a pattern has no albedo: `data-albedo` has to say it.",
    ),
    (
        '<circle r="1" data-albedo="2"/>',
        "<circle>: `albedo`, `mirror` and `specular` must add up to at most 1, but add up to 2.",
    ),
    (
        '<circle r="1" data-emision="2"/>',
        "<circle>: `data-emision` is not known here: did you mean `emission`?",
    ),
    (
        '<circle r="1" class="st0 lihgt"/>',
        "<circle>: the class `lihgt` is not known here: did you mean `light`?",
    ),
    ('<circle r="1" data-ior="1 2"/>', "<circle>: `data-ior` must be one number, but is '1 2'."),
    ('<use href="#no"/>', "<use>: `href` must name an element of this file, but is '#no'."),
    ('<g id="a"><use href="#a"/></g>', "`href` leads back to the element itself."),
    ('<svg viewBox="0 0 1 1"/>', "<svg>: `viewBox` is read at the root only."),
    ("<style>g > a {fill: red}</style>", "<style>: the selector `g > a` is not understood here."),
    (
        "<style>@media screen {g > a {fill: red} p {fill: red}}</style>",
        "<style>: the selector `g > a` is not understood here.",
    ),
    (
        "<style>a {fill: red; p {fill: red}}</style>",
        "<style>: the selector `a {fill: red; p` is not understood here.",
    ),
    (
        '<circle r="1" transform="scale(2)" transform-origin="center"/>',
        "<circle>: `transform-origin` must be two lengths, but is 'center'.",
    ),
    (
        '<circle r="1" transform="scale(2)" transform-origin="50% 1"/>',
        "<circle>: `transform-origin` must be a length, but is '50%'.",
    ),
    ("<g></a>", "the text is no XML: mismatched tag."),
    ("<g>" * 300, "elements are nested too deeply."),
]


@pytest.mark.parametrize(("inside", "sentence"), WRONG, ids=range(len(WRONG)))
def test_a_bad_drawing_is_one_sentence_with_the_line_and_the_element(inside, sentence):
    with pytest.raises(ValueError, match=r"d\.svg, line 3") as caught:
        svg(f"\n\n{inside}\n")
    words = str(caught.value)
    assert words.endswith(sentence)
    assert "\n" not in words


@pytest.mark.parametrize(
    ("source", "sentence"),
    [
        ("", "d.svg, line 1: the text is no XML: no element found."),
        ("<html/>", "d.svg, line 1: the drawing must be <svg>, but is <html>."),
        ("<svg/>", "d.svg: a scene must have at least one shape, but there is none."),
        ('<svg viewBox="0 0 1"/>', f"{PAGE}`viewBox` must be 4 numbers, but is '0 0 1'."),
        ('<svg viewBox="0 0 1 0"/>', f"{PAGE}`viewBox` must have a positive size."),
        ('<svg data-sky="1 2"/>', f"{PAGE}`data-sky` must be one number or three, but is '1 2'."),
        ('<svg data-scale="-1"/>', f"{PAGE}`data-scale` must be positive, but is -1."),
        ('<!DOCTYPE svg [<!ENTITY a "b">]><svg/>', "d.svg, line 1: entities are not read here."),
    ],
)
def test_a_bad_page_is_one_sentence(source, sentence):
    with pytest.raises(ValueError, match=r"d\.svg") as caught:
        _scene_from_svg(source, "d.svg")
    assert str(caught.value) == sentence


def test_bad_arguments_are_one_sentence():
    with pytest.raises(ValueError, match=r"Argument `tolerance` must be positive, but is 0\."):
        _scene_from_svg("<svg/>", tolerance=0.0)


def test_without_the_package_the_sentence_names_the_extra(monkeypatch):
    monkeypatch.setitem(sys.modules, "svgelements", None)
    with pytest.raises(ModuleNotFoundError, match=r'pip install "firstorder\[drawings\]"'):
        svg('<path d="M0 0h1" stroke="red"/>')


def test_lengths_numbers_colours_and_trees():
    assert length("x", " 1in ") == 96.0
    assert length("x", "25.4mm") == pytest.approx(96.0, rel=1e-15)
    assert floats("x", "1,-2-3 .5e1") == [1, -2, -3, 5]
    assert albedo_of("Black") == 0.0
    assert tree(b"<a>\n<b k='v'/></a>", "f").children[0].line == 2


# --- random bytes --------------------------------------------------------------------------------


@given(st.binary(max_size=200) | st.text(max_size=200).map(lambda t: f"<svg>{t}</svg>".encode()))
def test_random_bytes_never_crash_the_reader(source):
    refuses_in_one_sentence(_scene_from_svg, source)


PATH_WORDS = st.sampled_from(
    [*"MmLlHhVvCcSsQqTtAaZz", "0", "1", "-2.5", "1e30", "1e-30", ".5", ","]
)


@given(st.lists(PATH_WORDS, max_size=24))
def test_random_paths_never_crash_the_reader(words):
    refuses_in_one_sentence(
        _scene_from_svg, f'<svg><path stroke="red" d="M 0 0 {" ".join(words)}"/></svg>'
    )


WORDS = st.sampled_from(
    ["", "0", "-1", "1e300", "1e-300", "nan", "5%", "1 2", "url(#a)", "#", "rgb(1,2)", "none", "a",
     "inherit", "light inward", "point-light", "rotate(1e300)", "scale(1e-200)", "0 0 1e-300 1"]
)  # fmt: skip
NAMES = st.sampled_from(
    ["cx", "r", "rx", "ry", "width", "height", "points", "fill", "stroke", "class", "transform",
     "viewBox", "data-sky", "data-emission", "data-scale", "data-intensity", "style", "href", "d"]
)  # fmt: skip
TAGS = st.sampled_from(["circle", "ellipse", "rect", "polygon", "path", "line", "use", "g", "svg"])


@given(st.lists(st.tuples(TAGS, st.dictionaries(NAMES, WORDS, max_size=4)), max_size=3), st.data())
def test_random_attributes_never_crash_the_reader(elements, data):
    root = data.draw(st.dictionaries(NAMES, WORDS, max_size=2))

    def opened(tag, attributes):
        return "<" + " ".join([tag, *(f'{k}="{v}"' for k, v in attributes.items())])

    inside = "".join(
        opened(tag, {"r": "1", "width": "1", "height": "2", **a}) + "/>" for tag, a in elements
    )
    refuses_in_one_sentence(_scene_from_svg, opened("svg", root) + ">" + inside + "</svg>")
