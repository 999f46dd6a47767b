import functools
import itertools

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from firstorder.checks.tolerance import fitted_order, normwise
from firstorder.conventions import FLATLAND, FLATLAND_SLOPE, SPACE, SPACE_SLOPE, Frame
from firstorder.fields import Constant, GaussianProfile, autodiff_jet, gaussian
from firstorder.laws import Convolve, Move
from firstorder.transport import (
    Curvature,
    Fresnel,
    Schlick,
    Snell,
    Transmission,
    fresnel_reflection,
    refraction,
)

L = gaussian((0.2, -0.1), (0.7, 0.5), 0.4)
ETA = st.floats(0.4, 2.5)
ANGLE = st.floats(-1.5, 1.5)


def amplitudes(eta, t):
    """Power that passes, from the transmitted amplitudes and not from 1 - R."""
    b = np.arcsin(np.sin(t) / eta)
    c, d = np.cos(t), np.cos(b)
    ts, tp = 2 * c / (c + eta * d), 2 * c / (eta * c + d)
    return eta * d / c * 0.5 * (ts**2 + tp**2)


@given(ETA, ANGLE)
def test_energy_is_reflected_or_passes(eta, t):
    R = float(Fresnel(eta)(0.0, t))
    if abs(np.sin(t)) >= 0.999 * eta:
        assert 0.0 <= R <= 1.0
        return
    assert R + amplitudes(eta, t) == pytest.approx(1.0, abs=1e-12)
    assert float(Transmission(eta)(0.0, t)) == pytest.approx(eta * (1 - R), abs=1e-13)


@given(ETA, ANGLE)
def test_reflectance_is_reciprocal(eta, t):
    if abs(np.sin(t)) < 0.999 * eta:
        b = np.arcsin(np.sin(t) / eta)
        back = float(Fresnel(1.0 / eta)(0.0, b))
        assert float(Fresnel(eta)(0.0, t)) == pytest.approx(back, abs=1e-11)


@pytest.mark.parametrize("eta", [1.0, 1.4])
def test_how_the_reflectance_bends_with_the_index(eta):
    """At normal incidence it is ((eta - 1) / (eta + 1))^2: 1 / 2 between equal media."""
    found = jax.grad(jax.grad(lambda e: Fresnel(e)(0.0, 0.0)))(eta)
    assert float(found) == pytest.approx(8.0 * (2.0 - eta) / (eta + 1.0) ** 4, rel=1e-12)


def test_brewster_and_critical_angles():
    eta = 1.5
    s_only = 0.5 * ((1 - eta**2) / (1 + eta**2)) ** 2
    assert float(Fresnel(eta)(0.0, np.arctan(eta))) == pytest.approx(s_only, rel=1e-12)
    critical = np.arcsin(1 / eta)
    assert float(Fresnel(1 / eta)(0.0, critical + 1e-6)) == 1.0
    assert float(Fresnel(1 / eta)(0.0, critical - 1e-3)) < 0.8


def test_it_breaks_at_both_horizons_and_both_critical_angles():
    places = sorted(float(at) for at, _ in Fresnel(1 / 1.5).breaks())
    critical, horizon = np.arcsin(1 / 1.5), 0.5 * np.pi
    np.testing.assert_allclose(places, [-horizon, -critical, critical, horizon], rtol=1e-12)


def by_schlick(t):
    """The polynomial, below the horizon too."""
    return 0.04 + 0.96 * (1.0 - np.cos(t)) ** 5


def by_fresnel(t):
    """Of glass, by its angles of incidence and refraction; below the horizon too."""
    c, d = np.cos(t), np.cos(np.arcsin(np.sin(t) / 1.5))
    return 0.5 * (((c - 1.5 * d) / (c + 1.5 * d)) ** 2 + ((1.5 * c - d) / (1.5 * c + d)) ** 2)


def by_transmission(t):
    return 1.5 * (1.0 - by_fresnel(t))


@pytest.mark.parametrize(
    ("factor", "formula", "below"),
    [
        (Schlick(0.04), by_schlick, 1.0),
        (Fresnel(1.5), by_fresnel, 1.0),
        (Transmission(1.5), by_transmission, 0.0),
    ],
)
def test_at_a_horizon_a_break_is_what_lies_above_it_less_what_lies_below_it(factor, formula, below):
    for side in (-1.0, 1.0):
        horizon = side * 0.5 * np.pi
        jumps = [jump for at, jump in factor.breaks() if abs(at - horizon) < 1e-9]
        for t in horizon + np.array([-0.05, 0.0, 0.05]):
            change, h = lambda t, s=side: s * (below - formula(t)), 1e-4
            values = np.array([change(t + k * h) for k in (-1, 0, 1)])
            slope = (values[2] - values[0]) / (2.0 * h)
            bend = (values[2] - 2.0 * values[1] + values[0]) / h**2
            found = sum(np.array(jump.derivatives(jnp.asarray(t))) for jump in jumps)
            np.testing.assert_allclose(found, [values[1], slope, bend], rtol=2e-6, atol=2e-6)


