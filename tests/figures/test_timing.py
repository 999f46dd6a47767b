"""Ratios of times: their spread, and what a loaded machine adds to it."""

import os
import subprocess
import sys
import time
from types import SimpleNamespace

import pytest

from figures import timing
from figures.verdicts import HOLDS, REFUTED, UNDECIDED, Statement, at_least

CORES = os.cpu_count() or 1
PAIRS = [(2.0, 1.0), (2.1, 1.0), (1.9, 1.0)]


def beside(share):
    return timing.of_times(PAIRS, SimpleNamespace(share=lambda: share))


@pytest.mark.parametrize("share", [-0.01, 0.0, timing.QUIET])
def test_a_quiet_machine_adds_nothing(share):
    assert beside(share) == timing.of_rounds(PAIRS)


@pytest.mark.parametrize("share", [0.5, float("nan")])
@pytest.mark.parametrize(
    ("factor", "verdict"),
    [(0.35, HOLDS), (0.45, UNDECIDED), (1.55, UNDECIDED), (1.65, REFUTED)],
)
def test_a_loaded_machine_or_one_that_does_not_tell_decides_nothing_close(factor, verdict, share):
    found = beside(share)
    said = Statement("", None, found.mean, at_least(factor * found.mean), "", error=found.error)
    assert said.verdict == verdict


def worked(seconds):
    start = time.process_time()
    while time.process_time() < start + seconds:
        pass


@pytest.mark.parametrize("busy", [0, 1])
def test_what_this_process_takes_is_not_counted(busy, monkeypatch):
    """The clock of all processors is one of this process and of one that never rests, or none."""

    def clock():
        return time.process_time() + busy * time.perf_counter()

    monkeypatch.setattr(timing, "_busy", clock)
    others = timing.Others()
    worked(0.1)
    assert others.share() == pytest.approx(busy / CORES, abs=1e-3)


@pytest.mark.skipif(not os.path.exists("/proc/stat"), reason="the system does not tell")
def test_another_process_is_seen():
    others, start = timing.Others(), time.perf_counter()
    script = "import tests.figures.test_timing as t; t.worked(0.5)"
    subprocess.run([sys.executable, "-c", script], check=True)
    passed = time.perf_counter() - start
    assert others.share() > 0.45 / (passed * CORES)
