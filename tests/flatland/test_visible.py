import jax
import jax.numpy as jnp
import numpy as np
import pytest

from firstorder.conventions import direction
from firstorder.flatland import (
    Arcs,
    Circles,
    ConstantSky,
    Ellipses,
    Receiver,
    Scene,
    Segments,
    irradiance,
    primitive,
    receiver,
    view,
)
from firstorder.flatland._reference import reference_nearest
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
        assert np.array_equal(reference_nearest(scene, origins, along, 0)[1], seen.seen[wide])


def test_the_view_turns_with_its_receiver():
    scene = Scene.of(primitive(Circles((0.0, 2.0), 0.5)))
    straight = view(scene, Receiver((0.0, 0.0), 0.0))
    tilted = view(scene, Receiver((0.0, 0.0), 0.3))
    assert jnp.allclose(tilted.angles[1:3], straight.angles[1:3] - 0.3, rtol=0.0, atol=1e-12)


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
    scene = Scene.of(primitive(shape))

    def total(x):
        v = view(scene, Receiver(jnp.stack([x, 0.0]), 0.0))
        return jnp.sum(jnp.sin(v.angles) * jnp.arange(v.angles.size))

    v = view(scene, Receiver((0.0, 0.0), 0.0))
    width = np.diff(np.asarray(v.angles))
    assert sorted(set(np.asarray(v.seen)[width > 1e-9]) - {-1}) == seen
    assert jnp.isfinite(jax.grad(total)(0.0))
    assert jnp.isfinite(jax.grad(jax.grad(total))(0.0))


def test_a_receiver_on_a_circle_sees_what_is_above_its_own_tangent():
    scene = Scene.of(primitive(Circles((0.0, 0.0), 1.0)), primitive(Circles((0.0, 3.0), 0.5)))
    v = view(scene, receiver(scene, 0, 0.0))
    width = np.diff(np.asarray(v.angles))
    assert set(np.asarray(v.seen)[width > 1e-9]) == {-1, 1}


ROUND = pytest.mark.parametrize(
    "shape",
    [
        Circles((0.37, -0.21), 0.83),
        Ellipses((0.37, -0.21), (0.83, 0.83), 0.3),
        Arcs((0.37, -0.21), 0.83, 1.3, -2.0 * np.pi),
    ],
    ids=["circle", "ellipse", "arc"],
)


@ROUND
@pytest.mark.parametrize("tilt", [0.3, -0.6, 1.0])
def test_a_tilted_receiver_on_a_round_shape_sees_what_is_above_its_tangent(shape, tilt):
    scene = Scene.of(primitive(shape), environment=ConstantSky(1.0))
    at = Receiver.on_shape(scene, 0, 0.4).tilted(tilt)
    np.testing.assert_allclose(irradiance(scene, at), 1.0 + np.cos(tilt), rtol=1e-12)
    second = jax.hessian(lambda a: irradiance(scene, at.tilted(a)))(0.0)
    np.testing.assert_allclose(second, -np.cos(tilt), rtol=1e-10)


@ROUND
def test_a_receiver_within_rounding_of_a_round_shape_is_inside_or_outside(shape):
    rng = np.random.default_rng(0)
    n, tilt = rng.uniform(-np.pi, np.pi, 200), rng.uniform(-1.4, 1.4, 200)
    off = 0.83 * (1.0 + rng.integers(-2, 3, 200) * np.finfo(float).eps)
    p = np.array([0.37, -0.21]) + off[:, None] * np.asarray(direction(n))
    scene = Scene.of(primitive(shape), environment=ConstantSky(1.0))
    E = jax.vmap(lambda p, n: irradiance(scene, Receiver(p, n)))(p, n + tilt)
    inside, outside = np.abs(E), np.abs(E - 1.0 - np.cos(tilt))
    assert np.max(np.minimum(inside, outside)) < 1e-6


