"""The page: it takes orders of the mouse, changes the board, and sends the numbers of each picture.

A picture whose program is not compiled yet is left out and named; the page then asks to go on, and
is told before each wait what it waits for.
"""

from __future__ import annotations

import dataclasses
import pathlib
import time
from collections.abc import Callable
from typing import Any

import anywidget
import traitlets

from . import files, handles, panels
from .asked import Asked
from .board import KINDS, Board, first_board, fitted

UNDONE = 50  # boards that are kept
# One module: the pictures, and the page that shows them.
SCRIPT = "\n".join(
    pathlib.Path(__file__).with_name(name).read_text(encoding="utf-8")
    for name in ("pictures.js", "page.js")
)


# What is drawn after the scene, in the order in which it is compiled, and in words.
PICTURES: dict[str, tuple[str, Callable[[Asked], dict[str, Any]]]] = {
    "view": ("what the probe sees", panels.view_panel),
    "field": ("the light field", panels.field_panel),
    "curve": ("E, E′ and E″ with their jumps", panels.curve_panel),
    "spectrum": ("the shadow’s spectrum", panels.spectrum_panel),
    "path": ("the path’s portraits", panels.path_panel),
    "records": ("the cache", panels.record_panel),
}


class Explorer(anywidget.AnyWidget):
    """A flatland scene under the mouse.

    Attributes:
        shown: all numbers that are drawn; `todo` names the pictures that wait for their program.
        asked: an order of the page: `do` says which, `n` counts them.
        text: a scene as a file, for the page to save.
    """

    _esm = SCRIPT
    shown = traitlets.Dict().tag(sync=True)
    asked = traitlets.Dict().tag(sync=True)
    text = traitlets.Dict().tag(sync=True)

    def __init__(self, board: Board | None = None, count: int = 192):
        """Show a board; nothing is compiled yet.

        Args:
            board: to begin with.
            count: places along the receiver.
        """
        super().__init__()
        self.board = first_board() if board is None else board
        self._count, self._before, self._compiled = count, [], set()
        self._redraw(0)

    # --- orders ------------------------------------------------------------------------------------

    @traitlets.observe("asked")
    def _answer(self, change: Any) -> None:
        order = change["new"]
        if not order:
            return
        number, said, asked = order["n"], None, None
        try:
            if order["do"] == "text":  # with its number: the same text twice is two texts
                body = self.written(order["what"])
                self.text = {"what": order["what"], "body": body, "n": number}
            else:
                asked = Asked(self._after(order), self._count)
                _ = asked.world  # what cannot be a scene is refused here, before anything is shown
                self._keep(asked.board, order)
        except ValueError as error:
            asked, said = None, str(error)
        self._redraw(number, asked, order["do"] == "go on", said)

    def _after(self, order: dict[str, Any]) -> Board:
        """The board after an order."""
        board, what = self.board, order["do"]
        if what == "go on":
            return board
        if what == "undo":
            return self._before[-1] if self._before else board
        orders = {
            "move": lambda: handles.move(board, order["handle"], order["to"]),
            "add": lambda: handles.added(board, order["what"]),
            "remove": lambda: handles.removed(board, order["index"]),
            "receive": lambda: handles.received_by(board, order["index"]),
            "tolerance": lambda: dataclasses.replace(board, tolerance=float(order["value"])),
            "fit": lambda: fitted(board),
            "load": lambda: files.read(order["name"], order["text"]),
        }
        return orders[what]()

    def _keep(self, after: Board, order: dict[str, Any]) -> None:
        """Take a board, and remember the one before: of a drag only the first."""
        if order["do"] == "undo":
            self._before = self._before[:-1]
        elif order["do"] != "go on" and (order["do"] != "move" or order.get("first")):
            self._before = [*self._before, self.board][-UNDONE:]
        self.board = after

    def written(self, what: str) -> str:
        """The board as the text of a file: "toml", "svg" or "python"."""
        writers = {"toml": files.to_toml, "svg": files.to_svg, "python": files.to_python}
        return writers[what](self.board)

    # --- pictures ----------------------------------------------------------------------------------

    def _redraw(
        self,
        number: int,
        asked: Asked | None = None,
        go_on: bool = False,
        said: str | None = None,
    ) -> None:
        """Send all pictures that are compiled; with `go_on`, and the next one."""
        begin, form = time.perf_counter(), _form(self.board)
        asked = Asked(self.board, self._count) if asked is None else asked
        shown: dict[str, Any] = {"n": number, "scene": panels.scene_panel(self.board)}
        waiting = [name for name in PICTURES if (form, name) not in self._compiled]
        if go_on and waiting:
            self._compiled.add((form, waiting.pop(0)))
        for name, (_, draw) in PICTURES.items():
            if name not in waiting:
                shown[name] = draw(asked)
        seconds = time.perf_counter() - begin
        words = f"Redrawn in {1000.0 * seconds:.0f} ms."
        if waiting:
            done = len(PICTURES) - len(waiting)
            what = PICTURES[waiting[0]][0]
            words = f"Compiling {what}, {done + 1} of {len(PICTURES)}: some seconds, once."
        self.shown = shown | {"todo": waiting, "words": said or words, "seconds": seconds}

    def draw(self) -> Explorer:
        """All pictures at once, however long their programs take to compile."""
        while self.shown["todo"]:
            self._redraw(self.shown["n"], go_on=True)
        return self


def _form(board: Board) -> tuple:
    """Key of a program: how many parts of each kind there are, and who receives."""
    kinds = [part.kind for part in board.parts]
    counts = tuple(kinds.count(kind) for kind in (*KINDS, "point"))
    straight = board.parts[board.receiver].kind == "segment"
    return counts, straight, type(board.environment)
