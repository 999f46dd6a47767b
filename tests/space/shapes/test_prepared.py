"""Distances to shapes as searches ask for them: rays along axes, from inside, from the shape."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from firstorder.space import Boxes, Cylinders, Discs, Ellipsoids, Planes, Rectangles, Triangles

INF = np.inf
# Canonical origins and directions, with the distances that geometry gives, kind by kind. None
# starts level with a plane or where the ray is nearest to the middle of a ball: there
# rounding decides.
RAYS = {
    Ellipsoids: [
        ((0, 0, -3), (0, 0, 1), 2),
        ((0, 0, 0), (1, 0, 0), 1),
        ((0.6, 0.1, 0), (0, -1, 0), 0.9),
        ((0, 0, 3), (0, 0, 1), INF),
        ((0, 1.5, -3), (0, 0, 1), INF),
        ((0.6, 0, -9), (0, 0, 1), 8.2),
    ],
    Boxes: [
        ((0.5, 0.5, -3), (0, 0, 1), 2),
        ((0.5, 0.5, 0), (0, -1, 0), 1.5),
        ((1.5, 0, -3), (0, 0, 1), INF),
        ((-1.5, 0, 0), (0, 0, 1), INF),
        ((0, 0, 3), (0, 0, 1), INF),
        ((-2, 0, 0), (1, 0, 0), 1),
        ((2, 0, 0), (-0.8, 0, 0.6), 1.25),
    ],
    Cylinders: [
        ((0.5, 0, -3), (0, 0, 1), 2),
        ((0.5, 0, 0), (0, 0, -1), 1),
        ((1.5, 0, -3), (0, 0, 1), INF),
        ((-3, 0.6, 0), (1, 0, 0), 2.2),
        ((0, 0.6, 0), (-1, 0, 0), 0.8),
        ((-3, 0, 1.5), (1, 0, 0), INF),
        ((0, 0, 3), (0, 0, 1), INF),
    ],
    Discs: [
        ((0.5, 0, 2), (0, 0, -1), 2),
        ((0.5, 0, -2), (0, 0, 1), 2),
        ((0.5, 0, 2), (0, 0, 1), INF),
        ((0.9, 0.9, 2), (0, 0, -1), INF),
        ((-2, 0, 0.1), (1, 0, 0), INF),
    ],
    Rectangles: [((0.9, -0.9, 2), (0, 0, -1), 2), ((1.1, 0, 2), (0, 0, -1), INF)],
    Triangles: [((0.4, 0.5, 2), (0, 0, -1), 2), ((0.6, 0.5, 2), (0, 0, -1), INF)],
    Planes: [((40, 7, 2), (0.6, 0, -0.8), 2.5), ((40, 7, 2), (0.6, 0, 0.8), INF)],
}
TURN = np.linalg.qr(np.random.default_rng(8).normal(size=(3, 3)))[0]


@pytest.mark.parametrize("kind", RAYS, ids=lambda kind: kind.__name__)
@pytest.mark.parametrize("turn", [np.eye(3), TURN * np.linalg.det(TURN)], ids=["upright", "turned"])
@pytest.mark.parametrize("size", [1.0, 1e-9, 1e9])
def test_distances_are_those_of_geometry(kind, turn, size):
    """Of rays along the axes too, where a slab has no quotient, and of any size."""
    o, d, true = (np.array(a, float) for a in zip(*RAYS[kind], strict=True))
    center = size * np.array([0.3, -0.2, 0.5])
    shapes = kind(np.stack([center] * 2), np.stack([size * turn, 2.0 * size * turn]))
    prepared = jax.vmap(lambda shape: shape.prepared())(shapes)
    one = jax.tree.map(lambda a: a[0], prepared)
    ask = jax.jit(jax.vmap(lambda o, d, own: one.distance(o, d, own)))
    start, along = jnp.asarray(center + size * o @ turn.T), jnp.asarray(d @ turn.T)
    nowhere = jnp.zeros(len(o), bool)
    np.testing.assert_allclose(ask(start, along, nowhere), size * true, rtol=1e-9)
    assert np.all(np.isinf(ask(start, along, ~nowhere)))
    assert prepared.count == 2


@pytest.mark.parametrize("kind", [Discs, Planes])
@pytest.mark.parametrize("height", [0.0, 2.0])
def test_what_is_flat_is_not_met_edge_on(kind, height):
    """By a ray in its plane or beside it, for which there is no quotient."""
    one = jax.tree.map(lambda a: a[0], kind(np.zeros(3), np.eye(3)).prepared())
    assert jnp.isinf(
        one.distance(jnp.array([-2.0, 0.0, height]), jnp.array([1.0, 0.0, 0.0]), False)
    )


@pytest.mark.parametrize("kind", RAYS, ids=lambda kind: kind.__name__)
def test_derivatives_are_those_of_geometry_and_none_where_there_is_no_hit(kind):
    """By differences, in origin and direction; a miss has the derivative zero, not NaN."""
    one = jax.tree.map(lambda a: a[0], kind(np.zeros(3), TURN).prepared())
    ask = jax.jit(jax.vmap(lambda o, d: one.distance(o, d, False)))
    slopes = jax.jit(jax.vmap(jax.grad(lambda o, d: one.distance(o, d, False), (0, 1))))
    o, d, true = (np.array(a, float) for a in zip(*RAYS[kind], strict=True))
    ray = np.stack([o @ TURN.T, d @ TURN.T])
    found, h = np.stack(slopes(*ray)), 1e-6
    for k in range(3):
        step = h * np.eye(3)[k]
        for which in (0, 1):
            more, less = ray.copy(), ray.copy()
            more[which] += step
            less[which] -= step
            with np.errstate(invalid="ignore"):
                by_differences = (np.asarray(ask(*more)) - np.asarray(ask(*less))) / (2.0 * h)
            slope = np.where(np.isfinite(true), by_differences, 0.0)
            np.testing.assert_allclose(found[which, :, k], slope, rtol=1e-6, atol=1e-6)
