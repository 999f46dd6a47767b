"""Edges behind one another: parallel ones are one stair, and their spectrum is exact."""

import functools

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.integrate import quad
from scipy.special import erf

from firstorder.checks.cases import light
from firstorder.conventions import FLATLAND_SLOPE as FRAME
from firstorder.fields import Affine, Bars, Grid, HalfPlane, gaussian, half_plane
from firstorder.laws import Move, Multiply
from firstorder.laws._stairs import Stair, merged, steps_of
from firstorder.transport import Occlusion, PlanarBlockers, Travel, slit_blocker

W = 0.5, -0.8
WINDOW = Grid.spanning((256, 1), (6.0, 6.0))
ROUNDING = 64.0 * np.finfo(float).eps


def found_steps(field):
    """The steps of a field that has some."""
    steps = steps_of(field)
    assert steps is not None
    return steps


def edge(at, left, right, depth=0.0, window=WINDOW):
    return Occlusion(half_plane(at, left, right, "x", FRAME), depth, window)


def compiled(F, *frequencies):
    """With everything traced, so that nobody can see which levels are parallel."""
    return eqx.filter_jit(lambda F, w: F(*w))(F, frequencies)


def stair(level, places, heights):
    places, heights = jnp.asarray(places, float), jnp.asarray(heights, float)
    return Stair(level, places, heights, jnp.asarray(-5.0), jnp.asarray(4.0), 8)


BEHIND = {
    "in one plane": edge(0.2, 0.0, 1.0) >> edge(0.2, 1.0, 0.0),
    "with travel before": Travel(1.0) >> edge(0.2, 0.0, 1.0) >> edge(0.2, 1.0, 0.0),
    "with travel between": edge(0.2, 0.0, 1.0) >> Travel(0.7) >> edge(0.2, 1.0, 0.0, 0.7),
    "with smooth light between": (
        edge(0.2, 0.0, 1.0) >> Travel(0.7) >> edge(-1.0, 0.5, 1.0) >> edge(0.2, 1.0, 0.0, 0.7)
    ),
    "as layers": PlanarBlockers(
        (half_plane(0.2, 0.0, 1.0, "x", FRAME), half_plane(0.2, 1.0, 0.0, "x", FRAME)),
        [0.4, 0.4],
        WINDOW,
    ),
    "without a window": edge(0.2, 0.0, 1.0, window=None) >> edge(0.2, 1.0, 0.0, window=None),
}


@pytest.mark.parametrize("name", BEHIND)
@pytest.mark.parametrize("ask", [lambda F, *w: F(*w), compiled], ids=["eager", "traced"])
def test_complementary_half_planes_are_dark(name, ask):
    F = BEHIND[name](light(FRAME)).spectrum()
    total = abs(light(FRAME).spectrum()(0.0, 0.0))
    assert abs(ask(F, *W)) < ROUNDING * total


@pytest.mark.parametrize("waves", [96, 256])
@pytest.mark.parametrize("ask", [lambda F, *w: F(*w), compiled], ids=["eager", "traced"])
def test_two_edges_are_a_slit(waves, ask):
    """By quadrature of what each line of constant x holds: nothing of it is a Fourier series."""
    window = Grid.spanning((waves, 1), (5.0, 5.0))
    L = gaussian((0.21, -0.13), (0.55, 0.4), 0.35, 1.3, FRAME)
    path = edge(-0.3, 0.0, 1.0, window=window) >> Travel(0.7) >> edge(0.4, 1.0, 0.0, 0.7, window)
    P, c = np.asarray(L.precision), np.asarray(L.center)

    def across(x):
        """`int L(x, v) exp(-2 pi i (W_x x + W_v v)) dv`, with the frequencies before the travel."""
        w = np.array([W[0], W[1] + 0.7 * W[0]])
        a, h = P[1, 1], x - c[0]
        mean = c[1] - P[0, 1] * h / a
        rest = np.exp(-0.5 * (P[0, 0] - P[0, 1] ** 2 / a) * h**2)
        wave = np.exp(-2j * np.pi * (w[0] * x + w[1] * mean) - 2.0 * np.pi**2 * w[1] ** 2 / a)
        return 1.3 * rest * np.sqrt(2.0 * np.pi / a) * wave

    parts = [
        quad(lambda x, p=p: p(across(x)), -0.3, 0.4, epsabs=1e-14)[0] for p in (np.real, np.imag)
    ]
    assert abs(ask(path(L).spectrum(), *W) - complex(*parts)) < 1e-13


def test_a_slit_of_two_edges_is_the_slit_blocker():
    L = light(FRAME)
    two = (edge(-0.4, 0.25, 1.0) >> edge(0.6, 1.0, 0.25))(L).spectrum()
    one = slit_blocker(-0.4, 0.6, FRAME, 0.25, 0.0, WINDOW)(L).spectrum()
    assert abs(two(*W) - one(*W)) < 1e-14


def test_edges_that_are_not_parallel_stay_two():
    """Nothing is left of a bell between two lines that cross: the quarter that is, is known."""
    L = gaussian((0.0, 0.0), (0.5, 0.5), 0.0, 1.0, FRAME)
    quarter = edge(0.0, 0.0, 1.0) >> Occlusion(half_plane(0.0, 0.0, 1.0, "v", FRAME), 0.0, WINDOW2)
    F = quarter(L).spectrum()
    expected = 0.25 * 2.0 * np.pi * 0.25
    assert abs(F(0.0, 0.0) - expected) < 1e-12
    assert abs(compiled(F, 0.0, 0.0) - expected) < 1e-12


