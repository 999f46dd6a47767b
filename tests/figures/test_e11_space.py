"""E11's scenes: references outlive a kill, own rays are unbiased, and shared ones agree."""

import types

import jax
import numpy as np
import pytest

from figures.e11.shared import bounds, compared, limits, space
from firstorder.shadowfield.rendering.ray_table import trace_shadow_rays


@pytest.fixture(scope="module")
def scene():
    return space.grids(40)


def test_a_reference_that_was_cut_short_is_finished_to_the_same_bits(tmp_path, monkeypatch, scene):
    monkeypatch.setattr(space, "OUT", tmp_path / "whole")
    whole = space.reference(scene, 16, quiet=True)
    monkeypatch.setattr(space, "OUT", tmp_path / "cut")
    real, made = space.own_rays, []

    def dies(*args):
        if len(made) == 2:
            raise KeyboardInterrupt
        made.append(1)
        return real(*args)

    with monkeypatch.context() as patch:
        patch.setattr(space, "own_rays", dies)
        with pytest.raises(KeyboardInterrupt):
            space.reference(scene, 16, quiet=True)
    kept = [f.stat().st_mtime_ns for f in sorted(tmp_path.glob("cut/*/*.npz"))]
    again = space.reference(scene, 16, quiet=True)
    assert len(kept) == 2  # of four
    assert [f.stat().st_mtime_ns for f in sorted(tmp_path.glob("cut/*/*.npz"))][:2] == kept
    assert again.tobytes() == whole.tobytes()
    assert np.all(np.isfinite(again))


@pytest.mark.parametrize("what", ["faces", "falloff", "version", "nothing"])
def test_a_reference_of_something_else_is_another_one(tmp_path, monkeypatch, scene, what):
    monkeypatch.setattr(space, "OUT", tmp_path)
    monkeypatch.setattr(space, "own_rays", lambda scene, where, *about: np.zeros(len(where)))
    space.reference(scene, 4, quiet=True)
    if what == "faces":
        mesh = types.SimpleNamespace(
            vertices=scene.tracer.mesh.vertices, faces=scene.tracer.mesh.faces[::-1]
        )
        scene = scene._replace(tracer=types.SimpleNamespace(mesh=mesh))
    if what == "falloff":
        monkeypatch.setattr(space, "falloff", lambda place: np.ones(place.shape[:-1]))
    if what == "version":
        monkeypatch.setattr(space, "_VERSION", space._VERSION + 1)
    space.reference(scene, 4, quiet=True)
    assert len(list(tmp_path.iterdir())) == (1 if what == "nothing" else 2)


def test_smoothed_bounds_leave_alone_what_is_no_ground(scene):
    where = np.flatnonzero(scene.floor)
    rng = np.random.default_rng(0)
    near = rng.uniform(1.0, 2.0, len(where))
    low, high = space.smoothed_bounds(scene, where, (near, near + 0.5), 2)
    assert np.all(low <= near)
    assert np.all(high >= near + 0.5)
    assert np.std(low) < 0.5 * np.std(near)


def test_a_scene_has_the_same_bits_in_either_precision(scene):
    with jax.enable_x64(False):
        other = space.grids(40)
    assert other.receivers.tobytes() == scene.receivers.tobytes()
    a, b = (np.asarray(s.tracer.mesh.vertices) for s in (scene, other))
    assert a.tobytes() == b.tobytes()


def test_own_rays_have_the_mean_of_the_falloff(scene):
    """Against rays even over the lamp, weighed by a falloff that is written here."""
    pixels = np.flatnonzero(scene.floor)[::37]
    found = space.own_rays(scene, pixels, 1024)
    for k, one in zip(pixels, found, strict=True):
        table, _ = trace_shadow_rays(scene.lamp, scene.receivers[[k]], 4000, scene.blockers)
        light = np.exp(-0.5 * np.sum((table.y / (0.5 * scene.lamp.half)) ** 2, 1))
        expected = np.sum(light * table.free) / np.sum(light)
        assert abs(one - expected) <= 0.03  # strata of 1/32; 4000 even places
    assert np.ptp(found) > 0.5


def test_quick_visibility_and_depths_of_blockers_agree(scene):
    a = scene.receivers[scene.floor]
    b = np.broadcast_to(scene.lamp.center, a.shape)
    free = np.isinf(scene.blockers(a, b)[0])
    np.testing.assert_array_equal(scene.visible(a, b), free)
    np.testing.assert_array_equal(np.isinf(scene.hides(a, b)[0]), free)


