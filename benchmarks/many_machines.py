"""What jobs on workers cost, measured on this machine, and what follows for 10 to 1,000 of them.

    python -m benchmarks.many_machines --out benchmarks/many_machines.md
    python -m benchmarks.many_machines --quick        small sizes, to see that it runs

An image of a mesh of a million triangles by tiles, and a sweep of scenes by batches. Measured are
the seconds of the processor that a job takes on a worker, the bytes of its result, what a job costs
the scheduler and the client, what a worker costs before its first result (with an empty cache of
compiled functions, and with one that another worker has filled), and how much sooner two workers
are done than one, in turns. From these follows the time of N workers:

    T(N) = S + max(ceil(J / N) t, J c, J q, J b / B)

J jobs of t seconds after a start of S, of which each costs the client c and the scheduler q, and
sends b bytes over a network of B bytes a second. It stops to fall where N = t / max(c, q, b / B),
or at N = J. Seconds are those of the processor: another load on the machine does not count.
"""

from __future__ import annotations

import argparse
import contextlib
import dataclasses
import math
import os
import pathlib
import platform
import statistics
import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import psutil

from firstorder import flatland, session, space
from firstorder.imaging import pinhole
from firstorder.io.scenes.space_toml import MeshModel
from firstorder.jobs import run_jobs
from firstorder.jobs.sweeps import _Batches
from firstorder.rendering import World, render_tiles
from firstorder.rendering._distant import _Packed
from firstorder.rendering.image_files import _Shade
from firstorder.rendering.tiles import _layers, _Tile
from firstorder.space.meshes.triangle_mesh import mesh
from firstorder.space.skies import ConstantSky
from tests.jobs.cluster import Cluster

FOUR_K, SIDE = (3840, 2160), 64
ROWS = 1_000_000
NETWORK = 125e6  # bytes a second, of one gigabit
COUNTS = (1, 10, 100, 1000)


@dataclasses.dataclass(frozen=True)
class Costs:
    """What was measured of jobs of one kind; seconds of the processor.

    Attributes:
        name: of the kind.
        jobs: in the whole task.
        job: seconds of a job on a worker.
        size: bytes of its result.
        client: seconds of the client for a job.
        scheduler: seconds of the scheduler for a job.
        cold: seconds of a worker up to its first result, with an empty cache.
        warm: the same, with a cache that another worker has filled.
        travels: bytes that each worker gets before its first job.
        speedup: of two workers over one, by the clock.
    """

    name: str
    jobs: int
    job: float
    size: float
    client: float
    scheduler: float
    cold: float
    warm: float
    travels: int
    speedup: float

    @property
    def bottlenecks(self) -> dict[str, float]:
        """Seconds for a job that no further worker shortens."""
        return {
            "the client": self.client,
            "the scheduler": self.scheduler,
            "the network": self.size / NETWORK,
        }

    def seconds(self, workers: int, start: float) -> float:
        """Time of the whole task by some workers."""
        spread = self.travels / NETWORK * math.ceil(math.log2(workers + 1))
        each = math.ceil(self.jobs / workers) * self.job
        return start + spread + max(each, *(self.jobs * s for s in self.bottlenecks.values()))

    @property
    def limit(self) -> tuple[float, str]:
        """Workers beyond which the time does not fall, and what is in the way."""
        name, cost = max(self.bottlenecks.items(), key=lambda item: item[1])
        return min((self.job / cost, name), (float(self.jobs), "the number of jobs"))


# --- what is measured ----------------------------------------------------------------------------


@dataclasses.dataclass(frozen=True)
class Timed:
    """A function of jobs, and the seconds of the processor that it took."""

    function: Callable[[Any], Any]

    def __call__(self, job: Any) -> tuple[float, Any]:
        begin = time.process_time()
        result = self.function(job)
        return time.process_time() - begin, result


@dataclasses.dataclass(frozen=True)
class Same:
    """A shading function that is done at once: what is left is the cost of a tile's way."""

    layers: dict[str, np.ndarray]

    def __call__(self, places: np.ndarray, number: int) -> dict[str, np.ndarray]:
        return self.layers


def spent(process: Any) -> float:
    """Seconds of the processor that a process has taken since it began."""
    times = psutil.Process(process.pid).cpu_times()
    return times.user + times.system


def timed(function: Any, jobs: Sequence[Any], cluster: Cluster) -> list[tuple[float, Any]]:
    return [answer for _, answer in run_jobs(Timed(function), jobs, scheduler=cluster.address)]


@contextlib.contextmanager
def clusters(folder: pathlib.Path) -> Iterator[Callable[[int], Cluster]]:
    """Makes clusters that share one cache of compiled functions, empty at first."""
    with contextlib.ExitStack() as stack:
        cache = str(folder / "cache")
        yield lambda count: stack.enter_context(
            Cluster(count, folder, pinned=True, FIRSTORDER_CACHE=cache)
        )