WINDOW2 = Grid.spanning((128, 128), (5.0, 5.0))


def test_the_derivative_of_a_slit_in_its_edges():
    """`d/dp int_a^p = ` the light on the edge: the error function, and not the code, says so."""
    L = gaussian((0.1, 0.0), (0.5, 0.4), 0.0, 1.0, FRAME)

    def through(p):
        return jnp.real((edge(-0.3, 0.0, 1.0) >> edge(p, 1.0, 0.0))(L).spectrum()(0.0, 0.0))

    open_to = 0.5 * (erf((0.4 - 0.1) / (0.5 * np.sqrt(2))) - erf((-0.3 - 0.1) / (0.5 * np.sqrt(2))))
    assert abs(through(0.4) - open_to * 2.0 * np.pi * 0.2) < 1e-12
    slope = np.exp(-0.5 * ((0.4 - 0.1) / 0.5) ** 2) * np.sqrt(2.0 * np.pi) * 0.4
    assert abs(jax.grad(through)(0.4) - slope) < 1e-10


def test_products_of_stairs_are_products_of_values():
    """Levels of other scale, other sign and other offset; the values are asked for one by one."""
    a = Bars(Affine([1.0, 0.5], 0.2, FRAME), [-1.0, 0.3, 0.9], [0.2, 1.0, 0.5, 0.7])
    b = Bars(Affine([-2.0, -1.0], 0.7, FRAME), [-0.9, 0.1], [0.3, 0.9, 0.6])
    product = merged([stair(*found_steps(f)) for f in (a, b)])
    assert len(product) == 1
    both = Bars(product[0].level, product[0].places, product[0].heights)
    x, v = np.meshgrid(np.linspace(-2.0, 2.0, 29), np.linspace(-1.0, 1.0, 13))
    np.testing.assert_allclose(both(x, v), a(x, v) * b(x, v), rtol=1e-14)
    # The period is what both share: level b from -5 to 4 is level a from -1.45 to 3.05.
    np.testing.assert_allclose([product[0].low, product[0].high], [-1.45, 3.05], rtol=1e-14)


@pytest.mark.parametrize("scale", [1e-8, 1e8])
def test_whether_levels_are_parallel_does_not_depend_on_their_units(scale):
    a = stair(Affine([0.3, 0.7], 0.0, FRAME), [0.0], [0.0, 1.0])
    for normal, count in (((0.1, 0.7 / 3.0), 1), ((0.3, 0.6), 2)):
        b = stair(Affine(scale * np.array(normal), 0.0, FRAME), [0.0], [0.0, 1.0])
        assert len(merged([a, b])) == count


def test_traced_levels_give_the_same_product():
    a, b = half_plane(0.2, 0.1, 1.0, "x", FRAME), half_plane(0.5, 1.0, 0.3, "x", FRAME)
    for normal, parallel in (((-3.0, 0.0), True), ((1.0, 0.1), False)):
        c = HalfPlane(Affine(normal, 0.4, FRAME), 0.2, 0.6)

        def series(fields):
            kept = merged([stair(*found_steps(f)) for f in fields])
            return [
                Bars(Affine(s.level.normal, s.level.offset, FRAME), s.places, s.heights)
                for s in kept
            ]

        kept = jax.jit(series)((a, b, c))
        x, v = np.linspace(-1.0, 1.0, 18), 0.3
        values = [sum_of(f, x, v) for f in kept]
        np.testing.assert_allclose(np.prod(values, axis=0), a(x, v) * b(x, v) * c(x, v), rtol=1e-14)
        assert bool(np.all(values[-1] == 1.0)) is parallel


def sum_of(stairs, x, v):
    """Values of a stair, equal places included, which `Bars` itself refuses."""
    s = np.asarray(stairs.level(x, v))
    k = np.sum(s[..., None] > np.asarray(stairs.places), axis=-1)
    return np.asarray(stairs.heights)[k]


def test_steps_are_found_through_moves_and_nowhere_else():
    mask = half_plane(0.3, 0.1, 1.0, "x", FRAME)
    level, places, heights = found_steps(Move([[2.0, 0.5], [0.0, 1.0]])(mask))
    np.testing.assert_allclose(level.normal, [2.0, 0.5])
    assert places.tolist() == [0.0]
    assert heights.tolist() == [0.1, 1.0]
    assert steps_of(light(FRAME)) is None
    assert steps_of(Multiply(mask)(light(FRAME))) is None


@pytest.mark.parametrize("unit", [1e-6, 1.0, 1e6])
def test_which_edges_are_parallel_does_not_depend_on_the_unit(unit):
    """Behind `x + v > 0` and `x + 3 v > 0` lies the share of a quadrant aslant."""
    f = functools.partial(np.asarray, dtype="float32")
    F = gaussian(f([0.0, 0.0]), f([unit, 1.0]), frame=FRAME).spectrum()
    for slope in (1.0, 3.0):
        edge = HalfPlane(Affine(f([1.0, slope * unit]), f(0.0), FRAME), f(0.0), f(1.0))
        F = Multiply(edge, waves=128)(F)
    share = complex(F(f(0.0), f(0.0))) / (2.0 * np.pi * unit)
    assert abs(share - 0.25 - np.arcsin(4.0 / np.sqrt(20.0)) / (2.0 * np.pi)) < 5e-3