def test_no_nan_anywhere_on_the_circle():
    angles = jnp.array([0.0, jnp.arcsin(0.7), 0.5 * jnp.pi, -0.5 * jnp.pi, 1.3, 3.0])
    for factor in (Fresnel(0.7), Fresnel(1.0), Fresnel(1.5), Transmission(1.5), Schlick(0.04)):
        jets = factor.jets(0.0, angles)
        assert all(np.all(np.isfinite(leaf)) for leaf in jax.tree.leaves(jets))
        slope = jax.grad(lambda e, f=factor: f.derivatives(jnp.array(0.6))[0] * e)(1.0)
        assert np.isfinite(slope)
    for eta in (0.7, 1.0, 1.5):
        slopes = jax.vmap(jax.grad(lambda t, e=eta: Fresnel(e)(0.0, t)))(angles)
        assert np.all(np.isfinite(slopes))
        assert np.isfinite(jax.grad(lambda e: Fresnel(e)(0.0, 0.6))(eta))


@pytest.mark.parametrize("angle", [2.0, -3.0])
def test_below_the_horizon_all_is_reflected_at_every_angle(angle):
    for factor, value in ((Fresnel(1.5), 1.0), (Schlick(0.04), 1.0), (Transmission(1.5), 0.0)):
        assert [float(a) for a in factor.derivatives(jnp.array(angle))] == [value, 0.0, 0.0]


def test_schlick_is_off_by_at_most_what_its_docstring_says():
    t = jnp.linspace(-0.5 * jnp.pi, 0.5 * jnp.pi, 2001)
    worst = 0.0
    for eta in np.linspace(1.3, 2.0, 8):
        off = np.abs(Schlick(((eta - 1) / (eta + 1)) ** 2)(0.0, t) - Fresnel(eta)(0.0, t))
        worst = max(worst, float(np.max(off)))
        if abs(eta - 1.5) < 1e-9:
            assert 0.035 < np.max(off) < 0.036
    assert 0.06 < worst < 0.07


def test_into_glass_and_out_again_loses_only_what_is_reflected():
    through = (refraction(1.5) >> refraction(1 / 1.5))(L)
    for x, t in ((0.3, 0.2), (0.1, -1.0)):
        passed = 1.0 - float(Fresnel(1.5)(0.0, t))
        assert through(x, t).item() == pytest.approx(passed**2 * L(x, t).item(), rel=1e-12)


@eqx.filter_jit
def jet_of(field, u):
    jet = field.jet(u)
    return jet.value, jet.gradient, jet.hessian


@pytest.mark.parametrize(
    ("eta", "last", "first"),
    [(1.5, np.arcsin(1 / 1.5), 0.5 * np.pi), (0.7, 0.5 * np.pi, np.arcsin(0.7))],
)
def test_beyond_the_last_refracted_angle_the_map_goes_on_with_slope_one(eta, last, first):
    relabelled = Snell(eta)(L)
    for side in (-1.0, 1.0):
        beyond = relabelled(0.2, side * (last + 0.3))
        np.testing.assert_allclose(beyond, L(0.2, side * (first + 0.3)), rtol=1e-12)
        found = jet_of(relabelled, jnp.array([0.2, side * (last + 0.3)]))
        there = jet_of(L, jnp.array([0.2, side * (first + 0.3)]))
        for a, b in zip(found, there, strict=True):
            np.testing.assert_allclose(a, b, rtol=1e-12)


@functools.cache
def fine_rule():
    """Two seconds of work."""
    return np.polynomial.legendre.leggauss(2000)


@pytest.mark.parametrize(("eta", "bound"), [(0.7, 1e-12), (1.5, 1e-5)])
def test_what_is_refracted_is_blurred_as_by_a_fine_sum(eta, bound):
    """Into the denser medium the map is as steep as a root at the last angle."""
    last, sigma, theta = np.arcsin(min(1.0, 1.0 / eta)), 0.2, 0.9
    x, w = fine_rule()
    truth = 0.0
    for low, high in itertools.pairwise((-2.5, -last, last, 2.5)):
        # By sin: the root is smooth in the new variable.
        a = 0.5 * (low + high) + 0.5 * (high - low) * np.sin(0.5 * np.pi * x)
        da = 0.25 * np.pi * (high - low) * np.cos(0.5 * np.pi * x) * w
        front = np.where(
            np.abs(a) < last,
            np.arcsin(np.clip(eta * np.sin(a), -1.0, 1.0)),
            np.sign(a) * (np.arcsin(min(1.0, eta)) + np.abs(a) - last),
        )
        light = np.exp(-0.5 * ((0.3 - 0.1) / 1.0) ** 2 - 0.5 * ((front - 0.2) / 0.8) ** 2)
        truth += np.sum(da * light * np.exp(-0.5 * ((theta - a) / sigma) ** 2))
    truth /= sigma * np.sqrt(2.0 * np.pi)
    blurred = Convolve(GaussianProfile(sigma))(Snell(eta)(gaussian((0.1, 0.2), (1.0, 0.8))))
    assert abs(blurred(0.3, theta) / truth - 1.0) < bound