def measured(name: str, total: int, function: Any, jobs: Sequence[Any], way: Any) -> Costs:
    """Costs of jobs of a kind.

    Args:
        name: of the kind.
        total: number of jobs of the whole task.
        function: of a job.
        jobs: a few, of which the first two are spent on starts.
        way: from a cluster and a result to seconds of the client and scheduler for a job.
    """
    import cloudpickle

    with tempfile.TemporaryDirectory() as where, clusters(pathlib.Path(where)) as cluster:
        one = cluster(1)
        timed(function, jobs[:1], one)
        cold = spent(one.workers[0])
        one.kill_worker()
        one.wait_for_workers(1)
        timed(function, jobs[1:2], one)
        warm = spent(one.workers[0])
        two = cluster(2)
        timed(function, [*jobs[:2]] * 2, two)
        known, walls = [], ([], [])
        for _ in range(2):
            for each, wall in zip((one, two), walls, strict=True):
                begin = time.perf_counter()
                known += timed(function, jobs[2:], each)
                wall.append(time.perf_counter() - begin)
        seconds = statistics.median(seconds for seconds, _ in known)
        result = known[0][1]
        client, scheduler = way(one, result)
    parts = [result] if isinstance(result, bytes) else jax.tree.leaves(result)
    size = sum(len(a) if isinstance(a, bytes) else np.asarray(a).nbytes for a in parts)
    ratio = statistics.median(walls[0]) / statistics.median(walls[1])
    travels = len(cloudpickle.dumps(function))
    return Costs(name, total, seconds, size, client, scheduler, cold, warm, travels, ratio)


def for_a_job(run: Callable[[int], Any], cluster: Cluster, count: int) -> tuple[float, float]:
    """Seconds of the client and of the scheduler for a job more."""
    costs = []
    for number in (1, 1 + count):
        before = time.process_time(), spent(cluster.scheduler)
        run(number)
        costs.append((time.process_time() - before[0], spent(cluster.scheduler) - before[1]))
    return tuple((b - a) / count for a, b in zip(*costs, strict=True))  # pyright: ignore


# --- an image ------------------------------------------------------------------------------------


def hills(side: int) -> World:
    """A landscape of 2 side^2 triangles under a sky."""
    t = np.linspace(-1.0, 1.0, side + 1)
    x, y = np.meshgrid(t, t, indexing="ij")
    z = 0.05 * np.sin(9.0 * x) * np.cos(7.0 * y) + 0.02 * np.sin(31.0 * x + 17.0 * y)
    k = np.arange((side + 1) ** 2).reshape(side + 1, side + 1)
    a, b, c, d = (k[:-1, :-1], k[1:, :-1], k[1:, 1:], k[:-1, 1:])
    faces = np.concatenate([np.stack(s, -1).reshape(-1, 3) for s in ((a, b, c), (a, c, d))])
    land = mesh(np.stack([x, y, z], -1).reshape(-1, 3), faces)
    camera = pinhole((0.0, -1.2, 0.7), (0.0, 0.0, 0.0))
    return World(
        camera, models=(MeshModel(land, "land", {"albedo": 0.5}, None),), sky=ConstantSky(1.0)
    )


def image(quick: bool) -> Costs:
    """Tiles of an image in 4K."""
    width, height = FOUR_K
    shade = _Shade(hills(30 if quick else 708), width, height)
    places = [(x, y) for y in (320, 704, 1088) for x in (640, 1856, 3072)][: 4 if quick else 5]
    jobs = [(_Tile(x, y, x + SIDE, y + SIDE), 0) for x, y in places]
    total = math.ceil(width / SIDE) * math.ceil(height / SIDE)

    def way(cluster: Cluster, made: bytes) -> tuple[float, float]:
        import io

        with np.load(io.BytesIO(made)) as kept:
            layers = {name: kept[name].reshape(SIDE * SIDE, -1)[:, 0] for name in kept.files}

        def run(count: int) -> None:
            with tempfile.TemporaryDirectory() as folder:
                render_tiles(
                    Same(layers), SIDE * count, SIDE, folder, side=SIDE, scheduler=cluster.address
                )

        return for_a_job(run, cluster, 20 if quick else 60)

    name = f"tiles of {SIDE} x {SIDE} pixels, {2 * (30 if quick else 708) ** 2:,} triangles"
    return measured(name, total, _Packed(_layers, shade), jobs, way)


# --- sweeps --------------------------------------------------------------------------------------


def disc(radius, height):
    """Irradiance of a floor behind a disc in flatland, and its slope by the radius."""

    def behind(radius):
        lamp = flatland.primitive(flatland.Segments((0.5, 1.0), (-0.5, 1.0)), emission=1.0)
        disc = flatland.primitive(flatland.Circles(jnp.stack([0.1, height]), radius))
        floor = flatland.Receiver.at((0.3, 0.0))
        return flatland.irradiance(flatland.Scene.of(lamp, disc), floor)

    E, slope = jax.value_and_grad(behind)(radius)
    return {"E": E, "dE": slope}


