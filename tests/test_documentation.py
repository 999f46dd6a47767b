"""Public names say shapes, units, errors and sources, and show an example, where each applies.

`python -m tests.documentation` prints the table, and what is missing by file.
"""

import copy
import dataclasses
import importlib
import re

import pytest

from tests import documentation as docs

# The least share of names, to which a kind of statement applies, that make it.
FLOOR = 0.95


def named(name):
    (found,) = (of for of in docs.names() if of.name == f"firstorder.{name}")
    return found


def retold(of, *changes):
    """A name whose docstring is changed: each match of a pattern is replaced."""
    node = copy.deepcopy(of.node)
    doc = of.doc
    for pattern, words in changes:
        assert re.search(pattern, doc, re.S)
        doc = re.sub(pattern, words, doc, flags=re.S)
    node.body[0].value.value = doc
    return dataclasses.replace(of, node=node)


@pytest.mark.parametrize("kind", docs.KINDS)
def test_names_say_what_applies_to_them(kind):
    missing = docs.missing(kind)
    said = 1.0 - len(missing) / len(docs.wanted(kind))
    lacking = "\n".join(f"{of.file}: {of.own}: {', '.join(what)}" for of, what in missing.items())
    assert said >= FLOOR, lacking


def test_all_kinds_apply_to_many_names():
    assert len(docs.names()) > 700
    assert {kind for kind in docs.KINDS if len(docs.wanted(kind)) < 80} == set()


@pytest.mark.parametrize(
    ("kind", "name", "pattern", "lacks"),
    [
        ("shapes", "bandwidth.rms_cutoff", "a number or an array", ["exponent"]),
        ("units", "bandwidth.glossy_bandwidth_in_space", r"\[cycles/rad\]", ["cutoff"]),
        ("errors", "ledger.own_entry", "Raises:.*?(?=Example)", ["ValueError"]),
        ("source", "visibility.Elevation", "Reference:.*", ["R07.39", "R07.40", "R07.41"]),
        ("example", "conventions.direction", "Example:.*", ["direction"]),
        ("example", "fields.Wavelet.of", "Example:.*", ["of"]),
    ],
)
def test_what_is_taken_out_of_a_docstring_is_missed(kind, name, pattern, lacks):
    wants, without = docs.KINDS[kind]
    of = named(name)
    assert wants(of)
    assert without(of) == []
    assert without(retold(of, (pattern, ""))) == lacks


def test_what_is_said_never_to_raise_would_have_to_say_so_otherwise():
    assert [name for name in docs.NEVER if not docs.exceptions(named(name))] == []


IMPORT = re.compile(r"^ *>>> from (firstorder[\w.]*) import (\w+(?:, \w+)*)$", re.M)


def home(module, names):
    """The first package on the way to a module that exports all of the names."""
    parts, things = module.split("."), importlib.import_module(module)
    for k in range(2, len(parts)):
        package = importlib.import_module(".".join(parts[:k]))
        public = getattr(package, "__all__", ())
        if all(n in public and getattr(package, n) is getattr(things, n, None) for n in names):
            return package.__name__
    return module


def test_examples_import_names_from_where_they_are_exported():
    elsewhere = [
        f"{path.name}: from {module} import {names}"
        for path in (docs.ROOT / "src").rglob("*.py")
        for module, names in IMPORT.findall(path.read_text(encoding="utf-8"))
        if home(module, names.split(", ")) != module
    ]
    assert elsewhere == []
