import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.stats import norm

from firstorder.checks.cases import CENTER, CORRELATION, SIGMA, light
from firstorder.checks.cases.laws.convolve import Leaning
from firstorder.conventions import FLATLAND
from firstorder.errors import Refused
from firstorder.fields import (
    Affine,
    BoxProfile,
    Constant,
    Covariance,
    Environment,
    GaussianProfile,
    HalfPlane,
    Harmonics,
    UniformProfile,
    gaussian,
    half_plane,
)
from firstorder.laws import Circle, Convolve, Hemisphere, Integrate, Line, Move, Multiply
from firstorder.transport import VaryingGaussian

U = jnp.array([0.3, -0.2])
BLUR = Convolve(Leaning(0.3, 0.1))


@eqx.filter_jit
def blurred(field):
    return field.jet(U)


@given(st.floats(-1.0, 1.0), st.floats(-0.5, 0.5))
def test_a_convolution_commutes_with_moves_that_only_shift_along_its_axis(slope, shift):
    """Shears `theta + slope x + shift`, curvature among them: R07 §4.1 rests on it."""
    move = Move(jnp.array([[1.0, 0.0], [0.0, 1.0]]).at[1, 0].set(slope), jnp.array([0.0, shift]))
    first, last = blurred(BLUR(move(light()))), blurred(move(BLUR(light())))
    jax.tree.map(lambda a, b: np.testing.assert_allclose(a, b, rtol=0.0, atol=1e-11), first, last)


def test_two_gaussian_blurs_are_one_of_summed_variance():
    twice = Convolve(GaussianProfile(0.5))(light())
    chained = Convolve(GaussianProfile(0.4), nodes=48)(
        Convolve(GaussianProfile(0.3), nodes=48)(light())
    )
    np.testing.assert_allclose(jax.jit(lambda u: chained.at(u))(U), twice.at(U), rtol=1e-10)


@pytest.mark.parametrize("domain", [None, Circle(), Hemisphere(0.1)])
def test_a_box_has_the_light_at_both_its_ends_for_derivatives(domain):
    w, box = 0.4, BoxProfile(0.4, "theta")
    blur = Convolve(box) if domain is None else Convolve(box, domain)
    jet = blurred(blur(gaussian((0.0, 0.0), (1.0, 0.5))))
    far, near = (np.exp(-0.5 * (0.3**2 + ((-0.2 + s * w) / 0.5) ** 2)) for s in (1.0, -1.0))
    np.testing.assert_allclose(jet.gradient[1], far - near, rtol=1e-9)
    bend = -((-0.2 + w) * far - (-0.2 - w) * near) / 0.25
    np.testing.assert_allclose(jet.hessian[1, 1], bend, rtol=1e-6)


def test_a_hemisphere_of_even_light_is_blurred_between_its_two_horizons():
    """The slope in x of a normal `n(x)` moves both, and each takes a bell of the kernel."""
    normal, theta, sigma = Affine([0.5, 0.0], 0.1), -0.9, 0.6
    even = Convolve(GaussianProfile(sigma), Hemisphere(normal))(Constant(1.0))
    jet = even.jet(jnp.array([0.4, theta]))
    near, far = ((theta - 0.3 + s * 0.5 * np.pi) / sigma for s in (1.0, -1.0))
    np.testing.assert_allclose(jet.value, norm.cdf(near) - norm.cdf(far), rtol=1e-12)
    slope = -0.5 * (norm.pdf(near) - norm.pdf(far)) / sigma
    np.testing.assert_allclose(jet.gradient[0], slope, rtol=1e-9)


@pytest.mark.parametrize(("axis", "a"), [("x", 0), ("theta", 1)])
def test_a_blurred_bell_is_a_wider_bell_in_every_portrait(axis, a):
    """Its variance along the axis grows by that of the kernel, and it keeps its light."""
    variance = np.diag(SIGMA) @ [[1.0, CORRELATION], [CORRELATION, 1.0]] @ np.diag(SIGMA)
    wider = variance + 0.09 * np.outer(np.eye(2)[a], np.eye(2)[a])
    sigma = np.sqrt(np.diag(wider))
    height = 1.3 * np.sqrt(np.linalg.det(variance) / np.linalg.det(wider))
    true = gaussian(CENTER, sigma, wider[0, 1] / np.prod(sigma), height)
    blur = Convolve(GaussianProfile(0.3, axis))
    w = np.array([[0.3, -0.2], [-0.1, 0.6], [0.0, 0.4]])
    F = jax.vmap(blur(light().spectrum()).at)(w)
    np.testing.assert_allclose(F, jax.vmap(true.spectrum().at)(w), rtol=1e-12)
    S = blur(light().covariance())
    np.testing.assert_allclose(S.matrix, true.covariance().matrix, rtol=1e-12)
    for normal in ([1.0, 0.0], [0.0, 1.0], [0.4, -0.7]):
        ends, told = blur(light().spectrum()).extent(), true.spectrum().extent()
        assert ends is not None
        assert told is not None
        np.testing.assert_allclose(ends.along(normal), told.along(normal), rtol=1e-12)


