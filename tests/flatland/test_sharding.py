"""Receivers spread over devices, and over processes, are the same receivers."""

import json
import os
import pathlib
import socket
import subprocess
import sys

import numpy as np
import pytest

PROGRAM = pathlib.Path(__file__).parent / "_sharded.py"
# Sums over lanes may be ordered otherwise; everything else is the same bit by bit.
BOUND = 1e-13


def start(devices, *arguments):
    kept = {k: v for k, v in os.environ.items() if not k.startswith("JAX_")}
    flags = {"XLA_FLAGS": f"--xla_force_host_platform_device_count={devices}"}
    return subprocess.Popen(
        [sys.executable, str(PROGRAM), *map(str, arguments)],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env=kept | flags | {"JAX_PLATFORMS": "cpu"},
    )


def finished(process):
    out, err = process.communicate(timeout=300)
    assert process.returncode == 0, err[-2000:]
    line = next(row for row in out.splitlines() if row.startswith("result "))
    return {k: np.array(v) for k, v in json.loads(line.removeprefix("result ")).items()}


@pytest.fixture(scope="module")
def here():
    return finished(start(2))


def differences(rows, whole):
    """Largest relative differences of E, its gradient, and path tracing's mean and error."""
    truth = whole[1:, rows[0].astype(int)]
    return np.max(np.abs(rows[1:] - truth) / np.abs(truth), axis=1)


def test_two_devices_agree_with_one(here):
    assert sorted(here["spread"][0]) == [0, 1, 2, 3]
    E, gradient, *paths = differences(here["spread"], here["whole"])
    assert E == gradient == 0.0
    assert max(paths) <= BOUND


def test_two_processes_agree_with_one(here):
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    both = [start(1, port, rank) for rank in (0, 1)]
    rows = [finished(process)["spread"] for process in both]
    assert [row[0].tolist() for row in rows] == [[0, 1], [2, 3]]
    for row in rows:
        E, gradient, *paths = differences(row, here["whole"])
        assert E == gradient == 0.0
        assert max(paths) <= BOUND


def test_other_receivers_are_noticed(here):
    """The comparison can fail: half the receivers were a micrometre away."""
    assert np.all(differences(here["moved"], here["whole"]) > BOUND)
