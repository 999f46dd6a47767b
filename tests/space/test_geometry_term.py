import jax
import jax.numpy as jnp
import numpy as np
import pytest

from firstorder.checks.tolerance import normwise, rounding
from firstorder.space import _geometry_term as module
from firstorder.space._geometry_term import (
    coupling,
    coupling_gradient,
    coupling_hessian,
    coupling_jet,
)

PAIRS = 64


@pytest.fixture(scope="module")
def pairs():
    """Points that see each other, with unit normals in no special position."""
    rng = np.random.default_rng(5)
    x, y = rng.normal(size=(2, PAIRS, 3))
    way = (y - x) / np.linalg.norm(y - x, axis=-1, keepdims=True)
    up, down = way + 0.5 * rng.normal(size=way.shape), -way + 0.5 * rng.normal(size=way.shape)
    unit = [n / np.linalg.norm(n, axis=-1, keepdims=True) for n in (up, down)]
    sees = (np.sum(unit[0] * way, -1) > 0.1) & (np.sum(unit[1] * way, -1) < -0.1)
    assert np.sum(sees) > PAIRS / 2
    return [jnp.asarray(a[sees]) for a in (x, unit[0], y, unit[1])]


jet = jax.jit(coupling_jet)


@jax.jit
def autodiff(x, up, y, down):
    def value(x):  # from the definition: nothing shared with the closed forms
        p = y - x
        return -(up @ p) * (down @ p) / (p @ p) ** 2

    return value(x), jax.grad(value)(x), jax.hessian(value)(x)


def worst(ours, pairs):
    return max(normwise(a, b) for a, b in zip(ours, jax.vmap(autodiff)(*pairs), strict=True))


@pytest.mark.smoke
def test_closed_forms_are_autodiffs(pairs):
    assert worst(jet(*pairs), pairs) < rounding(100)
    g, H = jax.jit(lambda *p: (coupling_gradient(*p), coupling_hessian(*p)))(*pairs)
    assert normwise(g, jet(*pairs).gradient) < rounding(100)
    assert normwise(H, jnp.swapaxes(H, -1, -2)) < rounding(100)


def test_points_of_a_sphere_couple_alike():
    """`G = 1 / (4 R^2)` for any two of them, seen from inside."""
    rng = np.random.default_rng(1)
    p, q = (v / np.linalg.norm(v, axis=-1, keepdims=True) for v in rng.normal(size=(2, 50, 3)))
    R = 1.7
    found = coupling(*map(jnp.asarray, (R * p, -p, R * q, -q)))
    np.testing.assert_allclose(found, 0.25 / R**2, rtol=1e-12)


def test_rescaling_and_reciprocity(pairs):
    x, up, y, down = pairs
    here, there = jet(*pairs), jet(3.0 * x, up, 3.0 * y, down)
    for k, (a, b) in enumerate(zip(here, there, strict=True)):
        assert normwise(b * 3.0 ** (2 + k), a) < 1e-13
    back = jet(y, down, x, up)
    assert normwise(back.value, here.value) < 1e-14
    assert normwise(back.gradient, -here.gradient) < 1e-13
    assert normwise(back.hessian, here.hessian) < 1e-13


@pytest.mark.parametrize("bits", [32, 64])
def test_backs_and_coinciding_points_give_zero_and_no_nan(bits):
    real = jnp.dtype(f"float{bits}")
    up, side = jnp.array([0.0, 0.0, 1.0], real), jnp.array([1.0, 0.0, 0.0], real)
    zero = jnp.zeros(3, real)
    slope = jax.jit(jax.grad(coupling))
    for y, down in ((up, up), (-up, -up), (zero, -up), (side, -side)):
        for part in (*jet(zero, up, y, down), slope(zero, up, y, down)):
            assert part.dtype == real
            assert not np.any(np.asarray(part))


FAULTS = {
    "the fall-off of flatland": lambda r, u, n, m, a, b: (r, u, n, m, a, b * r),
    "the normal of the other side": lambda r, u, n, m, a, b: (r, u, n, -m, a, b),
    "looking back": lambda r, u, n, m, a, b: (r, -u, n, m, a, b),
    "cosines exchanged": lambda r, u, n, m, a, b: (r, u, n, m, b, a),
}


@pytest.mark.parametrize("fault", FAULTS)
def test_faults_are_noticed(fault, pairs, monkeypatch):
    right = module.linear_jet
    monkeypatch.setattr(module, "linear_jet", lambda *args: right(*FAULTS[fault](*args)))
    wrong = jax.jit(lambda *p: module.coupling_jet(*p))(*pairs)
    error = worst(wrong, pairs)
    assert np.isfinite(error)
    assert error > 1e-2
