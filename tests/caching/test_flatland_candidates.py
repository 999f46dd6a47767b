import jax.numpy as jnp
import numpy as np
import pytest
from scipy.special import ellipe, ellipeinc

from derivations.caching._light import scene_a_columns
from derivations.squares import FIRST
from firstorder import caching, flatland
from firstorder.caching import (
    flatland_candidates,
    gradient_discontinuities,
    radius_with_events,
    scene_candidates,
)
from firstorder.caching.flatland_candidates import _ray_lengths
from firstorder.flatland import Arcs, Scene, Segments, primitive

FLOOR = primitive(Segments((-1.0, 0.0), (1.0, 0.0)), name="floor")
LAMP = primitive(Segments((0.5, 1.0), (-0.5, 1.0)), emission=1.0)
BLOCKER = primitive(Segments((0.2, 0.5), (-0.2, 0.5)))
S = jnp.array([0.05, 0.3, 0.45, 0.8])


def columns(found):
    """E, E', E'', ... one column each."""
    held = [a for a in (found.value, found.gradient, found.hessian, found.third) if a is not None]
    return np.stack([np.asarray(a).reshape(found.count) for a in held], -1)


@pytest.fixture(scope="module")
def bare():
    return scene_candidates(Scene.of(FLOOR, LAMP), 0, S, rays=2048)


@pytest.fixture(scope="module")
def blocked():
    """Also a little left and right of a kink at s = 0.45."""
    scene = Scene.of(FLOOR, LAMP, BLOCKER)
    s = jnp.concatenate([S, jnp.array([0.45 - 1e-6, 0.45 + 1e-6])])
    return scene_candidates(scene, 0, s, derivatives=2, rays=16), gradient_discontinuities(scene, 0)


def test_under_a_lamp_all_is_closed_form(bare):
    np.testing.assert_allclose(bare.position[:, 0], 2.0 * S, rtol=1e-14)
    np.testing.assert_allclose(columns(bare), scene_a_columns(2.0 * S - 1.0), rtol=0.0, atol=1e-12)
    # The lamp alone is met, at 1 / cos: the mean of 1/D over the sines of its angles.
    x = np.asarray(2.0 * S - 1.0)
    a, b = np.arctan(-0.5 - x), np.arctan(0.5 - x)
    mean = 0.5 * (b - a + 0.5 * (np.sin(2 * b) - np.sin(2 * a))) / 2.0
    np.testing.assert_allclose(bare.harmonic, 1.0 / mean, rtol=2e-3)
    near = np.hypot(np.clip(x, -0.5, 0.5) - x, 1.0)
    np.testing.assert_allclose(bare.minimum, near, rtol=1e-3)


def test_on_a_valley_derivatives_are_in_arc_length():
    """Differences along the arc of the columns themselves; the first is the exact E."""
    valley = primitive(Arcs((0.0, 1.5), 1.5, np.pi - 0.8, 1.6), name="valley")
    scene = Scene.of(valley, primitive(Segments((0.5, 1.2), (-0.5, 1.2)), emission=1.0))
    h, at = 0.01, 0.37
    s = at + h * np.arange(-4, 5)
    found = scene_candidates(scene, *scene.named("valley"), jnp.asarray(s), derivatives=2, rays=8)
    x, E = np.asarray(found.position[:, 0]), columns(found)
    np.testing.assert_allclose(np.diff(x), 1.5 * 1.6 * h, rtol=1e-12)
    np.testing.assert_allclose(np.diff(found.tilt[:, 0]), 1.6 * h, rtol=1e-10)
    for k in range(2):
        slope = FIRST @ E[:, k] / (x[1] - x[0])
        assert slope == pytest.approx(E[4, k + 1], rel=1e-6)


@pytest.mark.smoke
def test_kinks_are_where_edges_line_up(blocked):
    found, (x, J, S0) = blocked
    np.testing.assert_allclose(x, [0.1, 0.9, 1.1, 1.9], rtol=0.0, atol=1e-12)
    assert np.all(S0 == 0.0)
    assert J[1] == pytest.approx(float(columns(found)[5, 1] - columns(found)[4, 1]), rel=1e-4)


def test_a_radius_that_knows_of_kinks_is_smaller_before_them(blocked):
    found, (x, J, _) = blocked
    h = columns(found)[:, 2]
    d = x - np.asarray(found.position)
    knowing = radius_with_events([h], 0.01, 1e-3, 3.0, d, J)
    blind = radius_with_events([h], 0.01, 1e-3, 3.0)
    assert np.all(knowing <= blind)
    assert knowing[4] < 0.9 * blind[4]


def test_black_things_change_nothing_but_the_lengths(bare):
    """To rounding: more gaps are summed in another order."""
    wall = primitive(Segments((-1.0, 2.0), (-1.0, 0.0)))
    walled = scene_candidates(Scene.of(FLOOR, LAMP, wall), 0, S, derivatives=2, rays=2048)
    np.testing.assert_allclose(columns(bare)[:, :3], columns(walled), rtol=1e-14)
    assert np.all(walled.harmonic < bare.harmonic)


def test_rays_are_uniform_in_the_sine():
    half = primitive(Segments((1e6, 1.0), (0.0, 1.0)))
    t = _ray_lengths(Scene.of(FLOOR, half), 0, jnp.array([0.5]), rays=4096)
    assert np.mean(np.isfinite(t)) == pytest.approx(0.5, abs=1e-3)


@pytest.mark.smoke
def test_bad_input_is_one_sentence():
    with pytest.raises(ValueError, match=r"^Argument `s` must lie in \[0, 1\], but is 1.5.$"):
        scene_candidates(Scene.of(FLOOR, LAMP), 0, jnp.array([1.5]))
    with pytest.raises(
        ValueError, match=r"^Argument `index` must be the number of a shape, 0 to 1"
    ):
        gradient_discontinuities(Scene.of(FLOOR, LAMP), 2)


def test_no_places_are_no_candidates():
    none = scene_candidates(Scene.of(FLOOR, LAMP), 0, jnp.zeros(0))
    assert np.shape(none.third) == (0, 1, 1, 1)


@pytest.mark.parametrize("thin", [0.5, 0.1, 0.02])
def test_arc_lengths_on_a_thin_ellipse_are_elliptic_integrals(thin):
    oval = flatland.primitive(flatland.Ellipses((0.2, 0.1), (1.0, thin), 0.3))
    s = np.array([0.0, 0.1, 0.25, 0.3, 0.77, 1.0])
    found = flatland_candidates._arc_length(flatland.Scene.of(oval), 0, s)
    whole = 4.0 * ellipe(1.0 - thin**2)
    np.testing.assert_allclose(found[-1], whole, rtol=1e-9)
    truth = ellipeinc(2.0 * np.pi * s, 1.0 - thin**2)
    np.testing.assert_allclose(found, truth, rtol=1e-9, atol=1e-14)


@pytest.mark.parametrize("s", [0.5, [[0.5]]])
def test_parameters_of_candidates_are_a_row(s):
    floor = flatland.primitive(flatland.Segments((-1.0, 0.0), (1.0, 0.0)))
    with pytest.raises(ValueError, match="Argument `s` must have shape"):
        caching.scene_candidates(flatland.Scene.of(floor), 0, jnp.asarray(s))
