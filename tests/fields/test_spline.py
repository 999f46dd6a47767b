import functools
import itertools

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.interpolate import CubicSpline

from firstorder.checks.tolerance import fitted_order, normwise
from firstorder.conventions import FLATLAND, SPACE, Frame
from firstorder.errors import Refused
from firstorder.fields import Gaussian, Grid, Spline, covariance_of_samples, gaussian
from firstorder.numerics._batching import batched

ANGLE = Frame(("theta",))
RAYS = jnp.asarray(np.random.default_rng(0).uniform(-1.1, 1.1, (150, 2)))


def light():
    return gaussian((0.21, -0.13), (0.45, 0.4), 0.35, 1.3)


@functools.cache
def errors(boundary, half_width):
    """Largest errors of value, gradient and Hessian at the rays, sizes doubling."""
    truth = jax.jit(batched(light().jet))(RAYS)
    found = []
    for n in (48, 96, 192):
        table = Spline.of(light(), Grid.spanning((n, n + 1), half_width), boundary)
        ours = jax.jit(batched(table.jet))(RAYS)
        parts = ("value", "gradient", "hessian")
        found.append([normwise(getattr(ours, p), getattr(truth, p)) for p in parts])
    return np.array(found)


@pytest.mark.parametrize(
    ("boundary", "half_width"),
    [("zero", (3.4, 3.2)), ("periodic", (3.4, 3.2)), ("open", (1.2, 1.15))],
)
def test_orders_of_convergence_are_four_three_two(boundary, half_width):
    found = errors(boundary, half_width)
    for k, order in enumerate((4.0, 3.0, 2.0)):
        assert -fitted_order([48, 96, 192], found[:, k]) == pytest.approx(order, abs=0.25)


def test_zero_is_wrong_where_light_does_not_end():
    assert errors("zero", (1.2, 1.15))[-1, 0] > 100 * errors("open", (1.2, 1.15))[-1, 0]


def test_it_goes_through_its_samples():
    grid = Grid((9, 8), (0.3, 0.2), (0.1, -0.2))
    samples = np.random.default_rng(1).normal(size=grid.size)
    for boundary in ("zero", ("periodic", "open")):
        table = Spline(samples, grid, FLATLAND, boundary)
        np.testing.assert_allclose(grid.sample(table), samples, rtol=0.0, atol=1e-12)


@pytest.mark.parametrize(("boundary", "kind"), [("open", "not-a-knot"), ("periodic", "periodic")])
def test_it_is_scipys_spline(boundary, kind):
    grid = Grid((8,), (0.3,), (0.1,))
    samples = np.random.default_rng(2).normal(size=8)
    table = Spline(samples, grid, ANGLE, boundary)
    knots, values = grid.axis(0), samples
    if boundary == "periodic":
        knots, values = np.append(knots, knots[0] + 2.4), np.append(values, values[0])
    spline = CubicSpline(knots, values, bc_type=kind)
    t = np.linspace(knots[0], knots[7], 50)
    jets = table.jets(t)
    for ours, order in ((jets.value, 0), (jets.gradient[:, 0], 1), (jets.hessian[:, 0, 0], 2)):
        np.testing.assert_allclose(ours, spline(t, order), rtol=0.0, atol=1e-11)


def test_what_holds_beyond_the_samples():
    ones, grid = np.ones((6, 6)), Grid((6, 6), (1.0, 1.0))
    far, near = (5.0, 0.0), (2.9, 0.0)  # the last sample lies at 2.5
    assert Spline(ones, grid)(*far) == 0.0
    assert np.isnan(Spline(ones, grid, FLATLAND, "open")(*far))
    assert Spline(ones, grid, FLATLAND, "open")(*near) == pytest.approx(1.0)
    circle = Spline(np.random.default_rng(0).normal(size=(6, 6)), grid, FLATLAND, "periodic")
    np.testing.assert_allclose(circle(*far), circle(-1.0, 6.0), rtol=0.0, atol=1e-13)


def test_an_open_table_refuses_what_it_cannot_know():
    table = Spline(np.ones((6, 6)), Grid((6, 6), (1.0, 1.0)), FLATLAND, ("zero", "open"))
    for portrait in (table.spectrum, table.covariance):
        with pytest.raises(Refused, match="does not know what lies beyond"):
            portrait()


def test_differentiable_in_the_samples():
    grid, u = Grid((6, 7), (0.3, 0.4)), jnp.array([0.1, 0.2])
    samples = jnp.asarray(np.random.default_rng(3).normal(size=grid.size))

    def bend(s):
        return Spline(s, grid).jet(u).hessian[0, 1]

    slope = jax.jit(jax.grad(bend))(samples)
    direction = jnp.asarray(np.random.default_rng(4).normal(size=grid.size))
    # The spline is linear in its samples: a difference of any size is the derivative.
    assert jnp.sum(slope * direction) == pytest.approx(
        float(bend(samples + direction) - bend(samples)), abs=1e-11
    )


def test_covariance_and_spectrum_are_those_of_the_spline():
    """Between its knots the spline is cubic: Gauss-Legendre there is exact for the products."""
    table = Spline.of(light(), Grid.spanning((14, 15), (2.4, 2.2), (0.2, -0.1)))
    t, w = np.polynomial.legendre.leggauss(10)
    points, weights = [], []
    for i, h in enumerate(table.grid.step):
        knots = table.grid.axis(i)[0] + h * np.arange(-2, table.grid.size[i] + 2)
        middle = 0.5 * (knots[1:] + knots[:-1])
        points.append((middle[:, None] + 0.5 * h * t).ravel())
        weights.append(np.tile(0.5 * h * w, len(middle)))
    X = jnp.asarray(np.stack(np.meshgrid(*points, indexing="ij"), -1))
    W = weights[0][:, None] * weights[1]
    jets = jax.jit(batched(table.jet))(X)
    g = np.asarray(jets.gradient)
    truth = np.einsum("ij,ija,ijb->ab", W, g, g) / (4 * np.pi**2 * np.sum(W * jets.value**2))
    np.testing.assert_allclose(table.covariance().matrix, truth, rtol=1e-12)
    Omega = np.array([0.7, -0.4])
    F = np.sum(W * jets.value * np.exp(-2j * np.pi * (X @ Omega)))
    assert complex(table.spectrum()(*Omega)) == pytest.approx(complex(F), abs=1e-12)


