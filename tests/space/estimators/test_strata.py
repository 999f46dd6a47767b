import jax
import jax.numpy as jnp
import numpy as np
import pytest

from firstorder.checks.statistics import LEVEL
from firstorder.space.estimators.strata import MEASURES, hemisphere_strata
from tests.samplers import uniform_p_value


def made(*args, **options):
    """`hemisphere_strata`, compiled as a whole: operation by operation costs far more."""
    return jax.jit(lambda: hemisphere_strata(*args, **options))()


UNEVEN = (np.array([0.0, 0.3, 1.0, np.pi / 2]), 0.4 + np.array([0.0, 1.0, 2.5, 2 * np.pi]))


@pytest.mark.smoke
@pytest.mark.parametrize("measure", MEASURES)
def test_cells_cover_the_hemisphere(measure):
    for borders in ((6, 10), (1, 1), UNEVEN):
        where = made(*borders, measure=measure)
        np.testing.assert_allclose(np.sum(where.projected), np.pi, rtol=1e-14)
        np.testing.assert_allclose(np.linalg.norm(where.directions, axis=-1), 1.0, rtol=1e-14)


@pytest.mark.parametrize("measure", MEASURES)
def test_directions_lie_in_their_cells(measure):
    where = made(*UNEVEN, jax.random.key(1), measure, shape=(50,))
    theta = np.arccos(where.directions[..., 2])
    phi = np.arctan2(where.directions[..., 1], where.directions[..., 0])
    phi = where.phi[0] + np.mod(phi - where.phi[0], 2 * np.pi)
    low, high = where.theta[:-1, None], where.theta[1:, None]
    assert np.all((theta >= low - 1e-7) & (theta <= high + 1e-7))
    assert np.all((phi >= where.phi[:-1] - 1e-9) & (phi <= where.phi[1:] + 1e-9))
    assert np.std(theta[:, 1, 1]) > 0.05


def test_equal_rows_are_equal_by_their_measure():
    np.testing.assert_allclose(made(5, 4).projected, np.pi / 20, rtol=1e-12)
    solid = made(5, 4, measure="solid angle")
    np.testing.assert_allclose(solid.weights, 2 * np.pi / 20, rtol=1e-12)
    np.testing.assert_allclose(np.diff(made(5, 4, measure="angle").theta), np.pi / 10)


@pytest.mark.parametrize("measure", MEASURES)
def test_weights_are_inverse_densities(measure):
    """Means over many sets: `int w_z^2 dw = 2 pi / 3`, `int w_x^2 w_z dw = pi / 4`."""
    where = made(*UNEVEN, jax.random.key(3), measure, shape=(4000,))
    x, z = where.directions[..., 0], where.directions[..., 2]
    for f, true in ((z**2, 2 * np.pi / 3), (x**2 * z, np.pi / 4)):
        sums = np.sum(where.weights * f, (1, 2))
        error = np.std(sums) / np.sqrt(sums.size)
        assert abs(np.mean(sums) - true) < 4.5 * error
        assert error < 0.02


def test_a_fault_of_the_weights_is_noticed():
    """Uniform directions with the weights of cosine-weighted ones."""
    where = made(*UNEVEN, jax.random.key(3), "solid angle", shape=(4000,))
    wrong = where.projected / where.directions[..., 2]
    sums = np.sum(wrong * where.directions[..., 2] ** 2, (1, 2))
    assert abs(np.mean(sums) - 2 * np.pi / 3) > 20 * np.std(sums) / np.sqrt(sums.size)


@pytest.mark.parametrize("measure", MEASURES)
def test_single_precision_keeps_weights_finite_at_the_horizon(measure):
    borders = [jnp.asarray(b, jnp.float32) for b in UNEVEN]
    where = made(*borders, jax.random.key(0), measure, shape=(2000,))
    assert where.directions.dtype == where.weights.dtype == jnp.float32
    assert np.all(np.isfinite(where.weights))
    assert np.all(where.directions[..., 2] >= 0.0)


def test_counts_may_be_numbers_of_numpy():
    ours, plain = hemisphere_strata(np.int64(3), np.int32(5)), hemisphere_strata(3, 5)
    np.testing.assert_array_equal(ours.directions, plain.directions)