def test_two_edges_in_line_give_the_derivative_of_one_side():
    lamp = primitive(Segments((0.5, 1.0), (-0.5, 1.0)), emission=1.0)
    blade = primitive(Segments((-0.2, 0.5), (0.25, 0.5)))
    scene = Scene.of(lamp, blade)

    @jax.jit
    def slope(x):
        return jax.grad(lambda x: irradiance(scene, Receiver(jnp.stack([x, 0.0]), 0.0)))(x)

    # Blade's and lamp's left ends, their right ends, and one of each are in line.
    for x in (0.1, 0.0, -0.9):
        sides = slope(x - 1e-9), slope(x + 1e-9)
        assert abs(sides[0] - sides[1]) > 0.1
        assert min(abs(slope(x) - side) for side in sides) < 1e-6


@pytest.mark.parametrize("angle", [0.0, 0.7, -2.5, 3.0])
def test_a_receiver_takes_its_normal_as_a_vector_or_as_an_angle(angle):
    by_angle = Receiver.at((0.5, 0.2), angle, on=3)
    by_vector = Receiver.at((0.5, 0.2), 2.5 * direction(jnp.asarray(angle)), on=3)
    for a, b in zip(jax.tree.leaves(by_angle), jax.tree.leaves(by_vector), strict=True):
        np.testing.assert_allclose(a, b, rtol=0.0, atol=1e-15)
    assert int(by_angle.on) == 3
    # One turn of the vector is one of the angle, in the derivative too.
    turn = jax.grad(lambda a: Receiver.at((0.5, 0.2), 2.5 * direction(a)).n)(jnp.asarray(angle))
    np.testing.assert_allclose(turn, 1.0, rtol=0.0, atol=1e-14)


def test_many_receivers_have_one_normal_or_one_each():
    points = jnp.array([[0.0, 0.0], [1.0, 0.0]])
    one, each = Receiver.at(points, (0.0, 2.0)), Receiver.at(points, [(0.0, 1.0), (-1.0, 0.0)])
    assert one.n.tolist() == [0.0, 0.0]
    assert one.on.tolist() == [-1, -1]
    np.testing.assert_allclose(each.n, [0.0, 0.5 * np.pi])
    np.testing.assert_array_equal(jax.vmap(Receiver.at)(points, each.n).n, each.n)


def test_a_receiver_that_is_none_is_refused():
    for given, words in (
        (((0.0, 0.0), (0.0, 0.0)), "`normal` must have a length, but is the zero vector"),
        (((0.0, 0.0), (0.0, 0.0, 1.0)), r"`normal` must have two coordinates, but has shape \(3,"),
        (((0.0, 0.0, 0.0),), r"`position` must have two coordinates, but has shape \(3,"),
        (((0.0, np.nan),), "`position` must be finite"),
        (((0.0, 0.0), np.inf), "`normal` must be finite"),
    ):
        with pytest.raises(ValueError, match=words):
            Receiver.at(*given)
    assert np.isnan(jax.jit(lambda v: Receiver.at((0.0, 0.0), v).n)(jnp.zeros(2)))


def test_a_receiver_on_a_shape_is_the_one_of_the_old_name():
    scene = Scene.of(primitive(Circles((0.3, 0.1), 0.5)))
    new, old = Receiver.on_shape(scene, 0, 0.2), receiver(scene, 0, 0.2)
    assert [a.tolist() for a in jax.tree.leaves(new)] == [b.tolist() for b in jax.tree.leaves(old)]


def test_a_receiver_steps_along_its_own_axes():
    at, turn = Receiver.at((0.3, 0.1), 0.5, on=2), np.exp(0.5j)  # local axes as complex numbers
    for there, step, angle in (
        (at.displaced(jnp.array([0.4, -0.2, 0.7])), turn * (0.4 - 0.2j), 1.2),
        (at.moved(0.4), turn * 0.4, 0.5),
        (at.tilted(0.7), 0.0, 1.2),
    ):
        np.testing.assert_allclose(
            there.position @ np.array([1.0, 1.0j]), 0.3 + 0.1j + step, rtol=1e-14
        )
        np.testing.assert_allclose(there.n, angle, rtol=1e-14)
        assert int(there.on) == 2
