"""Scenes on which certificates are tried, and what the trial counts.

`python -m tests.checks.certified_scenes 10000 3000` tries so many receivers of the shipped scenes,
and of nasty ones, and prints a row for each.
"""

import itertools
import pathlib
import sys
from typing import NamedTuple

import jax
import numpy as np

from firstorder.checks import certified
from firstorder.flatland import (
    Arcs,
    Circles,
    ConstantSky,
    PointLights,
    Receiver,
    Scene,
    Segments,
    irradiance,
    primitive,
)
from firstorder.flatland.library import named_scene, scene_names
from firstorder.io import read_flatland
from tests.checks.forty_digits import World

EXAMPLE = pathlib.Path(__file__).parents[2] / "examples" / "shadow.toml"
RECEIVERS_OF_A_NASTY_SCENE = 50


class Receivers(NamedTuple):
    """Rows of what receivers are made of."""

    position: np.ndarray
    n: np.ndarray
    on: np.ndarray


class Trial(NamedTuple):
    """Certificates beside true errors, a row for each receiver."""

    bound: np.ndarray
    certified: np.ndarray
    error: np.ndarray

    @property
    def wrong(self):
        """Certificates that are refuted."""
        return int(np.sum(~(self.error <= self.bound)))

    @property
    def ratio(self):
        """The bound over the true error, where there is one, in the middle."""
        some = self.certified & (self.error > 0.0)
        return float(np.median(self.bound[some] / self.error[some])) if some.any() else np.nan

    def __str__(self):
        most = max(self.bound[self.certified], default=np.nan)
        return (
            f"{self.bound.size:6d} receivers, {np.mean(self.certified):8.2%} certified, "
            f"{self.wrong} wrong, bound up to {most:.1e}, bound / error {self.ratio:.0f}"
        )


def trial(scene, receivers, judged=certified):
    """Certificates of all receivers against forty digits."""

    def ask(position, n, on):
        at = Receiver(position, n, on)
        return judged(scene, at), irradiance(scene, at)

    def in_blocks(rows):
        return jax.lax.map(lambda row: ask(*row), rows, batch_size=64)

    proof, E = jax.jit(in_blocks)(tuple(receivers))
    world = World(scene)
    rows = zip(*receivers, np.asarray(E), strict=True)
    error = [abs(float(world.irradiance(p, n, on) - float(E))) for p, n, on, E in rows]
    return Trial(np.asarray(proof.error), np.asarray(proof.certified), np.array(error))


# --- shipped scenes -------------------------------------------------------------------------------


def shipped():
    """Scenes that the library and the examples come with, but for those under a Gaussian sky."""
    for name in scene_names():
        scene = named_scene(name)
        if scene.environment is None:
            yield name, scene
    yield EXAMPLE.name, read_flatland(EXAMPLE)


def anywhere(scene, count, rng):
    """A half of all receivers on random shapes, the others anywhere in the box around them."""
    number = rng.integers(0, scene.count, count)
    frame = jax.vmap(scene.frame)(number, rng.uniform(0.0, 1.0, count))
    on_one = rng.uniform(size=count) < 0.5
    corners = np.asarray(frame.position)
    free = rng.uniform(corners.min(0), corners.max(0), (count, 2))
    n = rng.uniform(-np.pi, np.pi, count)
    return Receivers(
        np.where(on_one[:, None], frame.position, free),
        np.where(on_one, frame.n, n),
        np.where(on_one, number, -1),
    )


# --- nasty ones -----------------------------------------------------------------------------------


def nasty(seed):
    """A scene of shapes on a coarse grid: they touch, cross, overlap and stand in line."""
    rng = np.random.default_rng(seed)

    def grid(*shape):
        return rng.integers(-4, 5, shape) / 4.0

    start = grid(4, 2)
    end = start + rng.choice([-0.75, -0.5, 0.25, 1.0], (4, 2)) * rng.choice([0, 1, 1], (4, 2))
    end[:, 0] += 0.5 * np.all(start == end, 1)
    on_first = start[0] + np.outer((0.25, 0.75), end[0] - start[0])  # a lamp on a wall
    radii = rng.choice([0.25, 0.5], 4)
    sweep = rng.choice([-1.5, -1.0, -0.5, 0.5, 1.0, 1.5], 2) * np.pi
    things = [
        primitive(Segments(start, end), emission=rng.choice([0.0, 0.0, 1.0, 2.0], (4, 2))),
        primitive(Segments(*on_first), emission=3.0, two_sided=True),
        primitive(Circles(grid(2, 2), radii[:2]), emission=rng.choice([0.0, 1.0], (2, 2))),
        primitive(
            Arcs(grid(2, 2), radii[2:], rng.integers(0, 8, 2) * 0.25 * np.pi, sweep),
            emission=rng.choice([0.0, 1.0, 2.0], (2, 2)),
        ),
    ]
    sky = ConstantSky(0.5) if seed % 2 else None
    lights = PointLights(grid(2, 2), rng.choice([0.0, 1.0], 2)) if seed % 3 == 0 else None
    return Scene.of(*things, environment=sky, points=lights)


def aligned(scene, count, rng):
    """Receivers on the grid and off it, with normals along the axes or not, on shapes or not."""
    random = anywhere(scene, count, rng)
    position = rng.integers(-8, 9, (count, 2)) / 8.0
    n = rng.integers(-2, 3, count) * 0.5 * np.pi
    kind = rng.integers(0, 4, count)
    return Receivers(
        np.where(np.isin(kind, (0, 1))[:, None], position, random.position),
        np.where(np.isin(kind, (0, 2)) & (random.on < 0), n, random.n),
        np.where(np.isin(kind, (0, 1)), -1, random.on),
    )


# --- all of it ------------------------------------------------------------------------------------


def together(trials):
    """Several trials as one."""
    return Trial(*(np.concatenate(rows) for rows in zip(*trials, strict=True)))


def main(of_shipped, of_nasty):
    """Tries all scenes, and prints."""
    rng = np.random.default_rng(18)
    scenes = list(shipped())
    found = []
    for k, (name, scene) in enumerate(scenes):
        count = (of_shipped * (k + 1)) // len(scenes) - (of_shipped * k) // len(scenes)
        found.append(trial(scene, anywhere(scene, count, rng)))
        print(f"{name:14s}{found[-1]}", flush=True)
    print(f"{'all shipped':14s}{together(found)}", flush=True)
    rows = []
    for seed in itertools.islice(itertools.count(), of_nasty // RECEIVERS_OF_A_NASTY_SCENE):
        scene = nasty(seed)
        rows.append(trial(scene, aligned(scene, RECEIVERS_OF_A_NASTY_SCENE, rng)))
        if rows[-1].wrong:
            print(f"nasty {seed:8d}{rows[-1]}", flush=True)
    if rows:
        print(f"{'nasty':14s}{together(rows)}")


if __name__ == "__main__":
    from firstorder import session

    session.start()
    main(*map(int, sys.argv[1:]))
