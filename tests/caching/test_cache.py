import csv

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from derivations.caching._light import lamp, scene_a_columns
from firstorder import io
from firstorder.caching import Cache, Candidates, cache, clamped, taylor
from firstorder.caching.cache import _derivatives_of


def records(spacing=0.25, reach=1.3, order=1, fade=False):
    at = np.arange(-0.875, 0.9, spacing)
    zeros = jnp.zeros(len(at))
    data = jnp.asarray(scene_a_columns(at))
    radius = zeros + reach * spacing
    return Cache(jnp.asarray(at), zeros, data, radius, jnp.zeros(len(at), int), order, fade)


def error(caching):
    x = np.linspace(-0.9, 0.9, 301)
    return float(np.max(np.abs(caching(x).value - scene_a_columns(x)[:, 0])))


def test_candidates_hold_the_closed_form_and_its_derivatives():
    at = np.linspace(-1.0, 1.0, 9)
    found = Candidates.along(lamp, at)
    np.testing.assert_allclose(found.derivatives, scene_a_columns(at), atol=1e-13)
    assert np.all(np.isinf(found.minimum))


@pytest.mark.smoke
def test_each_order_extrapolates_better():
    errors = [error(records(0.0625, order=order)) for order in (0, 1, 2)]
    assert errors[0] > 4.0 * errors[1]
    assert errors[1] > 8.0 * errors[2]


FAULTS = {
    "no factorial": lambda d, dx, order: sum(d[..., k] * dx**k for k in range(order + 1)),
    "to the wrong side": lambda d, dx, order: taylor(d, -dx, order),
    "the value alone": lambda d, dx, order: d[..., 0] + 0.0 * dx,
}


@pytest.mark.parametrize("fault", FAULTS)
def test_a_fault_in_the_expansion_is_noticed(fault, monkeypatch):
    bound = 4.0 * error(records(order=2))
    plain = getattr(cache._answers, "__wrapped__")  # noqa: B009 (what is compiled stays)
    monkeypatch.setattr(cache, "_answers", plain)
    monkeypatch.setattr(cache, "taylor", FAULTS[fault])
    assert bound < error(records(order=2)) < np.inf


def test_on_a_record_the_record_answers():
    caching = records()
    answer = caching(caching.x)
    np.testing.assert_allclose(answer.value, caching.derivatives[:, 0], rtol=1e-13)
    assert np.all(answer.covered)


@pytest.mark.smoke
def test_where_nothing_covers_the_nearest_by_the_metric_answers():
    caching = records(reach=0.3)
    x = jnp.array([-5.0, 0.001, 7.0])
    answer = caching(x)
    assert answer.covered.tolist() == [False, False, False]
    assert np.all(np.isfinite(answer.value))
    first = caching.derivatives[0]
    assert answer.value[0].item() == pytest.approx(first[0] + first[1] * (-5.0 - caching.x[0]))
    slope = jax.vmap(jax.grad(lambda x: caching(x).value))(x)
    assert np.all(np.isfinite(slope))


def test_weights_are_inverse_errors():
    """Two records, by hand."""
    at = jnp.array([0.0, 1.0])
    data = jnp.array([[2.0, 0.5], [1.0, -1.0]])
    none = jnp.zeros(2, int)
    caching = Cache(at, jnp.zeros(2), data, jnp.array([2.0, 4.0]), none)
    x = 0.4
    w = np.array([2.0 / 0.4, 4.0 / 0.6])
    T = np.array([2.0 + 0.5 * 0.4, 1.0 + 0.6])
    assert caching(x).value.item() == pytest.approx(np.sum(w * T) / np.sum(w), rel=1e-13)
    fading = Cache(at, jnp.zeros(2), data, jnp.array([2.0, 4.0]), none, fade=True)
    w = w - 1.0
    assert fading(x).value.item() == pytest.approx(np.sum(w * T) / np.sum(w), rel=1e-13)


def test_a_turned_normal_is_farther_away():
    at = jnp.array([0.0, 1.0])
    none = jnp.zeros(2, int)
    turned = Cache(at, jnp.array([1.2, 0.0]), jnp.array([[2.0], [1.0]]), at * 0 + 2.0, none, 0)
    assert turned(0.1, 0.0).value < 1.5 < turned(0.1, 1.2).value


def test_faded_weights_leave_no_step():
    x = jnp.linspace(-0.9, 0.9, 4001)
    steps = [float(jnp.max(jnp.abs(jnp.diff(records(fade=f)(x).value)))) for f in (False, True)]
    assert steps[0] > 2.0 * steps[1]


def test_derivatives_flow_to_the_records():
    caching = records()

    def value(data):
        changed = Cache(caching.x, caching.n, data, caching.radius, caching.clamp)
        return changed(jnp.array(0.31)).value

    slope = jax.grad(value)(caching.derivatives)
    assert jnp.sum(slope[:, 0]).item() == pytest.approx(1.0)  # weights add up to one
    assert np.all(np.isfinite(slope))


def test_the_table_is_printed_and_exported(tmp_path):
    some = Candidates.along(lamp, jnp.array([0.5, -0.5, 0.0]))
    radii = clamped(jnp.array([0.01, 0.3, 9.0]), 0.1, 1.0)
    caching = Cache.of(some, radii, np.array([True, True, True]))
    columns = caching.columns()
    assert list(columns) == [
        "x", "n", "E", "dE_dx", "d2E_dx2", "d3E_dx3", "radius", "clamp",
    ]  # fmt: skip
    assert columns["x"].tolist() == [-0.5, 0.0, 0.5]
    assert columns["clamp"].tolist() == ["", "cut", "raised"]
    lines = str(caching).splitlines()
    assert len(lines) == 4
    assert lines[0].split()[-2:] == ["radius", "clamp"]
    assert lines[3].endswith("raised")
    io.write_csv(tmp_path / "cache.csv", columns)
    with (tmp_path / "cache.csv").open() as file:
        rows = list(csv.reader(file))
    assert rows[1][0] == "-0.5"
    assert len(rows) == 4


@pytest.mark.smoke
def test_bad_input_is_one_sentence():
    none = jnp.zeros(0)
    with pytest.raises(ValueError, match="Argument `x` must hold at least one record"):
        Cache(none, none, jnp.zeros((0, 2)), none, jnp.zeros(0, int))
    one = jnp.zeros(1)
    with pytest.raises(ValueError, match=r"^Argument `radius` must be positive, but is inf.$"):
        Cache(one, one, jnp.zeros((1, 2)), one + jnp.inf, jnp.zeros(1, int))
    with pytest.raises(ValueError, match="Argument `derivatives` must hold 3 columns"):
        Cache(one, one, jnp.zeros((1, 2)), one + 1.0, jnp.zeros(1, int), 2)
    with pytest.raises(ValueError, match="Argument `derivatives` must hold 2 columns"):
        taylor(jnp.zeros(1), 0.1)


def test_single_precision():
    at = jnp.linspace(-1.0, 1.0, 5, dtype=jnp.float32)
    some = Candidates.along(lamp, at)
    caching = Cache.of(some, clamped(jnp.full(5, 0.7, jnp.float32), 0.1, 1.0), order=2)
    value = caching(jnp.linspace(-1.0, 1.0, 17, dtype=jnp.float32)).value
    assert value.dtype == jnp.float32
    assert np.all(np.isfinite(value))
    assert _derivatives_of(lamp, at[0], 4).dtype == jnp.float32
