import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import dblquad
from scipy.special import eval_legendre

from firstorder.checks.tolerance import fitted_order
from firstorder.laws import VonMisesFisher, Zonal, ZonalCosine
from firstorder.laws.zonal import _tangents

BELL = Zonal(VonMisesFisher(7.0))
DIFFUSE = Zonal(ZonalCosine(), 24, 32)
LOBES = pytest.mark.parametrize("law", [BELL, DIFFUSE], ids=["bell", "clamped cosine"])


def light(w):
    """Smooth, and without any symmetry."""
    x, y, z = w
    return jnp.exp(0.9 * x - 0.4 * y * z + 0.3 * z) + 0.2 * y**3


def unit(*w):
    return jnp.asarray(w) / jnp.linalg.norm(jnp.asarray(w))


W = unit(0.5, -0.3, 0.7)

# Real spherical harmonics (any scale) with their orders.
HARMONICS = (
    (0, lambda w: 1.0 + 0.0 * w[0]),
    (1, lambda w: w[0] - 2.0 * w[2]),
    (2, lambda w: w[0] * w[1]),
    (3, lambda w: w[0] * (5.0 * w[2] ** 2 - 1.0)),
    (4, lambda w: (w[0] ** 2 - w[1] ** 2) * (7.0 * w[2] ** 2 - 1.0)),
)


@LOBES
def test_the_jet_is_that_of_the_value_along_great_circles(law):
    """Autodiff puts the derivatives on the light, the closed form on the kernel."""
    jet = jax.jit(lambda w: law.jet(light, w))(W)
    e1, e2 = _tangents(W)

    def along(s, a):
        e = jnp.cos(a) * e1 + jnp.sin(a) * e2
        return law.value(light, W * jnp.cos(s) + e * jnp.sin(s))

    slope, bend = jax.grad(along), jax.grad(jax.grad(along))
    for a in (0.0, 0.8, 2.1):
        e = jnp.cos(a) * e1 + jnp.sin(a) * e2
        np.testing.assert_allclose(e @ jet.gradient, jax.jit(slope)(0.0, a), rtol=0.0, atol=1e-10)
        np.testing.assert_allclose(e @ jet.hessian @ e, jax.jit(bend)(0.0, a), rtol=0.0, atol=1e-10)
    np.testing.assert_allclose(jet.gradient @ W, 0.0, rtol=0.0, atol=1e-14)
    np.testing.assert_allclose(jet.hessian @ W, 0.0, rtol=0.0, atol=1e-13)
    np.testing.assert_allclose(jet.value, law.value(light, W), rtol=1e-13)


@LOBES
def test_a_spherical_harmonic_is_multiplied_by_funk_and_hecke(law):
    multipliers = law.multipliers(4)
    for order, harmonic in HARMONICS:
        np.testing.assert_allclose(
            law.value(harmonic, W), multipliers[order] * harmonic(W), rtol=0.0, atol=1e-12
        )
        # -Laplacian has the eigenvalue l (l + 1): a check of the Hessian's trace
        trace = jnp.trace(law.jet(harmonic, W).hessian)
        expected = -order * (order + 1) * multipliers[order] * harmonic(W)
        np.testing.assert_allclose(trace, expected, rtol=0.0, atol=1e-10)


def test_the_multipliers_of_the_clamped_cosine_are_the_known_ones():
    """1, 2/3, 1/4, 0, -1/24: Ramamoorthi and Hanrahan 2001."""
    np.testing.assert_allclose(
        DIFFUSE.multipliers(4), [1.0, 2.0 / 3.0, 0.25, 0.0, -1.0 / 24.0], rtol=0.0, atol=1e-14
    )


def test_the_multipliers_of_the_bell_are_those_of_scipy():
    t, w = np.polynomial.legendre.leggauss(60)
    k = 7.0
    rho = k / (2 * np.pi * (1 - np.exp(-2 * k))) * np.exp(k * (t - 1))
    expected = [2 * np.pi * np.sum(w * rho * eval_legendre(n, t)) for n in range(6)]
    np.testing.assert_allclose(BELL.multipliers(5), expected, rtol=0.0, atol=1e-13)


