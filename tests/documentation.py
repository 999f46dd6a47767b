"""What the docstrings of public names say, and what they would have to say.

A public name is a function or class that a package exports, or a public class method or static
method by which a class of these is made (`Scene.of`). The rules, for each kind of statement:

- **shapes**: it takes, keeps or gives arrays. Said for one by an annotation with a shape
  (`Float[Array, "n 2"]`, or a name for one), or by a word for a shape where it is described.
- **units**: it takes, keeps or gives a physical quantity, by the names in `QUANTITIES`, outside the
  chapters of pure mathematics. Said by a unit (`[m]`, `[W/m^2]`, "radians", "cycles per") in the
  description of each such argument, or once before the list of arguments for all of them; that of
  a result anywhere.
- **errors**: its body, or what it calls directly, raises `ValueError` or `Refused`, or its body
  `TypeError`, which from a call only says again what the annotations say. Private functions of its
  module, and checks of arguments, count as part of the body. Said by the exception's name under
  `Raises:`.
- **source**: a row of the ledger says that it implements an equation of a paper. Said by the
  paper's name and a number or a section beside it.
- **example**: every function, and every class that is made by hand; not protocols, abstract
  classes, exceptions, and records that only functions make (nothing outside the library calls
  them). Said by an example, run as a doctest, in which the name stands.
"""

from __future__ import annotations

import ast
import dataclasses
import functools
import importlib
import inspect
import pathlib
import re
import sys
import typing
from collections.abc import Callable, Iterator
from typing import Any

import jaxtyping

from derivations import table
from docs.generate.api import home, public_names

ROOT = pathlib.Path(__file__).parent.parent
PAPERS = ("R07", "J12", "E11", "D05")
SECTIONS = r"(?:Args|Attributes|Raises|Returns|Yields|Example|Reference|Called)"


@dataclasses.dataclass(frozen=True)
class Public:
    """A public name: where it is described, its syntax, and its docstring."""

    name: str  # dotted, the shortest that users write
    module: str  # where it is written
    own: str  # its name there, of a method with its class
    node: ast.FunctionDef | ast.ClassDef
    thing: Any

    @property
    def doc(self) -> str:
        return ast.get_docstring(self.node) or ""

    @property
    def file(self) -> str:
        return str(pathlib.Path(sys.modules[self.module].__file__ or "").relative_to(ROOT))

    @property
    def chapter(self) -> str:
        return self.name.split(".")[1]


# --- the names -----------------------------------------------------------------------------------


@functools.cache
def names() -> tuple[Public, ...]:
    """All public names, each once."""
    found = []
    for dotted, thing in public_names().items():
        if not (inspect.isclass(thing) or inspect.isroutine(thing)) or home(id(thing)) != dotted:
            continue
        name = _found(dotted, thing)
        if name is not None:
            found.append(name)
            found += makers(name)
    return tuple(found)


def _found(dotted: str, thing: Any) -> Public | None:
    """A function or class with its syntax; other callables, such as types, have none."""
    node = definitions(thing.__module__).get(thing.__qualname__)
    return node and Public(dotted, thing.__module__, thing.__qualname__, node, thing)


def makers(cls: Public) -> Iterator[Public]:
    """The public class methods and static methods that return one of a class."""
    for node in cls.node.body if isinstance(cls.node, ast.ClassDef) else ():
        if isinstance(node, ast.FunctionDef) and not node.name.startswith("_"):
            kinds = {ast.unparse(d) for d in node.decorator_list}
            made = re.findall(r"\w+", ast.unparse(node.returns)) if node.returns else []
            if kinds & {"classmethod", "staticmethod"} and {cls.own, "Self"} & set(made):
                own = f"{cls.own}.{node.name}"
                yield Public(f"{cls.name}.{node.name}", cls.module, own, node, None)


@functools.cache
def definitions(module: str) -> dict[str, Any]:
    """Functions and classes of a module by their names, methods after the name of their class."""
    source = inspect.getsource(importlib.import_module(module))
    kinds = (ast.FunctionDef, ast.ClassDef)
    found: dict[str, Any] = {n.name: n for n in ast.parse(source).body if isinstance(n, kinds)}
    for name, node in list(found.items()):
        found |= {f"{name}.{n.name}": n for n in node.body if isinstance(n, ast.FunctionDef)}
    return found


# --- parts of a docstring ------------------------------------------------------------------------


def section(doc: str, head: str) -> str:
    """Text under a head, or beside it."""
    found = re.search(rf"^{head}:(.*?)(?=^{SECTIONS}:|\Z)", doc, re.S | re.M)
    return found[1] if found else ""


