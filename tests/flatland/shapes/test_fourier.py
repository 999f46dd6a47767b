import jax
import jax.numpy as jnp
import numpy as np
import pytest

from firstorder.flatland import Receiver, Scene, closed_curve, irradiance, primitive
from tests.flatland.worlds import bean


def as_circle(x, y, r):
    a = 2.0 * np.pi * np.arange(32) / 32
    return jax.tree.map(
        lambda c: c[0], closed_curve(np.stack([x + r * np.cos(a), y + r * np.sin(a)], -1), 2)
    )


OFF = jnp.array(False)


def test_a_circle_as_a_series_is_met_like_a_circle():
    d = jnp.array([0.6, 0.8])

    def t(x):
        return as_circle(1.0, 2.0, 0.7).hit(jnp.array([x, 0.1]), d, OFF)[0]

    def circle(x):
        w = jnp.array([x - 1.0, 0.1 - 2.0])
        b = w @ d
        return -b - jnp.sqrt(b**2 - w @ w + 0.49)

    for f, g in (
        (t, circle),
        (jax.grad(t), jax.grad(circle)),
        (jax.grad(jax.grad(t)), jax.grad(jax.grad(circle))),
    ):
        assert abs(jax.jit(f)(-0.5) - g(-0.5)) < 1e-10


def test_a_curve_does_not_meet_its_own_point_but_the_far_side():
    curve, n = as_circle(0.5, 2.0, 0.7), 64
    at = 2.0 * np.pi * (np.arange(n) + 0.3) / n
    inward = at + np.pi + np.linspace(-1.2, 1.2, n)
    place, along = (np.stack([np.cos(a), np.sin(a)], -1) for a in (at, inward))
    t, _ = jax.jit(jax.vmap(lambda o, d: curve.hit(o, d, jnp.array(True))))(
        np.array([0.5, 2.0]) + 0.7 * place, along
    )
    np.testing.assert_allclose(t, 1.4 * np.cos(np.linspace(-1.2, 1.2, n)), rtol=1e-12)


def test_tangents_of_a_circle_as_a_series_carry_two_derivatives():
    def side(p):
        points, valid = as_circle(0.0, 0.0, 0.5).silhouettes(jnp.array([p, 2.0]), OFF)
        return jnp.sum(jnp.where(valid, points[:, 0] ** 2 + points[:, 1], 0.0))

    def circle(p):
        q = jnp.array([p, 2.0])
        D = q @ q
        foot, off = q * 0.25 / D, jnp.array([-2.0, p]) * 0.5 * jnp.sqrt(D - 0.25) / D
        return sum((foot + k * off)[0] ** 2 + (foot + k * off)[1] for k in (-1.0, 1.0))

    for f, g in (
        (side, circle),
        (jax.grad(side), jax.grad(circle)),
        (jax.grad(jax.grad(side)), jax.grad(jax.grad(circle))),
    ):
        assert abs(jax.jit(f)(0.3) - g(0.3)) < 1e-9


def test_a_dent_has_four_tangents():
    shape = jax.tree.map(lambda a: a[0], bean())
    # Below the dent of the bean two more lines touch it.
    count = jnp.sum(shape.silhouettes(jnp.array([0.35, -3.0]), OFF)[1])
    assert count == 2
    above = [int(jnp.sum(shape.silhouettes(jnp.array([x, 0.9]), OFF)[1])) for x in (0.0, 3.0)]
    assert set(above) <= {2, 4}


@pytest.mark.parametrize("width", [1e-2, 1e-4, 1e-6])
def test_a_short_chord_beside_a_tangent_is_found(width):
    # The chord is far shorter than a piece; its two ends are on one piece of the curve.
    curve = as_circle(0.0, 0.0, 1.0)
    y = np.cos(0.5 * width)
    t, _ = curve.hit(jnp.array([-3.0, y]), jnp.array([1.0, 0.0]), OFF)
    assert abs(t - (3.0 - np.sin(0.5 * width))) < 1e-9 / width


def test_more_tangents_than_are_kept_are_no_answer():
    a = 2.0 * np.pi * np.arange(256) / 256
    r = 1.0 + 0.3 * np.cos(12.0 * a)
    flower = closed_curve(np.stack([r * np.cos(a), 3.0 + r * np.sin(a)], -1), 16, samples=256)
    assert jnp.isnan(
        irradiance(Scene.of(primitive(flower, emission=1.0)), Receiver((0.0, 0.0), 0.0))
    )
