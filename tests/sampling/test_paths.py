"""Random paths without a world: a line of vertices at which a path gathers one and goes on."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from firstorder.checks.statistics import LEVEL, chi_square, z_test
from firstorder.sampling._paths import (
    ANY,
    Gathered,
    check_many,
    path_lengths,
    roulette,
    survival_chance,
    walk,
)

SHARE = 0.7


def on_a_line(length, rows=3, paths=4000, lanes=50):
    """Every vertex brings one, and reflects a share: the sum of a geometric series."""
    first = jnp.arange(float(rows))

    def advance(vertex, weight, depth, u):
        chance = survival_chance(jnp.full_like(weight, SHARE), depth, length)
        on, heavier, _ = roulette(u[:, 0], chance)
        later = jnp.where(depth == 0, 1.0, SHARE) * weight * heavier
        on = on & (depth < length.bounces)
        return Gathered(vertex, later, weight * jnp.ones_like(vertex), on)

    key = jax.random.key(4)
    return jax.jit(lambda n: walk(first, key, n, lanes, 1, advance))(paths)


def test_a_given_number_of_reflections_has_no_variance():
    mean, error = on_a_line(path_lengths(3, 0.95))
    np.testing.assert_allclose(mean, 1.0 + (1.0 + SHARE + SHARE**2), rtol=1e-12)
    assert float(jnp.max(error)) < 1e-12


@pytest.mark.parametrize("paths", [7, 8, 9])
def test_as_many_paths_count_as_are_asked_for(paths):
    """Each brings one or nothing, so that they sum to a whole number; of four lanes."""

    def advance(vertex, weight, depth, u):
        return Gathered(vertex, weight, jnp.where(u[:, 0] < 0.5, weight, 0.0), depth < 0)

    mean, _ = walk(jnp.arange(50.0), jax.random.key(1), jnp.asarray(paths), 4, 1, advance)
    summed = np.asarray(mean) * paths
    np.testing.assert_allclose(summed, np.round(summed), rtol=0.0, atol=1e-12)
    assert set(np.round(summed) % 2) == {0.0, 1.0}


@pytest.mark.parametrize("survival", [0.3, 0.95])
@pytest.mark.parametrize("paths", [4000, 4033])
def test_roulette_is_unbiased(survival, paths):
    """1 + 1 / (1 - s), whatever the chance; paths need not fill their lanes."""
    mean, error = on_a_line(path_lengths(None, survival), paths=paths)
    assert z_test(mean, error, 1.0 + 1.0 / (1.0 - SHARE)).passed


def test_a_number_that_survives_is_uniform_anew():
    u = (jnp.arange(1000) + 0.5) / 1000
    on, weight, again = roulette(u, jnp.full(1000, 0.4))
    np.testing.assert_allclose(jnp.sum(on), 400)
    np.testing.assert_allclose(weight, 2.5)
    np.testing.assert_allclose(np.sort(again[on]), (np.arange(400) + 0.5) / 400, rtol=1e-12)
    assert not bool(jnp.any(roulette(u, jnp.zeros(1000))[0]))


def test_paths_of_a_given_length_are_followed_to_their_end():
    total, depth = jnp.full(3, 0.2), jnp.arange(3)
    assert survival_chance(total, depth, path_lengths(5, 0.9)).tolist() == [1.0, 1.0, 1.0]
    np.testing.assert_allclose(
        survival_chance(total, depth, path_lengths(None, 0.9)), [1.0, 0.2, 0.2]
    )
    assert int(path_lengths(None, 0.9).bounces) == ANY


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: path_lengths(-1, 0.9), "`bounces` must not be negative, but is -1"),
        (lambda: path_lengths(None, 1.0), "`survival`"),
        (lambda: check_many("paths", 1), "`paths` must be at least 2, but is 1"),
    ],
)
def test_bad_input_is_one_sentence(make, words):
    with pytest.raises(ValueError, match=words):
        make()


@jax.jit
def _rolled(u, depth, length):
    return roulette(u, survival_chance(jnp.full_like(u, SHARE), depth, length))


def lengths(survival, count=30_000, most=12):
    """How many of many paths end after 0, 1, 2, ... steps; the last ones are longer.

    The number that is left of one step decides about the next: it must be uniform anew.
    """
    u = np.random.default_rng(5).random(count)
    alive, left = np.ones(count, bool), [count]
    for depth in range(most):
        on, _, again = _rolled(u, depth, path_lengths(None, survival))
        alive, u = alive & np.asarray(on), np.asarray(again)
        left.append(int(alive.sum()))
    return [*-np.diff(left), left[-1]]


def geometric(chance, count, most=12):
    """The same by theory: the first step is always taken."""
    law = np.append(0.0, (1.0 - chance) * chance ** np.arange(most - 1))
    return count * np.append(law, 1.0 - law.sum())


@pytest.mark.parametrize("survival", [0.5, 0.95])
def test_paths_are_as_long_as_their_chance_says(survival):
    seen, chance = lengths(survival), min(SHARE, survival)
    assert chi_square(seen, geometric(chance, sum(seen))) > LEVEL
    assert chi_square(seen, geometric(chance + 0.02, sum(seen))) < LEVEL
