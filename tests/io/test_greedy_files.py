"""Short files that ask for much: each is read or refused in a time that grows with its length.

Every one of them once took minutes, or never ended. Times are of the processor.
"""

import random
import time
import warnings

import pytest

from firstorder.io import read_flatland, read_mitsuba, read_space, read_svg, space_from_toml
from firstorder.io.scenes import _mitsuba_xml, _toml_tables
from firstorder.io.scenes._elements import MOST_SHAPES
from firstorder.io.scenes._skies import MOST_DEGREE
from firstorder.io.scenes.flatland_toml import flatland_from_toml
from firstorder.io.scenes.mitsuba import space_from_mitsuba
from firstorder.io.svg._shapes import affine, floats, length
from firstorder.io.svg.reader import MOST_PIECES, MOST_USED, _scene_from_svg

LINE = '<line x2="1" stroke="red"/>'


def svg(inside: str):
    return _scene_from_svg(f"<svg>{inside}</svg>", "d.svg")


def refused(read) -> str:
    """The sentence by which something is refused, soon."""
    start = time.process_time()
    with pytest.raises(ValueError, match=r"\A[^\n]*\Z") as caught:
        read()
    assert time.process_time() - start < 4.0
    return str(caught.value)


def soon(read):
    """What is read, soon."""
    start = time.process_time()
    found = read()
    assert time.process_time() - start < 4.0
    return found


# --- drawings ------------------------------------------------------------------------------------


def bomb(levels: int, leaf: str) -> str:
    """Groups that each use the next one twice."""
    twice = (
        f'<g id="g{i}"><use href="#g{i + 1}"/><use href="#g{i + 1}"/></g>' for i in range(levels)
    )
    return f'{"".join(twice)}<g id="g{levels}">{leaf}</g><use href="#g0"/>{LINE}'


@pytest.mark.parametrize("levels", [17, 30])
@pytest.mark.parametrize(
    "leaf",
    [
        "",
        '<circle r="0"/>',
        '<path d="' + "M0 0" * 2000 + '"/>',
        f'<g class="{"a " * 2000}" transform="{"rotate(1)" * 500}" style="{"a:b;" * 2000}"/>',
    ],
    ids=["nothing", "no size", "moves", "words"],
)
def test_uses_within_uses_are_counted_whether_they_draw_or_not(levels, leaf):
    words = refused(lambda: svg(bomb(levels, leaf)))
    assert words.startswith("d.svg, line 1, ")
    assert f"`href` must repeat at most {MOST_USED} elements" in words


def test_what_is_used_is_drawn_as_often_as_it_is_used():
    # The groups are drawn where they stand, 2^6 + ... + 1 lines; the first is used once more.
    assert svg(bomb(6, LINE)).count == 2**7 - 1 + 2**6 + 1
    twice = svg(f'<g id="a" class="light">{LINE}</g><use href="#a" class="glass" x="3"/>')
    assert twice.material.ior.tolist() == [0.0, 1.5]
    assert twice.groups[0].start.tolist() == [[0.0, 0.0], [3.0, 0.0]]


