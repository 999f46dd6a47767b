import itertools

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
import sympy as sp
from hypothesis import given
from hypothesis import strategies as st

from derivations.reconstruction import hermite as derived
from firstorder.checks.tolerance import fitted_order, normwise, rounding
from firstorder.reconstruction import (
    HermiteInterpolant,
    hermite,
    hermite_basis,
    interpolation_error,
)

DATA = (1, 2, 3)
NODES = np.array([-1.0, -0.7, 0.1, 0.15, 0.9, 2.0])
X = np.linspace(-1.0, 2.0, 301)


value = eqx.filter_jit(lambda f, x: f(x))


def jets(p, x, data):
    """Value and derivatives of a NumPy polynomial, in columns."""
    return np.stack([p.deriv(k)(x) for k in range(data)], -1)


def worst_on_polynomials(data, degree, nodes=NODES):
    """Error on a polynomial of this degree, relative to its largest value."""
    p = np.polynomial.Polynomial(np.random.default_rng(degree).normal(size=degree + 1))
    return normwise(HermiteInterpolant(nodes, jets(p, nodes, data))(X), p(X))


# --- the basis ---------------------------------------------------------------------------------


@pytest.mark.parametrize("data", DATA)
def test_the_basis_is_the_derived_one(data):
    t = np.linspace(0.0, 1.0, 7)
    truth = [[sp.lambdify(derived.t, w)(t) + 0.0 * t for w in row] for row in derived.basis(data)]
    assert normwise(hermite_basis(t, data), np.moveaxis(np.array(truth), -1, 0)) < rounding(20)


@pytest.mark.smoke
@pytest.mark.parametrize("data", DATA)
def test_polynomials_of_its_degree_are_exact_and_the_next_one_is_not(data):
    assert worst_on_polynomials(data, 2 * data - 1) < rounding(50)
    assert worst_on_polynomials(data, 2 * data) > 1e-5


@given(
    st.lists(st.floats(0.01, 3.0), min_size=5, max_size=5),
    st.floats(-5.0, 5.0),
    st.lists(st.floats(-2.0, 2.0), min_size=6, max_size=6),
)
def test_quintics_are_exact_on_any_nodes(steps, shift, coefficients):
    """Also where cells of very different lengths meet, and far from the origin."""
    nodes = shift + np.concatenate([[0.0], np.cumsum(steps)])
    p = np.polynomial.Polynomial(coefficients)
    x = np.linspace(nodes[0], nodes[-1], 40)
    data = jets(p, nodes, 3)
    # Of sums of monomials, whose terms may be far larger than what is left of them.
    terms = np.polynomial.Polynomial(np.abs(coefficients))
    size = max(np.max(terms(np.abs(nodes))), 1e-300)
    size = max(size, *(np.max(terms.deriv(k)(np.abs(nodes))) * max(steps) ** k for k in (1, 2)))
    error = np.max(np.abs(np.asarray(value(HermiteInterpolant(nodes, data), x)) - p(x)))
    assert error <= rounding(50) * size


FAULTS = {
    "the far slope keeps its sign": lambda w: w.at[..., 1, 1:2].multiply(-1.0),
    "the ends are exchanged": lambda w: w[..., ::-1, :],
    "the second derivative counts twice": lambda w: w.at[..., :, 2:3].multiply(2.0),
    "the value's weight is linear": lambda w: w.at[..., 0, 0].add(0.1 * w[..., 0, -1]),
}


@pytest.mark.parametrize("fault", FAULTS)
def test_a_wrong_basis_is_noticed(fault, monkeypatch):
    right = hermite.hermite_basis
    assert worst_on_polynomials(3, 5) < rounding(50)
    monkeypatch.setattr(hermite, "hermite_basis", lambda t, k: FAULTS[fault](right(t, k)))
    error = worst_on_polynomials(3, 5)
    assert np.isfinite(error)
    assert error > rounding(50)


def test_a_length_forgotten_is_noticed(monkeypatch):
    """Slopes are per unit length; on cells of length 1 nobody would see it."""
    monkeypatch.setattr(HermiteInterpolant, "__call__", _without_lengths)
    assert worst_on_polynomials(2, 3) > rounding(50)


