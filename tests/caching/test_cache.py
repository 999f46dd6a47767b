"""Caches along a line and on a plane: their answers by hand and by loops, and their tables."""

import csv
import functools

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from derivations.caching._light import lamp, scene_a_columns
from firstorder import io
from firstorder.caching import (
    Cache,
    Candidates,
    ValidityRegion,
    cache,
    circular_regions,
    elliptic_regions,
    fill,
    random_orders,
    taylor,
)

# --- along a line --------------------------------------------------------------------------------


def segments(radius):
    return ValidityRegion(1.0 / jnp.asarray(radius)[:, None, None])


def records(spacing=0.25, reach=1.3, order=1, fade=False):
    at = np.arange(-0.875, 0.9, spacing)
    some = Candidates.on_line(at, scene_a_columns(at), tilt=0.0)
    return Cache(some, segments(np.full(len(at), reach * spacing)), order, fade)


def error(caching):
    x = np.linspace(-0.9, 0.9, 301)
    return float(np.max(np.abs(caching(x[:, None]).value - scene_a_columns(x)[:, 0])))


@pytest.mark.smoke
def test_each_order_extrapolates_better():
    errors = [error(records(0.0625, order=order)) for order in (0, 1, 2)]
    assert errors[0] > 4.0 * errors[1]
    assert errors[1] > 8.0 * errors[2]


def no_factorial(E, g, H, dx, order):
    return E + g[..., 0] * dx[..., 0] + H[..., 0, 0] * dx[..., 0] ** 2


FAULTS = {
    "no factorial": no_factorial,
    "to the wrong side": lambda E, g, H, dx, order: taylor(E, g, H, -dx, order),
    "the value alone": lambda E, g, H, dx, order: E + 0.0 * dx[..., 0],
}


@pytest.mark.parametrize("fault", FAULTS)
def test_a_fault_in_the_expansion_is_noticed(fault, monkeypatch):
    bound = 4.0 * error(records(order=2))
    monkeypatch.setattr(cache, "_answers", cache._answered)  # what is compiled stays
    monkeypatch.setattr(cache, "taylor", FAULTS[fault])
    assert bound < error(records(order=2)) < np.inf


def test_on_a_record_the_record_answers():
    caching = records()
    answer = caching(caching.records.position)
    np.testing.assert_allclose(answer.value, caching.records.value, rtol=1e-13)
    assert np.all(answer.covered)


@pytest.mark.smoke
def test_where_nothing_covers_the_nearest_by_the_metric_answers():
    caching = records(reach=0.3)
    x = jnp.array([-5.0, 0.001, 7.0])
    answer = caching(x[:, None])
    assert answer.covered.tolist() == [False, False, False]
    assert np.all(np.isfinite(answer.value))
    first = caching.records.at(0)
    expected = first.value + first.gradient[0] * (-5.0 - first.position[0])
    assert answer.value[0].item() == pytest.approx(expected)
    slope = jax.vmap(jax.grad(lambda x: caching(x).value))(x)
    assert np.all(np.isfinite(slope))


def test_weights_are_inverse_errors():
    """Two records, by hand."""
    some = Candidates.on_line(np.array([0.0, 1.0]), np.array([[2.0, 0.5], [1.0, -1.0]]))
    caching = Cache(some, segments([2.0, 4.0]))
    x = 0.4
    w = np.array([2.0 / 0.4, 4.0 / 0.6])
    T = np.array([2.0 + 0.5 * 0.4, 1.0 + 0.6])
    assert caching(x).value.item() == pytest.approx(np.sum(w * T) / np.sum(w), rel=1e-13)
    fading = Cache(some, segments([2.0, 4.0]), fade=True)
    w = w - 1.0
    assert fading(x).value.item() == pytest.approx(np.sum(w * T) / np.sum(w), rel=1e-13)


def test_a_turned_normal_is_farther_away():
    at, n = np.array([0.0, 1.0]), np.array([1.2, 0.0])
    some = Candidates.of(at, np.array([2.0, 1.0]), np.zeros((2, 1)), tilt=n)
    turned = Cache(some, segments([2.0, 2.0]), 0)
    assert turned(0.1, 0.0).value < 1.5 < turned(0.1, 1.2).value


