"""Reflection, and the chain in space: two principal curvatures and a separable lobe."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
import scipy.integrate

from firstorder.checks.tolerance import normwise
from firstorder.conventions import SPACE, SPACE_SLOPE, Frame
from firstorder.errors import Refused
from firstorder.fields import (
    Affine,
    Gaussian,
    GaussianProfile,
    Grid,
    autodiff_jet,
    discrete_transform,
    gaussian,
    half_plane,
)
from firstorder.laws import Circle, Hemisphere, Integrate, Line, Move, Multiply
from firstorder.transport import (
    Blend,
    Curvature,
    Event,
    Mirror,
    Reflection,
    Texture,
    Travel,
    VaryingGaussian,
    wave,
)

OUT = gaussian((0.0, 0.0), (1.0, 1.0)).frame.turned()
L = gaussian((0.2, -0.1), (0.7, 0.5), 0.4, frame=OUT)


class ParaxialAngles(Event):
    """v = theta, w = phi: the linearisation of the slopes at the central ray."""

    def law(self, frame):
        """A change of names."""
        return Move(jnp.eye(frame.dims), to=SPACE)


def space_path(nodes=48):
    """Source, travel, local frame with two curvatures, mirror, a separable lobe, and back."""
    spread = np.diag([0.20, 0.16, 0.18, 0.14]) + 0.02 * (np.ones((4, 4)) - np.eye(4))
    centre = np.array([0.1, -0.05, 0.08, 0.04])
    source = Gaussian(centre, np.linalg.inv(spread), 1.0, SPACE_SLOPE)
    shape = jnp.array([[0.35, 0.06], [0.06, -0.2]])
    out = SPACE.turned()
    path = (
        source
        >> Travel(0.3)
        >> ParaxialAngles()
        >> Curvature(shape)
        >> Mirror()
        >> Reflection(GaussianProfile(0.25, "theta", out), nodes=nodes)
        >> Reflection(GaussianProfile(0.15, "phi", out), nodes=nodes)
        >> Curvature(shape, back=True)
    )
    # Its moments, by matrices that share nothing with the events.
    K, Z, one = np.asarray(shape), np.zeros((2, 2)), np.eye(2)
    rotate = np.block([[one, Z], [K, one]])
    local = np.block([[one, -0.3 * one], [Z, one]]) @ rotate @ np.diag([1, 1, -1, -1])
    inward = np.linalg.inv(local)
    blurred = inward @ spread @ inward.T + np.diag([0.0, 0.0, 0.25**2, 0.15**2])
    return path, rotate @ blurred @ rotate.T, rotate @ inward @ centre, spread, blurred


@pytest.mark.parametrize("size", [24, 25])
def test_spectrum_of_the_chain_in_space(size):
    """The square of the whole chain: transform of its light against the light's transform."""
    path, moments, centre, spread, blurred = space_path()
    box = 6.5 * np.sqrt(np.diag(moments))
    grid = Grid.spanning((size,) * 4, tuple(box.tolist()), tuple(centre.tolist()))
    # The light is a Gaussian: its samples by the moments above, checked against the chain's.
    height = np.sqrt(np.linalg.det(spread) / np.linalg.det(blurred))
    light = Gaussian(centre, np.linalg.inv(moments), height, SPACE.turned())
    rays = jnp.asarray(np.random.default_rng(3).uniform(-0.5, 0.5, (6, 4)) * 0.5 * box + centre)
    traced = eqx.filter_jit(lambda: jax.lax.map(path.light.at, rays))()
    assert normwise(traced, jax.vmap(light.at)(rays)) < 1e-9
    Omega = tuple(np.array(a) for a in ([-0.3, 0.2], [0.25], [0.1, -0.4], [0.3]))
    by_samples = discrete_transform(jax.jit(grid.sample)(light), grid, *Omega)
    by_rules = path.spectra[-1](*np.meshgrid(*Omega, indexing="ij"))
    assert normwise(by_rules, by_samples) < 1e-9


def test_hessian_of_the_chain_in_space():
    path, *_ = space_path()
    u = jnp.array([0.15, -0.1, 0.05, 0.1])
    closed = eqx.filter_jit(path.light.jet)(u)
    oracle = eqx.filter_jit(lambda u: autodiff_jet(path.light.at, u, SPACE))(u)
    assert normwise(closed.gradient, oracle.gradient) < 1e-10
    assert normwise(closed.hessian, oracle.hessian) < 1e-10


