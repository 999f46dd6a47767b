"""Shapes that touch the receiver almost, or that have no area."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from firstorder.numerics import _roots
from firstorder.space import Scene, irradiance, primitive, receiver, rectangle, sphere, triangle

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


# --- without area --------------------------------------------------------------------------------

CORNERS = {
    "a point": [(0.0, 0.0, 1.0)] * 3,
    "two corners in one": [(0.0, 0.0, 1.0), (0.0, 0.0, 1.0), (0.3, 0.3, 1.0)],
    "a line": [(0.25, 0.5, 1.0), (0.5, 0.25, 1.0), (0.75, 0.0, 1.0)],
    "a line through the receiver": [(0.0, 0.0, 1.0), (0.0, 0.0, 1.5), (0.0, 0.0, 3.0)],
}


def with_flat(shape):
    """Irradiance from a lamp behind a ball, and perhaps something more that shines."""
    lamp = rectangle((0.0, 0.0, 2.0), (0.0, 0.5, 0.0), (0.5, 0.0, 0.0))
    scene = [primitive(lamp, emission=1.0), primitive(sphere((0.1, 0.2, 1.0), 0.2))]
    more = [] if shape is None else [primitive(shape, emission=(0.5, 0.5))]
    return irradiance(Scene.of(*scene, *more), AT)


@pytest.mark.parametrize("where", CORNERS)
def test_a_traced_triangle_without_area_is_not_there(where):
    asked = jax.jit(jax.value_and_grad(lambda c: with_flat(triangle(*c))))
    value, slope = asked(np.array(CORNERS[where]))
    np.testing.assert_allclose(value, with_flat(None), rtol=1e-14)
    assert np.all(np.isfinite(slope))


def test_a_traced_rectangle_without_area_is_not_there():
    found = jax.jit(lambda u: with_flat(rectangle((0.2, 0.1, 1.5), u, 2.0 * u)))
    np.testing.assert_allclose(found(np.array([0.1, 0.2, 0.0])), with_flat(None), rtol=1e-14)


def test_rays_do_not_meet_what_has_no_area():
    along = jnp.array([0.5, 0.0, 1.0])

    def distance(c):
        return Scene.of(primitive(triangle(*c))).distance(0, jnp.zeros(3), along)

    assert jax.jit(distance)(jnp.stack([along, 2.0 * along, 3.0 * along])) == np.inf


@pytest.mark.parametrize("where", CORNERS)
def test_a_concrete_triangle_without_area_is_refused(where):
    with pytest.raises(ValueError, match="must not be parallel"):
        triangle(*CORNERS[where])
