"""Edge angles in vertical slices against bisected rays, in every octant, and deliberate faults."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from firstorder.checks.tolerance import fitted_order
from firstorder.visibility import (
    contour_elevation,
    contour_elevation_hessian,
    crease_elevation,
    crease_elevation_hessian,
    elevation,
)

# Compiled once; the faults below trace anew.
LIMB, RIM, BEND, RIM_BEND = (
    jax.jit(f)
    for f in (
        contour_elevation,
        crease_elevation,
        contour_elevation_hessian,
        crease_elevation_hessian,
    )
)
BOUND = 1e-9  # central differences with steps of 1e-5 of angles of 1e-16, third derivatives of 10


def ball_edge(center, radius, phi, side, place=(0.0, 0.0, 0.0), frame=None):
    """The edge angle of a ball by bisection of "does this ray come nearer than the radius"."""
    frame = np.eye(3) if frame is None else frame
    gap = (np.asarray(center) - place) @ frame

    def met(theta):
        w = np.array([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)])
        return np.linalg.norm(np.cross(gap, w)) < radius

    middle = np.arctan2(gap[0] * np.cos(phi) + gap[1] * np.sin(phi), gap[2])
    inside, outside = middle, middle - side * 0.5 * np.pi
    assert met(inside)
    for _ in range(60):
        half = 0.5 * (inside + outside)
        inside, outside = (half, outside) if met(half) else (inside, half)
    return inside


BALLS = [  # centre, radius, azimuth less that of the centre, side
    ((1.0, 0.4, 1.5), 0.6, 0.2, 1.0),
    ((1.0, -0.4, 1.5), 0.6, -0.3, -1.0),
    ((-1.0, 0.7, 0.5), 0.4, 0.1, 1.0),
    ((-0.2, -0.1, 1.2), 0.5, 1.0, -1.0),  # over the pole: its lower end is negative
    ((-0.2, -0.1, 1.2), 0.5, 1.0, 1.0),
]


def touched(case, alpha):
    """Azimuth, touched point and normal of a ball's limb."""
    center, radius, turn, _ = case
    phi = np.arctan2(center[1], center[0]) + turn
    w = np.array([np.sin(alpha) * np.cos(phi), np.sin(alpha) * np.sin(phi), np.cos(alpha)])
    p = w * (w @ center)
    return jnp.asarray(phi), jnp.asarray(p), jnp.asarray((p - np.array(center)) / radius)


def differences(case, order=1, step=1e-5):
    center, radius, turn, side = case
    phi = np.arctan2(center[1], center[0]) + turn

    def at(x, y):
        return ball_edge(center, radius, phi, side, (x, y, 0.0))

    h = step
    if order == 1:
        return np.array([at(h, 0) - at(-h, 0), at(0, h) - at(0, -h)]) / (2 * h)
    mixed = (at(h, h) - at(h, -h) - at(-h, h) + at(-h, -h)) / 4
    xx, yy = at(h, 0) - 2 * at(0, 0) + at(-h, 0), at(0, h) - 2 * at(0, 0) + at(0, -h)
    return np.array([[xx, mixed], [mixed, yy]]) / h**2


def edge_of(case):
    center, radius, turn, side = case
    return ball_edge(center, radius, np.arctan2(center[1], center[0]) + turn, side)


ALPHA = [edge_of(case) for case in BALLS]


def limb_errors():
    """Errors of values and rates of all balls; traced anew on each call, for the faults."""
    rows = [touched(case, alpha) for case, alpha in zip(BALLS, ALPHA, strict=True)]
    phi, p, n = (jnp.stack(a) for a in zip(*rows, strict=True))
    found = jax.jit(lambda p, n, phi: contour_elevation(p, n, phi))(p, n, phi)
    rates = np.stack([differences(case) for case in BALLS])
    return np.abs(found.value - np.array(ALPHA)), np.abs(found.gradient - rates)


def test_the_rates_of_a_limb_are_those_of_bisected_rays():
    values, rates = limb_errors()
    assert np.max(values) < 1e-14
    assert np.max(rates) < BOUND


