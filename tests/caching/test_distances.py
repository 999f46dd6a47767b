"""The split circle and the split sphere, and lengths of rays."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from derivations.caching.distances import painted_irradiance
from firstorder import caching
from firstorder.caching import (
    distances,
    harmonic_mean_distance,
    minimum_distance,
    neighbour_clamping,
    split_change,
    split_error,
    split_radius,
)
from firstorder.flatland import Receiver, Scene, Segments, irradiance, primitive


def half(angle):
    return angle > 0.0


@pytest.mark.smoke
@given(st.floats(-0.99, 0.99), st.floats(-3.1, 3.1))
def test_the_error_bounds_the_change_in_the_split_circle(step, turn):
    assert split_change(step, 1.0, turn) <= split_error(step, 1.0, turn) + 1e-15


@pytest.mark.parametrize(("step", "turn"), [(0.3, 0.0), (0.0, 0.7), (0.4, 0.5)])
def test_the_change_is_that_of_light_on_a_circle(step, turn):
    true = painted_irradiance(step, turn, 1.0, half) - 1.0
    assert split_change(step, 1.0, turn).item() == pytest.approx(true, abs=1e-6)


@pytest.mark.parametrize(
    "fault",
    [
        lambda dx, R, turn: jnp.sin(dx / R + turn),
        lambda dx, R, turn: jnp.sin(jnp.arctan(dx / R) - turn),
        lambda dx, R, turn: jnp.sin(jnp.arctan(R / dx) + turn),
    ],
)
def test_a_fault_in_the_change_is_noticed(fault):
    true = painted_irradiance(0.4, 0.5, 1.0, half) - 1.0
    assert abs(float(fault(0.4, 1.0, 0.5)) - true) > 1e-3


@pytest.mark.smoke
def test_beyond_a_right_angle_the_error_does_not_fall_again():
    """Printed, the other side of a sheet (half a turn) would cost nothing."""
    assert split_error(0.0, 1.0, np.pi).item() == 1.0
    assert split_error(0.0, 1.0, -0.5).item() == pytest.approx(np.sin(0.5))


# --- where it is no bound ------------------------------------------------------------------------


def test_light_on_the_circle_may_change_by_more_after_a_finite_step():
    """By delta^3 / 16: the worst split is not the one above the record."""
    delta = 0.6
    at = np.arcsin(0.75 * delta)
    before, after = (
        painted_irradiance(x, 0.0, 1.0, lambda a: a > at, pieces=400000) for x in (0.0, delta)
    )
    assert after - before > delta + 0.5 * delta**3 / 16


def test_a_small_light_near_the_horizon_changes_its_share_twice_as_fast():
    def patch(angle):
        return np.abs(angle - 1.45) < 0.02

    before, after = (painted_irradiance(x, 0.0, 1.0, patch) for x in (0.0, 0.01))
    ratio = (after / before - 1.0) / split_error(0.01, 1.0).item()
    assert 1.9 < ratio < 2.1


def test_a_small_light_near_the_horizon_may_change_by_any_share_in_a_turn():
    def share(angle):
        before, after = (
            painted_irradiance(0.0, turn, 1.0, lambda a: np.abs(a - angle) < 0.002)
            for turn in (0.0, 0.01)
        )
        return (after / before - 1.0) / split_error(0.0, 1.0, 0.01).item()

    np.testing.assert_allclose(
        [share(a) for a in (0.5, 1.2, 1.5)], np.tan([0.5, 1.2, 1.5]), rtol=0.05
    )


def slats(count):
    """Bright slats between black gaps: each reaches from the distance 1 to the distance 2."""
    edges = np.linspace(-0.5, 0.5, 2 * count + 1)
    left, right = edges[:-1:2], edges[1::2]

    def point(r, a):
        return np.stack([-r * np.sin(a), r * np.cos(a)], -1)

    shape = Segments(jnp.asarray(point(2.0, right)), jnp.asarray(point(1.0, left)))
    return Scene.of(primitive(shape, emission=1.0, two_sided=True))


def test_no_bound_exists_when_distances_differ():
    """Nothing nearer than 1, nothing brighter than 1, and E' grows with the number of slats."""
    slopes = []
    for count in (4, 16):
        scene = slats(count)
        E = jax.jit(jax.value_and_grad(lambda x, s=scene: irradiance(s, Receiver((x, 0.0), 0.0))))
        value, slope = E(0.0)
        assert value < 1.0
        slopes.append(abs(float(slope)))
    assert slopes[0] > split_error(1.0, 1.0).item()
    assert slopes[1] > 3.0 * slopes[0]