def test_pieces_are_counted_before_they_are_kept():
    path = f'<path id="p" stroke="red" d="M0 0{"h1v1" * 500}"/>'
    many = path + '<use href="#p"/>' * (MOST_PIECES // 1000)
    assert f"at most {MOST_PIECES} pieces" in refused(lambda: svg(many))


@pytest.mark.parametrize(
    "text", ["a", "{a", "a{", "/*", "@import", "@charset ", "a,", ".a ", "<!--"]
)
def test_a_style_sheet_is_read_in_linear_time_whatever_is_in_it(text):
    assert soon(lambda: svg(f"<style><![CDATA[{text * 100_000}]]></style>{LINE}")).count == 1


def test_a_style_sheet_is_read_as_before():
    sheet = (
        "/* a { } */ <!-- .a , #b{fill:none;stroke: red !important} --> @import url(x); line "
        "{visibility: hidden} .c{stroke:#808080;nonsense:1}.d{stroke: red"
    )
    scene = svg(
        f'<style><![CDATA[{sheet}]]></style><path class="a" d="M0 0h1"/><path id="b" d="M0 0h1"/>'
        f'<path class="c" d="M0 0h1"/><path class="d" d="M0 0h1"/>{LINE}'
    )
    red, grey = 0.2126, 128 / 255
    expected = [red, red, grey, 0.0]  # the last one has a fill, black; the line is hidden
    assert scene.material.albedo[:, 0].tolist()[:3] == pytest.approx(expected[:3])
    assert scene.material.albedo[3:, 0].tolist() == [0.0] * (scene.count - 3)


@pytest.mark.parametrize(
    "inside",
    [
        '<circle r="{}x"/>'.format("1" * 100_000),
        '<polygon points="{}x"/>'.format("1" * 100_000),
        '<polygon points="1{}x"/>'.format(" " * 100_000),
        '<polygon points="{}x"/>'.format("1 , " * 30_000),
        '<circle r="1" transform="{}"/>'.format("a" * 100_000),
        '<circle r="1" transform="{}"/>'.format("a(" * 100_000),
        '<circle r="1" fill="rgb({})"/>'.format("1" * 100_000),
        '<circle r="1" fill="{}"/>'.format("a" * 100_000),
    ],
    ids=["length", "digits", "spaces", "commas", "transform", "brackets", "rgb", "colour"],
)
def test_attributes_are_refused_in_linear_time(inside):
    assert refused(lambda: svg(inside)).startswith("d.svg, line 1, <")


@pytest.mark.parametrize(
    ("piece", "times"), [("z", 15_000), ("M0 0", 15_000), ("h1v1", 5_000), ("c1 1 1 0 1 1", 5_000)]
)
def test_paths_are_read_in_linear_time(piece, times):
    """Those that draw are fewer: each piece is a shape, for which there is a price."""
    d = "M0 0h1v1" + piece * times
    assert soon(lambda: svg(f'<path stroke="red" d="{d}"/>')).count >= 2


def test_what_follows_a_close_goes_on_from_where_the_subpath_began():
    one = svg('<path stroke="red" d="M1 1h1v1z h-1 v-1 zz l0 2"/>').groups[0]
    other = svg('<path stroke="red" d="M1 1h1v1z M1 1h-1 v-1 z M1 1l0 2"/>').groups[0]
    assert one.start.tolist() == other.start.tolist()
    assert one.end.tolist() == other.end.tolist()


def test_numbers_lengths_and_transforms_are_read_as_before():
    assert floats("x", " 1,-2-3 .5e1 , 1.  7E+2,") == [1.0, -2.0, -3.0, 5.0, 1.0, 700.0]
    assert length("x", " +1.5e1 mm ") == 15.0 * 96.0 / 25.4
    for words in ("1..2", "1 e", "--1", "1,,2", ""):
        with pytest.raises(ValueError, match="must be numbers"):
            floats("x", words or "x")
    both = affine(" translate( 1 , 2 ),scale(2)  ")
    assert both.tolist() == [[2.0, 0.0, 1.0], [0.0, 2.0, 2.0]]


def test_lines_between_elements_cost_nothing():
    assert soon(lambda: svg("\n" * 1_000_000 + LINE)).count == 1


def test_a_colour_may_not_be_long_but_its_words_may():
    assert svg('<circle r="1" fill="rgb( 128 , 128 , 128 )"/>').count == 1


@pytest.mark.parametrize("x", [lambda i: (0, 1), lambda i: (0, i + 1), lambda i: (i, i + 5_000)])
def test_many_lines_that_lie_on_each_other_are_refused_at_once(x):
    ends = (x(i) for i in range(5_000))
    lines = "".join(f'<line x1="{a}" x2="{b}" stroke="red"/>' for a, b in ends)
    start = time.process_time()
    with pytest.raises(ValueError, match=r"^d\.svg: a scene must have at most 10000000 pairs of"):
        svg(lines)
    assert time.process_time() - start < 12.0  # of which most is reading 5,000 elements


def test_a_scene_of_flatland_has_so_many_shapes():
    corners = ", ".join(f"[{i}, {i % 2}]" for i in range(MOST_SHAPES + 2))
    text = f'[[shape]]\nkind = "polyline"\npoints = [{corners}]'
    words = refused(lambda: flatland_from_toml(text, "f.toml"))
    assert words == f"f.toml: a scene must have at most {MOST_SHAPES} shapes, but has more."


def test_what_a_whole_scene_refuses_begins_with_the_file_too():
    line = '[[shape]]\nkind = "segment"\nstart = [0, 0]\nend = [1, 0]\nemission = [1, 2, 3{}]\n'
    words = refused(lambda: flatland_from_toml(line.format("") + line.format(", 4"), "f.toml"))
    assert words.startswith("f.toml: ")


# --- TOML ----------------------------------------------------------------------------------------

QUOTES = '"""'


@pytest.mark.parametrize(
    ("text", "line"),
    [
        ("a." * 100_000 + "a = 1", 1),
        ("\n[" + "a." * 100_000 + "a]", 2),
        ("[[" + "a." * 100_000 + "a]]", 1),
        ("x = {" + "a . " * 100_000 + "a = 1}", 1),
        ('"a".' * 100_000 + "a = 1", 1),
        ("a.'b'." * 100_000 + "a = 1", 1),
        ("# it's\nx = {a = " + QUOTES + '\nx"""", b' + ".b" * 100_000 + " = 1}", 3),
        ("x = '''\n''''' \n" + "a." * 100_000 + "a = 1", 3),
    ],
    ids=["key", "header", "array", "inline", "quoted", "apostrophes", "five quotes", "six"],
)
def test_keys_of_many_parts_are_refused_before_they_are_read(text, line):
    words = refused(lambda: _toml_tables.parsed(text, "f.toml"))
    assert words == f"f.toml, line {line}: a key must have at most 16 dots, but has more."


@pytest.mark.parametrize(
    "text",
    [
        "x = [" + "1.5," * 100_000 + "]",
        "x = [" + "1.5\n," * 1000 + "]",
        'x = "' + "a.b." * 1000 + '"',
        "x = '" + "a.b." * 1000 + "'",
        f"x = {QUOTES}" + "a.b." * 1000 + '\\"' + f'"" {QUOTES}',
        "x = '''" + "a.b.\n" * 1000 + "'''",
        "# " + "a.b." * 1000,
        "# it's\n# " + "a.b." * 1000,
        'x = "\\\\" # ' + "a.b." * 1000,
        "a.b.c.d.e.f.g.h = 1.5e10",
        "x = [1979-05-27T07:32:00.999, 1.0, .5]".replace(".5]", "0.5]"),
        "x.y = 1.5\n" * 1 + "".join(f"k{i}.l = {i}.5\n" for i in range(1000)),
    ],
    ids=range(12),
)
def test_dots_that_join_no_key_are_read(text):
    assert soon(lambda: _toml_tables.parsed(text, "f.toml"))[1] is not None


def test_a_key_on_several_lines_is_one_sentence():
    words = refused(lambda: flatland_from_toml('"a\\nb" = 1', "f.toml"))
    assert words.startswith("f.toml")


# --- Mitsuba -------------------------------------------------------------------------------------


def test_defaults_that_hold_defaults_are_refused():
    each = (f'<default name="a{i + 1}" value="$a{i}$a{i}"/>' for i in range(26))
    text = f'<scene><default name="a0" value="xy"/>{"".join(each)}</scene>'
    words = refused(lambda: _mitsuba_xml.dict_of_xml(text.encode(), "m.xml"))
    assert words.startswith("m.xml, line 1: `value` must have at most 100000 letters")


def test_a_tube_finds_its_caps_among_many_discs():
    """Of colour, and with others of the same place or the same colour beside them."""
    red, blue = ({"type": "rgb", "value": c} for c in ([0.5, 0.1, 0.1], [0.1, 0.1, 0.5]))

    def place(x, z, down):
        sign = -1.0 if down else 1.0
        return [[sign, 0, 0, x], [0, 1, 0, 0], [0, 0, sign, z], [0, 0, 0, 1]]

    def coated(color):
        return {"bsdf": {"type": "diffuse", "reflectance": color}}

    scene = {"type": "scene"}
    for i in range(40):
        color = red if i % 2 else blue
        ends = {"p0": [3.0 * i, 0, 0], "p1": [3.0 * i, 0, 1]}
        scene[f"tube{i}"] = {"type": "cylinder", **ends, **coated(color)}
        for z in (0.0, 1.0):
            for other in (red, blue):
                name, world = f"{i}{z}{other is color}", place(3.0 * i, z, z == 0.0)
                scene[name] = {"type": "disk", "to_world": world, **coated(other)}
    found = space_from_mitsuba(scene).things
    assert [t.name for t in found if t.name.startswith("tube")] == [f"tube{i}" for i in range(40)]
    assert len(found) == 40 * 3
    assert {t.name[-5:] for t in found if not t.name.startswith("tube")} == {"False"}


# --- encodings -----------------------------------------------------------------------------------


@pytest.mark.parametrize("encoding", ["x-klingon", "shift_jis", "hex", "undefined", "utf-7"])
def test_an_unknown_encoding_is_one_sentence(encoding, tmp_path):
    head = f'<?xml version="1.0" encoding="{encoding}"?>'
    for name, read, text in (("a.svg", read_svg, "<svg/>"), ("a.xml", read_mitsuba, "<scene/>")):
        (tmp_path / name).write_text(head + text)
        words = refused(lambda read=read, path=tmp_path / name: read(path))
        assert words == f"{name}, line 1: the encoding of the text is not known here."


def test_encodings_of_one_byte_are_read():
    head = '<?xml version="1.0" encoding="windows-1252"?>'
    text = f'{head}<svg><circle id="café €" r="1"/></svg>'
    assert _scene_from_svg(text.encode("cp1252"), "d.svg").names == ("café €",)


# --- damage --------------------------------------------------------------------------------------

WORDS = (b"nan", b"inf", b"1e400", b"-1", b"0", b"1979-05-27", b"[[[", b"\xff\xfe", b'"', b"<", b"")
SAMPLES = {
    "a.svg": (
        read_svg,
        '<?xml version="1.0" encoding="utf-8"?><svg viewBox="0 0 4 3" data-sky="1 0 0.5">'
        "<style>.wall{stroke:#808080}</style><defs><g id='pair'><circle r='0.1'/></g></defs>"
        '<line class="wall" x2="4" y1="3" y2="3"/><path class="light" d="M3 1H1c1 1 1 0 2 1z"/>'
        '<use href="#pair" x="2" y="2" transform="rotate(10) scale(2)"/></svg>',
    ),
    "flat.toml": (
        read_flatland,
        '[[shape]]\nkind = "segment"\nstart = [0.5, 1]\nend = [-0.5, 1.0]\nname = "lamp"\n'
        'emission = 1.0\n[[shape]]\nkind = "polyline"\npoints = [[0, 0], [1, 0.5], [2, 0]]\n'
        "albedo = [0.5, 0.25]\n[[light]]\nposition = [0.0, 2.0]\nintensity = 3.0\n"
        '[environment]\nkind = "gaussian"\nsigma = 0.4\n',
    ),
    "space.toml": (
        read_space,
        'dimensions = 3\n[[shape]]\nkind = "sphere"\ncenter = [0, 0, 1.5]\nradius = 0.5\n'
        '[shape.texture]\nkind = "picture"\nvalues = [[0.2, 0.8], [0.5, 1.0]]\n'
        "[[mesh]]\nvertices = [[0, 0, 0], [1, 0, 0], [1, 1, 0]]\nfaces = [[0, 1, 2]]\n"
        'name = "floor"\nalbedo = 0.3\n[environment]\nkind = "constant"\nradiance = 0.5\n'
        "[camera]\neye = [0, -4, 2]\nlook_at = [0, 0, 0]\ngamma = 2.0\n",
    ),
    "m.xml": (
        read_mitsuba,
        '<scene version="3.0.0"><default name="r" value="0.5"/><bsdf type="diffuse" id="paint">'
        '<rgb name="reflectance" value="0.1, 0.2, $r"/></bsdf><shape type="rectangle" id="lamp">'
        '<transform name="to_world"><rotate x="1" angle="180"/><translate z="2"/></transform>'
        '<emitter type="area"><rgb name="radiance" value="2"/></emitter></shape>'
        '<shape type="sphere"><point name="center" value="0 0 1"/><ref id="paint"/></shape>'
        "</scene>",
    ),
}


def damaged(text: bytes, draw: random.Random) -> bytes:
    """A text after one to three accidents."""
    for _ in range(draw.randint(1, 3)):
        a, b = sorted(draw.randrange(len(text) + 1) for _ in range(2))
        b = min(b, a + 40)
        match draw.randrange(6):
            case 0:
                where = draw.randrange(max(len(text), 1))
                flipped = bytes([text[where] ^ 1 << draw.randrange(8)]) if text else b""
                text = text[:where] + flipped + text[where + 1 :]
            case 1:
                text = text[:a] + text[b:]
            case 2:
                text = text[:b] + text[a:b] * draw.choice((1, 3, 400)) + text[b:]
            case 3:
                text = text[:a]
            case 4:
                text = text[:a] + draw.choice(WORDS) + text[a:]
            case 5:
                text = text[:a] + draw.choice(WORDS) + text[b:]
    return text


@pytest.mark.parametrize("name", SAMPLES)
def test_a_damaged_file_is_a_scene_or_one_sentence_that_names_it(name, tmp_path):
    read, text = SAMPLES[name]
    path, draw, refusals = tmp_path / name, random.Random(name), []
    path.write_text(text)
    read(path)
    for _ in range(100):
        path.write_bytes(damaged(text.encode(), draw))
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")  # of what Mitsuba's readers leave out
                read(path)
        except ValueError as error:
            refusals.append(str(error))
    assert [r for r in refusals if not r.startswith(name) or len(r.splitlines()) > 1] == []
    assert 20 < len(refusals) < 100


@pytest.mark.parametrize("degree", [MOST_DEGREE + 1, 2**31 - 1])
def test_a_sky_of_very_many_harmonics_is_refused(degree):
    text = f"""dimensions = 3
[environment]
kind = "panorama"
values = [[1.0, 1.0, 1.0, 1.0], [1.0, 1.0, 1.0, 1.0]]
degree = {degree}
[[shape]]
kind = "sphere"
center = [0, 0, 0]
radius = 1
"""
    words = f"scene, line 5, environment: `degree` must be at most 32, but is {degree}."
    assert refused(lambda: space_from_toml(text)) == words
