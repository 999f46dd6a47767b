"""The page of stills: what one would show at the start of a talk."""

from __future__ import annotations

import ast
import pathlib
import re

from docs.generate import markdown as md

SCRIPTS = md.ROOT / "gallery" / "stills"


def pages() -> dict[str, str]:
    """All stills on one page, those first of which there is a picture."""
    words = (
        "Pictures of our own, without claims: light that is exact at every pixel, lines where its "
        "derivatives jump, and renderings with the same lamps and tone curve. `make gallery` draws "
        "them at 1920 x 1080 in `gallery/out`; small ones of a few are kept with the library. All "
        "take some 15 minutes of one processor: the rooms with bounces 4, the garden 3, "
        "the shafts 2.5, all others at most 1.5 each."
    )
    files = sorted(SCRIPTS.glob("[!_]*.py"), key=lambda f: (picture(f.stem) is None, f.stem))
    return {"stills.md": md.page("Stills", words, *map(_still, files))}


def picture(name: str) -> pathlib.Path | None:
    """The still as it was last drawn here, or the small one that is kept."""
    files = (md.ROOT / "gallery" / "out" / f"{name}.png", md.ROOT / "gallery" / f"still_{name}.png")
    return next((file for file in files if file.is_file()), None)


def _still(script: pathlib.Path) -> str:
    said = ast.get_docstring(ast.parse(script.read_text(encoding="utf-8"))) or ""
    title, _, caption = said.partition("\n")
    shown, found = "", picture(script.stem)
    if found is not None:
        there = found.relative_to(md.ROOT).as_posix()
        shown = f"![{md.escaped(title)}](../../{there})"
    drawn = f"Drawn by {md.file_link(script)}: `python -m gallery {script.stem}`."
    caption = md.escaped(re.sub(r"\s+", " ", caption.strip()))
    return "\n\n".join(part for part in (f"## {title}", shown, f"{caption} {drawn}") if part)
