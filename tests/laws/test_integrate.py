"""Integrate where it is hard: curved, parallel, crossing and coincident edges, ends that meet."""

from itertools import pairwise

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import quad
from scipy.special import erf

from firstorder.checks.cases import CENTER, CORRELATION, SIGMA, bell, light
from firstorder.checks.tolerance import normwise
from firstorder.conventions import FLATLAND, FLATLAND_SLOPE, Frame
from firstorder.errors import Refused
from firstorder.fields import (
    Affine,
    Constant,
    Covariance,
    Function,
    Gaussian,
    Grid,
    HalfPlane,
    Wavelet,
    autodiff_jet,
    half_plane,
)
from firstorder.flatland import Receiver, Scene, Segments, light_field, primitive
from firstorder.laws import Integrate, Map, Move, Multiply, Warp
from firstorder.numerics._batching import batched
from firstorder.transport import Mirror, Texture, Travel

LINE = Frame(("x",))
X = jnp.array([[-0.6], [-0.1], [0.35], [0.8]])


def masked(*levels):
    """The light of the cases behind half-planes `level > 0`."""
    field = light()
    for level in levels:
        field = Multiply(HalfPlane(level, 0.2, 1.0))(field)
    return field


def jets_agree(field, rays, bound=1e-10):
    both = batched(lambda u: (field.jet(u), autodiff_jet(field.at, u, field.frame)))
    closed, auto = jax.jit(both)(rays)
    for part in ("value", "gradient", "hessian"):
        a, b = getattr(closed, part), getattr(auto, part)
        assert normwise(a, b) < bound, part
    return closed


# region: straight edges, against closed forms that know nothing of panels


def erf_truth(x, slope, offset):
    """int_-inf^b of an upright bell exp(-(x^2 + t^2) / 2) with b = slope x + offset: jet in x."""
    b = slope * x + offset
    g, G = np.exp(-0.5 * b * b), np.sqrt(np.pi / 2) * (1 + erf(b / np.sqrt(2)))
    e = np.exp(-0.5 * x * x)
    return (
        e * G,
        e * (-x * G + slope * g),
        e * ((x * x - 1) * G - 2 * x * slope * g - slope**2 * b * g),
    )


@pytest.mark.parametrize("unit", [1e-9, 1e9])
@pytest.mark.parametrize("axis", ["x", "theta"])
def test_a_unit_of_length_is_only_a_factor(unit, axis):
    """The steps beside an edge, where its one-sided limits are taken, have no unit of their own."""
    across, along = (1, 0) if axis == "theta" else (0, 1)
    sizes = np.array([unit, 1.0])
    normal = np.zeros(2)
    normal[across], normal[along] = -1.0, 0.7
    light = Multiply(HalfPlane(Affine(normal / sizes, 0.2), 0.0, 1.0))(
        Gaussian([0.0, 0.0], np.diag(sizes**-2.0))
    )
    reach = 9.0 * sizes[across]
    found = Integrate(axis, -reach, reach)(light).jets(0.4 * sizes[along])
    true = erf_truth(0.4, 0.7, 0.2)
    for power, part in enumerate((found.value, found.gradient, found.hessian)):
        scaled = float(np.squeeze(part)) * sizes[along] ** power / sizes[across]
        expected = true[power]
        assert scaled == pytest.approx(float(expected), rel=1e-11)


def test_boundary_terms_of_gradient_and_hessian_are_those_of_the_error_function():
    bell0 = Function(lambda x, t: jnp.exp(-0.5 * (x * x + t * t)))
    field = Multiply(HalfPlane(Affine([0.7, -1.0], 0.2), 0.0, 1.0))(bell0)
    h = Integrate("theta", -9.0, 9.0)(field)
    got = jax.jit(batched(h.jet))(X)
    for i, x in enumerate(np.asarray(X[:, 0])):
        value, first, second = erf_truth(x, 0.7, 0.2)
        np.testing.assert_allclose(got.value[i], value, rtol=1e-12)
        np.testing.assert_allclose(got.gradient[i, 0], first, rtol=0.0, atol=1e-12)
        np.testing.assert_allclose(got.hessian[i, 0, 0], second, rtol=0.0, atol=1e-12)


def test_two_edges_that_cross_between_the_receivers():
    """They cross at x = 0.1: both orders of the two edges are among the receivers."""
    field = masked(Affine([0.9, -1.0], 0.0), Affine([-0.6, 1.0], -0.15))
    h = Integrate("theta", -5.0, 5.0)(field)
    jets_agree(h, X)


