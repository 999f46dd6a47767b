"""The term between two patches against autodiff of its definition, in two, three and more."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from firstorder.checks.tolerance import normwise, rounding
from firstorder.scene import _geometry_term as geometry_term

PAIRS = 8


def pairs(d):
    """Points that see each other, with unit normals in no special position."""
    rng = np.random.default_rng(d)
    x, y = rng.normal(size=(2, PAIRS, d))
    way = (y - x) / np.linalg.norm(y - x, axis=-1, keepdims=True)
    normals = [sign * way + 0.5 * rng.normal(size=way.shape) for sign in (1.0, -1.0)]
    n, m = (v / np.linalg.norm(v, axis=-1, keepdims=True) for v in normals)
    return tuple(map(jnp.asarray, (x, n, y, m)))


def definition(x, n, y, m):
    """Written in p, not in u and the cosines."""
    p = y - x
    return -(n @ p) * (m @ p) * (p @ p) ** (-0.5 * (p.size + 1))


def autodiff(here):
    parts = definition, jax.grad(definition), jax.hessian(definition)
    return tuple(jax.vmap(part)(*here) for part in parts)


def error(here, formulas=geometry_term.linear_jet):
    _, n, _, m = here
    f = geometry_term.facing(*here)
    jet = formulas(f.r, f.u, n, m, f.cos_x, f.cos_y)
    return max(normwise(a, b) for a, b in zip(jet, autodiff(here), strict=True))


@pytest.mark.parametrize("d", [2, 3, 5])
def test_the_closed_forms_are_the_derivatives(d):
    here = pairs(d)
    assert np.all(geometry_term.facing(*here).sees)
    assert error(here) < rounding(100)
    np.testing.assert_allclose(
        geometry_term.value(geometry_term.facing(*here)), autodiff(here)[0], rtol=1e-13
    )


@pytest.mark.parametrize("d", [2, 3])
def test_backs_and_coinciding_points_show_nothing(d):
    x, n, y, m = pairs(d)
    for f in (
        geometry_term.facing(x, -n, y, m),
        geometry_term.facing(x, n, y, -m),
        geometry_term.facing(x, -n, y, -m),
        geometry_term.facing(x, n, x, m),
    ):
        assert not np.any(f.sees)
        jet = geometry_term.linear_jet(f.r, f.u, n, m, f.cos_x, f.cos_y)
        assert not any(
            np.any(part)
            for part in (*geometry_term.with_horizons(jet, f.sees), geometry_term.value(f))
        )


FAULTS = {
    "the fall-off of another dimension": lambda r, u, n, m, a, b: (r, u, n, m, a, b * r),
    "the normal of the other side": lambda r, u, n, m, a, b: (r, u, n, -m, a, b),
    "looking back": lambda r, u, n, m, a, b: (r, -u, n, m, a, b),
    "cosines exchanged": lambda r, u, n, m, a, b: (r, u, n, m, b, a),
}


@pytest.mark.parametrize("fault", FAULTS)
@pytest.mark.parametrize("d", [2, 3])
def test_faults_are_noticed(d, fault):
    wrong = error(pairs(d), lambda *args: geometry_term.linear_jet(*FAULTS[fault](*args)))
    assert np.isfinite(wrong)
    assert wrong > 1e-2