def test_swapping_the_principal_curvatures_is_seen():
    light = Gaussian(np.zeros(4), np.eye(4), 1.0, SPACE).covariance()
    right, wrong = (
        Curvature(jnp.diag(jnp.array(k)))(light).matrix for k in ([0.5, -0.2], [-0.2, 0.5])
    )
    assert normwise(right, wrong) > 0.1


def test_a_constant_width_is_a_gaussian_profile():
    flat = VaryingGaussian(wave(0.5, 0.0, mean=0.3, frame=OUT), 0.3)
    rays = jnp.array([[0.2, 0.4], [1.0, -0.5]])
    a, b = (jax.vmap(p.jet)(rays) for p in (flat, GaussianProfile(0.3, frame=OUT)))
    assert normwise(a.hessian, b.hessian) < 1e-14


def test_the_jet_of_a_lobe_whose_width_changes():
    lobe = VaryingGaussian(wave(0.5, 0.1, 0.4, 0.3, frame=OUT), 0.4)
    u = jnp.array([0.3, 0.2])
    assert normwise(lobe.jet(u).hessian, autodiff_jet(lobe.at, u, OUT).hessian) < 1e-13


def blurred(x, theta, sigma, low=-np.inf, high=np.inf):
    """A unit bell of x and theta, blurred over theta by adaptive quadrature."""

    def product(s):
        bell = np.exp(-0.5 * (x**2 + s**2))
        return bell * np.exp(-0.5 * ((theta - s) / sigma) ** 2) / (sigma * np.sqrt(2.0 * np.pi))

    ends = max(low, theta - 9.0 * sigma), min(high, theta + 9.0 * sigma)
    return scipy.integrate.quad(product, *ends, epsabs=1e-14, epsrel=1e-13)[0]


@pytest.mark.parametrize("widest", [0.4, 3.2])
@pytest.mark.parametrize("domain", [Line(), Circle(), Hemisphere(Affine([0.1, 0.0], 0.2, OUT))])
def test_a_lobe_far_narrower_than_the_widest_is_as_exact(widest, domain):
    """Its integral ends where it does, and its jet knows how that moves."""
    lobe = VaryingGaussian(wave(0.5, 0.1, 0.4, 0.3, frame=OUT), widest)
    light, step = gaussian((0.0, 0.0), (1.0, 1.0), frame=OUT), 1e-3

    def sigma(x):
        return float(lobe.sigma(x, 0.0))

    def brute(x, theta):
        n = 0.1 * x + 0.2
        ends = (n - np.pi / 2, n + np.pi / 2) if isinstance(domain, Hemisphere) else ()
        return blurred(x, theta, sigma(x), *ends)

    found = Reflection(lobe, domain)(light).jet(jnp.array([0.3, 0.2]))
    np.testing.assert_allclose(found.value, brute(0.3, 0.2), rtol=1e-12)
    slope = (brute(0.3 + step, 0.2) - brute(0.3 - step, 0.2)) / (2.0 * step)
    np.testing.assert_allclose(found.gradient[0], slope, rtol=1e-5)


def test_lobes_that_vary_need_a_window_for_their_spectrum():
    lobe = GaussianProfile(0.3, frame=OUT)
    for varying in (
        VaryingGaussian(wave(0.5, 0.1, mean=0.3, frame=OUT), 0.4),
        Blend((lobe,), (wave(0.5, frame=OUT),)),
    ):
        with pytest.raises(Refused, match="window"):
            Reflection(varying)(L.spectrum())


def test_a_width_that_varies_in_time_has_no_series():
    """Its series is made at one time, and would hold that still."""
    moving = Frame(("x", "theta", "t"), "outgoing")
    lobe = VaryingGaussian(wave(0.5, 0.1, mean=0.3, axis="t", frame=moving), 0.4)
    with pytest.raises(Refused, match="or in time, needs a Blend"):
        lobe.semi_series(jnp.array(0.5), Grid((8, 8, 8), (0.5, 0.5, 0.5)))


def test_bad_lobes_are_one_sentence():
    lobe = GaussianProfile(0.3, frame=OUT)
    with pytest.raises(ValueError, match="must pair up"):
        Blend((lobe,), ())
    with pytest.raises(ValueError, match="`widest` must be positive"):
        VaryingGaussian(wave(0.5, 0.1, mean=0.3), 0.0)
    with pytest.raises(ValueError, match="needs mirrored light"):
        Reflection(lobe)(gaussian((0.0, 0.0), (1.0, 1.0)))


