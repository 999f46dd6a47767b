"""Weights of records by hand, near, far and on one of them."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from firstorder.caching._records import checked_order, distance, kept, turning, weights

ALL = jnp.ones(3, bool)


def shares(error, valid=ALL, fade=False):
    found = weights(jnp.asarray(error), valid, fade)
    return np.asarray(found.weight / found.weight.sum()), found


@pytest.mark.parametrize(
    ("fade", "wanted"), [(False, np.array([4.0, 2.0, 0.0])), (True, np.array([3.0, 1.0, 0.0]))]
)
def test_in_reach_it_is_one_over_the_error(fade, wanted):
    share, found = shares([0.25, 0.5, 1.5], fade=fade)
    np.testing.assert_allclose(share, wanted / wanted.sum(), rtol=1e-14)
    assert found.used.tolist() == [True, True, False]
    assert found.covered


def test_out_of_reach_the_nearest_counts_alone():
    for fade in (False, True):
        share, found = shares([1.5, 3.0, 2.0], fade=fade)
        assert share.tolist() == [1.0, 0.0, 0.0]
        assert not found.covered


def test_on_a_record_it_counts_alone_and_slopes_are_finite():
    share, _ = shares([0.0, 0.5, 0.5])
    np.testing.assert_allclose(share, [1.0, 0.0, 0.0], rtol=0.0, atol=1e-15)
    slope = jax.jacobian(lambda e: weights(e, ALL).weight)(jnp.array([0.0, 0.5, 3.0]))
    assert np.all(np.isfinite(slope))


def test_what_is_no_record_does_not_count():
    share, found = shares([0.1, 0.5, 2.0], jnp.array([False, True, True]))
    assert share.tolist() == [0.0, 1.0, 0.0]
    assert found.used.tolist() == [False, True, False]


def test_steps_and_turns_in_a_plane_are_measured_by_their_lengths():
    rng = np.random.default_rng(1)
    matrix, step = rng.normal(size=(3, 2, 2)), rng.normal(size=(3, 2))
    found = distance(jnp.asarray(matrix), jnp.asarray(step))
    truth = np.linalg.norm(np.einsum("rab,rb->ra", matrix, step), axis=1)
    np.testing.assert_allclose(found, truth, rtol=1e-14)
    turn = jnp.array([[0.3, 0.4], [-0.6, 0.8], [3.0, -4.0]])
    np.testing.assert_allclose(turning(turn), [np.sin(0.5), np.sin(1.0), 1.0], rtol=1e-14)
    for measured in (lambda x: distance(jnp.asarray(matrix), x), turning):
        assert not np.any(jax.jacobian(measured)(jnp.zeros((3, 2))))


def test_along_a_line_a_normal_may_go_around():
    turn = jnp.array([[0.3], [-0.5], [2.0], [-3.5], [2.0 * np.pi - 0.3], [-2.0 * np.pi]])
    wanted = [np.sin(0.3), np.sin(0.5), 1.0, 1.0, np.sin(0.3), 0.0]
    np.testing.assert_allclose(turning(turn), wanted, rtol=0.0, atol=1e-15)


def test_all_candidates_are_chosen_if_none_are_named():
    assert kept(None, 3).tolist() == [0, 1, 2]
    assert kept(np.array([False, True, True]), 3).tolist() == [1, 2]


@pytest.mark.parametrize("order", [3, -1])
def test_an_order_is_0_1_or_2(order):
    with pytest.raises(ValueError, match="Argument `order` must be 0, 1 or 2"):
        checked_order(order)