def test_a_turned_normal_is_farther_away_on_a_plane():
    """By the length of the turn, whichever tangent axis it is about."""
    at, n = np.array([[0.0, 0.0], [1.0, 0.0]]), np.array([[0.72, 0.96], [0.0, 0.0]])
    some = Candidates.of(at, np.array([2.0, 1.0]), np.zeros((2, 2)), tilt=n)
    turned = Cache(some, circular_regions(np.full(2, 2.0), 0.1, 3.0, dims=2), 0)
    place = np.array([0.1, 0.0])
    assert turned(place).value < 1.5 < turned(place, n[0]).value
    e = np.array([0.05 + np.sin(1.2), 0.45])
    expected = np.sum([2.0, 1.0] / e * (e < 1.0)) / np.sum(1.0 / e * (e < 1.0))
    assert turned(place).value.item() == pytest.approx(expected, rel=1e-12)


def test_faded_weights_leave_no_step():
    x = jnp.linspace(-0.9, 0.9, 4001)[:, None]
    steps = [float(jnp.max(jnp.abs(jnp.diff(records(fade=f)(x).value)))) for f in (False, True)]
    assert steps[0] > 2.0 * steps[1]


def test_derivatives_flow_to_the_records():
    caching = records()
    at = caching.records.position[:, 0]

    def value(data):
        return Cache(Candidates.on_line(at, data, tilt=0.0), caching.region)(0.31).value

    slope = jax.grad(value)(jnp.asarray(scene_a_columns(at)))
    assert jnp.sum(slope[:, 0]).item() == pytest.approx(1.0)  # weights add up to one
    assert np.all(np.isfinite(slope))


def test_the_table_is_printed_and_exported(tmp_path):
    at = jnp.array([0.5, -0.5, 0.0])
    some = Candidates.from_function(lamp, at, derivatives=3, tilt=0.0)
    radii = circular_regions(jnp.array([0.01, 0.3, 9.0]), 0.1, 1.0)
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


def test_single_precision():
    at = jnp.linspace(-1.0, 1.0, 5, dtype=jnp.float32)
    some = Candidates.from_function(lamp, at, derivatives=3)
    caching = Cache.of(some, circular_regions(jnp.full(5, 0.7, jnp.float32), 0.1, 1.0), order=2)
    value = caching(jnp.linspace(-1.0, 1.0, 17, dtype=jnp.float32)[:, None]).value
    assert value.dtype == jnp.float32
    assert np.all(np.isfinite(value))
    assert {a.dtype for a in jax.tree.leaves(some)} == {np.dtype(np.float32)}


# --- on a plane, and along a line by the same loops ----------------------------------------------


def E(x):
    """A field with slopes of every kind, in exact arithmetic below; along a line at y = 0.4."""
    y = x[1] if x.shape == (2,) else 0.4
    return 2.0 + x[0] ** 2 * y - 0.5 * y**2 + x[0]


PLACES = np.random.default_rng(0).uniform(size=(12, 2))
WHERE = np.concatenate([np.random.default_rng(1).uniform(size=(60, 2)), PLACES[:2], [[5.0, 5.0]]])


@pytest.fixture(scope="module", params=[1, 2])
def both(request):
    """Candidates, regions and places of either number of coordinates."""
    d = request.param
    some = Candidates.from_function(E, PLACES[:, :d])
    if d == 1:
        return some, circular_regions(0.02 + 0.1 * PLACES[:, 1], 0.03, 0.1), WHERE[:, :1]
    return some, jax.jit(lambda H: elliptic_regions(H, 0.01, 0.1, 0.6))(some.hessian), WHERE


def slowly(some, reach, where, order, fade):
    """The weighted mean, record by record."""
    value, covered = [], []
    for place in where:
        parts = []
        for i in range(len(PLACES)):
            dx = place - np.asarray(some.position[i])
            there = some.value[i]
            there += (np.asarray(some.gradient[i]) @ dx) if order > 0 else 0.0
            there += 0.5 * dx @ np.asarray(some.hessian[i]) @ dx if order > 1 else 0.0
            parts.append((np.linalg.norm(np.asarray(reach.matrix[i]) @ dx), float(there)))
        reached = [(1.0 / (e + 1e-300) - fade, t) for e, t in parts if e < 1.0]
        covered.append(bool(reached))
        w, t = np.array(reached or [(1.0, min(parts)[1])]).T
        value.append(w @ t / w.sum() if w.max() < 1e200 else t[np.argmax(w)])
    return np.array(value), covered