def ball(radius, height):
    """Irradiance of a floor behind a ball, its gradient and its Hessian along the floor."""
    lamp = space.primitive(space.rectangle((0, 0, 1), (0, 0.5, 0), (0.5, 0, 0)), emission=1.0)
    ball = space.primitive(space.sphere(jnp.stack([0.1, 0.0, height]), radius))
    scene = space.Scene.of(lamp, ball)

    def E(x):
        return space.irradiance(scene, space.Receiver.at(jnp.append(x, 0.0)))

    x = jnp.array([0.3, 0.1])
    return {"E": E(x), "dE": jax.grad(E)(x), "d2E": jax.hessian(E)(x)}


def rows(world: str, function: Any, batch: int) -> Costs:
    """Batches of a sweep of a million scenes."""
    rng = np.random.default_rng(0)
    jobs = [
        {"radius": rng.uniform(0.05, 0.1, batch), "height": rng.uniform(0.5, 0.7, batch)}
        for _ in range(6)
    ]

    def way(cluster: Cluster, made: Any) -> tuple[float, float]:
        def run(count: int) -> None:
            list(run_jobs(lambda job: made, [jobs[0]] * count, scheduler=cluster.address))

        return for_a_job(run, cluster, 100)

    name = f"batches of {batch:,} scenes of {world}"
    return measured(name, math.ceil(ROWS / batch), _Batches(function), jobs, way)


# --- what follows --------------------------------------------------------------------------------


def said(seconds: float) -> str:
    """A time in words.

    Example:
        >>> said(0.0123), said(75.0), said(7300.0)
        ('12 ms', '75 s', '2.0 h')
    """
    if seconds < 1.0:
        return f"{1e3 * seconds:.2g} ms" if seconds < 0.01 else f"{1e3 * seconds:.0f} ms"
    if seconds < 600.0:
        return f"{seconds:.2g} s" if seconds < 10.0 else f"{seconds:.0f} s"
    return f"{seconds / 60.0:.0f} min" if seconds < 5400.0 else f"{seconds / 3600.0:.1f} h"


def table(head: Sequence[str], lines: Sequence[Sequence[str]]) -> str:
    return "\n".join("| " + " | ".join(c) + " |" for c in (head, ["---"] * len(head), *lines))


def report(costs: Sequence[Costs]) -> str:
    """Both tables, in Markdown."""
    first = [
        ("", *(c.name for c in costs)),
        ("jobs, J", *(f"{c.jobs:,}" for c in costs)),
        ("a job, t", *(said(c.job) for c in costs)),
        ("its result, b", *(f"{c.size / 1e3:,.0f} kB" for c in costs)),
        ("the client's part of a job, c", *(said(c.client) for c in costs)),
        ("the scheduler's, q", *(said(c.scheduler) for c in costs)),
        ("a worker up to its first result, empty cache", *(said(c.cold) for c in costs)),
        ("the same, cache filled by another worker, S", *(said(c.warm) for c in costs)),
        ("what travels to each worker", *(f"{c.travels / 1e6:,.2f} MB" for c in costs)),
        ("two workers over one, by the clock", *(f"{c.speedup:.2f}" for c in costs)),
    ]
    second = [("workers", *(c.name for c in costs))]
    second += [(f"{n:,}", *(said(c.seconds(n, c.warm)) for c in costs)) for n in COUNTS]
    cold = [said(c.seconds(COUNTS[-1], c.cold)) for c in costs]
    second += [(f"{COUNTS[-1]:,}, each with an empty cache", *cold)]
    second += [("stops to fall at", *(f"{max(1.0, c.limit[0]):,.0f}: {c.limit[1]}" for c in costs))]
    about = (
        f"Measured on {os.cpu_count()} cores ({platform.machine()}, load "
        f"{os.getloadavg()[0]:.0f}), jax {jax.__version__}, a core for each worker; seconds of the "
        f"processor. Network: {NETWORK / 1e6:.0f} MB/s (assumed)."
    )
    return "\n\n".join((table(first[0], first[1:]), table(second[0], second[1:]), about)) + "\n"


def main() -> None:
    """Measure, and tell."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--quick", action="store_true", help="small sizes")
    parser.add_argument("--out", type=pathlib.Path, help="where the tables are written as well")
    given = parser.parse_args()
    session.start()
    sizes = (256, 16) if given.quick else (16384, 4096)
    costs = [image(given.quick), rows("flatland", disc, sizes[0]), rows("space", ball, sizes[1])]
    text = report(costs)
    print(text)
    if given.out:
        given.out.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    # Functions travel to workers by name, and `__main__` is not a name that they know.
    from benchmarks.many_machines import main as run

    run()
