"""First hits and shadow rays of scenes."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from firstorder.scene import _intersect
from firstorder.space import (
    Scene,
    first_shape,
    nearest,
    occluded,
    plane,
    primitive,
    sphere,
)

rng = np.random.default_rng(7)
CENTERS, RADII = (
    rng.uniform(-2.0, 2.0, (24, 3)) + np.array([0.0, 0.0, 3.0]),
    rng.uniform(0.1, 0.4, 24),
)
SCENE = Scene.of(
    *(primitive(sphere(c, r)) for c, r in zip(CENTERS, RADII, strict=True)),
    primitive(plane((0.0, 0.0, 0.0), (0.0, 0.0, 1.0))),
)
ORIGINS = jnp.asarray(rng.uniform(-2.0, 2.0, (300, 3)) + np.array([0.0, 0.0, 3.0]))
ALONG = rng.normal(size=(300, 3))
ALONG = jnp.asarray(ALONG / np.linalg.norm(ALONG, axis=1, keepdims=True))


def test_few_and_many_shapes_are_searched_alike():
    rays, rank = (ORIGINS, ALONG, jnp.full(300, -1)), _intersect.ranks(SCENE.material.emission)
    many = first_shape(SCENE, ORIGINS, ALONG)
    for chunk in (1, 7, 100):
        found = _intersect.first_shape(SCENE.groups, rank, rays, chunk=chunk)
        np.testing.assert_array_equal(many, found)
    assert {-1, 24} < set(np.asarray(many).tolist())


def test_the_distance_is_that_of_the_shape():
    hits = nearest(SCENE, ORIGINS, ALONG)
    hit = np.asarray(hits.index) >= 0
    points = np.asarray(ORIGINS + jnp.where(hit, hits.t, 0.0)[:, None] * ALONG)[hit]
    index = np.asarray(hits.index)[hit]
    balls = index < 24
    apart = np.linalg.norm(points[balls] - CENTERS[index[balls]], axis=1)
    np.testing.assert_allclose(apart, RADII[index[balls]], rtol=1e-9)
    np.testing.assert_allclose(points[~balls, 2], 0.0, rtol=0.0, atol=1e-12)
    assert np.all(np.isinf(np.asarray(hits.t)[~hit]))


@pytest.mark.parametrize("behind", [False, True])
def test_a_ray_that_misses_a_ball_has_finite_derivatives(behind):
    """Infinity stands for the ball, which is asked beside the shape that the ray meets."""
    wall = plane((0.0, 0.0, 4.0), (0.0, 0.0, -1.0))

    def t(place):
        shapes = sphere(jnp.array([2.0, 0.0, 2.0]), 0.5), *((wall,) if behind else ())
        scene = Scene.of(*map(primitive, shapes))
        t = nearest(scene, place[None], jnp.array([[0.0, 0.0, 1.0]])).t[0]
        return jnp.where(jnp.isfinite(t), t, 0.0)

    slope = [0.0, 0.0, -1.0] if behind else [0.0, 0.0, 0.0]
    np.testing.assert_array_equal(jax.grad(t)(jnp.zeros(3)), slope)
    np.testing.assert_array_equal(jax.hessian(t)(jnp.zeros(3)), np.zeros((3, 3)))


def test_a_hit_has_the_derivative_of_its_shape():
    def t(height):
        moved = Scene.of(primitive(sphere(jnp.array([0.0, 0.0, height]), 0.5)))
        return nearest(moved, jnp.zeros((1, 3)), jnp.array([[0.0, 0.0, 1.0]])).t[0]

    np.testing.assert_allclose(jax.value_and_grad(t)(2.0), (1.5, 1.0))


def test_points_see_each_other_or_not():
    ball = Scene.of(
        primitive(sphere((0.0, 0.0, 1.0), 0.5)), primitive(plane((0.0, 0.0, 0.0), (0.0, 0.0, 1.0)))
    )
    floor, under, beside = jnp.array([[0.0, 0.0, 0.0], [0.0, 0.0, 0.5], [2.0, 0.0, 1.0]])
    above = jnp.array([0.0, 0.0, 3.0])
    a = jnp.stack([floor, beside, floor, under])
    b = jnp.stack([above, above, under, floor])
    found = occluded(ball, a, b, on_a=jnp.array([1, -1, 1, 0]), on_b=jnp.array([-1, -1, 0, 1]))
    assert found.tolist() == [True, False, False, False]


@pytest.mark.parametrize("dtype", ["float32", "float64"])
def test_precision_is_kept(dtype):
    scene = jax.tree.map(lambda a: a.astype(dtype), SCENE)
    hits = nearest(scene, ORIGINS.astype(dtype), ALONG.astype(dtype))
    assert hits.t.dtype == dtype
    same = np.mean(np.asarray(hits.index) == np.asarray(first_shape(SCENE, ORIGINS, ALONG)))
    assert same > 0.99
