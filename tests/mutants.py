"""Random faults of one token in the library, and whether the test that mirrors the file sees them.

    make mutants                                    60 faults, in a copy of the tree
    python -m tests.mutants 300 --seed 1 --jobs 2   more of them, others

A fault is a sign, a factor of two, an exponent, a comparison, another index, a name for its twin
(`min` for `max`), two arguments or two branches of `where` changed over, or a term dropped. For
each the doctests of the file run, and its mirrored test, or where it has none the tests that import
it and those of the modules that do. A fault that they do not see is printed: the test is weak
there, or the fault changes nothing. Nothing is written into this tree.
"""

from __future__ import annotations

import argparse
import ast
import compileall
import concurrent.futures
import functools
import multiprocessing
import os
import pathlib
import queue
import random
import resource
import shutil
import subprocess
import sys
import tempfile
import threading
from collections.abc import Iterator
from multiprocessing import connection
from multiprocessing.context import ForkServerContext
from typing import NamedTuple, NoReturn

import pytest

from tests.shape_checks import SWITCH

ROOT = pathlib.Path(__file__).parent.parent
# Seconds of processor time, so that a busy machine decides nothing; a fault that runs on is seen.
LIMIT = 600
# What tests import of others takes longer than most tests that see a fault, so it is imported once
# for all. Nothing of this tree, whose files have the fault, and nothing that starts threads of JAX.
# fmt: off
COMMON = ("jax.numpy", "jax.scipy.special", "scipy.integrate", "scipy.interpolate",
          "scipy.optimize", "scipy.spatial", "sympy", "equinox", "matplotlib", "numba",
          "hypothesis", "pytest")
# fmt: on
ASKING = threading.Lock()
# Folders that show, judge or speak: a fault there is no wrong number.
APART = ("checks", "cli", "ledger", "plotting")

SWAPPED = {ast.Add: "-", ast.Sub: "+", ast.Mult: "/", ast.Div: "*", ast.Pow: "*"}
TOKENS = {ast.Add: "+", ast.Sub: "-", ast.Mult: "*", ast.Div: "/", ast.Pow: "**"}
COMPARED = {ast.Lt: ("<", ">"), ast.Gt: (">", "<"), ast.LtE: ("<=", ">="), ast.GtE: (">=", "<="),
            ast.Eq: ("==", "!="), ast.NotEq: ("!=", "==")}  # fmt: skip
# fmt: off
TWINS = {"min": "max", "minimum": "maximum", "argmin": "argmax", "sin": "cos", "any": "all",
         "floor": "ceil", "sinh": "cosh", "cumsum": "cumprod", "logical_and": "logical_or"}
# fmt: on
TWINS |= {other: one for one, other in TWINS.items()}
# Their first two arguments may be changed over.
COMMUTE = {*TWINS, "add", "multiply", "hypot", "dot", "isclose", "allclose", "equal", "zip",
           "isinstance", "getattr", "vmap", "jit"}  # ... or end the program at once  # fmt: skip


class Fault(NamedTuple):
    """A place in a file, and what stands there instead.

    Attributes:
        path: of the file, from the root.
        start: of the text that is replaced, in characters.
        end: behind it.
        text: what stands there instead.
    """

    path: str
    start: int
    end: int
    text: str

    def applied(self, source: str) -> str:
        """The file with the fault in it."""
        return source[: self.start] + self.text + source[self.end :]

    def told(self, source: str) -> str:
        """Place and change in one line."""
        line = source.count("\n", 0, self.start)
        before, after = source.splitlines()[line], self.applied(source).splitlines()[line]
        return f"{self.path}:{line + 1}:\n  - {before.strip()}\n  + {after.strip()}"


# --- where faults can be -------------------------------------------------------------------------


def faults_in(path: str, source: str) -> list[Fault]:
    """All faults that a file can have, in the bodies of its functions."""
    lines = [0]
    for line in source.splitlines(keepends=True):
        lines.append(lines[-1] + len(line.encode()))
    raw = source.encode()

    def place(line: int, column: int) -> int:
        return len(raw[: lines[line - 1] + column].decode())

    def span(node) -> tuple[int, int]:
        return (
            place(node.lineno, node.col_offset),
            place(node.end_lineno, node.end_col_offset),
        )

    found, tree = [], ast.parse(source)
    indices = set(_indices(tree))
    for node in _computing(tree):
        for start, end, text in _changes(node, source, span, node in indices):
            if source[start:end] != text:
                found.append(Fault(path, start, end, text))
    return found


def _computing(tree: ast.Module) -> Iterator[ast.AST]:
    """Expressions that compute: no annotation, no docstring, no message of an error."""
    for function in ast.walk(tree):
        if isinstance(function, (ast.FunctionDef, ast.Lambda)):
            body = function.body if isinstance(function.body, list) else [function.body]
            for statement in body:
                yield from _below(statement)


