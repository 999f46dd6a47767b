import jax
import jax.numpy as jnp
import numpy as np
import pytest
import sympy

from firstorder.conventions import Frame
from firstorder.fields import GaussianProfile, gaussian
from firstorder.symbolic import derive, formula, lobe
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
    with pytest.raises(ValueError, match="`half_width` must be positive"):
        lobe(BELL, t, parameters={s: 0.1}, half_width=-1.0)
    assert lobe(sympy.cos(t), t).half_width() == 0.5 * np.pi
