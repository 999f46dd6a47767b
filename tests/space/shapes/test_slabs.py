"""No ray passes between shapes that are joined, and none is met beside its edge."""

from functools import partial

import jax.numpy as jnp
import numpy as np
import pytest

from firstorder.space import Boxes, Rectangles, Scene, Triangles, primitive
from firstorder.space.intersect import first_shape

RNG = np.random.default_rng(4)
TILT = np.array([[np.cos(0.7), 0, -np.sin(0.7)], [0, 1, 0], [np.sin(0.7), 0, np.cos(0.7)]])


def point(center, turn, x, y):
    """A point of a plane."""
    return center + x * turn[:, 0] + y * turn[:, 1]


def floor(at, turn):
    return [Rectangles(at(-1, 0), turn), Rectangles(at(0.7, 0), turn * [0.7, 1, 1])]


def roof(at, turn):
    other = turn @ TILT
    middle = at(0, 0) + 0.7 * other[:, 0]
    return [Rectangles(at(-1, 0), turn), Rectangles(middle, other * [0.7, 1, 1])]


def mesh(at, turn):
    low, high, left, right = at(0, -1), at(0, 1), at(-1, 0.2), at(0.8, -0.1)
    edges = [(low, high - low, left - low), (high, low - high, right - high)]
    return [Triangles(a, np.stack([b, c, turn[:, 2]], 1)) for a, b, c in edges]


def blocks(at, turn):
    return [Boxes(at(-1, 0), turn), Boxes(at(1, 0), turn)]


def turns(count):
    for _ in range(count):
        turn = np.linalg.qr(RNG.normal(size=(3, 3)))[0]
        yield turn * np.linalg.det(turn)


@pytest.mark.parametrize("dtype", [np.float64, np.float32])
@pytest.mark.parametrize(
    ("joined", "away"),
    [(floor, 0), (floor, 100), (roof, 0), (roof, 100), (mesh, 0), (mesh, 100), (blocks, 0)],
)
def test_no_ray_passes_between_what_is_joined(joined, away, dtype):
    """Along the seam, from anywhere; at blocks from straight above, on the level of both faces.

    A ray that grazes a plane is off by more than the slack. Without the slack one ray of four to
    nine passes.
    """
    n = 2000
    for turn in turns(8):
        center = away * RNG.normal(size=3)
        shapes = joined(partial(point, center, turn), turn)
        scene = Scene.of(
            *(
                primitive(type(s)(*(a.astype(dtype) for a in (s.center[0], s.axes[0]))))
                for s in shapes
            )
        )
        aims = center + RNG.uniform(-0.99, 0.99, (n, 1)) * turn[:, 1]
        starts = center + 3.0 * RNG.normal(size=(n, 3))
        if joined is blocks:
            starts = aims + 5.0 * turn[:, 2]
        along = aims - starts
        along /= np.linalg.norm(along, axis=1, keepdims=True)
        steep = np.abs(along @ turn[:, 2]) > 0.2
        met = first_shape(scene, jnp.asarray(starts, dtype), jnp.asarray(along, dtype))
        assert steep.sum() > 0.5 * n
        assert np.all(np.asarray(met)[steep] >= 0)


@pytest.mark.parametrize("away", [0, 100])
@pytest.mark.parametrize(
    ("kind", "within"),
    [
        (Rectangles, [(1, 0.3), (-1, 0.3), (0.3, 1), (0.3, -1)]),
        (Triangles, [(0, 0.3), (0.3, 0), (0.4, 0.6)]),
    ],
)
def test_a_ray_beside_an_edge_misses(kind, within, away):
    """A hundred roundings outside: the slack is no frame. As many inside, it hits."""
    inner = {Rectangles: 0.0, Triangles: 0.25}[kind]
    off = 100.0 * np.finfo(float).eps * (4.0 + 2.0 * away)
    for turn in turns(8):
        center = away * RNG.normal(size=3)
        scene = Scene.of(primitive(kind(center, turn)))
        for sign, hits in ((1.0, False), (-1.0, True)):
            edge = inner + (1.0 + sign * off) * (np.array(within) - inner)
            starts = center + edge @ turn[:, :2].T + 2.0 * turn[:, 2]
            met = first_shape(scene, starts, np.broadcast_to(-turn[:, 2], starts.shape))
            assert np.all((np.asarray(met) >= 0) == hits)
