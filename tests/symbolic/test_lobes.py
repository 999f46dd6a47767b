import dataclasses

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
import sympy
from scipy.special import erfcinv

from firstorder import symbolic
from firstorder.conventions import Frame
from firstorder.errors import Refused
from firstorder.fields import GaussianProfile, gaussian
from firstorder.symbolic import derive, formula, lobe, lobes
from firstorder.transport import Reflection

t, a, s = sympy.symbols("t a s")
BELL = sympy.exp(-(t**2) / (2 * s**2)) / (s * sympy.sqrt(2 * sympy.pi))
LIGHT = gaussian((0.2, 0.1), (0.5, 0.3), 0.3, frame=Frame(sense="outgoing"))


def bell(width, **more):
    return lobe(BELL, t, parameters={s: width}, **more)


def test_a_bell_is_the_librarys():
    mine, hand = bell(0.1), GaussianProfile(0.1)
    assert 0.85 < mine.half_width() < 0.95
    for place in (0.0, 0.05, -0.3):
        found = mine.derivatives(jnp.asarray(place))
        np.testing.assert_allclose(found, hand.derivatives(jnp.asarray(place)), rtol=1e-12)
        np.testing.assert_allclose(
            mine.transform(jnp.asarray(30.0 * place)),
            hand.transform(jnp.asarray(30.0 * place)),
            rtol=0.0,
            atol=1e-14,
        )
    np.testing.assert_allclose(mine.spread(), hand.spread(), rtol=1e-13)


def test_reflection_by_it_is_that_by_the_librarys():
    u = jnp.array([0.3, 0.2])
    found, true = (Reflection(rho)(LIGHT).jet(u) for rho in (bell(0.1), GaussianProfile(0.1)))
    for part in ("value", "gradient", "hessian"):
        np.testing.assert_allclose(getattr(found, part), getattr(true, part), rtol=1e-11)


def test_its_parameters_are_leaves():
    def at(make):
        return jax.grad(lambda width: make(width)(0.0, 0.15))(0.1)

    mine = at(lambda width: bell(width, half_width=1.0))
    np.testing.assert_allclose(mine, at(GaussianProfile), rtol=1e-12)
    with pytest.raises(ValueError, match="`half_width` must be given where parameters"):
        at(bell)


def test_it_is_zero_beyond_its_end_and_its_formula_says_so():
    satin = lobe(sympy.cos(t) ** 2, t, half_width=0.5)
    assert satin(0.0, 0.6) == 0.0
    theta = sympy.Symbol("theta", real=True)
    inside = sympy.Abs(theta) < sympy.Rational(1, 2)
    assert formula(satin).expression == sympy.Piecewise((sympy.cos(theta) ** 2, inside), (0, True))
    found = derive(LIGHT >> Reflection(satin)).value.at(0.3, 0.2)
    np.testing.assert_allclose(found, Reflection(satin)(LIGHT)(0.3, 0.2), rtol=1e-12)


def test_what_is_no_lobe_is_refused_in_one_sentence():
    with pytest.raises(ValueError, match="must give a number for s"):
        lobe(BELL, t)
    with pytest.raises(ValueError, match="gives a number for the variable t"):
        lobe(BELL, t, parameters={s: 0.1, t: 1.0})
    with pytest.raises(ValueError, match="the lobe lives on at 64"):
        lobe(1 / (1 + t**2), t, axis="v")
    with pytest.raises(ValueError, match="must have no kink"):
        lobe(sympy.exp(-sympy.Abs(t)), t, axis="v")
    with pytest.raises(ValueError, match="`half_width` must be positive"):
        lobe(BELL, t, parameters={s: 0.1}, half_width=-1.0)
    assert lobe(sympy.cos(t), t).half_width() == 0.5 * np.pi


# --- transforms ----------------------------------------------------------------------------------

CLOSED = {
    # a lobe whose transform has a closed form, and NumPy's of the same
    "satin": (
        lambda: lobe(sympy.cos(t) ** 8 * (1 + a * t**2), t, parameters={a: 0.3}),
        lambda x: np.cos(x) ** 8 * (1 + 0.3 * x**2),
    ),
    "a bell beside the middle": (
        lambda: lobe((t + a) * sympy.exp(-(t**2) - t), t, parameters={a: 0.3}, axis="v"),
        lambda x: (x + 0.3) * np.exp(-(x**2) - x),
    ),
    "a ramp that ends": (
        lambda: lobe(t**3 * sympy.exp(-t / a), t, parameters={a: 0.3}, half_width=0.5),
        lambda x: x**3 * np.exp(-x / 0.3),
    ),
    "a wave in a bell": (
        lambda: lobe(sympy.exp(-2 * t**2) * (1 + sympy.sin(3 * t)), t, axis="v"),
        lambda x: np.exp(-2 * x**2) * (1 + np.sin(3 * x)),
    ),
}


