"""What docs/SECURITY.md says of files: they run, fetch, start and write nothing."""

import ast
import json
import os
import pathlib
import subprocess
import sys

import pytest

ROOT = pathlib.Path(__file__).parents[1]
SOURCES = sorted((ROOT / "src").rglob("*.py"))

# Modules that load code from data, reach the network or start programs.
DANGEROUS = (
    {"pickle", "cPickle", "dill", "cloudpickle", "marshal", "shelve", "joblib"}
    | {"socket", "ssl", "http", "urllib", "ftplib", "smtplib", "xmlrpc", "requests", "webbrowser"}
    | {"subprocess", "multiprocessing", "ctypes", "cffi", "pty", "code", "codeop"}
    | {"dask", "distributed"}
)
# Calls that run what a text says.
RUNNING = {"eval", "exec", "compile", "__import__", "parse_expr", "execfile"}
STARTING = {"system", "popen", "startfile", "fork", "forkpty"}
# The ledger runs the user's own Python anyway: no data comes near it.
OF_THE_LEDGER = {
    # A constant text, with names of variables.
    ("src/firstorder/ledger/_out_of_true.py", "compile"),
    ("src/firstorder/ledger/reporting.py", "multiprocessing"),  # rows are checked side by side
}
# One module speaks to a scheduler whose address the caller gives, and to no other: pickles travel.
OF_A_SCHEDULER = {
    ("src/firstorder/jobs/_dask.py", name) for name in ("cloudpickle", "dask", "distributed")
}


def dangers(tree):
    """What in a module could run, fetch or start something: lines and names."""
    for node in ast.walk(tree):
        names = []
        if isinstance(node, ast.Import):
            names = [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom) and node.level == 0:
            names = [node.module or ""]
        yield from ((node.lineno, n) for n in names if n.partition(".")[0] in DANGEROUS)
        if isinstance(node, ast.Call):
            yield from _calls(node)


def _calls(node):
    called = node.func
    name = called.attr if isinstance(called, ast.Attribute) else getattr(called, "id", "")
    if name in ("import_module", "_package", "find_spec") and node.args:
        asked = getattr(node.args[0], "value", "")
        if str(asked).partition(".")[0] in DANGEROUS:
            yield node.lineno, asked
    if isinstance(called, ast.Name) and called.id in RUNNING:
        yield node.lineno, called.id
    if isinstance(called, ast.Attribute):
        of_os = isinstance(called.value, ast.Name) and called.value.id == "os"
        if called.attr == "parse_expr" or (of_os and called.attr.startswith(("exec", "spawn"))):
            yield node.lineno, called.attr
        if of_os and called.attr in STARTING:
            yield node.lineno, called.attr
    for keyword in node.keywords:
        if keyword.arg in ("allow_pickle", "shell"):
            yield node.lineno, keyword.arg


def test_no_module_can_run_fetch_or_start_anything():
    found = {
        (path.relative_to(ROOT).as_posix(), name): line
        for path in SOURCES
        for line, name in dangers(ast.parse(path.read_text()))
    }
    assert set(found) == OF_THE_LEDGER | OF_A_SCHEDULER, found


@pytest.mark.parametrize(
    "line",
    [
        "import pickle",
        "from urllib.request import urlopen",
        "import http.client as h",
        "importlib.import_module('distributed')",
        "import_module('pickle')",
        "_package('cloudpickle')",
        "eval('1')",
        "exec(text)",
        "os.system('ls')",
        "os.execvp('ls', [])",
        "np.load(file, allow_pickle=True)",
        "sympy.parse_expr(text)",
    ],
)
def test_a_line_that_could_is_seen(line):
    assert list(dangers(ast.parse(line)))


def test_without_an_address_nothing_of_the_network_is_even_imported():
    """Jobs, a sweep and tiles that run here."""
    program = """
import sys, tempfile
from firstorder.jobs import run_jobs, sweep
from firstorder.rendering import render_tiles
before = {"dask", "distributed", "cloudpickle", "socket"} & set(sys.modules)
sweep(lambda k: k, {"k": [1.0]})
list(run_jobs(abs, [-1]))
render_tiles(lambda p, k: {"value": p[:, 0]}, 3, 1, tempfile.mkdtemp())
print(sorted({"dask", "distributed", "cloudpickle"} & set(sys.modules) - before))
"""
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True)
    assert (done.returncode, done.stdout) == (0, "[]\n"), done.stderr


