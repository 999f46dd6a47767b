"""Attacks: a row that names a function must notice when that function is off.

The function is put out of true where it stands, by other code in the same function object: every
name, table, closure or method that holds it holds the wrong one, whenever it was bound. What was
computed or compiled before is forgotten for the time being, and afterwards all is as it was.
"""

from __future__ import annotations

import dataclasses
import importlib
import inspect
import math
import pathlib
import sys
import types
from collections.abc import Sequence
from typing import Any

from firstorder.ledger._out_of_true import Dial, turned
from firstorder.ledger._process_memory import forget, forgotten, layers
from firstorder.ledger.judging import judge_route
from firstorder.ledger.rows import NUMERIC, Check, Row

# Factors by which a result is off. A row must notice these two, a tenth of a per cent too much and
# too little: a bound from above that is far too wide lets one of them pass.
REQUIRED = (1.001, 0.999)
# Of a wrong sign it is only told whether a row notices: many a statement holds of either sign.
FACTORS = (*REQUIRED, -1.0)


@dataclasses.dataclass(frozen=True)
class Attacked:
    """The outcome of an attack on a row.

    Attributes:
        equation: of the row that was judged.
        implements: the name that was put out of true.
        reason: why the row is excepted; "" if it is not.
        noticed: by factor, the route that failed; "" if none did.
        called: whether any route called what the row names.
        refused: why it cannot be attacked; "" if it can.
    """

    equation: str
    implements: str
    reason: str
    noticed: dict[float, str]
    called: bool
    refused: str = ""

    @property
    def status(self) -> str:
        """Whether the row notices the factors that count, and if not why.

        Those of `REQUIRED` count; if none of them was tried, all that were.
        """
        if self.refused:
            return "cannot be attacked"
        counted = [route for factor, route in self.noticed.items() if factor in REQUIRED]
        counted = counted or list(self.noticed.values())
        if all(counted):
            return "notices, against its exception" if self.reason else "notices"
        if self.reason:
            return "excepted"
        if any(counted):
            return "notices in part"
        return "does not notice" if self.called else "does not call it"

    @property
    def sound(self) -> bool:
        """Whether the row notices, or is excepted and does not."""
        return self.status in ("notices", "excepted")

    def as_json(self) -> dict[str, Any]:
        """The object that `firstorder ledger --attack --json` writes."""
        return {
            "equation": self.equation,
            "implements": self.implements,
            "status": self.status,
            "noticed": {f"{factor:g}": route for factor, route in self.noticed.items()},
            "reason": self.reason,
        }

    def __str__(self) -> str:
        """One line: id, status, the routes that noticed, the name, the reason of an exception."""
        routes = "  ".join(f"{f:g}:{route or '-':11}" for f, route in self.noticed.items())
        line = f"{self.equation:26} {self.status:16} {routes}  {self.implements}"
        return f"{line}  {self.refused or self.reason}".rstrip()


def attack(rows: Sequence[Row], factors: Sequence[float] = FACTORS) -> list[Attacked]:
    """Judge rows that name one function, with all floating numbers of its results off by a factor.

    Of a class, the results of all its own public methods and properties are off; of one that has
    none, the numbers that it is made of. A function that is returned is off in its turn. Numeric
    routes alone are judged, up to the first that fails; a number must say so, for an exception or a
    NaN is a fault of the attack and not of what was found.

    Args:
        rows: of one `implements`, with numeric routes; `judge` them first, for one that fails as it
            is seems to notice.
        factors: by which results are multiplied, one after the other; of a row that notices, those
            of `REQUIRED` must all be noticed.

    Raises:
        ValueError: one sentence, if what the rows name does not exist or is no function or class.

    Example:
        >>> from firstorder.conventions import mirror_direction
        >>> from firstorder.ledger import Check, Row, attack
        >>> def error():
        ...     return abs(float(mirror_direction(0.3, 0.0)) + 0.3)
        >>> name = "firstorder.conventions.mirror_direction"
        >>> row = Row("T.3", "definition", name, brute_force=Check(error, 1e-9))
        >>> attack([row])[0].noticed
        {1.001: 'brute_force', 0.999: 'brute_force', -1.0: 'brute_force'}
    """
    functions = functions_of(rows[0].implements)
    folders = _folders(functions, rows)
    called, noticed = {r.equation: False for r in rows}, {r.equation: {} for r in rows}
    dial = Dial(1.0)
    with turned(functions, dial), forgotten(folders):
        for factor in factors:
            _turn(dial, factor, folders)
            for row in rows:
                dial.calls = 0
                before = noticed[row.equation].values()  # a route that noticed once goes first
                routes = sorted(NUMERIC, key=lambda route: route not in before)
                route = _first_to_notice(row, routes)
                if not route and not dial.calls:  # what an earlier row has called is remembered
                    forget(folders)
                    route = _first_to_notice(row, routes)
                noticed[row.equation][factor] = route
                called[row.equation] |= dial.calls > 0
    return [
        Attacked(r.equation, r.implements, r.unnoticed, noticed[r.equation], called[r.equation])
        for r in rows
    ]


