import jax
import jax.numpy as jnp
import numpy as np
import pytest

from derivations.space.silhouettes.lambert_edge_term import (
    EDGES,
    _four,
    differences,
    lambert_exact,
)
from firstorder.checks.tolerance import normwise, rounding
from firstorder.space.silhouettes import _lambert_edge_term as lambert_edge_term
from firstorder.space.silhouettes._lambert_edge_term import arc_factor, lambert_edge


@pytest.fixture(scope="module", autouse=True)
def double():
    with jax.enable_x64(True):
        yield


def ends(pairs, dtype=None):
    p, q = (np.stack([_four(pair[i]) for pair in pairs], -1) for i in (0, 1))
    return jnp.asarray(p, dtype), jnp.asarray(q, dtype)


@pytest.fixture(scope="module")
def exact():
    found = [differences(lambda x, e=e: lambert_exact(*e, x), (0.0, 0.0)) for e in EDGES]
    return np.stack(found, -1)


def test_value_gradient_and_hessian_against_differences_in_50_digits(exact):
    ours = np.asarray(jax.jit(lambert_edge)(*ends(EDGES)))
    # A short edge is a difference of its ends: a rounding counts by one over its length.
    for i, (a, b) in enumerate(zip(ours.T, exact.T, strict=True)):
        p, q = map(_four, EDGES[i])
        assert normwise(a, b) < rounding(40, 1.0 / np.linalg.norm(p[:3] - q[:3]))


def test_single_precision(exact):
    ours = jax.jit(lambert_edge)(*ends(EDGES, np.float32))
    assert ours.dtype == np.float32
    bound = rounding(40, 8.0, np.float32)
    # Without the short edge, whose ends differ by 1e-4 of their directions.
    assert normwise(np.asarray(ours)[:, [0, 1, 3]], exact[:, [0, 1, 3]]) < bound


def test_the_factor_is_one_function_on_both_sides_of_the_switch():
    t = jnp.array([lambert_edge_term.SHORT * (1 - 1e-15), lambert_edge_term.SHORT * (1 + 1e-15)])
    for a in jax.jit(arc_factor)(1.0 - t, t):
        assert abs(float(a[1] - a[0])) < rounding(20, 16.0)


@pytest.mark.parametrize("s", [0.0, 2.0])
def test_an_edge_of_no_length_has_no_light_and_no_nan(s):
    p = jnp.array([0.6, 0.0, 0.8, s])
    value, slopes = jax.jit(lambda q: (lambert_edge(p, q), jax.jacfwd(lambert_edge, 1)(p, q)))(p)
    assert np.abs(value).max() < 1e-15
    assert np.isfinite(slopes).all()


def test_the_horizon_is_pi_and_does_not_move():
    """Points in the receiver's plane slide along it, at whatever distance."""
    phi = np.linspace(0.0, 2.0 * np.pi, 7)[:-1]
    s = np.array([0.0, 1.0, 0.3, 2.0, 0.0, 0.7])
    p = jnp.array([np.cos(phi), np.sin(phi), 0 * phi, s])
    total = np.asarray(jax.jit(lambda p: jnp.sum(lambert_edge(p, jnp.roll(p, -1, 1)), -1))(p))
    assert abs(total[0] - np.pi) < rounding(20)
    assert np.abs(total[1:]).max() < rounding(20, 8.0)


FAULTS = {
    "series one term late": ("_second_coefficients", lambda n: [0.0, *[1.0] * (n - 1)]),
    "switch to a series that has not converged": ("SHORT", 1.9),
}


@pytest.mark.parametrize("fault", FAULTS)
def test_a_wrong_factor_is_seen(fault, monkeypatch, exact):
    monkeypatch.setattr(lambert_edge_term, *FAULTS[fault])
    assert normwise(
        np.asarray(jax.jit(lambda p, q: lambert_edge(p, q))(*ends(EDGES))), exact
    ) > rounding(40, 8.0)


@pytest.mark.parametrize(
    "fault", ["far end stands still", "ends exchanged", "distance for its inverse"]
)
def test_a_wrong_edge_is_seen(fault, exact):
    p, q = ends(EDGES)
    wrong = {
        "far end stands still": (p, q.at[3].set(0.0)),
        "ends exchanged": (q, p),
        "distance for its inverse": (p.at[3].set(1 / p[3]), q),
    }[fault]
    error = normwise(np.asarray(jax.jit(lambert_edge)(*wrong)), exact)
    assert 1e-3 < error < np.inf
