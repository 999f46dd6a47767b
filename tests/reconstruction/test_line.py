import functools
import heapq
import itertools

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from firstorder import io, reconstruction
from firstorder.checks.tolerance import normwise, rounding
from firstorder.reconstruction import (
    LineCell,
    line_by_curvature,
    line_by_differences,
    line_by_disagreement,
    line_by_gradient,
    line_by_length,
    sample_line,
)
from firstorder.reconstruction import (
    line as adaptive,
)

DRIVERS = {
    "length": line_by_length,
    "differences": line_by_differences,
    "gradient": line_by_gradient,
    "curvature": line_by_curvature,
    "disagreement": line_by_disagreement(2),
}


class Ramp(eqx.Module):
    """`tanh(w (x - c)) + x / 10` with its two derivatives: smooth, steep in one place."""

    w: float = 12.0
    c: float = 0.23

    def __call__(self, x):
        f = jnp.tanh(self.w * (x - self.c))
        d = self.w * (1.0 - f * f)
        return f + 0.1 * x, d + 0.1, -2.0 * self.w * f * d


RAMP = Ramp()

FAULTS = {
    "length forgotten": lambda c: c.mean(1),
    "one end only": lambda c: c.length * jnp.abs(c.left[1]),
    "signed, so that ends cancel": lambda c: 0.5 * c.length * jnp.abs(c.left[1] - c.right[1]),
    "the value for the slope": lambda c: c.length * c.mean(0),
}


@functools.cache
def all_of_them(function, drivers, low=-1.0, budget=129, initial=9, breaks=()):
    """The samples of several drivers, compiled as one."""

    def one(which):
        def driver(cell):
            return jnp.dot(which, jnp.stack([d(cell) for d in drivers]))

        return sample_line(function, low, 1.0, budget, driver, initial=initial, breaks=breaks)

    return jax.jit(jax.vmap(one))(jnp.eye(len(drivers)))


def ramped(driver):
    kinds = {**DRIVERS, **FAULTS}
    lines = all_of_them(RAMP, tuple(kinds.values()))
    return jax.tree.map(lambda a: a[list(kinds).index(driver)], lines)


def by_slope(budget=129, **options):
    return sample_line(RAMP, -1.0, 1.0, budget, line_by_gradient, **options)


value = eqx.filter_jit(lambda line, data, x: line.interpolant(data)(x))


# --- the readable twin -------------------------------------------------------------------------


def twin(function, low, high, budget, weight, initial):
    """The same sampler with a heap; `weight(a, fa, b, fb)` in plain Python. Yields x by order."""
    known = [(x, function(x)) for x in np.linspace(low, high, initial)]
    heap = [(-weight(*a, *b), a, b) for a, b in itertools.pairwise(known)]
    heapq.heapify(heap)
    while len(known) < budget:
        _, a, b = heapq.heappop(heap)
        x = 0.5 * (a[0] + b[0])
        m = x, function(x)
        known.append(m)
        for left, right in ((a, m), (m, b)):
            heapq.heappush(heap, (-weight(*left, *right), left, right))
    return np.array([x for x, _ in known])


WEIGHTS = {
    "length": lambda a, f, b, g: b - a,
    "differences": lambda a, f, b, g: abs(g[0] - f[0]),
    "gradient": lambda a, f, b, g: (b - a) * (abs(f[1]) + abs(g[1])) / 2,
    "curvature": lambda a, f, b, g: (b - a) ** 2 * (abs(f[2]) + abs(g[2])) / 16,
}


def by_hand(x):
    f = np.tanh(12.0 * (x - 0.23))
    d = 12.0 * (1.0 - f * f)
    return f + 0.1 * x, d + 0.1, -24.0 * f * d


@pytest.mark.smoke
@pytest.mark.parametrize("driver", [d for d in WEIGHTS if d != "length"])
def test_the_samples_are_those_of_a_heap_in_their_order(driver):
    line = ramped(driver)
    truth = twin(by_hand, -1.0, 1.0, 129, WEIGHTS[driver], 9)
    assert normwise(line.x[np.argsort(line.order)], truth) < rounding(10)
    assert normwise(line.data, np.stack(by_hand(np.asarray(line.x)), -1)) < rounding(100, 12.0)