CASES = [(0, False), (1, False), (2, True)]


@pytest.mark.parametrize(("order", "fade"), CASES)
def test_answers_are_weighted_means_of_expansions(both, order, fade):
    some, reach, where = both
    value, covered = slowly(some, reach, where, order, fade)
    answer = Cache.of(some, reach, order=order, fade=fade)(where)
    np.testing.assert_allclose(answer.value, value, rtol=1e-9)
    assert np.asarray(answer.covered).tolist() == covered
    assert 20 < sum(covered) < len(covered)


def test_a_plane_is_exact_and_records_keep_their_values(both):
    some, reach, where = both
    caching = Cache.of(some, reach)
    slope = np.array([2.0, 3.0])[: some.dims]
    np.testing.assert_allclose(caching(some.position).value, some.value, rtol=1e-12)
    flat = Candidates.of(some.position, 1.0 + some.position @ slope, np.tile(slope, (12, 1)))
    answer = Cache.of(flat, reach)(where)
    np.testing.assert_allclose(answer.value, 1.0 + where @ slope, rtol=1e-12)


WRONG = {
    1: lambda E, g, H, dx, order: taylor(E, -g, H, dx, order),
    2: lambda E, g, H, dx, order: taylor(E, g[..., ::-1], H, dx, order),
}


def test_a_gradient_turned_round_is_noticed(both, monkeypatch):
    """Wrong twins of the expansion: the fault, seen by the same check."""
    some, reach, where = both
    value, _ = slowly(some, reach, where, 1, False)
    monkeypatch.setattr(cache, "_answers", cache._answered)
    monkeypatch.setattr(cache, "taylor", WRONG[some.dims])
    answer = Cache.of(some, reach)(where)
    assert 1e-2 < np.max(np.abs(np.asarray(answer.value) - value)) < np.inf


@pytest.mark.smoke
def test_chosen_rows_and_the_table(both, tmp_path):
    some, reach, where = both
    caching = Cache.of(some, reach, np.arange(12) < 3)
    assert caching.count == 3
    columns = caching.columns()
    if some.dims == 2:
        assert list(columns)[:3] == ["x", "y", "E"]
    assert len(str(caching).splitlines()) == 4
    io.write_csv(tmp_path / "cache.csv", columns)
    read = np.genfromtxt(
        tmp_path / "cache.csv", delimiter=",", names=True, dtype=None, encoding="utf-8"
    )
    again = Cache.from_columns({k: read[k] for k in read.dtype.names or ()})
    np.testing.assert_allclose(again.region.matrix, caching.region.matrix, rtol=1e-9)
    np.testing.assert_allclose(again(where).value, caching(where).value, rtol=1e-9)
    assert again.region.clamp.tolist() == caching.region.clamp.tolist()


@pytest.mark.parametrize("dims", [1, 2])
def test_a_table_keeps_tilts_and_third_derivatives(dims):
    places = PLACES[:4, :dims]
    some = Candidates.from_function(E, places, derivatives=3, tilt=0.1 * places)
    caching = Cache.of(some, circular_regions(np.full(4, 0.5), 0.1, 1.0, dims))
    again = Cache.from_columns(caching.columns())
    for a, b in zip(jax.tree.leaves(again), jax.tree.leaves(caching), strict=False):
        np.testing.assert_allclose(a, b, rtol=1e-12)


def test_axes_of_a_record_are_those_of_its_matrix(both):
    some, reach, _ = both
    region = Cache.of(some, reach).region
    lengths, angle = region.axes()
    if some.dims == 1:
        np.testing.assert_allclose(lengths[:, 0], region.radius)
        assert np.all(angle == 0.0)
        return
    for M, (a, b), t in zip(np.asarray(region.matrix), lengths, angle, strict=True):
        u, v = np.array([np.cos(t), np.sin(t)]), np.array([-np.sin(t), np.cos(t)])
        assert np.linalg.norm(M @ (a * u)) == pytest.approx(1.0)
        assert np.linalg.norm(M @ (b * v)) == pytest.approx(1.0)
        assert a >= b


# --- both, in the same words ---------------------------------------------------------------------


