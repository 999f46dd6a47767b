import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.integrate import dblquad

from firstorder.conventions import FLATLAND, FLATLAND_SLOPE, direction
from firstorder.errors import Refused
from firstorder.fields import (
    BoxProfile,
    DiracProfile,
    GaussianProfile,
    Separable,
    UniformProfile,
    gaussian,
    point_light,
    spot_light,
)
from firstorder.laws import Convolve, Integrate
from firstorder.transport import Travel
from firstorder.transport.events.travel import line_light

FALLOFF = ("v", FLATLAND_SLOPE)


def bell(sigma=0.3):
    return GaussianProfile(sigma, *FALLOFF)


def test_a_point_has_a_flat_spectrum_and_no_value():
    point = point_light(0.2, bell(), 1.7)
    Omega_x = np.linspace(-50.0, 50.0, 9)
    F = point.spectrum()(Omega_x, 0.4)
    np.testing.assert_allclose(np.abs(F), 1.7 * np.exp(-2 * (np.pi * 0.3 * 0.4) ** 2))
    np.testing.assert_allclose(
        np.angle(F / np.exp(-2j * np.pi * Omega_x * 0.2)), 0.0, rtol=0.0, atol=1e-12
    )
    for ask in (lambda: point(0.2, 0.0), lambda: point.jets(0.2, 0.0)):
        with pytest.raises(Refused, match="a Dirac in x has no value"):
            ask()
    with pytest.raises(Refused, match="infinite covariance"):
        point.covariance()


def test_an_isotropic_point_is_a_dirac_in_direction():
    with pytest.raises(Refused, match="Dirac in Omega_v: window it"):
        point_light(0.2, UniformProfile(*FALLOFF)).spectrum()


def test_uniform_light_along_no_ray_is_no_number():
    u = jnp.array([0.0, jnp.nan])
    jet = UniformProfile(*FALLOFF, 2.0).jet(u)
    assert np.isnan(jet.value)
    assert np.all(np.isnan(jet.gradient[1]))


def test_a_point_that_travels_becomes_a_line_in_frequency():
    F = Travel(2.0)(point_light(0.0, bell()).spectrum())
    # All that is left of Omega_v = b is sheared to Omega_v + d Omega_x = b.
    np.testing.assert_allclose(F(3.0, 0.4 - 2.0 * 3.0), F(0.0, 0.4), rtol=1e-12)


def test_a_spot_shrinks_to_a_point():
    point = complex(point_light(0.2, bell()).spectrum()(1.5, 0.4))
    sizes = np.array([0.04, 0.02])
    spots = [complex(spot_light(0.2, s, bell()).spectrum()(1.5, 0.4)) / (2 * s) for s in sizes]
    errors = np.abs(np.array(spots) - point)
    assert np.log2(errors[0] / errors[1]) == pytest.approx(2.0, abs=0.01)


def test_a_spots_spectrum_by_quadrature():
    spot, Omega = spot_light(0.2, 0.5, GaussianProfile(0.3, *FALLOFF, 0.8)), (0.7, -0.4)
    parts = [
        dblquad(
            lambda v, x, g=g: 0.8 / (0.3 * np.sqrt(2 * np.pi)) * np.exp(-(v**2) / 0.18)
            * g(2 * np.pi * (Omega[0] * x + Omega[1] * v)),
            -0.3, 0.7, -3.0, 3.0, epsabs=1e-11,
        )[0]
        for g in (np.cos, np.sin)
    ]  # fmt: skip
    assert complex(spot.spectrum()(*Omega)) == pytest.approx(
        complex(parts[0], -parts[1]), abs=1e-10
    )


def test_the_edges_of_a_bulb_at_a_height_blur_into_a_penumbra():
    """Irradiance of a bulb through its falloff: a difference of error functions, edges split."""
    from scipy.special import erf

    spot = line_light(spot_light(0.2, 0.5, bell()), 2.0)
    E = Integrate("v", -3.0, 3.0, 32)(spot)
    x = np.linspace(-1.0, 1.4, 5)
    ends = [(x - 0.2 + side * 0.5) / 2.0 for side in (1.0, -1.0)]
    truth = 0.5 * (erf(ends[0] / 0.3 / np.sqrt(2)) - erf(ends[1] / 0.3 / np.sqrt(2)))
    jets = jax.jit(lambda x: E.jets(x))(x)
    np.testing.assert_allclose(jets.value, truth, rtol=0.0, atol=1e-12)
    slopes = [np.exp(-0.5 * (e / 0.3) ** 2) / (0.3 * np.sqrt(2 * np.pi)) / 2.0 for e in ends]
    np.testing.assert_allclose(jets.gradient[:, 0], slopes[0] - slopes[1], rtol=0.0, atol=1e-12)


@pytest.mark.parametrize("frame", [FLATLAND, FLATLAND_SLOPE])
def test_a_line_light_is_seen_where_the_ray_meets_it(frame):
    emission, x, a, height = gaussian((0.2, -0.1), (0.5, 0.4), 0.3, 1.0, frame), 0.7, 0.3, 1.5
    toward = np.asarray(direction(jnp.array(a)))
    there = x + toward[0] * height / toward[1]
    label = np.tan(a) if frame.uses_slopes else a
    ours = line_light(emission, height)(x, label)
    assert float(ours) == pytest.approx(float(emission(there, label)), abs=1e-12)


def test_a_box_is_a_kernel_too():
    blur = Convolve(BoxProfile(0.5, "x", FLATLAND), nodes=24)(gaussian((0.2, -0.1), (0.5, 0.4)))
    from scipy.special import erf

    ends = (np.array([0.8, -0.2]) - 0.2) / 0.5 / np.sqrt(2)
    truth = 0.5 * np.sqrt(np.pi / 2) * (erf(ends[0]) - erf(ends[1]))
    assert float(blur(0.3, -0.1)) == pytest.approx(truth, abs=1e-12)


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: BoxProfile(0.0, "x"), "`width` must be positive, but is 0.0"),
        (lambda: BoxProfile(1.0, "z"), "`axis` must be one of x, v, but is 'z'"),
        (lambda: spot_light(0.0, -1.0, bell()), "`half_width` must be positive, but is -1.0"),
        (lambda: line_light(gaussian((0, 0), (1, 1)), -1.0), "`d` must not be negative"),
        (lambda: Separable([0.0, 0.0], (bell(), DiracProfile("x"))), "`factors` must act along"),
        (lambda: Separable([0.0], (DiracProfile("x"), bell())), r"`center` must have shape \(2,\)"),
        (lambda: point_light(np.nan, bell()), "`center` must be finite"),
    ],
)
def test_bad_input(make, words):
    with pytest.raises(ValueError, match=words):
        make()


def test_a_traced_box_without_inside_has_no_spectrum_and_no_edges():
    @jax.jit
    def told(width):
        box = BoxProfile(width, "x")
        return jnp.stack([box.transform(jnp.asarray(0.3)), box.edges()[0].level(0.1, 0.2)])

    assert np.isnan(told(-0.5)).all()
    assert np.isfinite(told(0.5)).all()