def test_an_edge_parallel_to_the_axis_survives_with_its_jump_integrated():
    field = masked(Affine([1.0, 0.0], -0.2))
    h = Integrate("theta", -5.0, 5.0)(field)
    (edge,) = h.edges()
    left, right = jax.jit(lambda x: h(x))(jnp.array([0.2 - 1e-9, 0.2 + 1e-9]))
    np.testing.assert_allclose(edge.jump(0.2), right - left, rtol=0.0, atol=1e-8)
    np.testing.assert_allclose(twice(jnp.array([1.0, 0.0]), h), half_bell(0.2), rtol=1e-12)


def half_bell(x):
    """The light of the cases over all theta, and over x with 0.2 of it left of `x`: by erf."""
    (cx, _), (sx, sy), r = CENTER, SIGMA, CORRELATION
    total = 1.3 * 2 * np.pi * sx * sy * np.sqrt(1 - r * r)
    return total * (1 - 0.8 * 0.5 * (1 + erf((x - cx) / (sx * np.sqrt(2)))))


def twice(normal, h=None):
    """All the light behind an edge that runs along theta, one integral after the other."""
    h = h or Integrate("theta", -5.0, 5.0)(masked(Affine(normal, -0.2)))
    return Integrate("x", -5.0, 5.0)(h).at(jnp.zeros(0))


def test_a_parallel_edge_is_not_lost_when_its_normal_is_traced():
    """Under jit nobody can see that the edge runs along the axis: it must survive all the same."""

    np.testing.assert_allclose(jax.jit(twice)(jnp.array([1.0, 0.0])), half_bell(0.2), rtol=1e-12)


# endregion
# region: curved edges, through warps


def test_a_curved_edge_has_the_jet_of_autodiff_and_the_value_of_quadrature():
    """A half-plane seen after travel in angles: its edge is x - d tan(theta) = 0.1."""
    d = 0.8
    seen = Travel(d)(half_plane(0.1))
    field = Multiply(seen)(light())
    h = Integrate("theta", -1.4, 1.4)(field)
    got = jets_agree(h, X)
    for x, value in zip(np.asarray(X[:, 0]), got.value, strict=True):
        truth = quad(lambda t, x=x: bell(x, t), -1.4, np.arctan((x - 0.1) / d), epsabs=1e-13)[0]
        np.testing.assert_allclose(value, truth, rtol=0.0, atol=1e-12)


def test_a_curved_edge_is_met_when_the_interval_ends_on_the_pole_of_its_level():
    h = Integrate("theta", -np.pi / 2, np.pi / 2)(Multiply(Travel(0.8)(half_plane(0.1)))(light()))
    truth = [
        quad(lambda t, x=x: bell(x, t), -np.pi / 2, np.arctan((x - 0.1) / 0.8), epsabs=1e-13)[0]
        for x in np.asarray(X[:, 0])
    ]
    np.testing.assert_allclose(jax.jit(batched(h.at))(X), truth, rtol=0.0, atol=1e-12)


def test_an_unmet_level_that_is_infinite_elsewhere_spoils_nothing():
    """log(theta + 2) is infinite at -2 and below; on [-1.5, -1.2] the edge is not met."""

    class Log(Map):
        def __call__(self, u):
            return jnp.stack([jnp.log(u[1] + 2.0) + 0.1 * u[0] - 0.5, u[1]])

    h = Integrate("theta", -1.5, -1.2)(Multiply(Warp(Log())(half_plane(0.0, 0.2)))(light()))
    dim = Integrate("theta", -1.5, -1.2)(0.2 * light())
    jets_agree(h, X)
    np.testing.assert_allclose(h.at(X[0]), dim.at(X[0]), rtol=1e-12)