def test_the_second_derivatives_of_a_limb():
    rows = [touched(case, alpha) for case, alpha in zip(BALLS, ALPHA, strict=True)]
    phi, p, n = (jnp.stack(a) for a in zip(*rows, strict=True))
    radii = jnp.array([case[1] for case in BALLS])[:, None, None]
    H = (jnp.eye(3) - n[:, :, None] * n[:, None, :]) / radii
    # Angles are right to 1e-16, second differences with steps of 3e-4 to 1e-8, their cubic error
    # to 1e-7 times fourth derivatives.
    truth = np.stack([differences(case, 2, 3e-4) for case in BALLS])
    np.testing.assert_allclose(BEND(p, n, H, phi), truth, atol=3e-5, rtol=1e-5)


def test_a_limb_and_a_tangent_in_its_plane_agree():
    case = BALLS[0]
    phi, p, n = touched(case, ball_edge(case[0], case[1], np.arctan2(0.4, 1.0) + 0.2, 1.0))
    for slide in (0.0, 0.7, -3.0):  # k need not be across the ray
        k = jnp.cross(n, p) + slide * p
        np.testing.assert_allclose(RIM(p, k, phi).gradient, LIMB(p, n, phi).gradient, rtol=1e-12)


POINT, TANGENT = (0.8, -0.5, 0.9), (0.3, 0.8, -0.2)


PHI = float(np.arctan2(-0.5, 0.8))


def line_angle(move, point=POINT, tangent=TANGENT, phi=PHI):
    """Where a line meets a slice: its point with v . p = 0, in plain geometry."""
    q = jnp.asarray(point) - jnp.append(move, 0.0)
    v = jnp.array([-jnp.sin(phi), jnp.cos(phi), 0.0])
    k = jnp.asarray(tangent)
    p = q - k * (v @ q) / (v @ k)
    return jnp.arctan2(p[0] * jnp.cos(phi) + p[1] * jnp.sin(phi), p[2])


def test_the_derivatives_of_a_straight_edge():
    still = jnp.zeros(2)
    unit = np.array(TANGENT) / np.linalg.norm(TANGENT)
    np.testing.assert_allclose(
        RIM(POINT, TANGENT).gradient, jax.grad(line_angle)(still), rtol=1e-13
    )
    np.testing.assert_allclose(
        RIM_BEND(POINT, jnp.asarray(unit)), jax.hessian(line_angle)(still), rtol=1e-12
    )


@pytest.mark.parametrize("tilt", [(-0.5, 0.2), (0.3, 0.9)])
def test_on_a_curved_receiver_the_frame_turns(tilt):
    """Against a ball seen from a frame that is turned by a small, finite, step."""
    case = BALLS[1]
    S = np.array([[tilt[0], 0.3], [0.3, tilt[1]]])
    center, radius, turn, side = case
    phi = float(np.arctan2(center[1], center[0]) + turn)
    h, rates = 1e-5, []
    for m in np.eye(2):
        ends = []
        for s in (h, -h):
            n = np.append(-S @ m * s, 1.0)
            n /= np.linalg.norm(n)
            axis = np.cross([0, 0, 1.0], n)  # the least turn that takes z to n
            cross = np.array(
                [[0, -axis[2], axis[1]], [axis[2], 0, -axis[0]], [-axis[1], axis[0], 0]]
            )
            frame = np.eye(3) + cross + cross @ cross / (1.0 + n[2])
            ends.append(ball_edge(center, radius, phi, side, (*(m * s), 0.0), frame))
        rates.append((ends[0] - ends[1]) / (2 * h))
    _, p, n = touched(case, ball_edge(center, radius, phi, side))
    np.testing.assert_allclose(LIMB(p, n, phi, S).gradient, rates, rtol=0.0, atol=BOUND)
    k = jnp.cross(n, p)
    np.testing.assert_allclose(RIM(p, k, phi, S).gradient, rates, rtol=0.0, atol=BOUND)


