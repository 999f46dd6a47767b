"""Shading behind blockers against high-precision differences of plain integrals; faults in it."""

import functools

import jax
import jax.numpy as jnp
import mpmath as mp
import numpy as np
import pytest

from derivations.visibility import gradients as oracle
from firstorder.visibility import (
    EdgeAngle,
    VisibilityEdges,
    angular_derivative_by_parts,
    autodiff_edges,
    circle_edge_angle,
    gradients,
    point_edge_angle,
    shading,
    shading_derivatives,
    visible_edges,
    visible_measure,
)

ENTRIES = ("B", "B_x", "B_theta", "B_xx", "B_xtheta", "B_thetatheta")


def slabs(x):
    low, high = (
        point_edge_angle(jnp.array([s[k] for s in oracle.SLABS]), jnp.stack([x, 0.0 * x]))
        for k in (0, 1)
    )
    return visible_edges(low, high)


@jax.jit
def jet(x, theta):
    T = functools.partial(oracle.transport, jnp)
    return shading(T, x, theta, slabs(x))


def test_value_gradient_and_hessian_are_those_of_the_integral():
    found = oracle._entries(jet(*map(jnp.asarray, oracle.PLACE)))
    np.testing.assert_allclose(found, oracle.brute_jet(), rtol=1e-13)


def test_the_parts_are_what_they_say():
    """Interior: edges held still. Boundary: transport held still. By differences of both."""
    s = jet(*map(jnp.asarray, oracle.PLACE))
    x, theta = oracle.PLACE
    pieces = oracle._pieces(mp, mp.mpf(x))
    with mp.workdps(30):
        h = mp.mpf(10) ** -8

        def still(dx, dt):
            return sum(
                mp.quad(lambda w: oracle.transport(mp, x + dx, theta + dt, w), p) for p in pieces
            )

        interior = [(still(h, 0) - still(-h, 0)) / (2 * h), (still(0, h) - still(0, -h)) / (2 * h)]
    np.testing.assert_allclose(s.gradient.interior, np.array(interior, float), rtol=1e-12)
    assert s.gradient.boundary[1] == 0.0  # visibility does not depend on theta
    assert s.hessian.boundary[1, 1] == 0.0
    whole = s.hessian.interior + s.hessian.boundary
    np.testing.assert_array_equal(s.hessian.total, whole)
    np.testing.assert_allclose(whole, whole.T, rtol=1e-14)


@jax.jit
def two_splits(x, theta):
    L, rho = (functools.partial(f, jnp) for f in (oracle.light, oracle.lobe))
    plain = shading(lambda x, t, w: L(x, w) * rho(t - w), x, theta, slabs(x))
    return angular_derivative_by_parts(L, rho, x, theta, slabs(x)), plain.gradient


def test_by_parts_is_the_same_derivative_with_another_split():
    parts, plain = two_splits(*map(jnp.asarray, oracle.PLACE))
    np.testing.assert_allclose(parts.total, plain.total[1], rtol=1e-13)
    assert abs(float(parts.boundary)) > 1e-2
    assert abs(parts.boundary - oracle.printed_angular(*oracle.PLACE)) > 1e-2  # the horizon's ends


# --- any parameters: a disc that moves and swells before a light of finite size ------------------

DISC = (0.15, 0.9, 0.15, -0.85, 0.95, 2.0)  # x, y, radius; light from, to, at height


def disc_and_light(p):
    """The disc's two edges; the light is a window, beyond which all is blocked."""
    low = circle_edge_angle(p[:2], p[2]).value
    high = circle_edge_angle(p[:2], p[2], -1.0).value
    right, left = -jnp.arctan(p[4] / p[5]), -jnp.arctan(p[3] / p[5])
    half = 0.5 * jnp.pi
    return jnp.stack([low, -half, left]), jnp.stack([high, right, half])