@pytest.mark.smoke
def test_reflection_keeps_power():
    before = L.spectrum()(0.0, 0.0)
    after = Reflection(GaussianProfile(0.3, frame=OUT))(L).spectrum()(0.0, 0.0)
    assert complex(after) == pytest.approx(complex(before))


@pytest.mark.smoke
def test_a_narrow_lobe_beside_a_wide_one_is_as_exact_as_alone():
    lobes = GaussianProfile(0.02, frame=OUT), GaussianProfile(0.5, frame=OUT)
    weights = [wave(0.5, a, mean=0.5, frame=OUT) for a in (0.5, -0.5)]
    both = Reflection(Blend(lobes, tuple(weights)))(L)
    first, second = (Multiply(w)(Reflection(p)(L)) for w, p in zip(weights, lobes, strict=True))
    u = jnp.array([0.13, 0.1])
    np.testing.assert_allclose(both.jet(u).hessian, (first + second).jet(u).hessian, rtol=1e-12)


def test_the_edge_between_two_materials_is_an_edge_of_what_they_reflect():
    lobes = GaussianProfile(0.1, frame=OUT), GaussianProfile(0.5, frame=OUT)
    left, right = half_plane(0.2, 1.0, 0.0, frame=OUT), half_plane(0.2, frame=OUT)
    edges = Reflection(Blend(lobes, (left, right)))(L).edges()
    jump = sum(e.jump(0.2, 0.3) for e in edges)
    wide, narrow = (Reflection(p)(L)(0.2, 0.3) for p in reversed(lobes))
    np.testing.assert_allclose(jump, wide - narrow, rtol=1e-12)


def test_a_pixel_over_two_materials_sees_their_edge_move():
    """Its derivative has the edge's own term, against the mean of many points."""
    lobes = GaussianProfile(0.1, frame=OUT), GaussianProfile(0.5, frame=OUT)
    weights = half_plane(0.2, 1.0, 0.0, frame=OUT), half_plane(0.2, frame=OUT)
    seen = Curvature(0.7, back=True)(Texture(wave(0.2, frame=OUT))(L))
    seen = Curvature(0.7, back=True)(Reflection(Blend(lobes, weights))(seen))
    pixel = Integrate("x", -1.0, 1.0)(Move([[1.0, 0.5], [0.0, 1.0]])(seen))
    ends = np.linspace(-1.0, 1.0, 20001)
    x, v = 0.5 * (ends[1:] + ends[:-1]), np.array([[0.101], [0.099]])
    sums = 2.0 * jnp.mean(Move([[1.0, 0.5], [0.0, 1.0]])(seen)(x, v), axis=1)
    jet = pixel.jets(0.1)
    np.testing.assert_allclose(jet.value, jnp.mean(sums), rtol=1e-6)
    np.testing.assert_allclose(jet.gradient[0], (sums[0] - sums[1]) / 0.002, rtol=0.02)


def test_a_blend_turns_about_one_axis():
    lobes = GaussianProfile(0.1, "theta"), GaussianProfile(0.1, "x")
    with pytest.raises(ValueError, match="must act along one axis"):
        Blend(lobes, (0.5, 0.5))


def test_a_lobe_is_nan_where_its_width_is_none():
    """A width that falls to both sides, positive for |x| < 0.3; and a traced bound on it."""
    lobe = VaryingGaussian(lambda x, theta: 0.3 - jnp.abs(x), 0.4)
    for x in (0.3, -0.31, 2.0):
        assert np.isnan(lobe(x, 0.1))
    assert lobe(0.1, 0.1) == pytest.approx(np.exp(-0.125) / (0.2 * np.sqrt(2.0 * np.pi)))
    reach = jax.jit(lambda w: VaryingGaussian(wave(0.5, 0.1, mean=0.3), w).half_width())
    assert np.isnan(reach(-0.4))
    assert np.isnan(reach(0.0))
    assert reach(0.4) == pytest.approx(3.6)


def test_an_edge_of_the_width_is_an_edge_of_what_is_reflected():
    lobe = VaryingGaussian(half_plane(0.2, 0.1, 0.3, frame=OUT), 0.3)
    (edge,) = Reflection(lobe, nodes=128)(L).edges()
    narrow, wide = (Reflection(GaussianProfile(s, frame=OUT))(L)(0.2, 0.3) for s in (0.1, 0.3))
    np.testing.assert_allclose(edge.jump(0.2, 0.3), wide - narrow, rtol=1e-7)
