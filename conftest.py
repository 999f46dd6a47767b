"""What the tests and the doctests in src share; pytest reads it after the import hook is in."""

import ctypes
import functools
import gc
import importlib
import os
import pathlib
import pkgutil
import threading

import jax
import pytest
from jax._src.interpreters import mlir
from jax._src.lib.mlir import ir

# No test opens a window, whatever the machine has.
os.environ.setdefault("MPLBACKEND", "Agg")

import firstorder
from firstorder import session

session.start()

# In importlib mode pytest loads a second copy of a module that nobody has imported yet, and a class
# is then not its own subclass. So everything is imported first, under its one name.
for _info in pkgutil.walk_packages(firstorder.__path__, "firstorder."):
    # (but for the registry's cases, which build their light on import and have no doctests)
    if not _info.name.endswith("__main__") and ".checks.cases." not in _info.name:
        importlib.import_module(_info.name)

# JAX makes so many objects that the collector, at Python's thresholds, takes a tenth of the
# processor time of the suite.
gc.set_threshold(100_000, 20, 50)

# No test reads from which line of ours an operation of a compiled program comes.
jax.config.update("jax_traceback_in_locations_limit", 0)


def _lend_contexts(most: int = 500) -> None:
    """Let JAX lower programs in a shared MLIR context; to make one for each takes 2 ms.

    Most programs of a test are a single operation. A context keeps the constants of all its
    programs, so after some of them there is another one. A program that is lowered while another
    one is being lowered gets a context of its own, or it would be put into that other program.
    """
    make, held = mlir.make_ir_context, threading.local()

    @functools.wraps(make)
    def lent():
        if _is_lowering():
            return make()
        if not getattr(held, "left", 0):
            held.context, held.left = make(), most
        held.left -= 1
        return held.context

    mlir.make_ir_context = lent


def _is_lowering() -> bool:
    """Whether a program is being lowered."""
    try:
        return ir.Context.current is not None
    except ValueError:
        return False


_lend_contexts()


def pytest_collection_modifyitems(items):
    for item in items:
        if isinstance(item, pytest.DoctestItem):
            item.add_marker(pytest.mark.smoke)


# XLA keeps what it has compiled until the process ends: some 10 GB at the end of the suite.
MOST = 2.5e9  # bytes in memory beyond which compiled functions are forgotten between modules
ROOM = 1e9  # bytes at least from then on until they are forgotten again
_limit = [MOST]


def pytest_runtest_teardown(item, nextitem):
    """Forget compiled functions when a module is done; most of them will not be called again."""
    if nextitem is not None and nextitem.path == item.path:
        return
    if _resident() > _limit[0]:
        jax.clear_caches()
        gc.collect()
        ctypes.CDLL(None).malloc_trim(0)  # without it the system gets nothing back
        _limit[0] = max(MOST, _resident() + ROOM)


def _resident() -> int:
    """Bytes of this process in memory; 0 where that cannot be read (only Linux says it so)."""
    table = pathlib.Path("/proc/self/statm")
    return int(table.read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE") if table.exists() else 0


def pytest_terminal_summary(terminalreporter):
    """Count the deliberate faults: killed, and all."""
    reports = {
        outcome: [r for r in terminalreporter.stats.get(outcome, ()) if "fault" in r.nodeid]
        for outcome in ("passed", "failed")
    }
    killed, survived = len(reports["passed"]), len(reports["failed"])
    if killed + survived:
        terminalreporter.write_line(f"deliberate faults killed: {killed} of {killed + survived}")
