import jax.numpy as jnp
import numpy as np
import pytest
from scipy.integrate import quad

from derivations.caching._light import lamp, scene_a_columns, scene_a_numbers
from firstorder.caching import (
    DEFINITIONS,
    errors,
    expected_error,
    ideal_radius,
    radius_for,
    rms,
    true_error,
)

AT, R = 0.35, 0.4


def by_quadrature(definition, order):
    E = scene_a_numbers()[0]
    columns = scene_a_columns(AT)

    def miss(t):
        expansion = columns[0] + columns[1] * t * (order > 0) + columns[2] * t * t / 2 * (order > 1)
        return abs(float(E(AT + t) - expansion))

    if definition == "largest":
        return max(miss(t) for t in np.linspace(-R, R, 4001))
    power = 2 if "squared" in definition else 1
    total = sum(quad(lambda t: miss(t) ** power, *ends)[0] for ends in ((-R, 0), (0, R)))
    return total / {"relative": columns[0]}.get(definition, 2 * R if "average" in definition else 1)


def worst_error():
    columns = jnp.asarray(scene_a_columns(AT))
    worst = 0.0
    for definition in DEFINITIONS:
        for order in (0, 1, 2):
            ours = float(true_error(lamp, AT, columns, R, order=order, definition=definition))
            bound = 1e-2 if definition == "largest" else 1.0  # the nodes stop short of the ends
            worst = max(worst, bound * abs(ours / by_quadrature(definition, order) - 1.0))
    return worst


def test_the_error_is_that_of_adaptive_quadrature():
    assert worst_error() < 1e-4


@pytest.mark.parametrize(
    "fault",
    [lambda d, x, order: d[..., 0] + 0.0 * x, lambda d, x, order: d[..., 0] - d[..., 1] * x],
)
def test_a_fault_is_noticed(fault, monkeypatch):
    monkeypatch.setattr(errors, "taylor", fault)
    assert worst_error() > 1e-2


@pytest.mark.smoke
def test_the_estimate_tends_to_the_truth():
    columns = jnp.asarray(scene_a_columns(AT))
    for order in (0, 1, 2):
        true = float(true_error(lamp, AT, columns, 0.01, order=order))
        assert float(expected_error(columns[order + 1], 0.01, order=order)) == pytest.approx(
            true, rel=1e-2
        )


def test_the_ideal_radius_has_the_tolerated_error_and_is_near_the_estimated_one():
    columns = jnp.asarray(scene_a_columns(0.2))
    found = ideal_radius(lamp, 0.2, columns, 1e-3, 1e-3, 2.0)
    assert float(true_error(lamp, 0.2, columns, found)) == pytest.approx(1e-3, rel=1e-10)
    assert float(found) == pytest.approx(float(radius_for(columns[2], 1e-3)), rel=0.02)


def test_a_kink_is_cut_at():
    def E(x):
        return jnp.abs(x - 0.1)

    start = jnp.array([0.1, -1.0])
    assert float(true_error(E, 0.0, start, 0.5, breaks=(0.1,))) == pytest.approx(0.16, rel=1e-13)


@pytest.mark.smoke
def test_rms():
    assert rms(np.array([[1.0, 3.0], [0.0, 0.0]]), np.zeros(2)).tolist() == [5.0**0.5, 0.0]


@pytest.mark.smoke
def test_bad_input_is_one_sentence():
    with pytest.raises(ValueError, match="Argument `definition` must be one of"):
        true_error(lamp, 0.0, jnp.zeros(2), 0.1, definition="median")
    with pytest.raises(ValueError, match=r"^Argument `tolerance` must be positive, but is 0.0.$"):
        ideal_radius(lamp, 0.0, jnp.zeros(2), 0.0, 0.1, 1.0)
