"""Merged blockers against a plain loop over sorted intervals, and the laws of a union."""

import inspect

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from firstorder.visibility import _intervals as intervals
from firstorder.visibility._intervals import (
    blocked_measure,
    clip_intervals,
    exposed_ends,
    interval_between,
    merge_intervals,
    signed_edges,
    visible_gaps,
    visible_measure,
)

N = 6
# A coarse grid makes ends meet, coincide and leave the horizon often. Compiled code flushes the
# smallest numbers to zero.
END = st.integers(-10, 10).map(lambda k: 0.2 * k) | st.floats(-2.0, 2.0, allow_subnormal=False)
SLOTS = st.lists(st.tuples(END, END), min_size=N, max_size=N).map(lambda s: np.array(s).T)
HALF = 0.5 * np.pi


def loop(low, high):
    """The union as a list: sort, and join what meets."""
    pieces = sorted((max(a, -HALF), min(b, HALF)) for a, b in zip(low, high, strict=True) if b > a)
    out = []
    for a, b in pieces:
        if b <= a:
            continue
        if out and a <= out[-1][1]:
            out[-1][1] = max(out[-1][1], b)
        else:
            out.append([a, b])
    return np.array(out).reshape(-1, 2)


def batch(low, high):
    """All that is computed, for any leading axes."""
    return {
        "measure": blocked_measure(low, high),
        "sines": blocked_measure(low, high, jnp.sin),
        "visible": visible_measure(low, high, jnp.sin),
        "merged": merge_intervals(low, high),
        "gaps": visible_gaps(low, high),
        "edges": signed_edges(low, high),
    }


@jax.jit
def everything(low, high):
    """The same and the derivatives, compiled once."""
    slope = jax.grad(lambda e: blocked_measure(e[0], e[1], jnp.sin))((low, high))
    return batch(low, high) | {"slope": slope}


def shown(pair):
    """The slots in use, sorted, as rows."""
    low, high = np.asarray(pair)
    keep = high > low
    return np.sort(np.stack([low[keep], high[keep]], -1), axis=0)


@given(SLOTS)
def test_the_union_is_that_of_a_plain_loop(slots):
    found, truth = everything(*slots), loop(*slots)
    np.testing.assert_array_equal(shown(found["merged"]), truth)
    assert abs(found["measure"] - np.sum(truth[:, 1] - truth[:, 0])) < 1e-14
    assert abs(found["sines"] - np.sum(np.sin(truth[:, 1]) - np.sin(truth[:, 0]))) < 1e-14
    assert abs(found["visible"] + found["sines"] - 2.0) < 1e-14


@given(SLOTS)
def test_gaps_are_what_the_union_leaves(slots):
    found, truth = everything(*slots), loop(*slots)
    ends = np.concatenate([[-HALF], truth.ravel(), [HALF]]).reshape(-1, 2)
    np.testing.assert_array_equal(shown(found["gaps"]), ends[ends[:, 1] > ends[:, 0]])


@given(SLOTS)
def test_signs_alternate_and_count_the_crossings(slots):
    angles, signs = map(np.asarray, everything(*slots)["edges"])
    order = np.argsort(angles[signs != 0])
    kept = signs[signs != 0][order]
    assert np.all(kept[1:] == -kept[:-1])
    truth = loop(*slots)
    assert np.sum(signs > 0) == np.sum(truth[:, 0] > -HALF)
    assert np.sum(signs < 0) == np.sum(truth[:, 1] < HALF)


@given(SLOTS, st.permutations(range(N)))
def test_order_does_not_matter(slots, order):
    one, two = everything(*slots), everything(*slots[:, order])
    np.testing.assert_array_equal(shown(one["merged"]), shown(two["merged"]))
    assert abs(one["sines"] - two["sines"]) < 1e-14


