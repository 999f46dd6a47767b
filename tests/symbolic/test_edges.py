"""Derivatives of integrals with edges in them, against their values in closed form."""

import numpy as np
import pytest
import sympy

from firstorder.errors import Refused
from firstorder.symbolic._edges import between_edges, differentiated, sifted

x, t, s = sympy.symbols("x t s", real=True)
AT = (-0.4, 0.3, 0.45, 0.8, 1.6)


def cases(yes, no, condition):
    return sympy.Piecewise((yes, condition), (no, True))


def value(expression, at):
    return complex(expression.subs(x, sympy.Float(at)).doit().evalf())


def within(at, low, high):
    return low < at < high


MOVING = {
    "below": (
        cases(t**2, sympy.sin(t), t < x),
        lambda u: (u**2 - np.sin(u)) * within(u, 0.0, 1.0),
    ),
    "above": (
        cases(t**2, 3, t > x),
        lambda u: (3.0 - u**2) * within(u, 0.0, 1.0),
    ),
    "at half the speed": (
        cases(sympy.exp(t), 0, 2 * t <= x + 1),
        lambda u: 0.5 * np.exp(0.5 * u + 0.5) * within(u, -1.0, 1.0),
    ),
    "the other way": (
        cases(1, 5, -3 * t >= x - 1),
        lambda u: 4.0 / 3.0 * within(u, -2.0, 1.0),
    ),
    "a strip": (
        cases(t + 1, 0, sympy.Abs(t - x) < sympy.Rational(1, 4)),
        lambda u: (u + 1.25) * within(u, -0.25, 0.75) - (u + 0.75) * within(u, 0.25, 1.25),
    ),
    "a strip that widens": (
        cases(t**2, 0, sympy.Abs(2 * t - 1) < x),
        lambda u: (0.25 * (1 + u) ** 2 + 0.25 * (1 - u) ** 2) / 2.0 * within(u, 0.0, 1.0),
    ),
    "a sign": (
        (t + 2) * sympy.sign(t - x),
        lambda u: -2.0 * (u + 2.0) * within(u, 0.0, 1.0),
    ),
    "a step and what moves between edges": (
        x**2 * sympy.Heaviside(x - t),
        lambda u: u**2 * within(u, 0.0, 1.0) + 2.0 * u * min(max(u, 0.0), 1.0),
    ),
    "two edges": (
        cases(1, 0, t < x) * cases(t, 0, 4 * t > x),
        lambda u: (u - u / 16.0) * within(u, 0.0, 1.0) - u / 16.0 * within(u, 1.0, 4.0),
    ),
    "either of two": (
        cases(t, 0, sympy.Or(t < x, t > 2 * x)),
        lambda u: u * within(u, 0.0, 1.0) - 4.0 * u * within(u, 0.0, 0.5),
    ),
    "not beyond": (
        cases(1, 0, sympy.Not(t < x, evaluate=False)),
        lambda u: -1.0 * within(u, 0.0, 1.0),
    ),
    "three cases": (
        sympy.Piecewise((1, t < x), (2, t < 2 * x), (5, True)),
        lambda u: -1.0 * within(u, 0.0, 1.0) - 6.0 * within(u, 0.0, 0.5),
    ),
    "a case in a case": (
        cases(cases(1, 0, t < x), 2, t < 2 * x),
        lambda u: 1.0 * within(u, 0.0, 1.0) - 4.0 * within(u, 0.0, 0.5),
    ),
    "a size of a size": (
        cases(t, 0, sympy.Abs(sympy.Abs(t - x) - 1) < sympy.Rational(3, 4)),
        lambda u: (
            (u + 1.75) * within(u, -1.75, -0.75)
            - (u + 0.25) * within(u, -0.25, 0.75)
            + (u - 0.25) * within(u, 0.25, 1.25)
            - (u - 1.75) * within(u, 1.75, 2.75)
        ),
    ),
    "two jumps at one edge": (
        sympy.Heaviside(x - t) * cases(3, 1, t < x),
        lambda u: 3.0 * within(u, 0.0, 1.0),
    ),
    "a bent edge that stays": (
        cases(x**2, t, sympy.sin(t) < sympy.Rational(1, 2)),
        lambda u: 2.0 * u * np.pi / 6.0,
    ),
    "a case that depends on the place": (
        cases(x * t, x**3, t < sympy.Rational(1, 2)),
        lambda u: 0.125 + 1.5 * u**2,
    ),
}