def _without_lengths(self, x, side="right"):
    i = hermite.cell_of(self.nodes, jnp.asarray(x), side)
    a, b = self.nodes[i], self.nodes[i + 1]
    w = hermite_basis((x - a) / (b - a), self.data.shape[1])
    return jnp.sum(w * jnp.stack([self.data[i], self.data[i + 1]], -2), (-2, -1))


def test_a_tensor_product_of_two_bases_is_exact_for_bicubics():
    c = np.random.default_rng(3).normal(size=(4, 4))
    (ax, hx), (ay, hy) = (0.3, 0.7), (-0.2, 1.3)
    d = np.polynomial.polynomial

    def part(k, m, x, y):
        return d.polyval2d(x, y, d.polyder(d.polyder(c, k, axis=0), m, axis=1))

    corners = np.empty((2, 2, 2, 2))  # end in x, derivative in x, end in y, derivative in y
    for i, k, j, m in itertools.product((0, 1), repeat=4):
        corners[i, k, j, m] = part(k, m, ax + i * hx, ay + j * hy) * hx**k * hy**m
    s, t = np.array([0.2, 0.9]), np.array([0.4, 0.6])
    p = jnp.einsum("pik,pjm,ikjm->p", hermite_basis(s, 2), hermite_basis(t, 2), corners)
    assert normwise(p, part(0, 0, ax + s * hx, ay + t * hy)) < rounding(100)


# --- the error ---------------------------------------------------------------------------------


@pytest.mark.parametrize("data", DATA)
def test_the_error_constants_are_the_derived_ones(data):
    for norm, truth in (("largest", derived.largest(data)), ("rms", derived.rms(data))):
        found = interpolation_error(0.5, -2.0, data, norm).item()
        assert abs(found / (float(truth) * 0.5 ** (2 * data) * 2.0) - 1.0) < rounding(10)


@pytest.mark.parametrize("data", DATA)
def test_the_next_monomial_attains_the_error(data):
    """`x^2m / (2m)!` on one cell: its largest error and its rms, sampled densely."""
    p = np.polynomial.Polynomial([0.0] * (2 * data) + [1.0 / float(sp.factorial(2 * data))])
    ends, x = np.array([0.3, 1.0]), np.linspace(0.3, 1.0, 2001)
    error = np.asarray(value(HermiteInterpolant(ends, jets(p, ends, data)), x)) - p(x)
    largest, rms = (interpolation_error(0.7, 1.0, data, n).item() for n in ("largest", "rms"))
    assert abs(np.max(np.abs(error)) / largest - 1.0) < 1e-9
    assert abs(np.sqrt(np.trapezoid(error**2, x) / 0.7) / rms - 1.0) < 1e-5


@pytest.mark.parametrize("data", DATA)
def test_the_order_of_the_error(data):
    counts = np.array([12, 24, 48])
    x = np.linspace(0.0, 2.0, 4001)
    errors = []
    for n in counts:
        a = np.linspace(0.0, 2.0, n + 1)
        columns = [np.sin(3.0 * a), 3.0 * np.cos(3.0 * a), -9.0 * np.sin(3.0 * a)]
        f = HermiteInterpolant(a, np.stack(columns[:data], -1))
        errors.append(np.max(np.abs(np.asarray(value(f, x)) - np.sin(3.0 * x))))
    bound = interpolation_error(2.0 / counts, 3.0 ** (2 * data), data)
    assert abs(fitted_order(counts, errors) + 2 * data) < 0.1
    assert np.all(np.array(errors) <= np.asarray(bound) + 1e-14)


# --- breaks, ends, transformations -------------------------------------------------------------


def test_nothing_is_interpolated_across_a_break():
    nodes = [0.0, 0.4, 0.4, 1.0]
    step = HermiteInterpolant(nodes, [[1.0, 1.0], [1.4, 1.0], [-3.0, 0.0], [-3.0, 0.0]])
    x = np.linspace(0.0, 1.0, 101)
    assert normwise(value(step, x), np.where(x < 0.4, 1.0 + x, -3.0)) < rounding(10)
    assert abs(step(0.4, side="left").item() - 1.4) < rounding()
    assert step(0.4).item() == -3.0