def test_light_is_conserved_by_a_kernel_of_integral_one():
    """Integrating over the angle before or after the blur is the same (energy)."""
    sums = Integrate("theta", -7.0, 7.0, 96)
    np.testing.assert_allclose(
        jax.jit(lambda u: sums(BLUR(light())).at(u))(U[:1]), sums(light()).at(U[:1]), rtol=1e-10
    )


def test_an_edge_that_runs_along_the_axis_survives_and_others_do_not():
    across, along = HalfPlane(Affine([0.8, -1.0], 0.1), 0.2, 1.0), half_plane(0.1, 0.2)
    assert BLUR(Multiply(across)(light())).edges() == ()
    (edge,) = BLUR(Multiply(along)(light())).edges()
    at = jnp.array([0.1, 0.3])
    np.testing.assert_allclose(edge.jump.at(at), 0.8 * BLUR(light()).at(at), rtol=1e-12)


def test_an_edge_along_the_axis_survives_when_it_is_traced():
    @eqx.filter_jit
    def jump(mask):
        edges = BLUR(Multiply(mask)(light())).edges()
        return sum(e.jump.at(jnp.array([0.1, 0.3])) for e in edges)

    expected = 0.8 * BLUR(light()).at(jnp.array([0.1, 0.3]))
    np.testing.assert_allclose(jump(half_plane(0.1, 0.2)), expected, rtol=1e-12)
    assert jump(HalfPlane(Affine([0.8, -1.0], 0.1), 0.2, 1.0)) == 0.0


def test_circle_and_horizon_refuse_what_only_the_line_has():
    for domain in (Circle(), Hemisphere(light())):
        with pytest.raises(Refused, match="whole line"):
            Convolve(Leaning(0.3, 0.1), domain)(light().covariance())
    with pytest.raises(Refused, match="not shift-invariant"):
        Convolve(Leaning(0.3, 0.1), Hemisphere(light()))(light().spectrum())


@pytest.mark.parametrize("sigma", [0.05, 1e-3])
@pytest.mark.parametrize("domain", [Circle(), Hemisphere(Affine([0.5, 0.0], 0.1))])
def test_a_narrow_kernel_sees_the_light_before_it_on_every_domain(domain, sigma):
    """A wave passes a bell damped by `exp(-sigma^2 / 2)`; the horizon is far away."""
    sky = Environment(Harmonics([1.0, 0.5], [0.0, 0.0]))
    jet = Convolve(GaussianProfile(sigma), domain)(sky).jet(jnp.array([0.2, -0.3]))
    seen = 0.5 * np.exp(-0.5 * sigma**2)
    np.testing.assert_allclose(jet.value, 1.0 + seen * np.cos(0.3), rtol=1e-9)
    np.testing.assert_allclose(jet.gradient[1], seen * np.sin(0.3), rtol=1e-7)


def test_even_light_under_an_even_kernel_keeps_its_covariance():
    S = Covariance(jnp.diag(jnp.array([0.3, 0.0])))
    np.testing.assert_array_equal(Convolve(UniformProfile("theta"))(S).matrix, S.matrix)


def test_a_horizon_takes_its_normal_as_a_number_or_function():
    truth = Convolve(Leaning(0.3, 0.1), Hemisphere(Affine([0.5, 0.0], 0.0)))(light()).jet(U)
    plain = Convolve(Leaning(0.3, 0.1), Hemisphere(lambda x: 0.5 * x))(light()).jet(U)
    np.testing.assert_allclose(plain.hessian, truth.hessian, rtol=1e-12)
    assert Hemisphere(0.2).normal(3.0, 1.0) == 0.2


def test_a_kernel_ends_nine_of_its_own_widths_away_on_a_line():
    """One whose width grows along it, `0.3 + 0.1 x`."""
    kernel = VaryingGaussian(Affine([0.1, 0.0], 0.3), widest=0.5)
    ends = Line().ends(kernel, FLATLAND.appended("s"))
    found = [end.at(jnp.array([0.4, -0.2, 0.7])) for end in ends]
    np.testing.assert_allclose(found, [-0.2 - 9.0 * 0.34, -0.2 + 9.0 * 0.34], rtol=1e-14)


@pytest.mark.parametrize("nodes", [0, 2.5, "64"])
def test_nodes_are_a_positive_integer(nodes):
    words = "^Argument `nodes` must be a positive integer, but is|violates type hint"
    with pytest.raises((ValueError, TypeError), match=words):
        Convolve(GaussianProfile(1.0), nodes=nodes)


def test_a_horizon_that_jumps_is_an_edge_of_the_blurred_light():
    def under(n):
        return Convolve(GaussianProfile(0.6), Hemisphere(n))(light())

    (edge,) = under(half_plane(0.2, -0.9, 0.8)).edges()
    jump = under(0.8)(0.2, 0.5) - under(-0.9)(0.2, 0.5)
    assert abs(jump) > 0.005
    np.testing.assert_allclose(edge.jump(0.2, 0.5), jump, rtol=1e-10)