@given(SLOTS, st.floats(0.0, 1.0))
def test_a_blocker_split_in_two_is_the_same_blocker(slots, share):
    low, high = slots.copy()
    low[-1] = high[-1] = 0.0  # a free slot
    middle = low[0] + share * (high[0] - low[0])
    halves = np.array([low, high])
    halves[:, -1] = middle, high[0]
    halves[1, 0] = middle
    one, two = everything(low, high), everything(*halves)
    np.testing.assert_array_equal(shown(one["merged"]), shown(two["merged"]))
    # The seam has no derivative, and the outer ends keep theirs.
    whole, parts = (np.asarray(e["slope"]) for e in (one, two))
    if high[0] > low[0]:
        assert abs(parts[0].sum() - whole[0].sum()) < 1e-13
        assert abs(parts[1].sum() - whole[1].sum()) < 1e-13


@given(SLOTS)
def test_superposition_of_blockers_that_are_apart(slots):
    """Measures of a union and its overlap: |A or B| = |A| + |B| where they do not meet."""
    truth = loop(*slots)
    total = sum(float(everything(*pad([row]))["sines"]) for row in truth)
    assert abs(total - everything(*slots)["sines"]) < 1e-14


def pad(rows):
    return np.pad(np.array(rows), ((0, N - len(rows)), (0, 0))).T


@given(SLOTS)
def test_derivatives_are_finite_and_only_of_exposed_ends(slots):
    slope = np.asarray(everything(*slots)["slope"])
    assert np.all(np.isfinite(slope))
    truth = loop(*slots)
    for part, sign, ends in ((slope[0], -1, truth[:, 0]), (slope[1], 1, truth[:, 1])):
        moving = ends[np.abs(ends) < HALF]
        assert abs(part.sum() - sign * np.sum(np.cos(moving))) < 1e-13


@given(*(st.floats(-3.0, 3.0),) * 4)
def test_the_span_of_a_segment_is_what_rays_meet(ax, ay, bx, by):
    """In any place about the receiver, below it too: angles of the ends, in either order."""
    a, b = np.array([ax, ay]), np.array([bx, by])
    area = abs(ax * by - ay * bx)
    if min(np.hypot(*a), np.hypot(*b), area) < 1e-3:
        return
    one, two = (np.arctan2(-e[:1], e[1:]) for e in (a, b))
    angles = np.linspace(-HALF, HALF, 103)[1:-1]
    u = np.stack([-np.sin(angles), np.cos(angles)], -1)
    weights = np.linalg.solve(np.stack([a, b], 1), u.T)  # u between a and b: both positive
    if np.min(np.abs(weights)) < 1e-9:
        return
    for low, high in (span(one, two), span(two, one)):
        np.testing.assert_array_equal((angles > low) & (angles < high), np.all(weights > 0, 0))


@jax.jit
def span(one, two):
    return clip_intervals(*interval_between(one, two))


def test_who_covers_whom():
    cases = {
        "apart": ([0.0, 0.5], [0.2, 0.9], [1, 1], [1, 1]),
        "touching": ([0.0, 0.2], [0.2, 0.9], [1, 0], [0, 1]),
        "crossing": ([0.0, 0.1], [0.2, 0.9], [1, 0], [0, 1]),
        "nested": ([0.0, 0.1], [0.9, 0.2], [1, 0], [1, 0]),
        "equal": ([0.0, 0.0], [0.9, 0.9], [1, 0], [1, 0]),
        "one low end": ([0.0, 0.0], [0.2, 0.9], [1, 0], [0, 1]),
        "empty": ([0.3, 0.3], [0.3, 0.1], [0, 0], [0, 0]),
        "not a number": ([np.nan, 0.1], [0.3, np.nan], [0, 0], [0, 0]),
    }
    for words, (low, high, at_low, at_high) in cases.items():
        found = exposed_ends(jnp.array(low), jnp.array(high))
        np.testing.assert_array_equal(np.asarray(found), np.array([at_low, at_high]), words)


def test_two_blockers_merge_as_one_moves():
    """Before, while and after they touch; the derivative loses the two ends that meet."""
    low, high = jnp.array([0.0, 0.5]), jnp.array([0.4, 0.9])

    def union(shift):
        step = shift * jnp.array([1.0, 0.0])
        return blocked_measure(low + step, high + step)

    for shift, measure, slope in ((0.0, 0.8, 0.0), (0.2, 0.7, -1.0), (0.6, 0.5, 1.0)):
        assert abs(union(shift) - measure) < 1e-15
        assert abs(jax.grad(union)(shift) - slope) < 1e-15