def _turn(dial: Dial, factor: float, folders: Sequence[pathlib.Path]) -> None:
    """Another factor; what was computed with the last one is forgotten.

    Programs compiled with it read the dial when they run and are kept, which halves the time of an
    attack, unless a number in one of them is off by the last factor for good.
    """
    dial.factor = factor
    forget(folders, programs=dial.baked)
    dial.baked = False


def _first_to_notice(row: Row, routes: Sequence[str]) -> str:
    """The first of some numeric routes that fails with a number; "" if none does."""
    for route in routes:
        check = getattr(row, route)
        if isinstance(check, Check):
            verdict = judge_route(route, check)
            number = verdict.error is not None and math.isfinite(verdict.error)
            if verdict.verdict == "fail" and number:
                return route
    return ""


# --- what a name stands for ----------------------------------------------------------------------


def functions_of(name: str) -> list[types.FunctionType]:
    """The plain functions behind a dotted name: one, or those of a class.

    Raises:
        ValueError: one sentence, if there is nothing of that name, or nothing that computes.

    Example:
        >>> from firstorder.ledger import functions_of
        >>> [f.__qualname__ for f in functions_of("firstorder.transport.Travel")]
        ['Travel.law']
    """
    found = _named(name)
    functions = _of_class(found) if inspect.isclass(found) else _plain(found)
    if not functions:
        raise ValueError(f"{name} is no function and no class of functions: nothing to attack.")
    return functions


def _named(name: str) -> Any:
    """The object of a dotted name; of a method or property as it stands in its class."""
    parts = name.split(".")
    for cut in range(len(parts), 0, -1):
        try:
            found = importlib.import_module(".".join(parts[:cut]))
        except ModuleNotFoundError:
            continue
        for part in parts[cut:]:
            if not hasattr(found, part):
                break
            as_it_stands = inspect.getattr_static if inspect.isclass(found) else getattr
            found = as_it_stands(found, part)
        else:
            return found
    raise ValueError(f"{name} does not exist.")


def _of_class(cls: type) -> list[types.FunctionType]:
    """A class's own public methods and properties; or what makes its instances."""
    public = [v for k, v in vars(cls).items() if k[0] != "_" or k == "__call__"]
    methods = [f for member in public for f in _plain(member)]
    return methods or [f for k in ("__new__", "__init__") for f in _plain(vars(cls).get(k))]


def _plain(member: Any) -> list[types.FunctionType]:
    """The plain function inside a property, a class method, a cached or a compiled function."""
    return next(([layer] for layer in layers(member) if inspect.isfunction(layer)), [])


# --- where it lies -------------------------------------------------------------------------------


def _folders(functions: Sequence[types.FunctionType], rows: Sequence[Row]) -> list[pathlib.Path]:
    """Where the packages lie that the functions and the rows come from."""
    checks = [getattr(row, route) for row in rows for route in NUMERIC]
    judges = [f for c in checks if isinstance(c, Check) for f in _plain(c.error)]
    modules = {sys.modules.get(f.__module__) for f in (*functions, *judges)}
    roots = {sys.modules.get(m.__name__.partition(".")[0], m) for m in modules if m}
    return [folder for m in roots for folder in _folders_of(m)]


def _folders_of(module: types.ModuleType) -> list[pathlib.Path]:
    """The folders of a package, or the one in which a module lies."""
    if hasattr(module, "__path__"):
        return [pathlib.Path(folder) for folder in module.__path__]
    return [pathlib.Path(module.__file__).parent] if module.__file__ else []
