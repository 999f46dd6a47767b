"""Silhouettes: they touch the shape, and all that is seen of it lies to their left."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from firstorder.space import (
    Boxes,
    Cylinders,
    Discs,
    Ellipsoids,
    Planes,
    Rectangles,
    Scene,
    Triangles,
    primitive,
    silhouette,
    sphere,
)
from firstorder.space.shapes import kinds

CENTER = np.array([0.3, -0.2, 0.4])
AXES = np.array([[0.9, 0.2, 0.1], [-0.1, 0.7, 0.2], [0.2, -0.3, 0.8]])
# The last two stand beside the shape, below its upper end and above its lower one.
BESIDE = CENTER + np.array([[2.5, 0.5, 0.8], [-1.0, 2.0, -0.7]]) @ AXES.T
EYES = np.array(
    [
        [3.0, 1.0, -2.0],
        [0.2, 0.1, 3.0],
        [-2.0, 0.3, 0.5],
        [0.5, -1.4, 0.1],
        [1.0, 1.0, 1.6],
        *BESIDE,
    ]
)


def samples(kind, count=20000):
    """Points of the shape."""
    rng = np.random.default_rng(11)
    q = rng.normal(size=(count, 3))
    ball = q / np.linalg.norm(q, axis=1, keepdims=True)
    square = rng.uniform(-1.0, 1.0, (count, 3))
    disc = square[:, :2] * (1.0 / np.maximum(np.hypot(*square[:, :2].T), 1.0))[:, None]
    flat = {
        Ellipsoids: ball,
        Boxes: square / np.max(np.abs(square), 1, keepdims=True),
        Cylinders: np.where(
            rng.random(count)[:, None] < 0.5,
            np.c_[ball[:, :2] / np.hypot(*ball[:, :2].T)[:, None], square[:, 2]],
            np.c_[disc, np.sign(square[:, 2])],
        ),
        Discs: np.c_[disc, 0.0 * square[:, 2]],
        Rectangles: np.c_[square[:, :2], 0.0 * square[:, 2]],
        Triangles: np.c_[np.sort(np.abs(square[:, :2]), 1) @ [[1, -1], [0, 1]], 0 * square[:, 2]],
    }[kind]
    return CENTER + flat @ AXES.T


@pytest.fixture(scope="module", params=[k for k in kinds.KINDS if k is not Planes])
def seen(request):
    """A kind, and its outlines from all eyes."""
    scene = Scene.of(primitive(request.param(CENTER, AXES)))
    found = jax.jit(jax.vmap(lambda eye: silhouette(scene, eye)))(jnp.asarray(EYES))
    return request.param, jax.tree.map(np.asarray, found)


def pieces(found, i):
    """Points and derivatives along all live pieces from one eye."""
    t = np.linspace(0.0, 1.0, 201)[:, None]
    straight, curved = found.straight, found.curved
    for k in np.flatnonzero(straight.live[i]):
        a, b = straight.start[i, k], straight.end[i, k]
        yield a + t * (b - a), np.broadcast_to(b - a, (201, 3))
    for k in np.flatnonzero(curved.live[i]):
        c, a, b = curved.center[i, k], curved.a[i, k], curved.b[i, k]
        first, last = curved.first[i, k], curved.last[i, k]
        s = first + t * (last - first)
        yield c + a * np.cos(s) + b * np.sin(s), (b * np.cos(s) - a * np.sin(s)) * (last - first)


@pytest.mark.parametrize("i", range(len(EYES)))
def test_the_shape_lies_to_the_left_and_comes_close(seen, i):
    kind, found = seen
    eye = EYES[i]
    w = samples(kind) - eye
    w /= np.linalg.norm(w, axis=1, keepdims=True)
    total = 0
    for p, v in pieces(found, i):
        total += 1
        left = np.cross(p - eye, v)
        left /= np.linalg.norm(left, axis=1, keepdims=True)
        side = w @ left.T
        assert side.min() > -1e-12  # a convex shape is on one side of every tangent
        assert np.all(side.min(0) < 0.2)
    assert total > 0


@pytest.mark.parametrize("i", range(len(EYES)))
def test_the_pieces_close(seen, i):
    """The ends of all pieces cancel: each is the start of another."""
    _, found = seen
    ends = [(p[0], p[-1]) for p, _ in pieces(found, i)]
    starts, stops = (np.array(a) for a in zip(*ends, strict=True))
    for stop in stops:
        assert np.linalg.norm(starts - stop, axis=1).min() < 1e-12


def test_derivatives_are_finite_where_there_is_no_silhouette():
    things = [primitive(kind(CENTER, AXES)) for kind in kinds.KINDS]
    scene = Scene.of(*things)

    def total(eye):
        found = silhouette(scene, eye)
        return sum(
            jnp.sum(a) for a in jax.tree.leaves(found) if jnp.issubdtype(a.dtype, jnp.inexact)
        ) - jnp.sum(found.curved.a[-1] + found.curved.b[-1])

    for eye in (CENTER, CENTER + AXES[:, 0], CENTER + 3.0 * AXES[:, 1]):  # inside, on, edge-on
        assert np.all(np.isfinite(jax.jit(jax.grad(total))(jnp.asarray(eye))))


def test_an_eye_on_a_shape_or_in_its_plane_sees_no_edge_of_it():
    scene = Scene.of(
        primitive(Rectangles(CENTER, np.eye(3))), primitive(Ellipsoids([5.0, 0, 0], np.eye(3)))
    )
    beside = jnp.asarray(CENTER + np.array([3.0, 0.2, 0.0]))
    found = silhouette(scene, beside)
    assert not found.straight.live.any()
    assert found.curved.live.all()
    assert not silhouette(scene, beside, on=0).curved.live.any()


def test_the_horizon_of_a_plane_does_not_move():
    scene = Scene.of(primitive(Planes([0.0, 0.0, -1.0], np.eye(3))))
    slope = jax.jacobian(lambda eye: silhouette(scene, eye).curved.center - eye)(jnp.zeros(3))
    assert not np.any(slope)


def test_the_eye_may_be_whole_numbers_of_numpy():
    scene = Scene.of(primitive(sphere((0.0, 0.0, 4.0), 1.0)))
    whole, plain = silhouette(scene, np.array([0, 0, 1])), silhouette(scene, jnp.array([0.0, 0, 1]))
    np.testing.assert_array_equal(whole.curved.center, plain.curved.center)
