"""The API: a page for each chapter, with every public name, its signature and its docstring."""

from __future__ import annotations

import ast
import functools
import importlib
import inspect
import pathlib
import pkgutil
import re
import types
from typing import Any

import firstorder
from docs.generate import markdown as md
from docs.generate.docstrings import told
from firstorder import conventions

FOLDER = "api"
# Names that a signature shows in place of what they are.
_CONSTANTS = {id(v): k for k, v in vars(conventions).items() if isinstance(v, conventions.Frame)}
_PARAMETER = inspect.Parameter


def pages() -> dict[str, str]:
    """A page for each package that exports something, and one that lists them."""
    found = {f"{FOLDER}/{name}.md": _chapter(name) for name in chapters()}
    described = [f"- [`{n}`]({n}.md): {_summary(_module(n))}" for n in chapters()]
    listing = md.toctree(chapters(), hidden=True)
    text = (
        "Every public name, by the package that exports it. `import firstorder` loads none of them."
    )
    found[f"{FOLDER}/index.md"] = md.page("API", text, "\n".join(described), listing)
    return found


@functools.cache
def chapters() -> tuple[str, ...]:
    """Public modules with `__all__`, below `firstorder`, and the few that are one file."""
    walk = pkgutil.walk_packages(firstorder.__path__, "firstorder.")
    public = [i.name for i in walk if i.ispkg and "._" not in i.name and ".cases" not in i.name]
    packages = [n for n in public if getattr(importlib.import_module(n), "__all__", ())]
    names = [n.removeprefix("firstorder.") for n in packages]
    return tuple(sorted([*names, "conventions", "errors", "session", "typing"]))


@functools.cache
def public_names() -> dict[str, Any]:
    """Everything that is exported, by its dotted name."""
    found = {}
    for chapter in chapters():
        module = _module(chapter)
        for name in getattr(module, "__all__", None) or _own(module):
            if not isinstance(getattr(module, name), types.ModuleType):
                found[f"{module.__name__}.{name}"] = getattr(module, name)
    return found


@functools.cache
def home(thing_id: int) -> str:
    """The dotted name under which a function or class is described: the shortest."""
    return min((k for k, v in public_names().items() if id(v) == thing_id), key=len, default="")


def reference(thing: Any, words: str = "") -> str:
    """A link to what is said of a public function or class, or its name alone."""
    there, name = home(id(thing)), words or thing.__name__
    return f"{{py:obj}}`{name} <{there}>`" if there else f"`{name}`"


def implementation(dotted: str) -> str:
    """A link to what is said of a dotted name, wherever it is written: a method's is its own."""
    parts = dotted.split(".")
    for cut in range(len(parts), 1, -1):
        try:
            thing = importlib.import_module(".".join(parts[:cut]))
        except ModuleNotFoundError:
            continue
        for k, part in enumerate(parts[cut:], cut + 1):
            thing = getattr(thing, part)
            if there := home(id(thing)):
                member = ".".join(parts[k:])
                known = inspect.isclass(thing) and member in dict(_members(thing))
                return f"{{py:obj}}`{dotted} <{f'{there}.{member}' if known else there}>`"
        break
    return f"`{dotted}`"


def linked(text: str) -> str:
    """Markdown in which names in backticks lead to what is said of them."""

    def link(found: re.Match) -> str:
        there = _by_ending().get(found[1], "")
        return f"{{py:obj}}`{found[1]} <{there}>`" if there else found[0]

    return re.sub(r"(?<![`}])`([A-Za-z][\w.]*)`(?!`)", link, text)


@functools.cache
def _by_ending() -> dict[str, str]:
    """Dotted names by every ending that means one thing only."""
    found: dict[str, set[str]] = {}
    for name, thing in public_names().items():
        parts = name.split(".")
        if inspect.isclass(thing) or inspect.isfunction(thing):
            for k in range(len(parts)):
                found.setdefault(".".join(parts[k:]), set()).add(home(id(thing)))
    # A small letter alone (`at`, `x`) is more often an argument than a function.
    return {k: next(iter(v)) for k, v in found.items() if len(v) == 1 and ("." in k or len(k) > 3)}


def _module(chapter: str) -> types.ModuleType:
    return importlib.import_module(f"firstorder.{chapter}")


def _own(module: types.ModuleType) -> list[str]:
    """Public functions and classes that a module without `__all__` defines, in its order."""
    tree = ast.parse(inspect.getsource(module))
    kinds = (ast.FunctionDef, ast.ClassDef)
    return [n.name for n in tree.body if isinstance(n, kinds) and not n.name.startswith("_")]


def _summary(module: types.ModuleType) -> str:
    return md.escaped((inspect.getdoc(module) or "").partition("\n\n")[0].replace("\n", " "))


