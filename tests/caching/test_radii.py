import math

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.integrate import quad

from firstorder.caching import CLAMPS, DEFINITIONS, clamped, expected_error, radii, radius_for

CASES = [(d, o) for d in DEFINITIONS for o in (0, 1, 2)]


def by_quadrature(definition, order, derivative, radius, value):
    """The definition, integrated adaptively over the first missing term."""

    def miss(t):
        return abs(derivative * t ** (order + 1)) / math.factorial(order + 1)

    power = 2 if "squared" in definition else 1
    if definition == "largest":
        return max(miss(-radius), miss(radius))
    total = sum(quad(lambda t: miss(t) ** power, *e)[0] for e in ((-radius, 0.0), (0.0, radius)))
    return total / {"relative": value}.get(definition, 2 * radius if "average" in definition else 1)


def worst_error():
    errors = []
    for definition, order in CASES:
        options = {"order": order, "definition": definition, "value": 1.7}
        for derivative, radius in ((-3.1, 0.4), (0.2, 2.5)):
            true = by_quadrature(definition, order, derivative, radius, 1.7)
            estimate = float(expected_error(derivative, radius, **options))
            back = float(radius_for(derivative, true, **options))
            errors += [abs(estimate / true - 1.0), abs(back / radius - 1.0)]
    return max(errors)


def test_every_definition_is_its_integral_and_every_radius_its_inverse():
    assert worst_error() < 1e-10


@pytest.mark.smoke
def test_the_printed_radius():
    assert radius_for(-6.0, 2.0).item() == pytest.approx(1.0)
    assert expected_error(6.0, 2.0).item() == pytest.approx(16.0)


LAWS = radii._law
FAULTS = {
    "one side only": lambda law: law._replace(factor=0.5 * law.factor),
    "no modulus of the square": lambda law: law._replace(power=1),
    "a power short": lambda law: law._replace(exponent=max(law.exponent - 1, 1)),
    "the mean of the wrong power": lambda law: law._replace(factor=law.factor * 1.2),
}


@pytest.mark.parametrize("fault", FAULTS)
def test_a_fault_in_the_law_is_noticed(fault, monkeypatch):
    monkeypatch.setattr(radii, "_law", lambda *given: FAULTS[fault](LAWS(*given)))
    assert 1e-3 < worst_error() < np.inf


def test_a_fault_in_the_factorial_is_noticed(monkeypatch):
    monkeypatch.setattr(radii, "_size", lambda D, *_: jnp.abs(jnp.asarray(D)))
    assert 1e-3 < worst_error() < np.inf


def test_at_equal_counts_averages_place_what_the_largest_error_places():
    """Their radii are one family: proportional to |E''|^(-1/2), whatever the tolerance."""
    h = jnp.array([0.3, -1.0, 7.0])
    shapes = [radius_for(h, 0.1, definition=d) for d in ("average", "average squared", "largest")]
    for r in shapes[1:]:
        np.testing.assert_allclose(r / r[0], shapes[0] / shapes[0][0], rtol=1e-14)
    powers = {
        d: float(jnp.log(radius_for(2.0, 0.1, definition=d) / radius_for(1.0, 0.1, definition=d)))
        / math.log(2.0)
        for d in DEFINITIONS
        if d != "relative"
    }
    assert powers == pytest.approx(
        {
            "total": -1 / 3,
            "integrated squared": -2 / 5,
            "average": -1 / 2,
            "average squared": -1 / 2,
            "largest": -1 / 2,
        }
    )


def test_units():
    """Space in other units by s, radiance by c: E^(k) by c / s^k, the radius by s."""
    s, c = 3.0, 5.0
    for order in (0, 1, 2):
        scaled = radius_for(1.3 * c / s ** (order + 1), 0.2 * c * s, order=order)
        assert float(scaled) == pytest.approx(s * float(radius_for(1.3, 0.2, order=order)))


@pytest.mark.smoke
def test_where_nothing_changes_the_radius_is_infinite_and_has_no_nan_in_its_gradient():
    assert np.isposinf(radius_for(0.0, 0.1).item())
    for order in (0, 1, 2):
        slope = jax.grad(lambda h, o=order: clamped(radius_for(h, 0.1, order=o), 0.1, 2.0).radius)
        assert slope(0.0).item() == 0.0
        assert np.isfinite(slope(40.0).item())


@pytest.mark.smoke
def test_clamps_are_reported():
    found = clamped(jnp.array([0.0, 0.1, 0.5, 2.0, 3.0, jnp.inf]), 0.1, 2.0)
    assert found.radius.tolist() == [0.1, 0.1, 0.5, 2.0, 2.0, 2.0]
    assert [CLAMPS[c] for c in found.clamp.tolist()] == ["raised", "", "", "", "cut", "cut"]
    assert np.isnan(clamped(jnp.nan, 0.1, 2.0).radius)


@pytest.mark.smoke
@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda: radius_for(1.0, 0.0), "Argument `tolerance` must be positive, but is 0.0."),
        (lambda: expected_error(1.0, -1.0), "Argument `radius` must not be negative, but is -1.0."),
        (lambda: radius_for(1.0, 1.0, order=3), "Argument `order` must be 0, 1 or 2, but is 3."),
        (
            lambda: radius_for(1.0, 1.0, definition="relative"),
            "Argument `value` must be given for the relative error, but is missing.",
        ),
        (
            lambda: radius_for(1.0, 1.0, definition="relative", value=0.0),
            "Argument `value` must be positive, but is 0.0.",
        ),
        (lambda: clamped(1.0, 2.0, 1.0), "Argument `high` must be at least 2, but is 1."),
        (lambda: clamped(1.0, 0.0, 1.0), "Argument `low` must be positive, but is 0.0."),
    ],
)
def test_bad_input_is_one_sentence(call, words):
    with pytest.raises(ValueError, match=r"must") as failure:
        call()
    assert str(failure.value) == words


def test_an_unknown_definition_is_refused():
    with pytest.raises(ValueError, match="Argument `definition` must be one of"):
        radii._law("median", 1)


def test_a_traced_tolerance_that_is_not_positive_gives_nan():
    radius = jax.jit(lambda e: radius_for(1.0, e))
    assert np.isnan(radius(-0.1))
    assert np.isfinite(radius(0.1))


def test_single_precision():
    r = radius_for(jnp.float32(-6.0), jnp.float32(2.0))
    assert r.dtype == jnp.float32
    assert float(r) == pytest.approx(1.0, rel=1e-6)
