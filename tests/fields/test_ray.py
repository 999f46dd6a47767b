"""Rays as lists, tuples and arrays; what is none is one sentence."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from firstorder.conventions import FLATLAND, SPACE
from firstorder.fields import Function
from firstorder.fields._ray import of_ray, stack

CALLS = []


class Asked:
    """A field that says what it was called with."""

    frame = FLATLAND

    @of_ray
    def at(self, u, *more, scale=1.0):
        """Of a ray."""
        CALLS.append((type(u), u.shape, u.dtype))
        return scale * (u[0] - 10.0 * u[1]) + sum(more)


FIELD = Function(lambda x, theta: x - 10.0 * theta, FLATLAND)


@pytest.mark.parametrize(
    "u", [[3, 0.25], (3.0, 0.25), np.array([3.0, 0.25]), jnp.array([3.0, 0.25])]
)
def test_a_ray_is_any_row_of_numbers(u):
    assert FIELD.at(u) == 0.5
    np.testing.assert_array_equal(FIELD.jet(u).gradient, [1.0, -10.0])


def test_a_traced_ray_goes_on_as_it_is():
    assert jax.jit(FIELD.at)(jnp.array([3.0, 0.25])) == 0.5
    slope = jax.jacfwd(FIELD.at)(jnp.array([3.0, 0.25]))
    np.testing.assert_array_equal(slope, [1.0, -10.0])
    assert Asked.at.__doc__ == "Of a ray."


def test_other_arguments_go_along():
    CALLS.clear()
    found = jax.jit(lambda u: Asked().at(u, 100.0, 7.0, scale=2.0))(jnp.array([3.0, 0.25]))
    assert found == 108.0
    assert [shape for _, shape, _ in CALLS] == [(2,)]


@pytest.mark.parametrize("u", [[1.0], [1.0, 2.0, 3.0], 1.0, [[1.0, 2.0]], np.ones((2, 2))])
def test_a_ray_has_an_entry_for_each_coordinate(u):
    words = "^Argument `u` of Function must be one ray, the 2 coordinates x, theta, but has shape"
    with pytest.raises(ValueError, match=words):
        FIELD.at(u)
    with pytest.raises(ValueError, match=words):
        jax.jit(FIELD.at)(jnp.asarray(u))


@pytest.mark.parametrize("u", ["north", [1.0, "north"], [[1.0], [1.0, 2.0]], None])
def test_what_holds_no_numbers_is_no_ray(u):
    with pytest.raises(
        TypeError, match=r"^Argument `u` of Function must be one ray, the numbers x, th"
    ):
        FIELD.at(u)


# --- coordinates apart ---------------------------------------------------------------------------


def test_coordinates_broadcast_and_stand_last():
    x, theta = np.array([[1.0], [2.0]]), np.array([5.0, 6.0, 7.0])
    rays = stack(FLATLAND, (x, theta))
    assert rays.shape == (2, 3, 2)
    np.testing.assert_array_equal(rays[..., 0], np.broadcast_to(x, (2, 3)))
    np.testing.assert_array_equal(rays[..., 1], np.broadcast_to(theta, (2, 3)))
    np.testing.assert_array_equal(stack(SPACE, (1, 2, 3, 4)), [1.0, 2.0, 3.0, 4.0])


def test_coordinates_are_as_many_as_the_frame_has():
    with pytest.raises(
        ValueError, match=r"^Arguments must be the 2 coordinates x, theta, but are 1"
    ):
        stack(FLATLAND, (1.0,))
    with pytest.raises(ValueError, match=r"^Arguments of a bell must be the 2 .* but are 3"):
        stack(FLATLAND, (1.0, 2.0, 3.0), "a bell")
    with pytest.raises(
        TypeError, match=r"^Arguments of a bell must be numbers or arrays, the coord"
    ):
        stack(FLATLAND, (1.0, "north"), "a bell")
    with pytest.raises(TypeError, match=r"^Arguments must be numbers or arrays"):
        stack(FLATLAND, (1.0, [[1.0], [1.0, 2.0]]))
