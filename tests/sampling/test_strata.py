import jax
import jax.numpy as jnp
import numpy as np
import pytest

from firstorder.checks.statistics import LEVEL, error_slope, sampler_p_value
from firstorder.sampling import jittered, midpoints

COUNTS = (8, 32, 128, 512)


def rms_error(f, truth, count, key, runs=200):
    mean = jax.vmap(lambda k: jnp.mean(f(jittered(k, count))))(jax.random.split(key, runs))
    return float(jnp.sqrt(jnp.mean((mean - truth) ** 2)))


def test_one_number_in_each_stratum(key):
    for count in (1, 7, 64):
        u = np.asarray(jittered(key, count))
        assert np.floor(u * count).astype(int).tolist() == list(range(count))
    assert midpoints(2).tolist() == [0.25, 0.75]


def test_all_together_are_uniform(key):
    u = jax.vmap(lambda k: jittered(k, 5))(jax.random.split(key, 4000))
    # Strata make the counts more even than chance would: compare one stratum alone.
    assert sampler_p_value(5.0 * u[:, 2] - 2.0, np.ones_like, 0.0, 1.0) > LEVEL


@pytest.mark.parametrize(
    ("f", "truth", "order"),
    [
        (lambda u: jnp.exp(u), np.e - 1.0, -1.5),
        (lambda u: (u > 0.437).astype(float), 1.0 - 0.437, -1.0),
    ],
)
def test_the_error_falls_as_it_says(f, truth, order, key):
    slope = error_slope(COUNTS, [rms_error(f, truth, n, key) for n in COUNTS])
    assert abs(slope.slope - order) < 0.15


def test_no_strata_are_refused():
    with pytest.raises(ValueError, match="must be positive, but is 0"):
        midpoints(0)


def test_a_seed_is_no_key():
    words = (
        r"^Argument `key` must be a key of random numbers, but is an int: write jax\.random\.key"
    )
    with pytest.raises(TypeError, match=f"{words}|violates type hint"):
        jittered(0, 3)


def test_single_precision_stays_in_its_strata(key):
    """The sum of a number and of that of its stratum may be rounded up to the next stratum."""
    count = 1 << 20
    with jax.enable_x64(False):
        u = np.asarray(jittered(key, count), float)
    assert np.floor(u * count).astype(int).tolist() == list(range(count))
