"""Contour integrals of one region against closed forms that come from elsewhere."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from firstorder.numerics._quadrature import periodic_trapezoid
from firstorder.visibility import _contour as contour

COS = 0.8  # of a cap's half-angle


def circle(count=16, center=(0.0, 0.0, 1.0), cosine=COS):
    """A circle of directions about an axis, counter-clockwise about it, as the limb of a ball."""
    axis = np.array(center) / np.linalg.norm(center)
    across = np.cross(axis, [0.3, 0.5, -0.4])
    across /= np.linalg.norm(across)
    other = np.cross(axis, across)
    t, w = periodic_trapezoid(2.0 * np.pi, count)
    sine = np.sqrt(1.0 - cosine**2)
    ring = np.cos(t)[:, None] * across + np.sin(t)[:, None] * other
    turned = np.cos(t)[:, None] * other - np.sin(t)[:, None] * across
    distance = np.linalg.norm(center)
    p = distance * cosine * (cosine * axis + sine * ring)
    return jnp.asarray(p), jnp.asarray(distance * cosine * sine * turned), w


def test_a_cap_overhead():
    p, v, w = circle()
    up = jnp.array([0.0, 0.0, 1.0])
    found = jnp.sum(w * contour.solid_angle_rate(p, v, up))
    np.testing.assert_allclose(found, 2.0 * np.pi * (1.0 - COS), rtol=1e-14)


def test_one_axis_for_another():
    """Part of a slanted circle: about the normal by many nodes, about its own axis by one."""
    center = np.array([1.0, -0.5, 1.2])
    p, v, _ = circle(4000, center)
    up, axis = jnp.array([0.0, 0.0, 1.0]), jnp.asarray(center / np.linalg.norm(center))
    w = np.full(2001, 2.0 * np.pi / 4000)
    w[[0, -1]] *= 0.5
    part = slice(300, 2301)
    true = jnp.sum(w * contour.solid_angle_rate(p[part], v[part], up))
    about = contour.solid_angle_rate(p[0], v[0], axis) * np.pi
    ends = (contour.segment_solid_angle(axis, p[k]) for k in (300, 2300))
    found = about - next(ends) + next(ends)
    np.testing.assert_allclose(found, true, rtol=1e-6)  # the trapezoid rule's


@pytest.mark.parametrize("center", [(0.0, 0.0, 1.0), (1.0, -0.5, 1.2)])
def test_light_of_a_ball_is_a_vector_along_its_direction(center):
    p, v, w = circle(center=center)
    found = jnp.sum(w * contour.vector_irradiance_rate(p, v), 0)
    axis = np.array(center) / np.linalg.norm(center)
    np.testing.assert_allclose(found, np.pi * (1.0 - COS**2) * axis, rtol=0.0, atol=1e-14)


def test_a_ball_that_comes_nearer():
    """The solid angle of a ball of radius r grows by 2 pi r^2 / (d^2 sqrt(d^2 - r^2))."""
    center = np.array([1.0, -0.5, 1.2])
    d = np.linalg.norm(center)
    p, v, w = circle(center=center)
    found = jnp.sum(w * contour.translation_rate(p, v), 0)
    square = d * d * (1.0 - COS**2)
    np.testing.assert_allclose(
        found, 2.0 * np.pi * square / (d**2 * d * COS) * center / d, rtol=0.0, atol=1e-14
    )


def test_an_octant():
    corners = jnp.eye(3)
    after = jnp.roll(corners, -1, 0)
    np.testing.assert_allclose(
        jnp.sum(contour.segment_solid_angle(corners, after)), 0.5 * np.pi, rtol=1e-14
    )
    light = jnp.sum(contour.segment_vector_irradiance(corners, after), 0)
    np.testing.assert_allclose(light, np.full(3, 0.25 * np.pi), rtol=1e-14)


def test_what_is_closed_for_a_segment_is_the_integral_of_its_rate():
    a, b = jnp.array([0.3, -0.4, 0.5]), jnp.array([-0.2, 0.7, 1.1])
    t, w = np.polynomial.legendre.leggauss(40)
    p, w, up = a + 0.5 * (1.0 + t)[:, None] * (b - a), 0.5 * w, jnp.array([0.0, 0.0, 1.0])
    for closed, rate in (
        (contour.segment_solid_angle, contour.solid_angle_rate(p, b - a, up)),
        (contour.segment_vector_irradiance, contour.vector_irradiance_rate(p, b - a)),
        (contour.segment_translation_rate, contour.translation_rate(p, b - a)),
    ):
        np.testing.assert_allclose(closed(a, b), w @ rate, rtol=1e-13)


def test_short_segments_and_segments_towards_the_eye_have_derivatives():
    a = jnp.array([0.3, 0.4, 0.5])

    def all_of(s, b):
        end = a + s * b
        return (
            contour.segment_solid_angle(a, end)
            + jnp.sum(contour.segment_vector_irradiance(a, end))
            + jnp.sum(contour.segment_translation_rate(a, end))
        )

    both = jax.jit(lambda s, b: (jax.grad(all_of)(s, b), jax.hessian(all_of)(s, b)))
    for b in (a, jnp.array([1.0, 0.0, 0.0])):
        for s in (0.0, 1e-9, 1e-3):
            assert np.all(np.isfinite(both(s, b)))


@pytest.mark.parametrize("share", [1.0, 1e-6])
def test_half_an_angle_has_the_derivatives_of_its_definition(share):
    """h = atan2(s, k) / (2 s), of s^2 and k, for a wide angle and for a narrow one."""
    s, k = share * 0.7, 0.6
    by_square = (k / (s * s + k * k) - np.arctan2(s, k) / s) / (4.0 * s * s)
    if share < 1.0:
        by_square = -1.0 / (6.0 * k**3)  # the difference above has lost its digits
    found = jax.grad(contour._half_angle_by_sine, (0, 1))(jnp.array(s * s), jnp.array(k))
    np.testing.assert_allclose(found, [by_square, -0.5 / (s * s + k * k)], rtol=1e-9)


def test_short_segments_keep_their_digits():
    a = jnp.array([0.3, 0.4, 0.5])
    for s in (1e-2, 1e-4, 1e-6):
        b = a + s * jnp.array([1.0, -1.0, 0.5])
        c = np.cross(np.asarray(a, np.longdouble), np.asarray(b, np.longdouble))
        size = np.sqrt(np.sum(c**2))
        angle = np.arctan2(size, np.sum(np.asarray(a, np.longdouble) * np.asarray(b)))
        found = contour.segment_vector_irradiance(a, b)
        np.testing.assert_allclose(found, (0.5 * angle * c / size).astype(float), rtol=1e-9)


@pytest.mark.parametrize(("dtype", "rtol"), [("float32", 1e-5), ("float64", 1e-12)])
def test_a_segment_that_runs_close_by_fills_half_a_turn(dtype, rtol):
    """From above its middle: an angle `2 arctan(1 / h)`, which changes by `2 / (1 + h^2)`."""
    for h in (1e-2, 1e-4, 1e-6):
        a, b = (jnp.array([x, 0.0, h], dtype) for x in (1.0, -1.0))
        light = contour.segment_vector_irradiance(a, b)
        np.testing.assert_allclose(light, [0.0, -np.arctan(1.0 / h), 0.0], rtol=rtol)
        rate = contour.segment_translation_rate(a, b)
        np.testing.assert_allclose(rate, [0.0, -2.0 / h / np.hypot(1.0, h), 0.0], rtol=rtol)


def test_half_an_angle_near_two_right_angles_has_the_derivatives_of_its_definition():
    s, k = 1e-6, -0.6
    by_square = (k / (s * s + k * k) - np.arctan2(s, k) / s) / (4.0 * s * s)
    found = jax.grad(contour._half_angle_by_sine, (0, 1))(jnp.array(s * s), jnp.array(k))
    np.testing.assert_allclose(found, [by_square, -0.5 / (s * s + k * k)], rtol=1e-9)


@pytest.mark.parametrize("dtype", ["float32", "float64"])
def test_precision_is_kept(dtype):
    a, b = jnp.eye(3, dtype=dtype)[:2]
    for f in (
        contour.segment_solid_angle,
        contour.segment_vector_irradiance,
        contour.segment_translation_rate,
        lambda a, b: contour.solid_angle_rate(a, b, a),
        contour.vector_irradiance_rate,
        contour.translation_rate,
    ):
        assert f(a, b).dtype == dtype


@eqx.filter_jit
def with_rate(f, a, b):
    return f(a, b), jax.jacobian(f)(a, b)


@pytest.mark.parametrize("unit", [1e-12, 1e-6, 1e6, 1e12])
@pytest.mark.parametrize(
    ("power", "f"),
    [
        (0, contour.segment_solid_angle),
        (0, contour.segment_vector_irradiance),
        (-1, contour.segment_translation_rate),
    ],
)
def test_single_precision_is_enough_in_every_unit_of_length(f, power, unit):
    a, b = (np.array(p, "float32") for p in ([1.0, 0.2, 0.5], [-0.3, 0.8, 0.6]))
    far = np.float32(unit)
    (value, rate), (value_far, rate_far) = with_rate(f, a, b), with_rate(f, far * a, far * b)
    np.testing.assert_allclose(far**-power * value_far, value, rtol=1e-5, atol=1e-6)
    np.testing.assert_allclose(far ** (1 - power) * rate_far, rate, rtol=1e-4, atol=1e-5)