def test_two_edges_seen_through_maps_of_plain_numbers_are_both_met():
    """A map's own number need be no JAX array: edges at theta = (x + 0.5) / 2 and theta = x / 3."""

    class Stretch(Map):
        by: float

        def __call__(self, u):
            return jnp.stack([u[0], self.by * u[1]])

    field = light()
    for by, offset, below in ((2.0, 0.5, 0.2), (3.0, 0.0, 0.5)):
        mask = HalfPlane(Affine([1.0, -1.0], offset), below, 1.0)
        field = Multiply(Warp(Stretch(by))(mask))(field)
    got = jets_agree(Integrate("theta", -4.0, 4.0)(field), X)
    for x, value in zip(np.asarray(X[:, 0]), got.value, strict=True):
        ends = np.sort([-4.0, 0.5 * (x + 0.5), x / 3.0, 4.0])
        pieces = [quad(lambda t, x=x: bell(x, t), *e, epsabs=1e-13)[0] for e in pairwise(ends)]
        low_first = 0.5 * (x + 0.5) < x / 3.0
        truth = pieces @ np.array([1.0, 0.2 if low_first else 0.5, 0.1])
        np.testing.assert_allclose(value, truth, rtol=0.0, atol=1e-12)


# endregion
# region: degenerate and moving ends


@pytest.mark.parametrize("ends", [(-1.0, 2.0), (2.0, -1.0)])
def test_a_break_where_light_bends_makes_its_integral_exact(ends):
    """The area under |theta - x| over [-1, 2]: two triangles, or one trapezium beside the bend."""
    bent = Function(lambda x, theta: jnp.abs(theta - x))
    h = Integrate("theta", *ends, 2, (Affine([1.0, 0.0], 0.0),))(bent)
    got = jax.jit(batched(h.jet))(jnp.array([[0.3], [3.0], [-2.0]]))
    sign = np.sign(ends[1])
    np.testing.assert_allclose(sign * got.value, [2.29, 7.5, 7.5], rtol=1e-12)
    np.testing.assert_allclose(sign * got.gradient[:, 0], [-0.4, 3.0, -3.0], rtol=1e-12)
    np.testing.assert_allclose(sign * got.hessian[:, 0, 0], [2.0, 0.0, 0.0], rtol=0.0, atol=1e-12)


def test_ends_that_move_across_an_edge():
    lower = Function(lambda x, t: -0.8 + 0.3 * x)
    upper = Function(lambda x, t: 0.5 + 0.2 * jnp.sin(2.0 * x))
    field = masked(Affine([0.9, -1.0], 0.05))
    got = jets_agree(Integrate("theta", lower, upper)(field), X)

    def inside(x, t):
        return bell(x, t) * (1.0 if 0.9 * x - t + 0.05 > 0 else 0.2)

    for x, value in zip(np.asarray(X[:, 0]), got.value, strict=True):
        ends = -0.8 + 0.3 * x, 0.5 + 0.2 * np.sin(2 * x)
        truth = quad(lambda t, x=x: inside(x, t), *ends, points=[0.9 * x + 0.05], epsabs=1e-13)[0]
        np.testing.assert_allclose(value, truth, rtol=0.0, atol=1e-11)


def test_an_end_may_be_a_plain_function():
    """The area under a line over the interval from x to 2 + x^2."""
    h = Integrate("theta", lambda x: x, lambda x, theta: 2.0 + x * x + 0.0 * theta, 8)
    found = h(Function(lambda x, theta: theta + 0.0 * x))(0.7)
    np.testing.assert_allclose(found, 0.5 * (2.49**2 - 0.7**2), rtol=1e-13)


def test_an_empty_interval_has_no_light_but_a_gradient():
    """int_0^x f dt at x = 0: the value vanishes, its derivative is f."""
    upper = Affine([1.0, 0.0], 0.0)
    for field in (light(), masked(Affine([0.9, -1.0], 0.4))):
        h = Integrate("theta", 0.0, upper, 8)(field)
        value, slope, jet = jax.jit(lambda u, h=h: (h.at(u), jax.grad(h.at)(u), h.jet(u)))(
            jnp.zeros(1)
        )
        assert value == 0.0
        np.testing.assert_allclose(slope[0], field(0.0, 0.0), rtol=1e-13)
        np.testing.assert_allclose(jet.gradient[0], field(0.0, 0.0), rtol=1e-13)


def test_ends_in_the_other_order_change_the_sign_with_edges_and_all():
    field = masked(Affine([0.9, -1.0], 0.0))
    there, back = (Integrate("theta", *ends)(field) for ends in ((-4.0, 5.0), (5.0, -4.0)))
    a, b = jets_agree(there, X), jets_agree(back, X)
    jax.tree.map(lambda p, q: np.testing.assert_allclose(p, -q, rtol=0.0, atol=1e-12), a, b)


