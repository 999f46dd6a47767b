import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.integrate import quad

from firstorder.conventions import FLATLAND, Frame
from firstorder.errors import Refused
from firstorder.fields import Affine, Grid, autodiff_jet
from firstorder.fields.apertures import Bars, Grating, SoftSlit

LEVEL = Affine([0.8, -0.5], 0.15)
WINDOW = Grid.spanning((64, 48), (2.0, 1.5), (0.2, -0.1))
APERTURES = {
    "bars": Bars(LEVEL, [-0.7, -0.2, 0.9], [0.1, 1.0, 0.4, 0.8]),
    "grating": Grating(LEVEL, 0.9, 0.35, 0.2, 0.9),
    "soft slit": SoftSlit(LEVEL, 0.8, 0.2),
}


def along(name):
    """The aperture as a function of its level."""
    n = np.asarray(LEVEL.normal) / np.sum(np.asarray(LEVEL.normal) ** 2)
    at = eqx.filter_jit(APERTURES[name].at)
    return lambda s: float(at(jnp.asarray(n * (s - 0.15))))


@pytest.mark.parametrize("name", APERTURES)
def test_the_series_has_the_integrals_of_its_waves(name):
    """Coefficients against adaptive quadrature over one period, in the level."""
    series = APERTURES[name].series(WINDOW)
    middle = (series.coefficients.size - 1) // 2
    n = np.asarray(LEVEL.normal)
    steps = np.asarray(series.frequencies) @ n / (n @ n)
    period = 1.0 / steps[middle + 1]
    low = 0.15 + n @ [0.2, -0.1] - 0.5 * period
    function = along(name)
    places = [-0.7, -0.2, 0.9]
    if name == "grating":
        places = [0.9 * (k + h * 0.5 * 0.35) for k in range(-6, 7) for h in (-1, 1)]
    if name == "soft slit":
        low = -0.5 * period  # the slit itself is wider than the window
    inside = [p for p in places if low < p < low + period]
    options = {"points": inside, "limit": 200, "epsabs": 1e-12}
    for k in (0, 1, -2, 5):
        turn = 2.0 * np.pi * k / period
        real = quad(lambda s, w=turn: function(s) * np.cos(w * s), low, low + period, **options)[0]
        odd = quad(lambda s, w=turn: function(s) * np.sin(w * s), low, low + period, **options)[0]
        truth = (real - 1j * odd) / period
        truth *= np.exp(2j * np.pi * k * 0.15 / period)  # the level's offset is a phase
        assert abs(series.coefficients[middle + k] - truth) < 1e-8


@pytest.mark.parametrize("side", [-3.0, 3.0])
def test_a_slit_beside_the_window_has_no_image_in_it(side):
    """A period holds the slit and the window: the series is the slit's tail, next to nothing."""
    slit = SoftSlit(Affine([0.8, -0.5], side), 0.8, 0.2)
    series = slit.series(Grid.spanning((192, 144), (2.0, 1.5), (0.2, -0.1)))
    waves, sizes = np.asarray(series.frequencies), np.asarray(series.coefficients)
    for u in ((-0.7, 0.5), (0.1, -0.4), (1.1, -0.8)):
        total = np.sum(sizes * np.exp(2j * np.pi * waves @ u))
        np.testing.assert_allclose(total, slit.at(jnp.array(u)), rtol=0.0, atol=1e-9)


@pytest.mark.parametrize("name", APERTURES)
def test_jets(name):
    field, u = APERTURES[name], jnp.array([0.1, 0.25])
    true = autodiff_jet(field.at, u, FLATLAND)
    np.testing.assert_allclose(field.jet(u).hessian, true.hessian, rtol=0.0, atol=1e-13)
    np.testing.assert_allclose(field.jet(u).gradient, true.gradient, rtol=0.0, atol=1e-13)


@pytest.mark.parametrize("name", ["bars", "grating"])
def test_edges_are_where_and_how_it_jumps(name):
    field = APERTURES[name]
    n = np.asarray(LEVEL.normal) / np.sum(np.asarray(LEVEL.normal) ** 2)
    for edge in field.edges():
        on = jnp.asarray(-float(edge.level.offset) * n)  # level zero
        assert abs(edge.level.at(on)) < 1e-14
        above, below = (field.at(on + s * 1e-6 * n) for s in (1.0, -1.0))
        assert abs(above - below - edge.jump.at(on)) < 1e-12
        # The mean of the sides; rounding may put the ray on either of them, and nowhere else.
        sides = np.array([below, 0.5 * (above + below), above])
        assert np.min(np.abs(field.at(on) - sides)) < 1e-12


