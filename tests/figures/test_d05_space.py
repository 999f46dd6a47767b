"""The scene in space of D05's Figs. 1, 6 and 9: soft balls, their series, rays and prediction."""

import jax.numpy as jnp
import numpy as np
import pytest

from figures.d05.shared import compared, receiver, space
from figures.timing import Ratio

PERIOD = 0.4


@pytest.fixture(scope="module")
def balls():
    return space.Balls.jittered(PERIOD, seed=3, soft=True)


def test_a_series_of_soft_balls_is_what_gets_through_their_middle_plane(balls):
    s, c = balls.series(44)
    x = np.linspace(-0.7, 0.9, 5)
    waves = np.exp(2j * np.pi * np.outer(x, s))
    expected = balls.through(x[:, None], x, 0.0, 0.0)
    np.testing.assert_allclose((waves @ c @ waves.T).real, expected, rtol=0.0, atol=2e-3)


def test_opaque_balls_hide_all_and_soft_ones_most_in_their_middles(balls):
    middle = balls.centers[6, 5]
    hard = space.Balls.jittered(PERIOD, seed=3)
    assert float(hard.through(*middle, 0.1, -0.2)) == 0.0
    assert float(balls.through(*middle, 0.1, -0.2)) < 1e-6
    # Across a slanted ray the distance from the middle is shorter than in the plane.
    off = middle + jnp.array([0.12, 0.0])
    assert float(balls.through(*off, 0.0, 0.0)) > float(balls.through(*off, 0.5, 0.0))


def test_rays_and_prediction_agree_on_light_that_has_travelled():
    pairs = space.travelled(space.source(), space.FIRST)
    window = space.Window(0.35, 0.3, 20, 1.0)
    light = space.Light(None, space.FIRST)
    place = receiver.Place("", window, light, pairs, behind=False)
    assert receiver.step(place, None).apart < 1e-3
    short = space.Light(None, 0.9 * space.FIRST)
    assert receiver.step(place._replace(light=short), None).apart > 0.05


def test_soft_balls_are_predicted_behind_them_and_not_by_the_series_of_others(balls):
    pairs = space.travelled(space.source(), space.FIRST)
    behind = pairs[0].blocked(), pairs[1].blocked()
    window = space.Window(0.3, 0.2, 16, 1.0)
    place = receiver.Place("", window, space.Light(balls, space.FIRST), behind, behind=True)
    others = space.Balls.jittered(PERIOD, seed=4, soft=True)
    own, wrong = (receiver.step(place, b.series(24)).likeness for b in (balls, others))
    assert 1.0 - own < 0.2 * (1.0 - wrong)


def test_the_least_ratio_at_equal_cost_is_that_of_the_seeds_times_what_more_samples_gain():
    plain = np.tile([0.5, 0.5, 0.8], (4, 1))
    even = np.tile([1.0, 1.0, 1.0], (4, 1))
    way = "bilateral"
    table = {("even", way): even[0], ("plain", way): plain[0]}
    found = compared.Compared(
        seeds={("even", way): even, ("plain", way): plain},
        table=table,
        cost={"time": Ratio(1.0, 0.1)},
        equal={("time", way): 0.9 * even[0]},
        budgets=np.array([]),
        curves={},
        true=np.array([]),
        images={},
    )
    least, error = compared._least(found, "time", "plain", way)
    assert least == pytest.approx(0.9 / 0.8)
    # The cost's own error: 5 % of the samples, of which twice as many gain a tenth.
    assert error == pytest.approx(least * abs(np.log(0.9)) / np.log(2.0) * 0.05)
