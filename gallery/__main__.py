"""Draw the stills: `python -m gallery [NAME ...] [--quick] [--width PIXELS] [--list] [--out DIR]`.

A still that is finished is not drawn again unless its script, the shared machinery or the library
has changed: each PNG carries the digest of what it was made from. Tiles are kept while a still is
unfinished, so that a killed run goes on.
"""

from __future__ import annotations

import ast
import functools
import hashlib
import importlib
import pathlib
import shutil
import sys
import time
from dataclasses import dataclass
from typing import Annotated

import matplotlib.image
import tyro
from PIL import Image

import firstorder
from firstorder import plotting, session
from firstorder.cli._pipes import piped
from firstorder.io import atomic_write
from gallery.frame import Frame

HERE = pathlib.Path(__file__).parent


@dataclass(frozen=True)
class Options:
    """Draw our own stills."""

    names: Annotated[tuple[str, ...], tyro.conf.Positional] = ()
    """Stills to draw, such as shafts; all if none is named."""
    quick: bool = False
    """A tenth of the size, in seconds."""
    width: int = 1920
    """In pixels; the height is nine sixteenths of it."""
    list: bool = False
    """Only say which stills there are."""
    out: pathlib.Path = HERE / "out"
    """Where stills are written."""
    force: bool = False
    """Draw again what is finished."""


def names() -> list[str]:
    """Names of all stills."""
    return sorted(file.stem for file in (HERE / "stills").glob("[!_]*.py"))


def main(options: Options) -> int:
    """Draw what is not finished."""
    unknown = [n for n in options.names if n not in names()]
    if unknown:
        print(f"There is no still called {unknown[0]!r}: see --list.", file=sys.stderr)
        return 2
    for name in options.names or names():
        if options.list:
            print(f"{name:12} {title(name)}")
            continue
        session.start()
        draw(name, options)
    return 0


def draw(name: str, options: Options) -> pathlib.Path:
    """Draw one still, if it is not finished; where it is."""
    width = 192 if options.quick else options.width
    file, made_of = options.out / f"{name}.png", key(name, width)
    if not options.force and _made_of(file) == made_of:
        print(f"{name:12} finished before")
        return file
    begin, spent = time.perf_counter(), time.process_time()
    tiles = options.out / "tiles" / f"{name}_{width}_{made_of}"
    frame = Frame(width, width * 9 // 16, tiles, made_of)
    with plotting.house_style():
        levels = importlib.import_module(f"gallery.stills.{name}").still(frame)
    with atomic_write(file) as part:
        matplotlib.image.imsave(part, levels, metadata={"Source": made_of, "Title": title(name)})
    shutil.rmtree(tiles, ignore_errors=True)
    took, spent = time.perf_counter() - begin, time.process_time() - spent
    print(f"{name:12} {took:6.1f} s, of processors {spent:6.1f} s", flush=True)
    return file


def key(name: str, width: int) -> str:
    """Digest of all that a still depends on."""
    script = (HERE / "stills" / f"{name}.py").read_bytes()
    return hashlib.sha256(script + _shared() + str(width).encode()).hexdigest()[:16]


@functools.cache
def _shared() -> bytes:
    package = pathlib.Path(firstorder.__file__).parent
    files = [*HERE.glob("*.py"), *HERE.glob("stills/_*.py"), *package.rglob("*.py")]
    return hashlib.sha256(b"".join(file.read_bytes() for file in sorted(files))).digest()


def _made_of(file: pathlib.Path) -> str | None:
    """What a PNG says that it was made from; None if it is not there or is none."""
    try:
        with Image.open(file) as picture:
            return picture.info.get("Source")
    except OSError:
        return None


def title(name: str) -> str:
    """First line of a still's docstring, without running it."""
    text = (HERE / "stills" / f"{name}.py").read_text(encoding="utf-8")
    return (ast.get_docstring(ast.parse(text)) or "").partition("\n")[0]


if __name__ == "__main__":
    config = (tyro.conf.FlagCreatePairsOff,)
    sys.exit(piped(lambda: main(tyro.cli(Options, description=__doc__, config=config))))