def test_power_is_kept_through_the_interface():
    """int L_t cos = int (1 - R) L cos for light from the whole half-plane."""
    eta, n = 1.5, 4000
    angles = np.pi * ((np.arange(n) + 0.5) / n - 0.5)
    inside = np.asarray(refraction(eta)(Constant(1.0))(0.0, angles))
    entering = (1.0 - np.asarray(Fresnel(eta)(0.0, angles))) * np.cos(angles)
    assert np.sum(inside * np.cos(angles)) == pytest.approx(np.sum(entering), rel=1e-4)


def test_jet_of_a_curved_interface():
    lens = (Curvature(-0.6) >> refraction(1.5) >> Curvature(-0.6, back=True))(L)
    u = jnp.array([0.3, 0.15])
    closed = eqx.filter_jit(lambda f: f.jet(u))(lens)
    oracle = eqx.filter_jit(lambda f: autodiff_jet(f.at, u, f.frame))(lens)
    assert normwise(closed.hessian, oracle.hessian) < 1e-12


def test_a_curved_interface_focuses_a_parallel_beam_where_opticians_say():
    """A hill of radius R focuses in the glass at R eta / (eta - 1): a ray at x comes from 0."""
    R, eta = 2.0, 1.5
    lens = Curvature(-1 / R) >> Snell(eta) >> Curvature(-1 / R, back=True)
    # The chain of maps: which outer angle does the inner ray (x, theta) come from?
    errors, heights = [], [0.02, 0.04, 0.08]
    for x in heights:
        n = -x / R  # normal of the hill at x, counter-clockwise
        inner = n + np.arcsin(np.sin(-n) / eta)  # refracted ray of a beam from straight above
        f = x / np.tan(-inner) if inner else np.inf
        errors.append(abs(abs(f) / (R * eta / (eta - 1)) - 1.0))
        source = gaussian((x, 0.0), (0.1, 0.1))
        assert lens(source)(x, inner).item() == pytest.approx(1.0, abs=1e-12)
    assert errors[-1] < 1e-3
    assert fitted_order(heights, errors) == pytest.approx(2.0, abs=0.1)


def test_the_linearised_interface_passes_spectra():
    at = jnp.array([0.0, 0.3])
    event = Snell(1.5).linearised(at, 0.05)
    law = event.law(L.frame)
    assert isinstance(law, Move)
    slope = 1.5 * np.cos(0.3) / np.sqrt(1 - (1.5 * np.sin(0.3)) ** 2)
    assert float(law.M[1, 1]) == pytest.approx(slope, rel=1e-12)
    assert float(event.error(L.frame)) < 0.01
    assert np.isfinite(complex(event(L.spectrum())(0.1, 0.2)))


@pytest.mark.smoke
def test_glossy_glass_reflects_less_than_a_mirror():
    out = L.frame.turned()
    glass = fresnel_reflection(1.5, GaussianProfile(0.1, frame=out))(L)
    assert 0.03 < glass(0.2, 0.1).item() < 0.06
    assert fresnel_reflection(1.5)(Constant(1.0))(0.0, 0.0).item() == pytest.approx(0.04)


@pytest.mark.parametrize("make", [Fresnel, Transmission, Snell])
def test_bad_indices_are_one_sentence(make):
    with pytest.raises(ValueError, match=r"`eta` must be positive, but is -1\.0"):
        make(-1.0)
    with pytest.raises(ValueError, match=r"`R0` must lie in \[0, 1\]"):
        Schlick(1.5)


@pytest.mark.parametrize("frame", [FLATLAND_SLOPE, SPACE, SPACE_SLOPE, Frame(("x", "t"))])
def test_light_refracts_by_angles_in_flatland_alone(frame):
    with pytest.raises(ValueError, match="a position and an angle"):
        Snell(1.5).law(frame)
    assert Snell(1.5).law(FLATLAND)


@pytest.mark.parametrize(
    ("look", "bad", "good"),
    [
        (lambda eta: Fresnel(eta)(0.0, 0.2), (0.0, -1.5), (0.7, 1.5)),
        (lambda eta: Transmission(eta)(0.0, 0.2), (0.0, -1.5), (0.7, 1.5)),
        (lambda eta: Snell(eta)(L)(0.1, 0.2), (0.0, -1.5), (0.7, 1.5)),
        (lambda R0: Schlick(R0)(0.0, 0.2), (-0.1, 1.1), (0.0, 1.0)),
        (lambda R0: Schlick(R0).derivatives(jnp.array(0.2))[2], (-0.1, 1.1), (0.0, 1.0)),
    ],
)
def test_traced_numbers_that_make_no_interface_give_nan(look, bad, good):
    look = jax.jit(look)
    assert all(np.isnan(look(number)) for number in bad)
    assert all(np.isfinite(look(number)) for number in good)


def test_many_indices_are_mapped_over():
    with pytest.raises(ValueError, match=r"^Argument `eta` must be one number, but has shape \(2,"):
        Snell(np.array([1.2, 1.5]))(gaussian((0.0, 0.0), (1.0, 1.0)))
