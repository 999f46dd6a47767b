import jax
import jax.numpy as jnp
import numpy as np
import pytest

from firstorder import caching
from firstorder.caching import CLAMPS, ValidityRegion, circular_regions, screen_limits
from firstorder.caching.regions import _check_regions
from firstorder.imaging import pinhole


@pytest.mark.smoke
@pytest.mark.parametrize("dims", [1, 2])
def test_clamps_are_reported(dims):
    found = circular_regions(jnp.array([0.0, 0.1, 0.5, 2.0, 3.0, jnp.inf]), 0.1, 2.0, dims)
    assert found.radius.tolist() == [0.1, 0.1, 0.5, 2.0, 2.0, 2.0]
    assert [CLAMPS[c] for c in found.clamp.tolist()] == ["raised", "", "", "", "cut", "cut"]
    assert np.isnan(circular_regions(jnp.nan, 0.1, 2.0, dims).radius)


def test_an_ellipse_has_the_radius_of_the_disc_of_its_area():
    region = ValidityRegion(jnp.array([[[2.0, 0.0], [0.0, 8.0]], [[0.0, 2.0], [8.0, 0.0]]]))
    np.testing.assert_allclose(region.radius, 0.25)
    lengths, angle = region.axes()
    np.testing.assert_allclose(lengths, [[0.5, 0.125]] * 2)
    np.testing.assert_allclose(angle % np.pi, [0.0, np.pi / 2], rtol=0.0, atol=1e-12)


def test_some_of_the_regions_are_chosen_with_what_acted():
    found = circular_regions(np.array([0.01, 0.2, 9.0]), 0.1, 1.0).at(np.array([2, 0]))
    assert found.radius.tolist() == [1.0, 0.1]
    assert found.clamp.tolist() == [1, -1]
    free = ValidityRegion(jnp.ones((3, 1, 1))).at(slice(2))
    assert free.clamp.tolist() == [0, 0]


@pytest.mark.smoke
@pytest.mark.parametrize("dims", [1, 2])
@pytest.mark.parametrize(
    ("given", "words"),
    [
        ((1.0, 2.0, 1.0), "Argument `high` must be at least 2, but is 1."),
        ((1.0, 0.0, 1.0), "Argument `low` must be positive, but is 0.0."),
        ((jnp.ones(2), -1.0, 1.0), "Argument `low` must be positive, but is -1.0."),
        ((-1.0, 0.1, 1.0), "Argument `radius` must not be negative, but is -1.0."),
    ],
)
def test_bad_input_is_one_sentence(given, words, dims):
    with pytest.raises(ValueError, match=r"must") as failure:
        circular_regions(*given, dims)
    assert str(failure.value) == words


def test_another_number_of_dimensions_is_refused():
    with pytest.raises(ValueError, match=r"^Argument `dims` must be 1 or 2, but is 3.$"):
        circular_regions(1.0, 0.1, 1.0, 3)


# --- limits on screen ----------------------------------------------------------------------------

CAMERA = pinhole((2.0, -1.0, 3.0), (0.2, 0.1, 0.0), gamma=1.3)
PLACES = np.random.default_rng(0).uniform(-1.0, 1.0, (5, 3))


def on_screen(point):
    """Image coordinates, by similar triangles."""
    right, up, back = np.asarray(CAMERA.axes).T
    away = point - np.asarray(CAMERA.eye)
    return 1.3 / -(away @ back)[..., None] * np.stack([away @ right, away @ up], -1)


def test_a_disc_towards_the_camera_has_as_many_pixels_as_asked_for():
    """Anywhere on the image, off its middle too."""
    low, high = screen_limits(CAMERA, PLACES, 0.005, pixels=(2.0, 40.0))
    right, up, _ = np.asarray(CAMERA.axes).T
    for aside in (right, 0.6 * right + 0.8 * up):
        for radius, pixels in ((low, 2.0), (high, 40.0)):
            rim = on_screen(PLACES + np.asarray(radius)[:, None] * aside)
            seen = np.linalg.norm(rim - on_screen(PLACES), axis=-1) / 0.005
            np.testing.assert_allclose(seen, pixels, rtol=1e-12)