# --- the split sphere ----------------------------------------------------------------------------


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
    change = float(split_change(2.0 * step, 2.0, dims=2))
    assert change == pytest.approx(lost, abs=4e-3)
    assert change <= float(split_error(2.0 * step, 2.0, dims=2))


def test_a_turn_changes_by_its_sine_and_the_error_bounds_it():
    for turn in (0.1, 0.6, 1.2):
        gained = half_bright(0.0, turn) / (0.5 * np.pi) - 1.0
        assert gained == pytest.approx(np.sin(turn), abs=4e-3)
        assert gained <= float(split_error(0.0, 1.0, turn, dims=2))


@pytest.mark.parametrize("fault", ["flatland's factor", "no root"])
def test_a_fault_in_the_sphere_is_noticed(fault):
    """Their errors at small steps no longer touch the true change."""
    wrong = {
        "flatland's factor": lambda d: d,
        "no root": lambda d: 4.0 / np.pi * d * d,
    }[fault]
    lost = 1.0 - half_bright(0.05, 0.0) / (0.5 * np.pi)
    assert float(split_error(0.05, 1.0, dims=2)) / lost == pytest.approx(1.0, abs=0.05)
    assert abs(wrong(0.05) / lost - 1.0) > 0.15


# --- lengths -------------------------------------------------------------------------------------


@pytest.mark.smoke
def test_lengths_of_rays():
    t = jnp.array([[1.0, 2.0, jnp.inf], [jnp.inf, jnp.inf, jnp.inf], [0.0, 1.0, 4.0]])
    assert minimum_distance(t).tolist() == [1.0, np.inf, 0.0]
    assert harmonic_mean_distance(t).tolist() == [2.0, np.inf, 0.0]
    assert harmonic_mean_distance(t, jnp.zeros((3, 3))).tolist() == [np.inf] * 3


def test_lengths_have_no_nan_in_their_gradients():
    t = jnp.array([1.0, 2.0, jnp.inf])
    np.testing.assert_allclose(jax.grad(harmonic_mean_distance)(t), [4 / 3, 1 / 3, 0.0], rtol=1e-12)
    assert np.all(np.isfinite(jax.grad(harmonic_mean_distance)(jnp.array([0.0, 1.0]))))
    assert np.all(jax.grad(harmonic_mean_distance)(t, jnp.zeros(3)) == 0.0)
    assert np.all(np.isfinite(jax.grad(split_error, (0, 1, 2))(0.0, 1.0, 0.0)))


@pytest.mark.smoke
def test_clamped_lengths_obey_the_triangle_inequality_and_are_the_largest_that_do(monkeypatch):
    monkeypatch.setattr(distances, "BLOCK", 17)
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


@pytest.mark.smoke
@pytest.mark.parametrize("dims", [1, 2])
@pytest.mark.parametrize("length", [0.3, 7.0])
def test_the_split_error_is_the_accuracy_at_the_radius(length, dims):
    """A bisection of the error, which grows with the step."""
    low, high = 0.0, 10.0 * length
    for _ in range(60):
        middle = 0.5 * (low + high)
        low, high = (
            (low, middle) if split_error(middle, length, dims=dims) > 0.2 else (middle, high)
        )
    assert split_radius(length, 0.2, dims).item() == pytest.approx(low, rel=1e-12)


def test_within_the_split_radius_light_changes_by_no_more_than_the_accuracy():
    step = split_radius(0.7, 0.2).item()
    assert abs(painted_irradiance(step / 0.7, 0.0, 1.0, half) - 1.0) <= 0.2


def test_a_record_that_sees_nothing_reaches_everywhere_and_one_in_a_corner_nowhere():
    assert split_radius(np.array([np.inf, 0.0]), 0.1).tolist() == [np.inf, 0.0]