def disc_sines(p):
    """Irradiance from the light past the disc, by hand, in mpmath."""
    cx, cy, r, start, stop, h = p
    c, middle = mp.sqrt(cx**2 + cy**2), -mp.atan(cx / cy)
    low, high = middle - mp.asin(r / c), middle + mp.asin(r / c)
    right, left = -mp.atan(stop / h), -mp.atan(start / h)
    return mp.sin(left) - mp.sin(right) - (mp.sin(high) - mp.sin(low))


def test_every_parameter_of_a_scene_has_its_gradient_and_hessian():
    """Disc within the light: position, radius, and the light's own edges, all cross terms."""
    p = jnp.array(DISC)

    @jax.jit
    def ours(p):
        return shading_derivatives(lambda p, w: jnp.cos(w), p, autodiff_edges(disc_and_light, p))

    found = ours(p)
    with mp.workdps(50):
        at = [mp.mpf(c) for c in DISC]
        h = mp.mpf(10) ** -12

        def B(*shifts):
            q = list(at)
            for i, s in shifts:
                q[i] += s * h
            return disc_sines(q)

        k = range(len(DISC))
        first = [(B((i, 1)) - B((i, -1))) / (2 * h) for i in k]
        second = [
            [
                (B((i, 1), (j, 1)) - B((i, 1), (j, -1)) - B((i, -1), (j, 1)) + B((i, -1), (j, -1)))
                / (4 * h**2)
                for j in k
            ]
            for i in k
        ]
    first, second = np.array(first, float), np.array(second, float)
    np.testing.assert_allclose(found.value, float(disc_sines(DISC)), rtol=1e-14)
    np.testing.assert_allclose(
        found.gradient.total, first, rtol=0.0, atol=1e-13 * np.abs(first).max()
    )
    np.testing.assert_allclose(
        found.hessian.total, second, rtol=0.0, atol=1e-12 * np.abs(second).max()
    )
    assert np.all(np.asarray(found.gradient.interior) == 0.0)  # this transport never changes


# --- faults: the boundary terms one by one --------------------------------------------------------


def boundary(terms):
    """A twin of `_boundary` with weights on its terms."""
    sgn, cross_w, slope_w, bend_w = terms

    def twin(T, p, edges):
        def one(a, g, H, sign):
            value, T_w, T_p = T(p, a), jax.grad(T, 1)(p, a), jax.grad(T)(p, a)
            cross = jnp.outer(T_p, g)
            bend = cross_w * (cross + cross.T) + slope_w * T_w * jnp.outer(g, g)
            bend = bend + bend_w * value * H
            return sgn * sign * value * g, sgn * sign * bend

        parts = jax.vmap(one)(edges.value, edges.gradient, edges.hessian, edges.jump)
        return parts[0].sum(0), parts[1].sum(0)

    return twin


