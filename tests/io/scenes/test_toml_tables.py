"""Tables of TOML: lines, keys and values, and what is said where they are wrong."""

import math
import re

import pytest

from firstorder.io.scenes import _toml_tables as toml
from firstorder.io.scenes._beside import Beside
from firstorder.io.scenes._elements import Place
from firstorder.io.scenes._toml_tables import TomlTable, lines_of, parsed, place_of

# --- texts ---------------------------------------------------------------------------------------


def test_a_text_is_read_from_bytes_or_words_with_lines_of_one_kind():
    for source in ("a = 1\r\nb = 'c'\n", b"a = 1\nb = 'c'\n"):
        assert parsed(source, "f") == ("a = 1\nb = 'c'\n", {"a": 1, "b": "c"})


DOTS = ".".join("a" * 17)  # sixteen dots


@pytest.mark.parametrize(
    ("source", "sentence"),
    [
        (b"a = 1\n\nb = '\xff'", "f, line 3: the text must be UTF-8, but is not."),
        ("a = 1\nb = ", "f, line 2: invalid value."),
        ("a = 1\n\na = 2", "f, line 3: cannot overwrite a value."),
        ("a = " + "[" * 10_000, "f: values are nested too deeply."),
        ("a = 1\n" + DOTS + ".a = 1", "f, line 2: a key must have at most 16 dots, but has more."),
        ('a = """\n\n"""\n' + DOTS + ".a = 1",
         "f, line 4: a key must have at most 16 dots, but has more."),
    ],
)  # fmt: skip
def test_what_is_no_toml_is_one_sentence_with_its_line(source, sentence):
    with pytest.raises(ValueError, match="f") as caught:
        parsed(source, "f")
    assert str(caught.value) == sentence


def test_a_text_that_ends_too_soon_ends_in_its_last_line():
    with pytest.raises(ValueError, match="f, line 3: "):
        parsed("a = 1\nb = 2\nc = [", "f")


@pytest.mark.parametrize(
    "source",
    [f"{DOTS} = 1", f'a = "{DOTS}.a"', f"a = '{DOTS}.a'", f"a = 1 # {DOTS}.a",
     f"a = '''\n{DOTS}.a'''", f'a = """\n{DOTS}.a"""'],
)  # fmt: skip
def test_dots_count_in_keys_alone(source):
    assert "a" in parsed(source, "f")[1]


def test_lines_are_those_of_headers_and_keys():
    text = '''top = 1
[[shape]]  # a comment ]
kind = "box"
"size" = [
    1.0, # not = a key
    2.0,
]
name = """
fake = 1
[fake]
"""
[shape.inner]
x = 1
[[shape]]
[shape.inner]
[ sky ]
a.b = 2
'''
    assert lines_of(text) == {
        ("top", 0, ""): 1, ("shape", 0, ""): 2, ("shape", 0, "kind"): 3, ("shape", 0, "size"): 4,
        ("shape", 0, "name"): 8, ("shape.inner", 0, ""): 12, ("shape.inner", 0, "x"): 13,
        ("shape", 1, ""): 14, ("shape.inner", 1, ""): 15, ("sky", 0, ""): 16, ("sky", 0, "a"): 17,
    }  # fmt: skip


def test_a_place_names_the_table_by_its_number_and_its_name():
    lines = {("shape", 0, ""): 3, ("shape", 1, ""): 7}
    assert str(place_of("f", lines, "shape", 1, {})) == "f, line 7, shape 2"
    assert str(place_of("f", lines, "shape", 0, {"name": "a\n b"})) == 'f, line 3, shape 1 ("a b")'
    assert str(place_of("f", lines, "shape", 5, {"name": ""})) == "f, line 3, shape 6"
    long = place_of("f", {}, "sky", 0, {"name": "x" * 41})
    assert str(long) == f'f, sky 1 ("{"x" * 40}")'


# --- tables --------------------------------------------------------------------------------------

LINES = {("shape", 1, "size"): 4, ("shape.inner", 1, ""): 5, ("shape.inner", 1, "x"): 6}


def table(**values):
    return TomlTable(values, Place("f", 3, "shape 2"), LINES, "shape", 1)


def test_keys_are_taken_with_defaults_and_what_is_left_over_is_refused():
    one = table(size=2, color=1.0)
    assert one.take("size", toml.number) == 2.0
    assert one.take("other", toml.number, 5) == 5
    with pytest.raises(ValueError, match="f, line 3, shape 2: `color` is not known here"):
        one.done()
    assert one.take("color", toml.number) == 1.0
    one.done()


@pytest.mark.parametrize(
    ("values", "key", "sentence"),
    [
        ({"size": "a"}, "size", "f, line 4, shape 2: `size` must be a number, but is 'a'."),
        ({}, "size", "f, line 3, shape 2: `size` is missing."),
        ({"size": 1}, "sizes",
         "f, line 4, shape 2: `size` is not known here: did you mean `sizes`?"),
        ({"a": "x" * 38}, "a", f"f, line 3, shape 2: `a` must be a number, but is '{'x' * 38}'."),
        ({"a": "x" * 39}, "a",
         f"f, line 3, shape 2: `a` must be a number, but is '{'x' * 36}...."),
    ],
)  # fmt: skip
def test_a_wrong_or_missing_value_is_told_with_its_line(values, key, sentence):
    with pytest.raises(ValueError, match="f, line") as caught:
        table(**values).take(key, toml.number)
    assert str(caught.value) == sentence