@pytest.mark.parametrize("name", MOVING)
def test_an_edge_inside_an_integral_sweeps_light_over(name):
    integrand, rate = MOVING[name]
    found = differentiated(sympy.Integral(integrand, (t, 0, 1)), x)
    assert not found.has(sympy.DiracDelta)
    np.testing.assert_allclose(
        [value(found, u) for u in AT], [rate(u) for u in AT], rtol=0.0, atol=1e-12
    )


TWICE = {
    "one after the other": (
        sympy.Integral(s * cases(1, 0, t < x + s), (t, 0, 1), (s, 0, 1)),
        # the edge is inside the square where t = x + s lies between 0 and 1
        lambda u: (min(1.0, 1.0 - u) ** 2 - max(0.0, -u) ** 2) / 2.0 if abs(u) < 1.0 else 0.0,
    ),
    "along the outer one": (
        sympy.Integral(s * t * cases(1, 0, s < x), (t, 0, 1), (s, 0, 1)),
        lambda u: 0.5 * u * within(u, 0.0, 1.0),
    ),
    "with a factor between": (
        sympy.Integral(s * sympy.Integral(cases(t, 0, t < x), (t, 0, 1)), (s, 0, 1)),
        lambda u: 0.5 * u * within(u, 0.0, 1.0),
    ),
    "along the outer one, with a factor between": (
        sympy.Integral(s * sympy.Integral(cases(t, 0, s < x), (t, 0, 1)), (s, 0, 1)),
        lambda u: 0.5 * u * within(u, 0.0, 1.0),
    ),
}


@pytest.mark.parametrize("name", TWICE)
def test_an_edge_sweeps_through_both_of_two_integrals(name):
    integral, rate = TWICE[name]
    found = differentiated(integral, x)
    np.testing.assert_allclose(
        [value(found, u) for u in AT], [rate(u) for u in AT], rtol=0.0, atol=1e-12
    )


def test_edges_sweep_over_the_whole_line_and_half_of_it():
    bell, step = sympy.exp(-(t**2)), sympy.Heaviside(t - x)
    for limits, low in [((t, -sympy.oo, sympy.oo), -9.0), ((t, 0, sympy.oo), 0.0)]:
        found = differentiated(sympy.Integral(bell * step, limits), x)
        true = [-np.exp(-(u**2)) * (u > low) for u in AT]
        np.testing.assert_allclose([value(found, u) for u in AT], true, rtol=0.0, atol=1e-12)
    found = differentiated(sympy.Integral(bell * step, (t, -sympy.oo, 1)), x)
    np.testing.assert_allclose(
        [value(found, u) for u in AT], [-np.exp(-(u**2)) * (u < 1.0) for u in AT]
    )


def test_edges_outside_of_integrals_have_no_derivative():
    expression = x**2 * sympy.sign(x - 1) + sympy.Heaviside(x)
    found = differentiated(expression, x)
    assert sympy.simplify(found - 2 * x * sympy.sign(x - 1)) == 0
    assert between_edges(3 * sympy.DiracDelta(x) + x) == x


def test_an_edge_along_an_integral_is_one_of_the_result():
    """It jumps in x for all t at once: nothing between edges."""
    found = differentiated(sympy.Integral(t * sympy.sign(x - 1), (t, 0, 1)), x)
    assert value(found, 0.3) == 0.0


def test_diracs_pick_values():
    delta = sympy.DiracDelta(2 * t - x)
    found = sifted(sympy.Integral(t**3 * delta + t, (t, 0, 1)) + x)
    np.testing.assert_allclose(value(found, 0.8), 0.4**3 / 2 + 0.5 + 0.8)
    np.testing.assert_allclose(value(found, 2.4), 0.5 + 2.4)


BENT = {
    "an edge that bends": sympy.DiracDelta(t**2 - x),
    "two edges at once": sympy.DiracDelta(t - x) * sympy.DiracDelta(t - 2 * x),
    "a change of a jump": sympy.DiracDelta(t - x, 1),
}


@pytest.mark.parametrize("name", BENT)
def test_what_has_no_closed_form_is_refused(name):
    with pytest.raises(Refused, match="not straight"):
        sifted(sympy.Integral(t * BENT[name], (t, 0, 1)))


