"""Faults are found where a file computes, nowhere else, and a test that sees one is known by it."""

import ast
import pathlib
import subprocess
import sys

import pytest

from tests.mutants import (
    COMMON,
    ROOT,
    Fault,
    all_faults,
    copies,
    faults_in,
    is_seen,
    judges_of,
    mirrored,
)

SOURCE = '''
LIMIT = 3.0 - 1.0


def travel(x: "float - 1", d, warnings, jnp):
    """A sentence - no more."""
    if x < -d:
        raise ValueError(f"Too far by {x - d}" + " - or so")
    warnings.warn("Close" + str(1))
    return jnp.where(d > 0.0, jnp.minimum(x, d) ** 2, half(x, d))
'''


def test_changes_are_made_where_a_function_computes():
    found = [fault.told(SOURCE).splitlines()[2].strip() for fault in faults_in("a.py", SOURCE)]
    right = "return jnp.where(d > 0.0, jnp.minimum(x, d) ** 2, half(x, d))"
    assert sorted(found) == sorted(
        {
            "+ if x > -d:",
            "+ if x < d:",
            "+ " + right.replace("d > 0.0", "d < 0.0"),
            "+ " + right.replace("0.0", "1.0"),
            "+ " + right.replace("** 2", "* 2"),
            "+ " + right.replace("** 2", "** 4"),
            "+ " + right.replace("minimum", "maximum"),
            "+ " + right.replace("half(x, d)", "half(d, x)"),
            "+ return jnp.where(d > 0.0, half(x, d), jnp.minimum(x, d) ** 2)",
        }
    )


def test_a_term_is_dropped_and_text_is_left_alone():
    source = 'def f(a, b):\n    return g(a + b, "π" + "%s" % a)\n'
    assert {
        fault.applied(source).splitlines()[1].strip() for fault in faults_in("a.py", source)
    } == {
        'return g(a - b, "π" + "%s" % a)',
        'return g(a, "π" + "%s" % a)',
        'return g("π" + "%s" % a, a + b)',
    }
    (dropped,) = [
        fault for fault in faults_in("a.py", "def f(a, b):\n    return (a) - (b + 1)\n")
        if fault.text == "(a)"
    ]  # fmt: skip
    assert dropped.applied("def f(a, b):\n    return (a) - (b + 1)\n").endswith("return (a)\n")


def test_an_index_becomes_one_that_is_there():
    """JAX reads the last entry for an index past the end, which would be no fault."""
    source = "def f(a):\n    return a[1], a[0], a[:, 2], a[3:]\n"
    found = {fault.applied(source).splitlines()[1].strip() for fault in faults_in("a.py", source)}
    assert found == {
        "return a[0], a[0], a[:, 2], a[3:]",
        "return a[1], a[1], a[:, 2], a[3:]",
        "return a[1], a[0], a[:, 0], a[3:]",
        "return a[1], a[0], a[:, 2], a[6:]",
    }


@pytest.fixture(scope="module")
def everywhere():
    return all_faults()


def test_the_changed_library_is_still_a_program(everywhere):
    assert len(everywhere) > 10_000
    for fault in everywhere[::150]:
        ast.parse(fault.applied((ROOT / fault.path).read_text(encoding="utf-8")))


def test_a_file_without_a_mirrored_test_is_that_of_who_imports_it():
    assert mirrored("src/firstorder/fields/_ray.py") == pathlib.Path("tests/fields/test_ray.py")
    events = "src/firstorder/transport/events/travel.py"
    assert judges_of(events) == [events, "tests/transport/events/test_travel.py"]
    errors = "src/firstorder/errors.py"
    assert "tests/laws/test_integrate.py" in judges_of(errors)


def test_who_imports_a_file_is_found_in_a_copy_of_the_tree(tmp_path):
    files = {
        "src/firstorder/a/_b.py": "",
        "src/firstorder/a/c.py": "from firstorder.a import _b, d\n",
        "src/firstorder/a/d.py": "from firstorder.a.c import f\n",
        "tests/a/test_c.py": "",
        "tests/a/test_d.py": "",
        "tests/a/test_other.py": "from firstorder.a._b import f\n",
    }
    for name, text in files.items():
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text(text)
    asked = "src/firstorder/a/_b.py"
    assert judges_of(asked, tmp_path) == [asked, "tests/a/test_c.py", "tests/a/test_other.py"]


def test_a_file_that_nobody_imports_is_judged_by_its_chapter(tmp_path):
    for name in ("src/firstorder/a/_b.py", "tests/a/test_c.py", "tests/test_d.py"):
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text("")
    asked = "src/firstorder/a/_b.py"
    assert judges_of(asked, tmp_path) == [asked, "tests/a/test_c.py"]


def test_what_is_imported_beforehand_leaves_jax_asleep():
    """A process with threads must not be forked, and JAX has some once it has looked for devices.

    None of ours is among it: a process would read it before it has moved into its copy.
    """
    program = [f"import {name}" for name in COMMON] + [
        "import sys, threading",
        "from jax._src.xla_bridge import backends_are_initialized",
        "names = [name for name in sys.modules if name.split('.')[0] in ('firstorder', 'tests')]",
        "print(backends_are_initialized(), threading.active_count(), names)",
    ]
    command = [sys.executable, "-c", "\n".join(program)]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    assert done.stdout == "False 1 []\n"


def test_nothing_is_seen_where_nothing_is_changed(tmp_path):
    (tree,) = copies(1, tmp_path)
    path = "src/firstorder/transport/events/travel.py"
    assert not is_seen(Fault(path, 0, 0, ""), tree)
    assert (tree / path).read_bytes() == (ROOT / path).read_bytes()


@pytest.mark.parametrize(
    ("test", "seen"),
    [
        ("assert f(2.0) == 4.0", True),
        ("assert f(2.0) > 0.0", False),
        ("assert f(2.0) == 4.0 or os.kill(os.getpid(), signal.SIGKILL)", True),
        ("while f(2.0) != 4.0: pass", True),
    ],
)
def test_a_change_is_seen_by_a_test_that_bites(tmp_path, test, seen):
    path = "src/package/thing.py"
    (tmp_path / path).parent.mkdir(parents=True)
    (tmp_path / path).write_text("def f(x):\n    return x + x\n")
    file = tmp_path / "tests" / "test_thing.py"
    file.parent.mkdir()
    imported = "import os, signal\nfrom package.thing import f\n"
    file.write_text(f"{imported}\n\ndef test_f():\n    {test}\n")
    (dropped,) = [f for f in faults_in(path, (tmp_path / path).read_text()) if f.text == "x"]
    assert is_seen(dropped, tmp_path, limit=4) == seen
    assert (tmp_path / path).read_text() == "def f(x):\n    return x + x\n"