def test_a_table_within_a_table_has_its_own_lines():
    inner = table(inner={"x": "a"}).inner("inner")
    assert inner is not None
    assert str(inner.place) == "f, line 5, shape 2, inner"
    assert inner.at("x").line == 6
    assert table().inner("inner") is None
    with pytest.raises(ValueError, match=r"`inner` must be written \[shape.inner\], with its own"):
        table(inner=3).inner("inner")


def test_a_file_is_named_by_a_text_and_refused_by_its_key(tmp_path):
    (tmp_path / "a").write_text("")
    beside = Beside(tmp_path)
    assert table(file="a").file(beside) == (tmp_path / "a").resolve()
    with pytest.raises(ValueError, match="f, line 4, shape 2: `size` must be text in quotes"):
        table(size=1).file(beside, "size")


# --- values --------------------------------------------------------------------------------------

V, W = [1, 2.0, 3], [4.0, 5.0, 6.0]


@pytest.mark.parametrize(
    ("read", "value", "found"),
    [
        ("number", 3, 3.0),
        ("point", [1, 2], [1.0, 2.0]),
        ("points", [[1, 2]], [[1.0, 2.0]]),
        ("numbers", [], []),
        ("numbers", [1, 2.5], [1.0, 2.5]),
        ("sided", 2, 2.0),
        ("sided", [1, 2], [1.0, 2.0]),
        ("sided", V, V),
        ("sided", [V, W], [V, W]),
        ("banded", 2, 2.0),
        ("banded", V, V),
        ("row", V, V),
        ("row", [], []),
        ("row", [V, W], [V, W]),
        ("picture", [V, W], [V, W]),
        ("picture", [[V, W], [W, V]], [[V, W], [W, V]]),
        ("yes", False, False),
        ("whole", 0, 0),
        ("whole", 2**31 - 1, 2**31 - 1),
        ("word", "a", "a"),
        ("vector", V, V),
        ("vectors", [V], [V]),
        ("three_vectors", [V, W, V], [V, W, V]),
        ("triples", [[0, 1, 2]], [[0, 1, 2]]),
        ("rows", [[1, 2], [3, 4]], [[1.0, 2.0], [3.0, 4.0]]),
    ],
)
def test_values_are_read(read, value, found):
    assert getattr(toml, read)(value) == found


SIDED = "a number, or three or more for bands; or two such for front and back"


@pytest.mark.parametrize(
    ("read", "words", "values"),
    [
        ("number", "a number", [True, "1", [1]]),
        ("number", "a finite number", [math.inf, math.nan, 10**400]),
        ("point", "two numbers", [3, [1], [1, 2, 3], "ab"]),
        ("point", "two finite numbers", [[1, math.inf], [1, "a"]]),
        ("points", "a list of pairs of numbers", [3, [], "ab"]),
        ("points", "a list of pairs of finite numbers", [[1, 2], [[1]]]),
        ("numbers", "a list of numbers", [3, "ab"]),
        ("numbers", "a list of finite numbers", [[math.nan]]),
        ("sided", SIDED, ["a", [1], [], [[1, 2], [1, 2]], [V, [1, 2]], [1, [1, 2]]]),
        ("banded", "a number, or one for each band", ["a", [], ["a"]]),
        ("row", "a list of numbers", [3]),
        ("picture", "rows of numbers", [3, [], [1, 2]]),
        ("picture", "rows of equally many bands", [[[V], [V, W]], [[V], [[1, 2]]]]),
        ("yes", "true or false", [1, "true"]),
        ("whole", "a whole number, not negative", [True, -1, 1.0, 2**31]),
        ("word", "text in quotes", [1]),
        ("vector", "three numbers", [3, [1, 2], [1, 2, 3, 4], "abc"]),
        ("vector", "three finite numbers", [[1, 2, math.inf]]),
        ("vectors", "a list of triples of numbers", [3, [], "ab"]),
        ("vectors", "a list of triples of finite numbers", [[[1, 2]]]),
        ("three_vectors", "three vectors of three numbers", [3, [V, V], "abc"]),
        ("triples", "a list of triples of whole numbers", [3, [], [3], [[0, 1]], [V, [0, 1]]]),
        ("rows", "rows of numbers", [3, [], [1]]),
        ("rows", "rows of equally many numbers", [[[1, 2], [3]]]),
    ],
)
def test_other_values_are_told_what_they_must_be(read, words, values):
    for value in values:
        with pytest.raises(ValueError, match=re.escape(words)) as caught:
            getattr(toml, read)(value)
        assert str(caught.value) == words, value


def test_the_mark_that_some_editors_put_first_is_no_part_of_the_text():
    assert parsed(b"\xef\xbb\xbfa = 1\n", "f") == ("a = 1\n", {"a": 1})