def test_batches_and_horizons():
    low = jnp.linspace(-2.0, 1.0, 24).reshape(2, 3, 4)
    high = low + 0.4
    at_once = jax.jit(batch)(low, high)
    one = jax.vmap(jax.vmap(everything))(low, high)
    assert at_once["merged"][0].shape == (2, 3, 4)
    assert at_once["gaps"][0].shape == (2, 3, 5)
    assert at_once["edges"][0].shape == (2, 3, 8)
    for name, found in at_once.items():
        for ours, single in zip(jax.tree.leaves(found), jax.tree.leaves(one[name]), strict=True):
            np.testing.assert_array_equal(ours, single)
    inside = jax.jit(lambda a, b: clip_intervals(a, b, (-0.1, 0.2)))(low, high)
    assert all(np.all((np.asarray(e) >= -0.1) & (np.asarray(e) <= 0.2)) for e in inside)


def test_below_the_horizon_nothing_moves():
    move = lambda t: blocked_measure(jnp.array([0.5]), jnp.array([2.0]) + t)  # noqa: E731
    assert jax.grad(move)(0.0) == 0.0
    at_it = lambda t: blocked_measure(jnp.array([-HALF]) + t, jnp.array([0.1]))  # noqa: E731
    assert jax.grad(at_it)(0.0) in (0.0, -1.0)  # one-sided, never half


def test_single_precision_is_kept():
    low, high = jnp.array([0.0, 0.1], jnp.float32), jnp.array([0.5, 0.7], jnp.float32)
    found = everything(low, high)
    assert {leaf.dtype.name for leaf in jax.tree.leaves(found)} == {"float32"}


# --- faults --------------------------------------------------------------------------------------


def all_ends(low, high):
    real = high > low
    return real, real


def no_ties(low, high):
    """Equal ends cover each other: both vanish."""
    real = high > low
    a, b = low[..., None, :], high[..., None, :]
    cl = real[..., None, :] & (a <= low[..., :, None]) & (b >= low[..., :, None])
    ch = real[..., None, :] & (b >= high[..., :, None]) & (a <= high[..., :, None])
    off = ~np.eye(low.shape[-1], dtype=bool)
    return real & ~jnp.any(cl & off, -1), real & ~jnp.any(ch & off, -1)


def open_ends(low, high):
    """Intervals that only touch are not joined: no derivative is wrong, but a seam stays."""
    at_low, _ = exposed_ends(low, high)
    return at_low, at_low


@pytest.mark.parametrize("fault", [all_ends, no_ties, open_ends])
def test_a_fault_in_the_masks_is_seen(fault, monkeypatch):
    rng = np.random.default_rng(5)
    slots = [0.2 * rng.integers(-7, 8, (2, N)) for _ in range(20)]

    def error():
        low, high = np.moveaxis(np.array(slots), 1, 0)
        totals = np.asarray(jax.jit(lambda a, b: blocked_measure(a, b))(low, high))
        truth = [np.sum(np.diff(loop(*s))) for s in slots]
        assert np.all(np.isfinite(totals))
        return np.max(np.abs(np.array(totals) - truth))

    assert error() < 1e-14
    monkeypatch.setattr(intervals, "exposed_ends", fault)
    assert error() > 1e-3


@pytest.mark.parametrize("f", [clip_intervals, visible_gaps, visible_measure])
def test_whole_numbers_are_angles(f):
    ask = inspect.unwrap(f)  # as a user has it: annotations, which are checked here, want floats
    low, high = np.array([0, 1]), np.array([1, 2])
    whole, truth = ask(low, high), ask(low * 1.0, high * 1.0)
    for a, b in zip(jax.tree.leaves(whole), jax.tree.leaves(truth), strict=True):
        np.testing.assert_array_equal(a, b)