def closed(name):
    return CLOSED[name][0]()


@pytest.mark.parametrize("name", CLOSED)
def test_a_closed_transform_is_that_of_the_fft(name):
    mine = closed(name)
    assert mine.closed is not None
    assert mine.resolved() == jnp.inf
    end, n, m = float(mine.half_width()), 4096, 12
    h = 2.0 * end / n
    x = -end + h * (np.arange(n) + 0.5)
    p = CLOSED[name][1](x)
    Omega = np.arange(-m, m + 1) / (2.0 * end)
    fft = h * np.fft.fftshift(np.fft.fft(p))[n // 2 - m : n // 2 + m + 1]
    fft = fft * np.exp(-2j * np.pi * Omega * x[0])  # the first sample is not at 0
    # The midpoint rule errs by h^2 / 24 times the slopes of the integrand at the ends.
    slopes = np.abs(np.gradient(p, h)[[0, -1]]) + np.pi * m / end * np.abs(p[[0, -1]])
    bound = h**2 / 24.0 * np.sum(slopes) + 1e-13 * np.sum(np.abs(p)) * h
    found = jax.vmap(mine.transform)(jnp.asarray(Omega))
    np.testing.assert_allclose(found, fft, atol=1.1 * bound, rtol=0.0)


@pytest.mark.parametrize("name", CLOSED)
def test_a_closed_transform_is_that_of_the_samples_to_rounding(name):
    mine = closed(name)
    sampled = dataclasses.replace(mine, closed=None)
    Omega = jnp.linspace(-10.0, 11.0, 40) / mine.half_width()
    mass = float(sampled.transform(jnp.array(0.0)).real) + float(jnp.max(mine(0.0, Omega)))
    found, true = (jax.vmap(each.transform)(Omega) for each in (mine, sampled))
    np.testing.assert_allclose(found, true, rtol=0.0, atol=1e-13 * abs(mass))


def test_a_transform_that_is_wrong_is_not_trusted(monkeypatch):
    right = lobes.closed_transform
    wrongs = (
        lambda F: F.expression.subs(F.Omega, -F.Omega),
        lambda F: sympy.Rational(1001, 1000) * F.expression,
    )
    for wrong in wrongs:

        def replaced(*given, wrong=wrong):
            F = right(*given)
            assert F is not None
            return F._replace(expression=wrong(F))

        monkeypatch.setattr(lobes, "closed_transform", replaced)
        skewed = closed("a bell beside the middle")
        assert skewed.closed is None
        assert skewed.resolved() == 12.0 / skewed.half_width()


@pytest.mark.parametrize("unit", [10**-6, 10**6])
def test_a_closed_transform_is_trusted_in_any_unit(unit):
    assert lobe(unit * sympy.exp(-(t**2)), t, axis="v").closed is not None


def test_a_closed_transform_is_trusted_in_single_precision_too():
    with jax.enable_x64(False):
        single = closed("satin")
        assert single.closed is not None
        assert single.transform(jnp.asarray(0.5)).dtype == "complex64"
    np.testing.assert_allclose(
        complex(single.transform(jnp.asarray(0.5))),
        closed("satin").transform(jnp.asarray(0.5)),
        rtol=0.0,
        atol=1e-5,
    )


def test_a_lobe_without_a_closed_transform_has_that_of_its_samples():
    cauchy = lobe(1 / (1 + t**2), t, half_width=2.0)
    assert cauchy.closed is None
    traced = []
    jax.jit(lambda width: traced.append(bell(width, half_width=1.0)))(0.1)
    assert traced[0].closed is None  # nobody can compare what is no number
    assert bell(0.1).closed is not None


def test_a_closed_transform_has_the_parameters_as_leaves():
    def at(width):
        wider = eqx.tree_at(lambda e: e.expressions.values, bell(0.1), (width,))
        return wider.transform(jnp.asarray(1.5)).real

    true = GaussianProfile(0.1).transform(jnp.asarray(1.5))
    np.testing.assert_allclose(at(0.1), true, rtol=1e-13)
    slope = jax.grad(lambda width: GaussianProfile(width).transform(jnp.asarray(1.5)))(0.1)
    np.testing.assert_allclose(jax.grad(at)(0.1), slope, rtol=1e-12)
    assert jnp.isnan(at(0.3))  # it is cut off where it is alive: the whole line's is not its own


def test_a_bell_that_is_moved_onto_either_end_has_no_closed_transform():
    def moved(to):
        own = lobe(sympy.exp(-50 * (t - a) ** 2), t, parameters={a: 0.1}, half_width=1.0)
        own = eqx.tree_at(lambda e: e.expressions.values, own, (to,))
        return complex(own.transform(jnp.asarray(1.5)))

    true = np.sqrt(np.pi / 50.0) * np.exp(-((1.5 * np.pi) ** 2) / 50.0 + 0.3j * np.pi)
    np.testing.assert_allclose(moved(-0.1), true, rtol=1e-12)
    assert np.isnan(moved(0.8))
    assert np.isnan(moved(-0.8))


def test_the_spectrum_after_a_closed_lobe_is_a_formula():
    found = derive(LIGHT >> Reflection(bell(0.1))).spectrum
    assert not found.expression.has(sympy.Sum, sympy.Integral)
    assert sympy.count_ops(found.expression) < 60
    true = Reflection(bell(0.1))(LIGHT.spectrum())(0.4, 0.7)
    np.testing.assert_allclose(found.at(0.4, 0.7), true, rtol=1e-12)
    ramp = derive(LIGHT >> Reflection(closed("a ramp that ends"))).spectrum
    assert "\\int_0^1 s^{3} e^{" in ramp.latex
    true = Reflection(closed("a ramp that ends"))(LIGHT.spectrum())(0.4, 0.7)
    np.testing.assert_allclose(ramp.at(0.4, 0.7), true, rtol=1e-10)


# --- band limits ---------------------------------------------------------------------------------


def test_the_band_limit_of_a_bell_is_the_error_functions():
    for share in (0.5, 0.01, 1e-6):
        limit = bell(0.1).band_limit(share)
        true = erfcinv(share) / (2.0 * np.pi * 0.1)
        assert limit.share == share
        assert abs(limit.Omega - true) <= 10.0 * limit.error + 1e-13
        assert limit.error < 1e-6


def test_the_band_limit_of_a_satin_is_that_of_its_power_spectrum():
    satin = closed("satin")
    limit = satin.band_limit(0.02)
    Omega = jnp.linspace(-60.0, 60.0, 24001)
    power = np.abs(jax.vmap(satin.transform)(Omega)) ** 2
    beyond = np.sum(power[np.abs(Omega) > limit.Omega]) / np.sum(power)
    step = float(Omega[1] - Omega[0])
    density = 2.0 * np.max(power) / np.sum(power)  # a sample more or less
    assert abs(beyond - 0.02) <= density
    assert limit.error < 1e-6 * step


def test_a_band_limit_that_is_not_there_is_refused():
    box = lobe(1 + 0 * t, t, half_width=1.0)
    assert abs(box.band_limit(0.01).Omega - 5.1429) < 1e-4
    with pytest.raises(Refused, match="what jumps has energy at all frequencies"):
        box.band_limit(1e-5)
    with pytest.raises(ValueError, match="`share` must lie between 0 and 1"):
        box.band_limit(1.0)
    with pytest.raises(ValueError, match="a band limit is measured"):
        jax.jit(lambda width: bell(width, half_width=1.0).band_limit().Omega)(0.1)


@pytest.mark.parametrize("width", [1e-9, 1e-6, 1e-3, 1.0])
def test_a_bell_ends_where_it_has_died_out_however_narrow_it_is(width):
    mine = bell(width, axis="v")
    np.testing.assert_allclose(mine.half_width(), width * np.sqrt(-2.0 * np.log(1e-17)), rtol=0.02)
    np.testing.assert_allclose(mine.spread(), 1.0 / (8.0 * (np.pi * width) ** 2), rtol=1e-9)
    assert mine.closed is not None


def test_a_lobe_of_nothing_is_refused_in_words_of_ours():
    with pytest.raises(ValueError, match="`profile` must not be zero"):
        lobe(0 * t, t)


def test_a_traced_end_that_is_none_gives_nan():
    t = sympy.Symbol("t")

    def value(end):
        return symbolic.lobe(sympy.exp(-(t**2)), t, half_width=end).derivatives(jnp.array(0.1))[0]

    assert jnp.isnan(jax.jit(value)(-1.0))
    assert abs(jax.jit(value)(1.0) - jnp.exp(-0.01)) < 1e-15
