import itertools

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import quad

from firstorder import caching
from firstorder.caching import (
    discontinuities,
    expected_error_with_events,
    radius_for,
    radius_with_events,
)


def kinked(x, h, d, J, S=0.0):
    """A parabola with a kink and a step at d, and a record at 0."""
    beyond = np.where(np.sign(d) * (x - d) > 0, np.abs(x - d), 0.0)
    return 0.5 * h * x**2 + J * beyond + S * (beyond > 0)


def by_quadrature(R, *world):
    points = sorted({-R, R, 0.0, float(np.clip(world[1], -R, R))})
    return sum(quad(lambda t: abs(kinked(t, *world)), *p)[0] for p in itertools.pairwise(points))


WORLDS = [
    (1.3, 0.4, 2.0),
    (1.3, -0.4, 2.0),
    (0.0, 0.7, -1.5),
    (2.0, 3.0, 5.0),
    (1.0, 0.3, 0.5, 0.2),
]


def worst_error():
    worst = 0.0
    for world in WORLDS:
        h, d, J, S = (*world, 0.0)[:4]
        given = ([h], np.array([d]), np.array([J]), np.array([S]))
        for R in (0.2, 1.1):
            true = by_quadrature(R, *world)
            worst = max(worst, abs(expected_error_with_events(R, *given).item() - true))
    return worst


def test_one_kink_behind_a_parabola_is_exact():
    assert worst_error() < 1e-12


FAULTS = {
    "the kink is forgotten": lambda d, J, S: (d, 0.0 * J, S),
    "only kinks to the right": lambda d, J, S: (jnp.where(d > 0, d, jnp.inf), J, S),
    "the step is forgotten": lambda d, J, S: (d, J, 0.0 * S),
    "the kink is at the record": lambda d, J, S: (0.0 * d, J, S),
}


@pytest.mark.parametrize("fault", FAULTS)
def test_a_fault_is_noticed(fault, monkeypatch):
    def wrong(distances, kinks, steps):
        d, J, S = FAULTS[fault](*(jnp.asarray(a) for a in (distances, kinks, steps)))
        return jnp.abs(d), jnp.abs(J), jnp.abs(S)

    monkeypatch.setattr(discontinuities, "_events", wrong)
    assert 1e-3 < worst_error() < np.inf


@pytest.mark.smoke
def test_without_events_and_with_one_derivative_the_pointwise_radius_comes_out():
    for order in (0, 1, 2):
        for definition in ("total", "average", "relative", "largest"):
            options = {"order": order, "definition": definition, "value": 0.8}
            ours = radius_with_events([-2.3], 0.1, 1e-3, 50.0, **options).item()
            assert ours == pytest.approx(radius_for(-2.3, 0.1, **options).item(), rel=1e-12)


@given(st.floats(-3.0, 3.0), st.floats(-3.0, 3.0), st.floats(-1.5, 1.5), st.floats(-3, 3))
def test_several_terms_are_an_upper_bound(h, third, d, J):
    """Their signs are dropped."""

    def miss(t):
        return abs(kinked(t, h, d, J) + third * t**3 / 6)

    R = 1.2
    points = sorted({-R, R, 0.0, float(np.clip(d, -R, R))})
    t = np.concatenate([np.linspace(a, b, 2001) for a, b in itertools.pairwise(points)])
    true = np.trapezoid([miss(u) for u in t], t)
    bound = expected_error_with_events(R, [h, third], np.array([d]), np.array([J])).item()
    assert true <= bound + 1e-5


def test_the_next_derivative_limits_the_radius_at_an_inflection():
    assert np.isposinf(radius_for(0.0, 0.1).item())
    guarded = radius_with_events([0.0, 4.0], 0.1, 1e-3, 50.0).item()
    assert guarded == pytest.approx((12.0 * 0.1 / 4.0) ** 0.25, rel=1e-12)


def test_the_radius_is_the_root():
    d, J = jnp.array([0.3, -0.5, jnp.inf]), jnp.array([1.0, 2.0, 9.0])
    R = radius_with_events([0.7], 0.1, 1e-3, 50.0, d, J)
    assert expected_error_with_events(R, [0.7], d, J).item() == pytest.approx(0.1, rel=1e-12)
    assert radius_for(0.7, 0.1) > R


def test_limits_are_reported_as_zero_and_infinity():
    assert radius_with_events([1.0], 1e-9, 0.1, 2.0).item() == 0.0
    assert np.isposinf(radius_with_events([1.0], 1e9, 0.1, 2.0).item())


def test_the_radius_is_differentiable_in_everything():
    @jax.jit
    def radius(h, e, d, J):
        return radius_with_events([h], e, 1e-3, 50.0, d[None], J[None])

    at = [np.array(a) for a in (0.7, 0.1, 0.3, 1.4)]
    slopes = jax.jit(jax.grad(radius, (0, 1, 2, 3)))(*at)
    for k, slope in enumerate(slopes):
        step = 1e-5
        up, down = (radius(*[a + s * (i == k) for i, a in enumerate(at)]) for s in (step, -step))
        assert slope.item() == pytest.approx(float(up - down) / (2 * step), rel=1e-6)