def test_shared_rays_come_near_own_ones_and_nearer_with_more_of_them(scene):
    true = scene.picture(space.own_rays(scene, scene.floor, 256), scene.floor)
    rms = []
    for rays in (1, 16):
        found = compared.shared(scene, rays, 2.0, own=(64, 0), radius=1)
        rms.append(np.sqrt(np.nanmean((found.visible - true) ** 2)))
        assert np.all(np.isfinite(found.visible[compared.ground_of(scene)]))
        assert found.floor_rays >= rays
    assert rms[1] < 0.5 * rms[0]
    assert rms[1] < 0.05


def test_a_window_is_a_part_of_the_image(scene):
    part = space.grids(40, window=(10, 20, 12))
    whole = scene.receivers.reshape(40, 40, 3)[10:22, 20:32]
    np.testing.assert_allclose(part.receivers.reshape(12, 12, 3), whole, rtol=0.0, atol=1e-12)
    np.testing.assert_array_equal(part.part, scene.part.reshape(40, 40)[10:22, 20:32].ravel())
    assert part.pixel == scene.pixel


def test_every_nth_pixel_off_the_edges(scene):
    some = scene.every(3, 4).reshape(40, 40)
    assert np.flatnonzero(some.any(0)).tolist() == list(range(4, 36, 3))
    assert some.sum() == 11**2


def test_pixels_that_are_judged_alone_see_what_they_see_among_all(scene):
    some = scene.floor & scene.every(3)
    whole = compared.shared(scene, 2, 2.0, own=(4, 0), seed=5)
    alone = compared.shared(scene, 2, 2.0, own=(4, 0), seed=5, judged=some)
    filtered = some & (whole.own.ravel() == 0.0)
    assert filtered.sum() > 50
    np.testing.assert_allclose(
        alone.visible.ravel()[filtered], whole.visible.ravel()[filtered], rtol=0.0, atol=1e-5
    )
    assert np.all(np.isnan(alone.visible.ravel()[~some]))


def test_blended_bounds_are_means_of_neighbours_that_have_some(scene):
    where = np.arange(40 * 40)
    near = np.full((40, 40), np.inf)
    near[:20], near[30:] = 1.0, 3.0
    near[25] = 2.0  # alone, ten pixels from others
    found, far = space.blended_bounds(scene, where, (near.ravel(), -near.ravel()), 1.0)
    found = found.reshape(40, 40)
    np.testing.assert_array_equal(np.isinf(found), np.isinf(near))
    np.testing.assert_allclose(found[[0, 19, 25, 39], 7], [1.0, 1.0, 2.0, 3.0])
    np.testing.assert_allclose(far, -found.ravel())
    near[:] = np.where(np.arange(40)[:, None] < 20, 1.0, 3.0)
    found = space.blended_bounds(scene, where, (near.ravel(), near.ravel()), 1.0)[0]
    assert 1.5 < found.reshape(40, 40)[19, 7] < 2.0 < found.reshape(40, 40)[20, 7] < 2.5


def test_the_reference_of_penumbrae_is_that_of_the_whole_image(tmp_path, monkeypatch, scene):
    monkeypatch.setattr(space, "OUT", tmp_path)
    found = space.penumbra_reference(scene, 256)
    true = scene.picture(space.own_rays(scene, scene.floor, 256, 9), scene.floor)
    assert np.all(np.isfinite(found) == np.isfinite(true))
    assert np.sqrt(np.nanmean((found - true) ** 2)) < 0.02


def test_a_jump_is_seen_from_both_sides():
    width = np.zeros((6, 5))
    width[3:] = np.log(3.0)
    assert np.flatnonzero(bounds._jumps(width).any(1)).tolist() == [2, 3]
    assert np.flatnonzero(bounds._jumps(width.T).any(0)).tolist() == [2, 3]
    width[3:] = np.log(1.5)
    assert not bounds._jumps(width).any()


def test_all_ways_to_find_bounds_are_compared_on_the_same_pixels():
    ground = limits.ground(space.array(40, 60), quick=True)
    window = limits.window(ground.picture(ground.true), 24)
    found = bounds.compared(ground, window, 4.0, 2.0, seeds=3)
    assert set(found.rms) == set(bounds.WAYS)
    assert np.all(found.rms[bounds.PLAIN][bounds.ALL] < 0.3)
    assert np.all((found.share[bounds.MISSED] > 0.0) & (found.share[bounds.MISSED] < 1.0))
    assert found.ratio(bounds.PLAIN, bounds.PLAIN, bounds.ALL) == (1.0, 0.0)
