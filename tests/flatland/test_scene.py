import jax
import jax.numpy as jnp
import numpy as np
import pytest

from firstorder.flatland import (
    Arcs,
    Circles,
    ConstantSky,
    Ellipses,
    PointLights,
    Receiver,
    Scene,
    Segments,
    closed_curve,
    irradiance,
    primitive,
)
from tests.flatland.worlds import bean, everything


def test_shapes_are_numbered_by_kind_and_found_by_name():
    scene = everything()
    assert scene.names == ("floor", "lamp", "arc", "circle", "ellipse", "bean")
    assert scene.named("bean") == (5,)
    with pytest.raises(ValueError, match=r"must be one of arc, bean, .* but is 'moon'"):
        scene.named("moon")


def test_materials_follow_their_shapes():
    scene = everything()
    assert scene.material.emission[scene.named("lamp")[0]].tolist() == [1.0, 0.0]
    assert scene.material.emission[scene.named("circle")[0], 0] == 0.7
    assert scene.material.albedo[0].tolist() == [0.5, 0.5]


def test_the_frame_of_a_floor_is_the_local_frame():
    at = everything().frame(0, 0.5)
    assert at.tangent.tolist() == [1.0, 0.0]
    assert at.normal.tolist() == [0.0, 1.0]
    assert (at.n, at.speed, at.kappa) == (0.0, 6.0, 0.0)


def test_a_hill_curves_down_and_a_valley_up():
    scene = Scene.of(
        primitive(Circles((0.0, 0.0), 0.5)), primitive(Arcs((0.0, 0.0), 2.0, 0.5 * np.pi, np.pi))
    )
    hill, valley = scene.frame(1, 0.2).kappa, scene.frame(0, 0.2).kappa
    assert abs(hill + 2.0) < 1e-12
    assert abs(valley - 0.5) < 1e-12


def test_lengths():
    scene = Scene.of(
        primitive(Segments((0.0, 0.0), (3.0, 4.0))), primitive(Circles((0.0, 0.0), 0.5))
    )
    assert abs(scene.length(0) - 5.0) < 1e-12
    assert abs(scene.length(1) - np.pi) < 1e-12


def test_a_scene_can_be_built_inside_a_gradient():
    def height(y):
        scene = Scene.of(primitive(Segments((-1.0, y), (1.0, y))))
        return scene.hit(jnp.array(0), jnp.zeros(2), jnp.array([0.0, 1.0]))[0]

    assert jax.jit(jax.grad(height))(2.0) == 1.0


def test_a_traced_radius_that_is_none_gives_nan():
    @jax.jit
    def E(radius):
        scene = Scene.of(
            primitive(Segments((1.0, 2.0), (-1.0, 2.0)), emission=1.0),
            primitive(Circles((0.2, 1.0), radius)),
            primitive(Ellipses((-0.6, 1.0), (0.2, 0.1))),  # which is one
        )
        return irradiance(scene, Receiver((0.0, 0.0), 0.0))

    assert jnp.isfinite(E(0.3))
    assert jnp.isnan(E(-0.3))


def test_curves_of_different_lengths_share_a_group():
    a = 2.0 * np.pi * np.arange(64) / 64
    other = closed_curve(np.stack([np.cos(a), np.sin(a)], -1), 2)
    scene = Scene.of(primitive(bean(4.0)), primitive(other))
    assert scene.count == 2
    assert abs(scene.frame(1, 0.3).kappa + 1.0) < 1e-12


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: Scene.of(), "`things` must hold at least one"),
        (
            lambda: primitive(Circles((0.0, 0.0), 1.0), emission=-1.0),
            "`emission` must not be negative",
        ),
        (
            lambda: primitive(Circles((0.0, 0.0), 1.0), albedo=0.7, mirror=0.5),
            "add up to at most 1",
        ),
        (lambda: PointLights((0.0, 0.0), -2.0), "`intensity` must not be negative"),
        (lambda: PointLights([(0.0, 0.0), (1.0, 0.0)], 1.0), "`intensity` must hold 2 lights"),
    ],
)
def test_bad_scenes_are_refused_in_one_sentence(make, words):
    with pytest.raises(ValueError, match=words):
        make()


@pytest.mark.parametrize(
    "given",
    [{"points": (0.0, 1.0)}, {"crossings": 3}, {"environment": ConstantSky}],
    ids=["points", "crossings", "a class"],
)
def test_other_kinds_of_things_in_a_scene_are_refused_in_one_sentence(given):
    """With the import hook it is beartype that says it."""
    (name,) = given
    ours = f"^Argument `{name}` must be a .*, but is "
    with pytest.raises(TypeError, match=rf"{ours}|parameter {name}="):
        Scene.of(primitive(Circles((0.0, 0.0), 1.0)), **given)


def test_a_frame_is_that_of_one_point_of_one_shape():
    """Two parameters would be taken for one of each coordinate."""
    scene = everything()
    with pytest.raises(ValueError, match="`s` must be one number"):
        scene.frame(0, np.array([0.1, 0.9]))
    with pytest.raises(ValueError, match="`index` must be one number"):
        scene.length(np.array([0, 1]))
