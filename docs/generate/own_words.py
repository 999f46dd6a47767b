"""What stands elsewhere in words of our own: conventions, glossary, contributing, scripts."""

from __future__ import annotations

import ast
import inspect
import pathlib
import re
import textwrap
from typing import Any

from docs.generate import api, notebook_pictures
from docs.generate import markdown as md
from firstorder import conventions

GLOSSARY, ADDING = "Words we use", "Adding ..."
_CALLED = re.compile(r"^Called: (.*?)(?:\n\n|\Z)", re.S | re.M)


def pages() -> dict[str, str]:
    """The pages, by name."""
    return {
        "conventions.md": _conventions(),
        "glossary.md": _glossary(),
        "adding.md": _adding(),
        "contributing.md": _contributing(),
        "not_built.md": (md.ROOT / "NOT_BUILT.md").read_text(encoding="utf-8"),
        "examples.md": _examples(),
        "notebooks.md": _notebooks(),
        "first_calls.md": _first_calls(),
    }


def _first_calls() -> str:
    """The kept table of the benchmark of first calls."""
    script = md.file_link(md.ROOT / "benchmarks/bench_first_call.py")
    words = (
        "The first call of a function traces and compiles it; later calls run. Equations are those "
        "of the program that is traced, and no machine changes them; seconds are processor time of "
        "one core with an empty cache, in float64. A second process finds the program in the "
        "cache and traces it again. What is quick is of a session that was started with "
        f"`optimize=False`. The table is printed by {script}."
    )
    table = (md.ROOT / "benchmarks/first_calls.md").read_text(encoding="utf-8")
    return md.page("What first calls cost", words, table)


def _conventions() -> str:
    """The docstring of `conventions`: a heading and its paragraph, over and over."""
    first, _, rest = (inspect.getdoc(conventions) or "").partition("\n\n")
    parts = [
        "Which side shines, where angle 0 is, what a unit is, which way light is labelled and "
        f"which sign the Fourier transform has. {first}"
    ]
    for block in re.split(r"\n(?=\S)", rest[rest.index("Flatland\n") :]):
        head, _, words = block.partition("\n")
        parts += [f"## {head}", api.linked(md.escaped(textwrap.dedent(words).strip()))]
    return md.page("Conventions", *parts, *_more_conventions())


def _more_conventions() -> list[str]:
    """The functions that hold the signs, each in a sentence."""
    functions = [getattr(conventions, n) for n in vars(conventions)]
    own = [f for f in functions if inspect.isfunction(f) and f.__module__ == conventions.__name__]
    rows = [
        (api.reference(f), md.escaped((inspect.getdoc(f) or "").partition("\n\n")[0], cell=True))
        for f in own
        if not f.__name__.startswith("_")
    ]
    return ["## The functions that hold them", md.table(("function", "what it is"), rows)]


def _sections() -> dict[str, str]:
    """Sections of CONTRIBUTING.md by heading."""
    text = (md.ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8")
    _, *sections = re.split(r"^## ", text, flags=re.M)
    parted = (section.partition("\n") for section in sections)
    return {head.strip(): words.strip() for head, _, words in parted}


def _glossary() -> str:
    """The field's words beside ours, from CONTRIBUTING.md, and the papers', from the code."""
    rows = [
        (md.escaped(words, cell=True), api.reference(thing), api.home(id(thing)).rpartition(".")[0])
        for thing, words in papers_words()
    ]
    table = md.table(("the papers say", "we say", "where"), rows)
    words = "What the docstrings of laws and events say under *Called*:"
    ours = api.linked(_sections()[GLOSSARY])
    return md.page("Glossary", ours, f"## The papers' words\n\n{words}", table)


def papers_words() -> list[tuple[Any, str]]:
    """Names of public functions and classes in the papers, as their docstrings say them."""
    things = {id(thing): thing for thing in api.public_names().values()}
    said = ((thing, _CALLED.search(inspect.getdoc(thing) or "")) for thing in things.values())
    return [(thing, " ".join(found[1].split())) for thing, found in said if found]


def _adding() -> str:
    """How to add an event, a law, a row, a figure: that section of CONTRIBUTING.md."""
    text = api.linked(_sections()[ADDING])
    headed = re.sub(r"^\*\*(.+?)\.?\*\*\.? *", r"## \1\n\n", text, flags=re.M)
    words = (
        "What a new part of the library has with it. Files that must lie beside each other, and in "
        "which order imports run: [contributing](contributing.md)."
    )
    return md.page("How to add an event, a law, a lobe, a row, a figure", words, headed)


def _contributing() -> str:
    """CONTRIBUTING.md but for the glossary and what is added how, which have their pages."""
    elsewhere = (GLOSSARY, ADDING)
    sections = [f"## {h}\n\n{words}" for h, words in _sections().items() if h not in elsewhere]
    words = (
        "Commands, the layout, honesty and style. [How to add](adding.md) an event, a law, a row "
        "of the ledger, a figure. Our words: [glossary](glossary.md)."
    )
    return md.page("Contributing", words, *map(api.linked, sections))


def _examples() -> str:
    """Every example, whole."""
    words = (
        "Short scripts to start from; each is run and judged by "
        f"{md.file_link(md.ROOT / 'tests/test_examples.py')}."
    )
    parts = []
    for file in sorted((md.ROOT / "examples").glob("*.py")):
        text = file.read_text(encoding="utf-8")
        name = file.relative_to(md.ROOT).as_posix()
        parts += [f"## {file.stem}", f"`python {name}`", md.fence(text, "python")]
    return md.page("Examples", words, *parts)


def _notebooks() -> str:
    """Every notebook by its title, with what its first words say and how it is run."""
    words = (
        "Notebooks with sliders, for [marimo](https://marimo.io): `make venv` installs it, and so "
        "does `pip install 'firstorder[notebooks]'`. `marimo run FILE` opens one in the browser "
        "with its sliders, `marimo edit FILE` with its code; `make notebooks` writes copies for "
        "Jupyter into `notebooks/ipynb`. The pictures are what each draws when it is opened."
    )
    parts = []
    for file in sorted((md.ROOT / "notebooks").glob("*.py")):
        title, said = _told(file)
        name = file.relative_to(md.ROOT).as_posix()
        shown = [_picture(title, picture) for picture in notebook_pictures.of(file.stem)]
        command = md.fence(f"marimo run {name}", "bash")
        parts += [f"## {title}", said, *shown, command, md.file_link(file)]
    return md.page("Notebooks", words, *(part for part in parts if part))


def _picture(title: str, picture: pathlib.Path) -> str:
    return f"![{md.escaped(title)}](../{picture.relative_to(md.ROOT / 'docs').as_posix()})"


def _told(file: pathlib.Path) -> tuple[str, str]:
    """A notebook's title, and its first paragraph of words."""
    tree = ast.parse(file.read_text(encoding="utf-8"))
    strings = [n.value for n in ast.walk(tree) if isinstance(n, ast.Constant)]
    texts = [textwrap.dedent(s).strip() for s in strings if isinstance(s, str)]
    titles = [
        k.value.value
        for n in ast.walk(tree)
        if isinstance(n, ast.Call)
        for k in n.keywords
        if k.arg == "app_title" and isinstance(k.value, ast.Constant)
    ]
    paragraphs = [p for text in texts if text.startswith("# ") for p in text.split("\n\n")[1:]]
    return str(titles[0]) if titles else file.stem, paragraphs[0] if paragraphs else ""
