"""Light along rays to panels of which each has its own radiance."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from firstorder.space import GaussianSky, Receiver, Scene, plane, primitive, rectangle
from firstorder.space.discontinuities import _queries as queries

AT = Receiver.at((0.0, 0.0, 0.0))
OFF, SIDES = 0.1, [(1.0, 1.0), (1.0, -1.0), (-1.0, 1.0), (-1.0, -1.0)]


def panel(x, y, emission, half=0.01):
    shape = rectangle((x, y, 1.0), (0.0, half, 0.0), (half, 0.0, 0.0))  # its front looks down
    return primitive(shape, emission=emission)


PANELS = [panel(OFF * x, OFF * y, 10.0**k) for k, (x, y) in enumerate(SIDES)]


def test_light_is_that_of_what_a_ray_meets_first_and_else_of_the_sky():
    scene = Scene.of(*PANELS, environment=0.5)
    ways = np.array([[2.0, -2.0, 20.0], [-0.1, 0.1, 1.0], [0.0, 0.0, 3.0], [0.1, 0.1, 1.0]])
    found = queries.light(scene, AT, np.zeros(3), ways.reshape(2, 2, 3))
    np.testing.assert_allclose(found, [[10.0, 100.0], [0.5, 1.0]])
    assert queries.light(scene, AT, np.zeros((0, 3)), np.zeros((0, 3))).shape == (0,)
    behind = queries.light(scene, AT, np.array([0.1, 0.1, 2.0]), np.array([[0.0, 0.0, -1.0]]))
    assert behind.tolist() == [0.0]  # the back is dark, and hides what is behind it


def test_rays_do_not_meet_the_shape_on_which_receivers_lie():
    floor = primitive(plane((0.0, 0.0, 0.0), (0.0, 0.0, 1.0)), emission=7.0)
    scene, down = Scene.of(floor, environment=0.5), np.array([[0.0, 0.0, -1.0]])
    above = np.array([0.0, 0.0, 0.3])
    assert queries.light(scene, AT, above, down).tolist() == [7.0]
    on = Receiver.at((0.0, 0.0, 0.0), on=0)
    assert queries.light(scene, on, above, down).tolist() == [0.5]


@pytest.mark.parametrize("flip", [1.0, -1.0])
@pytest.mark.parametrize(("x", "y"), SIDES)
def test_a_sum_about_a_crossing_alternates(flip, x, y):
    """Each panel has a power of ten of its own, and rays pass through their middles."""
    planes = flip * np.array([[1.0, 0.0, 0.0]]), np.array([[0.0, 3.0, 0.0]])
    up = np.array([[0.2, 0.1, 1.0]])
    towards = np.array([[x, 0.3 * y, 0.0]]), np.array([[0.3 * x, y, 0.0]]), up
    K, u = queries.crossing_sum(
        Scene.of(*PANELS), AT, np.zeros((1, 3)), planes, towards, np.array([OFF])
    )
    signs = np.sign(np.prod(SIDES, axis=1) * x * y)
    np.testing.assert_allclose(K, [signs @ 10.0 ** np.arange(4)])
    np.testing.assert_allclose(u, [[0.0, 0.0, 1.0]])


def test_rays_pass_along_the_images_of_the_edges():
    """Edges along (1, 0) and (3, 4) / 5 as seen: what lies along one is across the other."""
    a, b = OFF * np.array([[1.0, 0.0], [0.6, 0.8]])
    corners = [a + b, b - a, a - b, -a - b]  # on the sides ++, +-, -+ and -- of the two edges
    scene = Scene.of(*(panel(*c, 10.0**k) for k, c in enumerate(corners)))
    normals = np.array([[0.0, 1.0, 0.0]]), np.array([[0.8, -0.6, 0.0]])
    towards = *normals, np.array([[0.0, 0.0, 1.0]])
    K, _ = queries.crossing_sum(scene, AT, np.zeros((1, 3)), normals, towards, np.array([OFF]))
    np.testing.assert_allclose(K, [1.0 - 10.0 - 100.0 + 1000.0])


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_steps_share_the_digits_out(dtype):
    """The one a third of those that the other leaves; together half of all digits."""
    step, share = queries.steps(Receiver.at(np.zeros(3, dtype)), np.array([3.0]))
    eps = float(np.finfo(dtype).eps)
    np.testing.assert_allclose(step * share, 3.0 * np.sqrt(eps), rtol=1e-12)
    np.testing.assert_allclose(step / 3.0, share**3, rtol=1e-12)


def test_vectors_lose_what_is_across_the_plane_of_the_receivers():
    at = Receiver.at((1.0, 2.0, 3.0), (0.6, 0.0, 0.8))
    found = queries.tangential(at, np.array([[5.0, 2.0, 0.0], [0.6, 0.0, 0.8]]))
    np.testing.assert_allclose(found, [[3.2, 2.0, -2.4], [0.0, 0.0, 0.0]], rtol=0.0, atol=1e-15)


@pytest.mark.parametrize(("emission", "sky"), [(2.0, 0.5), (0.5, 2.0), (2.0, 0.0)])
def test_what_is_seen_is_more_than_rounding_of_the_brightest(emission, sky):
    scene = Scene.of(panel(0.0, 0.0, emission), environment=sky)
    most = 2e3 * np.finfo(float).eps
    strength = most * np.array([1.01, -1.01, 0.99, -0.99, 0.0, np.nan])
    assert queries.is_seen(scene, strength).tolist() == [True, True, *4 * [False]]


def test_what_cannot_be_looked_at_is_refused():
    scene = Scene.of(*PANELS)
    queries.check_concrete(scene, AT)
    with pytest.raises(ValueError, match="must be concrete"):
        jax.jit(lambda x: queries.check_concrete(scene, Receiver.at(jnp.full(3, x))))(1.0)
    sky = GaussianSky((0.0, 0.0, 1.0), 1.0, 0.3)
    with pytest.raises(ValueError, match="sky of one radiance"):
        queries.check_concrete(Scene.of(*PANELS, environment=sky), AT)
    with pytest.raises(ValueError, match="band"):
        queries.check_concrete(Scene.of(panel(0.0, 0.0, np.array([1.0, 2.0, 3.0]))), AT)
