"""Errors by finer rules, on integrals whose values are known."""

import inspect

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from firstorder.errors import Refused
from firstorder.fields import Grid, SampledSpectrum, gaussian
from firstorder.flatland import (
    Circles,
    ConstantSky,
    Receiver,
    Scene,
    derivatives,
    irradiance,
    primitive,
)
from firstorder.laws import Integrate, Multiply, VonMisesFisher, Zonal
from firstorder.numerics import Approximation, _refinement, gauss_legendre
from firstorder.numerics._refinement import approximated, counts_of, finer, refined, with_errors
from tests.approximations import judged

DRAWN = 500
NODES = (6, 7, 9, 12, 19)


def jump(a, t):
    """A step at a, and its integral over [-1, 1]."""
    return (t > a) * 1.0, 1.0 - a


def kink(a, t):
    return np.abs(t - a), 1.0 + a * a


def bend(a, t):
    """A jump of the second derivative."""
    return np.maximum(t - a, 0.0) ** 2, (1.0 - a) ** 3 / 3.0


def pole(a, t):
    """A peak of half-width 0.35 to 1.35: analytic, with poles at this distance."""
    w = 0.85 + 0.5 * a
    return w / (t * t + w * w), 2.0 * np.arctan(1.0 / w)


def wave(a, t):
    """Up to some three periods."""
    k = 10.5 + 10.0 * a
    return np.cos(k * t + a), 2.0 * np.sin(k) * np.cos(a) / k


def integrals(f, nodes=NODES):
    """Values, errors and truths of one integral for many numbers a, by rules of several sizes."""
    a = np.random.default_rng(0).uniform(-1.0, 1.0, DRAWN)[:, None]
    found = []
    for n in nodes:

        def answer(step, n=n):
            t, w = gauss_legendre(finer(n, step))
            return f(a, t)[0] @ w

        found.append((*approximated(answer), f(a, np.zeros(1))[1][:, 0]))
    return tuple(zip(*found, strict=True))


@pytest.mark.parametrize("f", [jump, kink, bend, pole, wave])
def test_the_error_of_a_rule_is_a_bound_in_99_of_100_cases(f):
    found = judged(*integrals(f))
    assert found.bound >= 0.99
    assert found.ratio <= 10.0


@pytest.mark.parametrize("f", [jump, kink, bend, pole, wave])
def test_an_error_a_hundred_times_too_small_is_no_bound(f, monkeypatch):
    monkeypatch.setattr(_refinement, "SAFETY", 0.01 * _refinement.SAFETY)
    assert judged(*integrals(f)).bound < 0.5


def test_a_break_beyond_the_outermost_nodes_of_all_rules_is_seen_by_none():
    """In the share of places that the first zero of J_0 says."""
    n = 3
    share = 2.4048**2 / 2.0 / (3 * n + 1.5) ** 2
    outside = share - 1.0 + np.max(gauss_legendre(finer(n, 2))[0])
    np.testing.assert_allclose(outside, 0.0, rtol=0.0, atol=2e-4)
    for f in (jump, kink, bend):
        missed = 1.0 - judged(*integrals(f, (n,))).bound
        assert abs(missed - share) < 3.0 * np.sqrt(share / DRAWN)


def test_rules_of_twice_and_three_times_the_nodes_miss_jumps(monkeypatch):
    """Breaks that lie well for one rule lie as well for its multiples."""
    monkeypatch.setitem(globals(), "finer", lambda n, step: (step + 1) * n)
    assert judged(*integrals(jump)).bound < 0.96


def test_rounding_alone_is_an_error():
    value, error = approximated(lambda step: jnp.array([0.1, -3.0]))
    assert value.tolist() == [0.1, -3.0]
    np.testing.assert_allclose(error, 16.0 * np.finfo(float).eps * np.array([0.1, 3.0]))


def test_what_has_no_value_has_no_error():
    assert np.isnan(approximated(lambda step: jnp.array(np.nan if step == 1 else 1.0)).error)


# --- functions -----------------------------------------------------------------------------------


@with_errors("nodes")
def bell(width, *, nodes=3, with_error=False):
    t, w = gauss_legendre(nodes)
    return jnp.sum(jnp.asarray(w) * jnp.exp(-((t / width) ** 2)))


def test_an_answer_is_the_same_with_and_without_its_error():
    assert bell(0.8, with_error=True).value == bell(0.8)
    assert isinstance(bell(0.8, with_error=True), Approximation)


def test_without_its_error_the_program_is_that_of_the_function_alone():
    bare = inspect.unwrap(bell)
    assert str(jax.make_jaxpr(bell)(0.8)) == str(jax.make_jaxpr(bare)(0.8))


def test_the_value_keeps_its_derivative_and_the_error_has_none():
    asked = jax.grad(lambda x: bell(x, with_error=True).value)(0.8)
    assert asked == jax.grad(bell)(0.8)
    assert jax.grad(lambda x: bell(x, with_error=True).error)(0.8) == 0.0


