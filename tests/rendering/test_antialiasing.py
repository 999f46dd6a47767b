"""Antialiasing: where places stand in a pixel, what an edge errs, and what is said of the error."""

import itertools

import numpy as np
import pytest

from firstorder.imaging import Lamp, pinhole
from firstorder.rendering import Renderer, World, antialiased, antialiasing, subpixels
from firstorder.space import Scene, plane, primitive, sphere
from firstorder.space.skies import ConstantSky


def check_one_place_a_cell_column_and_row():
    for k in (1, 2, 3, 5):
        p = subpixels(k)
        for cells in (k, 1):
            inside = np.floor(p * (k, k * cells)).astype(int)
            assert len({tuple(a) for a in inside.tolist()}) == k * k
        for axis in (0, 1):
            np.testing.assert_allclose(np.sort(p[:, axis]), (np.arange(k * k) + 0.5) / k**2)


def check_a_ramp_is_exact():
    np.testing.assert_allclose(subpixels(3).mean(0), 0.5, rtol=1e-14)


def _edge_error(p, angle: float) -> float:
    """Root mean square error of the covered share, over all edges of an angle that may cut."""
    m = np.array([np.cos(angle), np.sin(angle)])
    fine = (np.stack(np.meshgrid(*2 * [np.arange(64) + 0.5]), -1).reshape(-1, 2)) / 64
    offsets = np.linspace(fine.dot(m).min(), fine.dot(m).max(), 401)
    share = [np.mean(q.dot(m)[:, None] < offsets, 0) for q in (p, fine)]
    return float(np.sqrt(np.mean((share[0] - share[1]) ** 2)))


def check_an_edge_along_an_axis_errs_half_as_much_as_on_an_even_grid():
    """Steps of 1/4 against 1/2, and a step of w errs w / sqrt(12)."""
    for angle in (0.0, 0.5 * np.pi):
        assert _edge_error(subpixels(2), angle) == pytest.approx(0.25 / np.sqrt(12.0), rel=0.05)


CHECKS = (
    check_one_place_a_cell_column_and_row,
    check_a_ramp_is_exact,
    check_an_edge_along_an_axis_errs_half_as_much_as_on_an_even_grid,
)


@pytest.mark.parametrize("check", CHECKS)
def test_places(check):
    check()


def _even(rows):
    x = (np.arange(rows) + 0.5) / rows
    return np.array(list(itertools.product(x, x)))


FAULTS = {
    "an even grid": _even,
    "in corners": lambda k: subpixels(k) - 0.5 / k**2,
    "in the middle": lambda k: np.full((k * k, 2), 0.5),
}


@pytest.mark.parametrize(
    ("name", "check"),
    [("an even grid", CHECKS[2]), ("in corners", CHECKS[1]), ("in the middle", CHECKS[0])],
)
def test_a_fault_of_places_is_seen(name, check, monkeypatch):
    wrong, right = FAULTS[name], subpixels
    monkeypatch.setitem(globals(), "subpixels", lambda k: right(k))
    made = {k: wrong(k) for k in (1, 2, 3, 5)}
    monkeypatch.setitem(globals(), "subpixels", made.get)
    with pytest.raises(AssertionError):
        check()


@pytest.fixture(scope="module")
def renderer():
    """A ball on a floor under a lamp, with a sky."""
    lamp = Lamp((0.5, -1.0, 3.0), (0.0, 0.4, 0.0), (0.4, 0.0, 0.0), count=3, even=True)
    floor = primitive(plane((0.0, 0.0, 0.0), (0.0, 0.0, 1.0)), albedo=0.5)
    ball = primitive(sphere((0.0, 0.0, 0.5), 0.5), albedo=(0.9, 0.4, 0.2))
    camera = pinhole((0.0, -4.0, 2.0), (0.0, 0.0, 0.3), gamma=2.4)
    return Renderer(World(camera, Scene.of(floor, ball), (), (lamp,)))


def test_the_error_that_is_said_bounds_the_true_one(renderer, tmp_path):
    """Against 64 places a pixel, whose own error is below a fifth of that of 4."""
    fine = antialiased(renderer, 40, 30, tmp_path / "8", rows=8, quiet=True)
    found = antialiased(renderer, 40, 30, tmp_path / "2", quiet=True)
    said, true = (np.sqrt(np.mean(a**2)) for a in (found.error, found.value - fine.value))
    assert found.value.shape == (40, 30, 3)
    assert np.sqrt(np.mean(fine.error**2)) < 0.5 * said
    assert 1.0 < said / true < 4.0


def test_a_fault_of_the_image_is_seen(renderer, tmp_path, monkeypatch):
    """Places all in one corner: the image moves, and the error is said to be nothing."""
    fine = antialiased(renderer, 40, 30, tmp_path / "8", rows=8, quiet=True)
    monkeypatch.setattr(antialiasing, "subpixels", lambda rows: np.zeros((rows**2, 2)))
    found = antialiased(renderer, 40, 30, tmp_path / "bad", quiet=True)
    said, true = (np.sqrt(np.mean(a**2)) for a in (found.error, found.value - fine.value))
    assert not said / true > 1.0


def test_lamps_and_the_sky_are_in_the_image(renderer, tmp_path):
    """A lamp fills the middle one of five pixels, and the sky the outer ones."""
    up = pinhole((0.5, -1.5, 1.0), (0.5, -1.0, 3.0), gamma=1.0)
    made = Renderer(renderer.world._replace(camera=up, sky=ConstantSky((2.0, 3.0, 4.0))))
    found = antialiased(made, 5, 1, tmp_path, quiet=True)
    lamp, sky = [1.0, 1.0, 1.0], [2.0, 3.0, 4.0]
    np.testing.assert_array_equal(found.value[[0, 2, 4], 0], [sky, lamp, sky])
    assert np.all(found.error[[0, 2, 4]] == 0.0)


def test_it_goes_on_where_it_was_ended(renderer, tmp_path):
    whole = antialiased(renderer, 20, 15, tmp_path / "a", side=8, quiet=True)
    antialiased(renderer, 20, 15, tmp_path / "b", side=8, quiet=True)
    for file in sorted((tmp_path / "b").glob("*.npz"))[::2]:
        file.unlink()
    again = antialiased(renderer, 20, 15, tmp_path / "b", side=8, quiet=True)
    np.testing.assert_array_equal(whole.value, again.value)
    with pytest.raises(ValueError, match="at least 2"):
        antialiased(renderer, 4, 4, tmp_path / "c", rows=1)


@pytest.mark.parametrize("rows", [2, 3])
def test_where_all_places_send_the_same_there_is_no_error(rows, renderer, tmp_path, monkeypatch):
    """The difference of two means of squares keeps their rounding."""
    of_pixel = np.random.default_rng(0).uniform(0.0, 10.0, 48)
    monkeypatch.setattr(antialiasing, "_seen_radiance", lambda made, p, number: of_pixel)
    found = antialiased(renderer, 8, 6, tmp_path, rows=rows, quiet=True)
    np.testing.assert_array_equal(found.error, 0.0)
