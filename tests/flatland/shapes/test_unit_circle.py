"""A line and the unit circle: roots by `numpy.roots`, tangents by what they are."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from firstorder.flatland.shapes._unit_circle import (
    on_circle,
    turns,
    unit_circle_roots,
    unit_circle_tangents,
)

RNG = np.random.default_rng(3)
FREE = jnp.array(False)
both = jax.jit(unit_circle_roots)
touched = jax.jit(unit_circle_tangents)


def asked(w, d, on=False):
    """For each root its place, whether it is a hit, and whether it nearly is."""
    found = both(jnp.asarray(w, float), jnp.asarray(d, float), jnp.array(on))
    return [tuple(np.asarray(a).item() for a in one) for one in found]


@pytest.mark.parametrize("off", [-1e-12, 1e-12])
@pytest.mark.parametrize("lean", [0.4, 1e-4, 1e-8])
def test_a_ray_along_the_circle_from_a_point_on_it_to_rounding_meets_it_again(off, lean):
    """After the chord `2 sin(lean)`; by steps of its start it changes as that of any start does."""
    up, along = np.array([0.6, 0.8]), np.array([-0.8, 0.6])
    w, d = (1.0 + off) * up, np.cos(lean) * along - np.sin(lean) * up
    _, (t, there, nearly) = asked(w, d, True)
    assert there
    assert nearly
    assert t == pytest.approx(2.0 * np.sin(lean), rel=1e-4 if lean < 1e-6 else 1e-7)
    on = jnp.array(True)
    change = jax.grad(lambda w: unit_circle_roots(w, jnp.asarray(d), on)[1][0])(jnp.asarray(w))
    b = w @ d
    np.testing.assert_allclose(change, -d + (b * d - w) / abs(b), rtol=1e-6)


LINES = [(3.0 * RNG.normal(size=2), RNG.normal(size=2)) for _ in range(60)]
LINES += [(0.5 * RNG.uniform(-1, 1, 2), RNG.normal(size=2)) for _ in range(10)]


def test_roots_of_lines_from_outside_and_inside():
    hit = 0
    for w, d in LINES:
        true = np.roots([d @ d, 2.0 * w @ d, w @ w - 1.0])
        true = sorted(t.real for t in true) if abs(true[0].imag) < 1e-12 else []
        found = asked(w, d)
        for k, (t, there, nearly) in enumerate(found):
            assert np.isfinite(t)
            assert there == nearly == (bool(true) and true[k] > 0.0)
            if there:
                hit += 1
                assert t == pytest.approx(true[k], rel=1e-9)
    assert hit > 20


@pytest.mark.parametrize("angle", [0.3, 2.5, -1.7])
def test_a_point_on_the_circle_meets_its_other_side_alone(angle):
    w = np.array([np.cos(angle), np.sin(angle)])
    turned = np.array([-w[1], w[0]])
    for d, t in (
        (-w, 2.0),
        (-w - turned, 1.0),
        (-3.0 * w, 2.0 / 3.0),
        (w, None),
        (w + turned, None),
    ):
        near, far = asked((1.0 + 1e-13) * w, d, True)
        assert not near[1]
        assert not near[2]
        assert far[1] == far[2] == (t is not None)
        if t is not None:
            assert far[0] == pytest.approx(t, rel=1e-9)
    # Inside within rounding it is told that it lies on it: nothing is ahead but the other side.
    assert not asked((1.0 - 1e-13) * w, w, True)[1][1]


def test_roots_keep_their_digits_where_others_cancel():
    """Just before the circle, just inside of it, and from far away."""
    gap = 2.0**-40
    assert asked((0.0, -1.0 - gap), (0.0, 1.0))[0][0] == pytest.approx(gap, rel=1e-3)
    assert asked((0.0, 1.0 - gap), (0.0, 1.0))[1][0] == pytest.approx(gap, rel=1e-3)
    assert asked((0.0, -1e6), (0.0, 1.0))[0][0] == pytest.approx(1e6 - 1.0, rel=1e-14)


def test_a_ray_that_grazes_nearly_hits_and_one_that_does_not_does_not():
    """Sixteen roundings of the square are as good as a touch: the place is that of the touch."""
    for off, there, nearly in (
        (1.0 - 1e-9, True, True),
        (1.0, False, True),
        (1.0 + 1e-9, False, False),
    ):
        near, far = asked((off, -3.0), (0.0, 2.0))
        assert near[1:] == far[1:] == (there, nearly)
        assert near[0] == pytest.approx(1.5, abs=1e-4)
        assert far[0] == pytest.approx(1.5, abs=1e-4)
    one = 2.0**-52
    assert asked((1.0 + 2.0 * one, -3.0), (0.0, 1.0))[0][2]
    assert not asked((1.0 + 40.0 * one, -3.0), (0.0, 1.0))[0][2]


def test_misses_have_finite_derivatives():
    for w, d in (((3.0, -3.0), (0.0, 1.0)), ((0.0, 3.0), (0.0, 1.0)), ((1.0, -3.0), (0.0, 1.0))):
        slope = jax.jit(
            jax.jacobian(lambda w, d: [one[0] for one in unit_circle_roots(w, d, FREE)])
        )
        assert np.all(np.isfinite(slope(jnp.array(w), jnp.array(d))))


# --- tangents ------------------------------------------------------------------------------------


@pytest.mark.parametrize("w", [(3.0, 0.4), (-1.2, 0.5), (0.2, -1.1), (40.0, -9.0)])
def test_tangents_touch_the_circle_left_and_right(w):
    points, there = (np.asarray(a) for a in touched(jnp.array(w), FREE))
    assert there.tolist() == [True, True]
    np.testing.assert_allclose(np.linalg.norm(points, axis=1), 1.0, rtol=1e-12)
    np.testing.assert_allclose(
        np.sum(points * (points - np.array(w)), 1), 0.0, rtol=0.0, atol=1e-12
    )
    cross = w[0] * points[:, 1] - w[1] * points[:, 0]
    assert cross[0] < 0.0 < cross[1]  # the second lies to the left of the way out


def test_inside_there_are_none_and_on_the_circle_they_lie_to_both_sides():
    points, there = touched(jnp.array([0.3, -0.4]), FREE)
    assert there.tolist() == [False, False]
    assert np.all(np.isfinite(points))
    for step, here in ((0.0, True), (-1e-16, True), (-1e-9, False), (1e-9, True)):
        points, there = touched(jnp.array([0.0, 1.0 + step]), FREE)
        assert there.tolist() == [here, here]
        if here:
            np.testing.assert_allclose(points, [(0.0, 1.0), (0.0, 1.0)], rtol=0.0, atol=1e-4)
            assert points[0, 0] > 0.0 > points[1, 0]


def test_a_point_that_is_told_to_lie_on_it_has_points_of_its_tangent():
    w = np.array([0.6, 0.8])
    points, there = touched(jnp.asarray(w), jnp.array(True))
    assert there.tolist() == [True, True]
    np.testing.assert_allclose(points, [(1.4, 0.2), (-0.2, 1.4)], rtol=1e-12)


def test_turns_are_clockwise_from_the_top():
    quarter = [(0.0, 1.0), (1.0, 0.0), (0.0, -1.0), (-1.0, 0.0)]
    for k, h in enumerate(quarter):
        assert turns(jnp.array(h), jnp.array(True)) == pytest.approx(0.25 * k)
        assert turns(jnp.array(h), FREE) == 0.0
        np.testing.assert_array_equal(on_circle(jnp.array(h), jnp.array(True)), h)
        np.testing.assert_array_equal(on_circle(jnp.array(h), FREE), (0.0, 1.0))
    place = turns(jnp.array([-1e-3, 1.0]), jnp.array(True))
    assert place == pytest.approx(1.0 - np.arctan(1e-3) / (2.0 * np.pi), rel=1e-12)