def prose(doc: str) -> str:
    """Text before the first head."""
    return re.split(rf"^{SECTIONS}:", doc, maxsplit=1, flags=re.M)[0]


def entries(doc: str) -> dict[str, str]:
    """Descriptions of arguments and attributes by their names."""
    text = inspect.cleandoc("\n" + section(doc, "Args") + "\n" + section(doc, "Attributes"))
    found = re.findall(r"^(\*{0,2}\w+(?:, \*{0,2}\w+)*): (.*?)(?=^\S|\Z)", text, re.S | re.M)
    return {n.strip().lstrip("*"): words for ns, words in found for n in ns.split(",")}


# --- shapes --------------------------------------------------------------------------------------

# Words for a shape before the list of arguments, for all of them, and in the description of one.
SHAPES = re.compile(r"\bshapes?\b|\barrays?\b|\bbroadcast|\bnumbers, or\b", re.I)
SHAPE = re.compile(
    rf"{SHAPES.pattern}|\([\w.*]+,[\w ,.*]*\)|\bnumbers?\b|\bscalars?\b|\bvectors?\b|\bmatri\w+",
    re.I,
)
LOOSE = ("Array", "ArrayLike", "RealLike", "ndarray")


def arguments(of: Public) -> dict[str, ast.expr]:
    """Annotations of public arguments or fields by name, and of the result under "return"."""
    node = of.node
    if isinstance(node, ast.ClassDef):
        fields = [n for n in node.body if isinstance(n, ast.AnnAssign)]
        found = {ast.unparse(f.target): f.annotation for f in fields}
        init = definitions(of.module).get(f"{of.own}.__init__")
        found |= arguments(dataclasses.replace(of, node=init)) if init else {}
    else:
        a = node.args
        listed = [*a.posonlyargs, *a.args, *a.kwonlyargs, *filter(None, [a.vararg, a.kwarg])]
        found = {p.arg: p.annotation for p in listed if p.annotation}
        found |= {"return": node.returns} if node.returns else {}
    return {n: a for n, a in found.items() if not n.startswith("_")}


def array_kinds(of: Public, annotation: ast.AST) -> set[str]:
    """Of "shaped" and "loose", those arrays that an annotation names; functions are passed over."""
    if isinstance(annotation, ast.Constant) and isinstance(annotation.value, str):
        return array_kinds(of, ast.parse(annotation.value, mode="eval").body)
    if isinstance(annotation, ast.Subscript):
        head = ast.unparse(annotation.value)
        if head in ("Callable", "ClassVar", "Literal"):
            return set()
        if is_jaxtyping(vars(sys.modules[of.module]).get(head)):
            return {"shaped"}
    if isinstance(annotation, (ast.Name, ast.Attribute)):
        name = ast.unparse(annotation).rpartition(".")[2]
        if name in LOOSE:
            return {"loose"}
        return {"shaped"} if holds_shape(vars(sys.modules[of.module]).get(name)) else set()
    return set().union(*(array_kinds(of, c) for c in ast.iter_child_nodes(annotation)))


def is_jaxtyping(kind: Any) -> bool:
    return inspect.isclass(kind) and kind in vars(jaxtyping).values()


def holds_shape(kind: Any) -> bool:
    """Whether a name for a type, such as `Scalar`, stands for arrays of one shape."""
    if getattr(kind, "dim_str", None) is not None:
        return True
    return any(holds_shape(k) for k in typing.get_args(kind)) and not inspect.isclass(kind)


def wants_shapes(of: Public) -> bool:
    return any(array_kinds(of, a) for a in arguments(of).values())


def without_shape(of: Public) -> list[str]:
    """Arguments, fields or "return" whose shape nobody says."""
    told, before = entries(of.doc), prose(of.doc)
    told["return"] = section(of.doc, "Returns")
    loose = [n for n, a in arguments(of).items() if array_kinds(of, a) == {"loose"}]
    return [n for n in loose if not (SHAPE.search(told.get(n, "")) or SHAPES.search(before))]


# --- units ---------------------------------------------------------------------------------------

# Names of arguments, fields and (as a word of it) functions that stand for physical quantities.
LENGTHS = """
    distance distances d depth radius radii position positions origin origins x height width side
    spacing centre center corner corners vertices thickness period wavelength curvature curvatures
    kappa
"""
ANGLES = "theta phi angle angles azimuth azimuths elevation incidence turn sigma"
LIGHT = "radiance emission irradiance intensity L E flux radiosity"
FREQUENCIES = "frequency frequencies omega Omega cutoff bandwidth time"
QUANTITIES = frozenset(f"{LENGTHS} {ANGLES} {LIGHT} {FREQUENCIES}".split())
# Chapters of mathematics: a field's x has the units that its user gives it.
PURE = {"numerics", "laws", "symbolic", "ledger", "checks", "sampling", "typing", "errors"}
UNIT = re.compile(
    r"\[[^\]\n]*\b(m|rad|sr|W|Hz|s|unit|units|pixels?|cycles|degrees|nm|1)\b[^\]\n]*\]|\bradians?\b"
    r"|\bcycles per\b|\bmetres?\b|\binch(es)?\b|\bunits? of\b|\bpixels?\b|\bno unit\b|\bdegrees\b"
)
NUMBERS = re.compile(r"\b(Array|ArrayLike|RealLike|float|ndarray|Scalar|Vector|Ray|Frequency)\b")


