import jax
import jax.numpy as jnp
import numpy as np
import pytest

from firstorder.flatland.skies import ConstantSky, GaussianSky, PanoramaSky

SEED = np.random.default_rng(7)
ROW = SEED.uniform(0.0, 3.0, 12)
SKIES = {
    "constant": ConstantSky(0.7),
    "gaussian": GaussianSky(0.4, 0.8, 1.3),
    "lines": PanoramaSky(ROW),
    "cubics": PanoramaSky(ROW, smooth=True),
}


@pytest.mark.smoke
@pytest.mark.parametrize("name", SKIES)
def test_a_full_turn_changes_nothing(name):
    a = SEED.uniform(-3.0, 3.0, 50)
    for turns in (-1, 1, 3):
        np.testing.assert_allclose(
            SKIES[name](a + 2 * np.pi * turns), SKIES[name](a), rtol=0.0, atol=1e-13
        )


@pytest.mark.parametrize("name", SKIES)
@pytest.mark.parametrize("dtype", ["float32", "float64"])
def test_values_and_slopes_are_finite_and_keep_their_precision(name, dtype):
    sky = jax.tree.map(lambda x: x.astype(dtype), SKIES[name])
    a = jnp.linspace(-4.0, 4.0, 33, dtype=dtype)
    value, slope = jax.vmap(jax.value_and_grad(lambda x: sky(x)))(a)
    assert value.dtype == slope.dtype == dtype
    assert np.all(np.isfinite(value))
    assert np.all(np.isfinite(slope))


@pytest.mark.parametrize("smooth", [False, True])
def test_a_row_passes_through_its_values_and_keeps_its_mean(smooth):
    sky = PanoramaSky(ROW, smooth)
    np.testing.assert_allclose(sky(sky.breaks), ROW, rtol=0.0, atol=1e-13)
    # Gauss-Legendre of three nodes is exact for the cubics between two columns.
    t, w = np.polynomial.legendre.leggauss(3)
    step = 2 * np.pi / ROW.size
    nodes = np.asarray(sky.breaks)[:, None] - step * (t + 1) / 2
    mean = np.sum(w / 2 * np.asarray(sky(nodes))) / ROW.size
    np.testing.assert_allclose(mean, ROW.mean(), rtol=1e-14)


def test_the_middle_of_the_row_is_up_and_its_right_is_plus_x():
    row = np.zeros(64)
    row[47:49] = 1.0  # three quarters along
    assert PanoramaSky(row)(-0.5 * np.pi) > 0.9  # direction(-pi/2) = (1, 0)
    assert PanoramaSky(row)(0.5 * np.pi) == 0.0


def test_slopes_break_at_the_columns_only():
    for smooth, order in ((False, 1), (True, 2)):
        sky = PanoramaSky(ROW, smooth)
        derived = sky
        for _ in range(order):
            derived = jax.grad(derived)
        h = 1e-7
        at = np.asarray(sky.breaks)
        jump = np.abs(jax.vmap(derived)(at + h) - jax.vmap(derived)(at - h))
        step = 2 * np.pi / ROW.size
        between = np.abs(
            jax.vmap(derived)(at + step / 3 + h) - jax.vmap(derived)(at + step / 3 - h)
        )
        assert jump.min() > 1e-2
        assert between.max() < 1e-4
        lower = sky if order == 1 else jax.grad(sky)
        steps = np.abs(jax.vmap(lower)(at + h) - jax.vmap(lower)(at - h))
        assert steps.max() < 1e-4


def test_a_gaussian_is_one_and_its_sum_goes_around():
    sky = GaussianSky(0.0, 0.5)
    a = np.linspace(-1.5, 1.5, 31)
    np.testing.assert_allclose(sky(a), np.exp(-2 * a**2), rtol=1e-13)
    # the mean of a wrapped Gaussian is the area of the unwrapped one over 2 pi
    around = np.linspace(-np.pi, np.pi, 257)[:-1]
    for sigma in (0.5, 1.0, 2.0):
        mean = np.mean(GaussianSky(0.3, sigma, 2.0)(around))
        np.testing.assert_allclose(mean, 2 * sigma / np.sqrt(2 * np.pi), rtol=1e-6)


def test_a_coarser_row_has_the_same_mean_and_the_averages_of_its_columns():
    sky = PanoramaSky(ROW)
    np.testing.assert_allclose(sky.coarser(4).values, ROW.reshape(4, 3).mean(1), rtol=1e-13)
    for columns in (5, 7, 12):
        np.testing.assert_allclose(sky.coarser(columns).values.mean(), ROW.mean(), rtol=1e-13)
    np.testing.assert_allclose(sky.coarser(12).values, ROW, rtol=1e-13)


def test_every_number_is_a_leaf_with_a_slope():
    def light(values, center):
        return PanoramaSky(values)(0.3) + GaussianSky(center)(0.3)

    values, center = jax.grad(light, (0, 1))(jnp.asarray(ROW), jnp.asarray(0.1))
    assert np.count_nonzero(values) == 2
    np.testing.assert_allclose(values.sum(), 1.0, rtol=1e-14)
    np.testing.assert_allclose(center, 0.8 * np.exp(-0.08), rtol=1e-12)


@pytest.mark.parametrize(
    ("make", "sentence"),
    [
        (lambda: ConstantSky(-1.0), "Argument `radiance` must not be negative, but is -1.0."),
        (lambda: GaussianSky(0.0, 0.0), "Argument `sigma` must be positive, but is 0.0."),
        (
            lambda: PanoramaSky([1.0, 2.0]),
            "Argument `values` must be four or more numbers, but has (2,).",
        ),
        (
            lambda: PanoramaSky([1.0, 2.0, np.nan, 1.0]),
            "Argument `values` must be finite, but is nan.",
        ),
        (
            lambda: PanoramaSky([1.0, 2.0, -0.5, 1.0]),
            "Argument `values` must not be negative, but is -0.5.",
        ),
        (lambda: PanoramaSky(ROW).coarser(3), "Argument `columns` must lie in [4, 12], but is 3."),
    ],
)
def test_a_bad_sky_is_one_sentence(make, sentence):
    with pytest.raises(ValueError, match="Argument") as caught:
        make()
    assert str(caught.value) == sentence


@pytest.mark.parametrize(
    "sky",
    [
        ConstantSky,
        lambda L: GaussianSky(0.0, 0.5, L),
        lambda sigma: GaussianSky(0.0, sigma),
    ],
)
def test_a_traced_number_that_makes_no_sky_is_no_light(sky):
    L = jax.jit(lambda x: sky(x)(0.3))
    assert np.isnan(L(-0.5))
    assert L(0.5) > 0.0


def test_a_dark_part_stays_dark_in_fewer_columns():
    """Differences of sums round to less than nothing."""
    values = np.where(np.arange(1000) % 7 < 2, np.random.default_rng(0).random(1000), 0.0)
    values[300:700] = 0.0
    for columns in (7, 11, 333, 999):
        assert np.min(PanoramaSky(values).coarser(columns).values) >= 0.0