def test_an_edge_exactly_on_an_end_has_a_gradient_between_the_one_sided_ones():
    field = masked(Affine([1.0, -1.0], 0.5))  # the edge theta = x + 0.5 reaches 0.5 at x = 0
    h = Integrate("theta", -5.0, 0.5)(field)
    left, at, right = jax.jit(batched(h.jet))(jnp.array([[-1e-8], [0.0], [1e-8]])).gradient[:, 0]
    assert left - right > 0.1
    assert right < at < left
    np.testing.assert_allclose(jax.jit(jax.grad(h.at))(jnp.zeros(1))[0], at, rtol=0.0, atol=1e-9)


def test_three_coincident_edges_multiply_their_transparencies():
    level = Affine([0.9, -1.0], 0.1)
    thrice = Integrate("theta", -5.0, 5.0)(masked(level, level, level))
    once = Integrate("theta", -5.0, 5.0)(Multiply(HalfPlane(level, 0.008, 1.0))(light()))
    a, b = (jax.jit(batched(h.jet))(X) for h in (thrice, once))
    jax.tree.map(lambda p, q: np.testing.assert_allclose(p, q, rtol=0.0, atol=1e-12), a, b)


@given(
    x=st.sampled_from([0.0, 0.25, 0.5, -1.0]),
    slope=st.sampled_from([0.0, 1.0, -2.0]),
    offset=st.sampled_from([0.0, 0.5, -0.5, 1.0]),
    end=st.sampled_from([0.0, 0.5, 1.0]),
)
def test_no_nan_at_any_degenerate_meeting_of_edges_and_ends(x, slope, offset, end):
    value, gradient, jet = _degenerate(x, slope, offset, end)
    leaves = jax.tree.leaves((value, gradient, jet))
    assert all(bool(jnp.all(jnp.isfinite(leaf))) for leaf in leaves)


@jax.jit
def _degenerate(x, slope, offset, end):
    edges = Affine(jnp.stack([slope, -1.0]), offset), Affine(jnp.array([1.0, 0.0]), -0.25)
    h = Integrate("theta", -0.5, end, 8)(masked(*edges))
    u = jnp.stack([x])
    return h.at(u), jax.grad(h.at)(u), h.jet(u)


# endregion


def test_the_integral_over_a_number_of_nodes_that_is_none_is_refused():
    with pytest.raises(ValueError, match="Argument `nodes` must be positive, but is 0"):
        Integrate("theta", 0.0, 1.0, 0)


@pytest.mark.parametrize(("axis", "a"), [("x", 0), ("theta", 1)])
def test_a_bell_integrated_is_the_bell_of_what_is_left_in_every_portrait(axis, a):
    """Its marginal: centre and width stay, and its integral."""
    law, b = Integrate(axis, -9.0, 9.0), 1 - a
    w = np.array([[-0.4], [0.0], [0.7]])
    total = 1.3 * 2.0 * np.pi * np.prod(SIGMA) * np.sqrt(1.0 - CORRELATION**2)
    true = total * np.exp(
        -2.0 * (np.pi * SIGMA[b] * w[:, 0]) ** 2 - 2j * np.pi * CENTER[b] * w[:, 0]
    )
    F = law(light().spectrum())
    np.testing.assert_allclose(jax.vmap(F.at)(w), true, rtol=1e-12)
    extent = F.extent()
    assert extent is not None
    ends = np.array(extent.along([1.0], 3.0))
    np.testing.assert_allclose(ends, CENTER[b] + 3.0 * SIGMA[b] * np.array([-1.0, 1.0]), rtol=1e-12)
    S = law(light().covariance())
    np.testing.assert_allclose(S.matrix, [[1.0 / (8.0 * np.pi**2 * SIGMA[b] ** 2)]], rtol=1e-12)
    assert S.frame == F.frame == Frame((FLATLAND.coordinates[b],))


@pytest.mark.parametrize(("axis", "a"), [("x", 0), ("theta", 1)])
def test_wavelets_of_an_integral_are_those_of_the_sums_of_samples(axis, a):
    grid = Grid.spanning((4, 8), (1.5, 1.0), (0.2, 0.1))
    h = Integrate(axis, -1.0, 1.0).wavelet(Wavelet.of(light(), grid))
    true = np.asarray(grid.sample(light())).sum(a) * grid.step[a]
    np.testing.assert_allclose(h.samples(), true, rtol=1e-12)
    assert h.grid == Grid(
        grid.size[1 - a : 2 - a], grid.step[1 - a : 2 - a], (0.2, 0.1)[1 - a : 2 - a]
    )