@jax.jit
def twisted(terms, x, theta):
    """The jet with that twin in the library's place, traced once for all faults."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(gradients, "_boundary", boundary(terms))
        return shading(functools.partial(oracle.transport, jnp), x, theta, slabs(x))


@pytest.mark.parametrize(
    ("fault", "terms"),
    [
        ("none", (1, 1, 1, 1)),
        ("edges do not move", (0, 1, 1, 1)),
        ("the sign is flipped", (-1, 1, 1, 1)),
        ("half of the cross term", (1, 0.5, 1, 1)),
        ("the slope of T along the angle is forgotten", (1, 1, 0, 1)),
        ("the edge does not accelerate", (1, 1, 1, 0)),
    ],
)
def test_a_fault_at_the_boundary_is_seen(fault, terms):
    found = oracle._entries(twisted(jnp.array(terms, float), *map(jnp.asarray, oracle.PLACE)))
    truth = oracle.brute_jet()
    assert np.all(np.isfinite(found))
    error = np.max(np.abs(np.array(found) - truth)) / np.max(np.abs(truth))
    assert error < 1e-13 if fault == "none" else error > 1e-2


@jax.jit
def under_cosine(low, high, x):
    """Shading from the ends of three slabs, and the measure of what is left visible."""
    place = jnp.stack([x, 0.0 * x])
    low, high = point_edge_angle(low, place), point_edge_angle(high, place, side=-1.0)
    s = shading_derivatives(lambda p, w: jnp.cos(w), jnp.zeros(2), visible_edges(low, high))
    return s, visible_measure(low.value, high.value, jnp.sin)


# --- degenerate places ---------------------------------------------------------------------------


def box_and_disc(x):
    """R07's Fig. 9 in small: a box's ends and a disc that its shadow passes behind."""
    place = jnp.stack([x, 0.0 * x])
    b = [point_edge_angle(jnp.array(c), place) for c in ((0.5, 1.0), (-0.1, 1.0))]
    d = [circle_edge_angle((-0.3, 1.6), 0.3, side, place) for side in (1.0, -1.0)]
    low, high = (jax.tree.map(lambda *a: jnp.stack(a), p, q) for p, q in zip(b, d, strict=True))
    return visible_edges(low, high)


@jax.jit
def sky(x):
    return shading(lambda x, t, w: jnp.cos(w), x, jnp.zeros_like(x), box_and_disc(x))


def test_gradients_jump_where_two_edges_are_in_line_and_stay_finite():
    """The upper end of the box passes that of the disc. Right below an end nothing is special."""
    x = np.linspace(-2.0, 3.0, 2001)
    below = [0.5, -0.1, -0.3]
    s = jax.vmap(sky)(jnp.asarray(np.concatenate([x, below])))
    assert all(np.all(np.isfinite(leaf)) for leaf in jax.tree.leaves(s))
    value, slope = np.asarray(s.value)[:2001], np.asarray(s.gradient.total[:2001, 0])
    np.testing.assert_allclose(np.gradient(value, x)[5:-5], slope[5:-5], rtol=0.0, atol=0.4)
    events = np.flatnonzero(np.abs(np.diff(slope)) > 0.05)
    assert 1 <= events.size <= 4
    # Away from them the integral of the slope is the value.
    steps = 0.5 * (slope[1:] + slope[:-1]) * np.diff(x) - np.diff(value)
    assert np.max(np.abs(np.delete(steps, events))) < 1e-5


def test_blockers_that_reach_below_the_horizon_or_behind():
    """A near disc to the left and below, a segment seen from either side, one underneath."""
    disc = [circle_edge_angle((-0.6, -0.3), 0.5, side) for side in (1.0, -1.0)]
    corners = [((0.5, 0.2), (0.9, -0.4)), ((0.9, -0.4), (0.5, 0.2)), ((1.0, -0.1), (-1.0, -0.2))]
    ends = [[point_edge_angle(corner[k]) for corner in corners] for k in (0, 1)]
    low, high = (
        jax.tree.map(lambda *a: jnp.stack(a), d, *e) for d, e in zip(disc, ends, strict=True)
    )
    edges = visible_edges(low, high)
    angle, sign = edges.edges.value, edges.edges.jump
    shown = np.sort(np.asarray(angle)[np.asarray(sign) != 0])
    middle, half = np.arctan2(0.6, -0.3), np.arcsin(0.5 / np.hypot(0.6, 0.3))
    np.testing.assert_allclose(shown, [-np.arctan2(0.5, 0.2), middle - half], rtol=1e-14)
    assert edges.start == 0.0
    assert np.sum(sign) == 0.0


def test_hidden_edges_may_be_anything():
    nan = jnp.array([jnp.nan, 0.3])
    first, second = nan[:, None] * jnp.ones(2), nan[:, None, None] * jnp.ones((2, 2))
    edge = EdgeAngle(nan, first, second, jnp.array([0.0, 1.0]))
    edges = VisibilityEdges(edge, jnp.array(1.0))

    @jax.jit
    def both(edges):
        def dark(e):
            s = shading_derivatives(lambda p, w: jnp.cos(w) * (1.0 + p[0]), jnp.zeros(2), e)
            return s.value, s

        return jax.grad(dark, has_aux=True)(edges)

    slope, s = both(edges)
    assert abs(s.value - (np.sin(0.3) + 1.0)) < 1e-15
    assert np.isfinite(s.hessian.total).all()
    assert np.all(np.isfinite(slope.edges.value))
    assert abs(slope.edges.value[1] - np.cos(0.3)) < 1e-14


def test_inside_of_a_round_blocker_there_is_no_shading():
    @jax.jit
    def value():
        around = [circle_edge_angle((0.0, 0.5), 1.0, side) for side in (1.0, -1.0)]
        edges = visible_edges(*around)
        return shading_derivatives(lambda p, w: jnp.cos(w), jnp.zeros(2), edges).value

    assert np.isnan(value())


def test_all_blocked_is_dark():
    ends = np.array([[1e7, 1e-3]] * 3)
    dark, left = under_cosine(ends, ends * [-1.0, 1.0], 0.0)
    assert abs(dark.value) < 1e-15
    assert abs(left) < 1e-15


def test_light_with_breaks_is_cut_there():

    @jax.jit
    def bent(x):
        T = lambda p, w: jnp.abs(w - 0.1)  # noqa: E731
        return shading_derivatives(T, jnp.zeros(2), slabs(x), breaks=(0.1,)).value

    truth = sum(
        float(mp.quad(lambda w: abs(w - 0.1), [a, 0.1, b] if a < 0.1 < b else [a, b]))
        for a, b in oracle._pieces(mp, 0.12)
    )
    assert abs(bent(0.12) - truth) < 1e-14


@pytest.mark.parametrize("angle", [np.nan, np.array([0.1, np.inf])])
def test_breaks_are_finite(angle):
    with pytest.raises(ValueError, match="Argument `breaks` must be finite"):
        shading_derivatives(lambda p, w: w, jnp.zeros(2), slabs(0.1), breaks=(angle,))


def test_the_measure_and_the_quadrature_agree():
    low, high = np.moveaxis(np.array(oracle.SLABS), 1, 0)
    s, measure = under_cosine(low, high, 0.12)
    assert abs(s.value - measure) < 1e-14


# --- the metric of R07 §6.2 ----------------------------------------------------------------------


def inverse_distance(x):
    """Mean over directions of 1 / distance to the box or the disc."""
    angles = np.linspace(-1.5, 1.5, 4001)
    u = np.stack([-np.sin(angles), np.cos(angles)], -1)
    met = x + u[:, 0] / u[:, 1]
    box = np.where((met > -0.1) & (met < 0.5), 1.0 / u[:, 1], np.inf)
    w = np.array([-0.3 - x, 1.6])
    near = u @ w
    inside = near**2 - w @ w + 0.09
    disc = np.where(inside > 0, near - np.sqrt(np.maximum(inside, 0.0)), np.inf)
    return np.mean(1.0 / np.minimum(box, disc))


def test_harmonic_mean_against_the_sum_over_edges():
    """R07 §6.2 says that (37) confirms the harmonic mean of blocker distances as a metric.

    Measured along box and disc: related, as both fall far from blockers, but no more than that.
    Correlation 0.64; the ratio of the two changes by a factor of more than two.
    """
    x = np.linspace(-2.0, 2.0, 81)
    edges = jax.jit(jax.vmap(box_and_disc))(jnp.asarray(x)).edges
    rates = np.sum(np.where(edges.jump != 0, np.abs(edges.gradient[..., 0]), 0.0), -1)
    means = np.array([inverse_distance(a) for a in x])
    ratio = rates / means
    assert 0.5 < np.corrcoef(rates, means)[0, 1] < 0.8
    assert ratio.max() / ratio.min() > 2.0


def test_single_precision_is_kept():
    with jax.enable_x64(False):
        s = jet(jnp.array(0.12), jnp.array(0.3))
        assert {leaf.dtype.name for leaf in jax.tree.leaves(s)} == {"float32"}
    np.testing.assert_allclose(oracle._entries(s), oracle.brute_jet(), rtol=3e-5)