def test_an_error_is_told_under_vmap_and_for_every_band():
    sky = ConstantSky((1.0, 2.0, 3.0))
    ball = primitive(Circles((0.3, 1.0), 0.2))
    scene = Scene.of(ball, environment=sky)
    rows = Receiver(jnp.zeros((4, 2)), jnp.zeros(4))
    ask = jax.jit(jax.vmap(lambda at: irradiance(scene, at, with_error=True)))
    value, error = ask(rows)
    assert value.shape == error.shape == (4, 3)


def test_derivatives_of_a_function_that_tells_no_error_are_refused():
    with pytest.raises(TypeError, match="must answer `with_error`, but half does not"):
        derivatives(half, Receiver((0.0, 0.0), 0.0), with_error=True)


def half(at):
    return 0.5 * at.position[0]


def test_counts_are_those_asked_for_or_the_defaults():
    assert counts_of(bell, {}) == {"nodes": 3}
    assert counts_of(bell, {"nodes": 8, "width": 1.0}) == {"nodes": 8}


# --- things --------------------------------------------------------------------------------------


def test_every_rule_within_a_field_becomes_finer():
    inner = Integrate("x", -1.0, 1.0, 4)(gaussian((0.0, 0.0), (1.0, 1.0)))
    outer = Multiply(inner)(2.0 * inner)
    nodes = [
        law.nodes
        for law in jax.tree.leaves(refined(outer, 2), is_leaf=lambda x: isinstance(x, Integrate))
        if isinstance(law, Integrate)
    ]
    assert nodes == [13, 13]


def test_what_has_no_rule_is_returned_itself():
    f = 2.0 * gaussian((0.0, 0.0), (1.0, 1.0))
    assert refined(f, 1) is f
    held = jax.tree_util.Partial(max, [f], key={"f": f})
    assert refined(held, 1).args[0][0] is f


def test_a_field_in_a_partial_function_is_found():
    integral = Integrate("x", -1.0, 1.0, 4)(gaussian((0.0, 0.0), (1.0, 1.0)))
    held = refined(jax.tree_util.Partial(max, (integral,)), 1)
    assert held.args[0][0].law.nodes == 9


def test_windows_are_doubled_and_then_made_denser():
    grid = Grid((4, 1), (0.5, 3.0), (1.0, 0.0))
    assert grid.finer(0) == grid
    assert grid.finer(1) == Grid((8, 1), (0.5, 3.0), (1.0, 0.0))
    assert grid.finer(2).size == (13, 1)
    np.testing.assert_allclose(grid.finer(2).extent, grid.extent)


def test_samples_alone_refuse_to_tell_their_error():
    F = SampledSpectrum(jnp.ones((4, 2)), Grid((4, 2), (0.5, 1.0)))
    with pytest.raises(Refused, match="samples alone"):
        F(0.0, 0.0, with_error=True)


def test_light_that_a_window_does_not_hold_is_an_error_of_its_spectrum():
    f, wide = gaussian((0.0, 0.0), (1.0, 1.0)), Grid.spanning((24, 24), (6.0, 6.0))
    exact = f.spectrum()(0.1, 0.0)
    for grid in (Grid.spanning((24, 24), (2.0, 6.0)), wide):
        value, error = SampledSpectrum.of(f, grid)(0.1, 0.0, with_error=True)
        assert abs(value - exact) <= error
    assert error < 1e-8


def test_a_zonal_convolution_tells_the_error_of_its_jet_and_of_its_multipliers():
    coarse, fine = (Zonal(VonMisesFisher(5.0), n, 2 * n) for n in (5, 30))
    w, f = jnp.array([0.6, 0.0, 0.8]), lambda w: jnp.exp(w[0])
    for ask in (lambda z, **o: z.jet(f, w, **o), lambda z, **o: z.multipliers(4, **o)):
        (value, error), truth = jax.jit(lambda ask=ask: (ask(coarse, with_error=True), ask(fine)))()
        found = judged(value, error, truth)
        assert found.bound == 1.0
        assert found.ratio < 10.0


def test_products_without_a_window_take_more_waves():
    law = Multiply(gaussian((0.0, 0.0), (1.0, 1.0)))
    assert [refined(law, step).waves for step in (0, 1, 2)] == [256, 513, 769]


def test_an_error_that_is_asked_for_by_place_is_given():
    """Where the signature lets `with_error` stand without its name, it is not overlooked."""

    @with_errors("nodes")
    def bell(width, nodes=4, with_error=False):
        t, w = gauss_legendre(nodes)
        return jnp.sum(w * jnp.exp(-((t / width) ** 2)))

    found = bell(1.0, 5, True)
    assert isinstance(found, Approximation)
    assert found == bell(1.0, 5, with_error=True)
    assert bell(1.0, 5, False) == bell(1.0, 5)
