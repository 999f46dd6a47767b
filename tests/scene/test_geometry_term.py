"""The term between two patches: definitions, identities and limits, in two dimensions and more."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from derivations.scene import geometry_term as derived
from firstorder.checks.tolerance import normwise, rounding
from firstorder.scene import _geometry_term as module
from firstorder.scene._geometry_term import (
    facing,
    geometry_gradient,
    geometry_hessian,
    geometry_jet,
    geometry_term,
    linear_jet,
)

ANGLE = st.floats(-3.0, 3.0)


def pairs(d, count=64):
    """Points that see each other, with unit normals in no special position."""
    rng = np.random.default_rng(d)
    x, y = rng.normal(size=(2, count, d))
    way = (y - x) / np.linalg.norm(y - x, axis=-1, keepdims=True)
    normals = [sign * way + 0.5 * rng.normal(size=way.shape) for sign in (1.0, -1.0)]
    n, m = (v / np.linalg.norm(v, axis=-1, keepdims=True) for v in normals)
    sees = (np.sum(n * way, -1) > 0.1) & (np.sum(m * way, -1) < -0.1)
    assert np.sum(sees) > count / 2
    return tuple(jnp.asarray(v[sees]) for v in (x, n, y, m))


def definition(x, n, y, m):
    """Written in p, not in u and the cosines."""
    p = y - x
    return -(n @ p) * (m @ p) * (p @ p) ** (-0.5 * (p.size + 1))


@jax.jit
def autodiff(here):
    parts = definition, jax.grad(definition), jax.hessian(definition)
    return tuple(jax.vmap(part)(*here) for part in parts)


def worst(ours, here):
    return max(normwise(a, b) for a, b in zip(ours, autodiff(here), strict=True))


@pytest.mark.smoke
@pytest.mark.parametrize("d", [2, 3, 5])
def test_the_closed_forms_are_the_derivatives(d):
    here = pairs(d)
    assert np.all(facing(*here).sees)
    jet = jax.jit(geometry_jet)(*here)
    assert worst(jet, here) < rounding(100)
    np.testing.assert_allclose(geometry_term(*here), autodiff(here)[0], rtol=1e-13)
    g, H = jax.jit(lambda *p: (geometry_gradient(*p), geometry_hessian(*p)))(*here)
    assert normwise(g, jet.gradient) < rounding(100)
    assert normwise(H, jet.hessian) < rounding(100)
    assert normwise(H, jnp.swapaxes(H, -1, -2)) < rounding(100)
    by_x, by_y = (jax.vmap(jax.grad(geometry_term, argnums=k))(*here) for k in (0, 2))
    assert normwise(g, by_x) < rounding(100)
    assert normwise(g, -by_y) < rounding(100)
    assert normwise(H, jax.vmap(jax.hessian(geometry_term))(*here)) < rounding(100)


@pytest.mark.parametrize("d", [2, 3])
@pytest.mark.parametrize("order", [0, 1, 2])
def test_against_the_angle_subtended(order, d):
    assert derived.brute_force(order, d) < (1e-13, 1e-12, 1e-12)[order]


# --- identities ---------------------------------------------------------------------------------


def seen(a=0.3, b=-0.4, x=(0.2, -0.1), r=1.7, look=0.5):
    """A pair of flatland: cosines cos(look - a) and cos(look - b), both positive."""
    n, m = derived.up(a), -derived.up(b)
    return np.array(x), n, np.array(x) + r * derived.up(look), m


@given(ANGLE)
def test_rigid_motion(angle):
    """Turned about the origin and shifted: the value stays, gradient and Hessian turn along."""
    x, n, y, m = seen()
    T = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    ours, there = geometry_jet(x, n, y, m), geometry_jet(T @ x + 0.7, T @ n, T @ y + 0.7, T @ m)
    assert normwise(there.value, ours.value) < rounding(100)
    assert normwise(there.gradient, T @ ours.gradient) < rounding(100, 10.0)
    assert normwise(there.hessian, T @ ours.hessian @ T.T) < rounding(100, 10.0)


@given(st.floats(0.01, 100.0))
def test_units_of_flatland(scale):
    """1/m, 1/m^2, 1/m^3."""
    x, n, y, m = seen()
    small, large = geometry_jet(x, n, y, m), geometry_jet(scale * x, n, scale * y, m)
    for k, (a, b) in enumerate(zip(small, large, strict=True)):
        assert normwise(b * scale ** (k + 1), a) < rounding(100, 10.0)


@pytest.mark.parametrize("d", [2, 3])
def test_rescaling_and_reciprocity(d):
    x, n, y, m = pairs(d)
    here, there = geometry_jet(x, n, y, m), geometry_jet(3.0 * x, n, 3.0 * y, m)
    for k, (a, b) in enumerate(zip(here, there, strict=True)):
        assert normwise(b * 3.0 ** (d - 1 + k), a) < 1e-13
    back = geometry_jet(y, m, x, n)
    assert normwise(back.value, here.value) < 1e-14
    assert normwise(back.gradient, -here.gradient) < 1e-13
    assert normwise(back.hessian, here.hessian) < 1e-13
    assert normwise(geometry_term(y, m, x, n), geometry_term(x, n, y, m)) < rounding()


def test_a_turn_of_the_normal_needs_no_formula_of_its_own():
    """G is linear in n_x: the derivative by its angle is G with `-tangent` for the normal."""
    x, n, y, m = seen()
    p = y - x
    r = np.hypot(*p)
    u, along = p / r, -np.array([n[1], -n[0]])
    jet = linear_jet(jnp.array(r), u, along, m, along @ u, -(m @ u))
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


def test_points_of_a_sphere_see_each_other_alike():
    """`G = 1 / (4 R^2)` for any two of them, seen from inside."""
    rng = np.random.default_rng(1)
    p, q = (v / np.linalg.norm(v, axis=-1, keepdims=True) for v in rng.normal(size=(2, 50, 3)))
    R = 1.7
    found = geometry_term(*map(jnp.asarray, (R * p, -p, R * q, -q)))
    np.testing.assert_allclose(found, 0.25 / R**2, rtol=1e-12)


# --- nothing seen -------------------------------------------------------------------------------


@pytest.mark.parametrize("d", [2, 3])
def test_backs_and_coinciding_points_show_nothing(d):
    x, n, y, m = pairs(d)
    for here in ((x, -n, y, m), (x, n, y, -m), (x, -n, y, -m), (x, n, x, m)):
        assert not np.any(facing(*here).sees)
        assert not any(np.any(part) for part in (*geometry_jet(*here), geometry_term(*here)))


@pytest.mark.parametrize("d", [2, 3])
@pytest.mark.parametrize("bits", [32, 64])
def test_nothing_seen_has_the_derivative_zero_and_never_nan(bits, d):
    real = jnp.dtype(f"float{bits}")
    zero, (side, *_, up) = jnp.zeros(d, real), jnp.eye(d, dtype=real)
    parts = jax.jit(
        lambda *here: (
            *geometry_jet(*here),
            *jax.grad(geometry_term, argnums=(0, 1, 2, 3))(*here),
        )
    )
    for y, down in ((up, up), (-up, -up), (zero, -up), (side, -side)):
        for part in parts(zero, up, y, down):
            assert part.dtype == real
            assert not np.any(np.asarray(part))
    for argument in range(4):
        H = jax.hessian(geometry_term, argnums=argument)(zero, up, zero, -up)
        assert np.all(np.isfinite(H))


@pytest.mark.smoke
@pytest.mark.parametrize("d", [2, 3])
def test_single_precision_and_batches(d):
    here = tuple(v[:2] for v in pairs(d))
    exact = geometry_jet(*here)
    single = geometry_jet(*(jnp.asarray(p, jnp.float32) for p in here))
    for a, b in zip(single, exact, strict=True):
        assert a.dtype == jnp.float32
        assert a.shape[0] == 2
        assert normwise(np.asarray(a, float), b) < rounding(100, dtype=np.float32)


# --- deliberate faults --------------------------------------------------------------------------

ARGUMENTS = {
    "the fall-off of another dimension": lambda r, u, n, m, a, b: (r, u, n, m, a, b * r),
    "the normal of the other side": lambda r, u, n, m, a, b: (r, u, n, -m, a, b),
    "looking back": lambda r, u, n, m, a, b: (r, -u, n, m, a, b),
    "cosines exchanged": lambda r, u, n, m, a, b: (r, u, n, m, b, a),
}


@pytest.mark.parametrize("fault", ARGUMENTS)
@pytest.mark.parametrize("d", [2, 3])
def test_faults_of_the_arguments_are_noticed(d, fault, monkeypatch):
    here = pairs(d)
    monkeypatch.setattr(module, "linear_jet", lambda *args: linear_jet(*ARGUMENTS[fault](*args)))
    wrong = worst(geometry_jet(*here), here)
    assert np.isfinite(wrong)
    assert wrong > 1e-2


TERMS = {
    "the sign of the receiver's normal": lambda j, r, u, n, m, a, b: j._replace(
        gradient=j.gradient + (2 * b / r ** u.shape[-1])[..., None] * n
    ),
    "the fall-off of one dimension more": lambda j, r, u, n, m, a, b: j._replace(
        gradient=j.gradient + (a * b / r ** u.shape[-1])[..., None] * u
    ),
    "no identity in the Hessian": lambda j, r, u, n, m, a, b: j._replace(
        hessian=j.hessian
        + (3 * a * b / r ** (u.shape[-1] + 1))[..., None, None] * jnp.eye(u.shape[-1])
    ),
    "half of a symmetric product": lambda j, r, u, n, m, a, b: j._replace(
        hessian=j.hessian
        + n[..., :, None] * m[..., None, :] / r[..., None, None] ** (u.shape[-1] + 1)
    ),
}


@pytest.mark.parametrize("fault", TERMS)
@pytest.mark.parametrize("d", [2, 3])
def test_faults_of_a_term_are_noticed(d, fault, monkeypatch):
    monkeypatch.setattr(module, "linear_jet", lambda *args: TERMS[fault](linear_jet(*args), *args))
    errors = derived.brute_force(1, d), derived.brute_force(2, d)
    assert all(np.isfinite(errors))
    assert max(errors) > 1e-2


@pytest.mark.parametrize("which", range(4))
def test_nan_is_not_taken_for_what_is_not_seen(which):
    up = jnp.array([0.0, 0.0, 1.0])
    given = [0.0 * up, up, 2.0 * up, -up]
    given[which] = given[which] * jnp.nan
    assert np.isnan(geometry_jet(*given).value)