def _chapter(chapter: str) -> str:
    """The page of a package."""
    module = _module(chapter)
    entries = [
        _entry(name, thing)
        for name, thing in public_names().items()
        if name.rpartition(".")[0] == module.__name__
    ]
    module_directive = f"```{{py:module}} {module.__name__}\n```"
    said = told(inspect.getdoc(module) or "", linked)
    return md.page(module.__name__, module_directive, said, *entries)


def _entry(name: str, thing: Any) -> str:
    """One public name: described where it is at home, and pointed to elsewhere."""
    if inspect.isclass(thing) or inspect.isroutine(thing):
        there = home(id(thing))
        if there != name:
            return f"`{name.rpartition('.')[2]}`: see {reference(thing, there)}."
        last = name.rpartition(".")[2]  # the page says the module
        return _class(last, thing) if inspect.isclass(thing) else _function(last, thing)
    return _directive("data", name.rpartition(".")[2], f":value: {_value(thing)}", "")


def _class(name: str, cls: type) -> str:
    body = [told(_doc(cls), linked, _types(cls)), _source(cls)]
    body += [_member(member, thing) for member, thing in _members(cls)]
    return _directive("class", name + _signature(cls), "", "\n\n".join(body))


def _member(name: str, thing: Any) -> str:
    """A method or a property of a class."""
    if isinstance(thing, (property, functools.cached_property)):
        return _directive("property", name, "", told(_doc(thing), linked), colons=4)
    kind = {classmethod: ":classmethod:", staticmethod: ":staticmethod:"}.get(type(thing), "")
    f = inspect.unwrap(getattr(thing, "__func__", thing))
    signature = _signature(f, bound=not isinstance(thing, staticmethod))
    return _directive("method", name + signature, kind, told(_doc(f), linked, _types(f)), colons=4)


def _members(cls: type):
    """Public methods and properties that a class defines itself and describes."""
    for name, thing in vars(cls).items():
        kinds = (property, functools.cached_property, classmethod, staticmethod)
        shown = isinstance(thing, kinds) or (callable(thing) and not inspect.isclass(thing))
        if shown and not name.startswith("_") and _doc(thing):
            yield name, thing


def _function(name: str, f: Any) -> str:
    body = f"{told(_doc(f), linked, _types(f))}\n\n{_source(f)}"
    return _directive("function", name + _signature(f), "", body)


def _directive(kind: str, signature: str, option: str, body: str, colons: int = 5) -> str:
    fence = ":" * colons
    lines = [f"{fence}{{py:{kind}}} {signature}", option, "", body, fence]
    return "\n".join(line for k, line in enumerate(lines) if line or k == 2)


def _doc(thing: Any) -> str:
    return inspect.getdoc(thing) or ""


def _value(thing: Any) -> str:
    """A constant as Python writes it, if it is short."""
    shown = " ".join(repr(thing).split())
    return shown if len(shown) <= 100 else f"{shown[:100]} ..."


def _signature(f: Any, bound: bool = False) -> str:
    """Names and defaults; what is not an argument of a call is left out."""
    try:
        signature = inspect.signature(f)
    except (TypeError, ValueError):
        return "()"
    parameters = [
        p.replace(annotation=p.empty, default=_default(p)) for p in signature.parameters.values()
    ]
    plain = signature.replace(
        parameters=parameters[int(bound) :], return_annotation=inspect.Signature.empty
    )
    return str(plain)


class _Shown:
    """A default that shows itself by the words given."""

    def __init__(self, words: str):
        self.words = words

    def __repr__(self) -> str:
        return self.words


def _default(parameter: inspect.Parameter) -> Any:
    """The default as it may stand in a signature: what Python would read back, or dots."""
    value = parameter.default
    if value is _PARAMETER.empty:
        return value
    if id(value) in _CONSTANTS:
        return _Shown(_CONSTANTS[id(value)])
    if inspect.isroutine(value) or inspect.isclass(value):
        return _Shown(value.__name__)
    try:
        ast.parse(repr(value), mode="eval")
    except SyntaxError:
        return _Shown("...")
    return value


def _types(thing: Any) -> dict[str, str]:
    """Annotations by the name of the argument, as they are written."""
    f = vars(thing).get("__init__", thing) if inspect.isclass(thing) else inspect.unwrap(thing)
    notes = dict(getattr(f, "__annotations__", {})) | dict(getattr(thing, "__annotations__", {}))
    return {k: v for k, v in notes.items() if isinstance(v, str) and v != "Any" and "`" not in v}


def _source(thing: Any) -> str:
    """Where it is written."""
    try:
        file = inspect.getsourcefile(inspect.unwrap(thing))
    except TypeError:
        return ""
    path = pathlib.Path(file or "")
    return f"Source: {md.file_link(path, FOLDER)}" if md.ROOT in path.parents else ""
