import numpy as np
import pytest

from firstorder.caching import (
    harmonic_mean_distance,
    neighbour_clamping,
    split_sphere,
    split_sphere_change,
    split_sphere_error,
    weighted_harmonic_length,
)


def half_bright(step, turn, n=500):
    """Irradiance at a step from the centre of a unit sphere, its half x > 0 bright, by rays."""
    t = (np.arange(n) + 0.5) / n
    sine, phi = np.sqrt(t)[:, None], 2.0 * np.pi * t[None, :]
    w = np.stack([sine * np.cos(phi), sine * np.sin(phi), np.sqrt(1.0 - sine**2) + 0.0 * phi])
    c, s = np.cos(turn), np.sin(turn)
    w = np.stack([c * w[0] + s * w[2], w[1], c * w[2] - s * w[0]])  # the normal tips towards +x
    # Where the ray leaves the unit sphere, from (-step, 0, 0).
    along = step * w[0]
    x = -step + w[0] * (along + np.sqrt(along**2 - step**2 + 1.0))
    return np.pi * np.mean(x > 0.0)


@pytest.mark.parametrize("step", [0.05, 0.3, 0.9])
def test_the_change_is_what_rays_find_and_the_error_bounds_it(step):
    lost = 1.0 - half_bright(step, 0.0) / (0.5 * np.pi)
    change = float(split_sphere_change(2.0 * step, 2.0))
    assert change == pytest.approx(lost, abs=4e-3)
    assert change <= float(split_sphere_error(2.0 * step, 2.0))


def test_a_turn_changes_by_its_sine_and_the_error_bounds_it():
    for turn in (0.1, 0.6, 1.2):
        gained = half_bright(0.0, turn) / (0.5 * np.pi) - 1.0
        assert gained == pytest.approx(np.sin(turn), abs=4e-3)
        assert gained <= float(split_sphere_error(0.0, 1.0, turn))


@pytest.mark.parametrize("fault", ["flatland's factor", "no root"])
def test_a_fault_is_noticed(fault):
    """Their errors at small steps no longer touch the true change."""
    wrong = {
        "flatland's factor": lambda d: d,
        "no root": lambda d: 4.0 / np.pi * d * d,
    }[fault]
    lost = 1.0 - half_bright(0.05, 0.0) / (0.5 * np.pi)
    assert float(split_sphere_error(0.05, 1.0)) / lost == pytest.approx(1.0, abs=0.05)
    assert abs(wrong(0.05) / lost - 1.0) > 0.15


@pytest.mark.smoke
def test_clamped_lengths_obey_the_triangle_inequality_and_are_the_largest_that_do(monkeypatch):
    monkeypatch.setattr(split_sphere, "BLOCK", 17)
    rng = np.random.default_rng(0)
    x, R = rng.uniform(size=(60, 2)), rng.exponential(0.5, 60)
    R[7] = np.inf
    held = neighbour_clamping(x, R)
    distance = np.linalg.norm(x[:, None] - x[None], axis=-1)
    assert np.all(held[:, None] - held[None] <= distance + 1e-12)
    assert np.all(held <= R)
    np.testing.assert_allclose(neighbour_clamping(x, held), held)
    # One by one no length can be raised: it is its own or some neighbour's plus the way.
    np.testing.assert_allclose(held, (R[None] + distance).min(axis=1))
    assert np.sum(held < R) > 10


def test_distances_to_things_need_no_clamp():
    rng = np.random.default_rng(1)
    x, things = rng.uniform(size=(50, 3)), rng.uniform(size=(9, 3))
    R = np.linalg.norm(x[:, None] - things[None], axis=-1).min(axis=1)
    np.testing.assert_allclose(neighbour_clamping(x, R), R)


def test_equal_weights_give_the_plain_mean_and_weights_count_as_rays():
    lengths = np.array([1.0, 2.0, np.inf, 4.0])
    even = weighted_harmonic_length(lengths, np.full(4, 0.3))
    np.testing.assert_allclose(even, harmonic_mean_distance(np.asarray(lengths) + 0.0 * even))
    twice = weighted_harmonic_length(np.array([1.0, 3.0]), np.array([2.0, 1.0]))
    assert float(twice) == pytest.approx(3.0 / (2.0 + 1.0 / 3.0))


@pytest.mark.smoke
def test_bad_input_is_one_sentence():
    with pytest.raises(ValueError, match=r"^Argument `radius` must be positive, but is 0.0.$"):
        split_sphere_error(0.1, 0.0)
    with pytest.raises(ValueError, match=r"^Argument `length` must not be negative, but is -1.0.$"):
        neighbour_clamping(np.zeros((1, 2)), np.array([-1.0]))