MOVED = {
    "a case that bends": cases(t, 0, t**2 < x),
    "a size that bends": cases(1, 0, sympy.Abs(t**2 - x) < sympy.Rational(1, 4)),
    "a wave": cases(1, 0, sympy.sin(t) < x),
    "a function of a jump": sympy.exp(sympy.Heaviside(x - t)),
    "a floor": sympy.floor(3 * t - x),
    "a floor in a level": cases(1, 0, t - sympy.floor(t) < x),
    "a bent edge under a factor that may be zero": cases(1, 0, t**2 > x) * sympy.Heaviside(-s),
    "a bent edge under a small factor": cases(1, 0, t**2 > x) * sympy.Heaviside(s - 9),
    "exactly one of two": cases(1, 0, sympy.Xor(t < x, t**2 < x)),
}


@pytest.mark.parametrize("name", MOVED)
def test_an_edge_that_moves_without_a_closed_form_is_refused(name):
    with pytest.raises(Refused, match="no closed form"):
        differentiated(sympy.Integral(MOVED[name], (t, 0, 1)), x)


WITHOUT_A_JUMP = {
    "a parabola": (t**2 - x, 1, -1),
    "one that is met where x is negative": (t**2 + x, 1, 1),
    "times a special function": (t**2 - x, sympy.erf(t), -1),
    "times an integral": (t**2 - x, sympy.Integral(sympy.cos(s * t), (s, 0, 1)), -1),
}


@pytest.mark.parametrize("name", WITHOUT_A_JUMP)
def test_a_bent_edge_where_nothing_jumps_sweeps_nothing_over(name):
    level, factor, rate = WITHOUT_A_JUMP[name]
    found = differentiated(sympy.Integral(cases(level, 0, level > 0) * factor, (t, 0, 1)), x)
    true = sympy.Integral(cases(rate, 0, level > 0) * factor, (t, 0, 1))
    assert found == true


@pytest.mark.parametrize("closed", [True, False])
def test_an_edge_that_begins_on_an_end_counts_once(closed):
    """`int_0^x (t < x) dt` is x where x is positive, and nothing where it is not."""
    condition = t <= x if closed else t < x
    found = differentiated(sympy.Integral(cases(1, 0, condition), (t, 0, x)), x)
    np.testing.assert_allclose([value(found, u) for u in AT], [0.0, 1.0, 1.0, 1.0, 1.0])
    with pytest.raises(Refused, match="two jumps"):
        differentiated(sympy.Integral(cases(1, 0, abs(t) < x), (t, -x, x)), x)


def test_an_integral_that_runs_backwards_has_its_edges_too():
    found = differentiated(sympy.Integral(sympy.Heaviside(t - x), (t, 1, 0)), x)
    np.testing.assert_allclose([value(found, u) for u in AT], [0.0, 1.0, 1.0, 1.0, 0.0])


def test_a_stair_of_a_dozen_steps_stays_small():
    steps = [(k**2, t < x * k / 12) for k in range(1, 12)]
    found = differentiated(sympy.Integral(sympy.Piecewise(*steps, (0, True)), (t, 0, 1)), x)
    assert sympy.count_ops(found) < 2000
    # All edges are met: each sends k / 12 of what is lost behind it.
    true = sum(k / 12 * (k**2 - (k + 1) ** 2 * (k < 11)) for k in range(1, 12))
    np.testing.assert_allclose(value(found, 0.8), true)


def test_jumps_of_a_derivative_that_sympy_cannot_find_are_refused():
    once = sympy.Integral(cases(1, 0, t * s < x), (t, 0, 1), (s, 0, 1))
    with pytest.raises(Refused, match="SymPy"):
        differentiated(differentiated(once, x), x)


def test_floors_do_not_change_between_their_steps():
    found = differentiated(x * sympy.floor(3 * x) + sympy.Mod(x**2, 2), x)
    np.testing.assert_allclose(value(found, 0.8), 2.0 + 1.6)
    np.testing.assert_allclose(value(differentiated(found, x), 0.8), 2.0)


def test_cases_stay_cases():
    """What comes out has SymPy's own cases, also where a level is not known."""
    found = differentiated(sympy.Integral(cases(x * t, x**2, t < x), (t, 0, 1)), x)
    assert {f.func.__name__ for f in found.atoms(sympy.Function)} <= {"sign", "Piecewise"}
    both = sympy.And(t < 2, t > 0)
    found = differentiated(sympy.Integral(cases(x * t, x**2, both), (t, 0, 1)), x)
    np.testing.assert_allclose(value(found, 0.3), 0.5)