def test_equal_weights_give_the_plain_mean_and_weights_count_as_rays():
    lengths = np.array([1.0, 2.0, np.inf, 4.0])
    even = harmonic_mean_distance(lengths, np.full(4, 0.3))
    np.testing.assert_allclose(even, harmonic_mean_distance(np.asarray(lengths) + 0.0 * even))
    twice = harmonic_mean_distance(np.array([1.0, 3.0]), np.array([2.0, 1.0]))
    assert float(twice) == pytest.approx(3.0 / (2.0 + 1.0 / 3.0))


@pytest.mark.smoke
def test_bad_input_is_one_sentence():
    with pytest.raises(ValueError, match=r"^Argument `radius` must be positive, but is 0.0.$"):
        split_error(0.1, 0.0)
    with pytest.raises(
        ValueError, match=r"^Argument `lengths` must not be negative, but is -1.0.$"
    ):
        harmonic_mean_distance(jnp.array([-1.0, 1.0]))
    for shortest in (minimum_distance, harmonic_mean_distance):
        with pytest.raises(ValueError, match=r"^Argument `lengths` must hold at least one ray"):
            shortest(jnp.zeros((3, 0)))
    with pytest.raises(ValueError, match=r"^Argument `length` must not be negative, but is -1.0.$"):
        split_radius(-1.0, 0.1)
    with pytest.raises(ValueError, match=r"^Argument `accuracy` must be positive, but is 0.0.$"):
        split_radius(1.0, 0.0)
    assert np.isnan(jax.jit(split_radius)(-1.0, 0.1))
    assert np.isnan(jax.jit(split_radius)(1.0, -0.1))
    assert np.isnan(jax.jit(split_error)(0.1, -1.0))
    assert np.isnan(jax.jit(split_change)(0.1, -1.0))
    with pytest.raises(ValueError, match=r"^Argument `radius` must be positive, but is 0.0.$"):
        split_error(0.1, 0.0, dims=2)
    with pytest.raises(ValueError, match=r"^Argument `length` must not be negative, but is -1.0.$"):
        neighbour_clamping(np.zeros((1, 2)), np.array([-1.0]))
    with pytest.raises(
        ValueError, match=r"^Argument `turn` must be left out in the split sphere.$"
    ):
        split_change(0.1, 1.0, 0.2, dims=2)
    assert split_change(0.1, 1.0, 0, dims=2) == split_change(0.1, 1.0, dims=2)
    with pytest.raises(ValueError, match=r"^Argument `dims` must be 1 or 2, but is 3.$"):
        split_error(0.1, 1.0, dims=3)


@pytest.mark.parametrize(
    ("position", "length", "words"),
    [
        (np.zeros(3), np.ones(3), r"`position` must have shape \(m, d\)"),
        (np.zeros((3, 2)), np.ones(1), "`length` must have shape"),
        (np.zeros((3, 2)), 1.0, "`length` must have shape"),
    ],
)
def test_there_is_a_length_for_each_place(position, length, words):
    with pytest.raises(ValueError, match=words):
        neighbour_clamping(position, length)


@pytest.mark.parametrize("wrong", [-1.0, np.nan, -np.inf])
def test_a_traced_length_that_is_none_is_no_ray_that_misses(wrong):
    mean = jax.jit(caching.harmonic_mean_distance)
    assert jnp.isnan(mean(jnp.array([1.0, wrong])))
    assert jnp.isnan(mean(jnp.array([0.0, wrong])))
    assert jnp.isnan(mean(jnp.array([1.0, 2.0]), jnp.array([1.0, min(wrong, -1.0)])))


@pytest.mark.parametrize("function", [caching.minimum_distance, caching.harmonic_mean_distance])
def test_one_number_is_no_row_of_rays(function):
    with pytest.raises(
        ValueError, match=r"must hold at least one ray in a row, but has shape \(\)\."
    ):
        function(2.0)


def test_a_place_that_is_none_does_not_clamp_all_others():
    with pytest.raises(ValueError, match="Argument `position` must be finite, but is nan"):
        caching.neighbour_clamping(np.array([[0.0], [np.nan]]), np.ones(2))
