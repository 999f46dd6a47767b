"""The edge angle against bisection of traced rays, along every motion; degenerate places."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from derivations.visibility.edge_angles import CASES, bisected
from firstorder.conventions import direction
from firstorder.visibility import (
    EdgeAngle,
    circle_edge_angle,
    edge_at,
    point_edge_angle,
    visible_edges,
)

ANGLES = st.floats(-1.3, 1.3)


def test_alpha_is_the_direction_of_the_point():
    point, position, n = jnp.array([0.4, 1.7]), jnp.array([-0.3, 0.2]), 0.35
    a = point_edge_angle(point, position, n)
    met = position + a.distance * direction(a.value + n)
    np.testing.assert_allclose(met, point, rtol=1e-15)


def closed(case, order):
    center, radius, side, position, n, kappa = case
    a = circle_edge_angle(center, radius, side, position, n).along(kappa)
    return float(a.first if order == 1 else a.second)


@pytest.mark.parametrize("case", CASES)
@pytest.mark.parametrize("order", [1, 2])
def test_derivatives_along_a_curved_receiver_are_those_of_traced_rays(case, order):
    truth = bisected(order, *case)
    assert abs(closed(case, order) - truth) < 1e-12 * abs(truth)


def wrong(terms):
    """alpha_xx with some of its terms changed, at the local angle and distance of a case."""

    def second(case):
        center, radius, side, position, n, kappa = case
        a = circle_edge_angle(center, radius, side, position, n)
        s, c, D = np.sin(a.value), np.cos(a.value), float(a.distance)
        parts = np.array([-2 * s * c / D**2, kappa * s / D, -side * radius * c**2 / D**3])
        return float(parts @ np.array(terms))

    return second


@pytest.mark.parametrize(
    ("fault", "terms"),
    [
        ("none", (1, 1, 1)),
        ("the blocker's radius is forgotten", (1, 1, 0)),
        ("the slide has the wrong sign", (1, 1, -1)),
        ("the distance is held fixed", (0.5, 1, 1)),
        ("the receiver's bending is forgotten", (1, 0, 1)),
    ],
)
def test_a_fault_in_the_second_derivative_is_seen(fault, terms):
    errors = [abs(wrong(terms)(c) / bisected(2, *c) - 1.0) for c in CASES]
    assert (max(errors) > 1e-2) == (fault != "none")


def test_towards_the_other_side_the_sign_changes():
    """R07's 3D angle grows towards +u: there (36) is negative, as (45) says."""
    point, h = (0.3, 1.1), 1e-6
    towards = [np.arctan2(point[0] - x, point[1]) for x in (h, -h)]
    measured = (towards[0] - towards[1]) / (2 * h)
    assert abs(point_edge_angle(point).along().first + measured) < 1e-9


@given(ANGLES, st.floats(0.2, 3.0), st.floats(-2.0, 2.0), st.floats(0.1, 10.0))
def test_scaling_the_scene_scales_derivatives(angle, D, n, scale):
    point = D * np.asarray(direction(jnp.asarray(angle + n)))
    one = point_edge_angle(point, n=n, radius=0.3).along(kappa=0.2)
    two = point_edge_angle(scale * point, n=n, radius=0.3 * scale).along(kappa=0.2 / scale)
    np.testing.assert_allclose(two.value, one.value, rtol=0.0, atol=1e-14)
    np.testing.assert_allclose(two.first * scale, one.first, rtol=1e-12, atol=1e-13)
    np.testing.assert_allclose(two.second * scale**2, one.second, rtol=1e-12, atol=1e-12)


def moved(point, position, n, **how):
    """The edge as the receiver steps along its tangent and its normal, and turns."""
    axes = jnp.stack([jnp.array([jnp.cos(n), jnp.sin(n)]), direction(jnp.asarray(n))], -1)
    return lambda q: point_edge_angle(point, position + axes @ q[:2], n + q[2], **how)