@LOBES
def test_rotating_the_light_rotates_the_result(law):
    """(J f) * rho = J (f * rho) for the generator of every rotation: w x grad commutes."""

    def generated(w):  # the three components of w x grad f, scalars each
        return jnp.cross(w, jax.grad(light)(w))

    left = jnp.stack([law.value(lambda w, i=i: generated(w)[i], W) for i in range(3)])
    right = jnp.cross(W, law.jet(light, W).gradient)
    np.testing.assert_allclose(left, right, rtol=0.0, atol=1e-11)


def added_by_component(law):
    """The tangent gradient of the light, convolved component by component, and the true one."""

    def tangent(w):
        g = jax.grad(light)(w)
        return g - (g @ w) * w

    P = jnp.eye(3) - W[:, None] * W
    added = P @ jnp.stack([law.value(lambda w, i=i: tangent(w)[i], W) for i in range(3)])
    true = law.jet(light, W).gradient
    return jnp.linalg.norm(added - true) / jnp.linalg.norm(true)


def test_adding_tangent_vectors_by_component_is_wrong_by_the_fourth_power_of_the_width():
    """What R07's footnote 1 warns of, and why it may say that it serves in practice.

    The second order cancels: the projected Laplacian of the components of a tangent gradient is
    the rough Laplacian less the gradient, and by Bochner's formula that is grad(Laplace f).
    """
    widths = np.array([0.2, 0.1, 0.05])
    errors = jax.jit(jax.vmap(lambda w: added_by_component(Zonal(VonMisesFisher(1.0 / w**2)))))(
        widths
    )
    assert errors[0] > 1e-3
    np.testing.assert_allclose(fitted_order(widths, errors), 4.0, rtol=0.0, atol=0.1)


def test_the_value_is_that_of_adaptive_quadrature():
    def integrand(phi, theta):
        s = np.sin(theta)
        x, y, z = s * np.cos(phi), s * np.sin(phi), np.cos(theta)
        f = np.exp(0.9 * x - 0.4 * y * z + 0.3 * z) + 0.2 * y**3
        k, t = 7.0, float(W[0]) * x + float(W[1]) * y + float(W[2]) * z
        return f * k * np.exp(k * (t - 1)) / (2 * np.pi * (1 - np.exp(-2 * k))) * s

    truth = dblquad(integrand, 0, np.pi, 0, 2 * np.pi, epsabs=1e-9)[0]
    np.testing.assert_allclose(BELL.value(light, W), truth, rtol=0.0, atol=1e-8)


@given(st.sampled_from([(0, 0, 1), (0, 0, -1), (1, 0, 0), (0, -1, 0), (-1, 1, -1e-9)]))
def test_no_nan_at_poles_and_axes(w):
    jet = _jet(unit(*map(float, w)))
    assert all(bool(jnp.all(jnp.isfinite(leaf))) for leaf in jax.tree.leaves(jet))


@jax.jit
def _jet(w):
    return BELL.jet(light, w), jax.grad(lambda w: BELL.value(light, w))(w)


def test_light_that_knows_unit_vectors_alone_bends_under_a_broad_bell():
    def by_angles(w):
        return jnp.arccos(w[2]) ** 2

    def by_formula(w):
        return by_angles(w / jnp.linalg.norm(w))

    broad = Zonal(VonMisesFisher(3.0), 4, 8)
    bent, expected = jax.jit(lambda w: (broad.jet(by_angles, w), broad.jet(by_formula, w)))(W)
    np.testing.assert_allclose(bent.hessian, expected.hessian, rtol=0.0, atol=1e-12)


def test_a_sharp_lobe_returns_the_light_itself():
    sharp = Zonal(VonMisesFisher(1e6))
    np.testing.assert_allclose(sharp.value(light, W), light(W), rtol=1e-5)


def test_a_direction_that_is_none_is_refused():
    with pytest.raises(ValueError, match="must be a unit vector, but has length 2"):
        BELL.value(light, jnp.array([0.0, 0.0, 2.0]))


def test_a_traced_sharpness_that_is_none_gives_nan():
    look = jax.jit(lambda k: VonMisesFisher(k).derivatives(jnp.array(0.9))[0])
    assert np.isnan(look(-5.0))
    assert np.isnan(look(0.0))
    # 2 pi int k exp(k (t - 1)) / (2 pi (1 - exp(-2 k))) dt = 1
    assert look(5.0) == pytest.approx(5.0 * np.exp(-0.5) / (2.0 * np.pi * -np.expm1(-10.0)))
