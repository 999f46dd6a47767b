"""Every annotation of the package, shapes included, is checked on every call of a test run.

A plugin of pytest (`-p tests.shape_checks` in pyproject.toml); with `SHAPE_CHECKS=off` in the
environment tests run what a user runs. As modules are imported, each of their functions is put
under beartype, which asks jaxtyping whether an array has its shape. Each call has a context of its
own, so that `n` is one number in all arguments and in what comes back.

jaxtyping's own import hook also says in its errors which dimension was which. For that it binds the
arguments of each call once more, checks them twice, and writes code for a nested function each time
that it is made: a third of the processor time of the whole suite, where this takes a tenth.
"""

from __future__ import annotations

import ast
import dataclasses
import functools
import importlib.machinery
import inspect
import os
import sys
from typing import ParamSpecArgs, ParamSpecKwargs

import pytest
from beartype import BeartypeConf, beartype
from jaxtyping import jaxtyped

PACKAGE = "firstorder"
SWITCH = "SHAPE_CHECKS"
_NAME = "_shape_checked_"
# What is wrong with a call is a `TypeError`, as it is to a user.
_by_beartype = beartype(conf=BeartypeConf(violation_type=TypeError))


def checked(thing):
    """A function whose annotations are checked, or a class whose `__init__`'s are."""
    if inspect.isclass(thing):
        if dataclasses.is_dataclass(thing) and not hasattr(thing.__init__, _NAME):
            thing.__init__ = checked(thing.__init__)
            setattr(thing.__init__, _NAME, True)
        return thing
    if not getattr(thing, "__annotations__", None):
        return thing
    if inspect.isgeneratorfunction(thing):  # beartype would ask when its first item is asked for
        return jaxtyped(thing, typechecker=_by_beartype)

    @functools.wraps(thing)
    def call(*args, **kwargs):
        __tracebackhide__ = True
        nonlocal asked
        asked = asked or _asked(thing)
        with jaxtyped("context"):
            return asked(*args, **kwargs)

    asked = None
    return call


def _asked(thing):
    """A function under beartype, when it is first called: by then its module knows all names."""
    hints = thing.__annotations__
    known = {name: _evaluated(hint, thing.__globals__) for name, hint in hints.items()}
    try:
        thing.__annotations__ = {name: hint for name, hint in known.items() if hint is not None}
        return _by_beartype(thing)
    finally:
        thing.__annotations__ = hints


def _evaluated(hint, names):
    """What an annotation stands for; None for one that names what only type checkers import.

    `*args: P.args` says what another function takes, and that one is checked itself.
    """
    if not isinstance(hint, str):
        return hint
    try:
        hint = eval(hint, names)
    except (NameError, AttributeError):
        return None
    return None if isinstance(hint, ParamSpecArgs | ParamSpecKwargs) else hint


# --- as modules are imported ---------------------------------------------------------------------


class _Decorating(ast.NodeTransformer):
    """Puts `checked` on every function, below other decorators, and on every class, above them."""

    def visit_FunctionDef(self, node: ast.FunctionDef) -> ast.AST:
        if any(isinstance(a, ast.arg) and a.annotation for a in ast.walk(node)) or node.returns:
            node.decorator_list.append(_decorator(node))
        return self.generic_visit(node)

    def visit_ClassDef(self, node: ast.ClassDef) -> ast.AST:
        node.decorator_list.insert(0, _decorator(node))
        return self.generic_visit(node)


def _decorator(node: ast.AST) -> ast.expr:
    return ast.copy_location(ast.Name(_NAME, ast.Load()), node)


class _Loader(importlib.machinery.SourceFileLoader):
    """Compiles a module with decorators put in, anew in each process: no `.pyc` holds them."""

    def get_code(self, fullname):
        path = self.get_filename(fullname)
        return self.source_to_code(self.get_data(path), path)

    def source_to_code(self, data, path, *, _optimize=-1):
        tree = _Decorating().visit(ast.parse(data, path))
        return compile(ast.fix_missing_locations(tree), path, "exec", dont_inherit=True)

    def exec_module(self, module):
        setattr(module, _NAME, checked)
        super().exec_module(module)


class _Finder:
    """Finds the package's modules as Python does, and gives them the loader above."""

    @staticmethod
    def find_spec(fullname, path=None, target=None):
        if fullname.partition(".")[0] != PACKAGE:
            return None
        spec = importlib.machinery.PathFinder.find_spec(fullname, path, target)
        if spec is not None and isinstance(spec.loader, importlib.machinery.SourceFileLoader):
            spec.loader = _Loader(fullname, spec.origin)
        return spec


# --- as a plugin ---------------------------------------------------------------------------------


@pytest.hookimpl(tryfirst=True)
def pytest_load_initial_conftests(early_config, parser, args):
    """Before anything imports the package."""
    if os.environ.get(SWITCH) != "off":
        assert PACKAGE not in sys.modules, f"{PACKAGE} was imported before it could be checked"
        sys.meta_path.insert(0, _Finder)