def test_derivatives_by_all_freedoms_are_those_of_autodiff():
    angle = moved(jnp.array([0.4, 1.7]), jnp.array([-0.3, 0.2]), 0.35)
    zero = jnp.zeros(3)
    a, auto = angle(zero), lambda q: angle(q).value
    np.testing.assert_allclose(a.gradient, jax.jit(jax.grad(auto))(zero), rtol=1e-14)
    np.testing.assert_allclose(a.hessian, jax.jit(jax.hessian(auto))(zero), rtol=1e-13, atol=1e-15)


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_the_limb_of_a_disc_slides_for_every_step(side):
    center, position = jnp.array([0.9, 1.2]), jnp.array([-0.3, 0.2])
    auto = lambda q: circle_edge_angle(center, 0.4, side, position + q).value  # noqa: E731
    found = circle_edge_angle(center, 0.4, side, position).hessian[:2, :2]
    np.testing.assert_allclose(found, jax.jit(jax.hessian(auto))(jnp.zeros(2)), rtol=1e-12)


def test_they_give_every_motion():
    """Along a curved receiver: q' H q' + g q'' with the turn that goes with it."""
    kappa, change = 0.7, -0.3
    a = moved(jnp.array([0.4, 1.7]), jnp.array([-0.3, 0.2]), 0.35, radius=0.2, side=-1.0)(
        jnp.zeros(3)
    )
    step, bent = jnp.array([1.0, 0.0, kappa]), jnp.array([0.0, kappa, change])
    along = a.along(kappa, change)
    np.testing.assert_allclose(along.first, a.gradient @ step, rtol=1e-14)
    np.testing.assert_allclose(
        along.second, step @ a.hessian @ step + a.gradient @ bent, rtol=1e-14
    )


def test_along_a_curve_any_derivatives_go():
    """Of a direction the second by the turn alone is zero; the formula does not count on it."""
    rng = np.random.default_rng(0)
    g, H = rng.normal(size=3), rng.normal(size=(3, 3))
    H = H + H.T
    kappa, change = 0.7, -0.3

    def followed(x):
        u = jnp.stack([x, 0.5 * kappa * x**2, kappa * x + 0.5 * change * x**2])
        return g @ u + 0.5 * u @ H @ u

    edge = EdgeAngle(*(jnp.asarray(a) for a in (0.2, g, H, 1.0))).along(kappa, change)
    np.testing.assert_allclose(edge.first, jax.grad(followed)(0.0), rtol=1e-14)
    np.testing.assert_allclose(edge.second, jax.hessian(followed)(0.0), rtol=1e-14)


def test_a_known_angle_and_distance_are_a_point():
    a = point_edge_angle((0.4, 1.7), (-0.3, 0.2), 0.35, radius=0.2, side=-1.0)
    same = edge_at(a.value, 1.0 / a.distance, -1.0, 0.2 / a.distance**3)
    for ours, point in zip(jax.tree.leaves(same), jax.tree.leaves(a), strict=True):
        np.testing.assert_allclose(ours, point, rtol=1e-14, atol=1e-15)


def test_a_turn_on_the_spot():
    a = point_edge_angle((0.3, 2.0), (0.1, 0.0), 0.2)
    slope = jax.grad(lambda n: point_edge_angle((0.3, 2.0), (0.1, 0.0), n).value)(0.2)
    np.testing.assert_allclose([a.gradient[2], slope], -1.0, rtol=1e-15)
    assert np.all(a.hessian[2] == 0.0)


def test_one_derivative_is_asked_of_one_motion():
    with pytest.raises(ValueError, match="one derivative for each of 3 freedoms"):
        _ = point_edge_angle((0.3, 2.0)).first


def test_a_small_disc_is_a_corner():
    corner = point_edge_angle((0.4, 1.3)).along(kappa=0.3)
    disc = circle_edge_angle((0.4, 1.3), 1e-7).along(kappa=0.3)
    for ours, same in zip(jax.tree.leaves(disc), jax.tree.leaves(corner), strict=True):
        np.testing.assert_allclose(ours, same, rtol=0.0, atol=3e-7)


