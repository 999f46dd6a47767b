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