def test_spectra_and_wavelets_refuse_ends_that_move():
    law = Integrate("theta", Constant(-1.0), 1.0)
    for portrait in (light().spectrum(), light().covariance()):
        with pytest.raises(Refused, match="ends that move"):
            law(portrait)


def test_a_jet_at_one_ray_cannot_be_integrated():
    with pytest.raises(Refused, match="looks at many rays"):
        Integrate("theta", 0.0, 1.0).push(light().jet(jnp.zeros(2)), jnp.zeros(1))


def test_a_warped_edge_that_runs_along_the_axis_survives_too():
    """A curved level that does not change along theta: x^2 = 0.04 on x > 0."""

    class Square(Map):
        def __call__(self, u):
            return jnp.stack([u[0] ** 2, u[1]])

    mask = Warp(Square())(half_plane(0.04))
    h = Integrate("theta", -5.0, 5.0)(Multiply(mask)(light()))
    got = Integrate("x", 0.0, 5.0)(h).at(jnp.zeros(0))
    dark = quad(lambda x: quad(lambda t: bell(x, t), -5, 5)[0], 0.0, 0.2)[0]
    lit = quad(lambda x: quad(lambda t: bell(x, t), -5, 5)[0], 0.2, 5.0)[0]
    assert dark > 0.1
    np.testing.assert_allclose(got, lit, rtol=0.0, atol=1e-9)
    assert h.frame == FLATLAND.without("theta") == LINE


def test_light_that_is_the_same_along_an_axis_keeps_its_covariance_across_it():
    S = Covariance(jnp.diag(jnp.array([0.3, 0.0])))
    np.testing.assert_allclose(Integrate("theta", -1.0, 1.0)(S).matrix, [[0.3]])


def test_an_endless_interval_is_one_sentence():
    with pytest.raises(ValueError, match="Argument `upper` must be finite, but is inf"):
        Integrate("theta", 0.0, np.inf)


def test_a_pattern_labelled_by_the_sense_before_the_mirror_is_integrated_with_its_edge():
    """Its edge runs aslant after the move, so that the derivative has a term of it."""
    mirrored = light() >> Mirror() >> Texture(half_plane(0.2, frame=FLATLAND))
    seen = Move([[1.0, 0.5], [0.0, 1.0]])(mirrored.light)
    E, h = Integrate("x", -1.0, 1.0)(seen), 1e-5
    slope = (E(0.1 + h) - E(0.1 - h)) / (2.0 * h)
    np.testing.assert_allclose(E.jets(0.1).gradient[0], slope, rtol=1e-6)


def test_an_end_that_jumps_is_an_edge_of_the_integral():
    """Half way along the light reaches farther up, and less far down."""
    upper, lower = half_plane(0.2, 0.3, 0.7), half_plane(0.2, -0.9, -0.4)
    h = Integrate("theta", lower, upper)(light())
    rise = quad(lambda t: bell(0.2, t), 0.3, 0.7)[0]
    fall = quad(lambda t: bell(0.2, t), -0.9, -0.4)[0]
    assert [e.level(0.2).item() for e in h.edges()] == [0.0, 0.0]
    np.testing.assert_allclose(sum(e.jump(0.2) for e in h.edges()), rise - fall, rtol=1e-10)


@pytest.mark.parametrize(
    ("dtype", "v", "wide"),
    [("float64", 10.0, 1.0), ("float64", 100.0, 0.1), ("float32", 10.0, 1.0)],
)
def test_a_lamp_at_a_steep_slope_moves_its_edges(dtype, v, wide):
    """Over slopes the sides of an edge lie `1 + v^2` times as far apart as over angles."""
    lamp = Segments(*np.asarray([(-v, 1.0), (-v - wide, 1.0)], dtype))
    eye = Receiver(np.zeros(2, dtype), np.zeros((), dtype))
    L = light_field(Scene.of(primitive(lamp, emission=1.0)), eye, frame=FLATLAND_SLOPE)
    low, high = (jnp.asarray(a, dtype) for a in (v - 1.0, v + wide + 1.0))
    moment = Integrate("v", low, high)(Multiply(lambda x, v: v)(L))
    jet = jax.jit(moment.jet)(jnp.zeros(1, dtype))
    assert abs(jet.gradient[0] - wide) < (1e-6 if dtype == "float64" else 1e-3)
