"""Trees of XML with their lines, and which rules of a style sheet hold for an element."""

import warnings

import pytest

from firstorder.io.svg._xml import StyleSheet, tree

NAMED = b"""<svg xmlns="http://www.w3.org/2000/svg" xmlns:x="http://example.org"
     xmlns:s="http://www.w3.org/2000/svg">
  <s:g id="a">one <i/>and</s:g>
  <x:g x:id="b" id="c" x:name="d"/>
</svg>"""


def test_a_tree_has_names_lines_attributes_and_texts():
    root = tree(NAMED, "f")
    assert [n.tag for n in root.walk()] == ["svg", "g", "i", "g"]
    assert [n.line for n in root.walk()] == [1, 3, 3, 4]
    assert [n.foreign for n in root.walk()] == [False, False, False, True]
    assert [len(n.children) for n in root.walk()] == [2, 1, 0, 0]
    first, second = root.children
    assert first.attributes == {"id": "a"}
    assert second.attributes == {"id": "c", "name": "d"}  # the name without a namespace wins
    assert first.text == "one and"
    assert second.text == ""


def test_elements_without_a_namespace_are_svg():
    assert not tree(b"<svg/>", "f").foreign


def nested(depth):
    return b"<g>" * depth + b"</g>" * depth


@pytest.mark.parametrize(
    ("source", "sentence"),
    [
        (b"<a>\n<b>\n</a>", "f, line 3: the text is no XML: mismatched tag."),
        (b"", "f, line 1: the text is no XML: no element found."),
        (nested(201), "f, line 1: elements are nested too deeply."),
        (b"<!DOCTYPE a [\n<!ENTITY b 'c'>]><a/>", "f, line 2: entities are not read here."),
        (
            b"<?xml version='1.0' encoding='klingon'?><a/>",
            "f, line 1: the encoding of the text is not known here.",
        ),
    ],
)
def test_what_is_no_tree_is_one_sentence_with_the_line(source, sentence):
    with pytest.raises(ValueError, match="f, line") as caught:
        tree(source, "f")
    assert str(caught.value) == sentence


def test_elements_may_stand_in_each_other_two_hundred_deep():
    assert len(list(tree(nested(200), "f").walk())) == 200


# --- style sheets --------------------------------------------------------------------------------


def styled(rules, attributes="", around=""):
    """Declarations that hold for a circle."""
    source = f"<svg {around}><style>{rules}</style><circle {attributes}/></svg>"
    root = tree(source.encode(), "f")
    return StyleSheet(root, "f").of(root.children[-1])


@pytest.mark.parametrize(
    ("rules", "attributes", "fill"),
    [
        ("", 'fill="a"', "a"),
        ("* {fill: b}", 'fill="a"', "b"),
        ("circle {fill: c} * {fill: b}", "", "c"),
        (".k {fill: d} circle {fill: c}", 'class="k"', "d"),
        ("#i {fill: e} .k {fill: d}", 'class="k" id="i"', "e"),
        ("#i {fill: e}", 'id="i" style="fill: f"', "f"),
        # of as many classes, the one that stands last in the sheet, whatever the element says first
        (".k {fill: d} .l {fill: g}", 'class="l k"', "g"),
        (".l {fill: g} .k {fill: d}", 'class="l k"', "d"),
        (".k {fill: d} .l {fill: g} .k {fill: h}", 'class="k l"', "h"),
        # what is important, whoever says it, and the more special of two that are
        ("* {fill: b !important}", 'style="fill: f"', "b"),
        ("* {fill: b !important}", 'style="fill: f !important"', "f"),
        ("circle {fill: c !important} .k {fill: d !important}", 'class="k"', "d"),
        ("* {fill: b !important; fill: c}", "", "b"),
        # words and rules that are read
        ("a, circle , b {stroke: s; fill:c; ; width: 3}", "", "c"),
        ("/* circle {fill: b} */ circle {fill: c} /* and on", "", "c"),
        ("circle {fill: c} } rect {fill: b}", "", "c"),
        ("circle {fill: c} circle {fill: b", "", "c"),
        ("@media all {circle {fill: c}}", "", "c"),
        ("@import 'a{b'; circle {fill: c}", "", "c"),
        ("@keyframes k {from {fill: b}} circle {fill: c}", "", "c"),
    ],
)
def test_of_several_declarations_the_strongest_holds(rules, attributes, fill):
    assert styled(rules, attributes)["fill"] == fill


def test_declarations_are_read_up_to_the_first_colon_and_others_kept():
    found = styled("circle {transform: a:b; width: 3}", 'r="1" width="2"')
    assert found == {"r": "1", "width": "2", "transform": "a:b"}


def test_a_sheet_knows_its_selectors():
    root = tree(b"<svg><style>.a, rect {fill: b}</style></svg>", "f")
    sheet = StyleSheet(root, "f")
    assert [sheet.knows(word) for word in (".a", "rect", "a", ".b")] == [True, True, False, False]


def test_a_style_of_another_namespace_is_none():
    source = b"<svg><x:style xmlns:x='http://example.org'>g > a {fill: b}</x:style></svg>"
    assert not StyleSheet(tree(source, "f"), "f").knows("a")


@pytest.mark.parametrize(
    ("rules", "selector"),
    [
        ("g > a {fill: b}", "g > a"),
        ("a {fill: b; p {fill: c}}", "a {fill: b; p"),
        ("a:hover, circle {fill: b}", "a:hover"),
        ("x" * 39 + "+a {fill: b}", "x" * 39 + "+"),
    ],
)
def test_another_selector_is_refused_at_its_sheet(rules, selector):
    with pytest.raises(ValueError, match="is not understood here") as caught:
        styled(f"\n{rules}")
    sentence = f"f, line 1, <style>: the selector `{selector}` is not understood here."
    assert str(caught.value) == sentence


def test_rules_in_rules_are_refused_in_few_words_however_deep_they_are():
    with pytest.raises(ValueError, match="the selector `") as caught:
        styled("a {" * 2000 + "}" * 2000)
    assert len(str(caught.value)) < 120


@pytest.mark.parametrize(
    ("condition", "holds"),
    [
        ("@media screen", True),
        ("@media", True),
        ("@MEDIA print, only ALL", True),
        ("@media print", False),
        ("@media screen and (color)", False),
        ("@supports (fill: a)", False),
        ("@layer base", False),
    ],
)
def test_a_condition_holds_as_on_a_screen_or_is_left_out_with_one_warning(condition, holds):
    rules = f"circle {{fill: b}} {condition} {{circle {{fill: c}} rect {{fill: c}}}}"
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        found = styled(rules)
    assert found["fill"] == ("c" if holds else "b")
    words = (
        f"f, line 1, <style>: rules under `{condition}` are left out: those for a screen are read."
    )
    assert [str(w.message) for w in caught] == ([] if holds else [words])


@pytest.mark.parametrize(
    ("rules", "count"),
    [
        ("@media print {a {width: 3}}", 0),  # nothing that is read
        ("@media print {@media screen {a {fill: b}}}", 1),
        ("@media screen {@media print {a {fill: b}}}", 1),
        ("@media print {a {fill: b}} @media print {a {fill: c}}", 1),
        ("@media print {a {fill: b}} @page {a {fill: c}}", 2),
        ("@-webkit-keyframes k {from {fill: b}}", 0),
    ],
)
def test_each_condition_that_leaves_something_out_warns_once(rules, count):
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        styled(rules)
    assert len(caught) == count