def test_by_length_is_uniform_where_halving_comes_out_even():
    assert normwise(ramped("length").x, np.linspace(-1.0, 1.0, 129)) < rounding()


@pytest.mark.parametrize("fault", FAULTS)
def test_a_wrong_driver_is_noticed(fault):
    line = ramped(fault)
    truth = twin(by_hand, -1.0, 1.0, 129, WEIGHTS["gradient"], 9)
    error = normwise(line.x[np.argsort(line.order)], truth)
    assert np.isfinite(error)
    assert error > rounding(10)


# --- what greedy splitting promises ------------------------------------------------------------


def importances(line, driver):
    cells = LineCell(jnp.diff(line.x), line.data[:-1], line.data[1:])
    return np.asarray(jax.vmap(DRIVERS[driver])(cells))


@pytest.mark.parametrize(("driver", "halves"), [("gradient", 2), ("curvature", 4)])
def test_no_cell_is_left_more_important_than_those_that_were_split(driver, halves):
    """Halving a smooth cell divides its importance by 2, or by 4: so far do the leaves spread.

    The mean over a parent's ends is not the mean over its halves', hence the slack of 2.
    """
    w = np.sort(importances(ramped(driver), driver))
    assert np.sum(w < w[-1] / (2.0 * halves)) <= 8  # cells that were there at the beginning


@pytest.mark.parametrize(("driver", "power"), [("gradient", 1.0), ("curvature", 0.5)])
def test_the_density_of_the_samples(driver, power):
    """Equal importance means lengths as 1/|f'|, or as |f''|^(-1/2); in the mean over octaves."""
    line = sample_line(RAMP, -1.0, 1.0, 1025, DRIVERS[driver])
    h = np.diff(line.x)
    strength = np.mean(np.abs(np.stack([line.data[:-1, 1:], line.data[1:, 1:]])), 0)
    strength = strength[:, 0 if driver == "gradient" else 1]
    steep = strength > 0.05 * np.max(strength)
    slope = np.polyfit(np.log(strength[steep]), np.log(h[steep]), 1)[0]
    assert abs(slope + power) < 0.1


def error_of(line, data):
    x = np.linspace(-1.0, 1.0, 4001)
    return np.sqrt(np.mean((np.asarray(value(line, data, x)) - by_hand(x)[0]) ** 2))


def test_each_driver_is_best_at_what_it_drives():
    """The gradient spends samples on straight slopes, which curves through slopes need not."""
    linear = {d: error_of(ramped(d), 1) for d in DRIVERS}
    assert linear["curvature"] < linear["gradient"] < linear["differences"] < linear["length"]
    cubic = {d: error_of(ramped(d), 2) for d in DRIVERS}
    assert min(cubic, key=lambda d: cubic[d]) == "disagreement"
    assert cubic["gradient"] > cubic["length"]


def test_a_wave_that_the_grid_aliases_shows_in_slopes_and_not_in_differences():
    """R07 §9.2: eight whole periods in each cell, beside a gentle ramp that takes all samples."""

    def both(x):
        p, right = 2.0 * jnp.pi * 64.0 * x, x > 0.5
        slope = 2.0 * jnp.pi * 64.0 * jnp.cos(p)
        return jnp.where(right, jnp.sin(p), 0.5 - x), jnp.where(right, slope, -1.0)

    kinds = [sample_line(both, 0.0, 1.0, 60, d) for d in (line_by_gradient, line_by_differences)]
    found = [int(np.sum(np.asarray(line.x) > 0.5)) for line in kinds]
    assert found == [55, 4]


# --- batches, breaks, the table ----------------------------------------------------------------


def test_samples_of_a_smaller_budget_are_those_taken_first():
    long, short = ramped("gradient"), by_slope(65)
    kept = np.asarray(long.order) < 65
    np.testing.assert_array_equal(long.x[kept], short.x)
    np.testing.assert_array_equal(long.order[kept], short.order)


