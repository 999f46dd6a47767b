import jax
import jax.numpy as jnp
import mpmath
import numpy as np
import pytest

from firstorder.checks.statistics import LEVEL, chi_square, sampler_p_value
from firstorder.sampling import (
    CosineDirections,
    CosinePowerLobe,
    Discrete,
    PiecewiseConstant,
    UniformDirections,
)
from firstorder.sampling._distributions import lobe_area

H = 0.5 * np.pi
COUNT = 40_000
SKY = PiecewiseConstant(np.array([0.2, 0.0, 3.0, 1.0, 0.5]), -np.pi, np.pi)
LOBES = [
    CosinePowerLobe(e, c)
    for e, c in ((0.0, 0.0), (0.7, 0.0), (1.0, 0.3), (5.0, -0.4), (300.0, 0.2))
]


def one(sampler, u):
    return (
        sampler.sample(u[0], u[1]) if isinstance(sampler, CosinePowerLobe) else sampler.sample(u[0])
    )


def span(sampler):
    if isinstance(sampler, PiecewiseConstant):
        return -np.pi, np.pi
    center = float(sampler.center) if isinstance(sampler, CosinePowerLobe) else 0.0
    return center - H, center + H


@pytest.fixture
def numbers(key):
    return jax.random.uniform(key, (2, COUNT))


@pytest.mark.smoke
@pytest.mark.parametrize("sampler", [UniformDirections(), CosineDirections(), SKY, *LOBES])
def test_samples_follow_the_density(sampler, numbers):
    drawn = one(sampler, numbers)
    # Bins that the steps of the sky's density do not cut.
    assert sampler_p_value(drawn, sampler.density, *span(sampler), bins=60, nodes=24) > LEVEL


@pytest.mark.parametrize(
    ("sampler", "fault"),
    [
        (UniformDirections(), lambda a: 0.5 * np.cos(a)),
        (CosineDirections(), lambda a: np.full_like(a, 1.0 / np.pi)),
        (CosineDirections(), lambda a: np.cos(a) / np.pi),  # the constant of space
        (CosinePowerLobe(5.0, 0.3), CosinePowerLobe(6.0, 0.3).density),
        (CosinePowerLobe(5.0, 0.3), CosinePowerLobe(5.0, -0.3).density),
        (CosinePowerLobe(5.0, 0.3), lambda a: 2.0 * CosinePowerLobe(5.0, 0.3).density(a)),
        (SKY, PiecewiseConstant(SKY.weights[::-1], -np.pi, np.pi).density),
    ],
)
def test_a_wrong_density_is_noticed(sampler, fault, numbers):
    low, high = span(sampler)
    assert sampler_p_value(one(sampler, numbers), fault, low, high, bins=60, nodes=24) < LEVEL


def test_picks_come_by_weight(numbers):
    weights = np.array([0.0, 2.0, 1.0, 0.0, 4.0, 0.0])
    index, rest = Discrete(weights).sample(numbers[0])
    counts = np.bincount(np.asarray(index), minlength=6)
    assert counts[[0, 3, 5]].sum() == 0
    assert chi_square(counts, COUNT * weights / weights.sum()) > LEVEL
    # What is left of the number is uniform, and independent of the pick.
    span = ((-0.5, 5.5), (0.0, 1.0))
    inside = np.histogram2d(np.asarray(index), np.asarray(rest), bins=(6, 10), range=span)[0]
    expected = np.outer(COUNT * weights / weights.sum(), np.full(10, 0.1))
    assert chi_square(inside, expected) > LEVEL
    assert chi_square(counts, COUNT * weights[[1, 0, 2, 3, 4, 5]] / weights.sum()) < LEVEL


def test_the_edges_of_the_unit_interval_pick_something_positive():
    pick = Discrete(jnp.array([0.0, 1.0, 0.0]))
    index, rest = pick.sample(jnp.array([0.0, 1.0 - 1e-16, 1.0]))
    assert index.tolist() == [1, 1, 1]
    assert bool(jnp.all((rest >= 0.0) & (rest < 1.0)))
    nothing = Discrete(jnp.zeros(3)).sample(jnp.array([0.3]))
    assert bool(jnp.all(jnp.isfinite(nothing[1])))


