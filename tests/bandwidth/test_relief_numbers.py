"""Numbers of reliefs, against their heights sampled densely."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from derivations.bandwidth._relief_space_rays import Cosines, cell
from firstorder.bandwidth import Relief, flat_shape_error


def test_waves_have_the_numbers_of_their_samples():
    a, f = 0.02, 4.0
    x = np.arange(64) / (64 * f)
    ours, found = Relief.waves(a, f), Relief.of(a * np.sin(2.0 * np.pi * f * x), 1.0 / f)
    for name in ("height", "slope", "curvature"):
        over = float(getattr(found, name) / getattr(ours, name))
        assert 1.0 <= over < 1.02
    for name in ("rms_height", "rms_slope", "frequency"):
        np.testing.assert_allclose(getattr(found, name), getattr(ours, name), rtol=1e-12)
    assert np.isposinf(found.frequency_across)
    assert ours.balanced
    assert not found.balanced


@pytest.mark.smoke
@pytest.mark.parametrize("shape", [(16, 12), (15, 9)])
def test_numbers_of_samples_bound_those_between_them(shape):
    """Harmonics up to the highest that the samples tell: its maxima lie between them."""
    rng, sides = np.random.default_rng(3), np.array([0.5, 0.2])
    for _ in range(20):
        most = (np.array(shape) - 1) // 2
        k = rng.integers(-most, most + 1, (4, 2)) / sides
        relief = Cosines(k, rng.uniform(-1.0, 1.0, 4), rng.uniform(0.0, 6.0, 4))
        places = np.stack(
            np.meshgrid(
                *(np.arange(n) * s / n for n, s in zip(shape, sides, strict=True)), indexing="ij"
            ),
            -1,
        )
        found = Relief.of(relief.height(places), sides)
        fine = cell(np.diag(sides), 240)
        mean = np.mean(relief.height(fine))
        true = relief.numbers(fine)
        true = (
            np.abs(relief.height(fine) - mean).max(),
            *true[1:3],
            np.std(relief.height(fine)),
            true[4],
        )
        ours = (found.height, found.slope, found.curvature, found.rms_height, found.rms_slope)
        np.testing.assert_allclose(ours[3:], true[3:], rtol=1e-9)
        over = np.array(ours[:3]) / np.array(true[:3])
        assert np.all(over >= 1.0)
        assert np.all(over < 1.05)
        assert (found.frequency, found.frequency_across) == (2.0, 5.0)


def test_the_highest_wave_of_an_even_count_is_a_cosine():
    found = Relief.of(np.array([1.0, -1.0] * 4), 1.0)
    np.testing.assert_allclose(found.rms_height, np.sqrt(0.5), rtol=1e-12)
    np.testing.assert_allclose(found.rms_slope, 8.0 * np.pi * np.sqrt(0.5), rtol=1e-12)


def test_what_nobody_says_is_the_most_that_it_can_be():
    relief = Relief(0.1, 0.2, 3.0)
    assert (relief.rms_height, relief.rms_slope) == (0.1, 0.2)
    assert (relief.frequency, relief.frequency_across) == (0.0, np.inf)


@pytest.mark.parametrize(
    ("words", "call"),
    [
        ("`height` must not be negative", lambda: Relief(-0.1, 0.2, 3.0)),
        ("`slope` must not be negative", lambda: Relief(0.1, -0.2, 3.0)),
        ("`curvature` must not be negative", lambda: Relief(0.1, 0.2, np.nan)),
        ("`frequency` must not be negative", lambda: Relief(0.1, 0.2, 3.0, -1.0)),
        ("`frequency_across` must be positive", lambda: Relief(0.1, 0.2, 3.0, 1.0, 0.0)),
        ("`frequency_across` must be positive", lambda: Relief(0.1, 0.2, 3.0, 1.0, np.nan)),
        ("`frequency_across` must be positive", lambda: Relief(0.1, 0.2, 3.0, 1.0, -np.inf)),
        ("`rms_height` must not be", lambda: Relief(0.1, 0.2, 3.0, rms_height=-1.0)),
        ("`rms_slope` must not be", lambda: Relief(0.1, 0.2, 3.0, rms_slope=-1.0)),
        ("`frequency` must be positive", lambda: Relief.waves(0.1, 0.0)),
        ("`amplitude` must not be negative", lambda: Relief.waves(-0.1, 1.0)),
        ("`heights` must have one axis or two", lambda: Relief.of(np.zeros((2, 2, 2)), 1.0)),
        ("`heights` must hold samples", lambda: Relief.of(np.zeros(0), 1.0)),
        ("`heights` must be finite", lambda: Relief.of(np.array([0.1, np.nan]), 1.0)),
        ("`heights` must be real", lambda: Relief.of(np.array([0.1, 1j]), 1.0)),
        ("`periods` must have shape", lambda: Relief.of(np.zeros((8, 8)), 1.0)),
        ("`periods` must be positive", lambda: Relief.of(np.zeros(8), 0.0)),
    ],
)
def test_what_is_no_relief_is_one_sentence(words, call):
    with pytest.raises(ValueError, match=f"Argument {words}"):
        call()


@pytest.mark.parametrize(
    "made",
    [
        lambda s: Relief(s, 0.1, 1.0),
        lambda s: Relief(0.1, s, 1.0),
        lambda s: Relief(0.1, 0.1, s),
        lambda s: Relief(0.1, 0.1, 1.0, s),
        lambda s: Relief(0.1, 0.1, 1.0, 1.0, s),
        lambda s: Relief(0.1, 0.1, 1.0, rms_height=s),
        lambda s: Relief(0.1, 0.1, 1.0, rms_slope=s),
        lambda s: Relief.waves(s, 1.0),
        lambda s: Relief.waves(0.1, s),
        lambda s: Relief.of(jnp.arange(8.0), s),
    ],
)
def test_traced_numbers_of_no_relief_make_bounds_nan(made):
    bound = jax.jit(lambda s: flat_shape_error(made(s), 1e-3, 1e-3, view=0.1, reach=0.1))
    assert jnp.isnan(bound(-1.0))
    assert jnp.isfinite(bound(0.1))


@pytest.mark.parametrize("shape", [(8,), (4, 6)])
def test_numbers_of_what_is_flat_have_finite_gradients(shape):
    def numbers(heights):
        found = Relief.of(heights, np.ones(len(shape)))
        return found.height + found.slope + found.curvature + found.rms_height + found.rms_slope

    assert np.all(np.isfinite(jax.jit(jax.grad(numbers))(jnp.zeros(shape))))