@pytest.mark.parametrize("dims", [1, 2])
def test_three_lines_make_a_cache(dims):
    """From candidates to answers, along a line and on a plane."""
    side = np.linspace(0.0, 1.0, 64 if dims == 1 else 8)
    places = np.stack(np.meshgrid(*[side] * dims), -1).reshape(-1, dims)
    c = Candidates.from_function(lambda x: jnp.sum(jnp.cos(x)), places)
    region = circular_regions(np.full(64, 0.2), 1 / 64, 1.0, dims)
    caching = Cache.of(c, region, fill(c, region, random_orders(64, 1)[0]))
    answer = caching(places)
    assert np.all(answer.covered)
    np.testing.assert_allclose(answer.value, c.value, rtol=0.0, atol=0.05)


@pytest.mark.smoke
def test_places_have_an_axis_of_coordinates(both):
    some, reach, _ = both
    caching = Cache.of(some, reach)
    hint = r": arc lengths x are x\[..., None\]" if some.dims == 1 else ""
    words = rf"^Argument `x` must have shape \(..., {some.dims}\), but has \(3,\){hint}.$"
    with pytest.raises(ValueError, match=words):
        caching(jnp.zeros(3))
    assert caching(jnp.zeros((4, 3, some.dims))).value.shape == (4, 3)
    assert caching(jnp.zeros(some.dims)).value.shape == ()
    if some.dims == 1:
        assert caching(0.3).value == caching(jnp.array([0.3])).value


ONE = Candidates.of(np.zeros(1), np.zeros(1), np.zeros((1, 1)))
TILTED = Candidates.of(np.zeros(1), np.zeros(1), np.zeros((1, 1)), tilt=np.zeros(1))


@pytest.mark.smoke
@pytest.mark.parametrize(
    ("call", "words"),
    [
        (
            lambda: Cache(ONE, segments([jnp.inf])),
            r"^Argument `radius` must be positive, but is inf.$",
        ),
        (
            lambda: Cache(ONE, circular_regions(np.ones(1), 0.1, 2.0, dims=2)),
            r"^Argument `region` must have 1 dimension, as the candidates have, but has 2: "
            r"`circular_regions` takes `dims`.$",
        ),
        (
            lambda: Cache(ONE, segments([1.0]), 2),
            r"^Argument `hessian` must be given for order 2, but is missing.$",
        ),
        (
            lambda: taylor(ONE.value, ONE.gradient, None, np.ones((1, 1)), 2),
            r"^Argument `hessian` must be given for order 2, but is missing.$",
        ),
        (
            lambda: Cache(ONE, segments([1.0]))(0.0, 0.1),
            r"^Argument `tilt` must be left out: the records hold none.$",
        ),
        (
            lambda: Cache(TILTED, segments([1.0]))(np.zeros((2, 1)), np.zeros(3)),
            r"^Argument `tilt` must broadcast to shape \(2, 1\), but has \(3,\).$",
        ),
        (
            lambda: Cache.from_columns({"x": np.zeros(1), "angle": np.zeros(1)}),
            r"^Argument `columns` must hold `y`, but does not.$",
        ),
        (
            lambda: Cache.from_columns({"x": np.zeros(1)}),
            r"^Argument `columns` must hold `E`, but does not.$",
        ),
        *(
            (
                lambda d=d: Cache.of(
                    Candidates.of(PLACES[:, :d], np.ones(12), PLACES[:, :d]),
                    circular_regions(jnp.ones(12), 0.1, 1.0, d),
                    np.zeros(12, bool),
                ),
                r"^Argument `position` must hold at least one record, but is empty.$",
            )
            for d in (1, 2)
        ),
    ],
)
def test_bad_input_is_one_sentence(call, words):
    with pytest.raises(ValueError, match=words):
        call()


# --- properties ----------------------------------------------------------------------------------

COUNT = 7
DRAWN = np.random.default_rng(6)
POSITIONS = DRAWN.uniform(-1.0, 1.0, (COUNT, 2))
HELD = [DRAWN.normal(size=(2, COUNT, *shape)) for shape in ((), (2,), (2, 2))]
SHAPES = DRAWN.normal(size=(COUNT, 2, 2)) * 0.4 + 1.4 * np.eye(2)
STILL = np.eye(2)
SPOT = st.tuples(st.floats(-1.0, 1.0), st.floats(-1.0, 1.0))
ORDERS = st.tuples(st.sampled_from([0, 1, 2]), st.booleans())


