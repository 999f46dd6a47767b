import jax
import numpy as np
import pytest

from firstorder.checks.statistics import LEVEL
from firstorder.space.estimators._triangulation import (
    _directions,
    hemisphere_triangulation,
    strata_triangulation,
)
from firstorder.space.estimators.strata import hemisphere_strata
from tests.samplers import disc_place, uniform_p_value


def solid(w, triangles):
    """Projected solid angle of triangles, feet on the horizon among their corners."""
    foot = w * [1.0, 1.0, 0.0]
    size = np.linalg.norm(foot, axis=1, keepdims=True)
    foot = np.where(size > 0, foot / np.where(size > 0, size, 1.0), [1.0, 0.0, 0.0])
    corners = np.concatenate([w, foot])[triangles]
    a, b = corners, np.roll(corners, -1, 1)
    c = np.cross(a, b)
    length = np.linalg.norm(c, axis=-1)
    angle = np.arctan2(length, np.sum(a * b, -1))
    return np.sum(0.5 * angle * c[..., 2] / np.where(length > 0, length, 1.0), 1)


@pytest.mark.parametrize(("rays", "seed"), [(4, None), (30, None), (150, 3)])
def test_a_net_covers_the_hemisphere_once(rays, seed):
    net = hemisphere_triangulation(rays, None if seed is None else jax.random.key(seed))
    m = int(np.sqrt(rays)) ** 2
    assert net.directions.shape == (m, 3)
    assert np.unique(net.triangles)[0] == 0  # no number counts from the end
    w = np.asarray(net.directions, float)
    assert np.allclose(np.linalg.norm(w, axis=1), 1.0, rtol=0.0, atol=1e-6)
    assert (w[:, 2] > 0).all()
    assert abs(solid(w, net.triangles).sum() - np.pi) < 1e-6
    if seed is None:
        assert (solid(w, net.triangles) > -1e-9).all()


@pytest.mark.parametrize("size", [(1, 3), (5, 16)])
def test_strata_are_joined_around_the_pole(size):
    w = np.asarray(hemisphere_strata(*size).directions, float).reshape(-1, 3)
    triangles, neighbours = strata_triangulation(*size)
    areas = solid(w, triangles)
    assert abs(areas.sum() - np.pi) < 1e-6
    assert (areas > -1e-9).all()
    assert neighbours.shape[0] == size[0] * size[1]


def test_the_cosine_is_the_density():
    w = np.asarray(hemisphere_triangulation(150).directions, float)
    assert np.abs(w[:, :2].T @ w[:, :2] / len(w) - 0.25 * np.eye(2)).max() < 1.0 / len(w)


def test_neighbours_are_near_and_each_of_them_once():
    net = hemisphere_triangulation(100)
    w = np.asarray(net.directions, float)
    for i in (0, 44, 99):
        others = [j for j in net.neighbours[i] if j != i]
        assert len(others) == len(set(others)) > 2
        assert np.abs(w[others] - w[i]).max() < 1.0


def test_a_seed_is_no_key():
    with pytest.raises(TypeError, match=r"`key` must be a key of random numbers|type hint"):
        hemisphere_triangulation(9, 0)  # pyright: ignore[reportArgumentType]


def test_too_few_rays_are_refused():
    with pytest.raises(ValueError, match="`rays` must be at least 4"):
        hemisphere_triangulation(3)
    words = "^Argument `rays` must be a positive integer, but is nan|violates type hint"
    with pytest.raises((ValueError, TypeError), match=words):
        hemisphere_triangulation(float("nan"))
    with pytest.raises(ValueError, match="at least 1 and 3"):
        strata_triangulation(2, 2)


def test_directions_come_by_their_cosine():
    """Projected to the disc all of them together are uniform; each is in a cell of its own."""
    keys = jax.random.split(jax.random.key(6), 600)
    w = np.asarray(jax.jit(jax.vmap(lambda k: _directions(6, k)))(keys))
    assert uniform_p_value(disc_place(w[..., :2].reshape(-1, 2)), 6) > LEVEL
    assert (
        uniform_p_value(disc_place(w[..., :2].reshape(-1, 2) * w[..., 2:].reshape(-1, 1))) < LEVEL
    )
