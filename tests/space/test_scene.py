"""Scenes: numbering, materials, the sky, what is refused."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from firstorder.space import Scene, box, plane, primitive, rectangle, sphere


def room():
    return Scene.of(
        primitive(rectangle((0, 0, 2), (0, 1, 0), (1, 0, 0)), name="lamp", emission=(2.0, 0.5)),
        primitive(sphere((0, 0, 1), 0.5), name="ball", albedo=0.25),
        primitive(plane((0, 0, 0), (0, 0, 1)), name="floor", albedo=(0.5, 0.1)),
        primitive(sphere((3, 0, 1), 0.5), name="ball"),
        environment=lambda w: 1.0 + w[2],
    )


def test_shapes_are_numbered_kind_by_kind():
    scene = room()
    assert scene.count == 4
    assert scene.named("ball") == (0, 1)
    assert scene.named("lamp") == (2,)
    np.testing.assert_allclose(scene.material.albedo[jnp.array([0, 3])], [[0.25, 0.25], [0.5, 0.1]])


def test_a_side_shows_its_own_light():
    scene, (lamp,) = room(), room().named("lamp")
    point = jnp.array([0.0, 0.0, 2.0])
    up = jnp.array([0.0, 0.0, 1.0])
    assert scene.emitted(lamp, point, up) == 2.0  # it looks down
    assert scene.emitted(lamp, point, -up) == 0.5
    assert scene.sky(up) == 2.0


def test_one_hit_point_normal_and_distance():
    point, normal, t = room().surface(0, jnp.array([0.0, 0.0, 0.1]), jnp.array([0.0, 0.0, 1.0]))
    np.testing.assert_allclose(point, [0.0, 0.0, 0.5])
    np.testing.assert_allclose(normal, [0.0, 0.0, -1.0])
    np.testing.assert_allclose(t, 0.4)


def test_inside_and_on():
    scene = room()
    assert bool(scene.inside(jnp.array([0.1, 0.0, 1.0])))
    assert not bool(scene.inside(jnp.array([0.1, 0.0, 1.0]), on=0))
    assert not bool(scene.inside(jnp.array([0.0, 0.0, 0.4])))


def test_a_scene_can_be_made_inside_a_traced_function():
    def light(emission, height):
        scene = Scene.of(primitive(sphere((0.0, 0.0, height), 0.5), emission=emission))
        origin, up = jnp.zeros(3), jnp.array([0.0, 0.0, 1.0])
        return scene.emitted(0, origin, up) * scene.distance(0, origin, up)

    slopes = jax.jit(jax.grad(light, (0, 1)))(3.0, 2.0)
    np.testing.assert_allclose(slopes, (1.5, 3.0))


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (
            lambda: Scene.of(),
            "Argument `things` must hold at least one shape, but is empty: for an open sky alone "
            "let it be a floor, which hides nothing of the sky above it.",
        ),
        (
            lambda: primitive(box((0, 0, 0), (1, 1, 1)), albedo=0.8, specular=0.4),
            "Arguments `albedo` and `specular` must add up to at most 1, but add up to 1.2.",
        ),
        (
            lambda: primitive(box((0, 0, 0), (1, 1, 1)), emission=-1.0),
            "Argument `emission` must not be negative, but is -1.0.",
        ),
        (
            lambda: room().named("wall"),
            "Argument `name` must be one of ball, floor, lamp, but is 'wall'.",
        ),
        (
            lambda: Scene.of(primitive(sphere((0, 0, 0), 1.0)), environment=-1.0),
            "Argument `environment` must not be negative, but is -1.0.",
        ),
    ],
)
def test_bad_scenes_are_refused_in_one_sentence(make, words):
    with pytest.raises(ValueError, match="Argument") as found:
        make()
    assert str(found.value) == words


def test_the_old_name_of_the_environment_is_answered_with_the_new_one():
    with pytest.raises(TypeError) as found:
        Scene.of(primitive(sphere((0.0, 0.0, 0.0), 1.0)), sky=1.0)
    assert str(found.value) == "Argument `sky` is called `environment`."


def test_a_traced_negative_environment_gives_nan():
    ball = primitive(sphere((0.0, 0.0, 2.0), 0.5))
    assert np.isnan(jax.jit(lambda L: Scene.of(ball, environment=L).environment)(-1.0))