def test_among_many_what_has_no_weight_is_never_taken():
    """Sums of thousands in single precision once rose by a rounding where nothing was added."""
    rng = np.random.default_rng(3)
    weights = (rng.random(30_000) * (rng.random(30_000) < 0.5)).astype(np.float32)
    pick = Discrete(weights)
    ends = np.asarray(jnp.cumsum(pick.probability))
    index, _ = pick.sample(np.concatenate([ends, np.nextafter(ends, np.float32(0.0))]))
    assert np.all(weights[np.asarray(index)] > 0.0)


@pytest.mark.parametrize("e", [0.0, 0.5, 1.0, 2.0, 17.0])
def test_the_area_of_a_lobe_is_its_integral(e):
    t, w = np.polynomial.legendre.leggauss(400)
    truth = np.sum(w * H * np.cos(H * t) ** e)
    # The end of cos^0.5 limits the quadrature.
    assert abs(float(lobe_area(jnp.array(e))) / truth - 1.0) < (1e-6 if e == 0.5 else 1e-12)


@pytest.mark.parametrize("sampler", [UniformDirections(), CosineDirections(), LOBES[2]])
def test_single_precision_stays_single(sampler):
    sampler = jax.tree.map(lambda a: a.astype(jnp.float32), sampler)
    a = one(sampler, jnp.array([[0.3, 0.9], [0.2, 0.6]], jnp.float32))
    assert a.dtype == sampler.density(a).dtype == jnp.float32


def test_bad_arguments_are_one_sentence():
    with pytest.raises(ValueError, match=r"^Argument `exponent` must not be negative, but is -1.0"):
        CosinePowerLobe(-1.0)
    with pytest.raises(ValueError, match=r"^Argument `weights` must not be negative, but is -1.0"):
        Discrete([1.0, -1.0])


def test_traced_weights_that_are_negative_give_nan():
    found = jax.jit(lambda w: (Discrete(w).probability, Discrete(w).sample(0.5)[1]))
    for part in found(jnp.array([1.0, -0.25, 2.0])):
        assert np.all(np.isnan(part))
    for part in found(jnp.array([1.0, 0.25, 2.0])):
        assert np.all(np.isfinite(part))


def test_of_weights_that_are_all_zero_the_first_is_taken():
    pick = Discrete([0.0, 0.0, 0.0])
    index, _ = pick.sample(jnp.array([0.0, 0.3, 0.9]))
    assert index.tolist() == [0, 0, 0]
    assert pick.probability[0].item() == 0.0


@pytest.mark.parametrize("e", [0.0, 0.5, 15.9, 16.1, 1e3, 1e4, 1e6])
def test_sharp_lobes_are_normalised_in_single_precision(e):
    """Against the beta function: `B(e / 2 + 1 / 2, 1 / 2)`."""
    with jax.enable_x64(False):
        single = lobe_area(jnp.asarray(e, jnp.float32)).item()
    wanted = float(mpmath.beta(0.5 * e + 0.5, 0.5))
    np.testing.assert_allclose(single, wanted, rtol=2e-6)
    np.testing.assert_allclose(lobe_area(jnp.asarray(e)), wanted, rtol=1e-12)


@pytest.mark.parametrize("e", [0.5, 40.0, 1e3])
def test_areas_of_lobes_have_two_derivatives(e):
    def area(e):
        return mpmath.beta(e / 2 + 0.5, 0.5)

    for order, f in ((1, jax.grad(lobe_area)), (2, jax.grad(jax.grad(lobe_area)))):
        wanted = float(mpmath.diff(area, e, order))
        np.testing.assert_allclose(f(jnp.asarray(e)), wanted, rtol=1e-9)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (([1.0, 3.0], 2.0, 0.0), "`high` must be more than 2, but is 0"),
        (([1.0, 3.0], 2.0, 2.0), "`high` must be more than 2, but is 2"),
        (([-1.0, 3.0], 0.0, 2.0), "`weights` must not be negative"),
        (([1.0, 3.0], np.nan, 2.0), "`low` must be finite"),
    ],
)
def test_an_interval_that_runs_backwards_is_refused(arguments, words):
    """Its density was once negative."""
    weights, low, high = arguments
    with pytest.raises(ValueError, match=words):
        PiecewiseConstant(np.array(weights), low, high)