@pytest.mark.parametrize("batch", [7, 0.1])
def test_batches_spend_the_budget_and_stay_close_to_greedy(batch):
    line = by_slope(batch=batch)
    assert line.x.size == 129
    assert np.all(np.diff(line.x) > 0)
    assert sorted(line.order.tolist()) == list(range(129))
    assert error_of(line, 1) < 1.5 * error_of(ramped("gradient"), 1)


def test_a_share_of_the_cells_is_split_in_each_step():
    """Of 4, 6, 9 and 13 cells half; the even ones first, no more than the most of the others."""
    assert adaptive._sizes(5, 1, 21, 0.5) == [5, 2, 3, 4, 6, 1]


def test_a_batch_larger_than_the_cells_splits_them_all():
    line = by_slope(33, initial=3, batch=100)
    assert normwise(line.x, np.linspace(-1.0, 1.0, 33)) < rounding()


def jumping(x):
    """A jump and a kink at 1/3, which no halving of [0, 1] hits."""
    left = x < 1.0 / 3.0
    return jnp.where(left, x * x, 2.0 - x), jnp.where(left, 2.0 * x, -1.0)


SLOPED = ("length", "differences", "gradient")


@pytest.mark.parametrize("driver", SLOPED)
def test_breaks_are_respected(driver):
    x = np.linspace(0.0, 1.0, 1001)
    kinds = tuple(DRIVERS[d] for d in SLOPED)
    lines = all_of_them(jumping, kinds, 0.0, budget=24, initial=4, breaks=1.0 / 3.0)
    line = jax.tree.map(lambda a: a[SLOPED.index(driver)], lines)
    assert np.sum(np.asarray(line.x) == 1.0 / 3.0) == 2
    assert normwise(value(line, None, x), jumping(x)[0]) < rounding(50)


def test_a_break_forgotten_is_noticed():
    x = np.linspace(0.0, 1.0, 1001)
    line = sample_line(jumping, 0.0, 1.0, 24, line_by_gradient, initial=4)
    assert normwise(value(line, None, x), jumping(x)[0]) > 0.1


def test_one_side_of_a_break_taken_for_both_is_noticed(monkeypatch):
    """Without the hair's breadth both nodes at the break see the right side."""
    monkeypatch.setattr(adaptive.jnp, "minimum", lambda a, b: 0.0 * b)
    line = sample_line(jumping, 0.0, 1.0, 23, line_by_gradient, initial=4, breaks=1.0 / 3.0)
    x = np.linspace(0.0, 1.0, 1001)
    monkeypatch.undo()
    assert normwise(value(line, None, x), jumping(x)[0]) > 0.1


@pytest.mark.parametrize("scale", [lambda w: w, jnp.log])
def test_a_cell_that_cannot_be_judged_is_split_last(scale):
    """Whatever numbers the others have: those of a logarithm are negative."""

    def root(x):
        return jnp.sqrt(x), 0.5 / jnp.sqrt(x)

    line = sample_line(root, 0.0, 1.0, 65, lambda cell: scale(line_by_gradient(cell)))
    assert np.isinf(line.data[0, 1])
    assert float(line.x[1]) == 0.125


def test_the_table_prints_and_is_written(tmp_path):
    line = by_slope(9)
    assert str(line).splitlines()[0].split() == ["x", "value", "slope", "second", "order"]
    assert len(str(line).splitlines()) == 10
    io.write_csv(tmp_path / "line.csv", line.columns())
    read = np.loadtxt(tmp_path / "line.csv", delimiter=",", skiprows=1)
    assert normwise(read[:, 1:4], line.data) == 0.0


def test_a_traced_table_prints_its_shape():
    words = []
    jax.jit(lambda: words.append(str(sample_line(RAMP, -1.0, 1.0, 9))))()
    assert words[0].startswith("LineSamples(x=")