def test_there_is_no_angle_on_the_point_or_inside_the_disc():
    """NaN in value, and no NaN in derivatives: a padded slot must not poison a sum."""
    assert np.isnan(point_edge_angle((0.0, 0.0)).value)
    assert np.isnan(circle_edge_angle((0.0, 0.5), 1.0).value)
    assert np.isnan(circle_edge_angle((0.0, 0.5), 0.5).along().second)

    @jax.jit
    @jax.grad
    def masked(x):
        disc, corner = (
            circle_edge_angle(jnp.stack([x, 0.5]), 1.0),
            point_edge_angle(jnp.stack([x, 0.0 * x])),
        )
        return jnp.nan_to_num(disc.value) + jnp.nan_to_num(corner.value)

    assert masked(0.0) == 0.0


def test_discs_behind_and_at_the_side_are_finite():
    centers = jnp.array([[0.0, -2.0], [2.0, 0.0], [-2.0, 0.0], [0.0, 1.0 + 1e-12]])
    a = jax.jit(circle_edge_angle)(centers, 1.0)
    assert all(np.all(np.isfinite(leaf)) for leaf in jax.tree.leaves(a)[:2])


@pytest.mark.smoke
def test_bad_numbers_are_one_sentence():
    with pytest.raises(ValueError, match=r"^Argument `radius` must be positive, but is 0.0.$"):
        circle_edge_angle((0.0, 1.0), 0.0)
    with pytest.raises(ValueError, match=r"^Argument `radius` must not be negative, but is -1.0.$"):
        point_edge_angle((0.0, 1.0), radius=-1.0)
    with pytest.raises(ValueError, match=r"^Argument `n` must be finite, but is nan.$"):
        point_edge_angle((0.0, 1.0), n=np.nan)
    with pytest.raises(ValueError, match=r"^Argument `point` must be finite, but is nan.$"):
        point_edge_angle((np.nan, 1.0))
    with pytest.raises(ValueError, match=r"^Argument `center` must be finite, but is inf.$"):
        circle_edge_angle((np.inf, 1.0), 1.0)


def test_a_traced_radius_below_zero_gives_nan():
    found = jax.jit(lambda radius: point_edge_angle((0.0, 1.0), radius=radius))(
        jnp.array([-1.0, 1.0])
    )
    for leaf in (found.value, found.gradient, found.hessian):
        assert np.all(np.isnan(leaf[0]))
        assert np.all(np.isfinite(leaf[1]))


def test_single_precision_is_kept():
    with jax.enable_x64(False):
        a = jax.jit(circle_edge_angle)(jnp.array([0.3, 1.4]), jnp.array(0.5), jnp.array(1.0))
        assert {leaf.dtype.name for leaf in jax.tree.leaves(a)} == {"float32"}
    truth = circle_edge_angle((0.3, 1.4), 0.5).along().second
    np.testing.assert_allclose(a.along().second, truth, rtol=1e-5)


def test_only_an_edge_by_all_motions_follows_a_curve():
    low = point_edge_angle(jnp.array([[1.0, 2.0]]))
    high = point_edge_angle(jnp.array([[-1.0, 2.0]]), side=-1.0)
    for edge in (low.along(0.5), visible_edges(low, high).edges):
        with pytest.raises(ValueError, match="all three motions"):
            edge.along(0.5)


@pytest.mark.parametrize(
    "ask",
    [
        lambda: point_edge_angle((3.0,)),
        lambda: point_edge_angle((1.0, 2.0), position=0.5),
        lambda: circle_edge_angle((0.0, 1.0, 2.0), 0.1),
    ],
)
def test_points_of_the_plane_have_two_coordinates(ask):
    with pytest.raises(ValueError, match="must have two coordinates"):
        ask()