def test_a_line_that_could_not_is_passed():
    lines = "import re\nre.compile('a')\nnp.load(file)\npath.open()\nself.eval(1)"
    assert not list(dangers(ast.parse(lines)))


SKY = b"#?RADIANCE\n\n-Y 2 +X 4\n" + bytes([128, 128, 128, 129]) * 8
FLAT = """[[shape]]\nkind = "segment"\nstart = [-1, 1]\nend = [1, 1]\n
[environment]\nkind = "row"\nfile = "sky.hdr"\n"""
SPACE = """dimensions = 3\n[[mesh]]\nfile = "leaf.obj"\n
[environment]\nkind = "panorama"\nfile = "sky.hdr"\n"""
MITSUBA = """<scene version="3.0.0"><shape type="obj"><string name="filename" value="leaf.obj"/>
<boolean name="face_normals" value="true"/></shape></scene>"""
DRAWING = """<svg xmlns="http://www.w3.org/2000/svg" xmlns:xlink="http://www.w3.org/1999/xlink">
<style>@import url("http://localhost:9/a.css"); line { stroke: red }</style>
<image xlink:href="http://localhost:9/a.png"/><line x2="1"/></svg>"""

# The second reading is audited: the first imports packages and compiles.
AUDITED = """
import json, os, pathlib, sys
import firstorder.io as io
folder = pathlib.Path(sys.argv[1])
READERS = {
    "flat.toml": io.read_flatland,
    "space.toml": io.read_space,
    "mitsuba.xml": io.read_mitsuba,
    "drawing.svg": io.read_svg,
    "leaf.obj": io.read_mesh,
    "sky.hdr": io.read_image,
    "layers.exr": io.read_layers,
}
seen, listening = [], False
WRITES = os.O_WRONLY | os.O_RDWR | os.O_CREAT
def hook(event, args):
    if not listening:
        return
    if event == "open":
        name, _, flags = args
        inside = isinstance(name, int) or pathlib.Path(os.fsdecode(name)).is_relative_to(folder)
        if flags & WRITES or not inside:
            seen.append([event, str(name)])
    elif event.startswith(("socket.", "subprocess.", "os.", "pickle.", "urllib.", "ctypes.dl")):
        if event not in ("os.listdir", "os.scandir"):
            seen.append([event, repr(args)])
    elif event in ("exec", "compile", "import"):
        seen.append([event, repr(args)[:80]])
io.write_layers(folder / "layers.exr", {"Y": [[1.0, 2.0]]})
for name, read in READERS.items():
    read(folder / name)
sys.addaudithook(hook)
listening = True
for name, read in READERS.items():
    read(folder / name)
before = len(seen)
PROBE
listening = False
print(json.dumps([seen[:before], seen[before:]]))
"""
PROBES = """
(folder / "made").write_text("")
open(os.devnull).close()
import socket; socket.socket().close()
eval("1 + 1")
"""


def test_reading_opens_nothing_else_and_runs_nothing(tmp_path):
    (tmp_path / "sky.hdr").write_bytes(SKY)
    (tmp_path / "leaf.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    (tmp_path / "flat.toml").write_text(FLAT)
    (tmp_path / "space.toml").write_text(SPACE)
    (tmp_path / "mitsuba.xml").write_text(MITSUBA)
    (tmp_path / "drawing.svg").write_text(DRAWING)
    done = subprocess.run(
        [sys.executable, "-c", AUDITED.replace("PROBE", PROBES), str(tmp_path)],
        capture_output=True,
        text=True,
        env=os.environ | {"PYTHONDONTWRITEBYTECODE": "1"},
    )
    assert done.returncode == 0, done.stderr
    seen, probed = json.loads(done.stdout)
    assert seen == []
    # The audit itself sees what it is there to see.
    assert {"open", "socket.__new__", "compile", "exec"} <= {event for event, _ in probed}
    assert sum(event == "open" for event, _ in probed) >= 2