def test_bad_input_is_one_sentence():
    with pytest.raises(ValueError, match=r"^Argument `theta` must be a positive integer, but is 0"):
        hemisphere_strata(0, 4)
    with pytest.raises(ValueError, match=r"^Argument `phi` must be a positive integer, but is 0"):
        hemisphere_strata(4, 0)
    with pytest.raises(ValueError, match="must ascend from 0 to pi/2"):
        hemisphere_strata(np.array([0.1, 1.0]), 4)
    with pytest.raises(ValueError, match="must ascend over 2 pi"):
        hemisphere_strata(4, np.array([0.0, 1.0, 0.5]))
    with pytest.raises((ValueError, TypeError), match=r"`theta` must ascend from 0|type hint"):
        hemisphere_strata(np.array([[0.0], [0.5 * np.pi]]), 4)
    with pytest.raises((ValueError, TypeError), match=r"`theta` must be real|type hint"):
        hemisphere_strata(np.array([0.0, 0.5 + 1j, 0.5 * np.pi]), 4)
    with pytest.raises(TypeError, match=r"`key` must be a key of random numbers|type hint"):
        hemisphere_strata(4, 4, 0)
    with pytest.raises(ValueError, match="`measure` must be one of"):
        hemisphere_strata(4, 4, measure="area")
    with pytest.raises(
        ValueError, match=r"^Argument `shape` must be a positive integer, but is -1"
    ):
        hemisphere_strata(4, 4, shape=-1)


@pytest.mark.parametrize(
    ("right", "wrong"),
    [
        ((np.array([0.0, 1.0, 0.5 * np.pi]), 4), (np.array([0.0, 2.0, 0.5 * np.pi]), 4)),
        ((4, np.array([0.0, 1.0, 2.0 * np.pi])), (4, np.array([0.0, 7.0, 2.0 * np.pi]))),
        ((4, np.array([0.0, 1.0, 2.0 * np.pi])), (4, np.array([0.0, 1.0, 2.0]))),
    ],
)
def test_traced_borders_that_do_not_ascend_are_nan(right, wrong):
    """Their weights were negative, and the sum of a white sky about what it should be."""

    def weights(theta, phi):
        return hemisphere_strata(theta, phi).weights

    static = [k for k in (0, 1) if isinstance(right[k], int)]
    compiled = jax.jit(weights, static_argnums=static)
    np.testing.assert_allclose(compiled(*right), weights(*right), rtol=1e-12)
    assert np.all(np.isnan(compiled(*wrong)))


def test_one_leading_axis_may_be_a_number():
    assert hemisphere_strata(2, 4, shape=3).weights.shape == (3, 2, 4)


def heights(where, measure):
    """Where in their cells directions lie, by the rows' measure and by azimuth: (n, 2) each."""
    w = np.asarray(where.directions)
    theta, (low, high) = np.arccos(w[..., 2]), (where.theta[:-1, None], where.theta[1:, None])
    by = {"cosine": lambda a: np.sin(a) ** 2, "solid angle": np.cos, "angle": lambda a: a}[measure]
    up = (by(theta) - by(low)) / (by(high) - by(low))
    phi = where.phi[0] + np.mod(np.arctan2(w[..., 1], w[..., 0]) - where.phi[0], 2 * np.pi)
    return np.stack([up, (phi - where.phi[:-1]) / np.diff(where.phi)], -1)


@pytest.mark.parametrize("measure", MEASURES)
def test_directions_in_a_cell_follow_its_measure(measure):
    """Of all cells: uneven rows and columns too."""
    where = made(*UNEVEN, jax.random.key(4), measure, shape=(4000,))
    places = heights(where, measure).reshape(4000, -1, 2)
    worst = min(uniform_p_value(np.clip(places[:, k], 0, 1)) for k in range(places.shape[1]))
    assert worst > LEVEL / places.shape[1]
    other = heights(where, MEASURES[MEASURES.index(measure) - 1])
    assert min(uniform_p_value(other[:, row, 0]) for row in range(3)) < LEVEL