def test_scale_and_turn():
    """Angles do not know lengths; rates go with their inverse, and turn with the frame."""
    one = LIMB((1.0, 0.3, 1.0), (0.5, 0.1, -0.53))
    c, s = np.cos(0.7), np.sin(0.7)
    turn = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    two = LIMB(
        jnp.asarray(3.0 * turn @ [1.0, 0.3, 1.0]), jnp.asarray(-2.0 * turn @ [0.5, 0.1, -0.53])
    )
    np.testing.assert_allclose(two.value, one.value, rtol=1e-14)
    np.testing.assert_allclose(3.0 * two.gradient, turn[:2, :2] @ one.gradient, rtol=1e-13)


def test_a_slice_that_grazes_a_ball_is_singular_with_exponent_one_half():
    center, radius = np.array([1.0, 0.0, 1.5]), 0.6
    gaps, rates = np.array([1e-3, 1e-4, 1e-5, 1e-6]), []
    for gap in gaps:
        phi = np.arcsin(radius) - gap
        u, v = np.cos(phi), -np.sin(phi)
        cut = np.sqrt(radius**2 - v**2)
        q, far = np.array([u, 1.5]), np.hypot(u, 1.5)  # the slice's circle: centre and radius
        alpha = np.arctan2(q[0], q[1]) + np.arcsin(cut / far)
        D = np.sqrt(far**2 - cut**2)
        w = np.array([np.sin(alpha) * np.cos(phi), np.sin(alpha) * np.sin(phi), np.cos(alpha)])
        rates.append(float(LIMB(jnp.asarray(D * w), jnp.asarray(D * w - center), phi).alpha_v))
    assert abs(fitted_order(gaps, np.abs(rates)) + 0.5) < 0.01


def test_where_there_is_no_rate_there_is_no_number():
    assert np.isnan(LIMB((1.0, 0.0, 1.0), (0.0, 1.0, 0.0)).alpha_v)  # a grazing slice
    assert np.isnan(RIM((1.0, 0.0, 1.0), (1.0, 0.0, 1.0)).alpha_v)  # an edge end-on
    assert np.isnan(LIMB((0.0, 0.0, 0.0), (1.0, 0.0, 0.0)).value)
    over = RIM((0.0, 0.0, 2.0), (0.0, 1.0, 0.0))  # the pole has every azimuth
    np.testing.assert_allclose([over.value, over.alpha_u, over.alpha_v], [0.0, -0.5, 0.0])


def test_derivatives_are_finite_wherever_values_are():
    def total(s):
        found = RIM(jnp.stack([s, 0.0 * s, 2.0 + s]), (0.0, 1.0, 0.0))
        return found.value + found.alpha_u

    assert np.isfinite(jax.grad(total)(0.0))


def test_a_bad_number_is_refused():
    with pytest.raises(ValueError, match="Argument `point` must be finite, but is nan"):
        contour_elevation(jnp.array([jnp.nan, 0.0, 1.0]), (1.0, 0.0, 0.0))


# --- deliberate faults ---------------------------------------------------------------------------


def _forget_the_sign(m, p, S):
    return -m


def _flip_v(point, phi, right=elevation._slice):
    found = right(point, phi)
    u, v, w, c = found.axes
    return elevation._Slice(found.p, found.value, found.phi, (u, -v, w, c), found.D, found.there)


def _forget_the_distance(point, phi, right=elevation._slice):
    found = right(point, phi)
    return elevation._Slice(
        found.p, found.value, found.phi, found.axes, jnp.ones_like(found.D), found.there
    )


@pytest.mark.parametrize(
    ("name", "wrong"),
    [("_moved", _forget_the_sign), ("_slice", _flip_v), ("_slice", _forget_the_distance)],
)
def test_a_fault_is_noticed(monkeypatch, name, wrong):
    assert np.max(limb_errors()[1]) < BOUND
    monkeypatch.setattr(elevation, name, wrong)
    found = np.max(limb_errors()[1])
    assert np.isfinite(found)
    assert found > 100.0 * BOUND


@pytest.mark.parametrize("ask", [contour_elevation, crease_elevation, crease_elevation_hessian])
def test_a_point_of_the_plane_is_none_of_space(ask):
    with pytest.raises(ValueError, match="three coordinates"):
        ask((1.0, 1.0), (0.0, 1.0, 0.0))