def test_the_distance_in_the_place_of_the_depth_is_noticed():
    low, _ = screen_limits(CAMERA, PLACES, 0.005)
    away = np.linalg.norm(PLACES - np.asarray(CAMERA.eye), axis=1) * 1.5 * 0.005 / 1.3
    assert np.max(np.abs(low / away - 1.0)) > 0.01


@pytest.mark.parametrize("dims", [1, 2])
def test_each_record_has_limits_of_its_own(dims):
    low, high = screen_limits(CAMERA, PLACES, 0.005, pixels=(2.0, 40.0), world=(0.0, 0.5))
    found = circular_regions(jnp.array([0.0, 1e3, 0.05, 0.0, 1e3]), low, high, dims)
    np.testing.assert_allclose(found.radius, [low[0], high[1], 0.05, low[3], high[4]])
    assert found.clamp.tolist() == [-1, 1, 0, -1, 1]


def test_metres_hold_where_pixels_disagree():
    low, high = screen_limits(CAMERA, PLACES, 0.005, pixels=(2.0, 40.0), world=(0.3, 0.35))
    assert np.all((low == 0.3) & (high == 0.35))


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"position": CAMERA.eye + CAMERA.axes[:, 2]}, "`position` must be positive"),
        ({"pixel": 0.0}, "`pixel` must be positive"),
        ({"pixels": (3.0, 2.0)}, r"`pixels` must be a range, but is \(3, 2\)"),
        ({"world": (-1.0, 2.0)}, "`world` must be a range"),
        ({"world": (0.0, 0.0)}, r"`world` must be a range, but is \(0, 0\)"),
    ],
)
def test_limits_that_no_camera_has_are_refused(change, words):
    options = {"camera": CAMERA, "position": PLACES, "pixel": 0.01} | change
    with pytest.raises(ValueError, match=words):
        screen_limits(**options)


def test_traced_records_behind_the_camera_have_no_limits():
    behind = CAMERA.eye + CAMERA.axes[:, 2]
    limits = jax.jit(lambda x: screen_limits(CAMERA, x, 0.01, world=(0.1, 0.5)))
    assert np.all(np.isnan(limits(behind)))
    assert np.all(np.isfinite(limits(jnp.asarray(PLACES[0]))))


@pytest.mark.parametrize("world", [(0.0, 1.0), (1.0, 1.0)])
def test_limits_may_start_at_nothing_and_be_one_number(world):
    low, high = screen_limits(CAMERA, PLACES, 0.005, world=world)
    for radius in (low, high):
        assert np.all((radius >= world[0]) & (radius <= world[1]))


def test_radii_are_no_regions():
    with pytest.raises(TypeError, match=r"as `circular_regions` makes of radii, but is a float.$"):
        _check_regions(0.3, 1, 1)


def test_limits_in_the_wrong_order_name_the_first():
    with pytest.raises(ValueError, match=r"^Argument `high` must be at least 3, but is 2.$"):
        circular_regions(np.ones(2), np.array([1.0, 3.0]), 2.0)


@pytest.mark.parametrize(
    ("radius", "low", "high"),
    [(-1.0, 0.1, 1.0), (0.5, 2.0, 1.0), (0.5, -2.0, 1.0), (0.5, 0.1, -2.0), (0.5, 0.1, jnp.inf)],
)
def test_traced_radii_and_limits_that_would_be_refused_give_nan(radius, low, high):
    found = jax.jit(caching.circular_regions)(radius, low, high)
    assert jnp.isnan(found.radius)
    R = jax.jit(lambda low, high: caching.radius_with_events([1.0], 0.01, low, high))(low, high)
    assert jnp.isnan(R) == (radius > 0.0)