def test_the_radius_has_second_derivatives():
    """Of one derivative alone it is `(3 e / h)^(1/3)`; beside a kink, against differences."""
    h, e, x = 0.7, 0.1, jnp.array([0.7, 0.1, 0.3, 1.4])

    def radius(x):
        return radius_with_events([x[0]], x[1], 1e-3, 50.0, x[2:3], x[3:])

    R = (3.0 * e / h) ** (1.0 / 3.0)
    alone = jax.jit(jax.hessian(lambda x: radius_with_events([x[0]], x[1], 1e-3, 50.0)))(x[:2])
    wanted = R / 9.0 * np.array([[4.0 / h**2, -1.0 / (h * e)], [-1.0 / (h * e), -2.0 / e**2]])
    np.testing.assert_allclose(alone, wanted, rtol=1e-9)
    H, step = jax.jit(jax.hessian(radius))(x), 1e-5 * np.eye(4)
    slope = jax.jit(jax.grad(radius))
    slopes = [(slope(x + s) - slope(x - s)) / 2e-5 for s in step]
    np.testing.assert_allclose(H, slopes, rtol=1e-6, atol=1e-7)


def test_many_candidates_at_once_and_single_precision():
    x = jnp.linspace(0.0, 1.0, 5, dtype=jnp.float32)
    d = jnp.array([0.5, jnp.inf], jnp.float32) - x[:, None]
    J = jnp.array([3.0, 1.0], jnp.float32)
    R = radius_with_events([jnp.ones(5, jnp.float32)], jnp.float32(0.05), 1e-3, 5.0, d, J)
    assert R.dtype == jnp.float32
    assert R.shape == (5,)
    assert float(R[2]) < float(R[0])


@pytest.mark.smoke
def test_bad_input_is_one_sentence():
    with pytest.raises(ValueError, match="Argument `definition` must be one of"):
        discontinuities._checked("average squared")
    with pytest.raises(ValueError, match=r"Argument `kinks` must hold 2 jumps, but holds 1\."):
        expected_error_with_events(1.0, [1.0], np.zeros(2), np.zeros(1))
    with pytest.raises(ValueError, match=r"Argument `kinks` must hold 2 jumps, but holds 1\."):
        jax.jit(lambda d, J: expected_error_with_events(1.0, [1.0], d, J))(np.zeros(2), np.zeros(1))
    with pytest.raises(ValueError, match=r"Argument `steps` must hold 2 jumps, but holds 3\."):
        expected_error_with_events(1.0, [1.0], np.zeros(2), np.zeros(2), np.zeros(3))
    with pytest.raises(ValueError, match="Argument `derivatives` must hold at least one"):
        expected_error_with_events(1.0, [])
    assert np.isnan(jax.jit(lambda e: radius_with_events([1.0], e, 0.1, 2.0))(-1.0))


def test_the_largest_error_has_the_step_in_it():
    d, J, S = (np.array([a]) for a in (0.3, 0.5, 0.2))
    found = expected_error_with_events(1.0, [0.0], d, J, S, definition="largest")
    np.testing.assert_allclose(found, 0.5 * 0.7 + 0.2, rtol=1e-14)


@pytest.mark.parametrize("unit", [1.0, 1e-9])
def test_where_the_error_jumps_the_radius_has_no_slope_in_any_unit_of_light(unit):
    """In a small one an overshoot of the error once passed for a length."""

    def radius(tolerance):
        events = (np.array([a]) for a in (0.5, 0.0, 2.0 * unit))
        return radius_with_events([0.0], tolerance, 0.01, 2.0, *events, definition="largest")

    assert float(radius(unit)) == pytest.approx(0.5, rel=1e-12)
    assert jax.grad(radius)(unit) == 0.0


def test_one_kink_may_be_a_number():
    found = expected_error_with_events(0.5, [0.0], -0.25, 2.0, 0.1)
    assert float(found) == pytest.approx(0.5 * 2.0 * 0.25**2 + 0.1 * 0.25, rel=1e-14)
    assert float(radius_with_events([0.0], float(found), 0.01, 2.0, -0.25, 2.0, 0.1)) == (
        pytest.approx(0.5, rel=1e-12)
    )


def test_an_error_that_is_no_number_has_no_radius():
    """The halving once ended at `high`, as if all radii up to there were tolerated."""
    assert np.isnan(radius_with_events([np.nan], 0.25, 0.01, 2.0))
    assert np.isnan(radius_with_events([0.0], 0.25, 0.01, 2.0, np.array([np.nan]), np.ones(1)))


def test_limits_of_a_radius_are_in_order():
    with pytest.raises(ValueError, match=r"`high` must be at least 2, but is 0\.01"):
        radius_with_events([1.0], 0.25, 2.0, 0.01)


@pytest.mark.parametrize("value", [0.0, -1.0])
def test_a_relative_error_wants_a_value(value):
    with pytest.raises(ValueError, match="Argument `value` must be positive"):
        caching.expected_error_with_events(0.5, [1.0], definition="relative", value=value)

    def radius(value):
        return caching.radius_with_events([1.0], 0.1, 0.01, 1.0, definition="relative", value=value)

    assert jnp.isnan(jax.jit(radius)(value))
    assert jnp.isfinite(jax.jit(radius)(1.0))
    # Nothing is asked of it otherwise: black places have a total error.
    assert caching.expected_error_with_events(0.5, [1.0], value=value) > 0.0
    assert caching.radius_with_events([1.0], 0.1, 0.01, 1.0, value=value) > 0.0