@pytest.mark.parametrize("unit", [1.0, 1e-200, 1e-307, 1e200, 3e305, 5e307])
def test_a_choice_does_not_depend_on_the_unit_of_its_weights(unit):
    """The sum of the largest and the square of the smallest leave the range."""
    weights = unit * np.tile([1.0, 3.0, 0.0, 2.0], 64) / 3.0
    pick = Discrete(weights)
    wanted = np.tile([1.0, 3.0, 0.0, 2.0], 64) / 384
    np.testing.assert_allclose(pick.probability, wanted, rtol=1e-12)
    assert int(pick.sample(1.5 / 384)[0]) == 1


@pytest.mark.parametrize("unit", [1e-170, 1.0, 1e200])
def test_probabilities_have_derivatives_in_any_unit(unit):
    slope = jax.grad(lambda w: Discrete(w).probability[0])(unit * jnp.array([1.0, 3.0]))
    np.testing.assert_allclose(slope * unit, [3.0 / 16.0, -1.0 / 16.0], rtol=1e-12)


@pytest.mark.parametrize("weights", [np.zeros(0), np.ones((2, 2))])
def test_what_is_no_row_of_weights_is_refused(weights):
    words = "^Argument `weights` must be a row of numbers"
    with pytest.raises(ValueError, match=words):
        Discrete(weights)
    with pytest.raises(ValueError, match=words):
        PiecewiseConstant(weights, 0.0, 1.0)


def test_a_density_that_is_zero_everywhere_is_none_at_its_own_samples():
    none = PiecewiseConstant(np.zeros(4), 0.0, 2.0)
    x = none.sample(jnp.array([0.0, 0.5]))
    assert x.tolist() == [0.0, 0.25]
    assert none.density(x).tolist() == [0.0, 0.0]


def test_traced_arguments_outside_their_range_give_nan():
    def lobe(e):
        return CosinePowerLobe(e).density(0.3), CosinePowerLobe(e).sample(0.3, 0.4)

    def pieces(low):
        even = PiecewiseConstant([1.0, 2.0], low, 1.0)
        return even.density(0.5), even.density(3.0), even.sample(0.4)

    for made, wrong, right in ((lobe, -0.5, 0.5), (pieces, 2.0, 0.0)):
        assert np.all(np.isnan(jax.jit(made)(wrong)))
        assert np.all(np.isfinite(jax.jit(made)(right)))


def test_an_interval_has_one_start_and_one_end():
    for name, ends in (("low", ([0.0, 0.5], 1.0)), ("high", (0.0, [0.5, 1.0]))):
        words = rf"^Argument `{name}` must be one number, but has shape \(2,\)|violates type hint"
        with pytest.raises((ValueError, TypeError), match=words):
            PiecewiseConstant([1.0, 2.0], *ends)


@pytest.mark.parametrize("exponent", [1e5, 1e7, 1e9])
def test_a_sharp_lobe_keeps_its_digits_in_single_precision(exponent):
    u, v = np.random.default_rng(0).uniform(size=(2, 200)).astype(np.float32)
    sharp, truth = (
        CosinePowerLobe(np.asarray(exponent, t), np.asarray(0.0, t)) for t in (np.float32, float)
    )
    ours, wide = sharp.sample(u, v), truth.sample(u.astype(float), v.astype(float))
    assert ours.dtype == np.float32
    np.testing.assert_allclose(ours * exponent**0.5, wide * exponent**0.5, rtol=0.0, atol=1e-5)
    a = np.float32(2.0 * exponent**-0.5)
    np.testing.assert_allclose(sharp.density(a), truth.density(float(a)), rtol=1e-5)
