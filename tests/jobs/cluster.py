"""A scheduler and workers of `dask.distributed`: real processes on loopback, to be killed."""

from __future__ import annotations

import os
import pathlib
import signal
import socket
import subprocess
import sys

ROOT = pathlib.Path(__file__).parents[2]


def free_port() -> int:
    with socket.socket() as s:
        s.bind(("127.0.0.1", 0))
        return s.getsockname()[1]


class Cluster:
    """A scheduler and some workers, that begin with it and end with it.

    Args:
        workers: how many.
        folder: for what they say, and for compiled functions if the environment names no folder.
        protocol: tcp, or tls with certificates that the environment names.
        pinned: whether each worker keeps to one core, in turn.
        environment: of the processes, beside ours.
    """

    def __init__(
        self,
        workers: int,
        folder: pathlib.Path,
        *,
        protocol: str = "tcp",
        pinned: bool = False,
        **environment: str,
    ):
        self.folder, self.port, self.pinned = folder, free_port(), pinned
        self.address = f"{protocol}://127.0.0.1:{self.port}"
        self.environment, self._begun = environment, 0
        self.scheduler = self._scheduler()
        self.workers: list[subprocess.Popen[bytes]] = []
        for _ in range(workers):
            self.start_worker()
        self.wait_for_workers(workers)

    def __enter__(self) -> Cluster:
        return self

    def __exit__(self, *_: object) -> None:
        self.stop()

    def stop(self) -> None:
        """Kills all of it."""
        for process in (self.scheduler, *self.workers):
            _killed(process)

    def start_worker(self) -> None:
        """Begins another worker."""
        given = ("--no-nanny", "--nthreads", "1", "--host", "127.0.0.1")
        worker = self._begin("worker", self.address, *given)
        if self.pinned:
            cores = sorted(os.sched_getaffinity(0))
            os.sched_setaffinity(worker.pid, {cores[len(self.workers) % len(cores)]})
        self.workers.append(worker)

    def wait_for_workers(self, count: int) -> None:
        """Until the scheduler is there, and knows some workers."""
        from distributed import Client

        with Client(self.address, set_as_default=False, timeout=60) as client:
            if count:
                client.wait_for_workers(count, timeout=60)

    def kill_worker(self, number: int = 0) -> None:
        """Kills a worker, and begins another."""
        _killed(self.workers.pop(number))
        self.start_worker()

    def kill_scheduler(self) -> None:
        """Kills the scheduler, without which workers end, and begins all anew at its address."""
        count = len(self.workers)
        self.stop()
        self.scheduler, self.workers = self._scheduler(), []
        for _ in range(count):
            self.start_worker()

    def _scheduler(self) -> subprocess.Popen[bytes]:
        host, _, port = self.address.rpartition(":")
        given = ("--host", host, "--port", port)
        return self._begin("scheduler", *given)

    def _begin(self, kind: str, *given: str) -> subprocess.Popen[bytes]:
        paths = os.pathsep.join([str(ROOT / "src"), str(ROOT)])
        # Workers have no nanny here: they are not given up when the machine sleeps.
        awake = {"DASK_DISTRIBUTED__SCHEDULER__WORKER_TTL": "None"}
        environment = os.environ | {"PYTHONPATH": paths} | awake | self.environment
        command = (sys.executable, "-m", f"distributed.cli.dask_{kind}", *given, "--no-dashboard")
        self._begun += 1
        with (self.folder / f"{kind}{self._begun}.log").open("wb") as log:
            return subprocess.Popen(
                command, env=environment, cwd=self.folder, stdout=log, stderr=log
            )


def _killed(process: subprocess.Popen[bytes]) -> None:
    if process.poll() is None:
        os.kill(process.pid, signal.SIGKILL)
    process.wait()
