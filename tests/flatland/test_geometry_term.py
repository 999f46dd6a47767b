import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from derivations.flatland import geometry_term as derived
from firstorder.checks.tolerance import normwise, rounding
from firstorder.flatland import _geometry_term as geometry
from firstorder.flatland._geometry_term import (
    geometry_gradient,
    geometry_hessian,
    geometry_jet,
    geometry_term,
)

ANGLE = st.floats(-3.0, 3.0)


def facing(a=0.3, b=-0.4, x=(0.2, -0.1), r=1.7, look=0.5):
    """A pair that faces each other: cosines cos(look - a) and cos(look - b), both positive."""
    n, m = derived.up(a), -derived.up(b)
    return np.array(x), n, np.array(x) + r * derived.up(look), m


def turned(angle, *vectors):
    T = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    return T, [T @ v for v in vectors]


@pytest.mark.smoke
def test_the_closed_forms_are_the_derivatives():
    pair = facing()
    assert normwise(geometry_gradient(*pair), jax.grad(geometry_term)(*pair)) < rounding(100)
    assert normwise(geometry_hessian(*pair), jax.hessian(geometry_term)(*pair)) < rounding(100)
    by_y = jax.grad(geometry_term, argnums=2)(*pair)
    assert normwise(geometry_gradient(*pair), -by_y) < rounding(100)


@pytest.mark.parametrize("order", [0, 1, 2])
def test_against_the_angle_subtended(order):
    assert derived.brute_force(order) < (1e-13, 1e-9, 1e-9)[order]


@given(ANGLE)
def test_rigid_motion(angle):
    """Turned about the origin and shifted: the value stays, gradient and Hessian turn along."""
    x, n, y, m = facing()
    T, (x2, n2, y2, m2) = turned(angle, x, n, y, m)
    ours, there = geometry_jet(x, n, y, m), geometry_jet(x2 + 0.7, n2, y2 + 0.7, m2)
    assert normwise(there.value, ours.value) < rounding(100)
    assert normwise(there.gradient, T @ ours.gradient) < rounding(100, 10.0)
    assert normwise(there.hessian, T @ ours.hessian @ T.T) < rounding(100, 10.0)


@given(st.floats(0.01, 100.0))
def test_units(scale):
    """1/m, 1/m^2, 1/m^3."""
    x, n, y, m = facing()
    small, large = geometry_jet(x, n, y, m), geometry_jet(scale * x, n, scale * y, m)
    for k, (a, b) in enumerate(zip(small, large, strict=True)):
        assert normwise(b * scale ** (k + 1), a) < rounding(100, 10.0)


def test_reciprocity():
    x, n, y, m = facing()
    assert normwise(geometry_term(y, m, x, n), geometry_term(x, n, y, m)) < rounding()
    assert normwise(geometry_gradient(y, m, x, n), -geometry_gradient(x, n, y, m)) < rounding(100)


def test_a_turn_of_the_normal_needs_no_formula_of_its_own():
    """G is linear in n_x: the derivative by its angle is G with `-tangent` for the normal."""
    x, n, y, m = facing()
    p = y - x
    r = np.hypot(*p)
    u, along = p / r, -np.array([n[1], -n[0]])
    jet = geometry.linear_jet(jnp.array(r), u, along, m, along @ u, -(m @ u))
    angle = 0.3
    by_angle = jax.jacfwd(lambda a: geometry_jet(x, jnp.stack([-jnp.sin(a), jnp.cos(a)]), y, m))(
        angle
    )
    for ours, truth in zip(jet, by_angle, strict=True):
        assert normwise(ours, truth) < rounding(100)


def test_neighbours_on_a_curve_see_each_other_less_the_nearer_they_are():
    """In a bowl of curvature k, `G = k^2 r / 4`."""
    k, t = 1.6, np.array([1e-3, 0.1, 0.8])
    y = np.stack([np.sin(t), 1 - np.cos(t)], -1) / k
    inward = np.stack([-np.sin(t), np.cos(t)], -1)
    G = geometry_term(np.zeros(2), np.array([0.0, 1.0]), y, inward)
    np.testing.assert_allclose(G, k**2 * np.hypot(*y.T) / 4, rtol=1e-9)


def test_no_distance_is_zero_and_never_nan():
    up = jnp.array([0.0, 1.0])
    jet = geometry_jet(jnp.zeros(2), up, jnp.zeros(2), -up)
    assert all(np.all(np.asarray(part) == 0.0) for part in jet)
    for argument in range(4):
        args = [jnp.zeros(2), up, jnp.zeros(2), -up]
        assert np.all(np.asarray(jax.grad(geometry_term, argnums=argument)(*args)) == 0.0)
        H = jax.hessian(geometry_term, argnums=argument)(*args)
        assert np.all(np.isfinite(H))


@pytest.mark.parametrize("turn", ["receiver", "sender"])
def test_what_turns_its_back_gives_nothing(turn):
    x, n, y, m = facing()
    n, m = (-n, m) if turn == "receiver" else (n, -m)
    for part in geometry_jet(x, n, y, m):
        assert np.all(np.asarray(part) == 0.0)


@pytest.mark.smoke
def test_single_precision_and_batches():
    pairs = [np.stack(c) for c in zip(facing(), facing(b=0.1, r=0.4), strict=True)]
    exact = geometry_jet(*pairs)
    single = geometry_jet(*(jnp.asarray(p, jnp.float32) for p in pairs))
    for a, b in zip(single, exact, strict=True):
        assert a.dtype == jnp.float32
        assert a.shape[0] == 2
        assert normwise(np.asarray(a, float), b) < rounding(100, dtype=np.float32)


# --- deliberate faults --------------------------------------------------------------------------


def wrong(change):
    """A twin of `linear_jet` with one thing changed."""
    right = geometry.linear_jet

    def twin(r, u, normal_x, normal_y, cos_x, cos_y):
        return change(
            right(r, u, normal_x, normal_y, cos_x, cos_y), r, u, normal_x, normal_y, cos_x, cos_y
        )

    return twin


FAULTS = {
    "the sign of the receiver's normal": lambda j, r, u, n, m, a, b: j._replace(
        gradient=j.gradient + (2 * b / r**2)[..., None] * n
    ),
    "the fall-off of space": lambda j, r, u, n, m, a, b: j._replace(
        gradient=j.gradient + (a * b / r**2)[..., None] * u
    ),
    "no identity in the Hessian": lambda j, r, u, n, m, a, b: j._replace(
        hessian=j.hessian + (3 * a * b / r**3)[..., None, None] * jnp.eye(2)
    ),
    "half of a symmetric product": lambda j, r, u, n, m, a, b: j._replace(
        hessian=j.hessian + n[..., :, None] * m[..., None, :] / r[..., None, None] ** 3
    ),
}


@pytest.mark.parametrize("fault", FAULTS)
def test_faults_are_noticed(fault, monkeypatch):
    monkeypatch.setattr(geometry, "linear_jet", wrong(FAULTS[fault]))
    errors = derived.brute_force(1), derived.brute_force(2)
    assert all(np.isfinite(errors))
    assert max(errors) > 1e-2