def test_on_a_circle_the_spectrum_holds_at_its_harmonics():
    n = 32
    grid = Grid((n,), (2 * np.pi / n,))
    table = Spline(np.exp(np.cos(grid.axis(0) - 0.4)), grid, ANGLE, "periodic")
    theta = np.linspace(-np.pi, np.pi, 4001)[:-1]
    for m in (0, 1, -3):
        truth = np.sum(np.asarray(table(theta)) * np.exp(-1j * m * theta)) * 2 * np.pi / 4000
        assert complex(table.spectrum()(m / (2 * np.pi))) == pytest.approx(truth, abs=1e-9)
    fine = Grid((256,), (2 * np.pi / 256,))
    by_samples = covariance_of_samples(fine.sample(table), fine, ANGLE).matrix
    np.testing.assert_allclose(table.covariance().matrix, by_samples, rtol=1e-6)


def test_four_dimensions():
    f = Gaussian([0.1, -0.1, 0.2, 0.0], 2.0 * np.eye(4) + 0.3, 1.0, SPACE)
    table = Spline.of(f, Grid.spanning((16, 17, 16, 17), (3.2,) * 4))
    u = jnp.asarray(np.random.default_rng(5).normal(size=(50, 4)) * 0.4)
    assert normwise(jax.jit(batched(table.at))(u), batched(f.at)(u)) < 4e-3
    assert normwise(table.spectrum()(0.1, 0.2, -0.1, 0.2), f.spectrum()(0.1, 0.2, -0.1, 0.2)) < 4e-3


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ((np.ones((4, 5)), Grid((5, 4), (1.0, 1.0))), r"`samples` must have shape \(5, 4\)"),
        ((np.full((4, 4), np.nan), Grid((4, 4), (1.0, 1.0))), "`samples` must be finite"),
        (
            (np.ones((3, 4)), Grid((3, 4), (1.0, 1.0))),
            "`grid` must have 4 samples along every axis",
        ),
        ((np.ones(4), Grid((4,), (1.0,))), "`grid` must have 2 axes, but has 1"),
        (
            (np.ones((4, 4)), Grid((4, 4), (1.0, 1.0)), FLATLAND, "clamp"),
            "`boundary` must name one",
        ),
    ],
)
def test_bad_input(arguments, words):
    with pytest.raises(ValueError, match=words):
        Spline(*arguments)


def test_a_table_reaches_two_steps_beyond_its_samples_and_hardly_farther():
    table = Spline(np.ones((6, 5)), Grid((6, 5), (0.2, 0.3)))
    extent = table.spectrum().extent()
    assert extent is not None
    _, high = extent.along([1.0, 0.0])
    assert 0.5 + 0.4 <= high < 0.5 + 0.4 + 0.15


def test_the_gradient_bends_at_the_nodes_as_the_hessian_says():
    """There |t| has no derivative, and `jnp.sign` and that of `jnp.abs` tell of it differently."""
    samples = np.random.default_rng(2).normal(size=(6, 7))
    grid = Grid((6, 7), (0.2, 0.3))
    table = Spline(samples, grid)
    ways = [jax.jit(way(lambda u: table.jet(u).gradient)) for way in (jax.jacfwd, jax.jacrev)]
    hessian = jax.jit(lambda u: table.jet(u).hessian)
    for u in itertools.product(grid.axis(0)[2:4], grid.axis(1)[2:4]):
        for bend in ways:
            np.testing.assert_allclose(
                bend(np.array(u)), hessian(np.array(u)), rtol=1e-9, atol=1e-9
            )


@pytest.mark.parametrize("level", [0, 3])
def test_at_nodes_that_a_turn_leads_to_numbers_and_weights_belong_together(level):
    """A compiler may round such a place to both sides of a node in one program."""
    rng = np.random.default_rng(3)
    grid = Grid((9, 9), (0.1, 0.1))
    table = Spline(rng.normal(size=(9, 9)), grid)
    nodes = np.asarray(grid.axis(0))[rng.integers(0, 9, (2000, 2))]
    angle, shift = rng.uniform(0.0, 6.0, 2000), rng.normal(size=(2000, 2))
    c, s = np.cos(angle), np.sin(angle)
    turn = np.stack([np.stack([c, -s], -1), np.stack([s, c], -1)], 1)

    def at(p, turn, shift):
        (a, b), (c, d), (x, y) = *turn, p - shift
        return jnp.stack([a * x + c * y, b * x + d * y])

    def jet(*place):
        return table.jet(at(*place))

    compiled = jax.jit(jax.vmap(jet), compiler_options={"xla_backend_optimization_level": level})
    found = compiled(np.einsum("nij,nj->ni", turn, nodes) + shift, turn, shift)
    there = jax.vmap(table.jet)(nodes)
    for part in ("value", "gradient", "hessian"):
        true = getattr(there, part)
        size = np.max(np.abs(true))
        np.testing.assert_allclose(getattr(found, part), true, rtol=0.0, atol=1e-9 * size)
