"""Shapes that touch the receiver almost, that have no area, or that run into each other."""

import jax
import numpy as np
import pytest

from firstorder.numerics import _roots
from firstorder.space import Scene, irradiance, primitive, receiver, rectangle, sphere

AT = receiver((0.0, 0.0, 0.0))


# --- almost on a ball ----------------------------------------------------------------------------


def behind_two_balls(lamp, gap):
    """Irradiance from a lamp, a ball overhead and a ball beside the receiver, middle at horizon."""
    scene = [primitive(lamp, emission=1.0), primitive(sphere((-0.1, 0.2, 0.8), 0.3))]
    if gap is not None:
        scene.append(primitive(sphere((0.0625 + gap, 0.0, 0.0), 0.0625)))
    return irradiance(Scene.of(*scene), AT)


def assert_a_near_ball_hides_half_of_the_sky():
    """Its outline is almost the plane x = 0: all that is left of the lamp lies at x < 0."""
    lamp = rectangle((0.0, 0.0, 2.0), (0.0, 0.5, 0.0), (0.5, 0.0, 0.0))
    half = rectangle((-0.25, 0.0, 2.0), (0.0, 0.5, 0.0), (0.25, 0.0, 0.0))
    found = jax.jit(lambda gap: behind_two_balls(lamp, gap))
    left = jax.jit(lambda: behind_two_balls(half, None))()
    for gap in 10.0 ** -np.arange(6.0, 16.0):
        # The outline lies as far from the plane as the angle to the horizon of the ball.
        assert 0.0 <= found(gap) - left < np.sqrt(2.0 * gap / 0.0625)


def test_a_ball_as_near_as_rounding_hides_half_of_the_sky():
    assert_a_near_ball_hides_half_of_the_sky()


def test_fault_two_steps_to_an_extremum_lose_crossings(monkeypatch):
    monkeypatch.setattr(_roots, "STEPS", 2)
    with pytest.raises(AssertionError):
        assert_a_near_ball_hides_half_of_the_sky()