@functools.partial(jax.jit, static_argnums=3)
def _answers_at(records, matrix, x, how):
    answer = Cache(records, ValidityRegion(matrix), *how)(x)
    return answer.value, answer.covered


def on_plane(x, how, light=(1.0, 0.0), turn=STILL, shift=(0.0, 0.0), scale=1.0, order=None):
    """What a cache of seven records says at a place, when all is moved, scaled or put in order.

    Args:
        x: the place, moved with the rest.
        how: order of the expansions, and whether weights fade.
        light: weights of two radiances, whose values and derivatives the records hold.
        turn: matrix by which everything is turned.
        shift: by which it is moved then.
        scale: by which it is stretched first.
        order: of the records.
    """
    E, g, H = (np.tensordot(light, held, 1) for held in HELD)
    g, H = g @ turn.T / scale, turn @ (H + H.swapaxes(1, 2)) @ turn.T / scale**2
    rows = np.arange(COUNT) if order is None else np.asarray(order)
    at = scale * POSITIONS @ turn.T + np.asarray(shift)
    records = Candidates.of(*(a[rows] for a in (at, E, g, H)))
    matrix = jnp.asarray((SHAPES @ turn.T / scale)[rows])
    place = scale * turn @ np.asarray(x) + np.asarray(shift)
    return [np.asarray(a) for a in _answers_at(records, matrix, jnp.asarray(place), how)]


def assert_same_answer(ours, expected):
    """Values to rounding, which a place far from all records makes larger; and the same cover."""
    np.testing.assert_allclose(ours[0], expected[0], rtol=1e-9, atol=1e-9)
    assert ours[1] == expected[1]


def turning(angle):
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, -s], [s, c]])


@given(SPOT, ORDERS, st.floats(-3.0, 3.0), SPOT, st.floats(0.1, 10.0))
def test_a_cache_moved_turned_and_in_another_unit_answers_the_same(x, how, angle, shift, scale):
    moved = on_plane(x, how, turn=turning(angle), shift=shift, scale=scale)
    assert_same_answer(moved, on_plane(x, how))


@given(SPOT, ORDERS, st.permutations(range(COUNT)))
def test_the_order_of_records_does_not_matter(x, how, order):
    assert_same_answer(on_plane(x, how, order=order), on_plane(x, how))


@given(SPOT, ORDERS, st.tuples(st.floats(0.0, 5.0), st.floats(0.0, 5.0)))
def test_radiances_add_in_what_is_extrapolated(x, how, light):
    """Regions held, the answer is linear in what the records hold."""
    one, two = (on_plane(x, how, light=a)[0] for a in np.eye(2))
    found = on_plane(x, how, light=light)[0]
    np.testing.assert_allclose(found, light[0] * one + light[1] * two, rtol=1e-9, atol=1e-9)


@given(SPOT, st.floats(-2.0, 2.0), st.tuples(st.floats(-2.0, 2.0), st.floats(-2.0, 2.0)))
def test_records_of_a_plane_answer_with_that_plane(x, height, slope):
    """First order is exact for light that is linear, whatever the regions are."""
    slope = np.asarray(slope)
    records = Candidates.of(POSITIONS, height + POSITIONS @ slope, np.tile(slope, (COUNT, 1)))
    found, _ = _answers_at(records, jnp.asarray(SHAPES), jnp.asarray(x), (1, False))
    np.testing.assert_allclose(found, height + x @ slope, rtol=0.0, atol=1e-12)


def test_a_table_with_gaps_for_what_did_not_act_is_read():
    """As pandas reads the empty words of a file; other words are refused."""
    line = Candidates.from_function(jnp.cos, jnp.linspace(0.0, 1.0, 3))
    columns = Cache.of(line, circular_regions(jnp.array([0.3, 0.3, 9.0]), 0.1, 1.0)).columns()
    gaps = np.array([np.nan, np.nan, "cut"], dtype=object)
    assert Cache.from_columns(columns | {"clamp": gaps}).columns()["clamp"].tolist() == [
        "",
        "",
        "cut",
    ]
    with pytest.raises(ValueError, match="`columns` must hold known clamps, but has 'low'"):
        Cache.from_columns(columns | {"clamp": np.full(3, "low")})


def test_a_tilt_that_is_no_number_has_no_answer():
    """Along a line it once counted as a right angle, and the record answered."""
    assert np.isnan(Cache(TILTED, segments([1.0]))(0.0, np.nan).value)