def test_a_break_keeps_the_order_at_a_kink():
    """Without it a slope that jumps by 2 costs h / 2 times 1/4 of the jump, at best."""

    def f(a, sign):
        return np.stack([np.sin(a) + np.abs(a), np.cos(a) + sign], -1)

    left, right, x = np.linspace(-1, 0, 9), np.linspace(0, 1, 9), np.linspace(-1, 1, 999)
    nodes = np.concatenate([left, right])
    broken = HermiteInterpolant(nodes, np.concatenate([f(left, -1.0), f(right, 1.0)]))
    through = np.linspace(-1.0, 1.0, 18)
    smooth = HermiteInterpolant(through, f(through, np.sign(through)))
    errors = [
        np.max(np.abs(np.asarray(value(p, x)) - np.sin(x) - np.abs(x))) for p in (broken, smooth)
    ]
    assert errors[0] < 1e-6 < 1e-3 < errors[1]


def test_outside_of_the_nodes_nothing_is_known():
    f = HermiteInterpolant([0.0, 1.0], [[0.0], [1.0]])
    assert np.isnan(value(f, np.array([-0.001, 0.0, 1.0, 1.001]))).tolist() == [1, 0, 0, 1]
    assert value(f, np.array([0.0, 1.0])).tolist() == [0.0, 1.0]


@pytest.mark.parametrize("bits", [32, 64])
def test_precision_jit_and_derivatives(bits):
    with jax.enable_x64(bits == 64):
        a = jnp.linspace(0.0, 1.0, 5)
        f = HermiteInterpolant(jnp.concatenate([a, a[2:3]]).sort(), jnp.ones((6, 3)))
        run = eqx.filter_jit(lambda f, x: jax.vmap(f.derivatives)(x))
        out = run(f, jnp.linspace(0.0, 1.0, 41))
        assert all(o.dtype == f"float{bits}" and np.all(np.isfinite(o)) for o in out)
        total = eqx.filter_grad(lambda f: jnp.sum(f(jnp.linspace(0.0, 1.0, 41))))
        g = eqx.filter_jit(total)(f)
        assert all(np.all(np.isfinite(leaf)) for leaf in jax.tree.leaves(g))


def test_derivatives_of_the_interpolant_are_the_data_at_the_nodes():
    p = np.polynomial.Polynomial([0.3, -1.0, 0.2, 0.7, -0.4, 0.1])
    f = HermiteInterpolant(NODES, jets(p, NODES, 3))
    found = np.stack(jax.jit(jax.vmap(f.derivatives))(jnp.asarray(NODES)), -1)
    assert normwise(found, jets(p, NODES, 3)) < rounding(1000)  # h^-2 of the shortest cell


def test_traced_nodes_out_of_order_give_nan():
    assert np.isnan(
        jax.jit(lambda a: HermiteInterpolant(a, jnp.ones((2, 1)))(0.5))(jnp.array([1.0, 0.0]))
    )


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: HermiteInterpolant([0.0, 1.0, 0.5], np.ones((3, 1))), "in rising order"),
        (lambda: HermiteInterpolant([0.0, 1.0], np.ones((3, 1))), "one row per node"),
        (lambda: HermiteInterpolant([0.0], np.ones((1, 1))), "two or more"),
        (lambda: HermiteInterpolant([0.0, np.nan], np.ones((2, 1))), "must be finite"),
        (lambda: HermiteInterpolant([0.0, 1.0], np.ones((2, 4))), "1, 2 or 3"),
        (lambda: hermite_basis(0.5, 0), "1, 2 or 3"),
        (lambda: interpolation_error(-1.0, 1.0, 1), "not be negative"),
        (lambda: interpolation_error(1.0, 1.0, 1, "mean"), "'largest' or 'rms'"),
        (lambda: hermite.cell_of(jnp.ones(2), jnp.ones(()), "up"), "'left' or 'right'"),
    ],
)
def test_bad_input_is_one_sentence(make, words):
    with pytest.raises(ValueError, match=words):
        make()


@pytest.mark.parametrize("data", DATA)
def test_a_break_at_an_end_has_two_sides_too(data):
    """At either end of the nodes a break shows the value and the slope of the side asked for."""
    nodes = [0.0, 0.0, 1.0, 1.0]
    curve = HermiteInterpolant(nodes, np.arange(1.0, 1.0 + 4 * data).reshape(4, data))
    for x, left, right in ((0.0, 0, 1), (1.0, 2, 3)):
        for side, row in (("left", left), ("right", right)):
            assert curve(x, side).item() == curve.data[row, 0].item()
            if data > 1:
                slope = jax.grad(lambda x, side=side: curve(x, side))(x)
                assert slope.item() == curve.data[row, 1].item()
