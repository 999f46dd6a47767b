"""The page takes orders, says what it waits for, and refuses in words."""

import pathlib
import subprocess
import sys
import warnings

import pytest
from flatland_explorer import programs, widget
from flatland_explorer.board import first_board
from flatland_explorer.handles import handles
from flatland_explorer.widget import PICTURES, Explorer


@pytest.fixture
def page(monkeypatch):
    """A page whose pictures cost nothing: what they show is tested elsewhere."""
    drawn = {name: (words, lambda asked: {"parts": len(asked.board.parts)})
             for name, (words, _) in PICTURES.items()}  # fmt: skip
    monkeypatch.setattr(widget, "PICTURES", drawn)
    return Explorer(count=16)


class Mouse:
    """Orders, counted as the page counts them."""

    def __init__(self, page):
        self.page, self.count = page, 0

    def __call__(self, do, **more):
        self.count += 1
        self.page.asked = {"n": self.count, "do": do, **more}
        assert self.page.shown["n"] == self.count
        return self.page.shown


def test_the_first_picture_needs_no_program(monkeypatch):
    def never(*_):
        raise AssertionError("a program was asked for")

    monkeypatch.setattr(programs, "movable", never)
    shown = Explorer().shown
    assert len(shown["scene"]["parts"]) == 5
    assert shown["todo"] == list(PICTURES)
    assert shown["words"].startswith("Compiling what the probe sees, 1 of 6")


def test_pictures_come_one_by_one_and_each_wait_is_said_before(page):
    mouse = Mouse(page)
    for k, name in enumerate(PICTURES):
        assert PICTURES[name][0] in page.shown["words"]
        assert f"{k + 1} of {len(PICTURES)}" in page.shown["words"]
        assert name in mouse("go on")
    assert page.shown["todo"] == []
    assert page.shown["words"].startswith("Redrawn in")
    assert "Redrawn" in mouse("move", handle="2.body", to=[0.0, 0.5], first=True)["words"]
    # One more part is another program.
    assert mouse("add", what="strip")["todo"] == list(PICTURES)


def test_the_mouse_moves_a_part_and_a_drag_is_undone_at_once(page):
    mouse, before = Mouse(page), page.board
    for k in range(4):
        mouse("move", handle="2.body", to=[0.1 * k, 0.5], first=k == 0)
    assert handles(page.board)["2.body"] == pytest.approx((0.3, 0.5))
    mouse("tolerance", value=0.1)
    assert page.board.tolerance == 0.1
    mouse("undo")
    mouse("undo")
    assert page.board == before
    mouse("undo")
    assert page.board == before


def test_every_order_of_the_page_is_followed(page):
    mouse = Mouse(page)
    mouse("add", what="disc")
    assert len(page.board.parts) == 6
    mouse("receive", index=2)
    assert page.board.parts[page.board.receiver].name == "strip"
    mouse("remove", index=0)
    assert len(page.shown["scene"]["parts"]) == 5
    mouse("fit")
    mouse("text", what="toml")
    saved = page.text["body"]
    mouse("move", handle="0.body", to=[5.0, 5.0], first=True)
    mouse("load", name="scene.toml", text=saved)
    mouse("text", what="toml")
    assert page.text["body"] == saved
    for what in ("svg", "python"):
        mouse("text", what=what)
        assert page.text["what"] == what


@pytest.mark.parametrize(
    "order",
    [
        {"do": "remove", "index": 0},
        {"do": "receive", "index": 77},
        {"do": "load", "name": "a.toml", "text": "[[shape]]\nkind = 1"},
        {"do": "load", "name": "a.png", "text": ""},
        {"do": "move", "handle": "9.end", "to": [0.0, 0.0]},
        {"do": "move", "handle": "0.end", "to": [None, 0.0]},
    ],
)
def test_what_cannot_be_is_said_and_changes_nothing(page, order):
    mouse, before = Mouse(page), page.board
    words = mouse(order.pop("do"), **order)["words"]
    assert words.endswith(".")
    assert "Error" not in words
    assert page.board == before
    mouse("undo")
    assert page.board == before


def test_a_whole_page_is_drawn_without_a_warning():
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        page = Explorer(first_board(), count=16).draw()
    assert page.shown["todo"] == []
    assert set(PICTURES) <= set(page.shown)


def test_the_notebook_is_exported_with_all_pictures_and_no_error(tmp_path):
    page = tmp_path / "explorer.html"
    notebook = pathlib.Path(widget.__file__).parents[1] / "explorer.py"
    command = [sys.executable, "-m", "marimo", "export", "html", str(notebook), "-o", str(page)]
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert "Traceback" not in done.stderr
    text = page.read_text(encoding="utf-8")
    assert "application/vnd.marimo+error" not in text
    assert "Redrawn in" in text
    assert "Compiling" not in text.split("Redrawn in")[1][:200]
