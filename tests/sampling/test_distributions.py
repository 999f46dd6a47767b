import jax
import jax.numpy as jnp
import numpy as np
import pytest

from firstorder.checks.statistics import LEVEL, chi_square, sampler_p
from firstorder.sampling import Cosine, Lobe, Pick, Piecewise, Uniform
from firstorder.sampling.distributions import lobe_area

H = 0.5 * np.pi
COUNT = 40_000
SKY = Piecewise(np.array([0.2, 0.0, 3.0, 1.0, 0.5]), -np.pi, np.pi)
LOBES = [Lobe(e, c) for e, c in ((0.0, 0.0), (0.7, 0.0), (1.0, 0.3), (5.0, -0.4), (300.0, 0.2))]


def one(sampler, u):
    return sampler.sample(u[0], u[1]) if isinstance(sampler, Lobe) else sampler.sample(u[0])


def span(sampler):
    if isinstance(sampler, Piecewise):
        return -np.pi, np.pi
    center = float(sampler.center) if isinstance(sampler, Lobe) else 0.0
    return center - H, center + H


@pytest.fixture
def numbers(key):
    return jax.random.uniform(key, (2, COUNT))


@pytest.mark.smoke
@pytest.mark.parametrize("sampler", [Uniform(), Cosine(), SKY, *LOBES])
def test_samples_follow_the_density(sampler, numbers):
    drawn = one(sampler, numbers)
    # Bins that the steps of the sky's density do not cut.
    assert sampler_p(drawn, sampler.density, *span(sampler), bins=60, nodes=24) > LEVEL


@pytest.mark.parametrize(
    ("sampler", "fault"),
    [
        (Uniform(), lambda a: 0.5 * np.cos(a)),
        (Cosine(), lambda a: np.full_like(a, 1.0 / np.pi)),
        (Cosine(), lambda a: np.cos(a) / np.pi),  # the constant of space
        (Lobe(5.0, 0.3), Lobe(6.0, 0.3).density),
        (Lobe(5.0, 0.3), Lobe(5.0, -0.3).density),
        (Lobe(5.0, 0.3), lambda a: 2.0 * Lobe(5.0, 0.3).density(a)),
        (SKY, Piecewise(SKY.weights[::-1], -np.pi, np.pi).density),
    ],
)
def test_a_wrong_density_is_noticed(sampler, fault, numbers):
    low, high = span(sampler)
    assert sampler_p(one(sampler, numbers), fault, low, high, bins=60, nodes=24) < LEVEL


def test_picks_come_by_weight(numbers):
    weights = np.array([0.0, 2.0, 1.0, 0.0, 4.0, 0.0])
    index, rest = Pick(weights).sample(numbers[0])
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
    pick = Pick(jnp.array([0.0, 1.0, 0.0]))
    index, rest = pick.sample(jnp.array([0.0, 1.0 - 1e-16, 1.0]))
    assert index.tolist() == [1, 1, 1]
    assert bool(jnp.all((rest >= 0.0) & (rest < 1.0)))
    nothing = Pick(jnp.zeros(3)).sample(jnp.array([0.3]))
    assert bool(jnp.all(jnp.isfinite(nothing[1])))


@pytest.mark.parametrize("e", [0.0, 0.5, 1.0, 2.0, 17.0])
def test_the_area_of_a_lobe_is_its_integral(e):
    t, w = np.polynomial.legendre.leggauss(400)
    truth = np.sum(w * H * np.cos(H * t) ** e)
    # The end of cos^0.5 limits the quadrature.
    assert abs(float(lobe_area(jnp.array(e))) / truth - 1.0) < (1e-6 if e == 0.5 else 1e-12)


@pytest.mark.parametrize("sampler", [Uniform(), Cosine(), LOBES[2]])
def test_single_precision_stays_single(sampler):
    sampler = jax.tree.map(lambda a: a.astype(jnp.float32), sampler)
    a = one(sampler, jnp.array([[0.3, 0.9], [0.2, 0.6]], jnp.float32))
    assert a.dtype == sampler.density(a).dtype == jnp.float32


def test_bad_arguments_are_one_sentence():
    with pytest.raises(ValueError, match=r"^Argument `exponent` must not be negative, but is -1.0"):
        Lobe(-1.0)
    with pytest.raises(ValueError, match=r"^Argument `weights` must not be negative, but is -1.0"):
        Pick([1.0, -1.0])