def quantities(of: Public) -> list[str]:
    """Arguments and fields that are physical quantities, and "return" if the function is one."""
    if of.chapter in PURE:
        return []
    typed = {n: a for n, a in arguments(of).items() if NUMBERS.search(ast.unparse(a))}
    found = [n for n in typed if n in QUANTITIES]
    words = set(of.own.rpartition(".")[2].split("_"))
    return found + ["return"] * bool("return" in typed and words & QUANTITIES)


def wants_units(of: Public) -> bool:
    return bool(quantities(of))


def without_unit(of: Public) -> list[str]:
    told = entries(of.doc)
    before = prose(of.doc)
    told["return"] = section(of.doc, "Returns")
    return [n for n in quantities(of) if not UNIT.search(told.get(n, "") + before)]


# --- errors --------------------------------------------------------------------------------------

RAISED = {"ValueError", "TypeError", "Refused"}
# Whose own call gives what it calls no reason to refuse.
NEVER = {
    "checks.by_conversion": "the samples that it transforms fill their grid",
    "checks.sampler_p_value": "the counts that it compares have one sum",
    "flatland.bounces.final_gather": "it asks for one receiver at a time",
    "imaging.facet_gbuffer": "its blocks have a size",
    "imaging.gbuffer": "its blocks have a size",
    "shadowfield.scene_blockers": "its blocks have a size",
    "shadowfield.visible_lengths": "it asks for one receiver at a time",
}


def bodies(of: Public) -> list[ast.AST]:
    """Functions that run when a name is called: itself; of a class those that make and check one.

    Without arguments there is nothing to refuse.
    """
    if isinstance(of.node, ast.FunctionDef):
        return [of.node] if of.node.args.args or of.node.args.kwonlyargs else []
    inits = ("__init__", "__post_init__", "__check_init__")
    return [n for n in of.node.body if isinstance(n, ast.FunctionDef) and n.name in inits]


def raised(
    module: str, body: ast.AST, depth: int = 1, seen: frozenset[Any] = frozenset()
) -> set[str]:
    """Names of exceptions that a body raises, or what it calls, as deep as is asked."""
    found = set()
    for node in passing(body):
        if isinstance(node, ast.Raise) and isinstance(node.exc, ast.Call):
            found |= {ast.unparse(node.exc.func)} & RAISED
        elif isinstance(node, ast.Call):
            called = vars(sys.modules[module]).get(ast.unparse(node.func))
            found |= raised_by(module, called, depth, seen)
    return found


def passing(node: ast.AST) -> Iterator[ast.AST]:
    """A piece of syntax with all inside of it from which an exception gets out."""
    yield node
    caught = node.body if isinstance(node, ast.Try) and node.handlers else []
    for inside in ast.iter_child_nodes(node):
        if inside not in caught:
            yield from passing(inside)


def raised_by(module: str, called: Any, depth: int, seen: frozenset[Any]) -> set[str]:
    """Errors of a call of one of the library's own functions or classes."""
    if called in seen or not (inspect.isroutine(called) or inspect.isclass(called)):
        return set()
    there = called.__module__ or ""
    node = definitions(there).get(called.__qualname__) if there.startswith("firstorder.") else None
    if node is None:
        return set()
    near = there == module and called.__name__.startswith("_")
    near |= called.__name__.startswith(("check_", "require_"))
    if depth < 1 and not near:
        return set()
    of = Public("", there, called.__qualname__, node, called)
    left, seen = (depth if near else depth - 1), seen | {called}
    found = set().union(*(raised(there, body, left, seen) for body in bodies(of)))
    return found if there == module else found - {"TypeError"}


@functools.cache
def exceptions(of: Public) -> frozenset[str]:
    return frozenset().union(*(raised(of.module, body) for body in bodies(of)))


def wants_errors(of: Public) -> bool:
    return bool(exceptions(of)) and of.name.removeprefix("firstorder.") not in NEVER


def without_error(of: Public) -> list[str]:
    said = section(of.doc, "Raises")
    return sorted(e for e in exceptions(of) if not re.search(rf"\b{e}\b", said))