def test_a_sharp_aperture_has_no_covariance_and_a_soft_one_has():
    for name in ("bars", "grating"):
        with pytest.raises(Refused, match="an edge has"):
            APERTURES[name].covariance()
    V = along("soft slit")
    h = 1e-5
    slope2 = quad(lambda s: ((V(s + h) - V(s - h)) / (2 * h)) ** 2, -2.5, 2.5, limit=200)[0]
    power = quad(lambda s: V(s) ** 2, -2.5, 2.5, limit=200)[0]
    n = np.asarray(LEVEL.normal)
    expected = slope2 / (4 * np.pi**2 * power) * np.outer(n, n)
    np.testing.assert_allclose(APERTURES["soft slit"].covariance().matrix, expected, rtol=1e-6)


def test_a_thin_slit_has_the_covariance_of_its_blur():
    n = np.asarray(LEVEL.normal)
    bell = np.outer(n, n) / (8.0 * np.pi**2 * 0.2**2)
    for width in (1e-5, 1e-9):
        found = SoftSlit(LEVEL, width, 0.2).covariance().matrix
        np.testing.assert_allclose(found, bell, rtol=1e-8)


@pytest.mark.parametrize(
    ("normal", "frame", "size"),
    [([0.0, 1.0], FLATLAND, (1, 400)), ([1.0], Frame(("theta",)), (400,))],
)
def test_the_power_of_a_comb_is_the_share_that_is_open(normal, frame, size):
    comb = Grating(Affine(normal, 0.0, frame), 0.9, 0.35)
    waves = comb.series(Grid(size, (0.1,) * len(size))).coefficients
    assert np.sum(np.abs(waves) ** 2) == pytest.approx(0.35, abs=2e-3)


@pytest.mark.smoke
def test_bad_apertures_are_one_sentence():
    with pytest.raises(ValueError, match="`heights` must have 3 entries, but has 2"):
        Bars(LEVEL, [0.0, 1.0], [0.0, 1.0])
    with pytest.raises(ValueError, match="`places` must increase"):
        Bars(LEVEL, [1.0, 0.0], [0.0, 1.0, 0.0])
    with pytest.raises(ValueError, match="`open` must be less than 1"):
        Grating(LEVEL, 1.0, 1.5)
    with pytest.raises(ValueError, match="`period` must be positive"):
        Grating(LEVEL, -1.0)
    with pytest.raises(ValueError, match="`blur` must be positive"):
        SoftSlit(LEVEL, 1.0, 0.0)


def test_traced_places_out_of_order_give_nan():
    value = jax.jit(lambda p: Bars(LEVEL, p, [0.1, 1.0, 0.4, 0.8])(0.1, 0.25))
    for places in ((0.9, -0.2, -0.7), (-0.7, 0.9, -0.2), (-0.2, -0.7, 0.9), (-0.7, -0.2, -0.2)):
        assert np.isnan(value(jnp.array(places)))
    assert value(jnp.array([-0.7, -0.2, 0.9])) == pytest.approx(0.4)


@pytest.mark.parametrize(
    ("look", "bad", "good"),
    [
        (lambda p: Grating(LEVEL, p, 0.35)(0.1, 0.25), (-0.9, 0.0), (0.9,)),
        (lambda o: Grating(LEVEL, 0.9, o)(0.1, 0.25), (-0.1, 0.0, 1.0, 1.2), (0.2, 0.9)),
        (lambda w: SoftSlit(LEVEL, w, 0.2)(0.1, 0.25), (-0.8, 0.0), (0.8,)),
        (lambda b: SoftSlit(LEVEL, 0.8, b)(0.1, 0.25), (-0.2, 0.0), (0.2,)),
    ],
)
def test_traced_numbers_that_make_no_aperture_give_nan(look, bad, good):
    look = jax.jit(look)
    assert all(np.isnan(look(number)) for number in bad)
    assert all(np.isfinite(look(number)) for number in good)


def test_parameters_are_differentiable():
    def through(width, blur):
        return SoftSlit(LEVEL, width, blur).at(jnp.array([0.1, 0.2]))

    assert all(np.isfinite(g) for g in jax.grad(through, argnums=(0, 1))(0.8, 0.2))


def test_a_grating_tells_the_edges_of_as_many_teeth_on_both_sides():
    edges = Grating(Affine([1.0, 0.0], 0.0), 0.9, 0.35, teeth=2).edges()
    places = np.sort([-float(edge.level.offset) for edge in edges])
    np.testing.assert_allclose(places, -places[::-1])
    assert places[-1] == pytest.approx(2 * 0.9 + 0.5 * 0.35 * 0.9)
