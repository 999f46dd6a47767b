import jax
import jax.numpy as jnp
import numpy as np
import pytest

from firstorder.flatland import (
    Circles,
    Receiver,
    Scene,
    Segments,
    irradiance,
    receiver,
    thing,
    view,
)
from firstorder.flatland.reference import nearest_slowly
from tests.flatland.worlds import everything


def test_every_gap_shows_one_shape():
    scene = everything()
    at = receiver(scene, 0, 0.45)
    seen = jax.jit(lambda r: view(scene, r))(at)
    ends = np.asarray(seen.angles)
    wide = np.flatnonzero(np.diff(ends) > 1e-3)
    assert wide.size > 8
    for share in (0.02, 0.5, 0.98):
        a = ends[wide] + share * np.diff(ends)[wide]
        along = np.stack([-np.sin(a), np.cos(a)], -1)
        origins = np.broadcast_to(np.asarray(at.position), along.shape)
        assert np.array_equal(nearest_slowly(scene, origins, along, 0)[1], seen.seen[wide])


def test_the_view_turns_with_its_receiver():
    scene = Scene.of(thing(Circles((0.0, 2.0), 0.5)))
    straight = view(scene, Receiver((0.0, 0.0), 0.0))
    tilted = view(scene, Receiver((0.0, 0.0), 0.3))
    assert jnp.allclose(tilted.angles[1:3], straight.angles[1:3] - 0.3, atol=1e-12)


@pytest.mark.parametrize(
    ("shape", "seen"),
    [
        (Segments((-1.0, -0.5), (1.0, -0.5)), []),  # below the horizon
        (Segments((-1.0, 0.0), (-0.5, 0.0)), []),  # in the horizon
        (Segments((1.0, -1.0), (1.0, 1.0)), [0]),  # cut by it
        (Circles((0.0, 0.0), 1.0), [0]),  # around the receiver
        (Segments((0.0, 0.0), (0.0, 1.0)), []),  # edge on, from the receiver itself
    ],
)
def test_degenerate_views_are_finite(shape, seen):
    scene = Scene.of(thing(shape))

    def total(x):
        v = view(scene, Receiver(jnp.stack([x, 0.0]), 0.0))
        return jnp.sum(jnp.sin(v.angles) * jnp.arange(v.angles.size))

    v = view(scene, Receiver((0.0, 0.0), 0.0))
    width = np.diff(np.asarray(v.angles))
    assert sorted(set(np.asarray(v.seen)[width > 1e-9]) - {-1}) == seen
    assert jnp.isfinite(jax.grad(total)(0.0))
    assert jnp.isfinite(jax.grad(jax.grad(total))(0.0))


def test_a_receiver_on_a_circle_sees_what_is_above_its_own_tangent():
    scene = Scene.of(thing(Circles((0.0, 0.0), 1.0)), thing(Circles((0.0, 3.0), 0.5)))
    v = view(scene, receiver(scene, 0, 0.0))
    width = np.diff(np.asarray(v.angles))
    assert set(np.asarray(v.seen)[width > 1e-9]) == {-1, 1}


def test_two_edges_in_line_give_the_derivative_of_one_side():
    lamp = thing(Segments((0.5, 1.0), (-0.5, 1.0)), emission=1.0)
    blade = thing(Segments((-0.2, 0.5), (0.25, 0.5)))
    scene = Scene.of(lamp, blade)

    @jax.jit
    def slope(x):
        return jax.grad(lambda x: irradiance(scene, Receiver(jnp.stack([x, 0.0]), 0.0)))(x)

    # Blade's and lamp's left ends, their right ends, and one of each are in line.
    for x in (0.1, 0.0, -0.9):
        sides = slope(x - 1e-9), slope(x + 1e-9)
        assert abs(sides[0] - sides[1]) > 0.1
        assert min(abs(slope(x) - side) for side in sides) < 1e-6