def _below(node: ast.AST) -> Iterator[ast.AST]:
    spoken = isinstance(node, ast.Call) and getattr(node.func, "attr", "") == "warn"
    if spoken or isinstance(node, (ast.Raise, ast.FunctionDef, ast.Lambda, ast.JoinedStr)):
        return
    yield node
    for name, child in ast.iter_fields(node):
        if name in ("annotation", "decorator_list", "returns"):
            continue
        for one in child if isinstance(child, list) else [child]:
            if isinstance(one, ast.AST):
                yield from _below(one)


def _indices(tree: ast.Module) -> Iterator[ast.AST]:
    """What stands alone in brackets, or between their commas."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Subscript):
            yield from node.slice.elts if isinstance(node.slice, ast.Tuple) else [node.slice]


def _changes(node: ast.AST, source: str, span, index: bool) -> Iterator[tuple[int, int, str]]:
    """Changes that a node allows: start, end, and the text instead."""
    match node:
        case ast.BinOp(left, op, right) if type(op) in TOKENS:
            if isinstance(left, (ast.Constant, ast.JoinedStr)) and not _is_number(left):
                return  # text
            begin, end = span(node)
            at = source.find(TOKENS[type(op)], span(left)[1], span(right)[0])
            if at >= 0:
                yield at, at + len(TOKENS[type(op)]), SWAPPED[type(op)]
                if isinstance(op, (ast.Add, ast.Sub)):
                    yield begin, end, source[begin:at].rstrip()
        case ast.UnaryOp(ast.USub() | ast.Not() as op):
            start, _ = span(node)
            yield start, start + len("-" if isinstance(op, ast.USub) else "not"), ""
        case ast.Constant(int() | float() as value) if _is_number(node):
            # Past the end JAX reads the last entry, so that a larger index may change nothing.
            yield *span(node), repr(type(value)(0 if index and value else 2 * value or 1))
        case ast.Compare(left, [op], [right]) if type(op) in COMPARED:
            old, new = COMPARED[type(op)]
            at = source.find(old, span(left)[1], span(right)[0])
            if at >= 0:
                yield at, at + len(old), new
        case ast.BoolOp(op, [left, right, *_]):
            old, new = ("and", "or") if isinstance(op, ast.And) else ("or", "and")
            at = source.find(old, span(left)[1], span(right)[0])
            if at >= 0:
                yield at, at + len(old), new
        case ast.Call(ast.Attribute(attr=name) | ast.Name(id=name) as function, arguments):
            if name in TWINS:
                end = span(function)[1]
                yield end - len(name), end, TWINS[name]
            first = 1 if name == "where" else 0
            two = arguments[first : first + 2]
            if name in COMMUTE or name.startswith("check_") or len(two) < 2:
                return
            if not any(isinstance(a, (ast.Starred, ast.Lambda)) for a in two):
                (a, b), (c, d) = span(two[0]), span(two[1])
                yield a, d, source[c:d] + source[b:c] + source[a:b]


def _is_number(node: ast.AST) -> bool:
    return isinstance(node, ast.Constant) and type(node.value) in (int, float)


def all_faults() -> list[Fault]:
    """Every fault of every file of the library."""
    found = []
    for file in sorted((ROOT / "src" / "firstorder").rglob("*.py")):
        parts = file.relative_to(ROOT / "src" / "firstorder").parts
        if parts[0] not in APART and file.name != "__init__.py":
            source = file.read_text(encoding="utf-8")
            found += faults_in(str(file.relative_to(ROOT)), source)
    return found


# --- which tests should see them -----------------------------------------------------------------


def mirrored(path: str) -> pathlib.Path:
    """The test at the mirrored path of a file of the library."""
    *folders, stem = pathlib.Path(path).with_suffix("").parts[2:]
    return pathlib.Path("tests", *(f.lstrip("_") for f in folders), f"test_{stem.lstrip('_')}.py")


def judges_of(path: str, root: pathlib.Path = ROOT) -> list[str]:
    """The file's own doctests and its mirrored test.

    Where it has none, the tests that import it and those of the modules that do; where there is no
    such test either, those of its chapter.
    """
    own = mirrored(path)
    if (root / own).exists():
        return [path, str(own)]
    module = ".".join(pathlib.Path(path).with_suffix("").parts[1:])
    users = [f for f in (root / "src" / "firstorder").rglob("*.py") if _imports(f, module)]
    theirs = {mirrored(str(user.relative_to(root))) for user in users}
    theirs = {test for test in theirs if (root / test).exists()}
    direct = (f for f in (root / "tests").rglob("test_*.py") if _imports(f, module))
    theirs |= {test.relative_to(root) for test in direct}
    chapter = (test.relative_to(root) for test in (root / own).parent.glob("test_*.py"))
    return [path, *sorted(map(str, theirs or chapter))]


def _imports(file: pathlib.Path, module: str) -> bool:
    """Whether a file imports a module by name, or something from it."""
    chapter, _, stem = module.rpartition(".")
    if stem not in (source := file.read_text(encoding="utf-8")):
        return False
    return any(
        node.module == module
        or (node.module == chapter and any(name.name == stem for name in node.names))
        for node in ast.walk(ast.parse(source))
        if isinstance(node, ast.ImportFrom)
    )


# --- trying them ---------------------------------------------------------------------------------


def is_seen(fault: Fault, tree: pathlib.Path, limit: int = LIMIT) -> bool:
    """Whether tests fail in a copy of the tree with the fault in it, which is put right after."""
    file = tree / fault.path
    source = file.read_text(encoding="utf-8")
    file.write_text(fault.applied(source), encoding="utf-8")
    judge = _processes().Process(target=_judge, args=(tree, judges_of(fault.path, tree), limit))
    try:
        # Two threads that ask `multiprocessing` at once how a process ended may hear two answers.
        with ASKING:
            judge.start()
        connection.wait([judge.sentinel])
    finally:
        file.write_text(source, encoding="utf-8")
    with ASKING:
        return judge.exitcode not in (0, 5)  # 5: there is no test


@functools.cache
def _processes() -> ForkServerContext:
    """Processes that are forked from one that has already imported what all of them import."""
    os.environ.setdefault("MPLBACKEND", "Agg")  # as tests have it; matplotlib reads it once
    processes = multiprocessing.get_context("forkserver")
    processes.set_forkserver_preload([*COMMON])
    return processes


def _judge(tree: pathlib.Path, judges: list[str], limit: int) -> NoReturn:
    """Run tests in the copy of the tree that this process moves into, and end as they do."""
    resource.setrlimit(resource.RLIMIT_CPU, (limit, limit))
    for stream in (1, 2):
        os.dup2(os.open(os.devnull, os.O_WRONLY), stream)
    os.chdir(tree)
    for name in [name for name in sys.modules if name.partition(".")[0] == "tests"]:
        del sys.modules[name]  # this file came with them, and the copy has its own
    sys.path[:0] = [str(tree / "src"), str(tree)]
    sys.dont_write_bytecode = True  # or the next process might read the code of this one's fault
    os.environ |= {
        "PYTHONPATH": str(tree / "src"),
        "XLA_FLAGS": "--xla_backend_optimization_level=0",
        SWITCH: "off",  # types are judged by their own tool, and this starts sooner
    }
    options = ["-n", "0", "-q", "-x", "-p", "no:cacheprovider", f"--basetemp={tree / '.tmp'}"]
    options += ["-W", "ignore::pytest.PytestAssertRewriteWarning"]  # of plugins in `COMMON`
    sys.exit(pytest.main([*options, *judges]))


def copies(count: int, folder: pathlib.Path) -> list[pathlib.Path]:
    """Copies of what is committed and what is not yet, without what is ignored."""
    listed = ["git", "ls-files", "--cached", "--others", "--exclude-standard", "-z"]
    names = subprocess.run(listed, cwd=ROOT, check=True, capture_output=True, text=True).stdout
    trees = [folder / str(k) for k in range(count)]
    for tree in trees:
        for name in filter(None, names.split("\0")):
            if (ROOT / name).is_file():
                (tree / name).parent.mkdir(parents=True, exist_ok=True)
                shutil.copy(ROOT / name, tree / name)
        compileall.compile_dir(tree / "src", quiet=1)
    return trees


def main() -> int:
    """Try the faults that are asked for, and tell which were not seen."""
    parser = argparse.ArgumentParser(description="Random faults, and whether tests see them.")
    parser.add_argument("count", type=int, nargs="?", default=60)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--under", default="", help="only files whose path begins so")
    asked = parser.parse_args()
    known = [f for f in all_faults() if f.path.startswith(asked.under)]
    chosen = random.Random(asked.seed).sample(known, min(asked.count, len(known)))
    print(f"{len(chosen)} of {len(known)} faults, seed {asked.seed}", flush=True)
    survivors = 0
    with tempfile.TemporaryDirectory() as folder:
        free: queue.SimpleQueue[pathlib.Path] = queue.SimpleQueue()
        for tree in copies(asked.jobs, pathlib.Path(folder)):
            free.put(tree)

        def try_one(fault: Fault) -> tuple[Fault, bool]:
            tree = free.get()
            try:
                return fault, is_seen(fault, tree)
            finally:
                free.put(tree)

        with concurrent.futures.ThreadPoolExecutor(asked.jobs) as pool:
            for tried, (fault, seen) in enumerate(pool.map(try_one, chosen), 1):
                if not seen:
                    survivors += 1
                    source = (ROOT / fault.path).read_text(encoding="utf-8")
                    print(f"not seen: {fault.told(source)}", flush=True)
                if tried % 20 == 0:
                    print(f"... seen: {tried - survivors} of {tried}", flush=True)
    print(f"seen: {len(chosen) - survivors} of {len(chosen)}")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
