"""One record of value, gradient and Hessian: what it reads off, and that both worlds agree."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from firstorder import flatland, space
from firstorder.scene._derivatives import FLATLAND, SPACE, Derivatives, derivatives

RNG = np.random.default_rng(3)


def quadratic(freedoms):
    m = len(freedoms)
    g, H = RNG.normal(size=m), RNG.normal(size=(m, m))
    return Derivatives(jnp.array(1.0), jnp.asarray(g), jnp.asarray(H + H.T), freedoms)


@pytest.mark.smoke
def test_derivatives_by_some_freedoms_are_rows_of_all():
    d = quadratic(SPACE)
    part = d.by("tilt_x", "x")
    assert part.freedoms == ("tilt_x", "x")
    np.testing.assert_array_equal(part.gradient, d.gradient[np.array([3, 0])])
    np.testing.assert_array_equal(part.hessian, d.hessian[np.ix_([3, 0], [3, 0])])


def test_what_is_not_there_is_refused_in_one_sentence():
    d = quadratic(FLATLAND)
    with pytest.raises(ValueError, match="must be among x, y, n, but has 'z'"):
        d.by("z")
    with pytest.raises(ValueError, match="one derivative for each of x, y, n"):
        _ = d.first
    with pytest.raises(ValueError, match="by x alone, not by all freedoms"):
        d.by("x").along(0.1)
    at = flatland.Receiver((0.0, 0.0), 0.0)
    with pytest.raises(ValueError, match="`freedoms` must be among x, y, n, but has 'tilt'"):
        derivatives(lambda at: at.n, at, freedoms=("tilt",))


def test_a_motion_of_one_plane_is_that_of_flatland():
    """What does not change along y is flatland: x, z and minus the tilt are its x, y and n."""
    d = quadratic(FLATLAND)
    place = np.array([0, 2, 3])
    sign = np.array([1.0, 1.0, -1.0])
    g, H = np.zeros(5), np.zeros((5, 5))
    g[place] = sign * d.gradient
    H[np.ix_(place, place)] = sign[:, None] * sign * d.hessian
    lifted = Derivatives(d.value, jnp.asarray(g), jnp.asarray(H), SPACE)
    kappa, change = 0.7, -0.4
    S = jnp.diag(jnp.array([kappa, 0.0]))
    dS = jnp.zeros((2, 2, 2)).at[0, 0, 0].set(change)
    flat, full = d.along(kappa, change), lifted.along(S, dS)
    np.testing.assert_allclose(full.gradient[0], flat.first, rtol=1e-14)
    np.testing.assert_allclose(full.hessian[0, 0], flat.second, rtol=1e-14)


def test_along_a_valley_the_normal_turns_and_the_place_rises():
    """Of a polynomial in x, y and n along x = t, y = kappa t^2 / 2, n = kappa t."""
    d, kappa = quadratic(FLATLAND), 0.7
    (_, E_y, _), H = np.asarray(d.gradient), np.asarray(d.hessian)
    found = d.along(kappa)
    np.testing.assert_allclose(found.first, d.gradient[0] + kappa * d.gradient[2], rtol=1e-12)
    second = H[0, 0] + 2.0 * kappa * H[0, 2] + kappa**2 * H[2, 2] + kappa * E_y
    np.testing.assert_allclose(found.second, second, rtol=1e-12)


def test_along_many_curvatures_each_has_its_value():
    d = quadratic(FLATLAND)
    found = d.along(jnp.array([0.3, 0.7]))
    assert found.value.shape == found.first.shape == (2,)
    assert found.second[1] == d.along(0.7).second


def test_a_number_is_a_curvature_alike_in_all_directions():
    d = quadratic(SPACE)
    one, other = d.along(0.3), d.along(0.3 * jnp.eye(2))
    np.testing.assert_allclose(one.hessian, other.hessian, rtol=1e-14)


@pytest.mark.parametrize("world", [flatland, space], ids=["flatland", "space"])
def test_one_script_works_in_both_worlds(world):
    """Gradient and Hessian of irradiance by all freedoms, against differences."""
    if world is flatland:
        lamp, ball = flatland.Segments((0.5, 1.0), (-0.5, 1.0)), flatland.Circles((0.2, 0.5), 0.1)
        at = flatland.Receiver((0.3, 0.0), 0.1)
    else:
        lamp = space.rectangle((0.0, 0.0, 1.0), (0.0, 0.5, 0.0), (0.5, 0.0, 0.0))
        ball, at = space.sphere((0.2, 0.1, 0.5), 0.1), space.receiver((0.3, 0.0, 0.0))
    scene = world.Scene.of(world.primitive(lamp, emission=1.0), world.primitive(ball))
    d = jax.jit(lambda: world.derivatives(world.irradiance, scene, at))()
    E = jax.jit(lambda u: world.irradiance(scene, at.displaced(u)))
    m = len(at.freedoms)
    h, steps = 1e-4, np.eye(m) * 1e-4
    first = [(E(e) - E(-e)) / (2.0 * h) for e in steps]
    second = [
        [(E(a + b) - E(a - b) - E(b - a) + E(-a - b)) / (4.0 * h * h) for a in steps] for b in steps
    ]
    np.testing.assert_allclose(
        d.gradient, first, rtol=0.0, atol=1e-6
    )  # h^2 times the third derivatives
    np.testing.assert_allclose(d.hessian, second, rtol=0.0, atol=1e-5)
    moved = world.irradiance(scene, at.moved(0.05 if m == 3 else jnp.array([0.05, 0.0])))
    slope = d.translation().gradient[..., 0]
    assert abs(moved - d.value - 0.05 * slope) < 0.05**2 * np.max(np.abs(d.hessian))
    assert d.along(0.4).gradient.shape == d.translation().gradient.shape


@pytest.mark.parametrize(("world", "d"), [(flatland, 2), (space, 3)])
def test_what_is_no_function_has_no_derivatives(world, d):
    with pytest.raises(TypeError, match=r"but is a str: write derivatives\(irradiance, scene, at"):
        world.derivatives("irradiance", world.Receiver.at(jnp.zeros(d)))
