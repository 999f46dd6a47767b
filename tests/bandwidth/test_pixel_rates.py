"""Bandwidths pixel by pixel: against rays, spectra of slices, differences in images, and faults."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from derivations.bandwidth import _bandwidth_space as space
from derivations.bandwidth import pixel_rates as derived
from firstorder.bandwidth import glossy_bandwidth_in_space, occluded_bandwidth
from firstorder.bandwidth import pixel_rates as maps
from firstorder.bandwidth import screen_space as screen
from firstorder.imaging.camera import pinhole
from firstorder.imaging.hits import GBuffer, gbuffer
from firstorder.imaging.images import pixel_grid, pixel_labels, pixel_positions
from firstorder.space import Scene, box, plane, primitive, sphere


def pixel(d=1.5, S=((-0.7, 0.2), (0.2, 0.4)), theta=0.6):
    up, one = jnp.array([0.0, 0.0, 1.0]), jnp.ones(())
    return GBuffer(0.0 * up, up, up, d * one, jnp.cos(theta) * one, jnp.asarray(S))


# --- closed forms ------------------------------------------------------------------------------


@pytest.mark.smoke
def test_without_blockers_it_is_the_mirror_in_space():
    at = pixel()
    ours = glossy_bandwidth_in_space(1.3, at.distance, at.S, at.cosine)
    assert maps.glossy_bandwidth_map(1.3, at).item() == pytest.approx(float(ours), rel=1e-14)


@pytest.mark.parametrize("kappa", [-1.0, 0.0, 0.3])
def test_in_the_plane_of_view_it_is_flatland(kappa):
    """A trough seen along its curved direction; across it nothing turns faster."""
    at = pixel(S=((kappa, 0.0), (0.0, kappa * np.cos(0.6) ** -2)))
    ours = maps.glossy_bandwidth_map(1.3, at, 0.8, 0.5)
    flat = occluded_bandwidth(1.3, 1.5, kappa, np.cos(0.6), 1.0 / 0.8, light=0.5)
    assert ours.item() == pytest.approx(float(flat), rel=1e-12)


def relative(ours, true):
    return abs(float(ours) - true) / true


def test_units_do_not_matter():
    at, far = pixel(), pixel(d=1500.0, S=1e-3 * np.array([[-0.7, 0.2], [0.2, 0.4]]))
    for own in (maps.glossy_bandwidth_map, maps.diffuse_bandwidth_map):
        assert relative(own(1.3, far, 0.8e-3, 0.5), own(1.3, at, 0.8, 0.5)) < 1e-13


GLOSSY = maps.glossy_bandwidth_map


def no_eye(cutoff, at, slope=0.0, light=0.0):
    """D05 (21): the 1 is missing."""
    c, d, k = float(at.cosine), float(at.distance), np.max(np.abs(np.linalg.eigvalsh(at.S)))
    return d / c * (slope + 2.0 * k) * cutoff


def no_light(cutoff, at, slope=0.0, light=0.0):
    return GLOSSY(cutoff, at, slope)


def against(cutoff, at, slope=0.0, light=0.0):
    """The blocker turns the other way."""
    bent = GBuffer(
        at.position, at.normal, at.to_eye, at.distance, at.cosine, at.S + slope * jnp.eye(2)
    )
    return GLOSSY(cutoff, bent, 0.0) + at.distance * slope * light


@pytest.mark.parametrize("fault", [no_eye, no_light, against])
def test_rays_and_slices_notice_faults(monkeypatch, fault):
    assert derived.by_rays(True) < 1e-6
    monkeypatch.setattr(maps, "glossy_bandwidth_map", fault)
    assert derived.by_rays(True) > 1e-2
    assert derived.by_slices(True) > 1e-2


def test_slices_see_the_bound_reached_and_never_passed():
    d, S, theta, s = next(space.configurations(1, seed=21))
    for gloss, own in ((True, maps.glossy_bandwidth_map), (False, maps.diffuse_bandwidth_map)):
        bound = float(own(1500.0, pixel(d, S, theta), s, 900.0))
        assert space.reach(d, S, theta, s, gloss, 1500.0, 900.0, tries=6) < 1.01 * bound


def test_rms_cutoffs_are_those_of_the_lobes():
    """Numerically: the mean square of the derivative over that of the lobe, over 4 pi^2."""
    t = np.linspace(-0.5 * np.pi, 0.5 * np.pi, 20001)
    for s in (1.0, 3.0, 250.0):
        lobe = np.cos(t) ** s
        rms = np.sqrt(np.sum(np.gradient(lobe, t) ** 2) / np.sum(lobe**2)) / (2.0 * np.pi)
        assert float(maps.rms_cutoff(s)) == pytest.approx(rms, rel=1e-3)
    assert float(maps.rms_cutoff(0.5)) == np.inf
    assert np.isfinite(float(jax.grad(maps.rms_cutoff)(0.7)))


# --- images ------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def image():
    """A ball and a box on a floor, 96 x 64."""
    scene = Scene.of(
        primitive(plane((0, 0, 0), (0, 0, 1)), name="floor"),
        primitive(sphere((0.0, 0.0, 0.6), 0.6), name="ball"),
        primitive(box((0.9, -0.4, 0.0), (1.3, 0.4, 0.5)), name="box"),
    )
    camera = pinhole((0.3, -4.0, 2.0), (0.2, 0.0, 0.4), gamma=2.0)
    p = pixel_positions(*pixel_grid(96, 64))
    index, label = (np.asarray(a) for a in pixel_labels(scene, camera, jnp.asarray(p)))
    return scene, camera, p, index, label.reshape(96, 64), gbuffer(scene, camera, p, index)


def test_differences_between_pixels_are_the_closed_form(image):
    """Inside of shapes, away from slants: central differences err as the square of a pixel."""
    _, camera, p, _, label, at = image
    x, n = (np.asarray(a).reshape(96, 64, 3) for a in (at.position, at.normal))
    turns = screen.pixel_differences(x, n, camera.eye, label)
    step = np.asarray(maps.radians_per_pixel(camera, p, 2.0 / 96)).reshape(96, 64)
    inner = np.ones_like(label, bool)
    for axis in (0, 1):
        for by in (-1, 1):
            inner &= np.roll(label, by, axis) == label
    inner[[0, -1]] = inner[:, [0, -1]] = False
    inner &= np.asarray(at.cosine).reshape(96, 64) > 0.5
    for own, seen in (
        (maps.glossy_bandwidth_map, screen.screen_glossy_bandwidth),
        (maps.diffuse_bandwidth_map, screen.screen_diffuse_bandwidth),
    ):
        exact = np.asarray(own(1.3, at, 0.7, 0.5)).reshape(96, 64) * step
        found = np.asarray(seen(1.3, turns, 0.7, 0.5))
        ratio = found[inner] / exact[inner]
        # Pixels off the axis are wider along the radius: up to 1 / cos of 28 degrees.
        assert np.median(abs(ratio - 1.0)) < 0.03
        assert np.max(abs(ratio - 1.0)) < 0.15


def test_a_pixel_alone_turns_by_nothing():
    label = np.arange(12).reshape(4, 3)
    x = np.random.default_rng(0).normal(size=(4, 3, 3))
    n = np.broadcast_to((0.0, 0.0, 1.0), x.shape)
    turns = screen.pixel_differences(x, n, np.array([0.0, 0.0, 9.0]), label)
    assert all(np.all(a == 0.0) for a in turns)


def test_curvatures_seen_are_those_of_the_shapes(image):
    scene, _, _, index, _, at = image
    ball, floor = index == scene.named("ball")[0], index == scene.named("floor")[0]
    S = np.asarray(at.S)
    np.testing.assert_allclose(
        S[ball], np.broadcast_to(-np.eye(2) / 0.6, S[ball].shape), rtol=0.0, atol=1e-9
    )
    np.testing.assert_allclose(S[floor], 0.0, rtol=0.0, atol=1e-12)
    assert np.all(np.asarray(at.cosine) > 0.0)
    assert np.all(np.isfinite(S))


def test_the_sky_is_a_plane_across_the_ray(image):
    scene, camera, p, *_ = image
    at = gbuffer(scene, camera, p[:3], np.full(3, -1))
    assert np.all(at.S == 0.0)
    np.testing.assert_allclose(at.cosine, 1.0)
    np.testing.assert_allclose(maps.glossy_bandwidth_map(2.0, at), 2.0)


# --- blockers ----------------------------------------------------------------------------------


def test_slopes_of_a_ball_overhead():
    """Rays straight up meet it at 1 m; half of the light comes from there."""
    scene = Scene.of(
        primitive(sphere((0.0, 0.0, 1.5), 0.5)), primitive(plane((0, 0, 0), (0, 0, 1)))
    )
    along = jnp.array([[[0.0, 0.0, 1.0], [0.8, 0.0, 0.6]]])
    d = maps.blocker_distance(scene, jnp.zeros((1, 3)), along, jnp.array([1]))
    assert d.tolist() == [[1.0, np.inf]]
    assert maps.mean_inverse_distance(d).tolist() == [0.5]
    assert maps.mean_inverse_distance(d, jnp.array([[3.0, 1.0]])).tolist() == [0.75]
    assert maps.mean_inverse_distance(d, jnp.array([3.0, 1.0])).tolist() == [0.75]


def test_slopes_are_finite_with_gradients_where_nothing_is_met():
    def mean(d):
        return maps.mean_inverse_distance(d, jnp.array([0.0, 0.0]))

    d = jnp.array([jnp.inf, 2.0])
    assert mean(d).item() == 0.0
    assert np.all(np.isfinite(jax.grad(mean)(d)))
    assert np.all(np.isfinite(jax.grad(maps.mean_inverse_distance)(d)))


def test_changes_of_light_notice_an_arithmetic_mean(monkeypatch):
    assert derived.changes() < 0.02
    mean = lambda d, w: np.sum(w) / np.sum(w * d)  # noqa: E731
    monkeypatch.setattr(maps, "mean_inverse_distance", mean)
    assert derived.changes() > 0.2


# --- densities ---------------------------------------------------------------------------------


def test_densities_have_the_mean_1_and_follow_the_power():
    B = np.array([[0.01, 0.02], [0.04, 9.0]])
    found = maps.sampling_density(B, power=1.0, even=0.0)
    assert np.mean(found) == pytest.approx(1.0)
    np.testing.assert_allclose(found.ravel() / found[0, 0], [1.0, 2.0, 4.0, 50.0])
    np.testing.assert_allclose(maps.sampling_density(np.zeros(4)), 1.0)
    assert np.min(maps.sampling_density(B, even=0.3)) > 0.3


def test_the_best_split_notices_another_power(monkeypatch):
    assert derived.best_split() < 0.02
    own = maps.sampling_density
    monkeypatch.setattr(
        maps, "sampling_density", lambda B, power, even: own(B, power=2.0, even=even)
    )
    assert derived.best_split() > 0.1


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (
            lambda: maps.glossy_bandwidth_map(-1.0, pixel()),
            r"`cutoff` must lie in \[0, inf\], but is -1",
        ),
        (
            lambda: maps.glossy_bandwidth_map(1.0, pixel(), np.inf),
            "`slope` must be finite, but is inf",
        ),
        (
            lambda: maps.glossy_bandwidth_map(1.0, pixel(), 1.0, np.nan),
            "`light` must be finite, but is nan",
        ),
        (lambda: maps.glossy_bandwidth_map(1.0, pixel(d=-1.0)), "`distance` must not be negative"),
        (
            lambda: maps.mean_inverse_distance(jnp.array([1.0, 0.0])),
            r"`distance` must be positive, but is 0",
        ),
        (
            lambda: maps.mean_inverse_distance(jnp.array([1.0, np.nan])),
            "`distance` must be positive, but is n",
        ),
        (
            lambda: maps.sampling_density(np.array([1.0, np.nan])),
            r"`bandwidth` must lie in \[0, inf\], but",
        ),
        (
            lambda: maps.sampling_density(np.ones(2), power=np.inf),
            "`power` must be finite, but is inf",
        ),
        (lambda: maps.diffuse_bandwidth_map(1.0, pixel(), -1.0), "`slope` must not be negative"),
        (lambda: maps.sampling_density(np.ones(2), even=2.0), "`even` must lie in"),
        (lambda: maps.sampling_density(np.ones(2), limit=0.0), "`limit` must be positive"),
        (
            lambda: maps.sampling_density(-np.ones(2)),
            r"`bandwidth` must lie in \[0, inf\], but is -1",
        ),
    ],
)
def test_bad_input_gets_one_sentence(call, words):
    with pytest.raises(ValueError, match=words):
        call()


@pytest.mark.parametrize("own", [maps.glossy_bandwidth_map, maps.diffuse_bandwidth_map])
def test_traced_input_out_of_range_is_nan(own):
    good = dict(cutoff=1.0, d=1.5, S=-0.7, theta=0.6, slope=0.8, light=0.5)

    def made(cutoff, d, S, theta, slope, light):
        return own(cutoff, pixel(d, ((S, 0.2), (0.2, 0.4)), theta), slope, light)

    traced = jax.jit(made)
    assert traced(**good) == pytest.approx(made(**good).item(), rel=1e-12)
    bad = [*((name, -1.0) for name in ("cutoff", "d", "slope", "light")), ("theta", 2.0)]
    bad += [(name, np.nan) for name in good] + [("slope", np.inf), ("light", np.inf)]
    for name, number in bad:
        assert np.isnan(traced(**good | {name: number})), (name, number)


def test_traced_distances_out_of_range_have_no_mean():
    mean = jax.jit(maps.mean_inverse_distance)
    assert np.isnan(mean(jnp.array([0.0, 1.0])))
    assert np.isnan(mean(jnp.array([np.nan, 1.0])))
    assert np.isnan(mean(jnp.array([1.0, 2.0]), jnp.array([-1.0, 3.0])))
    assert np.isfinite(mean(jnp.array([np.inf, 1.0])))


def test_an_endless_spectrum_reaches_everywhere_but_where_nothing_turns():
    endless, flat = maps.rms_cutoff(0.5), pixel(S=((0.0, 0.0), (0.0, 0.0)))
    assert maps.glossy_bandwidth_map(endless, pixel(), 0.8, 0.5).item() == np.inf
    assert maps.diffuse_bandwidth_map(endless, flat).item() == 0.0
    np.testing.assert_allclose(
        maps.sampling_density(np.array([0.1, np.inf]), even=0.0), [1 / 13, 25 / 13]
    )


def test_differences_out_of_range_are_nan():
    turns = screen.PixelDifferences(*np.full((4, 1, 1, 3, 2), 0.1))
    lost = turns._replace(mirrored=np.nan * turns.mirrored, normal=np.nan * turns.normal)
    for own in (screen.screen_glossy_bandwidth, screen.screen_diffuse_bandwidth):
        assert np.isfinite(own(1.0, turns, 0.5, 0.5)).all()
        assert np.isnan(own(1.0, lost, 0.5, 0.5)).all()
        assert np.isnan(jax.jit(lambda s, own=own: own(1.0, turns, s))(-1.0)).all()


def test_a_bandwidth_has_its_slope_where_blockers_begin():
    """The guard for endless spectra must not flatten finite ones."""
    at, step = pixel(), 1e-3
    rate = jax.grad(lambda s: maps.diffuse_bandwidth_map(1.3, at, s, 0.5))(0.0)
    near = [maps.diffuse_bandwidth_map(1.3, at, s, 0.5).item() for s in (0.0, step)]
    assert rate.item() == pytest.approx((near[1] - near[0]) / step, rel=1e-9)


@pytest.mark.parametrize("size", [1e-11, 1.0, 1e11])
def test_a_small_or_large_turn_has_its_length_in_single_precision(size):
    none = np.zeros((1, 1, 3, 2))
    moved = none.copy()
    moved[0, 0, 0, 0] = size
    with jax.enable_x64(False):
        turns = screen.PixelDifferences(none, none, none, moved)
        found = screen.screen_diffuse_bandwidth(1.0, turns, slope=1.0)
    assert found.item() == pytest.approx(size, rel=1e-5)


@pytest.mark.parametrize("exponent", [np.nan, np.inf, -1.0])
def test_what_is_no_exponent_has_no_cutoff(exponent):
    with pytest.raises(ValueError, match="`exponent` must"):
        maps.rms_cutoff(exponent)
    assert np.isnan(jax.jit(maps.rms_cutoff)(-1.0))


def test_distances_and_weights_of_rays_pair():
    with pytest.raises(ValueError, match="`distance` must have an axis of rays"):
        maps.mean_inverse_distance(2.0)
    with pytest.raises(ValueError, match=r"`weight` must broadcast to shape \(3,\)"):
        maps.mean_inverse_distance(np.ones(3), np.ones(2))


def test_differences_are_those_of_images_of_one_size():
    one, eye, label = np.ones((4, 5, 3)), np.array([0.0, 0.0, 9.0]), np.zeros((4, 5), int)
    either = (ValueError, TypeError)
    with pytest.raises(either, match=r"`position` must have shape \(w, h, 3\)|type hint"):
        screen.pixel_differences(one[0], one[0], eye, label)
    with pytest.raises(either, match=r"`normal` must have shape|type hint"):
        screen.pixel_differences(one, one[:3], eye, label)
    with pytest.raises(either, match=r"`label` must have shape|type hint"):
        screen.pixel_differences(one, one, eye, label[0])
    with pytest.raises(either, match=r"`eye` must have shape|type hint"):
        screen.pixel_differences(one, one, eye[:2], label)
