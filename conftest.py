"""What the tests and the doctests in src share; pytest reads it after the import hook is in."""

import os

import pytest

# No test opens a window, whatever the machine has.
os.environ.setdefault("MPLBACKEND", "Agg")

from firstorder import session

session.start()


def pytest_collection_modifyitems(items):
    for item in items:
        if isinstance(item, pytest.DoctestItem):
            item.add_marker(pytest.mark.smoke)


def pytest_terminal_summary(terminalreporter):
    """Count the deliberate faults: killed, and all."""
    reports = {
        outcome: [r for r in terminalreporter.stats.get(outcome, ()) if "fault" in r.nodeid]
        for outcome in ("passed", "failed")
    }
    killed, survived = len(reports["passed"]), len(reports["failed"])
    if killed + survived:
        terminalreporter.write_line(f"deliberate faults killed: {killed} of {killed + survived}")
