"""Edges that outlive an integral over one coordinate, and what is left of the others."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from firstorder.conventions import FLATLAND_SLOPE, Frame
from firstorder.errors import Refused
from firstorder.fields import Affine, Constant, Edge, Function, GaussianProfile
from firstorder.fields.kernel import Kernel
from firstorder.laws import _edges as module

FLAT = Affine([2.0, 0.0], -0.5, FLATLAND_SLOPE)  # changes along x alone
STEEP = Affine([0.0, 3.0], 0.1, FLATLAND_SLOPE)  # along v alone
SLANTED = Affine([1.0, 1.0], 0.2, FLATLAND_SLOPE)
BENT = Function(lambda x, v: x * x * v + x, FLATLAND_SLOPE)  # d/dv is zero where x is
HIGH = Function(lambda x, v: jnp.sin(2.0 * x) * v**2 + 4.0, FLATLAND_SLOPE)


def edges(*levels):
    return tuple(Edge(level, HIGH) for level in levels)


def test_straight_edges_that_do_not_change_along_the_axis_are_kept_whole():
    given = edges(FLAT, STEEP, SLANTED)
    assert module.surviving_edges(given, 1) == given[:1]
    assert module.surviving_edges(given, 0) == given[1:2]
    assert module.surviving_edges((), 0) == ()


def values(e, u):
    """Jump, its gradient and its Hessian at a ray."""
    jet = e.jump.jet(jnp.asarray(u))
    return [
        np.asarray(a) for a in (e.jump.at(jnp.asarray(u)), jet.value, jet.gradient, jet.hessian)
    ]


@pytest.mark.parametrize("axis", [0, 1])
def test_of_a_bent_edge_the_jump_is_kept_where_its_level_does_not_change(axis):
    (e,) = module.surviving_edges(edges(BENT), axis)
    assert e.level is BENT
    assert e.jump.frame == FLATLAND_SLOPE
    # d/dx = 2 x v + 1 is zero at (-1/2, 1); d/dv = x^2 at x = 0.
    still, moving = [((-0.5, 1.0), (0.3, 1.0)), ((0.0, 0.7), (0.3, 0.7))][axis]
    x, v = still
    sine, cosine = np.sin(2.0 * x), np.cos(2.0 * x)
    true = sine * v**2 + 4.0, [2.0 * cosine * v**2, 2.0 * sine * v]
    bend = [[-4.0 * sine * v**2, 4.0 * cosine * v], [4.0 * cosine * v, 2.0 * sine]]
    for found, one in zip(values(e, still), (true[0], true[0], true[1], bend), strict=True):
        np.testing.assert_allclose(found, one, rtol=0.0, atol=1e-12)
    for found in values(e, moving):
        np.testing.assert_array_equal(found, 0.0)


def test_a_normal_that_cannot_be_looked_at_is_asked_at_the_ray():
    @jax.jit
    def jumps(normal):
        (e,) = module.surviving_edges(edges(Affine(normal, 0.2, FLATLAND_SLOPE)), 1)
        return e.jump.at(jnp.array([0.3, 2.0]))

    assert jumps(jnp.array([1.0, 0.0])) == pytest.approx(np.sin(0.6) * 4.0 + 4.0)
    assert jumps(jnp.array([1.0, 1e-9])) == 0.0


class Lean(Kernel):
    """A kernel over (x, v) along v: it jumps at x = 1/4, and where x + v is -0.2."""

    axis: str = eqx.field(static=True, default="v")
    frame: Frame = eqx.field(static=True, default=FLATLAND_SLOPE)

    def at(self, u):
        return u[0] + 5.0 * u[1]

    def jet(self, u):
        raise NotImplementedError

    def edges(self):
        return edges(FLAT, SLANTED)

    def half_width(self):
        return jnp.array(0.75)

    def knots(self):
        return jnp.array([-0.3, 0.4])

    def semi_series(self, Omega_axis, window):
        raise NotImplementedError


class Both(Lean):
    """Of two parts."""

    def parts(self):
        return Lean(), Lean()


def test_a_kernel_jumps_at_every_angle_where_a_level_of_the_others_is_zero():
    ((level, jump),) = module.kernel_jumps(Lean())
    assert level is FLAT
    assert jump.axis == "v"
    assert jump.frame == FLATLAND_SLOPE
    u = jnp.array([0.25, 1.5])
    true = np.sin(0.5) * 2.25 + 4.0
    assert jump.at(u) == pytest.approx(true)
    jet = jump.jet(u)
    assert jet.value == pytest.approx(true)
    np.testing.assert_allclose(jet.gradient, [2.0 * np.cos(0.5) * 2.25, 2.0 * np.sin(0.5) * 1.5])
    assert jump.half_width() == 0.75
    np.testing.assert_array_equal(jump.knots(), [-0.3, 0.4])
    assert jump.edges() == ()
    with pytest.raises(Refused, match="no series"):
        jump.semi_series(jnp.array(0.0), None)
    assert len(module.kernel_jumps(Both())) == 2


def test_a_profile_varies_along_its_axis_alone():
    assert module.kernel_jumps(GaussianProfile(0.3)) == ()


def test_edges_of_a_jump_go_with_it():
    inner = module.surviving_edges(edges(BENT), 0)[0]
    nested = Edge(BENT, eqx.tree_at(lambda a: a.jump, inner.jump, Constant(2.0, FLATLAND_SLOPE)))
    assert nested.jump.edges() == ()
    assert inner.jump.edges() == HIGH.edges()
