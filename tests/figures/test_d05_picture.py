import numpy as np
import pytest

from figures.d05.shared import picture, receiver, space

UP = np.array([[0.0, 0.0, 1.0]])


@pytest.fixture(scope="module")
def balls():
    return space.Balls.jittered(0.48)


@pytest.mark.parametrize("hidden", [False, True])
def test_the_light_of_the_receiver_is_that_of_rays_to_all_slopes(balls, hidden):
    x, blockers = np.array([-0.6, 0.1, 0.5]), balls if hidden else None
    rays = receiver.irradiance(blockers, x, 400)
    points = np.stack([*np.meshgrid(x, x, indexing="ij"), np.zeros((3, 3))], -1).reshape(-1, 3)
    found = picture.source_light(points, np.tile(UP, (9, 1)), blockers, nodes=60 if hidden else 20)
    # A ball's rim passes between nodes: a row of them, of some twenty that count, is undecided.
    off = 0.05 * rays.max() if hidden else 1e-5 * rays.max()
    assert np.allclose(found.reshape(3, 3), rays, rtol=0.0, atol=off)
    if hidden:
        assert np.max(abs(rays - receiver.irradiance(None, x, 400))) > 4.0 * off


def test_a_ray_meets_the_nearest_of_all_balls(balls):
    eye = np.array([1.0, -7.5, 1.8])
    rng = np.random.default_rng(1)
    way = np.column_stack([rng.uniform(-2, 2, (400, 2)), np.ones(400)]) - eye
    way /= np.linalg.norm(way, axis=1)[:, None]
    t, middle = (np.asarray(a) for a in picture._nearest_ball(balls, eye, way, 1.8))
    c = np.asarray(balls.centers).reshape(-1, 2) * (-1.0, 1.0)
    c = c[np.all(np.abs(c) < 1.8 - balls.radius, axis=1)]
    every = np.concatenate([c, np.full((len(c), 1), space.SECOND)], 1)
    each = np.array([picture.sphere(m, balls.radius)(eye, way) for m in every])
    met = np.isfinite(each.min(0))
    assert 0.1 < met.mean() < 0.9
    assert np.array_equal(np.isfinite(t), met)
    assert np.allclose(t[met], each.min(0)[met])
    assert np.allclose(middle[met], every[each.argmin(0)[met]])
