"""Fronts that look towards a point: shapes turn round, points and light stay where they are."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from firstorder import flatland, space

POINT = {"flatland": (0.1, -0.3), "space": (0.1, 0.2, -0.3)}
FLATLAND = {
    "segments": flatland.Segments([(-0.5, 1.0), (0.5, 1.0)], [(0.5, 1.0), (-0.5, 1.2)]),
    "arcs": flatland.Arcs([(0.0, 1.0), (0.0, 1.0)], 0.5, [0.3, 0.3], [1.0, -1.0]),
}
U, V = (0.5, 0.1, 0.0), (0.0, 0.4, 0.1)
SPACE = {
    "rectangle": space.rectangle((0.0, 0.0, 1.0), U, V),
    "disc": space.disc((0.0, 0.0, 1.0), (0.1, 0.0, 1.0), 0.5),
    "triangle": space.triangle((0.0, 0.0, 1.0), (1.0, 0.0, 1.0), (0.0, 2.0, 1.5)),
    "plane": space.plane((0.0, 0.0, 1.0), (0.1, 0.0, 1.0)),
}


def heights(world, shape, point):
    point = jnp.asarray(point)
    if world == "flatland":
        scene = flatland.Scene.of(flatland.primitive(shape))
        frames = [scene.frame(i, 0.5) for i in range(scene.count)]
        return np.array([f.normal @ (point - f.position) for f in frames])
    one = jax.tree.map(lambda a: a[0], shape)
    return np.array([one.normal(one.middle(point)) @ (point - one.center)])


CASES = [("flatland", s) for s in FLATLAND.values()] + [("space", s) for s in SPACE.values()]
NAMES = [*FLATLAND, *SPACE]


@pytest.mark.parametrize(("world", "shape"), CASES, ids=NAMES)
def test_all_fronts_look_towards_the_point(world, shape):
    make, point = {"flatland": flatland, "space": space}[world].primitive, POINT[world]
    assert (heights(world, shape, point) < 0.0).any()
    made = make(shape, emission=1.0, facing=point).shape
    assert (heights(world, made, point) > 0.0).all()
    np.testing.assert_allclose(abs(heights(world, made, point)), abs(heights(world, shape, point)))
    again = make(made, facing=point).shape
    jax.tree.map(np.testing.assert_array_equal, again, made)
    traced = jax.jit(lambda p: make(shape, facing=p).shape)(jnp.asarray(point))
    jax.tree.map(lambda a, b: np.testing.assert_allclose(a, b, rtol=0.0, atol=1e-15), traced, made)


@pytest.mark.parametrize("name", SPACE)
def test_a_turned_shape_covers_what_it_did(name):
    shape = SPACE[name]
    made = space.primitive(shape, facing=POINT["space"]).shape
    eye = jnp.array([0.1, 0.2, -0.3])
    ways = jax.random.normal(jax.random.key(0), (64, 3)) + jnp.array([0.0, 0.0, 2.0])
    ways = ways / jnp.linalg.norm(ways, axis=1, keepdims=True)
    old, new = (
        jax.vmap(lambda w, s=s: jax.tree.map(lambda a: a[0], s).distance(eye, w, False))(ways)
        for s in (shape, made)
    )
    assert np.isfinite(old).any()
    np.testing.assert_allclose(new, old, rtol=1e-12)


@pytest.mark.filterwarnings("ignore::firstorder.errors.NoLight")  # one lamp shows its back
def test_light_comes_from_the_front_that_was_turned():
    segment = flatland.Segments((-0.5, 1.0), (0.5, 1.0))
    at = flatland.Receiver.at((0.0, 0.0))
    dark, lit, both = (
        flatland.irradiance(
            flatland.Scene.of(flatland.primitive(segment, emission=1.0, **how)), at
        ).item()
        for how in ({}, {"facing": at.position}, {"two_sided": True})
    )
    assert dark == 0.0
    assert lit == pytest.approx(both, rel=1e-14)
    assert lit > 0.5


REFUSED = {
    "closed": (
        lambda: flatland.primitive(flatland.Circles((0.0, 1.0), 0.5), facing=(0.0, 0.0)),
        "must be left out for Circles, whose front is their outside: `two_sided=True` lets",
    ),
    "closed in space": (
        lambda: space.primitive(space.sphere((0.0, 0.0, 1.0), 0.5), facing=(0.0, 0.0, 0.0)),
        "must be left out for Ellipsoids, whose front is their outside",
    ),
    "in its plane": (
        lambda: flatland.primitive(flatland.Segments((0.0, 0.0), (1.0, 0.0)), facing=(3.0, 0.0)),
        "must lie on one side of every shape, but lies in the plane of shape 0",
    ),
    "another world": (
        lambda: space.primitive(SPACE["disc"], facing=(0.0, 0.0)),
        r"must have shape \(3,\), but has \(2,\)",
    ),
}


@pytest.mark.parametrize("name", REFUSED)
def test_what_has_no_such_side_is_refused(name):
    make, words = REFUSED[name]
    with pytest.raises(ValueError, match=f"^Argument `facing` {words}"):
        make()


def test_a_traced_point_in_the_plane_is_nan():
    segment = flatland.Segments((0.0, 0.0), (1.0, 0.0))
    make = jax.jit(lambda p: flatland.primitive(segment, facing=p).shape.start)
    assert np.isnan(make(jnp.array([3.0, 0.0]))).all()
    assert make(jnp.array([3.0, 1.0])).tolist() == [[0.0, 0.0]]
