"""Six numbers of a jet against autodiff of what they stand for."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from firstorder.checks.tolerance import normwise, rounding
from firstorder.conventions import FLATLAND
from firstorder.fields import gaussian
from firstorder.transport.shading._flat_jets import (
    Entries,
    FlatlandLight,
    Normal,
    entries_of,
    unpacked,
    value_of,
)

PLACE = jnp.array([0.3, -0.2])


def f(x, theta):
    return jnp.sin(x + 2.0 * theta) + x**2 * theta


def g(x, theta):
    return jnp.exp(0.3 * x - 0.5 * theta)


def six(function, x=PLACE[0], theta=PLACE[1]):
    def of(u):
        return function(u[0], u[1])

    u = jnp.stack([x, theta])
    slope, bend = jax.grad(of)(u), jax.hessian(of)(u)
    return Entries(of(u), *slope, bend[0, 0], bend[0, 1], bend[1, 1])


def off(ours, true):
    return normwise(jnp.stack(ours), jnp.stack(true))


def test_products_and_sums_are_those_of_functions():
    both = six(lambda x, t: f(x, t) * g(x, t))
    assert off(six(f).times(six(g)), both) < rounding(100)
    assert off(six(f) + six(g).scaled(3.0), six(lambda x, t: f(x, t) + 3.0 * g(x, t))) < rounding()


@pytest.mark.parametrize(("turn", "look"), [(2.0, -1.0), (1.0, 0.0)])
def test_light_is_looked_up_where_the_normal_sends_it(turn, look):
    def n(x):
        return 0.4 * x + 0.1 * x**2

    x, theta = PLACE
    normal = Normal(n(x), 0.4 + 0.2 * x, jnp.array(0.2))
    there = six(f, x, turn * normal.value + look * theta)
    true = six(lambda x, t: f(x, turn * n(x) + look * t))
    assert off(there.turned(normal, turn, look), true) < rounding(100)


def test_a_jet_and_back():
    e = six(f)
    jet = e.jet(FLATLAND)
    assert np.array_equal(jet.hessian, jet.hessian.T)
    assert off(unpacked(jet), e) == 0.0


def test_light_of_two_callables_is_a_field_like_any_other():
    light, field = (
        FlatlandLight(f, lambda x, t: tuple(six(f, x, t))),
        gaussian((0.1, 0.0), (1.0, 0.6)),
    )
    assert value_of(light, *PLACE) == light.at(PLACE) == f(*PLACE)
    assert off(entries_of(light, *PLACE), six(f)) == 0.0
    jet = field.jet(PLACE)
    assert value_of(field, *PLACE) == field.at(PLACE)
    assert off(entries_of(field, *PLACE), unpacked(jet)) == 0.0


FAULTS = {
    "Leibniz' two": lambda e: e._replace(xx=0.9 * e.xx),
    "the mixed derivative": lambda e: e._replace(x_theta=-e.x_theta),
    "x for theta": lambda e: e._replace(x=e.theta, theta=e.x),
}


@pytest.mark.parametrize("fault", FAULTS)
def test_a_fault_is_noticed(fault):
    wrong = FAULTS[fault](six(f).times(six(g)))
    assert off(wrong, six(lambda x, t: f(x, t) * g(x, t))) > 1e-2
