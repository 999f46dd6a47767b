"""The pictures that the notebooks draw, kept beside the site, which does not run them.

`python -m docs.generate.notebook_pictures` runs each at its own size and keeps what it draws before
a slider is moved (`make readme`). The explorer draws on its page: its picture needs a browser.
"""

from __future__ import annotations

import base64
import io
import json
import pathlib
import re
import subprocess
import sys
from typing import Any

from PIL import Image

from docs import browser
from docs.generate import kept
from docs.generate import markdown as md

FOLDER = kept.FOLDER / "notebooks"
COLOURS = 256
NOTEBOOKS = md.ROOT / "notebooks"
# In a process of its own: a notebook decides about precision for itself.
_RUN = """
import importlib, json, sys
sys.path.insert(0, sys.argv[1])
outputs, _ = importlib.import_module(sys.argv[2]).app.run()
print(json.dumps([getattr(output, "text", "") for output in outputs]))
"""

_PAGE = """
import json, sys
sys.path.insert(0, sys.argv[1])
from firstorder import session
session.start()
from flatland_explorer import widget
print(json.dumps([widget.SCRIPT, dict(widget.Explorer().draw().shown)]))
"""


def of(name: str) -> list[pathlib.Path]:
    """The kept pictures of a notebook, in the order in which it shows them."""
    return sorted(FOLDER.glob(f"{name}-*.png"))


def pictures(page: str) -> list[bytes]:
    r"""The PNG pictures that a page of HTML holds.

    Example:
        >>> from docs.generate.notebook_pictures import pictures
        >>> pictures("<img src='data:image/png;base64,iVBORw0KGgo='>")
        [b'\x89PNG\r\n\x1a\n']
    """
    found = re.findall(r"data:image/png;base64,([A-Za-z0-9+/=]+)", page)
    return [base64.b64decode(text) for text in dict.fromkeys(found)]


def _small(picture: bytes) -> bytes:
    """The picture in few colours: some 40 kB."""
    found = io.BytesIO()
    with Image.open(io.BytesIO(picture)) as image:
        few = image.convert("RGB").quantize(
            COLOURS, Image.Quantize.FASTOCTREE, dither=Image.Dither.NONE
        )
        few.save(found, "png", optimize=True)
    return found.getvalue()


def _drawn(name: str) -> list[bytes]:
    """Pictures that a notebook draws when it is opened."""
    if name == "explorer":
        return [_explorer()]
    return pictures("".join(_run(_RUN, name)))


def _explorer() -> bytes:
    """The page of the explorer, by its own drawing commands."""
    script, shown = _run(_PAGE)
    size = re.search(r"SIZE = \{ width: (\d+), height: (\d+) \}", script)
    assert size, "pictures.js says how large the page is"
    drawing = f"document.body.innerHTML = svg(commands({json.dumps(shown)}));"
    page = f'<body style="margin: 0"></body><script type="module">{script}\n{drawing}</script>'
    return browser.photographed(page, int(size[1]), int(size[2]))


def _run(program: str, *arguments: str) -> Any:
    """Object that a program writes as JSON in its last line."""
    command = [sys.executable, "-c", program, str(NOTEBOOKS), *arguments]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    return json.loads(done.stdout.splitlines()[-1])


def keep() -> None:
    """Draw and keep the pictures of all notebooks."""
    FOLDER.mkdir(parents=True, exist_ok=True)
    for file in sorted(NOTEBOOKS.glob("*.py")):
        for old in of(file.stem):
            old.unlink()
        for k, picture in enumerate(_drawn(file.stem), 1):
            (FOLDER / f"{file.stem}-{k}.png").write_bytes(_small(picture))


if __name__ == "__main__":
    keep()
