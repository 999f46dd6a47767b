"""`--minutes N`: no test begins later than that, and what was left out is counted.

A plugin of pytest (`-p tests.time_limit` in pyproject.toml). A run that is ended from outside says
nothing at all, and some machines are three times as slow as others: there `.ci/run` says how far
it came. Tests that are marked slow, most of which ask whether a check would notice a fault, are the
last.
"""

import time

import pytest

REASON = "left out: no time"
_started = time.monotonic()


def pytest_addoption(parser):
    """The option."""
    parser.addoption("--minutes", type=float, help="begin no test later, and count those left out")


def pytest_collection_modifyitems(config, items):
    """What is slow comes last."""
    if config.option.minutes is not None:
        items.sort(key=lambda item: item.get_closest_marker("slow") is not None)


@pytest.hookimpl(tryfirst=True)
def pytest_runtest_setup(item):
    """Leave a test out when the time is over."""
    minutes = item.config.option.minutes
    if minutes is not None and time.monotonic() - _started > 60.0 * minutes:
        pytest.skip(REASON)


def pytest_terminal_summary(terminalreporter, config):
    """Count what was left out."""
    skipped = terminalreporter.stats.get("skipped", ())
    count = sum(REASON in str(report.longrepr) for report in skipped)
    if config.option.minutes is not None:
        terminalreporter.write_line(
            f"tests left out after {config.option.minutes:g} minutes: {count}"
        )
