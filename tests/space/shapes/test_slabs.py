"""No ray passes between shapes that are joined, and none is met beside its edge."""

from functools import partial

import jax.numpy as jnp
import numpy as np
import pytest

from firstorder.space import Boxes, Cylinders, Rectangles, Scene, Triangles, primitive
from firstorder.space.intersect import first_shape

TILT = np.array([[np.cos(0.7), 0, -np.sin(0.7)], [0, 1, 0], [np.sin(0.7), 0, np.cos(0.7)]])


def point(center, turn, x, y):
    """A point of a plane."""
    return center + x * turn[:, 0] + y * turn[:, 1]


def floor(at, turn, thin):
    return [
        Rectangles(at(-thin, 0), turn * [thin, 1, 1]),
        Rectangles(at(0.7 * thin, 0), turn * [0.7 * thin, 1, 1]),
    ]


def roof(at, turn, thin):
    other = turn @ TILT
    middle = at(0, 0) + 0.7 * thin * other[:, 0]
    return [
        Rectangles(at(-thin, 0), turn * [thin, 1, 1]),
        Rectangles(middle, other * [0.7 * thin, 1, 1]),
    ]


def mesh(at, turn, thin):
    low, high, left, right = at(0, -1), at(0, 1), at(-thin, 0.2), at(0.8 * thin, -0.1)
    edges = [(low, high - low, left - low), (high, low - high, right - high)]
    return [Triangles(a, np.stack([b, c, turn[:, 2]], 1)) for a, b, c in edges]


def blocks(at, turn, thin):
    return [Boxes(at(side * thin, 0), turn * [thin, 1, 1]) for side in (-1, 1)]


def places(rng, away):
    """Some places that far off, and rotations."""
    for _ in range(8):
        turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
        yield away * rng.normal(size=3), turn * np.linalg.det(turn)


def single(scene_shapes, dtype):
    """A scene of shapes of one precision."""
    parts = [(type(s), s.center[0].astype(dtype), s.axes[0].astype(dtype)) for s in scene_shapes]
    return Scene.of(*(primitive(kind(center, axes)) for kind, center, axes in parts))


@pytest.mark.parametrize("dtype", [np.float64, np.float32])
@pytest.mark.parametrize(("thin", "high"), [(1.0, 3.0), (1.0, 300.0), (0.1, 3.0), (0.01, 30.0)])
@pytest.mark.parametrize(
    ("joined", "away"),
    [(floor, 0), (floor, 100), (roof, 0), (roof, 100), (mesh, 0), (mesh, 100), (blocks, 0)],
)
def test_no_ray_passes_between_what_is_joined(joined, away, thin, high, dtype):
    """Along the seam, from anywhere; at blocks from straight above, on the level of both faces.

    A ray that grazes a plane is off by more than is spared. Without that one ray of four to nine
    passes.
    """
    n, rng = 2000, np.random.default_rng(4)
    for center, turn in places(rng, away):
        scene = single(joined(partial(point, center, turn), turn, thin), dtype)
        aims = center + rng.uniform(-0.99, 0.99, (n, 1)) * turn[:, 1]
        starts = center + high * rng.normal(size=(n, 3))
        if joined is blocks:
            starts = aims + high * turn[:, 2]
        along = aims - starts
        along /= np.linalg.norm(along, axis=1, keepdims=True)
        steep = np.abs(along @ turn[:, 2]) > 0.2
        met = first_shape(scene, jnp.asarray(starts, dtype), jnp.asarray(along, dtype))
        assert steep.sum() > 0.5 * n
        assert np.all(np.asarray(met)[steep] >= 0)


@pytest.mark.parametrize("kind", [Boxes, Cylinders])
@pytest.mark.parametrize(("dtype", "thin"), [(np.float32, 1e-5), (np.float64, 1e-12)])
def test_a_plate_is_judged_where_an_oblique_ray_meets_it(kind, dtype, thin):
    """Not where the ray starts: its thin coordinate is large, and the others are not level."""
    scene = single([kind(np.zeros(3), np.diag([1.0, 1.0, thin]))], dtype)
    slope = 10.0 ** np.random.default_rng(4).uniform(-6, -1, 500)
    aim = np.where(np.arange(500) % 2 == 0, 0.99, 1.01)
    starts = np.stack([aim - 10.0 * slope, np.zeros(500), np.full(500, 10.0)], 1)
    along = np.stack([slope, np.zeros(500), -np.ones(500)], 1) / np.hypot(1.0, slope)[:, None]
    met = first_shape(scene, jnp.asarray(starts, dtype), jnp.asarray(along, dtype))
    np.testing.assert_array_equal(np.asarray(met) >= 0, aim < 1.0)


@pytest.mark.parametrize("away", [0, 100])
@pytest.mark.parametrize(
    ("kind", "within"),
    [
        (Rectangles, [(1, 0.3), (-1, 0.3), (0.3, 1), (0.3, -1)]),
        (Triangles, [(0, 0.3), (0.3, 0), (0.4, 0.6)]),
    ],
)
def test_a_ray_beside_an_edge_misses(kind, within, away):
    """A hundred roundings outside: what is spared is no frame. As many inside, it hits."""
    inner = {Rectangles: 0.0, Triangles: 0.25}[kind]
    for center, turn in places(np.random.default_rng(4), away):
        off = 100.0 * np.finfo(float).eps * (4.0 + 2.0 * np.max(np.abs(center)))
        scene = Scene.of(primitive(kind(center, turn)))
        for sign, hits in ((1.0, False), (-1.0, True)):
            edge = inner + (1.0 + sign * off) * (np.array(within) - inner)
            starts = center + edge @ turn[:, :2].T + 2.0 * turn[:, 2]
            met = first_shape(scene, starts, np.broadcast_to(-turn[:, 2], starts.shape))
            assert np.all((np.asarray(met) >= 0) == hits)


@pytest.mark.parametrize("kind", [Rectangles, Triangles])
@pytest.mark.parametrize("unit", [1e-6, 1.0, 1e6])
def test_in_any_unit_of_length_a_ray_beside_an_edge_misses(kind, unit):
    axes = jnp.diag(jnp.array([unit, unit, 1.0], jnp.float32))
    scene = Scene.of(primitive(kind(jnp.zeros((1, 3), jnp.float32), axes[None])))
    start = unit * jnp.array([[1.001, 0.25, 2.0], [0.5, -0.001 - (kind is Rectangles), 2.0]])
    down = jnp.broadcast_to(jnp.array([0.0, 0.0, -1.0], jnp.float32), start.shape)
    assert first_shape(scene, start.astype(jnp.float32), down).tolist() == [-1, -1]