# --- sources -------------------------------------------------------------------------------------


@functools.cache
def implemented() -> dict[str, set[str]]:
    """Equations of the papers by the name that implements them, as the ledger has it."""
    found: dict[str, set[str]] = {}
    for _, row in table().values():
        if row.implements and row.equation.split(".")[0] in PAPERS:
            found.setdefault(row.implements, set()).add(row.equation)
    return found


def equations(of: Public) -> set[str]:
    """Equations that a name implements; a class also by its methods."""
    own = (of.name, f"{of.module}.{of.own}")
    is_class = isinstance(of.node, ast.ClassDef)
    return {
        e
        for there, es in implemented().items()
        if there in own or (is_class and there.rpartition(".")[0] in own)
        for e in es
    }


def wants_source(of: Public) -> bool:
    return bool(equations(of))


def without_source(of: Public) -> list[str]:
    papers = {e.split(".")[0] for e in equations(of)}
    beside = r"[^\n]{0,80}?(\beqs?\b|§|\(\d|\bFig|\bTable\b|\bAlg|\bfootnote|\bApp\b)"
    return sorted(equations(of)) * (not any(re.search(p + beside, of.doc) for p in papers))


# --- examples ------------------------------------------------------------------------------------


FOLDERS = ("tests", "figures", "docs", "examples", "notebooks", "benchmarks", "gallery")
BUILT = "_build"  # the site, which carries copies of scripts


@functools.cache
def called_outside() -> frozenset[int]:
    """Things that are called by name outside the library, each by its id."""
    files = [f for folder in FOLDERS for f in (ROOT / folder).rglob("*.py") if BUILT not in f.parts]
    return frozenset(i for f in files for i in called_in(ast.parse(f.read_text("utf-8"))))


def called_in(tree: ast.Module) -> Iterator[int]:
    """Things of the library that a file calls: a name that it imports, or one of a chapter's."""
    ours = {}
    nodes = list(ast.walk(tree))
    for node in nodes:
        if isinstance(node, ast.ImportFrom) and (node.module or "").split(".")[0] == "firstorder":
            module = importlib.import_module(node.module or "")
            ours |= {a.asname or a.name: getattr(module, a.name, None) for a in node.names}
    for node in nodes:
        if isinstance(node, ast.Call):
            *chapter, name = ast.unparse(node.func).split(".")
            yield id(getattr(ours.get(chapter[0]), name, None) if chapter else ours.get(name))


def wants_example(of: Public) -> bool:
    if not isinstance(of.node, ast.ClassDef):
        return True
    protocol = getattr(of.thing, "_is_protocol", False)
    if protocol or inspect.isabstract(of.thing) or issubclass(of.thing, BaseException):
        return False
    return id(of.thing) in called_outside()


def without_example(of: Public) -> list[str]:
    """The name itself, if no example uses it; how a class is made, its own example may show."""
    cls, _, last = of.own.rpartition(".")
    doc = of.doc + (ast.get_docstring(definitions(of.module)[cls]) or "" if cls else "")
    lines = re.findall(r"^\s*(?:>>>|\.\.\.) .*$", doc, re.M)
    return [] if any(re.search(rf"\b{last}\b", line) for line in lines) else [last]


# --- the table -----------------------------------------------------------------------------------

Rule = tuple[Callable[[Public], bool], Callable[[Public], list[str]]]
KINDS: dict[str, Rule] = {
    "shapes": (wants_shapes, without_shape),
    "units": (wants_units, without_unit),
    "errors": (wants_errors, without_error),
    "source": (wants_source, without_source),
    "example": (wants_example, without_example),
}


def wanted(kind: str) -> list[Public]:
    """The names to which a kind of statement applies."""
    return [of for of in names() if KINDS[kind][0](of)]


def missing(kind: str) -> dict[Public, list[str]]:
    """Those of them that do not say it, with what is missing."""
    found = {of: KINDS[kind][1](of) for of in wanted(kind)}
    return {of: lacks for of, lacks in found.items() if lacks}


def report() -> str:
    """The table, and the names that lack something by file."""
    lines = [f"{len(names())} public names", "kind      applies   says  percent"]
    for kind in KINDS:
        n, lacking = len(wanted(kind)), len(missing(kind))
        lines.append(f"{kind:8} {n:8} {n - lacking:6} {100 * (n - lacking) / n:8.1f}")
    for kind in KINDS:
        lines += ["", kind]
        for of, lacks in sorted(missing(kind).items(), key=lambda pair: pair[0].file):
            lines.append(f"  {of.file}: {of.own} ({', '.join(lacks)})")
    return "\n".join(lines)


if __name__ == "__main__":
    print(report())