@pytest.mark.parametrize("bits", [32, 64])
def test_precision_vmap_and_derivatives(bits):
    """The values' gradient by the function's parameter, for the positions that were chosen."""
    with jax.enable_x64(bits == 64):
        run = jax.vmap(lambda c: sample_line(Ramp(12.0, c), -1.0, 1.0, 20, breaks=c).data[:, 0])
        c = jnp.array([0.1, 0.3])
        values, slopes = jax.jit(lambda c: jax.jvp(run, (c,), (jnp.ones_like(c),)))(c)
        assert values.shape == slopes.shape == (2, 20)
        assert values.dtype == f"float{bits}"
        assert np.all(np.isfinite(slopes))


def test_single_precision_in_a_double_session():
    low, high = jnp.array([-1.0, 1.0], jnp.float32)
    line = sample_line(Ramp(), low, high, 20, line_by_disagreement(1), breaks=jnp.float32(0.3))
    assert line.x.dtype == line.data.dtype == jnp.float32


def test_traced_ends_out_of_order_give_nan():
    ends = jnp.array([1.0, 0.0])
    assert np.all(np.isnan(jax.jit(lambda e: sample_line(RAMP, e[0], e[1], 9).x)(ends)))


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: sample_line(RAMP, 1.0, 0.0, 20), "must rise"),
        (lambda: sample_line(RAMP, 0.0, 1.0, 30, breaks=2.0), "must rise"),
        (lambda: sample_line(RAMP, 0.0, np.inf, 20), "must be finite"),
        (lambda: sample_line(RAMP, 0.0, 1.0, 5), "at least 9, the samples"),
        (lambda: sample_line(RAMP, 0.0, 1.0, 5, initial=1), "at least 2"),
        (lambda: sample_line(RAMP, 0.0, 1.0, 20, batch=0), "must be positive"),
        (lambda: sample_line(lambda x: (x,), 0.0, 1.0, 20), "needs slopes"),
        (lambda: sample_line(RAMP, 0.0, 1.0, 20, line_by_disagreement(3)), "less than the 3"),
        (lambda: by_slope(9).interpolant(4), r"lie in \[1, 3\]"),
    ],
)
def test_bad_input_is_one_sentence(make, words):
    with pytest.raises(ValueError, match=words):
        make()


@pytest.mark.parametrize("end", ["low", "high"])
def test_an_end_is_one_number(end):
    """Several would be taken for breaks, and none would never end."""
    for wrong in ([], [0.0, 0.5]):
        ends = {"low": 0.0, "high": 1.0} | {end: np.array(wrong)}
        with pytest.raises(ValueError, match=f"`{end}` must be one number"):
            sample_line(lambda x: (x, 1.0 + 0.0 * x), **ends, budget=20)


def test_values_are_those_of_their_places_however_short_and_far_the_line():
    low, high = np.float32(1000.0), np.float32(1000.01)
    line = reconstruction.sample_line(lambda x: (x - low, jnp.ones_like(x)), low, high, 12)
    np.testing.assert_array_equal(line.value, line.x - low)
    broken = reconstruction.sample_line(
        lambda x: (jnp.where(x < np.float32(1000.005), 1.0, 2.0), 0.0 * x), low, high, 24,
        breaks=np.float32(1000.005),
    )  # fmt: skip
    at = np.float32(1000.005)
    assert broken.value[broken.x == at].tolist() == [1.0, 2.0]
    assert np.array_equal(broken.value[broken.x != at], 1.0 + (broken.x[broken.x != at] > at))


@pytest.mark.parametrize("far", [0.0, 1e4])
def test_far_from_zero_samples_stand_where_they_matter_in_single_precision(far):
    def ramp(x):
        t = jnp.tanh(30.0 * (x - far - 0.8))
        return t, 30.0 * (1.0 - t * t)

    low, high, none = jnp.float32(far), jnp.float32(far + 1.0), jnp.zeros(0, jnp.float32)
    line = sample_line(ramp, low, high, 60, line_by_gradient, breaks=none)
    assert line.x.dtype == jnp.float32
    assert np.unique(line.x).size == 60
    assert np.mean(np.asarray(line.x) > far + 0.5) > 0.8
